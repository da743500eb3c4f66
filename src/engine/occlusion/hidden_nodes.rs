//! Which nodes are hidden by what is drawn before them.

use std::cell::Cell;
use std::sync::Arc;

use super::hiding_picture::HidingPicture;
use super::node_occlusion::NodeOcclusion;
use crate::camera::View;
use crate::engine::Visibility;
use crate::runtime::SceneTree;

/// Where less than this part of the triangles is hidden, it is not looked for in the next frames.
const LEAST_SAVED: f64 = 0.02;

/// Slabs that are drawn where less than `MUCH` is hidden.
const SLABS: usize = 300;

/// And where more is.
const MORE_SLABS: usize = 1000;

/// So much is hidden in streets, less from above.
const MUCH: f64 = 0.2;

/// After so many seconds it is looked for again,
const LOOK_AGAIN_S: f64 = 0.5;

/// or after twice as many, and so on up to these, where it took longer each time than it saved.
const LATEST_LOOK_S: f64 = 8.0;

/// Frames in which what it takes and saves counts half.
const FRAMES: f64 = 8.0;

/// What is hidden is counted on after so many seconds, so that levels do not change with it.
const STEADY_S: f64 = 0.5;

/// Which nodes are hidden by what is drawn before them: nothing of them would be seen, were they drawn.
///
/// What hides is the front itself, at the levels that are drawn: flat pieces of its surfaces that
/// cover all pixels of a cell of the image, whatever a graphics card makes of their edges. While a front is
/// being chosen, that of the frame before stands for it, seen from where the camera is now.
#[derive(Clone, Debug)]
pub struct HiddenNodes {
    /// Metres; nothing nearer is drawn.
    near: f64,
    /// By node, those in memory.
    nodes: Vec<Option<Arc<NodeOcclusion>>>,
    picture: HidingPicture,
    view: Option<View>,
    /// The nodes that hide others in the picture.
    hiding: Vec<u32>,
    /// Which nodes were found to be in sight in it.
    in_sight: Visibility,
    /// By node: when it was last found to be in sight, seconds.
    seen_s: Vec<Cell<f64>>,
    now_s: f64,
    /// By node; of no use but while fronts are compared.
    is_marked: Vec<Cell<bool>>,
    /// Nodes of the frame before that were drawn.
    drawn: Vec<u32>,
    /// Whether the front to come hides other nodes than that of the frame before.
    is_another: bool,
    /// Whether it is looked for in this frame.
    is_looked_for: bool,
    since_s: f64,
    look_again_s: f64,
    /// What part of the triangles was hidden when it was looked for last.
    saved: f64,
    /// Milliseconds that it saves a frame, less what it takes; once both are known.
    gain_ms: Option<f64>,
}

impl HiddenNodes {
    /// Nothing is known of as many nodes; nothing nearer than `near` metres is drawn.
    pub fn new(nodes: usize, near: f64) -> Self {
        Self {
            near,
            nodes: vec![None; nodes],
            picture: HidingPicture::default(),
            view: None,
            hiding: Vec::new(),
            in_sight: Visibility::default(),
            seen_s: vec![Cell::new(f64::NEG_INFINITY); nodes],
            now_s: 0.0,
            is_marked: vec![Cell::new(false); nodes],
            drawn: Vec::new(),
            is_another: false,
            is_looked_for: true,
            since_s: 0.0,
            look_again_s: LOOK_AGAIN_S,
            saved: 0.0,
            gain_ms: None,
        }
    }

    /// What a node that is in memory hides, and how it may be hidden; or that it is no more.
    pub fn set(&mut self, node: u32, occlusion: Option<Arc<NodeOcclusion>>) {
        self.nodes[node as usize] = occlusion;
    }

    /// Begins a frame, `dt_s` seconds after the one before: until its front is chosen, what was drawn
    /// before hides what is behind it.
    pub fn begin_frame(&mut self, view: &View, dt_s: f64) {
        self.since_s += dt_s;
        self.now_s += dt_s;
        self.is_looked_for |= self.since_s >= self.look_again_s;
        let drawn = std::mem::take(&mut self.drawn);
        self.look(view, &drawn);
        self.drawn = drawn;
    }

    fn look(&mut self, view: &View, front: &[u32]) {
        self.view = self.is_looked_for.then_some(*view);
        if !self.is_looked_for {
            return;
        }
        self.in_sight.begin_frame(self.nodes.len());
        let (mut picture, mut hiding) =
            (std::mem::take(&mut self.picture), std::mem::take(&mut self.hiding));
        picture.begin(view, self.near);
        hiding.clear();
        let slabs = if self.saved < MUCH { SLABS } else { MORE_SLABS };
        self.add(&mut picture, &mut hiding, front.iter().copied(), slabs);
        (self.picture, self.hiding) = (picture, hiding);
    }

    /// Lets more nodes hide others in a picture, those that are in memory.
    fn add(
        &self,
        picture: &mut HidingPicture,
        hiding: &mut Vec<u32>,
        nodes: impl Iterator<Item = u32>,
        slabs: usize,
    ) {
        let known = |node: u32| Some((node, self.nodes[node as usize].as_deref()?));
        let nodes: Vec<(u32, &NodeOcclusion)> = nodes.filter_map(known).collect();
        picture.add(&nodes, slabs);
        hiding.extend(nodes.iter().map(|&(node, _)| node));
    }

    /// Lets a picture in which `hiding` hide others show what another front hides: less than if it
    /// were drawn anew, in a part of the time.
    fn change(
        &self,
        tree: &SceneTree,
        picture: &mut HidingPicture,
        hiding: &mut Vec<u32>,
        front: &[u32],
        view: &View,
    ) {
        let marked = |node: u32| &self.is_marked[node as usize];
        front.iter().for_each(|&node| marked(node).set(true));
        if hiding.iter().any(|&node| !marked(node).get()) {
            picture.remove(|node| !marked(node).get());
            hiding.retain(|&node| marked(node).get());
        }
        hiding.iter().for_each(|&node| marked(node).set(false));
        // What is hidden hides nothing more.
        let more: Vec<u32> = front
            .iter()
            .copied()
            .filter(|&node| marked(node).get() && !picture.hides(view, tree.node(node).bbox))
            .collect();
        front.iter().for_each(|&node| marked(node).set(false));
        self.add(picture, hiding, more.into_iter(), MORE_SLABS);
    }

    /// Whether nothing of a node would be seen, or of nodes below it that are within its box.
    pub fn hides(&self, tree: &SceneTree, node: u32) -> bool {
        let Some(view) = &self.view else { return false };
        let is_hidden = || self.is_out(tree, node, view, &self.picture);
        let is_in_sight = || {
            let is_in_sight = !is_hidden();
            if is_in_sight {
                self.seen_s[node as usize].set(self.now_s);
            }
            is_in_sight
        };
        !self.in_sight.get_or(node, is_in_sight)
    }

    /// Whether a node is behind what was drawn, as seen by the whole of a view: [`hides`](Self::hides) takes
    /// what is outside of the [box](crate::camera::Frustum::within) of a frame's view for hidden.
    pub fn is_behind(&self, tree: &SceneTree, node: u32, view: &View) -> bool {
        self.view.is_some() && self.is_out(tree, node, view, &self.picture)
    }

    /// What a front would hide, were it drawn, as far as those in memory are known to hide others.
    pub fn behind<'a>(&'a self, tree: &'a SceneTree, front: &[u32], view: &'a View) -> Behind<'a> {
        let (mut picture, mut hiding) = (self.picture.clone(), self.hiding.clone());
        if self.view.is_none() {
            picture.begin(view, self.near);
            hiding.clear();
        }
        self.change(tree, &mut picture, &mut hiding, front, view);
        Behind { of: self, tree, view, picture }
    }

    /// Takes nodes of the front to come, which hides them, for hidden for a while already.
    pub fn count_on(&mut self, nodes: &[u32]) {
        for &node in nodes {
            self.seen_s[node as usize].set(f64::NEG_INFINITY);
        }
        self.is_another |= !nodes.is_empty();
        self.is_looked_for |= self.is_another;
    }

    fn is_out(&self, tree: &SceneTree, node: u32, view: &View, picture: &HidingPicture) -> bool {
        let is_out = |bbox| view.frustum.outside(bbox) > 0.0 || picture.hides(view, bbox);
        match &self.nodes[node as usize] {
            Some(occlusion) => occlusion.all_out(is_out),
            None => is_out(tree.node(node).bbox),
        }
    }

    /// Looking for it took so many milliseconds in this frame, and what is not drawn would have taken
    /// so many: where that does not pay, it is not looked for in the next frames.
    pub fn weigh(&mut self, took_ms: f64, saved_ms: f64) {
        // Nothing hides before the first frame, which says nothing of the next.
        if self.view.is_none() || self.hiding.is_empty() {
            return;
        }
        let gain_ms = saved_ms - took_ms;
        let mean_ms = self.gain_ms.get_or_insert(gain_ms);
        *mean_ms += (1.0 - libm::exp2(-1.0 / FRAMES)) * (gain_ms - *mean_ms);
        if *mean_ms >= 0.0 {
            self.look_again_s = LOOK_AGAIN_S;
        } else if self.is_looked_for {
            self.is_looked_for = false;
            self.look_again_s = (2.0 * self.look_again_s).min(LATEST_LOOK_S);
            // The next look counts by itself.
            self.gain_ms = None;
        }
    }

    /// Whether it was looked for what hides what in this frame.
    pub fn is_known(&self) -> bool {
        self.view.is_some()
    }

    /// Whether a node has been [hidden](Self::hides) for half a second at least.
    pub fn hides_steadily(&self, tree: &SceneTree, node: u32) -> bool {
        self.hides(tree, node) && self.now_s - self.seen_s[node as usize].get() >= STEADY_S
    }

    /// What has to be drawn of a front that was chosen: the same image as all of it.
    pub fn drawn(&mut self, tree: &SceneTree, front: &[u32], view: &View) -> &[u32] {
        let marked = |node: u32| &self.is_marked[node as usize];
        front.iter().for_each(|&node| marked(node).set(true));
        let all_there = self.hiding.iter().all(|&node| marked(node).get());
        front.iter().for_each(|&node| marked(node).set(false));
        if !all_there || std::mem::take(&mut self.is_another) {
            self.look(view, front);
        }
        self.drawn.clear();
        let mut drawn = std::mem::take(&mut self.drawn);
        drawn.extend(front.iter().copied().filter(|&node| !self.hides(tree, node)));
        // Nothing hides before the first frame, which says nothing of the next.
        if self.is_looked_for && !self.hiding.is_empty() {
            let triangles = |nodes: &[u32]| -> f64 {
                nodes.iter().map(|&node| f64::from(tree.node(node).triangles)).sum()
            };
            self.saved = 1.0 - triangles(&drawn) / triangles(front).max(1.0);
            self.since_s = 0.0;
            self.is_looked_for = self.saved >= LEAST_SAVED;
        }
        self.drawn = drawn;
        &self.drawn
    }
}

/// What a front would hide that is not drawn yet.
#[derive(Clone, Debug)]
pub struct Behind<'a> {
    of: &'a HiddenNodes,
    tree: &'a SceneTree,
    view: &'a View,
    picture: HidingPicture,
}

impl Behind<'_> {
    /// Whether nothing of a node would be seen.
    pub fn hides(&self, node: u32) -> bool {
        self.of.is_out(self.tree, node, self.view, &self.picture)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::occlusion::test_wall;
    use crate::runtime::test_tree::{sketch, tree, view};

    const FRAME_S: f64 = 1.0 / 32.0;

    /// Node 0 at 11 m, and behind it node 1 at 21 m and, not in memory, node 2 at 31 m.
    fn row() -> (SceneTree, HiddenNodes) {
        let tree = tree([11.0, 21.0, 31.0].map(|x| sketch([x, 0.0, 0.0], 1.0, vec![])).into());
        let mut hidden = HiddenNodes::new(3, 0.1);
        hidden.set(0, Some(test_wall(10.5)));
        hidden.set(1, Some(test_wall(20.5)));
        (tree, hidden)
    }

    #[test]
    fn the_front_itself_hides() {
        let (tree, mut hidden) = row();
        hidden.begin_frame(&view(), FRAME_S);
        assert!(!hidden.hides(&tree, 1), "nothing is drawn yet");
        assert_eq!(hidden.drawn(&tree, &[0, 1, 2], &view()), [0, 1, 2]);
        hidden.begin_frame(&view(), FRAME_S);
        assert!(hidden.hides(&tree, 1) && hidden.hides(&tree, 2) && !hidden.hides(&tree, 0));
        assert_eq!(hidden.drawn(&tree, &[2, 1, 0], &view()), [0]);
        assert_eq!(hidden.drawn(&tree, &[1, 2], &view()), [1], "what hid them is not drawn");
        hidden.set(1, None);
        hidden.begin_frame(&view(), FRAME_S);
        assert_eq!(hidden.drawn(&tree, &[1, 2], &view()), [1, 2], "it hides nothing that is known");
    }

    #[test]
    fn what_has_just_been_in_sight_is_not_counted_on() {
        let (tree, mut hidden) = row();
        let mut steady = Vec::new();
        for _ in 0..20 {
            hidden.begin_frame(&view(), FRAME_S);
            hidden.hides(&tree, 1);
            steady.push(hidden.hides_steadily(&tree, 1));
            hidden.drawn(&tree, &[0, 1], &view());
        }
        let first = steady.iter().position(|&steady| steady);
        assert_eq!(first, Some((STEADY_S / FRAME_S) as usize));
        assert!(steady[first.unwrap()..].iter().all(|&steady| steady));
    }

    #[test]
    fn where_it_takes_longer_than_it_saves_it_is_looked_for_ever_more_seldom() {
        let (tree, mut hidden) = row();
        let mut frames = |count: usize, took_ms: f64, saved_ms: f64| {
            let mut frame = || {
                hidden.begin_frame(&view(), FRAME_S);
                hidden.drawn(&tree, &[0, 1], &view());
                hidden.weigh(took_ms, saved_ms);
                hidden.view.is_some()
            };
            (0..count).filter(|_| frame()).count()
        };
        assert_eq!(frames(64, 1.0, 1.5), 64);
        let seconds = |seconds: f64| (seconds / FRAME_S) as usize;
        let looked = frames(seconds(3.0), 1.0, 0.5);
        assert!(looked < 16, "{looked}");
        let looked = frames(seconds(60.0), 1.0, 0.5);
        assert!((6..12).contains(&looked), "{looked}");
        assert!(frames(seconds(20.0), 1.0, 3.0) > seconds(11.0), "it pays again");
    }

    #[test]
    fn where_it_does_not_pay_it_is_looked_for_now_and_then() {
        let (tree, mut hidden) = row();
        let mut frame = |front: &[u32]| {
            hidden.begin_frame(&view(), FRAME_S);
            hidden.drawn(&tree, front, &view());
            hidden.view.is_some()
        };
        assert!(frame(&[0]));
        let looked = (0..64).filter(|_| frame(&[0])).count();
        assert_eq!(looked, 4, "nothing else is there");
        let looked = (0..64).filter(|_| frame(&[0, 1])).count();
        assert!((48..=64).contains(&looked), "{looked}");
    }
}
