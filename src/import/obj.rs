//! Wavefront OBJ.
//!
//! The file is read in batches of chunks. Threads parse the chunks of a batch each on its own
//! ([`statements`]); then the chunks are put in their order, which settles what their indices
//! mean and to which part their faces belong; threads make triangles of them ([`corners`]); and
//! in order again the triangles go into their parts. Meanwhile the next batch is parsed. The
//! model does not depend on where chunks end. Memory holds the file's vertices, which of them each
//! part has, and two batches; at the end vertices go to their parts, and what the file said of them
//! goes meanwhile.
//!
//! tobj is not used: it keeps about 100 bytes for each face of an object until the object ends and
//! hashes each corner, makes triangles of polylines, gives faces without texture coordinates those
//! of the face before, and cannot say in which line an error is.

pub(super) mod chunks;
pub(super) mod colors;
mod corners;
pub(super) mod index_faults;
pub(super) mod statements;

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

use encoding_rs::Encoding;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use self::chunks::Chunks;
use self::colors::{ColorRange, WHITE, make_linear};
use self::corners::{Run, Triangles};
use self::index_faults::IndexFaults;
use self::statements::{Change, MOST_VERTICES, Statements};
use super::clean::{CleanStats, clean};
use super::mtl::{FIRST_TILE, Library, MtlMaterial};
use super::names::{self, NameSample};
use super::page_uses::PageUses;
use super::paged_vec::PagedVec;
use super::paths::Finder;
use super::plain_text::PlainText;
use super::textures::{OpacityCache, Textures};
use super::vertices::{NONE, Numbered, VertexDeduplicator};
use super::words::Words;
use crate::mesh::{Group, Model, Normal, Part, SAME_NORMAL, Warnings};
use crate::stage_timer::StageTimer;
use crate::{Error, Result, side_file};

/// Text that one thread parses at a time: it and what is made of it should stay in the cache.
pub(super) const CHUNK_BYTES: usize = 1 << 18;

/// Chunks of a batch for each thread: enough to keep all busy when some take longer.
const CHUNKS_PER_THREAD: usize = 4;

/// Properties of a whole file, which a reader of a part of it must know.
#[derive(Clone, Default)]
pub(super) struct FileTraits {
    /// The likely encoding of names that are not UTF-8.
    pub(super) encoding: Option<&'static Encoding>,
    /// Some vertex has a colour.
    pub(super) has_colors: bool,
    /// Shared between the parts.
    pub(super) opacities: OpacityCache,
}

/// Reads the OBJ at `path` with its material libraries.
pub(super) fn load(path: &Path) -> Result<Model> {
    read(path, super::open_text(path)?, FileTraits::default(), CHUNK_BYTES)
}

/// Reads a part of the OBJ at `path`, whose text `reader` has, with line feeds alone.
pub(super) fn load_part(
    path: &Path,
    reader: impl Read + Send,
    traits: FileTraits,
) -> Result<Model> {
    let text = PlainText { head: Vec::new(), rest: Box::new(reader) };
    read(path, text, traits, CHUNK_BYTES)
}

/// Reads an OBJ of this text; the files that it names are looked for beside `path`.
fn read(path: &Path, text: PlainText, traits: FileTraits, chunk_bytes: usize) -> Result<Model> {
    let unreadable = |error| Error::input(path, format!("cannot be read: {error}"));
    let mut chunks = Chunks::new(text.head, text.rest, chunk_bytes);
    let mut obj = Obj::new(path, traits);
    let timer = StageTimer::current();
    let mut batch = Batch::parse(&mut chunks);
    loop {
        let Batch { parsed, ended } = batch;
        if parsed.is_empty() {
            ended.map_err(unreadable)?;
            return obj.finish();
        }
        let (added, next) = rayon::join(
            || timer.time(|| obj.add(parsed)),
            || timer.time(|| Batch::parse(&mut chunks)),
        );
        added.map_err(|what| Error::input(path, what))?;
        batch = next;
        if batch.parsed.is_empty() && ended.is_err() {
            batch.ended = ended;
        }
    }
}

/// A chunk's text, and what it says.
pub(super) struct Parsed {
    pub(super) text: Vec<u8>,
    pub(super) statements: Statements,
}

/// Chunks that are parsed at the same time.
pub(super) struct Batch {
    /// None at the end of the file.
    pub(super) parsed: Vec<Parsed>,
    /// Why reading ended behind them, where it failed.
    pub(super) ended: std::io::Result<()>,
}

impl Batch {
    pub(super) fn parse(chunks: &mut Chunks<impl Read>) -> Self {
        let mut texts = Vec::new();
        let mut read = || {
            while texts.len() < CHUNKS_PER_THREAD * rayon::current_num_threads() {
                match chunks.next()? {
                    Some(text) => texts.push(text),
                    None => break,
                }
            }
            Ok(())
        };
        let ended = read();
        let timer = StageTimer::current();
        let parse =
            |text: Vec<u8>| timer.time(|| Parsed { statements: Statements::of(&text), text });
        Self { parsed: texts.into_par_iter().map(parse).collect(), ended }
    }
}

/// A part in the making: its indices are numbers of the [`VertexDeduplicator`]'s vertices, and it has none yet.
#[derive(Default)]
struct PartState {
    part: Part,
    /// The normals of its corners; fewer where the last have none.
    normals: Vec<Normal>,
    /// Faces without texture coordinates.
    bare_faces: u64,
}

/// A material that a `usemtl` named.
struct UsedMaterial {
    /// As the file gives it.
    name: Vec<u8>,
    material: MtlMaterial,
    /// A library had defined it when it was first used.
    defined: bool,
}

/// The state of reading one file.
struct Obj<'a> {
    path: &'a Path,
    traits: FileTraits,
    /// Names that are not UTF-8.
    sample: NameSample,
    finder: Finder,
    dependencies: Vec<PathBuf>,
    warnings: Warnings,
    stats: CleanStats,
    index_faults: IndexFaults,

    library: Library,
    /// The files of libraries that were read.
    libraries: BTreeSet<PathBuf>,
    /// That of the first name of a library that is not UTF-8 and was found.
    library_encoding: Option<&'static Encoding>,
    textures: Textures,
    materials: Vec<UsedMaterial>,
    material_of_name: BTreeMap<Vec<u8>, u32>,
    /// The materials of UDIM tiles, by the material that has them and the tile's number.
    material_of_tile: BTreeMap<(u32, u32), u32>,
    /// Faces that no UDIM tile holds.
    faces_across_tiles: u64,
    /// What `usemtl` named last; `None` before the first.
    material: Option<u32>,

    positions: PagedVec<[f64; 3]>,
    /// Empty until a vertex has a colour, then one per position: as in [`colors::Colors`].
    colors: PagedVec<[u16; 4]>,
    color_range: ColorRange,
    texcoords: PagedVec<[f64; 2]>,
    normals: PagedVec<Normal>,

    /// The names of the groups, as the file gives them.
    groups: Vec<Vec<u8>>,
    /// What `o` or `g` named last.
    group_name: Vec<u8>,
    /// The group of that name once it has a face.
    group: Option<u32>,
    parts: Vec<PartState>,
    part_of: FxHashMap<(u32, u32), u32>,
    /// The part of the current group and material once it has a face.
    part: Option<u32>,

    unifier: VertexDeduplicator,
    /// Lines of the chunks so far.
    lines: u64,
}

/// The place of the faces of a chunk among the parts.
struct Placing {
    /// The first face without one.
    first: usize,
    /// A face, and the number of corners before it.
    corner_face: usize,
    corner: usize,
    /// The number of texture coordinates before the chunk.
    texcoords_before: usize,
}

/// A chunk in its place.
struct Placed {
    statements: Statements,
    runs: Vec<Run>,
    /// The numbers of positions, texture coordinates and normals before it.
    before: [usize; 3],
}

impl<'a> Obj<'a> {
    fn new(path: &'a Path, traits: FileTraits) -> Self {
        Self {
            path,
            sample: NameSample::default(),
            finder: Finder::new(path),
            dependencies: vec![path.to_path_buf()],
            warnings: Warnings::default(),
            stats: CleanStats::default(),
            index_faults: IndexFaults::default(),
            library: Library::default(),
            libraries: BTreeSet::new(),
            library_encoding: None,
            textures: Textures::new(traits.opacities.clone()),
            traits,
            materials: Vec::new(),
            material_of_name: BTreeMap::new(),
            material_of_tile: BTreeMap::new(),
            faces_across_tiles: 0,
            material: None,
            positions: PagedVec::default(),
            colors: PagedVec::default(),
            color_range: ColorRange::default(),
            texcoords: PagedVec::default(),
            normals: PagedVec::default(),
            groups: Vec::new(),
            group_name: super::stem(path).into_bytes(),
            group: None,
            parts: Vec::new(),
            part_of: FxHashMap::default(),
            part: None,
            unifier: VertexDeduplicator::default(),
            lines: 0,
        }
    }

    /// Adds the chunks that come next.
    fn add(&mut self, mut parsed: Vec<Parsed>) -> Result<(), String> {
        let mut before = self.counts();
        let chunk_starts: Vec<[usize; 3]> = parsed
            .iter()
            .map(
                |Parsed {
                     statements: Statements { positions, texcoords, normals, .. }, ..
                 }| {
                    let counts = [positions.len(), texcoords.len(), normals.len()];
                    let next = [0, 1, 2].map(|kind| before[kind] + counts[kind]);
                    std::mem::replace(&mut before, next)
                },
            )
            .collect();
        let timer = StageTimer::current();
        parsed.par_iter_mut().zip(chunk_starts).for_each(|(chunk, before)| {
            timer.time(|| chunk.statements.settle(&chunk.text, before));
        });
        let placed: Vec<Placed> =
            parsed.into_iter().map(|chunk| self.place(chunk)).collect::<Result<_, _>>()?;
        let positions = &self.positions;
        let triangles: Vec<Triangles> = placed
            .par_iter()
            .map(|Placed { statements, runs, before }| {
                timer.time(|| Triangles::of(statements, runs, *before, positions))
            })
            .collect();
        drop(placed);
        self.unifier.grow(self.positions.len());
        triangles.into_iter().try_for_each(|chunk| self.join(chunk))
    }

    /// The numbers of positions, texture coordinates and normals so far.
    fn counts(&self) -> [usize; 3] {
        [self.positions.len(), self.texcoords.len(), self.normals.len()]
    }

    /// Settles what a chunk's indices mean and to which parts its faces belong.
    fn place(&mut self, Parsed { statements: mut chunk, .. }: Parsed) -> Result<Placed, String> {
        let before = self.counts();
        chunk.check(before, self.lines)?;
        self.index_faults.add(&chunk.index_faults, self.lines);
        self.lines += chunk.lines;
        self.stats.add(&chunk.stats);
        self.add_colors(&mut chunk, before[0]);
        self.positions.extend(std::mem::take(&mut chunk.positions));
        self.texcoords.extend(std::mem::take(&mut chunk.texcoords));
        self.normals.extend(std::mem::take(&mut chunk.normals));
        let mut runs = Vec::with_capacity(chunk.changes.len() + 1);
        let mut placing =
            Placing { first: 0, corner_face: 0, corner: 0, texcoords_before: before[1] };
        for (end, change) in std::mem::take(&mut chunk.changes) {
            self.run(&chunk, end, &mut placing, &mut runs);
            self.sample.add(change.name());
            match change {
                Change::Group(name) => self.start_group(name),
                Change::Material(name) => self.use_material(&name),
                Change::Libraries(names) => self.read_libraries(&names),
            }
        }
        self.run(&chunk, chunk.faces.len(), &mut placing, &mut runs);
        Ok(Placed { statements: chunk, runs, before })
    }

    /// Takes over the colours of a chunk, before which there are so many positions. All become
    /// linear light where some are.
    fn add_colors(&mut self, chunk: &mut Statements, before: usize) {
        if self.colors.len() == 0 && chunk.colors.values.is_empty() {
            return;
        }
        let range = self.color_range.joined(chunk.colors.range);
        if range.has_fractions {
            chunk.colors.settle(range);
            if !self.color_range.has_fractions {
                self.stats.colors_clamped += make_linear(self.colors.iter_mut(), range);
            }
        }
        self.color_range = range;
        self.stats.colors_clamped += chunk.colors.clamped;
        let missing = before - self.colors.len();
        self.colors.extend(std::iter::repeat_n(WHITE, missing));
        let missing = chunk.positions.len() - chunk.colors.values.len();
        self.colors.extend(chunk.colors.values.drain(..));
        self.colors.extend(std::iter::repeat_n(WHITE, missing));
    }

    /// Appends the faces of a chunk up to this one, if there are any, to `runs`.
    fn run(&mut self, chunk: &Statements, end: usize, placing: &mut Placing, runs: &mut Vec<Run>) {
        let faces = std::mem::replace(&mut placing.first, end)..end;
        if faces.is_empty() {
            return;
        }
        let part = match self.part {
            Some(part) => part,
            None => self.start_part(),
        };
        let material = self.parts[part as usize].part.material;
        let used = &self.materials[material as usize];
        if used.material.is_tiled {
            self.tile_runs(chunk, faces, material, placing, runs);
            return;
        }
        // Texture coordinates stay with a material that may yet turn out to have a texture.
        let lit = used.material.material.texture.is_none();
        let textured = !lit || !used.defined;
        runs.push(Run { faces, part, textured, lit });
    }

    /// Appends faces of a material whose textures are UDIM tiles to `runs`: each is of the material
    /// of its tile.
    fn tile_runs(
        &mut self,
        chunk: &Statements,
        faces: Range<usize>,
        material: u32,
        placing: &mut Placing,
        runs: &mut Vec<Run>,
    ) {
        let corners_of = |faces: Range<usize>| -> usize {
            chunk.faces[faces].iter().map(|&count| count as usize).sum()
        };
        placing.corner += corners_of(placing.corner_face..faces.start);
        placing.corner_face = faces.end;
        let mut last: Option<(Option<u32>, u32)> = None;
        for face in faces {
            let count = chunk.faces[face] as usize;
            let corners = &chunk.corners[placing.corner..placing.corner + count];
            placing.corner += count;
            let texcoords = corners.iter().filter_map(|[_, texcoord, _]| {
                let texcoord = texcoord.resolve(placing.texcoords_before)?;
                self.texcoords.get(texcoord as usize).copied()
            });
            let base = &self.materials[material as usize].material;
            let tile = base.tile_of(texcoords);
            self.faces_across_tiles += u64::from(tile.as_ref().is_none_or(|tile| !tile.holds_face));
            let tile = tile.map(|tile| tile.number);
            let part = match last {
                Some((known, part)) if known == tile => {
                    if let Some(run) = runs.last_mut() {
                        run.faces.end = face + 1;
                    }
                    part
                }
                _ => {
                    let of_tile = tile.map_or(material, |tile| self.tile_material(material, tile));
                    let part = self.part_of(of_tile);
                    let textured =
                        self.materials[of_tile as usize].material.material.texture.is_some();
                    runs.push(Run { faces: face..face + 1, part, textured, lit: !textured });
                    part
                }
            };
            last = Some((tile, part));
        }
    }

    /// The material of a UDIM tile.
    fn tile_material(&mut self, material: u32, tile: u32) -> u32 {
        if let Some(known) = self.material_of_tile.get(&(material, tile)) {
            return *known;
        }
        let name = self.materials[material as usize].name.clone();
        let made = self.library.tile(
            &name,
            tile,
            self.path,
            &mut self.finder,
            &mut self.textures,
            &mut self.warnings,
        );
        let index = self.materials.len() as u32;
        let material_of_tile = made.unwrap_or_else(|| MtlMaterial::plain(""));
        self.materials.push(UsedMaterial { name, material: material_of_tile, defined: true });
        self.material_of_tile.insert((material, tile), index);
        index
    }

    /// Moves a chunk's triangles into their parts.
    fn join(&mut self, chunk: Triangles) -> Result<(), String> {
        if self.unifier.len() + chunk.vertices.len() >= MOST_VERTICES {
            return Err(format!("more than {MOST_VERTICES} distinct vertices; divide the file"));
        }
        self.stats.add(&chunk.stats);
        let number = |pair| self.unifier.vertex(pair);
        let vertices: Vec<u32> = chunk.vertices.into_iter().map(number).collect();
        let mut first = 0;
        for (part, end, bare_faces) in chunk.runs {
            let state = &mut self.parts[part as usize];
            state.bare_faces += bare_faces;
            let indices = &chunk.indices[first..end];
            let normals = chunk.normals.get(first..end).unwrap_or(&[]);
            if normals.iter().any(|&normal| normal != NONE) {
                state.normals.resize(state.part.indices.len(), Normal::NONE);
                let normal = |&number: &u32| self.normals.get(number as usize).copied();
                let known = normals.iter().map(normal);
                let nowhere = known.clone().filter(|normal| *normal == Some(Normal::NONE));
                self.stats.normals_dropped += nowhere.count() as u64;
                state.normals.extend(known.map(Option::unwrap_or_default));
            }
            state.part.indices.extend(indices.iter().map(|&index| vertices[index as usize]));
            first = end;
        }
        Ok(())
    }

    /// A name that comes again right away goes on with its group; after another it is a new one.
    fn start_group(&mut self, name: Vec<u8>) {
        let name = if name.is_empty() { super::stem(self.path).into_bytes() } else { name };
        if name != self.group_name {
            self.group_name = name;
            self.group = None;
            self.part = None;
        }
    }

    fn use_material(&mut self, name: &[u8]) {
        let material = match self.material_of_name.get(name) {
            Some(material) => *material,
            None => self.new_material(name),
        };
        if self.material != Some(material) {
            self.material = Some(material);
            self.part = None;
        }
    }

    fn new_material(&mut self, name: &[u8]) -> u32 {
        let made = self.library.material(
            name,
            self.path,
            &mut self.finder,
            &mut self.textures,
            &mut self.warnings,
        );
        let index = self.materials.len() as u32;
        self.materials.push(UsedMaterial {
            name: name.to_vec(),
            defined: made.is_some(),
            material: made.unwrap_or_else(|| MtlMaterial::plain("")),
        });
        self.material_of_name.insert(name.to_vec(), index);
        index
    }

    /// The part of the current group and material.
    fn start_part(&mut self) -> u32 {
        let material = match self.material {
            Some(material) => material,
            None => {
                // Faces before the first usemtl; the name cannot be one that a file gives.
                let index = self.materials.len() as u32;
                let (name, material) = (Vec::new(), MtlMaterial::plain(""));
                self.materials.push(UsedMaterial { name, material, defined: true });
                *self.material.insert(index)
            }
        };
        let part = self.part_of(material);
        self.part = Some(part);
        part
    }

    /// The part of the current group and a material; group and part are made where they are new.
    fn part_of(&mut self, material: u32) -> u32 {
        let group = *self.group.get_or_insert_with(|| {
            self.groups.push(self.group_name.clone());
            self.groups.len() as u32 - 1
        });
        let parts = &mut self.parts;
        *self.part_of.entry((group, material)).or_insert_with(|| {
            let part = Part { group, material, ..Part::default() };
            parts.push(PartState { part, ..PartState::default() });
            parts.len() as u32 - 1
        })
    }

    /// `mtllib` names one file or several. Any of them may have spaces, and a comment may follow.
    fn read_libraries(&mut self, names: &[u8]) {
        let words = Words::of(names);
        let mut missing: Option<Range<usize>> = None;
        let mut at = 0;
        while at < words.len() {
            let Some((end, file)) = self.longest_library(&words, at) else {
                if words.run(at..at + 1).starts_with(b"#") && at > 0 {
                    break;
                }
                let from = missing.take().map_or(at, |missing| missing.start);
                at += 1;
                missing = Some(from..at);
                if is_library(words.run(at - 1..at)) {
                    self.miss_library(&words, missing.take());
                }
                continue;
            };
            self.miss_library(&words, missing.take());
            self.library_encoding = self.library_encoding.or(self.finder.encoding());
            at = end;
            if self.libraries.contains(&file) {
                continue;
            }
            self.dependencies.push(file.clone());
            match side_file::read(&file, side_file::MOST_LIBRARY_BYTES) {
                Ok(bytes) => {
                    self.library.add(&bytes, self.library_encoding);
                    self.libraries.insert(file);
                }
                Err(error) => self.warn_of_library(
                    file.as_os_str().as_encoded_bytes(),
                    &format!("cannot be read: {error}"),
                ),
            }
        }
        self.miss_library(&words, missing);
    }

    /// The library that the words from `at` on name, and the word behind its name. As they are
    /// written they may be any words; otherwise they end with the first that ends in `.mtl`.
    fn longest_library(&mut self, words: &Words, at: usize) -> Option<(usize, PathBuf)> {
        let written = words.longest_file(at, words.len(), |name| self.finder.as_written(name));
        written.or_else(|| {
            let mut ends = at + 1..words.len();
            let end = ends.find(|end| is_library(words.run(end - 1..*end)));
            let last = end.unwrap_or(words.len());
            words.longest_file(at, last, |name| self.finder.existing(name))
        })
    }

    fn miss_library(&mut self, words: &Words, missing: Option<Range<usize>>) {
        let Some(missing) = missing else { return };
        let name = words.run(missing);
        self.finder.find(name);
        let why = self.finder.why_missing(name);
        self.warn_of_library(name, &why);
    }

    fn warn_of_library(&mut self, name: &[u8], problem: &str) {
        let name = names::display(name, self.encoding());
        let what = format!("{}: material library {name} {problem}", self.path.display());
        self.warnings.add(what, 1);
    }

    /// The likely encoding of names that are not UTF-8.
    fn encoding(&self) -> Option<&'static Encoding> {
        self.library_encoding.or(self.traits.encoding).or_else(|| self.sample.guess())
    }

    /// Libraries may come after the faces that use them; what none defines is plain: white where
    /// vertices have colours, grey elsewhere.
    fn resolve_materials(&mut self) {
        let has_colors = self.traits.has_colors || self.colors.len() > 0;
        let plain_color = if has_colors { "white" } else { "grey" };
        let undefined: Vec<u32> = std::mem::take(&mut self.material_of_name)
            .into_values()
            .filter(|index| !self.materials[*index as usize].defined)
            .collect();
        let encoding = self.encoding();
        let file = self.path.display();
        let mut is_plain = vec![false; self.materials.len()];
        for index in undefined {
            let used = &mut self.materials[index as usize];
            let mut made = self.library.material(
                &used.name,
                self.path,
                &mut self.finder,
                &mut self.textures,
                &mut self.warnings,
            );
            if made.as_ref().is_some_and(|made| made.is_tiled) {
                let what = "material that is used before its library: of UDIM tiles 1001 alone";
                self.warnings.add(format!("{file}: {what}"), 1);
                made = self.library.tile(
                    &used.name,
                    FIRST_TILE,
                    self.path,
                    &mut self.finder,
                    &mut self.textures,
                    &mut self.warnings,
                );
            }
            match made {
                Some(made) => used.material = made,
                None => {
                    let name = names::display(&used.name, encoding);
                    let what = match self.libraries.is_empty() {
                        true => "usemtl without a material library".to_owned(),
                        false => format!("material {name} is in no library"),
                    };
                    self.warnings.add(format!("{file}: {what}, taken as plain {plain_color}"), 1);
                    used.material.material.name = name;
                }
            }
            is_plain[index as usize] = used.material.material.texture.is_none();
        }
        for state in self.parts.iter_mut().filter(|state| is_plain[state.part.material as usize]) {
            state.bare_faces = 0;
        }
        self.warn_of_redefinitions();
        if has_colors {
            for used in self.materials.iter_mut().filter(|used| !used.material.has_color) {
                let [color @ .., _] = &mut used.material.material.base_color;
                *color = [1.0; 3];
            }
        }
    }

    /// Warns where libraries define a material that is used again, and otherwise.
    fn warn_of_redefinitions(&mut self) {
        let names = self.library.redefined(self.materials.iter().map(|used| &used.name[..]));
        let Some(first) = names.first() else { return };
        let what = format!(
            "{}: material defined again with other statements, the first definition counts (first: {})",
            self.path.display(),
            names::display(first, self.encoding())
        );
        self.warnings.add(what, names.len() as u64);
    }

    /// Makes linear light of all colours.
    fn settle_colors(&mut self) {
        if !self.color_range.has_fractions {
            let colors = self.colors.iter_mut();
            self.stats.colors_clamped += make_linear(colors, self.color_range);
        }
        self.color_range.report(self.path, &mut self.warnings);
        let what =
            "face in no single UDIM tile, textured by the tile of its middle if there is one";
        self.warnings.add(format!("{}: {what}", self.path.display()), self.faces_across_tiles);
    }

    /// Gives the parts their vertices. What the file says of these is as large as the parts are, and
    /// goes as soon as no vertex to come uses it.
    fn fill_parts(&mut self, mut vertices: Numbered) {
        let is_white = self.colors.iter().all(|color| *color == WHITE);
        let mut uses = PageUses::of(vertices.pairs());
        let counts = vertices.counts.clone();
        let mut repeats: Vec<Option<[f64; 2]>> = vec![None; self.parts.len()];
        for vertex in 0..vertices.len() {
            let Some(pair) = vertices.take(vertex) else { continue };
            let (number, position) = (pair.part as usize, pair.position as usize);
            let part = &mut self.parts[number].part;
            let used = &self.materials[part.material as usize];
            let count = counts[number] as usize;
            let at = self.positions.get(position);
            push(&mut part.positions, count, at.copied().unwrap_or_default());
            if !is_white {
                push(&mut part.colors, count, self.colors.get(position).copied().unwrap_or(WHITE));
            }
            if used.material.material.texture.is_some() {
                let given = self.texcoords.get(pair.texcoord as usize);
                let texcoord = given.map_or([0.0; 2], |uv| {
                    let back = repeats[number].get_or_insert_with(|| match used.defined {
                        true => used.material.whole_repeats(*uv),
                        false => [0.0; 2], // as it was before anything was known of it
                    });
                    used.material.transform.apply(*uv, *back)
                });
                push(&mut part.texcoords, count, texcoord);
            }
            if let Some(page) = uses.last_of_position(pair) {
                self.positions.free(page);
                self.colors.free(page);
            }
            if let Some(page) = uses.last_of_texcoord(pair) {
                self.texcoords.free(page);
            }
        }
    }

    fn finish(mut self) -> Result<Model> {
        let line_count = self.lines;
        self.index_faults.report(self.path, &mut self.warnings);
        if self.parts.is_empty() {
            let what = match (self.positions.len(), self.stats.not_triangles) {
                _ if !self.warnings.is_empty() => {
                    format!("no face is left: {}", super::listed(&self.warnings))
                }
                (0, 0) => {
                    format!("no vertex and no face in {line_count} lines; expected a Wavefront OBJ")
                }
                (vertices, others) => format!(
                    "no face; expected at least one (there are {vertices} vertices and {others} \
                     points, lines or free-form elements)"
                ),
            };
            return Err(Error::input(self.path, what));
        }
        self.resolve_materials();
        self.settle_colors();
        self.stats.unused_vertices = self.unifier.unused(self.positions.len());
        let vertices = std::mem::take(&mut self.unifier).numbered(self.parts.len());
        let timer = StageTimer::current();
        self.parts.par_iter_mut().for_each(|state| {
            let number = |index: &mut u32| *index = vertices.number(*index);
            timer.time(|| state.part.indices.iter_mut().for_each(number));
        });
        self.fill_parts(vertices);
        let parts: Vec<(Part, CleanStats)> = std::mem::take(&mut self.parts)
            .into_par_iter()
            .map(|state| timer.time(|| finished(state)))
            .collect();
        let mut kept = Vec::with_capacity(parts.len());
        for (part, stats) in parts {
            self.stats.add(&stats);
            if !part.indices.is_empty() {
                kept.push(part);
            }
        }
        self.stats.report(self.path, &mut self.warnings);
        let encoding = self.encoding();
        let name = |name: Vec<u8>| Group { name: names::display(&name, encoding) };
        let groups = self.groups.into_iter().map(name).collect();
        self.dependencies.extend(self.textures.dependencies());
        self.dependencies.extend(self.finder.absent());
        super::assemble(Model {
            source: self.path.to_path_buf(),
            dependencies: self.dependencies,
            groups,
            parts: kept,
            materials: self.materials.into_iter().map(|used| used.material.material).collect(),
            textures: self.textures.list,
            up: None,
            warnings: self.warnings,
        })
    }
}

/// True where a word ends the name of a material library.
fn is_library(word: &[u8]) -> bool {
    let word = word.strip_suffix(b"\"").unwrap_or(word);
    word[word.len().saturating_sub(4)..].eq_ignore_ascii_case(b".mtl")
}

/// Pushes one of `count` elements.
fn push<T>(elements: &mut Vec<T>, count: usize, element: T) {
    if elements.is_empty() {
        elements.reserve_exact(count);
    }
    elements.push(element);
}

/// A part as it will stay, and what was left out.
fn finished(PartState { mut part, mut normals, bare_faces }: PartState) -> (Part, CleanStats) {
    let mut stats = CleanStats { untextured_faces: bare_faces, ..CleanStats::default() };
    // A material may have turned out to have a texture; then it is not lit.
    if part.texcoords.is_empty() && !normals.is_empty() {
        normals.resize(part.indices.len(), Normal::NONE);
        stats.normals_dropped = part.set_normals(normals, SAME_NORMAL);
    }
    clean(&mut part, &mut stats);
    part.positions.shrink_to_fit();
    part.texcoords.shrink_to_fit();
    part.colors.shrink_to_fit();
    part.normals.shrink_to_fit();
    part.indices.shrink_to_fit();
    (part, stats)
}

#[cfg(test)]
mod tests;
