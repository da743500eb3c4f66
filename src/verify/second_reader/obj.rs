//! A plain reader of OBJ and MTL: line by line, no more than what most files have.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::content::{Content, Polygons, area};
use super::texture::{Image, Sample, Samples};
use crate::color::srgb_to_linear;
use crate::mesh::Wrap;
use crate::side_file;

/// The importer's name for the material of faces that have none.
const NO_MATERIAL: &str = "default";

/// A colour as the file has it, encoded; and a texture that it multiplies.
#[derive(Clone, Default)]
struct Look {
    diffuse: Option<[f64; 3]>,
    texture: Option<PathBuf>,
    /// Something that is not read here may change the colour.
    is_doubtful: bool,
}

#[derive(Default)]
struct Reader {
    folder: PathBuf,
    positions: Vec<DVec3>,
    /// The colour of each position, encoded; `None` where it has none.
    colors: Vec<Option<[f64; 3]>>,
    texcoords: Vec<[f64; 2]>,
    looks: BTreeMap<String, Look>,
    material: Option<String>,
    polygons: Polygons,
    samples: BTreeMap<PathBuf, Samples>,
    /// By the name of a material, triangles whose colour is that of their vertices: area and vertices.
    colored: BTreeMap<String, Vec<(f64, [usize; 3])>>,
    content: Content,
    /// Faces that name vertices that are not there, or have no coordinates.
    broken: u64,
}

/// Reads an OBJ file; or says why it is left alone.
pub(super) fn read(file: &Path) -> Result<Content, String> {
    let bytes = plain_text(std::fs::read(file).map_err(|error| error.to_string())?);
    let folder = file.parent().map(Path::to_owned).unwrap_or_default();
    let mut reader = Reader { folder, ..Reader::default() };
    for line in lines(&bytes) {
        let line = String::from_utf8_lossy(&line);
        let (keyword, rest) = statement(&line);
        match &keyword[..] {
            "v" => reader.vertex(rest),
            "vt" => {
                let [u, v] = [0, 1].map(|at| numbers(rest).nth(at).unwrap_or(0.0));
                reader.texcoords.push([u, 1.0 - v]);
            }
            "f" | "fo" => reader.face(rest),
            "usemtl" => reader.material = Some(rest.to_owned()),
            "mtllib" => reader.library(rest),
            _ => {}
        }
    }
    if reader.broken > 0 {
        return Err(format!("{} faces that name no vertices", reader.broken));
    }
    reader.add_vertex_colors();
    for (texture, samples) in &reader.samples {
        if let Some(image) = Image::open(texture) {
            samples.take(&image, [Wrap::Repeat; 2], &mut reader.content.materials);
        }
    }
    Ok(reader.content)
}

impl Reader {
    fn vertex(&mut self, rest: &str) {
        let numbers: Vec<f64> = numbers(rest).collect();
        let at = |at: usize| numbers.get(at).copied().unwrap_or(f64::NAN);
        self.positions.push(DVec3::new(at(0), at(1), at(2)));
        self.colors.push((numbers.len() >= 6).then(|| [at(3), at(4), at(5)]));
    }

    /// Takes a file of materials in, where it is found under this very name.
    fn library(&mut self, name: &str) {
        let path = self.folder.join(name.replace('\\', "/"));
        let Ok(bytes) = side_file::read(&path, side_file::MOST_LIBRARY_BYTES) else { return };
        let mut current = None;
        for line in lines(&plain_text(bytes)) {
            let line = String::from_utf8_lossy(&line);
            let (keyword, rest) = statement(&line);
            if keyword == "newmtl" {
                // The first definition of a name counts.
                current = (!self.looks.contains_key(rest)).then(|| rest.to_owned());
                self.looks.entry(rest.to_owned()).or_default();
                continue;
            }
            let Some(look) = current.as_ref().and_then(|name| self.looks.get_mut(name)) else {
                continue;
            };
            match &keyword[..] {
                "kd" => {
                    let values: Vec<f64> = numbers(rest).collect();
                    match values[..] {
                        _ if !values.iter().all(|value| value.is_finite()) => {
                            look.is_doubtful = true;
                        }
                        [grey] => look.diffuse = Some([grey; 3]),
                        [r, g, b, ..] => look.diffuse = Some([r, g, b]),
                        _ => look.is_doubtful = true,
                    }
                }
                "map_kd" => {
                    let path = self.folder.join(rest.replace('\\', "/"));
                    look.is_doubtful |= side_file::check(&path).is_err();
                    look.texture = Some(path);
                }
                _ => {}
            }
        }
    }

    fn face(&mut self, rest: &str) {
        let words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let number = |word: &str, count: usize| {
            let number: i64 = word.parse().ok()?;
            let index = if number < 0 { count as i64 + number } else { number - 1 };
            (index >= 0 && index < count as i64).then_some(index as usize)
        };
        let mut corners: Vec<(usize, Option<[f64; 2]>)> = Vec::new();
        for word in words {
            let mut parts = word.split('/');
            let Some(vertex) = number(parts.next().unwrap_or(""), self.positions.len()) else {
                self.broken += 1;
                return;
            };
            let texcoord = parts.next().and_then(|word| number(word, self.texcoords.len()));
            corners.push((vertex, texcoord.map(|at| self.texcoords[at])));
        }
        let places: Vec<DVec3> =
            corners.iter().map(|&(vertex, _)| self.positions[vertex]).collect();
        let material = self.material.as_deref().unwrap_or(NO_MATERIAL);
        self.polygons.add(&places, material, &mut self.content);
        self.color(&corners, &places);
    }

    /// Adds the colours of vertices, whose range is that of all of the file: bytes where all are
    /// integers and some are above 1, else fractions of 1.
    fn add_vertex_colors(&mut self) {
        let parts = || self.colors.iter().flatten().flatten().copied();
        let has_fractions = parts().any(|part| part.is_finite() && part.fract() != 0.0);
        let is_bytes = !has_fractions && parts().any(|part| part > 1.0);
        let full = if is_bytes { 255.0 } else { 1.0 };
        let light = |vertex: usize| {
            let color = self.colors[vertex].unwrap_or([full; 3]);
            // Not a number is 0, which `max` makes of it.
            color.map(|part| srgb_to_linear(part.max(0.0) / full))
        };
        for (name, triangles) in &self.colored {
            let content = self.content.materials.entry(name.clone()).or_default();
            for &(area, vertices) in triangles {
                let [a, b, c] = vertices.map(light);
                content.add(area, [0, 1, 2].map(|part| (a[part] + b[part] + c[part]) / 3.0));
            }
        }
    }

    /// Adds the colours of a polygon, as a fan.
    fn color(&mut self, corners: &[(usize, Option<[f64; 2]>)], places: &[DVec3]) {
        // Where a material has this name itself, faces without one have another.
        let is_taken = self.looks.contains_key(NO_MATERIAL);
        let unnamed = if is_taken { "" } else { NO_MATERIAL };
        let name = self.material.as_deref().unwrap_or(unnamed);
        let look = self.material.as_ref().and_then(|name| self.looks.get(name));
        let content = self.content.materials.entry(name.to_owned()).or_default();
        for at in 1..places.len().max(2) - 1 {
            let fan = [0, at, at + 1];
            let area = area(fan.map(|at| places[at]));
            if !area.is_finite() {
                continue;
            }
            content.area += area;
            let colors = fan.map(|at| self.colors[corners[at].0]);
            let texcoords = fan.map(|at| corners[at].1);
            match (look, colors, texcoords) {
                (None, [Some(_), Some(_), Some(_)], _) if self.material.is_none() => {
                    let triangle = (area, fan.map(|at| corners[at].0));
                    self.colored.entry(name.to_owned()).or_default().push(triangle);
                }
                (Some(look), [None, None, None], _) if look.is_doubtful => {}
                (
                    Some(Look { texture: Some(texture), diffuse, .. }),
                    [None, None, None],
                    [Some(a), Some(b), Some(c)],
                ) => {
                    // Black beside a texture is a default that exporters leave.
                    let factor = diffuse.filter(|color| *color != [0.0; 3]).unwrap_or([1.0; 3]);
                    let texcoords = [a, b, c].map(|at| at.map(|axis| axis as f32));
                    let sample = Sample { texcoords, area, light: factor.map(srgb_to_linear) };
                    self.samples.entry(texture.clone()).or_default().push(name, sample);
                }
                (Some(Look { texture: None, diffuse: Some(color), .. }), [None, None, None], _) => {
                    content.add(area, color.map(srgb_to_linear));
                }
                _ => {}
            }
        }
    }
}

/// A file's bytes in a superset of ASCII, without a byte-order mark.
fn plain_text(bytes: Vec<u8>) -> Vec<u8> {
    let (start, unit): (usize, fn([u8; 2]) -> u16) = match bytes[..] {
        [0xef, 0xbb, 0xbf, ..] => return bytes[3..].to_vec(),
        [0xff, 0xfe, ..] => (2, u16::from_le_bytes),
        [0xfe, 0xff, ..] => (2, u16::from_be_bytes),
        [(1..), 0, (1..), 0, ..] => (0, u16::from_le_bytes),
        [0, (1..), 0, (1..), ..] => (0, u16::from_be_bytes),
        _ => return bytes,
    };
    let units: Vec<u16> = bytes[start..].as_chunks().0.iter().map(|&pair| unit(pair)).collect();
    String::from_utf16_lossy(&units).into_bytes()
}

/// The lines of a file, those joined that end in a backslash.
fn lines(bytes: &[u8]) -> impl Iterator<Item = Vec<u8>> {
    let mut lines = bytes.split(|&byte| byte == b'\n' || byte == b'\r');
    std::iter::from_fn(move || {
        let mut line = lines.next()?.to_vec();
        while line.last() == Some(&b'\\') {
            line.pop();
            line.push(b' ');
            // Between a carriage return and a line feed there is an empty line.
            match lines.by_ref().find(|next| !next.is_empty()) {
                Some(next) => line.extend_from_slice(next),
                None => break,
            }
        }
        Some(line)
    })
}

/// The keyword in lower case, and what follows.
fn statement(line: &str) -> (String, &str) {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (keyword.to_lowercase(), rest.trim())
}

fn numbers(rest: &str) -> impl Iterator<Item = f64> {
    rest.split_whitespace().map_while(|word| word.parse().ok())
}
