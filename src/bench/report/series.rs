//! Series over the frames of a run.

use super::plot::Axis;
use crate::bench::FrameRecord;
use crate::bench::statistics::percentile;

/// Frames over which moving averages are taken (thesis figures 6.4 and 6.6).
pub(super) const WINDOW: usize = 35;

/// How far beyond the 99th percentile an axis reaches at most, so that one spike does not make
/// all else flat.
const BEYOND: f64 = 3.0;

/// Where frames stand from left to right.
pub(super) struct Places {
    places: Vec<f64>,
    label: &'static str,
}

impl Places {
    /// By the number of the frame; by its row where numbers do not rise.
    pub(super) fn frames(frames: &[FrameRecord]) -> Self {
        if frames.is_sorted_by(|a, b| a.frame < b.frame) {
            let places = frames.iter().map(|frame| frame.frame as f64).collect();
            return Self { places, label: "frame" };
        }
        Self { places: (0..frames.len()).map(|row| row as f64).collect(), label: "row of the log" }
    }

    /// By the time on the path, as the thesis's figure 6.1 has it; by frame where that does not
    /// rise.
    pub(super) fn seconds(frames: &[FrameRecord]) -> Self {
        if !frames.is_sorted_by(|a, b| a.time_s < b.time_s) {
            return Self::frames(frames);
        }
        let places = frames.iter().map(|frame| frame.time_s).collect();
        Self { places, label: "time on the path, s" }
    }

    /// The axis from the first to the last.
    pub(super) fn axis(&self) -> Axis {
        let end = |place: Option<&f64>| place.copied().unwrap_or(0.0);
        let range = [end(self.places.first()), end(self.places.last())];
        let range = if range[0] == range[1] { [range[0] - 0.5, range[1] + 0.5] } else { range };
        Axis { label: self.label.into(), range }
    }

    /// Values at their places.
    pub(super) fn points(&self, values: &[f64]) -> Vec<[f64; 2]> {
        self.places.iter().zip(values).map(|(&x, &y)| [x, y]).collect()
    }
}

/// A figure of each frame.
pub(super) fn of(frames: &[FrameRecord], value: impl Fn(&FrameRecord) -> f64) -> Vec<f64> {
    frames.iter().map(value).collect()
}

/// The mean of each value and those before it, [`WINDOW`] together.
pub(super) fn moving_average(values: &[f64]) -> Vec<f64> {
    let window = |end: usize| &values[(end + 1).saturating_sub(WINDOW)..=end];
    (0..values.len())
        .map(|end| window(end).iter().sum::<f64>() / window(end).len() as f64)
        .collect()
}

/// A range for values that may have spikes, and how many of them are beyond it. It has all that
/// must be in it.
pub(super) fn range(values: &[f64], must: &[f64]) -> ([f64; 2], usize) {
    let sizes: Vec<f64> = values.iter().filter(|v| v.is_finite()).map(|v| v.abs()).collect();
    let largest = |values: &[f64]| values.iter().fold(0f64, |most, value| most.max(value.abs()));
    let most = (percentile(&sizes, 99.0) * BEYOND).max(largest(must));
    let most = if most > 0.0 { most } else { f64::INFINITY };
    let inside = values.iter().chain(must).filter(|value| value.abs() <= most);
    let (low, high) = inside.fold((0f64, 0f64), |(low, high), &v| (low.min(v), high.max(v)));
    let beyond = sizes.iter().filter(|&&size| size > most).count();
    let low = if values.iter().any(|&v| v < -most) { -most } else { low * 1.05 };
    let high = if values.iter().any(|&v| v > most) { most } else { high * 1.05 };
    (if low == high { [0.0, 1.0] } else { [low, high] }, beyond)
}

/// What a caption says of values beyond the axis.
pub(super) fn beyond(values: &[f64], count: usize, unit: &str) -> String {
    let most = values
        .iter()
        .filter(|v| v.is_finite())
        .fold(0f64, |most, &value| if value.abs() > most.abs() { value } else { most });
    match count {
        0 => String::new(),
        1 => format!(" One frame is beyond the axis, at {most:.1} {unit}."),
        _ => format!(" {count} frames are beyond the axis, the farthest at {most:.1} {unit}."),
    }
}

/// Bytes as a plot shows them: how many are one unit, and its name.
pub(super) fn byte_unit(most: f64) -> (f64, &'static str) {
    const KIB: f64 = 1024.0;
    match most {
        most if most >= 4.0 * KIB * KIB * KIB => (KIB * KIB * KIB, "GiB"),
        most if most >= 2.0 * KIB * KIB => (KIB * KIB, "MiB"),
        most if most >= 4.0 * KIB => (KIB, "KiB"),
        _ => (1.0, "bytes"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_averages_begin_with_what_there_is() {
        let mut values = vec![0.0; 100];
        values[50] = 35.0;
        let averages = moving_average(&values);
        assert_eq!((averages[49], averages[50], averages[84], averages[85]), (0.0, 1.0, 1.0, 0.0));
        assert_eq!(moving_average(&[4.0, 2.0]), [4.0, 3.0]);
        assert!(moving_average(&[]).is_empty());
    }

    #[test]
    fn a_spike_does_not_flatten_the_rest_and_is_told() {
        let mut values = vec![10.0; 1000];
        values[7] = 5000.0;
        let ([low, high], count) = range(&values, &[30.0]);
        assert_eq!((low, high, count), (0.0, 30.0, 1));
        let told = beyond(&values, count, "ms");
        assert_eq!(told, " One frame is beyond the axis, at 5000.0 ms.");
        values[7] = 12.0;
        assert_eq!(range(&values, &[30.0]), ([0.0, 31.5], 0));
    }

    #[test]
    fn ranges_without_values_and_of_zeros_are_not_empty() {
        assert_eq!(range(&[], &[]), ([0.0, 1.0], 0));
        assert_eq!(range(&[0.0, 0.0], &[0.0]), ([0.0, 1.0], 0));
        assert_eq!(range(&[f64::NAN, -2.0], &[]).0, [-2.1, 0.0]);
    }
}
