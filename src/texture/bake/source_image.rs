//! The image of a triangle of the original, and how it goes on beyond its sides.

use glam::{DVec2, Vec4};

use super::source::SourceTriangle;
use crate::mesh::Wrap;
use crate::texture::block::{BlockTextures, Prepared};
use crate::texture::level::LevelImage;
use crate::texture::sampler::Sampler;

/// Continuation of an image beyond its sides.
#[derive(Clone, Copy)]
struct Wrapping {
    modes: [Wrap; 2],
    /// Size of the whole image, texels of the level.
    size: DVec2,
}

impl Wrapping {
    /// Along which axes the other side follows.
    fn repeats(&self) -> [bool; 2] {
        self.modes.map(|mode| mode == Wrap::Repeat)
    }

    /// The position in the image that shows the same.
    fn inside(&self, at: DVec2) -> DVec2 {
        let along = |axis: usize| {
            let (at, size) = (at[axis], self.size[axis]);
            match self.modes[axis] {
                Wrap::Repeat => at.rem_euclid(size),
                Wrap::Mirror => size - (at.rem_euclid(2.0 * size) - size).abs(),
                Wrap::Clamp => at,
            }
        };
        DVec2::new(along(0), along(1))
    }
}

/// The images of a triangle of the original at several resolutions.
pub(super) struct SourceImage<'a> {
    /// The coarsest first.
    levels: &'a [LevelImage],
    /// `None` where the triangle lies inside of the part of the image that there is.
    wrapping: Option<Wrapping>,
}

impl<'a> SourceImage<'a> {
    /// The coarsest level whose texels are at most so many source texels wide, or else the finest.
    pub fn level(&self, width: f64) -> Option<WrappedSampler<'a>> {
        let is_fine = |level: &&LevelImage| level.step <= width;
        let image = self.levels.iter().find(is_fine).or(self.levels.last())?;
        let wrapping =
            self.wrapping.map(|wrapping| Wrapping { size: wrapping.size / image.step, ..wrapping });
        Some(WrappedSampler { sampler: image.sampler(), step: image.step, wrapping })
    }
}

/// An image at one resolution, to be sampled anywhere.
pub(super) struct WrappedSampler<'a> {
    sampler: Sampler<'a>,
    /// Source texels per texel along each axis.
    pub step: f64,
    wrapping: Option<Wrapping>,
}

impl WrappedSampler<'_> {
    /// The colour at a position in texels by bilinear sampling, linear light, 0–1, and 1.
    #[inline]
    pub fn at(&self, at: DVec2) -> Vec4 {
        match &self.wrapping {
            None => self.sampler.at(at),
            Some(wrapping) => self.sampler.at_repeating(wrapping.inside(at), wrapping.repeats()),
        }
    }

    /// The mean of the square of two by two texels around a position, linear light, 0–1, and 1.
    #[inline]
    pub fn mean_at(&self, at: DVec2) -> Vec4 {
        if self.wrapping.is_none() {
            return self.sampler.mean_at(at);
        }
        let corners = [(-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5), (0.5, 0.5)];
        corners.into_iter().map(|(x, y)| self.at(at + DVec2::new(x, y))).sum::<Vec4>() * 0.25
    }
}

impl BlockTextures<'_> {
    /// The image of a triangle of the original; `None` where it has none.
    pub(super) fn image_of(&self, triangle: &SourceTriangle) -> Option<SourceImage<'_>> {
        match self.image_of_material(triangle.material)? {
            Prepared::Absent => None,
            Prepared::Atlas(atlas) => Some(SourceImage { levels: &atlas.pyramid, wrapping: None }),
            Prepared::Repeating(decoded) => {
                let modes = self.model.materials[triangle.material as usize].wrap;
                let size = [decoded.image.width, decoded.image.height].map(f64::from);
                let wrapping = Some(Wrapping { modes, size: DVec2::from(size) });
                Some(SourceImage { levels: decoded.pyramid(), wrapping })
            }
        }
    }

    /// The factor of a material's colours, linear light, 0–1, and 1.
    pub(super) fn factor_of(&self, material: u32) -> Vec4 {
        let material = self.model.materials.get(material as usize);
        let [r, g, b, _] = material.map_or([1.0; 4], |material| material.base_color);
        Vec4::new(r, g, b, 1.0).clamp(Vec4::ZERO, Vec4::ONE)
    }
}
