//! Cells in which viewers are, and what is drawn of all that is far from them: `cells.hlod`.

mod read;
#[cfg(test)]
mod tests;
mod write;

use std::ops::Range;

/// The index of cells inside an output folder.
pub const CELLS_FILE: &str = "cells.hlod";
/// The folder of their faces inside an output folder.
pub const CELLS_DIR: &str = "cells";

/// The contents of `cells.hlod`: virtual cells (Aliaga and others, 1999, section 3).
///
/// Cells are cubes of a regular lattice: cell `[i, j, k]` reaches from `size × [i, j, k]` to `size × [i + 1,
/// j + 1, k + 1]` in source coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct Cells {
    /// [`Scene::fingerprint`](super::Scene::fingerprint) of the build that they are of.
    pub scene: [u8; 32],
    /// What the faces were made with, as it was asked for.
    pub parameters: serde_json::Value,
    /// Metres along the side of a cell.
    pub size: f64,
    /// Metres that a texel of a face covers at one metre's distance, in the middle of its picture.
    pub texel: f64,
    /// In the order of their places, none twice.
    pub cells: Vec<Cell>,
    /// The faces of all cells, in the order of their cells.
    pub faces: Vec<Face>,
}

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Its place in the lattice.
    pub place: [i64; 3],
    /// The *cull box*, least and greatest source coordinates: what is in it is drawn from the hierarchy, and
    /// what is outside of it from faces.
    pub cull_box: [[f64; 3]; 2],
    /// What is seen of the outside, of [`Cells::faces`]. Directions in which nothing is have none.
    pub faces: Range<u32>,
}

/// One textured depth mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// File name inside `cells/`.
    pub file: String,
    /// Size of that file.
    pub file_bytes: u64,
    /// CRC-32 of that file; see [`file_crc`](super::file_crc).
    pub file_crc: u32,
    /// Number of vertices.
    pub vertices: u32,
    /// Number of triangles.
    pub triangles: u32,
    /// Least and greatest source coordinates of the vertices.
    pub bounds: [[f64; 3]; 2],
    /// The farthest that what it shows may be from where it is, as seen from anywhere in the cell: parts of
    /// the distance to it, which is radians nearly.
    pub error: f64,
    /// The pictures that its triangles show, in the order of its file.
    pub views: Vec<FaceView>,
}

/// A picture of a face, and the camera that took it.
#[derive(Clone, Debug, PartialEq)]
pub struct FaceView {
    /// Width and height in texels.
    pub size: [u32; 2],
    /// Steradians of the picture in which something is, seen from the cell's middle.
    pub solid_angle: f32,
    /// The depth of a point in that camera is the dot product of this with the point, from the origin of the
    /// face's file, and 1.
    pub projection: [f32; 4],
}

impl Cells {
    /// The place of the cell in which a point is.
    pub fn place_of(&self, point: [f64; 3]) -> [i64; 3] {
        place_of(self.size, point)
    }

    /// Least and greatest source coordinates of a cell.
    pub fn bounds(&self, place: [i64; 3]) -> [[f64; 3]; 2] {
        [0, 1].map(|end| place.map(|at| (at + end) as f64 * self.size))
    }

    /// The cell in which a point is, where there is one.
    pub fn cell_at(&self, point: [f64; 3]) -> Option<&Cell> {
        self.cell(self.place_of(point))
    }

    /// The cell at a place, where there is one.
    pub fn cell(&self, place: [i64; 3]) -> Option<&Cell> {
        let at = self.cells.binary_search_by_key(&place, |cell| cell.place).ok()?;
        self.cells.get(at)
    }

    /// The faces of a cell.
    pub fn faces_of(&self, cell: &Cell) -> &[Face] {
        &self.faces[cell.faces.start as usize..cell.faces.end as usize]
    }

    /// Adds cells with their faces; none of them is there yet.
    pub fn add(&mut self, more: Vec<(Cell, Vec<Face>)>) {
        let mut all: Vec<(Cell, Vec<Face>)> = Vec::with_capacity(self.cells.len() + more.len());
        let mut faces = std::mem::take(&mut self.faces).into_iter();
        for cell in std::mem::take(&mut self.cells) {
            let of_cell = faces.by_ref().take(cell.faces.len()).collect();
            all.push((cell, of_cell));
        }
        all.extend(more);
        all.sort_by_key(|(cell, _)| cell.place);
        for (cell, faces) in all {
            let first = self.faces.len() as u32;
            self.faces.extend(faces);
            self.cells.push(Cell { faces: first..self.faces.len() as u32, ..cell });
        }
    }

    /// Leaves away the cells for which `stays` is false.
    pub fn retain(&mut self, stays: impl Fn(&[Face]) -> bool) {
        let whole =
            std::mem::replace(self, Self { cells: Vec::new(), faces: Vec::new(), ..self.clone() });
        let kept = whole.cells.iter().filter(|cell| stays(whole.faces_of(cell)));
        self.add(kept.map(|cell| (cell.clone(), whole.faces_of(cell).to_vec())).collect());
    }
}

/// The place of the cell of a size in which a point is.
pub fn place_of(size: f64, point: [f64; 3]) -> [i64; 3] {
    point.map(|at| (at / size).floor() as i64)
}
