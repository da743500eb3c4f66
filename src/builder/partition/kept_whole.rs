//! Bodies that no plane between blocks divides.
//!
//! A house that a plane cuts in two costs both halves a border, which every level keeps part of, and
//! skirts along it. So a separate body that is small beside its block is of the block that has its
//! middle, with all its triangles. Which it is follows from the body and the partition alone: each
//! block finds out by itself, and all agree.

use std::collections::BTreeSet;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::{CellBox, Cluster, Partition};
use crate::mesh::box_tree::BoxTree;
use crate::mesh::{DisjointSet, Model, PositionKey, key};

/// The block that has all of a triangle's body; `NONE` where planes divide it.
pub struct KeptWhole {
    /// Block number by part and triangle; empty if no component crosses a plane.
    blocks: Vec<Vec<u32>>,
}

/// Marks that there is no block.
const NONE: u32 = u32::MAX;

/// Facts of a component.
#[derive(Clone, Copy)]
struct Body {
    place: CellBox,
    triangles: usize,
    block: u32,
}

impl KeptWhole {
    /// The bodies of a model, its triangles connected where they share positions. None with more than
    /// `most` triangles stays whole, and none that may go on where it is open, in what `others` have.
    pub fn new(model: &Model, partition: &Partition, most: usize, others: &Others) -> Self {
        if partition.cells().len() < 2 {
            return Self { blocks: Vec::new() };
        }
        let vertices: usize = model.parts.iter().map(|part| part.positions.len()).sum();
        let mut sets = DisjointSet::new(vertices);
        join_places(model, &mut sets);
        let mut first = 0u32;
        for part in &model.parts {
            for &[a, b, c] in part.indices.as_chunks::<3>().0 {
                sets.join(first + a, first + b);
                sets.join(first + a, first + c);
            }
            first += part.positions.len() as u32;
        }
        let mut bodies: FxHashMap<u32, Body> = FxHashMap::default();
        let mut first = 0u32;
        for part in &model.parts {
            for corners in part.indices.as_chunks::<3>().0 {
                let own = CellBox::around(corners.map(|vertex| part.positions[vertex as usize]));
                let new = Body { place: own, triangles: 0, block: NONE };
                let body = bodies.entry(sets.root(first + corners[0])).or_insert(new);
                body.triangles += 1;
                body.place = body.place.and(&own);
            }
            first += part.positions.len() as u32;
        }
        for body in bodies.values_mut() {
            body.block = block_of(body, partition, most);
        }
        if !others.is_empty() {
            for root in open_in(model, &mut sets, &bodies, partition, others) {
                bodies.entry(root).and_modify(|body| body.block = NONE);
            }
        }
        let mut first = 0u32;
        let mut blocks = Vec::with_capacity(model.parts.len());
        for part in &model.parts {
            let corners = part.indices.as_chunks::<3>().0.iter();
            let block = |corners: &[u32; 3]| {
                bodies.get(&sets.root(first + corners[0])).map_or(NONE, |body| body.block)
            };
            blocks.push(corners.map(block).collect());
            first += part.positions.len() as u32;
        }
        Self { blocks }
    }

    /// The block that has all of the body of a triangle of a part, if one has.
    pub fn block_of(&self, part: usize, triangle: usize) -> Option<u32> {
        let block = *self.blocks.get(part)?.get(triangle)?;
        (block != NONE).then_some(block)
    }
}

/// Makes one set of all vertices at one position, numbered through all parts. They are sorted: a hash map of
/// them would take more memory than the model.
fn join_places(model: &Model, sets: &mut DisjointSet) {
    let mut firsts = Vec::with_capacity(model.parts.len());
    let mut vertices: Vec<[u32; 2]> = Vec::with_capacity(sets.len());
    let mut first = 0u32;
    for (number, part) in (0..).zip(&model.parts) {
        firsts.push(first);
        first += part.positions.len() as u32;
        vertices.extend((0..part.positions.len() as u32).map(|vertex| [number, vertex]));
    }
    let place =
        |[part, vertex]: [u32; 2]| key(model.parts[part as usize].positions[vertex as usize]);
    vertices.par_sort_unstable_by_key(|&vertex| place(vertex));
    let number = |[part, vertex]: [u32; 2]| firsts[part as usize] + vertex;
    for pair in vertices.windows(2) {
        if place(pair[0]) == place(pair[1]) {
            sets.join(number(pair[0]), number(pair[1]));
        }
    }
}

/// Finds components that cross a plane and have open edges near another input. They may continue in it,
/// so they are not kept whole.
fn open_in(
    model: &Model,
    sets: &mut DisjointSet,
    bodies: &FxHashMap<u32, Body>,
    partition: &Partition,
    others: &Others,
) -> BTreeSet<u32> {
    let crossed = |body: &Body| {
        body.block != NONE && !partition.cell(body.block).place.holds_within(&body.place)
    };
    // Component by edge, and whether an odd number of triangles has the edge.
    let mut edges: FxHashMap<[PositionKey<f64>; 2], (u32, bool, [[f64; 3]; 2])> =
        FxHashMap::default();
    let mut first = 0u32;
    for part in &model.parts {
        for &[a, b, c] in part.indices.as_chunks::<3>().0 {
            let root = sets.root(first + a);
            if !bodies.get(&root).is_some_and(crossed) {
                continue;
            }
            for [from, to] in [[a, b], [b, c], [c, a]] {
                let ends = [from, to].map(|vertex| part.positions[vertex as usize]);
                let [one, other] = ends.map(key);
                let edge = edges.entry([one.min(other), one.max(other)]);
                let (_, is_open, _) = edge.or_insert((root, false, ends));
                *is_open = !*is_open;
            }
        }
        first += part.positions.len() as u32;
    }
    let open = edges.into_values().filter(|(_, is_open, _)| *is_open);
    open.filter(|(_, _, ends)| ends.iter().any(|end| others.may_have(end)))
        .map(|(root, ..)| root)
        .collect()
}

/// Surfaces of two inputs may be one that are no farther apart than this share of a triangle's size.
const NEAR: f64 = 0.01;

/// Other inputs may have triangles in these boxes.
#[derive(Default)]
pub struct Others {
    boxes: Option<BoxTree>,
}

impl Others {
    /// Surfaces of other inputs may be one with those of a cluster in this box.
    pub fn around(cluster: &Cluster) -> CellBox {
        cluster.around.larger(NEAR * cluster.largest)
    }

    /// Takes all clusters of other inputs.
    pub fn new<'a>(clusters: impl Iterator<Item = &'a Cluster>) -> Self {
        let boxes: Vec<_> = clusters.map(|cluster| Self::around(cluster).corners()).collect();
        Self { boxes: (!boxes.is_empty()).then(|| BoxTree::new(boxes)) }
    }

    fn is_empty(&self) -> bool {
        self.boxes.is_none()
    }

    fn may_have(&self, place: &[f64; 3]) -> bool {
        let holds = |&[low, high]: &[[f64; 3]; 2]| {
            (0..3).all(|axis| low[axis] <= place[axis] && place[axis] <= high[axis])
        };
        self.boxes.as_ref().is_some_and(|boxes| boxes.matching(holds).next().is_some())
    }
}

/// The block of a body that stays whole; `NONE` where it does not.
fn block_of(body: &Body, partition: &Partition, most: usize) -> u32 {
    if body.triangles > most {
        return NONE;
    }
    let block = partition.block_at(body.place.middle());
    if body.place.longest() <= partition.cell(block).body_size() { block } else { NONE }
}
