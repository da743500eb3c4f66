//! Which triangles of coarse nodes are no part of their surface: skirts, which cover gaps.
//!
//! A file says which of its triangles are skirts. They show only where levels meet; the source has
//! no surface there, so they are no part of the distances between surfaces. What they promise, that
//! nothing shows between two levels, [`super::gaps`] checks. A skirt that does not lie in the plane
//! of a cut that bounds its node counts as surface, and must be as near to the source as all of it.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::sample::cross;
use super::seams::Seam;
use super::tree::{apart, is_leaf, leaves, line};
use crate::format::{Node, Scene};
use crate::mesh::box_tree::{BoxTree, Corners};

/// How far a triangle in a cutting plane may be from it, as a share of its longest edge. A border
/// vertex may lie beside the plane by a hundredth of the edge that was not split there.
const BESIDE: f64 = 0.02;

/// Cosine of the angle between its normal and the plane's, at least.
const FACING: f64 = 0.98;

/// An axis and a coordinate on it, as bits: planes are found by equality.
type Plane = (usize, u64);

/// Marks the triangles of coarse nodes that lie in a plane at which they were cut.
/// Each list of seams finds planes by itself. Leaves whose boxes touch in a plane are enough, too: a
/// source that ends on both sides of a cut has no edge in common there, yet both sides have skirts. A
/// plane that separates two nodes bounds all nodes below them.
pub(super) fn mark(
    scene: &Scene,
    geometry: &mut [NodeGeometry],
    seams: [&[Seam]; 2],
    steps: &[f64],
) {
    let mut planes: Vec<BTreeSet<Plane>> = vec![BTreeSet::new(); geometry.len()];
    let mut part = |[a, b]: [u32; 2], plane: Plane| {
        for line in apart(scene, a, b) {
            if let Some(&topmost) = line.last() {
                planes[topmost as usize].insert(plane);
            }
        }
    };
    let middles: Vec<DVec3> = geometry.par_iter().map(middle_of).collect();
    for seams in seams {
        let mut pairs: BTreeMap<[u32; 2], Vec<&Seam>> = BTreeMap::new();
        for seam in seams {
            pairs.entry(seam.leaves).or_default().push(seam);
        }
        for ([a, b], seams) in pairs {
            let sides = [a, b].map(|leaf| LeafSide {
                node: &scene.nodes[leaf as usize],
                middle: middles[leaf as usize],
            });
            if let Some(plane) = plane_between(&seams, sides, steps[a as usize]) {
                part([a, b], plane);
            }
        }
    }
    for axis in 0..3 {
        for (leaves, coordinate) in touching_leaves(scene, axis) {
            part(leaves, (axis, coordinate.to_bits()));
        }
    }
    geometry.par_iter_mut().enumerate().for_each(|(number, node)| {
        if is_leaf(scene, number as u32) {
            return;
        }
        let planes: Vec<&Plane> =
            line(scene, number as u32).flat_map(|node| &planes[node as usize]).collect();
        let in_cut_plane = |(&skirt, &triangle): (&bool, &[u32; 3])| {
            let corners = node.corners(triangle);
            skirt && planes.iter().any(|plane| lies_in(corners, plane, steps[number]))
        };
        node.in_cut_plane = node.skirts.iter().zip(&node.triangles).map(in_cut_plane).collect();
    });
}

/// Pairs of leaves of which the one's box ends just where the other's begins along an axis, and the
/// coordinate. A leaf that is flat along the axis, as of a wall that lies in the plane, must face the
/// other: one that only passes it by was cut off elsewhere.
fn touching_leaves(scene: &Scene, axis: usize) -> Vec<([u32; 2], f64)> {
    let node = |leaf: u32| &scene.nodes[leaf as usize];
    let is_flat = |leaf: u32| node(leaf).bbox_max[axis] <= node(leaf).bbox_min[axis];
    let begins = |leaf: u32| node(leaf).bbox_min[axis] + 0.0;
    let mut leaves = leaves(scene);
    leaves.sort_by(|&a, &b| begins(a).total_cmp(&begins(b)));
    // The sides at which they begin.
    let side = |&leaf: &u32| {
        let (mut low, mut high) = (node(leaf).bbox_min, node(leaf).bbox_max);
        (low[axis], high[axis]) = (begins(leaf), begins(leaf));
        [low, high]
    };
    let sides = BoxTree::new(leaves.iter().map(side).collect());
    let beside = |&a: &u32| {
        let end = node(a).bbox_max[axis] + 0.0;
        let range = |at: usize| match at == axis {
            true => [end, end],
            false => [node(a).bbox_min[at], node(a).bbox_max[at]],
        };
        let touches = |bounds: &Corners| {
            (0..3).all(|at| {
                let [low, high] = range(at);
                low <= bounds[1][at] && bounds[0][at] <= high
            })
        };
        let faces = |b: u32| {
            (0..3).filter(|&at| at != axis).all(|at| {
                node(a).bbox_min[at] < node(b).bbox_max[at]
                    && node(b).bbox_min[at] < node(a).bbox_max[at]
            })
        };
        let is_apart = |&number: &usize| {
            let b = leaves[number];
            match (is_flat(a), is_flat(b)) {
                (false, false) => true,
                (true, true) => false,
                _ => faces(b),
            }
        };
        let mut found: Vec<usize> = sides.matching(touches).filter(is_apart).collect();
        found.sort_unstable();
        found.into_iter().map(|number| ([a, leaves[number]], end)).collect::<Vec<_>>()
    };
    leaves.par_iter().flat_map_iter(beside).collect()
}

/// Whether a triangle of a node with this lattice step lies in a plane.
fn lies_in(corners: [DVec3; 3], &(axis, bits): &Plane, step: f64) -> bool {
    let coordinate = f64::from_bits(bits);
    let [a, b, c] = corners;
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let beside = 2.0 * step + BESIDE * longest;
    let normal = cross(corners);
    normal[axis].abs() >= FACING * normal.length()
        && corners.iter().all(|corner| (corner[axis] - coordinate).abs() <= beside)
}

/// A leaf beside a plane.
#[derive(Clone, Copy)]
struct LeafSide<'a> {
    node: &'a Node,
    /// The middle of its surface.
    middle: DVec3,
}

/// The mean of a node's surface. The middle of its box would say little where a single body reaches far
/// beyond the plane.
fn middle_of(geometry: &NodeGeometry) -> DVec3 {
    let (mut sum, mut area) = (DVec3::ZERO, 0.0);
    for &triangle in &geometry.triangles {
        let corners = geometry.corners(triangle);
        let own = cross(corners).length();
        sum += corners.into_iter().sum::<DVec3>() / 3.0 * own;
        area += own;
    }
    if area > 0.0 { sum / area } else { DVec3::NAN }
}

/// The plane that holds most of the edges between two leaves and separates the middles of their surfaces.
fn plane_between(seams: &[&Seam], [a, b]: [LeafSide; 2], step: f64) -> Option<Plane> {
    let mut best: Option<(f64, Plane)> = None;
    for axis in 0..3 {
        let middle = |leaf: LeafSide| leaf.middle[axis];
        let (low, high) = if middle(a) <= middle(b) { (a, b) } else { (b, a) };
        let mut counts: BTreeMap<u64, usize> = BTreeMap::new();
        for seam in seams {
            let [from, to] = seam.ends.map(|end| end[axis] + 0.0);
            if from == to {
                *counts.entry(from.to_bits()).or_default() += 1;
            }
        }
        let Some((&bits, &count)) = counts.iter().max_by_key(|(_, count)| **count) else {
            continue;
        };
        // Vertices near the plane count as on it, so a few edges lie beside it, and small bodies
        // are not cut at all: boxes may overlap, but most of each surface is on its own side. Leaves
        // that are flat along the axis are not cut across it.
        let coordinate = f64::from_bits(bits);
        let side = |leaf: LeafSide| leaf.node.bbox_max[axis] - leaf.node.bbox_min[axis];
        let slack = 4.0 * step + BESIDE * side(a).min(side(b));
        let between = middle(low) < coordinate - slack && middle(high) > coordinate + slack;
        let apart = middle(high) - middle(low);
        if between && 2 * count >= seams.len() && best.is_none_or(|(most, _)| apart > most) {
            best = Some((apart, (axis, bits)));
        }
    }
    best.map(|(_, plane)| plane)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::test_scene::scene;
    use crate::scaling::assert_scales;

    #[test]
    fn the_plane_is_found_beside_other_coordinates_that_edges_share() {
        let node = |low: [f64; 3], high: [f64; 3]| Node {
            bbox_min: low,
            bbox_max: high,
            ..scene().nodes[0].clone()
        };
        let seam = |from: [f64; 3], to: [f64; 3]| Seam {
            ends: [DVec3::from(from), DVec3::from(to)],
            leaves: [0, 1],
        };
        let flat = [node([0.0; 3], [5.0, 9.0, 0.0]), node([5.0, 0.0, 0.0], [11.0, 9.0, 0.0])];
        let seams =
            [seam([5.0, 0.0, 0.0], [5.0, 4.0, 0.0]), seam([5.0, 4.0, 0.0], [5.0, 9.0, 0.0])];
        let seams: Vec<&Seam> = seams.iter().collect();
        let sides = |[a, b]: [f64; 2]| {
            let side = |node, x| LeafSide { node, middle: DVec3::new(x, 4.5, 0.0) };
            [side(&flat[0], a), side(&flat[1], b)]
        };
        let found = plane_between(&seams, sides([2.5, 8.0]), 1e-6);
        assert_eq!(found, Some((0, 5f64.to_bits())), "not z = 0, where all is");
        let beside = seam([5.01, 0.0, 0.0], [5.02, 4.0, 1.0]);
        assert_eq!(plane_between(&[&beside], sides([2.5, 8.0]), 1e-6), None);
        assert_eq!(plane_between(&seams, sides([6.0, 8.0]), 1e-6), None, "both beyond it");
    }

    #[test]
    fn the_middle_of_a_surface_is_where_most_of_it_is() {
        let square = |x: f32, side: f32| {
            [[x, 0.0, 0.0], [x + side, 0.0, 0.0], [x + side, side, 0.0], [x, side, 0.0]]
        };
        let geometry = NodeGeometry {
            positions: [square(0.0, 4.0), square(20.0, 1.0)].concat(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            ..NodeGeometry::default()
        };
        let middle = middle_of(&geometry);
        assert!((middle.x - (2.0 * 16.0 + 20.5) / 17.0).abs() < 1e-9, "{middle}");
    }

    /// Leaves in one square layer, side by side.
    #[test]
    fn time_scales_with_the_leaves_that_begin_in_a_plane() {
        let layer = |count: usize| {
            let leaf = |number: usize| Node {
                parent: None,
                first_child: None,
                next_sibling: None,
                bbox_min: [(number % 2) as f64, (number / 2) as f64, 0.0],
                bbox_max: [(number % 2 + 1) as f64, (number / 2 + 1) as f64, 1.0],
                ..scene().nodes[0].clone()
            };
            Scene { nodes: (0..count).map(leaf).collect(), ..scene() }
        };
        assert_scales(1000, layer, |scene| {
            assert!(touching_leaves(&scene, 0).len() >= scene.nodes.len() / 2);
        });
    }

    /// Two coarse nodes, 1 and 2, with a leaf each, 3 and 4, apart at x = 5.
    fn apart_at_5() -> Scene {
        let node = |parent, first_child, next_sibling, low: f64, high: f64| Node {
            parent,
            first_child,
            next_sibling,
            bbox_min: [low, 0.0, 0.0],
            bbox_max: [high, 9.0, 4.0],
            ..scene().nodes[0].clone()
        };
        let nodes = vec![
            node(None, Some(1), None, 0.0, 11.0),
            node(Some(0), Some(3), Some(2), 0.0, 5.0),
            node(Some(0), Some(4), None, 5.0, 11.0),
            node(Some(1), None, None, 0.0, 5.0),
            node(Some(2), None, None, 5.0, 11.0),
        ];
        Scene { nodes, ..scene() }
    }

    /// What a source has on one side of a cut need not have an edge in common with what it has on the
    /// other.
    #[test]
    fn nodes_are_apart_where_their_leaves_touch() {
        let scene = apart_at_5();
        assert_eq!(touching_leaves(&scene, 0), [([3, 4], 5.0)]);
        assert_eq!(touching_leaves(&scene, 1), []);
        let changed = |change: &dyn Fn(&mut Node)| {
            let mut scene = scene.clone();
            change(&mut scene.nodes[4]);
            touching_leaves(&scene, 0)
        };
        assert_eq!(changed(&|node| node.bbox_min[0] = 5.004), []);
        assert_eq!(changed(&|node| node.bbox_min[1] = 9.1), [], "passes it by");
        assert_eq!(changed(&|node| node.bbox_max[0] = 5.0), [([3, 4], 5.0)], "a wall in the plane");
        let flat_beside = |node: &mut Node| {
            node.bbox_max[0] = 5.0;
            (node.bbox_min[1], node.bbox_max[1]) = (9.0, 12.0);
        };
        assert_eq!(changed(&flat_beside), [], "a wall that goes on from it");

        let upright = [[5.0, 0.0, 1.0], [5.0, 9.0, 1.0], [5.0, 9.0, 3.0]];
        let with_skirt = NodeGeometry {
            positions: upright.to_vec(),
            triangles: vec![[0, 1, 2]],
            skirts: vec![true],
            ..NodeGeometry::default()
        };
        let apart = {
            let mut scene = scene.clone();
            scene.nodes[4].bbox_min[0] = 5.1;
            scene
        };
        for (scene, is_surface) in [(apart, true), (scene, false)] {
            let mut geometry = vec![NodeGeometry::default(); 5];
            geometry[1] = with_skirt.clone();
            mark(&scene, &mut geometry, [&[], &[]], &[1e-6; 5]);
            assert_eq!(geometry[1].is_surface(0), is_surface);
        }
    }

    /// Two coarse nodes with a leaf each, apart at x = 5; the first has two triangles in that plane,
    /// which are skirts where its file says so.
    #[test]
    fn skirts_count_as_none_only_in_a_plane_that_bounds_their_node() {
        let scene = apart_at_5();
        let seams =
            [Seam { ends: [DVec3::new(5.0, 0.0, 0.0), DVec3::new(5.0, 9.0, 0.0)], leaves: [3, 4] }];
        let floor = |x: f32| [[x, 0.0, 0.0], [x + 5.0, 0.0, 0.0], [x + 5.0, 9.0, 0.0]];
        let upright = [[5.0, 0.0, 1.0], [5.0, 9.0, 1.0], [5.0, 9.0, 3.0], [5.0, 0.0, 3.0]];
        let geometry_of = |parts: &[&[[f32; 3]]]| {
            let mut geometry = NodeGeometry::default();
            for part in parts {
                let first = geometry.positions.len() as u32;
                geometry.positions.extend_from_slice(part);
                let fan = (1..part.len() as u32 - 1).map(|v| [first, first + v, first + v + 1]);
                geometry.triangles.extend(fan);
            }
            geometry
        };
        let [ground, far] = [floor(0.0), floor(5.0)];
        for (skirts, expected) in [
            ([false, true, true], [false, true, true]),
            ([false; 3], [false; 3]),
            ([true; 3], [false, true, true]),
        ] {
            let mut geometry = vec![
                NodeGeometry::default(),
                geometry_of(&[&ground, &upright]),
                geometry_of(&[&far]),
                geometry_of(&[&ground]),
                geometry_of(&[&far]),
            ];
            geometry[1].skirts = skirts.to_vec();
            mark(&scene, &mut geometry, [&seams, &[]], &[1e-6; 5]);
            let marked: Vec<bool> = (0..3).map(|t| !geometry[1].is_surface(t)).collect();
            assert_eq!(marked, expected, "{skirts:?}");
        }
    }
}
