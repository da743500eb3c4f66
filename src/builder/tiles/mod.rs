//! Inputs that touch: tiles of a scan, a city exported in squares.
//!
//! Each input is built on its own, so that one is in memory at a time, and one that changes is built again
//! alone. What it must know of others is where they meet: [`rim`] says where an input ends, [`meeting`]
//! what two of them have in common there and how it thins, alike on both sides. [`border`] is what an
//! input's blocks are given. Which may meet their boxes say ([`mod@boxes`]).

pub mod border;
pub mod boxes;
pub mod meeting;
pub mod rim;

use std::collections::{BTreeMap, BTreeSet};
use std::hash::Hasher;
use std::path::PathBuf;

use rustc_hash::FxHasher;

use self::border::InputBorder;
use self::meeting::{Share, shares};
use self::rim::{BoundingBox, Rim, come_near, is_within};
use crate::Result;
use crate::builder::inputs::text_of;
use crate::builder::options::BuildOptions;
use crate::mesh::box_tree::BoxTree;
use crate::mesh::{Model, NEAR};

/// The inputs of a build, and which of them may touch: those whose boxes come near each other.
pub struct Tiles<'a> {
    inputs: &'a [PathBuf],
    options: &'a BuildOptions,
    boxes: Vec<BoundingBox>,
    /// How near boxes of inputs that may touch come to each other, in the units of files.
    near: f64,
    tree: BoxTree,
    rims: BTreeMap<usize, Rim>,
    /// Of each rim, the others that have a vertex near one of its own.
    touching: BTreeMap<usize, BTreeSet<usize>>,
}

/// Some of the inputs, found by where they are.
struct Chosen {
    inputs: Vec<usize>,
    tree: BoxTree,
}

impl<'a> Tiles<'a> {
    /// Of inputs with all their vertices in these boxes, as files have them.
    pub fn new(inputs: &'a [PathBuf], boxes: Vec<BoundingBox>, options: &'a BuildOptions) -> Self {
        let near = match options.placement.is_degrees() {
            // Of the Earth's meridian.
            true => reach(options) / 1e5,
            false => reach(options),
        };
        let tree = BoxTree::new(boxes.clone());
        let (rims, touching) = Default::default();
        Self { inputs, options, boxes, near, tree, rims, touching }
    }

    /// Whether two inputs may touch.
    pub fn are_neighbours(&self, input: usize, other: usize) -> bool {
        input != other && come_near(&self.boxes[input], &self.boxes[other], self.near)
    }

    /// The inputs that may touch one of those `chosen`, which is another.
    pub fn neighbours_of(&self, chosen: impl Iterator<Item = usize>) -> BTreeSet<usize> {
        let inputs: Vec<usize> = chosen.collect();
        let tree = BoxTree::new(inputs.iter().map(|&input| self.boxes[input]).collect());
        let chosen = Chosen { inputs, tree };
        (0..self.boxes.len()).filter(|&input| self.has_neighbour(input, &chosen)).collect()
    }

    fn has_neighbour(&self, input: usize, Chosen { inputs, tree }: &Chosen) -> bool {
        let comes_near = |other: &BoundingBox| come_near(&self.boxes[input], other, self.near);
        tree.matching(comes_near).any(|number| inputs[number] != input)
    }

    /// Makes sure that the borders of some inputs can be told. `read` reads an input, and gives what it is told of
    /// its model as it is built.
    pub fn read_rims(
        &mut self,
        of: &BTreeSet<usize>,
        mut read: impl FnMut(usize, &dyn Fn(&Model) -> Rim) -> Result<Rim>,
    ) -> Result<()> {
        let with_neighbours = self.neighbours_of(0..self.boxes.len());
        let mut wanted = self.neighbours_of(of.iter().copied());
        wanted.extend(with_neighbours.intersection(of));
        for input in wanted {
            if self.rims.contains_key(&input) {
                continue;
            }
            let distance = reach(self.options);
            let is_near = |edge: &BoundingBox| {
                let may_be_near = |other: &BoundingBox| is_within(edge, other, distance);
                self.options.placement.is_degrees()
                    || self.tree.matching(may_be_near).any(|other| other != input)
            };
            let rim = |model: &Model| Rim::new(model, is_near, self.options);
            let rim = read(input, &rim)?;
            self.rims.insert(input, rim);
        }
        self.touching = touching(&self.rims);
        Ok(())
    }

    /// The border of an input whose rim and whose neighbours' rims were read.
    pub fn border(&self, input: usize) -> InputBorder {
        let mut border = InputBorder::new(self.boxes[input]);
        for other in self.touching(input).filter(|&other| self.are_neighbours(input, other)) {
            let share = self.share(input, other);
            if !share.is_empty() {
                border.add(text_of(&self.inputs[other]), share);
            }
        }
        border
    }

    fn touching(&self, input: usize) -> impl Iterator<Item = usize> {
        self.touching.get(&input).into_iter().flatten().copied()
    }

    /// What an input has in common with another.
    fn share(&self, input: usize, other: usize) -> Share {
        let both = [input.min(other), input.max(other)];
        let [Some(first), Some(second)] = both.map(|at| self.rims.get(&at)) else {
            return Share::default();
        };
        let thirds: BTreeSet<usize> = self.touching(input).chain(self.touching(other)).collect();
        let is_neighbour = |third: &&usize| both.iter().all(|&at| self.are_neighbours(at, **third));
        let thirds = thirds.iter().filter(is_neighbour);
        let thirds: Vec<&Rim> = thirds.filter_map(|third| self.rims.get(third)).collect();
        let constants = self.options.hierarchy.constants.border;
        let [of_first, of_second] = shares([first, second], &thirds, constants);
        if input < other { of_first } else { of_second }
    }
}

/// Side of the cells by which [`touching`] vertices are found, in [`NEAR`]: most are in one.
const CELL: f64 = 64.0;

/// Of each rim, the others that have a vertex within [`NEAR`] of one of its own, and some that
/// have one not much farther.
fn touching(rims: &BTreeMap<usize, Rim>) -> BTreeMap<usize, BTreeSet<usize>> {
    // Hashes of cells, each with an input that has a vertex there.
    let mut users: Vec<(u64, usize)> = Vec::new();
    for (&input, rim) in rims {
        let mut cells: Vec<u64> =
            rim.edges.iter().flat_map(|edge| edge.ends).flat_map(cells_near).collect();
        cells.sort_unstable();
        cells.dedup();
        users.extend(cells.into_iter().map(|cell| (cell, input)));
    }
    users.sort_unstable();
    let mut touching: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    for in_cell in users.chunk_by(|(one, _), (other, _)| one == other) {
        for &(_, one) in in_cell {
            let others = in_cell.iter().map(|&(_, other)| other).filter(|&other| other != one);
            touching.entry(one).or_default().extend(others);
        }
    }
    touching
}

/// The cells that a cube of the side [`NEAR`], and a little more, around a vertex reaches into, by
/// hash; some more than once. Cubes around vertices within [`NEAR`] of each other overlap.
fn cells_near(vertex: [f64; 3]) -> impl Iterator<Item = u64> {
    let side = CELL * NEAR;
    let [low, high] =
        [-0.51, 0.51].map(|by| vertex.map(|at| ((at + by * NEAR) / side).floor() as i64));
    (0..8).map(move |corner| {
        let mut hasher = FxHasher::default();
        (0..3).for_each(|axis| hasher.write_i64([low, high][corner >> axis & 1][axis]));
        hasher.finish()
    })
}

/// How far vertices of inputs that touch may be apart, metres.
fn reach(options: &BuildOptions) -> f64 {
    NEAR + options.quantization().map_or(0.0, |quantization| 2.0 * quantization.bound())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::stitch::OpenEdge;
    use crate::mesh::wide;
    use crate::random::Random;
    use crate::scaling::assert_scales;

    /// A rim with edges from each of some vertices.
    fn rim(vertices: &[[f64; 3]]) -> Rim {
        let edge =
            |pair: &[[f64; 3]]| OpenEdge { part: 0, ends: [pair[0], pair[1]], corner: [0.0; 3] };
        let edges = vertices.windows(2).map(edge).collect();
        Rim { bounds: [[0.0; 3]; 2], edges, keeps: Vec::new() }
    }

    #[test]
    fn inputs_with_vertices_near_each_other_touch() {
        let mut random = Random::new(2, 0);
        let mut vertex = || [0; 3].map(|_| (random.unit() * 10.0 - 5.0) * NEAR);
        let rims: BTreeMap<usize, Vec<[f64; 3]>> =
            (0..30).map(|input| (input, (0..4).map(|_| vertex()).collect())).collect();
        let found = touching(&rims.iter().map(|(&input, of)| (input, rim(of))).collect());
        let mut near = 0;
        for (one, of_one) in &rims {
            for (other, of_other) in rims.iter().filter(|(other, _)| *other != one) {
                let is_near =
                    |a: &[f64; 3]| of_other.iter().any(|b| wide(*a).distance(wide(*b)) <= NEAR);
                if of_one.iter().any(is_near) {
                    near += 1;
                    assert!(found[one].contains(other), "{one} {other}");
                }
            }
        }
        assert!(near > 20, "{near}");
        let far = [rim(&[[0.0; 3], [9.0, 0.0, 0.0]]), rim(&[[0.0, 1.0, 0.0], [9.0, 1.0, 0.0]])];
        assert!(touching(&far.into_iter().enumerate().collect()).values().all(BTreeSet::is_empty));
    }

    #[test]
    fn time_scales_with_the_number_of_inputs() {
        // Rows of tiles whose boxes all meet, each with a vertex in common with the next.
        let rims = |count: usize| -> BTreeMap<usize, Rim> {
            let at = |input: usize| [input as f64, 0.0, 0.0];
            (0..count).map(|input| (input, rim(&[at(input), at(input + 1)]))).collect()
        };
        assert_scales(1000, rims, |rims| {
            assert!(touching(&rims).values().all(|others| others.len() <= 2));
        });
        let options = BuildOptions::default();
        assert_scales(
            1000,
            |count| vec![PathBuf::new(); count],
            |inputs| {
                let square = |at: usize| {
                    let low = [(at % 100) as f64, (at / 100) as f64, 0.0];
                    [low, low.map(|side| side + 1.0)]
                };
                let boxes = (0..inputs.len()).map(square).collect();
                let tiles = Tiles::new(&inputs, boxes, &options);
                assert_eq!(tiles.neighbours_of(0..inputs.len()).len(), inputs.len());
            },
        );
    }
}
