//! The image of a flat chart: how many texels it gets, and what each of them shows.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3, Vec4};

use super::flat::{FlatChart, for_centres};
use super::project::{Projection, Shown, TexelPlane};
use super::source::{Source, SourceTriangle, SurfacePoint};
use crate::color;
use crate::mesh::{Mesh, wide};
use crate::texture::bits::BitGrid;
use crate::texture::block::{BlockTextures, Prepared};
use crate::texture::fill;
use crate::texture::level::{LevelImage, Sampler};
use crate::texture::raster::Rasterizer;

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

/// So many samples are drawn at once, about: half a megabyte.
const BAND: usize = 1 << 16;

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
        source: &Source,
        mesh: &Mesh,
        triangles: &[u32],
        level: usize,
    ) -> f64 {
        let (mut texels, mut area) = (0.0, 0.0);
        let mut near = None;
        for &triangle in triangles {
            let [a, b, c] = mesh.corners(mesh.triangles[triangle as usize]);
            let cross = (b - a).cross(c - a);
            let normal = cross.normalize_or_zero();
            let Some(nearest) = source.nearest((a + b + c) / 3.0, normal, near, 0.0) else {
                continue;
            };
            near = Some(nearest);
            texels += source.triangle(nearest.triangle).density * cross.length();
            area += cross.length();
        }
        if area > 0.0 { (texels / area).sqrt() / self.steps[level] } else { 0.0 }
    }

    /// What the charts' scales are multiplied with so that with their gutters they take no more
    /// than the node's share.
    pub(super) fn fitted(&self, mesh: &Mesh, charts: &[FlatChart], level: usize) -> f64 {
        let cell = self.baked_cell(level);
        let part = if level == 0 { 1.0 } else { CELLS };
        let share = (self.share_of(mesh, level) * part).max((cell * cell) as f64 * 4.0);
        let longest = charts.iter().map(|chart| chart.size.max_element() * chart.scale);
        let most = (self.options.max_atlas as f64 * 0.5).max(1.0);
        let mut factor = (most / longest.fold(most, f64::max)).min(1.0);
        for _ in 0..FITS {
            let taken: f64 =
                charts.iter().map(|chart| chart.texels(chart.scale * factor, cell)).sum();
            if taken <= share {
                break;
            }
            factor *= (share / taken).sqrt().max(0.5);
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
        source: &Source,
        mesh: &Mesh,
        chart: &FlatChart,
        scale: f64,
        level: usize,
        away: &mut Away,
    ) -> Painted {
        let (corners, size) = chart.on_texels(scale, self.baked_cell(level));
        let [width, height] = size;
        let owners = owners(&corners, size);
        let mut pixels = vec![0u8; width * height * 3];
        let mut known = BitGrid::new(width, height);
        // Bilinear sampling of the next finer level averages just the texel's own width.
        let finer = (level + 1).min(self.steps.len() - 1);
        let samples = self.samples(scale / chart.scale, level);
        let mut projection = Projection::default();
        let byte = color::linear_to_byte();
        let mut near = None;
        let mut sums: Vec<Vec4> = Vec::new();
        for (number, (&triangle, &flat)) in (0..).zip(chart.triangles.iter().zip(&corners)) {
            let triangle = mesh.triangles[triangle as usize];
            let sampled = flat.map(|corner| corner * samples as f64);
            let plane = TexelPlane::new(mesh, triangle, sampled, BESIDE * samples as f64);
            let mut reach = 0.0;
            if let Some(plane) = &plane {
                let farthest = triangle.map(|vertex| away.of(vertex, plane.normal));
                reach = 2.0 * farthest.into_iter().fold(0.0, f64::max) + REACH_TEXELS / scale;
                projection.gather(source, plane, reach);
            }
            // What has no area in texels, as where the source has none, shows its middle.
            let [a, b, c] = mesh.corners(triangle);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let [columns, rows] = texels_around(flat, size);
            let band = (BAND / (columns.len() * samples * samples).max(1)).max(1);
            for first in rows.clone().step_by(band) {
                let rows = first..(first + band).min(rows.end);
                if let Some(plane) = &plane {
                    let sampled = [columns.clone(), rows.clone()]
                        .map(|Range { start, end }| start * samples..end * samples);
                    projection.draw(source, plane, reach, sampled, &self.steps);
                }
                for y in rows {
                    let owned = &owners[y * width..][..width];
                    sums.clear();
                    sums.resize(columns.len(), Vec4::ZERO);
                    if plane.is_some() {
                        let texels = (columns.clone(), y, samples);
                        let is_own = |x: usize| owned[x] == number;
                        self.add_samples(source, &projection, texels, is_own, &mut sums);
                    }
                    for (x, sum) in columns.clone().zip(&sums) {
                        if owned[x] != number {
                            continue;
                        }
                        let drawn = (sum.w > 0.0).then(|| sum.truncate() / sum.w);
                        let mut searched = || {
                            let centre =
                                DVec2::new(x as f64 + 0.5, y as f64 + 0.5) * samples as f64;
                            let point =
                                plane.as_ref().map_or((a + b + c) / 3.0, |plane| plane.at(centre));
                            near = source.nearest(point, normal, near, SLACK / scale).or(near);
                            Some(self.color_at(source, near?, finer))
                        };
                        let Some(color) = drawn.or_else(&mut searched) else { continue };
                        let bytes = color.to_array().map(|light| byte.of((light * 65535.0) as u16));
                        pixels[(y * width + x) * 3..][..3].copy_from_slice(&bytes);
                        known.set(x, y);
                    }
                }
            }
        }
        fill::fill_all(&mut pixels, 3, &known);
        Painted { image: LevelImage::own(size, 3, self.steps[level], pixels), corners }
    }

    /// Samples along each side of a texel of a chart that has so many texels for one of its level.
    fn samples(&self, factor: f64, level: usize) -> usize {
        let source_texels = self.steps[level] / factor.max(f64::MIN_POSITIVE);
        (source_texels.round() as usize).clamp(1, SAMPLES[usize::from(level > 0)])
    }

    /// Adds what the samples of those texels of a row show that are asked for, linear light, 0–1,
    /// and how many show anything.
    fn add_samples(
        &self,
        source: &Source,
        projection: &Projection,
        (columns, y, samples): (Range<usize>, usize, usize),
        is_own: impl Fn(usize) -> bool,
        sums: &mut [Vec4],
    ) {
        // Most samples show what the one before them shows.
        let mut before: Option<(u32, Shading)> = None;
        for row in y * samples..(y + 1) * samples {
            for (x, sum) in columns.clone().zip(&mut *sums).filter(|&(x, _)| is_own(x)) {
                for column in x * samples..(x + 1) * samples {
                    let Some((number, shown)) = projection.at(column, row) else { continue };
                    let shading = match &before {
                        Some((same, shading)) if *same == number => shading,
                        _ => &before.insert((number, self.shading(source, shown))).1,
                    };
                    let [column, row] = [column as i32, row as i32].map(f64::from);
                    *sum += shading.at(DVec2::new(column + 0.5, row + 0.5));
                }
            }
        }
    }

    /// What gives samples of a triangle of the original their colours.
    fn shading<'a>(&'a self, source: &Source, shown: &'a Shown) -> Shading<'a> {
        let triangle = source.triangle(shown.triangle);
        let image = self.levels_of(triangle).map(|levels| &levels[shown.level as usize]);
        let step = image.map_or(1.0, |image| image.step);
        Shading {
            sampler: image.map(LevelImage::sampler),
            texels: shown.texels(1.0 / step),
            shown,
            colors: triangle.colors,
        }
    }

    /// The images of a triangle of the original, by level; `None` where it has no texture.
    fn levels_of(&self, triangle: &SourceTriangle) -> Option<&[LevelImage]> {
        match self.textures.get(triangle.texture as usize) {
            Some(Prepared::Atlas(atlas)) => Some(&atlas.levels),
            _ => None,
        }
    }

    /// What the original shows at a point, at the level's resolution, linear light, 0–1.
    fn color_at(&self, source: &Source, point: SurfacePoint, level: usize) -> Vec3 {
        let triangle = source.triangle(point.triangle);
        let Some(levels) = self.levels_of(triangle) else { return Vec3::ONE };
        let image = &levels[level];
        let along = |axis: usize| {
            (0..3).map(|i| point.weights[i] * f64::from(triangle.texels[i][axis])).sum::<f64>()
        };
        let light = image.sampler().at(DVec2::new(along(0), along(1)) / image.step);
        (light * tint(triangle.colors, || point.weights)).truncate()
    }
}

/// What gives samples of one triangle of the original their colours.
struct Shading<'a> {
    /// `None` where the triangle has no texture.
    sampler: Option<Sampler<'a>>,
    /// The position in its image of the origin of the chart, and by column and row.
    texels: [DVec2; 3],
    shown: &'a Shown,
    colors: Option<[[u16; 4]; 3]>,
}

impl Shading<'_> {
    /// The colour of a sample, and 1.
    #[inline]
    fn at(&self, centre: DVec2) -> Vec4 {
        let Some(sampler) = &self.sampler else { return Vec4::ONE };
        let [origin, right, down] = self.texels;
        let light = sampler.at(origin + right * centre.x + down * centre.y);
        light * tint(self.colors, || self.shown.weights(centre))
    }
}

/// The vertex colours of a triangle's corners, weighted, and 1.
fn tint(colors: Option<[[u16; 4]; 3]>, weights: impl Fn() -> [f64; 3]) -> Vec4 {
    let Some(colors) = colors else { return Vec4::ONE };
    let weights = weights();
    let channel = |channel: usize| {
        let own = (0..3).map(|i| weights[i] * f64::from(colors[i][channel])).sum::<f64>();
        (own / 65535.0) as f32
    };
    Vec4::new(channel(0), channel(1), channel(2), 1.0)
}

/// How far the original is from a node's vertices.
pub(super) struct Away<'a> {
    source: &'a Source,
    mesh: &'a Mesh,
    /// By vertex; negative where nobody has asked yet.
    known: Vec<f64>,
    near: Option<SurfacePoint>,
}

impl<'a> Away<'a> {
    pub fn new(source: &'a Source, mesh: &'a Mesh) -> Self {
        Self { source, mesh, known: vec![-1.0; mesh.positions.len()], near: None }
    }

    /// The distance of a vertex, metres, seen from a triangle that faces this way.
    fn of(&mut self, vertex: u32, normal: DVec3) -> f64 {
        let known = &mut self.known[vertex as usize];
        if *known < 0.0 {
            let point = wide(self.mesh.positions[vertex as usize]);
            self.near = self.source.nearest(point, normal, self.near, 0.0).or(self.near);
            *known = self.near.map_or(0.0, |near| near.distance);
        }
        *known
    }
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

/// Columns and rows of the texels that may show a triangle with these corners.
fn texels_around([a, b, c]: [DVec2; 3], size: [usize; 2]) -> [Range<usize>; 2] {
    let (low, high) = (a.min(b).min(c) - BESIDE, a.max(b).max(c) + BESIDE);
    [0, 1].map(|axis| {
        let first = (low[axis].max(0.0) as usize).min(size[axis]);
        first..(high[axis].ceil().max(0.0) as usize).clamp(first, size[axis])
    })
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
    for [dx, dy] in [[1, 0], [0, 1]] {
        let before = owners.clone();
        for y in 0..height {
            for x in 0..width {
                if before[y * width + x] != FREE {
                    continue;
                }
                let back = (x >= dx && y >= dy).then(|| before[(y - dy) * width + x - dx]);
                let ahead =
                    (x + dx < width && y + dy < height).then(|| before[(y + dy) * width + x + dx]);
                let found = [back, ahead].into_iter().flatten().find(|&owner| owner != FREE);
                owners[y * width + x] = found.unwrap_or(FREE);
            }
        }
    }
    owners
}
