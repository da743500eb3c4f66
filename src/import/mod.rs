//! Import: OBJ with MTL, glTF and GLB become [`Model`]s; textures are found, but not decoded (see
//! [`decode`](crate::decode)).
//!
//! Everything that later steps rely on is settled here: polygons are triangles, texture transforms
//! are applied, node hierarchies are flattened in f64, coordinates are finite, indices are valid,
//! and no triangle is degenerate or there twice. What had to be repaired is counted in
//! [`Model::warnings`]; what cannot be read at all is an [`Error::Input`].

mod bounds;
mod clean;
mod find;
mod gltf;
mod gltf_buffers;
mod gltf_materials;
mod gltf_meshopt;
mod gltf_nodes;
mod gltf_unread;
mod lines;
mod mtl;
mod names;
mod obj;
mod opacity;
mod page_uses;
mod paged_vec;
mod paths;
mod plain_text;
mod texture_statement;
mod textures;
pub mod tiling;
mod tokens;
mod vertices;
mod words;

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use bounds::bounds;
pub use find::find_inputs;

use glam::DVec3;

use self::plain_text::PlainText;
use crate::format::open_regular;
use crate::mesh::{Material, Model, Part, Warnings};
use crate::{Error, Result};

/// Reads one model file: OBJ, glTF or GLB, by its extension.
pub fn load(path: &Path) -> Result<Model> {
    match find::kind(path) {
        Some(find::Kind::Obj) => obj::load(path),
        Some(find::Kind::Gltf) => gltf::load(path),
        None => {
            Err(Error::input(path, format!("not a model by its extension; {}", find::EXPECTED)))
        }
    }
}

/// True if a file is a model by its extension.
pub(crate) fn is_model(path: &Path) -> bool {
    find::kind(path).is_some()
}

/// The copyright notice that a model file states (`asset.copyright` of glTF). Reads its JSON alone.
pub fn copyright(path: &Path) -> Option<String> {
    match find::kind(path)? {
        find::Kind::Obj => None,
        find::Kind::Gltf => gltf::copyright(path),
    }
}

/// Opens a model file.
fn open(path: &Path) -> Result<File> {
    open_regular(path).map_err(|error| Error::input(path, format!("cannot be opened: {error}")))
}

/// Opens an OBJ.
fn open_text(path: &Path) -> Result<PlainText<'static>> {
    plain_text(path, open(path)?)
}

/// The text of the OBJ at `path`, which is in `file`.
fn plain_text<'a>(path: &Path, file: impl Read + Send + 'a) -> Result<PlainText<'a>> {
    let text = PlainText::new(file)
        .map_err(|error| Error::input(path, format!("cannot be read: {error}")))?;
    if text.head.is_empty() {
        return Err(Error::input(path, "is empty; expected a Wavefront OBJ with faces"));
    }
    match lines::not_text(&text.head) {
        Some(what) => Err(Error::input(path, what)),
        None => Ok(text),
    }
}

/// The name of a file without folder and extension, for groups that have no name of their own.
fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Warnings as one line of text.
fn listed(warnings: &Warnings) -> String {
    let reasons: Vec<String> =
        warnings.iter().map(|(what, times)| format!("{what} ({times})")).collect();
    reasons.join("; ")
}

/// Brings a model into the form that [`Model`] promises, whatever format it comes from: materials
/// of different names, groups and textures that are used, dependencies in order.
fn assemble(mut model: Model) -> Result<Model> {
    if model.parts.is_empty() {
        let what = format!("no triangle is left: {}", listed(&model.warnings));
        return Err(Error::input(model.source, what));
    }
    if !model.parts.iter().any(spans_area) {
        let what = "no triangle is left: all are lines, of no area; expected a surface";
        return Err(Error::input(model.source, what));
    }
    model.dependencies.sort();
    model.dependencies.dedup();
    number_equal_names(&mut model.materials);
    Ok(model)
}

/// Gives materials different names: the first of a name keeps it, others get the least number behind
/// it that is free.
fn number_equal_names(materials: &mut [Material]) {
    // Each name with the least number that may be free behind it.
    let mut names: BTreeMap<String, u64> = BTreeMap::new();
    for material in materials {
        let given = match material.name.is_empty() {
            true => "default".to_owned(),
            false => std::mem::take(&mut material.name),
        };
        let mut name = given.clone();
        if let Some(&first) = names.get(&given) {
            let mut number = first;
            name = loop {
                let numbered = format!("{given}.{number}");
                number += 1;
                if !names.contains_key(&numbered) {
                    break numbered;
                }
            };
            names.insert(given, number);
        }
        names.insert(name.clone(), 2);
        material.name = name;
    }
}

/// True where some triangle is higher than its corners' last bits. Looks no further than that.
fn spans_area(part: &Part) -> bool {
    part.indices.as_chunks::<3>().0.iter().any(|corners| {
        let [a, b, c] = corners.map(|vertex| DVec3::from(part.positions[vertex as usize]));
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let magnitude = [a, b, c].map(|corner| corner.abs().max_element()).into_iter();
        let rounding = 4.0 * f64::EPSILON * magnitude.fold(0.0, f64::max);
        // Height of the triangle on its longest side; false where that is beyond f64.
        (b - a).cross(c - a).length() > rounding * longest
    })
}

#[cfg(test)]
mod tests;
