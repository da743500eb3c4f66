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
mod corners;
pub(super) mod index_faults;
pub(super) mod statements;

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use self::chunks::Chunks;
use self::corners::{Run, Triangles};
use self::index_faults::IndexFaults;
use self::statements::{Change, MOST_VERTICES, Statements, WHITE};
use super::clean::{CleanStats, clean};
use super::lines::not_text;
use super::mtl::{Library, MtlMaterial};
use super::page_uses::PageUses;
use super::paged::Paged;
use super::paths::Finder;
use super::textures::Textures;
use super::vertices::{Numbered, Unifier};
use crate::mesh::{Group, Model, Part, Warnings};
use crate::stage_timer::StageTimer;
use crate::{Error, Result};

/// How much is looked at to tell text from other files.
const HEAD_BYTES: u64 = 1 << 20;

/// Text that one thread parses at a time: it and what is made of it should stay in the cache.
pub(super) const CHUNK_BYTES: usize = 1 << 18;

/// Chunks of a batch for each thread: enough to keep all busy when some take longer.
const CHUNKS_PER_THREAD: usize = 4;

/// Reads the OBJ at `path` with its material libraries.
pub(super) fn load(path: &Path) -> Result<Model> {
    read(path, super::open(path)?, CHUNK_BYTES)
}

/// Reads a part of the OBJ at `path`, whose text `reader` has.
pub(super) fn load_part(path: &Path, reader: impl Read + Send) -> Result<Model> {
    read(path, reader, CHUNK_BYTES)
}

/// Reads an OBJ from `reader`; what it names is looked for beside `path`.
fn read(path: &Path, mut reader: impl Read + Send, chunk_bytes: usize) -> Result<Model> {
    let unreadable = |error| Error::input(path, format!("cannot be read: {error}"));
    let mut head = text_of(path, &mut reader)?;
    if head.starts_with(BYTE_ORDER_MARK) {
        head.drain(..BYTE_ORDER_MARK.len());
    }
    let mut chunks = Chunks::new(head, reader, chunk_bytes);
    let mut obj = Obj::new(path);
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

/// What some editors begin a text with.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// The beginning of a file that is text.
pub(super) fn text_of(path: &Path, reader: &mut impl Read) -> Result<Vec<u8>> {
    let unreadable = |error| Error::input(path, format!("cannot be read: {error}"));
    let mut head = Vec::new();
    reader.take(HEAD_BYTES).read_to_end(&mut head).map_err(unreadable)?;
    if head.is_empty() {
        return Err(Error::input(path, "is empty; expected a Wavefront OBJ with faces"));
    }
    match not_text(&head) {
        Some(what) => Err(Error::input(path, what)),
        None => Ok(head),
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

/// A part in the making: its indices are numbers of the [`Unifier`]'s vertices, and it has none yet.
#[derive(Default)]
struct PartState {
    part: Part,
    /// Faces without texture coordinates.
    bare_faces: u64,
}

/// A material that a `usemtl` named.
struct UsedMaterial {
    material: MtlMaterial,
    /// A library had defined it when it was first used.
    defined: bool,
}

/// The state of reading one file.
struct Obj<'a> {
    path: &'a Path,
    finder: Finder,
    dependencies: Vec<PathBuf>,
    warnings: Warnings,
    stats: CleanStats,
    index_faults: IndexFaults,

    library: Library,
    libraries_read: usize,
    textures: Textures,
    materials: Vec<UsedMaterial>,
    material_of_name: BTreeMap<String, u32>,
    /// What `usemtl` named last; `None` before the first.
    material: Option<u32>,

    positions: Paged<[f64; 3]>,
    /// Empty until a vertex has a colour, then one per position.
    colors: Paged<[u16; 4]>,
    texcoords: Paged<[f64; 2]>,

    groups: Vec<Group>,
    /// What `o` or `g` named last.
    group_name: String,
    /// The group of that name once it has a face.
    group: Option<u32>,
    parts: Vec<PartState>,
    part_of: FxHashMap<(u32, u32), u32>,
    /// The part of the current group and material once it has a face.
    part: Option<u32>,

    unifier: Unifier,
    /// Lines of the chunks so far.
    lines: u64,
}

/// A chunk in its place.
struct Placed {
    statements: Statements,
    runs: Vec<Run>,
    /// How many positions and texture coordinates come before it.
    before: [usize; 2],
}

impl<'a> Obj<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            finder: Finder::new(path),
            dependencies: vec![path.to_path_buf()],
            warnings: Warnings::default(),
            stats: CleanStats::default(),
            index_faults: IndexFaults::default(),
            library: Library::default(),
            libraries_read: 0,
            textures: Textures::default(),
            materials: Vec::new(),
            material_of_name: BTreeMap::new(),
            material: None,
            positions: Paged::default(),
            colors: Paged::default(),
            texcoords: Paged::default(),
            groups: Vec::new(),
            group_name: super::stem(path),
            group: None,
            parts: Vec::new(),
            part_of: FxHashMap::default(),
            part: None,
            unifier: Unifier::default(),
            lines: 0,
        }
    }

    /// Adds the chunks that come next.
    fn add(&mut self, mut parsed: Vec<Parsed>) -> Result<(), String> {
        let mut before = [self.positions.len(), self.texcoords.len()];
        let chunk_starts: Vec<[usize; 2]> = parsed
            .iter()
            .map(|Parsed { statements, .. }| {
                let counts = [statements.positions.len(), statements.texcoords.len()];
                let next = [0, 1].map(|kind| before[kind] + counts[kind]);
                std::mem::replace(&mut before, next)
            })
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

    /// Settles what a chunk's indices mean and to which parts its faces belong.
    fn place(&mut self, Parsed { statements: mut chunk, .. }: Parsed) -> Result<Placed, String> {
        let before = [self.positions.len(), self.texcoords.len()];
        chunk.check(before, self.lines)?;
        self.index_faults.add(&chunk.index_faults, self.lines);
        self.lines += chunk.lines;
        self.stats.add(&chunk.stats);
        if self.colors.len() > 0 || !chunk.colors.is_empty() {
            let missing = before[0] - self.colors.len();
            self.colors.extend(std::iter::repeat_n(WHITE, missing));
            let missing = chunk.positions.len() - chunk.colors.len();
            self.colors.extend(std::mem::take(&mut chunk.colors));
            self.colors.extend(std::iter::repeat_n(WHITE, missing));
        }
        self.positions.extend(std::mem::take(&mut chunk.positions));
        self.texcoords.extend(std::mem::take(&mut chunk.texcoords));
        let mut runs = Vec::with_capacity(chunk.changes.len() + 1);
        let mut first = 0;
        let face_count = chunk.faces.len();
        for (end, change) in std::mem::take(&mut chunk.changes) {
            self.run(first..end, &mut runs);
            first = end;
            match change {
                Change::Group(name) => self.start_group(&name),
                Change::Material(name) => self.use_material(&name),
                Change::Libraries(names) => self.read_libraries(&names),
            }
        }
        self.run(first..face_count, &mut runs);
        Ok(Placed { statements: chunk, runs, before })
    }

    /// Appends the run of these faces, if there are any, to `runs`.
    fn run(&mut self, faces: std::ops::Range<usize>, runs: &mut Vec<Run>) {
        if faces.is_empty() {
            return;
        }
        let part = match self.part {
            Some(part) => part,
            None => self.start_part(),
        };
        let used = &self.materials[self.parts[part as usize].part.material as usize];
        // Texture coordinates stay with a material that may yet turn out to have a texture.
        let textured = used.material.material.texture.is_some() || !used.defined;
        runs.push(Run { faces, part, textured });
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
            state.part.indices.extend(indices.iter().map(|&index| vertices[index as usize]));
            first = end;
        }
        Ok(())
    }

    /// A name that comes again right away goes on with its group; after another it is a new one.
    fn start_group(&mut self, name: &str) {
        let stem;
        let name = if name.is_empty() {
            stem = super::stem(self.path);
            &stem
        } else {
            name
        };
        if name != self.group_name {
            self.group_name = name.to_owned();
            self.group = None;
            self.part = None;
        }
    }

    fn use_material(&mut self, name: &str) {
        let material = match self.material_of_name.get(name) {
            Some(material) => *material,
            None => self.new_material(name),
        };
        if self.material != Some(material) {
            self.material = Some(material);
            self.part = None;
        }
    }

    fn new_material(&mut self, name: &str) -> u32 {
        let made = self.library.material(
            name,
            self.path,
            &mut self.finder,
            &mut self.textures,
            &mut self.warnings,
        );
        let index = self.materials.len() as u32;
        self.materials.push(UsedMaterial {
            defined: made.is_some(),
            material: made.unwrap_or_else(|| MtlMaterial::plain(name)),
        });
        self.material_of_name.insert(name.to_owned(), index);
        index
    }

    /// The part of the current group and material; group and part are made where they are new.
    fn start_part(&mut self) -> u32 {
        let material = match self.material {
            Some(material) => material,
            None => {
                // Faces before the first usemtl; the name cannot be one that a file gives.
                let material = self.materials.len() as u32;
                self.materials
                    .push(UsedMaterial { material: MtlMaterial::plain(""), defined: true });
                *self.material.insert(material)
            }
        };
        let group = *self.group.get_or_insert_with(|| {
            self.groups.push(Group { name: self.group_name.clone() });
            self.groups.len() as u32 - 1
        });
        let parts = &mut self.parts;
        let part = *self.part_of.entry((group, material)).or_insert_with(|| {
            let part = Part { group, material, ..Part::default() };
            parts.push(PartState { part, bare_faces: 0 });
            parts.len() as u32 - 1
        });
        self.part = Some(part);
        part
    }

    /// `mtllib` names one file, in which there may be spaces, or several.
    fn read_libraries(&mut self, names: &str) {
        let whole = self.finder.find(names);
        let files: Vec<(&str, Option<PathBuf>)> = match whole {
            Some(file) => vec![(names, Some(file))],
            None => {
                let each: Vec<_> =
                    names.split_whitespace().map(|name| (name, self.finder.find(name))).collect();
                if each.iter().any(|(_, file)| file.is_some()) { each } else { vec![(names, None)] }
            }
        };
        for (name, file) in files {
            let problem = match file.map(|file| (std::fs::read(&file), file)) {
                Some((Ok(bytes), file)) => {
                    self.library.add(&bytes);
                    self.libraries_read += 1;
                    self.dependencies.push(file);
                    continue;
                }
                Some((Err(error), _)) => format!("cannot be read ({error})"),
                None => "not found".to_owned(),
            };
            let what = format!("{}: material library {name} {problem}", self.path.display());
            self.warnings.add(what, 1);
        }
    }

    /// Libraries may come after the faces that use them; what none defines is plain grey.
    fn resolve_materials(&mut self) {
        let names: Vec<(String, u32)> = std::mem::take(&mut self.material_of_name)
            .into_iter()
            .filter(|(_, index)| !self.materials[*index as usize].defined)
            .collect();
        let file = self.path.display();
        for (name, index) in names {
            let made = self.library.material(
                &name,
                self.path,
                &mut self.finder,
                &mut self.textures,
                &mut self.warnings,
            );
            if let Some(made) = made {
                self.materials[index as usize].material = made;
            } else if self.libraries_read > 0 {
                let what = format!("{file}: material {name} is in no library, taken as plain grey");
                self.warnings.add(what, 1);
            } else {
                let what =
                    format!("{file}: usemtl without a material library, taken as plain grey");
                self.warnings.add(what, 1);
            }
            if self.materials[index as usize].material.material.texture.is_none() {
                let of_material = |state: &&mut PartState| state.part.material == index;
                self.parts.iter_mut().filter(of_material).for_each(|state| state.bare_faces = 0);
            }
        }
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
        self.dependencies.extend(self.textures.dependencies());
        self.dependencies.extend(self.finder.absent());
        super::assemble(Model {
            source: self.path.to_path_buf(),
            dependencies: self.dependencies,
            groups: self.groups,
            parts: kept,
            materials: self.materials.into_iter().map(|used| used.material.material).collect(),
            textures: self.textures.list,
            up: None,
            warnings: self.warnings,
        })
    }
}

/// Pushes one of `count` elements.
fn push<T>(elements: &mut Vec<T>, count: usize, element: T) {
    if elements.is_empty() {
        elements.reserve_exact(count);
    }
    elements.push(element);
}

/// A part as it will stay, and what was left out.
fn finished(PartState { mut part, bare_faces }: PartState) -> (Part, CleanStats) {
    let mut stats = CleanStats { untextured_faces: bare_faces, ..CleanStats::default() };
    clean(&mut part, &mut stats);
    part.positions.shrink_to_fit();
    part.texcoords.shrink_to_fit();
    part.colors.shrink_to_fit();
    part.indices.shrink_to_fit();
    (part, stats)
}

#[cfg(test)]
mod tests;
