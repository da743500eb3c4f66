//! Which nodes are in memory, and what they hold there.

use super::memory_budget::MemoryBudget;
use super::recent_priority::RecentPriority;
use super::{PriorityList, ResidencyOptions, Sizes};

/// Where a node is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NodeState {
    /// On disk only.
    Absent,
    /// Being read, or suspended; this many bytes of its files have been.
    Loading {
        /// Bytes read.
        read: u64,
    },
    /// Read and decoded, not yet where drawing can use it.
    Loaded,
    /// Ready to be drawn.
    Resident,
    /// Given up; its memory is free once drawing lets go of it, or of what was decoded of it.
    Leaving,
    /// Its files cannot be used.
    Broken,
}

/// Bytes against the cap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MemoryUse {
    /// What may be in use at most, loads under way included.
    pub cap_bytes: u64,
    /// What is in use.
    pub used_bytes: u64,
    /// What all that the last frame asked for takes, in memory or not, shared textures apart.
    pub requested_bytes: u64,
}

/// What has happened so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// Bytes of files that were read.
    pub read_bytes: u64,
    /// Of these, bytes of nodes that had been loaded before.
    pub reread_bytes: u64,
    /// Nodes that were loaded.
    pub loads: u64,
    /// Nodes that were evicted.
    pub evictions: u64,
    /// Loads that were suspended for a more important one.
    pub suspensions: u64,
    /// Loads that were given up half way, or before drawing took them over.
    pub abandoned: u64,
}

/// What is looked up of every node that a frame visits: in one place, since nodes that are visited
/// together lie anywhere in memory.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct NodeRecord {
    pub state: NodeState,
    pub parent: Option<u32>,
    /// The coarsest there is of its piece: it never leaves. What has no parent and is none is a face.
    pub is_root: bool,
    /// Children that are not absent.
    pub children_held: u32,
    /// The frame in which it was visited last.
    pub visited: u32,
    /// The frame in which it was last said that it may be wanted soon.
    pub ahead: u32,
    /// The last frame in which it was drawn, or its children were visited in its place.
    pub needed: u32,
    /// [`NodeSize::bytes`](super::NodeSize::bytes).
    pub bytes: u64,
    pub recent: RecentPriority,
}

/// Which nodes are in memory.
///
/// A node is loaded only once its parent is resident, and evicted only once none of its
/// children is in memory, so that whatever is drawn can always be replaced by its parent. Roots
/// never leave. The faces of cells, whose numbers come after those of nodes, have no parents: they come
/// and go as they are wanted, since nodes can always be drawn in their place.
#[derive(Clone, Debug)]
pub struct Residency {
    pub(super) options: ResidencyOptions,
    pub(super) sizes: Sizes,
    pub(super) budget: MemoryBudget,
    pub(super) list: PriorityList,
    pub(super) nodes: Vec<NodeRecord>,
    /// By node: bytes to be read in all, fixed when its load begins.
    pub(super) to_read: Vec<u64>,
    /// By shared picture: whether it is in memory.
    pub(super) textures_held: Vec<bool>,
    /// By shared picture: whether drawing holds it.
    pub(super) textures_drawn: Vec<bool>,
    /// By node: whether it was ever loaded.
    pub(super) loaded_before: Vec<bool>,
    pub(super) frame: u32,
    /// Seconds since the first frame.
    pub(super) now_s: f64,
    /// The span at hand in which priorities are remembered.
    pub(super) span: u32,
    /// Seconds that the last frame took, as far as uploads and upkeep make up for them.
    pub(super) frame_s: f64,
    /// Nodes that the last frame visited and that were not resident.
    pub(super) missed: Vec<u32>,
    /// Bytes that a frame uploads at most, if it takes as long as the last one did.
    pub(super) upload_bytes: u64,
    /// Bytes that there is time for beside what is drawn; see [`Residency::limit_uploads`].
    pub(super) upload_limit: u64,
    /// Bytes of nodes that may be wanted soon that can begin to load now.
    pub(super) ahead_bytes: f64,
    /// Loaded, in the order in which they were.
    pub(super) arrivals: Vec<u32>,
    /// Leaving, and held by drawing.
    pub(super) leaving: Vec<u32>,
    /// Leaving, and not taken over by drawing.
    pub(super) dropped: Vec<u32>,
    /// Shared pictures in memory that only a load needed that was given up; drawing lets go of
    /// them, and their memory is free, at the next frame.
    pub(super) orphans: Vec<u32>,
    /// Being read or suspended.
    pub(super) loading: Vec<u32>,
    /// Nodes of which a chunk is being read, or which are being decoded.
    pub(super) taken_up: Vec<u32>,
    /// The load that was given the last chunk.
    pub(super) current: Option<u32>,
    pub(super) resident: usize,
    /// Bytes that the nodes of the last frame's requests take.
    pub(super) requested_bytes: u64,
    /// Where [`Residency::stale`] goes on.
    pub(super) cursor: usize,
    pub(super) counters: Counters,
    /// How many roots there are.
    pub(super) roots: usize,
    /// The least cap that there may be, bytes.
    pub(super) least_bytes: u64,
    /// Of all nodes of the hierarchy, bytes.
    pub(super) scene_bytes: u64,
}

impl Residency {
    /// Where a node is.
    pub fn state(&self, node: u32) -> NodeState {
        self.nodes[node as usize].state
    }

    /// Bytes that the load of a node reads in all.
    #[cfg(test)]
    pub(super) fn files_of_load(&self, node: u32) -> u64 {
        self.to_read[node as usize]
    }

    /// Whether a shared picture is in memory, or arrives with a node that is loaded.
    pub fn has_texture(&self, texture: u32) -> bool {
        self.textures_held[texture as usize]
    }

    /// Bytes in use: held for drawing, decoded, and read by loads under way.
    pub fn used_bytes(&self) -> u64 {
        self.budget.used()
    }

    /// The most bytes that were ever in use, under whatever cap.
    pub fn peak_bytes(&self) -> u64 {
        self.budget.peak()
    }

    /// Bytes that all nodes of the hierarchy would take, without the faces of cells.
    pub fn scene_bytes(&self) -> u64 {
        self.scene_bytes
    }

    /// The cap, and the bytes in use.
    pub fn memory_use(&self) -> MemoryUse {
        MemoryUse {
            cap_bytes: self.options.max_memory_bytes,
            used_bytes: self.used_bytes(),
            requested_bytes: self.requested_bytes,
        }
    }

    /// Nodes that are being read, or were read and are not yet resident.
    pub fn coming(&self) -> impl Iterator<Item = u32> {
        self.loading.iter().chain(&self.arrivals).copied()
    }

    /// Number of nodes that can be drawn.
    pub fn resident(&self) -> usize {
        self.resident
    }

    /// What has happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Bytes of the files that loading a node reads.
    pub(super) fn files(&self, node: u32, held: &[bool]) -> u64 {
        let size = &self.sizes.nodes[node as usize];
        let missing = size.textures.iter().filter(|&&texture| !held[texture as usize]);
        size.file_bytes + missing.map(|&t| self.sizes.textures[t as usize].file_bytes).sum::<u64>()
    }

    pub(super) fn begin(&mut self, node: u32) {
        let read = self.files(node, &self.textures_held);
        self.to_read[node as usize] = read;
        self.budget.reserve(&self.sizes, node, read);
        self.nodes[node as usize].state = NodeState::Loading { read: 0 };
        self.loading.push(node);
        if let Some(parent) = self.nodes[node as usize].parent {
            self.nodes[parent as usize].children_held += 1;
        }
    }

    pub(super) fn end_reading(&mut self, node: u32) {
        self.budget.release_read(self.to_read[node as usize]);
        self.loading.retain(|&other| other != node);
    }

    /// Gives back what was reserved for a load that will not be finished.
    pub(super) fn forget_load(&mut self, node: u32, state: NodeState) {
        let (held, orphans) = (&self.textures_held, &mut self.orphans);
        self.budget.release_load(&self.sizes, node, held, orphans);
        self.nodes[node as usize].state = state;
        if let Some(parent) = self.nodes[node as usize].parent {
            self.nodes[parent as usize].children_held -= 1;
        }
    }

    /// Gives back what a node held.
    pub(super) fn forget(&mut self, node: u32, state: NodeState, gone: &mut Vec<u32>) {
        let (held, drawn) = (&mut self.textures_held, &mut self.textures_drawn);
        self.budget.release(&self.sizes, node, |texture| {
            held[texture as usize] = false;
            if std::mem::take(&mut drawn[texture as usize]) {
                gone.push(texture);
            }
        });
        self.nodes[node as usize].state = state;
        if let Some(parent) = self.nodes[node as usize].parent {
            self.nodes[parent as usize].children_held -= 1;
        }
    }
}
