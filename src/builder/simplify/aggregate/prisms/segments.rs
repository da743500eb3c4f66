//! What segments in a plane do to each other, and what stands for three of them.

use glam::DVec2;

/// The point that stands for the second and third of four, so that areas stay where that is near
/// these, and the area that changes sides; `None` where the four come back to where they began.
pub(super) fn replacement([a, b, c, d]: [DVec2; 4]) -> Option<(DVec2, f64)> {
    let base = d - a;
    // Twice the area between the polyline and its chord, which the new one keeps.
    let area = (b - a).perp_dot(c - a) + (c - a).perp_dot(d - a);
    let length = base.length();
    if length < 1e-9 {
        return None;
    }
    // Points so far to the right of the chord have it.
    let height = area / length;
    let across = base.perp() / length;
    let level = |p: DVec2| -(p - a).dot(across);
    // On the line through the chord's end and the next point.
    let on = |from: DVec2, through: DVec2| {
        let (start, end) = (level(from), level(through));
        let rise = end - start;
        (rise.abs() > 1e-9 * length).then(|| from + (through - from) * ((height - start) / rise))
    };
    let keeps_area = |place: DVec2| (level(place) - height).abs() <= 1e-6 * length;
    let displaced = |place: DVec2| {
        // Both polylines start at `a` and end at `d`: lobes on either side are equal.
        let crossing = |p: DVec2, q: DVec2, r: DVec2, s: DVec2| {
            let (u, v) = (q - p, s - r);
            let cross = u.perp_dot(v);
            let t = (r - p).perp_dot(v) / cross;
            let w = (r - p).perp_dot(u) / cross;
            ((-1e-9..=1.0 + 1e-9).contains(&t) && (-1e-9..=1.0 + 1e-9).contains(&w))
                .then(|| p + u * t)
        };
        let lobe = |p: DVec2, q: DVec2, r: DVec2| (q - p).perp_dot(r - p).abs();
        if keeps_area(place) {
            if let Some(x) = crossing(place, d, b, c) {
                return lobe(b, place, x);
            }
            if let Some(x) = crossing(a, place, b, c) {
                return lobe(c, place, x);
            }
        }
        0.5 * (lobe(a, b, place) + lobe(b, c, place) + lobe(c, d, place))
    };
    // Lines that are all but parallel meet in another street.
    let reach = 4.0 * b.distance(c) + 2.0;
    let is_near = |place: &DVec2| place.distance(b).min(place.distance(c)) <= reach;
    let corners = [on(a, b), on(d, c)].into_iter().flatten().filter(is_near);
    let best = |places: &mut dyn Iterator<Item = DVec2>| {
        places.map(|place| (place, displaced(place))).min_by(|x, y| x.1.total_cmp(&y.1))
    };
    best(&mut corners.into_iter()).or_else(|| best(&mut [b, c, (b + c) * 0.5].into_iter()))
}

/// Whether two segments cross within both.
pub(super) fn do_cross([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> bool {
    let side = |o: DVec2, e: DVec2, x: DVec2| (e - o).perp_dot(x - o);
    side(a, b, p) * side(a, b, q) < 0.0 && side(p, q, a) * side(p, q, b) < 0.0
}

/// Whether a point is within a triangle, either way around, or on its sides.
pub(super) fn is_within(p: DVec2, [a, b, c]: &[DVec2; 3]) -> bool {
    let sides = [(a, b), (b, c), (c, a)].map(|(s, e)| (*e - *s).perp_dot(p - *s));
    let degenerate = (*b - *a).perp_dot(*c - *a).abs() < 1e-12;
    !degenerate && (sides.iter().all(|&side| side >= 0.0) || sides.iter().all(|&side| side <= 0.0))
}

#[cfg(test)]
mod tests {
    use glam::dvec2;

    use super::super::arcs::twice_area;
    use super::*;

    #[test]
    fn the_point_that_stands_for_two_keeps_the_area() {
        let corners = [[0.0, 0.0], [1.0, 2.0], [3.0, 2.5], [5.0, 0.0]].map(|[x, y]| dvec2(x, y));
        let [a, b, c, d] = corners;
        let (place, displaced) = replacement(corners).unwrap();
        let area = |points: &[DVec2]| twice_area(points);
        assert!((area(&[a, b, c, d]) - area(&[a, place, d])).abs() < 1e-9);
        let inside = |p: DVec2, ring: &[DVec2]| {
            let sides = ring.iter().zip(ring.iter().cycle().skip(1));
            sides.filter(|(a, b)| (a.y <= p.y) != (b.y <= p.y)).fold(false, |is_in, (a, b)| {
                is_in != (p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y))
            })
        };
        let points = (0..600 * 400).map(|n| dvec2((n % 600) as f64 + 0.5, (n / 600) as f64 + 0.5));
        let differ = |p: &DVec2| inside(*p, &[a, b, c, d]) != inside(*p, &[a, place, d]);
        let counted = points.map(|p| p * 0.01).filter(differ).count() as f64 * 1e-4;
        assert!((displaced - counted).abs() < 0.01, "{displaced} {counted}");
        // A corner that was cut off.
        let cut = [[0.0, 0.0], [4.0, 0.0], [5.0, 1.0], [5.0, 9.0]].map(|[x, y]| dvec2(x, y));
        let (place, displaced) = replacement(cut).unwrap();
        assert!(place.distance(dvec2(5.0, 0.0)) < 0.3 && displaced < 0.9, "{place} {displaced}");
    }
}
