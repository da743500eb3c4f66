//! Which materials may lose their seams, and which of them look alike.

use std::collections::BTreeMap;

use crate::mesh::{AlphaMode, Material};

/// Opaque materials that coarse nodes may mix, by class: those of one class are seen from the same sides. The
/// triangles that stand for textured and unlit ones get a texture of their own, those of lit ones a colour each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BakeClasses {
    /// By material: the first material of its class, or `None` where it stays as it is.
    first: Vec<Option<u32>>,
    /// By class, named by its first material: its first materials that are unlit and lit.
    by_light: BTreeMap<u32, [Option<u32>; 2]>,
    /// Tells by material whether it is shown with light.
    is_lit: Vec<bool>,
}

impl BakeClasses {
    /// The classes of the opaque ones among `materials` that are used; none if no image is used. Where an
    /// image is missing, `is_textured` says no. Cut-outs stay with their own texture, as a hole has no
    /// nearest point.
    pub fn new(
        materials: &[Material],
        is_textured: impl Fn(u32) -> bool,
        is_used: impl Fn(u32) -> bool,
    ) -> Self {
        let numbers = 0..materials.len() as u32;
        let is_opaque = |&number: &u32| {
            materials[number as usize].alpha == AlphaMode::Opaque && is_used(number)
        };
        if !numbers.clone().filter(is_opaque).any(&is_textured) {
            return Self::default();
        }
        let lit = |number: u32| !is_textured(number) && !materials[number as usize].is_unlit;
        let is_lit: Vec<bool> = numbers.clone().map(lit).collect();
        let mut first_of_sides = BTreeMap::new();
        let mut by_light: BTreeMap<u32, [Option<u32>; 2]> = BTreeMap::new();
        let mut first = vec![None; materials.len()];
        for number in numbers.filter(is_opaque) {
            let sides = materials[number as usize].double_sided;
            let class = *first_of_sides.entry(sides).or_insert(number);
            let light = usize::from(is_lit[number as usize]);
            by_light.entry(class).or_default()[light].get_or_insert(number);
            first[number as usize] = Some(class);
        }
        Self { first, by_light, is_lit }
    }

    /// Tells whether a material is shown with light.
    pub fn is_lit(&self, material: u32) -> bool {
        self.is_lit.get(material as usize).copied().unwrap_or(true)
    }

    /// An unlit and a lit material of a class, if it has one.
    pub fn by_light(&self, class: u32) -> [Option<u32>; 2] {
        self.by_light.get(&class).copied().unwrap_or_default()
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
    use crate::scaling::assert_scales;

    #[test]
    fn opaque_materials_that_are_used_are_one_class_for_each_kind_of_sides() {
        let textured = |name: &str| Material { texture: Some(0), ..Material::plain(name) };
        let hole = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..textured("hole") };
        let one_sided = Material { double_sided: false, ..textured("one-sided") };
        let unlit = Material { is_unlit: true, ..Material::plain("unlit") };
        let materials = [
            hole,
            Material::plain("unused"),
            Material::plain("plain"),
            textured("a"),
            one_sided,
            unlit,
        ];
        let is_textured = |number: u32| materials[number as usize].texture.is_some();
        let classes = BakeClasses::new(&materials, is_textured, |number| number != 1);
        let of: Vec<_> = (0..7).map(|material| classes.of(material)).collect();
        assert_eq!(of, [None, None, Some(2), Some(2), Some(4), Some(2), None]);
        assert_eq!(classes.by_light(2), [Some(3), Some(2)]);
        assert_eq!(classes.by_light(4), [Some(4), None]);
        assert_eq!([2, 3, 5].map(|material| classes.is_lit(material)), [true, false, false]);
        let plain = BakeClasses::new(&materials, |_| false, |_| true);
        assert!(plain.is_empty(), "nothing is baked where nothing is textured");
    }

    #[test]
    fn time_scales_with_the_number_of_colours() {
        let material = |number: usize| Material {
            base_color: [0.0, 0.25, 0.5, (number % (1 << 20)) as f32 / (1 << 20) as f32],
            ..Material::plain(number.to_string())
        };
        let materials = |count: usize| (0..count).map(material).collect::<Vec<_>>();
        for bakes in [false, true] {
            assert_scales(1000, materials, |materials| {
                BakeClasses::new(&materials, |_| bakes, |_| true)
            });
        }
    }
}
