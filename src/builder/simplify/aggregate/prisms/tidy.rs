//! Regions without crumbs.

use std::cmp::Reverse;
use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::heights::{NONE, Near};
use crate::mesh::DisjointSet;

/// Gives connected cells that are fewer than `least` to the neighbour that they have the longest
/// border with: open ones with regions all around, and parts of a region beside its largest.
pub(super) fn tidy(of_cell: &mut [u32], near: &Near, least: usize) {
    let mut joined = DisjointSet::new(of_cell.len());
    for (cell, other) in near.sides() {
        if of_cell[cell] == of_cell[other] {
            joined.join(cell as u32, other as u32);
        }
    }
    // The open around all starts in a corner.
    for &cell in near.cells.iter().filter(|&&cell| of_cell[cell as usize] == NONE) {
        if near.is_outermost(cell as usize) {
            joined.join(0, cell);
        }
    }
    let mut roots = vec![0; of_cell.len()];
    let mut cells = vec![0u32; of_cell.len()];
    for &cell in &near.cells {
        let root = joined.root(cell);
        roots[cell as usize] = root;
        cells[root as usize] += 1;
    }
    let mut largest: FxHashMap<u32, (u32, u32)> = FxHashMap::default();
    let counted = || near.cells.iter().map(|&root| (root, cells[root as usize]));
    for (root, count) in counted().filter(|&(_, count)| count > 0) {
        let known = largest.entry(of_cell[root as usize]).or_default();
        *known = (*known).max((count, root));
    }
    largest.insert(NONE, (u32::MAX, joined.root(0)));
    let is_crumb = |&(root, count): &(u32, u32)| {
        (1..least as u32).contains(&count) && largest[&of_cell[root as usize]].1 != root
    };
    let mut crumbs: Vec<(u32, u32)> =
        counted().filter(is_crumb).map(|(root, count)| (count, root)).collect();
    if crumbs.is_empty() {
        return;
    }
    crumbs.sort_unstable();
    // By crumb, the lengths of its borders.
    let mut borders: FxHashMap<u32, BTreeMap<u32, u32>> =
        crumbs.iter().map(|&(_, root)| (root, BTreeMap::new())).collect();
    for (cell, other) in near.sides() {
        let [a, b] = [roots[cell], roots[other]];
        if a != b {
            for (of, to) in [(a, b), (b, a)] {
                if cells[of as usize] < least as u32
                    && let Some(borders) = borders.get_mut(&of)
                {
                    *borders.entry(to).or_default() += 1;
                }
            }
        }
    }
    let mut label: FxHashMap<u32, u32> = FxHashMap::default();
    for (_, crumb) in crumbs {
        let around = borders[&crumb].iter();
        if let Some((to, _)) = around.max_by_key(|&(to, length)| (*length, Reverse(*to))) {
            let of_neighbour = label.get(to).copied().unwrap_or(of_cell[*to as usize]);
            label.insert(crumb, of_neighbour);
        }
    }
    for &cell in &near.cells {
        let root = roots[cell as usize];
        if cells[root as usize] < least as u32
            && let Some(&given) = label.get(&root)
        {
            of_cell[cell as usize] = given;
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, dvec2};

    use super::super::heights::Grid;
    use super::*;

    fn tidied(rows: &[&str], least: usize) -> Vec<String> {
        let (columns, margin) = (rows[0].len(), 3);
        let size = dvec2(columns as f64, rows.len() as f64);
        let grid = Grid::over(DVec2::ZERO, size, 1.0, margin);
        let place = |row: usize, column: usize| (row + margin) * grid.columns + column + margin;
        let mut cells = vec![NONE; grid.cells()];
        for (row, text) in rows.iter().enumerate() {
            for (column, c) in text.chars().enumerate() {
                cells[place(row, column)] = c.to_digit(10).unwrap_or(NONE);
            }
        }
        let near = Near::of(&cells, &grid, 1);
        tidy(&mut cells, &near, least);
        let symbol = |cell: u32| char::from_digit(cell, 10).unwrap_or('.');
        let of_row = |row| (0..columns).map(|column| symbol(cells[place(row, column)])).collect();
        (0..rows.len()).map(of_row).collect()
    }

    #[test]
    fn holes_and_crumbs_go_and_what_is_large_or_whole_stays() {
        let rows = [
            "..........",
            ".00000.2..",
            ".0.0.0....",
            ".0000011..",
            ".0...01...",
            ".0...0.0..",
            ".00000....",
            "..........",
        ];
        let expected = [
            "..........",
            ".00000.2..",
            ".00000....",
            ".0000011..",
            ".0...01...",
            ".0...0....",
            ".00000....",
            "..........",
        ];
        assert_eq!(tidied(&rows, 4), expected);
        assert_eq!(tidied(&rows, 1), rows);
    }
}
