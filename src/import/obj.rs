//! Wavefront OBJ.
//!
//! Statements are read one at a time and triangles go straight into their parts, so that memory
//! holds the result, the file's vertices, and nothing else. tobj, which reads the materials, is not
//! used for the geometry: it keeps about 100 bytes for each face of an object until the object
//! ends and hashes each corner, makes triangles of polylines, gives faces without texture
//! coordinates those of the face before, and cannot say in which line an error is.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use rustc_hash::FxHashMap;

use super::clean::{Tally, clean};
use super::color::{srgb_to_linear, to_unorm16};
use super::lines::{Lines, not_text, text};
use super::mtl::{Library, MtlMaterial, UvTransform};
use super::paths::Finder;
use super::polygon::Triangulator;
use super::textures::Textures;
use super::tokens::{corner, number, word};
use super::vertices::{Attributes, NONE, Unifier};
use crate::mesh::{Group, Model, Part, Warnings};
use crate::{Error, Result};

/// Read-ahead, in bytes; also how much is looked at to tell text from other files.
const BUFFER_BYTES: usize = 1 << 20;

/// Most vertices of a file, so that every index fits 32 bits with room for markers.
const MOST_VERTICES: usize = u32::MAX as usize - 64;

/// Most corners of a face: beyond this the ear clipping's own indices could overflow.
const MOST_CORNERS: usize = 1 << 20;

/// Reads the OBJ at `path` with its material libraries.
pub(super) fn load(path: &Path) -> Result<Model> {
    read(path, BufReader::with_capacity(BUFFER_BYTES, super::open(path)?))
}

/// Reads an OBJ from `reader`; what it names is looked for beside `path`.
fn read(path: &Path, mut reader: impl BufRead) -> Result<Model> {
    let unreadable = |error| Error::input(path, format!("cannot be read: {error}"));
    let head = reader.fill_buf().map_err(unreadable)?;
    if head.is_empty() {
        return Err(Error::input(path, "is empty; expected a Wavefront OBJ with faces"));
    }
    if let Some(what) = not_text(head) {
        return Err(Error::input(path, what));
    }
    if head.starts_with(b"\xef\xbb\xbf") {
        reader.consume(3);
    }
    let mut lines = Lines::new(reader);
    let mut obj = Obj::new(path);
    while let Some((line, statement)) = lines.next().map_err(unreadable)? {
        obj.statement(statement)
            .map_err(|what| Error::input(path, format!("line {line}: {what}")))?;
    }
    obj.finish(lines.count())
}

/// A part in the making.
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
    tally: Tally,

    library: Library,
    libraries_read: usize,
    textures: Textures,
    materials: Vec<UsedMaterial>,
    material_of_name: BTreeMap<String, u32>,
    /// What `usemtl` named last; `None` before the first.
    material: Option<u32>,

    positions: Vec<[f64; 3]>,
    /// Empty until a vertex has a colour, then one per position.
    colors: Vec<[u16; 4]>,
    texcoords: Vec<[f64; 2]>,

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
    triangulator: Triangulator,
    /// Position and texture coordinate of each corner of the face at hand.
    face: Vec<(u32, u32)>,
    /// Positions of its corners.
    outline: Vec<[f64; 3]>,
}

const WHITE: [u16; 4] = [u16::MAX; 4];

impl<'a> Obj<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            finder: Finder::new(path),
            dependencies: vec![path.to_path_buf()],
            warnings: Warnings::default(),
            tally: Tally::default(),
            library: Library::default(),
            libraries_read: 0,
            textures: Textures::default(),
            materials: Vec::new(),
            material_of_name: BTreeMap::new(),
            material: None,
            positions: Vec::new(),
            colors: Vec::new(),
            texcoords: Vec::new(),
            groups: Vec::new(),
            group_name: super::stem(path),
            group: None,
            parts: Vec::new(),
            part_of: FxHashMap::default(),
            part: None,
            unifier: Unifier::default(),
            triangulator: Triangulator::default(),
            face: Vec::new(),
            outline: Vec::new(),
        }
    }

    fn statement(&mut self, statement: &[u8]) -> Result<(), String> {
        let mut rest = statement;
        match word(&mut rest) {
            Some(b"v") => self.position(rest),
            Some(b"vt") => self.texcoord(rest),
            Some(b"f" | b"fo") => self.face(rest),
            Some(b"o" | b"g") => {
                self.start_group(text(rest).trim());
                Ok(())
            }
            Some(b"usemtl") => {
                self.use_material(text(rest).trim());
                Ok(())
            }
            Some(b"mtllib") => {
                self.read_libraries(text(rest).trim());
                Ok(())
            }
            Some(b"p" | b"l" | b"curv" | b"curv2" | b"surf") => {
                self.tally.not_triangles += 1;
                Ok(())
            }
            // Comments, normals, smoothing groups, display attributes.
            _ => Ok(()),
        }
    }

    /// `v x y z`, `v x y z w` (the weight matters to curves alone), `v x y z r g b [a]`.
    fn position(&mut self, mut rest: &[u8]) -> Result<(), String> {
        let mut values = [0.0; 7];
        let mut count = 0;
        while let Some(word) = word(&mut rest) {
            if word[0] == b'#' || count == values.len() {
                break;
            }
            values[count] = number(word).ok_or_else(|| {
                format!("vertex coordinate \"{}\"; expected a number", text(word))
            })?;
            count += 1;
        }
        if count < 3 {
            return Err(format!("vertex of {count} coordinates; expected 3"));
        }
        if self.positions.len() >= MOST_VERTICES {
            return Err(format!("more than {MOST_VERTICES} vertices; divide the file"));
        }
        if count >= 6 {
            let given = [values[3], values[4], values[5]];
            if given.iter().any(|part| !(0.0..=1.0).contains(part)) {
                self.tally.colors_clamped += 1;
            }
            let [r, g, b] = given.map(|part| to_unorm16(srgb_to_linear(part)));
            self.colors.resize(self.positions.len(), WHITE);
            self.colors.push([r, g, b, u16::MAX]);
        } else if !self.colors.is_empty() {
            self.colors.push(WHITE);
        }
        self.positions.push([values[0], values[1], values[2]]);
        Ok(())
    }

    fn texcoord(&mut self, mut rest: &[u8]) -> Result<(), String> {
        let mut read = || -> Result<Option<f64>, String> {
            match word(&mut rest) {
                Some(word) if word[0] != b'#' => number(word).map(Some).ok_or_else(|| {
                    format!("texture coordinate \"{}\"; expected a number", text(word))
                }),
                _ => Ok(None),
            }
        };
        let u = read()?.ok_or("texture coordinate without a value; expected u and v")?;
        let v = read()?.unwrap_or(0.0);
        // Beyond f32's range is infinite where it is used.
        if (u as f32).is_finite() && (v as f32).is_finite() {
            self.texcoords.push([u, v]);
        } else {
            self.tally.texcoords_not_finite += 1;
            self.texcoords.push([0.0, 1.0]);
        }
        Ok(())
    }

    fn face(&mut self, mut rest: &[u8]) -> Result<(), String> {
        self.face.clear();
        let mut bare = false;
        while let Some(word) = word(&mut rest) {
            if word[0] == b'#' {
                break;
            }
            let corner = corner(word).ok_or_else(|| {
                format!("face corner \"{}\"; expected v, v/vt, v//vn or v/vt/vn", text(word))
            })?;
            let position = resolve(corner.position, self.positions.len(), "vertex")?;
            let texcoord = if corner.texcoord == 0 {
                bare = true;
                NONE
            } else {
                resolve(corner.texcoord, self.texcoords.len(), "texture coordinate")?
            };
            self.face.push((position, texcoord));
        }
        if self.face.len() < 3 {
            self.tally.not_triangles += 1;
            return Ok(());
        }
        if self.face.len() > MOST_CORNERS {
            let count = self.face.len();
            return Err(format!("face of {count} corners; expected at most {MOST_CORNERS}"));
        }
        if self.unifier.len() + self.face.len() >= MOST_VERTICES {
            return Err(format!("more than {MOST_VERTICES} distinct vertices; divide the file"));
        }
        let part_index = match self.part {
            Some(part) => part,
            None => self.start_part(),
        };
        let state = &mut self.parts[part_index as usize];
        let used = &self.materials[state.part.material as usize];
        // Texture coordinates stay with a material that may yet turn out to have a texture.
        let textured = used.material.material.texture.is_some() || !used.defined;
        let transform = textured.then_some(&used.material.transform);
        state.bare_faces += u64::from(bare && textured);

        let source = Attributes {
            positions: &self.positions,
            colors: &self.colors,
            texcoords: &self.texcoords,
        };
        let (unifier, part, face) = (&mut self.unifier, &mut state.part, &self.face);
        let mut vertex = |part: &mut Part, corner: u32| {
            let (position, texcoord) = face[corner as usize];
            let texcoord = if textured { texcoord } else { NONE };
            let vertex = unifier.vertex(part_index, part, &source, position, texcoord, transform);
            part.indices.push(vertex);
        };
        if face.len() == 3 {
            (0..3).for_each(|corner| vertex(part, corner));
            return Ok(());
        }
        self.outline.clear();
        self.outline.extend(face.iter().map(|(position, _)| self.positions[*position as usize]));
        if !self.outline.as_flattened().iter().all(|coordinate| coordinate.is_finite()) {
            self.tally.not_finite += face.len() as u64 - 2;
            return Ok(());
        }
        let triangles = self.triangulator.triangulate(&self.outline);
        self.tally.flat_polygons += u64::from(triangles.is_empty());
        for corner in triangles.as_flattened() {
            vertex(part, *corner);
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
            let used = &self.materials[index as usize].material;
            let textured = used.material.texture.is_some();
            for state in self.parts.iter_mut().filter(|state| state.part.material == index) {
                if !textured {
                    state.part.texcoords = Vec::new();
                    state.bare_faces = 0;
                } else if used.transform != UvTransform::default() {
                    for texcoord in &mut state.part.texcoords {
                        let [u, v] = texcoord.map(f64::from);
                        *texcoord = used.transform.apply([u, 1.0 - v]);
                    }
                }
            }
        }
    }

    fn finish(mut self, line_count: u64) -> Result<Model> {
        if self.parts.is_empty() {
            let what = match (self.positions.len(), self.tally.not_triangles) {
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
        self.tally.unused_vertices = self.unifier.unused(self.positions.len());
        let white = self.colors.iter().all(|color| *color == WHITE);
        // The arrays by position are as large as the result; they go before anything else comes.
        self.positions = Vec::new();
        self.colors = Vec::new();
        self.texcoords = Vec::new();
        self.unifier = Unifier::default();

        let mut parts = Vec::with_capacity(self.parts.len());
        for state in self.parts {
            let mut part = state.part;
            self.tally.untextured_faces += state.bare_faces;
            // A part may have begun before the first coloured vertex of the file.
            if white {
                part.colors = Vec::new();
            } else {
                let missing = part.positions.len() - part.colors.len();
                part.colors.splice(0..0, std::iter::repeat_n(WHITE, missing));
            }
            clean(&mut part, &mut self.tally);
            if !part.indices.is_empty() {
                part.positions.shrink_to_fit();
                part.texcoords.shrink_to_fit();
                part.colors.shrink_to_fit();
                part.indices.shrink_to_fit();
                parts.push(part);
            }
        }
        self.tally.report(self.path, &mut self.warnings);
        self.dependencies.extend(self.textures.dependencies());
        self.dependencies.extend(self.finder.absent());
        super::assemble(Model {
            source: self.path.to_path_buf(),
            dependencies: self.dependencies,
            groups: self.groups,
            parts,
            materials: self.materials.into_iter().map(|used| used.material.material).collect(),
            textures: self.textures.list,
            up: None,
            warnings: self.warnings,
        })
    }
}

/// An index as written, from 1 or counted back from the last, to one from 0 below `count`.
#[inline]
fn resolve(index: i64, count: usize, what: &str) -> Result<u32, String> {
    let from_zero = if index < 0 { count as i64 + index } else { index - 1 };
    if from_zero < 0 || from_zero >= count as i64 {
        return Err(format!(
            "{what} index {index} of {count}; expected 1 to {count}, or -{count} to -1"
        ));
    }
    Ok(from_zero as u32)
}

#[cfg(test)]
mod tests;
