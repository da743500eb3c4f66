//! Reads a tileset and all that it refers to, and lists its tiles with what they say. Nothing in
//! the files is trusted; what does not hold becomes a fault and is left out.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};
use serde_json::Value;

use super::VERSION;
use crate::format::TILESET_FILE;

/// Something in a tileset that the specification does not allow, or that is not so.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// File, and path of the tile in it.
    pub place: String,
    /// What was expected and found.
    pub what: String,
}

/// An oriented box.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// Its middle.
    pub centre: DVec3,
    /// From the middle to the middles of three faces.
    pub half: [DVec3; 3],
}

impl Volume {
    /// Its corners.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|corner| {
            let sign = |axis: usize| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
            self.centre + (0..3).map(|axis| self.half[axis] * sign(axis)).sum::<DVec3>()
        })
    }

    /// Returns the distance of a point from it, metres; 0 inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        let from = point - self.centre;
        let nearest = |half: DVec3| {
            let axis = half.normalize_or_zero();
            axis * from.dot(axis).clamp(-half.length(), half.length())
        };
        (from - self.half.into_iter().map(nearest).sum::<DVec3>()).length()
    }

    /// How far a point is outside of it, metres.
    pub fn outside(&self, point: DVec3) -> f64 {
        let from = point - self.centre;
        let beyond = |axis: DVec3| from.dot(axis.normalize_or_zero()).abs() - axis.length();
        self.half.into_iter().map(beyond).fold(0.0, f64::max)
    }
}

/// A tile as it was read.
#[derive(Debug)]
pub struct Seen {
    /// File, and path of the tile in it.
    pub place: String,
    /// The tile above it, in the same file or the one that refers to it.
    pub parent: Option<usize>,
    /// From its coordinates to its parent's.
    pub transform: DAffine3,
    /// From its coordinates to those of the whole.
    pub to_whole: DAffine3,
    /// What encloses it.
    pub volume: Volume,
    /// Its geometric error.
    pub error: f64,
    /// Its content that is no tileset, relative to the output folder.
    pub content: Option<String>,
    /// True where tiles are below it, here or in another file.
    pub replaced: bool,
}

/// All tiles of a folder's tileset, parents first.
#[derive(Debug, Default)]
pub struct Walk {
    /// The tiles.
    pub tiles: Vec<Seen>,
    /// What does not hold.
    pub faults: Vec<Fault>,
    /// What the first file says of itself.
    pub extras: Value,
    /// The files that were read, relative to the folder.
    pub files: BTreeSet<String>,
}

/// A tile to be looked at.
struct Next {
    json: Value,
    file: String,
    place: String,
    parent: Option<usize>,
    root: bool,
}

impl Walk {
    /// Reads the tileset of an output folder.
    pub fn new(out: &Path) -> Self {
        let mut walk = Self::default();
        let mut stack = Vec::new();
        stack.extend(walk.open(out, TILESET_FILE, None));
        while let Some(next) = stack.pop() {
            let below = walk.visit(out, next);
            stack.extend(below.into_iter().rev());
        }
        walk
    }

    fn fault(&mut self, place: &str, what: impl Into<String>) {
        self.faults.push(Fault { place: place.into(), what: what.into() });
    }

    /// The root of a file.
    fn open(&mut self, out: &Path, file: &str, parent: Option<usize>) -> Option<Next> {
        if !self.files.insert(file.into()) {
            self.fault(file, "is referred to twice, expected a tree");
            return None;
        }
        let parsed = crate::format::read_regular(&out.join(file))
            .map_err(|error| format!("cannot be read: {error}"))
            .and_then(|bytes| {
                serde_json::from_slice::<Value>(&bytes).map_err(|error| format!("JSON: {error}"))
            });
        let mut json = match parsed {
            Ok(json) => json,
            Err(what) => {
                self.fault(file, what);
                return None;
            }
        };
        let version = &json["asset"]["version"];
        if version.as_str() != Some(VERSION) {
            self.fault(file, format!("asset.version: expected {VERSION:?}, found {version}"));
        }
        let root_error = json["root"]["geometricError"].as_f64().unwrap_or(f64::INFINITY);
        match json["geometricError"].as_f64() {
            Some(error) if error >= root_error => {}
            _ => self.fault(file, "geometricError: expected a number not below the root's"),
        }
        if parent.is_none() {
            self.extras = json["asset"]["extras"].take();
        }
        if !json["root"].is_object() {
            self.fault(file, "root: expected a tile");
            return None;
        }
        let json = json["root"].take();
        Some(Next { json, file: file.into(), place: format!("{file} root"), parent, root: true })
    }

    fn visit(&mut self, out: &Path, next: Next) -> Vec<Next> {
        let Next { mut json, file, place, parent, root } = next;
        match json.get("refine").map(Value::as_str) {
            Some(Some("REPLACE" | "ADD")) => {}
            None if !root => {}
            _ => self.fault(&place, "refine: expected REPLACE or ADD"),
        }
        let error = match json["geometricError"].as_f64() {
            Some(error) if error >= 0.0 && error.is_finite() => error,
            _ => {
                self.fault(&place, "geometricError: expected a number, 0 or more");
                return Vec::new();
            }
        };
        let Some(volume) = volume(&json["boundingVolume"]) else {
            self.fault(&place, "boundingVolume.box: expected 12 finite numbers");
            return Vec::new();
        };
        let Some(transform) = transform(json.get("transform")) else {
            self.fault(&place, "transform: expected an affine map of 16 numbers");
            return Vec::new();
        };
        let above = parent.map_or(DAffine3::IDENTITY, |parent| self.tiles[parent].to_whole);
        let index = self.tiles.len();
        let mut children = match json.get_mut("children").map(Value::take) {
            None => Vec::new(),
            Some(Value::Array(children)) if !children.is_empty() => children,
            Some(_) => {
                self.fault(&place, "children: expected tiles, or none of this name");
                Vec::new()
            }
        };
        let uri = match json.get("content") {
            None => None,
            Some(content) => match content["uri"].as_str().map(|uri| within(&file, uri)) {
                Some(Some(uri)) => Some(uri),
                _ => {
                    self.fault(&place, "content.uri: expected a path within the folder");
                    None
                }
            },
        };
        let mut below = Vec::new();
        let (mut content, mut replaced) = (None, !children.is_empty());
        match uri {
            Some(uri) if uri.ends_with(".json") => {
                if !children.is_empty() {
                    self.fault(&place, "children: expected none beside a tileset as content");
                    children.clear();
                }
                replaced = true;
                below.extend(self.open(out, &uri, Some(index)));
            }
            Some(uri) => {
                if !out.join(&uri).is_file() {
                    self.fault(&place, format!("content {uri}: expected a file, found none"));
                }
                content = Some(uri);
            }
            None => {}
        }
        below.extend(children.into_iter().zip(0..).map(|(json, number)| Next {
            json,
            file: file.clone(),
            place: format!("{place}/{number}"),
            parent: Some(index),
            root: false,
        }));
        let to_whole = above * transform;
        self.tiles.push(Seen {
            place,
            parent,
            transform,
            to_whole,
            volume,
            error,
            content,
            replaced,
        });
        below
    }
}

fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(Value::as_f64).collect();
    numbers?.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|n| n.is_finite()))
}

fn volume(value: &Value) -> Option<Volume> {
    let [x, y, z, a, b, c, d, e, f, g, h, i] = numbers(&value["box"])?;
    let half = [DVec3::new(a, b, c), DVec3::new(d, e, f), DVec3::new(g, h, i)];
    Some(Volume { centre: DVec3::new(x, y, z), half })
}

fn transform(value: Option<&Value>) -> Option<DAffine3> {
    let Some(value) = value else { return Some(DAffine3::IDENTITY) };
    let m = numbers::<16>(value)?;
    let column = |i: usize| DVec3::new(m[4 * i], m[4 * i + 1], m[4 * i + 2]);
    let matrix3 = DMat3::from_cols(column(0), column(1), column(2));
    let affine = [m[3], m[7], m[11], m[15]] == [0.0, 0.0, 0.0, 1.0];
    (affine && matrix3.determinant() != 0.0).then(|| DAffine3 { matrix3, translation: column(3) })
}

/// Where a reference of a file points, relative to the folder; `None` where that is outside.
pub(super) fn within(file: &str, uri: &str) -> Option<String> {
    let mut path = PathBuf::from(file);
    path.pop();
    for part in Path::new(uri).components() {
        match part {
            Component::Normal(name) => path.push(name),
            Component::CurDir => {}
            Component::ParentDir => path.pop().then_some(())?,
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    path.to_str().map(str::to_owned)
}
