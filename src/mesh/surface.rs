//! Closest points of a triangle mesh, exact in f64.
//!
//! The bounding-volume hierarchies have f32 boxes around centres of their own, since they only
//! guide the search: a box is left out only where it is farther than the best triangle so far by
//! more than f32 can be wrong. The distance to a triangle is computed in f64 from source
//! coordinates. Each square of some kilometres has its own hierarchy, so that f32 stays fine where
//! a scene holds models from both ends of a country, and so has each part of a million triangles:
//! building one takes several times the memory that it then has.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;

use super::OrientedBox;
use crate::stage_timer::StageTimer;

/// Share of the extent by which a distance to a box may be wrong in f32: that of the point and
/// that of the box's corner, along three axes.
const BOX_SLACK: f64 = 4.0 / (1 << 23) as f64;

/// Least side of the squares, metres.
const SQUARE: f64 = 8192.0;

/// Least side of the squares, in sizes of the median triangle: what is in millimetres would have
/// a square for each triangle.
const SQUARE_TRIANGLES: f64 = 1024.0;

/// What lowers the reach of a search to this has found enough.
const ENOUGH: f64 = -1.0;

/// Triangles of one hierarchy, at most.
const MOST_TRIANGLES: usize = 1 << 20;

/// Triangles of a leaf of a hierarchy, at most.
const LEAF: usize = 4;

/// The boxes of two nodes overlap where their areas sum up to more than so many times that of the box
/// around both: those of a surface that is divided well have somewhat more than it.
const OVERLAP: f32 = 1.5;

/// A triangle mesh that can be asked for its closest point.
pub(crate) struct Surface {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    parts: Vec<Part>,
}

impl std::fmt::Debug for Surface {
    fn fmt(&self, out: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(out, "Surface of {} triangles", self.triangles.len())
    }
}

/// The triangles whose first corner lies in one square, or a part of them.
struct Part {
    nodes: Vec<BvhNode>,
    /// By node, the boxes of those that overlap others; empty where none does.
    oriented: Vec<Option<Box<OrientedBox>>>,
    /// Numbers of the triangles, those of a node side by side.
    members: Vec<u32>,
    low: DVec3,
    high: DVec3,
    slack: f64,
}

/// A node of a hierarchy, in 32 bytes.
#[derive(Clone, Copy, Default)]
struct BvhNode {
    low: Vec3,
    /// Triangles; 0 where it has nodes below it.
    count: u32,
    high: Vec3,
    /// Its first triangle among the members, or the first of two nodes below it.
    first: u32,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    /// The triangle's number.
    pub triangle: u32,
    /// Weights of its corners.
    pub weights: [f64; 3],
    /// Source coordinates.
    pub point: DVec3,
    /// Squared distance to the point that was asked for.
    pub squared: f64,
}

impl Hit {
    /// Distance to the point that was asked for, metres.
    pub fn distance(&self) -> f64 {
        self.squared.sqrt()
    }
}

impl Surface {
    /// A surface of these triangles in source coordinates.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self::in_parts(positions, triangles, MOST_TRIANGLES)
    }

    /// The same with hierarchies of at most so many triangles.
    fn in_parts(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, most: usize) -> Self {
        let size = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| positions[vertex as usize]);
            (a.max(b).max(c) - a.min(b).min(c)).max_element()
        };
        let mut sizes: Vec<f64> = triangles.iter().map(size).collect();
        let middle = sizes.len() / 2;
        let median = match sizes.is_empty() {
            true => 0.0,
            false => *sizes.select_nth_unstable_by(middle, f64::total_cmp).1,
        };
        drop(sizes);
        let side = SQUARE.max(SQUARE_TRIANGLES * median);
        let mut squares: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
        for (number, triangle) in (0..).zip(&triangles) {
            let corner = positions[triangle[0] as usize];
            let square = (corner / side).floor().to_array().map(|at| at as i64);
            squares.entry(square).or_default().push(number);
        }
        let mut parts = Vec::new();
        for members in squares.into_values() {
            divide(members, &positions, &triangles, most, &mut parts);
        }
        let timer = StageTimer::current();
        let part = |members| timer.time(|| Part::new(&positions, &triangles, members));
        let parts = parts.into_par_iter().map(part).collect();
        Self { positions, triangles, parts }
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|vertex| self.positions[vertex as usize])
    }

    /// All vertices.
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// The vertices of all triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The point nearest to `point`; `None` where there is no triangle.
    pub fn closest(&self, point: DVec3) -> Option<Hit> {
        self.closest_of(point, None, |_| 1.0)
    }

    /// The point nearest to `point` where the distance of a triangle counts `weight` times, which
    /// is at least 1; `None` where there is no triangle. The search begins with triangle `first`.
    pub fn closest_of(
        &self,
        point: DVec3,
        first: Option<u32>,
        weight: impl Fn(u32) -> f64,
    ) -> Option<Hit> {
        let weighted = |hit: &Hit| hit.squared * weight(hit.triangle).powi(2);
        let first = first.map(|triangle| hit(point, triangle, self.corners(triangle)));
        let mut best = first.map(|hit| (weighted(&hit), hit));
        let reach = best.map_or(f64::INFINITY, |(squared, _)| squared.sqrt());
        self.search(point, reach, |hit, reach| {
            let squared = weighted(&hit);
            // Of triangles that are equally near the first is taken, whatever the tree looks like.
            if best.is_none_or(|(least, best)| (squared, hit.triangle) < (least, best.triangle)) {
                *reach = squared.sqrt();
                best = Some((squared, hit));
            }
        });
        best.map(|(_, hit)| hit)
    }

    /// Some point within `reach` of `point`, on triangle `first` where that is near enough.
    pub fn any_within(&self, point: DVec3, reach: f64, first: u32) -> Option<Hit> {
        let squared = reach * reach;
        let known = self.on_triangle(point, first);
        if known.squared <= squared {
            return Some(known);
        }
        let mut found = None;
        self.search(point, reach, |hit, reach| {
            if hit.squared <= squared {
                found = Some(hit);
                *reach = ENOUGH;
            }
        });
        found
    }

    /// The point of one triangle that is nearest to `point`.
    pub fn on_triangle(&self, point: DVec3, triangle: u32) -> Hit {
        hit(point, triangle, self.corners(triangle))
    }

    /// The distance from `point`; infinite where there is no triangle.
    pub fn distance(&self, point: DVec3) -> f64 {
        self.closest(point).map_or(f64::INFINITY, |hit| hit.distance())
    }

    /// The nearest points of all triangles within `reach` of `point`, by number of triangle.
    pub fn within(&self, point: DVec3, reach: f64) -> Vec<Hit> {
        let mut hits = Vec::new();
        self.search(point, reach, |hit, reach| {
            if hit.squared <= *reach * *reach {
                hits.push(hit);
            }
        });
        hits.sort_unstable_by_key(|hit| hit.triangle);
        hits
    }

    /// Visits the triangles whose boxes may meet the box from `low` to `high`, in no order.
    pub fn in_box(&self, low: DVec3, high: DVec3, mut visit: impl FnMut(u32)) {
        for part in &self.parts {
            part.in_box(low, high, &mut visit);
        }
    }

    /// Visits the triangles that may be within `reach`, near ones first; `visit` may lower it.
    fn search(&self, point: DVec3, mut reach: f64, mut visit: impl FnMut(Hit, &mut f64)) {
        let distance = |part: &Part| point.distance_squared(point.clamp(part.low, part.high));
        let nearer = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0);
        let numbered = self.parts.iter().zip(0..).map(|(part, number)| (distance(part), number));
        let Some((_, nearest)) = numbered.min_by(nearer) else { return };
        self.parts[nearest].search(self, point, &mut reach, &mut visit);
        for (number, part) in self.parts.iter().enumerate() {
            if number != nearest && reach != ENOUGH && distance(part) <= reach * reach {
                part.search(self, point, &mut reach, &mut visit);
            }
        }
    }
}

/// Halves triangles across their longest side until a hierarchy can be built of each part.
fn divide(
    mut members: Vec<u32>,
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    most: usize,
    parts: &mut Vec<Vec<u32>>,
) {
    if members.len() <= most {
        members.shrink_to_fit();
        return parts.push(members);
    }
    let corner = |number: &u32| positions[triangles[*number as usize][0] as usize];
    let low = members.iter().map(corner).fold(DVec3::INFINITY, DVec3::min);
    let high = members.iter().map(corner).fold(DVec3::NEG_INFINITY, DVec3::max);
    let axis = (high - low).max_position();
    let middle = members.len() / 2;
    let by_place = |number: &u32| (corner(number)[axis], *number);
    members.select_nth_unstable_by(middle, |a, b| {
        let (a, b) = (by_place(a), by_place(b));
        a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
    });
    let others = members.split_off(middle);
    divide(members, positions, triangles, most, parts);
    divide(others, positions, triangles, most, parts);
}

/// A triangle while a hierarchy is built.
struct BoxedTriangle {
    number: u32,
    corners: [Vec3; 3],
}

impl BoxedTriangle {
    fn low(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        a.min(b).min(c)
    }

    fn high(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        a.max(b).max(c)
    }

    /// Twice the centre of its box.
    fn centre(&self) -> Vec3 {
        self.low() + self.high()
    }
}

/// The nodes of a hierarchy while it is built.
#[derive(Default)]
struct Builder {
    nodes: Vec<BvhNode>,
    oriented: BTreeMap<usize, OrientedBox>,
}

impl Builder {
    /// Builds the hierarchy of `boxes`, whose first is number `first` of all, below node `at`. Halves
    /// them at the median of the longest side that their centres span, so that counts alone bound the
    /// depth, wherever the boxes are.
    fn build(&mut self, at: usize, boxes: &mut [BoxedTriangle], first: usize) {
        let low = boxes.iter().fold(Vec3::INFINITY, |low, boxed| low.min(boxed.low()));
        let high = boxes.iter().fold(Vec3::NEG_INFINITY, |high, boxed| high.max(boxed.high()));
        if boxes.len() <= LEAF {
            self.nodes[at] = BvhNode { low, count: boxes.len() as u32, high, first: first as u32 };
            return;
        }
        let centres = || boxes.iter().map(BoxedTriangle::centre);
        let span = centres().fold(Vec3::NEG_INFINITY, Vec3::max)
            - centres().fold(Vec3::INFINITY, Vec3::min);
        let axis = span.max_position();
        let middle = boxes.len() / 2;
        boxes.select_nth_unstable_by(middle, |a, b| {
            a.centre()[axis].total_cmp(&b.centre()[axis]).then(a.number.cmp(&b.number))
        });
        let child = self.nodes.len();
        self.nodes.extend([BvhNode::default(); 2]);
        self.nodes[at] = BvhNode { low, count: 0, high, first: child as u32 };
        let (lower, upper) = boxes.split_at_mut(middle);
        self.build(child, lower, first);
        self.build(child + 1, upper, first + middle);
        let [one, other, both] = [child, child + 1, at].map(|node| self.nodes[node].half_area());
        if one + other > OVERLAP * both {
            for (node, boxes) in [(child, lower), (child + 1, upper)] {
                let around = OrientedBox::around(boxes.iter().map(|boxed| boxed.corners));
                self.oriented.insert(node, around);
            }
        }
    }

    /// By node; empty where there is none.
    fn oriented(&mut self) -> Vec<Option<Box<OrientedBox>>> {
        let nodes = if self.oriented.is_empty() { 0 } else { self.nodes.len() };
        (0..nodes).map(|node| self.oriented.remove(&node).map(Box::new)).collect()
    }
}

impl BvhNode {
    fn half_area(&self) -> f32 {
        let Vec3 { x, y, z } = self.high - self.low;
        x * y + y * z + z * x
    }
}

impl Part {
    fn new(positions: &[DVec3], triangles: &[[u32; 3]], members: Vec<u32>) -> Self {
        let corners = |number: u32| triangles[number as usize].map(|v| positions[v as usize]);
        let all = || members.iter().flat_map(|&number| corners(number));
        let low = all().fold(DVec3::INFINITY, DVec3::min);
        let high = all().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = (low + high) * 0.5;
        let local = |number: u32| corners(number).map(|p| (p - centre).as_vec3());
        let boxed = |&number: &u32| BoxedTriangle { number, corners: local(number) };
        let mut boxes: Vec<BoxedTriangle> = members.iter().map(boxed).collect();
        let mut builder = Builder { nodes: vec![BvhNode::default()], ..Builder::default() };
        builder.build(0, &mut boxes, 0);
        let oriented = builder.oriented();
        let nodes = builder.nodes;
        let members = boxes.iter().map(|boxed| boxed.number).collect();
        Self { nodes, oriented, members, low, high, slack: (high - low).max_element() * BOX_SLACK }
    }

    fn in_box(&self, low: DVec3, high: DVec3, visit: &mut impl FnMut(u32)) {
        let centre = (self.low + self.high) * 0.5;
        let slack =
            self.slack + (low - centre).abs().max(high - centre).abs().max_element() * BOX_SLACK;
        let wanted = [(low - centre - slack).as_vec3a(), (high - centre + slack).as_vec3a()];
        let mut stack = Vec::with_capacity(64);
        stack.push(0u32);
        while let Some(number) = stack.pop() {
            let node = &self.nodes[number as usize];
            let (low, high) = (Vec3A::from(node.low), Vec3A::from(node.high));
            if low.cmpgt(wanted[1]).any() || high.cmplt(wanted[0]).any() {
                continue;
            }
            match node.count {
                0 => stack.extend([node.first, node.first + 1]),
                _ => self.members_of(node).iter().for_each(|&member| visit(member)),
            }
        }
    }

    fn members_of(&self, node: &BvhNode) -> &[u32] {
        &self.members[node.first as usize..][..node.count as usize]
    }

    fn search(
        &self,
        surface: &Surface,
        point: DVec3,
        reach: &mut f64,
        visit: &mut impl FnMut(Hit, &mut f64),
    ) {
        let from_centre = point - (self.low + self.high) * 0.5;
        let local: Vec3A = from_centre.as_vec3a();
        // A point far outside is rounded by more than the square's extent says.
        let slack = self.slack + from_centre.abs().max_element() * BOX_SLACK;
        let to_box = |node: u32| {
            let BvhNode { low, high, .. } = self.nodes[node as usize];
            let squared = (local - local.clamp(low.into(), high.into())).length_squared();
            match self.oriented.get(node as usize) {
                Some(Some(oriented)) => squared.max(oriented.squared_distance(local.into())),
                _ => squared,
            }
        };
        // Squares, and a last bit more.
        let limit = |reach: f64| ((reach + slack).powi(2) * (1.0 + 1e-6)) as f32;
        let mut most = limit(*reach);
        let mut stack: Vec<(f32, u32)> = Vec::with_capacity(96);
        stack.push((to_box(0), 0));
        while let Some((distance, number)) = stack.pop() {
            if distance > most {
                continue;
            }
            let node = &self.nodes[number as usize];
            if node.count > 0 {
                for &triangle in self.members_of(node) {
                    visit(hit(point, triangle, surface.corners(triangle)), reach);
                    if *reach == ENOUGH {
                        return;
                    }
                }
                most = limit(*reach);
            } else {
                let (left, right) = (node.first, node.first + 1);
                let (near, far) = ((to_box(left), left), (to_box(right), right));
                let (near, far) = if near.0 <= far.0 { (near, far) } else { (far, near) };
                if far.0 <= most {
                    stack.push(far);
                }
                if near.0 <= most {
                    stack.push(near);
                }
            }
        }
    }
}

fn hit(point: DVec3, triangle: u32, corners: [DVec3; 3]) -> Hit {
    let weights = nearest_weights(point, corners);
    let [a, b, c] = corners;
    let nearest = a * weights[0] + b * weights[1] + c * weights[2];
    // Relative to the first corner, since weights of large coordinates lose digits.
    let offset = (b - a) * weights[1] + (c - a) * weights[2] - (point - a);
    Hit { triangle, weights, point: nearest, squared: offset.length_squared() }
}

/// Weights of the corners at the nearest point of a triangle, by the region of the plane that the
/// projection falls in (Ericson, Real-Time Collision Detection, section 5.1.5).
fn nearest_weights(p: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    // Of a side without length the other two know more.
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3 {
        let v = d1 / (d1 - d3);
        return [1.0 - v, v, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6 {
        let w = d2 / (d2 - d6);
        return [1.0 - w, 0.0, w];
    }
    let va = d3 * d6 - d5 * d4;
    let length = (d4 - d3) + (d5 - d6);
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 && length > 0.0 {
        let w = (d4 - d3) / length;
        return [0.0, 1.0 - w, w];
    }
    let sum = va + vb + vc;
    if sum > 0.0 { [va / sum, vb / sum, vc / sum] } else { [1.0, 0.0, 0.0] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::scaling::assert_scales;

    /// The nearest point by brute force: the projection where it is inside, else of the sides.
    fn naive(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let normal = (b - a).cross(c - a);
        let side = |from: DVec3, to: DVec3| {
            let t = ((p - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
            p.distance(from + (to - from) * t)
        };
        let sides = side(a, b).min(side(b, c)).min(side(c, a));
        let foot = p - normal * ((p - a).dot(normal) / normal.length_squared());
        let inside = [(a, b), (b, c), (c, a)]
            .iter()
            .all(|&(from, to)| (to - from).cross(foot - from).dot(normal) >= 0.0);
        if inside { p.distance(foot) } else { sides }
    }

    fn soup(triangles: u32, at: DVec3) -> Surface {
        soup_in_parts(triangles, at, MOST_TRIANGLES)
    }

    fn soup_in_parts(triangles: u32, at: DVec3, most: usize) -> Surface {
        let mut random = Random::new(5, 0);
        let mut positions = Vec::new();
        for _ in 0..triangles {
            let mut point = |size: f64| {
                DVec3::new(
                    random.between(-size, size),
                    random.between(-size, size),
                    random.between(-size, size),
                )
            };
            let centre = at + point(50.0);
            positions.extend([centre + point(4.0), centre + point(4.0), centre + point(4.0)]);
        }
        let corners = (0..triangles).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        Surface::in_parts(positions, corners, most)
    }

    #[test]
    fn agrees_with_trying_every_triangle_at_any_coordinates() {
        for at in [DVec3::ZERO, DVec3::new(678_016.0, 5_403_456.0, 300.0)] {
            let surface = soup(300, at);
            let mut random = Random::new(6, 0);
            for _ in 0..500 {
                let point = at
                    + DVec3::new(
                        random.between(-80.0, 80.0),
                        random.between(-80.0, 80.0),
                        random.between(-80.0, 80.0),
                    );
                let expected = (0..300)
                    .map(|triangle| naive(point, surface.corners(triangle)))
                    .fold(f64::INFINITY, f64::min);
                let found = surface.closest(point).unwrap();
                assert!((found.distance() - expected).abs() < 1e-8, "{found:?} {expected}");
                assert!((found.point.distance(point) - expected).abs() < 1e-8);
                let near = surface.within(point, expected + 5.0);
                let count = (0..300)
                    .filter(|&t| naive(point, surface.corners(t)) <= expected + 5.0)
                    .count();
                assert_eq!(near.len(), count);
            }
        }
    }

    #[test]
    fn triangles_without_area_are_as_near_as_their_longest_side() {
        let (o, x) = (DVec3::ZERO, DVec3::X);
        let flat = [[o, o, x], [o, x, o], [x, o, o], [o, x, x], [o, x, x * 0.5], [x * 0.5, x, o]];
        for corners in flat {
            for (at, expected) in [(-1.0, 1.0), (0.25, 0.0), (0.75, 0.0), (3.0, 2.0)] {
                let Hit { weights, squared, .. } = hit(x * at + DVec3::Y, 0, corners);
                assert!((squared - expected * expected - 1.0).abs() < 1e-12, "{corners:?} {at}");
                assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12, "{weights:?}");
            }
        }
        assert_eq!(hit(x, 0, [o; 3]).squared, 1.0);
    }

    #[test]
    fn models_from_far_apart_are_searched_one_by_one() {
        let (here, there) = (soup(50, DVec3::ZERO), soup(50, DVec3::new(678_016.0, 5e6, 0.0)));
        let first = here.positions.len() as u32;
        let triangles = here.triangles.iter().copied();
        let shifted = there.triangles.iter().map(|triangle| triangle.map(|v| first + v));
        let both = Surface::new(
            here.positions.iter().chain(&there.positions).copied().collect(),
            triangles.chain(shifted).collect(),
        );
        assert!(both.parts.len() > 1);
        for (at, alone) in [(DVec3::ZERO, &here), (DVec3::new(678_016.0, 5e6, 0.0), &there)] {
            let point = at + DVec3::new(3.0, 40.0, -7.0);
            assert_eq!(both.distance(point), alone.distance(point));
        }
    }

    #[test]
    fn a_model_in_millimetres_has_few_parts() {
        let corner = |at: usize| DVec3::new((at % 100) as f64, (at / 100) as f64, 0.0) * 2e4;
        let triangle = |at: usize| [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| corner(at) + p * 1e4);
        let positions: Vec<DVec3> = (0..10_000).flat_map(triangle).collect();
        let triangles = (0..10_000).map(|at| [0, 1, 2].map(|corner| 3 * at + corner)).collect();
        assert!(Surface::new(positions, triangles).parts.len() <= 4);
    }

    #[test]
    fn parts_are_one_surface() {
        let at = DVec3::new(678_016.0, 5_403_456.0, 300.0);
        let (whole, parts) = (soup(300, at), soup_in_parts(300, at, 20));
        assert!(whole.parts.len() == 1 && parts.parts.len() == 16);
        let mut random = Random::new(7, 0);
        for _ in 0..500 {
            let mut point = |size: f64| DVec3::from([(); 3].map(|()| random.between(-size, size)));
            let (point, size) = (at + point(80.0), point(30.0).abs());
            assert_eq!(parts.closest(point), whole.closest(point));
            let reach = size.x;
            let within = parts.within(point, reach);
            assert_eq!(within, whole.within(point, reach));
            let any = parts.any_within(point, reach, 299);
            assert_eq!(any.is_some(), !within.is_empty());
            assert!(any.is_none_or(|hit| within.contains(&hit)));
            let in_box = |surface: &Surface| {
                let mut found = Vec::new();
                surface.in_box(point - size, point + size, |triangle| {
                    let corners = surface.corners(triangle);
                    let low = corners.into_iter().fold(DVec3::INFINITY, DVec3::min);
                    let high = corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max);
                    if low.cmple(point + size).all() && high.cmpge(point - size).all() {
                        found.push(triangle);
                    }
                });
                found.sort_unstable();
                found
            };
            assert_eq!(in_box(&parts), in_box(&whole));
        }
    }

    /// The boxes along the axes of most slivers hold a point near their common corner.
    #[test]
    fn time_scales_with_the_triangles_of_a_fan() {
        let fan = |count: usize| {
            let rim = |at: usize| {
                let (sin, cos) = (at as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
                DVec3::new(cos, sin, 0.0) * 100.0
            };
            let positions: Vec<DVec3> =
                [DVec3::Z * 10.0].into_iter().chain((0..count).map(rim)).collect();
            let next = |at: u32| (at + 1) % count as u32;
            (positions, (0..count as u32).map(|at| [0, at + 1, next(at) + 1]).collect::<Vec<_>>())
        };
        assert_scales(1000, fan, |(positions, triangles)| {
            let mut random = Random::new(2, 0);
            let surface = Surface::new(positions.clone(), triangles);
            for _ in 0..positions.len() {
                let [x, y] = [0; 2].map(|_| random.between(-50.0, 50.0));
                surface.closest(DVec3::new(x, y, random.between(0.0, 10.0))).unwrap();
            }
        });
    }

    #[test]
    fn coincident_triangles_make_no_deep_hierarchy() {
        let triangles = |count: usize| vec![[0, 1, 2]; count];
        let positions = || vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        assert_scales(1000, triangles, |triangles| {
            let surface = Surface::new(positions(), triangles);
            assert_eq!(surface.distance(DVec3::Z), 1.0);
        });
    }

    #[test]
    fn nothing_is_near_an_empty_surface() {
        let surface = Surface::new(Vec::new(), Vec::new());
        assert_eq!(surface.closest(DVec3::ZERO), None);
        assert!(surface.within(DVec3::ZERO, 1e9).is_empty());
    }
}
