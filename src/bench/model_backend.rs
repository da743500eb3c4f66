//! A backend in which nothing is drawn, so that runs are the same on every machine.
//!
//! How long a frame takes is nobody's own equation. Other than in the engine's cost model, fragments
//! are hidden by what is before them in the same tile of the image, small triangles waste the
//! blocks of pixels in which machines shade, geometry and fragments pass side by side as far as the
//! machine has units for both, what is new is slower in its first frame, times scatter, and now and
//! then the whole machine stalls.

use std::sync::{Arc, Mutex};

use super::model_load::TileLoad;
use super::{BrokenFiles, ClockConstants, ModelFiles};
use crate::camera::View;
use crate::engine::{Backend, Drawn, NodeOcclusion, lock};
use crate::format::cells::Cells;
use crate::random::Random;
use crate::runtime::SceneTree;
use crate::runtime::residency::{Changes, Residency};
use crate::{Error, Result};

/// A backend in which time follows from constants and a seed.
#[derive(Clone, Debug)]
pub struct ModelBackend<'a> {
    tree: &'a SceneTree,
    constants: ClockConstants,
    seed: u64,
    frames: u64,
    /// Bytes of nodes that were uploaded and not yet drawn.
    cold_bytes: u64,
    /// Seconds of the frame before.
    dt_s: f64,
    /// Bytes that loading had time for and did not read, or the other way round below 0.
    credit: f64,
    load: TileLoad,
    cells: Option<Arc<Cells>>,
    files: Option<Arc<ModelFiles>>,
    with_occlusion: bool,
    broken: BrokenFiles,
}

impl<'a> ModelBackend<'a> {
    /// A backend over a hierarchy; `seed` is that of noise and stalls.
    pub fn new(tree: &'a SceneTree, constants: ClockConstants, seed: u64) -> Self {
        Self {
            tree,
            constants,
            seed,
            frames: 0,
            cold_bytes: 0,
            dt_s: 0.0,
            credit: 0.0,
            load: TileLoad::default(),
            cells: None,
            files: None,
            with_occlusion: false,
            broken: BrokenFiles::default(),
        }
    }

    /// Draws the faces of cells as well.
    pub fn with_cells(self, cells: Option<Arc<Cells>>) -> Self {
        Self { cells, ..self }
    }

    /// Checks the files of the nodes that it loads, and reads what these hide, where that is wanted.
    pub fn with_files(self, files: Arc<ModelFiles>, with_occlusion: bool) -> Self {
        Self { files: Some(files), with_occlusion, ..self }
    }

    /// Begins with files that are known to be of no use.
    pub fn with_broken(self, broken: BrokenFiles) -> Self {
        Self { broken, ..self }
    }

    /// Files that could not be used.
    pub fn broken(&self) -> &BrokenFiles {
        &self.broken
    }

    /// All of the files of a node were read.
    fn loaded(&mut self, node: u32, residency: &mut Residency) -> Result<()> {
        let files = self.files.as_ref();
        match files.map_or(Ok(None), |files| files.load(node, self.with_occlusion)) {
            Ok(_) => residency.loaded(node),
            Err(error @ Error::Input { .. }) => {
                self.broken.add(&error);
                residency.broken(node);
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// What a frame takes by chance: a factor, and milliseconds.
    fn chance(&self) -> (f64, f64) {
        let ClockConstants { noise, stalls_per_s, stall_ms, .. } = self.constants;
        let mut random = Random::new(self.seed, self.frames);
        // Two numbers give one of a normal distribution (Box and Muller 1958).
        let [u, v] = [1.0 - random.unit(), random.unit()];
        let normal = (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v);
        let stalls = random.unit() < 1.0 - libm::exp(-stalls_per_s * self.dt_s);
        let stall_ms = if stalls { -stall_ms * libm::log(1.0 - random.unit()) } else { 0.0 };
        (libm::exp(noise * normal), stall_ms)
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
            self.loaded(root, &mut residency)?;
        }
        Ok(())
    }

    fn apply(&mut self, changes: &Changes) -> Result<f64> {
        self.cold_bytes = changes.arrived_bytes;
        Ok(self.constants.prices.uploaded_byte * changes.arrived_bytes as f64)
    }

    fn now_ms(&mut self) -> f64 {
        0.0
    }

    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn> {
        let faces = self.cells.as_ref().map_or(&[][..], |cells| &cells.faces);
        let load = self.load.of(self.tree, faces, front, view);
        let ClockConstants { prices, cold_byte, .. } = self.constants;
        let both = self.constants.drawing_ms(&load);
        let cold = cold_byte * self.cold_bytes as f64;
        let (factor, stall_ms) = self.chance();
        self.frames += 1;
        let draw_ms = factor * (prices.frame + both + cold) + stall_ms;
        Ok(Drawn { draw_ms, gpu_ms: None })
    }

    fn occlusion(&mut self, node: u32) -> Option<Arc<NodeOcclusion>> {
        let files = self.files.as_ref().filter(|_| self.with_occlusion)?;
        files.load(node, true).ok().flatten()
    }

    fn end_frame(
        &mut self,
        residency: &Mutex<Residency>,
        frame_ms: f64,
        interval_ms: f64,
    ) -> Result<()> {
        let mut residency = lock(residency)?;
        let ms = frame_ms.max(interval_ms);
        self.dt_s = ms / 1e3;
        self.credit += ms * self.constants.load_bytes_per_ms;
        while self.credit > 0.0 {
            let Some(step) = residency.next_step() else {
                self.credit = 0.0; // time in which there was nothing to do is gone
                break;
            };
            self.credit -= step.bytes as f64;
            if residency.chunk_read(step.node, step.bytes) {
                self.loaded(step.node, &mut residency)?;
            }
        }
        Ok(())
    }

    fn process_bytes(&mut self) -> u64 {
        0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::Prices;
    use crate::engine::test_frame::triangles_alone;
    use crate::runtime::test_tree::{Sketch, sketch, tree, view};

    fn draw_ms(constants: ClockConstants, seed: u64, frames: usize) -> Vec<f64> {
        let wall = |x: f64| Sketch { size: 100.0, ..sketch([x, 0.0, 0.0], 1.0, vec![]) };
        let tree = tree(vec![wall(60.0), wall(160.0)]);
        let mut backend = ModelBackend::new(&tree, constants, seed);
        (0..frames).map(|_| backend.draw(&[0, 1], &view()).unwrap().draw_ms).collect()
    }

    /// 20 triangles at 1 ms, and an image of 10,000 fragments.
    fn constants() -> ClockConstants {
        let prices = Prices { plain_fragment: 1e-3, ..triangles_alone(1.0) };
        ClockConstants { prices, edge_fragment: 0.0, ..ClockConstants::default() }
    }

    #[test]
    fn what_is_hidden_takes_its_part_and_units_work_side_by_side() {
        // The near wall fills the image; all under the far one is hidden.
        let walls = tree(vec![Sketch { size: 100.0, ..sketch([160.0, 0.0, 0.0], 1.0, vec![]) }]);
        let far = view().frustum.covered(walls.node(0).bbox);
        let hidden = |hidden_fragment, overlap| {
            let prices = Prices { hidden_fragment, ..constants().prices };
            draw_ms(ClockConstants { prices, overlap, ..constants() }, 0, 1)[0]
        };
        assert!((hidden(0.0, 0.0) - 30.0).abs() < 1e-9);
        assert!((hidden(5e-4, 0.0) - (30.0 + 5.0 * far)).abs() < 1e-9);
        assert!((hidden(0.0, 1.0) - 20.0).abs() < 1e-9, "the longer of both");
    }

    #[test]
    fn many_triangles_have_many_edges() {
        let edges = draw_ms(ClockConstants { edge_fragment: 1e-3, ..constants() }, 0, 1)[0];
        // Ten triangles over the whole image, and ten over the part of it that is far.
        let more = edges - 30.0;
        let near = (10.0f64 * 1e4).sqrt() * 1e-3;
        assert!(more > near && more < 2.0 * near, "{more}");
    }

    #[test]
    fn noise_and_stalls_are_those_of_the_seed() {
        let noisy = ClockConstants { noise: 0.1, stalls_per_s: 1.0, stall_ms: 50.0, ..constants() };
        let (one, again, other) =
            (draw_ms(noisy, 1, 100), draw_ms(noisy, 1, 100), draw_ms(noisy, 2, 100));
        assert!(one == again && one != other);
        let mean = draw_ms(ClockConstants { noise: 0.1, ..constants() }, 3, 4000);
        let logarithms: Vec<f64> = mean.iter().map(|ms| libm::log(*ms)).collect();
        let deviation = crate::bench::statistics::deviation(&logarithms);
        assert!((deviation - 0.1).abs() < 0.005, "{deviation}");
    }
}
