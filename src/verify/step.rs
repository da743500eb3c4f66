//! The lattice that the nodes' coordinates lie on, and so how far they are rounded.

use std::collections::BTreeMap;

use crate::format::{Node, Scene};
use crate::lattice::{Lattice, Quantization};

/// For each node the step of its lattice in metres. Source coordinates are rounded to multiples of
/// it: by half a step at most along each axis.
///
/// A quantised build's step is among the parameters. Otherwise, or where blocks are too large for
/// that, it is not stored. It follows from the largest extent of a block and the largest
/// coordinate, as [`Lattice::for_extent`] says; a block of strays has its own. Where
/// an extent is a power of two to a millionth, the result may be twice the real step. Nodes above blocks
/// are all taken to have the lattice of the largest.
pub(super) fn steps(scene: &Scene) -> Vec<f64> {
    let quantization = Quantization::of(&scene.parameters);
    let fine = fine_lattices(scene).into_iter();
    fine.map(|fine| fine.or_coarser(quantization).step).collect()
}

/// For each node how far along each axis a vertex of it may be off the source's, metres: half of its lattice's
/// step.
pub(super) fn vertex_bounds(scene: &Scene) -> Vec<f64> {
    steps(scene).into_iter().map(|step| 0.5 * step).collect()
}

/// The same without regard to quantisation: how closely nodes meet whatever the lattice is, since
/// all of them lie on it.
pub(super) fn fine_steps(scene: &Scene) -> Vec<f64> {
    fine_lattices(scene).into_iter().map(|fine| fine.step).collect()
}

/// Nodes with a common lattice.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Group {
    Blocks,
    /// A block of strays.
    FarOff(u32),
    Above,
}

/// Returns the lattice of each node.
fn fine_lattices(scene: &Scene) -> Vec<Lattice> {
    let is_far_off = |block: u32| {
        scene.blocks.get(block as usize).is_some_and(|block| block.name.ends_with("(far off)"))
    };
    let group_of = |block: Option<u32>| match block {
        Some(block) if is_far_off(block) => Group::FarOff(block),
        Some(_) => Group::Blocks,
        None => Group::Above,
    };
    // Boxes of the leaves by origin: a block, or an upper node. Coarse nodes may extend beyond the source.
    let mut boxes: BTreeMap<(Group, u32), [[f64; 3]; 2]> = BTreeMap::new();
    let mut add = |of: (Group, u32), node: &Node| {
        let [low, high] = boxes.entry(of).or_insert([node.bbox_min, node.bbox_max]);
        for axis in 0..3 {
            low[axis] = low[axis].min(node.bbox_min[axis]);
            high[axis] = high[axis].max(node.bbox_max[axis]);
        }
    };
    for node in &scene.nodes {
        if let (Some(block), None) = (node.block, node.first_child) {
            add((group_of(node.block), block), node);
        }
        let above = node.parent.filter(|&at| scene.nodes[at as usize].block.is_none());
        if let Some(above) = above {
            add((Group::Above, above), node);
        }
    }
    let mut groups: BTreeMap<Group, [f64; 2]> = BTreeMap::new();
    for ((group, _), [low, high]) in boxes {
        let [extent, magnitude] = groups.entry(group).or_default();
        for axis in 0..3 {
            *extent = extent.max(high[axis] - low[axis]);
            *magnitude = magnitude.max(low[axis].abs()).max(high[axis].abs());
        }
    }
    let lattice = |node: &Node| {
        let [extent, magnitude] = groups.get(&group_of(node.block)).copied().unwrap_or_default();
        Lattice::for_extent(extent * (1.0 + 1e-6), magnitude)
    };
    scene.nodes.iter().map(lattice).collect()
}
