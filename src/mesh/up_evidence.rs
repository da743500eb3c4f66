//! Which axis points at the sky, where the format does not say: Y or Z, by the shape of the surface.
//!
//! Four properties of built surfaces are compared between the two axes:
//!
//! - Walls are upright, and ground and flat roofs are level: along the up axis more area has a normal parallel or
//!   perpendicular to it.
//! - Open surfaces (scans, terrain) show the sky more area than the ground.
//! - Closed buildings on flat ground have their floors at the bottom of the box, while walls that face one way are
//!   spread over it.
//! - Cities are flatter than wide.
//!
//! The evidence is a sum of differences, weighted so that each property that holds fully gives about 2 to 4. It is
//! positive for Z. On 18 surveyed, scanned and modelled city files and on generated blocks and towers it was at least
//! 2 in favour of the right axis, and below 2 for a façade, a room, a cube, a pyramid and a lone closed tower.

use super::{Model, UpAxis, Warnings};

/// Evidence that counts as clear.
const CLEAR: f64 = 2.0;

/// Evidence for Z before anything is known: most surveyed data has it up.
const PRIOR: f64 = 0.5;

/// Weight of the share of level and upright area.
const RIGHT_ANGLES: f64 = 4.0;

/// Weight of the share of area that faces up rather than down.
const OPEN_SKY: f64 = 3.0;

/// Weight of the share of downward area that lies at the bottom.
const BASE: f64 = 2.0;

/// Largest evidence from the sides of the box; e^3 = 20 times flatter than wide.
const MOST_FLATNESS: f64 = 3.0;

/// Cosine of the angle between normal and axis up to which a face is upright; from 1 minus it on it is level.
const TOLERANCE: f64 = 0.05;

/// Part of the box's side within which a face is at the bottom.
const BOTTOM: f64 = 0.01;

/// Least share of downward area along both axes for which floors are compared.
const LEAST_DOWNWARD: f64 = 0.01;

/// The up axis of a surface, as its shape suggests it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpGuess {
    /// The axis.
    pub axis: UpAxis,
    /// False where the shape speaks for the other axis nearly as much.
    pub is_clear: bool,
}

impl UpGuess {
    /// An axis that is known.
    pub fn known(axis: UpAxis) -> Self {
        Self { axis, is_clear: true }
    }

    /// Adds a warning where the shape is not clear.
    pub fn warn(self, warnings: &mut Warnings) {
        if !self.is_clear {
            let axis = self.axis;
            let what = format!(
                "input whose shape does not say which axis is up, {axis:?} assumed; set --up y or --up z"
            );
            warnings.add(what, 1);
        }
    }
}

/// Areas of a surface that say which axis is up.
#[derive(Clone, Debug)]
pub struct UpEvidence {
    low: [f64; 3],
    high: [f64; 3],
    area: f64,
    /// Along Y and along Z.
    along: [AxisAreas; 2],
}

/// Areas in square metres with respect to one axis.
#[derive(Clone, Copy, Debug, Default)]
struct AxisAreas {
    /// Projected along the axis, of faces that face its positive end.
    upward: f64,
    /// Projected along the axis, of faces that face its negative end.
    downward: f64,
    /// The part of `downward` at the bottom of the box.
    at_bottom: f64,
    /// Level or upright.
    at_right_angles: f64,
}

impl UpEvidence {
    /// Evidence of a surface in a box of these least and greatest coordinates, with no face so far.
    pub fn new([low, high]: [[f64; 3]; 2]) -> Self {
        Self { low, high, area: 0.0, along: [AxisAreas::default(); 2] }
    }

    /// Evidence of all triangles of a model.
    pub fn of(model: &Model) -> Self {
        let mut evidence = Self::new(model.bounds());
        for part in &model.parts {
            for triangle in part.indices.as_chunks::<3>().0 {
                evidence.add(&triangle.map(|vertex| part.positions[vertex as usize]));
            }
        }
        evidence
    }

    /// Adds a polygon. Its order must not depend on threads, since sums are rounded.
    pub fn add(&mut self, corners: &[[f64; 3]]) {
        // Twice the vector area, by a fan.
        let mut normal = [0.0; 3];
        for pair in corners.windows(2).skip(1) {
            let [a, b] = [pair[0], pair[1]]
                .map(|corner| -> [f64; 3] { std::array::from_fn(|i| corner[i] - corners[0][i]) });
            for (axis, sum) in normal.iter_mut().enumerate() {
                let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
                *sum += a[next] * b[last] - a[last] * b[next];
            }
        }
        let area = normal.iter().map(|part| part * part).sum::<f64>().sqrt();
        if !(area > 0.0 && area.is_finite()) {
            return;
        }
        self.area += area;
        for (along, axis) in self.along.iter_mut().zip([1, 2]) {
            let projected = normal[axis];
            let top = corners.iter().fold(f64::NEG_INFINITY, |top, corner| top.max(corner[axis]));
            let is_at_bottom = top - self.low[axis] <= BOTTOM * (self.high[axis] - self.low[axis]);
            along.upward += projected.max(0.0);
            along.downward += (-projected).max(0.0);
            along.at_bottom += if is_at_bottom { (-projected).max(0.0) } else { 0.0 };
            let cosine = projected.abs() / area;
            let is_oblique = (TOLERANCE..=1.0 - TOLERANCE).contains(&cosine);
            along.at_right_angles += if is_oblique { 0.0 } else { area };
        }
    }

    /// The more likely axis.
    pub fn guess(&self) -> UpGuess {
        let evidence = self.for_z();
        UpGuess {
            axis: if evidence + PRIOR > 0.0 { UpAxis::Z } else { UpAxis::Y },
            is_clear: evidence.abs() >= CLEAR,
        }
    }

    /// Evidence for Z, and against Y where it is negative.
    fn for_z(&self) -> f64 {
        let [y, z] = self.along;
        let share = |area: f64| if self.area > 0.0 { area / self.area } else { 0.0 };
        let right_angles = share(z.at_right_angles - y.at_right_angles);
        let open_sky = share((z.upward - z.downward) - (y.upward - y.downward));
        let have_floors = [y, z].iter().all(|along| share(along.downward) > LEAST_DOWNWARD);
        let base = match have_floors {
            true => z.at_bottom / z.downward - y.at_bottom / y.downward,
            false => 0.0,
        };
        RIGHT_ANGLES * right_angles
            + OPEN_SKY * open_sky
            + BASE * base
            + (self.flatness(2) - self.flatness(1))
    }

    /// The logarithm of how much shorter the box is along `axis` than along both others; 0 where it is not.
    fn flatness(&self, axis: usize) -> f64 {
        let side = |axis: usize| self.high[axis] - self.low[axis];
        let width = side((axis + 1) % 3).min(side((axis + 2) % 3));
        match width > side(axis) {
            true => libm::log(width / side(axis)).min(MOST_FLATNESS),
            false => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    type Polygon = Vec<[f64; 3]>;

    /// A box of `size` at `at`, turned about Z; its floor is the last side.
    fn house(at: [f64; 2], size: [f64; 3], turn: f64) -> Vec<Polygon> {
        let (sine, cosine) = turn.sin_cos();
        let [width, depth, height] = size;
        let corner = |x: f64, y: f64, z: f64| {
            [at[0] + cosine * x - sine * y, at[1] + sine * x + cosine * y, z]
        };
        let plan = [[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]];
        let level = |z: f64| plan.map(|[x, y]| corner(x, y, z)).to_vec();
        let (floor, roof) = (level(0.0), level(height));
        let wall = |a: usize| vec![floor[a], floor[(a + 1) % 4], roof[(a + 1) % 4], roof[a]];
        let mut sides: Vec<Polygon> = (0..4).map(wall).collect();
        sides.push(roof.clone());
        sides.push(floor.iter().rev().copied().collect());
        sides
    }

    /// A block of 60 m by 60 m with houses of 15 m to 30 m, or of `height`.
    fn block(turned: bool, height: Option<f64>, count: usize) -> Vec<Vec<Polygon>> {
        let mut random = Random::new(11, 0);
        let pitch = 60.0 / count as f64;
        let place = |at: usize| pitch * at as f64 + 0.15 * pitch;
        let mut houses = Vec::new();
        for at in (0..count * count).map(|at| [place(at % count), place(at / count)]) {
            let height = height.unwrap_or_else(|| 15.0 + 15.0 * random.unit());
            let turn = if turned { random.unit() } else { 0.0 };
            houses.push(house(at, [0.7 * pitch, 0.7 * pitch, height], turn));
        }
        houses
    }

    fn ground() -> Vec<Polygon> {
        vec![vec![[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 60.0, 0.0], [0.0, 60.0, 0.0]]]
    }

    /// What is guessed of a surface whose sky is at +Z, and of the same turned so that it is at +Y.
    fn guesses(surface: &[Polygon]) -> [UpGuess; 2] {
        [UpAxis::Z, UpAxis::Y].map(|up| {
            let turn = |p: [f64; 3]| up.from_z_up(p.into()).to_array();
            let surface: Vec<Polygon> =
                surface.iter().map(|polygon| polygon.iter().map(|&p| turn(p)).collect()).collect();
            let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            for corner in surface.iter().flatten() {
                for (axis, value) in corner.iter().enumerate() {
                    bounds[0][axis] = bounds[0][axis].min(*value);
                    bounds[1][axis] = bounds[1][axis].max(*value);
                }
            }
            let mut evidence = UpEvidence::new(bounds);
            surface.iter().for_each(|polygon| evidence.add(polygon));
            evidence.guess()
        })
    }

    const RIGHT: [UpAxis; 2] = [UpAxis::Z, UpAxis::Y];

    #[test]
    fn blocks_stand_upright_whatever_is_closed_or_turned() {
        let open = |houses: Vec<Vec<Polygon>>| -> Vec<Polygon> {
            houses.into_iter().flat_map(|house| house.into_iter().take(5)).collect()
        };
        let clear = [
            [block(false, None, 4).concat(), ground()].concat(),
            block(false, None, 4).concat(),
            block(false, Some(30.0), 4).concat(),
            block(true, None, 4).concat(),
            [open(block(true, None, 4)), ground()].concat(),
            [block(false, Some(200.0), 2).concat(), ground()].concat(),
        ];
        for (number, surface) in clear.iter().enumerate() {
            let found = guesses(surface);
            assert_eq!(found.map(|guess| guess.axis), RIGHT, "{number}");
            assert!(found.iter().all(|guess| guess.is_clear), "{number}");
        }
        // Neither floors nor ground: right, but not by much.
        assert_eq!(guesses(&open(block(false, None, 4))).map(|guess| guess.axis), RIGHT);
    }

    #[test]
    fn shapes_that_say_nothing_are_not_clear() {
        let surfaces = [
            house([0.0; 2], [10.0; 3], 0.0),
            house([0.0; 2], [20.0, 20.0, 100.0], 0.0),
            Vec::new(),
        ];
        for (number, surface) in surfaces.iter().enumerate() {
            assert!(guesses(surface).iter().all(|guess| !guess.is_clear), "{number}");
            assert_eq!(guesses(surface)[0].axis, UpAxis::Z);
        }
        let mut warnings = Warnings::default();
        guesses(&surfaces[0])[0].warn(&mut warnings);
        assert!(warnings.iter().next().unwrap().0.contains("--up y or --up z"));
    }

    #[test]
    fn hostile_coordinates_give_a_guess() {
        let mut evidence = UpEvidence::new([[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]]);
        evidence.add(&[[f64::NAN; 3], [1e300; 3], [-1e300, 1e300, 0.0]]);
        evidence.add(&[]);
        evidence.add(&[[0.0; 3]]);
        assert!(!evidence.guess().is_clear);
    }
}
