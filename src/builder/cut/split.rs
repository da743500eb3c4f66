//! Cutting a chunk at a plane (thesis section 3.2, figure 3.2): triangles that cross are
//! re-triangulated at the plane, with the same new vertices on both sides.
//!
//! Every vertex is labelled below, above, or on the plane; only edges from below to above are
//! split. Any labelling gives two chunks that fit together without gap or overlap, since both get
//! the same vertices; that freedom is used three times:
//! - Small separate bodies are on one side with all their vertices ([`crate::builder::cut::uncut`]).
//! - A vertex so near the plane that a split edge would leave a sliver counts as on it.
//! - An edge that lies on an earlier cut is never split, since the neighbour across that cut would
//!   not know of the new vertex (a T-junction); its end nearer to the plane counts as on it.
//!
//! New vertices are computed from the edge's ends in an order that depends on the positions alone
//! and rounded to the lattice, so they are equal in every bit wherever the edge is met.

use std::borrow::Cow;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::chain::{BorderVertex, CutPlane, KeepRule};
use crate::builder::border::rank::SurfaceQuadric;
use crate::builder::border::vertex::{Border, Path};
use crate::builder::cut::uncut::WholeComponents;
use crate::lattice::Lattice;
use crate::mesh::{Coordinate, Mesh, Normal, PositionKey, all_differ, key, renumber, wide};

/// Limits of the labelling.
#[derive(Clone, Copy, Debug)]
pub struct CutTolerance {
    /// A crossing that would leave less than this share of an edge on one side is not made: the
    /// edge's end counts as on the plane. 0–0.5.
    pub sliver_share: f64,
    /// Nor one nearer to the edge's end than this many lattice steps.
    pub sliver_steps: f64,
}

impl Default for CutTolerance {
    fn default() -> Self {
        Self { sliver_share: 0.01, sliver_steps: 4.0 }
    }
}

/// A chunk of a block: its mesh, its borders and the planes that made them.
#[derive(Clone, Debug, Default)]
pub struct Chunk<C: Coordinate = f32> {
    /// The geometry.
    pub mesh: Mesh<C>,
    /// Which vertices are shared with neighbours.
    pub border: Border,
    /// The planes on the way here.
    pub path: Path<C>,
    /// Triangles between borders that touch ([`crate::builder::stitch`]), over the mesh's vertices:
    /// part of what is simplified, not of the source.
    pub stitches: Vec<[u32; 3]>,
    /// By how much cuts have moved each vertex off the surface, metres at most; `None` where that is
    /// too little to be followed.
    pub moved: Option<Vec<f32>>,
}

impl<C: Coordinate> Chunk<C> {
    /// The most that cuts have moved any vertex off the surface, metres.
    pub fn most_moved(&self) -> f64 {
        self.moved.iter().flatten().copied().fold(0.0, f32::max).into()
    }
}

/// Where and how to cut.
#[derive(Clone, Debug)]
pub struct Cut<'a, C> {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Metres from the block's origin; a multiple of the lattice step.
    pub coordinate: C,
    /// Where new vertices are rounded to; `None` while a file is divided, in f64.
    pub lattice: Option<Lattice>,
    /// See [`CutTolerance`].
    pub tolerance: CutTolerance,
    /// What is not cut but goes to one side.
    pub whole: WholeComponents,
    /// How many of the new border's vertices each level keeps.
    pub rule: &'a KeepRule<'a>,
}

const BELOW: i8 = -1;
const ON: i8 = 0;
const ABOVE: i8 = 1;

/// Cuts `chunk`; either side may be empty of triangles.
pub fn cut<C: Coordinate>(chunk: Chunk<C>, cut: &Cut<C>) -> (Chunk<C>, Chunk<C>) {
    let Chunk { mut mesh, mut border, path, mut stitches, mut moved } = chunk;
    // Behind the triangles from here on, on both sides too.
    let source = mesh.triangles.len();
    mesh.triangles.append(&mut stitches);
    let mut labels = label(&mesh, &border, cut);
    let halves = split(&mut mesh, source, &mut border, &mut labels, &mut moved, cut);
    let plane = Arc::new(make_plane(&mesh, &border, &labels, &halves, cut));
    let path_below = path.with(Arc::clone(&plane));
    let path_above = path_below.clone();
    let bit = path.len() as u32;
    let shared = shared_positions(&mesh, &labels, &halves);
    let side = |triangles: &[[u32; 3]], source: usize, path| {
        let apart = moved.is_some().then(|| without_collapsed(&mesh, &labels, triangles, source));
        let (triangles, source) = match apart.flatten() {
            Some((kept, source)) => (Cow::Owned(kept), source),
            None => (Cow::Borrowed(triangles), source),
        };
        let (mut mesh, border, used) =
            extract(&mesh, &border, &triangles, &labels, &shared, &plane, bit);
        let stitches = mesh.triangles.split_off(source);
        let of_side =
            |moved: &Vec<f32>| used.iter().map(|&vertex| moved[vertex as usize]).collect();
        let moved = moved.as_ref().map(of_side);
        Chunk { mesh, border, path, stitches, moved }
    };
    let [below, above] = halves.source;
    (side(&halves.below, below, path_below), side(&halves.above, above, path_above))
}

/// Triangles without those of which two corners meet, as rounded crossings may where rounding shows,
/// and how many of the first `source` are left; `None` where there are none such. Both sides may
/// drop them: of the edges of such a triangle one has no length, and the others are one. It stays
/// where a vertex beside the plane would be lost to the source.
fn without_collapsed<C: Coordinate>(
    mesh: &Mesh<C>,
    labels: &[i8],
    triangles: &[[u32; 3]],
    source: usize,
) -> Option<(Vec<[u32; 3]>, usize)> {
    let collapsed =
        |triangle: &[u32; 3]| !all_differ(triangle.map(|vertex| mesh.positions[vertex as usize]));
    if !triangles.iter().any(collapsed) {
        return None;
    }
    let (of_source, stitches) = triangles.split_at(source);
    let mut used = vec![false; mesh.positions.len()];
    for triangle in of_source.iter().filter(|triangle| !collapsed(triangle)) {
        triangle.iter().for_each(|&vertex| used[vertex as usize] = true);
    }
    let lost = |vertex: u32| labels[vertex as usize] != ON && !used[vertex as usize];
    let stays = |triangle: &&[u32; 3]| !collapsed(triangle) || triangle.iter().any(|&v| lost(v));
    let mut kept: Vec<[u32; 3]> = of_source.iter().filter(stays).copied().collect();
    let source = kept.len();
    kept.extend(stitches.iter().filter(|triangle| !collapsed(triangle)));
    Some((kept, source))
}

/// Triangles of the two sides, and the edges along which crossing triangles were split.
#[derive(Default)]
struct Halves {
    below: Vec<[u32; 3]>,
    above: Vec<[u32; 3]>,
    /// How many of `below` and `above` are of the source; stitches follow.
    source: [usize; 2],
    /// Of `below` and `above`, those triangles that have a corner on the plane.
    touching: [Vec<[u32; 3]>; 2],
    split_edges: Vec<[u32; 2]>,
}

impl Halves {
    fn push_below(&mut self, triangle: [u32; 3], touches: bool) {
        self.below.push(triangle);
        if touches {
            self.touching[0].push(triangle);
        }
    }

    fn push_above(&mut self, triangle: [u32; 3], touches: bool) {
        self.above.push(triangle);
        if touches {
            self.touching[1].push(triangle);
        }
    }

    fn push(&mut self, triangle: [u32; 3], side: i8) {
        if side == BELOW {
            self.push_below(triangle, true);
        } else {
            self.push_above(triangle, true);
        }
    }
}

fn label<C: Coordinate>(mesh: &Mesh<C>, border: &Border, cut: &Cut<C>) -> Vec<i8> {
    let distance =
        |vertex: u32| mesh.positions[vertex as usize][cut.axis].wide() - cut.coordinate.wide();
    let mut labels: Vec<i8> = mesh
        .positions
        .iter()
        .map(|position| {
            if position[cut.axis] < cut.coordinate {
                BELOW
            } else if position[cut.axis] > cut.coordinate {
                ABOVE
            } else {
                ON
            }
        })
        .collect();
    for (vertex, above) in cut.whole.sides(mesh, cut.axis, cut.coordinate) {
        labels[vertex as usize] = if above { ABOVE } else { BELOW };
    }
    let step = cut.lattice.map_or(0.0, |lattice| lattice.step);
    let nearest = cut.tolerance.sliver_steps * step;
    let mut marked: FxHashSet<PositionKey<C>> = FxHashSet::default();
    let mut widest = 0.0f64;
    for &[a, b, c] in &mesh.triangles {
        let [at_a, at_b, at_c] = [labels[a as usize], labels[b as usize], labels[c as usize]];
        if !(at_a.min(at_b).min(at_c) == BELOW && at_a.max(at_b).max(at_c) == ABOVE) {
            continue;
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if labels[from as usize] * labels[to as usize] >= 0 {
                continue;
            }
            let (near, far) = {
                let (from_distance, to_distance) = (distance(from).abs(), distance(to).abs());
                let from_first = from_distance
                    .total_cmp(&to_distance)
                    .then_with(|| order(mesh, from).cmp(&order(mesh, to)))
                    .is_le();
                if from_first { (from, to) } else { (to, from) }
            };
            let (near_distance, far_distance) = (distance(near).abs(), distance(far).abs());
            let on_earlier_cut = border.planes[from as usize] & border.planes[to as usize] != 0;
            let sliver = near_distance
                <= (cut.tolerance.sliver_share * (near_distance + far_distance)).max(nearest);
            if on_earlier_cut || sliver {
                marked.insert(key(mesh.positions[near as usize]));
                widest = widest.max(near_distance);
            }
        }
    }
    if !marked.is_empty() {
        for (vertex, label) in labels.iter_mut().enumerate() {
            if *label != ON
                && distance(vertex as u32).abs() <= widest
                && marked.contains(&key(mesh.positions[vertex]))
            {
                *label = ON;
            }
        }
    }
    labels
}

/// An order of positions that is the same wherever they are met.
fn order<C: Coordinate>(mesh: &Mesh<C>, vertex: u32) -> PositionKey<C> {
    key(mesh.positions[vertex as usize])
}

fn split<C: Coordinate>(
    mesh: &mut Mesh<C>,
    source: usize,
    border: &mut Border,
    labels: &mut Vec<i8>,
    moved: &mut Option<Vec<f32>>,
    cut: &Cut<C>,
) -> Halves {
    let triangles = std::mem::take(&mut mesh.triangles);
    let mut halves = Halves {
        below: Vec::with_capacity(triangles.len() / 2 + 64),
        above: Vec::with_capacity(triangles.len() / 2 + 64),
        ..Halves::default()
    };
    let mut made: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for (number, triangle) in triangles.into_iter().enumerate() {
        let [a, b, c] = triangle;
        let side = [labels[a as usize], labels[b as usize], labels[c as usize]];
        let (low, high) = (side[0].min(side[1]).min(side[2]), side[0].max(side[1]).max(side[2]));
        let (has_below, has_above) = (low == BELOW, high == ABOVE);
        match (has_below, has_above) {
            (true, false) => halves.push_below(triangle, high == ON),
            (false, true) => halves.push_above(triangle, low == ON),
            (false, false) => {
                let sum: f64 =
                    triangle.iter().map(|&v| mesh.positions[v as usize][cut.axis].wide()).sum();
                let low = sum / 3.0 < cut.coordinate.wide();
                halves.push(triangle, if low { BELOW } else { ABOVE });
            }
            (true, true) => {
                let mut crossing = |from: u32, to: u32| {
                    let edge = (from.min(to), from.max(to));
                    *made.entry(edge).or_insert_with(|| {
                        labels.push(ON);
                        border.planes.push(0);
                        border.keep.push(0);
                        push_crossing(mesh, moved, from, to, cut)
                    })
                };
                split_triangle(triangle, side, &mut crossing, &mut halves);
            }
        }
        if number < source {
            halves.source = [halves.below.len(), halves.above.len()];
        }
    }
    halves
}

/// Splits one triangle that has vertices on both sides.
fn split_triangle(
    triangle: [u32; 3],
    side: [i8; 3],
    crossing: &mut impl FnMut(u32, u32) -> u32,
    halves: &mut Halves,
) {
    // Turn the triangle so that its first vertex is on the plane or alone on its side.
    let first = (0..3)
        .find(|&i| side[i] == ON)
        .or_else(|| (0..3).find(|&i| side[i] != side[(i + 1) % 3] && side[i] != side[(i + 2) % 3]))
        .unwrap_or(0);
    let [a, b, c] = [triangle[first], triangle[(first + 1) % 3], triangle[(first + 2) % 3]];
    let [side_a, side_b] = [side[first], side[(first + 1) % 3]];
    if side_a == ON {
        let middle = crossing(b, c);
        halves.push([a, b, middle], side_b);
        halves.push([a, middle, c], -side_b);
        halves.split_edges.push([a, middle]);
    } else {
        let (to_b, to_c) = (crossing(a, b), crossing(a, c));
        halves.push([a, to_b, to_c], side_a);
        halves.push([to_b, b, c], -side_a);
        halves.push([to_b, c, to_c], -side_a);
        halves.split_edges.push([to_b, to_c]);
    }
}

/// Appends the vertex at which an edge crosses the plane.
fn push_crossing<C: Coordinate>(
    mesh: &mut Mesh<C>,
    moved: &mut Option<Vec<f32>>,
    from: u32,
    to: u32,
    cut: &Cut<C>,
) -> u32 {
    let (low, high) = if order(mesh, from) <= order(mesh, to) { (from, to) } else { (to, from) };
    let (low, high) = (low as usize, high as usize);
    let start = mesh.positions[low].map(C::wide);
    let end = mesh.positions[high].map(C::wide);
    let t = (cut.coordinate.wide() - start[cut.axis]) / (end[cut.axis] - start[cut.axis]);
    let index = mesh.positions.len() as u32;
    let exact = |i: usize| start[i] + (end[i] - start[i]) * t;
    let position: [C; 3] = std::array::from_fn(|i| {
        if i == cut.axis {
            cut.coordinate
        } else {
            let exact = exact(i);
            // Adding 0 turns -0 into 0.
            C::narrow(cut.lattice.map_or(exact, |lattice| lattice.round(exact)) + 0.0)
        }
    });
    if let Some(moved) = moved {
        let off: f64 = (0..3).map(|i| (position[i].wide() - exact(i)).powi(2)).sum::<f64>().sqrt();
        // The edge may be off the surface already: at its ends, and between them by what is between.
        let before = f64::from(moved[low]) * (1.0 - t) + f64::from(moved[high]) * t;
        moved.push(((before + off) as f32).next_up());
    }
    mesh.positions.push(position);
    if !mesh.texcoords.is_empty() {
        let (start, end) = (mesh.texcoords[low], mesh.texcoords[high]);
        mesh.texcoords.push(std::array::from_fn(|i| {
            (f64::from(start[i]) + (f64::from(end[i]) - f64::from(start[i])) * t) as f32
        }));
    }
    if !mesh.colors.is_empty() {
        let (start, end) = (mesh.colors[low], mesh.colors[high]);
        mesh.colors.push(std::array::from_fn(|i| {
            (f64::from(start[i]) + (f64::from(end[i]) - f64::from(start[i])) * t).round() as u16
        }));
    }
    if !mesh.normals.is_empty() {
        let ends = mesh.normals[low].vector().zip(mesh.normals[high].vector());
        let between = ends.map(|(start, end)| Normal::along(start.lerp(end, t)));
        mesh.normals.push(between.unwrap_or(Normal::NONE));
    }
    mesh.materials.push(mesh.materials[low]);
    index
}

/// Positions on the plane that triangles of both sides use.
fn shared_positions<C: Coordinate>(
    mesh: &Mesh<C>,
    labels: &[i8],
    halves: &Halves,
) -> FxHashSet<PositionKey<C>> {
    let on_plane = |triangles: &[[u32; 3]]| {
        let mut used: FxHashSet<PositionKey<C>> = FxHashSet::default();
        for triangle in triangles {
            for &vertex in triangle {
                if labels[vertex as usize] == ON {
                    used.insert(key(mesh.positions[vertex as usize]));
                }
            }
        }
        used
    };
    let below = on_plane(&halves.touching[0]);
    let mut shared = on_plane(&halves.touching[1]);
    shared.retain(|position| below.contains(position));
    shared
}

/// Collects the edges along which the two sides meet and ranks their vertices.
fn make_plane<C: Coordinate>(
    mesh: &Mesh<C>,
    border: &Border,
    labels: &[i8],
    halves: &Halves,
    cut: &Cut<C>,
) -> CutPlane<C> {
    let mut numbers: FxHashMap<PositionKey<C>, u32> = FxHashMap::default();
    let mut vertices: Vec<BorderVertex<C>> = Vec::new();
    let mut wedges: Vec<u32> = Vec::new();
    let mut number_of = |vertex: u32| {
        let position = mesh.positions[vertex as usize];
        let number = *numbers.entry(key(position)).or_insert_with(|| {
            vertices.push(BorderVertex {
                position,
                fixed: false,
                surface: SurfaceQuadric::default(),
                gone: false,
            });
            wedges.push(vertex);
            vertices.len() as u32 - 1
        });
        let entry = &mut vertices[number as usize];
        // Beside the plane, or on another border too.
        entry.fixed |= position[cut.axis] != cut.coordinate || border.planes[vertex as usize] != 0;
        number
    };
    const BOTH: u8 = 3;
    let mut sides: FxHashMap<[u32; 2], u8> = FxHashMap::default();
    for &[a, b] in &halves.split_edges {
        let (a, b) = (number_of(a), number_of(b));
        sides.insert([a.min(b), a.max(b)], BOTH);
    }
    for (triangles, side) in [(&halves.touching[0], 1u8), (&halves.touching[1], 2u8)] {
        for &[a, b, c] in triangles.iter() {
            let on = [a, b, c].map(|vertex| labels[vertex as usize] == ON);
            for (from, to, both) in
                [(a, b, on[0] && on[1]), (b, c, on[1] && on[2]), (c, a, on[2] && on[0])]
            {
                if both {
                    let (from, to) = (number_of(from), number_of(to));
                    if from != to {
                        *sides.entry([from.min(to), from.max(to)]).or_insert(0) |= side;
                    }
                }
            }
        }
    }
    let mut edges: Vec<[u32; 2]> =
        sides.iter().filter(|&(_, &side)| side == BOTH).map(|(&edge, _)| edge).collect();
    edges.sort_unstable();
    add_surroundings(&mut vertices, &numbers, &wedges, mesh, labels, halves, cut.rule);
    CutPlane::new(cut.axis, cut.coordinate, &vertices, &edges, cut.rule)
}

/// Adds to border vertices the planes of the triangles of both sides around them, and fixes those
/// that are on a seam of texture or material. Both sides' triangles count, also those that have only
/// a corner on the plane: a side that sees the seam alone would keep what the other does without.
fn add_surroundings<C: Coordinate>(
    vertices: &mut [BorderVertex<C>],
    numbers: &FxHashMap<PositionKey<C>, u32>,
    wedges: &[u32],
    mesh: &Mesh<C>,
    labels: &[i8],
    halves: &Halves,
    rule: &KeepRule,
) {
    for triangle in halves.touching.iter().flatten() {
        let corners = triangle.map(|vertex| wide(mesh.positions[vertex as usize]));
        for &vertex in triangle.iter().filter(|&&vertex| labels[vertex as usize] == ON) {
            let Some(&number) = numbers.get(&key(mesh.positions[vertex as usize])) else {
                continue;
            };
            let (entry, wedge) = (&mut vertices[number as usize], wedges[number as usize]);
            entry.surface.add_triangle(corners);
            let materials = [wedge, vertex].map(|vertex| mesh.materials[vertex as usize]);
            entry.fixed |= wedge != vertex && rule.keeps_seam(materials);
        }
    }
}

/// One side as a mesh of its own, and which vertices it has.
fn extract<C: Coordinate>(
    mesh: &Mesh<C>,
    border: &Border,
    triangles: &[[u32; 3]],
    labels: &[i8],
    shared: &FxHashSet<PositionKey<C>>,
    plane: &CutPlane<C>,
    bit: u32,
) -> (Mesh<C>, Border, Vec<u32>) {
    let (triangles, used) = renumber(triangles, mesh.positions.len());
    let mut side_border =
        Border { planes: Vec::with_capacity(used.len()), keep: Vec::with_capacity(used.len()) };
    for &vertex in &used {
        let old = vertex as usize;
        let (mut planes, mut keep) = (border.planes[old], border.keep[old]);
        if labels[old] == ON {
            let position = mesh.positions[old];
            if shared.contains(&key(position)) {
                if planes == 0 {
                    // A vertex that touches the other side without an edge stays for ever.
                    keep = plane.keep_level(position).unwrap_or(0);
                }
                planes |= 1 << bit;
            }
        }
        side_border.planes.push(planes);
        side_border.keep.push(keep);
    }
    (mesh.with_vertices(&used, triangles), side_border, used)
}

#[cfg(test)]
mod tests;
