//! Camera paths of every kind over the real data sets: what they show, and that they pass through
//! nothing. Where there is no graphics adapter these tests say that they were skipped, or fail if
//! `HLOD_REQUIRE_GPU` is 1.
#![cfg(feature = "render")]

use std::path::Path;

use clap::ValueEnum;
use hlod::bench::{ReferenceRenderer, Session};
use hlod::builder::BuildOptions;
use hlod::camera::{Ground, PathKind, Pose, make_path, up_vector};
use hlod::import;
use hlod::render::RenderOptions;

#[path = "../common/adapter.rs"]
mod adapter;
mod picture;
#[path = "../common/rays.rs"]
#[allow(dead_code)]
mod rays;
#[path = "../e2e/support/mod.rs"]
#[allow(dead_code)]
mod support;
mod surfaces;
mod twice;
mod visibility;

use adapter::or_skip;
use picture::{SIZE, part_with_model};
use surfaces::Surfaces;

/// The least part of a picture that shows the model.
const LEAST_PART: f64 = 0.25;
/// Sets of bodies far apart with no ground between, and of roads alone: where the camera turns from
/// one to the next, or looks at all of them, a few pictures show less.
const SPARSE: [&str; 2] = ["lyon_roads", "wageningen"];
/// The part of the pictures of a path that may show less there, and what these show at least.
const SPARSE_FEW: f64 = 0.02;
const SPARSE_LEAST_PART: f64 = 0.15;
/// Sets in which much is hidden: of the others little is, or of some paths only.
const HIDING: [&str; 2] = ["hamada", "wageningen"];
/// Of so many frames one is drawn.
const DRAWN: usize = 12;
/// Seeds of the paths.
const SEEDS: [u64; 2] = [0, 7];
const CAP_BYTES: u64 = 1 << 30;

fn check(set: &str) {
    let Some(path) = support::data(set) else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    support::build_with(&import::find_inputs(&[path]).unwrap(), &out, &BuildOptions::default());
    check_scene(set, &out);
}

fn check_scene(set: &str, out: &Path) {
    let session = Session::open(out).unwrap();
    let options = RenderOptions { size: SIZE, ..RenderOptions::default() };
    let Some(mut renderer) = or_skip(ReferenceRenderer::new(&session, &options, CAP_BYTES)) else {
        return;
    };
    let surfaces = Surfaces::read(session.scene(), out);
    let ground = Ground::read(session.scene(), out).unwrap();
    let sky = up_vector(session.scene().up);
    let mut faults = Vec::new();
    for kind in PathKind::value_variants().iter().copied() {
        for seed in SEEDS {
            let path = make_path(&ground, kind, kind.default_frames(), 30.0, seed).unwrap();
            let poses: Vec<Pose> = path.frames.iter().map(|frame| frame.pose).collect();
            let passed = surfaces.passed(&poses);
            let is_outside = poses.iter().step_by(DRAWN).any(|pose| surfaces.is_open(pose, sky));
            let mut parts: Vec<(usize, f64)> = Vec::new();
            for (index, pose) in poses.iter().enumerate().step_by(DRAWN) {
                parts.push((index, part_with_model(&mut renderer, session.tree(), pose)));
            }
            let least = parts.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            let few = parts.iter().filter(|(_, part)| *part < LEAST_PART).count();
            let is_sparse = SPARSE.contains(&set);
            let may_lack = if is_sparse { SPARSE_FEW * parts.len() as f64 } else { 0.0 };
            let is_enough = few as f64 <= may_lack && (few == 0 || least.1 >= SPARSE_LEAST_PART);
            if !is_enough || !passed.is_empty() || !is_outside {
                faults.push(format!(
                    "{kind:?} {seed}: {few} of {} pictures show less, least {:.3} in frame {}; \
                     passes through something before frames {passed:?}; begins outside: {is_outside}",
                    parts.len(),
                    least.1,
                    least.0
                ));
            }
        }
    }
    drop(renderer);
    let options = RenderOptions { size: visibility::SIZE, ..RenderOptions::default() };
    let mut renderer = ReferenceRenderer::new(&session, &options, CAP_BYTES).unwrap();
    let (hidden, differ) = visibility::hidden_and_faults(&session, &ground, &mut renderer);
    faults.extend(differ);
    let is_enough = hidden > 500 || !HIDING.contains(&set);
    assert!(faults.is_empty() && is_enough, "{set}: {hidden} nodes hidden, {faults:#?}");
}

/// A test for each set, so that they run side by side.
macro_rules! sets {
    ($($set:ident)*) => { $(#[test] fn $set() { check(stringify!($set)) })* };
}

mod sets {
    use super::check;

    sets! { hamada ingolstadt lyon_houses lyon_roads oblique_a oblique_b sceaux torcs_street1 wageningen }

    #[test]
    fn a_terrain() {
        check("3dfier");
    }
}

#[test]
fn a_generated_city() {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("city.obj");
    let options = hlod::city::CityOptions { blocks: 16, triangles: 60_000, ..Default::default() };
    hlod::city::write(&options, &input).unwrap();
    let out = folder.path().join("out");
    support::build_with(&[input], &out, &BuildOptions::default());
    check_scene("a city", &out);
}
