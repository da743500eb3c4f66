//! Ear clipping of rings with many corners, in n log n time.
//!
//! The ear with the shortest diagonal comes first, which keeps triangles small. A corner is an ear
//! where no other corner that is reflex or straight lies in its triangle (Held, FIST: Fast
//! Industrial-Strength Triangulation of Polygons, 2001). Those corners are in a tree of bounding
//! boxes over a Morton order. An ear that is blocked waits until the corner that blocks it is
//! clipped or becomes convex.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec2;

/// The length of a diagonal, as the bits of its square, the corner before which it lies, and the
/// number of changes of that corner's neighbours.
type Candidate = Reverse<(u64, u32, u32)>;

/// Clips ears off a counter-clockwise ring until it has at most `most` corners. Appends their
/// triangles to `triangles` and returns the corners that are left, in their order.
///
/// A ring that intersects itself may run out of ears. Then convex corners are clipped although
/// others lie in their triangles, and at last reflex ones without a triangle.
pub(super) fn clip_ears(ring: &[[f64; 2]], most: usize, triangles: &mut Vec<[u32; 3]>) -> Vec<u32> {
    let mut clipper = Clipper::new(ring);
    let mut left = ring.len();
    while left > most.max(3) {
        let Some(ear) = clipper.next_ear() else { break };
        let [before, after] = clipper.neighbours(ear);
        if clipper.turn(ear) > 0.0 {
            triangles.push([before, ear, after]);
        }
        clipper.clip(ear);
        left -= 1;
    }
    (0..ring.len() as u32).filter(|&corner| !clipper.corners[corner as usize].is_clipped).collect()
}

/// A corner of the ring.
struct Corner {
    at: DVec2,
    before: u32,
    after: u32,
    is_clipped: bool,
    /// The number of changes of its neighbours.
    changes: u32,
    /// The ears that it blocks.
    blocks: Vec<Candidate>,
}

struct Clipper {
    corners: Vec<Corner>,
    /// Corners that are not known to be blocked.
    candidates: BinaryHeap<Candidate>,
    /// Convex corners that were blocked, and reflex ones behind them.
    blocked: BinaryHeap<(Reverse<bool>, Candidate)>,
    blockers: BlockerTree,
}

impl Clipper {
    fn new(ring: &[[f64; 2]]) -> Self {
        let count = ring.len() as u32;
        let corner = |(number, &at): (u32, &[f64; 2])| Corner {
            at: DVec2::from(at),
            before: (number + count - 1) % count,
            after: (number + 1) % count,
            is_clipped: false,
            changes: 0,
            blocks: Vec::new(),
        };
        let corners: Vec<Corner> = (0..).zip(ring).map(corner).collect();
        let mut clipper = Self {
            blockers: BlockerTree::new(ring),
            corners,
            candidates: BinaryHeap::new(),
            blocked: BinaryHeap::new(),
        };
        for corner in 0..count {
            clipper.blockers.set(corner, clipper.blocker(corner));
            clipper.consider(corner);
        }
        clipper.blockers.fill();
        clipper
    }

    fn at(&self, corner: u32) -> DVec2 {
        self.corners[corner as usize].at
    }

    fn neighbours(&self, corner: u32) -> [u32; 2] {
        let Corner { before, after, .. } = self.corners[corner as usize];
        [before, after]
    }

    /// Twice the area of a corner's triangle; above 0 where the corner is convex.
    fn turn(&self, corner: u32) -> f64 {
        let [a, c] = self.neighbours(corner).map(|corner| self.at(corner));
        let b = self.at(corner);
        (b - a).perp_dot(c - b)
    }

    /// The position of a corner that may block ears.
    fn blocker(&self, corner: u32) -> Option<DVec2> {
        let blocks = !self.corners[corner as usize].is_clipped && self.turn(corner) <= 0.0;
        blocks.then(|| self.at(corner))
    }

    /// Makes a corner a candidate, or the last resort where it is not convex.
    fn consider(&mut self, corner: u32) {
        let [a, c] = self.neighbours(corner).map(|corner| self.at(corner));
        let diagonal = a.distance_squared(c).to_bits();
        let candidate = Reverse((diagonal, corner, self.corners[corner as usize].changes));
        match self.turn(corner) > 0.0 {
            true => self.candidates.push(candidate),
            false => self.blocked.push((Reverse(true), candidate)),
        }
    }

    /// The corner to clip; `None` where none is left.
    fn next_ear(&mut self) -> Option<u32> {
        while let Some(candidate) = self.candidates.pop() {
            if !self.is_current(candidate) {
                continue;
            }
            let Reverse((_, corner, _)) = candidate;
            let [a, c] = self.neighbours(corner).map(|corner| self.at(corner));
            match self.blockers.first_in([a, self.at(corner), c]) {
                Some(blocker) => {
                    self.corners[blocker as usize].blocks.push(candidate);
                    self.blocked.push((Reverse(false), candidate));
                }
                None => return Some(corner),
            }
        }
        while let Some((_, candidate)) = self.blocked.pop() {
            if self.is_current(candidate) {
                let Reverse((_, corner, _)) = candidate;
                return Some(corner);
            }
        }
        None
    }

    /// False where the corner was clipped or its neighbours changed since.
    fn is_current(&self, Reverse((_, corner, changes)): Candidate) -> bool {
        let corner = &self.corners[corner as usize];
        !corner.is_clipped && corner.changes == changes
    }

    fn clip(&mut self, ear: u32) {
        let [before, after] = self.neighbours(ear);
        self.corners[ear as usize].is_clipped = true;
        self.corners[before as usize].after = after;
        self.corners[after as usize].before = before;
        for corner in [before, after] {
            self.corners[corner as usize].changes += 1;
            self.consider(corner);
        }
        for corner in [before, ear, after] {
            let blocker = self.blocker(corner);
            if blocker.is_none() {
                self.candidates.extend(std::mem::take(&mut self.corners[corner as usize].blocks));
            }
            self.blockers.update(corner, blocker);
        }
    }
}

/// A box without points.
const EMPTY: [DVec2; 2] = [DVec2::INFINITY, DVec2::NEG_INFINITY];

/// A complete binary tree of the bounding boxes of corners that may block ears.
struct BlockerTree {
    /// The root is 1, and the nodes below node n are 2n and 2n + 1. The second half are leaves.
    boxes: Vec<[DVec2; 2]>,
    /// The corner of each leaf.
    corner_of_leaf: Vec<u32>,
    leaf_of_corner: Vec<u32>,
    /// Nodes to visit.
    stack: Vec<u32>,
}

impl BlockerTree {
    /// A tree for the corners of a ring, without blockers.
    fn new(ring: &[[f64; 2]]) -> Self {
        let low = ring.iter().map(|&at| DVec2::from(at)).fold(DVec2::INFINITY, DVec2::min);
        let high = ring.iter().map(|&at| DVec2::from(at)).fold(DVec2::NEG_INFINITY, DVec2::max);
        let scale = f64::from(u32::MAX) / (high - low).max_element();
        let code = |corner: u32| {
            let cell = (DVec2::from(ring[corner as usize]) - low) * scale;
            spread(cell.x as u32) | spread(cell.y as u32) << 1
        };
        let mut corner_of_leaf: Vec<u32> = (0..ring.len() as u32).collect();
        corner_of_leaf.sort_by_cached_key(|&corner| code(corner));
        let mut leaf_of_corner = vec![0; ring.len()];
        for (leaf, &corner) in (0..).zip(&corner_of_leaf) {
            leaf_of_corner[corner as usize] = leaf;
        }
        let boxes = vec![EMPTY; 2 * ring.len().next_power_of_two()];
        Self { boxes, corner_of_leaf, leaf_of_corner, stack: Vec::new() }
    }

    /// Sets whether a corner may block ears, by its position; [`Self::fill`] is due afterwards.
    /// Returns the node.
    fn set(&mut self, corner: u32, blocker: Option<DVec2>) -> usize {
        let node = self.boxes.len() / 2 + self.leaf_of_corner[corner as usize] as usize;
        self.boxes[node] = blocker.map_or(EMPTY, |at| [at, at]);
        node
    }

    /// Sets all boxes above the leaves.
    fn fill(&mut self) {
        (1..self.boxes.len() / 2).rev().for_each(|node| self.join(node));
    }

    /// Sets the box of a node from those below it.
    fn join(&mut self, node: usize) {
        let [[low, high], [other_low, other_high]] =
            [self.boxes[2 * node], self.boxes[2 * node + 1]];
        self.boxes[node] = [low.min(other_low), high.max(other_high)];
    }

    /// Sets whether a corner may block ears, and the boxes above it.
    fn update(&mut self, corner: u32, blocker: Option<DVec2>) {
        let mut node = self.set(corner, blocker) / 2;
        while node > 0 {
            self.join(node);
            node /= 2;
        }
    }

    /// A corner in a counter-clockwise triangle or on its sides, but not at its corners.
    fn first_in(&mut self, triangle: [DVec2; 3]) -> Option<u32> {
        let leaves = self.boxes.len() / 2;
        self.stack.clear();
        self.stack.push(1);
        while let Some(node) = self.stack.pop() {
            let bounds = self.boxes[node as usize];
            if !may_meet(triangle, bounds) {
                continue;
            }
            if (node as usize) < leaves {
                self.stack.extend([2 * node, 2 * node + 1]);
            } else if !triangle.contains(&bounds[0]) {
                return Some(self.corner_of_leaf[node as usize - leaves]);
            }
        }
        None
    }
}

/// False where a box lies outside one side of a counter-clockwise triangle or outside its bounds.
/// A box of one point meets the triangle where this is true.
fn may_meet(triangle: [DVec2; 3], [low, high]: [DVec2; 2]) -> bool {
    let [a, b, c] = triangle;
    let overlaps = low.cmple(a.max(b).max(c)).all() && high.cmpge(a.min(b).min(c)).all();
    overlaps
        && [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
            let inward = (to - from).perp();
            let farthest = DVec2::select(inward.cmpgt(DVec2::ZERO), high, low);
            inward.dot(farthest - from) >= 0.0
        })
}

/// Spreads bits to the even places.
fn spread(bits: u32) -> u64 {
    let mut spread = u64::from(bits);
    for (shift, mask) in [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ] {
        spread = (spread | spread << shift) & mask;
    }
    spread
}
