//! Camera paths with odd times, odd angles, or without the scene in view.

use std::fs;
use std::time::{Duration, Instant};

use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;

use crate::bench_support::{Place, city};

const INPUT: i32 = 3;

/// A path as its rows, to be changed.
struct Rows(Vec<Vec<String>>);

impl Rows {
    fn read(place: &Place, name: &str) -> Self {
        let text = fs::read_to_string(place.path().join(name)).unwrap();
        Self(text.lines().map(|line| line.split(',').map(String::from).collect()).collect())
    }

    /// Writes the first `frames` rows, each changed by its index.
    fn write(
        &self,
        place: &Place,
        name: &str,
        frames: usize,
        change: impl Fn(usize, &mut [String]),
    ) {
        let mut rows = self.0[..=frames].to_vec();
        rows[1..].iter_mut().enumerate().for_each(|(index, row)| change(index, row));
        let lines: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
        fs::write(place.path().join(name), lines.join("\n") + "\n").unwrap();
    }
}

const TIME: usize = 1;
const POSITION: std::ops::Range<usize> = 2..5;
const FOV: usize = 9;

fn model(place: &Place, path: &str, out: &str) -> assert_cmd::assert::Assert {
    place.bench(&["out", path, "-q", "--clock", "model", "--out", out])
}

#[test]
fn stamps_that_are_not_seconds_are_refused_with_line_and_unit() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    for (scale, first, unit, line) in [
        (1e3, 0.0, "milliseconds", 3),
        (1e3, 1_732_896_000_000.0, "milliseconds", 2),
        (1e6, 0.0, "microseconds", 3),
        (1e9, 5e9, "nanoseconds", 3),
    ] {
        rows.write(&place, "unit.csv", 6, |index, row| {
            row[TIME] = (first + (index as f64 * scale / 30.0).round()).to_string();
        });
        let line = format!("unit.csv: line {line}: column 2 (time_s): expected seconds");
        model(&place, "unit.csv", "r").code(INPUT).stderr(contains(line).and(contains(unit)));
    }
    // Seconds since 1970.
    rows.write(&place, "epoch.csv", 6, |index, row| {
        row[TIME] = (1_732_896_000.0 + index as f64 / 30.0).to_string();
    });
    model(&place, "epoch.csv", "r").success().stderr("");
}

#[test]
fn gaps_are_played_as_a_second_by_both_clocks() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    for (name, gap_s) in [("hour.csv", 3600.0), ("day.csv", 86_400.0)] {
        rows.write(&place, name, 4, |index, row| {
            row[TIME] = [0.0, 0.03, gap_s, 2.0 * gap_s + 1.0][index].to_string();
        });
    }
    let told = || contains("2 of 3 gaps").and(contains("played as 1 s")).and(contains("3601 s"));
    model(&place, "hour.csv", "model").success().stderr(told());
    // Gaps of other lengths are played alike.
    model(&place, "day.csv", "day").success();
    let played = |out: &str| place.frames(out).column("read_bytes");
    assert_eq!(played("model"), played("day"));
    let begin = Instant::now();
    place
        .bench(&["out", "hour.csv", "--size", "64x36", "--out", "wall"])
        .stderr(told().or(contains("adapter")));
    assert!(begin.elapsed() < Duration::from_secs(300), "it slept through a gap");
}

#[test]
fn stamps_that_are_all_equal_are_played_at_a_fixed_rate() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    for (name, stamp) in [("zero", "0"), ("five", "5")] {
        let file = format!("{name}.csv");
        rows.write(&place, &file, 30, |_, row| row[TIME] = stamp.into());
        let told = contains("all 30 time stamps are equal").and(contains("30 frames a second"));
        model(&place, &file, name).success().stderr(told);
    }
    let times = place.frames("five").column("time_s");
    assert!((times[0], times[29]) == (5.0, 5.0 + 29.0 / 30.0), "{times:?}");
    // As the path that has these times.
    model(&place, "fly.csv", "timed").success().stderr("");
    for column in ["time_s", "toggles_up", "toggles_down", "read_bytes", "frame_ms"] {
        let [zero, timed] = ["zero", "timed"].map(|out| place.frames(out).column(column));
        assert_eq!(zero, timed, "{column}");
    }
}

#[test]
fn angles_in_radians_are_warned_of() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    rows.write(&place, "radians.csv", 5, |_, row| row[FOV] = "1.047".into());
    model(&place, "radians.csv", "r")
        .stderr(contains("fov_y_deg is 1.047").and(contains("radians")).and(contains("60.0")));
    // A telephoto lens now and then is none.
    rows.write(&place, "zoom.csv", 5, |index, row| {
        row[FOV] = if index == 2 { "2" } else { "60" }.into();
    });
    model(&place, "zoom.csv", "r").success().stderr("");
}

#[test]
fn a_path_that_never_shows_the_scene_is_refused() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    for (x, y, z) in [(4_135_000.0, 835_000.0, 4_769_000.0), (1e7, 1e7, 1e7), (-1e9, 0.0, 50.0)] {
        rows.write(&place, "far.csv", 5, |_, row| {
            for (field, value) in row[POSITION].iter_mut().zip([x, y, z]) {
                *field = f64::to_string(&value);
            }
        });
        let told = contains("far.csv: no frame shows the scene: the scene lies between")
            .and(contains(format!("the camera of frame 0 is at ({x:.2}, {y:.2}, {z:.2})")));
        model(&place, "far.csv", "far").code(INPUT).stderr(told);
        assert!(!place.path().join("far").exists());
    }
}

#[test]
fn frames_without_the_scene_are_counted_and_left_out_of_means() {
    let place = Place::new(city());
    let rows = Rows::read(&place, "fly.csv");
    let away = |row: &mut [String]| row[POSITION.start] = "1e7".into();
    for (name, shown, is_told) in [("some", 20, false), ("few", 10, true)] {
        let file = format!("{name}.csv");
        rows.write(&place, &file, 30, |index, row| {
            if index >= shown {
                away(row);
            }
        });
        let done = model(&place, &file, name).success();
        let told = contains(format!("{} of 30 frames do not show the scene", 30 - shown));
        if is_told {
            done.stderr(told);
        } else {
            done.stderr("");
        }
        let (frames, summary) = (place.frames(name), place.summary(name));
        let outside = frames.column("without_scene");
        assert_eq!(outside.iter().sum::<f64>(), (30 - shown) as f64);
        assert_eq!(summary["frames"], 30);
        assert_eq!(summary["frames_without_scene"], 30 - shown);
        for (key, column, scale) in
            [("/utilisation", "actual_ms", 30.0), ("/frame_ms/mean", "frame_ms", 1.0)]
        {
            let of_shown = frames.column(column)[..shown].iter().sum::<f64>() / shown as f64;
            let found = summary.pointer(key).unwrap().as_f64().unwrap();
            assert!((found - of_shown / scale).abs() < 1e-9 * of_shown, "{key}: {found}");
        }
    }
    // The same frames in front of it give the same means.
    rows.write(&place, "shown.csv", 20, |_, _| {});
    model(&place, "shown.csv", "shown").success();
    let [some, shown] = ["some", "shown"].map(|name| place.summary(name));
    assert_eq!(some["utilisation"], shown["utilisation"]);
    assert_eq!(shown["frames_without_scene"], 0);
}
