//! A cap that changes while nodes are in memory.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::memory_budget::MemoryBudget;
use super::state::{NodeState, Residency};
use crate::{Error, Result};

/// The refusal of a cap below what the roots need.
pub(super) fn too_low(roots: usize, needed: u64, found: u64) -> Error {
    Error::Usage(format!(
        "--max-memory: expected at least {needed} bytes, which the {roots} roots take while they \
         are loaded, found {found}; build with a lower --desired-tris or fewer blocks to make \
         roots smaller"
    ))
}

impl Residency {
    /// Sets the cap, bytes. From the next [`begin_frame`](Self::begin_frame) on no more is in use:
    /// as far as need be, loads under way are given up, then nodes that drawing has not taken over
    /// yet, then the least useful nodes in memory, children before their parents, even where they
    /// are drawn. Roots stay: a cap below what they need is refused, and nothing done.
    pub fn set_max_memory(&mut self, bytes: u64) -> Result<()> {
        if bytes < self.least_bytes {
            return Err(too_low(self.roots, self.least_bytes, bytes));
        }
        self.options.max_memory_bytes = bytes;
        self.budget.set_cap(bytes);
        while self.once_left().is_over()
            && let Some(node) = self.least_useful_load()
        {
            self.abandon(node);
        }
        let mut once_left = self.once_left();
        self.drop_arrivals(&mut once_left);
        self.leave_least_useful(&mut once_left);
        Ok(())
    }

    /// What will be in use once drawing has let go of all that leaves.
    fn once_left(&self) -> MemoryBudget {
        let mut budget = self.budget.clone();
        for &node in self.leaving.iter().chain(&self.dropped) {
            budget.release(&self.sizes, node, |_| {});
        }
        for &texture in &self.orphans {
            budget.release_texture(&self.sizes, texture, |_| {});
        }
        budget
    }

    fn least_useful_load(&self) -> Option<u32> {
        self.loading.iter().copied().min_by_key(|&node| self.usefulness(node))
    }

    /// A load that will not be finished.
    pub(super) fn abandon(&mut self, node: u32) {
        self.end_reading(node);
        self.forget_load(node, NodeState::Absent);
        self.counters.abandoned += 1;
    }

    /// The last to come go first: they may rely on textures that came with others before.
    fn drop_arrivals(&mut self, once_left: &mut MemoryBudget) {
        while once_left.is_over()
            && let Some(node) = self.arrivals.pop()
        {
            once_left.release(&self.sizes, node, |_| {});
            self.nodes[node as usize].state = NodeState::Leaving;
            self.list.set_loaded(node, false);
            self.counters.abandoned += 1;
            self.dropped.push(node);
        }
        // A load that begins before the next frame has to read what would have come with them.
        for &node in &self.dropped {
            for &texture in &self.sizes.nodes[node as usize].textures {
                let comes =
                    |&other: &u32| self.sizes.nodes[other as usize].textures.contains(&texture);
                self.textures_held[texture as usize] =
                    self.textures_drawn[texture as usize] || self.arrivals.iter().any(comes);
            }
        }
    }

    /// Nodes leave, of those without children in memory the least useful first.
    fn leave_least_useful(&mut self, once_left: &mut MemoryBudget) {
        if !once_left.is_over() {
            return;
        }
        let mut children: Vec<u32> = self.nodes.iter().map(|node| node.children_held).collect();
        for &node in self.leaving.iter().chain(&self.dropped) {
            if let Some(parent) = self.nodes[node as usize].parent {
                children[parent as usize] -= 1;
            }
        }
        let may_leave = |residency: &Self, children: &[u32], node: u32| {
            let record = &residency.nodes[node as usize];
            record.state == NodeState::Resident && !record.is_root && children[node as usize] == 0
        };
        let mut least: BinaryHeap<_> = (0..self.nodes.len() as u32)
            .filter(|&node| may_leave(self, &children, node))
            .map(|node| Reverse((self.usefulness(node), node)))
            .collect();
        while once_left.is_over()
            && let Some(Reverse((_, node))) = least.pop()
        {
            once_left.release(&self.sizes, node, |_| {});
            self.leave(node);
            if let Some(parent) = self.nodes[node as usize].parent {
                children[parent as usize] -= 1;
                if may_leave(self, &children, parent) {
                    least.push(Reverse((self.usefulness(parent), parent)));
                }
            }
        }
    }

    /// By what nodes are ordered: whether the last frame drew or visited them, rather than that they may
    /// be wanted soon, and their priority.
    fn usefulness(&self, node: u32) -> (bool, u64) {
        let record = &self.nodes[node as usize];
        let is_visited = record.visited == self.frame && record.ahead != self.frame;
        let is_wanted = is_visited || record.needed == self.frame;
        // Numbers of at least 0 are in the order of their bits.
        (is_wanted, self.list.priority(node).max(0.0).to_bits())
    }
}
