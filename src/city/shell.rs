//! Roofs, side walls and (where the block is closed) base and back of a row of houses.
//!
//! The outline of the façade's grid is lofted backwards over a few rings that keep only some of
//! its corners; the last ring is capped by the back wall.

use std::collections::BTreeMap;

use super::grid::{Corner, Grid};

/// Which corners of the outline the rings keep, and how many rings there are.
#[derive(Clone, Debug)]
pub(super) struct Shell {
    /// The fine outline, as [`Grid::outline`] gives it; without the ground where open.
    outline: Vec<Corner>,
    /// Ascending indices into the outline, always with the first and all corners where it turns.
    kept: Vec<usize>,
    rings: u32,
    closed: bool,
}

/// Every how many-th row of a vertical step is kept.
const ROW_STRIDE: u32 = 6;

impl Shell {
    /// Keeps `extra_columns` of the columns between the houses' ends, evenly spread.
    pub(super) fn new(grid: &Grid, rings: u32, extra_columns: u32, closed: bool) -> Self {
        let keeps_column = kept_columns(grid, extra_columns);
        let mut outline = grid.outline();
        if !closed {
            outline.truncate(grid.outline_above_ground());
        }
        let count = outline.len();
        let keeps = |&index: &usize| {
            let (column, row) = outline[index];
            let before = outline[(index + count - 1) % count];
            let after = outline[(index + 1) % count];
            let is_end = !closed && (index == 0 || index + 1 == count);
            let is_vertical = before.0 == column && after.0 == column;
            let is_level = before.1 == row && after.1 == row;
            is_end
                || if is_vertical {
                    row % ROW_STRIDE == 0
                } else {
                    !is_level || keeps_column[column as usize]
                }
        };
        let kept = (0..count).filter(keeps).collect();
        Self { outline, kept, rings, closed }
    }

    /// The most extra columns that a grid has.
    pub(super) fn max_extra_columns(grid: &Grid) -> u32 {
        grid.columns + 1 - grid.bounds.len() as u32
    }

    /// How many triangles one more extra column makes in a closed shell: two quads a ring, one
    /// above and one below.
    pub(super) fn triangles_per_extra_column(rings: u32) -> u32 {
        4 * rings
    }

    /// The number that [`Shell::triangles`] returns.
    pub(super) fn triangle_count(&self) -> u64 {
        let corners = [self.outline.len(), self.kept.len()].map(|count| count as u64);
        let [fine, kept] = if self.closed { corners } else { corners.map(|count| count - 1) };
        let loft = fine + kept + 2 * kept * u64::from(self.rings - 1);
        if self.closed { loft + kept - 2 } else { loft }
    }

    /// How many rings there are behind the outline.
    pub(super) fn rings(&self) -> u32 {
        self.rings
    }

    /// The corners whose front vertices the shell starts from.
    pub(super) fn front(&self) -> &[Corner] {
        &self.outline
    }

    /// Ring (1 to `rings`) and corner of each further vertex.
    pub(super) fn ring_vertices(&self) -> impl Iterator<Item = (u32, Corner)> {
        (1..=self.rings)
            .flat_map(move |ring| self.kept.iter().map(move |&index| (ring, self.outline[index])))
    }

    /// The triangles, outward and counter-clockwise, of `front` vertices (one for each corner of
    /// [`Shell::front`]) and the ring vertices, numbered from `first_ring_vertex` in their order.
    pub(super) fn triangles(&self, front: &[u32], first_ring_vertex: u32) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.triangle_count() as usize);
        let per_ring = self.kept.len() as u32;
        let ring_vertex = |ring: u32, kept: usize| {
            first_ring_vertex + (ring - 1) * per_ring + (kept % self.kept.len()) as u32
        };
        let edges = if self.closed { self.kept.len() } else { self.kept.len() - 1 };
        for edge in 0..edges {
            let (a, b) = (ring_vertex(1, edge), ring_vertex(1, edge + 1));
            let from = self.kept[edge];
            let to = if edge + 1 < self.kept.len() {
                self.kept[edge + 1]
            } else {
                self.outline.len() + self.kept[0]
            };
            let vertex = |index: usize| front[index % front.len()];
            let middle = from + (to - from) / 2;
            triangles.extend((from..middle).map(|i| [vertex(i + 1), vertex(i), a]));
            triangles.push([b, vertex(middle), a]);
            triangles.extend((middle..to).map(|i| [vertex(i + 1), vertex(i), b]));
            for ring in 1..self.rings {
                let (a, b) = (ring_vertex(ring, edge), ring_vertex(ring, edge + 1));
                let (c, d) = (ring_vertex(ring + 1, edge), ring_vertex(ring + 1, edge + 1));
                triangles.extend([[b, a, c], [b, c, d]]);
            }
        }
        if self.closed {
            self.cap(first_ring_vertex + (self.rings - 1) * per_ring, &mut triangles);
        }
        triangles
    }

    /// The back wall: between neighbouring kept columns, the vertices of both sides zipped upwards.
    fn cap(&self, first_vertex: u32, triangles: &mut Vec<[u32; 3]>) {
        let mut columns: BTreeMap<u32, Vec<(u32, u32)>> = BTreeMap::new();
        for (&index, vertex) in self.kept.iter().zip(first_vertex..) {
            let (column, row) = self.outline[index];
            columns.entry(column).or_default().push((row, vertex));
        }
        columns.values_mut().for_each(|column| column.sort_unstable());
        let columns: Vec<_> = columns.into_iter().collect();
        let mut roofs = self.roofs_by_column();
        for pair in columns.windows(2) {
            let ((left, left_side), (_, right_side)) = (&pair[0], &pair[1]);
            let roof = roofs.remove(left).unwrap_or(0);
            let upto = |side: &[(u32, u32)]| side.partition_point(|&(row, _)| row <= roof);
            zip_sides(&left_side[..upto(left_side)], &right_side[..upto(right_side)], triangles);
        }
    }

    /// The height of the roof to the right of each column, from the level stretches of the outline.
    fn roofs_by_column(&self) -> BTreeMap<u32, u32> {
        self.outline
            .windows(2)
            .filter(|pair| pair[0].1 == pair[1].1 && pair[1].0 < pair[0].0)
            .map(|pair| (pair[1].0, pair[1].1))
            .collect()
    }
}

/// Which columns the rings keep: the ends of the houses and `extra` others, evenly spread.
fn kept_columns(grid: &Grid, extra: u32) -> Vec<bool> {
    let mut keeps = vec![false; grid.columns as usize + 1];
    for &bound in &grid.bounds {
        keeps[bound as usize] = true;
    }
    let others: Vec<usize> = (0..keeps.len()).filter(|&column| !keeps[column]).collect();
    let (count, extra) = (others.len() as u64, u64::from(extra).min(others.len() as u64));
    for (&column, number) in others.iter().zip(0u64..) {
        keeps[column] = (number + 1) * extra / count > number * extra / count;
    }
    keeps
}

/// Triangles between two upright chains of (row, vertex) that begin and end at equal rows; they
/// face away from the street.
fn zip_sides(left: &[(u32, u32)], right: &[(u32, u32)], triangles: &mut Vec<[u32; 3]>) {
    let (mut l, mut r) = (0, 0);
    while l + 1 < left.len() || r + 1 < right.len() {
        let climbs_left = r + 1 == right.len()
            || (l + 1 < left.len() && (left[l + 1].0, right[r].0) <= (right[r + 1].0, left[l].0));
        if climbs_left {
            triangles.push([left[l].1, left[l + 1].1, right[r].1]);
            l += 1;
        } else {
            triangles.push([left[l].1, right[r + 1].1, right[r].1]);
            r += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skyline() -> Grid {
        let roofs = vec![9, 14, 14, 5];
        Grid { columns: 30, rows: 14, bounds: vec![0, 9, 15, 22, 30], roofs }
    }

    #[test]
    fn counts_are_known_beforehand() {
        for closed in [false, true] {
            for rings in [1, 2, 5] {
                for extra in [0, 1, 7, Shell::max_extra_columns(&skyline())] {
                    let shell = Shell::new(&skyline(), rings, extra, closed);
                    let front: Vec<u32> = (0..shell.front().len() as u32).collect();
                    let triangles = shell.triangles(&front, front.len() as u32);
                    assert_eq!(triangles.len() as u64, shell.triangle_count());
                }
            }
        }
    }

    #[test]
    fn an_extra_column_adds_the_promised_triangles() {
        let count = |extra| Shell::new(&skyline(), 3, extra, true).triangle_count();
        assert_eq!(count(1) - count(0), u64::from(Shell::triangles_per_extra_column(3)));
        assert_eq!(count(9) - count(8), u64::from(Shell::triangles_per_extra_column(3)));
    }

    #[test]
    fn the_closed_shell_has_one_border_and_it_is_the_outline() {
        let shell = Shell::new(&skyline(), 3, 5, true);
        let front: Vec<u32> = (0..shell.front().len() as u32).collect();
        let mut edges = std::collections::BTreeSet::new();
        for [a, b, c] in shell.triangles(&front, front.len() as u32) {
            for edge in [(a, b), (b, c), (c, a)] {
                assert!(edges.insert(edge), "edge {edge:?} is used twice in one direction");
            }
        }
        let border: Vec<_> = edges.iter().filter(|&&(a, b)| !edges.contains(&(b, a))).collect();
        assert_eq!(border.len(), front.len());
        for &&(a, b) in &border {
            assert_eq!((b + 1) % front.len() as u32, a, "the façade goes the other way");
        }
    }
}
