//! Which materials prisms may have.

use crate::texture::BakeClasses;

/// By material, whether prisms may have it. They have no texture coordinates. By default none may.
#[derive(Clone, Debug, Default)]
pub struct Extrudable {
    plain: Vec<bool>,
    baked: Vec<bool>,
}

impl Extrudable {
    /// Of so many materials, of which some have textures, and some of these may be baked anew.
    pub fn new(materials: usize, is_textured: impl Fn(u32) -> bool, classes: &BakeClasses) -> Self {
        let plain: Vec<bool> =
            (0..materials as u32).map(|material| !is_textured(material)).collect();
        let baked =
            (0..).zip(&plain).map(|(material, &plain)| plain || classes.of(material).is_some());
        Self { baked: baked.collect(), plain }
    }

    /// Those of a node whose texture is `baked` anew, or of one that keeps the source's.
    pub fn materials(&self, baked: bool) -> &[bool] {
        if baked { &self.baked } else { &self.plain }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{AlphaMode, Material};

    #[test]
    fn a_texture_that_is_not_baked_anew_may_not_be_lost() {
        let textured = || Material { texture: Some(0), ..Material::plain("wall") };
        let cut_out = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..textured() };
        let materials = [Material::plain("roof"), textured(), cut_out];
        let is_textured = |material| material > 0;
        let classes = BakeClasses::new(&materials, is_textured, |_| true);
        let extrudable = Extrudable::new(materials.len(), is_textured, &classes);
        assert_eq!(extrudable.materials(false), [true, false, false]);
        assert_eq!(extrudable.materials(true), [true, true, false]);
    }
}
