//! Real buildings and terrains that are known to be broken, where they are present: `HLOD_DATA`,
//! or `../shared/data` beside the repository.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::chain::{Chain, Placement, options};
use crate::shape::half_a_step;
use crate::support::Random;
use crate::support::inputs::write;
use crate::table::{Bounds, Table, Twin};

/// The same file nearer to the origin.
fn moved(input: &Path, folder: &Path, back: DVec3, shake: u64) -> PathBuf {
    let text = std::fs::read_to_string(input).unwrap();
    let mut moved = String::new();
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let _ = match fields[..] {
            ["v", x, y, z, ..] => {
                let at = DVec3::from([x, y, z].map(|c| c.parse().unwrap())) - back;
                let mut random = Random::new(
                    at.to_array().iter().fold(shake, |s, c| s.rotate_left(21) ^ c.to_bits()),
                    0,
                );
                let at = if shake > 0 { at + half_a_step(&mut random) } else { at };
                writeln!(moved, "v {} {} {}", at.x, at.y, at.z)
            }
            _ => writeln!(moved, "{line}"),
        };
    }
    write(folder, "near.obj", moved)
}

#[test]
fn real_broken_files_build_and_verify() {
    let data = std::env::var_os("HLOD_DATA").unwrap_or_else(|| "../shared/data".into());
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join(data).join("lyon_nasty");
    if !data.exists() {
        println!("skipped: {} is not there", data.display());
        return;
    }
    let mut table = Table::new("91-nasty", "Real files that are broken");
    for input in hlod::import::find_inputs(&[data]).unwrap() {
        let name = input.file_stem().unwrap().to_string_lossy().into_owned();
        let chain = Chain::new(&input, &options()).unwrap();
        table.verified(&name, chain.failures());
        // Nearer to the origin by so much that planes between blocks, which lie at round coordinates, are
        // where they were.
        let folder = crate::chain::inputs();
        let back = (DVec3::from(chain.built.scene.nodes[0].bbox_min) / 4096.0).round() * 4096.0;
        let all = (0..4).map(|shake| {
            let near = moved(&input, &folder, back, shake);
            let path = Placement { offset: -back, ..Placement::SAME }.path(&chain.path());
            Chain::new(&near, &options()).unwrap().figures(&path, 1.0)
        });
        let twin = Twin::several("the same at the origin", all.collect());
        let bounds: Bounds = &[("RMS", 0.12), ("nodes", 0.06)];
        table.within(&name, &chain.own_figures(), &twin, bounds, "rounded to other points");
    }
    table.finish();
}
