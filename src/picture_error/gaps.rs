//! Background where there should be surface, and the other way round.

use image::GrayImage;

/// Where two pictures of the same view differ in what is surface and what is background.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gaps {
    /// Pixels with surface in the reference.
    pub reference_pixels: u64,
    /// Background in the picture where the reference has surface: its pixels.
    pub gaps: Vec<[u32; 2]>,
    /// Pixels with surface in the picture where the reference has background.
    pub extra_pixels: u64,
    /// To the nearest background of the reference.
    to_background: Distances,
    /// To the nearest surface of the picture.
    to_surface: Distances,
}

/// More than the square of any distance in a picture, where there is no background at all.
const FAR: u64 = u64::MAX / 4;

impl Gaps {
    /// Compares where surface is (not 0) in the reference and in the picture; `None` where their
    /// sizes differ.
    pub fn between(reference: &GrayImage, picture: &GrayImage) -> Option<Self> {
        if reference.dimensions() != picture.dimensions() {
            return None;
        }
        let mut gaps = Vec::new();
        let (mut reference_pixels, mut extra_pixels) = (0, 0);
        for ((x, y, expected), found) in reference.enumerate_pixels().zip(picture.pixels()) {
            match (expected.0[0] > 0, found.0[0] > 0) {
                (true, false) => gaps.push([x, y]),
                (false, true) => extra_pixels += 1,
                _ => {}
            }
            reference_pixels += u64::from(expected.0[0] > 0);
        }
        // Of use for gaps alone.
        let [to_background, to_surface] = match gaps.is_empty() {
            true => [Distances::default(), Distances::default()],
            false => {
                [Distances::to(reference, |value| value == 0), Distances::to(picture, |v| v > 0)]
            }
        };
        Some(Self { reference_pixels, gaps, extra_pixels, to_background, to_surface })
    }

    /// Those gaps that no outline explains which lies up to `reach` pixels further in: they are
    /// farther than that from the reference's background, so that background is seen *through* the
    /// model, or from the picture's surface, so that something is gone altogether.
    pub fn inner(&self, mut reach: impl FnMut([u32; 2]) -> f64) -> Vec<[u32; 2]> {
        let distance = |at: [u32; 2]| {
            (self.to_background.squared(at).max(self.to_surface.squared(at)) as f64).sqrt()
        };
        self.gaps.iter().copied().filter(|&at| distance(at) > reach(at)).collect()
    }
}

/// How far pixels are from the nearest that is sought: along columns, from which the least over a row, of what
/// columns have and how far away they are, is found where it is asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Distances {
    width: usize,
    /// For each pixel the squared distance to the nearest in its column.
    squares: Vec<u64>,
}

impl Distances {
    fn to(picture: &GrayImage, sought: impl Fn(u8) -> bool) -> Self {
        let width = picture.width() as usize;
        let mut squares = vec![FAR; picture.as_raw().len()];
        let rows = picture.as_raw().chunks(width).zip(squares.chunks_mut(width)).enumerate();
        // Row by row down, and then up: the last place in each column, whichever way that was.
        let mut last = vec![None; width];
        let mut nearest = |(y, (row, squares)): (usize, (&[u8], &mut [u64]))| {
            for ((&value, slot), last) in row.iter().zip(squares).zip(&mut last) {
                if sought(value) {
                    *last = Some(y);
                }
                if let Some(last) = *last {
                    *slot = (y.abs_diff(last) as u64).pow(2).min(*slot);
                }
            }
        };
        rows.for_each(&mut nearest);
        let rows = picture.as_raw().chunks(width).zip(squares.chunks_mut(width)).enumerate();
        rows.rev().for_each(&mut nearest);
        Self { width, squares }
    }

    /// Of a pixel, squared; [`FAR`] where there is none.
    fn squared(&self, [x, y]: [u32; 2]) -> u64 {
        let (x, y) = (x as usize, y as usize);
        let row = &self.squares[y * self.width..(y + 1) * self.width];
        let mut least = row[x];
        // Columns further away than what was found cannot have anything nearer.
        for away in 1..self.width {
            let square = (away as u64).pow(2);
            if square >= least {
                break;
            }
            let sides = [x.checked_sub(away), Some(x + away).filter(|&x| x < self.width)];
            for side in sides.into_iter().flatten() {
                least = least.min(row[side] + square);
            }
        }
        least
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;
    use crate::random::Random;

    fn mask(width: u32, height: u32, surface: impl Fn(u32, u32) -> bool) -> GrayImage {
        GrayImage::from_fn(width, height, |x, y| Luma([255 * u8::from(surface(x, y))]))
    }

    #[test]
    fn gaps_and_what_is_too_much_are_counted_apart() {
        let reference = mask(10, 8, |x, _| x < 6);
        let picture = mask(10, 8, |x, y| (x, y) != (2, 3) && x != 5 && x < 7 || (x, y) == (9, 0));
        let gaps = Gaps::between(&reference, &picture).unwrap();
        assert_eq!((gaps.reference_pixels, gaps.gaps.len(), gaps.extra_pixels), (48, 9, 9));
        // The column at the outline is explained by an outline a pixel further in; the hole is not.
        assert_eq!(gaps.inner(|_| 1.0), [[2, 3]]);
        assert_eq!(gaps.inner(|_| 4.0), [[0; 2]; 0]);
        assert_eq!(gaps.inner(|_| 0.0).len(), 9);
        assert_eq!(Gaps::between(&reference, &mask(8, 10, |_, _| true)), None);
    }

    #[test]
    fn what_is_gone_altogether_is_no_outline() {
        // A mast three pixels wide on the ground: every pixel of it is near the background.
        let reference = mask(21, 30, |x, y| y >= 25 || (9..12).contains(&x));
        let picture = mask(21, 30, |_, y| y >= 25);
        let inner = Gaps::between(&reference, &picture).unwrap().inner(|_| 4.0);
        assert_eq!(inner.len(), 3 * 21, "what is not within four pixels of the ground");
    }

    #[test]
    fn without_any_background_every_gap_is_inside() {
        let gaps = Gaps::between(&mask(5, 5, |_, _| true), &mask(5, 5, |x, _| x > 0)).unwrap();
        assert_eq!(gaps.inner(|_| 1e6).len(), 5);
    }

    #[test]
    fn distances_are_those_of_trying_all() {
        let mut random = Random::new(1, 0);
        for share in [0.02, 0.3, 0.9] {
            let bits: Vec<bool> = (0..19 * 23).map(|_| random.between(0.0, 1.0) > share).collect();
            let picture = mask(19, 23, |x, y| bits[(y * 19 + x) as usize]);
            let distances = Distances::to(&picture, |value| value == 0);
            for at in 0..bits.len() {
                let found = distances.squared([at as u32 % 19, at as u32 / 19]);
                let square = |other: usize| {
                    let away = |a: usize, b: usize| a.abs_diff(b) as u64;
                    away(at % 19, other % 19).pow(2) + away(at / 19, other / 19).pow(2)
                };
                let naive = (0..bits.len()).filter(|&other| !bits[other]).map(square).min();
                assert_eq!(found, naive.unwrap_or(FAR));
            }
        }
    }
}
