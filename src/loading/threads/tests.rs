//! What becomes of a run when decoding panics.

use std::fs;
use std::time::Instant;

use super::*;
use crate::format::NODES_DIR;
use crate::loading::node_files::guarded;
use crate::render::content::{Content, Indices};
use crate::runtime::SceneTree;
use crate::runtime::residency::{ResidencyOptions, Sizes};
use crate::runtime::test_tree::{scene, sketch};

/// Seconds of a frame.
const FRAME_S: f64 = 1.0 / 30.0;

/// Far more than anything here takes.
const PATIENCE: Duration = Duration::from_secs(60);

/// The node over which decoding panics.
const FAULTY: u32 = 2;

fn nothing(files: &NodeFiles, reading: Reading) -> Result<Arrival> {
    let content = Content {
        origin: files.scene().nodes[reading.node() as usize].origin.into(),
        vertices: Vec::new(),
        indices: Indices::Short(Vec::new()),
        draws: Vec::new(),
        pictures: Vec::new(),
    };
    Ok(Arrival { node: reading.node(), content, pictures: Vec::new(), occlusion: None })
}

fn faulty(files: &NodeFiles, reading: Reading) -> Result<Arrival> {
    assert_ne!(reading.node(), FAULTY, "made to fail");
    nothing(files, reading)
}

fn faulty_guarded(files: &NodeFiles, reading: Reading) -> Result<Arrival> {
    guarded(reading.path().to_owned(), || faulty(files, reading))
}

/// Does not return before another thread decodes as well.
fn together(files: &NodeFiles, reading: Reading) -> Result<Arrival> {
    static MET: Mutex<usize> = Mutex::new(0);
    static COME: Condvar = Condvar::new();
    let mut met = MET.lock().unwrap();
    *met += 1;
    COME.notify_all();
    let (met, _) = COME.wait_timeout_while(met, PATIENCE / 2, |met| *met < 2).unwrap();
    if *met < 2 {
        return Err(Error::Internal("nobody came".into()));
    }
    nothing(files, reading)
}

fn threads(count: usize) -> NonZero<usize> {
    NonZero::new(count).unwrap()
}

/// A root, resident, with three children that are not, and threads that load them; their files
/// are there as long as the folder.
fn rig(count: usize, decode: Decode) -> (tempfile::TempDir, Arc<Mutex<Residency>>, LoadingThreads) {
    let leaf = || sketch([0.0; 3], 1.0, vec![]);
    let scene = Arc::new(scene(vec![sketch([0.0; 3], 1.0, vec![leaf(), leaf(), leaf()])]));
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join(NODES_DIR)).unwrap();
    for node in &scene.nodes {
        let file = folder.path().join(NODES_DIR).join(&node.file);
        fs::write(file, vec![0; node.file_bytes as usize]).unwrap();
    }
    let tree = SceneTree::new(&scene);
    let sizes = Sizes::new(&scene, |_, _, _| 100, |_| 0);
    let mut residency = Residency::new(&tree, sizes, ResidencyOptions::default()).unwrap();
    let step = residency.load_root(0);
    residency.chunk_read(0, step.bytes);
    residency.loaded(0);
    let residency = Arc::new(Mutex::new(residency));
    let files = NodeFiles::new(folder.path(), Arc::clone(&scene));
    let threads = LoadingThreads::start_with(&files, &residency, threads(count), decode).unwrap();
    (folder, residency, threads)
}

/// Loads until `done` says so; the states, and the errors.
fn load(
    count: usize,
    decode: Decode,
    done: impl Fn(&LoadingThreads, &Residency) -> bool,
) -> (Vec<NodeState>, Vec<String>, Result<()>) {
    let (_folder, residency, threads) = rig(count, decode);
    let mut errors = Vec::new();
    let start = Instant::now();
    loop {
        let mut residency = residency.lock().unwrap();
        residency.begin_frame(FRAME_S);
        residency.set_priorities(&[(0, 9.0), (1, 3.0), (2, 2.0), (3, 1.0)], &[]);
        if done(&threads, &residency) || start.elapsed() > PATIENCE {
            errors.extend(threads.arrivals().filter_map(Result::err).map(|e| e.to_string()));
            let states = (0..4).map(|node| residency.state(node)).collect();
            return (states, errors, threads.check());
        }
        drop(residency);
        errors.extend(threads.arrivals().filter_map(Result::err).map(|e| e.to_string()));
        threads.wake();
        std::thread::sleep(Duration::from_micros(200));
    }
}

#[test]
fn a_node_over_which_decoding_panics_is_told_of_once_and_the_others_arrive() {
    let (states, errors, alive) = load(1, faulty_guarded, |_, residency| {
        residency.resident() == 3 && residency.state(FAULTY) == NodeState::Broken
    });
    use NodeState::{Broken, Resident};
    assert_eq!(states, [Resident, Resident, Broken, Resident]);
    assert_eq!(errors.len(), 1, "{errors:?}");
    assert!(errors[0].contains("n2.glb") && errors[0].contains("made to fail"), "{errors:?}");
    alive.unwrap();
}

#[test]
fn a_node_that_is_slow_to_decode_holds_up_no_other() {
    let (states, errors, _) = load(2, together, |_, residency| residency.resident() == 4);
    assert_eq!(errors, Vec::<String>::new());
    assert_eq!(states, [NodeState::Resident; 4]);
}

#[test]
fn threads_one_of_which_died_are_an_error() {
    let (_, errors, alive) = load(2, faulty, |threads, _| threads.check().is_err());
    assert_eq!(errors, Vec::<String>::new());
    let error = alive.unwrap_err();
    assert!(error.to_string().contains("loading thread died"), "{error}");
    assert_eq!(error.exit_code(), 1);
    let (states, _, alive) = load(2, nothing, |_, residency| residency.resident() == 4);
    assert_eq!(states, [NodeState::Resident; 4]);
    alive.unwrap();
}

#[test]
fn nothing_is_loaded_while_threads_stand_still_and_all_of_it_afterwards() {
    let (_folder, residency, threads) = rig(3, nothing);
    let ask = || {
        let mut residency = residency.lock().unwrap();
        residency.begin_frame(FRAME_S);
        residency.set_priorities(&[(0, 9.0), (1, 3.0), (2, 2.0), (3, 1.0)], &[]);
        drop(residency);
        threads.wake();
    };
    let known = || {
        let residency = residency.lock().unwrap();
        (residency.counters().read_bytes, residency.resident())
    };
    let guard = threads.pause().unwrap();
    ask();
    let before = known();
    threads.wake();
    std::thread::sleep(2 * LONGEST_SLEEP);
    assert_eq!(known(), before);
    drop(guard);
    let start = Instant::now();
    while known().1 < 4 && start.elapsed() < PATIENCE {
        ask();
        std::thread::sleep(Duration::from_micros(200));
    }
    assert!(known().0 > before.0 && known().1 == 4);
    // Standing still waits for what is under way, and not for ever.
    drop(threads.pause().unwrap());
}
