//! The loop over the frames of a path: choose, load, draw, log.

use std::sync::{Arc, Mutex, MutexGuard};

use image::RgbaImage;

use super::{BenchOptions, FrameInspector, FrameRecord, FrameSample, Pace};
use crate::camera::{CameraPath, View};
use crate::runtime::residency::{Changes, Residency};
use crate::runtime::{FrameOutcome, Policy, Residents, SceneTree, Selection, ToggleCounter};
use crate::{Error, Result};

/// Nodes in memory whose priority is looked at again in each frame though nothing visited them.
const STALE_PER_FRAME: usize = 64;

/// Where a run takes place: on a graphics card and by the clock on the wall, or in a model of both.
pub trait Backend {
    /// Loads the roots, before the first frame.
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()>;

    /// Takes over what was loaded and lets go of what left; milliseconds that it took.
    fn apply(&mut self, changes: &Changes) -> Result<f64>;

    /// Milliseconds since some fixed moment; for parts of frames.
    fn now_ms(&mut self) -> f64;

    /// Draws nodes; milliseconds that it took.
    fn draw(&mut self, frame: u64, front: &[u32], view: &View) -> Result<Drawn>;

    /// The priorities of a frame were set: loading may go on.
    fn priorities_set(&mut self) {}

    /// Ends a frame that took `frame_ms`, `interval_ms` after the one before at the earliest.
    fn end_frame(
        &mut self,
        residency: &Mutex<Residency>,
        frame_ms: f64,
        interval_ms: f64,
    ) -> Result<()>;

    /// Frame `frame` of the path was logged: a time for what must not be timed.
    fn logged(&mut self, frame: u64) -> Result<()> {
        let _ = frame;
        Ok(())
    }

    /// Stands still while somebody looks at the frame that was drawn last, with its picture where
    /// there is one: nothing is loaded meanwhile, and nothing of it is left behind.
    fn pause_for(&mut self, front: &[u32], view: &View, inspect: &mut Inspect<'_>) -> Result<()> {
        let _ = (front, view);
        inspect(None)
    }

    /// Bytes of the whole process; 0 where that is not measured.
    fn process_bytes(&mut self) -> u64;
}

/// Looks at a picture, where there is one.
pub type Inspect<'a> = dyn FnMut(Option<RgbaImage>) -> Result<()> + 'a;

/// What drawing a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Milliseconds until the picture was complete.
    pub draw_ms: f64,
}

/// What a run needs.
pub struct Replay<'a> {
    /// The hierarchy.
    pub tree: &'a SceneTree,
    /// The camera.
    pub path: &'a CameraPath,
    /// What chooses.
    pub policy: &'a mut dyn Policy,
    /// What is in memory.
    pub residency: Arc<Mutex<Residency>>,
    /// Where it takes place.
    pub backend: &'a mut dyn Backend,
    /// Who looks at its frames, or nobody.
    pub inspector: Option<&'a mut dyn FrameInspector>,
    /// What else determines it.
    pub options: BenchOptions,
    /// Number of levels of the scene.
    pub levels: usize,
}

/// What a run gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// One a frame.
    pub frames: Vec<FrameRecord>,
    /// Bytes in use once the roots were loaded.
    pub start_bytes: u64,
    /// The most bytes that were ever in use, also between frames.
    pub peak_bytes: u64,
}

/// Locks; a thread that died while it held the lock is an error of ours.
pub(super) fn lock(residency: &Mutex<Residency>) -> Result<MutexGuard<'_, Residency>> {
    residency.lock().map_err(|_| Error::Internal("the loading thread died".into()))
}

/// Replays a path; `progress` is told of each frame that is done and ends the run where it says
/// false.
pub fn run(mut replay: Replay<'_>, mut progress: impl FnMut(&FrameRecord) -> bool) -> Result<Run> {
    let roots = replay.tree.roots().to_vec();
    replay.backend.load_roots(&replay.residency, &roots)?;
    let mut state = State::new(&replay);
    {
        let residency = lock(&replay.residency)?;
        state.run.start_bytes = residency.used_bytes();
        state.read_bytes = residency.counters().read_bytes;
    }
    let settle = replay.options.warm_up_frames;
    for _ in 0..settle {
        state.frame(&mut replay, 0)?;
    }
    for index in 0..replay.path.frames.len() {
        let mut record = state.frame(&mut replay, index)?;
        replay.backend.logged(index as u64)?;
        state.inspect(&mut replay, index, &mut record)?;
        let go_on = progress(&record);
        state.run.frames.push(record);
        if !go_on {
            break;
        }
    }
    state.run.peak_bytes = lock(&replay.residency)?.peak_bytes();
    Ok(state.run)
}

/// What is kept from frame to frame.
struct State {
    residents: Residents,
    selection: Selection,
    /// The front of the frame before.
    before: Vec<u32>,
    toggles: ToggleCounter,
    stale: Vec<u32>,
    others: Vec<(u32, f64)>,
    read_bytes: u64,
    evictions: u64,
    run: Run,
}

impl State {
    fn new(replay: &Replay<'_>) -> Self {
        Self {
            residents: Residents::none(replay.tree.len()),
            selection: Selection::default(),
            before: Vec::new(),
            toggles: ToggleCounter::default(),
            stale: Vec::new(),
            others: Vec::new(),
            read_bytes: 0,
            evictions: 0,
            run: Run::default(),
        }
    }

    fn frame(&mut self, replay: &mut Replay<'_>, index: usize) -> Result<FrameRecord> {
        let path_frame = &replay.path.frames[index];
        let view = view(replay, index);
        self.before.clone_from(&self.selection.front);
        let mut record = FrameRecord {
            frame: path_frame.frame,
            time_s: path_frame.time_s,
            nodes_by_level: vec![0; replay.levels],
            triangles_by_level: vec![0; replay.levels],
            ..FrameRecord::default()
        };

        let changes = lock(&replay.residency)?.begin_frame();
        for &node in &changes.left {
            self.residents.set(node, false);
        }
        for &node in &changes.arrived {
            self.residents.set(node, true);
        }
        record.arrived = changes.arrived.len() as u32;
        record.upload_ms = replay.backend.apply(&changes)?;

        let before = replay.backend.now_ms();
        replay.policy.select(replay.tree, &view, &self.residents, &mut self.selection);
        record.select_ms = replay.backend.now_ms() - before;
        self.set_priorities(replay, &view, &mut record)?;
        replay.backend.priorities_set();

        let drawn = replay.backend.draw(index as u64, &self.selection.front, &view)?;
        record.draw_ms = drawn.draw_ms;
        record.actual_ms = record.select_ms + record.draw_ms;
        record.frame_ms = record.actual_ms + record.upload_ms;
        replay.policy.drawn(&FrameOutcome { actual_ms: record.actual_ms });
        self.describe(replay, &mut record);

        let interval_ms = match replay.options.pace {
            Pace::Recorded => interval_ms(replay.path, index),
            Pace::Unthrottled => 0.0,
        };
        replay.backend.end_frame(&replay.residency, record.frame_ms, interval_ms)?;
        self.count(replay, &mut record)?;
        Ok(record)
    }

    /// Lets the inspector look at the frame that is over.
    fn inspect(
        &mut self,
        replay: &mut Replay<'_>,
        index: usize,
        record: &mut FrameRecord,
    ) -> Result<()> {
        let view = view(replay, index);
        let Some(inspector) = replay.inspector.as_mut().filter(|inspector| inspector.wants(index))
        else {
            return Ok(());
        };
        let before = (record.toggles() > 0).then_some(&self.before[..]);
        let front = &self.selection.front[..];
        replay.backend.pause_for(front, &view, &mut |drawn| {
            let sample = FrameSample { frame: record.frame, view: &view, front, before, drawn };
            record.accuracy = Some(inspector.inspect(sample)?);
            Ok(())
        })
    }

    /// Tells residency what matters now.
    fn set_priorities(
        &mut self,
        replay: &Replay<'_>,
        view: &View,
        record: &mut FrameRecord,
    ) -> Result<()> {
        let mut residency = lock(&replay.residency)?;
        residency.stale(STALE_PER_FRAME, &mut self.stale);
        self.others.clear();
        let priority = |&node: &u32| (node, replay.policy.priority(replay.tree, node, view));
        self.others.extend(self.stale.iter().map(priority));
        let Selection { front, priorities, .. } = &self.selection;
        residency.set_priorities(priorities, &self.others);
        residency.set_needed(front.iter().copied());
        if replay.options.selection.all_siblings {
            residency.set_needed(priorities.iter().map(|&(node, _)| node));
        }
        record.waiting = residency.waiting() as u32;
        Ok(())
    }

    fn describe(&mut self, replay: &Replay<'_>, record: &mut FrameRecord) {
        let selection = &self.selection;
        record.estimated_ms = selection.estimated_ms;
        record.estimated_without_feedback_ms = selection.estimated_without_feedback_ms;
        (record.v_time, record.share_ms) = (selection.v_time, selection.share_ms);
        record.covered = selection.covered;
        (record.visited, record.culled) = (selection.visited() as u32, selection.culled);
        record.nodes = selection.front.len() as u32;
        for &node in &selection.front {
            let node = replay.tree.node(node);
            record.triangles += u64::from(node.triangles);
            record.nodes_by_level[node.level as usize] += 1;
            record.triangles_by_level[node.level as usize] += u64::from(node.triangles);
        }
        let toggles = self.toggles.count(replay.tree, &selection.front);
        (record.toggles_up, record.toggles_down) = (toggles.up, toggles.down);
    }

    fn count(&mut self, replay: &mut Replay<'_>, record: &mut FrameRecord) -> Result<()> {
        let residency = lock(&replay.residency)?;
        let counters = residency.counters();
        record.read_bytes = counters.read_bytes - self.read_bytes;
        record.evictions = counters.evictions - self.evictions;
        (self.read_bytes, self.evictions) = (counters.read_bytes, counters.evictions);
        record.memory_bytes = residency.used_bytes();
        record.resident = residency.resident() as u32;
        drop(residency);
        record.process_bytes = replay.backend.process_bytes();
        Ok(())
    }
}

/// The camera of a frame.
fn view(replay: &Replay<'_>, index: usize) -> View {
    let pose = replay.path.frames[index].pose;
    View::new(pose, replay.path.velocity(index), replay.options.size.0)
}

/// Milliseconds from a frame to the next, as recorded; the last lasts as long as the one before.
fn interval_ms(path: &CameraPath, index: usize) -> f64 {
    let last = path.frames.len() - 1;
    let from = index.min(last.saturating_sub(1));
    let to = (from + 1).min(last);
    (path.frames[to].time_s - path.frames[from].time_s) * 1e3
}
