//! Pixels under triangles of (x, y, parallax).

/// A part of one pixel's width that a pixel's middle may be outside of a triangle that it is in.
const EDGE: f64 = 1e-9;

/// Calls `pixel` with column, row and parallax for every pixel of a picture whose middle is in a triangle.
pub(super) fn triangle(
    corners: [[f32; 3]; 3],
    size: [usize; 2],
    mut pixel: impl FnMut(isize, isize, f32),
) {
    let [a, b, c] = corners.map(|at| at.map(f64::from));
    let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if twice == 0.0 {
        return;
    }
    let [low, high] = [[a, b, c].map(|at| at[1]), [a, b, c].map(|at| at[1])];
    let low = low.into_iter().fold(f64::INFINITY, f64::min);
    let high = high.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let first = (low - 0.5 - EDGE).ceil().max(0.0) as usize;
    let end = ((high - 0.5 + EDGE).floor() + 1.0).clamp(0.0, size[1] as f64) as usize;
    // The weight of a corner is linear along a row: `at the row's beginning + slope × column`.
    let weights = |y: f64| {
        [(b, c), (c, a), (a, b)].map(|(from, to)| {
            let slope = -(to[1] - from[1]) / twice;
            let begin = ((to[0] - from[0]) * (y - from[1]) + (to[1] - from[1]) * from[0]) / twice;
            [begin, slope]
        })
    };
    for row in first..end {
        let weights = weights(row as f64 + 0.5);
        let (mut from, mut to) = (0.5, size[0] as f64 - 0.5);
        for [begin, slope] in weights {
            match slope {
                slope if slope > 0.0 => from = f64::max(from, (-begin - EDGE) / slope),
                slope if slope < 0.0 => to = f64::min(to, (-begin - EDGE) / slope),
                _ if begin < -EDGE => to = f64::NEG_INFINITY,
                _ => {}
            }
        }
        let mut column = (from - 0.5).ceil();
        while column + 0.5 <= to {
            let parallax: f64 = weights
                .iter()
                .zip([a, b, c])
                .map(|([begin, slope], corner)| (begin + slope * (column + 0.5)) * corner[2])
                .sum();
            pixel(column as isize, row as isize, parallax as f32);
            column += 1.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_drawn_over_the_middles_of_pixels_in_it() {
        let mut pixels = Vec::new();
        let corners = [[0.0, 0.0, 1.0], [4.0, 0.0, 1.0], [0.0, 4.0, 5.0]];
        for corners in [corners, [corners[0], corners[2], corners[1]]] {
            pixels.clear();
            triangle(corners, [3, 9], |x, y, parallax| pixels.push(([x, y], parallax)));
            // Those on the edge as well; none beyond the picture.
            let expected = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1], [0, 2], [1, 2], [0, 3]];
            assert_eq!(pixels.iter().map(|at| at.0).collect::<Vec<_>>(), expected);
            for &([_, y], parallax) in &pixels {
                assert!((parallax - (y as f32 + 1.5)).abs() < 1e-6, "{parallax}");
            }
        }
    }
}
