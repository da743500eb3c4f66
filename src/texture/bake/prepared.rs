//! Decides whether coarse nodes of a block may be baked, and keeps what they are baked from.

use super::classes::BakeClasses;
use super::plan::{BakePlan, BakeReason, bake_decision};
use super::source::{BakeSource, ImageKind, TriangleTexels};
use crate::mesh::{Mesh, Wrap};
use crate::texture::block::{BlockTextures, Prepared};
use crate::texture::charts::{self, Charts};

/// The block at full detail, as coarse nodes are baked from it.
#[derive(Debug)]
pub(in crate::texture) struct PreparedBake {
    /// The materials that may be baked.
    pub classes: BakeClasses,
    /// The surfaces that baked textures show.
    pub source: BakeSource,
    /// See [`BakePlan::always`].
    always: Option<BakeReason>,
    /// See [`BakePlan::where_over_budget`].
    where_over_budget: bool,
}

impl BlockTextures<'_> {
    /// Prepares baking of coarse nodes of a block, whose mesh at full detail has these charts; `None` where
    /// it would not be worth it.
    pub(in crate::texture) fn prepare_bake(
        &self,
        mesh: &Mesh,
        charts: &Charts,
    ) -> Option<PreparedBake> {
        if self.steps.len() < 2 || mesh.texcoords.len() != mesh.positions.len() {
            return None;
        }
        let mut is_used = vec![false; self.model.materials.len()];
        for &material in &mesh.materials {
            if let Some(used) = is_used.get_mut(material as usize) {
                *used = true;
            }
        }
        let classes = BakeClasses::new(
            &self.model.materials,
            |material| self.image_of_material(material).is_some(),
            |material| is_used[material as usize],
        );
        if classes.is_empty() {
            return None;
        }
        let is_cut_up = |triangle: &&[u32; 3]| {
            let material = mesh.triangle_material(**triangle);
            classes.of(material).is_some()
                && matches!(self.image_of_material(material), Some(Prepared::Atlas(_)))
        };
        let cut_up = mesh.triangles.iter().filter(is_cut_up);
        let mut cut_up: Vec<u32> =
            cut_up.map(|triangle| charts.of_vertex[triangle[0] as usize]).collect();
        cut_up.sort_unstable();
        cut_up.dedup();
        let repeats = self.textures.iter().any(|image| matches!(image, Prepared::Repeating(_)));
        let (always, where_over_budget) = bake_decision(cut_up.len(), self.options.root_triangles);
        if always.is_none() && !where_over_budget && !repeats {
            return None;
        }
        let texels = |triangle| self.triangle_texels(mesh, charts, triangle);
        let source = BakeSource::new(mesh, &classes, texels);
        Some(PreparedBake { classes, source, always, where_over_budget })
    }

    /// Returns where the texels of a triangle lie; `None` where it has no image.
    fn triangle_texels(
        &self,
        mesh: &Mesh,
        charts: &Charts,
        triangle: [u32; 3],
    ) -> Option<TriangleTexels> {
        let material = mesh.triangle_material(triangle);
        let chart = charts.of_vertex[triangle[0] as usize];
        let corners = triangle.map(|vertex| charts::sane(mesh.texcoords[vertex as usize]));
        match self.image_of_material(material)? {
            Prepared::Absent => None,
            Prepared::Atlas(source) => {
                let bounds = &charts.boxes[chart as usize];
                let tile = [0, 1].map(|axis| source.tile(bounds, axis));
                let texels = corners.map(|uv| {
                    [0, 1].map(|i| (uv[i] - tile[i]) * source.size[i] - source.origin[i])
                });
                Some(TriangleTexels { chart, texels, image: ImageKind::CutUp })
            }
            Prepared::Repeating(decoded) => {
                let size = [decoded.image.width, decoded.image.height].map(f64::from);
                let wrap = self.model.materials[material as usize].wrap;
                // After two periods mirrored images repeat, too.
                let low = [0, 1].map(|axis| {
                    let least = corners.iter().map(|uv| uv[axis]).fold(f64::INFINITY, f64::min);
                    if wrap[axis] == Wrap::Clamp { 0.0 } else { 2.0 * (least / 2.0).floor() }
                });
                let texels = corners.map(|uv| [0, 1].map(|i| (uv[i] - low[i]) * size[i]));
                Some(TriangleTexels { chart, texels, image: ImageKind::Repeating })
            }
        }
    }

    /// Returns the image of a material; `None` where it has none.
    pub(in crate::texture) fn image_of_material(&self, material: u32) -> Option<&Prepared> {
        let texture = self.material_textures.get(material as usize).copied().flatten()?;
        self.textures.get(texture as usize).filter(|image| !matches!(image, Prepared::Absent))
    }

    /// Returns the texels that charts of this area, square metres, should have in a node of this level.
    pub(super) fn bake_share(&self, area: f64, level: usize) -> f64 {
        let Some(PreparedBake { source, .. }) = &self.bake_source else { return 0.0 };
        let texels =
            (self.used_texels as f64 + source.repeating_texels()) / self.steps[level].powi(2);
        texels * (area / source.unlit_area().max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Returns what coarse nodes may bake; `None` where it would not be worth it.
    pub fn bake_plan(&self) -> Option<BakePlan<'_>> {
        let PreparedBake { classes, always, where_over_budget, .. } = self.bake_source.as_ref()?;
        Some(BakePlan {
            classes,
            always: *always,
            where_over_budget: *where_over_budget,
            textures: Some(self),
        })
    }
}
