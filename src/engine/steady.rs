//! What levels are chosen by, the same from frame to frame for as long as that does little harm.

use super::{CostModel, Load};

/// Prices and budgets that are no further from those of now than this part are kept: where a node's
/// price is near what is left of a frame, every frame's noise would decide anew.
const KEPT: f64 = 0.02;

/// While the camera stands and nothing arrives, a frame is shorter than it may be by as much as this
/// part before anything is chosen anew: nothing but noise has changed, and who stands still sees every
/// change. Not longer, since what is too long is late.
const KEPT_STILL: f64 = 0.05;

/// Prices, and how much longer than by these frames take, as they were when they last changed by
/// more than noise does.
///
/// They change together, by what they come to for what the last frame drew. Noise that raises a price
/// lowers the rest that the price does not explain, so that both together are steadier than each.
#[derive(Clone, Debug)]
pub(super) struct Steady {
    costs: CostModel,
    ratio: f64,
}

impl Steady {
    /// Before any frame.
    pub fn new(costs: &CostModel, ratio: f64) -> Self {
        Self { costs: costs.clone(), ratio }
    }

    /// The cost model to choose by.
    pub fn costs(&self) -> &CostModel {
        &self.costs
    }

    /// What drawing may be expected to take, so that a frame keeps to its target.
    pub fn budget_ms(&self, target_ms: f64) -> f64 {
        target_ms / self.ratio
    }

    /// Compares with the prices and the ratio of now, for what the last frame drew, `drawn`.
    pub fn follow(&mut self, costs: &CostModel, ratio: f64, drawn: &Load, is_still: bool) {
        let kept_ms = self.costs.priced_ms(drawn) * self.ratio;
        let more = costs.priced_ms(drawn) * ratio / kept_ms - 1.0;
        let least = if is_still { -KEPT_STILL } else { -KEPT };
        if !(least..=KEPT).contains(&more) {
            (self.costs, self.ratio) = (costs.clone(), ratio);
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
        steady.follow(&costs, ratio, &DRAWN, is_still);
        (steady.costs().priced_ms(&DRAWN), steady.budget_ms(30.0))
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
        steady.follow(&costs, 1.0, &DRAWN, true);
        assert_eq!(steady.costs().priced_ms(&DRAWN), 200.0);
    }
}
