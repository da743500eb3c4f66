//! The loop of a frame: choose, load, draw, report.

use std::sync::{Arc, Mutex, MutexGuard};

use super::choosing::Choosing;
use super::margin::Margin;
use super::predict::predict;
use super::settling::Settling;
use super::steady::Steady;
use super::uploads::Uploads;
use super::{
    Backend, CostModel, CoveredParts, FarField, FarFieldMode, FarShown, FrameEstimate, FrameInput,
    FrameOutcome, FrameReport, FrontCheck, FrontLoad, HiddenNodes, Inspect, Load, Occluders,
    Policy, PredictedView, Residents, SeenAreas, Selection, ToggleCauses, Visibility,
    geometry_load,
};
use crate::camera::{Pose, View};
use crate::format::cells::Cells;
use crate::runtime::residency::{Changes, Counters, MemoryUse, Residency};
use crate::runtime::{SceneTree, ToggleCounter};
use crate::{Error, Result};

/// No more seconds than this are said to have passed between frames: a machine that slept or stalled,
/// or whose clock jumped, has seen nothing meanwhile that it should forget anything for.
const LONGEST_STEP_S: f64 = 1.0;

/// Occluders are cut before the eye at this part of the scene's diagonal, so that scenes in any unit are
/// alike.
const NEAR: f64 = 1e-5;

/// What policies see, apart from the view.
struct Seen<'a> {
    tree: &'a SceneTree,
    visibility: Visibility,
    covered: CoveredParts,
    seen: Option<SeenAreas>,
    hidden: Option<HiddenNodes>,
    predicted: Vec<PredictedView>,
    residents: Residents,
    memory: MemoryUse,
    steady: Steady,
    target_ms: f64,
    /// What the far field takes of the frame, milliseconds.
    far_ms: f64,
    /// What drawing takes where all is as coarse as can be, milliseconds.
    least_ms: f64,
    /// Seconds since the frame before began.
    dt_s: f64,
}

impl Seen<'_> {
    fn from<'a>(&'a self, view: &'a View) -> FrameInput<'a> {
        FrameInput {
            tree: self.tree,
            view,
            visibility: &self.visibility,
            covered: &self.covered,
            seen: self.seen.as_ref(),
            hidden: self.hidden.as_ref(),
            predicted: &self.predicted,
            residents: &self.residents,
            memory: self.memory,
            costs: self.steady.costs(),
            target_ms: (self.target_ms - self.far_ms).max(0.0),
            budget_ms: (self.budget_ms() - self.far_ms).max(0.0),
            dt_s: self.dt_s,
        }
    }

    /// What drawing may be expected to take, far field included.
    fn budget_ms(&self) -> f64 {
        self.steady.budget_ms(self.target_ms, self.least_ms)
    }
}

/// Draws frame after frame of a scene.
pub struct Engine<'a> {
    seen: Seen<'a>,
    policy: &'a mut dyn Policy,
    residency: Arc<Mutex<Residency>>,
    backend: &'a mut dyn Backend,
    costs: CostModel,
    choosing: Choosing,
    uploads: Uploads,
    margin: Margin,
    settling: Settling,
    front_load: FrontLoad,
    far_field: Option<FarField>,
    far_requests: Vec<(u32, f64)>,
    /// The part of the picture that the nodes of the frame before covered, 0 to 1.
    covered: f64,
    /// Roots in view.
    roots: Vec<u32>,
    /// What the frame before drew, and took.
    drawn: Vec<u32>,
    /// The same with the faces of the far field.
    drawn_with_faces: Vec<u32>,
    load: Load,
    /// The camera of the frame before.
    pose: Option<Pose>,
    selection: Selection,
    /// The front of the frame before.
    before: Vec<u32>,
    toggles: ToggleCounter,
    check: FrontCheck,
    stale: Vec<u32>,
    others: Vec<(u32, f64)>,
    /// Counters of residency after the frame before.
    counters: Counters,
    frames: u64,
    levels: usize,
    start_bytes: u64,
}

/// Locks; a thread that died while it held the lock is an error of ours.
pub fn lock(residency: &Mutex<Residency>) -> Result<MutexGuard<'_, Residency>> {
    residency.lock().map_err(|_| Error::Internal("a loading thread died".into()))
}

impl<'a> Engine<'a> {
    /// Loads the roots of a scene, of which a frame may take `target_ms`; `costs` is what is
    /// expected of frames at first.
    pub fn start(
        tree: &'a SceneTree,
        policy: &'a mut dyn Policy,
        residency: Arc<Mutex<Residency>>,
        backend: &'a mut dyn Backend,
        costs: CostModel,
        target_ms: f64,
    ) -> Result<Self> {
        backend.load_roots(&residency, tree.roots())?;
        let (memory, counters) = {
            let residency = lock(&residency)?;
            (residency.memory_use(), residency.counters())
        };
        let mut margin = Margin::default();
        Ok(Self {
            seen: Seen {
                tree,
                visibility: Visibility::default(),
                covered: CoveredParts::default(),
                seen: None,
                hidden: None,
                predicted: Vec::new(),
                residents: Residents::none(tree.len()),
                memory,
                steady: Steady::new(&costs, margin.ratio()),
                target_ms,
                far_ms: 0.0,
                least_ms: 0.0,
                dt_s: 0.0,
            },
            uploads: Uploads::new(costs.prices().uploaded_byte),
            policy,
            residency,
            backend,
            costs,
            choosing: Choosing::default(),
            margin,
            settling: Settling::default(),
            front_load: FrontLoad::default(),
            far_field: None,
            far_requests: Vec::new(),
            covered: 0.0,
            roots: Vec::new(),
            drawn: Vec::new(),
            drawn_with_faces: Vec::new(),
            load: Load::default(),
            pose: None,
            selection: Selection::default(),
            before: Vec::new(),
            toggles: ToggleCounter::default(),
            check: FrontCheck::default(),
            stale: Vec::new(),
            others: Vec::new(),
            counters,
            frames: 0,
            levels: tree.levels(),
            start_bytes: memory.used_bytes,
        })
    }

    /// Finds out how much of nodes is seen past these, where the policy asks for it.
    pub fn look_past(&mut self, occluders: Arc<Occluders>) {
        if self.policy.wants_seen_areas() {
            let near = NEAR * self.seen.tree.diagonal();
            self.seen.seen = Some(SeenAreas::new(occluders, near));
        }
    }

    /// Draws nothing that what is before it hides; nothing nearer than `near` metres is drawn.
    pub fn cull_hidden(&mut self, near: f64) {
        let mut hidden = HiddenNodes::new(self.seen.tree.len(), near);
        for &root in self.seen.tree.roots() {
            hidden.set(root, self.backend.occlusion(root));
        }
        self.seen.hidden = Some(hidden);
    }

    /// Draws what is far from the faces of cells, or where that pays. Residency must know of them:
    /// [`Sizes::with_faces`](crate::runtime::residency::Sizes::with_faces).
    pub fn draw_far_from(&mut self, cells: Arc<Cells>, mode: FarFieldMode) {
        let nodes = self.seen.tree.len();
        self.seen.residents.grow(nodes + cells.faces.len());
        self.far_field = FarField::new(cells, nodes as u32, mode);
    }

    /// Draws a frame. The next begins `interval_s` seconds after this one began, at the earliest.
    /// A view that is not [finite](View::is_finite) is refused.
    pub fn frame(&mut self, view: &View, interval_s: f64) -> Result<FrameReport> {
        if !view.is_finite() {
            let Pose { position, rotation, fov_y_deg } = view.pose;
            return Err(Error::Usage(format!(
                "camera: expected finite numbers, found a position of {position}, a rotation of \
                 {rotation} and an angle of view of {fov_y_deg}°"
            )));
        }
        self.before.clone_from(&self.selection.front);
        let without_scene = !self.seen.tree.is_in_view(view);
        let mut report = FrameReport { without_scene, ..FrameReport::default() };

        let changes = self.begin_frame(&mut report)?;
        report.upload_ms = self.backend.apply(&changes)?;
        self.uploads.observe(changes.arrived_bytes, report.upload_ms, self.seen.dt_s);
        if !self.settling.has_ended() {
            // Frames of the loading phase are late whatever they draw, and not like those after it.
            self.uploads.forget_frames();
        }
        self.hold_occlusion(&changes);
        let seen = &mut self.seen;
        predict(self.pose.as_ref(), view, seen.dt_s, &mut seen.predicted);
        let view = &self.look_far(view);
        let seen = &mut self.seen;
        seen.visibility.begin_frame(seen.tree.len());
        seen.covered.begin_frame(seen.tree.len());
        let is_still =
            changes.arrived.is_empty() && self.pose == Some(view.pose) && self.margin.is_known();
        let beside_ms = self.choosing.expected_ms() + self.uploads.reserve_ms(seen.target_ms);
        seen.steady.follow(&self.costs, beside_ms, self.margin.ratio(), &self.load, is_still);

        let before = self.backend.now_ms();
        self.choose(view);
        report.select_ms = self.backend.now_ms() - before;
        let front = &self.selection.front;
        self.check.check(self.seen.tree, front, view, &self.seen.residents).map_err(|fault| {
            let (policy, frame) = (self.policy.name(), self.frames);
            Error::Internal(format!("policy {policy}, frame {frame}: {fault}"))
        })?;
        self.set_requests(view, &mut report)?;
        self.backend.priorities_set();
        self.weigh_far(view);

        self.drawn_with_faces.clone_from(&self.drawn);
        if let Some(far_field) = &self.far_field {
            self.drawn_with_faces.extend(&far_field.shown().faces);
        }
        let drawn = self.backend.draw(&self.drawn_with_faces, view)?;
        (report.draw_ms, report.gpu_ms) = (drawn.draw_ms, drawn.gpu_ms);
        report.actual_ms = report.select_ms + report.draw_ms;
        report.frame_ms = report.actual_ms + report.upload_ms;
        self.estimate(view, &changes, &mut report);
        let &FrameReport { actual_ms, frame_ms, .. } = &report;
        self.policy.drawn(&FrameOutcome { actual_ms, frame_ms });
        self.describe(view, &changes, &mut report);

        self.backend.end_frame(&self.residency, report.frame_ms, interval_s * 1e3)?;
        self.count(&mut report)?;
        self.frames += 1;
        // What is no number says nothing.
        let step_s = (report.frame_ms / 1e3).max(interval_s).max(0.0);
        self.seen.dt_s = step_s.min(LONGEST_STEP_S);
        self.pose = Some(view.pose);
        Ok(report)
    }

    /// Chooses a front, and what has to be drawn of it.
    fn choose(&mut self, view: &View) {
        let Seen { tree, dt_s, .. } = self.seen;
        if let Some(seen) = &mut self.seen.seen {
            seen.look(tree, &view.within(None), dt_s);
        }
        let mut took_ms = 0.0;
        if let Some(hidden) = &mut self.seen.hidden {
            took_ms -= self.backend.now_ms();
            hidden.begin_frame(view, dt_s);
            took_ms += self.backend.now_ms();
        }
        self.seen.least_ms = self.least_ms(view);
        self.policy.select(&self.seen.from(view), &mut self.selection);
        let front = &self.selection.front;
        self.drawn.clear();
        let Some(hidden) = &mut self.seen.hidden else {
            self.drawn.extend(front);
            return;
        };
        took_ms -= self.backend.now_ms();
        hidden.count_on(&self.selection.counted_on);
        self.drawn.extend(hidden.drawn(tree, front, view));
        took_ms += self.backend.now_ms();
        let costs = self.seen.steady.costs();
        let sum_ms = |nodes: &[u32]| -> f64 {
            nodes.iter().map(|&node| costs.added_ms(&geometry_load(tree.node(node)))).sum()
        };
        hidden.weigh(took_ms, sum_ms(front) - sum_ms(&self.drawn));
    }

    /// What drawing takes where all is as coarse as can be, milliseconds.
    fn least_ms(&mut self, view: &View) -> f64 {
        let Seen { tree, steady, covered, .. } = &self.seen;
        let is_in_view = |&root: &u32| view.frustum.outside(tree.node(root).bbox) <= 0.0;
        self.roots.clear();
        self.roots.extend(tree.roots().iter().copied().filter(is_in_view));
        steady.costs().priced_ms(&self.front_load.of(tree, &self.roots, view, covered, 0))
    }

    /// The view without what faces show of it, and as much of those that are expected.
    fn look_far(&mut self, view: &View) -> View {
        let Some(far_field) = &mut self.far_field else { return *view };
        let seen = &mut self.seen;
        far_field.look(view, &seen.residents);
        for at in &mut seen.predicted {
            *at = far_field.expected(at);
        }
        seen.far_ms = seen.steady.costs().added_ms(&far_field.load(view, self.covered));
        view.within(far_field.shown().cull_box)
    }

    /// Weighs, now and then, whether faces pay.
    fn weigh_far(&mut self, view: &View) {
        let (Some(far_field), seen) = (&mut self.far_field, &self.seen) else { return };
        if far_field.is_due(seen.dt_s, seen.hidden.as_ref()) {
            let whole = view.within(None);
            let budget_ms = seen.budget_ms();
            let frame = FrameInput { budget_ms, ..seen.from(&whole) };
            far_field.weigh(&frame, &self.selection.front, self.covered);
        }
    }

    /// Takes over what arrived and lets go of what left.
    fn begin_frame(&mut self, report: &mut FrameReport) -> Result<Changes> {
        let upload_bytes = self.upload_bytes();
        let mut residency = lock(&self.residency)?;
        residency.limit_uploads(upload_bytes);
        let changes = residency.begin_frame(self.seen.dt_s);
        for &node in &changes.left {
            self.seen.residents.set(node, false);
        }
        for &node in &changes.arrived {
            self.seen.residents.set(node, true);
        }
        self.seen.residents.set_coming(residency.coming());
        self.seen.memory = residency.memory_use();
        report.arrived = changes.arrived.len() as u32;
        report.uploaded_bytes = changes.arrived_bytes;
        Ok(changes)
    }

    /// Bytes that there is time to upload beside what the frame before drew; any number until the
    /// first view is in memory.
    fn upload_bytes(&self) -> u64 {
        if !self.settling.has_ended() {
            return u64::MAX;
        }
        let drawing_ms = self.choosing.expected_ms() + self.costs.estimate(&self.load).mean_ms;
        self.uploads.limit_bytes(self.seen.target_ms, drawing_ms)
    }

    /// Knows what the nodes in memory hide, and of no others.
    fn hold_occlusion(&mut self, changes: &Changes) {
        let Some(hidden) = &mut self.seen.hidden else { return };
        // Faces hide nothing.
        let nodes = self.seen.tree.len() as u32;
        let left = changes.left.iter().filter(|&&node| node < nodes);
        left.for_each(|&node| hidden.set(node, None));
        let arrived = changes.arrived.iter().filter(|&&node| node < nodes);
        arrived.for_each(|&node| hidden.set(node, self.backend.occlusion(node)));
    }

    /// Sets what was expected of a frame beside what it took, and learns from it.
    fn estimate(&mut self, view: &View, changes: &Changes, report: &mut FrameReport) {
        let (costs, &Seen { tree, target_ms, least_ms, dt_s, ref steady, ref covered, .. }) =
            (&mut self.costs, &self.seen);
        let mut whole = self.front_load.of(tree, &self.drawn, view, covered, changes.arrived_bytes);
        let [width, height] = view.size.map(f64::from);
        self.covered = (whole.plain_fragments + whole.textured_fragments) / (width * height);
        if let Some(far_field) = &self.far_field {
            whole += far_field.load(view, self.covered);
        }
        let drawn = Load { uploaded_bytes: 0.0, ..whole };
        let choosing_ms = self.choosing.expected_ms();
        let modelled = costs.estimate(&whole);
        (report.modelled_ms, report.modelled_deviation_ms) =
            (choosing_ms + modelled.mean_ms, modelled.deviation_ms);
        let estimate = self.selection.estimate.unwrap_or_else(|| FrameEstimate {
            ms: choosing_ms + costs.estimate(&drawn).mean_ms,
            without_feedback_ms: costs.expected_ms(&drawn),
        });
        report.estimated_ms = estimate.ms;
        report.estimated_without_feedback_ms = estimate.without_feedback_ms;
        report.loading_phase = !self.settling.is_over(report.arrived, report.waiting, dt_s);
        if !report.loading_phase {
            let expected_ms = choosing_ms + costs.priced_ms(&drawn);
            let frame_ms = steady.frame_ms(target_ms, least_ms);
            // Time for uploads is kept free apart from this.
            self.margin.observe(expected_ms, report.actual_ms, frame_ms, dt_s);
        }
        costs.observe(&whole, report.frame_ms - report.select_ms, report.gpu_ms, dt_s);
        self.choosing.observe(report.select_ms, dt_s);
        self.load = drawn;
    }

    /// Sets the memory cap, bytes: by the end of the next frame no more is in use. The least useful
    /// nodes leave, from the finest upward, even where they were drawn: their ancestors are in their
    /// place. A cap below what the roots need is refused, and the old one stays.
    pub fn set_max_memory(&mut self, bytes: u64) -> Result<()> {
        lock(&self.residency)?.set_max_memory(bytes)
    }

    /// Nodes that the last frame drew.
    pub fn drawn(&self) -> &[u32] {
        &self.drawn
    }

    /// What it showed of what is far.
    pub fn far_shown(&self) -> FarShown {
        self.far_field.as_ref().map(|far_field| far_field.shown().clone()).unwrap_or_default()
    }

    /// What the frame before showed of it, where that was of another cell, or was the hierarchy alone.
    pub fn far_shown_before(&self) -> Option<FarShown> {
        self.far_field.as_ref()?.shown_before().cloned()
    }

    /// Nodes of its front that it did not draw, since those drawn hide them.
    pub fn hidden(&self) -> Vec<u32> {
        // What is drawn is in the front's order.
        let mut drawn = self.drawn.iter().peekable();
        let is_hidden = |node: &u32| drawn.next_if_eq(&node).is_none();
        self.selection.front.iter().copied().filter(is_hidden).collect()
    }

    /// The front of the frame before it.
    pub fn front_before(&self) -> &[u32] {
        &self.before
    }

    /// Pauses loading while the last frame is inspected, with its image where there is one.
    pub fn inspect(&mut self, view: &View, inspect: &mut Inspect<'_>) -> Result<()> {
        self.backend.pause_for(&self.drawn_with_faces, view, inspect)
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

    /// Bytes that all nodes would take in memory.
    pub fn scene_bytes(&self) -> Result<u64> {
        Ok(lock(&self.residency)?.scene_bytes())
    }

    /// The most bytes that were ever in use, also between frames, under whatever cap.
    pub fn peak_bytes(&self) -> Result<u64> {
        Ok(lock(&self.residency)?.peak_bytes())
    }

    /// Tells residency what matters now.
    fn set_requests(&mut self, view: &View, report: &mut FrameReport) -> Result<()> {
        let mut residency = lock(&self.residency)?;
        residency.stale(&mut self.stale);
        self.others.clear();
        let input = self.seen.from(view);
        let nodes = self.seen.tree.len() as u32;
        let utility = |&node: &u32| match node < nodes {
            true => (node, self.policy.utility(&input, node)),
            // A face that is not wanted is of no use.
            false => (node, 0.0),
        };
        self.others.extend(self.stale.iter().map(utility));
        let Selection { front, requests, ahead, released, keep_visited, .. } = &self.selection;
        residency.set_priorities(requests, &self.others);
        if let Some(far_field) = &self.far_field {
            let most = requests.iter().fold(0.0, |most: f64, request| most.max(request.1));
            self.far_requests.clear();
            far_field.requests(view, &self.seen.predicted, most, &mut self.far_requests);
            residency.set_faces(&self.far_requests);
        }
        residency.set_ahead(ahead);
        residency.set_needed(front.iter().copied());
        if *keep_visited {
            residency.set_needed(requests.iter().map(|&(node, _)| node));
        }
        residency.release(released);
        report.waiting = residency.waiting() as u32;
        Ok(())
    }

    fn describe(&mut self, view: &View, changes: &Changes, report: &mut FrameReport) {
        let selection = &self.selection;
        report.diagnostics.clone_from(&selection.diagnostics);
        (report.visited, report.culled) = (selection.visited() as u32, selection.culled);
        report.lacking = selection.lacking;
        report.nodes = self.drawn.len() as u32;
        report.hidden_nodes = selection.front.len() as u32 - report.nodes;
        let triangles = |nodes: &[u32]| -> u64 {
            nodes.iter().map(|&node| u64::from(self.seen.tree.node(node).triangles)).sum()
        };
        report.hidden_triangles = triangles(&selection.front) - triangles(&self.drawn);
        report.nodes_by_level = vec![0; self.levels];
        report.triangles_by_level = vec![0; self.levels];
        for &node in &self.drawn {
            let node = self.seen.tree.node(node);
            report.triangles += u64::from(node.triangles);
            report.nodes_by_level[node.level as usize] += 1;
            report.triangles_by_level[node.level as usize] += u64::from(node.triangles);
        }
        let toggles = self.toggles.count(self.seen.tree, &selection.front);
        (report.toggles_up, report.toggles_down) = (toggles.up, toggles.down);
        let frame = self.seen.from(view);
        report.toggle_causes = ToggleCauses::of(&frame, &self.toggles, changes);
        if let Some(far_field) = &self.far_field {
            report.faces = far_field.shown().faces.len() as u32;
            report.far_changed = far_field.shown_before().is_some();
            report.face_triangles = far_field.triangles();
        }
        report.finer_resident = self.drawn.iter().any(|&node| frame.can_refine(node));
    }

    fn count(&mut self, report: &mut FrameReport) -> Result<()> {
        let residency = lock(&self.residency)?;
        let counters = residency.counters();
        report.read_bytes = counters.read_bytes - self.counters.read_bytes;
        report.reread_bytes = counters.reread_bytes - self.counters.reread_bytes;
        report.evictions = counters.evictions - self.counters.evictions;
        self.counters = counters;
        report.memory_bytes = residency.used_bytes();
        report.resident = residency.resident() as u32;
        Ok(())
    }
}
