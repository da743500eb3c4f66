//! Borders of the source that touch without sharing vertices: tiles of a scan that overlap by a few
//! centimetres, objects modelled one beside the other.
//!
//! Seen at full detail nothing is open there, since the slit is narrower than what the surface
//! resolves. Simplified apart, both borders draw back from each other, and a coarse level shows the
//! sky between them. Strips of triangles from one border to the other make them one surface for
//! everything but the leaves, which stay the source: cutting planes divide the strips too, and
//! simplification finds vertices inside of a surface where there were two borders.
//!
//! - [`mod@open_edges`]: the borders
//! - [`touching`]: what touches
//! - `strip`: the triangles from one border to the other

pub mod open_edges;
mod strip;
pub mod touching;

pub use open_edges::{OpenEdge, open_edges};
pub use strip::Stitch;
pub use touching::stitches;
