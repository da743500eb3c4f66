//! The files of a scene, for runs in which nothing is drawn.

use std::sync::{Arc, Mutex};

use rustc_hash::{FxHashMap, FxHashSet};

use crate::engine::NodeOcclusion;
use crate::loading::NodeFiles;
use crate::{Error, Result};

/// Checks the files of nodes as a run that draws would, once for all runs of a scene, and keeps
/// what these nodes hide.
#[derive(Debug)]
pub struct ModelFiles {
    files: NodeFiles,
    checked: Mutex<Checked>,
}

#[derive(Debug, Default)]
struct Checked {
    /// By number and whether what a node hides was wanted: that, or the file that cannot be used.
    nodes: FxHashMap<(u32, bool), std::result::Result<Option<Arc<NodeOcclusion>>, BrokenFile>>,
    /// Shared textures that can be decoded.
    textures: FxHashSet<u32>,
}

type BrokenFile = (std::path::PathBuf, String);

impl ModelFiles {
    /// The files of a scene, and of the faces that `files` reads.
    pub fn new(files: NodeFiles) -> Self {
        Self { files, checked: Mutex::default() }
    }

    /// Checks the files of a node or a face, and finds what it hides where that is wanted.
    pub fn load(&self, number: u32, with_occlusion: bool) -> Result<Option<Arc<NodeOcclusion>>> {
        let mut checked = self
            .checked
            .lock()
            .map_err(|_| Error::Internal("a thread that checked files died".into()))?;
        let Checked { nodes, textures } = &mut *checked;
        let found = nodes.entry((number, with_occlusion)).or_insert_with(|| {
            let files = &self.files;
            let done = files.check(number, |texture| textures.contains(&texture), with_occlusion);
            match done {
                Ok(occlusion) => {
                    textures.extend(files.textures_of(number));
                    Ok(occlusion.map(Arc::new))
                }
                Err(Error::Input { path, what }) => Err((path, what)),
                Err(error) => Err((Default::default(), error.to_string())),
            }
        });
        found.clone().map_err(|(path, what)| Error::input(path, what))
    }
}
