//! Pairs of position and texture coordinate become vertices, each pair once to a part.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};

use super::paged_vec::{PagedVec, page_of};

/// No index.
pub(super) const NONE: u32 = u32::MAX;

/// Longest chain that is searched. Pairs whose position has more are looked up in a tree, so that
/// no file can make the search quadratic.
const LONGEST_SEARCH: u32 = 64;

/// The vertices, and those that use one position as a chain: OBJ indices are dense, so a list per
/// position takes the place of a hash map.
#[derive(Default)]
pub(super) struct VertexDeduplicator {
    /// Per position: its newest vertex that is in its chain, or [`NONE`].
    heads: Vec<u32>,
    vertices: PagedVec<Vertex>,
    /// What was not found within [`LONGEST_SEARCH`] vertices of its chain.
    beyond: BTreeMap<Pair, u32>,
}

/// A use of a position in a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Pair {
    /// The part's number.
    pub(super) part: u32,
    /// The position's number.
    pub(super) position: u32,
    /// The texture coordinate's number, or [`NONE`].
    pub(super) texcoord: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Vertex {
    pair: Pair,
    /// The next older one of its position, or [`NONE`].
    next: u32,
}

impl VertexDeduplicator {
    /// Makes room for that many positions.
    pub(super) fn grow(&mut self, positions: usize) {
        self.heads.resize(positions.max(self.heads.len()), NONE);
    }

    /// The number of a pair's vertex, whose position there is room for: the next one where it is
    /// new.
    #[inline]
    pub(super) fn vertex(&mut self, pair: Pair) -> u32 {
        let number = self.vertices.len() as u32;
        let head = self.heads[pair.position as usize];
        let mut at = head;
        let mut searched = 0;
        while let Some(vertex) = self.vertices.get(at as usize) {
            if vertex.pair.part == pair.part && vertex.pair.texcoord == pair.texcoord {
                return at;
            }
            at = vertex.next;
            searched += 1;
            if searched == LONGEST_SEARCH {
                let known = *self.beyond.entry(pair).or_insert(number);
                if known == number {
                    self.vertices.push(Vertex { pair, next: NONE });
                }
                return known;
            }
        }
        self.heads[pair.position as usize] = number;
        self.vertices.push(Vertex { pair, next: head });
        number
    }

    /// How many vertices there are in all parts.
    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }

    /// How many of `positions` positions no vertex uses.
    pub(super) fn unused(&self, positions: usize) -> u64 {
        let beyond = positions.saturating_sub(self.heads.len());
        (self.heads.iter().filter(|head| **head == NONE).count() + beyond) as u64
    }

    /// The vertices with their numbers within their parts, of which there are so many.
    pub(super) fn numbered(mut self, parts: usize) -> Numbered {
        let mut counts = vec![0; parts];
        for vertex in self.vertices.iter_mut() {
            let count = &mut counts[vertex.pair.part as usize];
            vertex.next = *count;
            *count += 1;
        }
        Numbered { vertices: self.vertices, counts }
    }
}

/// Vertices with their numbers within their parts.
pub(super) struct Numbered {
    /// What was a chain is the number.
    vertices: PagedVec<Vertex>,
    /// How many each part has.
    pub(super) counts: Vec<u32>,
}

impl Numbered {
    /// Within its part, of a vertex.
    #[inline]
    pub(super) fn number(&self, vertex: u32) -> u32 {
        self.vertices.get(vertex as usize).map_or(0, |vertex| vertex.next)
    }

    /// What the vertices are made of, in order.
    pub(super) fn pairs(&self) -> impl Iterator<Item = Pair> {
        self.vertices.iter().map(|vertex| vertex.pair)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }

    /// What a vertex is made of; those before it may go.
    pub(super) fn take(&mut self, vertex: usize) -> Option<Pair> {
        let page = page_of(vertex);
        if page > 0 && page_of(vertex - 1) < page {
            self.vertices.free(page - 1);
        }
        self.vertices.get(vertex).map(|vertex| vertex.pair)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_one_vertex_to_a_part() {
        let mut unifier = VertexDeduplicator::default();
        unifier.grow(3);
        let mut vertex =
            |part, position, texcoord| unifier.vertex(Pair { part, position, texcoord });
        assert_eq!([vertex(0, 1, 0), vertex(0, 1, 1), vertex(0, 1, 0)], [0, 1, 0]);
        assert_eq!([vertex(1, 1, 1), vertex(0, 0, NONE), vertex(0, 1, 1)], [2, 3, 1]);
        assert_eq!((unifier.unused(3), unifier.len()), (1, 4));
        let mut numbered = unifier.numbered(2);
        assert_eq!([0, 1, 2, 3].map(|vertex| numbered.number(vertex)), [0, 1, 0, 2]);
        assert_eq!(numbered.counts, [3, 1]);
        let pairs: Vec<Pair> = numbered.pairs().collect();
        assert_eq!(pairs[2], Pair { part: 1, position: 1, texcoord: 1 });
        assert_eq!(
            [0, 1, 2, 3].map(|vertex| numbered.take(vertex)),
            [0, 1, 2, 3].map(|at| pairs.get(at).copied())
        );
    }

    #[test]
    fn very_long_chains_stay_right() {
        let mut unifier = VertexDeduplicator::default();
        unifier.grow(1);
        for _ in 0..2 {
            for texcoord in 0..1000 {
                assert_eq!(unifier.vertex(Pair { part: 0, position: 0, texcoord }), texcoord);
            }
        }
        assert_eq!(unifier.len(), 1000);
    }
}
