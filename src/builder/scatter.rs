//! The triangles of an input, shared out among the blocks that they meet.

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::builder::partition::{CellBox, KeptWhole, Others, Partition};
use crate::mesh::{Model, Part};

/// Triangles of an input that one block gets.
#[derive(Debug, Default)]
pub struct BlockParts {
    /// Triangles that are within the block, and those of bodies that are of it as a whole.
    pub inner: Vec<Part>,
    /// Triangles that cross or touch a side of the block: others have them too.
    pub crossing: Vec<Part>,
}

impl BlockParts {
    /// Returns whether there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.inner.is_empty() && self.crossing.is_empty()
    }

    /// Adds what it gets of another input.
    pub fn add(&mut self, other: Self) {
        self.inner.extend(other.inner);
        self.crossing.extend(other.crossing);
    }
}

/// Triangles of a part that one block gets.
#[derive(Default)]
struct Chosen {
    inner: Vec<u32>,
    crossing: Vec<u32>,
}

/// Distributes the triangles of a model to blocks. [`KeptWhole::new`] explains `most` and `others`.
pub fn scatter(
    model: Model,
    partition: &Partition,
    most: usize,
    others: &Others,
) -> FxHashMap<u32, BlockParts> {
    let mut blocks: FxHashMap<u32, BlockParts> = FxHashMap::default();
    if partition.cells().len() < 2 {
        let all = BlockParts { inner: model.parts, crossing: Vec::new() };
        blocks.extend((!all.is_empty()).then_some((0, all)));
        return blocks;
    }
    let bodies = KeptWhole::new(&model, partition, most, others);
    for (number, part) in model.parts.into_iter().enumerate() {
        let mut chosen: FxHashMap<u32, Chosen> = FxHashMap::default();
        for (triangle, corners) in part.indices.as_chunks::<3>().0.iter().enumerate() {
            let place = CellBox::around(corners.map(|vertex| part.positions[vertex as usize]));
            let at = triangle as u32;
            if let Some(block) = bodies.block_of(number, triangle) {
                chosen.entry(block).or_default().inner.push(at);
                continue;
            }
            partition.blocks_meeting(&place, &mut |block| {
                let chosen = chosen.entry(block).or_default();
                if partition.cell(block).place.holds_within(&place) {
                    chosen.inner.push(at);
                } else {
                    chosen.crossing.push(at);
                }
            });
        }
        let mut chosen: Vec<(u32, Chosen)> = chosen.into_iter().collect();
        chosen.sort_unstable_by_key(|(block, _)| *block);
        let extracted: Vec<(u32, BlockParts)> = chosen
            .into_par_iter()
            .map_init(
                || vec![u32::MAX; part.positions.len()],
                |numbers, (block, Chosen { inner, crossing })| {
                    let mut of = |triangles: &[u32]| {
                        (!triangles.is_empty()).then(|| extract(&part, triangles, numbers))
                    };
                    let inner = of(&inner).into_iter().collect();
                    let crossing = of(&crossing).into_iter().collect();
                    (block, BlockParts { inner, crossing })
                },
            )
            .collect();
        for (block, parts) in extracted {
            blocks.entry(block).or_default().add(parts);
        }
    }
    blocks
}

/// Some triangles of a part, with the vertices that they use. `numbers` has `u32::MAX` for each vertex of
/// the part, before and after.
fn extract(part: &Part, triangles: &[u32], numbers: &mut [u32]) -> Part {
    let mut own = Part { group: part.group, material: part.material, ..Part::default() };
    let mut used: Vec<u32> = Vec::new();
    own.indices.reserve_exact(3 * triangles.len());
    for &triangle in triangles {
        for &vertex in &part.indices[3 * triangle as usize..][..3] {
            let number = &mut numbers[vertex as usize];
            if *number == u32::MAX {
                *number = used.len() as u32;
                used.push(vertex);
            }
            own.indices.push(*number);
        }
    }
    fn pick<T: Copy>(values: &[T], used: &[u32]) -> Vec<T> {
        if values.is_empty() {
            return Vec::new();
        }
        used.iter().map(|&vertex| values[vertex as usize]).collect()
    }
    own.positions = pick(&part.positions, &used);
    own.texcoords = pick(&part.texcoords, &used);
    own.colors = pick(&part.colors, &used);
    own.normals = pick(&part.normals, &used);
    used.iter().for_each(|&vertex| numbers[vertex as usize] = u32::MAX);
    own
}
