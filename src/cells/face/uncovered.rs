//! What of a picture no surface shows that was made from other places.
//!
//! What is hidden from a cell's middle may be seen from elsewhere in it. Seen from there, what the surfaces
//! made so far do not show is made a surface of its own, as incremental textured depth meshes are (Wilson
//! and Manocha, 2003).

use glam::{DVec3, Vec3};

use super::depths::Depths;
use super::raster::triangle;
use super::{Captured, Layer};
use crate::cells::options::CellOptions;

/// Pixels around what is uncovered that are taken with it, so that both surfaces overlap.
const MORE_PX: isize = 2;

/// Triangles nearer to a camera than this part of the reach are cut.
const NEAR_PART: f64 = 0.05;

impl Captured {
    /// Leaves of the picture what none of `layers`, which are around `origin`, shows within the bound from
    /// here; false where that is nothing.
    pub fn keep_uncovered<'a>(
        &mut self,
        layers: impl Iterator<Item = &'a Layer> + Clone,
        origin: DVec3,
        options: &CellOptions,
    ) -> bool {
        let mut uncovered = self.uncovered(layers, origin, options);
        if !uncovered.contains(&true) {
            return false;
        }
        let side = self.picture.width() as isize;
        uncovered = grown(&uncovered, side);
        for (at, (metres, uncovered)) in self.metres.iter_mut().zip(uncovered).enumerate() {
            if !uncovered {
                *metres = f32::INFINITY;
                let at = at as u32;
                let pixel = self.picture.get_pixel_mut(at % side as u32, at / side as u32);
                pixel.0[3] = 0;
            }
        }
        true
    }

    fn uncovered<'a>(
        &self,
        layers: impl Iterator<Item = &'a Layer>,
        origin: DVec3,
        options: &CellOptions,
    ) -> Vec<bool> {
        let depths = self.depths(options.reach_m(), options);
        let bound = 2.0 * options.error_px as f32;
        let side = depths.width as isize;
        let mut uncovered: Vec<bool> = (0..self.metres.len())
            .map(|at| depths.parallax(at as isize % side, at as isize / side).is_some())
            .collect();
        let to_camera = self.rotation.inverse();
        let near = NEAR_PART * options.reach_m();
        let camera = |at: Vec3| to_camera * (at.as_dvec3() + (origin - self.eye));
        let size = [depths.width, depths.height()];
        for layer in layers {
            let points: Vec<DVec3> = layer.positions.iter().map(|&at| camera(at)).collect();
            for corners in &layer.triangles {
                let corners = corners.map(|corner| points[corner as usize]);
                for corners in cut_before(corners, near) {
                    let corners = corners.map(|at| pixel(at, &depths, options));
                    triangle(corners, size, |x, y, parallax| {
                        cover(&mut uncovered, &depths, [x, y], parallax, bound);
                    });
                }
            }
        }
        uncovered
    }
}

/// Covers those of a pixel and the ones around it that have this parallax.
fn cover(
    uncovered: &mut [bool],
    depths: &Depths<'_>,
    [x, y]: [isize; 2],
    parallax: f32,
    bound: f32,
) {
    for y in y - 1..=y + 1 {
        for x in x - 1..=x + 1 {
            if let Some(expected) = depths.parallax(x, y)
                && (parallax - expected).abs() <= bound
            {
                uncovered[y as usize * depths.width + x as usize] = false;
            }
        }
    }
}

/// Where a point before a camera is seen, with its parallax.
fn pixel(at: DVec3, depths: &Depths<'_>, options: &CellOptions) -> [f32; 3] {
    let middle = depths.width as f64 / 2.0;
    let [x, y] = [at.x, -at.y].map(|side| middle + side / -at.z * options.focal_px());
    [x as f32, y as f32, depths.pixel_metres / -at.z as f32]
}

/// What of a triangle is farther before a camera than `near` metres: up to two triangles.
fn cut_before(corners: [DVec3; 3], near: f64) -> Vec<[DVec3; 3]> {
    let is_before = |at: DVec3| -at.z >= near;
    if corners.iter().all(|&at| is_before(at)) {
        return vec![corners];
    }
    let mut kept = Vec::with_capacity(4);
    for (at, next) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
        if is_before(at) {
            kept.push(at);
        }
        if is_before(at) != is_before(next) {
            kept.push(at.lerp(next, (-near - at.z) / (next.z - at.z)));
        }
    }
    (2..kept.len()).map(|last| [kept[0], kept[last - 1], kept[last]]).collect()
}

/// With the pixels around each.
fn grown(pixels: &[bool], side: isize) -> Vec<bool> {
    let mut grown = vec![false; pixels.len()];
    for (at, _) in pixels.iter().enumerate().filter(|(_, is_in)| **is_in) {
        let [x, y] = [at as isize % side, at as isize / side];
        let range = |at: isize| (at - MORE_PX).max(0)..(at + MORE_PX + 1).min(side);
        for y in range(y) {
            range(x).for_each(|x| grown[(y * side + x) as usize] = true);
        }
    }
    grown
}
