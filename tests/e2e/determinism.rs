//! The bytes of `out/` depend on inputs and options alone.

use std::fs;
use std::path::{Path, PathBuf};

use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions};
use hlod::builder::simplify::ladder::Simplifier;
use hlod::builder::threads::with_threads;

use crate::support::inputs::{small_city, write_city, write_soup, write_street};
use crate::support::result::{difference, lasting};
use crate::support::{build_with, run_build};

/// Every way to make the tree.
fn ways() -> Vec<HierarchyOptions> {
    let mut ways = Vec::new();
    for simplifier in [Simplifier::Qem, Simplifier::Clustering] {
        for borders in [BorderMode::Locked, BorderMode::Skirts] {
            ways.push(HierarchyOptions {
                desired_tris: 200,
                simplifier,
                borders,
                ..HierarchyOptions::default()
            });
        }
    }
    ways
}

fn same_at_any_number_of_threads(write: impl Fn(&Path) -> PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let inputs = [write(folder.path())];
    for hierarchy in ways() {
        let options = BuildOptions { hierarchy, ..BuildOptions::default() };
        let mut first = None;
        for (number, threads) in [1, 2, 7, 1].into_iter().enumerate() {
            let out = folder.path().join(format!("out{number}"));
            with_threads(threads, || build_with(&inputs, &out, &options)).unwrap();
            let result = lasting(&out);
            fs::remove_dir_all(&out).unwrap();
            match &first {
                None => {
                    assert!(result.len() > 10, "only {} files", result.len());
                    first = Some(result);
                }
                Some(first) => {
                    let differ = difference(first, &result);
                    assert_eq!(differ, None, "run {number}, {threads} threads, {options:?}");
                }
            }
        }
    }
}

#[test]
fn a_textured_city_is_the_same_at_any_number_of_threads() {
    same_at_any_number_of_threads(|folder| write_city(folder, &small_city()));
}

#[test]
fn a_soup_is_the_same_at_any_number_of_threads() {
    same_at_any_number_of_threads(|folder| write_soup(folder, 2_500, 3));
}

#[test]
fn shared_and_cut_out_pictures_are_the_same_at_any_number_of_threads() {
    same_at_any_number_of_threads(|folder| write_street(folder, 30));
}

#[test]
fn the_program_agrees_with_itself_whatever_threads_it_is_given() {
    let folder = tempfile::tempdir().unwrap();
    write_city(folder.path(), &small_city());
    let result = |threads: &str| {
        let size = ["--desired-tris", "250", "--force"];
        let arguments = [&["--threads", threads][..], &size, &["city.obj", "out"]].concat();
        run_build(folder.path(), &arguments);
        lasting(&folder.path().join("out"))
    };
    let one = result("1");
    for threads in ["2", "7", "0"] {
        assert_eq!(difference(&one, &result(threads)), None, "{threads} threads");
    }
}

/// A city that is moved is the same city to those who give it the same relative name.
#[test]
fn the_folder_that_a_relative_input_lies_in_does_not_show() {
    let result = || {
        let folder = tempfile::tempdir().unwrap();
        write_city(folder.path(), &small_city());
        run_build(folder.path(), &["city.obj", "out"]);
        lasting(&folder.path().join("out"))
    };
    assert_eq!(difference(&result(), &result()), None);
}
