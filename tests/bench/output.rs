//! Results of an earlier run stay whole until those of a later one are complete.

use std::fs;

use crate::bench_support::{Place, city};
use crate::support::result::{contents, difference};

#[test]
fn a_later_run_replaces_an_earlier_one_and_leaves_the_rest_alone() {
    let place = Place::new(city());
    let run = |target: &str| {
        let options = ["--clock", "model", "--target-ms", target, "--out", "r", "-q"];
        place.bench(&[&["out", "fly.csv"], &options[..]].concat())
    };
    run("30").success();
    fs::write(place.path().join("r/notes.txt"), "mine").unwrap();
    let first = contents(&place.path().join("r"));
    run("30").success();
    assert_eq!(difference(&first, &contents(&place.path().join("r"))), None);
    run("4").success();
    let differ = difference(&first, &contents(&place.path().join("r"))).unwrap();
    assert_eq!(differ, ["frames.csv", "report.html", "summary.json"]);
}

#[test]
fn a_run_that_fails_leaves_the_earlier_result_as_it_was() {
    let place = Place::new(city());
    let run = |path: &str, target: &str| {
        let options = ["--clock", "model", "--target-ms", target, "--out", "r", "-q"];
        place.bench(&[&["out", path], &options[..]].concat())
    };
    run("fly.csv", "30").success();
    let result = place.path().join("r");
    let first = contents(&result);
    fs::write(place.path().join("bad.csv"), "frame,time_s,x,y,z\n0,0,0,0,NaN\n").unwrap();
    run("bad.csv", "30").code(3);
    run("fly.csv", "0").code(2);
    assert_eq!(difference(&first, &contents(&result)), None);
    // The last of the files cannot be placed: none of the others is.
    fs::remove_file(result.join("summary.json")).unwrap();
    fs::create_dir(result.join("summary.json")).unwrap();
    fs::write(result.join("summary.json/kept.txt"), "mine").unwrap();
    let before = contents(&result);
    run("fly.csv", "4").code(4).stderr(predicates::str::contains("summary.json"));
    assert_eq!(difference(&before, &contents(&result)), None);
}
