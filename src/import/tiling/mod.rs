//! A large OBJ as tiles: parts of its ground that are read one at a time, so that no more than one of them
//! need be in memory.
//!
//! The file is read three times. For its vertices alone: where they are says where the ground is divided
//! (`division`). For what its faces join: small bodies stay whole (`bodies`). Then its faces go to the tile in which
//! they are, those that are in several are cut along the planes between them, and each tile's text goes to
//! a file on disk (`tile_text`) whose parts are read like files of their own. Its vertices are on disk
//! meanwhile (`spilled`). These files have no names: they are gone however the program ends.
//!
//! Tiles depend on the file alone, not on memory.

mod bodies;
mod disk_vec;
mod division;
mod tile_text;

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use self::bodies::Bodies;
use self::disk_vec::DiskVec;
use self::division::{Counts, Division};
use self::tile_text::{Belongs, FaceCorner, NONE, Names, TileReader, TileText};
use super::clean::CleanStats;
use super::find::{Kind, kind};
use super::names::NameSample;
use super::obj::chunks::Chunks;
use super::obj::colors::{ColorRange, WHITE};
use super::obj::index_faults::IndexFaults;
use super::obj::statements::{Change, MOST_VERTICES, Statements};
use super::obj::{Batch, CHUNK_BYTES, FileTraits, Parsed, load_part};
use super::plain_text::PlainText;
use crate::bytes::Bytes;
use crate::mesh::{Model, Normal, Triangulator, UpAxis, UpEvidence, UpGuess, Warnings};
use crate::stage_timer::StageTimer;
use crate::{Error, Result};

/// Vertices of a tile, at most: about 200,000 triangles, which take 15 MB as text and as much again in memory
/// while they are built.
pub const TILE_VERTICES: u64 = 1 << 17;

/// Files of fewer bytes are read whole: they have about as many vertices as a tile.
pub const TILE_BYTES: u64 = 16 << 20;

/// Bodies stay whole that are no wider than this part of a tile,
const SMALL: f64 = 0.125;

/// and have no more than this part of its vertices.
const FEW: u64 = 32;

/// Bytes on disk that tiles and vertices take, over those of the file.
const DISK: f64 = 1.5;

/// Corners of a tile's faces that are written at once.
const PENDING: usize = 6000;

/// Corners of faces that wait for this in all tiles together.
const MOST_PENDING: usize = 1 << 20;

/// A file in tiles.
pub struct Tiling {
    source: PathBuf,
    file: Arc<File>,
    tiles: Vec<TileText>,
    up: UpAxis,
    traits: FileTraits,
    warnings: Warnings,
}

impl std::fmt::Debug for Tiling {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{} tiles of {}", self.tiles.len(), self.source.display())
    }
}

/// The two axes along the ground.
fn ground(up: UpAxis) -> [usize; 2] {
    match up {
        UpAxis::Y => [0, 2],
        UpAxis::Z => [0, 1],
    }
}

/// Whether a file is divided: an OBJ that is large.
pub fn is_divided(path: &Path) -> bool {
    kind(path) == Some(Kind::Obj)
        && std::fs::metadata(path).is_ok_and(|facts| facts.len() > TILE_BYTES)
}

impl Tiling {
    /// Divides the OBJ at `path`, of [`bounds`](super::bounds), into tiles of `vertices` at most, with files in
    /// `dir` while it lasts. Where `up` is `None` its shape says which axis is up.
    pub fn of(
        path: &Path,
        bounds: [[f64; 3]; 2],
        up: Option<UpAxis>,
        vertices: u64,
        dir: &Path,
    ) -> Result<Self> {
        check_space(path, dir)?;
        let unwritable = |error: io::Error| {
            Error::output(dir, format!("tiles of {} cannot be written: {error}", path.display()))
        };
        let evidence = up.is_none().then(|| UpEvidence::new(bounds));
        let mut tiler = Tiler::new(path, dir, evidence).map_err(unwritable)?;
        let fault = |fault| match fault {
            Fault::Text(what) => Error::input(path, what),
            Fault::Disk(error) => unwritable(error),
        };
        each_chunk(path, |chunk| tiler.join(chunk).map_err(fault))?;
        let shape = tiler.evidence.take().map(|evidence| evidence.guess());
        let up = up.map(UpGuess::known).or(shape).unwrap_or(UpGuess::known(UpAxis::Z));
        up.warn(&mut tiler.warnings);
        let up = up.axis;
        tiler.divide(bounds, up, vertices).map_err(unwritable)?;
        let axes = ground(up);
        let side = axes.map(|axis| bounds[1][axis] - bounds[0][axis]);
        let width = (side[0] * side[1] / tiler.division.tiles as f64).sqrt() * SMALL;
        tiler.settle(axes, width, (vertices / FEW) as u32).map_err(unwritable)?;
        each_chunk(path, |chunk| tiler.add(chunk).map_err(fault))?;
        let tiling = tiler.finish(up).map_err(unwritable)?;
        match tiling.tiles.is_empty() {
            true if !tiling.warnings.is_empty() => {
                let what = format!("no face is left: {}", super::listed(&tiling.warnings));
                Err(Error::input(path, what))
            }
            true => Err(Error::input(path, "no face; expected at least one")),
            false => Ok(tiling),
        }
    }

    /// The axis that points at the sky.
    pub fn up(&self) -> UpAxis {
        self.up
    }

    /// How many tiles there are.
    pub fn tiles(&self) -> usize {
        self.tiles.len()
    }

    /// Least and greatest coordinates of a tile's vertices.
    pub fn bounds(&self, tile: usize) -> [[f64; 3]; 2] {
        self.tiles[tile].bounds.unwrap_or_default()
    }

    /// Bytes of a tile's text.
    pub fn bytes(&self, tile: usize) -> u64 {
        self.tiles[tile].pieces.iter().map(|&(_, length)| u64::from(length)).sum()
    }

    /// Reads a tile. What was imperfect in all of the file is told with the first.
    pub fn load(&self, tile: usize) -> Result<Model> {
        let pieces = self.tiles[tile].pieces.iter();
        let reader = TileReader { file: Arc::clone(&self.file), pieces, piece: (0, 0) };
        let mut model = load_part(&self.source, reader, self.traits.clone())?;
        if tile == 0 {
            model.warnings.extend(self.warnings.clone());
        }
        Ok(model)
    }
}

/// Goes through a file, chunk by chunk.
fn each_chunk(path: &Path, mut add: impl FnMut(Parsed) -> Result<()> + Send) -> Result<()> {
    let PlainText { head, rest } = super::open_text(path)?;
    let mut chunks = Chunks::new(head, rest, CHUNK_BYTES);
    let timer = StageTimer::current();
    let mut batch = Batch::parse(&mut chunks);
    loop {
        let Batch { parsed, ended } = batch;
        if parsed.is_empty() {
            return ended.map_err(|error| Error::input(path, format!("cannot be read: {error}")));
        }
        let (added, next) = rayon::join(
            || timer.time(|| parsed.into_iter().try_for_each(&mut add)),
            || timer.time(|| Batch::parse(&mut chunks)),
        );
        added?;
        batch = next;
        if batch.parsed.is_empty() && ended.is_err() {
            batch.ended = ended;
        }
    }
}

/// Refuses to begin where the disk has no room for what will be written.
fn check_space(path: &Path, dir: &Path) -> Result<()> {
    let bytes = std::fs::metadata(path).map_or(0, |facts| facts.len());
    let needed = (bytes as f64 * DISK) as u64;
    if let Some(free) = free_bytes(dir).filter(|free| *free < needed) {
        return Err(Error::output(
            dir,
            format!(
                "{} of disk are needed while {} is divided, found {}; free some, or choose an \
                 output on another disk",
                Bytes::megabytes(needed),
                path.display(),
                Bytes::megabytes(free)
            ),
        ));
    }
    Ok(())
}

/// The bytes that may still be written to the disk of a folder; `None` if the system does not say.
#[cfg(unix)]
fn free_bytes(folder: &Path) -> Option<u64> {
    let disk = rustix::fs::statvfs(folder).ok()?;
    Some(disk.f_bavail.saturating_mul(disk.f_frsize))
}

#[cfg(not(unix))]
fn free_bytes(_folder: &Path) -> Option<u64> {
    None
}

/// Why a file cannot be divided.
enum Fault {
    /// What is wrong with its text.
    Text(String),
    Disk(io::Error),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Disk(error)
    }
}

/// The state of dividing a file.
struct Tiler<'a> {
    path: &'a Path,
    /// Which axis is up, where that is to be found out.
    evidence: Option<UpEvidence>,
    division: Division,
    file: File,
    end: u64,
    tiles: Vec<TileText>,
    /// Corners that wait in a tile until they are written.
    pending: usize,
    positions: DiskVec<[f64; 3]>,
    /// How many of them stand before what is being added.
    placed: usize,
    bodies: Bodies,
    texcoords: DiskVec<[f64; 2]>,
    normals: DiskVec<Normal>,
    /// One per position where a vertex has a colour; linear light.
    colors: DiskVec<[u16; 4]>,
    color_range: ColorRange,
    /// Names that faces belong to.
    sample: NameSample,
    traits: FileTraits,
    names: Names,
    belongs: Belongs,
    triangulator: Triangulator,
    stats: CleanStats,
    index_faults: IndexFaults,
    warnings: Warnings,
    lines: u64,
}

impl<'a> Tiler<'a> {
    fn new(path: &'a Path, dir: &Path, evidence: Option<UpEvidence>) -> io::Result<Self> {
        Ok(Self {
            path,
            evidence,
            division: Division::default(),
            file: tempfile::tempfile_in(dir)?,
            end: 0,
            tiles: Vec::new(),
            pending: PENDING,
            positions: DiskVec::new(dir)?,
            placed: 0,
            bodies: Bodies::default(),
            texcoords: DiskVec::new(dir)?,
            normals: DiskVec::new(dir)?,
            colors: DiskVec::new(dir)?,
            color_range: ColorRange::default(),
            sample: NameSample::default(),
            traits: FileTraits::default(),
            names: Names::default(),
            belongs: Belongs::default(),
            triangulator: Triangulator::default(),
            stats: CleanStats::default(),
            index_faults: IndexFaults::default(),
            warnings: Warnings::default(),
            lines: 0,
        })
    }

    /// Joins what the faces of the next chunk have in common, and keeps its vertices.
    fn join(&mut self, Parsed { text, statements: mut chunk }: Parsed) -> Result<(), Fault> {
        // Texture coordinates and normals do not matter here.
        let before = self.positions.len();
        chunk.settle(&text, [before, MOST_VERTICES, MOST_VERTICES]);
        self.traits.has_colors |= !chunk.colors.values.is_empty();
        self.color_range = self.color_range.joined(chunk.colors.range);
        chunk.changes.iter().for_each(|(_, change)| self.sample.add(change.name()));
        self.positions.extend(std::mem::take(&mut chunk.positions))?;
        self.bodies.grow(self.positions.len());
        self.bodies.join_faces(&chunk, before);
        if let Some(evidence) = &mut self.evidence {
            let mut first = 0;
            let mut outline = Vec::new();
            for &count in &chunk.faces {
                outline.clear();
                for [position, ..] in &chunk.corners[first..first + count as usize] {
                    let position = position.resolve(before).map_or(usize::MAX, |at| at as usize);
                    outline.extend(self.positions.get(position)?);
                }
                evidence.add(&outline);
                first += count as usize;
            }
        }
        Ok(())
    }

    /// Once all vertices are known: where the ground is divided into tiles of so many.
    fn divide(&mut self, bounds: [[f64; 3]; 2], up: UpAxis, vertices: u64) -> io::Result<()> {
        let mut counts = Counts::new(bounds, up);
        for index in 0..self.positions.len() {
            if let Some(position) = self.positions.get(index)?
                && position.iter().all(|coordinate| coordinate.is_finite())
            {
                counts.add(position);
            }
        }
        self.division = Division::of(&counts, vertices);
        self.tiles.resize_with(self.division.tiles, TileText::default);
        self.pending = PENDING.min(MOST_PENDING / self.division.tiles);
        Ok(())
    }

    /// Once all faces are joined: small bodies stay whole.
    fn settle(&mut self, axes: [usize; 2], width: f64, vertices: u32) -> io::Result<()> {
        let Self { bodies, division, positions, .. } = self;
        let position = |vertex: usize| positions.get(vertex).map(Option::unwrap_or_default);
        bodies.settle(division, axes, (width, vertices), position)
    }

    /// Adds the next chunk.
    fn add(&mut self, Parsed { text, statements: mut chunk }: Parsed) -> Result<(), Fault> {
        let before = [self.placed, self.texcoords.len(), self.normals.len()];
        chunk.settle(&text, before);
        chunk.check(before, self.lines).map_err(Fault::Text)?;
        self.index_faults.add(&chunk.index_faults, self.lines);
        self.lines += chunk.lines;
        self.stats.add(&chunk.stats);
        if self.traits.has_colors {
            chunk.colors.settle(self.color_range);
            self.stats.colors_clamped += chunk.colors.clamped;
            let missing = chunk.positions.len() - chunk.colors.values.len();
            self.colors.extend(chunk.colors.values.drain(..))?;
            self.colors.extend(std::iter::repeat_n(WHITE, missing))?;
        }
        self.placed += chunk.positions.len();
        self.texcoords.extend(std::mem::take(&mut chunk.texcoords))?;
        self.normals.extend(std::mem::take(&mut chunk.normals))?;
        let (mut first, mut corner) = (0, 0);
        for (end, change) in std::mem::take(&mut chunk.changes) {
            self.faces(&chunk, first..end, &mut corner, before)?;
            first = end;
            match change {
                Change::Group(name) => {
                    self.names.groups.push(name);
                    self.belongs.group = self.names.groups.len();
                }
                Change::Material(name) => {
                    self.names.materials.push(name);
                    self.belongs.material = self.names.materials.len();
                }
                Change::Libraries(names) => self.names.libraries.push(names),
            }
        }
        self.faces(&chunk, first..chunk.faces.len(), &mut corner, before)
    }

    fn faces(
        &mut self,
        chunk: &Statements,
        faces: std::ops::Range<usize>,
        first: &mut usize,
        before: [usize; 3],
    ) -> Result<(), Fault> {
        let mut corners: Vec<FaceCorner> = Vec::new();
        let mut outline: Vec<[f64; 3]> = Vec::new();
        for &count in &chunk.faces[faces] {
            let references = &chunk.corners[*first..*first + count as usize];
            *first += count as usize;
            corners.clear();
            for [position, texcoord, normal] in references {
                let position = position.resolve(before[0]).unwrap_or(0);
                let texcoord = texcoord.resolve(before[1]);
                let normal = normal.resolve(before[2]);
                corners.push(FaceCorner {
                    at: self.positions.get(position as usize)?.unwrap_or_default(),
                    texcoord: match texcoord {
                        Some(texcoord) => self.texcoords.get(texcoord as usize)?,
                        None => None,
                    },
                    color: self.colors.get(position as usize)?,
                    normal: match normal {
                        Some(normal) => self.normals.get(normal as usize)?,
                        None => None,
                    },
                    source: Some([position, texcoord.unwrap_or(NONE), normal.unwrap_or(NONE)]),
                });
            }
            outline.clear();
            outline.extend(corners.iter().map(|corner| corner.at));
            if !outline.as_flattened().iter().all(|coordinate| coordinate.is_finite()) {
                self.stats.not_finite += u64::from(count) - 2;
                continue;
            }
            let first = corners.first().and_then(|corner| corner.source).map_or(0, |[at, ..]| at);
            let body = self.bodies.tile_of(first);
            if let Some(tile) = body.or_else(|| self.division.tile_of(&outline)) {
                self.tiles[tile].add(&corners, self.belongs);
                self.flush_full(tile)?;
                continue;
            }
            let triangles = match &corners[..] {
                [_, _, _] => vec![[0, 1, 2]],
                _ => self.triangulator.triangulate(&outline).to_vec(),
            };
            self.stats.flat_polygons += u64::from(triangles.is_empty());
            for triangle in triangles {
                let triangle = triangle.map(|corner| corners[corner as usize]).to_vec();
                let mut touched = Vec::new();
                let (tiles, belongs) = (&mut self.tiles, self.belongs);
                self.division.cut(triangle, &mut |tile, part| {
                    tiles[tile].add(part, belongs);
                    touched.push(tile);
                });
                touched.into_iter().try_for_each(|tile| self.flush_full(tile))?;
            }
        }
        Ok(())
    }

    fn flush_full(&mut self, tile: usize) -> io::Result<()> {
        let text = &mut self.tiles[tile];
        match text.pending() >= self.pending {
            true => text.flush(&self.names, &self.file, &mut self.end),
            false => Ok(()),
        }
    }

    fn finish(mut self, up: UpAxis) -> io::Result<Tiling> {
        for tile in &mut self.tiles {
            tile.flush(&self.names, &self.file, &mut self.end)?;
        }
        let mut warnings = self.warnings;
        self.index_faults.report(self.path, &mut warnings);
        self.color_range.report(self.path, &mut warnings);
        self.stats.report(self.path, &mut warnings);
        let mut tiles = self.tiles;
        tiles.retain(|tile| !tile.pieces.is_empty());
        self.traits.encoding = self.sample.guess();
        let source = self.path.to_path_buf();
        let file = Arc::new(self.file);
        Ok(Tiling { source, file, tiles, up, traits: self.traits, warnings })
    }
}

#[cfg(test)]
mod tests;
