//! How cells are made.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// By what the cull box of each cell is chosen: as the sum of the error of what is near, at the level that the
/// triangles are enough for, and of the weighted error of what is far is least (Aliaga and others, 1999,
/// section 3.3).
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Balance {
    /// Triangles of what is near in a view, at most.
    pub triangles: u64,
    /// What a pixel of error of what is far counts, over one of what is near.
    pub far_weight: f64,
}

impl Default for Balance {
    /// The weight is the paper's.
    fn default() -> Self {
        Self { triangles: 50_000, far_weight: 0.15 }
    }
}

/// How cells are made.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct CellOptions {
    /// Metres along the side of a cell.
    pub cell_m: f64,
    /// Metres from a cell to the sides of its cull box, where that is not balanced.
    pub cull_m: f64,
    /// By what it is chosen for each cell.
    pub balance: Option<Balance>,
    /// Pixels along the side of a picture of 90°.
    pub pixels: u32,
    /// Pixels by which what faces show may be off, as seen from anywhere in the cell.
    pub error_px: f64,
    /// JPEG quality of the pictures, 1–100.
    pub jpeg_quality: u8,
}

impl Default for CellOptions {
    fn default() -> Self {
        Self {
            cell_m: 4.0,
            cull_m: 120.0,
            balance: Some(Balance::default()),
            pixels: 512,
            error_px: 1.0,
            jpeg_quality: 80,
        }
    }
}

impl CellOptions {
    /// Refuses what is out of range, by the name of the option.
    pub fn check(&self) -> Result<()> {
        let refuse = |name: &str, range: &str, found: &dyn std::fmt::Display| {
            Err(Error::Usage(format!("{name}: expected {range}, found {found}")))
        };
        let is_length = |metres: f64| metres > 0.0 && metres.is_finite();
        if !is_length(self.cell_m) {
            return refuse("--cell", "metres, above 0", &self.cell_m);
        }
        if !is_length(self.cull_m) {
            return refuse("--cull", "metres, above 0", &self.cull_m);
        }
        if let Some(Balance { triangles: 0, .. }) = self.balance {
            return refuse("--triangles", "1 or more", &0);
        }
        if let Some(Balance { far_weight, .. }) = self.balance
            && !is_length(far_weight)
        {
            return refuse("--far-weight", "a number above 0", &far_weight);
        }
        if !(16..=8192).contains(&self.pixels) {
            return refuse("--pixels", "16 to 8192", &self.pixels);
        }
        if !is_length(self.error_px) {
            return refuse("--error", "pixels, above 0", &self.error_px);
        }
        match self.jpeg_quality {
            1..=100 => Ok(()),
            found => refuse("--jpeg-quality", "1 to 100", &found),
        }
    }

    /// Pixels from a picture's middle at which what is beside it as far as it is ahead is seen. Pictures of
    /// neighbouring directions overlap by a pixel and a half on each side, so that their surfaces, which
    /// reach from the middle of the first pixel to that of the last, meet.
    pub fn focal_px(&self) -> f64 {
        f64::from(self.pixels) / 2.0 - 1.5
    }

    /// The angle of view of a picture, degrees: a little more than 90.
    pub fn fov_deg(&self) -> f64 {
        2.0 * libm::atan2(f64::from(self.pixels) / 2.0, self.focal_px()).to_degrees()
    }

    /// Metres by which what faces show reaches into a cull box whose sides are so far from its cell: where it is cut, both sides overlap, since
    /// faces are off by a pixel. What is nearer is drawn before it there.
    pub fn overlap_m(&self, cull_m: f64) -> f64 {
        self.cell_m.min(cull_m / 4.0)
    }

    /// Metres from a cell's middle to its corners.
    pub fn reach_m(&self) -> f64 {
        self.cell_m * 3f64.sqrt() / 2.0
    }
}
