//! Camera paths over built scenes: nobody passes through a surface.

use clap::ValueEnum;
use std::path::{Path, PathBuf};

use glam::DVec3;
use hlod::builder::BuildOptions;
use hlod::camera::{CameraPath, Ground, PathKind, make_path, read_path, up_vector, write_path};
use hlod::city::{self, CityOptions};

use crate::support::build_with;
use crate::support::geometry::Triangle;
use crate::support::result::Built;

/// Frames from one place that is looked at to the next.
const STRIDE: usize = 6;

fn build(input: PathBuf, out: &Path) -> (Built, Ground, Vec<Triangle>) {
    build_with(&[input], out, &BuildOptions::default());
    let built = Built::read(out);
    let leaves = (0..built.meshes.len()).filter(|&node| built.is_leaf(node));
    let triangles = leaves.flat_map(|node| built.triangles(node)).collect();
    let ground = Ground::read(&built.scene, out).unwrap();
    (built, ground, triangles)
}

/// True where the line from `from` to `to` crosses a triangle (Möller and Trumbore 1997).
fn crosses(from: DVec3, to: DVec3, [a, b, c]: Triangle) -> bool {
    let (min, max) = (from.min(to), from.max(to));
    if a.max(b).max(c).cmplt(min).any() || a.min(b).min(c).cmpgt(max).any() {
        return false;
    }
    let (along, ab, ac) = (to - from, b - a, c - a);
    let p = along.cross(ac);
    let determinant = ab.dot(p);
    if determinant == 0.0 {
        return false;
    }
    let u = (from - a).dot(p) / determinant;
    let q = (from - a).cross(ab);
    let v = along.dot(q) / determinant;
    let t = ac.dot(q) / determinant;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)
}

/// How often a path passes through a surface.
fn crossings(path: &CameraPath, triangles: &[Triangle]) -> usize {
    let places: Vec<DVec3> =
        path.frames.iter().step_by(STRIDE).map(|frame| frame.pose.position).collect();
    let crossed = |pair: &[DVec3]| triangles.iter().any(|&t| crosses(pair[0], pair[1], t));
    places.windows(2).filter(|pair| crossed(pair)).count()
}

/// Looks at every kind of path over a generated city.
fn check_city(options: &CityOptions, name: &str) {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join(name);
    city::write(options, &input).unwrap();
    let (built, ground, triangles) = build(input, &folder.path().join("out"));
    let sky = up_vector(built.scene.up);
    for kind in PathKind::value_variants().iter().copied() {
        let path = make_path(&ground, kind, kind.default_frames(), 30.0, 1).unwrap();
        assert_eq!(crossings(&path, &triangles), 0, "{name} {kind:?}");
        // The ground is below and no roof above, at the ends of long lines up and down.
        if matches!(kind, PathKind::Walk | PathKind::Drive | PathKind::Still | PathKind::Shake) {
            let frames: Vec<_> = path.frames.iter().step_by(40).collect();
            let mut on_ground = 0;
            for frame in &frames {
                let eye = frame.pose.position;
                let hits = |way: DVec3| triangles.iter().any(|&t| crosses(eye, eye + way, t));
                assert!(!hits(sky * 100.0), "{name} {kind:?} {}: under a roof", frame.frame);
                assert!(!hits(sky * -0.8), "{name} {kind:?} {}: too low", frame.frame);
                on_ground += usize::from(hits(sky * -2.5));
            }
            // A line down meets the ground, but for shortcuts past the rim of the scan.
            assert!(on_ground * 5 >= frames.len() * 4, "{name} {kind:?}: {on_ground}");
        }
        let file = folder.path().join("path.csv");
        write_path(&path, &file).unwrap();
        assert_eq!(read_path(&file, built.scene.up).unwrap(), path);
    }
}

#[test]
fn paths_keep_to_the_streets_of_a_city_far_out() {
    let offset = [678_016.0, 5_403_456.0, 400.0];
    let options = CityOptions { blocks: 16, triangles: 60_000, offset, ..CityOptions::default() };
    check_city(&options, "city.obj");
}

#[test]
fn paths_keep_to_the_streets_of_a_city_with_y_up() {
    let options = CityOptions { blocks: 8, triangles: 30_000, ..CityOptions::default() };
    check_city(&options, "city.glb");
}

#[test]
fn a_missing_node_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let input = folder.path().join("city.obj");
    city::write(&CityOptions { blocks: 1, triangles: 3000, ..CityOptions::default() }, &input)
        .unwrap();
    let (built, ..) = build(input, &out);
    std::fs::remove_dir_all(out.join("nodes")).unwrap();
    let error = Ground::read(&built.scene, &out).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("nodes/"), "{error}");
    assert!(error.to_string().contains(".glb: cannot read the node"), "{error}");
}
