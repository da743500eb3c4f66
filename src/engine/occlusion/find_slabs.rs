//! Finds the slabs of a surface.

use std::f64::consts::TAU;

use glam::DVec3;

use super::rectangles::{Edge, FillRule, rectangles};
use super::slab::Slab;
use super::surface::Surface;

/// Directions across which slabs are looked for, at most.
const DIRECTIONS: usize = 8;

/// Layers of one thickness across one direction, at most.
const LAYERS: usize = 6;

/// How thick layers are, over the diagonal of the surface. Thin ones come first: the more from the side
/// that a thick one is seen, the less it hides.
const THICKNESSES: [f64; 3] = [1.0 / 400.0, 1.0 / 100.0, 1.0 / 30.0];

/// Layers are looked for at every so manieth part of their thickness.
const STEPS: usize = 4;

/// The least area of a slab, over the square of the diagonal of the surface.
const LEAST_AREA: f64 = 1.0 / 1000.0;

/// How fine borders are known, over the diagonal.
const FINE: f64 = 1.0 / 3000.0;

/// How much smaller slabs are than what was found, over the diagonal: more than places in an f32 are off.
const ROUNDING: f64 = 2e-6;

/// A triangle counts towards a layer where its normal is so near to the direction across.
const ALONG: f64 = 0.8;

/// A piece needs no more slabs once they cover this part of it.
const ENOUGH: f64 = 0.6;

/// Directions to the side that are told apart.
const AZIMUTHS: usize = 36;

/// Walls, slopes, and what is level.
const BINS: usize = 2 * AZIMUTHS + 1;

/// Finds slabs of a surface in a scene in which `up` is up.
pub(super) fn find_slabs(surface: &Surface, up: DVec3) -> Vec<Slab> {
    if !(surface.diagonal > 0.0 && surface.diagonal.is_finite()) {
        return Vec::new();
    }
    let mut search = Search {
        surface,
        up,
        least: LEAST_AREA * surface.diagonal * surface.diagonal,
        left: surface.triangles.iter().map(|triangle| triangle.area).collect(),
        groups: vec![0; surface.triangles.len()],
        first: vec![(0, 0); surface.edges.len()],
        turns: vec![0; surface.edges.len()],
        searches: 0,
        slabs: Vec::new(),
    };
    let bins: Vec<Option<usize>> =
        surface.triangles.iter().map(|triangle| bin(triangle.normal, up)).collect();
    let mut tried = [false; BINS];
    for _ in 0..DIRECTIONS {
        let Some(best) = search.best_bin(&bins, &tried) else { break };
        tried[best] = true;
        search.across(search.direction(&bins, best));
    }
    search.slabs
}

/// Which of the directions that are told apart a normal has, either way along it.
fn bin(normal: DVec3, up: DVec3) -> Option<usize> {
    let rise = normal.dot(up);
    let upward = if rise < 0.0 { -normal } else { normal };
    let east = up.any_orthonormal_vector();
    let turn = libm::atan2(upward.dot(up.cross(east)), upward.dot(east)) / TAU;
    let azimuth =
        |turns: f64| ((turns.rem_euclid(1.0) * AZIMUTHS as f64) as usize).min(AZIMUTHS - 1);
    match rise.abs() {
        _ if normal == DVec3::ZERO => None,
        // Walls are the same from either side.
        rise if rise < 0.4 => Some(azimuth(turn * 2.0)),
        rise if rise < 0.94 => Some(AZIMUTHS + azimuth(turn)),
        _ => Some(2 * AZIMUTHS),
    }
}

/// A bin and those beside it.
fn beside(bin: usize) -> impl Iterator<Item = usize> {
    let (class, at) = (bin / AZIMUTHS, bin % AZIMUTHS);
    let (steps, around) = if class < 2 { (3, AZIMUTHS) } else { (1, 1) };
    (0..steps).map(move |step| class * AZIMUTHS + (at + around - steps / 2 + step) % around)
}

struct Search<'a> {
    surface: &'a Surface,
    up: DVec3,
    /// The least area of a slab.
    least: f64,
    /// Area by triangle; 0 once slabs cover most of its piece.
    left: Vec<f64>,
    /// By triangle of a layer: another of its piece, or itself (union-find).
    groups: Vec<u32>,
    /// By edge: the layer in which it was met last, and the first triangle at it.
    first: Vec<(u32, u32)>,
    /// By edge of that layer: how many more triangles go along it than back.
    turns: Vec<i32>,
    /// Layers so far.
    searches: u32,
    slabs: Vec<Slab>,
}

impl Search<'_> {
    /// The bin with most of the area that is left, those beside it included.
    fn best_bin(&self, bins: &[Option<usize>], tried: &[bool; BINS]) -> Option<usize> {
        let mut areas = [0.0; BINS];
        for (bin, left) in bins.iter().zip(&self.left) {
            if let Some(bin) = bin {
                areas[*bin] += left;
            }
        }
        let around = |bin: usize| beside(bin).map(|bin| areas[bin]).sum::<f64>();
        let untried = (0..BINS).filter(|&bin| !tried[bin] && around(bin) >= self.least);
        untried.reduce(|best, bin| if around(bin) > around(best) { bin } else { best })
    }

    /// The mean normal of a bin and those beside it, of what is left.
    fn direction(&self, bins: &[Option<usize>], best: usize) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (at, bin) in bins.iter().enumerate() {
            if bin.is_some_and(|bin| beside(best).any(|beside| beside == bin)) {
                let normal = self.surface.triangles[at].normal * self.left[at];
                sum += if sum.dot(normal) < 0.0 { -normal } else { normal };
            }
        }
        sum.normalize_or_zero()
    }

    /// Finds slabs across a direction.
    fn across(&mut self, across: DVec3) {
        let triangles = &self.surface.triangles;
        let levels: Vec<f64> = self.surface.points.iter().map(|at| at.dot(across)).collect();
        let low = levels.iter().copied().fold(f64::INFINITY, f64::min);
        let high = levels.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let ends: Vec<[f64; 2]> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.points.map(|at| levels[at as usize]);
                [a.min(b).min(c), a.max(b).max(c)]
            })
            .collect();
        for thickness in THICKNESSES.map(|part| part * self.surface.diagonal) {
            let step = thickness / STEPS as f64;
            let mut areas = vec![0.0; ((high - low) / step) as usize + 1 + STEPS];
            for (at, [from, to]) in ends.iter().enumerate() {
                let is_across = triangles[at].normal.dot(across).abs() > ALONG;
                if is_across && to - from <= thickness {
                    areas[((from + to) / 2.0 - low).max(0.0).div_euclid(step) as usize] +=
                        self.left[at];
                }
            }
            let layers: Vec<f64> = areas.windows(STEPS).map(|steps| steps.iter().sum()).collect();
            let mut order: Vec<usize> =
                (0..layers.len()).filter(|&at| layers[at] >= self.least).collect();
            order.sort_by(|&a, &b| layers[b].total_cmp(&layers[a]).then(a.cmp(&b)));
            let mut taken: Vec<usize> = Vec::new();
            for layer in order {
                if taken.len() == LAYERS {
                    break;
                }
                if taken.iter().all(|taken| taken.abs_diff(layer) >= STEPS) {
                    taken.push(layer);
                    let from = low + layer as f64 * step;
                    let is_inside = |[a, b]: [f64; 2]| a >= from && b <= from + thickness;
                    let inside = (0..).zip(&ends).filter(|(_, ends)| is_inside(**ends));
                    let inside: Vec<u32> = inside.map(|(at, _)| at).collect();
                    self.layer(across, &levels, &inside);
                }
            }
        }
    }

    /// Finds the slabs of the pieces of which the triangles of a layer consist.
    fn layer(&mut self, across: DVec3, levels: &[f64], inside: &[u32]) {
        self.join(inside);
        let mut pieces: Vec<(u32, u32)> =
            inside.iter().map(|&at| (group(&mut self.groups, at), at)).collect();
        pieces.sort_unstable();
        for piece in pieces.chunk_by(|a, b| a.0 == b.0) {
            let triangles = &self.surface.triangles;
            let seen = |at: u32| {
                let triangle = &triangles[at as usize];
                triangle.area * triangle.normal.dot(across).abs()
            };
            let area: f64 = piece.iter().map(|&(_, at)| seen(at)).sum();
            let left: f64 = piece.iter().map(|&(_, at)| self.left[at as usize]).sum();
            if area < self.least || left < area / 4.0 {
                continue;
            }
            if self.piece(across, levels, piece) > ENOUGH * area {
                piece.iter().for_each(|&(_, at)| self.left[at as usize] = 0.0);
            }
        }
    }

    /// Joins triangles that meet at edges, and finds out how they go along these.
    fn join(&mut self, inside: &[u32]) {
        self.searches += 1;
        inside.iter().for_each(|&at| self.groups[at as usize] = at);
        for &at in inside {
            for (edge, turns) in self.surface.triangles[at as usize].sides {
                let first = &mut self.first[edge as usize];
                if first.0 == self.searches {
                    self.turns[edge as usize] += turns;
                    let [a, b] = [first.1, at].map(|at| group(&mut self.groups, at));
                    self.groups[a.max(b) as usize] = a.min(b);
                } else {
                    (*first, self.turns[edge as usize]) = ((self.searches, at), turns);
                }
            }
        }
    }

    /// Finds the slabs of one piece; the area that they cover.
    fn piece(&mut self, across: DVec3, levels: &[f64], piece: &[(u32, u32)]) -> f64 {
        let u = self.up.cross(across).try_normalize();
        let u = u.unwrap_or_else(|| across.any_orthonormal_vector());
        let v = across.cross(u);
        let mut border = Vec::new();
        let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
        let triangles = piece.iter().map(|&(_, at)| &self.surface.triangles[at as usize]);
        let both_sides = triangles.clone().all(|triangle| triangle.double_sided);
        let rule = if both_sides { FillRule::EvenOdd } else { FillRule::NonZero };
        for triangle in triangles {
            for point in triangle.points {
                from = from.min(levels[point as usize]);
                to = to.max(levels[point as usize]);
            }
            for (edge, _) in triangle.sides {
                let turns = std::mem::take(&mut self.turns[edge as usize]);
                if turns != 0 && (rule == FillRule::NonZero || turns % 2 != 0) {
                    let place = |point: u32| {
                        let at = self.surface.points[point as usize];
                        [at.dot(u), at.dot(v)]
                    };
                    let ends = self.surface.edges[edge as usize].map(place);
                    border.push(Edge { ends, turns });
                }
            }
        }
        let rounding = ROUNDING * self.surface.diagonal;
        let mut covered = 0.0;
        for found in rectangles(&border, rule, self.least, FINE * self.surface.diagonal) {
            covered += found.new_area;
            let middle = |axis: usize| (found.min[axis] + found.max[axis]) / 2.0;
            let half = |axis: usize| (found.max[axis] - found.min[axis]) / 2.0 - rounding;
            let out = if found.to_the_left { across } else { -across };
            let centre = u * middle(0) + v * middle(1) + across * ((from + to) / 2.0);
            self.slabs.push(Slab {
                middle: centre.as_vec3(),
                half: [(u * half(0)).as_vec3(), (v * half(1)).as_vec3()],
                half_across: (out * ((to - from) / 2.0 + rounding)).as_vec3(),
                both_sides,
            });
        }
        covered
    }
}

/// The group of a triangle.
fn group(groups: &mut [u32], mut at: u32) -> u32 {
    while groups[at as usize] != at {
        groups[at as usize] = groups[groups[at as usize] as usize];
        at = groups[at as usize];
    }
    at
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::engine::occlusion::test_mesh::{bumpy_wall, meets, mesh};
    use crate::random::Random;

    fn slabs(triangles: &[[[f32; 3]; 3]]) -> Vec<Slab> {
        find_slabs(&Surface::new(&mesh(triangles)), DVec3::Z)
    }

    #[test]
    fn a_wall_is_one_slab_and_looks_outward() {
        let wall = [
            [[3.0, 0.0, 0.0], [3.0, 8.0, 0.0], [3.0, 8.0, 5.0]],
            [[3.0, 0.0, 0.0], [3.0, 8.0, 5.0], [3.0, 0.0, 5.0]],
        ];
        let found = slabs(&wall);
        assert!(found[0].area() > 0.9 * 40.0, "{found:?}");
        assert!(found[0].half_across.x > 0.0, "its corners turn to the left from there");
        assert!(found[0].half_across.length() < 1e-3);
        let [one, [a, b, c]] = wall;
        let found = slabs(&[one, [a, c, b]]);
        assert!(found[0].area() > 0.9 * 40.0, "both sides are drawn, wherever each looks");
        let mut mesh = mesh(&[one, [a, c, b]]);
        mesh.primitives[0].surface.double_sided = false;
        let found = find_slabs(&Surface::new(&mesh), DVec3::Z);
        assert!(
            found.iter().all(|slab| slab.area() < 20.0),
            "one of them is seen from either side"
        );
        assert!(slabs(&[]).is_empty());
        assert!(slabs(&[[[1.0; 3]; 3]]).is_empty(), "a point");
        assert!(slabs(&[[[0.0; 3], [1.0; 3], [f32::INFINITY; 3]]]).is_empty());
        assert!(slabs(&[[[0.0; 3], [1.0; 3], [f32::NAN; 3]]]).is_empty());
    }

    #[test]
    fn lines_through_both_faces_meet_the_surface() {
        let mut random = Random::new(4, 0);
        let (mut lines, mut large) = (0, 0);
        for _ in 0..20 {
            let wall = bumpy_wall(&mut random);
            for slab in slabs(&wall) {
                large += u32::from(slab.area() > 20.0);
                let mut at = |face: f32| {
                    let [u, v] = slab.half.map(|half| half * random.between(-1.0, 1.0) as f32);
                    (slab.middle + u + v + slab.half_across * face).as_dvec3()
                };
                for _ in 0..50 {
                    let [from, to] = [at(1.0), at(-1.0)];
                    lines += 1;
                    assert!(meets(&wall, from, to), "{slab:?} {from} {to}");
                }
            }
        }
        assert!(lines > 5000 && large > 20, "{lines} {large}");
    }

    #[test]
    fn part_of_view_is_that_of_a_sphere() {
        let half = [Vec3::Y * 0.1, Vec3::Z * 0.2];
        let slab = Slab { middle: Vec3::X, half, half_across: Vec3::X * 0.01, both_sides: true };
        assert!((slab.part_of_view(Vec3::X * 10.0) - 0.08 / 100.0).abs() < 1e-6);
        assert!(slab.part_of_view(Vec3::Y * 10.0) < 1e-9, "edge on");
        assert!(slab.part_of_view(Vec3::X * 1e-9) <= 1.0);
    }
}
