//! The distance of a level to the source, two-sided, as Metro measures it (Cignoni, Rocchini and
//! Scopigno 1998): points spread by area over each surface, and all vertices, to the closest point
//! of the other.
//!
//! From a node the distance is to the whole source, since any part of it may be the nearest. From
//! the source it is to the whole front, and counts for the node above the leaf that the point lies
//! on: that node stands for it. Leaves in the front are the source itself and count as no distance.

use glam::DVec3;
use rayon::prelude::*;

use super::assembly::Assembly;
use super::distance_stats::DistanceStats;
use super::front::Front;
use super::geometry::NodeGeometry;
use super::node_textures::NodePoint;
use super::points::Points;
use super::progress::Progress;
use super::report::Distance;
use super::sample::{cross, spread};
use super::tree::is_leaf;
use crate::format::Scene;
use crate::mesh::Surface;

/// A node of a front and its distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeDistances {
    /// The node.
    pub node: u32,
    /// From the source below it to the front.
    pub to_front: DistanceStats,
    /// From it to the source.
    pub to_source: DistanceStats,
}

/// The point of a front that stands for one of the leaves: the nearest, where those that face
/// another way count as farther.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShownAt {
    /// The node that has it.
    pub node: u32,
    /// Its triangle and weights there.
    pub at: NodePoint,
}

/// A surface stands for another if the cosine of the angle between their normals is at least this: a
/// flat roof for a gable, but no wall for a floor.
const FACING: f64 = 0.5;

/// How many times as far a surface counts that faces another way, and by how many times more, for
/// each unit that the cosine is below 1, one that faces much the same way.
const AWAY: f64 = 8.0;
const ASIDE: f64 = 4.0;

/// What was measured of a front.
pub(super) struct FrontDistances {
    /// Its nodes that are no leaves, in order.
    pub nodes: Vec<NodeDistances>,
    /// From the source to the front.
    pub to_front: DistanceStats,
    /// From the front to the source.
    pub to_source: DistanceStats,
    /// For each point that lies below a coarse node, its number, and what the front shows there.
    pub shown: Vec<(u32, Option<ShownAt>)>,
}

/// Measures a front. `reference` is the source, or the leaves joined.
pub(super) fn measure(
    scene: &Scene,
    front: &Front,
    leaves: &[u32],
    geometry: &[NodeGeometry],
    points: &Points,
    reference: &Surface,
    seed: u64,
    progress: &dyn Progress,
) -> FrontDistances {
    let assembly = Assembly::new(front.nodes(), geometry);
    let mut place_of = vec![usize::MAX; scene.nodes.len()];
    let mut nodes: Vec<NodeDistances> = Vec::new();
    for node in front.nodes().filter(|&node| !is_leaf(scene, node)) {
        place_of[node as usize] = nodes.len();
        let (to_front, to_source) = Default::default();
        nodes.push(NodeDistances { node, to_front, to_source });
    }

    // Leaf by leaf: sums are formed in the order of leaves, whatever thread took them.
    let from_leaves: Vec<(u32, DistanceStats, Vec<_>)> = leaves
        .par_iter()
        .enumerate()
        .filter_map(|(index, &leaf)| {
            let above = front.above(scene, leaf).filter(|&node| node != leaf)?;
            let mut stats = DistanceStats::default();
            let mut shown = Vec::new();
            for number in points.of_leaf(index) {
                let point = &points.all[number];
                let Some(hit) = assembly.surface.closest(point.point) else { continue };
                stats.add(hit.distance());
                let triangle = geometry[leaf as usize].triangles[point.triangle as usize];
                let normal = normal(geometry[leaf as usize].corners(triangle));
                shown.push((number as u32, assembly.shown(point.point, normal, hit.triangle)));
            }
            for vertex in geometry[leaf as usize].surface_vertices() {
                stats.reach(assembly.surface.distance(vertex));
            }
            progress.done(1);
            Some((above, stats, shown))
        })
        .collect();
    let mut shown = Vec::new();
    for (above, stats, hits) in from_leaves {
        nodes[place_of[above as usize]].to_front.extend(&stats);
        shown.extend(hits);
    }

    let from_nodes: Vec<DistanceStats> = nodes
        .par_iter()
        .map(|measured| {
            let node = &geometry[measured.node as usize];
            let mut stats = DistanceStats::default();
            // Draws that differ from level to level, and that no path of an input decides, as
            // the ids of nodes do.
            let stream = u64::from(measured.node);
            for sample in spread(node.surface(), points.density, seed, stream) {
                stats.add(reference.distance(sample.point));
            }
            for vertex in node.surface_vertices() {
                stats.reach(reference.distance(vertex));
            }
            progress.done(1);
            stats
        })
        .collect();
    let (mut to_front, mut to_source) = <(DistanceStats, DistanceStats)>::default();
    for (node, stats) in nodes.iter_mut().zip(from_nodes) {
        node.to_source = stats;
        to_front.extend(&node.to_front);
        to_source.extend(&node.to_source);
    }
    for (index, &leaf) in leaves.iter().enumerate() {
        if front.has(leaf) {
            let count = points.of_leaf(index).len() as u64;
            to_front.add_zeros(count);
            to_source.add_zeros(count);
        }
    }
    FrontDistances { nodes, to_front, to_source, shown }
}

impl Assembly {
    /// What stands for a point of a surface that faces this way; `None` where all that is near
    /// faces another way, as at the floor of a house whose floor is gone. The search begins with
    /// triangle `first`.
    fn shown(&self, point: DVec3, facing: DVec3, first: u32) -> Option<ShownAt> {
        let cosine = |triangle: u32| normal(self.surface.corners(triangle)).dot(facing);
        let weight = |triangle: u32| match cosine(triangle) {
            cosine if cosine < FACING => AWAY,
            cosine => 1.0 + ASIDE * (1.0 - cosine),
        };
        let hit = self.surface.closest_of(point, Some(first), weight)?;
        let (node, triangle) = self.owner(hit.triangle);
        (cosine(hit.triangle) >= FACING).then_some(ShownAt { node, at: (triangle, hit.weights) })
    }
}

fn normal(corners: [DVec3; 3]) -> DVec3 {
    cross(corners).normalize_or_zero()
}

/// A stats in metres and in units of 1e-4 of a diagonal.
pub(super) fn figures(stats: &DistanceStats, diagonal: f64) -> Distance {
    let unit = if diagonal > 0.0 { 1e4 / diagonal } else { 0.0 };
    Distance {
        samples: stats.count(),
        mean: stats.mean(),
        rms: stats.rms(),
        max: stats.max(),
        mean_relative: stats.mean() * unit,
        rms_relative: stats.rms() * unit,
        max_relative: stats.max() * unit,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::test_scene::scene;
    use crate::random::Random;

    /// A bumpy sheet of `side` by `side` squares from `x` on.
    fn sheet(x: f32, side: u32, bump: f64, seed: u64) -> NodeGeometry {
        let mut random = Random::new(seed, 0);
        let mut sheet = NodeGeometry { origin: DVec3::new(7e5, 0.0, 0.0), ..Default::default() };
        for i in 0..=side {
            for j in 0..=side {
                let z = random.between(0.0, bump) as f32;
                sheet.positions.push([
                    x + i as f32 * 8.0 / side as f32,
                    j as f32 * 8.0 / side as f32,
                    z,
                ]);
            }
        }
        for at in (0..side * (side + 1)).filter(|at| at % (side + 1) != side) {
            let [a, b, c, d] = [at, at + side + 1, at + side + 2, at + 1];
            sheet.triangles.extend([[a, b, c], [a, c, d]]);
        }
        sheet
    }

    /// The distance to the nearest of some triangles: by trying all, each by its plane and sides.
    fn naive(point: DVec3, triangles: &[[DVec3; 3]]) -> f64 {
        let to_triangle = |&[a, b, c]: &[DVec3; 3]| {
            let normal = cross([a, b, c]);
            let foot = point - normal * ((point - a).dot(normal) / normal.length_squared());
            let inside = [(a, b), (b, c), (c, a)]
                .iter()
                .all(|&(from, to)| (to - from).cross(foot - from).dot(normal) >= 0.0);
            let side = |from: DVec3, to: DVec3| {
                let along = to - from;
                let t = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
                point.distance(from + along * t)
            };
            let sides = side(a, b).min(side(b, c)).min(side(c, a));
            if inside { point.distance(foot) } else { sides }
        };
        triangles.iter().map(to_triangle).fold(f64::INFINITY, f64::min)
    }

    fn all(nodes: &[&NodeGeometry]) -> Vec<[DVec3; 3]> {
        nodes.iter().flat_map(|node| node.surface().map(|(_, corners)| corners)).collect()
    }

    #[test]
    fn a_flat_roof_stands_for_a_gable_and_no_wall_for_a_floor() {
        // A wall along x from 0 to 8, 5 m high, that faces -y, and the roof behind it.
        let block = NodeGeometry {
            positions: vec![
                [0.0, 0.0, 0.0],
                [8.0, 0.0, 0.0],
                [8.0, 0.0, 5.0],
                [0.0, 0.0, 5.0],
                [8.0, 9.0, 5.0],
                [0.0, 9.0, 5.0],
            ],
            triangles: vec![[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]],
            ..NodeGeometry::default()
        };
        let assembly = Assembly::new([0].into_iter(), &[block]);
        let triangle =
            |point: DVec3, facing: DVec3| assembly.shown(point, facing, 0).map(|shown| shown.at.0);
        let gable = DVec3::new(0.0, -1.0, 1.6).normalize();
        assert!(triangle(DVec3::new(2.0, 0.7, 4.1), gable) >= Some(2), "though the wall is nearer");
        assert!(triangle(DVec3::new(2.0, 0.1, 1.0), DVec3::NEG_Y) < Some(2));
        assert_eq!(triangle(DVec3::new(2.0, 0.1, 0.0), DVec3::NEG_Z), None);
    }

    #[test]
    fn distances_are_those_of_brute_force() {
        // Nodes 2 and 3 are leaves below 1, below 0; node 4 is a leaf and a root.
        let scene = scene();
        let geometry = [
            sheet(0.0, 2, 0.4, 1),
            sheet(0.0, 3, 0.4, 2),
            sheet(0.0, 6, 0.4, 3),
            sheet(8.0, 6, 0.4, 4),
            sheet(40.0, 6, 0.4, 5),
        ];
        let leaves = [2, 3, 4];
        let points = Points::new(&leaves, &geometry, 600, 9);
        let joined = Assembly::new(leaves.into_iter(), &geometry);
        let source = all(&[&geometry[2], &geometry[3], &geometry[4]]);
        for level in 0..2u32 {
            let drawn = all(&[&geometry[level as usize], &geometry[4]]);
            let found = measure(
                &scene,
                &Front::level(&scene, level),
                &leaves,
                &geometry,
                &points,
                &joined.surface,
                9,
                &super::super::Silent,
            );
            let below = [points.of_leaf(0), points.of_leaf(1)].map(|range| &points.all[range]);
            let samples: Vec<DVec3> = below.concat().iter().map(|point| point.point).collect();
            let distances: Vec<f64> = samples.iter().map(|&p| naive(p, &drawn)).collect();
            let vertices =
                [&geometry[2], &geometry[3]].map(NodeGeometry::surface_vertices).concat();
            let max = vertices.iter().map(|&p| naive(p, &drawn)).chain(distances.iter().copied());
            let max = max.fold(0.0, f64::max);
            let mean = distances.iter().sum::<f64>() / distances.len() as f64;
            let node = found.nodes[0].to_front;
            assert_eq!(node.count(), samples.len() as u64);
            assert!((node.mean() - mean).abs() < 1e-9 && (node.max() - max).abs() < 1e-9);
            let squares = distances.iter().map(|d| d * d).sum::<f64>();
            // The leaf above the level counts as no distance.
            assert_eq!(found.to_front.count(), points.all.len() as u64);
            let rms = (squares / points.all.len() as f64).sqrt();
            assert!((found.to_front.rms() - rms).abs() < 1e-9);

            let node = &geometry[level as usize];
            let spots = spread(node.surface(), points.density, 9, u64::from(level));
            let distances = spots.iter().map(|sample| naive(sample.point, &source));
            let vertices = node.surface_vertices();
            let max = vertices.iter().map(|&p| naive(p, &source)).chain(distances.clone());
            let max = max.fold(0.0, f64::max);
            let mean = distances.sum::<f64>() / spots.len() as f64;
            let stats = found.nodes[0].to_source;
            assert!((stats.mean() - mean).abs() < 1e-9 && (stats.max() - max).abs() < 1e-9);
        }
    }
}
