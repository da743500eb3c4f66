//! How far one picture is from another of the same view, as people see it.
//!
//! [`flip`] is what a person would notice who flips between the two (Andersson et al. 2020);
//! [`ssim`] (Wang et al. 2004) and [`psnr`] are what older publications report. All are by hand:
//! what there is for FLIP binds a C++ library that takes one core half a second for 1280 × 720
//! pixels, and the crates for SSIM compute other windows than the paper's. What the tests expect
//! of FLIP are the values of that library.
//!
//! [`Gaps`] counts background where there should be surface, which none of these weighs as it
//! should.

mod color;
mod filter;
mod flip;
mod gaps;
mod magma;
mod psnr;
mod ssim;
#[cfg(test)]
mod test_pictures;

pub use flip::{FlipMap, PIXELS_PER_DEGREE, flip};
pub use gaps::Gaps;
pub use psnr::{mean_squared_error, psnr};
pub use ssim::ssim;
