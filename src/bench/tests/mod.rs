//! Runs with the model clock over small scenes.

mod loaders;

use std::sync::{Arc, Mutex};

use glam::DVec3;

use super::write::frames_csv;
use super::*;
use crate::camera::{CameraPath, PathFrame, Pose, from_angles};
use crate::engine::policies::{POLICIES, Settings};
use crate::engine::test_frame::{quick, triangles_alone};
use crate::engine::{CostModel, FrameInput, Policy, Prices, Selection};
use crate::format::Scene;
use crate::mesh::UpAxis;
use crate::runtime::SceneTree;
use crate::runtime::residency::{Residency, ResidencyOptions, Sizes};
use crate::runtime::test_tree::{Sketch, scene, sketch};

/// A street of houses along x, each of so many levels below its root, with two children a node.
fn street(houses: usize, levels: u32) -> Scene {
    fn node(at: [f64; 3], size: f64, depth: u32) -> Sketch {
        let children = match depth {
            0 => vec![],
            _ => [-1.0, 1.0]
                .map(|side| node([at[0] + side * size / 4.0, at[1], at[2]], size / 2.0, depth - 1))
                .into(),
        };
        Sketch { size, benefit: size, error: size / 20.0, ..sketch(at, 100.0, children) }
    }
    scene((0..houses).map(|house| node([house as f64 * 20.0, 15.0, 0.0], 16.0, levels)).collect())
}

/// Along the street at 1.5 m/s and 30 frames a second, looking ahead and aside.
fn walk(frames: usize) -> CameraPath {
    let frames = (0..frames)
        .map(|frame| PathFrame {
            frame: frame as u64,
            time_s: frame as f64 / 30.0,
            pose: Pose {
                position: DVec3::new(frame as f64 * 0.05, 0.0, 0.0),
                rotation: from_angles(UpAxis::Z, 30.0, 0.0, 0.0),
                fov_y_deg: 60.0,
            },
        })
        .collect();
    CameraPath { frames }
}

fn options(max_memory_bytes: u64) -> BenchOptions {
    let residency = ResidencyOptions { max_memory_bytes, ..ResidencyOptions::default() };
    let policy = PolicyChoice::new("lakhia", &Settings::new()).unwrap();
    BenchOptions { target_ms: 3.0, residency, policy, ..BenchOptions::default() }
}

fn constants() -> ClockConstants {
    ClockConstants {
        prices: Prices { frame: 0.5, ..triangles_alone(0.01) },
        edge_fragment: 0.0,
        cold_byte: 0.0,
        load_bytes_per_ms: 50.0,
        ..ClockConstants::default()
    }
}

fn replay(scene: &Scene, path: &CameraPath, options: BenchOptions) -> Run {
    replay_before(scene, path, options, None)
}

fn replay_before(
    scene: &Scene,
    path: &CameraPath,
    options: BenchOptions,
    inspector: Option<&mut dyn FrameInspector>,
) -> Run {
    replay_by(scene, path, options, constants(), inspector)
}

fn replay_by(
    scene: &Scene,
    path: &CameraPath,
    options: BenchOptions,
    constants: ClockConstants,
    inspector: Option<&mut dyn FrameInspector>,
) -> Run {
    let tree = SceneTree::new(scene);
    let sizes = Sizes::new(scene, |vertices, _, _| u64::from(vertices) * 20, |_| 0);
    let residency = Residency::new(&tree, sizes, options.residency).unwrap();
    let mut policy = options.policy.make().unwrap();
    let mut backend = ModelBackend::new(&tree, constants, options.seed);
    let replay = Replay {
        tree: &tree,
        path,
        policy: &mut *policy,
        residency: Arc::new(Mutex::new(residency)),
        backend: &mut backend,
        occluders: None,
        cells: None,
        costs: CostModel::new(&constants.prices),
        inspector: match inspector {
            Some(inspector) => Some(inspector),
            None => None,
        },
        options,
    };
    run(replay, |_| true).unwrap()
}

fn context(options: BenchOptions) -> Context {
    Context {
        scene_name: "street".into(),
        path_name: "walk.csv".into(),
        options,
        policy: "lakhia",
        diagnostics: &["v_time", "share_ms"],
        clock: "model",
        constants: constants(),
        scene_fingerprint: "f".into(),
        path_fingerprint: "p".into(),
        adapter: None,
        broken: Vec::new(),
        reference: None,
        levels: 3,
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let (scene, path) = (street(20, 2), walk(200));
    let [first, second] = [(); 2].map(|()| {
        let run = replay(&scene, &path, options(1 << 20));
        frames_csv(&run, &context(options(1 << 20))).unwrap()
    });
    assert!(first == second);
    assert_eq!(first.iter().filter(|&&byte| byte == b'\n').count(), 201);
}

#[test]
fn a_walk_starts_with_the_roots_and_gets_finer_as_nodes_arrive() {
    let run = replay(&street(20, 2), &walk(300), options(1 << 20));
    let first = &run.frames[0];
    assert_eq!(first.report.nodes_by_level[1..], [0, 0]);
    assert_eq!(first.report.resident, 20);
    assert_eq!(run.start_bytes, 20 * 200);
    let nodes = street(20, 2).nodes.len() as u64;
    assert_eq!(run.scene_bytes, nodes * 200);
    let last = run.frames.last().unwrap();
    assert!(last.report.nodes_by_level[2] > 0, "{last:?}");
    assert!(run.frames.iter().map(|frame| frame.report.toggles_up).sum::<u32>() > 0);
    // What is drawn is what the levels say, and time follows from cost.
    for frame in &run.frames {
        assert_eq!(frame.report.nodes, frame.report.nodes_by_level.iter().sum::<u32>());
        assert_eq!(frame.report.triangles, 10 * u64::from(frame.report.nodes));
        assert!(
            (frame.report.actual_ms - (0.5 + 0.1 * f64::from(frame.report.nodes))).abs() < 1e-9
        );
    }
}

/// Past houses that come into view one after another, at 30 m/s, looking at them: nodes arrive in every
/// frame. Those after the loading phase.
fn drive_past(upload_ms: f64) -> Vec<FrameRecord> {
    let mut path = walk(300);
    for frame in &mut path.frames {
        frame.pose.position.x *= 20.0;
        frame.pose.rotation = from_angles(UpAxis::Z, 90.0, 0.0, 0.0);
    }
    let mut constants = constants();
    constants.prices.uploaded_byte = upload_ms / 200.0;
    let policy = PolicyChoice::new("gain-over-price", &Settings::new()).unwrap();
    let options = BenchOptions { policy, ..options(1 << 20) };
    let mut frames = replay_by(&street(20, 5), &path, options, constants, None).frames;
    frames.retain(|frame| !frame.report.loading_phase);
    assert!(frames.len() > 200, "{}", frames.len());
    frames
}

#[test]
fn uploads_and_drawing_fit_into_the_frame_together() {
    // A node takes up to a quarter of the target to upload.
    for upload_ms in [0.0, 0.08, 0.3, 0.75] {
        let frames = drive_past(upload_ms);
        let uploads = frames.iter().filter(|frame| frame.report.upload_ms > 0.0).count();
        assert!(upload_ms == 0.0 || uploads > 100, "{uploads}");
        let late = frames.iter().filter(|frame| frame.report.frame_ms > 1.1 * 3.0).count();
        assert!(late <= frames.len() / 50, "{late} of {} at {upload_ms} ms", frames.len());
    }
}

#[test]
fn uploads_cost_no_more_detail_than_they_take_time() {
    let nodes = |frames: &[FrameRecord]| -> f64 {
        frames.iter().map(|frame| f64::from(frame.report.nodes)).sum()
    };
    let without = nodes(&drive_past(0.0));
    for upload_ms in [0.08, 0.3] {
        let frames = drive_past(upload_ms);
        let most_ms = frames.iter().fold(0.0, |most: f64, frame| most.max(frame.report.upload_ms));
        // A frame of 3 ms, of which 2.5 are for nodes.
        let least = 1.0 - most_ms / 2.5 - 0.02;
        let part = nodes(&frames) / without;
        assert!(part > least, "{part} of the nodes, uploads of {most_ms} ms at most");
    }
}

/// FLIP of 0.9 in the loading phase, of 0.1 after it.
struct Phases;

impl FrameInspector for Phases {
    fn wants(&self, index: usize, _: bool) -> bool {
        index.is_multiple_of(2)
    }

    fn inspect(&mut self, frame: FrameSample<'_>) -> crate::Result<Accuracy> {
        let flip_mean = if frame.loading_phase { 0.9 } else { 0.1 };
        Ok(Accuracy { flip_mean, ssim: Some(1.0 - flip_mean), ..Accuracy::default() })
    }
}

#[test]
fn the_loading_phase_is_reported_apart() {
    let summary_of = |frames: usize, warm_up_frames: u64| {
        let options = BenchOptions { warm_up_frames, ..options(1 << 20) };
        let run = replay_before(&street(20, 2), &walk(frames), options.clone(), Some(&mut Phases));
        let reference = ReferenceContext { every: 2, ..ReferenceContext::default() };
        let context = Context { reference: Some(reference), ..context(options) };
        let summary = summary(&run, &context);
        let page = report_html(&run, &context, &summary).unwrap();
        (run, summary_text(&summary), page, summary)
    };
    let (run, text, page, summary) = summary_of(200, 0);
    let loading = run.frames.iter().take_while(|frame| frame.report.loading_phase).count();
    assert!((1..70).contains(&loading), "{loading}");
    // It ends for good, with the first frame that needs nothing that it has not.
    assert!(run.frames[loading..].iter().all(|frame| !frame.report.loading_phase));
    let (first, report) = (&run.frames[0], &run.frames[loading].report);
    let seconds = run.frames[loading].time_s - first.time_s;
    assert!((report.arrived, report.waiting) == (0, 0) || seconds >= 2.0, "{report:?}");
    assert_eq!(summary["loading_phase"]["frames"], loading);
    assert_eq!(summary["warm"]["frames"], 200 - loading);
    let looked = &summary["accuracy"];
    assert_eq!(looked["loading_phase"]["frames"], loading.div_ceil(2));
    assert_eq!(looked["warm_frames"], 100 - loading.div_ceil(2));
    assert_eq!(looked["frames"], 100);
    let close = |value: &serde_json::Value, to: f64| (value.as_f64().unwrap() - to).abs() < 1e-9;
    assert!(close(&looked["loading_phase"]["flip_mean"]["mean"], 0.9));
    assert!(close(&looked["flip_mean"]["mean"], 0.1) && close(&looked["flip_mean"]["max"], 0.1));
    assert!(close(&looked["ssim"]["min"], 0.9));
    assert!(
        text.contains("frames of loading") && text.contains("loading phase, FLIP 0.9"),
        "{text}"
    );
    assert!(page.contains("<td>FLIP in the loading phase, mean</td><td>0.9000</td>"));

    // A path that ends within it has no image error, rather than that of what is not loaded.
    let (_, text, _, summary) = summary_of(1, 0);
    assert_eq!(summary["accuracy"]["warm_frames"], 0);
    assert!(summary["accuracy"]["flip_mean"]["mean"].is_null());
    assert!(summary["warm"]["frame_ms"]["mean"].is_null());
    assert!(text.contains("--warm-up-frames") && !text.contains("NaN"), "{text}");

    let (_, text, _, summary) = summary_of(20, 200);
    assert_eq!(summary["loading_phase"]["frames"], 0);
    assert_eq!(summary["warm"]["frames"], 20);
    assert!(!text.contains("loading phase") && !text.contains("frames of loading"), "{text}");
}

#[test]
fn loading_reads_no_faster_than_the_clock_allows() {
    let run = replay(&street(20, 2), &walk(300), options(1 << 20));
    let mut seconds = 0.0;
    let mut bytes = 0;
    for frame in &run.frames {
        bytes += frame.report.read_bytes;
        // A chunk that was begun is finished.
        assert!(bytes as f64 <= seconds * 50_000.0 + 50.0 * 34.0 + 1000.0);
        seconds += 1.0 / 30.0;
    }
    assert!(bytes > 10_000);
}

/// Where the walk begins, for good.
fn stand(frames: u64) -> CameraPath {
    let mut path = walk(1);
    path.frames = (0..frames)
        .map(|frame| PathFrame { frame, time_s: frame as f64 / 30.0, ..path.frames[0] })
        .collect();
    path
}

/// A frame takes another time whatever it draws, and now and then one stalls. Policies that steer by
/// the time of each frame follow this a little: the loop leaves its dead band now and then, and the
/// thesis's counters go up and down with its shares.
#[test]
fn a_still_camera_comes_to_rest_in_spite_of_noise() {
    let (scene, path) = (street(60, 2), stand(6000));
    let constants =
        ClockConstants { noise: 0.045, stalls_per_s: 0.1, stall_ms: 5.0, ..constants() };
    for kind in POLICIES {
        let follows = ["lakhia", "screen-error-loop"].contains(&kind.name);
        for seed in 0..6 {
            let policy = PolicyChoice::new(kind.name, &quick(kind)).unwrap();
            let options = BenchOptions { policy, seed, target_ms: 10.0, ..options(1 << 20) };
            let run = replay_by(&scene, &path, options, constants, None);
            let late: u32 = run.frames[1000..].iter().map(|frame| frame.report.toggles()).sum();
            assert!(late <= if follows { 30 } else { 0 }, "{}, seed {seed}: {late}", kind.name);
        }
    }
}

#[test]
fn a_still_camera_settles() {
    let run = replay(&street(20, 2), &stand(20_000), options(1 << 20));
    let late: u32 = run.frames[10_000..].iter().map(|frame| frame.report.toggles()).sum();
    assert_eq!(late, 0);
}

#[test]
fn memory_stays_below_a_cap_of_a_few_nodes_and_is_used() {
    let cap = 20 * 200 + 6 * 200 + 1000;
    let run = replay(&street(20, 2), &walk(600), options(cap));
    assert!(run.peak_bytes <= cap);
    assert!(run.frames.iter().all(|frame| frame.report.memory_bytes <= cap));
    assert!(run.peak_bytes as f64 > 0.9 * cap as f64, "{} of {cap}", run.peak_bytes);
    assert!(run.frames.iter().map(|frame| frame.report.evictions).sum::<u64>() > 0);
}

#[test]
fn frames_of_settling_are_not_logged() {
    let mut options = options(1 << 20);
    options.warm_up_frames = 100;
    let run = replay(&street(20, 2), &walk(10), options);
    assert_eq!(run.frames.len(), 10);
    assert!(run.frames[0].report.nodes_by_level[1..].iter().sum::<u32>() > 0, "settled before");
}

#[test]
fn a_summary_has_the_promised_keys_and_agrees_with_the_frames() {
    let run = replay(&street(20, 2), &walk(300), options(1 << 20));
    let context = context(options(1 << 20));
    let summary = summary(&run, &context);
    for key in [
        "/frames",
        "/toggles/up",
        "/toggles/down",
        "/toggles/per_frame",
        "/frame_ms/mean",
        "/frame_ms/p50",
        "/frame_ms/p95",
        "/frame_ms/p99",
        "/over_target_share",
        "/estimate_error_percent/mean",
        "/estimate_error_percent/sd",
        "/without_feedback/estimate_error_percent/mean",
        "/without_feedback/estimate_error_percent/sd",
        "/utilisation",
        "/memory/cap_bytes",
        "/memory/peak_bytes",
        "/memory/peak_share",
        "/select_ms/mean",
    ] {
        assert!(summary.pointer(key).is_some_and(serde_json::Value::is_number), "{key}");
    }
    assert_eq!(summary["frames"], 300);
    let up: u32 = run.frames.iter().map(|frame| frame.report.toggles_up).sum();
    assert_eq!(summary["toggles"]["up"], up);
    // The model draws in the time that was estimated.
    assert!(summary["estimate_error_percent"]["mean"].as_f64().unwrap().abs() < 1e-9);
    let text = summary_text(&summary);
    assert!(text.lines().count() < 24 && !text.contains("NaN"), "{text}");
}

#[test]
fn a_run_is_written_whole_and_compares_with_itself_and_not_with_another_target() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, options: BenchOptions| {
        let run = replay(&street(20, 2), &walk(100), options.clone());
        let context = context(options);
        let out = dir.path().join(name);
        let summary = summary(&run, &context);
        let files = write_run(&out, &run, &context, &summary).unwrap();
        assert!(files.iter().all(|file| file.is_file()));
        let names = files.iter().map(|file| file.file_name().unwrap().to_str().unwrap());
        assert_eq!(names.collect::<Vec<_>>(), ["frames.csv", "summary.json", "report.html"]);
        SummaryFile::read(&out.join("summary.json")).unwrap()
    };
    let mut other = options(1 << 20);
    let [first, second] = ["first", "second"].map(|name| write(name, other.clone()));
    let limits = Limits { max: vec!["toggles=+0".parse().unwrap()] };
    let comparison = compare(&first, &second, &limits, false).unwrap();
    assert!(!comparison.exceeded() && comparison.differences.is_empty());
    other.target_ms = 2.0;
    let error = compare(&first, &write("third", other), &limits, false).unwrap_err();
    assert!(error.to_string().contains("parameters.target_ms: 3.0 against 2.0"));
}

/// Draws the roots, and from the third frame on the first child of the first root beside them.
#[derive(Default)]
struct Overlapping(u32);

impl Policy for Overlapping {
    fn name(&self) -> &'static str {
        "overlapping"
    }

    fn select(&mut self, frame: &FrameInput<'_>, out: &mut Selection) {
        let &FrameInput { tree, view, residents, .. } = frame;
        out.clear();
        self.0 += 1;
        let child = tree.children(tree.roots()[0])[0];
        let is_visible = |node: u32| view.frustum.outside(tree.node(node).bbox) <= 0.0;
        out.front.extend(tree.roots().iter().copied().filter(|&root| is_visible(root)));
        out.requests.extend(tree.roots().iter().chain([&child]).map(|&node| (node, 1.0)));
        if self.0 > 50 && residents.contains(child) {
            out.front.extend([tree.roots()[0], child]);
            out.front.sort_unstable();
            out.front.dedup();
        }
    }

    fn utility(&self, _: &FrameInput<'_>, _: u32) -> f64 {
        0.0
    }
}

#[test]
fn a_front_that_is_none_ends_the_run_with_policy_frame_and_rule() {
    let (scene, path, options) = (street(20, 2), walk(100), options(1 << 20));
    let tree = SceneTree::new(&scene);
    let sizes = Sizes::new(&scene, |vertices, _, _| u64::from(vertices) * 20, |_| 0);
    let residency = Residency::new(&tree, sizes, options.residency).unwrap();
    let replay = Replay {
        tree: &tree,
        path: &path,
        policy: &mut Overlapping::default(),
        residency: Arc::new(Mutex::new(residency)),
        backend: &mut ModelBackend::new(&tree, constants(), 0),
        occluders: None,
        cells: None,
        costs: CostModel::new(&constants().prices),
        inspector: None,
        options,
    };
    let error = run(replay, |_| true).unwrap_err();
    assert_eq!(error.exit_code(), 1);
    let message = error.to_string();
    assert!(
        message.contains("policy overlapping, frame 50: node 1 is drawn, and so is one above it"),
        "{message}"
    );
}

/// Keeps what it was shown of every third frame.
#[derive(Default)]
struct Onlooker(Vec<(u64, Vec<u32>, Option<Vec<u32>>)>);

impl FrameInspector for Onlooker {
    fn wants(&self, index: usize, _: bool) -> bool {
        index.is_multiple_of(3)
    }

    fn inspect(&mut self, frame: FrameSample<'_>) -> crate::Result<Accuracy> {
        assert_eq!(frame.drawn, None, "the model draws nothing");
        self.0.push((frame.frame, frame.front.to_vec(), frame.before.map(<[u32]>::to_vec)));
        Ok(Accuracy { gap_pixels: frame.frame, ..Accuracy::default() })
    }
}

#[test]
fn a_witness_sees_every_front_and_changes_nothing_but_its_own_columns() {
    let (scene, path) = (street(20, 2), walk(300));
    let mut inspector = Onlooker::default();
    let mut watched = replay_before(&scene, &path, options(1 << 20), Some(&mut inspector));
    for (index, frame) in watched.frames.iter_mut().enumerate() {
        let expected = index.is_multiple_of(3).then_some(frame.frame);
        assert_eq!(frame.accuracy.take().map(|accuracy| accuracy.gap_pixels), expected);
    }
    assert_eq!(watched, replay(&scene, &path, options(1 << 20)));
    assert_eq!(inspector.0.len(), 100);
    // Where levels toggled, and only there, it saw the front of the frame before too.
    let mut toggled = 0;
    for (frame, front, before) in &inspector.0 {
        let record = &watched.frames[*frame as usize];
        assert_eq!(front.len() as u32, record.report.nodes);
        assert_eq!(before.is_some(), record.report.toggles() > 0);
        if let Some(before) = before {
            assert_eq!(before.len() as u32, watched.frames[*frame as usize - 1].report.nodes);
            assert_ne!(before, front);
            toggled += 1;
        }
    }
    assert!(toggled > 0, "no toggle was seen");
}
