//! What of a scene is seen around a place, by direction, and how much of a picture that makes.
//!
//! Directions are points, not areas, so that a picture's part with surfaces is right in the mean
//! however small they are. What stands in front of what does not matter: any surface will do.

use glam::{DVec2, DVec3};

use super::plan::direction;
use super::raster::{Cells, Surfaces};
use crate::camera::DEFAULT_FOV_Y_DEG;

/// Directions around, of equal angles.
const AZIMUTHS: usize = 96;
/// Angles above the horizon in each of them, from the lowest on.
const ELEVATIONS: usize = 64;
const LOWEST_DEG: f64 = -88.0;
const STEP_DEG: f64 = 2.3;
/// Points of a picture, across and down.
const POINTS: [u32; 2] = [32, 18];
/// Width of a picture by its height.
pub(super) const ASPECT: f64 = 16.0 / 9.0;

/// In which directions there is a surface.
#[derive(Clone, Debug)]
pub(super) struct Panorama {
    /// By azimuth: bits by elevation.
    columns: Vec<u64>,
}

impl Panorama {
    /// Around `eye`, a place on the map.
    pub(super) fn new(surfaces: &Surfaces, eye: DVec3) -> Self {
        Self::part_of(None, f64::INFINITY, surfaces, eye)
    }

    /// Of what lies outside of other cells.
    pub(super) fn beyond(inner: &Cells, surfaces: &Surfaces, eye: DVec3) -> Self {
        Self::part_of(Some(inner), f64::INFINITY, surfaces, eye)
    }

    /// Of what is no farther away than so many metres.
    pub(super) fn within(far: f64, surfaces: &Surfaces, eye: DVec3) -> Self {
        Self::part_of(None, far, surfaces, eye)
    }

    fn part_of(inner: Option<&Cells>, far: f64, surfaces: &Surfaces, eye: DVec3) -> Self {
        let slope = |index| libm::tan((LOWEST_DEG + STEP_DEG * index as f64).to_radians());
        let slopes: [f64; ELEVATIONS] = std::array::from_fn(slope);
        let azimuth = |index| direction(360.0 * index as f64 / AZIMUTHS as f64);
        let column = |index| column(inner, far, surfaces, eye, azimuth(index), &slopes);
        Self { columns: (0..AZIMUTHS).map(column).collect() }
    }

    /// What is seen in either.
    pub(super) fn or(mut self, other: &Self) -> Self {
        self.columns.iter_mut().zip(&other.columns).for_each(|(column, other)| *column |= other);
        self
    }

    /// The part of a picture in which there is a surface, 0 to 1.
    pub(super) fn part(&self, picture: &Picture, yaw_deg: f64) -> f64 {
        // Points are less than a turn to the right: what is truncated is never negative.
        let turned = (yaw_deg / 360.0 * AZIMUTHS as f64).rem_euclid(AZIMUTHS as f64);
        let nearest = turned + AZIMUTHS as f64 + 0.5;
        let seen = picture.points.iter().filter(|(aside, bit)| {
            let azimuth = (nearest + aside) as usize % AZIMUTHS;
            self.columns[azimuth] >> bit & 1 == 1
        });
        seen.count() as f64 / f64::from(POINTS[0] * POINTS[1])
    }
}

/// Bits of the elevations in which a surface is seen along `ahead`. Over a cell, surfaces fill all
/// from the lowest to the highest, within a rectangle.
fn column(
    inner: Option<&Cells>,
    far: f64,
    surfaces: &Surfaces,
    eye: DVec3,
    ahead: DVec2,
    slopes: &[f64; ELEVATIONS],
) -> u64 {
    let (cells, blocks) = (&surfaces.cells, &surfaces.blocks);
    let start = eye.truncate();
    // Nothing is divided by 0 along an axis.
    let ahead = DVec2::select(ahead.cmpeq(DVec2::ZERO), DVec2::splat(1e-12), ahead);
    // From where to where the line is in a rectangle; neither beside it nor behind.
    let crossed = |rectangle: [DVec2; 2]| {
        let [first, last] = rectangle.map(|side| (side - start) / ahead);
        let near = first.min(last).max_element().max(0.0);
        let far = first.max(last).min_element();
        (near <= far && far > 0.0).then_some([near, far])
    };
    // The elevations of what is so high, between two distances.
    let bits = |heights: [f32; 2], [near, far]: [f64; 2]| {
        let [low, high] = heights.map(|z| f64::from(z) - eye.z);
        let least = low / if low < 0.0 { near } else { far };
        let most = high / if high > 0.0 { near } else { far };
        let from = slopes.partition_point(|&slope| slope < least);
        let to = slopes.partition_point(|&slope| slope <= most);
        if from < to { u64::MAX >> (ELEVATIONS - (to - from)) << from } else { 0 }
    };
    let mut seen = 0;
    for block in blocks.along(start, ahead, [0.0, far]) {
        let Some(heights) = surfaces.block_heights(block) else { continue };
        let middle = blocks.middle(block);
        let half = DVec2::splat(blocks.side / 2.0 + cells.side * BLOCK_SLACK);
        let Some([enters, leaves]) = crossed([middle - half, middle + half]) else { continue };
        // Most blocks far away add nothing to what stands before them.
        if bits(heights, [enters, leaves]) & !seen == 0 {
            continue;
        }
        for cell in cells.along(start, ahead, [enters, leaves.min(far)]) {
            let is_within = |inner: &Cells| inner.at(cells.middle(cell)).is_some();
            if !surfaces.is_covered(cell) || inner.is_some_and(is_within) {
                continue;
            }
            if let Some(range) = crossed(surfaces.rectangle(cell)) {
                seen |= bits([surfaces.low[cell], surfaces.high[cell]], range);
            }
        }
    }
    seen
}

/// By what share of a cell a block may seem smaller than its cells together, since coordinates are
/// rounded.
const BLOCK_SLACK: f64 = 1e-3;

/// The directions of the points of a picture with some pitch.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    /// Azimuths to the left of the middle, and the bit of the elevation.
    points: Vec<(f64, u32)>,
}

impl Picture {
    pub(super) fn new(pitch_deg: f64) -> Self {
        let half = libm::tan(DEFAULT_FOV_Y_DEG.to_radians() / 2.0);
        let (sin, cos) = libm::sincos(pitch_deg.to_radians());
        let along =
            |index: u32, count: u32| 2.0 * (f64::from(index) + 0.5) / f64::from(count) - 1.0;
        let mut points = Vec::new();
        for (row, column) in (0..POINTS[1]).flat_map(|row| (0..POINTS[0]).map(move |x| (row, x))) {
            let left = -along(column, POINTS[0]) * half * ASPECT;
            let up = along(row, POINTS[1]) * half;
            let (ahead, rise) = (cos - up * sin, sin + up * cos);
            let elevation = libm::atan2(rise, libm::hypot(ahead, left)).to_degrees();
            let bit = ((elevation - LOWEST_DEG) / STEP_DEG).round().max(0.0);
            if bit < ELEVATIONS as f64 {
                let azimuth = libm::atan2(left, ahead).to_degrees() / 360.0 * AZIMUTHS as f64;
                points.push((azimuth, bit as u32));
            }
        }
        Self { points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(side: f64) -> Surfaces {
        let count = (200.0 / side) as usize;
        let corner = DVec2::splat(-100.0);
        Surfaces::new(Cells { corner, side, columns: count, rows: count })
    }

    fn square(surfaces: &mut Surfaces, corners: [DVec3; 4]) {
        let [a, b, c, d] = corners;
        surfaces.add([a, b, c]);
        surfaces.add([a, c, d]);
    }

    #[test]
    fn a_plain_is_seen_below_the_horizon_and_straight_down() {
        let mut surfaces = map(0.5);
        let at = |x: f64, y: f64| DVec3::new(x * 200.0, y * 200.0, 0.0);
        square(&mut surfaces, [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)]);
        let panorama = Panorama::new(&surfaces, DVec3::new(3.0, 1.0, 1.7));
        for yaw in [0.0, 17.0, 90.0, 200.0] {
            let part = |pitch| panorama.part(&Picture::new(pitch), yaw);
            assert!((part(0.0) - 0.5).abs() < 0.04, "{}", part(0.0));
            assert_eq!(part(-60.0), 1.0);
            assert_eq!(part(40.0), 0.0);
        }
        // From outside the map only what is inside of it is seen.
        let beside = Panorama::new(&surfaces, DVec3::new(300.0, 0.0, 50.0));
        let part = beside.part(&Picture::new(-20.0), 180.0);
        // It is 200 to 400 m away and 200 m wide, 50 m below: 7 by 40 degrees of 60 by 92.
        assert!((part - 0.05).abs() < 0.02, "{part}");
        assert_eq!(beside.part(&Picture::new(-20.0), 0.0), 0.0);
    }

    #[test]
    fn a_wall_fills_as_much_of_the_picture_as_its_angles_say() {
        let mut surfaces = map(0.25);
        // 10 m away across +y, 8 m to both sides, from 3 m below to 3 m above the eye.
        let at = |x: f64, z: f64| DVec3::new(x, 10.0, z);
        square(&mut surfaces, [at(-8.0, -3.0), at(8.0, -3.0), at(8.0, 3.0), at(-8.0, 3.0)]);
        let panorama = Panorama::new(&surfaces, DVec3::ZERO);
        let half = 10.0 * 30f64.to_radians().tan();
        let expected = 16.0 * 6.0 / (4.0 * half * half * ASPECT);
        let found = panorama.part(&Picture::new(0.0), 90.0);
        assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
        assert_eq!(panorama.part(&Picture::new(0.0), 270.0), 0.0);
        // Half of it is out of a picture that looks past its end.
        let aside = panorama.part(&Picture::new(0.0), 90.0 + 45.0);
        assert!(aside > 0.0 && aside < found * 0.8, "{aside}");
    }

    #[test]
    fn sparse_things_far_away_fill_what_they_cover() {
        let mut surfaces = map(1.0);
        // A quarter of the ground.
        for (x, y) in (0..50).flat_map(|x| (0..50).map(move |y| (x, y))) {
            let [x, y] = [x, y].map(|at| f64::from(at) * 4.0 - 100.0);
            let at = |i: f64, j: f64| DVec3::new(x + i, y + j, 0.0);
            square(&mut surfaces, [at(0.1, 0.1), at(1.9, 0.1), at(1.9, 1.9), at(0.1, 1.9)]);
        }
        let above = Panorama::new(&surfaces, DVec3::new(0.3, 0.7, 60.0));
        let part = above.part(&Picture::new(-80.0), 40.0);
        assert!((part - 0.25).abs() < 0.06, "{part}");
    }

    #[test]
    fn blocks_that_are_left_out_add_nothing() {
        let mut random = crate::random::Random::new(5, 0);
        let mut unit = || random.unit();
        let mut surfaces = map(0.5);
        for _ in 0..300 {
            let [x, y, side, z] = [200.0, 200.0, 12.0, 9.0].map(|most| unit() * most);
            let at = |i: f64, j: f64| DVec3::new(x - 100.0 + i * side, y - 100.0 + j * side, z);
            square(&mut surfaces, [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)]);
        }
        // The same surfaces, of which every block may add something.
        let mut unknown = surfaces.clone();
        unknown.raise_blocks();
        for _ in 0..60 {
            let [x, y, z] = [300.0, 300.0, 40.0].map(|most| unit() * most);
            let eye = DVec3::new(x - 150.0, y - 150.0, z);
            for far in [30.0, f64::INFINITY] {
                let [some, all] = [&surfaces, &unknown].map(|map| Panorama::within(far, map, eye));
                assert_eq!(some.columns, all.columns, "{eye} {far}");
            }
        }
    }
}
