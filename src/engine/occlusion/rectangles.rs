//! Rectangles that lie wholly under a surface, as seen along a direction.
//!
//! Seen along a direction, a surface is over a point as often as its border goes round it: of the
//! triangles over the point as many more look towards the viewer than away. So where the border goes
//! round, whatever is behind is hidden, and only the border is looked at here. Of a surface that is
//! drawn from either side it is enough that an odd number of triangles is over the point, whichever
//! way each of them looks.

/// Cells along the longer side of the border, at most.
const CELLS: f64 = 96.0;

/// Rectangles of one border, at most.
const RECTANGLES: usize = 12;

/// What rounding may come to, of a cell.
const ROUNDING: f64 = 1e-6;

/// Which points are under a surface, by how often its border goes round them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FillRule {
    NonZero,
    EvenOdd,
}

/// An edge of the border of a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub ends: [[f64; 2]; 2],
    /// How many more triangles go from the first end to the second than back.
    pub turns: i32,
}

/// An upright rectangle wholly under the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rectangle {
    pub min: [f64; 2],
    pub max: [f64; 2],
    /// Whether the border goes round it to the left, as seen by who looks down on both axes: then the
    /// surface looks at them.
    pub to_the_left: bool,
    /// Of it, what no rectangle before it covers.
    pub new_area: f64,
}

/// Rectangles round which a border goes and through which it does not, from the largest down to `least`
/// in area; to within `fine` or more.
pub(super) fn rectangles(edges: &[Edge], rule: FillRule, least: f64, fine: f64) -> Vec<Rectangle> {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for end in edges.iter().flat_map(|edge| edge.ends) {
        for axis in 0..2 {
            min[axis] = min[axis].min(end[axis]);
            max[axis] = max[axis].max(end[axis]);
        }
    }
    let [width, height] = [max[0] - min[0], max[1] - min[1]];
    let side = (width.max(height) / CELLS).max(fine);
    if width * height < least || side <= 0.0 {
        return Vec::new();
    }
    let mut grid = Grid {
        columns: (width / side) as usize + 2,
        rows: (height / side) as usize + 1,
        min,
        side,
        cells: Vec::new(),
        new: Default::default(),
        heights: Vec::new(),
        stack: Vec::new(),
    };
    grid.cells = vec![Cell::default(); grid.columns * grid.rows];
    edges.iter().for_each(|edge| grid.add(edge));
    grid.sum_up();
    if rule == FillRule::EvenOdd {
        grid.cells.iter_mut().for_each(|cell| cell.turns = cell.turns.rem_euclid(2));
    }
    grid.new = SIGNS.map(|sign| NewCells::of(&grid.cells, sign));
    std::iter::from_fn(|| grid.largest(least)).take(RECTANGLES).collect()
}

#[derive(Clone, Copy, Debug, Default)]
struct Cell {
    /// How often the border goes round it.
    turns: i32,
    /// The border goes through it.
    is_border: bool,
}

impl Cell {
    fn is_free(&self, sign: i32) -> bool {
        !self.is_border && self.turns * sign > 0
    }
}

/// Ways for a border to go round: to the left and to the right.
const SIGNS: [i32; 2] = [1, -1];

/// Cells that a border goes round one way, and no rectangle covers.
#[derive(Default)]
struct NewCells {
    /// By cell: all bits, or none.
    is_new: Vec<u16>,
    /// How many there are.
    count: usize,
}

impl NewCells {
    fn of(cells: &[Cell], sign: i32) -> Self {
        let is_new = cells.iter().map(|cell| if cell.is_free(sign) { u16::MAX } else { 0 });
        let is_new: Vec<u16> = is_new.collect();
        let count = is_new.iter().filter(|&&cell| cell != 0).count();
        Self { is_new, count }
    }

    fn cover(&mut self, cells: std::ops::Range<usize>) {
        for cell in &mut self.is_new[cells] {
            self.count -= usize::from(*cell != 0);
            *cell = 0;
        }
    }
}

struct Grid {
    columns: usize,
    rows: usize,
    min: [f64; 2],
    side: f64,
    cells: Vec<Cell>,
    /// By way.
    new: [NewCells; 2],
    /// By column: new cells in a row above each other.
    heights: Vec<u16>,
    stack: Vec<usize>,
}

impl Grid {
    fn row(&mut self, row: usize) -> &mut [Cell] {
        &mut self.cells[row * self.columns..(row + 1) * self.columns]
    }

    fn add(&mut self, edge: &Edge) {
        let place = |end: [f64; 2]| [0, 1].map(|axis| (end[axis] - self.min[axis]) / self.side);
        let [a, b] = edge.ends.map(place);
        let (low, high, turns) = if a[1] < b[1] { (a, b, edge.turns) } else { (b, a, -edge.turns) };
        let at = |height: f64| low[0] + (high[0] - low[0]) * (height - low[1]) / (high[1] - low[1]);
        // Of rows whose middle it crosses, cells to the right are on its other side.
        let last = self.columns - 1;
        let first_row = |height: f64| (height - 0.5).ceil().max(0.0) as usize;
        for row in first_row(low[1])..first_row(high[1]).min(self.rows) {
            let column = (at(row as f64 + 0.5) + 0.5).floor().max(0.0) as usize;
            self.row(row)[column.min(last)].turns -= turns;
        }
        let from = (low[1] - ROUNDING).max(0.0) as usize;
        let to = ((high[1] + ROUNDING) as usize).min(self.rows - 1);
        for row in from..=to {
            let [a, b] = match high[1] - low[1] < ROUNDING {
                true => [low[0], high[0]],
                false => [0.0, 1.0].map(|end| at((row as f64 + end).clamp(low[1], high[1]))),
            };
            let (from, to) = (a.min(b) - ROUNDING, a.max(b) + ROUNDING);
            let columns = from.max(0.0) as usize..=(to as usize).min(last);
            self.row(row)[columns].iter_mut().for_each(|cell| cell.is_border = true);
        }
    }

    /// From steps along each row to turns.
    fn sum_up(&mut self) {
        for row in 0..self.rows {
            self.row(row).iter_mut().fold(0, |turns, cell| {
                cell.turns += turns;
                cell.turns
            });
        }
    }

    /// The rectangle that covers most of what is free and not yet covered.
    fn largest(&mut self, least: f64) -> Option<Rectangle> {
        let area = |cells: usize| cells as f64 * self.side * self.side;
        let is_enough = |cells: usize| cells > 0 && area(cells) >= least;
        // A surface that looks one way is usual.
        let [left, right] = [0, 1].map(|way| match is_enough(self.new[way].count) {
            true => {
                largest_new(&self.new[way].is_new, self.columns, &mut self.heights, &mut self.stack)
            }
            false => Default::default(),
        });
        let (sign, (new, columns, rows)) = if right.0 > left.0 { (-1, right) } else { (1, left) };
        if !is_enough(new) {
            return None;
        }
        let new_area = area(new);
        let (mut columns, mut rows) = (columns, rows);
        for row in rows[0]..rows[1] {
            let first = row * self.columns;
            let covered = first + columns[0]..first + columns[1];
            self.new.iter_mut().for_each(|new| new.cover(covered.clone()));
        }
        // It may reach into what others cover.
        let is_free =
            |column: usize, row: usize| self.cells[row * self.columns + column].is_free(sign);
        let in_column =
            |column: usize, rows: [usize; 2]| (rows[0]..rows[1]).all(|row| is_free(column, row));
        let in_row = |row: usize, columns: [usize; 2]| {
            (columns[0]..columns[1]).all(|column| is_free(column, row))
        };
        while columns[0] > 0 && in_column(columns[0] - 1, rows) {
            columns[0] -= 1;
        }
        while columns[1] < self.columns && in_column(columns[1], rows) {
            columns[1] += 1;
        }
        while rows[0] > 0 && in_row(rows[0] - 1, columns) {
            rows[0] -= 1;
        }
        while rows[1] < self.rows && in_row(rows[1], columns) {
            rows[1] += 1;
        }
        let place = |end: usize| [columns[end], rows[end]].map(|cells| cells as f64 * self.side);
        let [from, to] = [0, 1].map(place);
        Some(Rectangle {
            min: [0, 1].map(|axis| self.min[axis] + from[axis]),
            max: [0, 1].map(|axis| self.min[axis] + to[axis]),
            to_the_left: sign > 0,
            new_area,
        })
    }
}

/// The largest rectangle of new cells: how many they are, and its columns and rows from and to.
fn largest_new(
    is_new: &[u16],
    columns: usize,
    heights: &mut Vec<u16>,
    stack: &mut Vec<usize>,
) -> (usize, [usize; 2], [usize; 2]) {
    let mut best = (0, [0; 2], [0; 2]);
    heights.clear();
    heights.resize(columns + 1, 0);
    let mut rows = is_new.chunks_exact(columns).enumerate().peekable();
    while let Some((row, cells)) = rows.next() {
        let mut all = 0;
        for (cell, height) in cells.iter().zip(&mut *heights) {
            *height = (*height + 1) & cell;
            all += u32::from(*height);
        }
        // What all goes on in the next row is larger there.
        let goes_on =
            |below: &[u16]| cells.iter().zip(below).all(|(cell, below)| cell & !below == 0);
        if all as usize <= best.0 || rows.peek().is_some_and(|(_, below)| goes_on(below)) {
            continue;
        }
        // Each rectangle ends at the first column that is lower; none is left at the last, of 0.
        stack.clear();
        for (column, &height) in heights.iter().enumerate() {
            while let Some(&top) = stack.last()
                && heights[top] >= height
            {
                stack.pop();
                let from = stack.last().map_or(0, |&lower| lower + 1);
                let area = usize::from(heights[top]) * (column - from);
                if area > best.0 {
                    let rows = [row + 1 - usize::from(heights[top]), row + 1];
                    best = (area, [from, column], rows);
                }
            }
            stack.push(column);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::FillRule::{EvenOdd, NonZero};
    use super::*;
    use crate::random::Random;

    /// The edges of a polygon, in order.
    fn polygon(corners: &[[f64; 2]]) -> Vec<Edge> {
        let next = corners.iter().cycle().skip(1);
        corners.iter().zip(next).map(|(&a, &b)| Edge { ends: [a, b], turns: 1 }).collect()
    }

    fn square(from: f64, to: f64) -> Vec<Edge> {
        polygon(&[[from, from], [to, from], [to, to], [from, to]])
    }

    fn reversed(edges: Vec<Edge>) -> Vec<Edge> {
        edges.into_iter().map(|edge| Edge { turns: -edge.turns, ..edge }).collect()
    }

    fn area(rectangle: &Rectangle) -> f64 {
        (rectangle.max[0] - rectangle.min[0]) * (rectangle.max[1] - rectangle.min[1])
    }

    /// How often edges go round a point, by the angles that they take.
    fn turns(edges: &[Edge], [x, y]: [f64; 2]) -> i32 {
        let angle = |edge: &Edge| {
            let [[ax, ay], [bx, by]] = edge.ends.map(|[ex, ey]| [ex - x, ey - y]);
            f64::from(edge.turns) * libm::atan2(ax * by - ay * bx, ax * bx + ay * by)
        };
        (edges.iter().map(angle).sum::<f64>() / std::f64::consts::TAU).round() as i32
    }

    #[test]
    fn of_a_square_nearly_all_is_found_and_the_side_that_it_looks_to() {
        let found = rectangles(&square(2.0, 7.0), NonZero, 0.1, 0.0);
        assert!(area(&found[0]) > 0.9 * 25.0 && found[0].to_the_left, "{found:?}");
        let found = rectangles(&reversed(square(2.0, 7.0)), NonZero, 0.1, 0.0);
        assert!(area(&found[0]) > 0.9 * 25.0 && !found[0].to_the_left, "{found:?}");
        assert!(rectangles(&square(2.0, 7.0), NonZero, 25.1, 0.0).is_empty(), "too small");
        assert!(rectangles(&[], NonZero, 0.0, 0.0).is_empty());
    }

    #[test]
    fn surfaces_that_look_at_each_other_hide_nothing_and_holes_are_left_open() {
        let both = [square(0.0, 9.0), reversed(square(0.0, 9.0))].concat();
        assert!(rectangles(&both, NonZero, 0.1, 0.0).is_empty());
        let hole = [square(0.0, 9.0), reversed(square(4.0, 5.0))].concat();
        let found = rectangles(&hole, EvenOdd, 0.1, 0.0);
        let covered: f64 = found.iter().map(|rectangle| rectangle.new_area).sum();
        assert!((0.85 * 80.0..80.0).contains(&covered), "{covered}");
        for Rectangle { min, max, .. } in found {
            assert!((0..2).any(|axis| max[axis] < 4.0 || min[axis] > 5.0));
        }
    }

    #[test]
    fn borders_go_round_every_point_of_a_rectangle() {
        let mut random = Random::new(11, 0);
        let mut found = 0;
        for _ in 0..300 {
            let mut edges = Vec::new();
            for _ in 0..1 + (random.unit() * 3.0) as usize {
                let corners = 3 + (random.unit() * 9.0) as usize;
                let mut corner = |_| [0; 2].map(|_| random.between(-5.0, 5.0));
                edges.extend(polygon(&(0..corners).map(&mut corner).collect::<Vec<_>>()));
            }
            let rule = if random.unit() < 0.5 { NonZero } else { EvenOdd };
            for Rectangle { min, max, to_the_left, .. } in rectangles(&edges, rule, 0.05, 0.0) {
                found += 1;
                for _ in 0..20 {
                    let at = [0, 1].map(|axis| random.between(min[axis], max[axis]));
                    let turns = turns(&edges, at);
                    let is_under = match rule {
                        NonZero => turns.signum() == if to_the_left { 1 } else { -1 },
                        EvenOdd => turns % 2 != 0,
                    };
                    assert!(is_under, "{rule:?} {at:?} {turns}");
                }
            }
        }
        assert!(found > 1000, "{found}");
    }
}
