//! East, north and up of a mesh.

use glam::DVec3;

use crate::mesh::UpAxis;

/// Turns a mesh's axes so that Z is up, and back.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    up: UpAxis,
}

impl Frame {
    pub(super) fn of(up: UpAxis) -> Self {
        Self { up }
    }

    pub(super) fn upright(self, p: DVec3) -> DVec3 {
        match self.up {
            UpAxis::Z => p,
            UpAxis::Y => DVec3::new(p.x, -p.z, p.y),
        }
    }

    pub(super) fn back(self, p: DVec3) -> DVec3 {
        match self.up {
            UpAxis::Z => p,
            UpAxis::Y => DVec3::new(p.x, p.z, -p.y),
        }
    }
}
