//! The source's colours at points of the leaves.

use glam::DVec3;
use rayon::prelude::*;

use super::geometry::NodeGeometry;
use super::points::Points;
use super::sample::cross;
use super::source::Source;
use super::surface_appearance::{Color, SurfaceAppearance, squared_difference};
use crate::decode::decode_texture;

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
    pub appearance: SurfaceAppearance,
}

/// For each point what the source shows there; `None` where there is no triangle of the source
/// within `reach`, where it is see-through, or where its image cannot be read.
///
/// Where several triangles of the source coincide, as in models whose faces stand there twice with
/// different images, the one is taken that is most like the leaf, whose colours are `shown`.
pub(super) fn source_colors(
    source: &Source,
    points: &Points,
    geometry: &[NodeGeometry],
    shown: &[Option<Color>],
    reach: f64,
) -> Vec<Option<Shown>> {
    let mut appearances: Vec<(u32, SurfaceAppearance)> = points
        .all
        .par_iter()
        .zip(&points.leaf)
        .enumerate()
        .flat_map_iter(|(number, (point, &leaf))| {
            let leaf = &geometry[leaf as usize];
            let normal = cross(leaf.corners(leaf.triangles[point.triangle as usize]));
            candidates(source, point.point, normal, reach)
                .into_iter()
                .map(move |appearance| (number as u32, appearance))
        })
        .collect();
    // By image, so that each is decoded once; points stay in order within.
    appearances.sort_by_key(|&(number, appearance)| (appearance.image, number));
    let mut best: Vec<Option<Shown>> = vec![None; points.all.len()];
    let sources: Vec<_> = source.images().map(|(_, image)| image).collect();
    let groups: Vec<&[(u32, SurfaceAppearance)]> =
        appearances.chunk_by(|a, b| a.1.image == b.1.image).collect();
    let colors: Vec<Vec<Option<Color>>> = groups
        .par_iter()
        .map(|group| {
            let image = match group[0].1.image {
                None => None,
                Some(number) => match decode_texture(sources[number as usize]) {
                    Ok(image) => Some(image),
                    Err(_) => return vec![None; group.len()],
                },
            };
            group.iter().map(|(_, appearance)| appearance.color(image.as_ref())).collect()
        })
        .collect();
    for (group, colors) in groups.iter().zip(colors) {
        for (&(number, appearance), color) in group.iter().zip(colors) {
            let Some(color) = color else { continue };
            let best = &mut best[number as usize];
            let off =
                |color| shown[number as usize].map_or(0.0, |at| squared_difference(at, color));
            if best.is_none_or(|best| off(color) < off(best.color)) {
                *best = Some(Shown { color, appearance });
            }
        }
    }
    best
}

fn candidates(source: &Source, point: DVec3, normal: DVec3, reach: f64) -> Vec<SurfaceAppearance> {
    let surface = source.built();
    let hits = surface.within(point, reach);
    let aligned = |triangle: u32| {
        let other = cross(surface.corners(triangle));
        other != DVec3::ZERO && normal.dot(other) >= ALIGNED * normal.length() * other.length()
    };
    hits.into_iter()
        .filter(|hit| aligned(hit.triangle))
        .take(MOST_CANDIDATES)
        .map(|hit| source.appearance(hit.triangle, hit.weights))
        .collect()
}
