//! Recognises time stamps that are not in seconds.

/// A median step between stamps of at most this many seconds is taken as it is.
const LONGEST_STEP_S: f64 = 5.0;

/// Stamps in a finer unit are whole numbers or nearly so. A path of which at least a tenth of the
/// steps is below one is in seconds, however long its other steps are.
const LEAST_STEP: f64 = 1.0;

/// A stamp from here on is no number of seconds since 1970: it would be in the year 5138.
const LATEST_EPOCH_S: f64 = 1e11;

/// A unit finer than seconds.
struct Unit {
    name: &'static str,
    /// Steps between two frames of a path that is recorded in this unit: at most 250 frames a
    /// second, at least one.
    steps: std::ops::RangeInclusive<f64>,
}

const UNITS: [Unit; 3] = [
    Unit { name: "milliseconds", steps: 4.0..=1e3 },
    Unit { name: "microseconds", steps: 4e3..=1e6 },
    Unit { name: "nanoseconds", steps: 4e6..=1e9 },
];

/// The first stamp that cannot be in seconds.
#[derive(Debug, PartialEq)]
pub(super) struct WrongUnit {
    /// Index of its row.
    pub row: usize,
    /// What was found and what it looks like, for a message.
    pub found: String,
}

/// Refuses stamps, in ascending order, that are not in seconds. The origin of the stamps is free.
///
/// Steps that are too long for a frame and fit none of the finer units are gaps in a recording,
/// and pass.
pub(super) fn check_seconds(stamps: &[f64]) -> Result<(), WrongUnit> {
    let first = stamps.first().copied().unwrap_or(0.0);
    if first.abs() >= LATEST_EPOCH_S {
        // Today is 1.8e12 ms, 1.8e15 µs or 1.8e18 ns after 1970.
        let unit = match first.abs() {
            ..1e14 => &UNITS[0],
            ..1e17 => &UNITS[1],
            _ => &UNITS[2],
        };
        return Err(WrongUnit {
            row: 0,
            found: format!("{first}: this looks like {unit} since 1970"),
        });
    }
    let mut steps: Vec<f64> =
        stamps.windows(2).map(|pair| pair[1] - pair[0]).filter(|&step| step > 0.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    // A single step may be a gap.
    if steps.len() < 2 || steps[steps.len() / 10] < LEAST_STEP {
        return Ok(());
    }
    let median = steps[(steps.len() - 1) / 2];
    let unit = UNITS.iter().find(|unit| median > LONGEST_STEP_S && unit.steps.contains(&median));
    let row = stamps.windows(2).position(|pair| pair[1] > pair[0]).map_or(0, |before| before + 1);
    match unit {
        Some(unit) => Err(WrongUnit {
            row,
            found: format!("{} after {}: these look like {unit}", stamps[row], stamps[row - 1]),
        }),
        None => Ok(()),
    }
}

impl std::fmt::Display for Unit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(stamps: &[f64]) -> Option<(usize, String)> {
        check_seconds(stamps).err().map(|wrong| (wrong.row, wrong.found))
    }

    /// `count` stamps from `first` on, `step` apart.
    fn regular(first: f64, step: f64, count: usize) -> Vec<f64> {
        (0..count).map(|index| first + step * index as f64).collect()
    }

    #[test]
    fn stamps_of_any_frame_rate_in_a_finer_unit_are_recognised() {
        for unit in &UNITS {
            for fps in [1.0, 10.0, 23.976, 30.0, 60.0, 144.0] {
                let step = unit.steps.end() / fps;
                for first in [0.0, 5.5 * step] {
                    let (row, what) = found(&regular(first, step, 5)).expect("refused");
                    assert!(row == 1 && what.ends_with(unit.name), "{fps} {what}");
                }
                let (row, what) = found(&regular(1.75e9 * unit.steps.end(), step, 2)).unwrap();
                assert!(row == 0 && what.contains(unit.name) && what.contains("1970"), "{what}");
            }
        }
    }

    #[test]
    fn jitter_and_repeated_stamps_do_not_hide_the_unit() {
        let (row, what) = found(&[0.0, 0.0, 16.0, 17.0, 33.0, 33.0, 50.0]).unwrap();
        assert_eq!((row, what.as_str()), (2, "16 after 0: these look like milliseconds"));
        // A pause within a recording in milliseconds.
        assert!(found(&[0.0, 33.0, 66.0, 3_600_066.0, 3_600_099.0]).is_some());
    }

    #[test]
    fn seconds_pass_from_any_origin_and_with_any_gaps() {
        for fps in [0.2, 1.0, 30.0, 1000.0] {
            for first in [0.0, -7.0, 1.75e9] {
                assert_eq!(found(&regular(first, 1.0 / fps, 50)), None, "{fps} {first}");
            }
        }
        for stamps in [
            &[][..],
            &[3.0],
            &[0.0; 9],
            &[0.0, 3600.0],
            &[0.0, 60.0],
            &[0.0, 0.033, 3600.0],
            &[0.0, 3600.0, 7200.0, 10_800.0],
            &[0.0, 0.033, 60.0, 120.0, 180.0],
        ] {
            assert_eq!(found(stamps), None, "{stamps:?}");
        }
    }
}
