//! The triangles along one border to another.

use glam::DVec3;

use crate::mesh::wide;

/// A triangle between two borders: over an open edge, to a vertex of the other border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stitch {
    /// The open edge, as its own triangle winds; the stitch winds the other way.
    pub edge: [[f64; 3]; 2],
    /// The third corner.
    pub apex: [f64; 3],
    /// The parts that the edge and the apex belong to.
    pub parts: [u32; 2],
}

/// Borders that touch do so for at least so many times as far as they are apart. What is shorter
/// is a notch or the narrow end of a hole: bridged, it is simplified as if there were surface, and a
/// tongue between two holes may go.
pub(super) const LEAST_LENGTH: f64 = 4.0;

/// The stitches along one border, so far as it goes without a break that is longer than such a
/// strip at its widest.
#[derive(Default)]
pub(super) struct Strip {
    pub stitches: Vec<Stitch>,
    /// Along the border, metres.
    pub length: f64,
    /// The farthest apex from its edge, metres.
    pub width: f64,
    /// Along the border since the last stitch, metres.
    pub gap: f64,
}

impl Strip {
    /// Appends a stitch, if it is a triangle.
    pub fn push(&mut self, stitch: Stitch) {
        if stitch.edge.contains(&stitch.apex) {
            return;
        }
        let (off, _) = nearest_on(stitch.edge.map(wide), wide(stitch.apex));
        self.width = self.width.max(off);
        self.stitches.push(stitch);
    }

    /// The stitches of a strip that is long enough; the next one begins.
    pub fn finished(&mut self) -> Vec<Stitch> {
        let Self { stitches, length, width, .. } = std::mem::take(self);
        if length >= LEAST_LENGTH * width { stitches } else { Vec::new() }
    }
}

/// The distance of a place from an edge, and how far along it the nearest point is, 0–1.
pub(super) fn nearest_on([from, to]: [DVec3; 2], place: DVec3) -> (f64, f64) {
    let along = (place - from).dot(to - from) / (to - from).length_squared();
    let along = along.clamp(0.0, 1.0);
    (from.lerp(to, along).distance(place), along)
}
