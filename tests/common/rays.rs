//! Rays against triangles, by trying all whose box they meet.

use glam::DVec3;
use hlod::mesh::Mesh;

/// Triangles of one box.
struct Part {
    low: DVec3,
    high: DVec3,
    triangles: Vec<[DVec3; 3]>,
}

/// Where a ray begins and its direction, of length 1.
pub type Ray = [DVec3; 2];

/// Triangles in parts that lie close together.
pub struct Soup(Vec<Part>);

/// Triangles of a part.
const PART: usize = 48;

/// Points that are tried along each stretch of a ray inside the source.
const DEPTHS: u32 = 24;

impl Soup {
    pub fn new(meshes: impl IntoIterator<Item = Mesh>) -> Self {
        let mut parts = Vec::new();
        for mesh in meshes {
            let point = |vertex: u32| DVec3::from(mesh.positions[vertex as usize].map(f64::from));
            for triangles in mesh.triangles.chunks(PART) {
                let triangles: Vec<_> = triangles.iter().map(|t| t.map(point)).collect();
                let corners = || triangles.as_flattened().iter();
                parts.push(Part {
                    low: corners().fold(DVec3::INFINITY, |low, &p| low.min(p)),
                    high: corners().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p)),
                    triangles,
                });
            }
        }
        Self(parts)
    }

    /// Where a ray meets triangles, in order, in lengths of `direction`.
    pub fn crossings(&self, [origin, direction]: Ray) -> Vec<f64> {
        let mut found = Vec::new();
        for part in &self.0 {
            let (to_low, to_high) =
                ((part.low - origin) / direction, (part.high - origin) / direction);
            let (enter, leave) = (to_low.min(to_high), to_low.max(to_high));
            // A flat box has no inside.
            if enter.max_element() <= leave.min_element() + 1e-9 {
                found.extend(part.triangles.iter().filter_map(|t| crossing(origin, direction, t)));
            }
        }
        found.sort_by(f64::total_cmp);
        found
    }

    /// True where a ray, before `stopped`, is farther inside these closed triangles than `bound`
    /// says for the place. `crossings` are its own with them.
    pub fn is_deep(
        &self,
        [origin, direction]: Ray,
        crossings: &[f64],
        stopped: f64,
        bound: impl Fn(DVec3) -> f64,
    ) -> bool {
        crossings.as_chunks::<2>().0.iter().any(|&[from, to]| {
            let reached = to.min(stopped);
            (0..DEPTHS).any(|step| {
                let at = from + (reached - from) * (f64::from(step) + 0.5) / f64::from(DEPTHS);
                let point = origin + direction * at;
                // No deeper than it is far from where the ray came in or would go out.
                let most = (at - from).min(to - at);
                let bound = if most > 0.0 { bound(point) } else { 0.0 };
                most > bound && self.distance(point, bound) > bound
            })
        })
    }

    /// Whether a point is no farther from some triangle than `near`.
    pub fn is_near(&self, point: DVec3, near: f64) -> bool {
        self.distance(point, near) <= near
    }

    /// The distance from a point to the nearest triangle, or something not above `enough` where it
    /// is at most that.
    fn distance(&self, point: DVec3, enough: f64) -> f64 {
        let mut nearest = f64::INFINITY;
        for part in &self.0 {
            if point.distance(point.clamp(part.low, part.high)) < nearest {
                for triangle in &part.triangles {
                    nearest = nearest.min(distance_to(point, triangle));
                }
            }
            if nearest <= enough {
                break;
            }
        }
        nearest
    }
}

/// Where a ray meets a triangle. A ray through a shared edge or corner meets at least one of the
/// triangles there: the three volumes have the same digits from whichever triangle they are seen.
fn crossing(origin: DVec3, direction: DVec3, triangle: &[DVec3; 3]) -> Option<f64> {
    let [a, b, c] = triangle.map(|corner| corner - origin);
    let volumes = [direction.dot(b.cross(c)), direction.dot(c.cross(a)), direction.dot(a.cross(b))];
    if volumes.iter().any(|&v| v < 0.0) && volumes.iter().any(|&v| v > 0.0) {
        return None;
    }
    let total: f64 = volumes.iter().sum();
    if total == 0.0 {
        return None;
    }
    let point = (a * volumes[0] + b * volumes[1] + c * volumes[2]) / total;
    let along = point.dot(direction);
    (along > 0.0).then_some(along)
}

/// The distance from a point to a triangle: to its plane where the foot is inside, else to the
/// nearest side.
fn distance_to(point: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let beside = |from: DVec3, to: DVec3| (to - from).cross(point - from).dot(normal) >= 0.0;
    if normal != DVec3::ZERO && beside(a, b) && beside(b, c) && beside(c, a) {
        return (point - a).dot(normal).abs();
    }
    let to_side = |from: DVec3, to: DVec3| {
        let along = to - from;
        let t = (point - from).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
        point.distance(from + along * t.clamp(0.0, 1.0))
    };
    to_side(a, b).min(to_side(b, c)).min(to_side(c, a))
}
