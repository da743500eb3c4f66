//! What levels are chosen by, the same from frame to frame for as long as that does little harm.

use super::{CostModel, Load};

/// Prices and budgets that are no further from those of now than this part are kept: where a node's
/// price is near what is left of a frame, every frame's noise would decide anew.
const KEPT: f64 = 0.02;

/// While the camera stands and nothing arrives, a frame is shorter than it may be by as much as this
/// part before anything is chosen anew: nothing but noise has changed, and who stands still sees every
/// change. Not longer, since what is too long is late.
const KEPT_STILL: f64 = 0.05;

/// Of the time for drawing, so much is left however wrong estimates are. Where choosing and uploads take
/// half of a short frame, and now and then twice as long, all of it would be kept free otherwise: on a
/// graphics card with a target of 8 ms, three nodes were drawn in 3 ms.
const LEAST_LEFT: f64 = 0.5;

/// Prices, what choosing and uploads take beside them, and how much longer than by both frames take, as they
/// were when they last changed by more than noise does.
///
/// They change together, by what they come to for what the last frame drew. Noise that raises a price
/// lowers the rest that the price does not explain, so that both together are steadier than each.
#[derive(Clone, Debug)]
pub(super) struct Steady {
    costs: CostModel,
    beside_ms: f64,
    ratio: f64,
}

impl Steady {
    /// Before any frame.
    pub fn new(costs: &CostModel, ratio: f64) -> Self {
        Self { costs: costs.clone(), beside_ms: 0.0, ratio }
    }

    /// The cost model to choose by.
    pub fn costs(&self) -> &CostModel {
        &self.costs
    }

    /// What a frame may be expected to take, so that it keeps to its target.
    ///
    /// What is kept free of it is for what drawing less would prevent: of the time beside `least_ms`,
    /// which drawing takes at least, no more than a part is given up for frames that are late for other
    /// reasons.
    pub fn frame_ms(&self, target_ms: f64, least_ms: f64) -> f64 {
        let least_ms = self.beside_ms + least_ms;
        (target_ms / self.ratio).max(least_ms + (target_ms - least_ms).max(0.0) * LEAST_LEFT)
    }

    /// What drawing may be expected to take of it; 0 where choosing and uploads take all of it.
    pub fn budget_ms(&self, target_ms: f64, least_ms: f64) -> f64 {
        (self.frame_ms(target_ms, least_ms) - self.beside_ms).max(0.0)
    }

    /// Compares with the prices, what choosing and uploads take and the ratio of now, for what the last frame drew,
    /// `drawn`.
    pub fn follow(
        &mut self,
        costs: &CostModel,
        beside_ms: f64,
        ratio: f64,
        drawn: &Load,
        is_still: bool,
    ) {
        let kept_ms = (self.costs.priced_ms(drawn) + self.beside_ms) * self.ratio;
        let more = (costs.priced_ms(drawn) + beside_ms) * ratio / kept_ms - 1.0;
        let least = if is_still { -KEPT_STILL } else { -KEPT };
        if !(least..=KEPT).contains(&more) {
            *self = Self { costs: costs.clone(), beside_ms, ratio };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::test_frame::triangles_alone;

    const DRAWN: Load = Load {
        draws: 0.0,
        vertices: 0.0,
        triangles: 100.0,
        plain_fragments: 0.0,
        textured_fragments: 0.0,
        hidden_fragments: 0.0,
        uploaded_bytes: 0.0,
    };

    /// Frames of 30 ms by which the budget goes once prices and ratio have changed from 1.
    fn budget_of(price: f64, ratio: f64, is_still: bool) -> (f64, f64) {
        let mut steady = Steady::new(&CostModel::new(&triangles_alone(1.0)), 1.0);
        let costs = CostModel::new(&triangles_alone(price));
        steady.follow(&costs, 0.0, ratio, &DRAWN, is_still);
        (steady.costs().priced_ms(&DRAWN), steady.budget_ms(30.0, 0.0))
    }

    #[test]
    fn small_changes_are_kept_from_choices_and_larger_ones_followed_at_once() {
        for is_still in [false, true] {
            assert_eq!(budget_of(1.015, 1.0, is_still), (100.0, 30.0));
            assert_eq!(budget_of(1.0, 1.015, is_still), (100.0, 30.0));
            assert_eq!(budget_of(1.5, 1.2, is_still), (150.0, 25.0));
            assert_eq!(budget_of(0.5, 1.0, is_still), (50.0, 30.0));
        }
    }

    #[test]
    fn what_a_price_explains_and_the_rest_does_not_is_no_change() {
        assert_eq!(budget_of(1.25, 0.8, false), (100.0, 30.0));
    }

    #[test]
    fn a_still_camera_leaves_more_unused_and_is_late_no_longer() {
        assert_eq!(budget_of(0.96, 1.0, true), (100.0, 30.0));
        assert_eq!(budget_of(0.96, 1.0, false), (96.0, 30.0));
        assert_eq!(budget_of(1.03, 1.0, true), (103.0, 30.0));
    }

    #[test]
    fn where_nothing_is_known_to_take_time_whatever_is_learned_is_followed() {
        let mut steady = Steady::new(&CostModel::new(&triangles_alone(0.0)), 1.0);
        let costs = CostModel::new(&triangles_alone(2.0));
        steady.follow(&costs, 0.0, 1.0, &DRAWN, true);
        assert_eq!(steady.costs().priced_ms(&DRAWN), 200.0);
    }

    #[test]
    fn half_of_the_time_for_detail_is_left_however_wrong_estimates_are() {
        let costs = CostModel::new(&triangles_alone(0.1));
        let mut steady = Steady::new(&costs, 1.0);
        steady.follow(&costs, 0.0, 2.0, &DRAWN, false);
        let budgets = [0.0, 10.0, 30.0, 40.0].map(|least_ms| steady.budget_ms(30.0, least_ms));
        assert_eq!(budgets, [15.0, 20.0, 30.0, 40.0]);
    }

    #[test]
    fn what_choosing_takes_is_not_left_for_drawing() {
        let costs = CostModel::new(&triangles_alone(0.1));
        let mut steady = Steady::new(&costs, 1.0);
        let mut budget_of = |beside_ms| {
            steady.follow(&costs, beside_ms, 1.25, &DRAWN, false);
            [0.0, 15.0].map(|least_ms| steady.budget_ms(30.0, least_ms))
        };
        assert_eq!(budget_of(4.0), [20.0, 20.5], "half of what is left of 30 ms by 4 and 15");
        assert_eq!(budget_of(4.2), [20.0, 20.5], "of 14 ms, it is noise");
        assert_eq!(budget_of(40.0), [0.0, 15.0]);
    }
}
