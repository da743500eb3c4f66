//! Pairs of position and texture coordinate become vertices, each pair once to a part.

use std::collections::BTreeMap;

/// No index.
pub(super) const NONE: u32 = u32::MAX;

/// Longest chain that is searched. Pairs whose position has more are looked up in a tree, so that
/// no file can make the search quadratic.
const LONGEST_SEARCH: u32 = 64;

/// The vertices that use one position, as a chain: OBJ indices are dense, so a list per position
/// takes the place of a hash map.
#[derive(Default)]
pub(super) struct Unifier {
    /// Per position: its newest entry, or [`NONE`].
    heads: Vec<u32>,
    entries: Vec<Entry>,
    /// What was not found within [`LONGEST_SEARCH`] entries of its chain.
    beyond: BTreeMap<Pair, u32>,
}

/// A use of a position in a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Pair {
    /// The part's number.
    pub(super) part: u32,
    /// The position's number.
    pub(super) position: u32,
    /// The texture coordinate's number, or [`NONE`].
    pub(super) texcoord: u32,
}

struct Entry {
    part: u32,
    texcoord: u32,
    vertex: u32,
    next: u32,
}

impl Unifier {
    /// Makes room for that many positions.
    pub(super) fn grow(&mut self, positions: usize) {
        self.heads.resize(positions.max(self.heads.len()), NONE);
    }

    /// The vertex of a pair, whose position there is room for; `make` makes it where it is new.
    #[inline]
    pub(super) fn vertex(&mut self, pair: Pair, make: impl FnOnce() -> u32) -> u32 {
        let head = self.heads[pair.position as usize];
        let mut at = head;
        let mut searched = 0;
        while let Some(entry) = self.entries.get(at as usize) {
            if entry.part == pair.part && entry.texcoord == pair.texcoord {
                return entry.vertex;
            }
            at = entry.next;
            searched += 1;
            if searched == LONGEST_SEARCH {
                return *self.beyond.entry(pair).or_insert_with(make);
            }
        }
        let vertex = make();
        self.heads[pair.position as usize] = self.entries.len() as u32;
        let Pair { part, texcoord, .. } = pair;
        self.entries.push(Entry { part, texcoord, vertex, next: head });
        vertex
    }

    /// How many pairs there are in all parts.
    pub(super) fn len(&self) -> usize {
        self.entries.len() + self.beyond.len()
    }

    /// How many of `positions` positions no vertex uses.
    pub(super) fn unused(&self, positions: usize) -> u64 {
        let beyond = positions.saturating_sub(self.heads.len());
        (self.heads.iter().filter(|head| **head == NONE).count() + beyond) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pair_is_one_vertex_to_a_part() {
        let (mut unifier, mut made) = (Unifier::default(), [0, 0]);
        unifier.grow(3);
        let mut vertex = |part: usize, position, texcoord| {
            unifier.vertex(Pair { part: part as u32, position, texcoord }, || {
                made[part] += 1;
                made[part] - 1
            })
        };
        assert_eq!([vertex(0, 1, 0), vertex(0, 1, 1), vertex(0, 1, 0)], [0, 1, 0]);
        assert_eq!([vertex(1, 1, 1), vertex(0, 0, NONE), vertex(0, 1, 1)], [0, 2, 1]);
        assert_eq!((unifier.unused(3), unifier.len()), (1, 4));
    }

    #[test]
    fn very_long_chains_stay_right() {
        let mut unifier = Unifier::default();
        unifier.grow(1);
        let mut made = 0;
        for _ in 0..2 {
            for texcoord in 0..1000 {
                let vertex = unifier.vertex(Pair { part: 0, position: 0, texcoord }, || {
                    made += 1;
                    made - 1
                });
                assert_eq!(vertex, texcoord);
            }
        }
        assert_eq!((made, unifier.len()), (1000, 1000));
    }
}
