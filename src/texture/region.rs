//! The part of an image that a block uses.

use std::ops::Range;

use super::bits::BitGrid;
use super::fill::{self, Texels};
use crate::decode::DecodedTexture;

/// Used texels are extended by so many texels into unused ones at every level. So no block of a JPEG, which is 16
/// texels wide with half the colour resolution, has both a used texel and a foreign one. Atlases copy less around a
/// chart: half a cell, and the rest of the last cell.
pub(crate) const REACH: usize = 16;

/// The texels of a texture that a block uses.
#[derive(Debug)]
pub(crate) struct Region {
    /// First column and row; outside 0..size where charts cross the image's border.
    pub origin: [i64; 2],
    /// Columns and rows, at least 1.
    pub size: [usize; 2],
    /// The texels that some triangle uses; `None` where it is (nearly) all of them.
    pub covered: Option<BitGrid>,
}

impl Region {
    /// Returns its first column and row if the image itself can serve as its texels: the region lies inside of the
    /// image, all of it is used, and the rest of the image is not larger.
    pub fn first_if_shared(&self, image: &DecodedTexture) -> Option<[usize; 2]> {
        let sides = [image.width, image.height].map(i64::from);
        let is_inside = (0..2).all(|axis| {
            self.origin[axis] >= 0 && self.origin[axis] + self.size[axis] as i64 <= sides[axis]
        });
        let is_most = 2 * (self.size[0] * self.size[1]) as u64 >= image.texels();
        let is_shared = is_inside && is_most && self.covered.is_none();
        is_shared.then(|| self.origin.map(|start| start as usize))
    }
}

/// The number of rows that are made at once.
const BAND: usize = 128;

/// The rows of a region. Unused texels near used ones have the colours of these.
pub(crate) struct RegionRows<'a> {
    image: &'a DecodedTexture,
    region: &'a Region,
    /// The rows that are made.
    band: Range<usize>,
    /// Their texels, and those of rows before and after whose colours reach them.
    texels: Vec<u8>,
    /// The first row in `texels`.
    first: usize,
}

impl<'a> RegionRows<'a> {
    /// Prepares to make rows.
    pub fn new(image: &'a DecodedTexture, region: &'a Region) -> Self {
        Self { image, region, band: 0..0, texels: Vec::new(), first: 0 }
    }

    /// Returns the texels of a row. Rows are asked for in their order.
    pub fn row(&mut self, y: usize) -> &[u8] {
        if !self.band.contains(&y) {
            self.make(y);
        }
        let bytes = self.region.size[0] * usize::from(self.image.channels);
        &self.texels[(y - self.first) * bytes..][..bytes]
    }

    fn make(&mut self, start: usize) {
        let height = self.region.size[1];
        self.band = start..(start + BAND).min(height);
        let Some(covered) = &self.region.covered else {
            self.copy(self.band.clone());
            return;
        };
        let rows = start.saturating_sub(REACH)..(self.band.end + REACH).min(height);
        self.copy(rows.clone());
        let [channels, stride] = [usize::from(self.image.channels), self.region.size[0]];
        let texels = &mut Texels { pixels: &mut self.texels, channels, stride, origin: [0; 2] };
        fill::extend(texels, &covered.rows(rows), REACH);
    }

    /// Copies rows of the region. Beyond a side, the image goes on at the opposite one.
    fn copy(&mut self, rows: Range<usize>) {
        let Region { origin, size, .. } = self.region;
        let [width, height] = [self.image.width, self.image.height].map(|side| side as usize);
        let channels = usize::from(self.image.channels);
        self.first = rows.start;
        self.texels.clear();
        for y in rows {
            let row = (origin[1] + y as i64).rem_euclid(height as i64) as usize;
            let row = &self.image.pixels[row * width * channels..][..width * channels];
            let mut x = origin[0].rem_euclid(width as i64) as usize;
            let mut left = size[0];
            while left > 0 {
                let count = left.min(width - x);
                self.texels.extend_from_slice(&row[x * channels..(x + count) * channels]);
                left -= count;
                x = 0;
            }
        }
    }
}
