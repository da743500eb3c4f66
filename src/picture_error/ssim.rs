//! Structural similarity: Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, *Image Quality
//! Assessment: From Error Visibility to Structural Similarity*, IEEE Transactions on Image
//! Processing 13(4), 2004.

use image::RgbImage;
use rayon::prelude::*;

use super::filter::{Kernel, Plane};

/// Standard deviation of the window, and how far it reaches: 11 × 11 pixels (section III.B).
const SIGMA: f64 = 1.5;
const REACH: usize = 5;
/// `C1` and `C2` (eqs. 7 and 11) for values of 0 to 255.
const C: [f32; 2] = [(0.01 * 255.0) * (0.01 * 255.0), (0.03 * 255.0) * (0.03 * 255.0)];

/// The mean similarity of two pictures in luma (eq. 17), 1 where they are the same; `None` where
/// their sizes differ or are below the window's.
pub fn ssim(a: &RgbImage, b: &RgbImage) -> Option<f64> {
    let (width, height) = a.dimensions();
    let window = 2 * REACH as u32 + 1;
    if a.dimensions() != b.dimensions() || width < window || height < window {
        return None;
    }
    if a == b {
        return Some(1.0);
    }
    let bell = |x: f64| (-x * x / (2.0 * SIGMA * SIGMA)).exp();
    let sum: f64 = (-(REACH as i64)..=REACH as i64).map(|x| bell(x as f64)).sum();
    let kernel = Kernel::new(REACH, |x| bell(x) / sum);
    let mean = |plane: &Plane| plane.filtered(&kernel, &kernel);
    let [a, b] = [a, b].map(luma);
    let [mean_a, mean_b] = [&a, &b].map(mean);
    let [square_a, square_b] = [&a, &b].map(|plane| mean(&plane.map(|v| v * v)));
    let product = mean(&a.zip(&b, |a, b| a * b));
    let index = |at: usize| {
        let (x, y) = (mean_a.values[at], mean_b.values[at]);
        let variances = square_a.values[at] - x * x + square_b.values[at] - y * y;
        let covariance = product.values[at] - x * y;
        // Eq. 13.
        (2.0 * x * y + C[0]) * (2.0 * covariance + C[1])
            / ((x * x + y * y + C[0]) * (variances + C[1]))
    };
    // Only where the whole window is within the picture.
    let (width, height) = (width as usize, height as usize);
    let (columns, rows) = (REACH..width - REACH, REACH..height - REACH);
    let count = columns.len() * rows.len();
    let of_row = |y: usize| columns.clone().map(|x| f64::from(index(y * width + x))).sum::<f64>();
    let sums: Vec<f64> = rows.into_par_iter().map(of_row).collect();
    Some(sums.iter().sum::<f64>() / count as f64)
}

/// Rec. 601 luma.
fn luma(picture: &RgbImage) -> Plane {
    let values = picture.as_raw().par_chunks_exact(3).map(|pixel| {
        let [r, g, b] = [0, 1, 2].map(|i| f32::from(pixel[i]));
        0.299 * r + 0.587 * g + 0.114 * b
    });
    Plane { width: picture.width() as usize, values: values.collect() }
}

#[cfg(test)]
mod tests {
    use super::super::test_pictures::{changed, picture, plain};
    use super::*;

    #[test]
    fn the_value_is_that_of_windows_summed_up_one_by_one() {
        // By numpy in double precision, with a window of its own for each pixel.
        let found = ssim(&picture(plain), &picture(changed)).unwrap();
        assert!((found - 0.783_549_64).abs() < 1e-5, "{found}");
        let other_way_round = ssim(&picture(changed), &picture(plain)).unwrap();
        assert!((found - other_way_round).abs() < 1e-6);
    }

    #[test]
    fn the_same_is_one_and_what_has_no_window_has_no_value() {
        let same = ssim(&picture(plain), &picture(plain)).unwrap();
        assert!((same - 1.0).abs() < 1e-9, "{same}");
        assert_eq!(ssim(&RgbImage::new(10, 99), &RgbImage::new(10, 99)), None);
        assert_eq!(ssim(&RgbImage::new(20, 30), &RgbImage::new(30, 20)), None);
    }

    #[test]
    fn flat_pictures_compare_by_their_means_alone() {
        // Eq. 13 without variances: (2 x y + C1) / (x² + y² + C1).
        let [a, b] = [100, 150].map(|grey| RgbImage::from_pixel(20, 20, image::Rgb([grey; 3])));
        let c = (0.01f64 * 255.0).powi(2);
        let expected = (2.0 * 100.0 * 150.0 + c) / (100.0f64.powi(2) + 150.0f64.powi(2) + c);
        let found = ssim(&a, &b).unwrap();
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
}
