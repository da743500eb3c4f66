//! The borders of a block as nodes above it need them: in a file of its own, so that neither the block
//! nor the process that built it need be there.

use std::path::Path;

use super::face::{FaceBorder, FaceVertex};
use crate::builder::border::rank::SurfaceQuadric;
use crate::{Error, Result};

/// The border in one plane.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedFace {
    /// The axis that the plane is across.
    pub axis: usize,
    /// Coordinate on that axis, in source coordinates.
    pub at: f64,
    /// Vertices; one that several cells beyond have is there for each.
    pub vertices: Vec<FaceVertex>,
    /// Pairs of vertices.
    pub edges: Vec<[u32; 2]>,
}

/// All borders of a block.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedBorder {
    /// At most one of each side.
    pub faces: Vec<RecordedFace>,
}

/// First bytes of a border file. The last one is the version.
const MAGIC: &[u8; 8] = b"hlodbrd\x01";

impl RecordedBorder {
    /// Records the borders on the sides of a block.
    pub fn of<'a>(faces: impl Iterator<Item = &'a FaceBorder>) -> Self {
        let face = |face: &FaceBorder| RecordedFace {
            axis: face.plane.axis,
            at: face.plane.coordinate,
            vertices: face.vertices.clone(),
            edges: face.edges.clone(),
        };
        Self { faces: faces.filter(|face| !face.edges.is_empty()).map(face).collect() }
    }

    /// Serialises the borders, little-endian.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend((self.faces.len() as u32).to_le_bytes());
        for RecordedFace { axis, at, vertices, edges } in &self.faces {
            bytes.extend((*axis as u32).to_le_bytes());
            bytes.extend(at.to_le_bytes());
            bytes.extend((vertices.len() as u32).to_le_bytes());
            bytes.extend((edges.len() as u32).to_le_bytes());
            for FaceVertex { position, surface } in vertices {
                for number in position.iter().chain(&surface.terms()) {
                    bytes.extend(number.to_le_bytes());
                }
            }
            for end in edges.as_flattened() {
                bytes.extend(end.to_le_bytes());
            }
        }
        bytes
    }

    /// Reads such a file.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let mut reader = Reader { rest: bytes };
        let read = reader.border();
        read.ok_or_else(|| {
            Error::output(
                path,
                "expected the borders of a block, found another file or a part of it",
            )
        })
    }
}

struct Reader<'a> {
    rest: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*first)
    }

    fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn f64(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes).filter(|number| number.is_finite())
    }

    fn border(&mut self) -> Option<RecordedBorder> {
        if self.take::<8>()? != *MAGIC {
            return None;
        }
        let count = self.u32()?;
        let mut faces = Vec::new();
        for _ in 0..count {
            faces.push(self.face()?);
        }
        self.rest.is_empty().then_some(RecordedBorder { faces })
    }

    fn face(&mut self) -> Option<RecordedFace> {
        let axis = self.u32()? as usize;
        let at = self.f64()?;
        let [vertex_count, edge_count] = [self.u32()?, self.u32()?];
        if axis > 2
            || vertex_count as usize > self.rest.len()
            || edge_count as usize > self.rest.len()
        {
            return None;
        }
        let mut vertices = Vec::with_capacity(vertex_count as usize);
        for _ in 0..vertex_count {
            let position = [self.f64()?, self.f64()?, self.f64()?];
            let mut terms = [0.0; 6];
            for term in &mut terms {
                *term = self.f64()?;
            }
            vertices.push(FaceVertex { position, surface: SurfaceQuadric::from_terms(terms) });
        }
        let mut edges = Vec::with_capacity(edge_count as usize);
        for _ in 0..edge_count {
            let edge = [self.u32()?, self.u32()?];
            if edge.iter().any(|&end| end >= vertex_count) {
                return None;
            }
            edges.push(edge);
        }
        Some(RecordedFace { axis, at, vertices, edges })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn is_read_as_it_is_written_and_no_other_file_is() {
        let vertex = |x: f64| FaceVertex {
            position: [x, 2.0, -3.5],
            surface: SurfaceQuadric::from_terms([1.0, 2.0, 3.0, 4.0, 5.0, x]),
        };
        let face = RecordedFace {
            axis: 2,
            at: -3.5,
            vertices: vec![vertex(1.0), vertex(2.0)],
            edges: vec![[0, 1]],
        };
        let border = RecordedBorder { faces: vec![face.clone(), RecordedFace { axis: 0, ..face }] };
        let bytes = border.to_bytes();
        let path = Path::new("block");
        assert_eq!(RecordedBorder::from_bytes(&bytes, path).unwrap(), border);
        for cut in 0..bytes.len() {
            assert!(RecordedBorder::from_bytes(&bytes[..cut], path).is_err(), "{cut}");
        }
        let mut beyond = bytes.clone();
        beyond[bytes.len() - 4] = 2;
        assert!(RecordedBorder::from_bytes(&beyond, path).is_err());
    }
}
