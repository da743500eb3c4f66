//! Runs by the model clock in which single frames go wrong, beside runs in which none does.

use std::ops::Range;
use std::sync::{Arc, Mutex};

use glam::DVec3;
use hlod::bench::{ClockConstants, ModelBackend, ModelFiles, PolicyChoice, Session};
use hlod::camera::{Pose, View, from_angles};
use hlod::engine::policies::{POLICIES, Settings};
use hlod::engine::{
    Backend, CostModel, Drawn, Engine, FrameReport, NodeOcclusion, Occluders, Prices,
};
use hlod::format::Scene;
use hlod::mesh::UpAxis;
use hlod::render::content::TextureFormat;
use hlod::runtime::SceneTree;
use hlod::runtime::residency::{Changes, Residency, ResidencyOptions, Sizes};
use hlod::{Error, Result};

use crate::bench_support::city;
use crate::tall_street::street;

/// Seconds from a frame to the next, unless one takes longer.
pub const FRAME_S: f64 = 1.0 / 30.0;

/// Frames of a second.
pub const SECOND: usize = 30;

/// A frame is late that takes so many times the target.
pub const LATE: f64 = 1.1;

/// What goes wrong in a frame.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Milliseconds by which drawing takes longer.
    pub stall_ms: f64,
    /// Milliseconds that drawing is said to take, whatever it takes.
    pub said_ms: Option<f64>,
    /// Seconds from this frame to the next, at least; none in runs that are not throttled.
    pub interval_s: f64,
    /// The memory cap from this frame on, bytes.
    pub cap_bytes: Option<u64>,
}

impl Default for Fault {
    fn default() -> Self {
        Self { stall_ms: 0.0, said_ms: None, interval_s: FRAME_S, cap_bytes: None }
    }
}

/// The model clock, but for the fault of the frame at hand.
struct FaultyBackend<'a> {
    model: ModelBackend<'a>,
    fault: Arc<Mutex<Fault>>,
}

impl Backend for FaultyBackend<'_> {
    fn load_roots(&mut self, residency: &Mutex<Residency>, roots: &[u32]) -> Result<()> {
        self.model.load_roots(residency, roots)
    }

    fn apply(&mut self, changes: &Changes) -> Result<f64> {
        self.model.apply(changes)
    }

    fn now_ms(&mut self) -> f64 {
        self.model.now_ms()
    }

    fn draw(&mut self, front: &[u32], view: &View) -> Result<Drawn> {
        let drawn = self.model.draw(front, view)?;
        let Fault { stall_ms, said_ms, .. } = *self.fault.lock().unwrap();
        Ok(Drawn { draw_ms: said_ms.unwrap_or(drawn.draw_ms + stall_ms), ..drawn })
    }

    fn occlusion(&mut self, node: u32) -> Option<Arc<NodeOcclusion>> {
        self.model.occlusion(node)
    }

    fn end_frame(&mut self, residency: &Mutex<Residency>, ms: f64, interval: f64) -> Result<()> {
        // A loader has no more time than passes, whatever a clock says of it.
        let ms = if ms.is_finite() { ms.clamp(0.0, 1e4) } else { 0.0 };
        self.model.end_frame(residency, ms, interval.clamp(0.0, 1e4))
    }

    fn process_bytes(&mut self) -> u64 {
        0
    }
}

/// A scene, and a machine on which about half of it can be drawn in time.
pub struct Ground {
    pub name: &'static str,
    pub tree: SceneTree,
    pub sizes: Sizes,
    pub target_ms: f64,
    /// On a surface.
    pub wall: DVec3,
    /// Bytes a second.
    pub upload_bytes_per_s: u64,
    pub constants: ClockConstants,
    occluders: Option<Arc<Occluders>>,
    files: Option<Arc<ModelFiles>>,
}

/// What frames are like: noise of 2 %.
fn constants(triangle: f64, load_bytes_per_ms: f64) -> ClockConstants {
    let prices = Prices { triangle, ..ClockConstants::default().prices };
    ClockConstants { prices, noise: 0.02, load_bytes_per_ms, ..ClockConstants::default() }
}

impl Ground {
    /// The city of the other tests, with all that hides.
    pub fn city() -> Self {
        let session = Session::open(city()).unwrap();
        let mut occluders = Occluders::default();
        let mut wall = DVec3::ZERO;
        for &root in session.tree().roots() {
            let mesh = session.files().read_mesh(root).unwrap();
            occluders.add(root, session.tree().node(root).bbox, &mesh);
            let corners = mesh.primitives[0].positions.iter().take(3);
            let corners =
                corners.map(|&at| DVec3::from(mesh.origin) + DVec3::from(at.map(f64::from)));
            wall = corners.sum::<DVec3>() / 3.0;
        }
        Self {
            name: "city",
            tree: session.tree().clone(),
            sizes: session.sizes(TextureFormat::Rgba8),
            target_ms: 20.0,
            wall,
            upload_bytes_per_s: ResidencyOptions::DEFAULT.upload_bytes_per_s,
            constants: constants(4e-3, 2_000.0),
            occluders: Some(Arc::new(occluders)),
            files: Some(Arc::new(ModelFiles::new(session.files()))),
        }
    }

    /// Twelve houses of 1,365 nodes each.
    pub fn street() -> Self {
        let scene: Scene = street(12, 5);
        Self {
            name: "street",
            tree: SceneTree::new(&scene),
            sizes: Sizes::new(&scene, |vertices, _, _| u64::from(vertices) * 24, |_| 0),
            target_ms: 20.0,
            wall: DVec3::new(32.0, 9.0, 1.0),
            upload_bytes_per_s: ResidencyOptions::DEFAULT.upload_bytes_per_s,
            constants: constants(1e-3, 1_000.0),
            occluders: None,
            files: None,
        }
    }

    /// A camera somewhere in the box around everything, 0 to 1 along each axis, beyond it outside.
    pub fn pose(&self, at: [f64; 3], yaw_deg: f64, pitch_deg: f64) -> Pose {
        let boxes = || self.tree.roots().iter().map(|&root| self.tree.node(root).bbox);
        let least = boxes().map(|bbox| bbox[0]).reduce(DVec3::min).unwrap();
        let most = boxes().map(|bbox| bbox[1]).reduce(DVec3::max).unwrap();
        let position = least + DVec3::from(at) * (most - least);
        Pose {
            position,
            rotation: from_angles(UpAxis::Z, yaw_deg, pitch_deg, 0.0),
            fov_y_deg: 60.0,
        }
    }

    /// A walk along the scene, looking about.
    pub fn walk(&self, frame: usize) -> Pose {
        let time_s = frame as f64 * FRAME_S;
        self.pose([0.1 + 0.01 * time_s, 0.4, 0.6], 20.0 * libm::sin(time_s / 3.0), -8.0)
    }

    /// Residency of a policy's own.
    fn residency(&self, cap_bytes: u64) -> Residency {
        let options = ResidencyOptions {
            max_memory_bytes: cap_bytes,
            upload_bytes_per_s: self.upload_bytes_per_s,
            ..ResidencyOptions::default()
        };
        Residency::new(&self.tree, self.sizes.clone(), options).unwrap()
    }

    /// Bytes that everything takes, with room to load it.
    pub fn all_bytes(&self) -> u64 {
        let nodes = self.sizes.nodes.iter().map(|size| size.held_bytes + size.file_bytes);
        let textures = self.sizes.textures.iter().map(|size| size.held_bytes + size.file_bytes);
        nodes.sum::<u64>() + textures.sum::<u64>()
    }

    /// The least cap that there may be.
    pub fn least_bytes(&self) -> u64 {
        let options = ResidencyOptions { max_memory_bytes: 0, ..ResidencyOptions::default() };
        let refused = Residency::new(&self.tree, self.sizes.clone(), options).unwrap_err();
        assert!(matches!(refused, Error::Usage(_)), "{refused}");
        let text = refused.to_string();
        let (_, after) = text.split_once("at least ").unwrap();
        after.split_once(" bytes").unwrap().0.parse().unwrap()
    }
}

/// Frames of a run, and the most bytes that were ever in use.
pub struct Frames {
    pub reports: Vec<FrameReport>,
    pub peak_bytes: u64,
    /// Caps that were refused.
    pub refused: Vec<Error>,
    target_ms: f64,
}

/// A run of a policy: `pose` and `fault` are those of each frame. Every front is checked by the engine.
pub fn frames(
    ground: &Ground,
    policy: &str,
    count: usize,
    cap_bytes: u64,
    pose: impl Fn(usize) -> Pose,
    fault: impl Fn(usize) -> Fault,
) -> Frames {
    let choice = PolicyChoice::new(policy, &Settings::new()).unwrap();
    let mut policy = choice.make().unwrap();
    let residency = Arc::new(Mutex::new(ground.residency(cap_bytes)));
    let model = ModelBackend::new(&ground.tree, ground.constants, 1);
    let model = match &ground.files {
        Some(files) => model.with_files(Arc::clone(files), true),
        None => model,
    };
    let at_hand = Arc::new(Mutex::new(Fault::default()));
    let mut backend = FaultyBackend { model, fault: Arc::clone(&at_hand) };
    let costs = CostModel::new(&ground.constants.prices);
    let (tree, target_ms) = (&ground.tree, ground.target_ms);
    let mut engine =
        Engine::start(tree, &mut *policy, residency, &mut backend, costs, target_ms).unwrap();
    if let Some(occluders) = &ground.occluders {
        engine.look_past(Arc::clone(occluders));
    }
    engine.cull_hidden(tree.near_plane().into());
    let (mut reports, mut refused) = (Vec::new(), Vec::new());
    for frame in 0..count {
        let fault = fault(frame);
        *at_hand.lock().unwrap() = fault;
        refused.extend(fault.cap_bytes.and_then(|bytes| engine.set_max_memory(bytes).err()));
        let before = pose(frame.saturating_sub(1));
        let now = pose(frame);
        let velocity = (now.position - before.position) / FRAME_S;
        let report = engine.frame(&View::new(now, velocity, [1280, 720]), fault.interval_s);
        let name = ground.name;
        reports.push(report.unwrap_or_else(|error| panic!("{name}, frame {frame}: {error}")));
    }
    let peak_bytes = engine.peak_bytes().unwrap();
    Frames { reports, peak_bytes, refused, target_ms }
}

/// How a camera that is nowhere is refused.
pub fn refused_view(ground: &Ground, pose: Pose) -> Error {
    let (mut policy, tree) = (POLICIES[0].make(&Settings::new()).unwrap(), &ground.tree);
    let residency = Arc::new(Mutex::new(ground.residency(1 << 30)));
    let mut backend = ModelBackend::new(tree, ground.constants, 1);
    let costs = CostModel::new(&ground.constants.prices);
    let mut engine =
        Engine::start(tree, &mut *policy, residency, &mut backend, costs, 20.0).unwrap();
    engine.frame(&View::new(pose, DVec3::ZERO, [1280, 720]), FRAME_S).unwrap_err()
}

impl Frames {
    /// Frames of a range that are late.
    pub fn late(&self, range: Range<usize>) -> usize {
        let late_ms = LATE * self.target_ms;
        self.reports[range].iter().filter(|frame| frame.frame_ms > late_ms).count()
    }

    /// Toggles of a range.
    pub fn toggles(&self, range: Range<usize>) -> u32 {
        self.reports[range].iter().map(FrameReport::toggles).sum()
    }

    /// Those of them that nothing in memory brought about.
    pub fn chosen(&self, range: Range<usize>) -> u32 {
        self.reports[range].iter().map(|frame| frame.toggle_causes.chosen).sum()
    }

    /// Mean over a range of the triangles of the front.
    pub fn triangles(&self, range: Range<usize>) -> f64 {
        let frames = range.len() as f64;
        let of = |frame: &FrameReport| (frame.triangles + frame.hidden_triangles) as f64;
        self.reports[range].iter().map(of).sum::<f64>() / frames
    }

    /// Evictions of a range.
    pub fn evictions(&self, range: Range<usize>) -> u64 {
        self.reports[range].iter().map(|frame| frame.evictions).sum()
    }
}
