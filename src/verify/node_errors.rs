//! The distance of each coarse node from the original that it stands for: the leaves below it.
//!
//! A stored error speaks of the node alone, wherever its neighbours are, and of its largest
//! distance. So both are measured here, node by node: at all vertices, and where the largest may
//! be between them, by dividing triangles (the farthest first) until no point of theirs can be
//! farther by more than [`SLACK`], or often enough. What is found is really there, so a stored error
//! below it is wrong; nothing here is taken from the builder.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::progress::Progress;
use super::tree::{is_leaf, line};
use crate::format::Scene;
use crate::mesh::Surface;

/// Triangles are divided while some point of theirs may be farther than the farthest by this share.
const SLACK: f64 = 0.02;

/// Divisions of the triangles of one surface: at least, and for each triangle.
const LEAST_DIVISIONS: usize = 20_000;
const DIVISIONS_PER_TRIANGLE: f64 = 0.25;

/// One vertex in so many is measured first: what is nearer than half of the farthest of these need not
/// be known exactly.
const SAMPLED: usize = 64;

/// Vertices that one thread measures in one go.
const CHUNK: usize = 4096;

/// The largest distance between a node and the original.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeError {
    /// The node.
    pub node: u32,
    /// From the original below it to the node, metres, and where.
    pub to_node: (f64, DVec3),
    /// From the node to the original below it.
    pub to_original: (f64, DVec3),
}

impl NodeError {
    /// The larger of both directions, metres.
    pub fn max(&self) -> f64 {
        self.to_node.0.max(self.to_original.0)
    }
}

/// Measures all coarse nodes, in order.
pub(super) fn node_errors(
    scene: &Scene,
    leaves: &[u32],
    geometry: &[NodeGeometry],
    progress: &dyn Progress,
) -> Vec<NodeError> {
    let mut below: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for &leaf in leaves {
        for node in line(scene, leaf).filter(|&node| !is_leaf(scene, node)) {
            below.entry(node).or_default().push(leaf);
        }
    }
    let measure = |(node, leaves): (u32, Vec<u32>)| {
        let simplified = joined(&[node], geometry, |_| true);
        let original = joined(&leaves, geometry, |_| true);
        // A skirt beside its plane is seen, and must be near the original; but it stands for none of it.
        let is_skirt = &geometry[node as usize].skirts;
        let bare =
            joined(&[node], geometry, |triangle| is_skirt.get(triangle as usize) != Some(&true));
        let error = NodeError {
            node,
            to_node: farthest(&original, &bare),
            to_original: farthest(&simplified, &original),
        };
        progress.done(1);
        error
    };
    below.into_iter().collect::<Vec<_>>().into_par_iter().map(measure).collect()
}

/// Several nodes as one surface, without their skirts in cutting planes; of each, the triangles that count.
fn joined(nodes: &[u32], geometry: &[NodeGeometry], counts: impl Fn(u32) -> bool) -> Surface {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for node in nodes.iter().map(|&node| &geometry[node as usize]) {
        let first = positions.len() as u32;
        positions.extend((0..node.positions.len() as u32).map(|vertex| node.position(vertex)));
        let surface = (0..)
            .zip(&node.triangles)
            .filter(|&(number, _)| node.is_surface(number) && counts(number));
        triangles.extend(surface.map(|(_, triangle)| triangle.map(|vertex| first + vertex)));
    }
    Surface::new(positions, triangles)
}

/// A point, the nearest triangle of the other surface or one that is near enough, and how far it is.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec3,
    nearest: u32,
    distance: f64,
}

impl Corner {
    /// The search begins with triangle `known`.
    fn new(at: DVec3, to: &Surface, known: u32) -> Self {
        let hit = to.closest_of(at, Some(known), |_| 1.0);
        let (nearest, distance) = hit.map_or((known, 0.0), |hit| (hit.triangle, hit.distance()));
        Self { at, nearest, distance }
    }
}

/// A part of a triangle.
struct Part {
    corners: [Corner; 3],
    /// No point of it is farther.
    bound: f64,
}

impl Part {
    /// The distance changes by no more than the way does, so a corner tells of all the others; and
    /// the distance to one triangle is convex, so that no point is farther from it than the farthest
    /// corner.
    fn new(corners: [Corner; 3], to: &Surface) -> Self {
        let by_way = |corner: &Corner| {
            let ways = corners.iter().map(|other| corner.at.distance(other.at));
            corner.distance + ways.fold(0.0, f64::max)
        };
        let to_nearest_of = |corner: &Corner| {
            let distance = |other: &Corner| match other.nearest == corner.nearest {
                true => other.distance,
                false => to.on_triangle(other.at, corner.nearest).distance(),
            };
            corners.iter().map(distance).fold(0.0, f64::max)
        };
        let [a, b, c] = &corners;
        let mut bound = by_way(a).min(by_way(b)).min(by_way(c)).min(to_nearest_of(a));
        if b.nearest != a.nearest {
            bound = bound.min(to_nearest_of(b));
        }
        if c.nearest != a.nearest && c.nearest != b.nearest {
            bound = bound.min(to_nearest_of(c));
        }
        Self { corners, bound }
    }
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

/// The vertices of a surface, and those of its triangles that may be farther from another than all vertices:
/// theirs are measured exactly. Of most vertices it is enough that some triangle is near, which is found sooner
/// than the nearest.
fn corners(from: &Surface, to: &Surface) -> (Vec<Corner>, Vec<[u32; 3]>) {
    let positions = from.positions();
    let mut used = vec![false; positions.len()];
    from.triangles().iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
    let used: Vec<u32> = (0..).zip(used).filter(|(_, used)| *used).map(|(v, _)| v).collect();
    let measured = |vertex: u32, known: u32| Corner::new(positions[vertex as usize], to, known);

    let some = used.par_iter().step_by(SAMPLED).map(|&vertex| measured(vertex, 0).distance);
    let reach = 0.5 * some.reduce(|| 0.0, f64::max);
    let nearly = |vertices: &[u32]| {
        let mut known = 0;
        let nearly = |&vertex: &u32| {
            let at = positions[vertex as usize];
            let corner = match to.any_within(at, reach, known) {
                Some(hit) => Corner { at, nearest: hit.triangle, distance: hit.distance() },
                None => measured(vertex, known),
            };
            known = corner.nearest;
            (vertex, corner)
        };
        vertices.iter().map(nearly).collect::<Vec<_>>()
    };
    let mut corners: Vec<Corner> =
        positions.iter().map(|&at| Corner { at, nearest: 0, distance: 0.0 }).collect();
    let found: Vec<_> = used.par_chunks(CHUNK).map(nearly).collect();
    for (vertex, corner) in found.into_iter().flatten() {
        corners[vertex as usize] = corner;
    }

    let largest = corners.iter().map(|corner| corner.distance).fold(0.0, f64::max);
    let is_far = |triangle: &&[u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| corners[vertex as usize]);
        a.distance + a.at.distance(b.at).max(a.at.distance(c.at)) > largest
    };
    let far: Vec<[u32; 3]> = from.triangles().par_iter().filter(is_far).copied().collect();
    let is_near = |vertex: &u32| corners[*vertex as usize].distance <= reach;
    let mut again: Vec<u32> = far.iter().flatten().copied().filter(is_near).collect();
    again.par_sort_unstable();
    again.dedup();
    let exactly = |&vertex: &u32| (vertex, measured(vertex, corners[vertex as usize].nearest));
    let found: Vec<_> = again.par_iter().map(exactly).collect();
    for (vertex, corner) in found {
        corners[vertex as usize] = corner;
    }
    (corners, far)
}

/// The largest distance found from one surface to another, and where.
fn farthest(from: &Surface, to: &Surface) -> (f64, DVec3) {
    let mut best = (0.0, from.positions().first().copied().unwrap_or_default());
    if to.triangles().is_empty() {
        return (f64::INFINITY, best.1);
    }
    let measured = |at: DVec3, known: u32| Corner::new(at, to, known);
    let (corners, far) = corners(from, to);
    // The first of equals.
    for corner in &corners {
        if corner.distance > best.0 {
            best = (corner.distance, corner.at);
        }
    }
    let mut largest = best.0;
    let part = |corners: [Corner; 3], largest: f64| {
        // Cheap, and mostly enough.
        let [a, b, c] = corners;
        let way = a.at.distance(b.at).max(a.at.distance(c.at));
        let near = a.distance + way <= largest;
        let part = (!near).then(|| Part::new(corners, to));
        part.filter(|part| part.bound > largest * (1.0 + SLACK))
    };
    let open: Vec<Part> = far
        .par_iter()
        .filter_map(|triangle| part(triangle.map(|v| corners[v as usize]), largest))
        .collect();
    let mut open = BinaryHeap::from(open);
    let triangles = from.triangles().len() as f64;
    for _ in 0..LEAST_DIVISIONS + (triangles * DIVISIONS_PER_TRIANGLE) as usize {
        let farther = |part: &Part| part.bound > largest * (1.0 + SLACK);
        let Some(next) = open.pop().filter(farther) else { break };
        let [a, b, c] = from_longest_edge(next.corners);
        let middle = measured((a.at + b.at) * 0.5, a.nearest);
        if middle.distance > best.0 {
            best = (middle.distance, middle.at);
        }
        largest = best.0;
        open.extend([[a, middle, c], [middle, b, c]].into_iter().filter_map(|c| part(c, largest)));
    }
    best
}

/// The corners in the same order round, so that the longest edge lies between the first two.
fn from_longest_edge([a, b, c]: [Corner; 3]) -> [Corner; 3] {
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| a.at.distance_squared(b.at));
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Surface {
        let at = DVec3::new(678_016.0, 5_403_456.0, 0.0);
        Surface::new(positions.iter().map(|&p| at + DVec3::from(p)).collect(), triangles.to_vec())
    }

    #[test]
    fn what_no_vertex_is_far_from_is_found() {
        let square = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 0.0], [0.0, 9.0, 0.0]];
        let whole = surface(&square, &[[0, 1, 2], [0, 2, 3]]);
        let half = surface(&square, &[[0, 1, 2]]);
        let deepest = 9.0 * 0.5f64.sqrt();
        let (found, _) = farthest(&whole, &half);
        assert!((found - deepest).abs() < 1e-6, "the corner: {found}");
        assert_eq!(farthest(&half, &whole).0, 0.0);
        // A ridge over the middle of a long triangle.
        let ridge = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [10.0, 9.0, 0.0], [7.0, 0.0, 0.5]];
        let bent = surface(&ridge, &[[0, 3, 2], [3, 1, 2]]);
        let flat = surface(&ridge[..3], &[[0, 1, 2]]);
        let (found, at) = farthest(&bent, &flat);
        assert!((found - 0.5).abs() < 1e-9 && (at.x - 678_023.0).abs() < 1e-6);
        let (back, _) = farthest(&flat, &bent);
        assert!(back > 0.3 && back < 0.5, "{back}");
    }

    #[test]
    fn many_equal_triangles_end() {
        let square = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 0.0]];
        let many = surface(&square, &[[0, 1, 2]; 1000]);
        let lifted = surface(&square.map(|[x, y, _]| [x, y, 1.0]), &[[0, 1, 2]; 1000]);
        assert_eq!(farthest(&many, &lifted).0, 1.0);
    }
}
