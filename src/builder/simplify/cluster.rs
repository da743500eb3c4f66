//! Vertex clustering (Rossignac & Borrel 1993 as Cozzi & Loo describe it, section 3): vertices
//! are graded, a uniform grid gathers them into cells, and every cell keeps its best vertex.
//!
//! Departures: the cell size is searched for so that a triangle budget is met; a cell keeps one
//! texture coordinate per chart, so that a triangle never mixes charts; locked vertices are cells
//! of their own.

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::vertex::Border;
use crate::builder::simplify::compact::compact;
use crate::mesh::{DisjointSet, Mesh, PositionKey, all_differ, key, wide};

/// Halvings of the cell size's range; the count of triangles is nearly monotone in it.
const SEARCH_STEPS: usize = 14;

/// Clusters to at most about `target` triangles; also returns the largest distance that a vertex
/// moved, metres.
pub fn cluster(
    mesh: &Mesh,
    border: &Border,
    locked: &[bool],
    target: usize,
) -> (Mesh, Border, f64) {
    let Some((low, high)) = mesh.bounds() else {
        return (mesh.clone(), border.clone(), 0.0);
    };
    let extent = (0..3).map(|i| high[i] - low[i]).fold(0.0, f32::max);
    let places = Places::of(mesh, locked);
    let (mut fine, mut coarse) = (f64::from(extent) / 4096.0, f64::from(extent) * 2.0);
    let mut best = coarse;
    for _ in 0..SEARCH_STEPS {
        let size = (fine * coarse).sqrt();
        if count(mesh, &places.cells(mesh, locked, low, size)) <= target {
            (best, coarse) = (size, size);
        } else {
            fine = size;
        }
    }
    collapse_cells(mesh, border, locked, &places, &places.cells(mesh, locked, low, best))
}

/// Distinct positions, their grades, and the chart of each vertex.
struct Places {
    /// Per vertex, the number of its position.
    place: Vec<u32>,
    /// Per position, its grade.
    grid_level: Vec<f32>,
    /// Per vertex, the smallest vertex of its chart.
    chart: Vec<u32>,
}

impl Places {
    fn of(mesh: &Mesh, locked: &[bool]) -> Self {
        let mut numbers: FxHashMap<PositionKey<f32>, u32> = FxHashMap::default();
        let place: Vec<u32> = mesh
            .positions
            .iter()
            .map(|&position| {
                let next = numbers.len() as u32;
                *numbers.entry(key(position)).or_insert(next)
            })
            .collect();
        let grid_level = grades(mesh, &place, numbers.len());
        debug_assert_eq!(locked.len(), place.len());
        Self { place, grid_level, chart: charts(mesh) }
    }

    /// The cell of each vertex.
    fn cells(&self, mesh: &Mesh, locked: &[bool], low: [f32; 3], size: f64) -> Vec<u32> {
        let mut numbers: FxHashMap<[i32; 4], u32> = FxHashMap::default();
        mesh.positions
            .iter()
            .enumerate()
            .map(|(vertex, position)| {
                let cell = if locked[vertex] {
                    [self.place[vertex] as i32, 0, 0, 1]
                } else {
                    let at = |i: usize| (f64::from(position[i] - low[i]) / size) as i32;
                    [at(0), at(1), at(2), 0]
                };
                let next = numbers.len() as u32;
                *numbers.entry(cell).or_insert(next)
            })
            .collect()
    }
}

/// Grade of each position: the probability of lying on a silhouette, cos(θ/2) with θ the largest
/// angle between two incident edges (Low & Tan 1997), times the longest incident edge.
fn grades(mesh: &Mesh, place: &[u32], places: usize) -> Vec<f32> {
    let mut first_edge: Vec<u32> = vec![0; places + 1];
    for triangle in &mesh.triangles {
        for &vertex in triangle {
            first_edge[place[vertex as usize] as usize + 1] += 2;
        }
    }
    for i in 0..places {
        first_edge[i + 1] += first_edge[i];
    }
    let mut fill = first_edge.clone();
    let mut edges = vec![glam::Vec3::ZERO; first_edge[places] as usize];
    for &triangle in &mesh.triangles {
        for turn in 0..3 {
            let vertex = triangle[turn] as usize;
            let here = glam::Vec3::from(mesh.positions[vertex]);
            for other in [triangle[(turn + 1) % 3], triangle[(turn + 2) % 3]] {
                let slot = &mut fill[place[vertex] as usize];
                edges[*slot as usize] = glam::Vec3::from(mesh.positions[other as usize]) - here;
                *slot += 1;
            }
        }
    }
    (0..places)
        .map(|at| {
            let mine = &edges[first_edge[at] as usize..first_edge[at + 1] as usize];
            // Of a fan of triangles every edge stands twice; a few directions tell the angle.
            let longest = mine.iter().map(|edge| edge.length()).fold(0.0, f32::max);
            let mut least_cosine = 1f32;
            for (i, a) in mine.iter().enumerate().take(24) {
                for b in &mine[i + 1..mine.len().min(24)] {
                    let cosine = a.dot(*b) / (a.length() * b.length()).max(f32::MIN_POSITIVE);
                    least_cosine = least_cosine.min(cosine);
                }
            }
            // cos(θ/2) = sqrt((1 + cos θ) / 2).
            (((1.0 + least_cosine) * 0.5).max(0.0).sqrt() + 1e-3) * longest
        })
        .collect()
}

/// Connected components over shared vertices, as the smallest vertex of each.
fn charts(mesh: &Mesh) -> Vec<u32> {
    let mut connected = DisjointSet::new(mesh.positions.len());
    for &[a, b, c] in &mesh.triangles {
        connected.join(a, b);
        connected.join(b, c);
    }
    (0..mesh.positions.len() as u32).map(|vertex| connected.root(vertex)).collect()
}

/// Turns a triangle of cells so that its smallest comes first: equal for equal oriented triangles.
fn turned([a, b, c]: [u32; 3]) -> [u32; 3] {
    if a <= b && a <= c {
        [a, b, c]
    } else if b <= a && b <= c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Triangles that remain.
fn count(mesh: &Mesh, cells: &[u32]) -> usize {
    let mut seen: FxHashSet<[u32; 3]> = FxHashSet::default();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| cells[vertex as usize]);
        if all_differ(corners) {
            seen.insert(turned(corners));
        }
    }
    seen.len()
}

fn collapse_cells(
    mesh: &Mesh,
    border: &Border,
    locked: &[bool],
    places: &Places,
    cells: &[u32],
) -> (Mesh, Border, f64) {
    // The best vertex of each cell; ties go to the first.
    let better = |a: u32, b: u32| {
        let grid_level = |vertex: u32| places.grid_level[places.place[vertex as usize] as usize];
        grid_level(a) > grid_level(b)
    };
    let cell_count = cells.iter().max().map_or(0, |&most| most as usize + 1);
    let mut best = vec![u32::MAX; cell_count];
    for (vertex, &cell) in cells.iter().enumerate() {
        let slot = &mut best[cell as usize];
        if *slot == u32::MAX || better(vertex as u32, *slot) {
            *slot = vertex as u32;
        }
    }
    // For each cell and chart, the chart's vertex nearest to the cell's position lends its looks.
    let mut lender: FxHashMap<(u32, u32), (u32, f64)> = FxHashMap::default();
    let mut moved = 0f64;
    for (vertex, &cell) in cells.iter().enumerate() {
        let target = wide(mesh.positions[best[cell as usize] as usize]);
        let distance = target.distance(wide(mesh.positions[vertex]));
        moved = moved.max(distance);
        let entry = lender.entry((cell, places.chart[vertex])).or_insert((vertex as u32, distance));
        if distance < entry.1 {
            *entry = (vertex as u32, distance);
        }
    }
    let mut result = mesh.clone();
    let mut result_border = border.clone();
    for (vertex, &cell) in cells.iter().enumerate() {
        result.positions[vertex] = mesh.positions[best[cell as usize] as usize];
        if !locked[vertex] {
            result_border.planes[vertex] = 0;
            result_border.keep[vertex] = 0;
        }
    }
    let mut seen: FxHashSet<[u32; 3]> = FxHashSet::default();
    result.triangles.retain_mut(|triangle| {
        let corners = triangle.map(|vertex| cells[vertex as usize]);
        if !all_differ(corners) || !seen.insert(turned(corners)) {
            return false;
        }
        *triangle = triangle
            .map(|vertex| lender[&(cells[vertex as usize], places.chart[vertex as usize])].0);
        true
    });
    let (result, result_border) = compact(&result, &result_border);
    (result, result_border, moved)
}
