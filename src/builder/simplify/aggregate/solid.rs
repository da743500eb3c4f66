//! A box that stands for one body or several.

use glam::{DVec2, dvec2};

use crate::builder::constants::BoxConstants;
use crate::mesh::{Mesh, UpAxis, wide};

/// Of one box, without a floor, which nobody sees.
pub(super) const TRIANGLES: usize = 10;

/// What a side of a box looks like.
#[derive(Clone, Copy)]
pub(super) struct Look {
    /// A vertex with its material.
    pub(super) vertex: u32,
    /// Linear, 0 to 65535.
    pub(super) color: [f64; 4],
}

/// An upright box, metres, Z up.
#[derive(Clone, Copy)]
pub(super) struct Solid {
    pub(super) centre: DVec2,
    /// Half of the rectangle around all that it stands for, along `axis` and square to it.
    around: DVec2,
    /// Its area from above: that of all that it stands for, square metres.
    pub(super) footprint: f64,
    /// Of length 1.
    pub(super) axis: DVec2,
    pub(super) low: f64,
    pub(super) high: f64,
    roof: Look,
    wall: Look,
}

/// Sums over a body's triangles.
#[derive(Default)]
struct Sums {
    /// The area above which the body's roofs are, and their height times this.
    footprint: f64,
    roof_heights: f64,
    /// All areas as seen from above, those that face down negative, and times their heights.
    rise: f64,
    rise_heights: f64,
    /// Directions of walls turned four times as far, so that all four sides of a house point the
    /// same way, times their areas.
    directions: DVec2,
    roof: LookSum,
    wall: LookSum,
}

/// What triangles look like on average.
#[derive(Default)]
pub(super) struct LookSum {
    largest: (f64, u32),
    pub(super) area: f64,
    color: [f64; 4],
}

impl LookSum {
    pub(super) fn add(&mut self, mesh: &Mesh, triangle: [u32; 3], area: f64) {
        if area > self.largest.0 {
            self.largest = (area, triangle[0]);
        }
        self.area += area;
        for vertex in triangle {
            if let Some(color) = mesh.colors.get(vertex as usize) {
                for (sum, &channel) in self.color.iter_mut().zip(color) {
                    *sum += f64::from(channel) * area / 3.0;
                }
            }
        }
    }

    pub(super) fn look(&self) -> Option<Look> {
        (self.area > 0.0)
            .then(|| Look { vertex: self.largest.1, color: self.color.map(|sum| sum / self.area) })
    }
}

impl Solid {
    /// The box of as much footprint as the body, as high as its roofs are on average; `None` for
    /// what has no roof, is flat, or has hardly any walls or volume.
    pub(super) fn of(
        mesh: &Mesh,
        triangles: &[[u32; 3]],
        up: UpAxis,
        constants: &BoxConstants,
    ) -> Option<Self> {
        let at = |vertex: u32| up.z_up(wide(mesh.positions[vertex as usize]));
        let mut sums = Sums::default();
        for &triangle in triangles {
            let [a, b, c] = triangle.map(at);
            let normal = (b - a).cross(c - a) * 0.5;
            let area = normal.length();
            sums.rise += normal.z;
            sums.rise_heights += normal.z * (a.z + b.z + c.z) / 3.0;
            if normal.z.abs() <= constants.wall_rise * area {
                let along = dvec2(normal.x, normal.y);
                sums.directions += along.length() * turned_four_times(along);
                sums.wall.add(mesh, triangle, area);
            } else if normal.z > 0.0 {
                sums.footprint += normal.z;
                sums.roof_heights += normal.z * (a.z + b.z + c.z) / 3.0;
                sums.roof.add(mesh, triangle, area);
            }
        }
        let roof = sums.roof.look()?;
        let wall = sums.wall.look()?;
        let axis = turned_back(sums.directions);
        let mut rectangle = Rectangle::along(axis);
        let mut low = f64::INFINITY;
        for &vertex in triangles.as_flattened() {
            let point = at(vertex);
            rectangle.add(point.truncate());
            low = low.min(point.z);
        }
        let (centre, around) = rectangle.centre_and_half();
        let high = sums.roof_heights / sums.footprint;
        let footprint = sums.footprint.min(4.0 * around.x * around.y);
        let solid = Self { centre, around, footprint, axis, low, high, roof, wall };
        let walls = 4.0 * solid.half().element_sum() * (high - low);
        let volume = sums.rise_heights - sums.rise * low;
        let is_body = high - low > constants.least_height * footprint.sqrt()
            && sums.wall.area >= constants.least_walls * walls
            && volume >= constants.least_volume * footprint * (high - low);
        is_body.then_some(solid)
    }

    /// The box that stands for both: over their rectangle, with their footprints, and as high as
    /// they are on average.
    pub(super) fn joined(&self, other: &Self) -> Self {
        let (mine, others) = (self.footprint, other.footprint);
        let larger = if mine >= others { self } else { other };
        let mut rectangle = Rectangle::along(larger.axis);
        let corners = |solid: &Self| solid.corners(solid.around);
        for corner in corners(self).into_iter().chain(corners(other)) {
            rectangle.add(corner);
        }
        let (centre, around) = rectangle.centre_and_half();
        let mean = |a: f64, b: f64| (a * mine + b * others) / (mine + others);
        let mixed = |a: Look, b: Look, larger: Look| Look {
            vertex: larger.vertex,
            color: std::array::from_fn(|i| mean(a.color[i], b.color[i])),
        };
        Self {
            centre,
            around,
            footprint: (mine + others).min(4.0 * around.x * around.y),
            axis: larger.axis,
            low: self.low.min(other.low),
            high: mean(self.high, other.high),
            roof: mixed(self.roof, other.roof, larger.roof),
            wall: mixed(self.wall, other.wall, larger.wall),
        }
    }

    /// Half sides of the box: those of the rectangle shrunk to the footprint.
    pub(super) fn half(&self) -> DVec2 {
        let area = 4.0 * self.around.x * self.around.y;
        self.around * if area > 0.0 { (self.footprint / area).sqrt() } else { 0.0 }
    }

    /// Half of its width along a direction of length 1, metres.
    pub(super) fn half_along(&self, direction: DVec2) -> f64 {
        let half = self.half();
        half.x * self.axis.dot(direction).abs() + half.y * self.axis.perp().dot(direction).abs()
    }

    /// Counter-clockwise from above.
    fn corners(&self, half: DVec2) -> [DVec2; 4] {
        let (x, y) = (self.axis * half.x, self.axis.perp() * half.y);
        [-x - y, x - y, x + y, y - x].map(|way| self.centre + way)
    }

    /// Appends the box to `boxes`, looking as `mesh` does.
    pub(super) fn add_to(&self, boxes: &mut Mesh, mesh: &Mesh, up: UpAxis) {
        let mut add = |corner: DVec2, height: f64, look: &Look| {
            let place = up.from_z_up(corner.extend(height));
            boxes.positions.push(place.as_vec3().to_array());
            boxes.materials.push(mesh.materials[look.vertex as usize]);
            if !mesh.colors.is_empty() {
                boxes.colors.push(look.color.map(|channel| channel.round() as u16));
            }
            boxes.positions.len() as u32 - 1
        };
        let corners = self.corners(self.half());
        let roof = corners.map(|corner| add(corner, self.high, &self.roof));
        let top = corners.map(|corner| add(corner, self.high, &self.wall));
        let foot = corners.map(|corner| add(corner, self.low, &self.wall));
        boxes.triangles.extend([[roof[0], roof[1], roof[2]], [roof[0], roof[2], roof[3]]]);
        for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
            boxes.triangles.extend([[foot[i], foot[j], top[j]], [foot[i], top[j], top[i]]]);
        }
    }
}

/// A rectangle around points, in its own axes.
struct Rectangle {
    axis: DVec2,
    low: DVec2,
    high: DVec2,
}

impl Rectangle {
    fn along(axis: DVec2) -> Self {
        Self { axis, low: DVec2::INFINITY, high: DVec2::NEG_INFINITY }
    }

    fn add(&mut self, point: DVec2) {
        let own = dvec2(self.axis.dot(point), self.axis.perp().dot(point));
        (self.low, self.high) = (self.low.min(own), self.high.max(own));
    }

    fn centre_and_half(&self) -> (DVec2, DVec2) {
        let (own, half) = ((self.low + self.high) * 0.5, (self.high - self.low) * 0.5);
        (self.axis * own.x + self.axis.perp() * own.y, half)
    }
}

/// The fourth power of a direction as a complex number, of length 1; 0 for none.
fn turned_four_times(direction: DVec2) -> DVec2 {
    let square = |z: DVec2| dvec2(z.x * z.x - z.y * z.y, 2.0 * z.x * z.y);
    square(square(direction.normalize_or_zero()))
}

/// The direction nearest to the first axis whose fourth power points this way.
fn turned_back(direction: DVec2) -> DVec2 {
    let root = |z: DVec2| {
        let (x, y) = ((0.5 + 0.5 * z.x).max(0.0).sqrt(), (0.5 - 0.5 * z.x).max(0.0).sqrt());
        dvec2(x, y.copysign(z.y))
    };
    root(root(direction.try_normalize().unwrap_or(DVec2::X)))
}

#[cfg(test)]
impl Solid {
    /// A box along the axes, of one colour.
    pub(super) fn plain(centre: DVec2, around: DVec2, low: f64, high: f64) -> Self {
        let look = Look { vertex: 0, color: [0.0; 4] };
        let (footprint, axis) = (4.0 * around.x * around.y, DVec2::X);
        Self { centre, around, footprint, axis, low, high, roof: look, wall: look }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// A house of 8 by 4 m and 3 m high, turned by about 30 degrees.
    fn house(up: UpAxis) -> Mesh {
        let axis = dvec2(0.75f64.sqrt(), 0.5);
        let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]];
        let places = [1.0, 4.0].into_iter().flat_map(|height| {
            corners.map(|[x, y]| {
                let place = dvec2(50.0, 20.0) + axis * x + axis.perp() * y;
                up.from_z_up(place.extend(height)).as_vec3().to_array()
            })
        });
        let mut triangles = vec![[4, 5, 6], [4, 6, 7], [0, 2, 1], [0, 3, 2]];
        for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
            triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
        }
        let positions: Vec<[f32; 3]> = places.collect();
        Mesh { materials: vec![0; positions.len()], positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn the_box_of_a_box_is_itself_whichever_axis_is_up() {
        for up in [UpAxis::Z, UpAxis::Y] {
            let house = house(up);
            let solid = Solid::of(&house, &house.triangles, up, &BoxConstants::default()).unwrap();
            assert!((solid.footprint - 32.0).abs() < 1e-3, "{}", solid.footprint);
            assert!((solid.low - 1.0).abs() < 1e-5 && (solid.high - 4.0).abs() < 1e-5);
            let mut boxes = Mesh::default();
            solid.add_to(&mut boxes, &house, up);
            assert_eq!(boxes.triangles.len(), TRIANGLES);
            // All but the floor, facing outwards.
            assert!((boxes.area() - (house.area() - 32.0)).abs() < 1e-2, "{}", boxes.area());
            let volume = |mesh: &Mesh| -> f64 {
                let six = |&t: &[u32; 3]| {
                    let [a, b, c] = mesh.corners(t);
                    let down = up.from_z_up(DVec3::Z);
                    (a - down).dot((b - down).cross(c - down))
                };
                mesh.triangles.iter().map(six).sum::<f64>() / 6.0
            };
            // The point is in the plane of the floor, which adds nothing then.
            assert!((volume(&boxes) - volume(&house)).abs() < 1e-2);
            for place in &house.positions {
                let near = |p: &[f32; 3]| wide(*p).distance(wide(*place)) < 1e-3;
                assert!(boxes.positions.iter().any(near), "{place:?}");
            }
        }
    }

    #[test]
    fn what_is_flat_or_has_no_roof_is_no_body() {
        let house = house(UpAxis::Z);
        let up = UpAxis::Z;
        assert!(
            Solid::of(&house, &house.triangles[..2], up, &BoxConstants::default()).is_none(),
            "a roof alone"
        );
        assert!(
            Solid::of(&house, &house.triangles[4..], up, &BoxConstants::default()).is_none(),
            "walls alone"
        );
        let mut slope = house.clone();
        for place in &mut slope.positions {
            place[2] = place[0] * 0.4;
        }
        assert!(
            Solid::of(&slope, &slope.triangles[..2], up, &BoxConstants::default()).is_none(),
            "a slope"
        );
        let mut ramp = house;
        for place in &mut ramp.positions {
            place[2] = place[2] * 0.1 + place[0] * 0.4;
        }
        assert!(
            Solid::of(&ramp, &ramp.triangles, up, &BoxConstants::default()).is_none(),
            "a ramp"
        );
    }

    #[test]
    fn joined_boxes_keep_their_volume_and_base() {
        let house = house(UpAxis::Z);
        let a = Solid::of(&house, &house.triangles, UpAxis::Z, &BoxConstants::default()).unwrap();
        let b = Solid {
            centre: a.centre + dvec2(12.0, 3.0),
            low: a.low + 1.0,
            high: a.high + 6.0,
            ..a
        };
        let both = a.joined(&b);
        assert!((both.footprint - 64.0).abs() < 1e-3);
        assert!((both.high - (a.high + 3.0)).abs() < 1e-9);
        assert!((both.low - a.low).abs() < 1e-9);
    }
}
