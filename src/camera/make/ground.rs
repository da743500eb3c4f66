//! What a scene looks like to someone who stands in it: where the ground is and where one can go.

use std::path::Path;
use std::sync::OnceLock;

use glam::{DVec2, DVec3};

use super::panorama::Panorama;
use super::plan::Plan;
use super::raster::{Cells, Surfaces};
use super::sight::Sight;
use super::{survey, terrain, window};
use crate::format::Scene;
use crate::{Error, Result};

/// Height of the eye above the ground, metres.
pub(super) const EYE_HEIGHT_M: f64 = 1.7;
/// The eye is no higher than this part of a scene's width.
const EYE_PART_OF_WIDTH: f64 = 0.1;
/// Longest side of a map in cells.
const MAX_CELLS: f64 = 1024.0;
/// Side of a cell, metres, where that is not too many cells.
const CELL_M: f64 = 0.5;
/// Free space around what is mapped, metres.
const MARGIN_M: f64 = 12.0;
/// What rises above the ground by more than this stands in the way, metres.
const STEP_OVER_M: f64 = 0.85;
/// Metres that the ground may rise within a metre before it stands in the way.
const STEEPEST: f64 = 0.7;
/// Slabs thicker than this are buildings, metres.
const MAX_SLAB_M: f64 = 2.5;
/// Half the sides of the squares in which the place with most of the model is sought: a few metres,
/// and a part of the city's width.
const NEAR_M: f64 = 10.0;
const NEAR_PART: f64 = 0.125;
/// What is farther away than this is not in a flight's way, metres.
const CLEAR_M: f64 = 20.0;
/// Longest side, in cells, of the coarse map of a city of which only a part is mapped finely.
const OVERVIEW_CELLS: f64 = 1024.0;

/// The ground of a scene, its obstacles and the room between them, for [`make_path`].
///
/// Of a city that is wider than a kilometre only the densest square kilometre is mapped; whoever
/// walks stays within it.
///
/// [`make_path`]: super::make_path
#[derive(Clone, Debug)]
pub struct Ground {
    pub(super) plan: Plan,
    /// A person's size: 1, or less where the scene is smaller than a few houses.
    pub(super) scale: f64,
    /// Around all nodes, on the map.
    pub(super) bounds: [DVec3; 2],
    /// Of the mapped part.
    pub(super) surfaces: Surfaces,
    /// Of all of the city, coarsely; `None` where all is mapped.
    pub(super) overview: Option<Surfaces>,
    /// The middle of where most of the model is.
    pub(super) focus: DVec3,
    /// How much of the model is near each cell of the fine map, and farther around.
    density: Vec<f32>,
    /// Height of the ground.
    pub(super) height: Vec<f32>,
    /// Metres to the middle of the nearest obstacle; 0 within one.
    pub(super) clearance: Vec<f32>,
    /// Found when it is first asked for, since flights ask for none of it.
    sight: OnceLock<Sight>,
}

impl Ground {
    /// Maps the scene of the output folder `dir`. Reads only nodes as coarse as will do.
    pub fn read(scene: &Scene, dir: &Path) -> Result<Self> {
        let Some([min, max]) = scene.bounds() else {
            return Err(Error::Internal("a scene without nodes has no ground".to_owned()));
        };
        let (min, max) = (DVec3::from_array(min), DVec3::from_array(max));
        // The middle of the bounds, and never so far from them that f32 would not do.
        let plan = Plan::new(scene.up, min + (max - min) / 2.0);
        let bounds = plan.map_box([min.to_array(), max.to_array()]);
        let size = bounds[1] - bounds[0];
        if !size.is_finite() {
            return Err(Error::input(dir, "the scene has no finite size"));
        }
        let scale = scale(size);
        let shown = window::choose(scene, &plan, bounds);
        let cells = cells(shown, scale);
        let nodes = survey::nodes(scene, &plan, shown, cells.side / 2.0);
        let mut surfaces = Surfaces::new(cells);
        survey::read(scene, dir, &nodes, &plan, &mut surfaces)?;
        let whole = bounds.map(DVec3::truncate);
        let mut overview = None;
        if shown != whole {
            let side = (whole[1] - whole[0]).max_element() / OVERVIEW_CELLS;
            let cells = cells_of(whole, side);
            let nodes = survey::nodes(scene, &plan, whole, side);
            let mut surfaces = Surfaces::new(cells);
            survey::read(scene, dir, &nodes, &plan, &mut surfaces)?;
            overview = Some(surfaces);
        }
        Ok(Self::new(plan, scale, bounds, surfaces, overview))
    }

    /// The ground under surfaces that were rasterised.
    pub(super) fn new(
        plan: Plan,
        scale: f64,
        bounds: [DVec3; 2],
        surfaces: Surfaces,
        overview: Option<Surfaces>,
    ) -> Self {
        let bottom = if is_slabs(&surfaces, scale) { &surfaces.high } else { &surfaces.low };
        let is_covered = |cell| surfaces.is_covered(cell);
        let height = terrain::ground(&surfaces.cells, bottom, is_covered, scale);
        let step = (STEP_OVER_M * scale + STEEPEST * surfaces.cells.side) as f32;
        let blocked: Vec<bool> =
            surfaces.high.iter().zip(&height).map(|(high, ground)| high - ground > step).collect();
        let clearance = clearance(&surfaces.cells, &blocked);
        let density = density(&surfaces, scale);
        let focus = match &overview {
            Some(overview) => densest(overview, &self::density(overview, scale), |_| true),
            None => densest(&surfaces, &density, |_| true),
        };
        let focus = focus.unwrap_or_default();
        let sight = OnceLock::new();
        Self { plan, scale, bounds, surfaces, overview, focus, density, height, clearance, sight }
    }

    /// How much one sees from the streets.
    pub(super) fn sight(&self) -> &Sight {
        self.sight.get_or_init(|| {
            let eye = |cell: usize| f64::from(self.height[cell]) + self.eye_height();
            Sight::new(&self.surfaces, self.scale, |cell| self.clearance[cell] > 0.0, eye)
        })
    }

    /// What is seen around a place.
    pub(super) fn panorama(&self, eye: DVec3) -> Panorama {
        let near = Panorama::new(&self.surfaces, eye);
        match &self.overview {
            Some(overview) => near.or(&Panorama::beyond(&self.surfaces.cells, overview, eye)),
            None => near,
        }
    }

    /// Where most of the model is within so many metres of a place of the fine map; the place itself
    /// where there is nothing.
    pub(super) fn focus_near(&self, place: DVec3, reach: f64) -> DVec3 {
        let is_near = |other: DVec2| other.distance(place.truncate()) <= reach;
        densest(&self.surfaces, &self.density, is_near).unwrap_or(place)
    }

    /// The lowest height at a place that is clear of all that stands near it: it falls by a metre for
    /// each metre away from that.
    pub(super) fn clear_height(&self, place: DVec2) -> f64 {
        let reach = DVec2::splat(CLEAR_M * self.scale);
        let height = |map: &Surfaces| {
            let away = |cell: usize| (map.cells.middle(cell) - place).length() - map.cells.side;
            let height = |cell: usize| f64::from(map.high[cell]) - away(cell).max(0.0);
            let cells = map.cells.within(place - reach, place + reach);
            cells.map(height).fold(f64::NEG_INFINITY, f64::max)
        };
        let coarse = self.overview.as_ref().map_or(f64::NEG_INFINITY, height);
        height(&self.surfaces).max(coarse) + self.eye_height()
    }

    /// Metres from the ground to the eye.
    pub(super) fn eye_height(&self) -> f64 {
        EYE_HEIGHT_M * self.scale
    }

    /// The height of the ground at a place; that of the nearest cell outside of the map.
    pub(super) fn height_at(&self, place: DVec2) -> f64 {
        let cells = &self.surfaces.cells;
        let limit = DVec2::new(cells.columns as f64, cells.rows as f64) - 0.5;
        let near = ((place - cells.corner) / cells.side).clamp(DVec2::splat(0.5), limit);
        let cell = cells.at(cells.corner + near * cells.side).unwrap_or(0);
        f64::from(self.height[cell])
    }

    /// The middle of the scene.
    pub(super) fn middle(&self) -> DVec3 {
        (self.bounds[0] + self.bounds[1]) / 2.0
    }
}

/// The product of the shares of cells with a surface in a small and in a wide square around each.
fn density(surfaces: &Surfaces, scale: f64) -> Vec<f32> {
    let cells = &surfaces.cells;
    let is_covered: Vec<bool> = (0..cells.len()).map(|cell| surfaces.is_covered(cell)).collect();
    let width = cells.side * cells.columns.max(cells.rows) as f64;
    let [near, wide] =
        [NEAR_M * scale, width * NEAR_PART].map(|reach| share(cells, &is_covered, reach));
    near.iter().zip(&wide).map(|(near, wide)| near * wide).collect()
}

/// The first of the densest cells with a surface that are in question, at its height.
fn densest(
    surfaces: &Surfaces,
    density: &[f32],
    is_in_question: impl Fn(DVec2) -> bool,
) -> Option<DVec3> {
    let cells = &surfaces.cells;
    (0..cells.len())
        .filter(|&cell| surfaces.is_covered(cell) && is_in_question(cells.middle(cell)))
        .reduce(|a, b| if density[b] > density[a] { b } else { a })
        .map(|cell| cells.middle(cell).extend(surfaces.high[cell].into()))
}

/// True where a scene is of slabs that one goes on, as roads are that someone made solid: most of
/// what it covers rises above its own bottom, but by little.
fn is_slabs(surfaces: &Surfaces, scale: f64) -> bool {
    let covered = (0..surfaces.cells.len()).filter(|&cell| surfaces.is_covered(cell));
    let mut rises: Vec<f32> =
        covered.map(|cell| surfaces.high[cell] - surfaces.low[cell]).collect();
    let middle = rises.len() / 2;
    if rises.is_empty() {
        return false;
    }
    let (_, &mut median, _) = rises.select_nth_unstable_by(middle, f32::total_cmp);
    let range = STEP_OVER_M * scale..=MAX_SLAB_M * scale;
    range.contains(&f64::from(median))
}

/// The cells of a map of what stands from `min` to `max`.
pub(super) fn cells([min, max]: [DVec2; 2], scale: f64) -> Cells {
    let margin = MARGIN_M * scale;
    let extent = max - min + 2.0 * margin;
    let side = (CELL_M * scale).max(extent.max_element() / MAX_CELLS);
    cells_of([min - margin, max + margin], side)
}

fn cells_of([min, max]: [DVec2; 2], side: f64) -> Cells {
    let count = ((max - min) / side).ceil().max(DVec2::ONE);
    Cells { corner: min, side, columns: count.x as usize, rows: count.y as usize }
}

/// A person's size in a scene of `size` metres.
pub(super) fn scale(size: DVec3) -> f64 {
    let width = if size.x.max(size.y) > 0.0 { size.x.max(size.y) } else { size.z };
    if width > 0.0 { (width * EYE_PART_OF_WIDTH / EYE_HEIGHT_M).min(1.0) } else { 1.0 }
}

/// Metres from each cell's middle to the nearest obstacle's: chamfer distances in two sweeps, at
/// most 8 % too long (Borgefors 1986).
pub(super) fn clearance(cells: &Cells, blocked: &[bool]) -> Vec<f32> {
    let side = cells.side as f32;
    let mut distance: Vec<f32> =
        blocked.iter().map(|&is| if is { 0.0 } else { f32::INFINITY }).collect();
    let mut sweep = |cell: usize, is_before: fn(usize, usize) -> bool| {
        for (beside, step) in cells.around(cell) {
            if is_before(beside, cell) {
                let length = if step[0] != 0 && step[1] != 0 { side * 4.0 / 3.0 } else { side };
                distance[cell] = distance[cell].min(distance[beside] + length);
            }
        }
    };
    (0..cells.len()).for_each(|cell| sweep(cell, |beside, cell| beside < cell));
    (0..cells.len()).rev().for_each(|cell| sweep(cell, |beside, cell| beside > cell));
    distance
}

/// The share of cells that are so in the square within `reach` metres of each.
fn share(cells: &Cells, is_so: &[bool], reach: f64) -> Vec<f32> {
    let reach = (reach / cells.side).ceil() as usize;
    // sums[row][column] counts what is before both: a row and a column more than there are cells.
    let width = cells.columns + 1;
    let mut sums = vec![0u32; width * (cells.rows + 1)];
    for row in 0..cells.rows {
        let mut line = 0;
        for column in 0..cells.columns {
            line += u32::from(is_so[row * cells.columns + column]);
            sums[(row + 1) * width + column + 1] = sums[row * width + column + 1] + line;
        }
    }
    let share = |cell: usize| {
        let (column, row) = (cell % cells.columns, cell / cells.columns);
        let (left, low) = (column.saturating_sub(reach), row.saturating_sub(reach));
        let right = (column + reach + 1).min(cells.columns);
        let high = (row + reach + 1).min(cells.rows);
        let count = sums[high * width + right] + sums[low * width + left]
            - sums[high * width + left]
            - sums[low * width + right];
        count as f32 / ((right - left) * (high - low)) as f32
    };
    (0..cells.len()).map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clearance_and_shares_are_those_of_a_slow_count() {
        let cells = Cells { corner: DVec2::ZERO, side: 2.0, columns: 17, rows: 11 };
        let blocked: Vec<bool> = (0..cells.len()).map(|cell| cell * 7919 % 37 == 3).collect();
        let clearance = clearance(&cells, &blocked);
        let shares = share(&cells, &blocked, 6.0);
        for cell in 0..cells.len() {
            let place = cells.middle(cell);
            let others = (0..cells.len()).filter(|&other| blocked[other]);
            let nearest = others
                .map(|other| (cells.middle(other) - place).length())
                .fold(f64::INFINITY, f64::min);
            let found = f64::from(clearance[cell]);
            assert!(found >= nearest * 0.94 && found <= nearest * 1.09, "{found} {nearest}");
            let near = |other: &usize| (cells.middle(*other) - place).abs().max_element() <= 6.0;
            let square: Vec<usize> = (0..cells.len()).filter(near).collect();
            let count = square.iter().filter(|&&other| blocked[other]).count();
            assert_eq!(shares[cell], count as f32 / square.len() as f32);
        }
    }

    #[test]
    fn solid_roads_are_ground_and_houses_are_not() {
        for (thick, is_road) in [(0.1, true), (2.0, true), (6.0, false)] {
            let shown = [DVec2::ZERO, DVec2::new(100.0, 40.0)];
            let mut surfaces = Surfaces::new(cells(shown, 1.0));
            // Short boxes without bottoms, end to end, their walls in every cell.
            for index in 0..200 {
                let x = f64::from(index) * 0.5;
                let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
                surfaces.add([at(x, 16.0, 0.0), at(x, 24.0, 0.0), at(x, 24.0, thick)]);
                surfaces.add([at(x, 16.0, 0.0), at(x, 16.0, thick), at(x, 24.0, thick)]);
            }
            let plan = Plan::new(crate::mesh::UpAxis::Z, DVec3::ZERO);
            let bounds = [DVec3::ZERO, DVec3::new(100.0, 40.0, thick)];
            let ground = Ground::new(plan, 1.0, bounds, surfaces, None);
            let cell = ground.surfaces.cells.at(DVec2::new(50.0, 20.0)).unwrap();
            assert_eq!(ground.clearance[cell] > 0.0, is_road, "{thick}");
            let expected = if is_road { thick } else { 0.0 };
            assert!((f64::from(ground.height[cell]) - expected).abs() < 0.2, "{thick}");
        }
    }
}
