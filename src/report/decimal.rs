//! Single-precision numbers in JSON.

/// The number with the fewest decimals that rounds to `value`: JSON writers widen an f32 to f64,
/// and show digits that it never had.
pub fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_added_and_nothing_lost() {
        assert_eq!(serde_json::json!([shortest(0.6), shortest(0.05)]).to_string(), "[0.6,0.05]");
        for value in [0.1, -1.0 / 3.0, 1e-30, f32::MAX, f32::MIN_POSITIVE, -0.0] {
            assert_eq!(shortest(value) as f32, value);
        }
    }
}
