//! What was written.

use std::fmt;

use super::scan::{STEPS_PER_METRE, Scan};
use super::{City, Jpeg};

/// Counts and sizes of a written city.
#[derive(Clone, Debug, PartialEq)]
pub struct CitySummary {
    /// Façade rows.
    pub blocks: usize,
    /// All triangles.
    pub triangles: u64,
    /// Those of the façades.
    pub facade_triangles: u64,
    /// All vertices.
    pub vertices: u64,
    /// Texels of all textures.
    pub texels: u64,
    /// Bytes of all files.
    pub bytes: u64,
    /// Mean distance of neighbouring façade samples, metres.
    pub sample_spacing: f64,
    /// Lower and upper corner of the city, world coordinates in metres.
    pub bounds: [[f64; 3]; 2],
}

impl CitySummary {
    pub(super) fn new(city: &City) -> Self {
        Self {
            blocks: city.len(),
            triangles: 0,
            facade_triangles: 0,
            vertices: 0,
            texels: 0,
            bytes: 0,
            sample_spacing: 0.0,
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        }
    }

    /// Counts a block in.
    pub(super) fn add(&mut self, facts: &BlockFacts) {
        let share = facts.triangles as f64 / (self.triangles + facts.triangles).max(1) as f64;
        self.sample_spacing += (facts.sample_spacing - self.sample_spacing) * share;
        self.triangles += facts.triangles;
        self.facade_triangles += facts.facade_triangles;
        self.vertices += facts.vertices;
        self.texels += facts.texels;
        for axis in 0..3 {
            self.bounds[0][axis] = self.bounds[0][axis].min(facts.bounds[0][axis]);
            self.bounds[1][axis] = self.bounds[1][axis].max(facts.bounds[1][axis]);
        }
    }
}

/// Counts of one block.
pub(super) struct BlockFacts {
    triangles: u64,
    facade_triangles: u64,
    vertices: u64,
    texels: u64,
    sample_spacing: f64,
    bounds: [[f64; 3]; 2],
}

impl BlockFacts {
    pub(super) fn new(origin: [i64; 3], scan: &Scan, jpeg: Option<&Jpeg>) -> Self {
        let mut bounds = [[i32::MAX; 3], [i32::MIN; 3]];
        for position in &scan.positions {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(position[axis]);
                bounds[1][axis] = bounds[1][axis].max(position[axis]);
            }
        }
        let bounds = bounds.map(|corner| {
            std::array::from_fn(|axis| {
                let steps = origin[axis] * STEPS_PER_METRE as i64 + i64::from(corner[axis]);
                steps as f64 / STEPS_PER_METRE
            })
        });
        Self {
            triangles: scan.triangles.len() as u64,
            facade_triangles: scan.facade_triangles as u64,
            vertices: scan.positions.len() as u64,
            texels: jpeg.map_or(0, |jpeg| jpeg.texels),
            sample_spacing: scan.spacing,
            bounds,
        }
    }
}

impl fmt::Display for CitySummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.triangles.max(1) as f64;
        let corner = |[x, y, z]: [f64; 3]| format!("{x:.4}, {y:.4}, {z:.4}");
        writeln!(f, "blocks            {}", self.blocks)?;
        writeln!(f, "triangles         {} ({} of façades)", self.triangles, self.facade_triangles)?;
        writeln!(f, "vertices          {}", self.vertices)?;
        writeln!(f, "sample spacing    {:.3} m", self.sample_spacing)?;
        let per_triangle = self.texels as f64 / count;
        writeln!(f, "texels            {} ({per_triangle:.1} a triangle)", self.texels)?;
        writeln!(f, "lower corner      {}", corner(self.bounds[0]))?;
        writeln!(f, "upper corner      {}", corner(self.bounds[1]))?;
        write!(f, "bytes             {}", self.bytes)
    }
}
