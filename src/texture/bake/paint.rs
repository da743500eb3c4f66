//! The image of a flat chart: how many texels it gets, and what each of them shows.

use glam::{DVec2, DVec3};

use super::flat::{FlatChart, for_centres};
use super::source::{Source, SurfacePoint};
use crate::color;
use crate::mesh::{Mesh, wide};
use crate::texture::bits::BitGrid;
use crate::texture::block::{BlockTextures, Prepared};
use crate::texture::fill;
use crate::texture::level::LevelImage;
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
    ) -> Painted {
        let (corners, size) = chart.on_texels(scale, self.baked_cell(level));
        let [width, height] = size;
        let owners = owners(&corners, size);
        let mut pixels = vec![0u8; width * height * 3];
        let mut known = BitGrid::new(width, height);
        // Bilinear sampling of the next finer level averages just the texel's own width.
        let finer = (level + 1).min(self.steps.len() - 1);
        let mut near = None;
        let byte = color::linear_to_byte();
        let to_surface: Vec<TexelToSurface> = chart
            .triangles
            .iter()
            .zip(&corners)
            .map(|(&triangle, flat)| {
                TexelToSurface::new(mesh, mesh.triangles[triangle as usize], *flat)
            })
            .collect();
        for y in 0..height {
            for x in 0..width {
                let owner = owners[y * width + x];
                if owner == FREE {
                    continue;
                }
                let to_surface = &to_surface[owner as usize];
                let point = to_surface.at(DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
                let Some(nearest) = source.nearest(point, to_surface.normal, near, SLACK / scale)
                else {
                    continue;
                };
                near = Some(nearest);
                let color = self.color_at(source, nearest, finer);
                pixels[(y * width + x) * 3..][..3]
                    .copy_from_slice(&color.map(|light| byte.of((light * 65535.0) as u16)));
                known.set(x, y);
            }
        }
        fill::fill_all(&mut pixels, 3, &known);
        Painted { image: LevelImage::own(size, 3, self.steps[level], pixels), corners }
    }

    /// What the original shows at a point, at the level's resolution, linear light, 0–1.
    fn color_at(&self, source: &Source, point: SurfacePoint, level: usize) -> [f32; 3] {
        let triangle = source.triangle(point.triangle);
        let Some(Prepared::Atlas(atlas)) = self.textures.get(triangle.texture as usize) else {
            return [1.0; 3];
        };
        let image = &atlas.levels[level];
        let along = |axis: usize| {
            (0..3).map(|i| point.weights[i] * f64::from(triangle.texels[i][axis])).sum::<f64>()
        };
        let mut color = image.light_at([along(0) / image.step, along(1) / image.step]);
        if let Some(colors) = triangle.colors {
            for (channel, light) in color.iter_mut().enumerate() {
                let own =
                    (0..3).map(|i| point.weights[i] * f64::from(colors[i][channel])).sum::<f64>();
                *light *= (own / 65535.0) as f32;
            }
        }
        color
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

/// From a chart's texels to its triangle in space.
struct TexelToSurface {
    flat: [DVec2; 3],
    corners: [DVec3; 3],
    /// One over twice the area in texels; 0 where it has none.
    inverse: f64,
    normal: DVec3,
}

impl TexelToSurface {
    fn new(mesh: &Mesh, triangle: [u32; 3], flat: [DVec2; 3]) -> Self {
        let corners = triangle.map(|vertex| wide(mesh.positions[vertex as usize]));
        let [a, b, c] = flat;
        let doubled = (b - a).perp_dot(c - a);
        let inverse = if doubled.abs() > 1e-6 { 1.0 / doubled } else { 0.0 };
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self { flat, corners, inverse, normal: normal.normalize_or_zero() }
    }

    /// The point of the triangle's plane; of a triangle without area its middle.
    fn at(&self, texel: DVec2) -> DVec3 {
        let [a, b, c] = self.flat;
        let [p, q, r] = self.corners;
        if self.inverse == 0.0 {
            return (p + q + r) / 3.0;
        }
        let v = (texel - a).perp_dot(c - a) * self.inverse;
        let w = (b - a).perp_dot(texel - a) * self.inverse;
        p + (q - p) * v + (r - p) * w
    }
}
