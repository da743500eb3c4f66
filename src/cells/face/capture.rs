//! Draws what is outside of a cull box.

use std::path::PathBuf;

use glam::{DQuat, DVec3};

use super::Captured;
use crate::bench::{ReferenceRenderer, Session};
use crate::camera::{Pose, View, from_angles};
use crate::cells::options::CellOptions;
use crate::mesh::UpAxis;
use crate::render::{RenderOptions, Side};
use crate::runtime::SceneTree;
use crate::{Error, Result};

/// Degrees of yaw and pitch of the six directions.
pub(in crate::cells) const DIRECTIONS: [[f64; 2]; 6] =
    [[0.0, 0.0], [90.0, 0.0], [180.0, 0.0], [270.0, 0.0], [0.0, 90.0], [0.0, -90.0]];

/// Levels are as fine as it takes for them to be off by no more than this, pixels.
const LEVEL_ERROR_PX: f64 = 0.5;

/// Bytes of nodes that are held for the pictures to come.
const CAP_BYTES: u64 = 1 << 30;

/// Draws what is outside of a cull box.
pub(in crate::cells) struct Capture {
    renderer: ReferenceRenderer,
    up: UpAxis,
    /// The output folder, for messages.
    dir: PathBuf,
}

impl Capture {
    pub fn new(session: &Session, options: &CellOptions, adapter: Option<&str>) -> Result<Self> {
        let options = RenderOptions {
            size: [options.pixels; 2],
            adapter: adapter.map(str::to_owned),
            cut: Some(Side::Outside),
            ..RenderOptions::default()
        };
        let renderer = ReferenceRenderer::new(session, &options, CAP_BYTES)?;
        Ok(Self { renderer, up: session.scene().up, dir: session.dir().to_owned() })
    }

    /// Of a camera that looks in a direction, by yaw and pitch.
    pub fn rotation(&self, [yaw, pitch]: [f64; 2]) -> DQuat {
        from_angles(self.up, yaw, pitch, 0.0)
    }

    /// What is seen in a direction of the outside of a box; none where nothing is.
    pub fn draw(
        &mut self,
        eye: DVec3,
        outside_of: [DVec3; 2],
        direction: [f64; 2],
        options: &CellOptions,
    ) -> Result<Option<Captured>> {
        let rotation = self.rotation(direction);
        let pose = Pose { position: eye, rotation, fov_y_deg: options.fov_deg() };
        let view = View::new(pose, DVec3::ZERO, [options.pixels; 2]);
        let nodes = front(self.renderer.tree(), &view, outside_of);
        if nodes.is_empty() {
            return Ok(None);
        }
        self.renderer.cut_at(Some(outside_of));
        let picture = self.renderer.render(&nodes, &pose)?;
        if picture.pixels().all(|pixel| pixel.0[3] == 0) {
            return Ok(None);
        }
        let metres = self.renderer.depths()?;
        Ok(Some(Captured { picture, metres, eye, rotation }))
    }

    /// Fails where a file could not be used.
    pub fn check(&self) -> Result<()> {
        match self.renderer.broken().next() {
            Some(first) => {
                let what = format!("a file cannot be used; build again: {first}");
                Err(Error::input(&self.dir, what))
            }
            None => Ok(()),
        }
    }
}

/// Nodes in view that are not wholly inside of a box, each as coarse as it can be without being off by more
/// than [`LEVEL_ERROR_PX`].
fn front(tree: &SceneTree, view: &View, [min, max]: [DVec3; 2]) -> Vec<u32> {
    let mut front = Vec::new();
    let mut open: Vec<u32> = tree.roots().to_vec();
    while let Some(node) = open.pop() {
        let at = tree.node(node);
        let is_inside = at.bbox[0].cmpge(min).all() && at.bbox[1].cmple(max).all();
        if is_inside || view.frustum.outside(at.bbox) > 0.0 {
            continue;
        }
        let children = tree.children(node);
        let error_px = at.viewer_error * tree.pixels_per_metre(node, view);
        if children.is_empty() || error_px <= LEVEL_ERROR_PX {
            front.push(node);
        } else {
            open.extend(children);
        }
    }
    front
}
