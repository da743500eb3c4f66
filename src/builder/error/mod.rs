//! The two-sided distance between a simplified mesh and the original, bounded and measured.
//!
//! - [`Original`]: a surface that is searched, of one mesh or of several
//! - `bvh`, `triangle`: its hierarchy, and eight triangles at a time
//! - `directed`, `polygon`: the bound on the largest distance, one way
//! - `exact`: the same in f64, for surfaces that f32 cannot tell apart
//! - `overlay`, `adjacency`: proving that a triangle is near by walking over the other surface
//! - `detail`: the same where the original is known by surfaces that are off it themselves
//! - `samples`: points for the mean, and [`MeanDistance`] to choose among meshes by it

mod adjacency;
mod bvh;
mod detail;
mod directed;
mod exact;
mod mean;
mod nearest;
mod original;
mod overlay;
mod polygon;
mod samples;
mod stored;
mod triangle;

pub use self::detail::{Detail, error_through};
pub use self::directed::TIGHTNESS;
use self::directed::{Directed, Largest, seed};
pub use self::mean::MeanDistance;
pub use self::nearest::NearestTriangle;
use self::original::Search;
pub use self::original::{Face, Original};
use crate::mesh::Mesh;

/// How far two surfaces are apart, metres, both ways.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SurfaceError {
    /// No point of one surface is farther from the other (an upper bound of the Hausdorff
    /// distance). 0 where they are equal to within a tenth of what rounding coordinates to f32 does.
    pub bound: f64,
    /// Of points of both surfaces, evenly spread by area, half of them of each: the mean distance.
    pub mean: f64,
    /// Of the same points: the root of the mean squared distance.
    pub rms: f64,
    /// Of the same points: 95 of 100 are not farther.
    pub p95: f64,
}

/// [`surface_error`], and how it was found.
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

/// Distance between a simplified mesh and the original, both ways.
///
/// Where only one of them has triangles, all numbers are the diagonal of its bounding box: as far
/// as anything that is drawn in place of it could be wrong. Infinite where coordinates are not
/// finite.
pub fn surface_error(original: &Original, simplified: &Mesh) -> SurfaceError {
    measure(original, simplified).error
}

/// [`surface_error`], and how it was found.
pub fn measure(original: &Original, simplified: &Mesh) -> Measured {
    let simplified = &Original::of(simplified, original.constants);
    let all = |distance: f64| {
        let error = SurfaceError { bound: distance, mean: distance, rms: distance, p95: distance };
        Measured { error, largest: distance, ..Default::default() }
    };
    let rounding = rounding(original, simplified);
    if !rounding.is_finite() {
        return all(f64::INFINITY);
    }
    if original.is_empty() || simplified.is_empty() {
        return all(original.diagonal().max(simplified.diagonal()));
    }
    let mut largest = Largest::at_least(2.0 * rounding);
    seed(original, simplified, &mut largest);
    seed(simplified, original, &mut largest);
    // This way first: each of its triangles settles several of the original.
    let (largest, marks) = Directed::new(simplified, original, largest, rounding).run();
    let back = Directed::new(original, simplified, largest, rounding).with_marks(marks);
    let (largest, _) = back.run();
    let bound = f64::from(largest.bound()) * (1.0 + RELATIVE_ROUNDING) + f64::from(rounding);
    let is_near = largest.found <= NEAR_ROUNDING * rounding;
    let exact = is_near.then(|| exact::both_ways(original, simplified)).flatten();
    let (found, bound) = match exact {
        Some(exact) => (exact.found, exact.bound.min(bound)),
        None => (largest.found.into(), bound),
    };
    let (mean, rms, p95) = statistics(original, simplified, bound);
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
fn rounding(a: &Original, b: &Original) -> f32 {
    let magnitude = a.bounds.magnitude().max(b.bounds.magnitude());
    f32::EPSILON * (magnitude + 12.0 * a.longest.max(b.longest))
}

/// Distances below so many times [`rounding`] are measured again in f64: rounding would be a large
/// part of the bound.
const NEAR_ROUNDING: f32 = 8.0;

/// Mean, root mean square and 95th percentile of sampled distances, none above `bound`.
fn statistics(a: &Original, b: &Original, bound: f64) -> (f64, f64, f64) {
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
