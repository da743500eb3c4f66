//! A picture of depths, as parallax.

/// Depths of a picture, row by row.
///
/// What matters of a depth is how far its pixel moves where the eye moves within its cell: by `focal
/// length in pixels × metres that the eye moves ÷ depth`. That is the *parallax* of a point, in pixels.
/// Along a plane it is linear in the picture's x and y, so that `(x, y, parallax)` is a space in which
/// planes are planes and every distance is in pixels, as it is seen from anywhere in the cell.
#[derive(Clone, Copy, Debug)]
pub struct Depths<'a> {
    /// Metres along the view; infinite where nothing is seen.
    pub metres: &'a [f32],
    /// Pixels of a row.
    pub width: usize,
    /// Pixels by which a point one metre away moves: focal length in pixels times the metres from the
    /// cell's middle to its farthest corner.
    pub pixel_metres: f32,
}

impl Depths<'_> {
    /// Rows.
    pub fn height(&self) -> usize {
        self.metres.len() / self.width.max(1)
    }

    /// Parallax of a pixel; none where nothing is seen, nor outside of the picture.
    pub fn parallax(&self, x: isize, y: isize) -> Option<f32> {
        let (x, y) = (usize::try_from(x).ok()?, usize::try_from(y).ok()?);
        if x >= self.width {
            return None;
        }
        let metres = *self.metres.get(y * self.width + x)?;
        (metres > 0.0 && metres.is_finite()).then(|| self.pixel_metres / metres)
    }

    /// Metres along the view of a parallax.
    pub fn metres_of(&self, parallax: f32) -> f32 {
        self.pixel_metres / parallax
    }
}
