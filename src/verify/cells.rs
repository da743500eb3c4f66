//! Check: cells are of this build, their files whole, and what the index says of each face is what it holds.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::options::{Limits, VerifyOptions};
use super::progress::Progress;
use super::report::{Check, Failure};
use crate::cells::SeenFaces;
use crate::format::cells::{CELLS_DIR, CELLS_FILE, Cell, Cells, Face};
use crate::format::{NodeMesh, Scene, file_crc, read_glb};
use crate::{Error, Result};

const AGAIN: &str = "make the cells again: hlod-build cells";

/// Metres by which a vertex may be beyond where it should be, for each metre from the cell: vertices are f32.
const ROUNDING: f64 = 1e-6;

/// Checks the cells of an output folder; none where it has no index of them.
pub(super) fn cells(
    out: &Path,
    scene: &Scene,
    options: &VerifyOptions,
    progress: &dyn Progress,
) -> Option<(Check, Vec<SeenFaces>)> {
    let mut check = Check::new("cells");
    let cells = match Cells::read(out) {
        Ok(cells) => cells?,
        Err(error) => {
            check.fail(CELLS_FILE, error.to_string(), AGAIN);
            return Some((check, Vec::new()));
        }
    };
    if let Err(error) = cells.check_scene(scene, out) {
        check.fail(CELLS_FILE, error.to_string(), AGAIN);
        return Some((check, Vec::new()));
    }
    progress.phase("reading cells", cells.cells.len() as u64);
    let failures: Vec<Vec<Failure>> = cells
        .cells
        .par_iter()
        .map(|cell| {
            let failures = cells.faces_of(cell).iter().flat_map(|face| {
                let place = format!("{CELLS_DIR}/{}", face.file);
                let what = face_failure(out, &cells, cell, face)?;
                Some(Failure { place, what, hint: AGAIN })
            });
            let failures = failures.collect();
            progress.done(1);
            failures
        })
        .collect();
    check.extend(failures.into_iter().flatten());
    let error = cells.faces.iter().fold(0.0, |most: f64, face| most.max(face.error));
    check.summary = format!(
        "{} cells with {} faces read, which say that they are off by {:.1} mm at most for each metre of distance",
        cells.cells.len(),
        cells.faces.len(),
        error * 1e3,
    );
    let mut seen = Vec::new();
    if check.passed && options.cells > 0 {
        match drawn(out, options, progress) {
            Ok(found) => {
                judge(&found, &options.limits, &mut check);
                seen = found;
            }
            Err(Error::NoAdapter(_)) => {
                check.summary += "; not drawn: there is no graphics adapter";
            }
            Err(error) => check.fail(CELLS_DIR, error.to_string(), AGAIN),
        }
    }
    Some((check, seen))
}

#[cfg(feature = "render")]
fn drawn(out: &Path, options: &VerifyOptions, progress: &dyn Progress) -> Result<Vec<SeenFaces>> {
    let begin = |cells: usize| progress.phase("drawing cells", cells as u64);
    crate::cells::seen_from_other_corners(out, options.cells, &begin, &|| progress.done(1))
}

#[cfg(not(feature = "render"))]
fn drawn(_: &Path, _: &VerifyOptions, _: &dyn Progress) -> Result<Vec<SeenFaces>> {
    Err(Error::NoAdapter("built without the renderer".into()))
}

/// Fails where faces show too little of what they should, or something else.
fn judge(seen: &[SeenFaces], limits: &Limits, check: &mut Check) {
    let sum = |of: fn(&SeenFaces) -> u64| seen.iter().map(of).sum::<u64>() as f64;
    let pixels = sum(|seen| seen.pixels).max(1.0);
    let [missing, wrong] = [sum(|seen| seen.missing), sum(|seen| seen.wrong)];
    check.summary += &format!(
        "; from corners that no picture was taken from, {} of them miss {:.3} % of what is far and show {:.3} % \
         of it wrongly",
        seen.len(),
        100.0 * missing / pixels,
        100.0 * wrong / pixels,
    );
    for seen in seen {
        let of = |pixels: u64| pixels as f64 / seen.pixels.max(1) as f64;
        let [i, j, k] = seen.place;
        for (found, most, what) in [
            (of(seen.missing), limits.missing_of_faces, "missing"),
            (of(seen.wrong), limits.wrong_of_faces, "shown wrongly"),
        ] {
            if found > most {
                let what = format!(
                    "{:.2} % of what is far is {what}, expected {:.2} % at most",
                    100.0 * found,
                    100.0 * most
                );
                check.fail(format!("the cell {i}, {j}, {k}"), what, AGAIN);
            }
        }
    }
}

/// What is wrong with a face.
fn face_failure(out: &Path, cells: &Cells, cell: &Cell, face: &Face) -> Option<String> {
    let path = out.join(CELLS_DIR).join(&face.file);
    let bytes = match crate::format::read_regular(&path) {
        Ok(bytes) => bytes,
        Err(error) => return Some(format!("cannot be read: {error}")),
    };
    let found = file_crc(&bytes);
    if bytes.len() as u64 != face.file_bytes {
        return Some(format!("expected {} bytes, found {}", face.file_bytes, bytes.len()));
    }
    if found != face.file_crc {
        return Some(format!("damaged: expected CRC-32 {:08x}, found {found:08x}", face.file_crc));
    }
    match read_glb(&bytes, Path::new(&face.file)) {
        Ok(mesh) => counts(&mesh, face).or_else(|| places(&mesh, cells, cell, face)),
        Err(error) => Some(error.to_string()),
    }
}

fn counts(mesh: &NodeMesh, face: &Face) -> Option<String> {
    let vertices: usize = mesh.primitives.iter().map(|part| part.positions.len()).sum();
    let triangles: usize = mesh.primitives.iter().map(|part| part.indices.len() / 3).sum();
    let expected = (face.vertices as usize, face.triangles as usize, face.views.len());
    let found = (vertices, triangles, mesh.images.len());
    (found != expected).then(|| {
        format!("vertices, triangles and pictures: expected {expected:?}, found {found:?}")
    })
}

/// Vertices are in the bounds that the index has, before the cameras that took their pictures, and none of
/// them is in the cell.
fn places(mesh: &NodeMesh, cells: &Cells, cell: &Cell, face: &Face) -> Option<String> {
    let origin = DVec3::from(mesh.origin);
    let [low, high] = face.bounds.map(DVec3::from);
    let [min, max] = cells.bounds(cell.place).map(DVec3::from);
    let slack = DVec3::splat(ROUNDING * (high - low).length());
    for (part, view) in mesh.primitives.iter().zip(&face.views) {
        let [x, y, z, w] = view.projection.map(f64::from);
        for &at in &part.positions {
            let from_origin = DVec3::from(at.map(f64::from));
            let at = origin + from_origin;
            if (at + slack).cmplt(low).any() || (at - slack).cmpgt(high).any() {
                return Some(format!("a vertex at {at}: expected to be from {low} to {high}"));
            }
            if at.cmpgt(min).all() && at.cmplt(max).all() {
                return Some(format!("a vertex at {at}: expected none in the cell itself"));
            }
            if from_origin.dot(DVec3::new(x, y, z)) + w <= 0.0 {
                return Some(format!(
                    "a vertex at {at}: expected before the camera of its picture"
                ));
            }
        }
    }
    None
}
