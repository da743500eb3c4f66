//! Colour as FLIP needs it: from sRGB to an opponent space in which eyes blur, and to one in which
//! distances are even (Andersson et al. 2020, sections 4.1.1 and 4.1.3).

use std::sync::LazyLock;

use glam::{Mat3, Vec3};
use image::RgbImage;
use rayon::prelude::*;

use super::filter::Plane;
use crate::color::srgb_to_linear;

/// From linear RGB to XYZ, by rows; IEC 61966-2-1 in fractions, as FLIP has it.
const XYZ: [[f64; 3]; 3] = [
    [10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0],
    [2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0],
    [1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0],
];

/// Matrices between linear RGB and XYZ relative to white, so that white is 1 in each.
struct Spaces {
    relative_xyz: Mat3,
    rgb: Mat3,
    linear: [f32; 256],
}

static SPACES: LazyLock<Spaces> = LazyLock::new(|| {
    let row = |row: [f64; 3]| {
        let white: f64 = row.iter().sum();
        row.map(|part| (part / white) as f32)
    };
    let relative_xyz = Mat3::from_cols_array_2d(&XYZ.map(row)).transpose();
    let linear = |byte: usize| srgb_to_linear(byte as f64 / 255.0) as f32;
    Spaces { relative_xyz, rgb: relative_xyz.inverse(), linear: std::array::from_fn(linear) }
});

/// YCxCz of a picture: lightness, red against green, yellow against blue.
pub(super) fn opponent(picture: &RgbImage) -> [Plane; 3] {
    let spaces = &*SPACES;
    let pixels = picture.as_raw().par_chunks_exact(3).map(|pixel| {
        let rgb = Vec3::from([0, 1, 2].map(|i| spaces.linear[usize::from(pixel[i])]));
        let Vec3 { x, y, z } = spaces.relative_xyz * rgb;
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    });
    let pixels: Vec<[f32; 3]> = pixels.collect();
    [0, 1, 2].map(|i| Plane {
        width: picture.width() as usize,
        values: pixels.par_iter().map(|pixel| pixel[i]).collect(),
    })
}

/// From YCxCz to L*a*b* in which colour weighs less the darker it is (Hunt's effect, eq. 4). What
/// no screen shows is clamped to what it does.
pub(super) fn hunt([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let xyz = Vec3::new(y + cx / 500.0, y, y - cz / 200.0);
    hunt_of_rgb(SPACES.rgb * xyz)
}

/// The same from linear RGB.
pub(super) fn hunt_of_rgb(rgb: Vec3) -> [f32; 3] {
    let xyz = SPACES.relative_xyz * rgb.clamp(Vec3::ZERO, Vec3::ONE);
    const DELTA: f32 = 6.0 / 29.0;
    let curve = |t: f32| {
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = xyz.to_array().map(curve);
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greys_have_no_colour_and_white_is_a_hundred() {
        for grey in [0, 7, 128, 255u8] {
            let picture = RgbImage::from_pixel(1, 1, image::Rgb([grey; 3]));
            let [y, cx, cz] = opponent(&picture).map(|plane| plane.values[0]);
            assert!(cx.abs() < 1e-3 && cz.abs() < 1e-3, "{grey}: {cx} {cz}");
            let [lightness, a, b] = hunt([y, cx, cz]);
            assert!(a.abs() < 1e-3 && b.abs() < 1e-3, "{grey}: {a} {b}");
            if grey == 255 {
                assert!((lightness - 100.0).abs() < 1e-3 && (y - 100.0).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn lab_is_that_of_tables() {
        // L*a*b* of the primaries under D65, from published tables, before Hunt's effect.
        for (rgb, lab) in [
            (Vec3::X, [53.24, 80.09, 67.20]),
            (Vec3::Y, [87.73, -86.18, 83.18]),
            (Vec3::Z, [32.30, 79.19, -107.86]),
        ] {
            let found = hunt_of_rgb(rgb);
            let share = lab[0] / 100.0;
            let expected = [lab[0], lab[1] * share, lab[2] * share];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 0.15, "{rgb}: {found} {expected}");
            }
        }
    }
}
