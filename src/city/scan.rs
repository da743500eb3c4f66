//! One block as a mesh: the façade as a displaced scan grid, with roofs and ground around it.

use super::facade::{Facade, House};
use super::grid::{Corner, Grid};
use super::holes::Holes;
use super::layout::{BlockPlacement, HALF_STREET, HOUSE_DEPTH, turn};
use super::sampling::Sampling;
use crate::random::{hash, mix};

/// Steps of the lattice that all coordinates lie on, to the metre: four decimals are exact.
pub(super) const STEPS_PER_METRE: f64 = 10_000.0;
/// Steps of texture coordinates across the texture: six decimals are exact.
pub(super) const TEXCOORD_STEPS: u32 = 1_000_000;

/// Largest displacement of a sample by noise, metres.
const NOISE: f64 = 0.015;
/// Largest shift of a sample within the façade, in sample spacings.
const JITTER: f64 = 0.08;
/// Largest displacement of roof and ground by noise, metres.
const COARSE_NOISE: f64 = 0.02;
/// How far the ridge of a roof rises over its eaves, as a share of the height above ground.
const RIDGE: f64 = 0.15;
/// The pavement's width and its height above the road, metres.
const PAVEMENT: f64 = 3.0;
const KERB: f64 = 0.12;
/// How far the ground reaches under the façades, below the deepest setback, metres.
const GROUND_BEHIND: f64 = 0.7;
/// Never a vertex.
const ABSENT: u32 = u32::MAX;

/// A block's mesh in whole steps. Textured vertices and triangles come first.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scan {
    /// Lattice steps from the origin of the block.
    pub(super) positions: Vec<[i32; 3]>,
    /// Of the façade's vertices, which come first. v grows downwards.
    pub(super) texcoords: Vec<[u32; 2]>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// How many of the triangles, from the first, are façade.
    pub(super) facade_triangles: usize,
    /// Between façade samples, metres.
    pub(super) spacing: f64,
}

/// Samples a block.
pub(super) fn scan(
    facade: &Facade,
    placement: &BlockPlacement,
    sampling: &Sampling,
    seed: u64,
) -> Scan {
    let mut scanner = Scanner {
        facade,
        grid: &sampling.grid,
        seed,
        is_closed: sampling.ground.is_none(),
        scan: Scan {
            positions: Vec::new(),
            texcoords: Vec::new(),
            triangles: Vec::with_capacity(sampling.triangle_count() as usize),
            facade_triangles: 0,
            spacing: sampling.spacing,
        },
    };
    let vertices = scanner.front(sampling.holes);
    scanner.shell(sampling, &vertices);
    if let Some(cells) = sampling.ground {
        scanner.ground(placement.ground_overhang, cells);
    }
    let mut scan = scanner.scan;
    for [x, y, _] in &mut scan.positions {
        [*x, *y] = turn(placement.turns, [*x, *y]);
    }
    scan
}

struct Scanner<'a> {
    facade: &'a Facade,
    grid: &'a Grid,
    seed: u64,
    is_closed: bool,
    scan: Scan,
}

/// Three numbers in −1..1 from 64 bits.
fn signed_noise(bits: u64) -> [f64; 3] {
    [0, 21, 42].map(|shift| ((bits >> shift) & 0x1f_ffff) as f64 / f64::from(0x10_0000) - 1.0)
}

impl Scanner<'_> {
    fn push(&mut self, position: [f64; 3]) -> u32 {
        let vertex = self.scan.positions.len() as u32;
        self.scan.positions.push(position.map(|metres| (metres * STEPS_PER_METRE).round() as i32));
        vertex
    }

    fn x(&self, column: u32) -> f64 {
        f64::from(column) / f64::from(self.grid.columns) * self.facade.length
    }

    fn z(&self, row: u32) -> f64 {
        f64::from(row) / f64::from(self.grid.rows) * self.facade.height
    }

    /// The façade's samples, column by column as a scanner passes them. Returns the vertex of each
    /// grid corner, [`ABSENT`] where no cell uses it.
    fn front(&mut self, hole_count: u64) -> Vec<u32> {
        let (facade, grid) = (self.facade, self.grid);
        let holes = Holes::draw(facade, grid, self.seed, hole_count);
        let stride = grid.rows as usize + 1;
        let corner = |column: u32, row: u32| column as usize * stride + row as usize;
        let house_of_column = grid.house_of_columns();
        let reach = |column: u32| {
            house_of_column.get(column as usize).map_or(0, |&house| grid.roofs[house as usize])
        };

        let mut vertices = vec![ABSENT; stride * (grid.columns as usize + 1)];
        for column in 0..grid.columns {
            for row in 0..reach(column) {
                if holes.has(column, row) {
                    for (c, r) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                        vertices[corner(column + c, row + r)] = 0;
                    }
                }
            }
        }
        let floors: Vec<Vec<Option<u32>>> = facade
            .houses
            .iter()
            .map(|house| (0..=grid.rows).map(|row| house.window_floor(self.z(row))).collect())
            .collect();
        let ledges: Vec<Vec<f64>> = facade
            .houses
            .iter()
            .map(|house| {
                let spacing = facade.height / f64::from(grid.rows);
                (0..=grid.rows).map(|row| house.ledge_at(self.z(row), spacing)).collect()
            })
            .collect();
        let spacing =
            [facade.length / f64::from(grid.columns), facade.height / f64::from(grid.rows)];
        for column in 0..=grid.columns {
            // The corners between two houses are the right one's.
            let index = house_of_column[column.min(grid.columns - 1) as usize] as usize;
            let house: &House = &facade.houses[index];
            let x = self.x(column);
            let window = house.window_column(x);
            let column_noise = mix(self.seed ^ u64::from(column));
            for row in 0..=grid.rows {
                let vertex = &mut vertices[corner(column, row)];
                if *vertex == ABSENT {
                    continue;
                }
                let recess = match (window, floors[index][row as usize]) {
                    (Some(window), Some(floor)) => house.recess(floor, window),
                    _ => -ledges[index][row as usize],
                };
                let [jitter_x, jitter_z, noise] = signed_noise(mix(column_noise ^ u64::from(row)));
                let is_inner = |at: u32, end: u32| f64::from(u8::from(at > 0 && at < end));
                let jitter_x = jitter_x * JITTER * spacing[0] * is_inner(column, grid.columns);
                let jitter_z = jitter_z * JITTER * spacing[1] * is_inner(row, grid.rows);
                *vertex = self.push([
                    x + jitter_x,
                    house.setback + recess + noise * NOISE,
                    self.z(row) + jitter_z,
                ]);
                self.scan.texcoords.push([
                    texcoord(column, grid.columns),
                    TEXCOORD_STEPS - texcoord(row, grid.rows),
                ]);
            }
        }
        for column in 0..grid.columns {
            for row in 0..reach(column) {
                if holes.has(column, row) {
                    let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                        .map(|(right, up)| vertices[corner(column + right, row + up)]);
                    self.scan.triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        self.scan.facade_triangles = self.scan.triangles.len();
        vertices
    }

    /// Roofs and walls behind the façade: welded to it where the block is closed, else with a
    /// border of their own, as the aerial scan that they stand for would have.
    fn shell(&mut self, sampling: &Sampling, vertices: &[u32]) {
        let shell = &sampling.shell;
        let front: Vec<u32> = shell
            .front()
            .iter()
            .map(|&(column, row)| {
                if self.is_closed {
                    let stride = self.grid.rows as usize + 1;
                    vertices[column as usize * stride + row as usize]
                } else {
                    self.push([self.x(column), self.eaves(column, row), self.z(row)])
                }
            })
            .collect();
        let first_ring_vertex = self.scan.positions.len() as u32;
        for (ring, corner) in shell.ring_vertices() {
            let share = f64::from(ring) / f64::from(shell.rings());
            self.push_ring_vertex(share, ring, corner);
        }
        self.scan.triangles.extend(shell.triangles(&front, first_ring_vertex));
    }

    /// How far back the roof begins above a corner.
    fn eaves(&self, column: u32, row: u32) -> f64 {
        let house = self
            .facade
            .houses
            .iter()
            .zip(self.grid.bounds.windows(2))
            .find(|(_, bounds)| column >= bounds[0] && column < bounds[1]);
        let house = house.map(|(house, _)| house).or(self.facade.houses.last());
        if row == 0 { 0.0 } else { house.map_or(0.0, |house| house.setback) }
    }

    fn push_ring_vertex(&mut self, share: f64, ring: u32, (column, row): Corner) {
        let key = u64::from(column) << 32 | u64::from(row);
        let [_, along_y, along_z] = signed_noise(hash(self.seed ^ 0x0f, key, ring.into()));
        // A gable: the ridge is half way. Scaling the height keeps lower corners below higher ones.
        let rise = 1.0 + RIDGE * (1.0 - (2.0 * share - 1.0).abs());
        let noise = if row > 0 && share < 1.0 { COARSE_NOISE } else { 0.0 };
        self.push([
            self.x(column),
            HOUSE_DEPTH * share + along_y * noise,
            self.z(row) * rise + along_z * noise,
        ]);
    }

    /// Pavement and road up to the middle of the street.
    fn ground(&mut self, overhang: f64, [along, across]: [u32; 2]) {
        let first = self.scan.positions.len() as u32;
        let length = self.facade.length + 2.0 * overhang;
        for row in 0..=across {
            let y =
                f64::from(row) / f64::from(across) * (HALF_STREET + GROUND_BEHIND) - HALF_STREET;
            let level = if y < -PAVEMENT { -KERB } else { 0.0 };
            for column in 0..=along {
                let key = u64::from(column) << 32 | u64::from(row);
                let [noise, ..] = signed_noise(hash(self.seed ^ 0xf0, key, 0));
                let x = f64::from(column) / f64::from(along) * length - overhang;
                self.push([x, y, level + noise * COARSE_NOISE]);
            }
        }
        let vertex = |column: u32, row: u32| first + row * (along + 1) + column;
        for row in 0..across {
            for column in 0..along {
                let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)]
                    .map(|(right, back)| vertex(column + right, row + back));
                self.scan.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
}

fn texcoord(at: u32, end: u32) -> u32 {
    (u64::from(at) * u64::from(TEXCOORD_STEPS) / u64::from(end.max(1))) as u32
}
