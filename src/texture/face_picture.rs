//! Pictures of what was drawn, as parts of them are used, encoded.

use image::RgbaImage;

use super::bits::BitGrid;
use super::encode::encode;
use super::fill::fill_all;
use super::open_page;
use super::shape::Shape;
use crate::{Error, Result};

/// Pixels along the side of a cell in which patches are packed.
const CELL: usize = 4;

/// Patches are packed where their page is smaller than so much of the window around them all.
const SMALLER: f64 = 0.9;

/// A part of a picture that is used, on a grid of cells of [`CELL`] pixels.
pub(crate) struct Patch {
    /// Its first column and row of cells in the picture.
    from: [usize; 2],
    shape: Shape,
}

impl Patch {
    /// What is within `margin` pixels of some pixels, of a picture of a size; none where that is nothing.
    pub fn around(pixels: &[[usize; 2]], margin: usize, size: [u32; 2]) -> Option<Self> {
        let ends = size.map(|side| (side as usize).div_ceil(CELL));
        let span = |axis: usize, at: usize| {
            let first = at.saturating_sub(margin) / CELL;
            first..((at + margin) / CELL + 1).min(ends[axis])
        };
        let mut from = [usize::MAX; 2];
        let mut to = [0; 2];
        for at in pixels {
            for axis in 0..2 {
                let span = span(axis, at[axis]);
                from[axis] = from[axis].min(span.start);
                to[axis] = to[axis].max(span.end);
            }
        }
        let [width, height] = [0, 1].map(|axis| to[axis].saturating_sub(from[axis]));
        if width * height == 0 {
            return None;
        }
        let mut cells = BitGrid::new(width, height);
        for &[x, y] in pixels {
            let columns = span(0, x);
            let (start, end) = (columns.start - from[0], columns.end - from[0]);
            span(1, y).for_each(|row| cells.set_span(row - from[1], start, end));
        }
        Some(Self { from, shape: Shape::of(&cells) })
    }
}

/// What is used of a picture.
pub(crate) struct FacePicture {
    /// A JPEG.
    pub bytes: Vec<u8>,
    /// Its width and height.
    pub size: [u32; 2],
    /// By patch: added to a position in the picture that it was taken from, that gives its position here.
    pub shifts: Vec<[f32; 2]>,
}

/// The patches of a picture as JPEG: the window around them all, or packed where that is smaller. Where
/// alpha is 0 nothing was drawn: colours around go on there, so that neither the JPEG nor the smaller versions
/// of the texture know of an edge.
pub(crate) fn face_picture(
    picture: &RgbaImage,
    patches: &[Patch],
    quality: u8,
) -> Result<FacePicture> {
    let (places, cells) = placed(patches)?;
    let [width, height] = cells.map(|side| side * CELL);
    let mut pixels = vec![0; width * height * 3];
    let mut known = BitGrid::new(width, height);
    for (patch, place) in patches.iter().zip(&places) {
        for &[row, start, end] in &patch.shape.runs {
            for y in 0..CELL {
                for x in start as usize * CELL..end as usize * CELL {
                    let at = [x, row as usize * CELL + y];
                    let [from, to] = [patch.from, *place]
                        .map(|place| [0, 1].map(|axis| place[axis] * CELL + at[axis]));
                    let Some(pixel) = picture.get_pixel_checked(from[0] as u32, from[1] as u32)
                    else {
                        continue;
                    };
                    let [r, g, b, alpha] = pixel.0;
                    if alpha > 0 {
                        let first = (to[1] * width + to[0]) * 3;
                        pixels[first..first + 3].copy_from_slice(&[r, g, b]);
                        known.set(to[0], to[1]);
                    }
                }
            }
        }
    }
    fill_all(&mut pixels, 3, &known);
    let shift = |(patch, place): (&Patch, &[usize; 2])| {
        [0, 1].map(|axis| (place[axis] as f32 - patch.from[axis] as f32) * CELL as f32)
    };
    Ok(FacePicture {
        bytes: encode(&pixels, [width, height], 3, quality)?.bytes,
        size: [width, height].map(|side| side as u32),
        shifts: patches.iter().zip(&places).map(shift).collect(),
    })
}

/// The first cell of each patch, and the cells of a page with all of them.
fn placed(patches: &[Patch]) -> Result<(Vec<[usize; 2]>, [usize; 2])> {
    let fold = |axis: usize| {
        patches.iter().fold([usize::MAX, 0], |[from, to], patch| {
            let first = patch.from[axis];
            [from.min(first), to.max(first + patch.shape.size[axis])]
        })
    };
    let window = [fold(0), fold(1)];
    let size = window.map(|[from, to]| to.saturating_sub(from));
    let area = |[width, height]: [usize; 2]| (width * height) as f64;
    let used: usize = patches.iter().map(|patch| patch.shape.area()).sum();
    if (used as f64) < SMALLER * area(size) {
        let (places, page) = packed(patches)?;
        if area(page) < SMALLER * area(size) {
            return Ok((places, page));
        }
    }
    let place = |patch: &Patch| [0, 1].map(|axis| patch.from[axis] - window[axis][0]);
    Ok((patches.iter().map(place).collect(), size))
}

/// The same on a page as small as is found.
fn packed(patches: &[Patch]) -> Result<(Vec<[usize; 2]>, [usize; 2])> {
    let shapes: Vec<Shape> = patches.iter().map(|patch| patch.shape.clone()).collect();
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    order.sort_by_key(|&at| std::cmp::Reverse((shapes[at].area(), shapes[at].size)));
    // Side by side or one above the other, all have room.
    let most: usize = shapes.iter().map(|shape| shape.size[0] + shape.size[1]).sum();
    let packing = open_page::pack(&shapes, &order, most.max(1));
    let Some(packing) = packing.filter(|packing| packing.pages.len() == 1) else {
        return Err(Error::Internal("patches of a face do not fit on a page".into()));
    };
    let places = packing.placements.iter().map(|at| [at.x, at.y]).collect();
    Ok((places, packing.pages[0]))
}

#[cfg(test)]
mod tests {
    use image::Rgba;

    use super::*;

    const SIZE: [u32; 2] = [96, 90];

    fn picture() -> RgbaImage {
        RgbaImage::from_fn(SIZE[0], SIZE[1], |x, y| {
            Rgba([x as u8 * 2, y as u8 * 2, 90, u8::from(x > 3) * 255])
        })
    }

    fn square([x, y]: [usize; 2], side: usize) -> Vec<[usize; 2]> {
        (0..side * side).map(|at| [x + at % side, y + at / side]).collect()
    }

    #[test]
    fn patches_keep_their_colours_wherever_they_are_put() {
        let of = [square([5, 7], 9), square([80, 70], 12), square([90, 4], 6)];
        let patches: Vec<Patch> =
            of.iter().map(|pixels| Patch::around(pixels, 1, SIZE).unwrap()).collect();
        let made = face_picture(&picture(), &patches, 100).unwrap();
        let [width, height] = made.size;
        assert!(width * height < SIZE[0] * SIZE[1] / 4, "{width} × {height}");
        let found = image::load_from_memory(&made.bytes).unwrap().to_rgb8();
        for (pixels, shift) in of.iter().zip(&made.shifts) {
            for at in pixels {
                let [x, y] = [0, 1].map(|axis| (at[axis] as f32 + shift[axis]) as u32);
                let found = found.get_pixel(x, y).0;
                let expected = [at[0] as u8 * 2, at[1] as u8 * 2, 90];
                let off = (0..3).map(|i| found[i].abs_diff(expected[i])).max().unwrap();
                assert!(off <= 12, "{at:?}: {found:?}, {expected:?}");
            }
        }
    }

    #[test]
    fn what_fills_its_window_is_cut_out_as_it_is() {
        let patch = Patch::around(&square([8, 12], 40), 2, SIZE).unwrap();
        let made = face_picture(&picture(), &[patch], 90).unwrap();
        assert_eq!((made.size, made.shifts), ([48, 48], vec![[-4.0, -8.0]]));
        let whole = Patch::around(&[[0, 0], [95, 89]], 99, SIZE).unwrap();
        let made = face_picture(&picture(), &[whole], 90).unwrap();
        assert_eq!((made.size, made.shifts), ([96, 92], vec![[0.0; 2]]));
        assert!(Patch::around(&[], 2, SIZE).is_none());
    }
}
