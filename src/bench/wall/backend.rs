//! The real backend: loading threads, a graphics adapter, and time as it passes.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use super::{Snapshots, process};
use crate::bench::BrokenFiles;
use crate::camera::View;
use crate::engine::{Backend, Drawn, Inspect, NodeOcclusion, lock};
use crate::loading::{Arrival, LoadingThreads, NodeFiles};
use crate::render::Renderer;
use crate::runtime::SceneTree;
use crate::runtime::residency::{Changes, Residency};
use crate::{Error, Result};

/// How often a frame is drawn again after somebody looked at it, so that the next finds caches as
/// warm as if nobody had: without, the first three are slower, the first by a third.
const WARM_UP: usize = 4;

/// The real backend.
pub struct GpuBackend<'a> {
    tree: &'a SceneTree,
    files: NodeFiles,
    renderer: &'a mut Renderer,
    threads: Option<LoadingThreads>,
    residency: Arc<Mutex<Residency>>,
    /// Decoded, and not yet resident.
    arrived: BTreeMap<u32, Arrival>,
    /// What nodes hide that were uploaded, until it is asked for.
    occlusions: BTreeMap<u32, NodeOcclusion>,
    broken: BrokenFiles,
    snapshots: Option<Snapshots>,
    /// Metres; nothing nearer is seen.
    near: f32,
    start: Instant,
    frame_start: Instant,
}

impl<'a> GpuBackend<'a> {
    /// A backend in which nothing is loaded yet.
    pub fn new(
        tree: &'a SceneTree,
        files: NodeFiles,
        renderer: &'a mut Renderer,
        residency: Arc<Mutex<Residency>>,
        snapshots: Option<Snapshots>,
    ) -> Self {
        let near = tree.near_plane();
        let now = Instant::now();
        Self {
            tree,
            files,
            renderer,
            threads: None,
            residency,
            arrived: BTreeMap::new(),
            occlusions: BTreeMap::new(),
            broken: BrokenFiles::default(),
            snapshots,
            near,
            start: now,
            frame_start: now,
        }
    }

    /// Begins with files that are known to be of no use.
    pub fn with_broken(self, broken: BrokenFiles) -> Self {
        Self { broken, ..self }
    }

    /// Files that could not be used.
    pub fn broken(&self) -> &BrokenFiles {
        &self.broken
    }

    /// Takes what the loading threads delivered, without what was given up since; fails where one
    /// will deliver no more.
    fn receive(&mut self, dropped: &[u32]) -> Result<()> {
        let alive = self.threads.as_ref().map_or(Ok(()), LoadingThreads::check);
        // A node that was given up may already have been loaded again: its first arrival is dropped.
        let mut dropped: BTreeSet<u32> = dropped.iter().copied().collect();
        dropped.retain(|node| self.arrived.remove(node).is_none());
        for arrival in self.threads.iter().flat_map(LoadingThreads::arrivals) {
            match arrival {
                Ok(arrival) if dropped.remove(&arrival.node) => {}
                Ok(arrival) => {
                    self.arrived.insert(arrival.node, arrival);
                }
                Err(error) => self.broken.add(&error),
            }
        }
        alive
    }

    fn upload(&mut self, arrival: &Arrival) -> Result<()> {
        for (texture, picture) in &arrival.pictures {
            self.renderer.upload_shared(*texture, picture)?;
        }
        let is_node = (arrival.node as usize) < self.tree.len();
        let level = if is_node { self.tree.node(arrival.node).level } else { 0 };
        self.renderer.upload(arrival.node, level, &arrival.content)
    }
}

impl Backend for GpuBackend<'_> {
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()> {
        for &root in roots {
            let mut residency = lock(residency)?;
            let step = residency.load_root(root);
            residency.chunk_read(root, step.bytes);
            match self.files.read(root, |texture| residency.has_texture(texture)) {
                Ok(arrival) => {
                    self.arrived.insert(root, arrival);
                    residency.loaded(root);
                }
                Err(error) => {
                    self.broken.add(&error);
                    residency.broken(root);
                }
            }
        }
        let count = LoadingThreads::default_count();
        self.threads = Some(LoadingThreads::start(&self.files, &self.residency, count)?);
        Ok(())
    }

    fn apply(&mut self, changes: &Changes) -> Result<f64> {
        self.frame_start = Instant::now();
        self.receive(&changes.dropped)?;
        changes.left.iter().for_each(|&node| self.renderer.remove(node));
        changes.left_textures.iter().for_each(|&texture| self.renderer.remove_shared(texture));
        for &node in &changes.arrived {
            let arrival = self.arrived.remove(&node).ok_or_else(|| {
                Error::Internal(format!("node {node} was said to be loaded and is not there"))
            })?;
            self.upload(&arrival)?;
            if let Some(occlusion) = arrival.occlusion {
                self.occlusions.insert(node, occlusion);
            }
        }
        if !changes.arrived.is_empty() {
            self.renderer.finish_uploads()?;
        }
        Ok(self.frame_start.elapsed().as_secs_f64() * 1e3)
    }

    fn now_ms(&mut self) -> f64 {
        self.start.elapsed().as_secs_f64() * 1e3
    }

    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn> {
        let begin = Instant::now();
        self.renderer.cut_at(view.frustum.box_within());
        let times = self.renderer.draw(front, &view.pose, self.near)?;
        Ok(Drawn { draw_ms: begin.elapsed().as_secs_f64() * 1e3, gpu_ms: times.gpu_ms })
    }

    fn occlusion(&mut self, node: u32) -> Option<Arc<NodeOcclusion>> {
        self.occlusions.remove(&node).map(Arc::new)
    }

    fn priorities_set(&mut self) {
        if let Some(threads) = &self.threads {
            threads.wake();
        }
    }

    fn end_frame(&mut self, _: &Mutex<Residency>, _: f64, interval_ms: f64) -> Result<()> {
        let interval = Duration::try_from_secs_f64(interval_ms / 1e3).unwrap_or(Duration::ZERO);
        if let Some(left) = interval.checked_sub(self.frame_start.elapsed()) {
            std::thread::sleep(left);
        }
        Ok(())
    }

    fn logged(&mut self, frame: u64) -> Result<()> {
        match &self.snapshots {
            Some(snapshots) => snapshots.take(frame, self.renderer),
            None => Ok(()),
        }
    }

    fn pause_for(&mut self, front: &[u32], view: &View, inspect: &mut Inspect<'_>) -> Result<()> {
        let guard = self.threads.as_ref().map(LoadingThreads::pause).transpose()?;
        inspect(Some(self.renderer.surface()?))?;
        for _ in 0..WARM_UP {
            self.renderer.draw(front, &view.pose, self.near)?;
        }
        drop(guard);
        Ok(())
    }

    fn process_bytes(&mut self) -> u64 {
        process::resident_bytes()
    }
}
