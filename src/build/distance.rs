//! The distance between a mesh and its simplification, measured, both ways.
//!
//! The Hausdorff distance obeys the triangle inequality, so the distances between a node and its
//! children's meshes, summed down to the leaves, bound the distance to the original.
//!
//! It is measured at all vertices of both meshes and at the centres of all triangles, of which the
//! largest are divided again and again. Only the largest distance counts: of most points it is
//! enough to know that they are not farther than another one, which the first triangle at hand
//! shows. Once no part reaches farther from its centre than that largest distance, no point between
//! can be more than twice as far, and [`ALLOWANCE`] makes the result a bound. Where a surface comes
//! back so exactly that this would take too many divisions, what is left is covered by likelihood
//! alone.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::Vec3;

use crate::mesh::Mesh;

/// The measured distance is multiplied by this, since the farthest point of a surface need not be
/// one of those that are measured.
pub const ALLOWANCE: f64 = 2.0;

/// Parts of triangles are divided at most this often in a direction, or once for so many triangles,
/// whichever is more.
const LEAST_DIVISIONS: usize = 512;
const TRIANGLES_PER_DIVISION: usize = 4;

/// Points that are tried in each direction for the mean; evenly spread over the triangles.
const MOST_SAMPLES: usize = 320;

/// Triangles that are tried first.
const SCOUTS: usize = 64;

/// A bound on the two-sided distance between two meshes over the same surface, metres.
pub fn hausdorff(source: &Mesh, simplified: &Mesh) -> f64 {
    if source.triangles.is_empty() || simplified.triangles.is_empty() {
        return 0.0;
    }
    let worst = TriangleGrid::new(simplified).farthest(source, 0.0);
    let worst = TriangleGrid::new(source).farthest(simplified, worst);
    f64::from(worst) * ALLOWANCE
}

/// The mean distance between two meshes, metres: that of the triangles' centres, weighted by
/// area, from each to the other, added up. Unlike the largest distance it tells a mesh that lost
/// a lamp post from one that is bent all over.
pub fn mean_distance(source: &Mesh, simplified: &Mesh) -> f64 {
    if source.triangles.is_empty() || simplified.triangles.is_empty() {
        return f64::INFINITY;
    }
    mean_one_way(source, simplified) + mean_one_way(simplified, source)
}

fn mean_one_way(from: &Mesh, to: &Mesh) -> f64 {
    let grid = TriangleGrid::new(to);
    let stride = from.triangles.len().div_ceil(4 * MOST_SAMPLES).max(1);
    let (mut sum, mut weights) = (0f64, 0f64);
    for &triangle in from.triangles.iter().step_by(stride) {
        let [a, b, c] = triangle.map(|v| Vec3::from(from.positions[v as usize]));
        let area = from.triangle_area(triangle);
        sum += area * f64::from(grid.distance_beyond((a + b + c) / 3.0, 0.0));
        weights += area;
    }
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// A triangle or a part of one.
struct Part {
    corners: [Vec3; 3],
    centre: Vec3,
    /// How far its farthest corner is from its centre.
    reach: f32,
}

impl Part {
    fn new(corners: [Vec3; 3]) -> Self {
        let centre = (corners[0] + corners[1] + corners[2]) * (1.0 / 3.0);
        let squared = corners.map(|corner| corner.distance_squared(centre));
        let reach = squared[0].max(squared[1]).max(squared[2]).sqrt();
        Self { corners, centre, reach }
    }

    /// The middle of its longest side, and its halves on both sides of that.
    fn divided(&self) -> (Vec3, [[Vec3; 3]; 2]) {
        let [a, b, c] = self.corners;
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| a.distance_squared(b));
        let (a, b, c) = if ab >= bc && ab >= ca {
            (a, b, c)
        } else if bc >= ca {
            (b, c, a)
        } else {
            (c, a, b)
        };
        let middle = (a + b) * 0.5;
        (middle, [[a, middle, c], [middle, b, c]])
    }
}

/// By reach; equal ones by their centres, so that the order is always the same.
impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = |part: &Self| [part.reach, part.centre.x, part.centre.y, part.centre.z];
        let pairs = order(self).into_iter().zip(order(other));
        pairs.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne()).unwrap_or(Ordering::Equal)
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

/// Triangles in a uniform grid over their bounding box.
struct TriangleGrid {
    low: Vec3,
    per_cell: f32,
    cells: [i32; 3],
    /// Where each cell's triangles begin in `members`.
    first: Vec<u32>,
    /// Numbers of triangles, cell by cell.
    members: Vec<u32>,
    triangles: Vec<[Vec3; 3]>,
}

/// Cells for each triangle: more makes the search cheaper and the grid dearer.
const CELLS_PER_TRIANGLE: f32 = 4.0;

/// Most cells along an axis, so that a cell's place fits bytes.
const MOST_CELLS: i32 = 256;

/// Added to a number from 0 to 2^22 it leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = 8_388_608.0;

impl TriangleGrid {
    fn new(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds().unwrap_or_default();
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let size = (high - low).max(Vec3::splat((high - low).max_element() * 1e-3 + 1e-20));
        let wanted = (mesh.triangles.len() as f32 * CELLS_PER_TRIANGLE).max(1.0);
        let most = MOST_CELLS as f32;
        let side = (size.x * size.y * size.z / wanted).cbrt().max(size.max_element() / most);
        let cells = (size / side).to_array().map(|n| (n.ceil() as i32).clamp(1, MOST_CELLS));
        let triangles = mesh
            .triangles
            .iter()
            .map(|&[a, b, c]| [a, b, c].map(|v| Vec3::from(mesh.positions[v as usize])))
            .collect();
        let count = (cells[0] * cells[1] * cells[2]) as usize;
        let (first, members) = (vec![0; count + 1], Vec::new());
        let mut grid = Self { low, per_cell: 1.0 / side, cells, first, members, triangles };
        grid.fill();
        grid
    }

    /// Lists each triangle in the cells that its box touches.
    fn fill(&mut self) {
        let boxes: Vec<[[u8; 3]; 2]> = self
            .triangles
            .iter()
            .map(|&[a, b, c]| {
                [a.min(b).min(c), a.max(b).max(c)].map(|p| self.cell_at(p).map(|at| at as u8))
            })
            .collect();
        let [width, depth, _] = self.cells.map(|count| count as usize);
        let for_rows = |[from, to]: [[u8; 3]; 2], visit: &mut dyn FnMut(std::ops::Range<usize>)| {
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    let row = (usize::from(z) * depth + usize::from(y)) * width;
                    visit(row + usize::from(from[0])..row + usize::from(to[0]) + 1);
                }
            }
        };
        // Counted, summed up to where each cell ends, and filled from behind to where it begins.
        let mut ends = std::mem::take(&mut self.first);
        let mut total = 0;
        for &cells in &boxes {
            for_rows(cells, &mut |row| ends[row].iter_mut().for_each(|count| *count += 1));
        }
        for end in &mut ends {
            total += *end;
            *end = total;
        }
        self.members = vec![0; total as usize];
        for (number, &cells) in boxes.iter().enumerate().rev() {
            for_rows(cells, &mut |row| {
                for end in &mut ends[row] {
                    *end -= 1;
                    self.members[*end as usize] = number as u32;
                }
            });
        }
        self.first = ends;
    }

    /// The farthest of the vertices of `mesh` and of points on its triangles, or `least` where none
    /// is farther. No point of it is more than twice as far, as far as divisions go.
    fn farthest(&self, mesh: &Mesh, least: f32) -> f32 {
        // The triangle that was near enough to the point before: mostly it is to the next one too.
        let (mut largest, mut last) = (least, 0);
        // Returns the largest distance so far.
        let mut measure = |point: Vec3| {
            let [a, b, c] = self.triangles[last as usize];
            if squared_distance(point, a, b, c) > largest * largest {
                let (distance, nearest) = self.search(point, largest);
                (largest, last) = (largest.max(distance), nearest);
            }
            largest
        };
        let mut worst = least;
        let corners = |triangle: [u32; 3]| triangle.map(|v| Vec3::from(mesh.positions[v as usize]));
        // Scouts, evenly spread, find about how large the largest is; the others need then hardly
        // be looked at.
        let stride = mesh.triangles.len().div_ceil(SCOUTS);
        for &triangle in mesh.triangles.iter().step_by(stride) {
            let [a, b, c] = corners(triangle);
            measure((a + b + c) * (1.0 / 3.0));
        }
        for &position in &mesh.positions {
            measure(position.into());
        }
        // Parts that reach farther from their centre than the largest distance, largest first.
        let mut parts = BinaryHeap::new();
        for &triangle in &mesh.triangles {
            let part = Part::new(corners(triangle));
            worst = measure(part.centre);
            if part.reach > worst {
                parts.push(part);
            }
        }
        for _ in 0..(mesh.triangles.len() / TRIANGLES_PER_DIVISION).max(LEAST_DIVISIONS) {
            let Some(part) = parts.pop().filter(|part| part.reach > worst) else { break };
            let (middle, halves) = part.divided();
            // An edge may lie outside of the other mesh's outline where its ends do not.
            measure(middle);
            for half in halves {
                let half = Part::new(half);
                worst = measure(half.centre);
                if half.reach > worst {
                    parts.push(half);
                }
            }
        }
        worst
    }

    /// The cell of a point, or the nearest to it. A point on a wall may count to either side.
    #[inline]
    fn cell_at(&self, point: Vec3) -> [i32; 3] {
        let at = ((point - self.low) * self.per_cell - 0.5).to_array();
        let place = |i: usize| {
            let inside = at[i].max(0.0).min((self.cells[i] - 1) as f32);
            (inside + WHOLE).to_bits() as i32 & 0x3f_ffff
        };
        [place(0), place(1), place(2)]
    }

    fn index(&self, [x, y, z]: [i32; 3]) -> usize {
        ((z * self.cells[1] + y) * self.cells[0] + x) as usize
    }

    /// The distance from `point` to the nearest triangle; any number not above `enough` where it
    /// is known not to exceed that.
    fn distance_beyond(&self, point: Vec3, enough: f32) -> f32 {
        self.search(point, enough).0
    }

    /// The same, and the triangle.
    fn search(&self, point: Vec3, enough: f32) -> (f32, u32) {
        let home = self.cell_at(point);
        let side = 1.0 / self.per_cell;
        // The point may lie outside of the grid.
        let outside = {
            let high = self.low
                + Vec3::new(self.cells[0] as f32, self.cells[1] as f32, self.cells[2] as f32)
                    * side;
            point.distance(point.clamp(self.low, high))
        };
        let enough_squared = enough * enough;
        let (mut best, mut nearest) = (f32::INFINITY, 0);
        let rings = self.cells[0].max(self.cells[1]).max(self.cells[2]);
        for ring in 0..=rings {
            // Nothing in this ring or beyond is nearer than this.
            let reach = (ring as f32 - 1.0) * side;
            if best <= enough_squared || (reach > 0.0 && best <= reach.max(outside).powi(2)) {
                break;
            }
            self.for_ring(home, ring, |cell| {
                let range = self.first[cell] as usize..self.first[cell + 1] as usize;
                for &triangle in &self.members[range] {
                    if best <= enough_squared {
                        return;
                    }
                    let [a, b, c] = self.triangles[triangle as usize];
                    let squared = squared_distance(point, a, b, c);
                    if squared < best {
                        (best, nearest) = (squared, triangle);
                    }
                }
            });
        }
        (best.sqrt(), nearest)
    }

    /// Visits the cells whose largest index distance from `home` is `ring`.
    fn for_ring(&self, home: [i32; 3], ring: i32, mut visit: impl FnMut(usize)) {
        let range = |i: usize| (home[i] - ring).max(0)..=(home[i] + ring).min(self.cells[i] - 1);
        for z in range(2) {
            for y in range(1) {
                let shell = (z - home[2]).abs() == ring || (y - home[1]).abs() == ring;
                if shell {
                    for x in range(0) {
                        visit(self.index([x, y, z]));
                    }
                } else {
                    for x in [home[0] - ring, home[0] + ring] {
                        if (0..self.cells[0]).contains(&x) {
                            visit(self.index([x, y, z]));
                        }
                    }
                }
            }
        }
    }
}

/// Squared distance from a point to a triangle, by the region of the plane that its projection
/// falls in (Ericson, Real-Time Collision Detection, section 5.1.5). Of needles it is that to
/// their sides: they have no plane to speak of, and the distance to it could be anything.
#[inline]
fn squared_distance(p: Vec3, a: Vec3, b: Vec3, c: Vec3) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length_squared();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length_squared();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        return (ap - ab * (d1 / (d1 - d3))).length_squared();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length_squared();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        return (ap - ac * (d2 / (d2 - d6))).length_squared();
    }
    let va = d3 * d6 - d5 * d4;
    let (from_b, from_c) = (d4 - d3, d5 - d6);
    if va <= 0.0 && from_b >= 0.0 && from_c >= 0.0 && from_b + from_c > 0.0 {
        return (bp - (c - b) * (from_b / (from_b + from_c))).length_squared();
    }
    let normal = ab.cross(ac);
    let area = normal.length_squared();
    if area > LEAST_SINE_SQUARED * ab.length_squared() * ac.length_squared() {
        return ap.dot(normal).powi(2) / area;
    }
    to_side(p, a, b).min(to_side(p, b, c)).min(to_side(p, c, a))
}

/// A triangle that is narrower than this at its first corner has no normal that f32 could hold.
const LEAST_SINE_SQUARED: f32 = 1e-4;

/// Squared distance from a point to the line between two others.
fn to_side(p: Vec3, a: Vec3, b: Vec3) -> f32 {
    let (ab, ap) = (b - a, p - a);
    let squared = ab.length_squared();
    let along = if squared > 0.0 { (ab.dot(ap) / squared).clamp(0.0, 1.0) } else { 0.0 };
    (ap - ab * along).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
        Mesh {
            positions: positions.to_vec(),
            materials: vec![0; positions.len()],
            triangles: triangles.to_vec(),
            ..Default::default()
        }
    }

    #[test]
    fn equal_meshes_are_at_no_distance_and_a_lifted_one_at_its_lift() {
        let square = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];
        let flat = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let lifted = mesh(&square.map(|[x, y, _]| [x, y, 0.5]), &[[0, 1, 2], [0, 2, 3]]);
        assert_eq!(hausdorff(&flat, &flat), 0.0);
        let distance = hausdorff(&flat, &lifted) / ALLOWANCE;
        assert!((distance - 0.5).abs() < 1e-6, "{distance}");
    }

    /// A hole in the middle of a triangle whose corners all stay, which no vertex is far from.
    #[test]
    fn what_is_missing_between_kept_vertices_is_found() {
        let square = [[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [9.0, 9.0, 0.0], [0.0, 9.0, 0.0]];
        let whole = mesh(&square, &[[0, 1, 2], [0, 2, 3]]);
        let half = mesh(&square, &[[0, 1, 2]]);
        let farthest = 9.0 * 0.5f64.sqrt();
        for (source, simplified) in [(&whole, &half), (&half, &whole)] {
            let bound = hausdorff(source, simplified);
            assert!(
                bound >= farthest && bound <= farthest * ALLOWANCE + 1e-6,
                "{bound} {farthest}"
            );
        }
    }

    /// A side that leaves the other's outline between vertices that both have.
    #[test]
    fn a_side_across_a_shallow_notch_is_found() {
        let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [10.0, 15.0, 0.0], [7.3, 0.04, 0.0]];
        let notched = mesh(&corners, &[[0, 3, 2], [3, 1, 2]]);
        let straight = mesh(&corners[..3], &[[0, 1, 2]]);
        // From the foot of the notch to the nearer of the notch's two sides.
        let deepest = 0.04 * f64::cos(f64::atan(0.04 / 7.3));
        for (source, simplified) in [(&notched, &straight), (&straight, &notched)] {
            let bound = hausdorff(source, simplified);
            assert!(bound >= deepest && bound <= deepest * ALLOWANCE + 1e-6, "{bound} {deepest}");
        }
    }

    #[test]
    fn the_bound_holds_for_points_all_over_both_surfaces() {
        let mut state = 3u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for _ in 0..20 {
            let side = 8u32;
            let positions: Vec<[f32; 3]> = (0..side * side)
                .map(|at| [(at % side) as f32, (at / side) as f32, random() * random()])
                .collect();
            let mut triangles = Vec::new();
            for at in (0..side * (side - 1)).filter(|at| at % side != side - 1) {
                triangles.push([at, at + 1, at + side]);
                triangles.push([at + 1, at + side + 1, at + side]);
            }
            let source = mesh(&positions, &triangles);
            triangles.retain(|_| random() < 0.6);
            let fewer = mesh(&positions, &triangles);
            let bound = hausdorff(&source, &fewer);
            let grid = TriangleGrid::new(&fewer);
            let at_vertices = positions.iter().map(|&p| grid.distance_beyond(p.into(), 0.0));
            let mut farthest = at_vertices.fold(0f32, f32::max);
            for &triangle in &source.triangles {
                let [a, b, c] = triangle.map(|v| Vec3::from(positions[v as usize]));
                for _ in 0..30 {
                    let (u, v) = (random(), random());
                    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                    let point = a + (b - a) * u + (c - a) * v;
                    farthest = farthest.max(grid.distance_beyond(point, 0.0));
                }
            }
            assert!(f64::from(farthest) <= bound, "{farthest} {bound}");
            assert!(bound <= f64::from(farthest) * ALLOWANCE * 1.1, "{farthest} {bound}");
        }
    }

    /// Against the nearest of many points of the triangle, none of which is nearer than it is.
    #[test]
    fn no_triangle_is_nearer_than_its_points() {
        let mut state = 11u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        for case in 0..400 {
            let mut point = || Vec3::new(random() * 100.0, random() * 100.0, random() * 5.0);
            let (p, a, far) = (point(), point(), point());
            // A triangle, a needle, a line, two corners in one place, and a point.
            let [b, c] = match case % 5 {
                0 => [far, point()],
                1 => [far, a + (far - a) * 0.4 + Vec3::new(1e-5, -2e-5, 1e-5)],
                2 => [far, a + (far - a) * 0.3],
                3 => [a, far],
                _ => [a, a],
            };
            let found = squared_distance(p, a, b, c).sqrt();
            let mut nearest = f32::INFINITY;
            for i in 0..=200u8 {
                for j in 0..=200 - i {
                    let (u, v) = (f32::from(i) / 200.0, f32::from(j) / 200.0);
                    nearest = nearest.min(p.distance(a + (b - a) * u + (c - a) * v));
                }
            }
            assert!(found <= nearest + 1e-3, "case {case}: {found}, a point at {nearest}");
            let spacing = (b - a).length().max((c - a).length()) / 200.0;
            assert!(found >= nearest - spacing - 1e-3, "case {case}: {found} below {nearest}");
        }
    }

    #[test]
    fn agrees_with_trying_every_triangle() {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let positions: Vec<[f32; 3]> =
            (0..300).map(|_| [random(), random() * 5.0, random()]).collect();
        let triangles: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let soup = mesh(&positions, &triangles);
        let grid = TriangleGrid::new(&soup);
        for _ in 0..500 {
            let p = Vec3::new(random() * 3.0 - 1.0, random() * 7.0 - 1.0, random() * 3.0 - 1.0);
            let naive = triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| Vec3::from(positions[v as usize]));
                    squared_distance(p, a, b, c)
                })
                .fold(f32::INFINITY, f32::min)
                .sqrt();
            assert_eq!(grid.distance_beyond(p, 0.0), naive);
        }
    }
}
