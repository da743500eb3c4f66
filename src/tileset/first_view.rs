//! Counts what a viewer loads and draws for the first complete picture of the whole.

use std::collections::BTreeSet;
use std::path::Path;

use glam::DVec3;
use serde::Serialize;
use serde_json::Value;

use super::walk::{Seen, Walk};
use crate::format::read_regular;

/// The number of rows of the picture.
const ROWS: f64 = 1080.0;

/// A tile is drawn where its error is at most so many pixels, as CesiumJS has it by default.
const MOST_PIXELS: f64 = 16.0;

/// The whole is seen from 45 degrees above, from so many radii of the sphere around it, which then fits a vertical
/// field of 60 degrees.
const DISTANCE: f64 = 2.0;

/// The needs of the first picture: 1,080 rows, the whole in view, 16 pixels of error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FirstView {
    /// Files that are loaded: tilesets, tiles that are drawn or above these, and images beside them.
    pub requests: usize,
    /// The bytes of these files.
    pub bytes: u64,
    /// Tiles that are drawn.
    pub tiles: usize,
    /// Draw calls of these: their primitives.
    pub draws: usize,
}

impl FirstView {
    /// Counts them for the tileset of an output folder. Tiles that do not hold what the specification asks for are
    /// left out; [`super::check`] finds them.
    pub fn of(out: &Path) -> Self {
        let Walk { tiles, files, .. } = Walk::new(out);
        let Some(eye) = tiles.first().map(eye) else { return Self::default() };
        let mut is_loaded = vec![false; tiles.len()];
        let mut first = Self::default();
        let mut requested: BTreeSet<String> = BTreeSet::new();
        for (number, tile) in tiles.iter().enumerate() {
            let file = file_of(tile);
            // A tile that refers to another file is not drawn itself.
            let is_refined = |above: usize| {
                let is_coarse = || pixels(&tiles[above], eye) > MOST_PIXELS;
                is_loaded[above] && (file_of(&tiles[above]) != file || is_coarse())
            };
            is_loaded[number] = tile.parent.is_none_or(is_refined);
            if !is_loaded[number] {
                continue;
            }
            if files.contains(file) {
                requested.insert(file.into());
            }
            let Some(content) = &tile.content else { continue };
            let (primitives, images) = contents(out, content);
            requested.extend(images);
            requested.insert(content.clone());
            if !tile.replaced || pixels(tile, eye) <= MOST_PIXELS {
                first.tiles += 1;
                first.draws += primitives;
            }
        }
        first.requests = requested.len();
        let bytes = |file: &String| out.join(file).metadata().map_or(0, |file| file.len());
        first.bytes = requested.iter().map(bytes).sum();
        first
    }
}

/// Returns the file that a tile is in.
fn file_of(tile: &Seen) -> &str {
    tile.place.split(' ').next().unwrap_or_default()
}

/// Returns the point from which the whole is seen.
fn eye(root: &Seen) -> DVec3 {
    let volume = root.volume;
    let radius = volume.corners().iter().map(|c| c.distance(volume.centre)).fold(0.0, f64::max);
    let aside = DVec3::new(0.0, -1.0, 1.0).normalize();
    root.to_whole.transform_point3(volume.centre + aside * radius * DISTANCE)
}

/// Returns the error of a tile in pixels.
fn pixels(tile: &Seen, eye: DVec3) -> f64 {
    let distance = tile.volume.distance(tile.to_whole.inverse().transform_point3(eye));
    // At a distance of 1, half of the rows cover the tangent of 30 degrees.
    let rows = ROWS * 0.5 * 3.0f64.sqrt();
    tile.error * rows / distance.max(f64::MIN_POSITIVE)
}

/// Returns the number of primitives of a GLB, and the images beside it; none if it cannot be read.
fn contents(out: &Path, file: &str) -> (usize, Vec<String>) {
    let read = || -> Option<Value> {
        let bytes = read_regular(&out.join(file)).ok()?;
        let length = u32::from_le_bytes(bytes.get(12..16)?.try_into().ok()?) as usize;
        serde_json::from_slice(bytes.get(20..20usize.checked_add(length)?)?).ok()
    };
    let Some(json) = read() else { return (0, Vec::new()) };
    let list = |name: &str| json[name].as_array().map_or(&[][..], Vec::as_slice);
    let primitives =
        list("meshes").iter().map(|mesh| mesh["primitives"].as_array().map_or(0, Vec::len)).sum();
    let images = list("images").iter().filter_map(|image| image["uri"].as_str());
    (primitives, images.filter_map(|uri| super::walk::within(file, uri)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a tileset of a box of 80 by 60 m: a root with this error, two leaves in another file, and an image that
    /// all tiles share.
    fn written(error: f64) -> tempfile::TempDir {
        let out = tempfile::tempdir().unwrap();
        let volume = serde_json::json!({ "box": [40, 30, 0, 40, 0, 0, 0, 30, 0, 0, 0, 0] });
        let tile = |error: f64, uri: &str| {
            serde_json::json!({
                "boundingVolume": volume, "geometricError": error, "refine": "REPLACE",
                "content": { "uri": uri }
            })
        };
        let file = |name: &str, root: Value| {
            let asset = serde_json::json!({ "version": "1.1" });
            let json = serde_json::json!({ "asset": asset, "geometricError": 1e3, "root": root });
            std::fs::write(out.path().join(name), json.to_string()).unwrap();
        };
        let mut root = tile(error, "root.glb");
        root["children"] = Value::Array(vec![tile(error, "below.json")]);
        file("tileset.json", root);
        let mut below = tile(error, "below.glb");
        below["children"] = Value::Array(vec![tile(0.0, "a.glb"), tile(0.0, "b.glb")]);
        file("below.json", below);
        for (name, primitives) in [("root", 1), ("below", 2), ("a", 4), ("b", 8)] {
            let json = serde_json::json!({
                "meshes": [{ "primitives": vec![serde_json::json!({}); primitives] }],
                "images": [{ "uri": "shared.jpg" }]
            });
            let json = json.to_string();
            let mut bytes = vec![0; 12];
            bytes.extend((json.len() as u32).to_le_bytes());
            bytes.extend(*b"JSON");
            bytes.extend(json.bytes());
            std::fs::write(out.path().join(format!("{name}.glb")), bytes).unwrap();
        }
        std::fs::write(out.path().join("shared.jpg"), [0; 1000]).unwrap();
        out
    }

    #[test]
    fn what_is_refined_is_loaded_and_what_is_not_is_drawn() {
        // The sphere has a radius of 50 m. At 100 m, 45 degrees up, the box is 81 m away, so that 16 pixels
        // of 1,080 rows are 1.4 m.
        let one = FirstView::of(written(1.3).path());
        assert_eq!((one.requests, one.tiles, one.draws), (3, 1, 1));
        let all = FirstView::of(written(1.5).path());
        assert_eq!((all.requests, all.tiles, all.draws), (7, 2, 12));
        assert!(all.bytes > one.bytes && one.bytes > 1000, "{} {}", all.bytes, one.bytes);
    }
}
