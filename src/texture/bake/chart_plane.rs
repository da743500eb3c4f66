//! Between points and samples of a flat chart.

use glam::{DVec2, DVec3};

/// A chart's plane: points are seen along its normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChartPlane {
    /// Unit length and at right angles: along columns, along rows, towards who looks at it.
    pub right: DVec3,
    pub up: DVec3,
    pub normal: DVec3,
    /// Of the point of sample (0, 0), metres along `right` and `up`.
    pub origin: DVec2,
    /// Samples a metre.
    pub scale: f64,
}

impl ChartPlane {
    /// The same with `scale` texels a metre, the first of which lies `margin` texels before the
    /// origin.
    pub fn of_texels(&self, scale: f64, margin: f64) -> Self {
        Self { origin: self.origin - margin / scale, scale, ..*self }
    }

    /// The same with so many samples along each side of a texel.
    pub fn of_samples(&self, samples: usize) -> Self {
        Self { scale: self.scale * samples as f64, ..*self }
    }

    /// The sample that a point lies over, from (0, 0), and its height, metres.
    #[inline]
    pub fn project(&self, point: DVec3) -> DVec3 {
        DVec3::new(
            (point.dot(self.right) - self.origin.x) * self.scale,
            (point.dot(self.up) - self.origin.y) * self.scale,
            point.dot(self.normal),
        )
    }

    /// The point at a height over a sample.
    pub fn at(&self, sample: DVec2, height: f64) -> DVec3 {
        let flat = sample / self.scale + self.origin;
        self.right * flat.x + self.up * flat.y + self.normal * height
    }

    /// The box in space of a box in samples and metres of height.
    pub fn box_around(&self, low: DVec3, high: DVec3) -> [DVec3; 2] {
        let (middle, half) = ((low + high) * 0.5, (high - low) * 0.5);
        let middle = self.at(middle.truncate(), middle.z);
        let half = self.right.abs() * (half.x / self.scale)
            + self.up.abs() * (half.y / self.scale)
            + self.normal.abs() * half.z;
        [middle - half, middle + half]
    }
}
