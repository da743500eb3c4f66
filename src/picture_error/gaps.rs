//! Background where there should be surface, and the other way round.

use image::GrayImage;

/// Where two pictures of the same view differ in what is surface and what is background.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gaps {
    width: u32,
    /// Pixels with surface in the reference.
    pub reference_pixels: u64,
    /// Background in the picture where the reference has surface: its pixels.
    pub gaps: Vec<[u32; 2]>,
    /// Pixels with surface in the picture where the reference has background.
    pub extra_pixels: u64,
    /// For each pixel the squared distance to the nearest background of the reference.
    to_background: Vec<u64>,
    /// For each pixel the squared distance to the nearest surface of the picture.
    to_surface: Vec<u64>,
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
            true => [Vec::new(), Vec::new()],
            false => [distances(reference, |value| value == 0), distances(picture, |v| v > 0)],
        };
        let width = reference.width();
        Some(Self { width, reference_pixels, gaps, extra_pixels, to_background, to_surface })
    }

    /// Those gaps that no outline explains which lies up to `reach` pixels further in: they are
    /// farther than that from the reference's background, so that background is seen *through* the
    /// model, or from the picture's surface, so that something is gone altogether.
    pub fn inner(&self, mut reach: impl FnMut([u32; 2]) -> f64) -> Vec<[u32; 2]> {
        let distance = |[x, y]: [u32; 2]| {
            let at = y as usize * self.width as usize + x as usize;
            (self.to_background[at].max(self.to_surface[at]) as f64).sqrt()
        };
        self.gaps.iter().copied().filter(|&at| distance(at) > reach(at)).collect()
    }
}

/// For each pixel the squared distance to the nearest that is sought: along columns first, and then
/// the least over each row of what columns have and how far away they are.
fn distances(picture: &GrayImage, sought: impl Fn(u8) -> bool) -> Vec<u64> {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let mut squares = vec![FAR; width * height];
    for x in 0..width {
        let found = |y: usize| sought(picture.as_raw()[y * width + x]);
        let mut nearest = |order: &mut dyn Iterator<Item = usize>| {
            let mut last = None;
            for y in order {
                if found(y) {
                    last = Some(y);
                }
                if let Some(last) = last {
                    let square = (y.abs_diff(last) as u64).pow(2);
                    let slot = &mut squares[y * width + x];
                    *slot = square.min(*slot);
                }
            }
        };
        nearest(&mut (0..height));
        nearest(&mut (0..height).rev());
    }
    let mut row = vec![0; width];
    for y in 0..height {
        let line = &mut squares[y * width..(y + 1) * width];
        row.copy_from_slice(line);
        for (x, slot) in line.iter_mut().enumerate() {
            // Columns further away than what was found cannot have anything nearer.
            for away in 1..width {
                let square = (away as u64).pow(2);
                if square >= *slot {
                    break;
                }
                let sides = [x.checked_sub(away), Some(x + away).filter(|&x| x < width)];
                for side in sides.into_iter().flatten() {
                    *slot = (*slot).min(row[side] + square);
                }
            }
        }
    }
    squares
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
            for (at, found) in distances(&picture, |value| value == 0).into_iter().enumerate() {
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
