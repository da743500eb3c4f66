//! The distance from points to triangles, eight at a time.

use glam::{DVec2, DVec3, Vec2, Vec3};

/// Triangles that are tested at a time.
pub(super) const LANES: usize = 8;

/// Keeps divisions by the squared length of an edge that has none finite.
const TINY: f32 = 1e-37;

/// One instruction, unlike `f32::min`, which asks for numbers that are none.
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// One instruction, unlike `f32::max`.
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A triangle in a frame of its own: its longest edge lies on the first axis, from the origin on,
/// and its apex above it. Needles, lines and points have such a frame too, though they have no
/// normal to speak of.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub origin: Vec3,
    pub along: Vec3,
    pub up: Vec3,
    /// The length of the longest edge.
    pub length: f32,
    pub apex: [f32; 2],
}

/// The frame of a [`Triangle`] in f64, which is square to f32 however thin the triangle is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub origin: DVec3,
    pub along: DVec3,
    pub up: DVec3,
    /// The length of the longest edge.
    pub length: f64,
    pub apex: DVec2,
}

impl Frame {
    pub fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = from_longest_edge(corners);
        let along = (b - a).try_normalize().unwrap_or(DVec3::X);
        let aside = |way: DVec3| way - along * way.dot(along);
        // Twice, since the first leaves rounding of the length of the way, which a needle's apex
        // may be nearer than.
        let up = aside(aside(c - a)).try_normalize();
        let up = up.filter(|up| up.dot(along).abs() < 1e-9);
        let up = up.unwrap_or_else(|| along.any_orthonormal_vector());
        Self {
            origin: a,
            along,
            up,
            length: (b - a).dot(along),
            apex: DVec2::new((c - a).dot(along), (c - a).dot(up).max(0.0)),
        }
    }

    /// The distance of a point, as [`Triangle::squared_distance`] finds it.
    pub fn distance(&self, point: DVec3) -> f64 {
        let way = point - self.origin;
        let at = DVec2::new(way.dot(self.along), way.dot(self.up));
        let height = way.dot(self.along.cross(self.up));
        let end = DVec2::new(self.length, 0.0);
        let to_edge = |from: DVec2, to: DVec2| {
            let edge = to - from;
            let squared = edge.length_squared();
            let share = if squared > 0.0 { (at - from).dot(edge) / squared } else { 0.0 };
            (at - from - edge * share.clamp(0.0, 1.0)).length_squared()
        };
        let is_within = at.y >= 0.0
            && at.perp_dot(self.apex) >= 0.0
            && (at - end).perp_dot(self.apex - end) <= 0.0;
        let edges = [(DVec2::ZERO, end), (end, self.apex), (self.apex, DVec2::ZERO)];
        let beside = match is_within {
            true => 0.0,
            false => edges.map(|(a, b)| to_edge(a, b)).into_iter().fold(f64::INFINITY, f64::min),
        };
        (height * height + beside).sqrt()
    }
}

impl Triangle {
    pub fn new(corners: [Vec3; 3]) -> Self {
        let Frame { origin, along, up, length, apex } =
            Frame::new(corners.map(|corner| corner.as_dvec3()));
        Self {
            origin: origin.as_vec3(),
            along: along.as_vec3(),
            up: up.as_vec3(),
            length: length as f32,
            apex: apex.as_vec2().into(),
        }
    }

    /// Returns its frame in f64.
    pub fn frame(&self) -> Frame {
        let [origin, along, up] = [self.origin, self.along, self.up].map(Vec3::as_dvec3);
        Frame {
            origin,
            along,
            up,
            length: self.length.into(),
            apex: Vec2::from(self.apex).as_dvec2(),
        }
    }

    /// The squared distance of a point. Branch-free, so that eight are found at a time.
    #[inline(always)]
    pub fn squared_distance(&self, point: Vec3) -> f32 {
        let way = point - self.origin;
        let (x, y) = (way.dot(self.along), way.dot(self.up));
        let height = way.dot(self.along.cross(self.up));
        let [apex_x, apex_y] = self.apex;
        // From the end of the longest edge.
        let (x_end, apex_x_end) = (x - self.length, apex_x - self.length);
        let beside = x - min(max(x, 0.0), self.length);
        let to_longest = beside * beside + y * y;
        let to_edge = |x: f32, apex_x: f32| {
            let squared_length = max(apex_x * apex_x + apex_y * apex_y, TINY);
            let share = (x * apex_x + y * apex_y) / squared_length;
            let share = min(max(share, 0.0), 1.0);
            let (x, y) = (x - share * apex_x, y - share * apex_y);
            x * x + y * y
        };
        let to_edges = min(to_edge(x, apex_x), to_edge(x_end, apex_x_end));
        // The longest edge has acute angles at both ends: above it, it is never the nearest.
        let is_between = (x * apex_y > y * apex_x) & (x_end * apex_y < y * apex_x_end);
        let above = if is_between { 0.0 } else { to_edges };
        height * height + if y < 0.0 { to_longest } else { above }
    }

    /// The squared distances of points.
    #[inline(always)]
    pub fn squared_distances(&self, points: &Points) -> Lanes {
        let mut squared = [0.0; LANES];
        for (lane, squared) in squared.iter_mut().enumerate() {
            *squared = self.squared_distance(points.lane(lane));
        }
        squared
    }

    pub fn area(&self) -> f64 {
        0.5 * f64::from(self.length) * f64::from(self.apex[1])
    }

    /// To within rounding.
    pub fn corners(&self) -> [Vec3; 3] {
        let [x, y] = self.apex;
        [
            self.origin,
            self.origin + self.along * self.length,
            self.origin + self.along * x + self.up * y,
        ]
    }
}

/// The corners in the same order round, so that the longest edge lies between the first two.
fn from_longest_edge([a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| a.distance_squared(b));
    if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

/// Eight numbers. Loops over the lanes become vector instructions.
pub(super) type Lanes = [f32; LANES];

/// Points, eight at a time.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Points {
    pub x: Lanes,
    pub y: Lanes,
    pub z: Lanes,
}

impl Points {
    pub fn from_fn(point: impl Fn(usize) -> Vec3) -> Self {
        let axis = |axis: usize| std::array::from_fn(|lane| point(lane)[axis]);
        Self { x: axis(0), y: axis(1), z: axis(2) }
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }
}

/// Eight triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangles {
    origin: Points,
    along: Points,
    up: Points,
    length: Lanes,
    apex: [Lanes; 2],
}

impl Triangles {
    pub fn from_fn(triangle: impl Fn(usize) -> Triangle) -> Self {
        let lanes: [Triangle; LANES] = std::array::from_fn(triangle);
        Self {
            origin: Points::from_fn(|lane| lanes[lane].origin),
            along: Points::from_fn(|lane| lanes[lane].along),
            up: Points::from_fn(|lane| lanes[lane].up),
            length: lanes.map(|triangle| triangle.length),
            apex: [0, 1].map(|axis| lanes.map(|triangle| triangle.apex[axis])),
        }
    }

    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Triangle {
        Triangle {
            origin: self.origin.lane(lane),
            along: self.along.lane(lane),
            up: self.up.lane(lane),
            length: self.length[lane],
            apex: [self.apex[0][lane], self.apex[1][lane]],
        }
    }

    /// The first, second and third corners, to within rounding.
    pub fn corners(&self) -> [Points; 3] {
        [0, 1, 2].map(|corner| Points::from_fn(|lane| self.lane(lane).corners()[corner]))
    }

    /// The squared distances of a point.
    #[inline(always)]
    pub fn squared_distances(&self, point: Vec3) -> Lanes {
        let mut squared = [0.0; LANES];
        for (lane, squared) in squared.iter_mut().enumerate() {
            *squared = self.lane(lane).squared_distance(point);
        }
        squared
    }
}
