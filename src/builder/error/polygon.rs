//! Convex parts of triangles, and cutting them.

use glam::{DVec2, DVec3};

use super::triangle::Frame;

/// A convex polygon. Its corners are f64, so that cutting it again and again moves nothing by as
/// much as an f32 is rounded.
pub(super) type Polygon = Vec<DVec3>;

/// A polygon with more corners is bisected: clipping may add some.
pub(super) const MOST_CORNERS: usize = 24;

/// Corners closer to a plane than this share of the polygon's size lie on it.
const ON_PLANE: f64 = 1e-9;

pub(super) fn centroid(polygon: &[DVec3]) -> DVec3 {
    polygon.iter().sum::<DVec3>() / polygon.len() as f64
}

/// The corners of a polygon are on its positive side, its negative side, or both.
struct Plane {
    normal: DVec3,
    offset: f64,
}

impl Plane {
    fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Cuts off what is above a plane; `None` where nothing is. What is left may be empty.
fn cut_off(polygon: &mut Polygon, plane: &Plane, tolerance: f64) -> Option<Polygon> {
    if polygon.iter().all(|&corner| plane.height(corner) <= tolerance) {
        return None;
    }
    if polygon.iter().all(|&corner| plane.height(corner) >= -tolerance) {
        return Some(std::mem::take(polygon));
    }
    let mut below = Vec::with_capacity(polygon.len() + 1);
    let mut above = Vec::with_capacity(polygon.len() + 1);
    let mut last = *polygon.last()?;
    let mut last_height = plane.height(last);
    for &corner in polygon.iter() {
        let height = plane.height(corner);
        if last_height.min(height) < -tolerance && last_height.max(height) > tolerance {
            let between = last + (corner - last) * (last_height / (last_height - height));
            below.push(between);
            above.push(between);
        }
        if height <= tolerance {
            below.push(corner);
        }
        if height >= -tolerance {
            above.push(corner);
        }
        (last, last_height) = (corner, height);
    }
    *polygon = below;
    Some(above)
}

/// Both sides of the plane through the centroid across the direction of the farthest corner.
pub(super) fn bisect(mut polygon: Polygon, centroid: DVec3, radius: f64) -> [Polygon; 2] {
    let from = |corner: &DVec3| corner.distance_squared(centroid);
    let farthest = polygon.iter().copied().max_by(|a, b| from(a).total_cmp(&from(b)));
    let normal = (farthest.unwrap_or(centroid) - centroid) / radius;
    let plane = Plane { normal, offset: normal.dot(centroid) };
    let above = cut_off(&mut polygon, &plane, radius * ON_PLANE);
    [polygon, above.unwrap_or_default()]
}

/// What of a polygon is above and near a triangle, and what is left around.
pub(super) struct Clipped {
    pub inside: Polygon,
    pub outside: Vec<Polygon>,
}

/// Share of the reach by which edges move outward. The rest is for corners, which move farther.
const EDGE_SHARE: f64 = 0.9;

/// Cuts a polygon by a convex region within `reach` of the triangle: a prism with its edges moved
/// outward and its corners cut off, between two planes beside the triangle's. `None` where that
/// does not hold the centroid.
///
/// The edges move outward so that what is left does not begin exactly at the edges of the
/// triangle, where rounding would leave slivers.
pub(super) fn clip(
    polygon: &[DVec3],
    centroid: DVec3,
    radius: f64,
    triangle: &Frame,
    reach: f64,
) -> Option<Clipped> {
    let Frame { origin, along, up, length, apex } = *triangle;
    let normal = along.cross(up);
    let flat = |point: DVec3| DVec2::new((point - origin).dot(along), (point - origin).dot(up));
    let height = |point: DVec3| (point - origin).dot(normal);
    let corners = [DVec2::ZERO, DVec2::new(length, 0.0), apex];
    // Of the reach each way gets what the centroid needs and half of what that leaves.
    let at = flat(centroid);
    let squared_height = height(centroid).powi(2);
    let edges = [0, 1, 2].map(|i| {
        let way = corners[(i + 1) % 3] - corners[i];
        way.try_normalize().unwrap_or([DVec2::X, DVec2::Y, DVec2::NEG_Y][i])
    });
    let beyond = |i: usize, point: DVec2| (point - corners[i]).dot(-edges[i].perp());
    let aside = (0..3).map(|i| beyond(i, at)).fold(0.0, f64::max);
    let left = reach * reach - squared_height - (aside / EDGE_SHARE).powi(2);
    if left <= 0.0 {
        return None;
    }
    let highest = polygon.iter().map(|&corner| height(corner).powi(2)).fold(0.0, f64::max);
    let thick = (squared_height + 0.5 * left).min(highest * 1.0001);
    let wide = (reach * reach - thick).sqrt();
    let thick = thick.sqrt();
    let outward = wide * EDGE_SHARE;
    // As far along an edge the corner of the moved edges may be to stay within reach.
    let onward = wide * (1.0 - EDGE_SHARE * EDGE_SHARE).sqrt();
    let tolerance = radius * ON_PLANE;
    let mut inside = polygon.to_vec();
    let mut outside = Vec::new();
    let mut keep_below = |normal: DVec3, from: DVec3, limit: f64| {
        let plane = Plane { normal, offset: normal.dot(from) + limit };
        outside.extend(cut_off(&mut inside, &plane, tolerance));
    };
    let direction = |flat: DVec2| along * flat.x + up * flat.y;
    for i in 0..3 {
        keep_below(direction(-edges[i].perp()), origin + direction(corners[i]), outward);
    }
    for i in 0..3 {
        let (before, after) = (edges[(i + 2) % 3], edges[i]);
        // Out of the corner, and half of how far the edge turns there.
        let out = (before - after).try_normalize().unwrap_or(-after.perp());
        let cosine = out.dot(-after.perp()).clamp(-1.0, 1.0);
        let sine = (1.0 - cosine * cosine).sqrt();
        if outward * sine > onward * cosine {
            let limit = outward * cosine + onward * sine;
            keep_below(direction(out), origin + direction(corners[i]), limit);
        }
    }
    keep_below(normal, origin, thick);
    keep_below(-normal, origin, thick);
    (!inside.is_empty()).then_some(Clipped { inside, outside })
}
