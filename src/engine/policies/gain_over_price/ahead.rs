//! What may be wanted in memory soon.

use glam::DQuat;

use super::Options;
use super::gain::Gain;
use super::worth::Worth;
use crate::camera::{Pose, View};
use crate::engine::policies::ranked::wholly_refining_ms;
use crate::engine::{FrameInput, Selection};

/// Nodes that are looked at in a frame, so that looking ahead takes little of it however many there
/// are: views are gone through in turn, over several frames where need be.
const LOOKED_AT: usize = 200;

/// Views to which a camera goes on, at most.
const ONWARD: usize = 3;

/// Turns to views all around, as cosine and sine of half of each: to either side, and back.
const AROUND: [[f64; 2]; 3] = {
    const HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;
    [[HALF, HALF], [0.0, 1.0], [HALF, -HALF]]
};

const VIEWS: usize = ONWARD + AROUND.len();

/// A camera may turn to any side within so many seconds.
const AROUND_S: f64 = 2.0;

/// What may be wanted in memory soon: where the camera goes on to, and all around it.
///
/// From each of these views the hierarchy is gone down as far as nodes will rank as high as the least that
/// is refined now. What will be refined then has its children loaded now.
#[derive(Clone, Debug, Default)]
pub(super) struct Ahead {
    at_hand: Option<Look>,
    /// The next view to be gone through.
    next: usize,
    /// Nodes in the view at hand, and how many of them were looked at.
    queue: Vec<u32>,
    looked_at: usize,
    /// Whose children are wanted in it, as far as was found.
    found: Vec<(u32, f64)>,
    /// What was found in each view when it was gone through last: whose children are worth how much.
    wanted: [Vec<(u32, f64)>; VIEWS],
    /// By node: the last frame in which it was asked for.
    asked: Vec<u32>,
    frame: u32,
}

/// A view that is gone through.
#[derive(Clone, Copy, Debug)]
struct Look {
    number: usize,
    view: View,
    /// What a node in it is worth, over one in view.
    worth: f64,
}

impl Ahead {
    /// Asks for what will rank as high as `least` and is not asked for already. What is in memory is worth
    /// no less for being expected.
    pub fn request(
        &mut self,
        frame: &FrameInput<'_>,
        least: f64,
        worth: &Worth,
        options: &Options,
        out: &mut Selection,
    ) {
        if options.ahead == 0.0 {
            return;
        }
        self.look(frame, least, options);
        self.frame += 1;
        self.asked.resize(frame.tree.len(), 0);
        for &(node, _) in &out.requests {
            self.asked[node as usize] = self.frame;
        }
        for &(parent, expected) in self.wanted.iter().flatten() {
            if !frame.residents.contains(parent) {
                continue;
            }
            let mut there = None;
            for &child in frame.tree.children(parent) {
                let asked = &mut self.asked[child as usize];
                if std::mem::replace(asked, self.frame) != self.frame {
                    let worth = match frame.residents.contains(child) {
                        true => *there.get_or_insert_with(|| {
                            expected.max(worth.away(frame, parent, options))
                        }),
                        false => expected / options.hysteresis,
                    };
                    out.ahead.push((child, worth));
                }
            }
        }
    }

    /// Goes on through a view.
    fn look(&mut self, frame: &FrameInput<'_>, least: f64, options: &Options) {
        if self.at_hand.is_none() {
            self.begin(frame, options);
        }
        let Some(Look { number, view, worth }) = self.at_hand else { return };
        for _ in 0..LOOKED_AT {
            let Some(&node) = self.queue.get(self.looked_at) else {
                std::mem::swap(&mut self.wanted[number], &mut self.found);
                self.at_hand = None;
                return;
            };
            self.looked_at += 1;
            let children = frame.tree.children(node);
            if children.is_empty() || view.frustum.outside(frame.tree.node(node).bbox) > 0.0 {
                continue;
            }
            let rank = Gain::expected(frame.tree, node, &view) / wholly_refining_ms(frame, node);
            if rank > least {
                self.found.push((node, rank * worth));
                self.queue.extend(children.iter().filter(|&&at| frame.residents.contains(at)));
            }
        }
    }

    /// Begins to go through the next view.
    fn begin(&mut self, frame: &FrameInput<'_>, options: &Options) {
        let number = self.next;
        self.next = (number + 1) % VIEWS;
        self.found.clear();
        self.queue.clear();
        self.looked_at = 0;
        let Some((view, after_s)) = expected(frame, number) else {
            self.wanted[number].clear();
            return;
        };
        let worth = libm::pow(options.ahead, after_s);
        self.at_hand = Some(Look { number, view, worth });
        let roots = frame.tree.roots().iter();
        self.queue.extend(roots.filter(|&&root| frame.residents.contains(root)));
    }
}

/// One of the views that may come, and after how many seconds. A camera that stands goes nowhere.
fn expected(frame: &FrameInput<'_>, number: usize) -> Option<(View, f64)> {
    if number < ONWARD {
        let at = frame.predicted.get(number)?;
        return (at.view.pose != frame.view.pose).then_some((at.view, at.after_s));
    }
    let [cosine, sine] = AROUND[number - ONWARD];
    let across = frame.tree.up() * sine;
    let turn = DQuat::from_xyzw(across.x, across.y, across.z, cosine);
    let Pose { rotation, .. } = frame.view.pose;
    let pose = Pose { rotation: turn * rotation, ..frame.view.pose };
    Some((View::new(pose, frame.view.velocity, frame.view.size), AROUND_S))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::engine::PredictedView;
    use crate::engine::test_frame::{TestFrame, root};
    use crate::runtime::test_tree::{Sketch, tree};

    /// A node with two children 10 m behind the camera.
    fn behind() -> Sketch {
        let mut behind = root(10.0, 0.1, 2);
        behind.centre[0] = -behind.centre[0];
        behind.children.iter_mut().for_each(|child| child.centre[0] = -child.centre[0]);
        behind
    }

    /// What is asked for within some frames and what it is worth, where node 0 with children 1 and 2 is
    /// ahead at 10 m, and node 3 with children 4 and 5 as far behind.
    fn asked_for(options: &Options, least: f64, going: Option<DVec3>) -> Vec<(u32, f64)> {
        let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), behind()]));
        [1, 2, 4, 5].iter().for_each(|&child| frame.residents.set(child, false));
        let predicted = going.map(|velocity| {
            let mut pose = frame.view.pose;
            pose.position += velocity;
            PredictedView { after_s: 1.0, view: View::new(pose, velocity, frame.view.size) }
        });
        let predicted: Vec<PredictedView> = predicted.into_iter().collect();
        let input = FrameInput { predicted: &predicted, ..frame.input() };
        let (mut ahead, mut out) = (Ahead::default(), Selection::default());
        let mut kept = Worth::default();
        kept.begin_frame(frame.tree.len(), 0.0, options);
        for _ in 0..2 * VIEWS {
            out.clear();
            out.requests.push((0, 1.0));
            ahead.request(&input, least, &kept, options, &mut out);
        }
        out.ahead.sort_unstable_by_key(|&(node, _)| node);
        out.ahead
    }

    fn nodes(found: &[(u32, f64)]) -> Vec<u32> {
        found.iter().map(|&(node, _)| node).collect()
    }

    #[test]
    fn what_the_camera_may_turn_to_is_asked_for_unless_it_will_rank_too_low() {
        let options = Options::default();
        assert_eq!(nodes(&asked_for(&options, 0.0, None)), [4, 5]);
        assert!(asked_for(&options, f64::MAX, None).is_empty());
        assert!(asked_for(&Options { ahead: 0.0, ..options }, 0.0, None).is_empty());
    }

    #[test]
    fn what_is_in_memory_is_worth_no_less_for_being_expected() {
        let frame = TestFrame::new(tree(vec![behind()]));
        let options = Options::default();
        let (mut ahead, mut out) = (Ahead::default(), Selection::default());
        let mut worth = Worth::default();
        worth.begin_frame(frame.tree.len(), 0.0, &options);
        for _ in 0..2 * VIEWS {
            out.clear();
            ahead.request(&frame.input(), 0.0, &worth, &options, &mut out);
        }
        let away = worth.away(&frame.input(), 0, &options);
        assert_eq!(out.ahead, [(1, away), (2, away)]);
    }

    #[test]
    fn where_it_goes_on_to_is_worth_more_the_sooner_it_is_there() {
        let options = Options::default();
        let found = asked_for(&options, 0.0, Some(DVec3::new(0.5, 0.0, 0.0)));
        assert_eq!(nodes(&found), [1, 2, 4, 5]);
        assert!(found[0].1 > 2.0 * found[2].1, "{found:?}");
        let away = asked_for(&options, 0.0, Some(DVec3::new(20.0, 0.0, 0.0)));
        assert_eq!(nodes(&away), [4, 5], "past what is ahead");
    }
}
