//! A bounding-volume hierarchy of eight children a node over the triangles of a mesh.

use glam::Vec3;

use super::triangle::{LANES, Lanes, Points, Triangle, Triangles, max};
use crate::mesh::{Mesh, OrientedBox};

/// What a child is: a node, or with this bit a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight boxes. Those that are not used are inside out, infinitely far from everything.
#[derive(Debug)]
pub(super) struct Node {
    low: Points,
    high: Points,
    pub children: [u32; LANES],
    /// `None` where the boxes are good enough.
    oriented: Option<Box<OrientedBoxes>>,
}

impl Node {
    /// Of at most eight children.
    fn new(children: &[(u32, Box3)]) -> Self {
        let of = |lane: usize| children.get(lane).copied().unwrap_or((LEAF, Box3::EMPTY));
        Self {
            low: Points::from_fn(|lane| of(lane).1.low),
            high: Points::from_fn(|lane| of(lane).1.high),
            children: std::array::from_fn(|lane| of(lane).0),
            oriented: None,
        }
    }

    /// The squared distances of a point to the children, or somewhat less.
    #[inline(always)]
    pub fn squared_distances(&self, point: Vec3) -> Lanes {
        let mut squared = [0.0; LANES];
        for (lane, squared) in squared.iter_mut().enumerate() {
            let outside = |low: f32, high: f32, at: f32| max(max(low - at, at - high), 0.0);
            let x = outside(self.low.x[lane], self.high.x[lane], point.x);
            let y = outside(self.low.y[lane], self.high.y[lane], point.y);
            let z = outside(self.low.z[lane], self.high.z[lane], point.z);
            *squared = x * x + y * y + z * z;
        }
        if let Some(oriented) = &self.oriented {
            let of_oriented = oriented.squared_distances(point);
            squared = std::array::from_fn(|lane| max(squared[lane], of_oriented[lane]));
        }
        squared
    }

    /// The boxes that are used, each with its child.
    pub fn boxes(&self) -> impl Iterator<Item = (u32, Box3)> {
        let boxes = (0..LANES).map(|lane| {
            let bounds = Box3 { low: self.low.lane(lane), high: self.high.lane(lane) };
            (self.children[lane], bounds)
        });
        boxes.filter(|(_, bounds)| !bounds.is_empty())
    }
}

/// Children's boxes overlap where their areas sum up to more than so many times that of the box
/// around all: half of those of a surface that is divided well do.
const OVERLAP: f32 = 3.0;

/// Eight boxes with axes of their own.
#[derive(Debug)]
struct OrientedBoxes {
    origin: Points,
    axes: [Points; 3],
    low: [Lanes; 3],
    high: [Lanes; 3],
}

impl OrientedBoxes {
    /// One around each group of triangles.
    fn around(groups: &[Vec<[Vec3; 3]>]) -> Self {
        let boxes: Vec<OrientedBox> =
            groups.iter().map(|group| OrientedBox::around(group.iter().copied())).collect();
        let of = |lane: usize| boxes.get(lane).copied().unwrap_or(OrientedBox::EMPTY);
        let extents = |corner: fn(OrientedBox) -> Vec3| -> [Lanes; 3] {
            std::array::from_fn(|axis| std::array::from_fn(|lane| corner(of(lane))[axis]))
        };
        Self {
            origin: Points::from_fn(|lane| of(lane).origin),
            axes: std::array::from_fn(|axis| Points::from_fn(|lane| of(lane).axes[axis])),
            low: extents(|of| of.low),
            high: extents(|of| of.high),
        }
    }

    #[inline(always)]
    fn squared_distances(&self, point: Vec3) -> Lanes {
        let mut squared = [0.0; LANES];
        for (lane, squared) in squared.iter_mut().enumerate() {
            let way = point - self.origin.lane(lane);
            for axis in 0..3 {
                let at = way.dot(self.axes[axis].lane(lane));
                let outside = max(max(self.low[axis][lane] - at, at - self.high[axis][lane]), 0.0);
                *squared += outside * outside;
            }
            *squared *= OrientedBox::LESS;
        }
        squared
    }
}

/// An axis-aligned box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box3 {
    pub low: Vec3,
    pub high: Vec3,
}

impl Box3 {
    pub const EMPTY: Self = Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY };

    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        let with = |bounds: Self, point: Vec3| Self {
            low: bounds.low.min(point),
            high: bounds.high.max(point),
        };
        points.into_iter().fold(Self::EMPTY, with)
    }

    pub fn and(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    /// Returns whether the distance to another box is at most `reach` along each axis.
    pub fn is_within(&self, reach: f32, other: Self) -> bool {
        let apart = (self.low - other.high).max(other.low - self.high);
        apart.max_element() <= reach
    }

    pub fn centre(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    pub fn diagonal(&self) -> f32 {
        self.low.distance(self.high)
    }

    fn half_area(&self) -> f32 {
        let Vec3 { x, y, z } = self.high - self.low;
        x * y + y * z + z * x
    }

    /// The largest absolute coordinate.
    pub fn magnitude(&self) -> f32 {
        if self.is_empty() { 0.0 } else { self.low.abs().max(self.high.abs()).max_element() }
    }
}

/// Nodes over numbered boxes.
#[derive(Debug)]
pub(super) struct Tree {
    pub nodes: Vec<Node>,
    pub root: u32,
}

impl Tree {
    /// A tree over boxes, at most so many to a leaf, and the boxes of each leaf.
    pub fn new(boxes: &[Box3], most: usize) -> (Self, Vec<Vec<u32>>) {
        Self::over(boxes, &[], most)
    }

    /// A tree over triangles with these boxes.
    fn over(boxes: &[Box3], triangles: &[[Vec3; 3]], most: usize) -> (Self, Vec<Vec<u32>>) {
        let member = |(number, bounds): (u32, &Box3)| Member { centre: bounds.centre(), number };
        let mut members: Vec<Member> = (0..).zip(boxes).map(member).collect();
        let mut builder = Builder { boxes, triangles, most, nodes: Vec::new(), leaves: Vec::new() };
        let (root, _) = builder.build(&mut members);
        (Self { nodes: builder.nodes, root }, builder.leaves)
    }
}

/// A box to be put into a tree.
struct Member {
    centre: Vec3,
    number: u32,
}

struct Builder<'a> {
    boxes: &'a [Box3],
    /// Empty where the boxes are of others.
    triangles: &'a [[Vec3; 3]],
    most: usize,
    nodes: Vec<Node>,
    leaves: Vec<Vec<u32>>,
}

impl Builder<'_> {
    fn build(&mut self, members: &mut [Member]) -> (u32, Box3) {
        if members.len() <= self.most {
            let numbers: Vec<u32> = members.iter().map(|member| member.number).collect();
            let boxes = numbers.iter().map(|&number| self.boxes[number as usize]);
            let bounds = boxes.fold(Box3::EMPTY, Box3::and);
            self.leaves.push(numbers);
            return (LEAF | (self.leaves.len() - 1) as u32, bounds);
        }
        let mut groups = vec![members];
        while groups.len() < LANES {
            let sizes = groups.iter().map(|group| group.len()).enumerate();
            let Some((largest, size)) = sizes.max_by_key(|&(number, size)| (size, LANES - number))
            else {
                break;
            };
            if size <= self.most {
                break;
            }
            let [low, high] = halves(groups.swap_remove(largest), self.most);
            groups.extend([low, high]);
        }
        let at = self.nodes.len();
        self.nodes.push(Node::new(&[]));
        let children: Vec<(u32, Box3)> = groups.iter_mut().map(|group| self.build(group)).collect();
        self.nodes[at] = Node::new(&children);
        let bounds = children.iter().map(|(_, bounds)| *bounds).fold(Box3::EMPTY, Box3::and);
        let areas: f32 = children.iter().map(|(_, bounds)| bounds.half_area()).sum();
        if !self.triangles.is_empty() && areas > OVERLAP * bounds.half_area() {
            let triangle = |member: &Member| self.triangles[member.number as usize];
            let triangles: Vec<Vec<[Vec3; 3]>> =
                groups.iter().map(|group| group.iter().map(triangle).collect()).collect();
            self.nodes[at].oriented = Some(Box::new(OrientedBoxes::around(&triangles)));
        }
        (at as u32, bounds)
    }
}

/// Divides at the median of the longest axis, so that leaves are full: counts alone bound the
/// depth, wherever the boxes are.
fn halves(members: &mut [Member], most: usize) -> [&mut [Member]; 2] {
    let spread = Box3::of(members.iter().map(|member| member.centre));
    let axis = (spread.high - spread.low).max_position();
    let middle = members.len().div_ceil(most) / 2 * most;
    members.select_nth_unstable_by(middle, |a, b| a.centre[axis].total_cmp(&b.centre[axis]));
    let (low, high) = members.split_at_mut(middle);
    [low, high]
}

/// The square of a larger coordinate is more than f32 holds, or nearly.
const LARGEST: f32 = 1e15;

/// The triangles of one mesh.
#[derive(Debug)]
pub(super) struct Bvh {
    pub tree: Tree,
    pub leaves: Vec<Triangles>,
    /// Triangles, of which the last leaves may lack some.
    pub counts: Vec<u8>,
    pub bounds: Box3,
    /// The longest edge; infinite where coordinates cannot be computed with.
    pub longest: f32,
}

impl Bvh {
    /// Also the mesh's triangles in each leaf.
    pub fn new(mesh: &Mesh) -> (Self, Vec<Vec<u32>>) {
        let corners = |&triangle: &[u32; 3]| triangle.map(|v| mesh.positions[v as usize].into());
        let corners: Vec<[Vec3; 3]> = mesh.triangles.iter().map(corners).collect();
        let boxes: Vec<Box3> = corners.iter().map(|&corners| Box3::of(corners)).collect();
        let (tree, leaves) = Tree::over(&boxes, &corners, LANES);
        // Of coordinates beyond, and those that are none, nothing can be computed.
        let is_usable = |corner: &Vec3| corner.is_finite() && corner.abs().max_element() < LARGEST;
        let all_usable = corners.as_flattened().iter().all(is_usable);
        let mut longest = if all_usable { 0f32 } else { f32::INFINITY };
        let frames = |members: &Vec<u32>| {
            // Lanes that are left over hold the first triangle again.
            let triangle = |lane: usize| {
                let member = members.get(lane).or(members.first());
                Triangle::new(member.map_or([Vec3::INFINITY; 3], |&m| corners[m as usize]))
            };
            Triangles::from_fn(triangle)
        };
        let frames: Vec<Triangles> =
            if corners.is_empty() { Vec::new() } else { leaves.iter().map(frames).collect() };
        for leaf in &frames {
            for lane in 0..LANES {
                longest = longest.max(leaf.lane(lane).length);
            }
        }
        let counts = leaves.iter().map(|members| members.len() as u8).collect();
        let bounds = boxes.into_iter().fold(Box3::EMPTY, Box3::and);
        (Self { tree, leaves: frames, counts, bounds, longest }, leaves)
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use super::super::NearestTriangle;
    use super::*;
    use crate::random::Random;
    use crate::scaling::assert_scales;

    /// A cone of so many triangles around its tip.
    fn cone(count: usize) -> Mesh {
        let rim = (0..count).map(|at| {
            let (sin, cos) = (TAU * at as f32 / count as f32).sin_cos();
            [100.0 * cos, 100.0 * sin, 0.0]
        });
        let next = |at: u32| (at % count as u32 + 1, (at + 1) % count as u32 + 1);
        Mesh {
            positions: std::iter::once([0.0, 0.0, 30.0]).chain(rim).collect(),
            triangles: (0..count as u32).map(next).map(|(a, b)| [0, a, b]).collect(),
            ..Mesh::default()
        }
    }

    fn points(count: usize) -> Vec<Vec3> {
        let mut random = Random::new(11, 0);
        let mut unit = || random.unit() as f32;
        let point = |_| {
            let (sin, cos) = (TAU * unit()).sin_cos();
            let from_tip = unit();
            let z = 30.0 * (1.0 - from_tip) + 4.0 * unit() - 2.0;
            Vec3::new(100.0 * from_tip * cos, 100.0 * from_tip * sin, z)
        };
        (0..count).map(point).collect()
    }

    #[test]
    fn the_nearest_triangle_of_a_cone_is_that_of_looking_at_all() {
        let mesh = cone(700);
        let nearest = NearestTriangle::of(&mesh).unwrap();
        let mut search = nearest.search();
        let squared = |number: usize, point: Vec3| {
            let corners = mesh.triangles[number].map(|at| mesh.positions[at as usize].into());
            Triangle::new(corners).squared_distance(point)
        };
        for point in points(300) {
            let least = (0..700).map(|number| squared(number, point)).fold(f32::MAX, f32::min);
            let found = squared(search(point) as usize, point);
            assert!(found <= least * 1.0001 + 1e-9, "{found} {least} at {point}");
        }
    }

    #[test]
    fn few_boxes_of_a_fan_hold_a_point() {
        let visited = |count: usize| {
            let (bvh, _) = Bvh::new(&cone(count));
            let visited = |point: Vec3| {
                let mut open = vec![bvh.tree.root];
                let mut leaves = 0;
                while let Some(child) = open.pop() {
                    if child & LEAF != 0 {
                        leaves += 1;
                        continue;
                    }
                    let node = &bvh.tree.nodes[child as usize];
                    let squared = node.squared_distances(point);
                    let near = (0..LANES).filter(|&lane| squared[lane] < 0.01);
                    open.extend(near.map(|lane| node.children[lane]));
                }
                leaves
            };
            points(200).into_iter().map(visited).sum::<usize>()
        };
        let [some, many] = [1000, 16_000].map(visited);
        assert!(many < 6 * some, "{some} {many}");
    }

    #[test]
    fn time_scales_with_the_triangles_of_a_fan() {
        let searched = |count: usize| (cone(count), points(count));
        assert_scales(1000, searched, |(mesh, points)| {
            let nearest = NearestTriangle::of(&mesh).unwrap();
            let mut search = nearest.search();
            points.into_iter().map(&mut search).max()
        });
    }
}
