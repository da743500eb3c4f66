//! What a surface looks like at a point: a factor and a position in an image, compared in sRGB.

use crate::color::{byte_to_linear, linear_to_srgb};
use crate::decode::DecodedTexture;
use crate::mesh::{AlphaMode, Wrap};

/// Opacity below which a blended texel shows more of what is behind it than of itself.
const SHOWS: f64 = 0.5;

/// How a point of a surface looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfaceAppearance {
    /// Number of an image; `None` where untextured.
    pub image: Option<u32>,
    /// Position in the image.
    pub texcoord: [f64; 2],
    /// Wrapping of the image.
    pub wrap: [Wrap; 2],
    /// What alpha does.
    pub alpha: AlphaMode,
    /// Base colour times vertex colour, linear light.
    pub factor: [f64; 3],
}

/// An sRGB colour, each channel 0–255, not rounded.
pub(super) type Color = [f32; 3];

impl SurfaceAppearance {
    /// Its colour; `image` is the image that it names. `None` where it is see-through.
    pub fn color(&self, image: Option<&DecodedTexture>) -> Option<Color> {
        let mut linear = self.factor;
        if let Some(image) = image {
            let (texel, opacity) = filtered(image, self.texcoord, self.wrap);
            let least = match self.alpha {
                AlphaMode::Opaque => 0.0,
                AlphaMode::Mask { cutoff } => f64::from(cutoff),
                AlphaMode::Blend => SHOWS,
            };
            if opacity < least {
                return None;
            }
            linear = std::array::from_fn(|channel| linear[channel] * texel[channel]);
        }
        Some(linear.map(|channel| (linear_to_srgb(channel) * 255.0) as f32))
    }
}

/// The square of a difference of colours, the mean of the channels.
pub(super) fn squared_difference(a: Color, b: Color) -> f64 {
    (0..3).map(|channel| f64::from(a[channel] - b[channel]).powi(2)).sum::<f64>() / 3.0
}

/// Bilinear filtering in linear light, and the opacity there.
fn filtered(image: &DecodedTexture, texcoord: [f64; 2], wrap: [Wrap; 2]) -> ([f64; 3], f64) {
    let size = [i64::from(image.width), i64::from(image.height)];
    let at: [f64; 2] = std::array::from_fn(|axis| texcoord[axis] * size[axis] as f64 - 0.5);
    let first = at.map(f64::floor);
    let part = [at[0] - first[0], at[1] - first[1]];
    let channels = usize::from(image.channels);
    let (mut color, mut opacity) = ([0.0; 3], 0.0);
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let weight = |axis: usize, step: i64| if step == 1 { part[axis] } else { 1.0 - part[axis] };
        let share = weight(0, dx) * weight(1, dy);
        if share == 0.0 {
            continue;
        }
        let x = wrapped(first[0] as i64 + dx, size[0], wrap[0]);
        let y = wrapped(first[1] as i64 + dy, size[1], wrap[1]);
        let texel = &image.pixels[(y * size[0] + x) as usize * channels..][..channels];
        for channel in 0..3 {
            let linear = f64::from(byte_to_linear()[usize::from(texel[channel])]) / 65535.0;
            color[channel] += share * linear;
        }
        opacity += share * texel.get(3).map_or(1.0, |&alpha| f64::from(alpha) / 255.0);
    }
    (color, opacity)
}

/// The texel that stands for one outside of the image.
fn wrapped(texel: i64, size: i64, wrap: Wrap) -> i64 {
    match wrap {
        Wrap::Repeat => texel.rem_euclid(size),
        Wrap::Mirror => {
            let texel = texel.rem_euclid(2 * size);
            texel.min(2 * size - 1 - texel)
        }
        Wrap::Clamp => texel.clamp(0, size - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> DecodedTexture {
        DecodedTexture {
            width: 2,
            height: 1,
            channels: 4,
            pixels: vec![255, 0, 0, 255, 0, 0, 255, 0],
        }
    }

    fn appearance(u: f64, wrap: Wrap) -> SurfaceAppearance {
        SurfaceAppearance {
            image: Some(0),
            texcoord: [u, 0.5],
            wrap: [wrap; 2],
            alpha: AlphaMode::Mask { cutoff: 0.25 },
            factor: [1.0; 3],
        }
    }

    #[test]
    fn texels_are_filtered_wrapped_and_cut_out() {
        let image = image();
        let color = |u, wrap| appearance(u, wrap).color(Some(&image));
        assert_eq!(color(0.25, Wrap::Clamp), Some([255.0, 0.0, 0.0]));
        assert_eq!(color(-0.75, Wrap::Repeat), Some([255.0, 0.0, 0.0]));
        assert_eq!(color(1.75, Wrap::Mirror), Some([255.0, 0.0, 0.0]));
        assert_eq!(color(0.75, Wrap::Clamp), None, "a hole");
        let half = color(0.5, Wrap::Clamp).unwrap();
        assert!((half[0] - 187.5).abs() < 0.5 && half[0] == half[2], "{half:?}");
    }

    #[test]
    fn factors_multiply_in_linear_light() {
        let plain = SurfaceAppearance {
            image: None,
            factor: [0.5, 0.25, 2.0],
            ..appearance(0.0, Wrap::Clamp)
        };
        let [red, green, blue] = plain.color(None).unwrap();
        assert!((red - 187.5).abs() < 0.1 && (green - 136.9).abs() < 0.5, "{red} {green}");
        assert_eq!(blue, 255.0);
        assert_eq!(squared_difference([0.0; 3], [3.0, 0.0, 0.0]), 3.0);
    }
}
