//! Least squares whose answers are not negative.

/// Sweeps of coordinate descent; answers of the time before are where they start.
const SWEEPS: usize = 16;

/// Sums over observations from which `N` weights that are not negative are fitted, pulled towards
/// some that are expected.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LeastSquares<const N: usize> {
    expected: [f64; N],
    /// Weight of what is expected.
    prior: f64,
    /// Sum of weight × terms × terms.
    squares: [[f64; N]; N],
    /// Sum of weight × terms × value.
    products: [f64; N],
}

impl<const N: usize> LeastSquares<N> {
    /// No observations; `prior` is what each expected weight counts as, in squares of terms.
    pub fn new(expected: [f64; N], prior: f64) -> Self {
        Self { expected, prior, squares: [[0.0; N]; N], products: [0.0; N] }
    }

    /// Adds an observation after keeping this part of what was there before.
    pub fn observe(&mut self, terms: &[f64; N], value: f64, weight: f64, kept: f64) {
        for (row, (squares, product)) in self.squares.iter_mut().zip(&mut self.products).enumerate()
        {
            for (square, term) in squares.iter_mut().zip(terms) {
                *square = *square * kept + weight * terms[row] * term;
            }
            *product = *product * kept + weight * terms[row] * value;
        }
    }

    /// Moves weights to the best ones, by coordinate descent.
    pub fn fit(&self, weights: &mut [f64; N]) {
        for _ in 0..SWEEPS {
            for at in 0..N {
                let square = self.squares[at][at] + self.prior;
                let others = dot(&self.squares[at], weights) - self.squares[at][at] * weights[at];
                let product = self.products[at] + self.prior * self.expected[at];
                weights[at] = ((product - others) / square).max(0.0);
            }
        }
    }
}

/// The sum of products.
pub(crate) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_that_explain_everything_are_found_and_others_are_not_negative() {
        let mut fit = LeastSquares::new([1.0, 1.0], 1e-9);
        for (terms, value) in [([1.0, 2.0], 8.0), ([2.0, 1.0], 7.0), ([1.0, 1.0], 5.0)] {
            fit.observe(&terms, value, 1.0, 1.0);
        }
        let mut weights = [0.0; 2];
        (0..10).for_each(|_| fit.fit(&mut weights));
        assert!((weights[0] - 2.0).abs() < 1e-6 && (weights[1] - 3.0).abs() < 1e-6, "{weights:?}");
        let mut falling = LeastSquares::new([1.0, 1.0], 1e-9);
        falling.observe(&[1.0, 1.0], 2.0, 1.0, 1.0);
        falling.observe(&[1.0, 2.0], 1.0, 1.0, 1.0);
        (0..10).for_each(|_| falling.fit(&mut weights));
        assert!(weights[1] == 0.0 && (weights[0] - 1.5).abs() < 1e-6, "{weights:?}");
    }

    #[test]
    fn without_observations_weights_are_as_expected() {
        let mut weights = [0.0; 3];
        LeastSquares::new([1.0, 2.0, 3.0], 1.0).fit(&mut weights);
        assert_eq!(weights, [1.0, 2.0, 3.0]);
    }
}
