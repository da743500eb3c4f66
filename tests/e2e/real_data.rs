//! The real data sets, where they are present: `HLOD_DATA`, or `../shared/data` beside the
//! repository.

use std::path::PathBuf;

use glam::DVec3;
use hlod::builder::BuildOptions;
use hlod::builder::constants::OutlineConstants;
use hlod::verify::{Silent, VerifyOptions, verify};
use hlod::{Error, import};

use crate::support::geometry::area;
use crate::support::result::{Built, report};
use crate::support::{build_with, data};

const DESIRED_TRIS: u64 = 2000;

/// The area of a model as imported.
fn source_area(inputs: &[PathBuf]) -> f64 {
    let models = inputs.iter().map(|input| import::load(input).unwrap());
    models
        .flat_map(|model| model.parts)
        .map(|part| {
            let corner = |vertex: u32| DVec3::from(part.positions[vertex as usize]);
            let triangles = part.indices.chunks_exact(3);
            triangles.map(|t| area([corner(t[0]), corner(t[1]), corner(t[2])])).sum::<f64>()
        })
        .sum()
}

fn check(set: &str) {
    let Some(path) = data(set) else { return };
    let inputs = match import::find_inputs(&[path]) {
        Err(Error::Input { what, .. }) => panic!("{set}: {what}"),
        found => found.unwrap(),
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    build_with(&inputs, &out, &BuildOptions::default());
    let built = Built::read(&out);
    assert_eq!(built.scene.check(), []);

    let (leaves, source) = (built.leaf_area(), source_area(&inputs));
    assert!(
        (leaves / source - 1.0).abs() < 1e-6,
        "{set}: the leaves have {leaves} m², the source {source} m²"
    );

    let report = report(&out);
    let over = report["over_budget"].as_array().unwrap();
    for entry in over {
        assert!(!entry["reason"].as_str().unwrap().is_empty(), "{set}: {entry}");
        assert!(entry["triangles"].as_f64() > entry["budget"].as_f64(), "{set}: {entry}");
    }
    // A root's budget is known from outside: it is the desired number itself, and twice that where
    // the block is a leaf.
    for root in built.scene.roots() {
        let node = &built.scene.nodes[root as usize];
        let excused = over.iter().any(|entry| entry["id"] == node.id.to_string());
        let is_leaf = node.first_child.is_none();
        let most = (DESIRED_TRIS as f64 * if is_leaf { 2.0 } else { 1.1 }).ceil();
        assert!(
            f64::from(node.triangles) <= most || excused,
            "{set}: {} has {} triangles and no reason",
            node.file,
            node.triangles
        );
    }
    let options = VerifyOptions { samples: Some(5_000), ..VerifyOptions::default() };
    let verified = verify(&out, &[], &options, &Silent).unwrap();
    let failed: Vec<_> = verified.checks.iter().filter(|check| !check.passed).collect();
    assert!(failed.is_empty(), "{set}: {failed:?}");
    // Nodes are judged one by one, on coarser grids.
    let least = OutlineConstants::default().least_kept - 0.01;
    // Districts are, by what they keep of the nodes below them.
    let is_district = |level: u32| {
        built.scene.nodes.iter().any(|node| node.level == level && node.block.is_none())
    };
    for (number, level) in verified.levels.iter().enumerate() {
        let below = verified.levels.get(number + 1).filter(|_| is_district(level.level));
        let kept = level.kept.least() / below.map_or(1.0, |below| below.kept.least());
        assert!(kept > least, "{set}: level {} keeps {:?}, {below:?}", level.level, level.kept);
    }
    println!(
        "{set}: {} nodes, {} of them over budget, {} s",
        built.scene.nodes.len(),
        over.len(),
        report["seconds"]
    );
}

macro_rules! sets {
    ($($name:ident: $set:literal,)*) => {
        $(#[test]
        fn $name() {
            check($set);
        })*
    };
}

sets! {
    sceaux: "sceaux",
    oblique_a: "oblique_a",
    ingolstadt: "ingolstadt",
    torcs_street1: "torcs_street1",
    oblique_b: "oblique_b",
    hamada: "hamada",
    lyon_houses: "lyon_houses",
    wageningen: "wageningen",
    lyon_roads: "lyon_roads",
    a_3dfier_terrain: "3dfier",
    lyon_nasty: "lyon_nasty",
    sceaux_glb: "glb/sceaux.glb",
    oblique_a_glb: "glb/oblique_a.glb",
    ingolstadt_glb: "glb/ingolstadt.glb",
    street1_glb: "glb/street1.glb",
    wageningen_glb: "glb/wageningen.glb",
}
