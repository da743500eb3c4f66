//! The triangles of one chunk over its own list of vertices: what threads can do of joining the
//! chunks before their vertices get the numbers that they have in their parts.

use std::ops::Range;

use rustc_hash::FxHashMap;

use super::super::clean::CleanStats;
use super::super::paged_vec::PagedVec;
use super::super::vertices::{NONE, Pair, VertexDeduplicator};
use super::statements::Statements;
use crate::mesh::Triangulator;

/// Consecutive faces of one part.
pub(super) struct Run {
    pub(super) faces: Range<usize>,
    pub(super) part: u32,
    /// Its material has, or may yet turn out to have, a texture.
    pub(super) textured: bool,
    /// Its material has no texture, as far as is known.
    pub(super) lit: bool,
}

/// A chunk's triangles.
#[derive(Default)]
pub(super) struct Triangles {
    /// The vertices in the order of their first use.
    pub(super) vertices: Vec<Pair>,
    /// Indices into `vertices`, three for each triangle.
    pub(super) indices: Vec<u32>,
    /// By index, the normal's number, or [`NONE`]; empty where no lit face has one.
    pub(super) normals: Vec<u32>,
    /// Part of each run, where its indices end, and its faces without texture coordinates.
    pub(super) runs: Vec<(u32, usize, u64)>,
    pub(super) stats: CleanStats,
}

impl Triangles {
    /// Triangulates the faces of a chunk. `before` is how many positions, texture coordinates and
    /// normals come before it; `positions` are all up to its end, and every index is in range.
    pub(super) fn of(
        statements: &Statements,
        runs: &[Run],
        before: [usize; 3],
        positions: &PagedVec<[f64; 3]>,
    ) -> Self {
        let mut result =
            Self { indices: Vec::with_capacity(statements.corners.len()), ..Self::default() };
        let corners: Vec<[u32; 3]> = statements
            .corners
            .iter()
            .map(|[position, texcoord, normal]| {
                let position = position.resolve(before[0]).unwrap_or(0);
                let texcoord = texcoord.resolve(before[1]).unwrap_or(NONE);
                [position, texcoord, normal.resolve(before[2]).unwrap_or(NONE)]
            })
            .collect();
        let has_normals =
            runs.iter().any(|run| run.lit) && corners.iter().any(|[_, _, normal]| *normal != NONE);
        let places = Places::of(&corners);
        let mut unifier = VertexDeduplicator::default();
        unifier.grow(places.count());
        let mut triangulator = Triangulator::default();
        let mut outline = Vec::new();
        let mut first = 0;
        for run in runs {
            let mut bare_faces = 0;
            for &count in &statements.faces[run.faces.clone()] {
                let face = &corners[first..first + count as usize];
                first += count as usize;
                if run.textured {
                    bare_faces += u64::from(face.iter().any(|[_, texcoord, _]| *texcoord == NONE));
                }
                let mut add = |corner: usize| {
                    let [position, texcoord, normal] = face[corner];
                    let texcoord = if run.textured { texcoord } else { NONE };
                    let pair = Pair { part: run.part, position: places.number(position), texcoord };
                    let index = unifier.vertex(pair);
                    if index as usize == result.vertices.len() {
                        result.vertices.push(Pair { position, ..pair });
                    }
                    result.indices.push(index);
                    if has_normals {
                        result.normals.push(if run.lit { normal } else { NONE });
                    }
                };
                if face.len() == 3 {
                    (0..3).for_each(add);
                    continue;
                }
                outline.clear();
                outline.extend(
                    face.iter().filter_map(|&[position, ..]| positions.get(position as usize)),
                );
                if !outline.as_flattened().iter().all(|coordinate| coordinate.is_finite()) {
                    result.stats.not_finite += face.len() as u64 - 2;
                    continue;
                }
                let triangles = triangulator.triangulate(&outline);
                result.stats.flat_polygons += u64::from(triangles.is_empty());
                triangles.as_flattened().iter().for_each(|corner| add(*corner as usize));
            }
            result.runs.push((run.part, result.indices.len(), bare_faces));
        }
        result
    }
}

/// Small numbers for the positions that a chunk uses.
enum Places {
    /// Their distance from the lowest: nearly always the positions stand together.
    Dense { low: u32, count: usize },
    /// In the order of their first use.
    Sparse(FxHashMap<u32, u32>),
}

/// Positions are numbered by their distance where at most so many come to a corner.
const MOST_PER_CORNER: usize = 4;

impl Places {
    fn of(corners: &[[u32; 3]]) -> Self {
        let all = || corners.iter().map(|[position, ..]| *position);
        let (Some(low), Some(high)) = (all().min(), all().max()) else {
            return Self::Dense { low: 0, count: 0 };
        };
        let count = (high - low) as usize + 1;
        if count <= MOST_PER_CORNER * corners.len() {
            return Self::Dense { low, count };
        }
        let mut numbers = FxHashMap::default();
        for position in all() {
            let next = numbers.len() as u32;
            numbers.entry(position).or_insert(next);
        }
        Self::Sparse(numbers)
    }

    fn count(&self) -> usize {
        match self {
            Self::Dense { count, .. } => *count,
            Self::Sparse(numbers) => numbers.len(),
        }
    }

    #[inline]
    fn number(&self, position: u32) -> u32 {
        match self {
            Self::Dense { low, .. } => position - low,
            Self::Sparse(numbers) => numbers[&position],
        }
    }
}
