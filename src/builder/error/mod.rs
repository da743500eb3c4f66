//! The two-sided distance between a node and the source, bounded and measured.
//!
//! - [`Below`]: what a node is measured against
//! - [`SearchableSurface`]: a surface that is searched, of one mesh or of several
//! - `bvh`, `triangle`: its hierarchy, and eight triangles at a time
//! - `one_sided_hausdorff`, `polygon`: the bound on the largest distance, one way
//! - `exact`: the same in f64, for surfaces that f32 cannot tell apart
//! - `overlay`, `adjacency`: proving that a triangle is near by walking over the other surface
//! - `samples`: points for the mean, and [`MeanDistance`] to choose among meshes by it

mod adjacency;
mod below;
mod bvh;
mod exact;
mod mean;
mod nearest;
mod one_sided_hausdorff;
mod overlay;
mod polygon;
mod samples;
mod searchable_surface;
mod stored;
mod triangle;

pub use self::below::{Below, BoundedNode, Surface, measured_against};
pub use self::mean::MeanDistance;
pub use self::nearest::NearestTriangle;
pub use self::one_sided_hausdorff::TIGHTNESS;
use self::one_sided_hausdorff::{MaxDistance, OneSidedHausdorff, seed};
pub use self::samples::point_of;
use self::searchable_surface::Search;
pub use self::searchable_surface::{Face, SearchableSurface};
pub use self::stored::SurfaceError;

/// [`SurfaceError`], and how it was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// The result.
    pub error: SurfaceError,
    /// The largest distance that was found at a point.
    pub largest: f64,
    /// Whether the bound is looser than [`TIGHTNESS`] allows, since it would take too long.
    pub exhausted: bool,
    /// How many polygons were divided.
    pub divisions: usize,
}

/// Distance between a node and what is below it, both ways, without what the source is off itself.
/// The bound is no less than that of the nodes below.
///
/// `beside` are triangles that are drawn with the node but cover nothing: they count from there to
/// what is below alone.
///
/// Where only one of them has triangles, all numbers are the diagonal of its bounding box: as far
/// as anything that is drawn in place of it could be wrong. Infinite where coordinates are not
/// finite.
pub fn measure(below: &Below, node: &SearchableSurface, beside: &SearchableSurface) -> Measured {
    let (source, surface) = (&below.source, &below.surface());
    let all = |distance: f64| {
        let error = SurfaceError::everywhere(distance);
        Measured { error, largest: distance, ..Default::default() }
    };
    let rounding =
        [node, beside].map(|node| rounding(surface, node)).into_iter().fold(0.0, f32::max);
    if !rounding.is_finite() {
        return all(f64::INFINITY);
    }
    if surface.is_empty() || node.is_empty() {
        return all(surface.diagonal().max(node.diagonal()).max(below.bound()));
    }
    let least = (LEAST_ROUNDING * rounding).max(below.bound() as f32);
    let mut largest = MaxDistance::at_least(least);
    seed(surface, node, &mut largest);
    seed(node, surface, &mut largest);
    if !beside.is_empty() {
        (largest, _) = OneSidedHausdorff::new(beside, surface, largest, rounding).run();
    }
    // This way first: each of its triangles settles several of those below.
    let (largest, visit_states) = OneSidedHausdorff::new(node, surface, largest, rounding).run();
    let (largest, _) = OneSidedHausdorff::new(surface, node, largest, rounding)
        .with_visit_states(visit_states)
        .run();
    let bound = f64::from(largest.bound()) * (1.0 + RELATIVE_ROUNDING) + f64::from(rounding);
    let is_near = largest.found <= NEAR_ROUNDING * rounding;
    let exact = is_near.then(|| exact::both_ways(surface, node, beside)).flatten();
    let (found, bound) = match exact {
        Some(exact) => {
            (exact.found, bound.min(exact.bound + f64::from(surface.max_surface_offset())))
        }
        None => (largest.found.into(), bound),
    };
    let bound = bound.max(below.bound());
    let (mean, rms, p95) = statistics(source, node, bound);
    Measured {
        error: SurfaceError { bound, mean, rms, p95 },
        largest: found,
        exhausted: largest.exhausted && exact.is_none(),
        divisions: largest.divisions,
    }
}

/// By what share of itself a distance may be wrong: it is computed by some ten operations.
const RELATIVE_ROUNDING: f64 = 32.0 / (1 << 24) as f64;

/// By how much a distance may be wrong beside [`RELATIVE_ROUNDING`]: coordinates of points that are
/// measured are rounded once, and what is computed from differences of coordinates, which are exact
/// to a last bit of themselves, a dozen times.
fn rounding(a: &SearchableSurface, b: &SearchableSurface) -> f32 {
    let magnitude = a.bounds.magnitude().max(b.bounds.magnitude());
    f32::EPSILON * (magnitude + 12.0 * a.longest.max(b.longest))
}

/// Distances below so many times [`rounding`] are not told apart in f32.
const LEAST_ROUNDING: f32 = 2.0 * TIGHTNESS;

/// Distances below so many times [`rounding`] are measured again in f64: rounding would be a large
/// part of the bound.
const NEAR_ROUNDING: f32 = 8.0;

/// Mean, root mean square and 95th percentile of sampled distances, none above `bound`.
fn statistics(a: &SearchableSurface, b: &SearchableSurface, bound: f64) -> (f64, f64, f64) {
    let mut distances = Vec::new();
    for (from, to) in [(a, b), (b, a)] {
        let mut search = Search::new(to);
        let to_other = |point| f64::from(search.nearest(point, 0.0).squared).sqrt().min(bound);
        distances.extend(from.samples().into_iter().map(to_other));
    }
    if distances.is_empty() {
        return (bound, bound, bound);
    }
    distances.sort_unstable_by(f64::total_cmp);
    let count = distances.len() as f64;
    let mean = distances.iter().sum::<f64>() / count;
    let rms = (distances.iter().map(|d| d * d).sum::<f64>() / count).sqrt();
    let p95 = distances[(distances.len() * 95).div_ceil(100) - 1];
    (mean, rms, p95)
}

#[cfg(test)]
mod tests;
