//! Where each block stands: a grid of streets, four façade rows around each city block.

use crate::random::Random;

/// Depth of the houses behind their façade, metres.
pub(super) const HOUSE_DEPTH: f64 = 12.0;
/// Ground in front of a façade, to the middle of the street, metres.
pub(super) const HALF_STREET: f64 = 7.0;

/// Where a block is in the city.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BlockPlacement {
    /// Where the block's local origin (left end of the façade, street line, ground) stands, whole
    /// metres from the city's corner.
    pub(super) corner: [i64; 2],
    /// Quarter turns counter-clockwise: 0 looks to −y, 1 to +x, 2 to +y, 3 to −x.
    pub(super) turns: u8,
    /// Length of the façade, whole metres, 60–120.
    pub(super) length: f64,
    /// How far the ground reaches past both ends of the façade, metres.
    pub(super) ground_overhang: f64,
}

/// The placements of `blocks` façade rows.
pub(super) fn placements(seed: u64, blocks: usize) -> Vec<BlockPlacement> {
    let cells = blocks.div_ceil(4);
    let columns = (1..).find(|n| n * n >= cells).unwrap_or(1);
    let rows = cells.div_ceil(columns);
    let mut random = Random::new(seed, 0);
    let mut sides = |count: usize| {
        let mut start = HALF_STREET as i64;
        let mut cells = Vec::with_capacity(count);
        for _ in 0..count {
            let side = i64::from(random.whole(84, 120));
            cells.push((start, side));
            start += side + 2 * HALF_STREET as i64;
        }
        cells
    };
    let (across, along) = (sides(columns), sides(rows));
    let depth = HOUSE_DEPTH as i64;
    (0..blocks)
        .map(|index| {
            let (x, width) = across[(index / 4) % columns];
            let (y, height) = along[(index / 4) / columns];
            // Rows 0 and 2 take the corners of the city block, rows 1 and 3 stand between them.
            let (corner, length) = match index % 4 {
                0 => ([x, y], width),
                1 => ([x + width, y + depth], height - 2 * depth),
                2 => ([x + width, y + height], width),
                _ => ([x, y + height - depth], height - 2 * depth),
            };
            let is_long = index % 2 == 0;
            BlockPlacement {
                corner,
                turns: (index % 4) as u8,
                length: length as f64,
                ground_overhang: if is_long { HALF_STREET } else { HOUSE_DEPTH },
            }
        })
        .collect()
}

/// Turns a horizontal vector by quarter turns, exactly.
pub(super) fn turn<T: Copy + std::ops::Neg<Output = T>>(turns: u8, [x, y]: [T; 2]) -> [T; 2] {
    match turns % 4 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_the_promised_length_and_do_not_overlap() {
        let placements = placements(5, 70);
        assert_eq!(placements.len(), 70);
        // Footprints as integer boxes: corner, corner + turned (length, depth).
        let boxes: Vec<[[i64; 2]; 2]> = placements
            .iter()
            .map(|placement| {
                assert!((60.0..=120.0).contains(&placement.length), "{}", placement.length);
                let far = turn(placement.turns, [placement.length as i64, HOUSE_DEPTH as i64]);
                let end = [placement.corner[0] + far[0], placement.corner[1] + far[1]];
                [0, 1].map(|axis| {
                    let (a, b) = (placement.corner[axis], end[axis]);
                    [a.min(b), a.max(b)]
                })
            })
            .collect();
        for (i, a) in boxes.iter().enumerate() {
            for b in &boxes[..i] {
                let overlaps =
                    (0..2).all(|axis| a[axis][0] < b[axis][1] && b[axis][0] < a[axis][1]);
                assert!(!overlaps, "{a:?} {b:?}");
            }
        }
    }
}
