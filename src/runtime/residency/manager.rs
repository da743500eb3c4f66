//! What is loaded next, and what is evicted for it.

use super::cap::too_low;
use super::eviction::Reservations;
use super::memory_budget::MemoryBudget;
use super::recent_priority::RecentPriority;
use super::state::{Counters, NodeRecord, NodeState, Residency};
use super::{PriorityList, ResidencyOptions, Sizes};
use crate::Result;
use crate::runtime::SceneTree;

/// How many nodes are tried, in order of priority, before loading waits for memory.
const CANDIDATES: usize = 16;

/// Seconds for which a frame makes up at most: one that stalled is not followed by another that
/// uploads all that has come meanwhile.
const MOST_FRAME_S: f64 = 0.1;

/// What may be wanted soon, and may not, is loaded at this part of the rate at which nodes become
/// resident.
const AHEAD: f64 = 0.1;

/// Where nothing was, it may make up for so many seconds.
const AHEAD_S: f64 = 0.25;

/// This part of the memory is left free by it. Measured: with nothing left free, orbits under a cap of a
/// quarter of the scene read a fifth to a half more.
const LEFT_FREE: f64 = 0.25;

/// Nodes a second that the last frame did not visit whose priorities are looked at again.
const STALE_PER_S: f64 = 2_000.0;

/// A chunk to be read: bytes `from..from + bytes` of the node's file followed by those of the
/// shared pictures that it needs and that are not in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// Whose.
    pub node: u32,
    /// Bytes read before.
    pub from: u64,
    /// Bytes to be read now; 0 only where nothing is missing.
    pub bytes: u64,
}

/// What drawing takes over and lets go of before a frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Changes {
    /// Nodes that become resident.
    pub arrived: Vec<u32>,
    /// Bytes that are uploaded for these: what each holds for drawing, and shared textures that no
    /// node drew before.
    pub arrived_bytes: u64,
    /// Nodes whose memory is to be freed.
    pub left: Vec<u32>,
    /// Nodes that were loaded and given up before drawing took them over: what was decoded of
    /// them is to be freed.
    pub dropped: Vec<u32>,
    /// Shared pictures whose memory is to be freed.
    pub left_textures: Vec<u32>,
}

fn record(tree: &SceneTree, sizes: &Sizes, node: u32) -> NodeRecord {
    let is_node = (node as usize) < tree.len();
    let parent = if is_node { tree.node(node).parent } else { None };
    NodeRecord {
        state: NodeState::Absent,
        parent,
        is_root: is_node && parent.is_none(),
        children_held: 0,
        visited: 0,
        ahead: 0,
        needed: 0,
        bytes: sizes.nodes[node as usize].bytes(),
        recent: RecentPriority::default(),
    }
}

impl Residency {
    /// Nothing in memory yet; [`load_root`](Self::load_root) comes next. Fails where the roots
    /// alone do not fit below the cap.
    pub fn new(tree: &SceneTree, sizes: Sizes, options: ResidencyOptions) -> Result<Self> {
        // Faces of cells come after the nodes.
        let nodes = sizes.nodes.len();
        let mut residency = Self {
            budget: MemoryBudget::new(options.max_memory_bytes, sizes.textures.len()),
            list: PriorityList::new(nodes),
            nodes: (0..nodes as u32).map(|node| record(tree, &sizes, node)).collect(),
            to_read: vec![0; nodes],
            textures_held: vec![false; sizes.textures.len()],
            textures_drawn: vec![false; sizes.textures.len()],
            loaded_before: vec![false; nodes],
            frame: 0,
            now_s: 0.0,
            span: 0,
            frame_s: 0.0,
            missed: Vec::new(),
            upload_bytes: 0,
            upload_limit: u64::MAX,
            ahead_bytes: 0.0,
            arrivals: Vec::new(),
            leaving: Vec::new(),
            dropped: Vec::new(),
            orphans: Vec::new(),
            loading: Vec::new(),
            taken_up: Vec::new(),
            current: None,
            resident: 0,
            requested_bytes: 0,
            cursor: 0,
            counters: Counters::default(),
            roots: tree.roots().len(),
            least_bytes: 0,
            scene_bytes: sizes.bytes_of(tree.len()),
            options,
            sizes,
        };
        residency.least_bytes = residency.bytes_for_roots(tree);
        if options.max_memory_bytes < residency.least_bytes {
            let found = options.max_memory_bytes;
            return Err(too_low(residency.roots, residency.least_bytes, found));
        }
        Ok(residency)
    }

    /// Bytes that all roots take, the largest of them while its files are read.
    fn bytes_for_roots(&self, tree: &SceneTree) -> u64 {
        let mut budget = MemoryBudget::new(u64::MAX, self.sizes.textures.len());
        for &root in tree.roots() {
            let read = self.files(root, &vec![false; self.sizes.textures.len()]);
            budget.reserve(&self.sizes, root, read);
            budget.release_read(read);
        }
        budget.peak()
    }

    /// Nodes that the last frame visited and found not in memory, and that still are not: how many
    /// loads wait.
    pub fn waiting(&self) -> usize {
        self.missed.iter().filter(|&&node| self.wants(node)).count()
    }

    /// Begins to load a root, before the first frame: all of its files are to be read, after
    /// which [`loaded`](Self::loaded) or [`broken`](Self::broken) is to be called.
    pub fn load_root(&mut self, root: u32) -> Step {
        self.begin(root);
        let bytes = self.to_read[root as usize];
        Step { node: root, from: 0, bytes }
    }

    /// Takes the priorities of a frame: of the nodes visited, and of some others.
    pub fn set_priorities(&mut self, visited: &[(u32, f64)], others: &[(u32, f64)]) {
        self.frame += 1;
        self.missed.clear();
        self.requested_bytes = 0;
        self.span = RecentPriority::span(self.now_s);
        for &(node, priority) in visited {
            let record = &mut self.nodes[node as usize];
            self.requested_bytes += record.bytes;
            record.visited = self.frame;
            record.recent.update(self.span, priority);
            if record.state != NodeState::Resident {
                self.missed.push(node);
            }
            if let Some(parent) = record.parent {
                self.nodes[parent as usize].needed = self.frame;
            }
        }
        self.list.update(visited);
        self.list.update(others);
    }

    /// Takes faces of cells that the frame wants beside the nodes.
    pub fn set_faces(&mut self, faces: &[(u32, f64)]) {
        for &(face, priority) in faces {
            let record = &mut self.nodes[face as usize];
            record.visited = self.frame;
            record.recent.update(self.span, priority);
            if record.state != NodeState::Resident {
                self.missed.push(face);
            }
        }
        self.list.update(faces);
    }

    /// Takes nodes that may be wanted soon, none of which the frame visited, after those that it did.
    pub fn set_ahead(&mut self, ahead: &[(u32, f64)]) {
        for &(node, priority) in ahead {
            let record = &mut self.nodes[node as usize];
            (record.visited, record.ahead) = (self.frame, self.frame);
            record.recent.update(self.span, priority);
        }
        self.list.update(ahead);
    }

    /// Says which nodes the frame draws, or could not draw their siblings without. Together with
    /// the parents of those visited, they are what brought selection to where it is: should one
    /// leave, what stands below it and its siblings would no longer be visited.
    pub fn set_needed(&mut self, nodes: impl IntoIterator<Item = u32>) {
        for node in nodes {
            self.nodes[node as usize].needed = self.frame;
        }
    }

    /// Nodes in memory that the last frame did not visit, some in each frame, in turn: their
    /// priorities should be looked at from time to time.
    pub fn stale(&mut self, out: &mut Vec<u32>) {
        out.clear();
        let count = (STALE_PER_S * self.frame_s).ceil() as usize;
        for _ in 0..(8 * count).min(self.nodes.len()) {
            self.cursor = if self.cursor + 1 < self.nodes.len() { self.cursor + 1 } else { 0 };
            let held = self.nodes[self.cursor].state == NodeState::Resident;
            if held && self.nodes[self.cursor].visited != self.frame {
                out.push(self.cursor as u32);
            }
            if out.len() == count {
                break;
            }
        }
    }

    /// Leaves a node to whoever reads and decodes it: until it is [put down](Self::put_down), nobody
    /// else is told to.
    pub fn take_up(&mut self, node: u32) {
        self.taken_up.push(node);
    }

    /// Its chunk was read, or all of it was decoded.
    pub fn put_down(&mut self, node: u32) {
        self.taken_up.retain(|&other| other != node);
    }

    /// What to read now: a chunk of the most important node that is not in memory, that nobody has
    /// [taken up](Self::take_up), and for which there is room or can be made. `None` where there is nothing to do until something
    /// changes.
    pub fn next_step(&mut self) -> Option<Step> {
        let mut at = self.list.first_unloaded();
        let mut reservations = Reservations::default();
        while let Some(node) = at {
            at = self.list.after(node);
            if self.taken_up.contains(&node) {
                continue;
            }
            let state = self.nodes[node as usize].state;
            match state {
                NodeState::Absent if self.nodes[node as usize].visited != self.frame => {
                    self.list.remove(node); // no longer of interest to anyone
                }
                NodeState::Absent if self.may_load_ahead(node, &reservations) => {
                    self.ahead_bytes -= self.nodes[node as usize].bytes as f64;
                    self.begin(node);
                    return Some(self.chunk(node));
                }
                NodeState::Absent
                    if !self.is_ahead(node)
                        && self.wants(node)
                        && self.reserve(node, &mut reservations) =>
                {
                    self.begin(node);
                    return Some(self.chunk(node));
                }
                NodeState::Loading { .. } if self.nodes[node as usize].visited == self.frame => {
                    return Some(self.chunk(node));
                }
                _ => {}
            }
            if reservations.tried == CANDIDATES {
                break;
            }
        }
        None
    }

    /// It may be wanted soon, and is not yet.
    fn is_ahead(&self, node: u32) -> bool {
        self.nodes[node as usize].ahead == self.frame
    }

    /// Whether a node that may be wanted soon can be loaded now. Nothing is ever evicted for it,
    /// a part of the memory is left to what is wanted, and what was evicted once is read again only when it
    /// is wanted.
    fn may_load_ahead(&self, node: u32, reservations: &Reservations) -> bool {
        let used = self.budget.used() + self.nodes[node as usize].bytes;
        let most = (1.0 - LEFT_FREE) * self.options.max_memory_bytes as f64;
        self.is_ahead(node)
            && !self.loaded_before[node as usize]
            && self.ahead_bytes > 0.0
            && used as f64 <= most
            && self.wants(node)
            && self.fits(node, reservations)
    }

    /// Visited in the last frame, not in memory, and the parent is, where it has one.
    fn wants(&self, node: u32) -> bool {
        let record = &self.nodes[node as usize];
        let is_resident = |parent: u32| self.nodes[parent as usize].state == NodeState::Resident;
        let outside = matches!(record.state, NodeState::Absent | NodeState::Loading { .. });
        outside
            && record.visited == self.frame
            && !record.is_root
            && record.parent.is_none_or(is_resident)
    }

    fn chunk(&mut self, node: u32) -> Step {
        let NodeState::Loading { read } = self.nodes[node as usize].state else {
            return Step { node, from: 0, bytes: 0 };
        };
        let others = self.current.filter(|other| *other != node && !self.taken_up.contains(other));
        if let Some(other) = others {
            let suspended = matches!(self.nodes[other as usize].state, NodeState::Loading { .. });
            self.counters.suspensions += u64::from(suspended);
        }
        self.current = Some(node);
        let left = self.to_read[node as usize] - read;
        Step { node, from: read, bytes: left.min(self.options.chunk_bytes) }
    }

    /// A chunk was read; true where it was the last, after which [`loaded`](Self::loaded) or
    /// [`broken`](Self::broken) is to be called. False too where the load was given up meanwhile.
    pub fn chunk_read(&mut self, node: u32, bytes: u64) -> bool {
        let NodeState::Loading { read } = &mut self.nodes[node as usize].state else {
            return false;
        };
        *read += bytes;
        self.counters.read_bytes += bytes;
        self.counters.reread_bytes += if self.loaded_before[node as usize] { bytes } else { 0 };
        *read >= self.to_read[node as usize]
    }

    /// A node was decoded and waits for drawing to take it.
    pub fn loaded(&mut self, node: u32) {
        if !matches!(self.nodes[node as usize].state, NodeState::Loading { .. }) {
            return;
        }
        self.end_reading(node);
        self.loaded_before[node as usize] = true;
        self.nodes[node as usize].state = NodeState::Loaded;
        for &texture in &self.sizes.nodes[node as usize].textures {
            self.textures_held[texture as usize] = true;
        }
        self.list.set_loaded(node, true);
        self.arrivals.push(node);
        self.counters.loads += 1;
    }

    /// A node's files cannot be used: it is never asked for again.
    pub fn broken(&mut self, node: u32) {
        if !matches!(self.nodes[node as usize].state, NodeState::Loading { .. }) {
            return;
        }
        self.end_reading(node);
        self.forget_load(node, NodeState::Broken);
        self.list.set_loaded(node, true);
        self.list.remove(node);
    }

    /// From the next frame on no more bytes than this are uploaded in one, however many
    /// [the rate](ResidencyOptions::upload_bytes_per_s) allows; one node always comes.
    pub fn limit_uploads(&mut self, bytes: u64) {
        self.upload_limit = bytes;
    }

    /// What drawing takes over and lets go of before it draws a frame. After this call arrived
    /// nodes are resident and the memory of those that left is free. `dt_s` is the seconds since the
    /// frame before began.
    pub fn begin_frame(&mut self, dt_s: f64) -> Changes {
        self.now_s += dt_s.max(0.0);
        self.frame_s = dt_s.clamp(0.0, MOST_FRAME_S);
        self.upload_bytes = (self.options.upload_bytes_per_s as f64 * self.frame_s) as u64;
        let ahead_bytes_per_s = AHEAD * self.options.upload_bytes_per_s as f64;
        let most = ahead_bytes_per_s * AHEAD_S;
        self.ahead_bytes = (self.ahead_bytes + ahead_bytes_per_s * self.frame_s).min(most);
        let mut changes = Changes::default();
        for node in std::mem::take(&mut self.leaving) {
            self.forget(node, NodeState::Absent, &mut changes.left_textures);
            changes.left.push(node);
        }
        for node in std::mem::take(&mut self.dropped) {
            self.forget(node, NodeState::Absent, &mut changes.left_textures);
            changes.dropped.push(node);
        }
        for texture in std::mem::take(&mut self.orphans) {
            // Unless another load has come to need it since.
            let held = &mut self.textures_held[texture as usize];
            let drawn = &mut self.textures_drawn[texture as usize];
            self.budget.release_texture(&self.sizes, texture, |texture| {
                *held = false;
                if std::mem::take(drawn) {
                    changes.left_textures.push(texture);
                }
            });
        }
        let limit = self.upload_bytes.min(self.upload_limit);
        let mut taken = 0;
        for &node in &self.arrivals {
            let size = &self.sizes.nodes[node as usize];
            let new =
                size.textures.iter().filter(|&&texture| !self.textures_drawn[texture as usize]);
            let new_bytes = new.map(|&texture| self.sizes.textures[texture as usize].held_bytes);
            let bytes = changes.arrived_bytes + size.held_bytes + new_bytes.sum::<u64>();
            if taken > 0 && bytes > limit && self.frame > 0 {
                break;
            }
            changes.arrived_bytes = bytes;
            for &texture in &size.textures {
                self.textures_drawn[texture as usize] = true;
            }
            taken += 1;
        }
        changes.arrived = self.arrivals.drain(..taken).collect();
        for &node in &changes.arrived {
            self.nodes[node as usize].state = NodeState::Resident;
        }
        self.resident += taken;
        changes
    }
}
