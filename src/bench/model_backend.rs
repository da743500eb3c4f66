//! A backend in which time follows from the cost model and loading from a number of bytes a
//! millisecond, so that runs are the same on every machine.

use std::sync::Mutex;

use super::ClockConstants;
use crate::camera::View;
use crate::engine::lock;
use crate::engine::{Backend, Drawn};
use crate::runtime::residency::{Changes, Residency};
use crate::runtime::{SceneTree, covered};
use crate::{Error, Result};

/// A backend in which time follows from the cost model. Nothing is read or drawn.
#[derive(Clone, Debug)]
pub struct ModelBackend<'a> {
    tree: &'a SceneTree,
    constants: ClockConstants,
    /// Bytes that loading had time for and did not read, or the other way round below 0.
    credit: f64,
}

impl<'a> ModelBackend<'a> {
    /// A backend over a hierarchy.
    pub fn new(tree: &'a SceneTree, constants: ClockConstants) -> Self {
        Self { tree, constants, credit: 0.0 }
    }
}

impl Backend for ModelBackend<'_> {
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()> {
        let mut residency = lock(residency)?;
        for &root in roots {
            let step = residency.load_root(root);
            if !residency.chunk_read(root, step.bytes) {
                return Err(Error::Internal(format!("root {root} is incomplete")));
            }
            residency.loaded(root);
        }
        Ok(())
    }

    fn apply(&mut self, _: &Changes) -> Result<f64> {
        Ok(0.0)
    }

    fn now_ms(&mut self) -> f64 {
        0.0
    }

    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn> {
        let cost: f64 = front.iter().map(|&node| self.tree.node(node).cost).sum();
        let ClockConstants { fixed_ms, ms_per_cost, fill_cost, ms_per_node, .. } = self.constants;
        let load = cost + fill_cost * covered(self.tree, front, view);
        Ok(Drawn { draw_ms: fixed_ms + ms_per_cost * load + ms_per_node * front.len() as f64 })
    }

    fn end_frame(
        &mut self,
        residency: &Mutex<Residency>,
        frame_ms: f64,
        interval_ms: f64,
    ) -> Result<()> {
        let mut residency = lock(residency)?;
        self.credit += frame_ms.max(interval_ms) * self.constants.load_bytes_per_ms;
        while self.credit > 0.0 {
            let Some(step) = residency.next_step() else {
                self.credit = 0.0; // time in which there was nothing to do is gone
                break;
            };
            self.credit -= step.bytes as f64;
            if residency.chunk_read(step.node, step.bytes) {
                residency.loaded(step.node);
            }
        }
        Ok(())
    }

    fn process_bytes(&mut self) -> u64 {
        0
    }
}
