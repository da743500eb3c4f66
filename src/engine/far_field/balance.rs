//! Whether faces show a view better than the hierarchy.

use glam::DVec3;

use super::FarField;
use crate::engine::policies::{Outlook, part_of_picture, wrong};
use crate::engine::{FrameInput, HiddenNodes, Visibility};
use crate::format::cells::Cell;

/// It is weighed so often, seconds.
const EVERY_S: f64 = 0.25;

/// What hides what is not looked for in every frame; it is weighed without after so many seconds.
const LATEST_S: f64 = 0.75;

/// One way is left where the other is better by this part,
const BETTER: f64 = 0.1;

/// and by more than this: a pixel off in a hundredth of the picture.
const VISIBLE: f64 = 0.01;

/// Frames that take longer than their budget by more than this part are late.
const LATE: f64 = 0.1;

/// What one way is late beside the other says nothing where it is less of the budget than this: estimates are no better.
const LATE_MATTERS: f64 = 0.02;

/// How much more of FLIP a wrong pixel beyond a cull box is than one before it: three to five times, over
/// walks and drives in two cities. What is far is small, and full of edges.
const FAR_WEIGHT: f64 = 4.0;

/// A face is wrong by so many of its texels: it is as far off as one at most, and blurred.
const FACE_TEXELS: f64 = 1.0;

/// Of the budget, so much is counted on where a way is not in use: more than expected may be seen at first.
const COUNTED_ON: f64 = 0.85;

/// A way is given so many seconds before it is weighed: levels come and go meanwhile.
const SETTLES_S: f64 = 1.0;

/// What the way in use was is half forgotten after so many seconds: a moment in which levels have not arrived yet
/// says little.
const IN_USE_HALF_LIFE_S: f64 = 1.0;

/// By how much the other was off what was expected of it, when it was in use, is half forgotten after so many.
const HALF_LIFE_S: f64 = 8.0;

/// Weighs, now and then, whether faces show a view better than the hierarchy, by what the image gains in
/// the time that they leave over.
///
/// Of the way that is in use it is known what it was of late. The other is expected to be what would be chosen for
/// it, and as much off that as it was when it was in use: levels may have had no time to arrive, or hide less
/// than finer ones would.
#[derive(Clone, Debug, Default)]
pub(super) struct Balance {
    use_faces: bool,
    since_s: f64,
    /// What the hierarchy alone, and with faces, was of late beside what was expected of it.
    off: [Picture; 2],
    /// What the way in use was of late, once it has been weighed.
    in_use: Option<Picture>,
    alone: Visibility,
    beside: Visibility,
    in_sight: Visibility,
}

/// What a way to draw a view comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Picture {
    /// Milliseconds over the budget.
    over_ms: f64,
    /// How wrong it is.
    wrong: f64,
}

impl Picture {
    fn and(self, more: Self, times: f64) -> Self {
        Self {
            over_ms: self.over_ms + times * more.over_ms,
            wrong: self.wrong + times * more.wrong,
        }
    }
}

impl Balance {
    /// The hierarchy alone is in use, and given time: levels arrive.
    pub fn new() -> Self {
        Self { since_s: EVERY_S - SETTLES_S, ..Self::default() }
    }

    /// Whether faces are to be drawn.
    pub fn uses_faces(&self) -> bool {
        self.use_faces
    }

    /// A frame has begun, `dt_s` seconds after the one before; whether to weigh in it.
    pub fn is_due(&mut self, dt_s: f64, hidden: Option<&HiddenNodes>) -> bool {
        self.since_s += dt_s;
        let is_known = hidden.is_none_or(HiddenNodes::is_known);
        self.since_s >= if is_known { EVERY_S } else { LATEST_S }
    }

    /// Weighs both ways to draw a view, by the budget of a frame that draws all of it. `front` is what was
    /// chosen of it now; nodes covered so much of the picture of late.
    pub fn weigh(
        &mut self,
        far_field: &FarField,
        frame: &FrameInput<'_>,
        front: &[u32],
        covered: f64,
    ) {
        let since_s = std::mem::take(&mut self.since_s);
        let Some(cell) = far_field.cell_at(frame.view.pose.position) else { return };
        // Until faces are there, what is chosen says nothing of them.
        if self.use_faces != far_field.shown.cull_box.is_some() {
            return;
        }
        let (expected, found) = self.pictures(far_field, cell, frame, front, covered);
        self.decide(expected, found, LATE_MATTERS * frame.budget_ms, since_s.max(0.0));
    }

    /// What the hierarchy alone and it with faces are expected to come to, and what the way in use does.
    fn pictures(
        &mut self,
        far_field: &FarField,
        cell: &Cell,
        frame: &FrameInput<'_>,
        front: &[u32],
        covered: f64,
    ) -> ([Picture; 2], Picture) {
        for visibility in [&mut self.alone, &mut self.beside, &mut self.in_sight] {
            visibility.begin_frame(frame.tree.len());
        }
        let is_hidden = |node: u32| {
            let hides = |hidden: &HiddenNodes| hidden.is_behind(frame.tree, node, frame.view);
            !self.in_sight.get_or(node, || !frame.hidden.is_some_and(hides))
        };
        let alone = FrameInput { visibility: &self.alone, hidden: None, ..*frame };
        let faces = far_field.in_view(cell, frame.view);
        let faces_ms = frame.costs.added_ms(&far_field.load_of(&faces, frame.view, covered));
        let view = frame.view.within(Some(cell.cull_box.map(DVec3::from_array)));
        let (visibility, budget_ms) = (&self.beside, (frame.budget_ms - faces_ms).max(0.0));
        let beside = FrameInput { view: &view, visibility, budget_ms, ..alone };
        let outlook = |frame: &FrameInput<'_>, is_in_use: bool| {
            let budget_ms = frame.budget_ms * if is_in_use { 1.0 } else { COUNTED_ON };
            Outlook::of(&FrameInput { budget_ms, ..*frame }, &is_hidden)
        };
        let whole = outlook(&alone, !self.use_faces);
        let near = outlook(&beside, self.use_faces);

        let is_far = |&node: &u32| !beside.is_visible(node);
        let far_of = |front: &[u32]| {
            Outlook::from_front(front.iter().copied().filter(is_far).collect(), &alone)
        };
        let far_part: f64 =
            far_of(&whole.front).front.iter().map(|&node| part_of_picture(&alone, node)).sum();
        let texel_px = FACE_TEXELS * far_field.texel() * frame.view.pixels_per_metre();
        let without_faces = |of: &Outlook| Picture {
            over_ms: over_ms(of, &alone),
            wrong: of.wrong(&alone) + (FAR_WEIGHT - 1.0) * far_of(&of.front).wrong(&alone),
        };
        let with_faces = |of: &Outlook| Picture {
            over_ms: over_ms(of, &beside),
            wrong: of.wrong(&beside) + FAR_WEIGHT * far_part * wrong(texel_px),
        };
        let now = front.iter().copied().filter(|&node| !is_hidden(node)).collect();
        let found = match self.use_faces {
            false => without_faces(&Outlook::from_front(now, &alone)),
            true => with_faces(&Outlook::from_front(now, &beside)),
        };
        ([without_faces(&whole), with_faces(&near)], found)
    }

    /// Changes to the other way where that is expected to be better than the one in use, of which `found` is drawn,
    /// `since_s` seconds after both were weighed last.
    fn decide(&mut self, expected: [Picture; 2], found: Picture, noise_ms: f64, since_s: f64) {
        let (now, other) = (usize::from(self.use_faces), usize::from(!self.use_faces));
        let kept = |half_life_s: f64| libm::exp2(-since_s / half_life_s);
        let of_late = kept(IN_USE_HALF_LIFE_S);
        let mix = |before: Picture, found: Picture| {
            Picture::default().and(before, of_late).and(found, 1.0 - of_late)
        };
        let in_use = mix(self.in_use.unwrap_or(found), found);
        self.in_use = Some(in_use);
        self.off[now] = mix(self.off[now], found.and(expected[now], -1.0));
        self.off[other] = Picture::default().and(self.off[other], kept(HALF_LIFE_S));
        let other = expected[other].and(self.off[other], 1.0);
        if is_better(other, in_use, noise_ms) {
            self.use_faces = !self.use_faces;
            (self.in_use, self.since_s) = (None, EVERY_S - SETTLES_S);
        }
    }
}

/// Milliseconds by which a frame is late.
fn over_ms(of: &Outlook, frame: &FrameInput<'_>) -> f64 {
    (of.ms - (1.0 + LATE) * frame.budget_ms).max(0.0)
}

/// Whether a picture is clearly less late than another, by more than `noise_ms`, or as late and clearly less wrong.
fn is_better(picture: Picture, than: Picture, noise_ms: f64) -> bool {
    let clearly = |less: f64, more: f64| less < (1.0 - BETTER) * more;
    let is_less_late =
        |a: Picture, b: Picture| b.over_ms - a.over_ms > noise_ms && clearly(a.over_ms, b.over_ms);
    match (is_less_late(picture, than), is_less_late(than, picture)) {
        (true, _) => true,
        (_, true) => false,
        _ => than.wrong - picture.wrong > VISIBLE && clearly(picture.wrong, than.wrong),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::engine::FarFieldMode;
    use crate::engine::test_frame::{TestFrame, root};
    use crate::format::cells::Cells;
    use crate::runtime::test_tree::{Sketch, tree};

    fn picture(over_ms: f64, wrong: f64) -> Picture {
        Picture { over_ms, wrong }
    }

    #[test]
    fn what_is_late_less_is_better_and_then_what_is_less_wrong() {
        let better = |a: [f64; 2], b: [f64; 2]| {
            [
                is_better(picture(a[0], a[1]), picture(b[0], b[1]), 0.1),
                is_better(picture(b[0], b[1]), picture(a[0], a[1]), 0.1),
            ]
        };
        assert_eq!(better([1.0, 0.5], [2.0, 0.1]), [true, false]);
        assert_eq!(better([0.0, 0.5], [1.0, 0.1]), [true, false]);
        assert_eq!(better([0.0, 0.4], [0.0, 0.5]), [true, false]);
        assert_eq!(better([0.05, 0.4], [0.0, 0.5]), [true, false], "as late as that is noise");
        // Neither clearly.
        assert_eq!(better([1.0, 0.5], [0.95, 0.5]), [false; 2]);
        assert_eq!(better([0.0, 0.5], [0.0, 0.46]), [false; 2]);
        assert_eq!(better([0.0, 0.001], [0.0, 0.009]), [false; 2], "neither is seen");
        assert_eq!(better([0.0, 0.0], [0.0, 0.0]), [false; 2]);
    }

    /// A cell about the eye without faces: what is beyond 20 m costs nothing with it.
    fn cells() -> Arc<Cells> {
        let cell = Cell { place: [0, 0, 0], cull_box: [[-20.0; 3], [20.0; 3]], faces: 0..0 };
        Arc::new(Cells {
            scene: [0; 32],
            parameters: serde_json::Value::Null,
            size: 10.0,
            texel: 0.05,
            cells: vec![cell],
            faces: Vec::new(),
        })
    }

    /// A node 11 m away and one 41 m away, 16 m wide, of which each takes 10 ms, and 10 more where it is refined.
    fn frame(target_ms: f64) -> TestFrame {
        let wide = |distance: f64| {
            // The near one is off by two pixels, as far away as half of its size.
            let mut node = root(distance, 0.5, 2);
            node.children.iter_mut().for_each(|child| child.size = 16.0);
            Sketch { size: 16.0, ..node }
        };
        let tree = tree(vec![wide(10.0), wide(40.0)]);
        TestFrame { target_ms, ..TestFrame::new(tree) }
    }

    fn far_field() -> FarField {
        FarField::new(cells(), 6, FarFieldMode::Auto).unwrap()
    }

    /// Whether faces are wanted beside a front, where there is so much time.
    fn wants_faces(target_ms: f64, front: &[u32]) -> bool {
        let (frame, mut far_field) = (frame(target_ms), far_field());
        assert!(!far_field.is_due(SETTLES_S - 0.1, None), "levels arrive");
        assert!(far_field.is_due(0.2, None));
        far_field.weigh(&frame.input(), front, 0.0);
        assert!(!far_field.is_due(0.2, None), "it has been weighed");
        far_field.is_wanted()
    }

    const ROOTS: [u32; 2] = [0, 3];
    const LEAVES: [u32; 4] = [1, 2, 4, 5];

    #[test]
    fn faces_are_used_where_there_is_no_time_for_what_they_show() {
        // With faces the near leaves take 20 ms.
        assert!(wants_faces(12.0, &ROOTS), "roots are late");
        assert!(wants_faces(25.0, &ROOTS), "no time but for roots");
        assert!(!wants_faces(40.0, &LEAVES), "time for all leaves");
    }

    #[test]
    fn what_is_drawn_counts_and_not_what_might_be() {
        assert!(wants_faces(40.0, &ROOTS));
    }

    #[test]
    fn what_fell_short_is_not_expected_again_so_soon() {
        let frame = frame(40.0);
        let mut far_field = far_field();
        let mut balance = Balance::default();
        let mut weigh = |far_field: &FarField, front: &[u32], since_s: f64| {
            balance.is_due(since_s, None);
            balance.weigh(far_field, &frame.input(), front, 0.0);
            balance.uses_faces()
        };
        // The hierarchy alone draws roots where leaves would do.
        assert!(weigh(&far_field, &ROOTS, 0.5));
        far_field.shown.cull_box = Some([DVec3::splat(-20.0), DVec3::splat(20.0)]);
        assert!(weigh(&far_field, &[1, 2], 0.5), "it would again");
        assert!(weigh(&far_field, &[1, 2], 0.5));
        assert!(!weigh(&far_field, &[1, 2], 100.0), "that is long ago");
    }
}
