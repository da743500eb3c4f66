//! Line segments in space, to be found by where they are.

use glam::DVec3;

use crate::mesh::Surface;

/// Segments with a search tree: triangles two of whose corners are one.
pub(super) struct Lines(Surface);

impl Lines {
    /// Of these pairs of ends.
    pub fn new(segments: impl ExactSizeIterator<Item = [DVec3; 2]>) -> Self {
        let triangles = (0..segments.len() as u32).map(|n| [2 * n, 2 * n + 1, 2 * n + 1]).collect();
        Self(Surface::new(segments.flatten().collect(), triangles))
    }

    /// Numbers of the segments within `reach` of a point, and how far each is, in order.
    pub fn near(&self, point: DVec3, reach: f64) -> Vec<(u32, f64)> {
        self.0.within(point, reach).iter().map(|hit| (hit.triangle, hit.distance())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_to_segments_not_to_lines() {
        let lines = Lines::new([[DVec3::ZERO, DVec3::X * 4.0], [DVec3::Y, DVec3::Y]].into_iter());
        let near = |x: f64, y: f64, reach| lines.near(DVec3::new(x, y, 0.0), reach);
        assert_eq!(near(2.0, 0.5, 1.0), [(0, 0.5)]);
        assert_eq!(near(0.0, 0.75, 1.0), [(0, 0.75), (1, 0.25)]);
        assert_eq!(near(7.0, 4.0, 5.0), [(0, 5.0)]);
        assert!(near(7.0, 4.0, 4.9).is_empty());
        assert!(Lines::new([].into_iter()).near(DVec3::ZERO, 1e9).is_empty());
    }
}
