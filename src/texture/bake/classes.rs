//! Which materials may lose their seams, and which of them look alike.

use crate::mesh::{AlphaMode, Material};

/// Materials whose triangles may share a baked texture, by class: all of one class differ in
/// nothing but their images.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BakeClasses {
    /// By material: the first material of its class, or `None` where its texture stays as it is.
    first: Vec<Option<u32>>,
}

impl BakeClasses {
    /// The classes of those opaque `materials` for whose texture `is_cut_up` says yes. Cut-outs
    /// stay with their own texture, as a hole has no nearest point, and so do repeating ones.
    pub fn new(materials: &[Material], is_cut_up: impl Fn(u32) -> bool) -> Self {
        let alike = |a: &Material, b: &Material| {
            a.base_color == b.base_color && a.double_sided == b.double_sided
        };
        let mut first: Vec<Option<u32>> = Vec::with_capacity(materials.len());
        for (number, material) in materials.iter().enumerate() {
            let bakes = material.alpha == AlphaMode::Opaque && is_cut_up(number as u32);
            let same = (0..number).find(|&other| {
                first[other] == Some(other as u32) && alike(&materials[other], material)
            });
            first.push(bakes.then_some(same.unwrap_or(number) as u32));
        }
        Self { first }
    }

    /// The material that stands for the class of this one; `None` where it has none.
    pub fn of(&self, material: u32) -> Option<u32> {
        self.first.get(material as usize).copied().flatten()
    }

    /// True where no material may be baked.
    pub fn is_empty(&self) -> bool {
        self.first.iter().all(Option::is_none)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opaque_materials_of_one_colour_are_one_class() {
        let named = |name: &str| Material { texture: Some(0), ..Material::plain(name) };
        let red = Material { base_color: [1.0, 0.0, 0.0, 1.0], ..named("red") };
        let hole = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..named("hole") };
        let materials = [hole, named("a"), red, named("plain"), named("b")];
        let classes = BakeClasses::new(&materials, |material| material != 3);
        let of: Vec<_> = (0..6).map(|material| classes.of(material)).collect();
        assert_eq!(of, [None, Some(1), Some(2), None, Some(1), None]);
    }
}
