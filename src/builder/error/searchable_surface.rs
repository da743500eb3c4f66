//! The surface that a chunk had before simplification.

use std::sync::{Arc, OnceLock};

use glam::{DVec3, Vec3};

use super::adjacency::{Adjacency, Links, Slot};
use super::bvh::{Box3, Bvh, LEAF, Node, Tree};
use super::samples::Samples;
use super::triangle::{LANES, Triangle, max, min};
use crate::builder::constants::MeasureConstants;
use crate::mesh::Mesh;

/// A surface of one or several meshes, searchable; built once and shared by all levels above it.
/// Cheap to clone.
#[derive(Clone, Debug)]
pub struct SearchableSurface {
    pub(super) parts: Vec<Arc<Part>>,
    /// Over the boxes of the parts, one to a leaf.
    top: Arc<Tree>,
    /// The part of each leaf.
    numbers: Vec<u32>,
    /// Neighbours across the borders of parts, computed when first needed.
    links: Arc<OnceLock<Links>>,
    pub(super) bounds: Box3,
    /// The longest edge.
    pub(super) longest: f32,
    /// How it is measured.
    pub(super) constants: MeasureConstants,
    /// A bound of the distance between each part and the source, both ways, metres; empty where
    /// all are 0.
    surface_offsets: Arc<[f32]>,
}

/// One mesh.
#[derive(Debug)]
pub(super) struct Part {
    pub bvh: Bvh,
    pub samples: Samples,
    pub adjacency: Adjacency,
    /// What each triangle looks like, where no triangle has corners of several colours; by slot.
    pub faces: Vec<Face>,
}

/// What a triangle of one colour looks like.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Face {
    /// The number of its material in the block's model.
    pub material: u32,
    /// RGBA, linear, 65535 is 1.
    pub color: [u16; 4],
}

impl Face {
    /// Of a triangle with vertex colours; `None` where its corners differ.
    pub fn of(mesh: &Mesh, triangle: [u32; 3]) -> Option<Self> {
        let [a, b, c] = triangle.map(|vertex| mesh.colors[vertex as usize]);
        let material = mesh.materials[triangle[0] as usize];
        (a == b && b == c).then_some(Self { material, color: a })
    }
}

/// By slot; empty where there are no vertex colours, or a triangle has several.
fn faces(mesh: &Mesh, leaves: &[Vec<u32>]) -> Vec<Face> {
    if mesh.colors.is_empty() {
        return Vec::new();
    }
    let mut faces = vec![Face::default(); leaves.len() * LANES];
    for (leaf, members) in leaves.iter().enumerate() {
        for (lane, &member) in members.iter().enumerate() {
            let Some(face) = Face::of(mesh, mesh.triangles[member as usize]) else {
                return Vec::new();
            };
            faces[leaf * LANES + lane] = face;
        }
    }
    faces
}

/// A triangle of a [`SearchableSurface`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TriangleId {
    pub part: u32,
    pub leaf: u32,
    pub lane: u32,
}

impl TriangleId {
    pub fn of_slot(part: u32, slot: Slot) -> Self {
        Self { part, leaf: slot / LANES as u32, lane: slot % LANES as u32 }
    }

    pub fn slot(self) -> Slot {
        self.leaf * LANES as u32 + self.lane
    }
}

impl SearchableSurface {
    /// The surface of one mesh.
    pub fn of(mesh: &Mesh, constants: MeasureConstants) -> Self {
        if mesh.triangles.is_empty() {
            return Self::from_parts(Vec::new(), constants);
        }
        let (bvh, leaves) = Bvh::new(mesh);
        let adjacency = Adjacency::new(mesh, &leaves);
        let samples = Samples::of(&bvh, &constants);
        let faces = faces(mesh, &leaves);
        Self::from_parts(vec![Arc::new(Part { bvh, samples, adjacency, faces })], constants)
    }

    /// The surface of one mesh, of which nothing is asked but what is near points.
    pub(super) fn of_points(mesh: &Mesh, constants: MeasureConstants) -> Self {
        if mesh.triangles.is_empty() {
            return Self::from_parts(Vec::new(), constants);
        }
        Self::of_bvh(Bvh::new(mesh).0, constants)
    }

    pub(super) fn of_bvh(bvh: Bvh, constants: MeasureConstants) -> Self {
        let samples = Samples::of(&bvh, &constants);
        let (adjacency, faces) = Default::default();
        Self::from_parts(vec![Arc::new(Part { bvh, samples, adjacency, faces })], constants)
    }

    /// Corners, area and looks of its triangles; `None` where some have several colours, or none.
    pub fn faces(&self) -> Option<impl Iterator<Item = ([Vec3; 3], f64, Face)>> {
        let known = self.parts.iter().all(|part| !part.faces.is_empty());
        let of_part = |part: &'_ Arc<Part>| {
            let part = Arc::clone(part);
            (0..part.bvh.leaves.len()).flat_map(move |leaf| {
                let part = Arc::clone(&part);
                (0..usize::from(part.bvh.counts[leaf])).map(move |lane| {
                    let triangle = part.bvh.leaves[leaf].lane(lane);
                    (triangle.corners(), triangle.area(), part.faces[leaf * LANES + lane])
                })
            })
        };
        (known && !self.is_empty()).then(|| self.parts.iter().flat_map(of_part))
    }

    /// Corners of its triangles.
    pub fn triangles(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.parts.iter().flat_map(|part| {
            let Bvh { leaves, counts, .. } = &part.bvh;
            leaves.iter().zip(counts).flat_map(|(leaf, &count)| {
                (0..usize::from(count)).map(|lane| leaf.lane(lane).corners())
            })
        })
    }

    /// Corners of a triangle as its mesh has them, in f64; `None` where these are not kept
    /// ([`Self::of_points`]).
    pub(super) fn exact_corners(&self, id: TriangleId) -> Option<[DVec3; 3]> {
        let linked = self.parts[id.part as usize].adjacency.triangles.get(id.slot() as usize)?;
        let [x, y, z] = linked.corners;
        Some([0, 1, 2].map(|at| DVec3::new(x[at].into(), y[at].into(), z[at].into())))
    }

    /// All triangles.
    pub(super) fn ids(&self) -> impl Iterator<Item = TriangleId> {
        (0..).zip(&self.parts).flat_map(|(part, one)| {
            (0..).zip(&one.bvh.counts).flat_map(move |(leaf, &count)| {
                (0..count.into()).map(move |lane| TriangleId { part, leaf, lane })
            })
        })
    }

    /// Several surfaces as one, each with its offs. Their triangles are shared, not copied.
    pub fn union(parts: &[Arc<Self>]) -> Self {
        let constants = parts.first().map_or_else(Default::default, |part| part.constants);
        let all = parts.iter().flat_map(|part| part.parts.iter().cloned());
        let union = Self::from_parts(all.collect(), constants);
        if parts.iter().all(|part| part.surface_offsets.is_empty()) {
            return union;
        }
        let surface_offsets = |part: &Arc<Self>| {
            let part = Arc::clone(part);
            (0..part.parts.len() as u32).map(move |number| part.off(number))
        };
        Self { surface_offsets: parts.iter().flat_map(surface_offsets).collect(), ..union }
    }

    /// What the triangle nearest to a point looks like; `None` where [`Self::faces`] has none.
    pub fn face_near(&self, point: Vec3) -> Option<Face> {
        if self.is_empty() {
            return None;
        }
        let id = Search::new(self).nearest(point, 0.0).id;
        self.parts[id.part as usize].faces.get(id.slot() as usize).copied()
    }

    fn from_parts(parts: Vec<Arc<Part>>, constants: MeasureConstants) -> Self {
        let boxes: Vec<Box3> = parts.iter().map(|part| part.bvh.bounds).collect();
        let (top, leaves) = Tree::new(&boxes, 1);
        Self {
            top: Arc::new(top),
            numbers: leaves.into_iter().flatten().collect(),
            bounds: boxes.into_iter().fold(Box3::EMPTY, Box3::and),
            longest: parts.iter().map(|part| part.bvh.longest).fold(0.0, f32::max),
            links: Arc::default(),
            parts,
            constants,
            surface_offsets: Arc::default(),
        }
    }

    /// The same surface, at most `off` metres from the source, both ways.
    pub fn with_surface_offset(self, off: f64) -> Self {
        let count = if off > 0.0 { self.parts.len() } else { 0 };
        Self { surface_offsets: vec![off as f32; count].into(), ..self }
    }

    /// A bound of the distance between a part and the source, metres.
    pub(super) fn off(&self, part: u32) -> f32 {
        self.surface_offsets.get(part as usize).copied().unwrap_or(0.0)
    }

    /// The largest of all parts.
    pub(super) fn max_surface_offset(&self) -> f32 {
        self.surface_offsets.iter().copied().fold(0.0, f32::max)
    }

    /// The largest of the parts whose boxes are within `reach` of a box along each axis.
    pub(super) fn max_surface_offset_near(&self, bounds: Box3, reach: f32) -> f32 {
        let near = self.parts.iter().zip(&*self.surface_offsets);
        let near = near.filter(|(part, _)| part.bvh.bounds.is_within(reach, bounds));
        near.map(|(_, &off)| off).fold(0.0, f32::max)
    }

    /// Returns the neighbours across the borders of parts.
    pub(super) fn links(&self) -> &Links {
        let adjacencies = || self.parts.iter().map(|part| &part.adjacency);
        self.links.get_or_init(|| Links::between(adjacencies()))
    }

    /// Whether there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    /// Of the bounding box; 0 where there is no triangle.
    pub(super) fn diagonal(&self) -> f64 {
        if self.is_empty() { 0.0 } else { self.bounds.diagonal().into() }
    }

    /// Returns the area of all triangles, square metres.
    pub fn area(&self) -> f64 {
        self.parts.iter().map(|part| part.samples.area).sum()
    }

    /// How many triangles there are.
    pub fn triangle_count(&self) -> usize {
        let of_part =
            |part: &Arc<Part>| part.bvh.counts.iter().map(|&n| usize::from(n)).sum::<usize>();
        self.parts.iter().map(of_part).sum()
    }

    pub(super) fn triangle(&self, id: TriangleId) -> Triangle {
        self.parts[id.part as usize].bvh.leaves[id.leaf as usize].lane(id.lane as usize)
    }
}

/// A triangle near a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub squared: f32,
    pub id: TriangleId,
}

/// Asks a [`SearchableSurface`], which must not be empty, for what is near points.
pub(super) struct Search<'a> {
    original: &'a SearchableSurface,
    stack: Vec<(f32, u32, u32)>,
    /// What was near the point before is often near the next one.
    last: TriangleId,
}

/// In place of a part's number: the tree over the parts.
const TOP: u32 = u32::MAX;

impl<'a> Search<'a> {
    pub fn new(original: &'a SearchableSurface) -> Self {
        let last = TriangleId { part: 0, leaf: 0, lane: 0 };
        Self { original, stack: Vec::with_capacity(128), last }
    }

    pub fn original(&self) -> &'a SearchableSurface {
        self.original
    }

    /// Visits the leaves whose boxes are within a distance, near ones first. `visit` returns how far
    /// others may be from then on; negative to end.
    pub fn leaves_near(
        &mut self,
        point: Vec3,
        mut reach: f32,
        mut visit: impl FnMut(u32, u32) -> f32,
    ) {
        let SearchableSurface { parts, top, numbers, .. } = self.original;
        self.stack.clear();
        self.stack.push((0.0, TOP, top.root));
        while let Some((squared, part, child)) = self.stack.pop() {
            if squared > reach * reach {
                continue;
            }
            if child & LEAF == 0 {
                let tree = if part == TOP { top } else { &parts[part as usize].bvh.tree };
                // More than the square, so that what is just within the reach is pushed.
                let most = reach * reach * 1.000_001 + f32::MIN_POSITIVE;
                push(&mut self.stack, &tree.nodes[child as usize], part, point, most);
            } else if part == TOP {
                let part = numbers[(child & !LEAF) as usize];
                self.stack.push((squared, part, parts[part as usize].bvh.tree.root));
            } else {
                reach = visit(part, child & !LEAF);
                if reach < 0.0 {
                    return;
                }
            }
        }
    }

    /// The nearest triangle, or one that is not farther than `enough`, its off included.
    pub fn nearest(&mut self, point: Vec3, enough: f32) -> Near {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has what the function is compiled for.
            return unsafe { self.nearest_avx2(point, enough) };
        }
        self.nearest_portable(point, enough)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn nearest_avx2(&mut self, point: Vec3, enough: f32) -> Near {
        self.nearest_portable(point, enough)
    }

    #[inline(always)]
    fn nearest_portable(&mut self, point: Vec3, enough: f32) -> Near {
        let is_enough = |best: &Near| {
            let enough = max(enough - self.original.off(best.id.part), 0.0);
            best.squared <= enough * enough
        };
        let at = point;
        let mut best = Near { squared: f32::INFINITY, id: self.last };
        let first = self.last;
        self.leaf(first.part, first.leaf, at, &mut best);
        let SearchableSurface { parts, top, numbers, .. } = self.original;
        if !is_enough(&best) {
            self.stack.clear();
            let start = match &parts[..] {
                [part] => (0.0, 0, part.bvh.tree.root),
                _ => (0.0, TOP, top.root),
            };
            self.stack.push(start);
            while let Some((squared, part, child)) = self.stack.pop() {
                if squared >= best.squared {
                    continue;
                }
                if child & LEAF == 0 {
                    let tree = if part == TOP { top } else { &parts[part as usize].bvh.tree };
                    push(&mut self.stack, &tree.nodes[child as usize], part, at, best.squared);
                } else if part == TOP {
                    let part = numbers[(child & !LEAF) as usize];
                    self.stack.push((squared, part, parts[part as usize].bvh.tree.root));
                } else if (part, child & !LEAF) != (first.part, first.leaf) {
                    self.leaf(part, child & !LEAF, at, &mut best);
                    if is_enough(&best) {
                        break;
                    }
                }
            }
        }
        self.last = best.id;
        best
    }

    #[inline(always)]
    fn leaf(&self, part: u32, leaf: u32, at: Vec3, best: &mut Near) {
        let triangles = &self.original.parts[part as usize].bvh.leaves[leaf as usize];
        let squared = triangles.squared_distances(at);
        let least = squared.into_iter().fold(f32::INFINITY, min);
        if least < best.squared {
            let lane = squared.iter().position(|&squared| squared == least).unwrap_or(0) as u32;
            *best = Near { squared: least, id: TriangleId { part, leaf, lane } };
        }
    }
}

/// Pushes the children that are nearer than `most`, the nearest last.
#[inline(always)]
fn push(stack: &mut Vec<(f32, u32, u32)>, node: &Node, part: u32, at: Vec3, most: f32) {
    let squared = node.squared_distances(at);
    // Without a branch for each, of which half would be foretold wrongly.
    let mut near = [0; LANES];
    let mut count = 0;
    for (lane, &squared) in squared.iter().enumerate() {
        near[count % LANES] = lane;
        count += usize::from(squared < most);
    }
    let first = stack.len();
    for &lane in &near[..count] {
        let mut place = stack.len();
        stack.push((squared[lane], part, node.children[lane]));
        while place > first && stack[place - 1].0 < stack[place].0 {
            stack.swap(place - 1, place);
            place -= 1;
        }
    }
}
