//! Skirts: what closes the gap between two levels that meet at a cutting plane.
//!
//! A node's border follows the original border with fewer vertices. The region between the two
//! lies in the cutting plane; the skirt of a border edge is the smallest rectangle in that plane
//! that contains the edge and the original polyline that it stands for. The neighbour's border
//! follows the same polyline and has skirts over its own deviation, so whatever the two levels
//! are, both sides reach the original polyline and nothing shows between them. A leaf follows the
//! original exactly and needs none.
//!
//! Where several pieces of the border have the same edge, each has a skirt on it. Where the mesh has
//! no such edge, because what ended there closed up when the border thinned, the neighbour is open
//! there all the same: the skirt stands alone, and looks like the nearest edge that there is.
//!
//! An end of the edge may lie beside the plane rather than on it ([`super::cut`]). From there to
//! the polyline's next vertex the region leaves the plane, and a triangle closes that part.

use rustc_hash::FxHashMap;

use super::border::{Border, Path};
use super::border_run::{BorderRun, edges_of};
use crate::mesh::{Mesh, wide};

/// What covers the region between one border edge and the original polyline.
#[derive(Clone, Debug, PartialEq)]
pub struct Skirt {
    /// The edge's vertices; the skirt looks like them.
    pub edge: [u32; 2],
    /// Positions of its own vertices, and which of the edge's two each looks like.
    pub corners: Vec<([f32; 3], u8)>,
    /// 0 and 1 are the edge's vertices, 2 and on the corners.
    pub triangles: Vec<[u8; 3]>,
}

/// The rectangles reach this share of their own width beyond the polyline.
const MARGIN: f64 = 0.02;

/// The skirts that a node needs whose border on `path` is made of `runs`. `step` is the lattice step
/// in metres.
pub fn skirts(
    mesh: &Mesh,
    border: &Border,
    runs: &[BorderRun],
    path: &Path,
    step: f64,
) -> Vec<Skirt> {
    let edges = edges_of(runs, path, mesh, border);
    let covered = |run: &BorderRun| {
        let points = run.points(path);
        if points.len() < 3 {
            return None;
        }
        let plane = path.plane(run.plane());
        let around = Run { points, axis: plane.axis, coordinate: plane.coordinate };
        match edges.get(&run.edge(path)) {
            Some(&edge) => Some(Skirt::new(edge, around, mesh.positions[edge[0] as usize], step)),
            None => Some(Skirt::alone(nearest_edge(mesh, points[0])?, around, step)),
        }
    };
    runs.iter().filter_map(covered).collect()
}

/// An edge of the triangle corner nearest to a place; the first of equals.
fn nearest_edge(mesh: &Mesh, place: [f32; 3]) -> Option<[u32; 2]> {
    let from =
        |edge: &[u32; 2]| wide(mesh.positions[edge[0] as usize]).distance_squared(wide(place));
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.min_by(|a, b| from(a).total_cmp(&from(b)))
}

/// The part of a border's original polyline that is still to be covered, and its plane.
struct Run<'a> {
    points: &'a [[f32; 3]],
    /// The axis that the plane is perpendicular to.
    axis: usize,
    coordinate: f32,
}

impl Skirt {
    fn new(edge: [u32; 2], mut run: Run, start: [f32; 3], step: f64) -> Self {
        let mut skirt = Self { edge, corners: Vec::new(), triangles: Vec::new() };
        // The vertices of the edge that the run's ends are.
        let ends = if run.points[0] == start { [0, 1] } else { [1, 0] };
        skirt.close_ends(&mut run, ends);
        skirt.cover(&run, ends, step);
        skirt
    }

    /// A skirt whose ends are no vertices of the mesh, which looks like some edge of it.
    fn alone(edge: [u32; 2], run: Run, step: f64) -> Self {
        let (first, last) = (run.points[0], run.points[run.points.len() - 1]);
        let mut skirt = Self::new(edge, run, first, step);
        if skirt.triangles.as_flattened().iter().any(|&corner| corner < 2) {
            let ends = [skirt.corner(first, 0), skirt.corner(last, 1)];
            for corner in skirt.triangles.as_flattened_mut().iter_mut().filter(|at| **at < 2) {
                *corner = ends[usize::from(*corner)];
            }
        }
        skirt
    }

    /// Adds a vertex; returns its number among the corners of triangles.
    fn corner(&mut self, position: [f32; 3], like: u8) -> u8 {
        self.corners.push((position, like));
        self.corners.len() as u8 + 1
    }

    /// Covers what leads from ends of the run that lie beside the plane to their neighbours, and
    /// takes such ends away from the run.
    fn close_ends(&mut self, run: &mut Run, ends: [u8; 2]) {
        // The chord over what is left of the run.
        let mut chord = ends;
        for end in 0..2 {
            let points = run.points;
            if points.len() < 3 {
                return;
            }
            let last = points.len() - 1;
            let (at, next, rest) = match end {
                0 => (points[0], points[1], &points[1..]),
                _ => (points[last], points[last - 1], &points[..last]),
            };
            if at[run.axis] != run.coordinate {
                let corner = self.corner(next, ends[end]);
                self.triangles.push([chord[0], corner, chord[1]]);
                chord[end] = corner;
                run.points = rest;
            }
        }
    }

    /// Covers a run in the plane with a rectangle over it and its chord.
    fn cover(&mut self, run: &Run, ends: [u8; 2], step: f64) {
        let [first, _, .., last] = run.points else { return };
        if run.points.len() == 2 {
            return;
        }
        let (start, end) = (wide(*first), wide(*last));
        let Some(along) = (end - start).try_normalize() else { return };
        let mut normal = glam::DVec3::ZERO;
        normal[run.axis] = 1.0;
        let across = normal.cross(along);
        let (mut low, mut high) = (0f64, 0f64);
        let (mut from, mut to) = (0f64, start.distance(end));
        for &point in run.points {
            let from_start = wide(point) - start;
            let (here, beside) = (from_start.dot(along), from_start.dot(across));
            (low, high) = (low.min(beside), high.max(beside));
            (from, to) = (from.min(here), to.max(here));
        }
        // Corners are rounded, and must not come to lie short of the run's own ends.
        let rounding = 2.0 * step;
        let margin = (high - low) * MARGIN + rounding;
        let [a, b, c, d] = [
            (from - rounding, low - margin, ends[0]),
            (from - rounding, high + margin, ends[0]),
            (to + rounding, low - margin, ends[1]),
            (to + rounding, high + margin, ends[1]),
        ]
        .map(|(here, beside, like)| {
            self.corner((start + along * here + across * beside).as_vec3().into(), like)
        });
        self.triangles.extend([[a, c, d], [a, d, b]]);
    }
}

/// Triangles of the skirts.
pub fn triangles_of(skirts: &[Skirt]) -> usize {
    skirts.iter().map(|skirt| skirt.triangles.len()).sum()
}

/// The skirts of `before` on a mesh of the same triangles, some of whose vertices became two: each
/// hangs on the vertices of the triangle that has its edge.
pub fn rehung(skirts: &[Skirt], before: &Mesh, after: &Mesh) -> Vec<Skirt> {
    if skirts.is_empty() {
        return Vec::new();
    }
    let mut edges: FxHashMap<[u32; 2], [u32; 2]> = FxHashMap::default();
    for (&[a, b, c], &[p, q, r]) in before.triangles.iter().zip(&after.triangles) {
        for (edge, own) in [([a, b], [p, q]), ([b, c], [q, r]), ([c, a], [r, p])] {
            edges.entry(edge).or_insert(own);
            edges.entry([edge[1], edge[0]]).or_insert([own[1], own[0]]);
        }
    }
    let rehung = |skirt: &Skirt| {
        let edge = edges.get(&skirt.edge).copied().unwrap_or(skirt.edge);
        Skirt { edge, ..skirt.clone() }
    };
    skirts.iter().map(rehung).collect()
}

/// Appends the skirts to a mesh. Returns pairs of vertices that look alike: a skirt's corner and
/// the border vertex that it copies.
pub fn append(mesh: &mut Mesh, skirts: &[Skirt]) -> Vec<[u32; 2]> {
    let mut alike = Vec::with_capacity(skirts.len() * 4);
    for skirt in skirts {
        let first = mesh.positions.len() as u32;
        for &(position, like) in &skirt.corners {
            let model = skirt.edge[usize::from(like)];
            let copy = mesh.push_copy(model as usize);
            mesh.positions[copy as usize] = position;
            alike.push([model, copy]);
        }
        let vertex = |corner: u8| match corner {
            0 | 1 => skirt.edge[usize::from(corner)],
            _ => first + u32::from(corner) - 2,
        };
        mesh.triangles.extend(skirt.triangles.iter().map(|triangle| triangle.map(vertex)));
    }
    alike
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The skirt of the edge from the first to the last of some points, for the plane x = 0.
    fn over(points: &[[f32; 3]]) -> Skirt {
        let run = Run { points, axis: 0, coordinate: 0.0 };
        Skirt::new([7, 8], run, points[0], 1e-6)
    }

    #[test]
    fn a_run_in_the_plane_lies_within_one_rectangle() {
        let points = [[0.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 3.0, -0.25], [0.0, 4.0, 0.0]];
        let skirt = over(&points);
        assert_eq!(skirt.triangles, [[2, 4, 5], [2, 5, 3]]);
        let corners: Vec<[f32; 3]> = skirt.corners.iter().map(|corner| corner.0).collect();
        for axis in 0..3 {
            let of = |positions: &[[f32; 3]]| {
                positions.iter().fold([f32::MAX, f32::MIN], |[low, high], p| {
                    [low.min(p[axis]), high.max(p[axis])]
                })
            };
            let ([low, high], [least, most]) = (of(&corners), of(&points));
            assert!(low <= least && high >= most && high - low <= (most - least) * 1.05 + 1e-5);
        }
    }

    #[test]
    fn ends_beside_the_plane_are_closed_by_triangles() {
        // 0.5 beside the plane at the first end, at both, and with nothing left to cover then.
        let [start, end] = [[0.5, 0.0, 0.0], [0.5, 4.0, 0.0]];
        let inner = [[0.0, 1.0, 0.0], [0.0, 2.0, 1.0], [0.0, 3.0, 0.0]];
        let one = over(&[start, inner[0], inner[1], inner[2]]);
        assert_eq!(one.triangles, [[0, 2, 1], [3, 5, 6], [3, 6, 4]]);
        assert_eq!(one.corners[0], (inner[0], 0));
        let both = over(&[start, inner[0], inner[1], inner[2], end]);
        assert_eq!(both.triangles[..2], [[0, 2, 1], [2, 3, 1]]);
        assert_eq!(both.corners[1], (inner[2], 1));
        assert_eq!(both.triangles.len(), 4);
        let least = over(&[start, inner[0], end]);
        assert_eq!(least.triangles, [[0, 2, 1]]);
    }

    #[test]
    fn a_skirt_without_an_edge_has_all_its_corners() {
        let points = [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 1.0], [0.0, 3.0, 0.0]];
        let run = || Run { points: &points, axis: 0, coordinate: 0.0 };
        let (hung, alone) = (over(&points), Skirt::alone([3, 4], run(), 1e-6));
        assert_eq!(alone.edge, [3, 4]);
        let places = |skirt: &Skirt| -> Vec<[[f32; 3]; 3]> {
            let place = |corner: u8| match corner {
                0 => points[0],
                1 => points[3],
                _ => skirt.corners[usize::from(corner) - 2].0,
            };
            skirt.triangles.iter().map(|triangle| triangle.map(place)).collect()
        };
        assert_eq!(places(&hung), places(&alone));
        assert!(alone.triangles.as_flattened().iter().all(|&corner| corner >= 2));
    }

    #[test]
    fn corners_look_like_the_ends_that_they_lie_at() {
        let mut mesh = Mesh {
            positions: (0..9).map(|i| [i as f32, 0.0, 0.0]).collect(),
            materials: (0..9).collect(),
            ..Mesh::default()
        };
        let skirts = [over(&[[0.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 2.0, 0.0]])];
        let alike = append(&mut mesh, &skirts);
        assert_eq!(alike, [[7, 9], [7, 10], [8, 11], [8, 12]]);
        assert_eq!(mesh.materials[9..], [7, 7, 8, 8]);
        assert_eq!(mesh.triangles.len(), triangles_of(&skirts));
    }
}
