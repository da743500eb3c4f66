use clap::Parser;
use serde_json::{Value, json};

use super::*;
use crate::bench::SUMMARY_VERSION;

fn summary() -> Value {
    json!({
        "format_version": SUMMARY_VERSION,
        "scene_fingerprint": "5ce9e",
        "path_fingerprint": "9a74",
        "policy": "lakhia",
        "clock": "model",
        "parameters": {
            "target_ms": 30.0,
            "selection": { "time": { "fixed_ms": 9.0 } },
            "size": [1280, 720],
        },
        "clock_constants": { "fixed_ms": 9.0 },
        "adapter": null,
        "frames": 100,
        "toggles": { "up": 6, "down": 4, "longest_run": 2 },
        "frame_ms": { "mean": 20.0, "p50": 19.0, "p95": 30.0, "p99": 33.0 },
        "over_target_share": 0.05,
        "late_share": 0.01,
        "utilisation": 0.7,
        "estimate_error_percent": { "mean": -2.0, "sd": 3.0 },
        "memory": { "peak_bytes": 100 << 20 },
        "loading": { "read_bytes": 5000, "evictions": 0 },
        "select_ms": { "mean": 0.1 },
        "visited_mean": 50.5,
        "nodes_mean": 40.0,
        "triangles_mean": 30000.0,
    })
}

fn file(name: &str, value: Value) -> SummaryFile {
    SummaryFile { path: name.into(), value }
}

/// A summary in which something stands elsewhere.
fn with(key: &str, value: Value) -> SummaryFile {
    let mut summary = summary();
    *summary.pointer_mut(key).unwrap() = value;
    file("new.json", summary)
}

fn limits(arguments: &[&str]) -> Limits {
    #[derive(Parser)]
    struct Command {
        #[command(flatten)]
        limits: Limits,
    }
    Command::try_parse_from([&["compare"], arguments].concat()).unwrap().limits
}

fn check(new: &SummaryFile, arguments: &[&str]) -> Comparison {
    compare(&file("base.json", summary()), new, &limits(arguments), false).unwrap()
}

fn exceeded(new: &SummaryFile, arguments: &[&str]) -> Vec<&'static str> {
    let rows = check(new, arguments).rows;
    rows.into_iter().filter(|row| row.exceeded).map(|row| row.metric).collect()
}

#[test]
fn the_same_run_exceeds_nothing_even_where_nothing_may_rise() {
    let same = file("new.json", summary());
    let of_all = METRICS.iter().filter(|metric| !metric.optional);
    let all: Vec<String> = of_all.map(|metric| format!("--max={}=+0", metric.name)).collect();
    let all: Vec<&str> = all.iter().map(String::as_str).collect();
    let comparison = check(&same, &all);
    assert!(!comparison.exceeded());
    assert_eq!(comparison.rows.iter().filter(|row| row.limit.is_some()).count(), all.len());
    assert!(comparison.rows.iter().all(|row| row.change_percent() == Some(0.0)));
}

#[test]
fn each_limit_judges_its_own_figure_and_holds_up_to_itself() {
    let cases = [
        ("toggles=+2", "/toggles/down", json!(6), json!(7)),
        ("toggles=+20%", "/toggles/up", json!(8), json!(9)),
        ("toggles=12", "/toggles/up", json!(8), json!(9)),
        ("longest-toggle-run=+1", "/toggles/longest_run", json!(3), json!(4)),
        ("frame-time-mean=+5%", "/frame_ms/mean", json!(21.0), json!(21.1)),
        ("frame-time-p95=+0.5ms", "/frame_ms/p95", json!(30.5), json!(30.6)),
        ("frame-time-p95=33ms", "/frame_ms/p95", json!(33.0), json!(33.1)),
        ("frame-time-p99=+1ms", "/frame_ms/p99", json!(34.0), json!(34.1)),
        ("over-target=+2pp", "/over_target_share", json!(0.07), json!(0.08)),
        ("late=+100%", "/late_share", json!(0.02), json!(0.03)),
        ("late=2%", "/late_share", json!(0.02), json!(0.03)),
        // In either direction.
        ("estimate-error=+0.5pp", "/estimate_error_percent/mean", json!(2.5), json!(2.6)),
        ("estimate-deviation=+10%", "/estimate_error_percent/sd", json!(3.3), json!(3.4)),
        ("peak-memory=+10MiB", "/memory/peak_bytes", json!(110 << 20), json!((110 << 20) + 1)),
        ("bytes-read=+1kB", "/loading/read_bytes", json!(6000), json!(6001)),
        ("evictions=+5%", "/loading/evictions", json!(0), json!(1)),
        ("selection=+20us", "/select_ms/mean", json!(0.12), json!(0.121)),
        ("nodes-visited=+1", "/visited_mean", json!(51.5), json!(51.6)),
    ];
    for (limit, key, at_the_limit, above) in cases {
        let (metric, _) = limit.split_once('=').unwrap();
        let limit = ["--max", limit];
        assert!(exceeded(&with(key, at_the_limit), &limit).is_empty(), "{limit:?}");
        assert_eq!(exceeded(&with(key, above.clone()), &limit), [metric], "{limit:?}");
        assert!(exceeded(&with(key, above), &[]).is_empty(), "{key} without a limit");
    }
}

#[test]
fn files_that_either_run_could_not_use_exceed_a_limit_of_their_own() {
    let with_broken = |names: &[&str]| {
        let mut summary = summary();
        summary["broken_files"] = json!(names);
        file("some.json", summary)
    };
    let compared = |base: &[&str], new: &[&str], arguments: &[&str]| {
        compare(&with_broken(base), &with_broken(new), &limits(arguments), false).unwrap()
    };
    let none = compared(&[], &[], &[]);
    assert!(!none.exceeded() && none.text().contains("broken-files"), "{}", none.text());
    for (base, new) in [(&[][..], &["a"][..]), (&["a"], &[]), (&["a"], &["a"])] {
        assert!(compared(base, new, &[]).exceeded(), "{base:?} {new:?}");
    }
    let allowed = compared(&["a"], &["a", "b"], &["--max", "broken-files=+1"]);
    assert!(!allowed.exceeded());
}

#[test]
fn runs_of_different_things_are_refused_and_named_unless_forced() {
    let cases = [
        ("/scene_fingerprint", json!("ffff"), r#"scene_fingerprint: "5ce9e" against "ffff""#),
        ("/path_fingerprint", json!("ffff"), r#"path_fingerprint: "9a74" against "ffff""#),
        ("/frames", json!(7), "frames: 100 against 7"),
        ("/policy", json!("other"), r#"policy: "lakhia" against "other""#),
        ("/clock", json!("wall"), r#"clock: "model" against "wall""#),
        ("/parameters/target_ms", json!(16), "parameters.target_ms: 30.0 against 16"),
        ("/parameters/size", json!([1, 2]), "parameters.size: [1280,720] against [1,2]"),
        ("/clock_constants/fixed_ms", json!(1.0), "clock_constants.fixed_ms: 9.0 against 1.0"),
        (
            "/format_version",
            json!(SUMMARY_VERSION + 1),
            "new.json: format_version: this program writes",
        ),
    ];
    let base = file("base.json", summary());
    for (key, value, words) in cases {
        let new = with(key, value);
        let error = compare(&base, &new, &Limits::default(), false).unwrap_err();
        assert!(matches!(error, Error::Usage(_)), "{error}");
        let message = error.to_string();
        assert!(message.contains(words) && message.contains("--force"), "{message}");
        let forced = compare(&base, &new, &Limits::default(), true).unwrap();
        assert!(forced.differences.iter().any(|found| found.contains(words)));
        assert!(forced.text().contains(words), "{}", forced.text());
    }
}

#[test]
fn another_adapter_matters_to_the_clock_on_the_wall_alone() {
    let run = |clock: &str, adapter: Value| {
        let mut file = with("/clock", json!(clock));
        file.value["adapter"] = adapter;
        file
    };
    let refused = |clock| {
        let [base, new] = ["one card", "another"].map(|name| run(clock, json!({ "name": name })));
        compare(&base, &new, &Limits::default(), false).is_err()
    };
    assert!(refused("wall"));
    assert!(!refused("model"));
}

#[test]
fn what_was_measured_at_the_start_does_not_make_runs_differ() {
    let run = |ms: f64| {
        let mut file = with("/parameters/selection/time/fixed_ms", json!(ms));
        file.value["clock"] = json!("wall");
        file
    };
    let comparison = compare(&run(9.0), &run(9.1), &Limits::default(), false).unwrap();
    assert!(comparison.differences.is_empty());
}

#[test]
fn a_missing_or_foreign_figure_names_file_and_key() {
    let base = file("base.json", summary());
    for key in ["/toggles/up", "/frame_ms/p95", "/memory/peak_bytes", "/scene_fingerprint"] {
        let mut new = summary();
        let (parent, leaf) = key.rsplit_once('/').unwrap();
        new.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(leaf);
        let new = file("new.json", new);
        for (base, new) in [(&base, &new), (&new, &base)] {
            let error = compare(base, new, &Limits::default(), true).unwrap_err();
            assert!(matches!(error, Error::Input { .. }), "{error}");
            let message = error.to_string();
            let name = key[1..].replace('/', ".");
            assert!(message.starts_with(&format!("new.json: {name}: ")), "{message}");
        }
    }
    let error = compare(&base, &with("/visited_mean", json!("many")), &Limits::default(), false);
    let message = error.unwrap_err().to_string();
    assert!(message.contains(r#"visited_mean: expected a number, found "many""#), "{message}");
}

#[test]
fn files_that_are_no_summary_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("summary.json");
    for (content, words) in [
        ("", "expected a summary in JSON"),
        ("{\"frames\": 1", "expected a summary in JSON"),
        ("[1, 2]", "format_version: found nothing"),
        ("{\"name\": \"package\"}", "format_version: found nothing"),
    ] {
        std::fs::write(&path, content).unwrap();
        let error = SummaryFile::read(&path).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let message = error.to_string();
        assert!(message.contains(words) && message.contains("summary.json"), "{message}");
    }
    assert_eq!(SummaryFile::read(&dir.path().join("none")).unwrap_err().exit_code(), 3);
    std::fs::write(&path, summary().to_string()).unwrap();
    assert_eq!(SummaryFile::read(&path).unwrap().value, summary());
}

#[test]
fn a_figure_that_is_no_number_exceeds_its_limit_and_is_shown_as_missing() {
    let new = with("/frame_ms/p95", Value::Null);
    assert!(exceeded(&new, &[]).is_empty());
    assert_eq!(exceeded(&new, &["--max=frame-time-p95=+50%"]), ["frame-time-p95"]);
    let comparison = check(&new, &[]);
    assert!(!comparison.text().contains("NaN"), "{}", comparison.text());
    let row = &comparison.to_json()["metrics"][6];
    assert_eq!((&row["metric"], &row["new"]), (&json!("frame-time-p95"), &Value::Null));
    assert_eq!(row["change_percent"], Value::Null);
}

#[test]
fn the_table_shows_change_limit_and_verdict() {
    let new = with("/toggles/up", json!(9));
    let comparison = check(&new, &["--max", "toggles=+20%", "--max", "peak-memory=+1MiB"]);
    let text = comparison.text();
    let line = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap();
    let words: Vec<&str> = line("toggles ").split_whitespace().collect();
    assert_eq!(words, ["toggles", "10", "13", "+3", "+30.0", "%", "+20%", "EXCEEDED"]);
    assert!(line("peak-memory").ends_with("+0.0 %  +1MiB"), "{text}");
    // From nothing to something is no percentage.
    let evictions = check(&with("/loading/evictions", json!(4)), &[]);
    assert!(
        evictions
            .text()
            .lines()
            .any(|line| { line.split_whitespace().eq(["evictions", "0", "4", "+4", "-"]) })
    );
    let json = comparison.to_json();
    assert_eq!(json["exceeded"], true);
    assert_eq!(json["metrics"][0]["change_percent"], 30.0);
    assert_eq!(json["metrics"][0]["limit"], "+20%");
}

#[test]
fn a_limit_that_is_none_is_a_mistake_in_the_arguments() {
    #[derive(Debug, Parser)]
    struct Command {
        #[command(flatten)]
        limits: Limits,
    }
    for argument in ["frame-time-p95=3", "toggles=3ms", "peak-memory=x", "late=+x"] {
        let error = Command::try_parse_from(["compare", "--max", argument]).unwrap_err();
        let error = error.to_string();
        assert!(error.contains("expected the most that it may be"), "{error}");
    }
}

#[test]
fn of_several_limits_of_one_figure_each_counts() {
    let new = with("/frame_ms/p95", json!(32.0));
    let both = ["--max=frame-time-p95=33ms", "--max=frame-time-p95=+1ms"];
    let row = check(&new, &both).rows.into_iter().find(|row| row.exceeded).unwrap();
    assert_eq!(row.limit.as_deref(), Some("+1ms, 33ms"));
    assert_eq!(exceeded(&new, &both[..1]), [""; 0]);
}

/// A run that was compared with the leaves.
fn with_pictures(every: u64, flip: f64, gaps: u64) -> SummaryFile {
    let mut file = file("new.json", summary());
    file.value["accuracy"] = json!({
        "every": every,
        "adapter": { "name": "llvmpipe" },
        "flip_mean": { "mean": flip },
        "flip_p95": { "mean": 0.1 },
        "gap_pixels": { "sum": gaps },
        "inner_gap_pixels": { "sum": 0 },
        "pop_flip": null,
    });
    file
}

#[test]
fn accuracy_is_judged_where_there_is_any_and_missed_where_it_is_asked_for() {
    let check = |base: &SummaryFile, new: &SummaryFile, arguments: &[&str]| {
        let comparison = compare(base, new, &limits(arguments), false).unwrap();
        let rows = comparison.rows.into_iter().filter(|row| row.exceeded);
        rows.map(|row| row.metric).collect::<Vec<_>>()
    };
    let (base, same) = (with_pictures(10, 0.02, 5), with_pictures(10, 0.02, 5));
    let worse = with_pictures(10, 0.0211, 6);
    let all = ["--max=flip=+5%", "--max=gap-pixels=+0"];
    assert!(check(&base, &same, &all).is_empty());
    assert_eq!(check(&base, &worse, &all), ["flip", "gap-pixels"]);
    assert!(check(&base, &worse, &["--max=flip=+0.0011"]).is_empty());
    assert_eq!(check(&base, &worse, &["--max=flip=+0.001"]), ["flip"]);
    // A run without, against one with, and two without.
    let without = file("base.json", summary());
    assert_eq!(check(&without, &same, &all), ["flip", "gap-pixels"]);
    assert_eq!(check(&without, &without, &["--max=flip=+1"]), ["flip"]);
    let plain = compare(&without, &without, &Limits::default(), false).unwrap();
    assert!(plain.rows.iter().all(|row| row.unit != Unit::Flip));
    let text = compare(&base, &worse, &Limits::default(), false).unwrap().text();
    assert!(text.contains("0.02110") && !text.contains("flip-of-toggles"), "{text}");
    let other = with_pictures(20, 0.02, 5);
    let refused = compare(&base, &other, &Limits::default(), false).unwrap_err().to_string();
    assert!(refused.contains("accuracy.every: 10 against 20"), "{refused}");
}
