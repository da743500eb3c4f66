//! The lattice that the nodes' coordinates lie on, and so how far they are rounded.

use std::collections::BTreeMap;

use super::tree::line;
use crate::format::Scene;
use crate::lattice::Lattice;
use crate::lattice::Quantization;

/// For each node the step of its lattice in metres. Source coordinates are rounded to multiples of
/// it: by half a step at most along each axis.
///
/// A quantised build's step is among the parameters. Otherwise, or where blocks are too large for
/// that, it is not stored. It follows from the largest extent of a block and the largest
/// coordinate of an input, as [`Lattice::for_extent`] says, and where there are several inputs from all of
/// each ([`Lattice::for_tile`]); a block of strays has its own. Where
/// an extent is a power of two to a millionth, the result may be twice the real step. Districts of one
/// level have one lattice; all are taken to have that of the largest.
pub(super) fn steps(scene: &Scene) -> Vec<f64> {
    let quantization = Quantization::of(&scene.parameters);
    let fine = fine_lattices(scene).into_iter();
    fine.map(|(fine, _)| fine.or_coarser(quantization).step).collect()
}

/// For each node how far along each axis a vertex of it may be off the source's, metres: half of its lattice's
/// step, and where that is coarser than the lattice of its input among several, on which vertices were before,
/// half of that one's.
pub(super) fn vertex_bounds(scene: &Scene) -> Vec<f64> {
    let quantization = Quantization::of(&scene.parameters);
    let bound = |(fine, tile): (Lattice, Option<Lattice>)| {
        let Lattice { step } = fine.or_coarser(quantization);
        let before = tile.filter(|tile| tile.step < step).map_or(0.0, |tile| tile.step);
        0.5 * (step + before)
    };
    fine_lattices(scene).into_iter().map(bound).collect()
}

/// The same without regard to quantisation: how closely nodes meet whatever the lattice is, since
/// all of them lie on it.
pub(super) fn fine_steps(scene: &Scene) -> Vec<f64> {
    fine_lattices(scene).into_iter().map(|(fine, _)| fine.step).collect()
}

/// What a node is of: a block, or where it is of none, the tree below a root.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Block {
    Number(u32),
    Root(u32),
}

/// Of each node, and that of its input where there are several.
fn fine_lattices(scene: &Scene) -> Vec<(Lattice, Option<Lattice>)> {
    // A block may have several roots.
    let block_of = |number: u32| match scene.nodes[number as usize].block {
        Some(block) => Block::Number(block),
        None => Block::Root(line(scene, number).last().unwrap_or(number)),
    };
    let of_nodes: Vec<Block> = (0..scene.nodes.len() as u32).map(block_of).collect();
    let mut boxes: BTreeMap<Block, [[f64; 3]; 2]> = BTreeMap::new();
    let mut members = Vec::new();
    for (node, &block) in scene.nodes.iter().zip(&of_nodes) {
        // Coarse nodes may reach beyond the source; leaves do not. Districts are made of coarse ones.
        let is_member = node.parent.is_some_and(|at| scene.nodes[at as usize].block.is_none());
        if is_member {
            members.push(node);
        }
        if node.first_child.is_some() {
            continue;
        }
        let [low, high] = boxes.entry(block).or_insert([node.bbox_min, node.bbox_max]);
        for axis in 0..3 {
            low[axis] = low[axis].min(node.bbox_min[axis]);
            high[axis] = high[axis].max(node.bbox_max[axis]);
        }
    }
    // Blocks that share a lattice, with the largest extent and coordinate.
    let mut groups: BTreeMap<(&str, Option<Block>), [f64; 2]> = BTreeMap::new();
    let group_of = |block: Block| {
        let Block::Number(number) = block else { return ("", None) };
        let Some(info) = scene.blocks.get(number as usize) else { return ("", None) };
        (info.input.as_str(), info.name.ends_with("(far off)").then_some(block))
    };
    for (&block, [low, high]) in &boxes {
        let [extent, magnitude] = groups.entry(group_of(block)).or_default();
        for axis in 0..3 {
            *extent = extent.max(high[axis] - low[axis]);
            *magnitude = magnitude.max(low[axis].abs()).max(high[axis].abs());
        }
    }
    let mut tiles: BTreeMap<&str, [[f64; 3]; 2]> = BTreeMap::new();
    for (&block, of_block) in &boxes {
        let [low, high] = tiles.entry(group_of(block).0).or_insert(*of_block);
        for axis in 0..3 {
            low[axis] = low[axis].min(of_block[0][axis]);
            high[axis] = high[axis].max(of_block[1][axis]);
        }
    }
    tiles.remove("");
    let is_several = tiles.len() > 1;
    let districts = groups.entry(("", None)).or_default();
    let mut of_district: BTreeMap<Option<u32>, [[f64; 3]; 2]> = BTreeMap::new();
    for member in members {
        let [low, high] =
            of_district.entry(member.parent).or_insert([member.bbox_min, member.bbox_max]);
        for axis in 0..3 {
            low[axis] = low[axis].min(member.bbox_min[axis]);
            high[axis] = high[axis].max(member.bbox_max[axis]);
            districts[0] = districts[0].max(high[axis] - low[axis]);
            districts[1] = districts[1].max(low[axis].abs()).max(high[axis].abs());
        }
    }
    of_nodes
        .iter()
        .map(|&block| {
            let group = group_of(block);
            let [extent, magnitude] = groups.get(&group).copied().unwrap_or_default();
            let fine = Lattice::for_extent(extent * (1.0 + 1e-6), magnitude);
            let of_tile = tiles.get(group.0).filter(|_| is_several).copied();
            let of_tile = of_tile.map(Lattice::for_tile);
            (of_tile.map_or(fine, |of_tile| fine.coarser(of_tile)), of_tile)
        })
        .collect()
}
