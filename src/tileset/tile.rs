//! Tiles in memory.

use glam::{DAffine3, DVec3};

use crate::format::{NODES_DIR, Scene};
use crate::place::{Fit, corners, z_up};

/// A tile with all below it.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Corners of its box, in its own coordinates: it encloses its content and all boxes below.
    pub low: DVec3,
    /// See [`Tile::low`].
    pub high: DVec3,
    /// By which a viewer chooses it, metres; never less than those below.
    pub error: f64,
    /// Bound, mean and 95th percentile of the distance to the source, metres; `None` where the tile
    /// only groups others.
    pub distances: Option<[f64; 3]>,
    /// A node's file, relative to the output folder; `None` where the tile only groups others.
    pub content: Option<String>,
    /// From its coordinates to its parent's; `None` where they are the same.
    pub transform: Option<DAffine3>,
    /// What it is replaced by.
    pub children: Vec<Tile>,
    /// From its coordinates to Earth-centred ones, where the city has a place.
    pub fit: Option<Fit>,
}

impl Tile {
    /// The tile of a node and all below it, by [`Scene::viewer_errors`].
    pub fn of_node(scene: &Scene, errors: &[f64], index: u32) -> Self {
        let node = &scene.nodes[index as usize];
        let (low, high) = z_up(scene.up, node.bbox_min, node.bbox_max);
        Self {
            low,
            high,
            error: errors[index as usize],
            distances: Some([node.geometric_error, node.mean_error, node.p95_error]),
            content: Some(format!("{NODES_DIR}/{}", node.file)),
            transform: None,
            children: scene
                .children(index)
                .map(|child| Self::of_node(scene, errors, child))
                .collect(),
            fit: None,
        }
    }

    /// Widens boxes until each encloses those below it; rounds them outwards to `per_metre` steps
    /// a metre, which makes them short to write.
    pub fn enclose(&mut self, per_metre: f64) {
        for child in &mut self.children {
            child.enclose(per_metre);
            let map = child.transform.unwrap_or(DAffine3::IDENTITY);
            for corner in corners(child.low, child.high) {
                let corner = map.transform_point3(corner);
                self.low = self.low.min(corner);
                self.high = self.high.max(corner);
            }
        }
        self.low = (self.low * per_metre).floor() / per_metre;
        self.high = (self.high * per_metre).ceil() / per_metre;
        // A flat box has no direction to look at it from.
        let step = 1.0 / per_metre;
        let flat = (self.high - self.low).cmplt(DVec3::splat(step * 0.5));
        self.low = DVec3::select(flat, self.low - step, self.low);
        self.high = DVec3::select(flat, self.high + step, self.high);
    }

    /// A tile without content over others.
    pub fn group(children: Vec<Self>) -> Self {
        let low = children.iter().fold(DVec3::INFINITY, |low, child| low.min(child.low));
        let high = children.iter().fold(DVec3::NEG_INFINITY, |high, child| high.max(child.high));
        let below = children.iter().map(|child| child.error).fold(0.0, f64::max);
        // Where it is not replaced, nothing is drawn: that is as wrong as the whole is large.
        let error = low.distance(high).max(below);
        Self {
            low,
            high,
            error,
            distances: None,
            content: None,
            transform: None,
            children,
            fit: None,
        }
    }

    /// The middle of its box.
    pub fn centre(&self) -> DVec3 {
        (self.low + self.high) * 0.5
    }
}
