//! Benefit and priority of a node (thesis, section 4.2, "Priority heuristics").

use glam::DVec3;

use super::LakhiaOptions;
use crate::camera::View;
use crate::runtime::TreeNode;

/// Priorities stay below this, so that sums of them and shares in them are finite.
const MOST: f64 = 1e150;

/// What a view says of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NodeScore {
    /// In view, as far as its box can tell.
    pub visible: bool,
    /// `priority = benefit / cost`; finite and not negative.
    pub priority: f64,
}

/// Metres from a point to a box, 0 inside.
fn distance(point: DVec3, bbox: [DVec3; 2]) -> f64 {
    point.distance(point.clamp(bbox[0], bbox[1]))
}

/// `frustumVis`: 1 in view, falling linearly with the metres outside of it to 0 where these
/// equal the distance from the camera: at the side of a narrow view, or behind the camera.
fn frustum_vis(outside: f64, distance: impl FnOnce() -> f64) -> f64 {
    if outside <= 0.0 { 1.0 } else { (1.0 - outside / distance()).max(0.0) }
}

/// `priority = staticBenefit × vis × foreshorten / (cost × distance²)` with
/// `vis = 1 + c_vis × frustumVis` and `foreshorten = 1 + c_fore × view · avgNormal`.
///
/// `view` is the normal of the image plane towards the eye, so that what faces the camera gains.
/// The distance is that of the node's box from the camera moved on by its velocity.
#[inline(always)] // asked for every node: a call each would take a tenth of selection
pub(super) fn score(
    node: &TreeNode,
    view: &View,
    least_distance: f64,
    options: &LakhiaOptions,
) -> NodeScore {
    let eye = view.pose.position;
    let outside = view.frustum.outside(node.bbox);
    let moved = distance(eye + view.velocity * options.lookahead_s, node.bbox);
    let distance_now = || distance(eye, node.bbox).max(least_distance);
    let distance = moved.max(least_distance);
    let vis = 1.0 + options.vis * frustum_vis(outside, distance_now);
    let foreshorten = 1.0 + options.fore * (-view.frustum.forward).dot(node.average_normal);
    let benefit = node.static_benefit * vis * foreshorten / (distance * distance);
    let priority = if benefit > 0.0 { (benefit / node.cost).min(MOST) } else { 0.0 };
    NodeScore { visible: outside <= 0.0, priority }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{Sketch, sketch, tree, view};

    fn options() -> LakhiaOptions {
        LakhiaOptions::default()
    }

    fn priority(sketch: Sketch, view: &View, options: &LakhiaOptions) -> f64 {
        score(tree(vec![sketch]).node(0), view, 1.0, options).priority
    }

    #[test]
    fn priority_is_benefit_over_cost_and_squared_distance() {
        // A cube of 2 m at 11 m: its near face is 10 m away. In view, no normal.
        let found = priority(sketch([11.0, 0.0, 0.0], 4.0, vec![]), &view(), &options());
        assert!((found - 1.0 * (1.0 + 1.275) / (4.0 * 100.0)).abs() < 1e-15, "{found}");
        let twice = Sketch { benefit: 2.0, ..sketch([11.0, 0.0, 0.0], 4.0, vec![]) };
        assert!((priority(twice, &view(), &options()) - 2.0 * found).abs() < 1e-15);
    }

    #[test]
    fn what_faces_the_camera_matters_more() {
        let facing = |x: f32| {
            let node = Sketch { normal: [x, 0.0, 0.0], ..sketch([11.0, 0.0, 0.0], 1.0, vec![]) };
            priority(node, &view(), &options())
        };
        assert!((facing(-1.0) / facing(0.0) - 1.45).abs() < 1e-12);
        assert!((facing(1.0) / facing(0.0) - 0.55).abs() < 1e-12);
    }

    #[test]
    fn visibility_falls_linearly_outside_of_the_view() {
        assert_eq!(frustum_vis(0.0, || 10.0), 1.0);
        assert_eq!(frustum_vis(5.0, || 10.0), 0.5);
        assert_eq!(frustum_vis(2.5, || 10.0), 0.75);
        assert_eq!(frustum_vis(15.0, || 10.0), 0.0);
        // Behind the camera nothing is added for visibility.
        let found = priority(sketch([-11.0, 0.0, 0.0], 1.0, vec![]), &view(), &options());
        assert!((found - 1.0 / 100.0).abs() < 1e-15, "{found}");
    }

    #[test]
    fn a_camera_on_its_way_sees_what_is_ahead_as_nearer() {
        let mut moving = view();
        moving.velocity = DVec3::new(10.0, 0.0, 0.0);
        let ahead = || sketch([21.0, 0.0, 0.0], 1.0, vec![]);
        let (still, moved) =
            (priority(ahead(), &view(), &options()), priority(ahead(), &moving, &options()));
        assert!((moved / still - (20.0f64 / 15.0).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn odd_figures_give_finite_priorities() {
        let odd = |cost: f64, benefit: f64, at: f64| {
            let node = Sketch { benefit, ..sketch([at, 0.0, 0.0], cost, vec![]) };
            priority(node, &view(), &options())
        };
        assert_eq!(odd(0.0, 1.0, 10.0), MOST);
        assert_eq!(odd(0.0, 0.0, 10.0), 0.0);
        assert_eq!(odd(1.0, f64::MAX, 0.0), MOST);
        assert!((odd(1.0, 1.0, 0.0) - 2.275).abs() < 1e-12, "inside the box: as from 1 m");
    }
}
