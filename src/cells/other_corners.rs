//! Faces as they are seen from corners of their cells that no picture was taken from.

use std::path::Path;

use glam::DVec3;

use super::face::{Capture, Captured, DIRECTIONS};
use super::options::CellOptions;
use super::prepare::{CORNERS, boxes};
use super::seen_faces::SeenFaces;
use crate::bench::{ReferenceRenderer, Session};
use crate::camera::Pose;
use crate::render::RenderOptions;
use crate::{Error, Result};

/// What is seen is looked for so many pixels around where it should be: it may be off by one, and edges fall on
/// either side of a pixel's middle.
const AROUND: i64 = 2;

/// By so many times the bound of what a face may be off depths may differ: half of it is that of the surface,
/// which is bounded as seen from where its picture was taken to where the eye may be, twice as far apart as the
/// middle of a cell and its corners.
const SLACK: f64 = 2.0;

/// Faces are drawn farther away than they are, so that what is near is before them: depths are this part.
const DRAWN_FARTHER: f64 = 0.98;

/// Bytes of faces that are held.
const CAP_BYTES: u64 = 256 << 20;

/// Draws, for `most` cells at most, spread evenly over all of them, what is outside of their cull boxes from
/// corners that no picture was taken from, and the faces in its place. Fails without a graphics adapter, and
/// where there are no cells.
pub fn seen_from_other_corners(
    out: &Path,
    most: usize,
    begin: &dyn Fn(usize),
    done: &dyn Fn(),
) -> Result<Vec<SeenFaces>> {
    let mut session = Session::open(out)?;
    session.read_cells()?;
    let Some(cells) = session.cells().cloned() else { return Ok(Vec::new()) };
    let options: CellOptions = serde_json::from_value(cells.parameters.clone())
        .map_err(|error| Error::input(out, format!("options of the cells: {error}")))?;
    let mut scene = Capture::new(&session, &options, None)?;
    let render = RenderOptions { size: [options.pixels; 2], ..RenderOptions::default() };
    let mut faces = ReferenceRenderer::new(&session, &render, CAP_BYTES)?;
    let nodes = session.tree().len() as u32;
    let step = cells.cells.len().div_ceil(most.max(1)).max(1);
    begin(cells.cells.len().div_ceil(step));
    let mut seen = Vec::new();
    for cell in cells.cells.iter().step_by(step) {
        let numbers: Vec<u32> = cell.faces.clone().map(|face| nodes + face).collect();
        let mut of_cell = SeenFaces { place: cell.place, ..SeenFaces::default() };
        let (min, shown) = boxes(cell, &options);
        // What no picture was taken from: corners opposite to those that were.
        for corner in CORNERS.map(|corner| -DVec3::from(corner)) {
            let half = options.cell_m / 2.0;
            let eye = min + DVec3::splat(half) + corner * half;
            for direction in DIRECTIONS {
                let expected = scene.draw(eye, shown, direction, &options)?;
                let rotation = scene.rotation(direction);
                let pose = Pose { position: eye, rotation, fov_y_deg: options.fov_deg() };
                faces.render(&numbers, &pose)?;
                let found = faces.depths()?;
                compare(expected.as_ref(), &found, &options, &mut of_cell);
            }
        }
        scene.check()?;
        seen.push(of_cell);
        done();
    }
    Ok(seen)
}

fn compare(
    expected: Option<&Captured>,
    found: &[f32],
    options: &CellOptions,
    seen: &mut SeenFaces,
) {
    let size = i64::from(options.pixels);
    // Pixels by which what is so far away moves as the eye does.
    let moves_px = options.reach_m() * options.focal_px();
    let parallax = |metres: f64| moves_px / metres;
    let expected = |at: i64| {
        let metres = expected.map_or(f32::INFINITY, |expected| expected.metres[at as usize]);
        parallax(f64::from(metres))
    };
    for row in 0..size {
        for column in 0..size {
            let at = row * size + column;
            let is = parallax(f64::from(found[at as usize]) * DRAWN_FARTHER);
            if is == 0.0 && expected(at) == 0.0 {
                continue;
            }
            seen.pixels += 1;
            let is_like = |other: f64| match is == 0.0 {
                true => other == 0.0,
                false => other > 0.0 && (is - other).abs() <= SLACK * options.error_px,
            };
            let [rows, columns] =
                [row, column].map(|at| (at - AROUND).max(0)..=(at + AROUND).min(size - 1));
            let is_there = rows
                .flat_map(|row| columns.clone().map(move |column| row * size + column))
                .any(|at| is_like(expected(at)));
            match is_there {
                true => {}
                false if is == 0.0 => seen.missing += 1,
                false => seen.wrong += 1,
            }
        }
    }
}
