//! What nodes hide, for runs in which nothing else is read.

use std::sync::{Arc, Mutex};

use rustc_hash::FxHashMap;

use crate::engine::NodeOcclusion;
use crate::loading::NodeFiles;

/// What nodes hide, found from their files once it is asked for, and kept for all runs of a scene.
#[derive(Debug)]
pub struct ModelOcclusions {
    files: NodeFiles,
    known: Mutex<FxHashMap<u32, Option<Arc<NodeOcclusion>>>>,
}

impl ModelOcclusions {
    /// Of the nodes of these files.
    pub fn new(files: NodeFiles) -> Self {
        Self { files, known: Mutex::default() }
    }

    /// What a node hides; `None` where its file cannot be used, which a run that draws would tell of.
    pub fn of(&self, node: u32) -> Option<Arc<NodeOcclusion>> {
        let mut known = self.known.lock().ok()?;
        let find = || self.files.read_occlusion(node).ok().map(Arc::new);
        known.entry(node).or_insert_with(find).clone()
    }
}
