//! Dividing the triangles of an island into parts that fill their bounding boxes.
//!
//! A plane through a façade leaves strips that lie askew in the source; by its box such a strip
//! takes many times its texels, and shapes of that kind do not interlock either. Cut into parts
//! of compact boxes it packs well, for a few duplicated vertices along the cuts. The cut with the
//! least sum of box areas is found among binned centroids, as bounding volume hierarchies are
//! built (Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007).

use super::charts::UvBox;

/// A cut must reduce the sum of box areas to this part, to be worth its gutters and vertices.
const WORTHWHILE: f64 = 0.95;

/// Candidates for a cut along each axis are the borders of this many bins.
const BINS: usize = 16;

/// Divides `triangles` (indices into `corners`) until no cut pays. `gutter` is added around each
/// box, in the corners' unit.
pub(crate) fn split(corners: &[[[f64; 2]; 3]], triangles: Vec<u32>, gutter: f64) -> Vec<Vec<u32>> {
    let mut parts = Vec::new();
    let mut open = vec![triangles];
    while let Some(triangles) = open.pop() {
        match best_cut(corners, &triangles, gutter) {
            None => parts.push(triangles),
            Some((axis, border)) => {
                let (low, high) = triangles
                    .into_iter()
                    .partition(|t| centre(&corners[*t as usize], axis) < border);
                open.push(high);
                open.push(low);
            }
        }
    }
    parts
}

/// The axis and position of the cut that pays most, if one does.
fn best_cut(corners: &[[[f64; 2]; 3]], triangles: &[u32], gutter: f64) -> Option<(usize, f64)> {
    if triangles.len() < 2 {
        return None;
    }
    let mut whole = UvBox::EMPTY;
    let mut centres = UvBox::EMPTY;
    for triangle in triangles {
        let triangle = &corners[*triangle as usize];
        triangle.iter().for_each(|corner| whole.add(*corner));
        centres.add([centre(triangle, 0), centre(triangle, 1)]);
    }
    let mut best = None;
    let mut least = area(&whole, gutter) * WORTHWHILE;
    for axis in 0..2 {
        let start = centres.min[axis];
        let length = centres.max[axis] - start;
        if length <= 0.0 {
            continue;
        }
        let per_bin = BINS as f64 / length;
        let mut bins = [UvBox::EMPTY; BINS];
        for triangle in triangles {
            let triangle = &corners[*triangle as usize];
            let bin = ((centre(triangle, axis) - start) * per_bin) as usize;
            triangle.iter().for_each(|corner| bins[bin.min(BINS - 1)].add(*corner));
        }
        let mut above = [0.0; BINS];
        let mut high = UvBox::EMPTY;
        for bin in (1..BINS).rev() {
            high.unite(&bins[bin]);
            above[bin] = area(&high, gutter);
        }
        let mut low = UvBox::EMPTY;
        for bin in 1..BINS {
            low.unite(&bins[bin - 1]);
            let sum = area(&low, gutter) + above[bin];
            let border = start + bin as f64 / per_bin;
            // Both sides keep a triangle, whatever rounding does to the border.
            if sum < least && border > centres.min[axis] && border <= centres.max[axis] {
                least = sum;
                best = Some((axis, border));
            }
        }
    }
    best
}

fn centre(triangle: &[[f64; 2]; 3], axis: usize) -> f64 {
    (triangle[0][axis] + triangle[1][axis] + triangle[2][axis]) / 3.0
}

fn area(bounds: &UvBox, gutter: f64) -> f64 {
    if bounds.min[0] > bounds.max[0] {
        return 0.0;
    }
    (bounds.max[0] - bounds.min[0] + gutter) * (bounds.max[1] - bounds.min[1] + gutter)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strip(at: impl Fn(f64) -> [f64; 2]) -> Vec<[[f64; 2]; 3]> {
        (0..400).map(|i| [0.0, 1.0, 2.0].map(|step| at(f64::from(i) + step))).collect()
    }

    #[test]
    fn a_strip_askew_is_cut_and_a_straight_one_is_not() {
        let askew = strip(|at| [at, at + (at * 7.0) % 20.0]);
        let parts = split(&askew, (0..400).collect(), 3.0);
        assert!(parts.len() >= 8, "{}", parts.len());
        let mut all: Vec<u32> = parts.concat();
        all.sort_unstable();
        assert_eq!(all, (0..400).collect::<Vec<u32>>());

        let straight = strip(|at| [at, (at * 7.0) % 20.0]);
        assert_eq!(split(&straight, (0..400).collect(), 3.0).len(), 1);
    }

    #[test]
    fn triangles_on_one_spot_stay_together() {
        let spot = vec![[[5.0, 5.0]; 3]; 50];
        assert_eq!(split(&spot, (0..50).collect(), 3.0).len(), 1);
    }
}
