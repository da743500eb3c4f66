//! The list of nodes by priority (thesis, section 4.3, "Priority queue implementation").

/// Stands for no node.
const NONE: u32 = u32::MAX;

/// Nodes in decreasing order of priority, as a doubly linked list.
///
/// From frame to frame priorities change little, so that a node moves few places: insertion,
/// removal and update take amortised constant time, where a heap takes `O(log n)`. The first node
/// that is not loaded is remembered. The thesis finds nodes through a hash table by identity;
/// here they are numbered, and tables do.
///
/// Where the camera jumps and all priorities change at once, the list is sorted anew instead.
/// Nodes of equal priority stand in order of their numbers.
#[derive(Clone, Debug)]
pub struct PriorityList {
    /// By node.
    entries: Vec<Entry>,
    head: u32,
    tail: u32,
    len: usize,
    /// The first node that is not loaded, or none.
    first_unloaded: u32,
    /// Places passed by nodes on their way, since the last time it was asked for.
    moves: u64,
}

/// What the list knows of a node, in one place: neighbours are anywhere in memory.
#[derive(Clone, Copy, Debug)]
struct Entry {
    priority: f64,
    before: u32,
    after: u32,
    listed: bool,
    loaded: bool,
}

impl Entry {
    const UNLISTED: Self =
        Self { priority: 0.0, before: NONE, after: NONE, listed: false, loaded: false };
}

impl PriorityList {
    /// An empty list for nodes `0..nodes`.
    pub fn new(nodes: usize) -> Self {
        Self {
            entries: vec![Entry::UNLISTED; nodes],
            head: NONE,
            tail: NONE,
            len: 0,
            first_unloaded: NONE,
            moves: 0,
        }
    }

    fn at(&self, node: u32) -> &Entry {
        &self.entries[node as usize]
    }

    fn at_mut(&mut self, node: u32) -> &mut Entry {
        &mut self.entries[node as usize]
    }

    /// Number of nodes in the list.
    pub fn len(&self) -> usize {
        self.len
    }

    /// True without nodes.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Whether a node is in the list.
    pub fn contains(&self, node: u32) -> bool {
        self.at(node).listed
    }

    /// The priority that a node was given last.
    pub fn priority(&self, node: u32) -> f64 {
        self.at(node).priority
    }

    /// The most important node.
    pub fn first(&self) -> Option<u32> {
        some(self.head)
    }

    /// The least important node.
    pub fn last(&self) -> Option<u32> {
        some(self.tail)
    }

    /// The node after this one.
    pub fn after(&self, node: u32) -> Option<u32> {
        some(self.at(node).after)
    }

    /// The node before this one.
    pub fn before(&self, node: u32) -> Option<u32> {
        some(self.at(node).before)
    }

    /// The most important node that is not loaded, in constant time.
    pub fn first_unloaded(&self) -> Option<u32> {
        some(self.first_unloaded)
    }

    /// Places that nodes passed on their way since the last call: the work that was done.
    pub fn take_moves(&mut self) -> u64 {
        std::mem::take(&mut self.moves)
    }

    /// Gives nodes their priorities, and puts those into the list that are not in it. Priorities
    /// are numbers, not NaN.
    pub fn update(&mut self, priorities: &[(u32, f64)]) {
        let size = (self.len + priorities.len()).max(2);
        // Beyond this, sorting everything is cheaper.
        let most = self.moves + 2 * size as u64 * u64::from(size.ilog2());
        for (done, &(node, priority)) in priorities.iter().enumerate() {
            self.set(node, priority);
            if self.moves > most {
                return self.sort_anew(&priorities[done..]);
            }
        }
    }

    /// Gives one node its priority.
    pub fn set(&mut self, node: u32, priority: f64) {
        if !self.contains(node) {
            self.at_mut(node).priority = priority;
            // Most nodes that are met for the first time belong to the end.
            let place = self.upwards(node, self.tail);
            self.link(node, place);
        } else if priority > self.priority(node) {
            self.at_mut(node).priority = priority;
            let above = self.at(node).before;
            if above != NONE && self.precedes(node, above) {
                self.unlink(node);
                let place = self.upwards(node, above);
                self.link(node, place);
            }
        } else if priority < self.priority(node) {
            self.at_mut(node).priority = priority;
            let below = self.at(node).after;
            if below != NONE && self.precedes(below, node) {
                self.unlink(node);
                let place = self.downwards(node, below);
                self.link(node, place);
            }
        }
    }

    /// Takes a node out of the list.
    pub fn remove(&mut self, node: u32) {
        if self.contains(node) {
            self.unlink(node);
        }
    }

    /// Says whether a node is loaded; it need not be in the list.
    pub fn set_loaded(&mut self, node: u32, loaded: bool) {
        if self.at(node).loaded == loaded {
            return;
        }
        self.at_mut(node).loaded = loaded;
        if !self.contains(node) {
            return;
        }
        if !loaded {
            self.offer(node);
        } else if self.first_unloaded == node {
            self.first_unloaded = self.next_unloaded(self.at(node).after);
        }
    }

    /// Whether `a` stands before `b`, or is the same.
    pub fn precedes_or_is(&self, a: u32, b: u32) -> bool {
        a == b || self.precedes(a, b)
    }

    /// The first node that is not loaded, from this one on.
    fn next_unloaded(&mut self, from: u32) -> u32 {
        let mut at = from;
        while at != NONE && self.at(at).loaded {
            at = self.at(at).after;
            self.moves += 1;
        }
        at
    }

    /// Remembers a node that is not loaded where it precedes the one remembered.
    fn offer(&mut self, node: u32) {
        if self.first_unloaded == NONE || self.precedes(node, self.first_unloaded) {
            self.first_unloaded = node;
        }
    }

    fn precedes(&self, a: u32, b: u32) -> bool {
        let (of_a, of_b) = (self.priority(a), self.priority(b));
        of_a > of_b || (of_a == of_b && a < b)
    }

    /// From `start` up to the last node that precedes `node`; none at the head.
    fn upwards(&mut self, node: u32, start: u32) -> u32 {
        let mut at = start;
        while at != NONE && self.precedes(node, at) {
            at = self.at(at).before;
            self.moves += 1;
        }
        at
    }

    /// From `start`, which precedes `node`, down to the last that does.
    fn downwards(&mut self, node: u32, start: u32) -> u32 {
        let mut at = start;
        loop {
            let next = self.at(at).after;
            self.moves += 1;
            if next == NONE || self.precedes(node, next) {
                return at;
            }
            at = next;
        }
    }

    /// Puts a node behind another, or at the head.
    fn link(&mut self, node: u32, behind: u32) {
        let next = if behind == NONE { self.head } else { self.at(behind).after };
        self.at_mut(node).before = behind;
        self.at_mut(node).after = next;
        *self.slot_after(behind) = node;
        *self.slot_before(next) = node;
        self.at_mut(node).listed = true;
        self.len += 1;
        if !self.at(node).loaded {
            self.offer(node);
        }
    }

    fn unlink(&mut self, node: u32) {
        let (above, below) = (self.at(node).before, self.at(node).after);
        *self.slot_after(above) = below;
        *self.slot_before(below) = above;
        self.at_mut(node).listed = false;
        self.len -= 1;
        if self.first_unloaded == node {
            self.first_unloaded = self.next_unloaded(below);
        }
    }

    fn slot_after(&mut self, node: u32) -> &mut u32 {
        if node == NONE { &mut self.head } else { &mut self.at_mut(node).after }
    }

    fn slot_before(&mut self, node: u32) -> &mut u32 {
        if node == NONE { &mut self.tail } else { &mut self.at_mut(node).before }
    }

    fn sort_anew(&mut self, rest: &[(u32, f64)]) {
        let mut nodes: Vec<u32> =
            std::iter::successors(self.first(), |&node| self.after(node)).collect();
        for &(node, priority) in rest {
            self.at_mut(node).priority = priority;
            if !std::mem::replace(&mut self.at_mut(node).listed, true) {
                nodes.push(node);
            }
        }
        nodes.sort_unstable_by(|&a, &b| {
            self.priority(b).total_cmp(&self.priority(a)).then(a.cmp(&b))
        });
        self.moves += nodes.len() as u64;
        (self.head, self.tail, self.len, self.first_unloaded) = (NONE, NONE, 0, NONE);
        for node in nodes {
            self.link(node, self.tail);
        }
    }
}

fn some(node: u32) -> Option<u32> {
    (node != NONE).then_some(node)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// Every promise of the list against a plain recomputation.
    fn check(list: &PriorityList) {
        let order: Vec<u32> =
            std::iter::successors(list.first(), |&node| list.after(node)).collect();
        let mut back: Vec<u32> =
            std::iter::successors(list.last(), |&node| list.before(node)).collect();
        back.reverse();
        assert_eq!(order, back);
        let mut sorted: Vec<u32> =
            (0..list.entries.len() as u32).filter(|&node| list.contains(node)).collect();
        sorted.sort_by(|&a, &b| {
            list.priority(b).partial_cmp(&list.priority(a)).unwrap().then(a.cmp(&b))
        });
        assert_eq!(order, sorted);
        assert_eq!(list.len(), order.len());
        let first = order.iter().copied().find(|&node| !list.at(node).loaded);
        assert_eq!(list.first_unloaded(), first);
    }

    #[test]
    fn any_sequence_of_changes_leaves_it_sorted_and_the_first_unloaded_known() {
        let mut list = PriorityList::new(24);
        let mut random = Random::new(1, 0);
        for _ in 0..20_000 {
            let node = random.below(24) as u32;
            match random.below(8) {
                0 => list.remove(node),
                1 | 2 => list.set_loaded(node, random.below(2) == 0),
                3 => list.update(&[
                    (node, random.below(9) as f64),
                    ((node + 1) % 24, random.below(9) as f64),
                ]),
                _ => list.set(node, random.below(9) as f64),
            }
            check(&list);
        }
    }

    #[test]
    fn a_jump_sorts_anew_and_gives_the_same_list() {
        let nodes = 2000u32;
        let (mut list, mut slow) =
            (PriorityList::new(nodes as usize), PriorityList::new(nodes as usize));
        let shuffled = |factor: u32| {
            (0..nodes).map(|node| (node, f64::from(node * factor % 1999))).collect::<Vec<_>>()
        };
        list.set_loaded(3, true);
        slow.set_loaded(3, true);
        for factor in [17, 1000, 3] {
            list.update(&shuffled(factor));
            shuffled(factor).iter().for_each(|&(node, priority)| slow.set(node, priority));
            check(&list);
            check(&slow);
            let most = 5 * u64::from(nodes) * 11;
            let moves = list.take_moves();
            assert!(moves <= most, "{moves}");
            assert!(slow.take_moves() > 2 * most, "the case is too easy");
        }
    }

    #[test]
    fn small_changes_move_nodes_by_few_places() {
        let nodes = 3000u32;
        let mut list = PriorityList::new(nodes as usize);
        // Nodes on a line, the camera walking along it.
        let at = |camera: f64| {
            (0..nodes)
                .map(|node| (node, 1.0 / (1.0 + (f64::from(node) - camera).abs())))
                .collect::<Vec<_>>()
        };
        list.update(&at(100.0));
        list.take_moves();
        for frame in 1..=100 {
            list.update(&at(100.0 + f64::from(frame) * 0.05));
        }
        let per_update = list.take_moves() as f64 / (100.0 * f64::from(nodes));
        assert!(per_update < 1.0, "{per_update} places for each update");
    }
}
