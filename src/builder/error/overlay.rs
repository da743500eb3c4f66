//! The overlay of a triangle and the connected triangles of another surface above and below it.
//!
//! From one triangle of the other surface on, all are visited that can be reached across edges
//! which pass over the triangle, seen along its normal. Where each of these edges belongs to just
//! two triangles, what is visited has no border over the triangle, so that all of its points are
//! covered an odd number of times, or all an even number of times (the degree of a map, modulo
//! 2). Where one point is covered an odd number of times, there is surface above or below each,
//! and none of it is farther than the highest corner of the overlay.
//!
//! Nothing is clipped but edges, and what is visited may have other triangles, more of them or
//! fewer: equal surfaces take about as many steps as their triangles overlap.

use glam::{Vec2, Vec3, Vec3A, Vec3Swizzles};

use super::adjacency::{Links, Slot, TriangleAdjacency};
use super::searchable_surface::{SearchableSurface, TriangleId};
use super::triangle::{Triangle, max, min};
use crate::builder::constants::MeasureConstants;

/// By so many times the rounding of coordinates edges are taken to be longer and points to be
/// nearer to edges.
const ROUNDINGS: f32 = 4.0;

/// Barycentric coordinates of the point at which coverage is counted: within, and on no line that
/// regular meshes have.
const COUNTED_AT: [f32; 3] = [0.293, 0.331, 0.376];

/// What walks have told of a triangle that they visited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct VisitState(u32);

impl VisitState {
    const NONE: Self = Self(u32::MAX);
    const SETTLED: Self = Self(u32::MAX - 1);

    fn near(slot: Slot) -> Self {
        Self(slot)
    }

    /// Whether all of the triangle is known to be near.
    pub fn is_settled(self) -> bool {
        self == Self::SETTLED
    }

    /// A triangle that it is above or below, at least in part.
    pub fn slot(self) -> Option<Slot> {
        (self.0 < Self::SETTLED.0).then_some(self.0)
    }
}

/// Of the triangles of a surface, what walks have told.
pub(super) struct VisitStates {
    /// Of each part the number of its first slot.
    firsts: Vec<usize>,
    /// Of each slot, which walk visited it last, and what is known.
    slots: Vec<(u32, VisitState)>,
    /// No point of a triangle that is marked as settled is farther, its off included.
    pub farthest: f32,
}

impl VisitStates {
    fn new(original: &SearchableSurface) -> Self {
        let mut count = 0;
        let firsts = original.parts.iter().map(|part| {
            let first = count;
            count += part.adjacency.triangles.len();
            first
        });
        let firsts = firsts.collect();
        Self { firsts, slots: vec![(0, VisitState::NONE); count], farthest: 0.0 }
    }

    /// Of a triangle.
    pub fn of(&self, id: TriangleId) -> VisitState {
        self.slots[self.firsts[id.part as usize] + id.slot() as usize].1
    }
}

/// Visits triangles of a surface.
pub(super) struct Overlay<'a> {
    original: &'a SearchableSurface,
    links: &'a Links,
    visit_states: VisitStates,
    now: u32,
    queue: Vec<Visited>,
}

#[derive(Clone, Copy)]
struct Visited {
    part: u32,
    slot: Slot,
    /// Of its mark.
    number: usize,
}

impl<'a> Overlay<'a> {
    pub fn new(original: &'a SearchableSurface) -> Self {
        let (links, visit_states) = (original.links(), VisitStates::new(original));
        Self { original, links, visit_states, now: 0, queue: Vec::new() }
    }

    /// What was learnt of the surface that was walked over.
    pub fn into_visit_states(self) -> VisitStates {
        self.visit_states
    }

    /// A bound on the distance of all points of a triangle, not above `limit`, if there is one to be
    /// found from a triangle `start` on that is near. Triangles on the way that are not farther
    /// from this one are marked as settled, whether or not.
    pub fn bound(
        &mut self,
        triangle: &Triangle,
        slot: Slot,
        start: TriangleId,
        limit: f32,
        rounding: f32,
    ) -> Option<f32> {
        let margin = ROUNDINGS * rounding;
        let MeasureConstants { aside, most_smaller, most_visited, .. } = self.original.constants;
        let base = Base::new(triangle, limit * aside, most_smaller, margin)?;
        let most = (limit * limit * (1.0 - aside * aside)).sqrt() - margin;
        if most <= 0.0 {
            return None;
        }
        self.now += 1;
        self.queue.clear();
        self.visit(start.part, start.slot());
        let mut highest = 0f32;
        let mut is_covered = false;
        let mut at = 0;
        while let Some(&Visited { part, slot: other, number }) = self.queue.get(at) {
            at += 1;
            let linked = &self.original.parts[part as usize].adjacency.triangles[other as usize];
            let seen = base.seen(linked);
            is_covered ^= seen.covers(base.counted_at, margin)?;
            let mark = &mut self.visit_states.slots[number].1;
            if *mark != VisitState::SETTLED {
                if seen.is_near(&base, most) {
                    *mark = VisitState::SETTLED;
                    // Also where the walk fails, and its bound counts for nothing.
                    let height = seen.height.abs().max_element() + margin;
                    let off = self.original.off(part);
                    let farthest = min(limit, height.hypot(limit * aside)) + off;
                    self.visit_states.farthest = max(self.visit_states.farthest, farthest);
                } else if *mark == VisitState::NONE || seen.is_centred() {
                    *mark = VisitState::near(slot);
                }
            }
            highest = max(highest, seen.height_within(&base, most, margin)?);
            let mut passing = seen.passing();
            while passing != 0 {
                let edge = passing.trailing_zeros() as usize;
                passing &= passing - 1;
                match linked.across(edge) {
                    Some(neighbour) => self.visit(part, neighbour),
                    None => {
                        let (part, slot) = self.links.across(part, other, edge)?;
                        self.visit(part, slot);
                    }
                }
            }
            if self.queue.len() > most_visited {
                return None;
            }
        }
        is_covered.then(|| min(limit, (highest + margin).hypot(limit * aside)))
    }

    #[inline(always)]
    fn visit(&mut self, part: u32, slot: Slot) {
        let number = self.visit_states.firsts[part as usize] + slot as usize;
        let visited = &mut self.visit_states.slots[number].0;
        if *visited != self.now {
            *visited = self.now;
            self.queue.push(Visited { part, slot, number });
        }
    }
}

/// The triangle that is to be covered, in its own frame, made smaller.
struct Base {
    origin: Vec3,
    along: Vec3,
    up: Vec3,
    normal: Vec3,
    /// Of each edge its normal outward, and how far along that it is.
    edges: [(Vec2, f32); 3],
    corners: [Vec2; 3],
    counted_at: Vec2,
    /// How far beyond each edge a point may be to be within the reach aside of the triangle.
    reach: [f32; 3],
}

impl Base {
    /// `None` for a triangle without area.
    #[inline(always)]
    fn new(triangle: &Triangle, aside: f32, most_smaller: f32, margin: f32) -> Option<Self> {
        let &Triangle { origin, along, up, length, apex } = triangle;
        let corners = [Vec2::ZERO, Vec2::new(length, 0.0), Vec2::from(apex)];
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.iter().map(|corner| corner.distance_squared(centre));
        let radius = radius.fold(0.0, max).sqrt();
        let smaller = min(aside / radius, most_smaller);
        let corners = corners.map(|corner| corner + (centre - corner) * smaller);
        let mut edges = [(Vec2::ZERO, 0.0); 3];
        let mut reach = [0.0; 3];
        // Made larger about its centre by as much as it was made smaller, of what it is now.
        let larger = 2.0 * smaller / (1.0 - smaller);
        for i in 0..3 {
            let normal = -(corners[(i + 1) % 3] - corners[i]).try_normalize()?.perp();
            let limit = normal.dot(corners[i]);
            edges[i] = (normal, limit + margin);
            reach[i] = (limit - normal.dot(centre)) * larger - 2.0 * margin;
        }
        let [a, b, c] = corners;
        let [of_a, of_b, of_c] = COUNTED_AT;
        let counted_at = a * of_a + b * of_b + c * of_c;
        Some(Self { origin, along, up, normal: along.cross(up), edges, corners, counted_at, reach })
    }

    /// Another triangle, seen along the normal.
    #[inline(always)]
    fn seen(&self, other: &TriangleAdjacency) -> Seen {
        let [x, y, z] = [0, 1, 2].map(|axis| Vec3A::from_array(other.corners[axis]));
        let [x, y, z] = [x - self.origin.x, y - self.origin.y, z - self.origin.z];
        let along = |way: Vec3| x * way.x + y * way.y + z * way.z;
        let (height, x, y) = (along(self.normal), along(self.along), along(self.up));
        let beyond = self.edges.map(|(normal, limit)| x * normal.x + y * normal.y - limit);
        Seen { x, y, height, beyond }
    }
}

/// A triangle of the other surface, seen along the normal: a lane for each corner, or for the edge
/// from there to the next.
struct Seen {
    x: Vec3A,
    y: Vec3A,
    height: Vec3A,
    /// How far beyond each edge of the base.
    beyond: [Vec3A; 3],
}

/// Of the lanes of three corners those that the next corner has.
#[inline(always)]
fn of_next(lanes: u32) -> u32 {
    lanes >> 1 | (lanes & 1) << 2
}

impl Seen {
    /// Whether all of it is near the base.
    #[inline(always)]
    fn is_near(&self, base: &Base, most: f32) -> bool {
        let within = |i: usize| self.beyond[i].max_element() <= base.reach[i];
        self.height.abs().max_element() <= most && within(0) && within(1) && within(2)
    }

    /// Whether its centre is over the base.
    #[inline(always)]
    fn is_centred(&self) -> bool {
        self.beyond.iter().all(|beyond| beyond.element_sum() <= 0.0)
    }

    /// Which edges pass over the base, a bit each.
    #[inline(always)]
    fn passing(&self) -> u32 {
        let beyond = self.beyond.map(|beyond| beyond.cmpgt(Vec3A::ZERO).bitmask());
        let [a, b, c] = beyond.map(|corners| corners & of_next(corners));
        let within = !(beyond[0] | beyond[1] | beyond[2]);
        let mut passing = !(a | b | c) & 7;
        let mut doubtful = passing & !(within | of_next(within));
        while doubtful != 0 {
            let edge = doubtful.trailing_zeros();
            doubtful &= doubtful - 1;
            if self.passed(edge as usize).is_none() {
                passing &= !(1 << edge);
            }
        }
        passing
    }

    /// The part of an edge that passes over the base, as shares of its length.
    #[inline(always)]
    fn passed(&self, edge: usize) -> Option<[f32; 2]> {
        let (mut begin, mut end) = (0f32, 1f32);
        for beyond in &self.beyond {
            let (from, to) = (beyond[edge], beyond[(edge + 1) % 3]);
            match (from > 0.0, to > 0.0) {
                (true, true) => return None,
                (true, false) => begin = max(begin, from / (from - to)),
                (false, true) => end = min(end, from / (from - to)),
                (false, false) => {}
            }
        }
        (begin <= end).then_some([begin, end])
    }

    /// Twice the areas of the triangles that a point makes with each edge, and how large they are
    /// of a point at `margin` from the edge, or a little more.
    #[inline(always)]
    fn areas(&self, point: Vec2, margin: f32) -> (Vec3A, Vec3A) {
        let along_x = self.x.yzx() - self.x;
        let along_y = self.y.yzx() - self.y;
        let areas = along_x * (point.y - self.y) - along_y * (point.x - self.x);
        (areas, (along_x.abs() + along_y.abs()) * margin)
    }

    /// Whether a point is covered; `None` where it is too near to an edge to tell.
    #[inline(always)]
    fn covers(&self, point: Vec2, margin: f32) -> Option<bool> {
        let (areas, nears) = self.areas(point, margin);
        if areas.cmpgt(nears).all() || areas.cmplt(-nears).all() {
            return Some(true);
        }
        let may_be = areas.cmpgt(-nears).all() || areas.cmplt(nears).all();
        (!may_be).then_some(false)
    }

    /// No point over the base is higher or lower; `None` where that is more than `most`.
    #[inline(always)]
    fn height_within(&self, base: &Base, most: f32, margin: f32) -> Option<f32> {
        let highest = self.height.abs().max_element();
        if highest <= most {
            return Some(highest);
        }
        self.height_clipped(base, margin).filter(|&height| height <= most)
    }

    /// The largest height at the corners of what is over the base; `None` where that is hard to
    /// tell.
    #[cold]
    fn height_clipped(&self, base: &Base, margin: f32) -> Option<f32> {
        let mut highest = 0f32;
        for edge in 0..3 {
            let [from, to] = [edge, (edge + 1) % 3].map(|corner| self.height[corner]);
            for share in self.passed(edge).into_iter().flatten() {
                highest = highest.max((from + (to - from) * share).abs());
            }
        }
        for &corner in &base.corners {
            let (areas, nears) = self.areas(corner, margin);
            if !areas.cmpgt(-nears).all() && !areas.cmplt(nears).all() {
                continue;
            }
            let whole = areas.abs().element_sum();
            let near = nears.max_element();
            let steepest = self.height.abs().max_element();
            if whole <= near {
                highest = highest.max(steepest);
                continue;
            }
            // Corners face the edges after them.
            let height = (areas.abs().yzx() / whole).dot(self.height);
            highest = highest.max(height.abs() + 2.0 * steepest * near / whole);
        }
        highest.is_finite().then_some(highest)
    }
}

#[cfg(test)]
mod tests;
