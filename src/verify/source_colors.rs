//! The source's colours at points of the leaves.

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::look::{Color, Look, squared_difference};
use super::points::Points;
use super::sample::cross;
use super::source::Source;
use crate::import::decode_texture;

/// The source's triangle must face the leaf's way: cosine of the angle between them.
const ALIGNED: f64 = 0.9;
/// Coincident triangles of the source that are tried.
const MOST_CANDIDATES: usize = 4;

/// What the source shows at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shown {
    /// Its colour.
    pub color: Color,
    /// How it comes about.
    pub look: Look,
}

/// For each point what the source shows there; `None` where there is no triangle of the source
/// within `reach`, where it is see-through, or where its picture cannot be read.
///
/// Where several triangles of the source coincide, as in models whose faces stand there twice with
/// different pictures, the one is taken that is most like the leaf, whose colours are `shown`.
pub(super) fn source_colors(
    source: &Source,
    points: &Points,
    geometry: &[NodeGeometry],
    shown: &[Option<Color>],
    reach: f64,
) -> Vec<Option<Shown>> {
    let mut looks: Vec<(u32, Look)> = points
        .all
        .par_iter()
        .zip(&points.leaf)
        .enumerate()
        .flat_map_iter(|(number, (point, &leaf))| {
            let leaf = &geometry[leaf as usize];
            let normal = cross(leaf.corners(leaf.triangles[point.triangle as usize]));
            candidates(source, point.point, normal, reach)
                .into_iter()
                .map(move |look| (number as u32, look))
        })
        .collect();
    // By picture, so that each is decoded once; points stay in order within.
    looks.sort_by_key(|&(number, look)| (look.picture, number));
    let mut best: Vec<Option<Shown>> = vec![None; points.all.len()];
    let sources: Vec<_> = source.pictures().map(|(_, picture)| picture).collect();
    let groups: Vec<&[(u32, Look)]> = looks.chunk_by(|a, b| a.1.picture == b.1.picture).collect();
    let colors: Vec<Vec<Option<Color>>> = groups
        .par_iter()
        .map(|group| {
            let picture = match group[0].1.picture {
                None => None,
                Some(number) => match decode_texture(sources[number as usize]) {
                    Ok(picture) => Some(picture),
                    Err(_) => return vec![None; group.len()],
                },
            };
            group.iter().map(|(_, look)| look.color(picture.as_ref())).collect()
        })
        .collect();
    for (group, colors) in groups.iter().zip(colors) {
        for (&(number, look), color) in group.iter().zip(colors) {
            let Some(color) = color else { continue };
            let best = &mut best[number as usize];
            let off =
                |color| shown[number as usize].map_or(0.0, |at| squared_difference(at, color));
            if best.is_none_or(|best| off(color) < off(best.color)) {
                *best = Some(Shown { color, look });
            }
        }
    }
    best
}

fn candidates(source: &Source, point: DVec3, normal: DVec3, reach: f64) -> Vec<Look> {
    let surface = source.built();
    let hits = surface.within(point, reach);
    let aligned = |triangle: u32| {
        let other = cross(surface.corners(triangle));
        other != DVec3::ZERO && normal.dot(other) >= ALIGNED * normal.length() * other.length()
    };
    hits.into_iter()
        .filter(|hit| aligned(hit.triangle))
        .take(MOST_CANDIDATES)
        .map(|hit| source.look(hit.triangle, hit.weights))
        .collect()
}
