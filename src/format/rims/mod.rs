//! Where the districts of a result end, from one build to the next: `rims.hlod`.
//!
//! How the borders between districts thin is decided for all of a level together, from the rims of all of them.
//! Where one tile of a city has changed, the rims of all others are as they were, and none of their members
//! need be read.

mod read;
#[cfg(test)]
mod tests;
mod write;

use std::collections::BTreeMap;

/// The rims of districts inside an output folder.
pub const RIMS_FILE: &str = "rims.hlod";

/// The contents of `rims.hlod`: by level above the blocks, from 0 upward, and by the district's file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rims(pub BTreeMap<(u32, String), KnownRim>);

/// What is known of where a district ends.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownRim {
    /// A hash of all that `ends` is made of.
    pub ends_made_of: [u8; 32],
    /// Edges at which its members end, before vertices of several inputs that are nearly one were joined; none
    /// where no inputs touch.
    pub ends: Vec<[[f64; 3]; 2]>,
    /// A hash of all that `skirts` and `rim` are made of.
    pub made_of: [u8; 32],
    /// A hash of the skirts of members that it has, where others are.
    pub skirts: [u8; 32],
    /// What its borders depend on.
    pub rim: Rim,
}

/// What the borders of a district depend on: its surface where it ends, and where others are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rim {
    /// Least and greatest source coordinates of all of its surface.
    pub bounds: ([f64; 3], [f64; 3]),
    /// Vertices that others may have, too.
    pub positions: Vec<[f64; 3]>,
    /// Edges at which it ends: those in planes of cuts, and where others may be.
    pub open: Vec<[[f64; 3]; 2]>,
    /// Corners of the triangles at the ends of those in planes.
    pub triangles: Vec<[[f64; 3]; 3]>,
}
