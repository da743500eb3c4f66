//! A small picture of how far away what is seen is.

use std::ops::Range;

use glam::{DVec3, Vec3};

use super::occluders::Occluder;
use crate::camera::View;

/// Pixels across and up.
pub(super) const SIZE: [usize; 2] = [160, 90];

/// How far away what is seen is, by pixel, from the upper left, row by row.
#[derive(Clone, Debug)]
pub(super) struct DepthPicture {
    /// One over metres along the line of sight; 0 where nothing is seen.
    inverse: Vec<f32>,
    /// Metres before the eye at which triangles are cut.
    near: f32,
    eye: DVec3,
    /// Right and up, a metre being half of the picture at a depth of 1 m, and forward.
    axes: [DVec3; 3],
    corners: Vec<Corner>,
}

/// A corner as the camera sees it.
#[derive(Clone, Copy, Debug)]
struct Corner {
    /// Across, up and along the line of sight; half of the picture is 1 at a depth of 1 m.
    at: Vec3,
    /// Pixels from the left and from above; means nothing behind the near plane.
    pixel: [f32; 2],
}

impl Corner {
    fn new(at: Vec3) -> Self {
        let half = SIZE.map(|pixels| pixels as f32 / 2.0);
        let over = 1.0 / at.z;
        Self { at, pixel: [(1.0 + at.x * over) * half[0], (1.0 - at.y * over) * half[1]] }
    }

    fn is_before(&self, near: f32) -> bool {
        self.at.z >= near
    }
}

impl DepthPicture {
    /// Before any view; triangles are cut so many metres before the eye, above 0.
    pub fn new(near: f32) -> Self {
        Self {
            inverse: vec![0.0; SIZE[0] * SIZE[1]],
            near,
            eye: DVec3::ZERO,
            axes: [DVec3::ZERO; 3],
            corners: Vec::new(),
        }
    }

    /// Begins the picture of a view, in which nothing is seen yet.
    pub fn begin(&mut self, view: &View) {
        self.inverse.fill(0.0);
        let [across, up] = view.frustum.across();
        self.eye = view.pose.position;
        self.axes = [across, up, view.frustum.forward];
    }

    /// Draws a surface.
    pub fn draw(&mut self, occluder: &Occluder) {
        let offset = occluder.origin - self.eye;
        let offset = self.axes.map(|axis| axis.dot(offset) as f32);
        let axes = self.axes.map(|axis| axis.as_vec3());
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(occluder.positions.iter().map(|&at| {
            Corner::new(Vec3::from_array([0, 1, 2].map(|axis| axes[axis].dot(at) + offset[axis])))
        }));
        for triangle in &occluder.triangles {
            self.draw_triangle(triangle.map(|corner| corners[corner as usize]));
        }
        self.corners = corners;
    }

    fn draw_triangle(&mut self, corners: [Corner; 3]) {
        let [columns, rows] = pixels_around(&corners, self.near);
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let corners = corners.map(|corner| corner.at);
        // The ray through (x, y, 1) meets the triangle's plane where it is a sum of corners. These are
        // the parts of each, over the depth: no division by the corners' depths, some of which may be
        // behind the eye (Olano and Greer 1997).
        let crosses: [Vec3; 3] =
            std::array::from_fn(|i| corners[(i + 1) % 3].cross(corners[(i + 2) % 3]));
        let whole = corners[0].dot(crosses[0]);
        if whole == 0.0 {
            return;
        }
        let parts = crosses.map(|cross| cross / whole);
        for row in rows {
            let y = 1.0 - (row as f32 + 0.5) / (SIZE[1] as f32 / 2.0);
            let pixels = &mut self.inverse[row * SIZE[0]..(row + 1) * SIZE[0]];
            for (column, pixel) in columns.clone().zip(&mut pixels[columns.clone()]) {
                let x = (column as f32 + 0.5) / (SIZE[0] as f32 / 2.0) - 1.0;
                let [a, b, c] = parts.map(|part| part.x * x + part.y * y + part.z);
                if (a >= 0.0) & (b >= 0.0) & (c >= 0.0) {
                    *pixel = pixel.max(a + b + c);
                }
            }
        }
    }

    /// Where what is seen is, metres from the eye, by pixel; infinite where nothing is.
    pub fn points_into(&self, points: &mut [Vec<f32>; 3]) {
        // A metre of an axis is more or less than one, since half of the picture is one.
        let axes = self.axes.map(|axis| (axis / axis.length_squared()).as_vec3());
        for points in points.iter_mut() {
            points.clear();
        }
        for (index, &inverse) in self.inverse.iter().enumerate() {
            let [column, row] = [index % SIZE[0], index / SIZE[0]];
            let x = (column as f32 + 0.5) / (SIZE[0] as f32 / 2.0) - 1.0;
            let y = 1.0 - (row as f32 + 0.5) / (SIZE[1] as f32 / 2.0);
            let at = (axes[0] * x + axes[1] * y + axes[2]) / inverse;
            for (points, at) in points.iter_mut().zip(at.to_array()) {
                points.push(if inverse > 0.0 { at } else { f32::INFINITY });
            }
        }
    }
}

/// Columns and rows of pixels whose middles may be in a triangle.
fn pixels_around(corners: &[Corner; 3], near: f32) -> [Range<usize>; 2] {
    let [mut least, mut most] = [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]];
    let mut add = |corner: &Corner| {
        for axis in 0..2 {
            least[axis] = least[axis].min(corner.pixel[axis]);
            most[axis] = most[axis].max(corner.pixel[axis]);
        }
    };
    for (index, a) in corners.iter().enumerate() {
        let b = &corners[(index + 1) % 3];
        if a.is_before(near) {
            add(a);
        }
        if a.is_before(near) != b.is_before(near) {
            let cut = a.at + (b.at - a.at) * ((near - a.at.z) / (b.at.z - a.at.z));
            add(&Corner::new(Vec3 { z: near, ..cut }));
        }
    }
    // Middles are at halves; rounding must not lose one.
    [0, 1].map(|axis| {
        let clamped = |at: f32| at.clamp(0.0, SIZE[axis] as f32);
        let (from, to) = (clamped(least[axis] - 0.51), clamped(most[axis] + 0.51));
        // Not by `ceil`, which is a call where a processor may have no instruction for it.
        let whole = from as usize;
        whole + usize::from((whole as f32) < from)..to as usize
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::runtime::test_tree::view;

    const NEAR: f32 = 1e-3;

    fn random_occluder(random: &mut Random) -> Occluder {
        let mut corner = || Vec3::from_array([0; 3].map(|_| random.between(-20.0, 20.0) as f32));
        let positions: Vec<Vec3> = (0..60).map(|_| corner()).collect();
        let triangles = (0..20).map(|at| [0, 1, 2].map(|corner| at * 3 + corner)).collect();
        Occluder { bbox: [DVec3::ZERO; 2], origin: DVec3::new(3.0, 0.0, 0.0), positions, triangles }
    }

    /// Metres along the line of sight to the nearest triangle on the ray through a pixel's middle.
    fn nearest(occluder: &Occluder, pixel: usize, view: &View) -> f64 {
        let [column, row] = [pixel % SIZE[0], pixel / SIZE[0]].map(|at| at as f64 + 0.5);
        let [x, y] = [column / 80.0 - 1.0, 1.0 - row / 45.0];
        let axes = view.frustum.across().map(|axis| axis / axis.length_squared());
        let ray = view.frustum.forward + axes[0] * x + axes[1] * y;
        let mut nearest = f64::INFINITY;
        for triangle in &occluder.triangles {
            let [a, b, c] = triangle.map(|at| {
                occluder.origin + occluder.positions[at as usize].as_dvec3() - view.pose.position
            });
            // a + u (b - a) + v (c - a) = t ray, by Cramer's rule.
            let [u, v] = [b - a, c - a];
            let whole = u.cross(v).dot(ray);
            let t = u.cross(v).dot(a) / whole;
            let at = ray * t - a;
            let [share_u, share_v] = [at.cross(v).dot(u.cross(v)), u.cross(at).dot(u.cross(v))]
                .map(|share| share / u.cross(v).length_squared());
            let inside = share_u >= 0.0 && share_v >= 0.0 && share_u + share_v <= 1.0;
            if inside && t >= f64::from(NEAR) {
                nearest = nearest.min(t);
            }
        }
        nearest
    }

    #[test]
    fn depths_are_those_of_rays_through_the_middles_of_pixels() {
        let mut random = Random::new(3, 0);
        let (mut picture, view) = (DepthPicture::new(NEAR), view());
        let (mut off, mut hits) = (0, 0);
        for _ in 0..10 {
            let occluder = random_occluder(&mut random);
            picture.begin(&view);
            picture.draw(&occluder);
            for (pixel, &inverse) in picture.inverse.iter().enumerate() {
                let expected = 1.0 / nearest(&occluder, pixel, &view);
                // Edges may pass by a pixel's middle on either side.
                let is_off = (f64::from(inverse) - expected).abs() > 1e-3 * expected + 1e-6;
                off += u32::from(is_off);
                hits += u32::from(expected > 0.0);
            }
        }
        assert!(hits > 50_000, "{hits}");
        assert!(off < hits / 1000, "{off} of {hits}");
    }

    #[test]
    fn points_are_where_the_surface_is() {
        let corners = [[-90.0, -90.0], [90.0, -90.0], [0.0, 90.0]];
        let positions = corners.map(|[y, z]| Vec3::new(8.0, y, z)).to_vec();
        let origin = DVec3::new(2.0, 1.0, 0.0);
        let occluder =
            Occluder { bbox: [DVec3::ZERO; 2], origin, positions, triangles: vec![[0, 1, 2]] };
        let mut picture = DepthPicture::new(NEAR);
        picture.begin(&view());
        picture.draw(&occluder);
        let mut points = Default::default();
        picture.points_into(&mut points);
        let [x, y, z] = &points;
        assert!(x.iter().all(|x| (x - 10.0).abs() < 1e-4));
        // 90 degrees: from 10 m away, as far across as up.
        let upper_left = [y[0], z[0]];
        let expected = [10.0 * (1.0 - 1.0 / 160.0), 10.0 * (1.0 - 1.0 / 90.0)];
        assert!(upper_left.iter().zip(expected).all(|(at, found)| (at - found).abs() < 1e-3));
    }
}
