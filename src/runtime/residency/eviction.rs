//! What is evicted for a node.

use super::state::{NodeState, Residency};

/// Memory reserved for nodes until they can begin to load, in order of their priority.
#[derive(Debug, Default)]
pub(super) struct Reservations {
    /// Nodes that could not begin: they wait for what is being evicted, or nothing may be.
    pub tried: usize,
    /// Those that wait.
    nodes: Vec<u32>,
    /// Bytes that these take.
    bytes: u64,
}

impl Residency {
    /// True where a node fits now, beside what is reserved for more important ones. Otherwise less
    /// important nodes are evicted, if they suffice: their memory is free from the next frame on and
    /// reserved for this node.
    pub(super) fn reserve(&mut self, node: u32, reservations: &mut Reservations) -> bool {
        let missing = self.missing(node, reservations);
        // Memory for more than is uploaded in a frame would lie idle.
        let too_much = !reservations.nodes.is_empty()
            && reservations.bytes + self.needed_bytes(node) > self.upload_bytes;
        if missing > 0 && (too_much || !self.evict(node, missing, reservations)) {
            reservations.tried += 1;
            return false;
        }
        if self.fits(node, reservations) {
            return true;
        }
        reservations.tried += 1;
        reservations.bytes += self.needed_bytes(node);
        reservations.nodes.push(node);
        false
    }

    /// Whether a node fits now, beside what is reserved for more important ones.
    pub(super) fn fits(&self, node: u32, reservations: &Reservations) -> bool {
        self.needed_bytes(node) <= self.budget.free() && self.missing(node, reservations) == 0
    }

    /// Bytes that loading a node takes now.
    fn needed_bytes(&self, node: u32) -> u64 {
        self.budget.held(&self.sizes, node) + self.files(node, &self.textures_held)
    }

    /// Bytes that a node and those before it lack even at the next frame.
    fn missing(&self, node: u32, reservations: &Reservations) -> u64 {
        let leaving = self.leaving.iter().chain(&self.dropped);
        let leaving: u64 = leaving.map(|&node| self.least_freed(node)).sum();
        let needed = reservations.bytes + self.needed_bytes(node);
        self.budget.beyond(needed).saturating_sub(leaving)
    }

    /// Frees `missing` bytes of what is less important than a node; false, and nothing done,
    /// where that does not suffice.
    fn evict(&mut self, node: u32, mut missing: u64, reservations: &Reservations) -> bool {
        let priority = self.list.priority(node);
        // Loads under way that matter less go first: nothing of them is drawn.
        let mut abandoned = Vec::new();
        for &other in &self.loading {
            if missing > 0 && other != node && self.gives_way(other, priority) {
                let freed = self.least_freed(other) + self.to_read[other as usize];
                missing = missing.saturating_sub(freed);
                abandoned.push(other);
            }
        }
        let mut victims = Vec::new();
        let mut at = self.list.last();
        while let (Some(other), true) = (at, missing > 0) {
            let margin = 1.0 + self.options.evict_margin;
            if self.list.priority(other) * margin >= priority {
                break;
            }
            at = self.list.before(other);
            let leads = |&for_node: &u32| self.leads_to(other, for_node);
            if self.nodes[other as usize].recent.of(self.span) * margin < priority
                && self.may_leave(other, &victims)
                && !leads(&node)
                && !reservations.nodes.iter().any(leads)
            {
                missing = missing.saturating_sub(self.least_freed(other));
                victims.push(other);
                // Its parent may leave now, and may have been passed on the way here.
                if let Some(parent) = self.nodes[other as usize].parent
                    && self.list.precedes_or_is(other, parent)
                {
                    at = Some(parent);
                }
            }
        }
        if missing > 0 {
            return false;
        }
        abandoned.into_iter().for_each(|other| self.abandon(other));
        victims.into_iter().for_each(|other| self.leave(other));
        true
    }

    /// Evicts nodes though nothing else needs their memory: those that the last frame neither
    /// drew nor visited, and that have no children in memory.
    pub fn release(&mut self, nodes: &[u32]) {
        for &node in nodes {
            let record = &self.nodes[node as usize];
            let wanted = [record.visited, record.needed];
            if !wanted.contains(&self.frame) && self.may_leave(node, &[]) {
                self.leave(node);
            }
        }
    }

    /// A node's memory is free from the next frame on.
    pub(super) fn leave(&mut self, node: u32) {
        self.nodes[node as usize].state = NodeState::Leaving;
        self.list.set_loaded(node, false);
        self.resident -= 1;
        self.counters.evictions += 1;
        self.leaving.push(node);
    }

    /// A load under way that is of less importance than `priority`, or that nobody asks for.
    fn gives_way(&self, other: u32, priority: f64) -> bool {
        self.nodes[other as usize].visited != self.frame
            || self.list.priority(other) * (1.0 + self.options.evict_margin) < priority
    }

    /// Resident, not a root, and without children in memory other than `victims`.
    fn may_leave(&self, node: u32, victims: &[u32]) -> bool {
        let record = &self.nodes[node as usize];
        if record.state != NodeState::Resident || record.is_root || victims.contains(&node) {
            return false;
        }
        let held = record.children_held;
        let leaving = |&&other: &&u32| self.nodes[other as usize].parent == Some(node);
        held == 0 || held as usize == victims.iter().filter(leaving).count()
    }

    /// Whether selection would no longer come to `node` if `other` left: `other` is an ancestor,
    /// or one of those that are drawn together with an ancestor or not at all. It would come back
    /// as soon as `node` is no longer asked for, and evict again for it, and so on.
    fn leads_to(&self, other: u32, node: u32) -> bool {
        let above = self.nodes[other as usize].parent;
        let needed = self.nodes[other as usize].needed == self.frame;
        std::iter::successors(self.nodes[node as usize].parent, |&at| {
            self.nodes[at as usize].parent
        })
        .any(|at| at == other || needed && above == Some(at))
    }

    /// Bytes that are free for certain once a node is gone; shared pictures may stay.
    fn least_freed(&self, node: u32) -> u64 {
        self.sizes.nodes[node as usize].bytes()
    }
}
