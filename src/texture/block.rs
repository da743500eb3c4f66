//! The textures of one block: what its nodes copy their texels from.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use glam::Vec3;
use rayon::prelude::*;

use super::bake::prepared::PreparedBake;
use super::bits::BitGrid;
use super::cache::{Decoded, TextureCache};
use super::charts::{Charts, UvBox};
use super::level::{self, LevelImage};
use super::plan::{self, TextureUse};
use super::raster::{self, Rasterizer};
use super::region::Region;
use super::shared::SharedTextures;
use crate::decode::DecodedTexture;
use crate::mesh::{Material, Mesh, Model, Wrap};
use crate::stage_timer::StageTimer;

/// What of the texture work can be chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureOptions {
    /// JPEG quality of leaves, 1–100; coarse levels are a quarter as far from 100. From 90 on, colour is
    /// kept at full resolution. Default 85.
    pub jpeg_quality: u8,
    /// Longest side of an atlas, texels, 16–65535; default 4096. A leaf that needs more gets
    /// several pages, a coarser node a coarser atlas and a warning.
    pub max_atlas: u32,
    /// True if triangles without a texture have normals.
    pub normals: bool,
    /// Triangles of the block's root. Where it has few for each chart, coarse nodes are baked.
    pub root_triangles: usize,
}

impl Default for TextureOptions {
    fn default() -> Self {
        Self { jpeg_quality: 85, max_atlas: 4096, normals: true, root_triangles: 900 }
    }
}

/// Texture factors for levels with these simplification factors (the root's first, 1 last).
///
/// The thesis's `c_levelFactor` is the ratio of triangles *and of texels* between two successive
/// levels, and its recursion ends at the first factor below 1, so the level above the original
/// may have hardly fewer triangles than it. If its texels followed, all levels together would
/// have up to `1 + 4/3 / factor` = 2.3 times the source's. So the ratio is kept here too: the
/// texels of the level above the original are its own divided by the level factor, and so on up.
pub fn texture_factors(simplifications: &[f64], level_factor: f64) -> Vec<f64> {
    let reduced = simplifications.iter().copied().filter(|factor| *factor > 1.0);
    let least = reduced.fold(f64::INFINITY, f64::min);
    let ratio = (level_factor / least).max(1.0);
    simplifications.iter().map(|factor| if *factor > 1.0 { factor * ratio } else { 1.0 }).collect()
}

/// The textures of one block at all its levels.
#[derive(Debug)]
pub struct BlockTextures<'a> {
    pub(super) model: &'a Model,
    pub(super) shared: &'a SharedTextures,
    pub(super) options: TextureOptions,
    /// Source texels per texel along each axis, by level.
    pub(super) steps: Vec<f64>,
    /// By texture of the model.
    pub(super) textures: Vec<Prepared>,
    /// By material of the model.
    pub(super) material_textures: Vec<Option<u32>>,
    /// What coarse nodes may be baked from; `None` where none is.
    pub(super) bake_source: Option<PreparedBake>,
    /// By texture of the model: the mean colour of its image, linear light, once it was asked for.
    pub(super) means: Vec<OnceLock<Vec3>>,
    pub(super) used_texels: u64,
    /// Square metres of the block's triangles whose textures are cut up.
    area: f64,
}

/// One texture of a block.
#[derive(Debug)]
pub(super) enum Prepared {
    /// Not used by the block, or not to be had.
    Absent,
    Atlas(AtlasSource),
    Repeating(Arc<Decoded>),
}

/// A texture whose texels the nodes copy.
#[derive(Debug)]
pub(super) struct AtlasSource {
    /// Of the whole image.
    pub size: [f64; 2],
    /// First texel of the region.
    pub origin: [f64; 2],
    /// Along which axes charts cross the image's border.
    pub wraps: [bool; 2],
    pub channels: usize,
    /// The region and its halves, down to the resolution of the root; the coarsest first.
    pub pyramid: Vec<LevelImage>,
    /// By level, the region at its resolution if that is none of the pyramid's. It is made when a node asks for it.
    levels: Vec<OnceLock<LevelImage>>,
}

impl AtlasSource {
    /// Returns the region at the resolution of a level, whose texels are `step` source texels wide.
    pub fn level(&self, level: usize, step: f64) -> Option<&LevelImage> {
        // Steps are square roots, and equal to powers of two only up to rounding.
        let is_fine = |image: &&LevelImage| image.step <= step * (1.0 + 1e-9);
        let finer = self.pyramid.iter().find(is_fine).or(self.pyramid.last())?;
        if step <= finer.step * (1.0 + 1e-9) {
            return Some(finer);
        }
        Some(self.levels.get(level)?.get_or_init(|| finer.at_step(step)))
    }

    /// The whole tiles by which a chart is moved so that it lies in the region.
    pub fn tile(&self, chart: &UvBox, axis: usize) -> f64 {
        if self.wraps[axis] {
            (chart.min[axis] - self.origin[axis] / self.size[axis]).floor()
        } else {
            chart.tile(axis)
        }
    }
}

impl<'a> BlockTextures<'a> {
    /// Decodes (or finds decoded) what the block's mesh uses and scales it for every level.
    ///
    /// `mesh` is the whole block at full detail; `factors` says for each level how many source
    /// texels become one (see [`texture_factors`]), the root's first and 1 (the source) last.
    pub fn prepare(
        cache: &TextureCache<'a>,
        shared: &'a SharedTextures,
        mesh: &Mesh,
        factors: &[f64],
        options: TextureOptions,
    ) -> Self {
        let (model, plan) = (cache.model(), cache.plan());
        let steps: Vec<f64> = factors
            .iter()
            .map(|factor| if factor.is_finite() { factor.max(1.0).sqrt() } else { 1.0 })
            .collect();
        let material_textures: Vec<Option<u32>> =
            (0..model.materials.len() as u32).map(|material| plan.texture_of(material)).collect();
        let mut used: Vec<u32> = mesh.materials.clone();
        used.sort_unstable();
        used.dedup();
        let used = plan.textures_of(used);

        let usage = Usage::find(mesh, &material_textures, plan.texture_count());
        let prepare = |texture: u32| {
            let Some(decoded) = cache.take(texture) else {
                return (texture, Prepared::Absent, 0);
            };
            let whole = plan.texture_use(texture) == TextureUse::Repeating;
            let found = if whole { None } else { usage.region(texture, &decoded.image, mesh) };
            let Some(Found { region, wraps, used_texels }) = found else {
                return (texture, Prepared::Repeating(decoded), 0);
            };
            let image = Arc::clone(&decoded.image);
            let source = AtlasSource {
                size: [f64::from(image.width), f64::from(image.height)],
                origin: region.origin.map(|start| start as f64),
                wraps,
                channels: usize::from(image.channels),
                pyramid: level::pyramid(image, &region, steps.first().copied().unwrap_or(1.0)),
                levels: vec![OnceLock::new(); steps.len()],
            };
            (texture, Prepared::Atlas(source), used_texels)
        };
        let timer = StageTimer::current();
        let prepared: Vec<(u32, Prepared, u64)> =
            used.into_par_iter().map(|texture| timer.time(|| prepare(texture))).collect();

        let mut textures = Vec::new();
        textures.resize_with(plan.texture_count(), || Prepared::Absent);
        let mut used_texels = 0;
        for (texture, prepared, texels) in prepared {
            textures[texture as usize] = prepared;
            used_texels += texels;
        }
        let mut block = Self {
            model,
            shared,
            options,
            steps,
            textures,
            material_textures,
            bake_source: None,
            means: vec![OnceLock::new(); plan.texture_count()],
            used_texels,
            area: 0.0,
        };
        block.area = block.atlas_area(mesh);
        block.bake_source = block.prepare_bake(mesh, &usage.charts);
        block
    }

    /// The area of the triangles whose textures are cut up, square metres.
    fn atlas_area(&self, mesh: &Mesh) -> f64 {
        if self.used_texels == 0 {
            return 0.0;
        }
        let in_atlas = |triangle: &&[u32; 3]| {
            let material = mesh.triangle_material(**triangle) as usize;
            let texture = self.material_textures.get(material).copied().flatten();
            texture.is_some_and(|texture| {
                matches!(self.textures.get(texture as usize), Some(Prepared::Atlas(_)))
            })
        };
        mesh.triangles.iter().filter(in_atlas).map(|triangle| mesh.triangle_area(*triangle)).sum()
    }

    /// The texels that a node of this level should have: the block's at the level's resolution,
    /// by the node's part of the block's surface.
    pub(super) fn share_of(&self, mesh: &Mesh, level: usize) -> f64 {
        let texels = self.used_texels as f64 / (self.steps[level] * self.steps[level]);
        texels * (self.atlas_area(mesh) / self.area.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// The number of different source texels that the block's triangles use, of textures that are
    /// cut up.
    pub fn used_texels(&self) -> u64 {
        self.used_texels
    }

    /// Tells by material whether its image can be shown several times side by side: it repeats and is not cut up.
    pub fn repeats(&self) -> Vec<bool> {
        let repeats = |(number, material): (u32, &Material)| {
            let is_whole = matches!(self.image_of_material(number), Some(Prepared::Repeating(_)));
            is_whole && material.wrap == [Wrap::Repeat; 2]
        };
        (0..).zip(&self.model.materials).map(repeats).collect()
    }

    /// The textures that are kept whole: a hash of each image, and its texels.
    pub fn repeating(&self) -> BTreeMap<String, u64> {
        let repeating = |prepared: &Prepared| match prepared {
            Prepared::Repeating(decoded) => {
                Some((decoded.hash().to_hex().to_string(), decoded.image.texels()))
            }
            _ => None,
        };
        self.textures.iter().filter_map(repeating).collect()
    }
}

/// The triangles and charts of each texture of a block.
struct Usage {
    charts: Charts,
    /// By chart: the sum of its triangles' areas in texture space, in tiles.
    areas: Vec<f64>,
    /// By texture: its triangles.
    triangles: Vec<Vec<[u32; 3]>>,
}

/// The part of an image that a block uses.
struct Found {
    region: Region,
    wraps: [bool; 2],
    used_texels: u64,
}

/// Regions begin and end at multiples of this many texels, which are the blocks of a JPEG: those of a leaf
/// that are the source's own compress better. Two scans have 0.5 and 0.6 % fewer bytes.
const REGION_MULTIPLE: i64 = 8;

/// A region of which this part is used is taken to be used wholly.
const NEARLY_ALL: f64 = 0.995;

impl Usage {
    fn find(mesh: &Mesh, material_textures: &[Option<u32>], textures: usize) -> Self {
        let mut triangles: Vec<Vec<[u32; 3]>> = vec![Vec::new(); textures];
        if mesh.texcoords.len() != mesh.positions.len() {
            return Self { charts: Charts::default(), areas: Vec::new(), triangles };
        }
        for triangle in &mesh.triangles {
            let material = mesh.triangle_material(*triangle) as usize;
            if let Some(texture) = material_textures.get(material).copied().flatten() {
                triangles[texture as usize].push(*triangle);
            }
        }
        let charts = Charts::find(&mesh.texcoords, triangles.iter().flatten().copied());
        let mut areas = vec![0.0; charts.boxes.len()];
        for triangle in triangles.iter().flatten() {
            let chart = charts.of_vertex[triangle[0] as usize] as usize;
            areas[chart] += plan::uv_area(&mesh.texcoords, *triangle);
        }
        Self { charts, areas, triangles }
    }

    /// The region of a texture, or `None` where charts are too long to be cut out of one image.
    fn region(&self, texture: u32, image: &DecodedTexture, mesh: &Mesh) -> Option<Found> {
        let triangles = &self.triangles[texture as usize];
        let size = [image.width as usize, image.height as usize];
        let mut charts: Vec<u32> =
            triangles.iter().map(|t| self.charts.of_vertex[t[0] as usize]).collect();
        charts.sort_unstable();
        charts.dedup();
        let boxes = || charts.iter().map(|chart| &self.charts.boxes[*chart as usize]);
        if boxes().any(|chart| (0..2).any(|axis| chart.exceeds_tile(axis))) {
            return None;
        }
        let wraps = [0, 1].map(|axis| boxes().any(|chart| chart.crosses_border(axis)));
        let mut origin = [0i64; 2];
        let mut region_size = [1usize; 2];
        for axis in 0..2 {
            let shifted = |chart: &UvBox| {
                let tile = if wraps[axis] { chart.min[axis].floor() } else { chart.tile(axis) };
                [chart.min[axis] - tile, chart.max[axis] - tile]
            };
            let low = boxes().map(|chart| shifted(chart)[0]).fold(f64::INFINITY, f64::min);
            let high = boxes().map(|chart| shifted(chart)[1]).fold(f64::NEG_INFINITY, f64::max);
            if low > high {
                return Some(Found {
                    region: Region { origin: [0; 2], size: [1; 2], covered: None },
                    wraps,
                    used_texels: 0,
                });
            }
            let side = size[axis] as f64;
            let (mut start, mut end) =
                ((low * side - 1.5).floor() as i64 + 1, (high * side + 0.5).ceil() as i64);
            if !wraps[axis] {
                start = start.div_euclid(REGION_MULTIPLE) * REGION_MULTIPLE;
                end = (end + REGION_MULTIPLE - 1).div_euclid(REGION_MULTIPLE) * REGION_MULTIPLE;
                start = start.clamp(0, size[axis] as i64 - 1);
                end = end.clamp(start + 1, size[axis] as i64);
            }
            origin[axis] = start;
            region_size[axis] = (end - start).max(1) as usize;
        }
        let texels = (region_size[0] * region_size[1]) as u64;
        let area = charts.iter().map(|chart| self.areas[*chart as usize]).sum::<f64>()
            * (size[0] * size[1]) as f64;
        let inner = region_size.map(|side| side.saturating_sub(2).max(1) as f64);
        let mut region = Region { origin, size: region_size, covered: None };
        let mut used_texels = texels;
        if area < NEARLY_ALL * inner[0] * inner[1] {
            let covered = self.coverage(texture, &charts, mesh, &region, size, wraps);
            used_texels = covered.count();
            if used_texels < texels {
                region.covered = Some(covered);
            }
        }
        Some(Found { region, wraps, used_texels })
    }

    /// The texels of the region that bilinear sampling of some triangle reads.
    fn coverage(
        &self,
        texture: u32,
        charts: &[u32],
        mesh: &Mesh,
        region: &Region,
        size: [usize; 2],
        wraps: [bool; 2],
    ) -> BitGrid {
        let mut covered = BitGrid::new(region.size[0], region.size[1]);
        let size = size.map(|side| side as f64);
        let origin = region.origin.map(|start| start as f64);
        // A chart that fills its box needs no look at its triangles.
        let filled = |chart: u32| {
            let (bounds, area) = (&self.charts.boxes[chart as usize], self.areas[chart as usize]);
            let sides = [0, 1].map(|axis| (bounds.max[axis] - bounds.min[axis]) * size[axis]);
            wraps == [false; 2] && raster::fills(sides, area * size[0] * size[1])
        };
        for chart in charts.iter().filter(|chart| filled(**chart)) {
            let bounds = &self.charts.boxes[*chart as usize];
            let corner = |uv: [f64; 2]| {
                [0, 1].map(|axis| (uv[axis] - bounds.tile(axis)) * size[axis] - origin[axis])
            };
            raster::mark_box(corner(bounds.min), corner(bounds.max), &mut covered);
        }
        // Where charts cross the border, a piece of one may be asked for a tile further on.
        let tiles = wraps.map(|wraps| if wraps { -2..3 } else { 0..1 });
        for (v, u) in tiles[1].clone().flat_map(|v| tiles[0].clone().map(move |u| (v, u))) {
            let moved = [f64::from(u) * size[0], f64::from(v) * size[1]];
            let triangles = self.triangles[texture as usize].iter().filter_map(|triangle| {
                let chart = self.charts.of_vertex[triangle[0] as usize];
                if filled(chart) {
                    return None;
                }
                let bounds = &self.charts.boxes[chart as usize];
                let tile = [0, 1].map(|axis| {
                    if wraps[axis] { bounds.min[axis].floor() } else { bounds.tile(axis) }
                });
                Some(triangle.map(|vertex| {
                    let uv = super::charts::sane(mesh.texcoords[vertex as usize]);
                    [0, 1].map(|axis| {
                        (uv[axis] - tile[axis]) * size[axis] - origin[axis] + moved[axis]
                    })
                }))
            });
            Rasterizer::default().mark_all(triangles, &mut covered);
        }
        covered
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_factors_bound_the_sum_of_all_texels() {
        assert_eq!(texture_factors(&[64.0, 16.0, 4.0, 1.0], 4.0), [64.0, 16.0, 4.0, 1.0]);
        assert_eq!(texture_factors(&[1.0], 4.0), [1.0]);
        for least in [1.0001, 1.39, 2.0, 3.9, 4.0] {
            let factors: Vec<f64> =
                (0..6).rev().map(|level| least * 4f64.powi(level)).chain([1.0]).collect();
            let sum: f64 = texture_factors(&factors, 4.0).iter().map(|factor| 1.0 / factor).sum();
            assert!(sum < 4.0 / 3.0, "{least}: {sum}");
        }
    }
}
