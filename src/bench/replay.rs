//! The loop over the frames of a path.

use std::sync::{Arc, Mutex};

use super::{BenchOptions, FrameInspector, FrameRecord, FrameSample, Pace};
use crate::Result;
use crate::camera::{CameraPath, View};
use crate::engine::{Backend, CostModel, Engine, Occluders, Policy};
use crate::format::cells::Cells;
use crate::runtime::SceneTree;
use crate::runtime::residency::Residency;

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
    /// What frames are expected to take at first.
    pub costs: CostModel,
    /// What hides what, where that is to be known.
    pub occluders: Option<Arc<Occluders>>,
    /// What is drawn of what is far, where cells are.
    pub cells: Option<Arc<Cells>>,
    /// Who inspects its frames, or nobody.
    pub inspector: Option<&'a mut dyn FrameInspector>,
    /// What else determines it.
    pub options: BenchOptions,
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
    /// Bytes that all nodes would take.
    pub scene_bytes: u64,
}

/// Replays a path; `progress` is told of each frame that is done and ends the run where it says
/// false.
pub fn run(replay: Replay<'_>, mut progress: impl FnMut(&FrameRecord) -> bool) -> Result<Run> {
    let Replay {
        tree,
        path,
        policy,
        residency,
        backend,
        costs,
        occluders,
        cells,
        mut inspector,
        options,
    } = replay;
    let mut engine = Engine::start(tree, policy, residency, backend, costs, options.target_ms)?;
    if let Some(occluders) = occluders {
        engine.look_past(occluders);
    }
    if let Some(cells) = cells {
        engine.draw_far_from(cells, options.far_field);
    }
    if options.cull_hidden {
        engine.cull_hidden(tree.near_plane().into());
    }
    let view =
        |index: usize| View::new(path.frames[index].pose, path.velocity(index), options.size.0);
    let interval_s = |index: usize| match options.pace {
        Pace::Recorded => path.interval_s(index),
        Pace::Unthrottled => 0.0,
    };
    for _ in 0..options.warm_up_frames {
        engine.frame(&view(0), interval_s(0))?;
    }
    let mut frames = Vec::new();
    for (index, at) in path.frames.iter().enumerate() {
        let view = view(index);
        let report = engine.frame(&view, interval_s(index))?;
        let process_bytes = engine.process_bytes();
        let mut record = FrameRecord {
            frame: at.frame,
            time_s: at.time_s,
            report,
            process_bytes,
            accuracy: None,
        };
        engine.logged(index as u64)?;
        let toggled = record.report.toggles() > 0 || record.report.far_changed;
        if let Some(inspector) = inspector.as_mut().filter(|at| at.wants(index, toggled)) {
            let (front, before) = (engine.drawn().to_vec(), engine.front_before().to_vec());
            let hidden = engine.hidden();
            let (far, far_before) = (engine.far_shown(), engine.far_shown_before());
            let (far, far_before) = (&far, far_before.as_ref());
            let (front, before) = (&front[..], toggled.then_some(&before[..]));
            engine.inspect(&view, &mut |drawn| {
                let (frame, hidden) = (record.frame, &hidden[..]);
                let sample = FrameSample {
                    frame,
                    view: &view,
                    loading_phase: record.report.loading_phase,
                    front,
                    far,
                    hidden,
                    before,
                    far_before,
                    drawn,
                };
                record.accuracy = Some(inspector.inspect(sample)?);
                Ok(())
            })?;
        }
        let go_on = progress(&record);
        frames.push(record);
        if !go_on {
            break;
        }
    }
    let [peak_bytes, scene_bytes] = [engine.peak_bytes()?, engine.scene_bytes()?];
    Ok(Run { frames, start_bytes: engine.start_bytes(), peak_bytes, scene_bytes })
}
