//! Loading threads over a scene on disk, under priorities that jump about and caps of a few
//! nodes. After every frame all that is promised is checked; a watchdog ends what hangs.

use std::collections::{BTreeMap, BTreeSet};
use std::num::NonZero;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use hlod::bench::Session;
use hlod::loading::{Arrival, LoadingThreads};
use hlod::runtime::SceneTree;
use hlod::runtime::residency::{Counters, NodeState, Residency, ResidencyOptions, Sizes};

use crate::bench_support::{city, street};
use crate::support::Random;

/// Far more than anything here takes.
const PATIENCE: Duration = Duration::from_secs(120);

const THREADS: NonZero<usize> = NonZero::new(3).unwrap();

/// Runs something and fails where it does not end.
pub fn watched<T: Send + 'static>(what: &str, run: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = channel();
    let thread = std::thread::spawn(move || {
        let _ = sender.send(run());
    });
    match receiver.recv_timeout(PATIENCE) {
        Ok(done) => done,
        Err(RecvTimeoutError::Timeout) => panic!("{what}: still running after {PATIENCE:?}"),
        Err(RecvTimeoutError::Disconnected) => match thread.join() {
            Err(panic) => std::panic::resume_unwind(panic),
            Ok(()) => unreachable!("ended without a result"),
        },
    }
}

/// What drawing would hold, as told by the changes of each frame.
pub struct Rig {
    pub tree: SceneTree,
    pub sizes: Sizes,
    pub residency: Arc<Mutex<Residency>>,
    pub threads: LoadingThreads,
    pub errors: Vec<String>,
    cap: u64,
    /// The highest cap that there was.
    most: u64,
    arrived: BTreeMap<u32, Arrival>,
    /// Bytes of what is drawn, by node and by shared picture.
    nodes: BTreeMap<u32, u64>,
    textures: BTreeMap<u32, u64>,
}

impl Rig {
    /// Roots loaded, the threads started. The cap is what the roots need and `nodes` nodes of the
    /// largest more; `None` is all the memory there is.
    pub fn new(session: &Session, nodes: Option<u64>, options: ResidencyOptions) -> Self {
        let files = session.files();
        let sizes = session.sizes(files.texture_format());
        let pictures = |textures: &[u32]| -> u64 {
            let size = |&texture: &u32| {
                sizes.textures[texture as usize].held_bytes
                    + sizes.textures[texture as usize].file_bytes
            };
            textures.iter().map(size).sum()
        };
        let with_all =
            sizes.nodes.iter().map(|n| n.held_bytes + n.file_bytes + pictures(&n.textures));
        let largest = with_all.max().unwrap();
        let roots: u64 = session
            .tree()
            .roots()
            .iter()
            .map(|&root| &sizes.nodes[root as usize])
            .map(|n| n.held_bytes + n.file_bytes + pictures(&n.textures))
            .sum();
        let cap = nodes.map_or(1 << 40, |nodes| roots + nodes * largest);
        let options = ResidencyOptions { max_memory_bytes: cap, ..options };
        let residency = Residency::new(session.tree(), sizes.clone(), options).unwrap();
        let residency = Arc::new(Mutex::new(residency));
        let (mut arrived, mut errors) = (BTreeMap::new(), Vec::new());
        for &root in session.tree().roots() {
            let mut residency = residency.lock().unwrap();
            let step = residency.load_root(root);
            residency.chunk_read(root, step.bytes);
            match files.read(root, |texture| residency.has_texture(texture)) {
                Ok(arrival) => {
                    arrived.insert(root, arrival);
                    residency.loaded(root);
                }
                Err(error) => {
                    errors.push(error.to_string());
                    residency.broken(root);
                }
            }
        }
        let threads = LoadingThreads::start(&files, &residency, THREADS).unwrap();
        Self {
            tree: session.tree().clone(),
            sizes,
            residency,
            threads,
            errors,
            cap,
            most: cap,
            arrived,
            nodes: BTreeMap::new(),
            textures: BTreeMap::new(),
        }
    }

    /// A frame: takes over what arrived, and asks for what `priorities` says of the nodes that
    /// selection would visit: roots, and children of what is resident.
    pub fn frame(&mut self, mut priority: impl FnMut(u32) -> Option<f64>) {
        let changes = self.residency.lock().unwrap().begin_frame(1.0 / 30.0);
        // A node that was dropped may already have been loaded again.
        let mut dropped: BTreeSet<u32> = changes.dropped.iter().copied().collect();
        dropped.retain(|node| self.arrived.remove(node).is_none());
        for arrival in self.threads.arrivals() {
            match arrival {
                Ok(arrival) if dropped.remove(&arrival.node) => {}
                Ok(arrival) => drop(self.arrived.insert(arrival.node, arrival)),
                Err(error) => self.errors.push(error.to_string()),
            }
        }
        assert!(dropped.is_empty(), "{dropped:?} never came");
        for node in &changes.left {
            assert!(self.nodes.remove(node).is_some(), "node {node} left and was not there");
        }
        for texture in &changes.left_textures {
            assert!(self.textures.remove(texture).is_some(), "picture {texture} was not there");
        }
        for &node in &changes.arrived {
            let arrival = self.arrived.remove(&node);
            let arrival = arrival.unwrap_or_else(|| panic!("node {node} has no content"));
            for (texture, picture) in &arrival.pictures {
                self.textures.insert(*texture, picture.bytes());
            }
            assert!(self.nodes.insert(node, arrival.content.bytes()).is_none());
            for texture in &self.sizes.nodes[node as usize].textures {
                assert!(self.textures.contains_key(texture), "node {node} lacks {texture}");
            }
        }
        let mut residency = self.residency.lock().unwrap();
        self.check(&residency);
        let mut visited = Vec::new();
        for node in 0..self.tree.len() as u32 {
            let above = self.tree.node(node).parent;
            let seen = above.is_none_or(|above| residency.state(above) == NodeState::Resident);
            if let (true, Some(priority)) = (seen, priority(node)) {
                visited.push((node, priority));
            }
        }
        residency.set_priorities(&visited, &[]);
        drop(residency);
        self.threads.wake();
    }

    /// Another cap, of which the least is what the roots need; whether it was lowered.
    pub fn set_cap(&mut self, cap: u64) -> bool {
        let changed = self.residency.lock().unwrap().set_max_memory(cap);
        let is_lower = changed.is_ok() && cap < self.cap;
        if changed.is_ok() {
            (self.cap, self.most) = (cap, self.most.max(cap));
        }
        is_lower
    }

    /// What holds at any time.
    fn check(&self, residency: &Residency) {
        let used = residency.used_bytes();
        assert!(used <= self.cap && residency.peak_bytes() <= self.most, "{used} of {}", self.cap);
        // What was given up is not kept.
        for &node in self.arrived.keys() {
            assert_eq!(residency.state(node), NodeState::Loaded, "node {node}");
        }
        let held: u64 = self.nodes.values().chain(self.textures.values()).sum();
        let nodes = self.sizes.nodes.iter().zip(0..);
        let in_flight: u64 = nodes
            .map(|(size, node)| match residency.state(node) {
                NodeState::Loading { .. } => size.held_bytes + size.file_bytes,
                NodeState::Loaded => size.held_bytes,
                _ => 0,
            })
            .sum();
        assert!(held + in_flight <= used, "{held} + {in_flight} bytes, {used} are counted");
        for node in 0..self.tree.len() as u32 {
            // Nodes may have been given up since the frame began, never the other way round.
            let resident = residency.state(node) == NodeState::Resident;
            let leaving = residency.state(node) == NodeState::Leaving;
            assert_eq!(self.nodes.contains_key(&node), resident || leaving, "node {node}");
            if let (true, Some(above)) = (resident, self.tree.node(node).parent) {
                assert_eq!(residency.state(above), NodeState::Resident, "above node {node}");
            }
            if self.tree.node(node).parent.is_none() {
                assert!(resident || residency.state(node) == NodeState::Broken, "root {node}");
            }
        }
    }

    /// Frames with the same priorities until nothing is loaded any more.
    pub fn settle(&mut self, priority: impl Fn(u32) -> Option<f64>) {
        let start = Instant::now();
        loop {
            self.frame(&priority);
            let mut residency = self.residency.lock().unwrap();
            let under_way = (0..self.tree.len() as u32).any(|node| {
                matches!(residency.state(node), NodeState::Loading { .. } | NodeState::Loaded)
            });
            // Asking changes nothing where there is nothing to do.
            if !under_way && residency.waiting() == 0 && residency.next_step().is_none() {
                return;
            }
            drop(residency);
            assert!(start.elapsed() < PATIENCE, "does not settle");
            std::thread::sleep(Duration::from_micros(300));
        }
    }
}

/// Frames in which priorities stay for a while and then jump; what happened.
fn storm(session: &Session, nodes: Option<u64>, chunk_bytes: u64, seed: u64) -> Counters {
    let mut random = Random::new(seed, 0);
    let upload_bytes_per_s = random.pick(&[0, 600_000, 1 << 27]);
    let evict_margin = random.pick(&[0.0, 0.1]);
    let options =
        ResidencyOptions { chunk_bytes, upload_bytes_per_s, evict_margin, ..Default::default() };
    let mut rig = Rig::new(session, nodes, options);
    let mut salt = 0;
    for _ in 0..200 {
        if random.below(6) == 0 {
            salt = random.bits();
        }
        rig.frame(|node| {
            let mut of_node = Random::new(salt, u64::from(node));
            (of_node.below(5) > 0).then(|| of_node.unit())
        });
        std::thread::sleep(Duration::from_micros(random.bits() % 400));
    }
    let counters = rig.residency.lock().unwrap().counters();
    let residency = Arc::clone(&rig.residency);
    drop(rig);
    // The threads have ended: nobody else holds it any more.
    assert_eq!(Arc::strong_count(&residency), 1);
    counters
}

#[test]
fn promises_hold_under_random_priorities_and_tight_caps() {
    let mut sum = Counters::default();
    for (scene, name) in [(city(), "city"), (street(), "street")] {
        let session = Session::open(scene).unwrap();
        assert!(session.tree().len() > 20, "{name}: {}", session.tree().len());
        for (nodes, chunk, seed) in [
            (Some(1), 1, 1),
            (Some(1), 64 << 10, 2),
            (Some(3), 7, 3),
            (Some(3), 1 << 20, 4),
            (Some(8), 100, 5),
            (Some(8), 4 << 10, 6),
            (None, 333, 7),
        ] {
            let session = session.clone();
            let counters = watched(&format!("{name} {nodes:?} {chunk} {seed}"), move || {
                storm(&session, nodes, chunk, seed)
            });
            sum.read_bytes += counters.read_bytes;
            sum.loads += counters.loads;
            sum.evictions += counters.evictions;
            sum.suspensions += counters.suspensions;
            sum.abandoned += counters.abandoned;
        }
    }
    // Whether a node is given up while it is read is chance: that it was given up in none of many storms is not.
    let session = Session::open(city()).unwrap();
    for seed in 8..40 {
        if sum.abandoned > 0 && sum.suspensions > 0 {
            break;
        }
        let session = session.clone();
        let counters =
            watched(&format!("city again {seed}"), move || storm(&session, Some(3), 100, seed));
        sum.suspensions += counters.suspensions;
        sum.abandoned += counters.abandoned;
    }
    println!("{sum:?}");
    assert!(sum.loads > 100 && sum.read_bytes > 100_000, "{sum:?}");
    assert!(sum.evictions > 0 && sum.suspensions > 0 && sum.abandoned > 0, "{sum:?}");
}

/// Caps change at any time, while nodes are read and decoded.
#[test]
fn a_cap_that_changes_is_held_and_nothing_given_up_is_kept() {
    let mut abandoned = 0;
    for (scene, chunk_bytes) in [(city(), 1 << 20), (street(), 100), (city(), 4 << 10)] {
        let session = Session::open(scene).unwrap();
        abandoned += watched("changing caps", move || {
            let options = ResidencyOptions { chunk_bytes, ..Default::default() };
            let mut rig = Rig::new(&session, None, options);
            let nodes = rig.sizes.nodes.iter().map(|size| size.held_bytes + size.file_bytes);
            let textures = rig.sizes.textures.iter().map(|size| size.held_bytes + size.file_bytes);
            let room = nodes.sum::<u64>() + textures.sum::<u64>();
            rig.set_cap(room);
            let mut random = Random::new(9, chunk_bytes);
            let mut lowered = 0;
            for frame in 0..600 {
                rig.frame(|node| Some(1.0 / f64::from(node + 1)));
                std::thread::sleep(Duration::from_micros(random.bits() % 600));
                let part = random.unit();
                let cap = if frame % 3 == 2 { room } else { (room as f64 * part) as u64 };
                lowered += usize::from(rig.set_cap(cap));
            }
            assert!(lowered > 50, "{lowered}");
            rig.set_cap(room);
            rig.settle(|node| Some(1.0 / f64::from(node + 1)));
            assert_eq!(rig.errors, Vec::<String>::new());
            rig.residency.lock().unwrap().counters().abandoned
        });
    }
    assert!(abandoned > 0);
}

#[test]
fn everything_arrives_where_there_is_room() {
    for (scene, chunk_bytes) in [(city(), 1 << 10), (street(), 1 << 20)] {
        let session = Session::open(scene).unwrap();
        watched("settling", move || {
            let options = ResidencyOptions { chunk_bytes, ..Default::default() };
            let mut rig = Rig::new(&session, None, options);
            rig.settle(|node| Some(1.0 / f64::from(node + 1)));
            assert_eq!(rig.nodes.len(), rig.tree.len());
            assert_eq!(rig.errors, Vec::<String>::new());
            let held: u64 = rig.nodes.values().chain(rig.textures.values()).sum();
            assert_eq!(rig.residency.lock().unwrap().used_bytes(), held, "counted to the byte");
        });
    }
}

#[test]
fn threads_that_are_dropped_amid_loads_end() {
    let session = Session::open(city()).unwrap();
    for frames in [0, 1, 3] {
        let session = session.clone();
        watched("dropping", move || {
            let options = ResidencyOptions { chunk_bytes: 1, ..Default::default() };
            let mut rig = Rig::new(&session, None, options);
            for _ in 0..frames {
                rig.frame(|_| Some(1.0));
            }
            let residency = Arc::clone(&rig.residency);
            drop(rig);
            assert_eq!(Arc::strong_count(&residency), 1);
        });
    }
}
