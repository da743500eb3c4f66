//! Islands: connected cells of a level image that a node's triangles use.
//!
//! Charts that lie side by side in the source become one island and keep their places relative to
//! each other; so do charts that use the same texels, which are then stored once.

use super::bits::BitGrid;
use super::shape::Shape;
use crate::mesh::DisjointSet;

/// The islands of one cell grid.
#[derive(Debug, Default)]
pub(crate) struct Islands {
    /// Cell of each island's bounding box's corner.
    pub origins: Vec<[usize; 2]>,
    /// The islands' cells.
    pub shapes: Vec<Shape>,
    /// `start, end, island` of each run, row after row.
    runs: Vec<(u32, u32, u32)>,
    /// Where each row's runs begin; one more than rows.
    rows: Vec<usize>,
}

impl Islands {
    /// Finds the islands: cells that share an edge belong together.
    pub fn find(grid: &BitGrid) -> Self {
        let mut labels = DisjointSet::new(0);
        let mut runs: Vec<(u32, u32, u32)> = Vec::new();
        let mut rows = vec![0];
        let mut above = 0..0;
        for y in 0..grid.height() {
            let first = runs.len();
            let mut candidate = above.start;
            for (start, end) in grid.runs(y) {
                let (start, end) = (start as u32, end as u32);
                let label = labels.push();
                while candidate < above.end && runs[candidate].1 <= start {
                    candidate += 1;
                }
                let mut touching = candidate;
                while touching < above.end && runs[touching].0 < end {
                    labels.join(label, runs[touching].2);
                    touching += 1;
                }
                runs.push((start, end, label));
            }
            above = first..runs.len();
            rows.push(runs.len());
        }
        let mut result = Self { runs, rows, ..Self::default() };
        result.collect(&mut labels);
        result
    }

    /// Numbers the islands in order of their first run and gathers their cells.
    fn collect(&mut self, labels: &mut DisjointSet) {
        let mut number = vec![u32::MAX; labels.len()];
        let mut bounds: Vec<[u32; 4]> = Vec::new();
        for y in 0..self.rows.len() - 1 {
            for run in &mut self.runs[self.rows[y]..self.rows[y + 1]] {
                let root = labels.root(run.2) as usize;
                if number[root] == u32::MAX {
                    number[root] = bounds.len() as u32;
                    bounds.push([run.0, y as u32, run.1, y as u32 + 1]);
                }
                run.2 = number[root];
                let bound = &mut bounds[run.2 as usize];
                *bound = [bound[0].min(run.0), bound[1], bound[2].max(run.1), y as u32 + 1];
            }
        }
        self.origins = bounds.iter().map(|bound| [bound[0] as usize, bound[1] as usize]).collect();
        self.shapes = bounds
            .iter()
            .map(|[left, top, right, bottom]| Shape {
                size: [(right - left) as usize, (bottom - top) as usize],
                runs: Vec::new(),
            })
            .collect();
        for y in 0..self.rows.len() - 1 {
            for (start, end, island) in &self.runs[self.rows[y]..self.rows[y + 1]] {
                let [left, top, ..] = bounds[*island as usize];
                self.shapes[*island as usize].runs.push([y as u32 - top, start - left, end - left]);
            }
        }
    }

    /// The island of a cell, or `None` where it is not used.
    pub fn at(&self, x: usize, y: usize) -> Option<usize> {
        let runs = &self.runs[*self.rows.get(y)?..*self.rows.get(y + 1)?];
        let next = runs.partition_point(|(start, ..)| *start as usize <= x);
        let (_, end, island) = runs.get(next.checked_sub(1)?)?;
        (x < *end as usize).then_some(*island as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arms_that_meet_below_are_one_island() {
        let image = ["1.1..", "1.1.1", "111..", "....."];
        let mut grid = BitGrid::new(5, 4);
        for (y, row) in image.iter().enumerate() {
            for (x, _) in row.bytes().enumerate().filter(|(_, cell)| *cell == b'1') {
                grid.set(x, y);
            }
        }
        let islands = Islands::find(&grid);
        assert_eq!(islands.shapes.len(), 2);
        assert_eq!(islands.shapes[0].size, [3, 3]);
        assert_eq!(islands.shapes[0].area(), 7);
        assert_eq!(islands.origins, [[0, 0], [4, 1]]);
        assert_eq!(islands.at(2, 0), Some(0));
        assert_eq!(islands.at(4, 1), Some(1));
        assert_eq!(islands.at(3, 1), None);
        assert_eq!(islands.at(0, 3), None);
    }
}
