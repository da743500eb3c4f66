//! The point of a mesh that is farthest from another, by branch and bound.
//!
//! Only the largest distance counts, so that of most points it is enough to know that they are not
//! farther than another one, which the first triangle at hand shows. No point of a part of the mesh
//! is farther than its centre by more than the part reaches from there, and none is farther from
//! one triangle of the other mesh than the part's corners, since that distance is convex. Parts
//! whose bound says that they may be too far are halved, the one with the largest bound first:
//! sides before triangles, since a surface is mostly farthest where it has a side, and of a side
//! only those parts stay open that pass from above one triangle to above the next.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::Vec3;

use super::ALLOWANCE;
use super::grid::TriangleGrid;
use super::triangle::from_longest_side;
use crate::mesh::Mesh;

/// Sides and triangles are divided at most so often, or once for so many triangles of the mesh,
/// whichever is more. Without, two of ten real cities had a node whose error was much too small.
const DIVISIONS_OF_SIDES: usize = 256;
const DIVISIONS_OF_TRIANGLES: usize = 64;
const TRIANGLES_PER_DIVISION: usize = 64;

/// The end of a stretch is sought in so many steps.
const BISECTIONS: usize = 10;

/// Triangles that are tried first.
const SCOUTS: usize = 64;

/// The distance of the farthest of the points of `mesh` that are tried, or `least` where none is
/// farther. No point at all is [`ALLOWANCE`] times as far, as far as divisions go, of which there
/// are `effort` times as many as usual.
pub(super) fn farthest(mesh: &Mesh, grid: &TriangleGrid, least: f32, effort: usize) -> f32 {
    let mut search = Search { grid, largest: least, last: 0 };
    let at = |vertex: u32| Vec3::from(mesh.positions[vertex as usize]);
    // Scouts, evenly spread, find about how large the largest is; the others need then hardly be
    // looked at.
    for &triangle in mesh.triangles.iter().step_by(mesh.triangles.len().div_ceil(SCOUTS)) {
        search.measure(centre(triangle.map(at)));
    }
    let corners: Vec<Corner> =
        mesh.positions.iter().map(|&position| search.measure(position.into())).collect();
    let corner = |vertex: u32| corners[vertex as usize];
    let most = |least: usize| effort * (mesh.triangles.len() / TRIANGLES_PER_DIVISION).max(least);
    let sides = sides(&mesh.triangles, mesh.positions.len());
    let sides = sides.into_iter().map(|side| side.map(corner));
    search.look_at(sides, ends_of_side, most(DIVISIONS_OF_SIDES));
    let triangles = mesh.triangles.iter().map(|&triangle| triangle.map(corner));
    search.look_at(triangles, halve_triangle, most(DIVISIONS_OF_TRIANGLES));
    search.largest
}

/// Each side of the triangles once, in order of its lower vertex.
fn sides(triangles: &[[u32; 3]], vertices: usize) -> Vec<[u32; 2]> {
    let of_all = || {
        let of_one = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
        triangles.iter().flat_map(of_one).map(|[a, b]| [a.min(b), a.max(b)])
    };
    // Sorted by counting; only the few sides of one vertex are compared.
    let mut ends = vec![0; vertices];
    for [low, _] in of_all() {
        ends[low as usize] += 1;
    }
    let mut total = 0;
    for end in &mut ends {
        total += *end;
        *end = total;
    }
    let mut sorted = vec![[0; 2]; total];
    for side in of_all() {
        let end = &mut ends[side[0] as usize];
        *end -= 1;
        sorted[*end] = side;
    }
    for of_vertex in sorted.chunk_by_mut(|a, b| a[0] == b[0]) {
        of_vertex.sort_unstable();
    }
    sorted.dedup();
    sorted
}

fn centre<const N: usize>(corners: [Vec3; N]) -> Vec3 {
    corners.iter().sum::<Vec3>() * (1.0 / N as f32)
}

/// A point of the mesh, measured.
#[derive(Clone, Copy)]
struct Corner {
    at: Vec3,
    /// A triangle of the other mesh not farther from it than the largest distance.
    near: u32,
}

/// What is left on both sides of the stretch that lies near the triangle that its middle is near
/// to.
fn ends_of_side(search: &mut Search, part: &Part<2>) -> [[Corner; 2]; 2] {
    let middle = part.centre;
    part.corners.map(|end| {
        // The stretch is in one piece, since the distance to a triangle is convex.
        let (mut within, mut beyond) = (middle.at, end.at);
        for _ in 0..BISECTIONS {
            let between = (within + beyond) * 0.5;
            if search.covers(search.squared_from(middle.near, [between])) {
                within = between;
            } else {
                beyond = between;
            }
        }
        if search.covers(search.squared_from(middle.near, [beyond])) {
            within = beyond;
        }
        [search.measure(within), end]
    })
}

/// The halves beside the middle of the longest side.
fn halve_triangle(search: &mut Search, part: &Part<3>) -> [[Corner; 3]; 2] {
    let [a, b, c] = from_longest_side(part.corners, |corner| corner.at);
    let middle = search.measure((a.at + b.at) * 0.5);
    [[a, middle, c], [middle, b, c]]
}

/// A side or a triangle or part of one.
struct Part<const N: usize> {
    corners: [Corner; N],
    centre: Corner,
    /// No point of it is farther than this, squared.
    bound_squared: f32,
}

struct Search<'a> {
    grid: &'a TriangleGrid,
    /// The largest distance so far.
    largest: f32,
    /// The triangle that was near enough to the point before: mostly it is to the next one too.
    last: u32,
}

impl Search<'_> {
    fn measure(&mut self, at: Vec3) -> Corner {
        let last = &self.grid.triangles[self.last as usize];
        if last.squared_distance(at) > self.largest * self.largest {
            let (distance, nearest) = self.grid.search(at, self.largest);
            (self.largest, self.last) = (self.largest.max(distance), nearest);
        }
        Corner { at, near: self.last }
    }

    /// Whether a squared distance is covered by what [`ALLOWANCE`] makes of the largest.
    fn covers(&self, squared: f32) -> bool {
        squared <= self.largest * self.largest * (ALLOWANCE * ALLOWANCE) as f32
    }

    /// Halves parts, at most so often, until no point of theirs can be too far.
    fn look_at<const N: usize>(
        &mut self,
        parts: impl Iterator<Item = [Corner; N]>,
        halve: fn(&mut Self, &Part<N>) -> [[Corner; N]; 2],
        most_divisions: usize,
    ) {
        let mut open: BinaryHeap<_> = parts.filter_map(|corners| self.open(corners)).collect();
        for _ in 0..most_divisions {
            let Some(part) = open.pop().filter(|part| !self.covers(part.bound_squared)) else {
                return;
            };
            for corners in halve(self, &part) {
                open.extend(self.open(corners));
            }
        }
    }

    /// The part between corners where points of it may be too far, and its centre measured.
    fn open<const N: usize>(&mut self, corners: [Corner; N]) -> Option<Part<N>> {
        let places = corners.map(|corner| corner.at);
        let reached_from = |number: usize| {
            // The corner itself is no farther from its triangle than the largest distance.
            let triangle = &self.grid.triangles[corners[number].near as usize];
            let others = (0..N).filter(|&other| other != number);
            others.into_iter().all(|other| self.covers(triangle.squared_distance(places[other])))
        };
        if (0..N).any(reached_from) {
            return None;
        }
        let centre = self.measure(centre(places));
        let reach_squared = places.map(|place| place.distance_squared(centre.at));
        let reach = reach_squared.into_iter().fold(0f32, f32::max).sqrt();
        let bound_squared =
            self.squared_from(centre.near, places).min((self.largest + reach).powi(2));
        (!self.covers(bound_squared)).then_some(Part { corners, centre, bound_squared })
    }

    /// The squared distance from one triangle to the farthest of these points, and so to all points
    /// between them.
    fn squared_from<const N: usize>(&self, triangle: u32, points: [Vec3; N]) -> f32 {
        let triangle = &self.grid.triangles[triangle as usize];
        points.map(|point| triangle.squared_distance(point)).into_iter().fold(0f32, f32::max)
    }
}

/// By bound; equal ones by place, so that the order is always the same.
impl<const N: usize> Ord for Part<N> {
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |part: &Self| part.corners.map(|corner| corner.at.to_array().map(f32::to_bits));
        let by_bound = self.bound_squared.total_cmp(&other.bound_squared);
        by_bound.then_with(|| place(self).cmp(&place(other)))
    }
}

impl<const N: usize> PartialOrd for Part<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<const N: usize> PartialEq for Part<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<const N: usize> Eq for Part<N> {}
