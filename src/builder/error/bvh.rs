//! A bounding-volume hierarchy of eight children a node over the triangles of a mesh.

use glam::Vec3;

use super::triangle::{LANES, Lanes, Points, Triangle, Triangles, max};
use crate::mesh::Mesh;

/// What a child is: a node, or with this bit a leaf.
pub(super) const LEAF: u32 = 1 << 31;

/// Eight boxes. Those that are not used are inside out, infinitely far from everything.
#[derive(Debug)]
pub(super) struct Node {
    low: Points,
    high: Points,
    pub children: [u32; LANES],
}

impl Node {
    /// Of at most eight children.
    fn new(children: &[(u32, Box3)]) -> Self {
        let of = |lane: usize| children.get(lane).copied().unwrap_or((LEAF, Box3::EMPTY));
        Self {
            low: Points::from_fn(|lane| of(lane).1.low),
            high: Points::from_fn(|lane| of(lane).1.high),
            children: std::array::from_fn(|lane| of(lane).0),
        }
    }

    /// The squared distances of a point to the boxes.
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

    pub fn centre(&self) -> Vec3 {
        (self.low + self.high) * 0.5
    }

    pub fn diagonal(&self) -> f32 {
        self.low.distance(self.high)
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
        let member = |(number, bounds): (u32, &Box3)| Member { centre: bounds.centre(), number };
        let mut members: Vec<Member> = (0..).zip(boxes).map(member).collect();
        let mut builder = Builder { boxes, most, nodes: Vec::new(), leaves: Vec::new() };
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
        let children: Vec<(u32, Box3)> =
            groups.into_iter().map(|group| self.build(group)).collect();
        self.nodes[at] = Node::new(&children);
        (at as u32, children.into_iter().map(|(_, bounds)| bounds).fold(Box3::EMPTY, Box3::and))
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
        let (tree, leaves) = Tree::new(&boxes, LANES);
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
