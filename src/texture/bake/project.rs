//! Draws the original onto a coarse triangle along its normal: what lies nearest above or below
//! each texel, found triangle by triangle as a rasteriser does rather than texel by texel.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::source::Source;
use crate::mesh::{Mesh, wide};

/// Triangles of the original whose normal has a smaller cosine with the coarse one's are seen from
/// their edge and show nothing.
const LEAST_SEEN: f64 = 1e-3;

/// What a chart's texel shows is taken from a level whose texels are at most so large for it:
/// bilinear sampling averages about two of them along each axis.
const NARROWER: f64 = 0.6;

/// Between texels of a chart and points of a triangle's plane.
pub(super) struct TexelPlane {
    /// The point of texel (0, 0), and by how much it moves with each texel.
    origin: DVec3,
    along: [DVec3; 2],
    /// Gives texels when multiplied with a point's offset from `origin`.
    inverse: [DVec3; 2],
    /// Unit length.
    pub normal: DVec3,
    corners: [DVec3; 3],
    flat: [DVec2; 3],
    /// How many texels around the triangle are seen.
    beside: f64,
}

impl TexelPlane {
    /// The plane of a triangle whose corners lie on these texels, and of so many texels around it;
    /// `None` where it has hardly any area in space or in texels.
    pub fn new(mesh: &Mesh, triangle: [u32; 3], flat: [DVec2; 3], beside: f64) -> Option<Self> {
        let corners = triangle.map(|vertex| wide(mesh.positions[vertex as usize]));
        let [a, b, c] = flat;
        let doubled = (b - a).perp_dot(c - a);
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let normal = cross.normalize_or_zero();
        if doubled.abs() <= 1e-6 || normal == DVec3::ZERO {
            return None;
        }
        let (p, q) = (corners[1] - corners[0], corners[2] - corners[0]);
        let along =
            [(p * (c - a).y - q * (b - a).y) / doubled, (q * (b - a).x - p * (c - a).x) / doubled];
        let origin = corners[0] - along[0] * a.x - along[1] * a.y;
        // The plane's dual basis.
        let [right, up] = along;
        let volume = right.cross(up).dot(normal);
        let inverse = [up.cross(normal) / volume, normal.cross(right) / volume];
        let finite = inverse.iter().all(|side| side.is_finite());
        finite.then_some(Self { origin, along, inverse, normal, corners, flat, beside })
    }

    /// The point of a texel.
    pub fn at(&self, texel: DVec2) -> DVec3 {
        self.origin + self.along[0] * texel.x + self.along[1] * texel.y
    }

    /// The texel that a point lies over.
    fn texel(&self, point: DVec3) -> DVec2 {
        let offset = point - self.origin;
        DVec2::new(self.inverse[0].dot(offset), self.inverse[1].dot(offset))
    }

    /// The box of what lies within `reach` along the normal.
    fn bounds(&self, reach: f64) -> (DVec3, DVec3) {
        let [a, b, c] = self.corners;
        let aside = (self.along[0].abs() + self.along[1].abs()) * self.beside;
        let grown = self.normal.abs() * reach + aside;
        (a.min(b).min(c) - grown, a.max(b).max(c) + grown)
    }

    /// Its sides as half planes: a texel lies in the triangle or no farther beside it than is seen
    /// where `[0] + x * [1] + y * [2]` is at least 0 for each.
    fn sides(&self) -> [[f64; 3]; 3] {
        let [a, b, c] = self.flat;
        let turn = (b - a).perp_dot(c - a).signum();
        [(a, b), (b, c), (c, a)].map(|(from, to)| {
            let inward = (to - from).perp() * turn;
            let beside = self.beside * (inward.x.abs() + inward.y.abs());
            [beside - inward.dot(from), inward.x, inward.y]
        })
    }
}

/// What a texel shows: a triangle of the original, and where in its image texel (x, y) of the chart
/// lies: `at + x * along[0] + y * along[1]`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    pub triangle: u32,
    /// The level whose texels are as large as those of the chart, or the next finer one.
    pub level: u32,
    at: DVec2,
    along: [DVec2; 2],
    /// The weights of the triangle's second and third corner likewise.
    weights: [[f64; 3]; 2],
}

impl Shown {
    /// The position in the image that the origin of the chart shows, and by how much it moves with
    /// each column and row; times `scale`.
    pub fn texels(&self, scale: f64) -> [DVec2; 3] {
        [self.at, self.along[0], self.along[1]].map(|texels| texels * scale)
    }

    /// The weights of the triangle's corners at a texel of the chart.
    pub fn weights(&self, at: DVec2) -> [f64; 3] {
        let [v, w] = self.weights.map(|[first, x, y]| first + x * at.x + y * at.y);
        [1.0 - v - w, v, w]
    }
}

/// Some texels around one coarse triangle, and what they show; kept between triangles.
#[derive(Default)]
pub(super) struct Projection {
    columns: [usize; 2],
    rows: [usize; 2],
    /// By texel of the box: the weighted distance of what it shows, and its number in `shown`.
    nearest: Vec<(f32, u32)>,
    shown: Vec<Shown>,
    candidates: Vec<u32>,
    /// By row of the box: the first column that may be seen, and the last.
    spans: Vec<[f64; 2]>,
}

/// The least whole number that is not below a value of 0 or more, of which i32 has enough and is
/// converted to in one step.
fn up(value: f64) -> usize {
    let below = value as i32;
    below as usize + usize::from(f64::from(below) < value)
}

/// The part of a range of columns whose centres have no negative value of any of three: each
/// `start + slope * x`.
fn span(values: [(f64, f64); 3], [mut from, mut to]: [f64; 2]) -> [f64; 2] {
    for (start, slope) in values {
        let crossing = -start / slope - 0.5;
        if slope > 0.0 {
            from = from.max(crossing);
        } else if slope < 0.0 {
            to = to.min(crossing);
        } else if start < 0.0 {
            to = -1.0;
        }
    }
    [from, to]
}

/// Nothing lies over the texel.
const NOTHING: u32 = u32::MAX;

impl Projection {
    /// Gathers what of `source` lies within `reach` of a triangle, to be drawn.
    pub fn gather(&mut self, source: &Source, plane: &TexelPlane, reach: f64) {
        self.candidates.clear();
        let (low, high) = plane.bounds(reach);
        source.in_box(low, high, |triangle| self.candidates.push(triangle));
        // Of equally near ones the first is shown, whatever the order of the search.
        self.candidates.sort_unstable();
    }

    /// Draws what was gathered for a triangle onto these columns and rows of texels. `steps` are
    /// source texels a texel, by level, the finest last.
    pub fn draw(
        &mut self,
        source: &Source,
        plane: &TexelPlane,
        reach: f64,
        texels: [Range<usize>; 2],
        steps: &[f64],
    ) {
        [self.columns, self.rows] = texels.map(|Range { start, end }| [start, end]);
        let count = [self.columns, self.rows].map(|[first, end]| end - first);
        self.nearest.clear();
        self.nearest.resize(count[0] * count[1], (f32::INFINITY, NOTHING));
        self.shown.clear();
        let sides = plane.sides();
        self.spans.clear();
        for y in self.rows[0]..self.rows[1] {
            let [first, end] = self.columns.map(|column| column as f64);
            let row = sides.map(|[at, x, slope]| (at + slope * (y as f64 + 0.5), x));
            self.spans.push(span(row, [first, end - 1.0]));
        }
        for index in 0..self.candidates.len() {
            let number = self.candidates[index];
            self.draw_one(source, number, plane, &sides, reach, steps);
        }
    }

    fn draw_one(
        &mut self,
        source: &Source,
        number: u32,
        plane: &TexelPlane,
        sides: &[[f64; 3]; 3],
        reach: f64,
        steps: &[f64],
    ) {
        let (triangle, corners) = (source.triangle(number), source.corners(number));
        let cosine = triangle.normal.dot(plane.normal);
        if cosine.abs() < LEAST_SEEN {
            return;
        }
        let [a, b, c] = corners.map(|corner| plane.texel(corner));
        let doubled = (b - a).perp_dot(c - a);
        if doubled == 0.0 {
            return;
        }
        let is_beyond = |&[at, x, y]: &[f64; 3]| {
            [a, b, c].iter().all(|corner| at + x * corner.x + y * corner.y < 0.0)
        };
        if sides.iter().any(is_beyond) {
            return;
        }
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        // Texels whose centre lies in the box.
        let centres = |axis: usize, [first, end]: [usize; 2]| {
            let from = up((low[axis] - 0.5).clamp(first as f64, end as f64));
            // One after the last that is not above.
            let to = (high[axis] + 0.5).clamp(from as f64, end as f64) as i32 as usize;
            from..to
        };
        let (columns, rows) = (centres(0, self.columns), centres(1, self.rows));
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        // Everything is linear in texels: first, by column, by row.
        let linear = |origin: DVec2, slopes: DVec2, value: f64| {
            [value - slopes.dot(origin), slopes.x, slopes.y]
        };
        let (ab, ac) = ((b - a) / doubled, (c - a) / doubled);
        let weights =
            [linear(a, DVec2::new(ac.y, -ac.x), 0.0), linear(a, DVec2::new(-ab.y, ab.x), 0.0)];
        let weight = Source::weight(cosine);
        let height = |point: DVec3| (point - plane.origin).dot(plane.normal) * weight;
        let heights = corners.map(height);
        let rises = [heights[1] - heights[0], heights[2] - heights[0]];
        let combine = |first: f64, rises: [f64; 2]| -> [f64; 3] {
            std::array::from_fn(|i| {
                let own = if i == 0 { first } else { 0.0 };
                own + weights[0][i] * rises[0] + weights[1][i] * rises[1]
            })
        };
        let distance = combine(heights[0], rises);
        let most = reach * weight;
        let mut own = NOTHING;
        for y in rows {
            let row = (y - self.rows[0]) * (self.columns[1] - self.columns[0]);
            let at = |value: [f64; 3]| value[0] + value[2] * (y as f64 + 0.5);
            let starts = [at(weights[0]), at(weights[1]), at(distance)];
            // The columns in which no weight is negative.
            let seen = self.spans[y - self.rows[0]];
            let range = [seen[0].max(columns.start as f64), seen[1].min(columns.end as f64 - 1.0)];
            let [from, to] = span(
                [
                    (starts[0], weights[0][1]),
                    (starts[1], weights[1][1]),
                    (1.0 - starts[0] - starts[1], -weights[0][1] - weights[1][1]),
                ],
                range,
            );
            if from > to {
                continue;
            }
            for x in up(from)..=to as i32 as usize {
                let value = (starts[2] + distance[1] * (f64::from(x as i32) + 0.5)).abs();
                let texel = &mut self.nearest[row + x - self.columns[0]];
                if value <= most && (value as f32) < texel.0 {
                    if own == NOTHING {
                        own = self.shown.len() as u32;
                        let [p, q, r] = triangle.texels.map(|at| DVec2::from(at.map(f64::from)));
                        let u = combine(p.x, [q.x - p.x, r.x - p.x]);
                        let v = combine(p.y, [q.y - p.y, r.y - p.y]);
                        let along = [DVec2::new(u[1], v[1]), DVec2::new(u[2], v[2])];
                        let width = along[0].length().max(along[1].length());
                        let finer = steps.iter().position(|&step| step <= width * NARROWER);
                        let level = finer.unwrap_or(steps.len() - 1) as u32;
                        let at = DVec2::new(u[0], v[0]);
                        self.shown.push(Shown { triangle: number, level, at, along, weights });
                    }
                    *texel = (value as f32, own);
                }
            }
        }
    }

    /// What a texel shows, and its number; `None` beyond these columns and rows too.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> Option<(u32, &Shown)> {
        let is_in = |at: usize, [first, end]: [usize; 2]| (first..end).contains(&at);
        if !is_in(x, self.columns) || !is_in(y, self.rows) {
            return None;
        }
        let row = (y - self.rows[0]) * (self.columns[1] - self.columns[0]);
        let number = self.nearest[row + x - self.columns[0]].1;
        Some((number, self.shown.get(number as usize)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Material;
    use crate::random::Random;
    use crate::texture::bake::BakeClasses;

    /// Those of the original.
    const TRIANGLES: u32 = 100;

    /// Triangles anywhere within a metre above or below the square from 0 to 4, each the whole of
    /// an image of 100 texels a side.
    fn soup(random: &mut Random) -> Source {
        let mut mesh = Mesh::default();
        for first in (0..TRIANGLES).map(|triangle| 3 * triangle) {
            let mut place = |low: f64, high: f64| random.between(low, high) as f32;
            let at = [place(0.0, 4.0), place(0.0, 4.0), place(-1.0, 1.0)];
            for _ in 0..3 {
                let near = [place(-1.0, 1.0), place(-1.0, 1.0), place(-0.3, 0.3)];
                mesh.positions.push(std::array::from_fn(|axis| at[axis] + near[axis]));
                mesh.materials.push(0);
            }
            mesh.triangles.push([first, first + 1, first + 2]);
        }
        let classes = BakeClasses::new(&[Material::plain("any")], |_| true);
        Source::new(&mesh, &classes, |_| Some((0, [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]])))
    }

    /// Weights of the corners where the line through a point along a normal meets a triangle's
    /// plane, and how far away that is.
    fn met(point: DVec3, normal: DVec3, [a, b, c]: [DVec3; 3]) -> Option<([f64; 3], f64)> {
        let cross = (b - a).cross(c - a);
        let away = (a - point).dot(cross) / normal.dot(cross);
        let at = point + normal * away;
        let share = |p: DVec3, q: DVec3| (p - at).cross(q - at).dot(cross) / cross.length_squared();
        let weights = [share(b, c), share(c, a), share(a, b)];
        weights.iter().all(|&weight| weight >= 0.0).then_some((weights, away.abs()))
    }

    #[test]
    fn texels_show_what_a_line_along_the_normal_meets_first() {
        let mut random = Random::new(7, 0);
        let source = soup(&mut random);
        // A slope, and texels turned against it.
        let corners = [[0.0, 0.0, -0.4], [4.0, 0.5, 0.3], [0.5, 4.0, 0.2]];
        let mesh = Mesh { positions: corners.to_vec(), ..Mesh::default() };
        let flat = [DVec2::new(31.0, 2.0), DVec2::new(30.0, 33.0), DVec2::new(1.5, 6.0)];
        let plane = TexelPlane::new(&mesh, [0, 1, 2], flat, 1.5).unwrap();
        for (corner, flat) in corners.into_iter().zip(flat) {
            assert!(plane.at(flat).distance(wide(corner)) < 1e-5);
            assert!(plane.texel(wide(corner)).distance(flat) < 1e-5);
        }
        let reach = 0.7;
        let mut projection = Projection::default();
        let [columns, rows] = [0..40, 0..40];
        let texels = [columns.clone(), rows.clone()];
        projection.gather(&source, &plane, reach);
        projection.draw(&source, &plane, reach, texels, &[8.0, 4.0, 2.0, 1.0]);
        let [columns, rows] = [projection.columns, projection.rows].map(|[first, end]| first..end);
        let (mut shown, mut empty, mut beside) = (0, 0, 0);
        for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
            let centre = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            if plane.sides().iter().any(|&[at, x, y]| at + x * centre.x + y * centre.y < 0.0) {
                assert!(projection.at(x, y).is_none(), "{x} {y} is beside the triangle");
                beside += 1;
                continue;
            }
            let point = plane.at(centre);
            let lies_over = (0..TRIANGLES).filter_map(|number| {
                let (weights, away) = met(point, plane.normal, source.corners(number))?;
                let cosine = source.triangle(number).normal.dot(plane.normal);
                Some((away * Source::weight(cosine), away, weights, number))
            });
            let nearest =
                lies_over.filter(|&(_, away, ..)| away <= reach).min_by(|a, b| a.0.total_cmp(&b.0));
            let Some((_, _, weights, number)) = nearest else {
                assert!(projection.at(x, y).is_none(), "{x} {y}");
                empty += 1;
                continue;
            };
            shown += 1;
            let (_, found) = projection.at(x, y).unwrap();
            assert_eq!(found.triangle, number, "{x} {y}");
            for (found, expected) in found.weights(centre).into_iter().zip(weights) {
                assert!((found - expected).abs() < 1e-6, "{found} {expected}");
            }
            let texel = DVec2::new(weights[1], weights[2]) * 100.0;
            let [origin, right, down] = found.texels(1.0);
            let shown = origin + right * centre.x + down * centre.y;
            assert!(shown.distance(texel) < 1e-3);
        }
        assert!(shown > 300 && empty > 50, "{shown} shown, {empty} empty");
        assert!(beside > 200, "{beside} beside");
    }
}
