//! The largest distance from one surface to another, one way, by branch and bound.
//!
//! Only the largest distance counts, so that of most parts of the surface it is enough to know
//! that they are not farther than a point that was found elsewhere. A part is settled
//! - where its centre is nearer than that by more than the part reaches from there;
//! - where all its corners are near one triangle of the other surface: the distance to that is
//!   convex, so that nothing between them is farther.
//!
//! What is not settled is divided: nodes of the hierarchy into their children, leaves into
//! triangles, triangles into polygons. A polygon is clipped to what is near one triangle, which
//! is settled, and what is left around, so that equal surfaces with other triangles take about as
//! many polygons as their triangles overlap in.
//!
//! Surfaces may have an offset from the source themselves. It is added to distances from them and to them
//! (triangle inequality).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::{DVec3, Vec3};

use super::bvh::{Box3, LEAF};
use super::overlay::{Overlay, VisitState, VisitStates};
use super::polygon::{Clipped, MOST_CORNERS, Polygon, bisect, centroid, clip};
use super::searchable_surface::{Search, SearchableSurface, TriangleId};
use super::triangle::{LANES, Points, Triangle, max};
use crate::builder::constants::MeasureConstants;

/// The bound is at most so many times the largest distance found, as far as the budget goes.
pub const TIGHTNESS: f32 = 1.1;

/// The largest distance of both ways, as far as it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaxDistance {
    /// Found at a point.
    pub found: f32,
    /// Smaller distances are not told apart.
    least: f32,
    /// No part that is settled is farther.
    pub settled: f32,
    /// Whether the budget was too small.
    pub exhausted: bool,
    /// Polygons that were divided.
    pub divisions: usize,
}

impl MaxDistance {
    /// Nothing less than `least` is told apart.
    pub fn at_least(least: f32) -> Self {
        let found = least / TIGHTNESS;
        Self { found, least, settled: 0.0, exhausted: false, divisions: 0 }
    }

    /// No point of either surface is farther.
    pub fn bound(&self) -> f32 {
        self.found.max(self.settled)
    }

    fn limit(&self) -> f32 {
        self.least.max(self.found * TIGHTNESS)
    }

    fn find(&mut self, distance: f32) {
        self.found = self.found.max(distance);
    }

    /// Whether what is not farther than this needs no division.
    fn settles(&mut self, bound: f32) -> bool {
        let settles = bound <= self.limit();
        if settles {
            self.settled = self.settled.max(bound);
        }
        settles
    }
}

/// Part of a triangle.
struct Part {
    /// The number of the mesh that the triangle is of.
    of: u32,
    corners: Polygon,
    /// No point of it is farther.
    bound: f32,
    /// How far its centre is, and from which triangle, where that is known.
    near: Option<(f32, TriangleId)>,
}

impl Part {
    fn new(of: u32, corners: Polygon, bound: f32) -> Self {
        Self { of, corners, bound, near: None }
    }
}

/// From a surface to another; neither may be empty.
pub(super) struct OneSidedHausdorff<'a> {
    from: &'a SearchableSurface,
    /// What the way back has told of its triangles.
    visit_states: Option<VisitStates>,
    /// By how much computed distances may be wrong.
    rounding: f32,
    search: Search<'a>,
    overlay: Overlay<'a>,
    largest: MaxDistance,
    budget: usize,
    constants: MeasureConstants,
}

/// A triangle that is not settled.
struct Open {
    id: TriangleId,
    /// See [`Part`].
    bound: f32,
    /// A triangle that it is above or below.
    start: TriangleId,
}

/// Measures some points, spread evenly.
pub(super) fn seed(from: &SearchableSurface, to: &SearchableSurface, largest: &mut MaxDistance) {
    let mut search = Search::new(to);
    let leaves: usize = from.parts.iter().map(|part| part.bvh.leaves.len()).sum();
    let all = (0..).zip(&from.parts);
    let all = all.flat_map(|(of, part)| part.bvh.leaves.iter().map(move |leaf| (of, leaf)));
    for (part, leaf) in all.step_by(leaves.div_ceil(from.constants.seeds)) {
        let off = from.off(part);
        for point in leaf.lane(0).corners() {
            let near = search.nearest(point, largest.found - off);
            largest.find(near.squared.sqrt() + off + to.off(near.id.part));
        }
    }
}

impl<'a> OneSidedHausdorff<'a> {
    pub fn new(
        from: &'a SearchableSurface,
        to: &'a SearchableSurface,
        largest: MaxDistance,
        rounding: f32,
    ) -> Self {
        let triangles = from.triangle_count() + to.triangle_count();
        let constants = from.constants;
        let budget = constants.divisions.max(constants.divisions_per_triangle * triangles);
        let (search, overlay) = (Search::new(to), Overlay::new(to));
        Self { from, visit_states: None, rounding, search, overlay, largest, budget, constants }
    }

    /// With what the way back has told. The surface it goes to must be of one mesh.
    pub fn with_visit_states(self, visit_states: VisitStates) -> Self {
        let settled = self.largest.settled.max(visit_states.farthest);
        let largest = MaxDistance { settled, ..self.largest };
        Self { visit_states: Some(visit_states), largest, ..self }
    }

    /// Raises the largest distance to what it is, or to what the budget can say; also what was
    /// learnt of the other surface.
    pub fn run(mut self) -> (MaxDistance, VisitStates) {
        let mut open = Vec::new();
        for (number, part) in (0..).zip(&self.from.parts) {
            self.child(number, part.bvh.tree.root, part.bvh.bounds, &mut open);
        }
        let mut left = BinaryHeap::new();
        for triangle in open {
            self.triangle(triangle, &mut left);
        }
        self.divide_rest(left);
        (self.largest, self.overlay.into_visit_states())
    }

    /// Measures a point of a mesh of the surface, to no less than `enough` or the largest so far.
    fn measure(&mut self, of: u32, point: Vec3, enough: f32) -> (f32, TriangleId) {
        let near = self.nearest(of, point, enough.min(self.largest.found));
        self.largest.find(near.0);
        near
    }

    /// The distance to the nearest triangle and how far both meshes may be off, or one that is not
    /// above `enough`.
    fn nearest(&mut self, of: u32, point: Vec3, enough: f32) -> (f32, TriangleId) {
        let near = self.search.nearest(point, enough - self.from.off(of));
        (near.squared.sqrt() + self.off(of, near.id), near.id)
    }

    /// Returns the sum of the surface offsets of a mesh and of the other surface at a triangle.
    fn off(&self, of: u32, at: TriangleId) -> f32 {
        self.from.off(of) + self.search.original().off(at.part)
    }

    /// Measures the centre of a part that reaches so far from there, to no less than what settles
    /// it.
    fn measure_near(&mut self, of: u32, centre: Vec3, reach: f32) -> (f32, TriangleId) {
        let settling = self.largest.limit() - reach;
        self.measure(of, centre, settling)
    }

    fn child(&mut self, part: u32, child: u32, bounds: Box3, open: &mut Vec<Open>) {
        if child & LEAF != 0 && self.unsettled(part, child & !LEAF) == 0 {
            return;
        }
        let reach = bounds.diagonal() * 0.5;
        let limit = self.largest.limit();
        // Otherwise not even a centre on the other surface would do.
        if reach < limit {
            let (distance, _) = self.nearest(part, bounds.centre(), limit - reach);
            if self.largest.settles(distance + reach) {
                return;
            }
        }
        if child & LEAF != 0 {
            return self.leaf(part, child & !LEAF, open);
        }
        let from = self.from;
        for (child, bounds) in from.parts[part as usize].bvh.tree.nodes[child as usize].boxes() {
            self.child(part, child, bounds, open);
        }
    }

    /// The lanes of a leaf that the way back has not settled, one bit each.
    fn unsettled(&self, part: u32, leaf: u32) -> u32 {
        let count = self.from.parts[part as usize].bvh.counts[leaf as usize];
        let is_open =
            |&lane: &u32| !self.mark(part, leaf, lane).is_some_and(VisitState::is_settled);
        (0..count.into()).filter(is_open).fold(0, |lanes, lane| lanes | 1 << lane)
    }

    fn mark(&self, part: u32, leaf: u32, lane: u32) -> Option<VisitState> {
        Some(self.visit_states.as_ref()?.of(TriangleId { part, leaf, lane }))
    }

    /// Settles triangles of a leaf, all at a time, by triangles of the other surface that one of
    /// them is near to.
    fn leaf(&mut self, part: u32, leaf: u32, open: &mut Vec<Open>) {
        let bvh = &self.from.parts[part as usize].bvh;
        let corners = bvh.leaves[leaf as usize].corners();
        let mut bounds = [f32::INFINITY; LANES];
        let mut unsettled = self.unsettled(part, leaf);
        while unsettled != 0 {
            let chosen = unsettled.trailing_zeros() as usize;
            let marked = self.mark(part, leaf, chosen as u32).and_then(VisitState::slot);
            let start = marked.map(|slot| TriangleId::of_slot(0, slot)).unwrap_or_else(|| {
                let [a, b, c] = [0, 1, 2].map(|corner| corners[corner].lane(chosen));
                let centre = (a + b + c) / 3.0;
                let reach = [a, b, c].map(|corner| corner.distance_squared(centre));
                let reach = reach.into_iter().fold(0f32, f32::max).sqrt();
                let (distance, near) = self.measure_near(part, centre, reach);
                bounds[chosen] = bounds[chosen].min(distance + reach);
                near
            });
            let off = self.off(part, start);
            let triangle = self.search.original().triangle(start);
            let squared = [0, 1, 2].map(|corner| triangle.squared_distances(&corners[corner]));
            let [a, b, c] = squared;
            let tried = unsettled;
            for lane in (0..LANES).filter(|lane| tried >> lane & 1 == 1) {
                bounds[lane] = bounds[lane].min(max(max(a[lane], b[lane]), c[lane]).sqrt() + off);
                if self.largest.settles(bounds[lane]) {
                    unsettled &= !(1 << lane);
                }
            }
            // The one that the triangle was found for needs more than that.
            if unsettled >> chosen & 1 == 0 {
                continue;
            }
            unsettled &= !(1 << chosen);
            for (corners, squared) in corners.iter().zip(squared) {
                // Others are known to be nearer than what was found.
                if marked.is_none() && squared[chosen].sqrt() + off > self.largest.found {
                    self.measure(part, corners.lane(chosen), self.largest.found);
                }
            }
            let bound = bounds[chosen];
            if !self.largest.settles(bound) {
                let id = TriangleId { part, leaf, lane: chosen as u32 };
                open.push(Open { id, bound, start });
            }
        }
    }

    /// Settles a triangle by its overlay, else by dividing it.
    fn triangle(&mut self, open: Open, left: &mut BinaryHeap<Waiting>) {
        let Open { id, bound, start } = open;
        let triangle = self.from.triangle(id);
        if self.largest.settles(bound) || self.settles_overlay(&triangle, id, start) {
            return;
        }
        let corners = triangle.corners();
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let nearest = self.measure(id.part, centre, 0.0);
        if nearest.1 != start && self.settles_overlay(&triangle, id, nearest.1) {
            return;
        }
        // Layers of a folded surface may coincide at the centre, and the walk may begin on one that ends.
        // Fewer of them reach the corner that is farthest from it.
        let reach = |corner: &Vec3| corner.distance_squared(centre);
        let far = corners.into_iter().max_by(|a, b| reach(a).total_cmp(&reach(b)));
        let (_, near) = self.measure(id.part, far.unwrap_or(centre), 0.0);
        if ![start, nearest.1].contains(&near) && self.settles_overlay(&triangle, id, near) {
            return;
        }
        let corners = corners.map(|corner| corner.as_dvec3()).to_vec();
        self.divide(Part { of: id.part, corners, bound, near: Some(nearest) }, left);
    }

    fn settles_overlay(&mut self, triangle: &Triangle, id: TriangleId, start: TriangleId) -> bool {
        let limit = self.largest.limit() - self.from.off(id.part);
        // The walk visits triangles within the limit only.
        let to = self.search.original();
        let off = to.max_surface_offset_near(Box3::of(triangle.corners()), limit);
        if limit <= off {
            return false;
        }
        let bound = self.overlay.bound(triangle, id.slot(), start, limit - off, self.rounding);
        bound.is_some_and(|bound| self.largest.settles(bound + off + self.from.off(id.part)))
    }

    /// Divides a triangle and what it is divided into, to some number of polygons.
    fn divide(&mut self, part: Part, left: &mut BinaryHeap<Waiting>) {
        let mut stack = vec![part];
        let mut divisions = 0;
        while let Some(part) = stack.pop() {
            if self.largest.settles(part.bound) {
                continue;
            }
            if divisions == self.constants.polygons_per_triangle {
                left.push(Waiting { number: left.len(), part });
                continue;
            }
            divisions += 1;
            self.divide_once(part, &mut stack);
        }
    }

    fn divide_rest(&mut self, mut left: BinaryHeap<Waiting>) {
        let mut number = left.len();
        let mut divisions = 0;
        let mut parts = Vec::new();
        while let Some(Waiting { part, .. }) = left.pop() {
            // All others are nearer.
            if self.largest.settles(part.bound) {
                return;
            }
            if divisions == self.budget {
                self.largest.exhausted = true;
                self.largest.settled = self.largest.settled.max(part.bound);
                return;
            }
            divisions += 1;
            self.divide_once(part, &mut parts);
            for part in parts.drain(..) {
                left.push(Waiting { number, part });
                number += 1;
            }
        }
    }

    fn divide_once(&mut self, part: Part, parts: &mut Vec<Part>) {
        self.largest.divisions += 1;
        let Part { of, corners, bound, near } = part;
        let centre = centroid(&corners);
        let reach = corners.iter().map(|corner| corner.distance_squared(centre));
        let reach = reach.fold(0.0, f64::max).sqrt();
        let (distance, near) =
            near.unwrap_or_else(|| self.measure_near(of, centre.as_vec3(), reach as f32));
        let bound = bound.min(distance + reach as f32);
        if self.largest.settles(bound) {
            return;
        }
        let off = self.off(of, near);
        let triangle = self.search.original().triangle(near);
        let (farthest, number) = farthest_corner(&triangle, &corners);
        let bound = bound.min(farthest + off);
        if self.largest.settles(bound) {
            return;
        }
        let limit = self.largest.limit();
        let much_larger =
            reach > self.constants.much_larger * f64::from(triangle.length + 2.0 * limit);
        if corners.len() <= MOST_CORNERS && !much_larger {
            // A part clipped exactly to the limit would seem to be beyond it half of the time.
            let near = f64::from(limit - self.rounding - off);
            let clipped =
                (near > 0.0).then(|| clip(&corners, centre, reach, &triangle.frame(), near));
            if let Some(Clipped { inside, outside }) = clipped.flatten() {
                let (farthest, _) = farthest_corner(&triangle, &inside);
                if self.largest.settles(farthest + off) {
                    parts.extend(outside.into_iter().map(|corners| Part::new(of, corners, bound)));
                    return;
                }
            }
        }
        self.measure(of, corners[number].as_vec3(), self.largest.found);
        if self.largest.settles(bound) {
            return;
        }
        let halves = bisect(corners, centre, reach);
        parts.extend(
            halves
                .into_iter()
                .filter(|half| !half.is_empty())
                .map(|corners| Part::new(of, corners, bound)),
        );
    }
}

/// The corner that is farthest from a triangle, and how far it is.
fn farthest_corner(triangle: &Triangle, corners: &[DVec3]) -> (f32, usize) {
    let mut farthest = (0f32, 0);
    for (chunk, first) in corners.chunks(LANES).zip((0..).step_by(LANES)) {
        let points = Points::from_fn(|lane| chunk[lane.min(chunk.len() - 1)].as_vec3());
        let squared = triangle.squared_distances(&points);
        for (lane, &squared) in squared.iter().enumerate().take(chunk.len()) {
            if squared > farthest.0 {
                farthest = (squared, first + lane);
            }
        }
    }
    (farthest.0.sqrt(), farthest.1)
}

/// A part that waits for its turn: the one with the largest bound is the first, and of equal ones
/// the oldest.
struct Waiting {
    part: Part,
    number: usize,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_bound = self.part.bound.total_cmp(&other.part.bound);
        by_bound.then_with(|| other.number.cmp(&self.number))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting {}
