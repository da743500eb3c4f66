//! The loop of a frame: choose, load, draw, report.

use std::sync::{Arc, Mutex, MutexGuard};

use super::{
    Backend, FrameInput, FrameOutcome, FrameReport, FrontCheck, Inspect, Policy, Residents,
    Selection,
};
use crate::camera::View;
use crate::runtime::residency::Residency;
use crate::runtime::{SceneTree, ToggleCounter};
use crate::{Error, Result};

/// Nodes in memory whose priority is renewed in each frame though nothing visited them.
const STALE_PER_FRAME: usize = 64;

/// Draws frame after frame of a scene.
pub struct Engine<'a> {
    tree: &'a SceneTree,
    policy: &'a mut dyn Policy,
    residency: Arc<Mutex<Residency>>,
    backend: &'a mut dyn Backend,
    target_ms: f64,
    /// Seconds since the frame before began.
    dt_s: f64,
    residents: Residents,
    selection: Selection,
    /// The front of the frame before.
    before: Vec<u32>,
    toggles: ToggleCounter,
    check: FrontCheck,
    stale: Vec<u32>,
    others: Vec<(u32, f64)>,
    /// Counters of residency after the frame before.
    read_bytes: u64,
    evictions: u64,
    frames: u64,
    levels: usize,
    start_bytes: u64,
}

/// Locks; a thread that died while it held the lock is an error of ours.
pub fn lock(residency: &Mutex<Residency>) -> Result<MutexGuard<'_, Residency>> {
    residency.lock().map_err(|_| Error::Internal("the loading thread died".into()))
}

impl<'a> Engine<'a> {
    /// Loads the roots of a scene, of which a frame may take `target_ms`.
    pub fn start(
        tree: &'a SceneTree,
        policy: &'a mut dyn Policy,
        residency: Arc<Mutex<Residency>>,
        backend: &'a mut dyn Backend,
        target_ms: f64,
    ) -> Result<Self> {
        backend.load_roots(&residency, tree.roots())?;
        let (start_bytes, read_bytes) = {
            let residency = lock(&residency)?;
            (residency.used_bytes(), residency.counters().read_bytes)
        };
        Ok(Self {
            tree,
            policy,
            residency,
            backend,
            target_ms,
            dt_s: 0.0,
            residents: Residents::none(tree.len()),
            selection: Selection::default(),
            before: Vec::new(),
            toggles: ToggleCounter::default(),
            check: FrontCheck::default(),
            stale: Vec::new(),
            others: Vec::new(),
            read_bytes,
            evictions: 0,
            frames: 0,
            levels: tree.levels(),
            start_bytes,
        })
    }

    /// Draws a frame. The next begins `interval_s` seconds after this one began, at the earliest.
    pub fn frame(&mut self, view: &View, interval_s: f64) -> Result<FrameReport> {
        self.before.clone_from(&self.selection.front);
        let mut report = FrameReport::default();

        let changes = lock(&self.residency)?.begin_frame();
        for &node in &changes.left {
            self.residents.set(node, false);
        }
        for &node in &changes.arrived {
            self.residents.set(node, true);
        }
        report.arrived = changes.arrived.len() as u32;
        report.upload_ms = self.backend.apply(&changes)?;

        let before = self.backend.now_ms();
        let &mut Self { tree, target_ms, dt_s, ref residents, .. } = self;
        let input = FrameInput { tree, view, residents, target_ms, dt_s };
        self.policy.select(&input, &mut self.selection);
        report.select_ms = self.backend.now_ms() - before;
        let front = &self.selection.front;
        self.check.check(self.tree, front, view, &self.residents).map_err(|fault| {
            let (policy, frame) = (self.policy.name(), self.frames);
            Error::Internal(format!("policy {policy}, frame {frame}: {fault}"))
        })?;
        self.set_priorities(view, &mut report)?;
        self.backend.priorities_set();

        let drawn = self.backend.draw(&self.selection.front, view)?;
        report.draw_ms = drawn.draw_ms;
        report.actual_ms = report.select_ms + report.draw_ms;
        report.frame_ms = report.actual_ms + report.upload_ms;
        self.policy.drawn(&FrameOutcome { actual_ms: report.actual_ms });
        self.describe(&mut report);

        self.backend.end_frame(&self.residency, report.frame_ms, interval_s * 1e3)?;
        self.count(&mut report)?;
        self.frames += 1;
        self.dt_s = (report.frame_ms / 1e3).max(interval_s);
        Ok(report)
    }

    /// Nodes that the last frame drew.
    pub fn front(&self) -> &[u32] {
        &self.selection.front
    }

    /// Nodes that the frame before it drew.
    pub fn front_before(&self) -> &[u32] {
        &self.before
    }

    /// Pauses loading while the last frame is inspected, with its image where there is one.
    pub fn inspect(&mut self, view: &View, inspect: &mut Inspect<'_>) -> Result<()> {
        self.backend.pause_for(&self.selection.front, view, inspect)
    }

    /// Frame `frame` of a path was logged: a time for what must not be timed.
    pub fn logged(&mut self, frame: u64) -> Result<()> {
        self.backend.logged(frame)
    }

    /// Bytes of the whole process; 0 where that is not measured.
    pub fn process_bytes(&mut self) -> u64 {
        self.backend.process_bytes()
    }

    /// Bytes in use once the roots were loaded.
    pub fn start_bytes(&self) -> u64 {
        self.start_bytes
    }

    /// The most bytes that were ever in use, also between frames.
    pub fn peak_bytes(&self) -> Result<u64> {
        Ok(lock(&self.residency)?.peak_bytes())
    }

    /// Tells residency what matters now.
    fn set_priorities(&mut self, view: &View, report: &mut FrameReport) -> Result<()> {
        let mut residency = lock(&self.residency)?;
        residency.stale(STALE_PER_FRAME, &mut self.stale);
        self.others.clear();
        let &mut Self { tree, target_ms, dt_s, ref residents, .. } = self;
        let input = FrameInput { tree, view, residents, target_ms, dt_s };
        let priority = |&node: &u32| (node, self.policy.priority(&input, node));
        self.others.extend(self.stale.iter().map(priority));
        let Selection { front, priorities, keep_visited, .. } = &self.selection;
        residency.set_priorities(priorities, &self.others);
        residency.set_needed(front.iter().copied());
        if *keep_visited {
            residency.set_needed(priorities.iter().map(|&(node, _)| node));
        }
        report.waiting = residency.waiting() as u32;
        Ok(())
    }

    fn describe(&mut self, report: &mut FrameReport) {
        let selection = &self.selection;
        report.estimated_ms = selection.estimated_ms;
        report.estimated_without_feedback_ms = selection.estimated_without_feedback_ms;
        (report.v_time, report.share_ms) = (selection.v_time, selection.share_ms);
        report.covered = selection.covered;
        (report.visited, report.culled) = (selection.visited() as u32, selection.culled);
        report.nodes = selection.front.len() as u32;
        report.nodes_by_level = vec![0; self.levels];
        report.triangles_by_level = vec![0; self.levels];
        for &node in &selection.front {
            let node = self.tree.node(node);
            report.triangles += u64::from(node.triangles);
            report.nodes_by_level[node.level as usize] += 1;
            report.triangles_by_level[node.level as usize] += u64::from(node.triangles);
        }
        let toggles = self.toggles.count(self.tree, &selection.front);
        (report.toggles_up, report.toggles_down) = (toggles.up, toggles.down);
    }

    fn count(&mut self, report: &mut FrameReport) -> Result<()> {
        let residency = lock(&self.residency)?;
        let counters = residency.counters();
        report.read_bytes = counters.read_bytes - self.read_bytes;
        report.evictions = counters.evictions - self.evictions;
        (self.read_bytes, self.evictions) = (counters.read_bytes, counters.evictions);
        report.memory_bytes = residency.used_bytes();
        report.resident = residency.resident() as u32;
        Ok(())
    }
}
