//! The outcome of packing.

use super::shape::Shape;

/// Where a shape's bounding box lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Placement {
    pub page: usize,
    pub x: usize,
    pub y: usize,
    /// True where the shape's columns became rows.
    pub transposed: bool,
}

/// Where all shapes lie.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packing {
    /// In the order of the shapes.
    pub placements: Vec<Placement>,
    /// Columns and rows of each page.
    pub pages: Vec<[usize; 2]>,
    /// True where shapes leave the only page on one side and come back on the other.
    pub wraps: bool,
}

impl Packing {
    /// Cells of all pages.
    pub fn area(&self) -> usize {
        self.pages.iter().map(|[width, height]| width * height).sum()
    }

    /// Finds out whether shapes go over the sides; where none does, pages end with their shapes.
    pub fn trim(&mut self, shapes: &[&Shape]) {
        let mut used = vec![[0; 2]; self.pages.len()];
        for (placement, shape) in self.placements.iter().zip(shapes) {
            let [mut width, mut height] = shape.size;
            if placement.transposed {
                (width, height) = (height, width);
            }
            let used = &mut used[placement.page];
            *used = [used[0].max(placement.x + width), used[1].max(placement.y + height)];
        }
        self.wraps =
            used.iter().zip(&self.pages).any(|(used, page)| used[0] > page[0] || used[1] > page[1]);
        if !self.wraps {
            self.pages = used;
        }
    }
}
