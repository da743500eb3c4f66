//! Triangles in a uniform grid, for the nearest to a point.

use glam::Vec3;

use super::triangle::Triangle;
use crate::mesh::Mesh;

/// Triangles in a uniform grid over their bounding box.
pub(super) struct TriangleGrid {
    low: Vec3,
    per_cell: f32,
    cells: [i32; 3],
    /// Where each cell's triangles begin in `members`.
    first: Vec<u32>,
    /// Numbers of triangles, cell by cell.
    members: Vec<u32>,
    pub(super) triangles: Vec<Triangle>,
}

/// Cells for each triangle: more makes the search cheaper and the grid dearer.
const CELLS_PER_TRIANGLE: f32 = 4.0;

/// Most cells along an axis, so that a cell's place fits bytes.
const MOST_CELLS: i32 = 256;

/// Added to a number from 0 to 2^22 it leaves the nearest whole number in the lowest bits.
const WHOLE: f32 = 8_388_608.0;

impl TriangleGrid {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let (low, high) = mesh.bounds().unwrap_or_default();
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let size = (high - low).max(Vec3::splat((high - low).max_element() * 1e-3 + 1e-20));
        let wanted = (mesh.triangles.len() as f32 * CELLS_PER_TRIANGLE).max(1.0);
        let most = MOST_CELLS as f32;
        let side = (size.x * size.y * size.z / wanted).cbrt().max(size.max_element() / most);
        let cells = (size / side).to_array().map(|n| (n.ceil() as i32).clamp(1, MOST_CELLS));
        let corners = |&triangle: &[u32; 3]| triangle.map(|v| mesh.positions[v as usize].into());
        let corners: Vec<[Vec3; 3]> = mesh.triangles.iter().map(corners).collect();
        let triangles = corners.iter().copied().map(Triangle::new).collect();
        let count = (cells[0] * cells[1] * cells[2]) as usize;
        let (first, members) = (vec![0; count + 1], Vec::new());
        let mut grid = Self { low, per_cell: 1.0 / side, cells, first, members, triangles };
        grid.fill(&corners);
        grid
    }

    /// Lists each triangle in the cells that its box touches.
    fn fill(&mut self, corners: &[[Vec3; 3]]) {
        let boxes: Vec<[[u8; 3]; 2]> = corners
            .iter()
            .map(|&[a, b, c]| {
                [a.min(b).min(c), a.max(b).max(c)].map(|p| self.cell_at(p).map(|at| at as u8))
            })
            .collect();
        let [width, depth, _] = self.cells.map(|count| count as usize);
        let for_rows = |[from, to]: [[u8; 3]; 2], visit: &mut dyn FnMut(std::ops::Range<usize>)| {
            for z in from[2]..=to[2] {
                for y in from[1]..=to[1] {
                    let row = (usize::from(z) * depth + usize::from(y)) * width;
                    visit(row + usize::from(from[0])..row + usize::from(to[0]) + 1);
                }
            }
        };
        // Counted, summed up to where each cell ends, and filled from behind to where it begins.
        let mut ends = std::mem::take(&mut self.first);
        let mut total = 0;
        for &cells in &boxes {
            for_rows(cells, &mut |row| ends[row].iter_mut().for_each(|count| *count += 1));
        }
        for end in &mut ends {
            total += *end;
            *end = total;
        }
        self.members = vec![0; total as usize];
        for (number, &cells) in boxes.iter().enumerate().rev() {
            for_rows(cells, &mut |row| {
                for end in &mut ends[row] {
                    *end -= 1;
                    self.members[*end as usize] = number as u32;
                }
            });
        }
        self.first = ends;
    }

    /// The cell of a point, or the nearest to it. A point on a wall may count to either side.
    #[inline]
    fn cell_at(&self, point: Vec3) -> [i32; 3] {
        let at = ((point - self.low) * self.per_cell - 0.5).to_array();
        let place = |i: usize| {
            let inside = at[i].max(0.0).min((self.cells[i] - 1) as f32);
            (inside + WHOLE).to_bits() as i32 & 0x3f_ffff
        };
        [place(0), place(1), place(2)]
    }

    fn index(&self, [x, y, z]: [i32; 3]) -> usize {
        ((z * self.cells[1] + y) * self.cells[0] + x) as usize
    }

    /// The distance from `point` to the nearest triangle; any number not above `enough` where it
    /// is known not to exceed that.
    pub(super) fn distance_beyond(&self, point: Vec3, enough: f32) -> f32 {
        self.search(point, enough).0
    }

    /// The same, and the triangle.
    pub(super) fn search(&self, point: Vec3, enough: f32) -> (f32, u32) {
        let home = self.cell_at(point);
        let side = 1.0 / self.per_cell;
        // The point may lie outside of the grid.
        let outside = {
            let high = self.low
                + Vec3::new(self.cells[0] as f32, self.cells[1] as f32, self.cells[2] as f32)
                    * side;
            point.distance(point.clamp(self.low, high))
        };
        let enough_squared = enough * enough;
        let (mut best, mut nearest) = (f32::INFINITY, 0);
        let rings = self.cells[0].max(self.cells[1]).max(self.cells[2]);
        for ring in 0..=rings {
            // Nothing in this ring or beyond is nearer than this.
            let reach = (ring as f32 - 1.0) * side;
            if best <= enough_squared || (reach > 0.0 && best <= reach.max(outside).powi(2)) {
                break;
            }
            self.for_ring(home, ring, |cell| {
                let range = self.first[cell] as usize..self.first[cell + 1] as usize;
                for &triangle in &self.members[range] {
                    if best <= enough_squared {
                        return;
                    }
                    let candidate = &self.triangles[triangle as usize];
                    if candidate.squared_height(point) < best {
                        let squared = candidate.squared_distance(point);
                        if squared < best {
                            (best, nearest) = (squared, triangle);
                        }
                    }
                }
            });
        }
        (best.sqrt(), nearest)
    }

    /// Visits the cells whose largest index distance from `home` is `ring`.
    fn for_ring(&self, home: [i32; 3], ring: i32, mut visit: impl FnMut(usize)) {
        let range = |i: usize| (home[i] - ring).max(0)..=(home[i] + ring).min(self.cells[i] - 1);
        for z in range(2) {
            for y in range(1) {
                let shell = (z - home[2]).abs() == ring || (y - home[1]).abs() == ring;
                if shell {
                    for x in range(0) {
                        visit(self.index([x, y, z]));
                    }
                } else {
                    for x in [home[0] - ring, home[0] + ring] {
                        if (0..self.cells[0]).contains(&x) {
                            visit(self.index([x, y, z]));
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_trying_every_triangle() {
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let positions: Vec<[f32; 3]> =
            (0..300).map(|_| [random(), random() * 5.0, random()]).collect();
        let triangles: Vec<[u32; 3]> = (0..100).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let soup = Mesh {
            materials: vec![0; positions.len()],
            positions: positions.clone(),
            triangles: triangles.clone(),
            ..Default::default()
        };
        let grid = TriangleGrid::new(&soup);
        for _ in 0..500 {
            let p = Vec3::new(random() * 3.0 - 1.0, random() * 7.0 - 1.0, random() * 3.0 - 1.0);
            let naive = triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| Vec3::from(positions[v as usize]));
                    Triangle::new([a, b, c]).squared_distance(p)
                })
                .fold(f32::INFINITY, f32::min)
                .sqrt();
            assert_eq!(grid.distance_beyond(p, 0.0), naive);
        }
    }
}
