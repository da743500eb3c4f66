//! Checks a tileset on the disk: what the specification demands, and that it is the scene's.

use std::collections::BTreeMap;
use std::path::Path;

use glam::DVec3;

pub use super::walk::Fault;
use super::walk::{Seen, Walk};
use crate::Result;
use crate::format::{NODES_DIR, Node, Scene};
use crate::place::{Globe, Placement, corners, z_up};

/// Metres that a box may reach out of another, beside the digits that numbers have.
const SLACK: f64 = 1e-8;
/// Digits of the coordinates in a tileset.
const PRECISION: f64 = 1e-12;
/// Metres that a leaf may be farther from its place than the tileset says: it was measured at other
/// points.
const ROUNDING: f64 = 2e-4;

/// What does not hold, and what was found.
#[derive(Debug, Default)]
pub struct Checked {
    /// Number of tiles.
    pub tiles: usize,
    /// Number of tileset files.
    pub files: usize,
    /// Largest distance of a leaf's corner from where its coordinates belong on the Earth, metres;
    /// `None` for a city without a place.
    pub placed_within: Option<f64>,
    /// What does not hold.
    pub faults: Vec<Fault>,
}

/// Checks the tileset in an output folder against the specification and the scene beside it.
pub fn check(out: &Path, scene: &Scene, placement: &Placement) -> Result<Checked> {
    let globe = placement.globe()?;
    let mut walk = Walk::new(out);
    let mut faults = std::mem::take(&mut walk.faults);
    let errors = scene.viewer_errors();
    let nodes = scene.nodes.iter().zip(errors);
    let nodes: BTreeMap<String, (&Node, f64)> =
        nodes.map(|(node, error)| (format!("{NODES_DIR}/{}", node.file), (node, error))).collect();
    let mut shown: BTreeMap<&str, usize> = BTreeMap::new();
    let mut placed_within = globe.as_ref().map(|_| 0.0);
    for tile in &walk.tiles {
        let mut fault = |what| faults.push(Fault { place: tile.place.clone(), what });
        if let Some(above) = tile.parent.map(|parent| &walk.tiles[parent]) {
            against_parent(tile, above).into_iter().for_each(&mut fault);
        }
        let Some(content) = &tile.content else { continue };
        *shown.entry(content).or_default() += 1;
        let Some(&(node, error)) = nodes.get(content) else {
            fault(format!("content {content}: expected a node of the scene"));
            continue;
        };
        if tile.error != error {
            fault(format!("geometricError: expected the node's {error}, found {}", tile.error));
        }
        if tile.replaced != node.first_child.is_some() {
            fault("children: expected as the scene has them".into());
        }
        let (low, high) = z_up(scene.up, node.bbox_min, node.bbox_max);
        let slack = slack(low.abs().max(high.abs()).max_element());
        let out = corners(low, high).map(|corner| tile.volume.outside(corner));
        let out = out.into_iter().fold(0.0, f64::max);
        if out > slack {
            fault(format!("content {content} reaches {out} m out of the tile's box"));
        }
        if let (Some(globe), false) = (&globe, tile.replaced) {
            let off = misplaced(globe, tile, low, high);
            placed_within = placed_within.map(|most: f64| most.max(off));
        }
    }
    for (content, count) in nodes.keys().map(|name| (name, shown.get(name.as_str()))) {
        if count != Some(&1) {
            let found = count.copied().unwrap_or(0);
            let what = format!("content {content}: expected in one tile, found in {found}");
            faults.push(Fault { place: crate::format::TILESET_FILE.into(), what });
        }
    }
    if let Some(off) = placed_within {
        let said = walk.extras["placed_within_metres"].as_f64().unwrap_or(0.0);
        if off > said + ROUNDING {
            let what = format!("a leaf is {off} m from its place, expected {said} m at most");
            faults.push(Fault { place: crate::format::TILESET_FILE.into(), what });
        }
    }
    Ok(Checked { tiles: walk.tiles.len(), files: walk.files.len(), placed_within, faults })
}

/// Errors do not grow downwards, and boxes lie within each other.
fn against_parent(tile: &Seen, above: &Seen) -> Vec<String> {
    let mut wrong = Vec::new();
    if tile.error > above.error {
        wrong.push(format!("geometricError {} is above its parent's {}", tile.error, above.error));
    }
    let magnitude = |point: DVec3| point.abs().max_element();
    let slack = slack(magnitude(tile.volume.centre).max(magnitude(tile.transform.translation)));
    let corners = tile.volume.corners().map(|corner| tile.transform.transform_point3(corner));
    let out = corners.map(|corner| above.volume.outside(corner)).into_iter().fold(0.0, f64::max);
    if out > slack {
        wrong.push(format!("its box reaches {out} m out of its parent's"));
    }
    wrong
}

fn slack(magnitude: f64) -> f64 {
    SLACK + magnitude * PRECISION
}

/// How far the corners of a box are from where they belong.
fn misplaced(globe: &Globe, tile: &Seen, low: DVec3, high: DVec3) -> f64 {
    corners(low, high)
        .into_iter()
        .map(|corner| {
            let found = tile.to_whole.transform_point3(corner);
            globe.to_ecef(corner).map_or(f64::INFINITY, |there| there.distance(found))
        })
        .fold(0.0, f64::max)
}
