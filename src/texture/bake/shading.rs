//! The colours of samples.

use glam::{DVec2, Vec4};

use super::project::{Projection, SampleHit};
use super::source::BakeSource;
use super::source_image::WrappedSampler;
use super::tile::Tile;
use crate::texture::block::BlockTextures;

/// What samples show is taken from a level whose texels are at most so large for them: bilinear
/// sampling averages about two of them along each axis.
const NARROWER: f64 = 0.6;

/// Where wide samples have so many texels between them, two by two of these are averaged; fewer are
/// magnified.
const WIDE: f64 = 1.5;

/// What the samples of a tile show.
pub(super) struct Samples<'a> {
    tile: &'a Tile,
    /// By sample: the number in `shadings` of what it shows, or one beyond all.
    numbers: &'a [u32],
    shadings: Vec<Shading<'a>>,
    /// By sample: the chart of what it shows; empty where no sample is wide.
    charts: Vec<u32>,
}

/// What gives samples of one triangle of the original their colours.
struct Shading<'a> {
    /// `None` where the triangle has no texture.
    sampler: Option<WrappedSampler<'a>>,
    /// Colour of the material, which multiplies that of the image.
    factor: Vec4,
    /// The position in its image of the origin of the chart, and by column and row.
    texels: [DVec2; 3],
    /// Samples far enough inside its chart are means of two by two texels.
    wide: bool,
    shown: &'a SampleHit,
    colors: Option<[[u16; 4]; 3]>,
}

/// No chart has the sample.
const NO_CHART: u32 = u32::MAX;

impl<'a> Samples<'a> {
    /// Of what was drawn onto a tile. `wide` samples average two by two texels where these are all
    /// of one chart.
    pub fn new(
        block: &'a BlockTextures,
        source: &BakeSource,
        tile: &'a Tile,
        projection: &'a Projection,
        wide: bool,
    ) -> Self {
        let shown = projection.shown.iter();
        let shadings: Vec<Shading> =
            shown.map(|shown| Shading::new(block, source, shown, wide)).collect();
        let chart_of = |&number: &u32| match projection.shown.get(number as usize) {
            Some(shown) => source.triangle(shown.triangle).chart,
            None => NO_CHART,
        };
        let numbers = &projection.numbers[..];
        let charts = if wide { numbers.iter().map(chart_of).collect() } else { Vec::new() };
        Self { tile, numbers, shadings, charts }
    }

    /// Adds to each texel of a row what its samples show, linear light, 0–1, and how many show
    /// anything. There are `side` samples along each side of a texel, the first of them in `row`.
    pub fn add(&self, row: usize, side: usize, sums: &mut [Vec4]) {
        for row in row..row + side {
            let first = self.tile.index(self.tile.columns.start, row);
            let y = f64::from(row as i32) + 0.5;
            let mut column = self.tile.columns.start;
            let mut index = first;
            for sum in &mut *sums {
                for _ in 0..side {
                    if let Some(shading) = self.shadings.get(self.numbers[index] as usize) {
                        let at = DVec2::new(f64::from(column as i32) + 0.5, y);
                        *sum += shading.at(at, shading.wide && self.is_inside(column, row, index));
                    }
                    column += 1;
                    index += 1;
                }
            }
        }
    }

    /// True where a sample and those beside it show one chart.
    fn is_inside(&self, column: usize, row: usize, index: usize) -> bool {
        let (columns, rows) = (&self.tile.columns, &self.tile.rows);
        let is_at_side = column == columns.start
            || column + 1 == columns.end
            || row == rows.start
            || row + 1 == rows.end;
        let own = self.charts[index];
        let beside = [
            index.wrapping_sub(1),
            index + 1,
            index.wrapping_sub(columns.len()),
            index + columns.len(),
        ];
        !is_at_side && beside.iter().all(|&beside| self.charts[beside] == own)
    }
}

impl<'a> Shading<'a> {
    fn new(
        block: &'a BlockTextures,
        source: &BakeSource,
        shown: &'a SampleHit,
        wide: bool,
    ) -> Self {
        let triangle = source.triangle(shown.triangle);
        let image = block.image_of(triangle);
        let sampler = image.and_then(|image| image.level(shown.spacing * NARROWER));
        let step = sampler.as_ref().map_or(1.0, |sampler| sampler.step);
        Self {
            sampler,
            factor: block.factor_of(triangle.material),
            texels: shown.texels(1.0 / step),
            wide: wide && shown.spacing >= step * WIDE,
            shown,
            colors: triangle.colors,
        }
    }

    /// The colour at a sample's centre, linear light, 0–1, and 1.
    #[inline]
    fn at(&self, centre: DVec2, wide: bool) -> Vec4 {
        let light = self.sampler.as_ref().map_or(Vec4::ONE, |sampler| {
            let [origin, right, down] = self.texels;
            let at = origin + right * centre.x + down * centre.y;
            if wide { sampler.mean_at(at) } else { sampler.at(at) }
        });
        light * self.factor * tint(self.colors, || self.shown.weights(centre))
    }
}

/// The vertex colours of a triangle's corners, weighted, and 1.
pub(super) fn tint(colors: Option<[[u16; 4]; 3]>, weights: impl Fn() -> [f64; 3]) -> Vec4 {
    let Some(colors) = colors else { return Vec4::ONE };
    let weights = weights();
    let channel = |channel: usize| {
        let own = (0..3).map(|i| weights[i] * f64::from(colors[i][channel])).sum::<f64>();
        (own / 65535.0) as f32
    };
    Vec4::new(channel(0), channel(1), channel(2), 1.0)
}
