//! The largest distance from one surface to another in f64, for surfaces that f32 cannot tell apart.
//!
//! Simplification gives flat surfaces back to within a few roundings of f32. What
//! [`super::directed`] finds there is rounding of its own, up to several times the true distance,
//! or less than it. Here each triangle is clipped to the region near one triangle of the other
//! surface after the other, until nothing of it is left: the same branch and bound without the
//! steps that are fast because they compute in f32. It takes several times as long, so only
//! surfaces this near to each other are measured so.

use glam::DVec3;

use super::one_sided_hausdorff::TIGHTNESS;
use super::polygon::{Clipped, MOST_CORNERS, Polygon, bisect, centroid, clip};
use super::searchable_surface::{Search, SearchableSurface, TriangleId};
use super::triangle::Frame;

/// Distances up to this share of the largest coordinate count as none: a tenth of what rounding
/// vertices to f32 may do. Clipping is exact to a tenth of this.
const NONE: f64 = 1e-8;

/// By what share of the largest coordinate an f64 distance may be wrong.
const LAST_BITS: f64 = 1e-14;

/// Polygons that are looked at before the search gives up, at least and for each triangle.
const LEAST_POLYGONS: usize = 4096;
const POLYGONS_PER_TRIANGLE: usize = 16;

/// The largest distance between two surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Exact {
    /// Found at a point, metres.
    pub found: f64,
    /// No point is farther, metres; 0 where the surfaces are equal.
    pub bound: f64,
}

/// Leaves of the other surface that are looked at for one point: where very many triangles are in one
/// place, one of them that is a little farther than the nearest must do.
const MOST_LEAVES: usize = 256;

/// The largest distance both ways, and from `beside` to `a`. `None` where it would take too long.
pub(super) fn both_ways(
    a: &SearchableSurface,
    b: &SearchableSurface,
    beside: &SearchableSurface,
) -> Option<Exact> {
    let magnitude = [a, b, beside].map(|surface| surface.bounds.magnitude());
    let magnitude = magnitude.into_iter().fold(0.0, f32::max).into();
    let there = Walk::new(b, magnitude).over(a)?;
    let mut back = Walk::new(a, magnitude);
    (back.found, back.settled) = (there.found, there.settled);
    Some(back.over(b)?.over(beside)?.exact())
}

/// The search for the point that is farthest from a surface.
struct Walk<'a> {
    to: &'a SearchableSurface,
    search: Search<'a>,
    /// The largest distance found at a point.
    found: f64,
    /// No polygon that is settled is farther.
    settled: f64,
    /// The triangle that was near the last point.
    near: Frame,
    magnitude: f64,
}

impl<'a> Walk<'a> {
    fn new(to: &'a SearchableSurface, magnitude: f64) -> Self {
        let near = Frame::new([DVec3::INFINITY; 3]);
        Self { to, search: Search::new(to), found: 0.0, settled: 0.0, near, magnitude }
    }

    fn exact(&self) -> Exact {
        let bound = self.found.max(self.settled);
        if bound <= NONE * self.magnitude {
            return Exact::default();
        }
        Exact { found: self.found, bound: bound + LAST_BITS * self.magnitude }
    }

    /// Returns the distance up to which a polygon is not divided further, metres.
    fn limit(&self) -> f64 {
        self.found * f64::from(TIGHTNESS) + NONE * self.magnitude
    }

    /// A triangle that is near a point: the nearest, or one no farther than some point is known to be.
    fn measure(&mut self, point: DVec3) -> Option<Frame> {
        let enough = self.found.max(0.1 * NONE * self.magnitude);
        let mut best = (self.near.distance(point), self.near);
        if best.0 <= enough {
            return Some(best.1);
        }
        if best.0.is_nan() {
            best.0 = f64::INFINITY;
        }
        // Distances to boxes are those of f32, and so are those by which most triangles are passed over.
        let epsilon = f64::from(f32::EPSILON);
        let slack = self.magnitude * 4.0 * epsilon;
        let reach = |distance: f64| (distance + slack) as f32;
        let mut leaves = 0;
        let to = self.to;
        let of_triangles = slack + 24.0 * epsilon * f64::from(to.longest);
        let place = point.as_vec3();
        self.search.leaves_near(place, reach(best.0), |part, leaf| {
            leaves += 1;
            let bvh = &to.parts[part as usize].bvh;
            let squared = bvh.leaves[leaf as usize].squared_distances(place);
            for lane in 0..u32::from(bvh.counts[leaf as usize]) {
                if f64::from(squared[lane as usize]).sqrt() > best.0 + of_triangles {
                    continue;
                }
                let corners = to.exact_corners(TriangleId { part, leaf, lane });
                let Some(frame) = corners.map(Frame::new) else { return -1.0 };
                let distance = frame.distance(point);
                if distance < best.0 {
                    best = (distance, frame);
                }
            }
            if best.0 <= enough || leaves == MOST_LEAVES { -1.0 } else { reach(best.0) }
        });
        let (distance, near) = best;
        // Others may be nearer than one that is near enough.
        if distance > enough {
            self.found = distance;
        }
        self.near = near;
        distance.is_finite().then_some(near)
    }

    /// Settles all triangles of a surface.
    fn over(mut self, from: &SearchableSurface) -> Option<Self> {
        // One corner of each first, so that most limits are known when triangles are clipped.
        for id in from.ids() {
            let [corner, ..] = from.exact_corners(id)?;
            self.measure(corner)?;
        }
        let triangles = from.triangle_count() + self.to.triangle_count();
        let mut left = LEAST_POLYGONS.max(POLYGONS_PER_TRIANGLE * triangles);
        let mut stack: Vec<Polygon> = Vec::new();
        for id in from.ids() {
            stack.push(from.exact_corners(id)?.to_vec());
            while let Some(polygon) = stack.pop() {
                left = left.checked_sub(1)?;
                self.divide(polygon, &mut stack)?;
            }
        }
        Some(self)
    }

    /// Settles a polygon, or a part of it and pushes the others.
    fn divide(&mut self, polygon: Polygon, stack: &mut Vec<Polygon>) -> Option<()> {
        let centre = centroid(&polygon);
        let near = self.measure(centre)?;
        let (distance, at) = farthest(&polygon, &near)?;
        if self.settles(distance) {
            return Some(());
        }
        let reach = polygon.iter().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        let limit = self.limit();
        let much_larger = self.to.constants.much_larger * (near.length + 2.0 * limit);
        if polygon.len() <= MOST_CORNERS && reach <= much_larger {
            // A part clipped exactly to the limit would seem to be beyond it half of the time.
            let clip_at = limit - 0.5 * NONE * self.magnitude;
            if let Some(Clipped { inside, outside }) = clip(&polygon, centre, reach, &near, clip_at)
                && self.settles(farthest(&inside, &near)?.0)
            {
                stack.extend(outside);
                return Some(());
            }
        }
        self.measure(at)?;
        if !self.settles(distance) {
            let halves = bisect(polygon, centre, reach);
            stack.extend(halves.into_iter().filter(|half| !half.is_empty()));
        }
        Some(())
    }

    fn settles(&mut self, distance: f64) -> bool {
        let settles = distance <= self.limit();
        if settles {
            self.settled = self.settled.max(distance);
        }
        settles
    }
}

/// The corner that is farthest from a triangle, and how far it is. The distance to a triangle is
/// convex: no point between the corners is farther.
fn farthest(corners: &[DVec3], triangle: &Frame) -> Option<(f64, DVec3)> {
    let distances = corners.iter().map(|&at| (triangle.distance(at), at));
    distances.reduce(|most, next| if next.0 > most.0 { next } else { most })
}

#[cfg(test)]
mod tests {
    use super::super::tests::{mesh, surface_error, surface_of};
    use super::*;
    use crate::random::Random;

    /// A square of `size` metres divided into `side` times `side` squares, its inner vertices moved by up
    /// to `bump` out of its plane, which is tilted.
    fn sheet(side: u32, size: f64, bump: f64, random: &mut Random) -> crate::mesh::Mesh {
        let mut positions = Vec::new();
        for at in 0..(side + 1) * (side + 1) {
            let [i, j] = [at / (side + 1), at % (side + 1)];
            let is_inner = (1..side).contains(&i) && (1..side).contains(&j);
            let [x, y] = [i, j].map(|at| f64::from(at) * size / f64::from(side));
            let z = if is_inner { random.between(-bump, bump) } else { 0.0 };
            positions.push([x as f32, y as f32, (z + 0.25 * x + 0.5 * y) as f32]);
        }
        let square = |at: u32| [[at, at + side + 1, at + side + 2], [at, at + side + 2, at + 1]];
        let squares = (0..side * (side + 1)).filter(|at| at % (side + 1) != side);
        mesh(&positions, &squares.flat_map(square).collect::<Vec<_>>())
    }

    /// The largest distance from vertices of one mesh to another, by trying all triangles.
    fn of_vertices(from: &crate::mesh::Mesh, to: &SearchableSurface) -> f64 {
        let frames: Vec<Frame> =
            to.ids().map(|id| Frame::new(to.exact_corners(id).unwrap())).collect();
        let distance = |&at: &[f32; 3]| {
            let at = DVec3::from(at.map(f64::from));
            frames.iter().map(|frame| frame.distance(at)).fold(f64::INFINITY, f64::min)
        };
        from.positions.iter().map(distance).fold(0.0, f64::max)
    }

    #[test]
    fn distances_below_the_rounding_of_f32_are_bounded_tightly() {
        let mut random = Random::new(11, 0);
        let none = surface_of(&Default::default());
        for bump in [0.0, 1e-6, 1e-5, 1e-4, 1e-3] {
            let fine = sheet(16, 64.0, bump, &mut random);
            let coarse = sheet(1, 64.0, 0.0, &mut random);
            let (fine_surface, coarse_surface) = (surface_of(&fine), surface_of(&coarse));
            let exact = both_ways(&fine_surface, &coarse_surface, &none).unwrap();
            let least = of_vertices(&fine, &coarse_surface);
            assert!(exact.bound >= least.min(exact.found), "{bump}: {exact:?} {least}");
            assert!(exact.bound == 0.0 || exact.bound >= least, "{bump}: {exact:?} {least}");
            let most = 1.2 * least.max(exact.found) + 1.1 * NONE * 64.0;
            assert!(exact.bound <= most, "{bump}: {exact:?} {least}");
            assert!(exact.bound > 0.0 || least < 1e-6, "{bump}: {exact:?} {least}");
            let measured = surface_error(&fine_surface, &coarse);
            assert!(measured.bound >= exact.found, "{bump}: {measured:?} {exact:?}");
        }
    }

    #[test]
    fn equal_surfaces_of_other_triangles_are_equal() {
        let mut random = Random::new(12, 0);
        let [fine, coarse] = [24, 7].map(|side| {
            let mut sheet = sheet(side, 64.0, 0.0, &mut random);
            sheet.positions.iter_mut().for_each(|at| at[2] = 3.0);
            surface_of(&sheet)
        });
        let none = surface_of(&Default::default());
        assert_eq!(both_ways(&fine, &coarse, &none), Some(Exact::default()));
    }
}
