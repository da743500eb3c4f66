//! How much of nodes is seen, past what is before them.

use std::collections::VecDeque;
use std::sync::Arc;

use glam::Vec3;
use rustc_hash::FxHashSet;

use super::depth_picture::{DepthPicture, SIZE};
use super::occluders::Occluders;
use crate::camera::View;
use crate::runtime::SceneTree;

/// A picture begins so many seconds after the one before, or later.
const EVERY_S: f64 = 0.1;

/// Triangles that are drawn in a frame, unless a single surface has more.
const TRIANGLES: usize = 3000;

/// Surfaces that are off by less than this on average, in pixels of the picture, are fine enough.
const FINE: f64 = 0.25;

/// The part of what is under a node's box that is seen of it where nothing else is known. By
/// `scripts/gain`, the medians over nodes of eight scenes are 0.03 (a generated city) to 0.41 (a scan of
/// one house): rather high, so that what comes into view is not taken for hidden.
const USUAL: f64 = 0.3;

/// As how many pixels that weighs.
const WEIGHT: f64 = 2.0;

/// Pixels across, and up, that are looked at of a box.
const LOOKED: usize = 16;

/// What is seen from somewhere, once it is known.
#[derive(Clone, Debug)]
struct Known {
    view: View,
    /// The nodes whose surfaces it shows.
    drawn: FxHashSet<u32>,
    /// By pixel: where what is seen is, metres from the eye; infinite where nothing is.
    points: [Vec<f32>; 3],
}

/// How much of nodes is seen, past what is before them.
///
/// Occluders are drawn into a small picture of depths, as fine as it shows, some in each frame. Of the
/// pixels under a node's box, the node is seen in those in which what is nearest is in the box: so
/// that coarse levels tell of finer ones, of which nothing need be in memory.
#[derive(Clone, Debug)]
pub struct SeenAreas {
    occluders: Arc<Occluders>,
    picture: DepthPicture,
    view: Option<View>,
    /// Nodes that are drawn into it.
    drawn: FxHashSet<u32>,
    /// Those of them that are not drawn yet, near ones first.
    left: VecDeque<u32>,
    since_s: f64,
    known: Option<Known>,
    pictures: u32,
}

impl SeenAreas {
    /// Before any view; what is nearer to the eye than `near` metres, above 0, hides nothing.
    pub fn new(occluders: Arc<Occluders>, near: f64) -> Self {
        Self {
            occluders,
            picture: DepthPicture::new(near as f32),
            view: None,
            drawn: FxHashSet::default(),
            left: VecDeque::new(),
            since_s: f64::INFINITY,
            known: None,
            pictures: 0,
        }
    }

    /// The number of the picture that is known; another where anything may have changed.
    pub fn picture(&self) -> u32 {
        self.pictures
    }

    /// Goes on with the picture at hand, or begins one of this view; `dt_s` seconds after the frame
    /// before. The first is drawn in one go.
    pub fn look(&mut self, tree: &SceneTree, view: &View, dt_s: f64) {
        self.since_s += dt_s;
        if self.view.is_none() && !self.begin(tree, view) {
            return;
        }
        let mut drawn = 0;
        while drawn < TRIANGLES || self.known.is_none() {
            let Some(next) = self.left.pop_front() else { break };
            let Some(occluder) = self.occluders.get(next) else { continue };
            self.picture.draw(occluder);
            drawn += occluder.triangles.len();
        }
        if self.left.is_empty() {
            self.finish();
        }
    }

    /// Begins a picture of a view, unless that is known or it is too soon.
    fn begin(&mut self, tree: &SceneTree, view: &View) -> bool {
        let is_known = self.known.as_ref().is_some_and(|known| known.view.pose == view.pose);
        if is_known || self.since_s < EVERY_S {
            return false;
        }
        self.since_s = 0.0;
        self.view = Some(*view);
        self.picture.begin(view);
        let eye = view.pose.position;
        let scale = SIZE[0] as f64 / f64::from(view.size[0]);
        let is_fine =
            |node| tree.node(node).mean_error * tree.pixels_per_metre(node, view) * scale < FINE;
        let squared = |node: u32| {
            let [min, max] = tree.node(node).bbox;
            eye.distance_squared(eye.clamp(min, max))
        };
        let front = self.occluders.front(tree, view, is_fine);
        let mut in_view: Vec<(f64, u32)> =
            front.iter().map(|&node| (squared(node), node)).collect();
        in_view.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.drawn.clear();
        self.drawn.extend(front);
        self.left.clear();
        self.left.extend(in_view.into_iter().map(|(_, node)| node));
        true
    }

    fn finish(&mut self) {
        let Some(view) = self.view.take() else { return };
        let (mut drawn, mut points) =
            self.known.take().map(|known| (known.drawn, known.points)).unwrap_or_default();
        std::mem::swap(&mut drawn, &mut self.drawn);
        self.picture.points_into(&mut points);
        self.known = Some(Known { view, drawn, points });
        self.pictures += 1;
    }

    /// Square metres across the line of sight in which a node was seen; `None` where it was out of the
    /// view that is known.
    pub fn of(&self, tree: &SceneTree, node: u32) -> Option<f64> {
        let view = &self.known.as_ref()?.view;
        let covered = view.frustum.covered(tree.node(node).bbox);
        Some(self.part(tree, node)? * NodeScale::of(tree, node, view).area(covered))
    }

    /// The part of what is under a node's box in which the node was seen, above 0 and to 1; `None` as
    /// in [`of`](Self::of).
    pub fn part(&self, tree: &SceneTree, node: u32) -> Option<f64> {
        let Known { view, drawn, points } = self.known.as_ref()?;
        let [min, max] = tree.node(node).bbox;
        let rectangle = view.frustum.rectangle([min, max])?;
        // The surface that is drawn for it may be off by its error.
        let reach = 2.0 * tree.node(standing_for(tree, node, drawn)).mean_error;
        let eye = view.pose.position;
        let inside = [(min - reach - eye).as_vec3(), (max + reach - eye).as_vec3()];
        let [columns, rows] = pixels(rectangle);
        let step = |pixels: usize| pixels.div_ceil(LOOKED).max(1);
        let (mut looked, mut seen) = (0u32, 0u32);
        for row in rows.clone().step_by(step(rows.len())) {
            for column in columns.clone().step_by(step(columns.len())) {
                let at = row * SIZE[0] + column;
                let at = Vec3::from_array([0, 1, 2].map(|axis| points[axis][at]));
                looked += 1;
                seen += u32::from(at.clamp(inside[0], inside[1]) == at);
            }
        }
        Some((f64::from(seen) + WEIGHT * USUAL) / (f64::from(looked) + WEIGHT))
    }

    /// The same where nothing is known, from a view with this scale of the node and this part of its picture
    /// under the node's box.
    pub fn usual(scale: NodeScale, covered: f64) -> f64 {
        USUAL * scale.area(covered)
    }
}

/// Pixels that a metre of a node takes in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeScale {
    /// At its nearest point.
    pub nearest: f64,
    /// The same, but no nearer than half of its size: from inside of its box, a node is not all at the eye,
    /// and its area is not nothing.
    pub whole: f64,
}

impl NodeScale {
    /// That of a node in a view.
    pub fn of(tree: &SceneTree, node: u32, view: &View) -> Self {
        let [min, max] = tree.node(node).bbox;
        let half = (max - min).length() / 2.0;
        let nearest = tree.pixels_per_metre(node, view);
        Self { nearest, whole: nearest.min(view.pixels_per_metre() / half) }
    }

    /// The part of the picture that an area of the node takes, 0 to 1; square metres across the line of sight,
    /// as parts of the picture at a pixel a metre.
    pub fn part_of_picture(self, area: f64) -> f64 {
        (area * self.per_area()).min(1.0)
    }

    /// The area that takes such a part of the picture.
    fn area(self, part: f64) -> f64 {
        part / self.per_area()
    }

    /// Pixels that a square metre takes.
    fn per_area(self) -> f64 {
        self.whole * self.whole
    }
}

/// The one of some nodes that stands for a node, or is it; a root where none does.
fn standing_for(tree: &SceneTree, mut node: u32, nodes: &FxHashSet<u32>) -> u32 {
    while !nodes.contains(&node) {
        let Some(parent) = tree.node(node).parent else { break };
        node = parent;
    }
    node
}

/// The columns and rows of which the middles are in a rectangle of the picture.
fn pixels([across, up]: [[f64; 2]; 2]) -> [std::ops::Range<usize>; 2] {
    let range = |from: f64, to: f64, pixels: usize| {
        let place = |end: f64| ((end + 1.0) / 2.0 * pixels as f64 - 0.5).ceil().max(0.0) as usize;
        place(from).min(pixels)..place(to).min(pixels)
    };
    // Rows are from above.
    [range(across[0], across[1], SIZE[0]), range(-up[1], -up[0], SIZE[1])]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::occlusion::occluders::Occluder;
    use crate::runtime::test_tree::{Sketch, sketch, tree, view};

    /// A square across the view, so far away, of two triangles.
    fn wall(distance: f32, half: f32) -> Occluder {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let [min, max] = [-half, half].map(|at| Vec3::new(distance, at, at).as_dvec3());
        Occluder {
            bbox: [min, max],
            origin: DVec3::ZERO,
            positions: corners.map(|[y, z]| Vec3::new(distance, y * half, z * half)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    /// Of surfaces of nodes 0, 1, ...
    fn areas(surfaces: Vec<Occluder>) -> SeenAreas {
        let of = (0..surfaces.len() as u32).map(|at| (at, at)).collect();
        SeenAreas::new(Arc::new(Occluders { surfaces, of }), 1e-3)
    }

    /// The parts of what is under the boxes of two cubes, 2 m wide at 11.3 and 21.3 m, that are seen.
    fn seen(surfaces: Vec<Occluder>) -> [f64; 2] {
        let tree = tree([11.3, 21.3].map(|x| sketch([x, 0.0, 0.0], 1.0, vec![])).into());
        let mut areas = areas(surfaces);
        areas.look(&tree, &view(), 0.0);
        let under = |node: u32| {
            let covered = view().frustum.covered(tree.node(node).bbox);
            NodeScale::of(&tree, node, &view()).area(covered)
        };
        [0, 1].map(|node| areas.of(&tree, node).unwrap() / under(node))
    }

    #[test]
    fn what_is_behind_a_wall_is_not_seen_and_what_is_beside_it_is() {
        let [near, far] = seen(vec![wall(10.35, 1.05), wall(20.35, 1.05)]);
        assert!(near > 0.9 && far < 0.05, "{near} {far}");
        let [near, far] = seen(vec![wall(20.35, 1.05)]);
        assert!(near < 0.05 && far > 0.9, "nothing of the near one is there: {near} {far}");
        let [_, far] = seen(vec![wall(10.35, 0.25), wall(20.35, 1.05)]);
        assert!((0.6..0.8).contains(&far), "a fourth of it is hidden: {far}");
    }

    #[test]
    fn what_is_hidden_is_known_some_frames_later_and_out_of_view_never() {
        let boxes = tree([11.0, -11.0].map(|x| sketch([x, 0.0, 0.0], 1.0, vec![])).into());
        let many = Occluder { triangles: vec![[0, 1, 2]; TRIANGLES], ..wall(5.0, 0.1) };
        let mut areas = areas(vec![many, wall(10.5, 1.0)]);
        areas.look(&boxes, &view(), 0.03);
        assert_eq!(areas.picture(), 1, "the first at once");
        assert_eq!(areas.of(&boxes, 1), None);
        for _ in 0..10 {
            areas.look(&boxes, &view(), 0.03);
        }
        assert_eq!(areas.picture(), 1, "nothing moves");
        let mut moved = view();
        moved.pose.position.y += 0.1;
        let moved = View::new(moved.pose, DVec3::ZERO, moved.size);
        areas.look(&boxes, &moved, 0.03);
        assert_eq!(areas.picture(), 1, "half of it is drawn");
        areas.look(&boxes, &view(), 0.03);
        assert_eq!(areas.picture(), 2, "the rest is");
        assert_eq!(areas.known.map(|known| known.view.pose), Some(moved.pose));
    }
    #[test]
    fn surfaces_are_as_fine_as_the_picture_shows() {
        // Off by 2 m, with children that are not, at a distance at which a metre is 0.1 pixel, or 8.
        let at = |x: f64| {
            let leaf = || sketch([x, 0.0, 0.0], 1.0, vec![]);
            Sketch { error: 2.0, ..sketch([x, 0.0, 0.0], 1.0, vec![leaf(), leaf()]) }
        };
        for (x, expected) in [(801.0, vec![0]), (11.0, vec![1, 2])] {
            let tree = tree(vec![at(x)]);
            let wall = || wall(x as f32, 1.0);
            let mut areas = areas(vec![wall(), wall(), wall()]);
            areas.look(&tree, &view(), 0.0);
            let known = areas.known.unwrap();
            assert_eq!(known.drawn, expected.into_iter().collect(), "{x} m");
        }
    }

    #[test]
    fn what_was_seen_from_within_a_node_is_not_nothing_from_beside_it() {
        // A floor of 40 m on which the camera stands, and then half a metre above it.
        let floor = Sketch { size: 40.0, ..sketch([15.0, 0.0, -20.0], 1.0, vec![]) };
        let tree = tree(vec![floor]);
        let mut above = view();
        above.pose.position.z += 0.5;
        let above = View::new(above.pose, DVec3::ZERO, above.size);
        let covered = |view: &View| view.frustum.covered(tree.node(0).bbox);
        let area = SeenAreas::usual(NodeScale::of(&tree, 0, &view()), covered(&view()));
        let part = NodeScale::of(&tree, 0, &above).part_of_picture(area);
        let expected = USUAL * covered(&above);
        assert!((0.5..2.5).contains(&(part / expected)), "{part} {expected}");
    }
}
