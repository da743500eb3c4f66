//! The distance of a level to the source, two-sided, as Metro measures it (Cignoni, Rocchini and
//! Scopigno 1998): points spread by area over each surface, and all vertices, to the closest point
//! of the other.
//!
//! The front of a level consists of all its nodes and the leaves above it. From a node the
//! distance is to the whole source, since any part of it may be the nearest. From the source it is
//! to the whole front, and counts for the node above the leaf that the point lies on: that node
//! stands for it. Leaves above the level are the source itself and count as no distance.

use rayon::prelude::*;

use super::assembly::Assembly;
use super::geometry::NodeGeometry;
use super::points::Points;
use super::progress::Progress;
use super::report::Distance;
use super::sample::spread;
use super::surface::Surface;
use super::tally::Tally;
use super::tree::{at_level, front, is_leaf};
use crate::format::Scene;

/// A node of a level and its distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeDistances {
    /// The node.
    pub node: u32,
    /// From the source below it to the front.
    pub to_front: Tally,
    /// From it to the source.
    pub to_source: Tally,
}

impl NodeDistances {
    /// The larger maximum of both directions, metres.
    pub fn max(&self) -> f64 {
        self.to_front.max().max(self.to_source.max())
    }
}

/// What was measured of a level.
pub(super) struct LevelDistances {
    /// Its nodes that are no leaves, in order.
    pub nodes: Vec<NodeDistances>,
    /// From the source to the front.
    pub to_front: Tally,
    /// From the front to the source.
    pub to_source: Tally,
    /// For each point that lies below a coarse node, its number, and the node, triangle and
    /// weights of the front's closest point.
    pub closest: Vec<(u32, u32, u32, [f64; 3])>,
}

/// Measures a level. `reference` is the source, or the leaves joined.
pub(super) fn measure(
    scene: &Scene,
    level: u32,
    leaves: &[u32],
    geometry: &[NodeGeometry],
    points: &Points,
    reference: &Surface,
    seed: u64,
    progress: &dyn Progress,
) -> LevelDistances {
    let assembly = Assembly::new(front(scene, level), geometry);
    let mut place_of = vec![usize::MAX; scene.nodes.len()];
    let mut nodes: Vec<NodeDistances> = Vec::new();
    for node in front(scene, level).filter(|&node| !is_leaf(scene, node)) {
        place_of[node as usize] = nodes.len();
        let (to_front, to_source) = Default::default();
        nodes.push(NodeDistances { node, to_front, to_source });
    }

    // Leaf by leaf: sums are formed in the order of leaves, whatever thread took them.
    let from_leaves: Vec<(u32, Tally, Vec<_>)> = leaves
        .par_iter()
        .enumerate()
        .filter_map(|(place, &leaf)| {
            let above = at_level(scene, leaf, level).filter(|&node| node != leaf)?;
            let mut tally = Tally::default();
            let mut closest = Vec::new();
            for number in points.of_leaf(place) {
                let point = points.all[number].point;
                let Some(hit) = assembly.surface.closest(point) else { continue };
                tally.add(hit.distance(), point);
                let (node, triangle) = assembly.owner(hit.triangle);
                closest.push((number as u32, node, triangle, hit.weights));
            }
            for vertex in geometry[leaf as usize].surface_vertices() {
                tally.reach(assembly.surface.distance(vertex), vertex);
            }
            progress.done(1);
            Some((above, tally, closest))
        })
        .collect();
    let mut closest = Vec::new();
    for (above, tally, hits) in from_leaves {
        nodes[place_of[above as usize]].to_front.extend(&tally);
        closest.extend(hits);
    }

    let from_nodes: Vec<Tally> = nodes
        .par_iter()
        .map(|measured| {
            let node = &geometry[measured.node as usize];
            let mut tally = Tally::default();
            // Draws that differ from level to level.
            let stream = scene.nodes[measured.node as usize].id;
            for sample in spread(node.surface(), points.density, seed, stream) {
                tally.add(reference.distance(sample.point), sample.point);
            }
            for vertex in node.surface_vertices() {
                tally.reach(reference.distance(vertex), vertex);
            }
            progress.done(1);
            tally
        })
        .collect();
    let (mut to_front, mut to_source) = <(Tally, Tally)>::default();
    for (node, tally) in nodes.iter_mut().zip(from_nodes) {
        node.to_source = tally;
        to_front.extend(&node.to_front);
        to_source.extend(&node.to_source);
    }
    for (place, &leaf) in leaves.iter().enumerate() {
        if scene.nodes[leaf as usize].level <= level {
            let count = points.of_leaf(place).len() as u64;
            to_front.add_zeros(count);
            to_source.add_zeros(count);
        }
    }
    LevelDistances { nodes, to_front, to_source, closest }
}

/// A tally in metres and in units of 1e-4 of a diagonal.
pub(super) fn figures(tally: &Tally, diagonal: f64) -> Distance {
    let unit = if diagonal > 0.0 { 1e4 / diagonal } else { 0.0 };
    Distance {
        samples: tally.count(),
        mean: tally.mean(),
        rms: tally.rms(),
        max: tally.max(),
        mean_relative: tally.mean() * unit,
        rms_relative: tally.rms() * unit,
        max_relative: tally.max() * unit,
    }
}

/// The larger of two distances, figure by figure.
pub(super) fn larger(a: &Distance, b: &Distance) -> Distance {
    Distance {
        samples: a.samples + b.samples,
        mean: a.mean.max(b.mean),
        rms: a.rms.max(b.rms),
        max: a.max.max(b.max),
        mean_relative: a.mean_relative.max(b.mean_relative),
        rms_relative: a.rms_relative.max(b.rms_relative),
        max_relative: a.max_relative.max(b.max_relative),
    }
}
