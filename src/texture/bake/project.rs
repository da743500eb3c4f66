//! Draws the original onto the triangles of a flat chart along their normals: what lies nearest
//! above or below each sample, found triangle by triangle as a rasteriser does.
//!
//! A chart is drawn tile by tile, so that what is written stays in the cache. What of the original
//! is near a tile is searched for and fetched once for all of the chart's triangles there.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3A};

use super::chart_plane::ChartPlane;
use super::facet::Facet;
use super::source::BakeSource;
use super::tile::{Member, Tile};

/// Triangles of the original whose normal has a smaller cosine with the chart's are seen from their
/// edge and show nothing.
const LEAST_SEEN: f64 = 1e-3;

/// A centre that rounding puts this far beside a triangle, in samples, still lies in it.
const SLACK: f64 = 1e-6;

/// What a sample shows: a triangle of the original, and where in its image sample (x, y) of the
/// chart lies: `at + x * along[0] + y * along[1]`, source texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct SampleHit {
    pub triangle: u32,
    /// By how much the position moves from one sample to the next, source texels, along rows or
    /// columns, whichever is more.
    pub spacing: f64,
    at: DVec2,
    along: [DVec2; 2],
    /// The weights of the triangle's second and third corner likewise.
    weights: [[f64; 3]; 2],
}

impl SampleHit {
    /// The position in the image that the origin of the chart shows, and by how much it moves with
    /// each column and row; times `scale`.
    pub fn texels(&self, scale: f64) -> [DVec2; 3] {
        [self.at, self.along[0], self.along[1]].map(|texels| texels * scale)
    }

    /// The weights of the triangle's corners at a sample of the chart.
    pub fn weights(&self, at: DVec2) -> [f64; 3] {
        let [v, w] = self.weights.map(|[first, x, y]| first + x * at.x + y * at.y);
        [1.0 - v - w, v, w]
    }
}

/// What the samples of one tile show; kept between tiles for its memory.
#[derive(Default)]
pub(super) struct Projection {
    /// By sample of the tile: the weighted distance of what it shows, metres.
    nearest: Vec<f32>,
    /// By sample of the tile: the number in `shown` of what it shows, or one beyond all.
    pub numbers: Vec<u32>,
    pub shown: Vec<SampleHit>,
    found: Vec<u32>,
    candidates: Vec<Candidate>,
}

/// A triangle of the original near a tile.
struct Candidate {
    number: u32,
    /// In samples and metres over the chart.
    corners: [DVec3; 3],
    low: Vec3A,
    high: Vec3A,
}

/// Nothing lies over the sample.
const NOTHING: u32 = u32::MAX;

impl Projection {
    /// Draws what of `source` lies within reach of a tile's triangles.
    pub fn draw(
        &mut self,
        source: &BakeSource,
        plane: &ChartPlane,
        tile: &Tile,
        facets: &[Option<Facet>],
    ) {
        self.nearest.clear();
        self.nearest.resize(tile.owners.len(), f32::INFINITY);
        self.numbers.clear();
        self.numbers.resize(tile.owners.len(), NOTHING);
        self.shown.clear();
        let facet_of = |member: &Member| facets[member.number as usize].as_ref();
        let all = tile.members.iter().filter_map(|member| Some(member.bounds(facet_of(member)?)));
        let around = all.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)]);
        let Some(around) = around else { return };
        self.gather(source, plane, around);
        for member in &tile.members {
            let Some(facet) = facet_of(member) else { continue };
            let [low, high] = member.bounds(facet);
            for index in 0..self.candidates.len() {
                let candidate = &self.candidates[index];
                if !(candidate.low.cmpgt(high) | candidate.high.cmplt(low)).any() {
                    self.draw_one(source, index, facet, member, tile);
                }
            }
        }
    }

    /// Finds the triangles of the original that may meet a box in samples and metres over the chart.
    fn gather(&mut self, source: &BakeSource, plane: &ChartPlane, [low, high]: [Vec3A; 2]) {
        self.found.clear();
        let [from, to] = plane.box_around(low.as_dvec3(), high.as_dvec3());
        source.in_box(from, to, |triangle| self.found.push(triangle));
        // Of equally near ones the first is shown, whatever the order of the search.
        self.found.sort_unstable();
        self.candidates.clear();
        for &number in &self.found {
            let corners = source.corners(number).map(|corner| plane.project(corner));
            let [a, b, c] = corners.map(|corner| corner.as_vec3a());
            let (own_low, own_high) = (a.min(b).min(c), a.max(b).max(c));
            if !(own_low.cmpgt(high) | own_high.cmplt(low)).any() {
                self.candidates.push(Candidate { number, corners, low: own_low, high: own_high });
            }
        }
    }

    /// Draws a candidate onto the samples of one triangle of the chart.
    fn draw_one(
        &mut self,
        source: &BakeSource,
        candidate: usize,
        facet: &Facet,
        member: &Member,
        tile: &Tile,
    ) {
        let Candidate { number, corners, .. } = self.candidates[candidate];
        let triangle = source.triangle(number);
        let cosine = triangle.normal.dot(facet.normal);
        if cosine.abs() < LEAST_SEEN {
            return;
        }
        let [(a, p), (b, q), (c, r)] = corners.map(|corner| facet.project(corner));
        if facet.is_beside([a, b, c]) {
            return;
        }
        // Samples whose centre lies in the box.
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let centres = |low: f64, high: f64, range: &Range<usize>| {
            let [first, end] = [range.start as f64, range.end as f64];
            let from = up((low - 0.5 - SLACK).clamp(first, end));
            // One after the last that is not above.
            from..(high + 0.5 + SLACK).clamp(from as f64, end) as i32 as usize
        };
        let columns = centres(low.x, high.x, &member.columns);
        let rows = centres(low.y, high.y, &member.rows);
        let doubled = (b - a).perp_dot(c - a);
        if columns.is_empty() || rows.is_empty() || doubled == 0.0 {
            return;
        }
        // Everything is linear in samples: at the origin, by column, by row.
        let (ab, ac) = ((b - a) / doubled, (c - a) / doubled);
        let linear = |slopes: DVec2| -> [f64; 3] {
            [-(slopes.x * a.x + slopes.y * a.y), slopes.x, slopes.y]
        };
        let weights = [linear(DVec2::new(ac.y, -ac.x)), linear(DVec2::new(-ab.y, ab.x))];
        let combine = |first: f64, second: f64, third: f64| -> [f64; 3] {
            let rises = [second - first, third - first];
            std::array::from_fn(|i| {
                let own = if i == 0 { first } else { 0.0 };
                own + weights[0][i] * rises[0] + weights[1][i] * rises[1]
            })
        };
        let above = combine(p, q, r);
        let weight = BakeSource::weight(cosine) as f32;
        let (reach, slope) = (facet.reach as f32, above[1] as f32);
        let edges = Edges::new([a, b, c]);
        let range = [columns.start as f64, columns.end as f64 - 1.0];
        let mut own = NOTHING;
        for y in rows {
            let middle = y as f64 + 0.5;
            let [from, to] = edges.span(middle, range);
            if from > to {
                continue;
            }
            let (from, to) = (up(from), to as i32 as usize);
            let count = (to + 1).saturating_sub(from);
            let start = (above[0] + above[2] * middle + above[1] * (from as f64 + 0.5)) as f32;
            let first = tile.index(from, y);
            let samples = first..first + count;
            let owners = &tile.owners[samples.clone()];
            let nearest = &mut self.nearest[samples.clone()];
            let numbers = &mut self.numbers[samples];
            let is_new = own == NOTHING;
            let next = if is_new { self.shown.len() as u32 } else { own };
            let mut some = false;
            for (index, ((owner, nearest), number)) in
                (0i32..).zip(owners.iter().zip(nearest).zip(numbers))
            {
                let distance = (start + slope * index as f32).abs();
                let weighted = distance * weight;
                let is_near = distance <= reach && weighted < *nearest;
                let is_nearer = is_near && *owner == member.number;
                *nearest = if is_nearer { weighted } else { *nearest };
                *number = if is_nearer { next } else { *number };
                some |= is_nearer;
            }
            if is_new && some {
                own = next;
                let [p, q, r] = triangle.texels.map(|at| DVec2::from(at.map(f64::from)));
                let u = combine(p.x, q.x, r.x);
                let v = combine(p.y, q.y, r.y);
                let along = [DVec2::new(u[1], v[1]), DVec2::new(u[2], v[2])];
                let spacing = along[0].length_squared().max(along[1].length_squared()).sqrt();
                let at = DVec2::new(u[0], v[0]);
                self.shown.push(SampleHit { triangle: number, spacing, at, along, weights });
            }
        }
    }
}

/// The least whole number that is not below a value of 0 or more, of which i32 has enough and is
/// converted to in one step.
fn up(value: f64) -> usize {
    let below = value as i32;
    below as usize + usize::from(f64::from(below) < value)
}

/// Where the sides of a triangle cross rows of samples: for a row at `y`, its centres lie between
/// `[0] + y * [1]` of all on the left and of all on the right.
struct Edges {
    left: [[f64; 2]; 3],
    right: [[f64; 2]; 3],
}

impl Edges {
    fn new([a, b, c]: [DVec2; 3]) -> Self {
        let turn = (b - a).perp_dot(c - a);
        let mut edges =
            Self { left: [[f64::NEG_INFINITY, 0.0]; 3], right: [[f64::INFINITY, 0.0]; 3] };
        for (side, (from, to)) in [(a, b), (b, c), (c, a)].into_iter().enumerate() {
            let rise = to.y - from.y;
            // Flat ones bound rows, not columns.
            if rise == 0.0 {
                continue;
            }
            let slope = (to.x - from.x) / rise;
            // Of columns, whose centres are half a sample farther right.
            let crossing = from.x - slope * from.y - 0.5;
            if (rise > 0.0) == (turn > 0.0) {
                edges.right[side] = [crossing + SLACK, slope];
            } else {
                edges.left[side] = [crossing - SLACK, slope];
            }
        }
        edges
    }

    /// The part of a range of columns whose centres lie in the triangle at `y`.
    #[inline]
    fn span(&self, y: f64, [mut from, mut to]: [f64; 2]) -> [f64; 2] {
        for side in 0..3 {
            from = from.max(self.left[side][0] + self.left[side][1] * y);
            to = to.min(self.right[side][0] + self.right[side][1] * y);
        }
        [from, to]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Material, Mesh};
    use crate::random::Random;
    use crate::texture::bake::BakeClasses;
    use crate::texture::bake::source::{ImageKind, TriangleTexels};

    /// Those of the original.
    const TRIANGLES: u32 = 100;

    /// Triangles anywhere within a metre above or below the square from 0 to 4, each the whole of
    /// an image of 100 texels a side.
    fn soup(random: &mut Random) -> BakeSource {
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
        let classes = BakeClasses::new(&[Material::plain("any")], |_| true, |_| true);
        let texels = [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0]];
        BakeSource::new(&mesh, &classes, |_| {
            Some(TriangleTexels { chart: 0, texels, image: ImageKind::CutUp })
        })
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

    /// Two triangles that meet at an angle of 40 degrees, seen askew.
    fn fold() -> (Mesh, ChartPlane) {
        let corners = [[0.0, 0.0, -0.4], [4.0, 0.5, 0.3], [0.5, 4.0, 0.2], [4.0, 4.0, -1.5]];
        let mesh = Mesh {
            positions: corners.to_vec(),
            triangles: vec![[0, 1, 2], [2, 1, 3]],
            ..Mesh::default()
        };
        let normal = DVec3::new(0.2, 0.3, 1.0).normalize();
        let right = normal.cross(DVec3::new(-0.3, 1.0, 0.2)).normalize();
        let up = normal.cross(right);
        let low = corners.iter().fold(DVec2::INFINITY, |low, corner| {
            let corner = DVec3::from(corner.map(f64::from));
            low.min(DVec2::new(corner.dot(right), corner.dot(up)))
        });
        (mesh, ChartPlane { right, up, normal, origin: low - 0.5, scale: 8.0 })
    }

    #[test]
    fn samples_show_what_a_line_along_the_normal_meets_first() {
        const SIDE: usize = 60;
        const REACH: f64 = 0.7;
        let source = soup(&mut Random::new(7, 0));
        let (mesh, plane) = fold();
        let facets: Vec<Option<Facet>> = mesh
            .triangles
            .iter()
            .map(|&triangle| Facet::new(&plane, &mesh, triangle, REACH, 1.5))
            .collect();
        let centre = |x: usize, y: usize| DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
        let owner = |x: usize, y: usize| {
            let is_in = |&triangle: &u32| {
                let flat = mesh.corners(mesh.triangles[triangle as usize]);
                let [a, b, c] = flat.map(|corner| plane.project(corner).truncate() - centre(x, y));
                a.perp_dot(b) > 0.0 && b.perp_dot(c) > 0.0 && c.perp_dot(a) > 0.0
            };
            [0, 1].into_iter().find(is_in).unwrap_or(NOTHING)
        };
        let owners: Vec<Vec<u32>> =
            (0..SIDE).map(|y| (0..SIDE).map(|x| owner(x, y)).collect()).collect();
        let (mut projection, mut tile) = (Projection::default(), Tile::default());
        let (mut shown, mut empty, mut free) = ([0; 2], 0, 0);
        // All at once, and in parts.
        for side in [SIDE, 25] {
            let parts = || (0..SIDE).step_by(side).map(|from| from..(from + side).min(SIDE));
            for [columns, rows] in parts().flat_map(|y| parts().map(move |x| [x, y.clone()])) {
                tile.fill([columns.clone(), rows.clone()], 1, |y| &owners[y], &facets);
                projection.draw(&source, &plane, &tile, &facets);
                for (y, x) in rows.flat_map(|y| columns.clone().map(move |x| (y, x))) {
                    let number = projection.numbers[tile.index(x, y)] as usize;
                    let Some(Some(facet)) = facets.get(owners[y][x] as usize) else {
                        assert_eq!(number, NOTHING as usize, "{x} {y} is nobody's");
                        free += 1;
                        continue;
                    };
                    let point = plane.at(centre(x, y), facet.height(centre(x, y)));
                    let nearest = (0..TRIANGLES)
                        .filter_map(|number| {
                            let (weights, away) = met(point, facet.normal, source.corners(number))?;
                            let cosine = source.triangle(number).normal.dot(facet.normal);
                            Some((away * BakeSource::weight(cosine), away, weights, number))
                        })
                        .filter(|&(_, away, ..)| away <= REACH)
                        .min_by(|a, b| a.0.total_cmp(&b.0));
                    let Some((_, _, weights, expected)) = nearest else {
                        assert_eq!(number, NOTHING as usize, "{x} {y}");
                        empty += 1;
                        continue;
                    };
                    shown[owners[y][x] as usize] += 1;
                    let found = &projection.shown[number];
                    assert_eq!(found.triangle, expected, "{x} {y}");
                    for (found, expected) in found.weights(centre(x, y)).into_iter().zip(weights) {
                        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
                    }
                    let texel = DVec2::new(weights[1], weights[2]) * 100.0;
                    let [origin, right, down] = found.texels(1.0);
                    let at = origin + right * centre(x, y).x + down * centre(x, y).y;
                    assert!(at.distance(texel) < 1e-3);
                }
            }
        }
        assert!(shown.iter().all(|&count| count > 300), "{shown:?}");
        assert!(empty > 50 && free > 200, "{empty} empty, {free} free");
    }
}
