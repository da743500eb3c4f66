//! How far away what hides others is.

use glam::{DVec3, Vec3};

use super::node_occlusion::NodeOcclusion;
use super::slab::Slab;
use crate::camera::View;

/// Pixels across and up of a cell.
const CELL: f64 = 4.0;

/// What a slab hides ends so many pixels before its edges: more than the 1/256 of a pixel to which
/// graphics cards round corners.
const EDGE: f64 = 1.0 / 32.0;

/// What is hidden is farther away by this part, more than depths are rounded.
const BEHIND: f64 = 1e-4;

/// Slabs of a smaller part of a sphere hide no cell, or nearly none.
const LEAST_PART: f32 = 1e-4;

/// Cells of a row that go through the processor side by side.
const RUN: usize = 8;

/// No node.
const NONE: u32 = u32::MAX;

/// Every so manieth slab of a node it is looked whether all others are too small.
const LOOK_EVERY: u32 = 16;

/// How far away what hides others is, by cells of the image, each of which is wholly before what is
/// farther.
#[derive(Clone, Debug, Default)]
pub(super) struct HidingPicture {
    /// One over metres along the line of sight, row by row from the upper left; 0 where nothing hides.
    inverse: Vec<f32>,
    /// By cell: the node that hides what is farther.
    by: Vec<u32>,
    columns: usize,
    rows: usize,
    /// Cells of a row and what is left of its last [run](RUN).
    stride: usize,
    eye: DVec3,
    /// Right, down and forward, so that the first two over the third are pixels from the middle.
    axes: [DVec3; 3],
    /// Pixels.
    size: [f64; 2],
    /// Nothing nearer is drawn, metres.
    near: f64,
    /// Slabs by the part of the view that they take, with the node that they are of.
    candidates: Vec<(f32, u32, u32)>,
    /// By row: where the slab that is drawn begins and ends, in cells.
    ends: [Vec<f64>; 2],
}

/// a x + b y + c, with x and y in cells from the upper left.
type Linear = [f64; 3];

impl HidingPicture {
    /// Begins the picture of a view, in which nothing hides yet; nothing nearer than `near` metres is
    /// drawn.
    pub fn begin(&mut self, view: &View, near: f64) {
        let size = view.size.map(f64::from);
        self.size = size;
        [self.columns, self.rows] = size.map(|pixels| (pixels / CELL).ceil() as usize);
        self.stride = self.columns.next_multiple_of(RUN);
        self.inverse.clear();
        self.inverse.resize(self.stride * self.rows, 0.0);
        self.by.clear();
        self.by.resize(self.stride * self.rows, NONE);
        let [across, up] = view.frustum.across();
        self.eye = view.pose.position;
        self.axes = [across * (size[0] / 2.0), -up * (size[1] / 2.0), view.frustum.forward];
        self.near = near;
    }

    /// Draws what more nodes hide, by so many of their slabs, the largest in the image.
    pub fn add(&mut self, nodes: &[(u32, &NodeOcclusion)], slabs: usize) {
        let sides = self.sides();
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for (node, &(_, occlusion)) in (0..).zip(nodes) {
            let offset = (occlusion.origin - self.eye).as_vec3();
            let squared = occlusion.squared_distance(self.eye) as f32;
            for (at, slab) in (0u32..).zip(&occlusion.slabs) {
                // The largest are first.
                if at.is_multiple_of(LOOK_EVERY) && slab.area() < LEAST_PART * squared {
                    break;
                }
                let part = slab.part_of_view(slab.middle + offset);
                if part > LEAST_PART && is_in_view(&sides, slab, offset) {
                    candidates.push((part, node, at));
                }
            }
        }
        if candidates.len() > slabs {
            let larger = |a: &(f32, u32, u32), b: &(f32, u32, u32)| {
                b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2)))
            };
            candidates.select_nth_unstable_by(slabs, larger);
            candidates.truncate(slabs);
        }
        for &(_, node, at) in &candidates {
            let (by, occlusion) = nodes[node as usize];
            self.draw_slab(&occlusion.slabs[at as usize], occlusion.origin - self.eye, by);
        }
        self.candidates = candidates;
    }

    /// Forgets what nodes hide of which `is_gone` says so. What is farther than these and hidden by others
    /// as well is forgotten with them.
    pub fn remove(&mut self, is_gone: impl Fn(u32) -> bool) {
        for (inverse, by) in self.inverse.iter_mut().zip(&mut self.by) {
            if *by != NONE && is_gone(*by) {
                (*inverse, *by) = (0.0, NONE);
            }
        }
    }

    /// Normals of the planes through the eye between which the view is, which point into it: its four
    /// sides, and what is before the eye.
    fn sides(&self) -> [Vec3; 5] {
        let [right, down, forward] = self.axes;
        let [half_width, half_height] = self.size.map(|pixels| forward * (pixels / 2.0));
        [half_width - right, half_width + right, half_height - down, half_height + down, forward]
            .map(|side| side.as_vec3())
    }

    fn seen(&self, at: DVec3) -> DVec3 {
        DVec3::from_array(self.axes.map(|axis| axis.dot(at)))
    }

    fn draw_slab(&mut self, slab: &Slab, offset: DVec3, by: u32) {
        let middle = slab.middle.as_dvec3() + offset;
        let across = slab.half_across.as_dvec3();
        // On which side the eye is, and whether it is out of the slab at all.
        let from = -middle.dot(across);
        let across = match across.length_squared() {
            within if from > within => across,
            within if from < -within && slab.both_sides => -across,
            _ => return,
        };
        let [u, v] = slab.half.map(|half| half.as_dvec3());
        let face = |face: DVec3| {
            let middle = middle + face;
            [middle - u - v, middle + u - v, middle + u + v, middle - u + v].map(|at| self.seen(at))
        };
        let [front, back] = [face(across), face(-across)];
        // A ray passes through a face where it is on the inner side of the four planes through the eye
        // and the edges of the face, wherever the eye looks.
        let mut bounds = [Linear::default(); 9];
        for (at, corners) in [front, back].iter().enumerate() {
            let middle = corners.iter().sum::<DVec3>();
            for side in 0..4 {
                let plane = corners[side].cross(corners[(side + 1) % 4]);
                let inward = if plane.dot(middle) < 0.0 { -plane } else { plane };
                bounds[at * 4 + side] = self.least_in_cells(inward, EDGE);
            }
        }
        // What is nearer than the near plane hides nothing.
        let [a, b, c] = one_over_depth(&front).to_array();
        bounds[8] = self.least_in_cells(DVec3::new(-a, -b, (1.0 - BEHIND) / self.near - c), 0.0);
        let farthest = self.least_in_cells(one_over_depth(&back), 0.0);
        self.fill(self.rows_of(&[front, back]), &bounds, &farthest, by);
    }

    /// The rows in which a slab may be.
    fn rows_of(&self, faces: &[[DVec3; 4]; 2]) -> std::ops::Range<usize> {
        if faces.iter().flatten().any(|at| at.z < self.near) {
            return 0..self.rows;
        }
        let ends = faces.map(|corners| {
            let heights = corners.map(|at| (at.y / at.z + self.size[1] / 2.0) / CELL);
            let low = heights.into_iter().fold(f64::INFINITY, f64::min);
            [low, heights.into_iter().fold(f64::NEG_INFINITY, f64::max)]
        });
        let row = |at: f64| at.clamp(0.0, self.rows as f64) as usize;
        let to = row(ends[0][1].min(ends[1][1])) + 1;
        row(ends[0][0].max(ends[1][0]))..to.min(self.rows)
    }

    /// The least over the pixels of a cell of a x + b y + c, x and y in pixels from the middle of the
    /// image, `edge` pixels towards where it is less.
    fn least_in_cells(&self, linear: DVec3, edge: f64) -> Linear {
        let [a, b, c] = linear.to_array();
        let from_corner = c - a * self.size[0] / 2.0 - b * self.size[1] / 2.0;
        let middle = (a + b) * CELL / 2.0;
        // Colours are those of the middles of pixels.
        let reach = (a.abs() + b.abs()) * (CELL / 2.0 - 0.5) + edge * (a * a + b * b).sqrt();
        [a * CELL, b * CELL, from_corner + middle - reach]
    }

    /// Hides what is farther than `farthest` in the cells in which all bounds are above 0.
    fn fill(
        &mut self,
        rows: std::ops::Range<usize>,
        bounds: &[Linear; 9],
        farthest: &Linear,
        by: u32,
    ) {
        if !bounds.iter().chain([farthest]).flatten().all(|number| number.is_finite()) {
            return;
        }
        let last = self.columns as f64 - 1.0;
        let [left, right] = &mut self.ends;
        for (ends, end) in [(&mut *left, 0.0), (&mut *right, last)] {
            ends.clear();
            ends.resize(rows.len(), end);
        }
        // Each bound is a line; where it meets a row. Line by line, since rows go through the processor
        // side by side; not by `max` and `min`, which look for what is no number.
        let first = rows.start as f64;
        let row = |at: usize| first + f64::from(at as i32);
        for &[a, b, c] in bounds {
            if a == 0.0 {
                // Along the rows, it bounds these themselves.
                for (at, end) in left.iter_mut().enumerate() {
                    *end = if b * row(at) + c > 0.0 { *end } else { f64::INFINITY };
                }
                continue;
            }
            let [from, slope] = [-c / a, -b / a];
            if a > 0.0 {
                for (at, end) in left.iter_mut().enumerate() {
                    let meets = from + slope * row(at);
                    *end = if meets > *end { meets } else { *end };
                }
            } else {
                for (at, end) in right.iter_mut().enumerate() {
                    let meets = from + slope * row(at);
                    *end = if meets < *end { meets } else { *end };
                }
            }
        }
        let slope = farthest[0] as f32;
        for (row, (&left, &right)) in rows.zip(left.iter().zip(&*right)) {
            if left > right {
                continue;
            }
            // Not by `ceil`, which is a call where a processor may have no instruction for it.
            let from = left as usize;
            let from = from + usize::from((from as f64) < left);
            if from as f64 > right {
                continue;
            }
            let (from, to) = (from as i32, right as i32 + 1);
            let start = (farthest[1] * row as f64 + farthest[2]) as f32;
            let runs = row * self.stride / RUN..(row + 1) * self.stride / RUN;
            let of_row = self.inverse.as_chunks_mut::<RUN>().0[runs.clone()].iter_mut();
            let of_row = of_row.zip(&mut self.by.as_chunks_mut::<RUN>().0[runs]);
            let to_run = (to as usize).div_ceil(RUN);
            for (run, (inverse, owner)) in of_row.enumerate().take(to_run).skip(from as usize / RUN)
            {
                for at in 0..RUN {
                    let column = (run * RUN + at) as i32;
                    let here = start + slope * column as f32;
                    let is_nearer = (here > inverse[at]) & (column >= from) & (column < to);
                    inverse[at] = if is_nearer { here } else { inverse[at] };
                    owner[at] = if is_nearer { by } else { owner[at] };
                }
            }
        }
    }

    /// Whether nothing of a box is seen: it is in the view, and what hides it is before all of it.
    pub fn hides(&self, view: &View, bbox: [DVec3; 2]) -> bool {
        let [min, max] = bbox.map(|at| at - self.eye);
        let forward = self.axes[2];
        let nearer = |axis: usize| if forward[axis] > 0.0 { min[axis] } else { max[axis] };
        let nearest: f64 = (0..3).map(|axis| forward[axis] * nearer(axis)).sum();
        if nearest <= self.near {
            return false;
        }
        let Some([across, up]) = view.frustum.rectangle(bbox) else { return false };
        let inverse = ((1.0 + BEHIND) / nearest) as f32;
        let cells = |from: f64, to: f64, axis: usize, cells: usize| {
            let pixel = |at: f64| (at + 1.0) / 2.0 * self.size[axis];
            let from = ((pixel(from) - 1.0) / CELL).max(0.0) as usize;
            from..(((pixel(to) + 1.0) / CELL).ceil() as usize).min(cells)
        };
        let columns = cells(across[0], across[1], 0, self.columns);
        // Rows are from above.
        cells(-up[1], -up[0], 1, self.rows).all(|row| {
            let cells = &self.inverse[row * self.stride..][columns.clone()];
            // All of them, side by side.
            cells.iter().fold(true, |all, &cell| all & (cell >= inverse))
        })
    }
}

/// Whether any of a slab may be between sides of a view.
fn is_in_view(sides: &[Vec3; 5], slab: &Slab, offset: Vec3) -> bool {
    let middle = slab.middle + offset;
    let [u, v] = slab.half;
    sides.iter().all(|side| {
        let reach = side.dot(u).abs() + side.dot(v).abs() + side.dot(slab.half_across).abs();
        side.dot(middle) + reach > 0.0
    })
}

/// One over the depth of the plane of a face along the ray through (x, y, 1): a x + b y + c.
fn one_over_depth(face: &[DVec3; 4]) -> DVec3 {
    let plane = (face[1] - face[0]).cross(face[3] - face[0]);
    plane / plane.dot(face[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{View, from_angles};
    use crate::engine::occlusion::test_mesh::{bumpy_wall, meets, mesh};
    use crate::mesh::UpAxis;
    use crate::random::Random;
    use crate::runtime::test_tree::view;

    const NEAR: f64 = 0.1;

    /// A square across the view at so many metres.
    fn wall(distance: f32, half: f32) -> [[[f32; 3]; 3]; 2] {
        let corner = |y: f32, z: f32| [distance, y * half, z * half];
        [
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)],
            [corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        ]
    }

    fn cube(centre: [f64; 3], half: f64) -> [DVec3; 2] {
        [-half, half].map(|half| DVec3::from(centre) + half)
    }

    fn picture(view: &View, triangles: &[[[f32; 3]; 3]]) -> HidingPicture {
        let mut picture = HidingPicture::default();
        let node = NodeOcclusion::new(&mesh(triangles), UpAxis::Z);
        picture.begin(view, NEAR);
        picture.add(&[(0, &node)], 1000);
        picture
    }

    #[test]
    fn what_is_behind_a_wall_is_hidden_and_nothing_else() {
        let view = view();
        let picture = picture(&view, &wall(10.0, 2.0));
        let hides = |centre, half| picture.hides(&view, cube(centre, half));
        assert!(hides([21.0, 0.0, 0.0], 1.0));
        assert!(hides([21.0, 2.0, -2.0], 1.0));
        assert!(!hides([21.0, 0.0, 0.0], 6.0), "it reaches beyond");
        assert!(!hides([21.0, 4.0, 0.0], 1.0), "beside");
        assert!(!hides([9.0, 0.0, 0.0], 0.5), "before");
        assert!(!hides([10.0, 0.0, 0.0], 0.5), "in it");
        assert!(!hides([-20.0, 0.0, 0.0], 1.0), "behind the camera");
        assert!(!HidingPicture::default().hides(&view, cube([21.0, 0.0, 0.0], 1.0)));
    }

    #[test]
    fn what_is_nearer_than_the_near_plane_hides_nothing() {
        let view = view();
        for (distance, is_hidden) in [(0.09, false), (0.11, true)] {
            let picture = picture(&view, &wall(distance, 0.1));
            assert_eq!(picture.hides(&view, cube([21.0, 0.0, 0.0], 1.0)), is_hidden, "{distance}");
        }
    }

    #[test]
    fn what_is_drawn_from_one_side_hides_from_that_side() {
        let view = view();
        let hides = |distance: f32, double_sided: bool| {
            let mut mesh = mesh(&wall(distance, 2.0));
            mesh.primitives[0].surface.double_sided = double_sided;
            let mut picture = HidingPicture::default();
            picture.begin(&view, NEAR);
            picture.add(&[(0, &NodeOcclusion::new(&mesh, UpAxis::Z))], 1000);
            picture.hides(&view, cube([3.0 * f64::from(distance), 0.0, 0.0], 1.0))
        };
        assert!(hides(10.0, true) && !hides(10.0, false), "it looks away");
    }

    #[test]
    fn every_ray_to_what_is_hidden_meets_a_surface_before() {
        let mut random = Random::new(21, 0);
        let (mut hidden, mut visible) = (0, 0);
        for _ in 0..30 {
            let wall = bumpy_wall(&mut random);
            let mut pose = view().pose;
            let [x, y, z] = [(2.0, 9.0), (-6.0, 6.0), (0.0, 8.0)];
            pose.position = DVec3::from([x, y, z].map(|(from, to)| random.between(from, to)));
            pose.rotation = from_angles(
                UpAxis::Z,
                180.0 + random.between(-50.0, 50.0),
                random.between(-20.0, 20.0),
                0.0,
            );
            let view = View::new(pose, DVec3::ZERO, [640, 360]);
            let picture = picture(&view, &wall);
            for _ in 0..100 {
                let half = random.between(0.05, 1.0);
                let at = [(-30.0, -1.0), (-15.0, 15.0), (-2.0, 10.0)];
                let at = at.map(|(from, to)| random.between(from, to));
                if !picture.hides(&view, cube(at, half)) {
                    visible += 1;
                    continue;
                }
                hidden += 1;
                for _ in 0..50 {
                    let to = DVec3::from(at.map(|at| at + random.between(-half, half)));
                    assert!(
                        view.frustum.outside([to, to]) > 0.0 || meets(&wall, pose.position, to),
                        "{to} from {}",
                        pose.position
                    );
                }
            }
        }
        assert!(hidden > 300 && visible > 300, "{hidden} {visible}");
    }
}
