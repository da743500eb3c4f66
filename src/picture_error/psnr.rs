//! The peak signal-to-noise ratio.

use image::RgbImage;

/// The mean of the squared differences of all values of all pixels, 0 to 65,025; `None` where
/// sizes differ, and 0 without pixels.
pub fn mean_squared_error(a: &RgbImage, b: &RgbImage) -> Option<f64> {
    if a.dimensions() != b.dimensions() {
        return None;
    }
    let square = |(&a, &b): (&u8, &u8)| u64::from(a.abs_diff(b)).pow(2);
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(square).sum();
    Some(sum as f64 / a.as_raw().len().max(1) as f64)
}

/// The ratio in decibels for a mean squared error: `10 log10(255² / error)`, and so infinite where
/// there is none.
pub fn psnr(mean_squared_error: f64) -> f64 {
    10.0 * (255.0f64.powi(2) / mean_squared_error).log10()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_everywhere_has_the_ratio_of_tables() {
        let [a, b] = [10, 11].map(|grey| RgbImage::from_pixel(3, 2, image::Rgb([grey; 3])));
        assert_eq!(mean_squared_error(&a, &b), Some(1.0));
        assert!((psnr(1.0) - 48.1308).abs() < 1e-4);
        assert_eq!(psnr(255.0f64.powi(2)), 0.0);
        assert_eq!(mean_squared_error(&a, &a).map(psnr), Some(f64::INFINITY));
        assert_eq!(mean_squared_error(&a, &RgbImage::new(2, 3)), None);
    }
}
