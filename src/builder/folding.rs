//! Untextured materials that differ in colour only become one material with vertex colours.
//!
//! A border between two colours is no reason to keep an edge from collapsing when seen from afar,
//! as a border between two textures is; and one material is one draw.

use crate::mesh::{AlphaMode, Material, Model, Part};

/// Which materials become which one.
#[derive(Clone, Debug, Default)]
pub struct Folding {
    /// New number by material; `None` if it is kept.
    into: Vec<Option<u32>>,
    /// Colours of the materials that are replaced.
    colors: Vec<[f32; 4]>,
}

impl Folding {
    /// Folds each class of untextured materials that look alike but for their colour, where several of
    /// it are used: their common material is appended to `materials`.
    pub fn new(materials: &mut Vec<Material>, is_used: &[bool]) -> Self {
        let foldable = |material: &Material| {
            material.texture.is_none() && !matches!(material.alpha, AlphaMode::Mask { .. })
        };
        let class = |material: &Material| {
            [material.alpha == AlphaMode::Blend, material.double_sided, material.is_unlit]
        };
        let count = materials.len();
        let colors = materials.iter().map(|material| material.base_color).collect();
        let mut into = vec![None; count];
        for sought in (0..8_u8).map(|bits| [4, 2, 1].map(|bit| bits & bit != 0)) {
            let in_class: Vec<usize> = (0..count)
                .filter(|&at| foldable(&materials[at]) && class(&materials[at]) == sought)
                .collect();
            let is_used = |at: &&usize| is_used.get(**at).copied().unwrap_or(false);
            if in_class.iter().filter(is_used).count() < 2 {
                continue;
            }
            let folded = materials.len() as u32;
            in_class.iter().for_each(|&at| into[at] = Some(folded));
            let [is_blended, double_sided, is_unlit] = sought;
            materials.push(Material {
                base_color: [1.0; 4],
                alpha: if is_blended { AlphaMode::Blend } else { AlphaMode::Opaque },
                double_sided,
                is_unlit,
                ..Material::plain(format!("untextured {folded}"))
            });
        }
        Self { into, colors }
    }

    /// Returns the replacement of a material; `None` if it is kept.
    pub fn of(&self, material: u32) -> Option<u32> {
        self.into.get(material as usize).copied().flatten()
    }

    /// Gives a part what its material becomes, and its colour to its vertices.
    pub fn apply(&self, part: &mut Part) {
        let Some(folded) = self.of(part.material) else { return };
        let base = self.colors[part.material as usize];
        if part.colors.is_empty() {
            part.colors = vec![[u16::MAX; 4]; part.positions.len()];
        }
        for color in &mut part.colors {
            for channel in 0..4 {
                let value = f32::from(color[channel]) * base[channel].clamp(0.0, 1.0);
                color[channel] = value.round() as u16;
            }
        }
        part.material = folded;
    }
}

/// Folds the untextured materials of a model.
pub fn merge_untextured(model: &mut Model) {
    let mut is_used = vec![false; model.materials.len()];
    for part in &model.parts {
        if let Some(is_used) = is_used.get_mut(part.material as usize) {
            *is_used = true;
        }
    }
    let folding = Folding::new(&mut model.materials, &is_used);
    model.parts.iter_mut().for_each(|part| folding.apply(part));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Group, Warnings};
    use crate::scaling::assert_scales;

    fn model(colors: &[[f32; 4]]) -> Model {
        let part = |material: u32| Part {
            material,
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            indices: vec![0, 1, 2],
            ..Default::default()
        };
        Model {
            source: "m.obj".into(),
            dependencies: Vec::new(),
            groups: vec![Group { name: "g".into() }],
            parts: (0..colors.len() as u32).map(part).collect(),
            materials: colors
                .iter()
                .map(|&base_color| Material { base_color, ..Material::plain("m") })
                .collect(),
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        }
    }

    #[test]
    fn colours_move_to_the_vertices() {
        let mut folded = model(&[[1.0, 0.0, 0.5, 1.0], [0.0, 1.0, 0.0, 1.0]]);
        merge_untextured(&mut folded);
        assert_eq!(folded.parts[0].material, folded.parts[1].material);
        assert_eq!(folded.materials[folded.parts[0].material as usize].base_color, [1.0; 4]);
        assert_eq!(folded.parts[0].colors[2], [65535, 0, 32768, 65535]);
        assert_eq!(folded.parts[1].colors[0], [0, 65535, 0, 65535]);
    }

    #[test]
    fn lit_and_unlit_materials_stay_apart() {
        let mut folded = model(&[[0.5; 4]; 4]);
        folded.materials[2].is_unlit = true;
        folded.materials[3].is_unlit = true;
        merge_untextured(&mut folded);
        let is_unlit =
            |part: usize| folded.materials[folded.parts[part].material as usize].is_unlit;
        assert_eq!([0, 1, 2, 3].map(is_unlit), [false, false, true, true]);
        assert_eq!(folded.parts[2].material, folded.parts[3].material);
    }

    #[test]
    fn a_single_untextured_material_stays() {
        let mut single = model(&[[0.2, 0.3, 0.4, 1.0]]);
        merge_untextured(&mut single);
        assert_eq!((single.parts[0].material, single.materials.len()), (0, 1));
        assert!(single.parts[0].colors.is_empty());
    }

    #[test]
    fn time_scales_with_the_number_of_materials() {
        let of_colors = |count: usize| model(&vec![[0.5, 0.5, 0.5, 1.0]; count]);
        assert_scales(1000, of_colors, |mut model| {
            merge_untextured(&mut model);
            assert_eq!(model.materials.len(), model.parts.len() + 1);
        });
    }
}
