//! How densely a block is sampled, so that it has the triangles that were asked for.

use super::facade::Facade;
use super::grid::Grid;
use super::layout::{HALF_STREET, HOUSE_DEPTH};
use super::shell::Shell;

/// Share of the façade's cells that occlusion and ragged borders take away.
const HOLE_SHARE: f64 = 0.05;
/// Roof and ground are sampled this much more coarsely than the façade.
const COARSENESS: f64 = 6.0;
/// More rings would come before the deepest recess.
const MAX_RINGS: f64 = 8.0;

/// A block's resolution.
#[derive(Clone, Debug)]
pub(super) struct Sampling {
    pub(super) grid: Grid,
    pub(super) shell: Shell,
    /// Cells of the ground along and across the street; `None` where the block is closed.
    pub(super) ground: Option<[u32; 2]>,
    /// Façade cells that become holes.
    pub(super) holes: u64,
    /// Between samples of the façade, metres.
    pub(super) spacing: f64,
}

impl Sampling {
    /// The resolution at which the block has `triangles`: to one triangle where there are holes
    /// to choose the size of, else to within what one more column of the roof adds.
    pub(super) fn new(facade: &Facade, overhang: f64, closed: bool, triangles: u64) -> Self {
        let at = |spacing| Self::at(facade, overhang, closed, spacing);
        // The coarsest resolution that has enough, or for a closed block the finest that has not
        // too many. The count is no exact function of the spacing (cells are whole), so the
        // bisection keeps what it has seen to hold on either side.
        let enough = |sampling: &Self| {
            if closed {
                sampling.triangle_count() > triangles
            } else {
                let removable = HOLE_SHARE * sampling.grid.cells() as f64 * 2.0;
                sampling.triangle_count() as f64 - removable >= triangles as f64
            }
        };
        let guess = (2.0 * facade.area() / triangles as f64).sqrt();
        let (mut fine, mut coarse) = (0.25 * guess, 8.0 * guess);
        for _ in 0..40 {
            let middle = 0.5 * (fine + coarse);
            if enough(&at(middle)) {
                fine = middle;
            } else {
                coarse = middle;
            }
        }
        let mut sampling = at(if closed { coarse } else { fine });
        let found = sampling.triangle_count();
        if closed {
            let rings = rings(sampling.spacing);
            let per_column = f64::from(Shell::triangles_per_extra_column(rings));
            let extra = extra_columns(&sampling.grid);
            let more = ((triangles as f64 - found as f64) / per_column).round() as i64;
            let wanted = (i64::from(extra) + more)
                .clamp(0, i64::from(Shell::max_extra_columns(&sampling.grid)));
            sampling.shell = Shell::new(&sampling.grid, rings, wanted as u32, true);
        } else {
            sampling.holes = found.saturating_sub(triangles) / 2;
        }
        sampling
    }

    fn at(facade: &Facade, overhang: f64, closed: bool, spacing: f64) -> Self {
        let grid = Grid::new(facade, spacing);
        let shell = Shell::new(&grid, rings(spacing), extra_columns(&grid), closed);
        let cells = |metres: f64| ((metres / (COARSENESS * spacing)).round() as u32).max(2);
        let ground = (!closed).then(|| [cells(facade.length + 2.0 * overhang), cells(HALF_STREET)]);
        Self { grid, shell, ground, holes: 0, spacing }
    }

    /// Triangles of façade, shell and ground.
    pub(super) fn triangle_count(&self) -> u64 {
        let ground = self.ground.map_or(0, |[along, across]| u64::from(along) * u64::from(across));
        2 * (self.grid.cells() + ground - self.holes) + self.shell.triangle_count()
    }
}

fn rings(spacing: f64) -> u32 {
    (HOUSE_DEPTH / (COARSENESS * spacing)).round().clamp(2.0, MAX_RINGS) as u32
}

fn extra_columns(grid: &Grid) -> u32 {
    (f64::from(Shell::max_extra_columns(grid)) / COARSENESS) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_triangles_is_met() {
        for seed in 0..60 {
            let facade = Facade::draw(seed, 60.0 + seed as f64);
            for triangles in [800, 2_000, 20_001, 400_000] {
                let open = Sampling::new(&facade, 7.0, false, triangles);
                assert!(open.triangle_count().abs_diff(triangles) <= 1, "{seed} {triangles}");
                let share = open.holes as f64 / open.grid.cells() as f64;
                assert!((0.03..0.25).contains(&share), "{seed} {triangles}: {share}");
                let closed = Sampling::new(&facade, 7.0, true, triangles);
                let miss = closed.triangle_count().abs_diff(triangles);
                assert!(miss as f64 <= 0.01 * triangles as f64, "{seed} {triangles}: {miss}");
            }
        }
    }
}
