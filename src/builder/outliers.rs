//! Setting aside the few triangles that lie so far off that they would cost the rest its digits.
//!
//! A block's coordinates are f32 offsets, so its extent decides how fine they are. One stray
//! triangle at 1e8 m would leave a city block a lattice of several metres. Such triangles become a
//! block of their own, on a lattice of its own; nothing is lost.

use crate::builder::partition::CellBox;
use crate::mesh::Part;

/// Steps over a block's extent; see [`crate::lattice`].
const STEPS: f64 = 8_388_608.0;
/// The median edge must have at least this many lattice steps, or strays are looked for.
const STEPS_PER_EDGE: f64 = 500.0;
/// The share of triangles at either end of an axis that may be strays.
const TAIL: f64 = 0.005;

/// Splits off what lies far outside of the box that holds nearly all triangles. `None` where
/// there is nothing to split off, or the block is fine enough with it.
pub fn set_outliers_aside(parts: &[Part]) -> Option<(Vec<Part>, Vec<Part>)> {
    let corners = || {
        parts.iter().flat_map(|part| {
            part.indices.as_chunks::<3>().0.iter().map(|t| t.map(|v| part.positions[v as usize]))
        })
    };
    let CellBox { mut low, mut high } = CellBox::around(corners().flatten());
    let fine = longest_side(low, high) / STEPS * STEPS_PER_EDGE;
    let (mut count, mut shorter) = (0, 0);
    for [a, b, _] in corners() {
        count += 1;
        shorter += usize::from(longest_side(a, b) < fine);
    }
    // The median edge, that of place `count / 2`, is long enough.
    if count < 2 || shorter <= count / 2 {
        return None;
    }
    // The box of nearly all triangles, and as much again on every side.
    let tail = ((count as f64 * TAIL) as usize).max(1).min((count - 1) / 2);
    let mut reach = 0f64;
    for i in 0..3 {
        let mut centres: Vec<f64> =
            corners().map(|t| (t[0][i] + t[1][i] + t[2][i]) / 3.0).collect();
        low[i] = *centres.select_nth_unstable_by(tail, f64::total_cmp).1;
        high[i] = *centres.select_nth_unstable_by(count - 1 - tail, f64::total_cmp).1;
        reach = reach.max(high[i] - low[i]);
    }
    let inside = |position: &[f64; 3]| {
        (0..3).all(|i| position[i] >= low[i] - reach && position[i] <= high[i] + reach)
    };
    let near: Vec<Part> =
        parts.iter().map(|part| subset(part, |t| t.iter().all(&inside))).collect();
    let far: Vec<Part> =
        parts.iter().map(|part| subset(part, |t| !t.iter().all(&inside))).collect();
    let keep = |parts: Vec<Part>| -> Vec<Part> {
        parts.into_iter().filter(|part| !part.indices.is_empty()).collect()
    };
    let (near, far) = (keep(near), keep(far));
    (!near.is_empty() && !far.is_empty()).then_some((near, far))
}

fn longest_side(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max)
}

/// The triangles of a part that `keep` wants, with the vertices that they use.
fn subset(part: &Part, keep: impl Fn(&[[f64; 3]; 3]) -> bool) -> Part {
    let mut result = Part { group: part.group, material: part.material, ..Part::default() };
    let mut new_index = vec![u32::MAX; part.positions.len()];
    for triangle in part.indices.as_chunks::<3>().0 {
        if !keep(&triangle.map(|vertex| part.positions[vertex as usize])) {
            continue;
        }
        for &vertex in triangle {
            let old = vertex as usize;
            if new_index[old] == u32::MAX {
                new_index[old] = result.positions.len() as u32;
                result.positions.push(part.positions[old]);
                result.texcoords.extend(part.texcoords.get(old));
                result.colors.extend(part.colors.get(old));
                result.normals.extend(part.normals.get(old));
            }
            result.indices.push(new_index[old]);
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(count: u32, stray: Option<f64>) -> Part {
        let mut part = Part::default();
        let starts = (0..count).map(|i| f64::from(i) * 0.1).chain(stray);
        for (i, x) in starts.enumerate() {
            part.positions.extend([[x, 0.0, 0.0], [x + 0.1, 0.0, 0.0], [x, 0.1, 0.0]]);
            part.indices.extend((0..3).map(|k| 3 * i as u32 + k));
        }
        part
    }

    #[test]
    fn a_stray_triangle_becomes_a_block_of_its_own() {
        let (near, far) = set_outliers_aside(&[row(2000, Some(1e8))]).expect("has a stray");
        assert_eq!(near[0].indices.len(), 6000);
        assert_eq!((far[0].indices.len(), far[0].positions[0][0]), (3, 1e8));
    }

    #[test]
    fn what_fits_stays_together() {
        assert!(set_outliers_aside(&[row(2000, None)]).is_none());
        assert!(set_outliers_aside(&[row(2000, Some(300.0))]).is_none(), "far, but fine enough");
    }
}
