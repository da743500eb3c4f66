//! Vertex colours, whose components are fractions of 1 or, in other files, bytes.
//!
//! A file's components are bytes where all of them are integers and some are above 1. That is known
//! at its end alone, so integers are kept as they are until a fraction shows up or the file ends.

use std::path::Path;

use crate::color::{srgb_to_linear, unorm16};
use crate::mesh::Warnings;

/// The colour of vertices to which the file gives none.
pub(in crate::import) const WHITE: [u16; 4] = [u16::MAX; 4];

/// Largest integer that is kept: below [`WHITE`]'s components.
const LARGEST: f64 = 65534.0;

/// The range of colours' components, as far as they were read.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::import) struct ColorRange {
    /// Some component is no integer: full intensity is 1.
    pub(in crate::import) has_fractions: bool,
    /// The largest integer.
    largest: u16,
}

impl ColorRange {
    /// That of two texts of a file.
    pub(in crate::import) fn joined(self, other: Self) -> Self {
        Self {
            has_fractions: self.has_fractions || other.has_fractions,
            largest: self.largest.max(other.largest),
        }
    }

    /// True where components are bytes.
    pub(in crate::import) fn is_bytes(self) -> bool {
        !self.has_fractions && self.largest > 1
    }
}

impl ColorRange {
    /// Warns where components are bytes, naming the file.
    pub(in crate::import) fn report(self, file: &Path, warnings: &mut Warnings) {
        let what = "vertex colours are integers of 0 to 255, divided by 255";
        warnings.add(format!("{}: {what}", file.display()), u64::from(self.is_bytes()));
    }
}

/// The colours of a chunk: RGBA, linear light where some component is no integer, otherwise the
/// integers of sRGB.
#[derive(Debug, Default)]
pub(in crate::import) struct Colors {
    /// Empty until a vertex has a colour, then one per position.
    pub(in crate::import) values: Vec<[u16; 4]>,
    pub(in crate::import) range: ColorRange,
    /// The number of colours with a component that was out of range and is clamped.
    pub(in crate::import) clamped: u64,
}

impl Colors {
    /// Adds a colour, before which there are so many positions.
    pub(super) fn push(&mut self, components: [f64; 3], positions: usize) {
        self.values.resize(positions, WHITE);
        let is_fraction = |value: &f64| value.is_finite() && value.fract() != 0.0;
        if !self.range.has_fractions && components.iter().any(is_fraction) {
            self.clamped += make_linear(&mut self.values, ColorRange::default());
            self.range.has_fractions = true;
        }
        // Integers above full intensity are counted once it is known.
        let highest = if self.range.has_fractions { 1.0 } else { f64::INFINITY };
        let is_inside = |value: &f64| (0.0..=highest).contains(value);
        self.clamped += u64::from(!components.iter().all(is_inside));
        let [r, g, b] = components.map(|value| match self.range.has_fractions {
            true => unorm16(srgb_to_linear(value)),
            false => value.clamp(0.0, LARGEST) as u16,
        });
        if !self.range.has_fractions {
            self.range.largest = self.range.largest.max(r).max(g).max(b);
        }
        self.values.push([r, g, b, u16::MAX]);
    }

    /// Adds a vertex without a colour.
    #[inline]
    pub(super) fn push_none(&mut self) {
        if !self.values.is_empty() {
            self.values.push(WHITE);
        }
    }

    /// Makes colours linear light where they are not, now that the range of the file is known.
    pub(in crate::import) fn settle(&mut self, range: ColorRange) {
        if !self.range.has_fractions {
            self.clamped += make_linear(&mut self.values, range);
        }
    }
}

/// Makes linear light of integers of this range; returns how many colours were out of range.
pub(in crate::import) fn make_linear<'a>(
    colors: impl IntoIterator<Item = &'a mut [u16; 4]>,
    range: ColorRange,
) -> u64 {
    let one = if range.is_bytes() { 255 } else { 1 };
    let table: Vec<u16> =
        (0..=one).map(|value| unorm16(srgb_to_linear(f64::from(value) / f64::from(one)))).collect();
    let mut clamped = 0;
    for color in colors.into_iter().filter(|color| **color != WHITE) {
        let components = &mut color[..3];
        clamped += u64::from(components.iter().any(|value| *value > one));
        components.iter_mut().for_each(|value| *value = table[usize::from((*value).min(one))]);
    }
    clamped
}
