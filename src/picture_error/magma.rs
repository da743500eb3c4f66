//! Colours for differences.

/// Every eighth of matplotlib's `magma` (CC0), which FLIP's authors show differences in.
const STOPS: [[u8; 3]; 9] = [
    [0, 0, 4],
    [28, 16, 68],
    [79, 18, 123],
    [129, 37, 129],
    [181, 54, 122],
    [229, 80, 100],
    [251, 135, 97],
    [254, 194, 135],
    [252, 253, 191],
];

/// The colour of a value from 0 to 1; what is beyond, or no number, is as its nearest end.
pub(super) fn magma(value: f32) -> [u8; 3] {
    let place = value.clamp(0.0, 1.0) * (STOPS.len() - 1) as f32;
    let from = (place as usize).min(STOPS.len() - 2);
    let part = place - from as f32;
    std::array::from_fn(|i| {
        let [low, high] = [STOPS[from][i], STOPS[from + 1][i]].map(f32::from);
        (low + part * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_go_from_black_to_bright_and_stay_within() {
        assert_eq!([magma(0.0), magma(1.0), magma(0.5)], [STOPS[0], STOPS[8], STOPS[4]]);
        assert_eq!([magma(-1.0), magma(7.0)], [STOPS[0], STOPS[8]]);
        let light = |value: f32| magma(value).map(u32::from).iter().sum::<u32>();
        let steps: Vec<u32> = (0..=100).map(|i| light(i as f32 / 100.0)).collect();
        assert!(steps.is_sorted(), "{steps:?}");
    }
}
