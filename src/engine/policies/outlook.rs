//! How well a view can be drawn in a time.

use std::collections::{BTreeSet, BinaryHeap};

use super::gain_over_price::{part_of_picture, removed};
use super::ranked::{Ranked, added_ms};
use crate::engine::{FrameInput, FrontLoad, NodeScale};

/// Half of a pixel's worst is what an error of so many pixels makes of it. For the order in which nodes are
/// refined the square root is better (`scripts/gain`), but it has no end: one node around the eye, off by a
/// thousand pixels, would outweigh all else that is wrong with a picture.
const HALF_WRONG_PX: f64 = 2.0;

/// So often at most a front is summed up: what it takes is not the sum of what its nodes take.
const ROUNDS: usize = 4;

/// So often it is tried whether a node that does not fit takes less than its triangles do.
const TRIES: usize = 16;

/// How well a view can be drawn within its budget, were everything in memory: levels are chosen anew from
/// the roots, by what the image gains over what it takes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outlook {
    /// What would be drawn.
    pub front: Vec<u32>,
    /// Milliseconds that it takes.
    pub ms: f64,
}

impl Outlook {
    /// Of a view, by its budget; `is_hidden` says of nodes in view that nothing of them is seen, now as in
    /// other frames, whatever is drawn now.
    pub fn of(frame: &FrameInput<'_>, is_hidden: &dyn Fn(u32) -> bool) -> Self {
        let is_drawn = |&node: &u32| frame.is_visible(node) && !is_hidden(node);
        let roots = frame.tree.roots().iter().copied();
        let front: Vec<u32> = roots.filter(is_drawn).collect();
        let mut outlook = Self::from_front(front, frame);
        for _ in 0..ROUNDS {
            if outlook.ms >= frame.budget_ms || !outlook.refine(frame, &is_drawn) {
                break;
            }
        }
        outlook
    }

    /// Of what is drawn.
    pub fn from_front(front: Vec<u32>, frame: &FrameInput<'_>) -> Self {
        Self { ms: front_ms(frame, &front), front }
    }

    /// Refines while there is time; whether anything was.
    fn refine(&mut self, frame: &FrameInput<'_>, is_drawn: &dyn Fn(&u32) -> bool) -> bool {
        let children = |node: u32| frame.tree.children(node).iter().copied().filter(is_drawn);
        let refining_ms = |node: u32| added_ms(frame, node, children(node));
        let mut upgrades = BinaryHeap::new();
        let push = |upgrades: &mut BinaryHeap<Ranked>, node: u32| {
            let per_metre = NodeScale::of(frame.tree, node, frame.view).whole;
            let gain = part_of_picture(frame, node) * removed(frame.tree, node, per_metre);
            if gain > 0.0 && !frame.tree.children(node).is_empty() {
                upgrades.push(Ranked { rank: gain / refining_ms(node), node });
            }
        };
        self.front.iter().for_each(|&node| push(&mut upgrades, node));
        let mut is_refined = BTreeSet::new();
        let (mut ms, mut tries) = (self.ms, TRIES);
        while let Some(Ranked { node, .. }) = upgrades.pop() {
            let mut more_ms = ms + refining_ms(node);
            if more_ms > frame.budget_ms {
                // What is in its place may cover less of the picture, and take less than it seems.
                let others = self
                    .front
                    .iter()
                    .copied()
                    .filter(|&at| at != node && !is_refined.contains(&at));
                more_ms = front_ms(frame, &others.chain(children(node)).collect::<Vec<_>>());
                if more_ms > frame.budget_ms {
                    tries -= 1;
                    if tries == 0 {
                        break;
                    }
                    continue;
                }
            }
            ms = more_ms;
            is_refined.insert(node);
            for child in children(node) {
                self.front.push(child);
                push(&mut upgrades, child);
            }
        }
        self.front.retain(|node| !is_refined.contains(node));
        self.ms = front_ms(frame, &self.front);
        !is_refined.is_empty()
    }

    /// How wrong the picture is: the sum over what is drawn of the part of the picture in which it is seen
    /// times how wrong that is, 0 to 1.
    pub fn wrong(&self, frame: &FrameInput<'_>) -> f64 {
        let of = |&node: &u32| {
            let error = frame.tree.node(node).mean_error;
            part_of_picture(frame, node)
                * wrong(error * NodeScale::of(frame.tree, node, frame.view).whole)
        };
        self.front.iter().map(of).sum()
    }
}

/// How wrong pixels are where a surface is off by so many, 0 to 1.
pub fn wrong(error_px: f64) -> f64 {
    error_px / (error_px + HALF_WRONG_PX)
}

fn front_ms(frame: &FrameInput<'_>, front: &[u32]) -> f64 {
    let load = FrontLoad::default().of(frame.tree, front, frame.view, frame.covered, 0);
    frame.costs.priced_ms(&load)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::{TestFrame, root};
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// Two roots, 10 ms each, which take 10 ms more where they are refined; the nearer is 0.
    fn frame(target_ms: f64) -> TestFrame {
        let tree = tree(vec![root(10.0, 0.1, 2), root(40.0, 0.1, 2)]);
        TestFrame { target_ms, ..TestFrame::new(tree) }
    }

    fn outlook(target_ms: f64, hidden: &[u32]) -> (Vec<u32>, f64, f64) {
        let frame = frame(target_ms);
        let mut found = Outlook::of(&frame.input(), &|node| hidden.contains(&node));
        found.front.sort_unstable();
        let wrong = found.wrong(&frame.input());
        (found.front, found.ms, wrong)
    }

    #[test]
    fn the_more_time_there_is_the_less_is_wrong() {
        let found = [5.0, 25.0, 35.0, 45.0].map(|target_ms| outlook(target_ms, &[]));
        let fronts = found.each_ref().map(|at| at.0.clone());
        assert_eq!(fronts, [vec![0, 3], vec![0, 3], vec![1, 2, 3], vec![1, 2, 4, 5]]);
        let took = found.each_ref().map(|at| at.1.round());
        assert_eq!(took, [20.0, 20.0, 30.0, 40.0]);
        let wrong = found.map(|at| at.2);
        assert!(wrong[0] == wrong[1] && wrong[1] > wrong[2] && wrong[2] > wrong[3]);
        assert_eq!(wrong[3], 0.0);
    }

    #[test]
    fn what_is_hidden_takes_no_time() {
        assert_eq!(outlook(25.0, &[3]).0, [1, 2]);
        assert_eq!(outlook(15.0, &[3, 2]).0, [1]);
        assert_eq!(outlook(15.0, &[0, 3]), (vec![], 0.0, 0.0));
    }

    #[test]
    fn nothing_need_be_in_memory() {
        let mut frame = frame(45.0);
        frame.residents = crate::engine::Residents::none(6);
        assert_eq!(Outlook::of(&frame.input(), &|_| false).front.len(), 4);
    }

    #[test]
    fn wrong_is_half_at_two_pixels() {
        assert_eq!([0.0, 2.0, 6.0].map(wrong), [0.0, 0.5, 0.75]);
    }

    #[test]
    fn a_node_around_the_eye_is_as_far_as_half_of_its_size() {
        let around = Sketch { size: 40.0, error: 1.0, ..sketch([0.0; 3], 1.0, vec![]) };
        let frame = TestFrame::new(tree(vec![around]));
        let frame = frame.input();
        let part = part_of_picture(&frame, 0);
        // A metre takes 50 pixels at a metre.
        let expected = part * wrong(50.0 / (20.0 * 3_f64.sqrt()));
        let found = Outlook::from_front(vec![0], &frame).wrong(&frame);
        assert!(part > 0.1 && (found - expected).abs() < 1e-9, "{found} {expected}");
    }
}
