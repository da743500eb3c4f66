//! Charts in their plane: where the corners of their triangles lie, none on another.

use glam::{DVec2, DVec3};

use super::chart_plane::ChartPlane;
use super::planar::{PlanarChart, planar_charts};
use crate::mesh::{Mesh, wide};

/// A planar chart, flat.
#[derive(Clone, Debug)]
pub(super) struct FlatChart {
    /// Numbers of the mesh's triangles.
    pub triangles: Vec<u32>,
    /// Their corners in metres, all at 0 or above.
    pub corners: Vec<[DVec2; 3]>,
    /// The greatest coordinates, metres.
    pub size: DVec2,
    /// One sample a metre, from the least coordinates on.
    pub plane: ChartPlane,
    /// Texels a metre that it should have.
    pub scale: f64,
}

/// Most texels along a side when triangles are looked for that lie on others.
const MOST_TEXELS: f64 = 2048.0;

/// Directions that are tried for a chart's sides, over a right angle.
const TURNS: usize = 8;

/// Another direction than the first must make the box smaller than this share of it.
const WORTH_TURNING: f64 = 0.9;

/// The flat charts of these triangles; each lies in exactly one. `scale` gives the texels a metre
/// of some triangles: no two triangles of a chart have the centre of the same texel at that scale.
pub(super) fn flat_charts(
    mesh: &Mesh,
    members: &[u32],
    scale: impl Fn(&[u32]) -> f64,
) -> Vec<FlatChart> {
    let mut charts = Vec::new();
    let mut open = planar_charts(mesh, members);
    while !open.is_empty() {
        let mut left = Vec::new();
        for chart in open {
            let scale = scale(&chart.triangles);
            let (flat, above) = FlatChart::new(mesh, chart, scale);
            charts.push(flat);
            left.extend(above);
        }
        // The first triangle of each chart stays in it, so there are fewer each time.
        left.sort_unstable();
        open = planar_charts(mesh, &left);
    }
    charts
}

impl FlatChart {
    /// A chart seen along its normal, and the triangles that would lie on others.
    fn new(mesh: &Mesh, chart: PlanarChart, scale: f64) -> (Self, Vec<u32>) {
        let [right, up] = axes(mesh, &chart);
        let normal = right.cross(up);
        let plane = ChartPlane { right, up, normal, origin: DVec2::ZERO, scale: 1.0 };
        let flatten = |vertex: u32| plane.project(wide(mesh.positions[vertex as usize])).truncate();
        let corners: Vec<[DVec2; 3]> = chart
            .triangles
            .iter()
            .map(|&number| mesh.triangles[number as usize].map(flatten))
            .collect();
        let triangles = chart.triangles;
        let mut flat = Self { triangles, corners, size: DVec2::ZERO, plane, scale };
        let above = flat.take_overlaps();
        let all = || flat.corners.iter().flatten();
        let low = all().fold(DVec2::INFINITY, |low, &corner| low.min(corner));
        flat.plane.origin = low;
        flat.corners.iter_mut().flatten().for_each(|corner| *corner -= low);
        flat.size =
            flat.corners.iter().flatten().fold(DVec2::ZERO, |high, &corner| high.max(corner));
        (flat, above)
    }

    /// Removes the triangles that lie on earlier ones.
    fn take_overlaps(&mut self) -> Vec<u32> {
        let all = || self.corners.iter().flatten();
        let low = all().fold(DVec2::INFINITY, |low, &corner| low.min(corner));
        let high = all().fold(DVec2::NEG_INFINITY, |high, &corner| high.max(corner));
        let scale = self.scale.min(MOST_TEXELS / (high - low).max_element().max(f64::MIN_POSITIVE));
        let [width, height] = ((high - low) * scale).to_array().map(|side| side as usize + 1);
        let mut taken = vec![false; width * height];
        let mut above = Vec::new();
        let mut kept = 0;
        let mut cells = Vec::new();
        for index in 0..self.triangles.len() {
            let triangle = self.corners[index].map(|corner| (corner - low) * scale);
            cells.clear();
            for_centres(triangle, [width, height], -1e-9, |[x, y]| cells.push(y * width + x));
            if kept > 0 && cells.iter().any(|&cell| taken[cell]) {
                above.push(self.triangles[index]);
                continue;
            }
            cells.iter().for_each(|&cell| taken[cell] = true);
            self.triangles[kept] = self.triangles[index];
            self.corners[kept] = self.corners[index];
            kept += 1;
        }
        self.triangles.truncate(kept);
        self.corners.truncate(kept);
        above
    }
}

/// Two directions across the chart's normal in which its box is small.
fn axes(mesh: &Mesh, chart: &PlanarChart) -> [DVec3; 2] {
    let normal = chart.normal.try_normalize().unwrap_or(DVec3::Z);
    // Upright on walls, as the images mostly are; on the ground along the first axis.
    let reference = if normal.z.abs() < 0.9 { DVec3::Z } else { DVec3::Y };
    let right = reference.cross(normal).normalize();
    let up = normal.cross(right);
    let box_of = |right: DVec3, up: DVec3| {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &number in &chart.triangles {
            for vertex in mesh.triangles[number as usize] {
                let point = wide(mesh.positions[vertex as usize]);
                let flat = DVec2::new(point.dot(right), point.dot(up));
                (low, high) = (low.min(flat), high.max(flat));
            }
        }
        (high - low).element_product()
    };
    let mut best = (box_of(right, up) * WORTH_TURNING, [right, up]);
    for turn in 1..TURNS {
        let (sine, cosine) = libm::sincos(std::f64::consts::FRAC_PI_2 * turn as f64 / TURNS as f64);
        let transposed = [right * cosine + up * sine, up * cosine - right * sine];
        let size = box_of(transposed[0], transposed[1]);
        if size < best.0 {
            best = (size, transposed);
        }
    }
    best.1
}

/// Visits the cells of a grid of this `size` whose centres lie inside a triangle, or outside it by
/// no more than `slack` of its height over the nearest side.
pub(super) fn for_centres(
    [a, b, c]: [DVec2; 3],
    size: [usize; 2],
    slack: f64,
    mut visit: impl FnMut([usize; 2]),
) {
    let doubled = (b - a).perp_dot(c - a);
    if doubled == 0.0 {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    let range = |axis: usize| {
        let first = (low[axis] - 0.5).floor().max(0.0) as usize;
        first..((high[axis] + 0.5).ceil().max(0.0) as usize).min(size[axis])
    };
    let columns = range(0);
    // Weights are linear: along a row each has one slope.
    let sides = [(b, c), (c, a), (a, b)];
    let slopes = sides.map(|(p, q)| -(q.y - p.y) / doubled);
    for y in range(1) {
        let first = DVec2::new(columns.start as f64 + 0.5, y as f64 + 0.5);
        let starts = sides.map(|(p, q)| (q - p).perp_dot(first - p) / doubled);
        for x in columns.clone() {
            let along = (x - columns.start) as f64;
            if (0..3).all(|side| starts[side] + slopes[side] * along >= -slack) {
                visit([x, y]);
            }
        }
    }
}
