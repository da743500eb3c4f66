//! Which materials may lose their seams, and which of them look alike.

use std::collections::BTreeMap;

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
        // Zeros of either sign are one colour.
        let look = |material: &Material| {
            (material.base_color.map(|part| (part + 0.0).to_bits()), material.double_sided)
        };
        let mut first_of_look = BTreeMap::new();
        let first = (0..)
            .zip(materials)
            .map(|(number, material)| {
                let bakes = material.alpha == AlphaMode::Opaque && is_cut_up(number);
                bakes.then(|| *first_of_look.entry(look(material)).or_insert(number))
            })
            .collect();
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
    use crate::scaling::assert_scales;

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

    #[test]
    fn time_scales_with_the_number_of_colours() {
        let material = |number: usize| Material {
            base_color: [0.0, 0.25, 0.5, (number % (1 << 20)) as f32 / (1 << 20) as f32],
            ..Material::plain(number.to_string())
        };
        let materials = |count: usize| (0..count).map(material).collect::<Vec<_>>();
        for bakes in [false, true] {
            assert_scales(1000, materials, |materials| BakeClasses::new(&materials, |_| bakes));
        }
    }
}
