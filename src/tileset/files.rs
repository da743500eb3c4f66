//! Tiles as JSON: one file for a small city; for a large one a file for the top, and others for
//! regions, which a viewer reads when it comes near.

use glam::{DAffine3, DVec3};
use serde_json::{Map, Value, json};

use super::VERSION;
use super::placed::place;
use super::regions::root;
use super::tile::Tile;
use crate::format::{COPYRIGHT, Scene, TILESET_FILE, TILESETS_DIR};
use crate::lattice::Quantization;
use crate::place::Placement;
use crate::{Error, Result};

/// Tiles in a file, at most: about half a megabyte.
pub const MOST_TILES: usize = 2000;
/// Tiles above each other in a file, at most: readers of JSON bound how deep they go.
const DEEPEST: usize = 40;
/// Boxes are rounded outwards to a decimal below this share of the city's diagonal.
const ROUNDING: f64 = 1e-6;

/// A file of a tileset.
#[derive(Clone, Debug, PartialEq)]
pub struct TilesetFile {
    /// Relative to the output folder.
    pub path: String,
    /// JSON.
    pub bytes: Vec<u8>,
}

/// The files of a scene's tileset: `tileset.json` first. They depend on the arguments alone.
///
/// Fails where the city does not lie where its coordinates could be of.
pub fn files(scene: &Scene, placement: &Placement) -> Result<Vec<TilesetFile>> {
    files_of(scene, placement, MOST_TILES)
}

pub(super) fn files_of(
    scene: &Scene,
    placement: &Placement,
    most: usize,
) -> Result<Vec<TilesetFile>> {
    let mut root = root(scene);
    let mut extras = json!({
        "generator": concat!("hlod ", env!("CARGO_PKG_VERSION")),
        "fingerprint": blake3::Hash::from(scene.fingerprint).to_hex().as_str(),
        "up": scene.up,
        "parameters": scene.parameters,
    });
    if let Some(copyright) = scene.copyright() {
        extras[COPYRIGHT] = json!(copyright);
        // CesiumJS shows these; those of glTF only while a node is drawn.
        let credits: Vec<Value> =
            copyright.split("; ").map(|notice| json!({ "html": escaped(notice) })).collect();
        extras["cesium"] = json!({ "credits": credits });
    }
    if let Some(quantization) = Quantization::of(&scene.parameters) {
        extras["quantized"] =
            json!({ "step_metres": quantization.step, "bound_metres": quantization.bound() });
    }
    if let Some(globe) = placement.globe()? {
        let beyond = || Error::Usage("coordinates have no place on the Earth".into());
        let residual = place(&mut root, &globe).ok_or_else(beyond)?;
        extras["placed_within_metres"] = json!(rounded_up(residual));
        if let Some(caveat) = globe.caveat() {
            extras["placement_caveat"] = json!(caveat);
        }
    }
    let extent = root.low.distance(root.high).max(f64::MIN_POSITIVE);
    let digits = -(extent * ROUNDING).log10().floor().clamp(-9.0, 0.0) as i32;
    let per_metre = 10f64.powi(digits);
    root.enclose(per_metre);

    let mut files = Vec::new();
    let mut writer = Writer { most, per_metre, files: &mut files };
    let tile = writer.tile(root, 0);
    let whole = writer.document(tile.json, extras)?;
    files.insert(0, TilesetFile { path: TILESET_FILE.into(), bytes: whole });
    Ok(files)
}

/// Text as HTML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Two digits are enough of a bound, and no more are known of one that was sampled.
fn rounded_up(metres: f64) -> f64 {
    (metres * 1e4).ceil() / 1e4
}

struct Writer<'a> {
    most: usize,
    /// Steps of the boxes' corners; a power of ten.
    per_metre: f64,
    files: &'a mut Vec<TilesetFile>,
}

/// A tile as JSON that stands in no file yet.
struct Pending {
    json: Value,
    /// Tiles in it that are in the same file.
    tiles: usize,
    /// How many are above each other.
    depth: usize,
    /// What the tile's parent needs to know of it to refer to its file.
    frame: Option<Value>,
}

impl Writer<'_> {
    /// From the leaves up, each tile takes its children into its file until there are too many;
    /// then the largest of them become files.
    fn tile(&mut self, tile: Tile, depth: usize) -> Pending {
        let Tile { low, high, error, distances, content, transform, children, .. } = tile;
        let mut below: Vec<Pending> =
            children.into_iter().map(|child| self.tile(child, depth + 1)).collect();
        loop {
            let tiles: usize = below.iter().map(|child| child.tiles).sum();
            let deepest = below.iter().map(|child| child.depth).max().unwrap_or(0);
            let too_deep = deepest >= DEEPEST;
            if tiles < self.most && !too_deep {
                break;
            }
            let weight = |child: &Pending| if too_deep { child.depth } else { child.tiles };
            // The first of the largest.
            let largest = (0..below.len()).rev().max_by_key(|&child| weight(&below[child]));
            match largest {
                Some(child) if below[child].tiles > 1 => self.set_apart(&mut below[child]),
                _ => break,
            }
        }
        let mut json = Map::new();
        let frame = transform.map(|transform| columns(&transform));
        if let Some(frame) = &frame {
            json.insert("transform".into(), frame.clone());
        }
        json.insert("boundingVolume".into(), self.volume(low, high));
        json.insert("geometricError".into(), json!(error));
        if depth == 0 {
            json.insert("refine".into(), json!("REPLACE"));
        }
        if let Some([bound, mean, p95]) = distances.filter(|_| !below.is_empty()) {
            let extras = json!({ "boundError": bound, "meanError": mean, "p95Error": p95 });
            json.insert("extras".into(), extras);
        }
        if let Some(uri) = content {
            json.insert("content".into(), json!({ "uri": uri }));
        }
        let tiles = 1 + below.iter().map(|child| child.tiles).sum::<usize>();
        let depth = 1 + below.iter().map(|child| child.depth).max().unwrap_or(0);
        if !below.is_empty() {
            let children = below.into_iter().map(|child| child.json).collect();
            json.insert("children".into(), Value::Array(children));
        }
        Pending { json: Value::Object(json), tiles, depth, frame }
    }

    /// Moves a tile and what is below it to a file of its own, and leaves a tile that refers to
    /// it.
    fn set_apart(&mut self, pending: &mut Pending) {
        let mut root = std::mem::take(&mut pending.json);
        let mut reference = Map::new();
        if let Some(frame) = &pending.frame {
            // The transform of the tile that refers to a tileset applies to all of it.
            reference.insert("transform".into(), frame.clone());
            if let Some(root) = root.as_object_mut() {
                root.shift_remove("transform");
            }
        }
        for shared in ["boundingVolume", "geometricError"] {
            reference.insert(shared.into(), root[shared].clone());
        }
        let path = format!("{TILESETS_DIR}/{}.json", self.files.len());
        reference.insert("content".into(), json!({ "uri": path }));
        root["refine"] = json!("REPLACE");
        step_out(&mut root);
        // JSON of strings and finite numbers; `document` cannot fail for it.
        let bytes = self.document(root, Value::Null).unwrap_or_default();
        self.files.push(TilesetFile { path, bytes });
        *pending = Pending { json: Value::Object(reference), tiles: 1, depth: 1, frame: None };
    }

    fn document(&self, root: Value, extras: Value) -> Result<Vec<u8>> {
        let mut asset = json!({ "version": VERSION });
        if !extras.is_null() {
            asset["extras"] = extras;
        }
        let error = root["geometricError"].clone();
        let document = json!({ "asset": asset, "geometricError": error, "root": root });
        let mut bytes = serde_json::to_vec(&document)
            .map_err(|error| Error::Internal(format!("tileset: {error}")))?;
        bytes.push(b'\n');
        Ok(bytes)
    }

    /// Centre and half axes; the numbers are multiples of half a step, but for the last digit of
    /// their binary form.
    fn volume(&self, low: DVec3, high: DVec3) -> Value {
        let centre = (low + high) * 0.5;
        let half = (high - low) * 0.5;
        let short = |value: f64| {
            let steps = 2.0 * self.per_metre;
            (value * steps).round() / steps
        };
        let [x, y, z] = centre.to_array().map(short);
        let [a, b, c] = half.to_array().map(short);
        json!({ "box": [x, y, z, a, 0, 0, 0, b, 0, 0, 0, c] })
    }
}

/// Contents of a tileset in a folder are found from there.
fn step_out(tile: &mut Value) {
    if let Some(uri) = tile.pointer("/content/uri").and_then(Value::as_str) {
        tile["content"]["uri"] = json!(format!("../{uri}"));
    }
    for child in tile.get_mut("children").and_then(Value::as_array_mut).into_iter().flatten() {
        step_out(child);
    }
}

fn columns(map: &DAffine3) -> Value {
    let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis];
    let t = map.translation;
    json!([x.x, x.y, x.z, 0.0, y.x, y.y, y.z, 0.0, z.x, z.y, z.z, 0.0, t.x, t.y, t.z, 1.0])
}
