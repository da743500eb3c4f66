//! The borders of a node above blocks.
//!
//! They are those of its blocks, as far as they lie in the planes that bound the node. What the nodes
//! below still have of them is ranked anew, for the node and nothing else, by what the source's triangles
//! on both sides are worth there. So the nodes on both sides of a plane thin their borders alike; and
//! skirts reach to the source's border, as everywhere.

use std::collections::{BTreeMap, BTreeSet};

use rustc_hash::FxHashSet;

use crate::builder::border::chain::{BorderVertex, CutPlane, KeepRule};
use crate::builder::cut::face::FaceVertex;
use crate::builder::cut::record::{RecordedBorder, RecordedFace};
use crate::builder::partition::CellBox;
use crate::lattice::Lattice;
use crate::mesh::{PositionKey, key};

/// The borders of two cells as those of the cell that they are the halves of.
pub fn joined(one: RecordedBorder, other: RecordedBorder, place: &CellBox) -> RecordedBorder {
    let mut faces: Vec<RecordedFace> = Vec::new();
    for face in one.faces.into_iter().chain(other.faces) {
        let is_outside = [false, true].map(|upper| place.side(face.axis, upper)).contains(&face.at);
        if !is_outside {
            continue;
        }
        let same = |known: &&mut RecordedFace| (known.axis, known.at) == (face.axis, face.at);
        match faces.iter_mut().find(same) {
            Some(known) => {
                let first = known.vertices.len() as u32;
                known.vertices.extend(face.vertices);
                known.edges.extend(face.edges.into_iter().map(|edge| edge.map(|end| first + end)));
            }
            None => faces.push(face),
        }
    }
    faces.sort_by(|a, b| a.axis.cmp(&b.axis).then(a.at.total_cmp(&b.at)));
    RecordedBorder { faces }
}

/// The planes of a node's borders on its lattice; `there` is where the nodes below have vertices.
pub fn planes(
    border: &RecordedBorder,
    there: &FxHashSet<PositionKey<f64>>,
    lattice: Lattice,
    rule: &KeepRule,
) -> Vec<CutPlane<f64>> {
    border.faces.iter().map(|face| plane(face, border, there, lattice, rule)).collect()
}

fn plane(
    face: &RecordedFace,
    border: &RecordedBorder,
    there: &FxHashSet<PositionKey<f64>>,
    lattice: Lattice,
    rule: &KeepRule,
) -> CutPlane<f64> {
    let at = lattice.round(face.at) + 0.0;
    let rounded = |vertex: &FaceVertex| vertex.position.map(|c| lattice.round(c) + 0.0);
    let mut numbers: BTreeMap<PositionKey<f64>, u32> =
        face.vertices.iter().map(|vertex| (key(rounded(vertex)), 0)).collect();
    numbers.values_mut().zip(0..).for_each(|(number, next)| *number = next);
    let number_of = |vertex: u32| numbers[&key(rounded(&face.vertices[vertex as usize]))];
    let mut vertices: Vec<Option<BorderVertex<f64>>> = vec![None; numbers.len()];
    let is_on_other = |position: [f64; 3]| {
        let mut others = border.faces.iter().filter(|other| other.axis != face.axis);
        others.any(|other| position[other.axis] == lattice.round(other.at))
    };
    for (number, vertex) in (0u32..).zip(&face.vertices) {
        let position = rounded(vertex);
        vertices[number_of(number) as usize].get_or_insert_with(|| BorderVertex {
            position,
            fixed: is_on_other(position),
            surface: vertex.surface,
            gone: !there.contains(&key(position)),
        });
    }
    let vertices: Vec<BorderVertex<f64>> = vertices.into_iter().flatten().collect();
    let edges: BTreeSet<[u32; 2]> = face
        .edges
        .iter()
        .map(|edge| edge.map(number_of))
        .filter(|[a, b]| a != b)
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    let edges: Vec<[u32; 2]> = edges.into_iter().collect();
    CutPlane::new(face.axis, at, &vertices, &edges, rule)
}
