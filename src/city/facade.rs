//! The architecture of one block: a row of houses with windows and ledges, in metres.
//!
//! `x` runs along the façade from 0, `z` is the height above the ground. Geometry and texture are
//! both drawn from this one description, so that painted windows lie where the recesses are.

use crate::random::{Random, hash, unit};

/// A row of houses, one side of a city block.
#[derive(Clone, Debug)]
pub(super) struct Facade {
    /// Metres.
    pub(super) length: f64,
    /// Height of the highest house, metres.
    pub(super) height: f64,
    /// From left to right, without gaps.
    pub(super) houses: Vec<House>,
}

/// One house of the row.
#[derive(Clone, Debug)]
pub(super) struct House {
    /// Left and right end, metres.
    pub(super) span: [f64; 2],
    /// Metres.
    pub(super) height: f64,
    /// How far it stands back from the street's line, metres.
    pub(super) setback: f64,
    /// Floor to floor, metres.
    floor_height: f64,
    floors: u32,
    windows: Windows,
    /// How far the ledges stand out, metres.
    ledge: f64,
    seed: u64,
}

/// The windows of each floor, all alike within a house.
#[derive(Clone, Debug)]
struct Windows {
    /// Left edge of the first, metres from the house's left end.
    first: f64,
    /// Left edge to left edge, metres.
    pitch: f64,
    count: u32,
    width: f64,
    /// Above the floor, metres.
    sill: f64,
    height: f64,
}

/// A window's outline, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) x: [f64; 2],
    pub(super) z: [f64; 2],
}

impl Facade {
    /// Draws a row of houses, each 8–18 m wide and 8–25 m high.
    pub(super) fn draw(seed: u64, length: f64) -> Self {
        let mut random = Random::new(seed, 1);
        let mut houses = Vec::new();
        let mut left = 0.0;
        while left < length {
            let width = random.between(8.0, 18.0);
            let right = if length - left - width < 8.0 { length } else { left + width };
            houses.push(House::draw(&mut random, [left, right]));
            left = right;
        }
        let height = houses.iter().fold(0.0, |height: f64, house| height.max(house.height));
        Self { length, height, houses }
    }

    /// The area of all house fronts, square metres.
    pub(super) fn area(&self) -> f64 {
        self.houses.iter().map(|house| (house.span[1] - house.span[0]) * house.height).sum()
    }
}

impl House {
    fn draw(random: &mut Random, span: [f64; 2]) -> Self {
        let floors = random.whole(2, 7);
        let floor_height = random.between(3.2, 3.6);
        let height = (f64::from(floors) * floor_height + random.between(0.8, 1.6)).clamp(8.0, 25.0);
        let pitch = random.between(2.0, 3.2);
        let width = pitch * random.between(0.4, 0.6);
        let room = span[1] - span[0] - 0.8;
        let count = ((room - width) / pitch).floor().max(0.0) as u32 + 1;
        let used = f64::from(count - 1) * pitch + width;
        let windows = Windows {
            first: 0.5 * (span[1] - span[0] - used),
            pitch,
            count,
            width,
            sill: random.between(0.7, 1.0),
            height: random.between(1.4, 1.9),
        };
        Self {
            span,
            height,
            setback: random.between(0.0, 0.6),
            floor_height,
            floors,
            windows,
            ledge: random.between(0.1, 0.25),
            seed: random.bits(),
        }
    }

    /// The number of the window in its floor at `x`, where one is.
    pub(super) fn window_column(&self, x: f64) -> Option<u32> {
        let along = x - self.span[0] - self.windows.first;
        let number = (along / self.windows.pitch).floor();
        let inside = along - number * self.windows.pitch <= self.windows.width;
        (along >= 0.0 && inside && number < f64::from(self.windows.count)).then_some(number as u32)
    }

    /// The floor whose windows reach over the height `z`.
    pub(super) fn window_floor(&self, z: f64) -> Option<u32> {
        let floor = (z / self.floor_height).floor();
        let above = z - floor * self.floor_height - self.windows.sill;
        (floor < f64::from(self.floors) && (0.0..=self.windows.height).contains(&above))
            .then_some(floor as u32)
    }

    /// How deep a window lies behind the wall, 0.1–0.3 m.
    pub(super) fn recess(&self, floor: u32, column: u32) -> f64 {
        0.1 + 0.2 * unit(hash(self.seed, floor.into(), column.into()))
    }

    /// How far a ledge or the cornice stands out at height `z`, where samples are `spacing` apart
    /// (so that even a coarse scan hits each of them). Metres.
    pub(super) fn ledge_at(&self, z: f64, spacing: f64) -> f64 {
        let half = f64::max(0.12, 0.5 * spacing);
        let nearest = (z / self.floor_height).round();
        let is_ledge = nearest >= 1.0
            && nearest <= f64::from(self.floors)
            && (z - nearest * self.floor_height).abs() <= half;
        let is_cornice = self.height - z <= 2.0 * half;
        if is_cornice {
            self.ledge + 0.1
        } else if is_ledge {
            self.ledge
        } else {
            0.0
        }
    }

    /// The outlines of all windows.
    pub(super) fn windows(&self) -> impl Iterator<Item = Window> {
        let Windows { first, pitch, count, width, sill, height } = self.windows;
        (0..self.floors).flat_map(move |floor| {
            (0..count).map(move |column| {
                let left = self.span[0] + first + f64::from(column) * pitch;
                let low = f64::from(floor) * self.floor_height + sill;
                Window { x: [left, left + width], z: [low, low + height] }
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn houses_fill_the_row_within_their_ranges() {
        for seed in 0..200 {
            let facade = Facade::draw(seed, 60.0 + seed as f64 * 0.3);
            assert_eq!(facade.houses[0].span[0], 0.0);
            assert_eq!(facade.houses.last().unwrap().span[1], facade.length);
            for pair in facade.houses.windows(2) {
                assert_eq!(pair[0].span[1], pair[1].span[0]);
            }
            for house in &facade.houses {
                let width = house.span[1] - house.span[0];
                assert!((8.0..=26.0).contains(&width), "{width}");
                assert!((8.0..=25.0).contains(&house.height));
            }
        }
    }

    #[test]
    fn lookup_agrees_with_the_outlines() {
        let facade = Facade::draw(3, 90.0);
        for house in &facade.houses {
            assert!(house.windows().count() > 0);
            for window in house.windows() {
                assert!(window.x[0] > house.span[0] && window.x[1] < house.span[1]);
                assert!(window.z[0] > 0.0 && window.z[1] < house.height, "{window:?}");
                let [x, z] = [window.x, window.z].map(|[low, high]| 0.5 * (low + high));
                let (floor, column) =
                    (house.window_floor(z).unwrap(), house.window_column(x).unwrap());
                assert!((0.1..=0.3).contains(&house.recess(floor, column)));
                assert_eq!(house.window_column(window.x[0] - 0.01), None);
                assert_eq!(house.window_floor(window.z[1] + 0.01), None);
            }
        }
    }
}
