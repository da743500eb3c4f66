//! Least squares with factors that are times, and so never below 0.

use glam::{DMat3, DVec3};

/// The factors `f`, none below 0, by which the least `Σ (f · terms − value)²` is reached. A term
/// that never occurs has the factor 0.
///
/// With three terms the seven ways of leaving some of them out are few enough to try all.
pub(super) fn fit(samples: &[([f64; 3], f64)]) -> [f64; 3] {
    let (mut square, mut product) = (DMat3::ZERO, DVec3::ZERO);
    for (terms, value) in samples {
        let terms = DVec3::from(*terms);
        square += DMat3::from_cols(terms * terms.x, terms * terms.y, terms * terms.z);
        product += terms * *value;
    }
    let residual = |factors: DVec3| factors.dot(square * factors) - 2.0 * factors.dot(product);
    let mut best = DVec3::ZERO;
    for mask in 1..8 {
        let used = DVec3::from(std::array::from_fn(|i| f64::from(mask >> i & 1)));
        let Some(factors) = solve(square, product, used) else { continue };
        if factors.min_element() >= 0.0 && residual(factors) < residual(best) {
            best = factors;
        }
    }
    best.to_array()
}

/// The solution of the normal equations in which terms whose `used` is 0 have no part; `None`
/// where they cannot be told apart.
fn solve(square: DMat3, product: DVec3, used: DVec3) -> Option<DVec3> {
    // Scaled to ones on the diagonal, so that units do not matter to the determinant.
    let diagonal = DVec3::new(square.x_axis.x, square.y_axis.y, square.z_axis.z);
    if (0..3).any(|i| used[i] > 0.0 && diagonal[i] <= 0.0) {
        return None;
    }
    let scale = DVec3::from(std::array::from_fn(|i| {
        if used[i] > 0.0 { 1.0 / diagonal[i].sqrt() } else { 0.0 }
    }));
    let picked = DMat3::from_diagonal(scale);
    let matrix = picked * square * picked + DMat3::from_diagonal(DVec3::ONE - used);
    (matrix.determinant() > 1e-12).then(|| scale * (matrix.inverse() * (scale * product)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [[f64; 3]; 5] =
        [[1.0, 2.0, 0.5], [3.0, 1.0, 0.0], [5.0, 7.0, 1.0], [2.0, 2.0, 1.0], [1.0, 0.0, 4.0]];

    fn made(factors: [f64; 3]) -> Vec<([f64; 3], f64)> {
        POINTS.iter().map(|&p| (p, DVec3::from(p).dot(factors.into()))).collect()
    }

    #[test]
    fn factors_are_found_whatever_their_units() {
        let found = fit(&made([0.5, 2.0, 3.0]));
        assert!(DVec3::from(found).abs_diff_eq(DVec3::new(0.5, 2.0, 3.0), 1e-9), "{found:?}");
        let tiny: Vec<_> = made([0.5, 2.0, 3.0])
            .into_iter()
            .map(|([x, y, z], value)| ([x * 1e9, y, z * 1e-6], value))
            .collect();
        let found = fit(&tiny);
        assert!((found[0] / 0.5e-9 - 1.0).abs() < 1e-6 && (found[2] / 3e6 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn no_factor_is_below_zero_and_the_others_make_up_for_it() {
        let samples = made([1.0, -0.2, 0.5]);
        let found = fit(&samples);
        assert!(found.iter().all(|&factor| factor >= 0.0), "{found:?}");
        assert_eq!(found[1], 0.0);
        // No step that is allowed makes it better.
        let error = |factors: [f64; 3]| -> f64 {
            let deviation =
                |(terms, value): &([f64; 3], f64)| DVec3::from(*terms).dot(factors.into()) - value;
            samples.iter().map(|sample| deviation(sample).powi(2)).sum()
        };
        for axis in 0..3 {
            for step in [-1e-3, 1e-3] {
                let mut moved = found;
                moved[axis] += step;
                assert!(moved[axis] < 0.0 || error(moved) > error(found), "{axis} {step}");
            }
        }
    }

    #[test]
    fn terms_that_cannot_be_told_apart_share_no_factors() {
        let alone = fit(&[([2.0, 0.0, 0.0], 3.0), ([4.0, 0.0, 0.0], 6.0)]);
        assert!((alone[0] - 1.5).abs() < 1e-12 && alone[1..] == [0.0; 2], "{alone:?}");
        let twins = fit(&[([1.0, 1.0, 0.0], 2.0), ([3.0, 3.0, 0.0], 6.0)]);
        assert_eq!(twins.iter().filter(|&&factor| factor > 0.0).count(), 1, "{twins:?}");
        assert_eq!(fit(&[]), [0.0; 3]);
    }
}
