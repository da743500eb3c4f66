//! Check: a second reader finds in the files of the source what the importer found.
//!
//! All other checks read the source by the importer that the build uses, so that what it loses is
//! missing on both sides. The readers here share no code with it. They know less: they read what
//! most files have, plainly, and say why they leave a file or a material alone. For OBJ that is
//! less than a hundred lines of our own, since `tobj` 4.0.5 gives colours to the wrong vertices where only some
//! have one; for glTF it is the crate `gltf`.

mod content;
mod gltf;
mod obj;
mod texture;

use std::path::Path;

use super::report::{Check, Failure};
use crate::mesh::Model;
pub(super) use content::Content;

/// Larger files are not read a second time, bytes.
const MOST_BYTES: u64 = 512 << 20;

/// Share by which areas and coordinates may differ beside what is known: sums in another order.
const ROUNDING: f64 = 1e-6;

/// Difference of a material's mean colour in one channel, sRGB, 0–255: both sample its textures, at
/// other points where polygons are divided otherwise.
const OTHER_COLOR: f64 = 24.0;

/// A material with less of the area is not compared, since few samples decide.
const LEAST_AREA: f64 = 1e-4;

const HINT: &str = "look at what the build warns of in this file; if it warns of nothing, report \
                    this: the importer loses something";

/// One file, read twice.
pub(super) struct Comparison {
    /// The file as it was named.
    file: String,
    /// The differences, or why the file was not compared.
    outcome: Result<Compared, String>,
}

/// The comparison of a file.
#[derive(Default)]
struct Compared {
    differences: Vec<String>,
    /// Materials whose colours were compared, and all.
    materials: [usize; 2],
}

/// Reads a file again and compares what is there with the importer's model, before that is changed.
pub(super) fn compare(file: &Path, model: &Model) -> Comparison {
    let is_obj = file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
    let size = std::fs::metadata(file).map_or(0, |metadata| metadata.len());
    let second = match (size <= MOST_BYTES, is_obj) {
        (false, _) => Err(format!("larger than {} MiB", MOST_BYTES >> 20)),
        (true, true) => obj::read(file),
        (true, false) => gltf::read(file),
    };
    let outcome = second.map(|second| differences(&Content::of(model), &second));
    Comparison { file: file.to_string_lossy().into_owned(), outcome }
}

fn differences(ours: &Content, theirs: &Content) -> Compared {
    let mut compared = Compared::default();
    let mut differs = |what: String| compared.differences.push(what);
    let [fewest, most] = theirs.triangles;
    if !(fewest..=most).contains(&ours.triangles[0]) {
        let found = ours.triangles[0];
        differs(format!("{found} triangles, the second reader finds {fewest} to {most}"));
    }
    let [least, largest] = [theirs.area[0] * (1.0 - ROUNDING), theirs.area[1] * (1.0 + ROUNDING)];
    let area = ours.area[0];
    if !(area >= least && area <= largest) {
        differs(format!("area {area:.6} m², the second reader finds {least:.6} to {largest:.6}"));
    }
    let ([low, low_of_all], [high, high_of_all]) = (theirs.low, theirs.high);
    let size = low_of_all.abs().max(high_of_all.abs()).max_element() * ROUNDING;
    let (our_low, our_high) = (ours.low[0], ours.high[0]);
    let is_within = (our_low + size).cmpge(low_of_all) & (our_high - size).cmple(high_of_all);
    let holds = (our_low - size).cmple(low) & (our_high + size).cmpge(high);
    if !(is_within & holds).all() {
        differs(format!(
            "the box from {our_low} to {our_high}, the second reader finds {low} to {high}"
        ));
    }
    for (name, second) in &theirs.materials {
        compared.materials[1] += 1;
        let Some(first) = ours.materials.get(name) else { continue };
        if first.area.max(second.area) < LEAST_AREA * theirs.area[1] {
            continue;
        }
        let (Some(a), Some(b)) = (first.mean_color(), second.mean_color()) else { continue };
        compared.materials[0] += 1;
        let is_same = |channel: usize| (a[channel] - b[channel]).abs() <= OTHER_COLOR;
        if !(0..3).all(is_same) {
            let text = |color: [f64; 3]| color.map(|c| format!("{c:.0}")).join(",");
            let (a, b) = (text(a), text(b));
            compared.differences.push(format!(
                "material {name} has the mean colour {a}, the second reader finds {b}"
            ));
        }
    }
    compared
}

/// The check over all files.
pub(super) fn check(files: &[Comparison]) -> Check {
    let mut check = Check::new("second reader");
    let (mut materials, mut compared, mut left_out) = ([0, 0], 0, Vec::new());
    for Comparison { file, outcome } in files {
        match outcome {
            Err(why) => left_out.push(format!("{file} ({why})")),
            Ok(found) => {
                compared += 1;
                materials = [0, 1].map(|at| materials[at] + found.materials[at]);
                check.extend(found.differences.iter().map(|what| Failure {
                    place: file.clone(),
                    what: what.clone(),
                    hint: HINT,
                }));
            }
        }
    }
    let [of, all] = materials;
    check.summary = format!(
        "{compared} of {} files read again: triangles, area, box, and colours of {of} of {all} materials",
        files.len()
    );
    if let Some(first) = left_out.first() {
        check.summary += &format!("; not compared: {first}");
        if left_out.len() > 1 {
            check.summary += &format!(" and {} more", left_out.len() - 1);
        }
    }
    check
}

#[cfg(test)]
mod tests;
