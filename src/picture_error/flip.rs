//! FLIP: what a person sees who flips between two pictures.
//!
//! P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. D. Fairchild, *FLIP: A
//! Difference Evaluator for Alternating Images*, HPG 2020. Sections and numbers are the paper's
//! (section 4); its filters are Gaussians and their derivatives, so all of them go along rows and
//! then along columns.

use std::f64::consts::PI;

use glam::Vec3;
use image::RgbImage;
use image::imageops::crop_imm;
use rayon::prelude::*;

use super::color::{hunt, hunt_of_rgb, opponent};
use super::filter::{Kernel, Plane};

/// Pixels in a degree of what is seen: a 4K screen 0.7 m wide from 0.7 m away, as the paper has
/// it, in whole pixels.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// One of the Gaussians of which an eye's blur is the sum (table 1): `a √(π/b) exp(−π² x²/b)` at
/// `x` degrees.
struct Bell {
    a: f64,
    b: f64,
}

/// The blur of lightness, of red against green and of yellow against blue.
const BLUR: [&[Bell]; 3] = [
    &[Bell { a: 1.0, b: 0.0047 }],
    &[Bell { a: 1.0, b: 0.0053 }],
    &[Bell { a: 34.1, b: 0.04 }, Bell { a: 13.5, b: 0.025 }],
];
/// The widest `b`, from which the reach of all filters follows.
const WIDEST: f64 = 0.04;

/// Exponent of colour differences (section 4.1.4).
const COLOR_EXPONENT: f32 = 0.7;
/// Differences up to this part of the largest are spread over `NEAR_SHARE` of the range.
const NEAR_PART: f32 = 0.4;
const NEAR_SHARE: f32 = 0.95;
/// Degrees that the finest feature takes (section 4.2.1).
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent of feature differences (section 4.2.2).
const FEATURE_EXPONENT: f32 = 0.5;

/// The difference at each pixel, 0 (none) to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Pixels in a row.
    pub width: u32,
    /// Row by row.
    pub values: Vec<f32>,
}

impl FlipMap {
    /// The mean over all pixels; 0 of none.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.values.iter().map(|&value| f64::from(value)).sum();
        sum / self.values.len().max(1) as f64
    }

    /// The least value that at least `percent` of the pixels do not exceed; 0 of none.
    pub fn percentile(&self, percent: f64) -> f64 {
        let mut values = self.values.clone();
        let rank = (percent / 100.0 * values.len() as f64).ceil() as usize;
        match values.len() {
            0 => 0.0,
            count => {
                let place = rank.saturating_sub(1).min(count - 1);
                f64::from(*values.select_nth_unstable_by(place, f32::total_cmp).1)
            }
        }
    }

    /// The map as a picture: black where there is no difference, over purple and orange to
    /// almost white.
    pub fn picture(&self) -> RgbImage {
        let height = self.values.len() / self.width.max(1) as usize;
        RgbImage::from_fn(self.width, height as u32, |x, y| {
            let place = y as usize * self.width as usize + x as usize;
            image::Rgb(super::magma::magma(self.values[place]))
        })
    }
}

/// The difference between two pictures of the same size; `None` where their sizes differ. The
/// order of the two does not matter.
pub fn flip(reference: &RgbImage, test: &RgbImage, pixels_per_degree: f64) -> Option<FlipMap> {
    if reference.dimensions() != test.dimensions() {
        return None;
    }
    let (width, height) = reference.dimensions();
    let mut values = vec![0.0; width as usize * height as usize];
    if let Some([x, y, across, down]) = matters(reference, test, pixels_per_degree) {
        let [reference, test] =
            [reference, test].map(|p| crop_imm(p, x, y, across, down).to_image());
        let part = flip_of_all(&reference, &test, pixels_per_degree);
        let rows = values.chunks_mut(width as usize).skip(y as usize);
        for (row, part) in rows.zip(part.chunks(across as usize)) {
            row[x as usize..(x + across) as usize].copy_from_slice(part);
        }
    }
    Some(FlipMap { width, values })
}

/// The part of two pictures outside of which they do not differ, nor does anything that a filter makes of
/// them: its left and upper end, and its width and height. Nothing where they are the same.
fn matters(a: &RgbImage, b: &RgbImage, pixels_per_degree: f64) -> Option<[u32; 4]> {
    let (width, height) = a.dimensions();
    let row = |picture: &RgbImage| 3 * picture.width().max(1) as usize;
    let rows = a.as_raw().chunks(row(a)).zip(b.as_raw().chunks(row(b)));
    let (mut columns, mut lines) = ([u32::MAX, 0], [u32::MAX, 0]);
    let widen = |[least, most]: &mut [u32; 2], at: u32| {
        (*least, *most) = ((*least).min(at), (*most).max(at));
    };
    for (y, (a, b)) in rows.enumerate() {
        let differ = |(a, b): (&u8, &u8)| a != b;
        let Some(first) = a.iter().zip(b).position(differ) else { continue };
        let last = a.iter().zip(b).rposition(differ).unwrap_or(first);
        widen(&mut lines, y as u32);
        widen(&mut columns, first as u32 / 3);
        widen(&mut columns, last as u32 / 3);
    }
    if lines[0] > lines[1] {
        return None;
    }
    // Once for what a difference reaches, and once more for what that is made of.
    let margin = 2 * blur_radius(pixels_per_degree).max(feature_radius(pixels_per_degree)) as u32;
    let range = |[least, most]: [u32; 2], side: u32| {
        let from = least.saturating_sub(margin);
        [from, side.min(most.saturating_add(margin + 1)) - from]
    };
    let ([x, across], [y, down]) = (range(columns, width), range(lines, height));
    Some([x, y, across, down])
}

/// The difference at each pixel, row by row.
fn flip_of_all(reference: &RgbImage, test: &RgbImage, pixels_per_degree: f64) -> Vec<f32> {
    let pictures = [reference, test].map(opponent);
    let features = feature_difference(&pictures, pixels_per_degree);
    let blurs = BLUR.map(|bells| Blur::new(bells, pixels_per_degree));
    let blurred = pictures.map(|planes| {
        let [y, cx, cz] = [0, 1, 2].map(|i| blurs[i].of(&planes[i]));
        let pixels = y.values.into_par_iter().zip(cx.values).zip(cz.values);
        pixels.map(|((y, cx), cz)| hunt([y, cx, cz])).collect::<Vec<_>>()
    });
    let most = hyab(hunt_of_rgb(Vec3::Y), hunt_of_rgb(Vec3::Z)).powf(COLOR_EXPONENT);
    let [reference, test] = &blurred;
    let values = reference.par_iter().zip(test).zip(&features.values).map(|((a, b), feature)| {
        let color = redistributed(hyab(*a, *b).powf(COLOR_EXPONENT), most);
        color.powf(1.0 - feature) // eq. 8
    });
    values.collect()
}

/// Pixels that the blur of an eye reaches: three standard deviations of the widest of its Gaussians.
fn blur_radius(pixels_per_degree: f64) -> usize {
    (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize
}

/// The standard deviation of what finds edges and points, in pixels.
fn feature_sigma(pixels_per_degree: f64) -> f64 {
    0.5 * FEATURE_WIDTH * pixels_per_degree
}

/// Pixels that it reaches.
fn feature_radius(pixels_per_degree: f64) -> usize {
    (3.0 * feature_sigma(pixels_per_degree)).ceil() as usize
}

/// What blurs one channel (section 4.1.2): a sum of Gaussians, each with its share.
struct Blur(Vec<(f32, Kernel)>);

impl Blur {
    fn new(bells: &[Bell], pixels_per_degree: f64) -> Self {
        let radius = blur_radius(pixels_per_degree);
        let parts: Vec<(f64, Kernel)> = bells
            .iter()
            .map(|&Bell { a, b }| {
                let bell = |x: f64| (-(PI * x / pixels_per_degree).powi(2) / b).exp();
                let sum: f64 = (-(radius as i64)..=radius as i64).map(|x| bell(x as f64)).sum();
                // Over both axes it weighs the square of its sum.
                (a * (PI / b).sqrt() * sum * sum, Kernel::new(radius, |x| bell(x) / sum))
            })
            .collect();
        let whole: f64 = parts.iter().map(|(weight, _)| weight).sum();
        Self(parts.into_iter().map(|(weight, kernel)| ((weight / whole) as f32, kernel)).collect())
    }

    fn of(&self, plane: &Plane) -> Plane {
        let parts = self.0.iter().map(|(share, kernel)| {
            let part = plane.filtered(kernel, kernel);
            if *share == 1.0 { part } else { part.map(|value| share * value) }
        });
        parts.reduce(|a, b| a.zip(&b, |a, b| a + b)).unwrap_or_else(|| plane.clone())
    }
}

/// The distance between two colours (eq. 3): that of lightness, and that of colour as the crow
/// flies.
fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Spreads small differences over most of 0 to 1, and large ones over the rest (section 4.1.4).
fn redistributed(difference: f32, most: f32) -> f32 {
    let near = NEAR_PART * most;
    if difference < near {
        NEAR_SHARE / near * difference
    } else {
        NEAR_SHARE + (difference - near) / (most - near) * (1.0 - NEAR_SHARE)
    }
}

/// How much edges and points differ, 0 to 1 (section 4.2, eq. 7).
fn feature_difference(pictures: &[[Plane; 3]; 2], pixels_per_degree: f64) -> Plane {
    let [[edges, points], [test_edges, test_points]] = [0, 1].map(|i| {
        let lightness = pictures[i][0].map(|y| (y + 16.0) / 116.0);
        features(&lightness, pixels_per_degree)
    });
    let edges = edges.zip(&test_edges, |a, b| (a - b).abs());
    let points = points.zip(&test_points, |a, b| (a - b).abs());
    edges.zip(&points, |edge, point| {
        (std::f32::consts::FRAC_1_SQRT_2 * edge.max(point)).powf(FEATURE_EXPONENT)
    })
}

/// How much of an edge and of a point there is at each pixel (section 4.2.1): the lengths of the
/// first and of the second derivatives of a Gaussian.
fn features(lightness: &Plane, pixels_per_degree: f64) -> [Plane; 2] {
    let sigma = feature_sigma(pixels_per_degree);
    let radius = feature_radius(pixels_per_degree);
    let steps = || (-(radius as i64)..=radius as i64).map(|x| x as f64);
    let bell = |x: f64| (-x * x / (2.0 * sigma * sigma)).exp();
    let sum: f64 = steps().map(bell).sum();
    let smooth = Kernel::new(radius, |x| bell(x) / sum);
    // What is above 0 sums up to 1, and what is below to −1.
    let derivative = |of: &dyn Fn(f64) -> f64| {
        let above: f64 = steps().map(of).filter(|&w| w > 0.0).sum();
        let below: f64 = steps().map(of).filter(|&w| w < 0.0).map(|w| -w).sum();
        Kernel::new(radius, |x| if of(x) > 0.0 { of(x) / above } else { of(x) / below })
    };
    let first = derivative(&|x| -x * bell(x));
    let second = derivative(&|x| (x * x / (sigma * sigma) - 1.0) * bell(x));
    let smoothed = lightness.across(&smooth);
    [first, second].map(|kernel| {
        let across = lightness.filtered(&kernel, &smooth);
        across.zip(&smoothed.down(&kernel), f32::hypot)
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{changed, picture, plain};
    use super::*;

    #[test]
    fn values_are_those_of_the_authors_own_program() {
        // NVIDIA's FLIP 1.0 through nv-flip 0.1.2.
        let places =
            [(0, 0), (20, 17), (45, 3), (46, 20), (30, 40), (55, 10), (63, 47), (12, 10), (5, 33)];
        let expected = [
            (
                67.0,
                0.145_617_49,
                [
                    0.0,
                    0.3080354,
                    0.5056697,
                    0.31954843,
                    0.14025782,
                    0.96140105,
                    0.9207964,
                    0.027053624,
                    0.06782099,
                ],
            ),
            (
                30.0,
                0.153_086_85,
                [
                    0.0,
                    0.31171426,
                    0.95631003,
                    0.28964406,
                    0.23982924,
                    0.9752267,
                    0.9675009,
                    0.27845576,
                    0.088319495,
                ],
            ),
        ];
        for (pixels_per_degree, mean, values) in expected {
            let map = flip(&picture(plain), &picture(changed), pixels_per_degree).unwrap();
            assert!((map.mean() - mean).abs() < 1e-5, "{} against {mean}", map.mean());
            for ((x, y), value) in places.into_iter().zip(values) {
                let found = map.values[y * map.width as usize + x];
                assert!((found - value).abs() < 2e-4, "{x} {y}: {found} against {value}");
            }
        }
    }

    #[test]
    fn a_picture_is_not_different_from_itself_and_order_does_not_matter() {
        let [a, b] = [picture(plain), picture(changed)];
        assert_eq!(flip(&a, &a, PIXELS_PER_DEGREE).unwrap().mean(), 0.0);
        assert_eq!(flip(&a, &b, PIXELS_PER_DEGREE), flip(&b, &a, PIXELS_PER_DEGREE));
        assert_eq!(flip(&a, &RgbImage::new(64, 47), PIXELS_PER_DEGREE), None);
    }

    #[test]
    fn what_lies_outside_of_all_differences_is_left_out_and_changes_nothing() {
        let before = RgbImage::from_fn(160, 120, |x, y| {
            image::Rgb([x as u8, (x * y % 251) as u8, 2 * y as u8])
        });
        let mut after = before.clone();
        // One place in the middle, one in a corner, and one row.
        for places in [&[(70, 66), (75, 61)][..], &[(0, 119)], &[(0, 50), (159, 50)]] {
            for &(x, y) in places {
                after.put_pixel(x, y, image::Rgb([255, 0, 99]));
            }
            let found = flip(&before, &after, PIXELS_PER_DEGREE).unwrap();
            assert_eq!(found.values, flip_of_all(&before, &after, PIXELS_PER_DEGREE));
            assert!(found.mean() > 0.0);
            after = before.clone();
        }
        let part = matters(&before, &before, PIXELS_PER_DEGREE);
        assert_eq!((part, flip(&before, &before, PIXELS_PER_DEGREE).unwrap().mean()), (None, 0.0));
    }

    #[test]
    fn black_and_white_differ_by_nearly_all_there_is() {
        let [black, white] = [0, 255].map(|grey| RgbImage::from_pixel(9, 5, image::Rgb([grey; 3])));
        let map = flip(&black, &white, PIXELS_PER_DEGREE).unwrap();
        let least = map.values.iter().copied().fold(1.0, f32::min);
        assert!((0.95..=1.0).contains(&least), "{least}");
        let blue_and_green = [image::Rgb([0, 0, 255]), image::Rgb([0, 255, 0])]
            .map(|color| RgbImage::from_pixel(4, 4, color));
        let map = flip(&blue_and_green[0], &blue_and_green[1], PIXELS_PER_DEGREE).unwrap();
        assert!((map.mean() - 1.0).abs() < 1e-4, "{}", map.mean());
    }

    #[test]
    fn percentiles_are_by_nearest_rank() {
        let map = FlipMap { width: 10, values: (1..=100).rev().map(|v| v as f32).collect() };
        assert_eq!([0.0, 1.0, 95.0, 100.0].map(|p| map.percentile(p)), [1.0, 1.0, 95.0, 100.0]);
        let nothing = FlipMap { width: 0, values: vec![] };
        assert_eq!((nothing.percentile(95.0), nothing.mean()), (0.0, 0.0));
        assert_eq!(map.picture().dimensions(), (10, 10));
    }
}
