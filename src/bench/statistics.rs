//! Means, deviations and percentiles.
//!
//! By hand: of the crates for it, `statrs` interpolates percentiles (and needs a newer compiler
//! than this crate) and `average` estimates them, so neither gives a value that some frame had.

/// The mean; 0 of nothing.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0u64);
    for value in values {
        sum += value;
        count += 1;
    }
    if count == 0 { 0.0 } else { sum / count as f64 }
}

/// The standard deviation of a whole, not of a sample; 0 of nothing.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let mean_value = mean(values.iter().copied());
    mean(values.iter().map(|value| (value - mean_value).powi(2))).sqrt()
}

/// The least value that at least `percent` of the values do not exceed (nearest rank); 0 of
/// nothing.
pub(super) fn percentile(values: &[f64], percent: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let rank = (percent / 100.0 * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        let values = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(values), 5.0);
        assert_eq!(deviation(&values), 2.0);
        assert_eq!(
            [0.0, 12.5, 50.0, 51.0, 100.0].map(|p| percentile(&values, p)),
            [2.0, 2.0, 4.0, 5.0, 9.0]
        );
        assert_eq!((mean([]), deviation(&[]), percentile(&[], 50.0)), (0.0, 0.0, 0.0));
    }
}
