//! Groups that share a few long edges, of which one is divided into several blocks.

use std::fmt::Write;

use crate::support::inputs::write;
use crate::support::run_build;

/// Squares of a sheet along x and y.
const SIDE: usize = 96;

/// A sheet, and beside it some triangles that have four vertices of its border: both share the
/// long edges between them, which planes that divide the sheet cross.
fn sheet_and_kerb() -> String {
    let mut text = String::from("g sheet\n");
    let height = |x: f64, y: f64| (0.3 * x).sin() + (0.4 * y).cos();
    for y in 0..=SIDE {
        for x in 0..=SIDE {
            let (x, y) = (x as f64, y as f64 + 1.0);
            let _ = writeln!(text, "v {x} {y} {}", height(x, y));
        }
    }
    let at = |x: usize, y: usize| y * (SIDE + 1) + x + 1;
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let _ = writeln!(text, "f {} {} {}", at(x, y), at(x + 1, y), at(x + 1, y + 1));
        let _ = writeln!(text, "f {} {} {}", at(x, y), at(x + 1, y + 1), at(x, y + 1));
    }
    // Shared vertices, not along an axis.
    let shared = (SIDE + 1) * (SIDE + 1) + 1;
    let kerb = [[0.0, 0.0], [30.6, -0.7], [66.2, -0.2], [96.0, 0.1]];
    for [x, y] in kerb {
        let _ = writeln!(text, "v {x} {y} {}", height(x, y));
    }
    for number in 0..3 {
        let (a, b) = (shared + number, shared + number + 1);
        for x in number * 32..(number + 1) * 32 {
            let _ = writeln!(text, "f {a} {} {}", at(x + 1, 0), at(x, 0));
        }
        let _ = writeln!(text, "f {a} {b} {}", at((number + 1) * 32, 0));
    }
    text.push_str("g kerb\n");
    for [x, y] in kerb {
        let _ = writeln!(text, "v {x} {} -1", y - 2.0);
    }
    for number in 0..3 {
        let (a, b) = (shared + number, shared + number + 1);
        let _ = writeln!(text, "f {b} {a} {}\nf {b} {} {}", a + 4, a + 4, b + 4);
    }
    text
}

#[test]
fn edges_that_a_divided_group_shares_with_another_stay_whole() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "kerb.obj", sheet_and_kerb());
    for desired in ["40", "43", "46"] {
        let built = run_build(
            folder.path(),
            &["--desired-tris", desired, "--up", "z", "kerb.obj", desired],
        );
        let blocks = run_build(folder.path(), &["inspect", desired]);
        assert!(!blocks.contains(" 1 blocks") && !blocks.contains(" 2 blocks"), "{built}{blocks}");
        run_build(folder.path(), &["verify", desired, "--source", "kerb.obj"]);
    }
}
