//! The borders of regions, as arcs between the places where several meet.

use glam::{DVec2, IVec2, dvec2, ivec2};
use rustc_hash::FxHashMap;

use super::heights::{Grid, NONE, Near};

/// A border of two regions, in corners of cells.
#[derive(Clone, Debug)]
pub(super) struct Arc {
    /// The regions at its left and right, [`NONE`] for the open.
    pub sides: [u32; 2],
    /// The middles of the sides of cells that it follows, between its ends where it has some;
    /// without those on straight lines.
    pub points: Vec<DVec2>,
    /// Where it begins and ends among other arcs; `None` where it is closed.
    pub nodes: Option<[IVec2; 2]>,
    /// The steps that it begins and ends with.
    steps: [usize; 2],
}

/// An arc, and whether it is walked from its beginning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct HalfArc {
    pub arc: usize,
    pub forward: bool,
}

/// Right, up, left, down.
const STEPS: [IVec2; 4] = [IVec2::X, IVec2::Y, IVec2::NEG_X, IVec2::NEG_Y];

struct Walker<'a> {
    regions: &'a [u32],
    grid: &'a Grid,
    /// By corner, a bit for each step that an arc has.
    walked: Vec<u8>,
}

/// All borders between the regions of cells.
pub(super) fn arcs(regions: &[u32], near: &Near, grid: &Grid) -> Vec<Arc> {
    let corners = (grid.columns + 1) * (grid.rows + 1);
    let mut walker = Walker { regions, grid, walked: vec![0; corners] };
    let mut arcs = Vec::new();
    // Borders are at the lower left of cells that are near.
    let at_border: Vec<u32> =
        near.cells.iter().copied().filter(|&cell| walker.is_at_border(cell as usize)).collect();
    for only_nodes in [true, false] {
        for cell in at_border.iter().map(|&cell| cell as usize) {
            let corner = ivec2((cell % grid.columns) as i32, (cell / grid.columns) as i32);
            if only_nodes && !walker.is_node(corner) {
                continue;
            }
            for step in 0..4 {
                if walker.is_border(corner, step) && !walker.is_walked(corner, step) {
                    arcs.push(walker.walk(corner, step));
                }
            }
        }
    }
    arcs
}

impl Walker<'_> {
    /// The cells around a corner: lower left, lower right, upper left, upper right. Corners of
    /// cells near bodies are within the grid.
    fn around(&self, cell: usize) -> [u32; 4] {
        let below = cell - self.grid.columns;
        [self.regions[below - 1], self.regions[below], self.regions[cell - 1], self.regions[cell]]
    }

    /// Whether not all cells around the lower left corner of one are of one region.
    fn is_at_border(&self, cell: usize) -> bool {
        let [a, b, c, d] = self.around(cell);
        a != b || a != c || a != d
    }

    fn sides(&self, corner: IVec2, step: usize) -> [u32; 2] {
        let cell = corner.y as usize * self.grid.columns + corner.x as usize;
        let [lower_left, lower_right, upper_left, upper_right] = self.around(cell);
        match step {
            0 => [upper_right, lower_right],
            1 => [upper_left, upper_right],
            2 => [lower_left, upper_left],
            _ => [lower_right, lower_left],
        }
    }

    fn is_border(&self, corner: IVec2, step: usize) -> bool {
        let [left, right] = self.sides(corner, step);
        left != right
    }

    fn is_node(&self, corner: IVec2) -> bool {
        (0..4).filter(|&step| self.is_border(corner, step)).count() > 2
    }

    fn number(&self, corner: IVec2) -> usize {
        corner.y as usize * (self.grid.columns + 1) + corner.x as usize
    }

    fn is_walked(&self, corner: IVec2, step: usize) -> bool {
        self.walked[self.number(corner)] & 1 << step != 0
    }

    fn walk(&mut self, start: IVec2, first: usize) -> Arc {
        let sides = self.sides(start, first);
        let (mut corner, mut step) = (start, first);
        let mut points: Vec<DVec2> = Vec::new();
        loop {
            let next = corner + STEPS[step];
            for (corner, step) in [(corner, step), (next, (step + 2) % 4)] {
                let number = self.number(corner);
                self.walked[number] |= 1 << step;
            }
            let point = (corner + next).as_dvec2() * 0.5;
            // Of three on a straight line the middle one is none.
            if let &[.., p, q] = &points[..]
                && (q - p).perp_dot(point - q) == 0.0
            {
                points.pop();
            }
            points.push(point);
            corner = next;
            if corner == start || self.is_node(corner) {
                break;
            }
            let onward = (0..4).find(|&to| to != (step + 2) % 4 && self.is_border(corner, to));
            let Some(onward) = onward else { break };
            step = onward;
        }
        let nodes = self.is_node(corner).then_some([start, corner]);
        Arc { sides, points, nodes, steps: [first, step] }
    }
}

impl HalfArc {
    fn nodes(self, arcs: &[Arc]) -> Option<[IVec2; 2]> {
        arcs[self.arc].nodes.map(|[a, b]| if self.forward { [a, b] } else { [b, a] })
    }

    /// The steps that it begins and ends with, walked this way.
    fn steps(self, arcs: &[Arc]) -> [usize; 2] {
        let [a, b] = arcs[self.arc].steps;
        if self.forward { [a, b] } else { [(b + 2) % 4, (a + 2) % 4] }
    }

    /// The region at its left.
    fn region(self, arcs: &[Arc]) -> u32 {
        arcs[self.arc].sides[usize::from(!self.forward)]
    }
}

/// The rings around each region, which is at their left: the outer ones run counter-clockwise.
pub(super) fn rings(arcs: &[Arc]) -> Vec<(u32, Vec<HalfArc>)> {
    let all = (0..arcs.len()).flat_map(|arc| [true, false].map(|forward| HalfArc { arc, forward }));
    let halves: Vec<HalfArc> = all.filter(|half| half.region(arcs) != NONE).collect();
    let mut starting: FxHashMap<(u32, IVec2), Vec<HalfArc>> = FxHashMap::default();
    for &half in &halves {
        if let Some([start, _]) = half.nodes(arcs) {
            starting.entry((half.region(arcs), start)).or_default().push(half);
        }
    }
    let mut used = vec![[false; 2]; arcs.len()];
    let mut rings = Vec::new();
    for &half in &halves {
        if used[half.arc][usize::from(half.forward)] {
            continue;
        }
        let region = half.region(arcs);
        let mut ring = Vec::new();
        let mut next = Some(half);
        while let Some(half) = next {
            used[half.arc][usize::from(half.forward)] = true;
            ring.push(half);
            next = half.nodes(arcs).and_then(|[_, end]| {
                let [_, step] = half.steps(arcs);
                // Left first: where two of its cells touch in a corner it stays with the one it is at.
                let turn = |onward: &&HalfArc| (step + 6 - onward.steps(arcs)[0]) % 4;
                let onward = starting.get(&(region, end))?.iter().min_by_key(turn).copied()?;
                (!used[onward.arc][usize::from(onward.forward)]).then_some(onward)
            });
        }
        rings.push((region, ring));
    }
    rings
}

/// Twice the area that a ring of points is around; negative where it runs clockwise.
pub(super) fn twice_area(points: &[DVec2]) -> f64 {
    let Some(&first) = points.first() else { return 0.0 };
    let around = points.iter().zip(points.iter().cycle().skip(1));
    around.map(|(&a, &b)| (a - first).perp_dot(b - first)).sum()
}

/// A node as a point.
pub(super) fn point(node: IVec2) -> DVec2 {
    dvec2(node.x.into(), node.y.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(rows: &[&str]) -> (Vec<u32>, Grid) {
        let size = dvec2(rows[0].len() as f64, rows.len() as f64);
        let grid = Grid::over(DVec2::ZERO, size, 1.0, 2);
        let mut regions = vec![NONE; grid.cells()];
        for (row, text) in rows.iter().enumerate() {
            for (column, c) in text.chars().enumerate() {
                regions[(row + 2) * grid.columns + column + 2] = c.to_digit(10).unwrap_or(NONE);
            }
        }
        (regions, grid)
    }

    fn arcs_of(rows: &[&str]) -> Vec<Arc> {
        let (regions, grid) = of(rows);
        arcs(&regions, &Near::of(&regions, &grid, 1), &grid)
    }

    /// Twice the areas of all rings by region, and how many rings each has.
    fn areas(rows: &[&str]) -> Vec<(u32, f64, usize)> {
        let arcs = arcs_of(rows);
        let mut areas = std::collections::BTreeMap::<u32, (f64, usize)>::new();
        for (region, ring) in rings(&arcs) {
            let mut points = Vec::new();
            for half in ring {
                let arc = &arcs[half.arc];
                let ends = |n: usize| arc.nodes.map(|nodes| point(nodes[n]));
                let mut all: Vec<DVec2> = ends(0).into_iter().collect();
                all.extend(&arc.points);
                all.extend(ends(1));
                if !half.forward {
                    all.reverse();
                }
                points.extend(all);
            }
            let known = areas.entry(region).or_default();
            *known = (known.0 + twice_area(&points), known.1 + 1);
        }
        areas.into_iter().map(|(region, (area, rings))| (region, area, rings)).collect()
    }

    #[test]
    fn rings_are_around_the_cells_of_their_region() {
        // Corners are cut off by an eighth of a cell each.
        assert_eq!(areas(&["00", "00"]), [(0, 2.0 * (4.0 - 0.5), 1)]);
        // A hole, which is a ring that runs clockwise.
        let hole = areas(&["000", "0.0", "000"]);
        assert_eq!(hole, [(0, 2.0 * (9.0 - 0.5 - 0.5), 2)]);
        // Two that share a side: no corner of the border between them is cut off.
        let two = areas(&["0011", "0011"]);
        assert_eq!(two, [(0, 2.0 * (4.0 - 0.25), 1), (1, 2.0 * (4.0 - 0.25), 1)]);
    }

    #[test]
    fn cells_that_touch_in_a_corner_have_rings_of_their_own() {
        assert_eq!(rings(&arcs_of(&["0.", ".0"])).len(), 2);
        assert_eq!(areas(&["01", "10"]).iter().map(|area| area.2).collect::<Vec<_>>(), [2, 2]);
    }

    #[test]
    fn each_side_of_a_cell_is_in_one_arc() {
        let rows = ["00112.", "0.1.22", "331122", ".3.0.2"];
        let at = |x: i32, y: i32| {
            let row = usize::try_from(y).ok().and_then(|y| rows.get(y))?;
            row.as_bytes().get(usize::try_from(x).ok()?).filter(|&&c| c != b'.').copied()
        };
        let sides = (-1..=4).flat_map(|y| (-1..=6).map(move |x| (x, y)));
        let borders: i32 = sides
            .map(|(x, y)| i32::from(at(x, y) != at(x + 1, y)) + i32::from(at(x, y) != at(x, y + 1)))
            .sum();
        let arcs = arcs_of(&rows);
        // Lengths along both axes, from end to end; middles cut corners, but not along the axes.
        let length = |arc: &Arc| {
            let ends = |n: usize| arc.nodes.map(|nodes| point(nodes[n]));
            let mut all: Vec<DVec2> = ends(0).into_iter().collect();
            all.extend(&arc.points);
            all.extend(ends(1).or_else(|| arc.points.first().copied()));
            all.windows(2).map(|pair| (pair[1] - pair[0]).abs().element_sum()).sum::<f64>()
        };
        assert_eq!(arcs.iter().map(length).sum::<f64>(), f64::from(borders));
        assert!(arcs.iter().all(|arc| arc.sides[0] != arc.sides[1]));
    }
}
