//! When the last vertex has taken what it needs from a page.

use super::paged_vec::page_of;
use super::vertices::{NONE, Pair};

/// How many vertices to come use each page of positions and of texture coordinates.
#[derive(Default)]
pub(super) struct PageUses {
    positions: Vec<u32>,
    texcoords: Vec<u32>,
}

impl PageUses {
    pub fn of(pairs: impl Iterator<Item = Pair>) -> Self {
        let mut uses = Self::default();
        let add = |counts: &mut Vec<u32>, page: usize| {
            counts.resize(counts.len().max(page + 1), 0);
            counts[page] += 1;
        };
        for Pair { position, texcoord, .. } in pairs {
            add(&mut uses.positions, page_of(position as usize));
            if texcoord != NONE {
                add(&mut uses.texcoords, page_of(texcoord as usize));
            }
        }
        uses
    }

    /// The page of a vertex's position where it is the last that uses it.
    pub fn last_of_position(&mut self, pair: Pair) -> Option<usize> {
        last_of(&mut self.positions, pair.position)
    }

    /// The same of texture coordinates.
    pub fn last_of_texcoord(&mut self, pair: Pair) -> Option<usize> {
        last_of(&mut self.texcoords, pair.texcoord)
    }
}

fn last_of(counts: &mut [u32], index: u32) -> Option<usize> {
    let page = page_of(index as usize);
    let count = counts.get_mut(page)?;
    *count = count.saturating_sub(1);
    (*count == 0).then_some(page)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_go_with_their_last_use() {
        let far = 1 << 20;
        let pair = |position, texcoord| Pair { part: 0, position, texcoord };
        let pairs = [pair(0, NONE), pair(far, 0), pair(1, far)];
        let mut uses = PageUses::of(pairs.into_iter());
        let page = page_of(far as usize);
        assert_eq!(pairs.map(|pair| uses.last_of_position(pair)), [None, Some(page), Some(0)]);
        assert_eq!(pairs.map(|pair| uses.last_of_texcoord(pair)), [None, Some(0), Some(page)]);
    }
}
