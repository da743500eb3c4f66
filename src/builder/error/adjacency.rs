//! Which triangles share edges, by positions: vertices differ at texture seams.

use glam::Vec3;
use meshopt::{VertexDataAdapter, generate_position_remap};
use rustc_hash::FxHashMap;

use super::triangle::LANES;
use crate::mesh::{Mesh, PositionKey, key};

/// A triangle of one mesh: the number of its leaf times eight, and its lane.
pub(super) type Slot = u32;

/// Marks an edge across which no triangle continues this one.
const NONE: Slot = u32::MAX;

/// Edges with more triangles than this are left without neighbours: pairing them takes time in
/// proportion to the square of their number.
const MOST_PAIRED: usize = 8;

/// Two triangles that face different ways continue each other if no other triangle of the edge
/// that faces the same way is flatter to one of them, by this difference of cosines.
const TURNED: f32 = 0.5;

/// The triangles of one mesh with their neighbours.
#[derive(Debug, Default)]
pub(super) struct Adjacency {
    /// One to a slot; those that are not used have no neighbours.
    pub triangles: Vec<TriangleAdjacency>,
    /// Edges that one triangle has.
    open: Vec<OpenEdge>,
}

/// What a walk over the surface needs of a triangle, side by side in memory.
#[derive(Clone, Copy, Debug)]
pub(super) struct TriangleAdjacency {
    /// As the mesh has them: three of x, of y and of z.
    pub corners: [[f32; 3]; 3],
    /// Across the edges from the first corner on.
    across: [Slot; 3],
}

impl TriangleAdjacency {
    const UNUSED: Self = Self { corners: [[0.0; 3]; 3], across: [NONE; 3] };

    /// The triangle across an edge.
    #[inline(always)]
    pub fn across(&self, edge: usize) -> Option<Slot> {
        (self.across[edge] != NONE).then_some(self.across[edge])
    }

    /// The way along an edge, and the direction from there to the third corner, across the edge.
    fn away_from(&self, edge: usize) -> (Vec3, Vec3) {
        let [x, y, z] = self.corners;
        let [from, to, apex] = [0, 1, 2].map(|next| {
            let corner = (edge + next) % 3;
            Vec3::new(x[corner], y[corner], z[corner])
        });
        let along = to - from;
        (along, (apex - from).reject_from(along).normalize_or_zero())
    }
}

/// An edge at the border of a mesh.
#[derive(Clone, Copy, Debug)]
struct OpenEdge {
    /// In order.
    ends: [PositionKey<f32>; 2],
    slot: Slot,
    edge: u8,
}

impl Adjacency {
    /// Of a mesh whose triangles are in these leaves.
    pub fn new(mesh: &Mesh, leaves: &[Vec<u32>]) -> Self {
        let bytes = bytemuck::cast_slice(&mesh.positions);
        let Ok(vertices) = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0) else {
            return Self::default();
        };
        let places = generate_position_remap(&vertices);
        let mut edges = EdgesByPlace::new(places.len());
        for &corners in &mesh.triangles {
            (0..3).for_each(|edge| edges.count(ends(corners, edge, &places)));
        }
        edges.allot();
        let mut triangles = vec![TriangleAdjacency::UNUSED; leaves.len() * LANES];
        for (slot, triangle) in slots(leaves) {
            let corners = mesh.triangles[triangle as usize];
            for edge in 0..3 {
                edges.put(ends(corners, edge.into(), &places), (slot, edge));
            }
            let axis = |axis: usize| corners.map(|v| mesh.positions[v as usize][axis]);
            triangles[slot as usize].corners = [0, 1, 2].map(axis);
        }
        let mut open = Vec::new();
        for place in 0..places.len() as u32 {
            let edges = edges.of(place);
            edges.sort_unstable();
            for same in edges.chunk_by(|a, b| a.0 == b.0) {
                match *same {
                    [(other, (slot, edge))] => {
                        let mut ends = [place, other].map(|v| key(mesh.positions[v as usize]));
                        ends.sort_unstable();
                        open.push(OpenEdge { ends, slot, edge });
                    }
                    [(_, a), (_, b)] => link(&mut triangles, a, b),
                    _ if same.len() <= MOST_PAIRED => {
                        let edges: Vec<(Slot, u8)> = same.iter().map(|&(_, edge)| edge).collect();
                        let pairs = continuing(&triangles, &edges);
                        pairs.into_iter().for_each(|[a, b]| link(&mut triangles, a, b));
                    }
                    _ => {}
                }
            }
        }
        Self { triangles, open }
    }
}

fn link(triangles: &mut [TriangleAdjacency], (a, of_a): (Slot, u8), (b, of_b): (Slot, u8)) {
    triangles[a as usize].across[usize::from(of_a)] = b;
    triangles[b as usize].across[usize::from(of_b)] = a;
}

/// Pairs the triangles of an edge that continue each other: flat ones first, of equally flat ones
/// those that face the same way. Where each face is there twice, both sides are so surfaces of
/// their own. An overlay is sound with any pairs: no triangle is in two.
fn continuing(triangles: &[TriangleAdjacency], edges: &[(Slot, u8)]) -> Vec<[(Slot, u8); 2]> {
    let away: Vec<(Vec3, Vec3)> =
        edges.iter().map(|&(slot, edge)| triangles[slot as usize].away_from(edge.into())).collect();
    let mut pairs: Vec<(f32, [usize; 2])> = Vec::new();
    for b in 0..edges.len() {
        for a in 0..b {
            let ((along_a, away_a), (along_b, away_b)) = (away[a], away[b]);
            // Neighbours that face the same way pass along their edge in opposite directions.
            let turned = if along_a.dot(along_b) > 0.0 { TURNED } else { 0.0 };
            pairs.push((away_a.dot(away_b) + turned, [a, b]));
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let mut is_paired = vec![false; edges.len()];
    pairs.retain(|(_, [a, b])| {
        let are_free = !is_paired[*a] && !is_paired[*b];
        if are_free {
            (is_paired[*a], is_paired[*b]) = (true, true);
        }
        are_free
    });
    pairs.into_iter().map(|(_, pair)| pair.map(|number| edges[number])).collect()
}

/// The slots that are used, each with its triangle.
fn slots(leaves: &[Vec<u32>]) -> impl Iterator<Item = (Slot, u32)> {
    let of_leaf = |(leaf, members): (u32, &Vec<u32>)| {
        let slots = leaf * LANES as u32..;
        slots.zip(members.clone())
    };
    (0..).zip(leaves).flat_map(of_leaf)
}

/// The places of an edge's ends, the lower number first.
fn ends(corners: [u32; 3], edge: usize, places: &[u32]) -> (u32, u32) {
    let [a, b] = [corners[edge], corners[(edge + 1) % 3]].map(|v| places[v as usize]);
    (a.min(b), a.max(b))
}

/// Edges in order of their lower places.
struct EdgesByPlace {
    begins: Vec<u32>,
    edges: Vec<(u32, (Slot, u8))>,
}

impl EdgesByPlace {
    fn new(vertices: usize) -> Self {
        Self { begins: vec![0; vertices + 2], edges: Vec::new() }
    }

    fn count(&mut self, (low, _): (u32, u32)) {
        self.begins[low as usize + 2] += 1;
    }

    /// Makes room for what was counted.
    fn allot(&mut self) {
        let mut sum = 0;
        for begin in &mut self.begins {
            sum += *begin;
            *begin = sum;
        }
        self.edges = vec![(0, (NONE, 0)); sum as usize];
    }

    fn put(&mut self, (low, high): (u32, u32), edge: (Slot, u8)) {
        let at = &mut self.begins[low as usize + 1];
        self.edges[*at as usize] = (high, edge);
        *at += 1;
    }

    fn of(&mut self, low: u32) -> &mut [(u32, (Slot, u8))] {
        let [begin, end] = [low, low + 1].map(|v| self.begins[v as usize] as usize);
        &mut self.edges[begin..end]
    }
}

/// Links over the edges where meshes meet: from the part, slot and edge of a triangle to the
/// part and slot of its neighbour.
#[derive(Debug, Default)]
pub(super) struct Links(FxHashMap<(u32, Slot, u8), (u32, Slot)>);

impl Links {
    /// Of some meshes, in the order of their numbers.
    pub fn between<'a>(parts: impl Iterator<Item = &'a Adjacency>) -> Self {
        let open = |(part, adjacency): (u32, &'a Adjacency)| {
            adjacency.open.iter().map(move |&edge| (edge.ends, part, edge))
        };
        let mut edges: Vec<_> = (0..).zip(parts).flat_map(open).collect();
        edges.sort_unstable_by_key(|&(ends, part, edge)| (ends, part, edge.slot, edge.edge));
        let mut links = FxHashMap::default();
        for same in edges.chunk_by(|a, b| a.0 == b.0) {
            if let [(_, part, a), (_, other, b)] = *same {
                links.insert((part, a.slot, a.edge), (other, b.slot));
                links.insert((other, b.slot, b.edge), (part, a.slot));
            }
        }
        Self(links)
    }

    /// The triangle across an edge.
    pub fn across(&self, part: u32, slot: Slot, edge: usize) -> Option<(u32, Slot)> {
        self.0.get(&(part, slot, edge as u8)).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::super::bvh::Bvh;
    use super::super::tests::mesh;
    use super::*;

    /// Returns for each triangle its neighbour across the edge from vertex 0 to vertex 1.
    fn across(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<Option<usize>> {
        let mesh = mesh(positions, triangles);
        let (_, leaves) = Bvh::new(&mesh);
        let adjacency = Adjacency::new(&mesh, &leaves);
        let numbers: FxHashMap<Slot, u32> = slots(&leaves).collect();
        let mut across = vec![None; triangles.len()];
        for (&slot, &number) in &numbers {
            let corners = triangles[number as usize];
            let edge = (0..3).find(|&edge| ends(corners, edge, &[0, 1, 2, 3, 4, 5, 6]) == (0, 1));
            let other = adjacency.triangles[slot as usize].across(edge.unwrap());
            across[number as usize] = other.map(|slot| numbers[&slot] as usize);
        }
        across
    }

    /// An edge, and points left and right of it, above it, and a little above the left.
    const POINTS: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [-1.0, 0.0, 0.3],
    ];

    #[test]
    fn flat_neighbours_continue_each_other() {
        let beside_a_wall = across(&POINTS, &[[0, 1, 2], [4, 1, 0], [1, 0, 3]]);
        assert_eq!(beside_a_wall, [Some(2), None, Some(0)]);
        let turned = across(&POINTS, &[[0, 1, 2], [4, 1, 0], [0, 1, 3]]);
        assert_eq!(turned, [Some(2), None, Some(0)]);
        let flatter = across(&POINTS, &[[0, 1, 5], [0, 1, 2], [1, 0, 3]]);
        assert_eq!(flatter, [None, Some(2), Some(1)]);
    }

    #[test]
    fn both_sides_of_a_sheet_are_surfaces_of_their_own() {
        let sides = across(&POINTS, &[[0, 1, 2], [1, 0, 2], [0, 1, 3], [1, 0, 3]]);
        assert_eq!(sides, [Some(3), Some(2), Some(1), Some(0)]);
    }

    #[test]
    fn a_crowded_edge_has_no_neighbours() {
        let many: Vec<[u32; 3]> = (0..9).map(|n| [0, 1, 2 + n % 4]).collect();
        assert_eq!(across(&POINTS, &many), [None; 9]);
    }
}
