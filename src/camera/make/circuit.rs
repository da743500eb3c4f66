//! A closed route along the streets, and the steps of someone who follows it.

use glam::{DVec2, DVec3};

use super::ground::Ground;
use super::plan;
use super::plan::yaw_deg;
use super::streets::Streets;
use crate::random::Random;

/// The first of the random streams of routes; 1 is that of places to stand at.
const STREAMS: u64 = 2;
/// Places that a route goes by.
const STOPS: usize = 6;
/// Places drawn for each of them, of which the best is taken.
const DRAWN: usize = 48;
/// Corners are rounded as by a Gaussian of this many metres.
const ROUNDING_M: f64 = 3.0;
/// Steps to a round where a route is made around a scene.
const ROUND_STEPS: f64 = 16.0;
/// Corners of such a route.
const ROUND_CORNERS: u32 = 720;

/// A closed line at eye height, on the map. At least three points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Circuit {
    points: Vec<DVec3>,
}

impl Circuit {
    /// A route for steps of at most `step` metres, another one with each seed and each `attempt`:
    /// along streets where there are any, else around.
    pub(super) fn make(
        ground: &Ground,
        streets: Option<&Streets<'_>>,
        seed: u64,
        attempt: u64,
        step: f64,
    ) -> Self {
        streets
            .and_then(|streets| Self::along(streets, &mut Random::new(seed, STREAMS + attempt)))
            .filter(|circuit| circuit.march(1, |_| step * 2.0).is_some())
            .unwrap_or_else(|| Self::around(ground, step))
    }

    /// By way of places that are far apart and have much to see.
    fn along(streets: &Streets<'_>, random: &mut Random) -> Option<Self> {
        let (ground, cells) = (streets.ground, &streets.ground.surfaces.cells);
        let stops = stops(streets, random);
        let mut way = Vec::new();
        for (index, &stop) in stops.iter().enumerate() {
            let leg = streets.way(stop, stops[(index + 1) % stops.len()])?;
            // The last cell is the first of the next leg.
            way.extend_from_slice(&leg[..leg.len() - 1]);
        }
        if way.len() < 3 {
            return None;
        }
        let sigma = ROUNDING_M * ground.scale / cells.side;
        let rounds = (2.0 * sigma * sigma).ceil() as usize;
        let mut places: Vec<DVec2> = way.iter().map(|&cell| cells.middle(cell)).collect();
        let open = |place| cells.at(place).is_some_and(|cell| streets.is_open[cell]);
        for _ in 0..rounds {
            round(&mut places, |a, b, c| {
                let between = (a + 2.0 * b + c) / 4.0;
                if open(between) { between } else { b }
            });
        }
        let mut heights: Vec<f64> = places.iter().map(|&place| ground.height_at(place)).collect();
        for _ in 0..rounds {
            round(&mut heights, |a, b, c| (a + 2.0 * b + c) / 4.0);
        }
        let eye = ground.eye_height();
        let points = places.iter().zip(&heights).map(|(&place, &height)| {
            place.extend((height + eye).max(ground.height_at(place) + eye / 2.0))
        });
        Some(Self { points: points.collect() })
    }

    /// Where the route begins.
    pub(super) fn start(&self) -> DVec3 {
        self.points[0]
    }

    /// A circle outside of what is mapped.
    pub(super) fn around(ground: &Ground, step: f64) -> Self {
        let cells = &ground.surfaces.cells;
        let half = DVec2::new(cells.columns as f64, cells.rows as f64) * cells.side / 2.0;
        let centre = cells.corner + half;
        let radius = half.length().max(step * ROUND_STEPS / std::f64::consts::TAU);
        let point = |index| {
            let yaw = 360.0 * f64::from(index) / f64::from(ROUND_CORNERS);
            let place = centre + plan::direction(yaw) * radius;
            place.extend(ground.height_at(place) + ground.eye_height())
        };
        Self { points: (0..ROUND_CORNERS).map(point).collect() }
    }

    /// Where one stands after 0, 1, … `count − 1` steps; step `k` is `step(k)` metres long, as the
    /// crow flies. `None` where the route is too small for a step.
    pub(super) fn march(&self, count: usize, step: impl Fn(usize) -> f64) -> Option<Vec<DVec3>> {
        let points = &self.points;
        let mut places = Vec::with_capacity(count + 1);
        let (mut place, mut next) = (points[0], 1);
        places.push(place);
        for index in 0..count {
            let (length, start) = (step(index), place);
            let mut begin = place;
            let mut passed = 0;
            while points[next].distance(start) < length {
                begin = points[next];
                next = (next + 1) % points.len();
                passed += 1;
                if passed > points.len() {
                    return None;
                }
            }
            // The line from `begin`, which is near, leaves the sphere of `length` around `start`.
            let (along, from) = (points[next] - begin, begin - start);
            let (a, b) = (along.length_squared(), along.dot(from));
            let c = from.length_squared() - length * length;
            let part = if a > 0.0 { ((b * b - a * c).max(0.0).sqrt() - b) / a } else { 1.0 };
            place = begin + along * part.clamp(0.0, 1.0);
            places.push(place);
        }
        Some(places)
    }
}

/// Places worth going by, far from each other, in the order of a round.
fn stops(streets: &Streets<'_>, random: &mut Random) -> Vec<usize> {
    let cells = &streets.ground.surfaces.cells;
    let mut stops: Vec<usize> = Vec::new();
    for _ in 0..STOPS {
        let apart = |cell: usize| {
            let place = cells.middle(cell);
            let distances = stops.iter().map(|&stop| place.distance(cells.middle(stop)));
            distances.fold(f64::INFINITY, f64::min).min(1e9)
        };
        let drawn: Vec<usize> = (0..DRAWN).map(|_| streets.draw(random)).collect();
        let worth = |cell: usize| apart(cell) * streets.interest(cell);
        let best = drawn.into_iter().reduce(|a, b| if worth(b) > worth(a) { b } else { a });
        stops.extend(best);
    }
    stops.sort_unstable();
    stops.dedup();
    let middle = stops.iter().map(|&stop| cells.middle(stop)).sum::<DVec2>() / stops.len() as f64;
    stops.sort_by(|&a, &b| {
        let angle = |stop: usize| yaw_deg(cells.middle(stop) - middle);
        angle(a).total_cmp(&angle(b)).then(a.cmp(&b))
    });
    stops
}

/// Replaces each value of a ring by what `mean` makes of the one before, itself and the one after.
fn round<T: Copy>(ring: &mut [T], mean: impl Fn(T, T, T) -> T) {
    let (Some(&first), Some(&last)) = (ring.first(), ring.last()) else { return };
    let mut before = last;
    for index in 0..ring.len() {
        let after = ring.get(index + 1).copied().unwrap_or(first);
        let now = ring[index];
        ring[index] = mean(before, now, after);
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_as_long_as_they_should_be_and_go_round() {
        let points = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)];
        let points = points.map(|(x, y)| DVec3::new(x, y, 1.0)).to_vec();
        let circuit = Circuit { points };
        let places = circuit.march(100, |index| 0.5 + 0.01 * index as f64).unwrap();
        assert_eq!(places.len(), 101);
        for (index, pair) in places.windows(2).enumerate() {
            let expected = 0.5 + 0.01 * index as f64;
            assert!((pair[0].distance(pair[1]) - expected).abs() < 1e-9);
            let on_line = |v: f64| v.abs() < 1e-9 || (v - 10.0).abs() < 1e-9;
            assert!(on_line(pair[1].x) || on_line(pair[1].y), "{}", pair[1]);
        }
        assert_eq!(circuit.march(1, |_| 30.0), None);
    }
}
