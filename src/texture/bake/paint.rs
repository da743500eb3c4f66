//! The image of a flat chart: how many texels it gets, and what each of them shows.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::facet::Facet;
use super::flat::{FlatChart, for_centres};
use super::nearby::Nearby;
use super::project::Projection;
use super::shading::{Samples, tint};
use super::source::{BakeSource, SurfacePoint};
use super::tile::Tile;
use crate::color;
use crate::mesh::Mesh;
use crate::texture::bits::BitGrid;
use crate::texture::block::BlockTextures;
use crate::texture::fill;
use crate::texture::level::LevelImage;
use crate::texture::raster::Rasterizer;

/// What painting needs of a node, and memory that its charts use one after another.
pub(super) struct Brushes {
    nearby: Nearby,
    tile: Tile,
    projection: Projection,
}

impl Brushes {
    /// To paint charts of a mesh.
    pub fn new(nearby: Nearby) -> Self {
        Self { nearby, tile: Tile::default(), projection: Projection::default() }
    }
}

/// A chart's image.
pub(super) struct Painted {
    pub image: LevelImage,
    /// The corners of the chart's triangles in it.
    pub corners: Vec<[DVec2; 3]>,
}

/// The cells of a node's charts are fitted to this part of the texels that are its share: atlases
/// are about a fifth larger than their cells, and so are those of the leaves, which nothing makes
/// smaller. Roots, which are few and seen longest, get all of it.
const CELLS: f64 = 0.72;

/// However much gutters take, there are so many texels for one of the level's along each axis.
const LEAST_SCALE: f64 = 0.5;

/// A triangle of the original that was nearest to the texel before is taken again where the texel
/// lies over it, farther away by no more than so many texels.
const SLACK: f64 = 0.5;

/// The original is looked for so many texels farther from a triangle than twice what it is from
/// the triangle's corners.
const REACH_TEXELS: f64 = 2.0;

/// Texels beside a triangle that take their colour from its plane, and rounding.
const BESIDE: f64 = 1.5;

/// Samples along each side of a texel at most: of roots, which are few and seen longest, and of all
/// others.
const SAMPLES: [usize; 2] = [4, 2];

/// Where triangles of the original have at least so many samples, fewer samples of a texel that are
/// means of two by two texels each are as good.
const SAMPLES_PER_TRIANGLE: f64 = 16.0;

/// How a texel is sampled.
struct Sampling {
    /// Samples along each side.
    side: usize,
    /// Each is the mean of two by two texels of the level that it is taken from.
    wide: bool,
}

/// So many samples along each side are drawn at once: what is written takes 200 KB.
const TILE: usize = 128;

/// Times that the scale is fitted to the texels that a node may have.
const FITS: usize = 4;

/// Texels from an outermost triangle to its image's side.
fn margin(cell: usize) -> f64 {
    // Cells are marked half a cell beyond the triangles: a whole number of cells then begins there.
    (cell as f64 * 0.5).max(1.0)
}

/// No triangle has the texel.
const FREE: u32 = u32::MAX;

impl BlockTextures<'_> {
    /// Texels a metre that triangles of a node should have: as many as the original has there, at
    /// the level's resolution.
    pub(super) fn scale_of(
        &self,
        nearby: &Nearby,
        mesh: &Mesh,
        triangles: &[u32],
        level: usize,
    ) -> f64 {
        nearby.density(mesh, triangles).sqrt() / self.steps[level]
    }

    /// Returns the factor of the charts' scales with which they and their gutters take no more than the node's
    /// share of texels. The charts have `area` square metres on the node.
    pub(super) fn fitted(&self, area: f64, charts: &[FlatChart], level: usize) -> f64 {
        let cell = self.baked_cell(level);
        let part = if level == 0 { 1.0 } else { CELLS };
        let share = (self.bake_share(area, level) * part).max((cell * cell) as f64 * 4.0);
        let longest = charts.iter().map(|chart| chart.size.max_element() * chart.scale);
        let most = (self.options.max_atlas as f64 * 0.5).max(1.0);
        let mut factor = (most / longest.fold(most, f64::max)).min(1.0);
        let inside: f64 = charts.iter().map(|chart| chart.area() * chart.scale.powi(2)).sum();
        for _ in 0..FITS {
            let taken: f64 =
                charts.iter().map(|chart| chart.texels(chart.scale * factor, cell)).sum();
            if taken <= share {
                break;
            }
            // What is around the triangles grows with their sides, not with their areas.
            let around = (taken / factor - inside * factor).max(0.0);
            let root = (around * around + 4.0 * inside * share).sqrt();
            // Whatever is no number here leaves it between these two.
            factor = (2.0 * share / (around + root)).max(factor * 0.5).min(factor);
            if factor < LEAST_SCALE {
                factor = LEAST_SCALE;
                break;
            }
        }
        factor
    }

    /// Draws a chart with `scale` texels a metre.
    pub(super) fn paint(
        &self,
        source: &BakeSource,
        mesh: &Mesh,
        chart: &FlatChart,
        scale: f64,
        level: usize,
        Brushes { nearby, tile, projection }: &mut Brushes,
    ) -> Painted {
        let cell = self.baked_cell(level);
        let (corners, size) = chart.on_texels(scale, cell);
        let [width, height] = size;
        let owners = owners(&corners, size);
        let mut pixels = vec![0u8; width * height * 3];
        let mut known = BitGrid::new(width, height);
        let triangles = nearby.triangles(mesh, &chart.triangles);
        let Sampling { side: samples, wide } = self.sampling(scale / chart.scale, level, triangles);
        let plane = chart.plane.of_texels(scale, margin(cell)).of_samples(samples);
        let facets: Vec<Option<Facet>> = chart
            .triangles
            .iter()
            .map(|&triangle| {
                let triangle = mesh.triangles[triangle as usize];
                let reach = 2.0 * nearby.farthest(triangle) + REACH_TEXELS / scale;
                Facet::new(&plane, mesh, triangle, reach, BESIDE * samples as f64)
            })
            .collect();
        let byte = color::linear_to_byte();
        let mut near = None;
        let mut sums: Vec<Vec4> = Vec::new();
        let owned = |y: usize| &owners[y * width..][..width];
        for [columns, rows] in tiles(size, (TILE / samples).max(1)) {
            tile.fill([columns.clone(), rows.clone()], samples, owned, &facets);
            projection.draw(source, &plane, tile, &facets);
            let shown = Samples::new(self, source, tile, projection, wide);
            for y in rows {
                sums.clear();
                sums.resize(columns.len(), Vec4::ZERO);
                shown.add(y * samples, samples, &mut sums);
                for (x, sum) in columns.clone().zip(&sums) {
                    let owner = owners[y * width + x];
                    if owner == FREE {
                        continue;
                    }
                    let mut searched = || {
                        let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * samples as f64;
                        let corners =
                            mesh.corners(mesh.triangles[chart.triangles[owner as usize] as usize]);
                        // What has no area in texels, as where the source has none, shows its middle.
                        let point = match &facets[owner as usize] {
                            Some(facet) => plane.at(centre, facet.height(centre)),
                            None => corners.into_iter().sum::<DVec3>() / 3.0,
                        };
                        let [a, b, c] = corners;
                        let normal = (b - a).cross(c - a).normalize_or_zero();
                        near = source.nearest(point, normal, near, SLACK / scale).or(near);
                        Some(self.color_at(source, near?, scale))
                    };
                    let drawn = (sum.w > 0.0).then(|| sum.truncate() / sum.w);
                    let Some(color) = drawn.or_else(&mut searched) else { continue };
                    let bytes = color.to_array().map(|light| byte.of((light * 65535.0) as u16));
                    pixels[(y * width + x) * 3..][..3].copy_from_slice(&bytes);
                    known.set(x, y);
                }
            }
        }
        fill::fill_all(&mut pixels, 3, &known);
        Painted { image: LevelImage::own(size, 3, self.steps[level], pixels), corners }
    }

    /// How texels are sampled of a chart which has so many texels for one of its level, and for whose
    /// source texels there are so many triangles of the original.
    fn sampling(&self, factor: f64, level: usize, triangles: f64) -> Sampling {
        let source_texels = self.steps[level] / factor.max(f64::MIN_POSITIVE);
        let most = (source_texels.round() as usize).clamp(1, SAMPLES[usize::from(level > 0)]);
        let wanted = source_texels * (SAMPLES_PER_TRIANGLE * triangles).sqrt();
        let side = (wanted.ceil() as usize).clamp(1, most);
        Sampling { side, wide: side < most }
    }

    /// Returns the colour of the original at a point, with `scale` texels a metre, linear light, 0–1.
    fn color_at(&self, source: &BakeSource, point: SurfacePoint, scale: f64) -> Vec3 {
        let triangle = source.triangle(point.triangle);
        let sampler = self.image_of(triangle).and_then(|image| {
            let area = triangle.area.max(f64::MIN_POSITIVE);
            let width = (triangle.texel_area() / area).sqrt() / scale;
            // Bilinear sampling averages about two texels along each axis.
            image.level(width * 0.5)
        });
        let light = sampler.map_or(Vec4::ONE, |sampler| {
            let along = |axis: usize| {
                (0..3).map(|i| point.weights[i] * f64::from(triangle.texels[i][axis])).sum::<f64>()
            };
            sampler.at(DVec2::new(along(0), along(1)) / sampler.step)
        });
        (light * self.factor_of(triangle.material) * tint(triangle.colors, || point.weights))
            .truncate()
    }
}

/// Columns and rows of an image, in squares with so many texels a side.
fn tiles([width, height]: [usize; 2], side: usize) -> impl Iterator<Item = [Range<usize>; 2]> {
    let along = move |end: usize| (0..end).step_by(side).map(move |at| at..(at + side).min(end));
    along(height).flat_map(move |rows| along(width).map(move |columns| [columns, rows.clone()]))
}

impl FlatChart {
    /// Its triangles in texels, and the size of its image.
    fn on_texels(&self, scale: f64, cell: usize) -> (Vec<[DVec2; 3]>, [usize; 2]) {
        let margin = margin(cell);
        let corners = self
            .corners
            .iter()
            .map(|triangle| triangle.map(|corner| corner * scale + margin))
            .collect();
        let size = (self.size * scale + 2.0 * margin).to_array();
        (corners, size.map(|side| (side.ceil() as usize).max(1)))
    }

    /// Square metres.
    fn area(&self) -> f64 {
        let doubled = |[a, b, c]: &[DVec2; 3]| (b - a).perp_dot(c - a).abs();
        self.corners.iter().map(doubled).sum::<f64>() * 0.5
    }

    /// The texels of the cells that it takes.
    fn texels(&self, scale: f64, cell: usize) -> f64 {
        let (corners, size) = self.on_texels(scale, cell);
        let [width, height] = size.map(|side| side.div_ceil(cell));
        let mut grid = BitGrid::new(width, height);
        let cells = |corner: DVec2| (corner / cell as f64).to_array();
        Rasterizer::default().mark_all(corners.iter().map(|t| t.map(cells)), &mut grid);
        (grid.count() * (cell * cell) as u64) as f64
    }
}

/// For each texel the triangle that it shows: the one that its centre lies in, or beside it one
/// whose plane goes on there, as far as bilinear sampling reaches.
fn owners(corners: &[[DVec2; 3]], size: [usize; 2]) -> Vec<u32> {
    let [width, height] = size;
    let mut owners = vec![FREE; width * height];
    for (number, &triangle) in (0..).zip(corners) {
        for_centres(triangle, size, 1e-9, |[x, y]| {
            let owner = &mut owners[y * width + x];
            if *owner == FREE {
                *owner = number;
            }
        });
    }
    // Those too thin to have a centre.
    for (number, &[a, b, c]) in (0..).zip(corners) {
        let middle = (a + b + c) / 3.0;
        let [x, y] = [middle.x as usize, middle.y as usize];
        let owner = &mut owners[y.min(height - 1) * width + x.min(width - 1)];
        if *owner == FREE {
            *owner = number;
        }
    }
    // Once along each row, then along each column: a ring of one texel.
    for row in owners.chunks_exact_mut(width) {
        let mut before = FREE;
        for x in 0..width {
            let own = row[x];
            if own == FREE {
                let after = row.get(x + 1).copied().unwrap_or(FREE);
                row[x] = if before == FREE { after } else { before };
            }
            before = own;
        }
    }
    let mut above = vec![FREE; width];
    for y in 0..height {
        let (own, below) = owners[y * width..].split_at_mut(width);
        let last = y + 1 == height;
        for (x, (own, above)) in own.iter_mut().zip(&mut above).enumerate() {
            let before = std::mem::replace(above, *own);
            if *own == FREE {
                let after = if last { FREE } else { below[x] };
                *own = if before == FREE { after } else { before };
            }
        }
    }
    owners
}
