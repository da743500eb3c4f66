//! The values of an opacity map decide whether its material has a cutoff or is blended.

/// The effect of an opacity map on a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Opacity {
    /// All of it is opaque.
    Opaque,
    /// It has holes: nearly all texels are opaque or transparent.
    Mask,
    /// Some of it is translucent.
    Blend,
    /// Nothing of it is visible.
    Transparent,
}

/// Alpha from here on is opaque: JPEG and 16-bit sources are off by a few steps of 255.
const OPAQUE: u8 = 250;

/// Alpha between transparent and opaque, beyond what JPEG leaves around edges (ringing of up to 15
/// steps).
const INTERMEDIATE: std::ops::RangeInclusive<u8> = 16..=239;

/// A map blends where more than this ratio of its texels lie in an intermediate area: the texel and
/// its eight neighbours are intermediate. The ramp of an antialiased edge is one or two texels wide
/// and has none of these, however many edges there are.
const MOST_IN_AREAS: f64 = 0.01;

/// A map blends where this ratio of its texels is intermediate: one of a few texels, whose ramps are
/// all that it shows.
const MOSTLY: f64 = 0.5;

impl Opacity {
    /// Judges a map with these alpha values, row by row.
    pub(super) fn of(width: usize, alpha: &[u8]) -> Self {
        if alpha.iter().all(|value| *value >= OPAQUE) {
            return Self::Opaque;
        }
        if alpha.iter().all(|value| value < INTERMEDIATE.start()) {
            return Self::Transparent;
        }
        let rows: Vec<&[u8]> = alpha.chunks(width.max(1)).collect();
        let is_area = |row: usize, column: usize| {
            let around = |at: usize, len: usize| at.saturating_sub(1)..(at + 2).min(len);
            rows[around(row, rows.len())].iter().all(|row| {
                row[around(column, row.len())].iter().all(|value| INTERMEDIATE.contains(value))
            })
        };
        let (mut intermediate, mut in_areas) = (0, 0);
        for (number, row) in rows.iter().enumerate() {
            for (column, value) in row.iter().enumerate() {
                if INTERMEDIATE.contains(value) {
                    intermediate += 1;
                    in_areas += usize::from(is_area(number, column));
                }
            }
        }
        let ratio = |count: usize| count as f64 / alpha.len() as f64;
        match ratio(in_areas) > MOST_IN_AREAS || ratio(intermediate) >= MOSTLY {
            true => Self::Blend,
            false => Self::Mask,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(side: usize, alpha: impl Fn(f64, f64) -> f64) -> Opacity {
        let at = |texel: usize| alpha((texel % side) as f64 + 0.5, (texel / side) as f64 + 0.5);
        let values: Vec<u8> =
            (0..side * side).map(|texel| (at(texel).clamp(0.0, 1.0) * 255.0) as u8).collect();
        Opacity::of(side, &values)
    }

    #[test]
    fn constant_maps_are_opaque_translucent_or_invisible() {
        for side in [1, 2, 64] {
            assert_eq!(of(side, |_, _| 1.0), Opacity::Opaque);
            assert_eq!(of(side, |_, _| 0.99), Opacity::Opaque);
            assert_eq!(of(side, |_, _| 0.9), Opacity::Blend);
            assert_eq!(of(side, |_, _| 0.4), Opacity::Blend);
            assert_eq!(of(side, |_, _| 0.1), Opacity::Blend);
            assert_eq!(of(side, |_, _| 0.0), Opacity::Transparent);
        }
    }

    #[test]
    fn antialiased_edges_are_a_mask_however_many_there_are() {
        // Leaves: discs with an edge of one texel, or of two.
        for spacing in [9.0, 16.0, 30.0] {
            for width in [1.0, 2.0] {
                let disc = |x: f64, y: f64| {
                    let [dx, dy] = [x, y].map(|at| at % spacing - spacing / 2.0);
                    (spacing * 0.35 - dx.hypot(dy)) / width + 0.5
                };
                assert_eq!(of(128, disc), Opacity::Mask, "{spacing} {width}");
            }
        }
        assert_eq!(of(2, |x, _| x - 0.5), Opacity::Mask);
        assert_eq!(of(64, |x, _| if x < 32.0 { 0.0 } else { 1.0 }), Opacity::Mask);
    }

    #[test]
    fn gradients_and_panes_blend() {
        for side in [4, 16, 256] {
            assert_eq!(of(side, |x, _| x / side as f64), Opacity::Blend, "{side}");
        }
        // A window: an opaque frame around a translucent pane.
        let pane = |x: f64, y: f64| if (8.0..56.0).contains(&x.min(y)) { 0.4 } else { 1.0 };
        assert_eq!(of(64, pane), Opacity::Blend);
    }
}
