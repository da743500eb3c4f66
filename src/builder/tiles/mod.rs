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
use std::path::PathBuf;

use self::border::InputBorder;
use self::meeting::{Share, shares};
use self::rim::{BoundingBox, Rim, come_near};
use crate::Result;
use crate::builder::inputs::text_of;
use crate::builder::options::BuildOptions;
use crate::mesh::{Model, NEAR};

/// The inputs of a build, and which of them may touch.
pub struct Tiles<'a> {
    inputs: &'a [PathBuf],
    options: &'a BuildOptions,
    boxes: Vec<BoundingBox>,
    neighbours: Vec<Vec<usize>>,
    rims: BTreeMap<usize, Rim>,
}

impl<'a> Tiles<'a> {
    /// Of inputs with all their vertices in these boxes, as files have them.
    pub fn new(inputs: &'a [PathBuf], boxes: Vec<BoundingBox>, options: &'a BuildOptions) -> Self {
        let near = match options.placement.is_degrees() {
            // Of the Earth's meridian.
            true => reach(options) / 1e5,
            false => reach(options),
        };
        let neighbours = |(at, own): (usize, &BoundingBox)| {
            let is_neighbour = |other: &usize| *other != at && come_near(own, &boxes[*other], near);
            (0..boxes.len()).filter(is_neighbour).collect()
        };
        let neighbours = boxes.iter().enumerate().map(neighbours).collect();
        Self { inputs, options, boxes, neighbours, rims: BTreeMap::new() }
    }

    /// The inputs that one may touch.
    pub fn neighbours(&self, input: usize) -> &[usize] {
        &self.neighbours[input]
    }

    /// Makes sure that the borders of some inputs can be told. `read` reads an input, and gives what it is told of
    /// its model as it is built.
    pub fn read_rims(
        &mut self,
        of: impl Iterator<Item = usize>,
        mut read: impl FnMut(usize, &dyn Fn(&Model) -> Rim) -> Result<Rim>,
    ) -> Result<()> {
        let with_neighbours = of.filter(|&input| !self.neighbours[input].is_empty());
        let wanted: BTreeSet<usize> = with_neighbours
            .flat_map(|input| self.neighbours[input].iter().copied().chain([input]))
            .collect();
        let everywhere = [[f64::NEG_INFINITY; 3], [f64::INFINITY; 3]];
        for input in wanted {
            if self.rims.contains_key(&input) {
                continue;
            }
            let others: Vec<BoundingBox> = match self.options.placement.is_degrees() {
                true => vec![everywhere],
                false => self.neighbours[input].iter().map(|&other| self.boxes[other]).collect(),
            };
            let rim = |model: &Model| Rim::new(model, &others, reach(self.options), self.options);
            let rim = read(input, &rim)?;
            self.rims.insert(input, rim);
        }
        Ok(())
    }

    /// The border of an input whose rim and whose neighbours' rims were read.
    pub fn border(&self, input: usize) -> InputBorder {
        let mut border = InputBorder::new(self.boxes[input]);
        for &other in &self.neighbours[input] {
            let share = self.share(input, other);
            if !share.is_empty() {
                border.add(text_of(&self.inputs[other]), share);
            }
        }
        border
    }

    /// What an input has in common with another.
    fn share(&self, input: usize, other: usize) -> Share {
        let both = [input.min(other), input.max(other)];
        let [Some(first), Some(second)] = both.map(|at| self.rims.get(&at)) else {
            return Share::default();
        };
        let near_other = &self.neighbours[other];
        let thirds = self.neighbours[input].iter().filter(|third| near_other.contains(third));
        let thirds: Vec<&Rim> = thirds.filter_map(|third| self.rims.get(third)).collect();
        let constants = self.options.hierarchy.constants.border;
        let [of_first, of_second] = shares([first, second], &thirds, constants);
        if input < other { of_first } else { of_second }
    }
}

/// How far vertices of inputs that touch may be apart, metres.
fn reach(options: &BuildOptions) -> f64 {
    NEAR + options.quantization().map_or(0.0, |quantization| 2.0 * quantization.bound())
}
