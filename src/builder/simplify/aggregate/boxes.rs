//! Fewer and larger boxes in place of bodies that stand too far apart to be joined.
//!
//! A suburb of detached houses has no gaps that could be filled, and there are more houses than a coarse node
//! has triangles. As in stochastic simplification of aggregate detail (Cook, Halstead, Planck & Ryu 2007), some
//! stay, spread evenly, and are enlarged so that the ground that all of them cover is kept.

use glam::{DVec2, DVec3};

use super::appearance::Appearance;
use super::prisms::Body;
use crate::builder::simplify::morton::places;
use crate::builder::simplify::parts::Part;
use crate::mesh::{Mesh, UpAxis, wide};
use crate::random::{hash, unit};

/// A box has so many triangles. It has no floor, since nobody sees that.
pub(super) const TRIANGLES: usize = 10;

/// The body that stays in one place has at least this share of the footprint of the largest one there.
const LARGE: f64 = 0.75;

/// Makes boxes of about `target` triangles that cover as much ground as the bodies and have as much volume.
pub(super) fn boxes(mesh: &Mesh, bodies: &[(Part, Body)], target: usize, up: UpAxis) -> Mesh {
    let bounds: Vec<Bounds> =
        bodies.iter().map(|(part, body)| Bounds::of(mesh, part, body, up)).collect();
    let middles: Vec<DVec3> = bounds.iter().map(|bounds| bounds.middle.extend(0.0)).collect();
    let places = places(&middles);
    let mut order: Vec<usize> = (0..bodies.len()).collect();
    order.sort_by_key(|&body| places[body]);
    let all = order.len();
    let count = (target / TRIANGLES).clamp(1, all);
    let low = bounds.iter().map(|bounds| bounds.low).fold(DVec2::INFINITY, DVec2::min);
    let high = bounds.iter().map(|bounds| bounds.high).fold(DVec2::NEG_INFINITY, DVec2::max);
    let mut result = Mesh::default();
    for number in 0..count {
        let around = &order[number * all / count..(number + 1) * all / count];
        let area: f64 = around.iter().map(|&body| bodies[body].1.footprint).sum();
        let volume: f64 =
            around.iter().map(|&body| bodies[body].1.footprint * bodies[body].1.height).sum();
        let chosen = chosen(around, number as u64, |body| bodies[body].1.footprint);
        let Bounds { middle, along, sides, .. } = bounds[chosen];
        let body = &bodies[chosen].1;
        let larger = (area / (sides.x * sides.y)).sqrt();
        let half = sides * larger * 0.5;
        let across = along.perp();
        // It moves to where it does not go beyond the bodies, or as much on one side as on the other.
        let reach = along.abs() * half.x + across.abs() * half.y;
        let (up_by, down_by) = (low - (middle - reach), high - (middle + reach));
        let middle = middle + up_by.max(DVec2::ZERO) + down_by.min(DVec2::ZERO);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| middle + along * (half.x * x) + across * (half.y * y));
        if half.is_finite() && area > 0.0 {
            push(&mut result, mesh, up, corners, [body.low, body.low + volume / area], body);
        }
    }
    result
}

/// The box around a body, seen from above.
#[derive(Clone, Copy)]
struct Bounds {
    middle: DVec2,
    /// The direction of its longest edge, unit length.
    along: DVec2,
    /// Its sides along that direction and across.
    sides: DVec2,
    /// The corners of an upright box around it.
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn of(mesh: &Mesh, part: &Part, body: &Body, up: UpAxis) -> Self {
        let at = |vertex: u32| up.z_up(wide(mesh.positions[vertex as usize])).truncate();
        let edges = part.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let longest = edges.map(|[from, to]| at(to) - at(from)).fold(DVec2::ZERO, |most, edge| {
            if edge.length_squared() > most.length_squared() { edge } else { most }
        });
        let along = longest.normalize_or(DVec2::X);
        let corners = || part.triangles.as_flattened().iter().map(|&vertex| at(vertex));
        let around = |axes: [DVec2; 2]| {
            let corners = || corners().map(|at| DVec2::new(at.dot(axes[0]), at.dot(axes[1])));
            let low = corners().fold(DVec2::INFINITY, DVec2::min);
            [low, corners().fold(DVec2::NEG_INFINITY, DVec2::max)]
        };
        let [first, last] = around([along, along.perp()]);
        let middle = (first + last) * 0.5;
        let middle = along * middle.x + along.perp() * middle.y;
        let [low, high] = around([DVec2::X, DVec2::Y]);
        // A body without an extent gets a thousandth of the side of a square with its footprint.
        let least = body.footprint.sqrt() * 1e-3;
        Self { middle, along, sides: (last - first).max(DVec2::splat(least)), low, high }
    }
}

/// Returns the body that stays of some: one of the large, chosen at random.
fn chosen(bodies: &[usize], number: u64, footprint: impl Fn(usize) -> f64) -> usize {
    let most = bodies.iter().map(|&body| footprint(body)).fold(0.0, f64::max);
    let large: Vec<usize> =
        bodies.iter().copied().filter(|&body| footprint(body) >= LARGE * most).collect();
    let place = unit(hash(0, number, bodies.len() as u64)) * large.len() as f64;
    large.get(place as usize).copied().unwrap_or(bodies[0])
}

/// Adds a box over four corners, counter-clockwise, that looks like a body.
fn push(
    result: &mut Mesh,
    mesh: &Mesh,
    up: UpAxis,
    corners: [DVec2; 4],
    heights: [f64; 2],
    body: &Body,
) {
    let mut corner = |at: DVec2, height: f64, look: &Appearance| {
        let position = up.from_z_up(at.extend(height)).as_vec3().to_array();
        look.push(result, mesh, position)
    };
    let [foot, top] = heights.map(|height| corners.map(|at| corner(at, height, &body.wall)));
    let roof = corners.map(|at| corner(at, heights[1], &body.roof));
    let [a, b, c, d] = roof;
    result.triangles.extend([[a, b, c], [a, c, d]]);
    for i in 0..4 {
        let j = (i + 1) % 4;
        result.triangles.extend([[foot[i], foot[j], top[j]], [foot[i], top[j], top[i]]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::constants::PrismConstants;
    use crate::builder::simplify::aggregate::{ComponentRules, Components};
    use crate::builder::simplify::test_box::add_box;

    /// Makes boxes of this width, 30 m apart on a grid, each turned by another angle.
    fn houses(count: usize, size: f64) -> Mesh {
        let mut mesh = Mesh::default();
        for house in 0..count * count {
            let middle = DVec2::new((house % count) as f64, (house / count) as f64) * 30.0;
            let along = DVec2::from_angle(house as f64 * 0.1);
            let half = DVec2::new(size, 0.7 * size) * 0.5;
            let height = 4.0 + (house % 5) as f64;
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| middle + along * (half.x * x) + along.perp() * (half.y * y));
            add_box(&mut mesh, corners, height);
        }
        mesh
    }

    fn spread(mesh: &Mesh, target: usize) -> Mesh {
        let constants = &PrismConstants::default();
        let rules = ComponentRules { up: UpAxis::Z, extrudable: &[true], constants };
        let free = vec![false; mesh.positions.len()];
        let components = Components::of(mesh, &free, &rules);
        components.spread(mesh, target, UpAxis::Z).expect("there are bodies").prisms
    }

    /// Returns the area that faces the sky, as seen from above, square metres.
    fn ground(mesh: &Mesh) -> f64 {
        let rise = |&triangle: &[u32; 3]| {
            let [a, b, c] = mesh.corners(triangle);
            (b - a).cross(c - a).z.max(0.0) * 0.5
        };
        mesh.triangles.iter().map(rise).sum()
    }

    #[test]
    fn fewer_houses_cover_as_much_ground_and_have_as_much_volume() {
        let mesh = houses(20, 9.0);
        let volume = |mesh: &Mesh| -> f64 {
            let six = |&t: &[u32; 3]| {
                let [a, b, c] = mesh.corners(t);
                a.dot(b.cross(c))
            };
            mesh.triangles.iter().map(six).sum::<f64>() / 6.0
        };
        let low = mesh.positions.iter().map(|p| p[0].min(p[1])).fold(f32::INFINITY, f32::min);
        let high = mesh.positions.iter().map(|p| p[0].max(p[1])).fold(0.0, f32::max);
        for target in [1000, 405, 47, 1] {
            let boxes = spread(&mesh, target);
            assert_eq!(boxes.triangles.len(), (target / 10).max(1) * 10);
            let (own, all) = (ground(&boxes), ground(&mesh));
            assert!((own / all - 1.0).abs() < 1e-3, "{target}: {own} of {all} m²");
            let (own, all) = (volume(&boxes), volume(&mesh));
            assert!((own / all - 1.0).abs() < 1e-3, "{target}: {own} of {all} m³");
            let inside = |p: &[f32; 3]| p[..2].iter().all(|c| (low..=high).contains(c));
            assert!(boxes.positions.iter().all(inside), "{target}");
        }
    }

    #[test]
    fn boxes_of_what_is_in_each_other_are_in_each_other() {
        let (outer, inner) = (spread(&houses(12, 10.0), 160), spread(&houses(12, 8.0), 160));
        for (outer, inner) in outer.positions.chunks(12).zip(inner.positions.chunks(12)) {
            let middle = |corners: &[[f32; 3]]| {
                corners.iter().map(|p| DVec2::new(p[0].into(), p[1].into())).sum::<DVec2>() / 12.0
            };
            assert!(middle(outer).distance(middle(inner)) < 4.0);
        }
    }
}
