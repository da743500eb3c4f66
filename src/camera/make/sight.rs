//! How much of the model one sees at best from places in the streets.

use glam::DVec2;
use rayon::prelude::*;

use super::panorama::{Panorama, Picture};
use super::raster::{Cells, Surfaces};

/// Metres from one place to the next.
const LATTICE_M: f64 = 8.0;
/// Places along the longer side of a map, at most.
const MOST_PLACES: usize = 96;
/// What is farther away is too small to count, metres.
const FAR_M: f64 = 150.0;
/// Directions that are tried.
const DIRECTIONS: u32 = 24;

/// Degrees by which one may look down.
const DOWN_DEG: [f64; 4] = [0.0, 20.0, 40.0, 60.0];

/// What can be seen every few metres.
#[derive(Clone, Debug)]
pub(super) struct Sight {
    cells: Cells,
    seen: Vec<Seen>,
}

/// The greatest part of a picture that shows the model: all 0 where nobody can stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// Of a level picture.
    pub(super) level: f32,
    /// Of one that looks down, or level.
    pub(super) any: f32,
}

impl Sight {
    /// At places where `is_free`; `eye` is the height of the eye over a cell of the map.
    pub(super) fn new(
        surfaces: &Surfaces,
        scale: f64,
        is_free: impl Fn(usize) -> bool,
        eye: impl Fn(usize) -> f64 + Sync,
    ) -> Self {
        let map = &surfaces.cells;
        let longest = map.columns.max(map.rows);
        let step = (LATTICE_M * scale / map.side).round() as usize;
        let step = step.max(longest.div_ceil(MOST_PLACES)).max(1);
        let cells = Cells {
            corner: map.corner,
            side: map.side * step as f64,
            columns: map.columns.div_ceil(step),
            rows: map.rows.div_ceil(step),
        };
        // The free cell of the map that is nearest to the middle of each of these.
        let mut nearest: Vec<Option<(f64, usize)>> = vec![None; cells.len()];
        for cell in (0..map.len()).filter(|&cell| is_free(cell)) {
            let place = map.middle(cell);
            let Some(within) = cells.at(place) else { continue };
            let away = place.distance_squared(cells.middle(within));
            if nearest[within].is_none_or(|(least, _)| away < least) {
                nearest[within] = Some((away, cell));
            }
        }
        let pictures = DOWN_DEG.map(|down| Picture::new(-down));
        let seen = |free: &Option<(f64, usize)>| {
            let Some((_, cell)) = *free else { return Seen::default() };
            let panorama =
                Panorama::within(FAR_M * scale, surfaces, map.middle(cell).extend(eye(cell)));
            let yaws = (0..DIRECTIONS).map(|at| 360.0 * f64::from(at) / f64::from(DIRECTIONS));
            let most = |picture: &Picture| {
                let parts = yaws.clone().map(|yaw| panorama.part(picture, yaw));
                parts.fold(0.0, f64::max) as f32
            };
            let parts = pictures.each_ref().map(most);
            Seen { level: parts[0], any: parts.into_iter().fold(0.0, f32::max) }
        };
        let seen = nearest.par_iter().map(seen).collect();
        Self { cells, seen }
    }

    /// Around a place; nothing outside of the map.
    pub(super) fn at(&self, place: DVec2) -> Seen {
        self.cells.at(place).map_or(Seen::default(), |cell| self.seen[cell])
    }
}
