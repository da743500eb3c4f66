//! Pairs of position and texture coordinate become vertices, each pair once to a part.

use super::mtl::UvTransform;
use crate::mesh::Part;

/// No index.
pub(super) const NONE: u32 = u32::MAX;

/// Longest chain that is searched. A position that is used with more texture coordinates gets a
/// second vertex for the same pair instead: harmless, and no file can make the search quadratic.
const LONGEST_SEARCH: u32 = 64;

/// The vertices that use one position, as a chain: OBJ indices are dense, so a list per position
/// takes the place of a hash map.
#[derive(Default)]
pub(super) struct Unifier {
    /// Per position: its newest entry, or [`NONE`].
    heads: Vec<u32>,
    entries: Vec<Entry>,
}

struct Entry {
    part: u32,
    texcoord: u32,
    vertex: u32,
    next: u32,
}

/// The source's attributes by position and texture coordinate.
pub(super) struct Attributes<'a> {
    pub(super) positions: &'a [[f64; 3]],
    /// Empty, or one per position.
    pub(super) colors: &'a [[u16; 4]],
    /// As written, v upwards.
    pub(super) texcoords: &'a [[f64; 2]],
}

impl Unifier {
    /// The vertex of `part` (whose index is `part_index`) for `position` and `texcoord`
    /// ([`NONE`] where it has none), appended to the part where it is new.
    ///
    /// Both indices are in range. With a transform every vertex gets a texture coordinate.
    #[inline]
    pub(super) fn vertex(
        &mut self,
        part_index: u32,
        part: &mut Part,
        source: &Attributes,
        position: u32,
        texcoord: u32,
        transform: Option<&UvTransform>,
    ) -> u32 {
        if self.heads.len() < source.positions.len() {
            self.heads.resize(source.positions.len(), NONE);
        }
        let head = self.heads[position as usize];
        let mut at = head;
        for _ in 0..LONGEST_SEARCH {
            let Some(entry) = self.entries.get(at as usize) else { break };
            if entry.part == part_index && entry.texcoord == texcoord {
                return entry.vertex;
            }
            at = entry.next;
        }
        let vertex = part.positions.len() as u32;
        part.positions.push(source.positions[position as usize]);
        if let Some(color) = source.colors.get(position as usize) {
            part.colors.push(*color);
        }
        if let Some(transform) = transform {
            let given = source.texcoords.get(texcoord as usize);
            part.texcoords.push(given.map_or([0.0; 2], |uv| transform.apply(*uv)));
        }
        self.heads[position as usize] = self.entries.len() as u32;
        self.entries.push(Entry { part: part_index, texcoord, vertex, next: head });
        vertex
    }

    /// How many vertices there are in all parts.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
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
        let source = Attributes {
            positions: &[[0.0; 3], [1.0; 3], [2.0; 3]],
            colors: &[],
            texcoords: &[[0.0, 1.0], [0.5; 2]],
        };
        let (mut unifier, mut parts) = (Unifier::default(), [Part::default(), Part::default()]);
        let mut vertex = |part: usize, position, texcoord| {
            unifier.vertex(
                part as u32,
                &mut parts[part],
                &source,
                position,
                texcoord,
                Some(&UvTransform::default()),
            )
        };
        assert_eq!([vertex(0, 1, 0), vertex(0, 1, 1), vertex(0, 1, 0)], [0, 1, 0]);
        assert_eq!([vertex(1, 1, 1), vertex(0, 0, NONE), vertex(0, 1, 1)], [0, 2, 1]);
        assert_eq!(unifier.unused(3), 1);
        assert_eq!(parts[0].texcoords, [[0.0; 2], [0.5; 2], [0.0; 2]]);
    }

    #[test]
    fn very_long_chains_stay_right() {
        let texcoords: Vec<_> = (0..1000).map(|at| [f64::from(at), 1.0]).collect();
        let source = Attributes { positions: &[[0.0; 3]], colors: &[], texcoords: &texcoords };
        let (mut unifier, mut part) = (Unifier::default(), Part::default());
        for round in 0..2 {
            for texcoord in 0..1000 {
                let vertex = unifier.vertex(
                    0,
                    &mut part,
                    &source,
                    0,
                    texcoord,
                    Some(&UvTransform::default()),
                );
                assert_eq!(part.texcoords[vertex as usize], [texcoord as f32, 0.0], "{round}");
            }
        }
    }
}
