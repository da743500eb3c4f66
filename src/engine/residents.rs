//! Which nodes a policy may draw.

/// Which nodes can be drawn now, and which are on their way into memory.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Residents {
    resident: Vec<bool>,
    coming: Vec<u32>,
}

impl Residents {
    /// None of `nodes` nodes.
    pub fn none(nodes: usize) -> Self {
        Self { resident: vec![false; nodes], coming: Vec::new() }
    }

    /// All of `nodes` nodes.
    pub fn all(nodes: usize) -> Self {
        Self { resident: vec![true; nodes], coming: Vec::new() }
    }

    /// Makes room for so many.
    pub fn grow(&mut self, nodes: usize) {
        self.resident.resize(nodes, false);
    }

    /// Whether a node can be drawn.
    pub fn contains(&self, node: u32) -> bool {
        self.resident.get(node as usize).copied().unwrap_or(false)
    }

    /// Says whether a node can be drawn.
    pub fn set(&mut self, node: u32, resident: bool) {
        if let Some(slot) = self.resident.get_mut(node as usize) {
            *slot = resident;
        }
    }

    /// Nodes that are being read, or were read and wait for their upload.
    pub fn coming(&self) -> &[u32] {
        &self.coming
    }

    /// Says which nodes are on their way.
    pub fn set_coming(&mut self, nodes: impl IntoIterator<Item = u32>) {
        self.coming.clear();
        self.coming.extend(nodes);
    }
}
