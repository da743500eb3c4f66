//! Each rule of the thesis by a case that fails where the rule is dropped.

use super::options::FRAME_S;
use super::*;
use crate::camera::View;
use crate::engine::test_frame::{TestFrame, triangles_alone};
use crate::engine::{CostModel, FrameOutcome, Policy, Prices, Residents, Selection};
use crate::runtime::SceneTree;
use crate::runtime::test_tree::{Sketch, sketch, tree, view};

/// Counters that count at once.
fn options() -> LakhiaOptions {
    LakhiaOptions {
        hyst_switch: 0.001,
        hyst_limit: 3.0,
        v_time_gain: 0.0,
        share_gain: 0.0,
        ..LakhiaOptions::default()
    }
}

/// Frames of 10 ms in which a unit of cost is expected to take `v_time`, and no nodes `fixed_ms`.
fn expecting(tree: &SceneTree, v_time: f64, fixed_ms: f64) -> TestFrame {
    let roots = tree.roots().iter().map(|&root| tree.node(root));
    let triangles: u32 = roots.clone().map(|root| root.triangles).sum();
    let cost: f64 = roots.map(|root| root.cost).sum();
    let prices = triangles_alone(v_time * cost / f64::from(triangles));
    TestFrame {
        costs: CostModel::new(&Prices { frame: fixed_ms, ..prices }),
        dt_s: FRAME_S,
        ..TestFrame::new(tree.clone())
    }
}

fn select(policy: &mut Lakhia, tree: &SceneTree, view: &View, residents: &Residents) -> Selection {
    let frame = expecting(tree, 1.0, 0.0);
    TestFrame { view: *view, residents: residents.clone(), ..frame }.select(policy)
}

fn estimated_ms(selection: &Selection) -> f64 {
    selection.estimate.unwrap().ms
}

fn v_time(selection: &Selection) -> f64 {
    selection.diagnostics[0]
}

fn took(ms: f64) -> FrameOutcome {
    FrameOutcome { actual_ms: ms, frame_ms: ms }
}

fn front(policy: &mut Lakhia, tree: &SceneTree, residents: &Residents) -> Vec<u32> {
    select(policy, tree, &view(), residents).front
}

/// A root of cost 1 with two children in view, of cost `cost` each.
fn fork(cost: f64) -> SceneTree {
    let child = |y: f64| sketch([11.0, y, 0.0], cost, vec![]);
    tree(vec![Sketch { size: 8.0, ..sketch([11.0, 0.0, 0.0], 1.0, vec![child(-2.0), child(2.0)]) }])
}

#[test]
fn children_that_fit_their_share_are_drawn_and_others_not() {
    let (cheap, dear) = (fork(4.9), fork(5.1));
    assert_eq!(front(&mut Lakhia::new(options()), &cheap, &Residents::all(3)), [1, 2]);
    assert_eq!(front(&mut Lakhia::new(options()), &dear, &Residents::all(3)), [0]);
}

/// The thesis's counters begin at 0, which counts as enough: whatever is in memory is drawn until
/// they have fallen by `c_hystSwitch`.
#[test]
fn what_is_new_is_drawn_until_its_counters_fall() {
    let tree = fork(50.0);
    let mut policy = Lakhia::new(LakhiaOptions { hyst_switch: 1.0, ..options() });
    let fronts: Vec<usize> =
        (0..4).map(|_| front(&mut policy, &tree, &Residents::all(3)).len()).collect();
    assert_eq!(fronts, [2, 1, 1, 1], "-0.9 a frame");
}

#[test]
fn children_that_are_not_all_in_memory_are_not_drawn() {
    let tree = fork(1.0);
    let mut residents = Residents::all(3);
    residents.set(2, false);
    let selection = select(&mut Lakhia::new(options()), &tree, &view(), &residents);
    assert_eq!(selection.front, [0]);
    // They are visited all the same, so that they get loaded.
    let visited: Vec<u32> = selection.requests.iter().map(|&(node, _)| node).collect();
    assert_eq!(visited, [0, 1, 2]);
}

#[test]
fn siblings_out_of_view_are_needed_only_where_asked_for() {
    let behind = sketch([-11.0, 0.0, 0.0], 1.0, vec![]);
    let ahead = sketch([11.0, 0.0, 0.0], 1.0, vec![]);
    let tree = tree(vec![Sketch { size: 24.0, ..sketch([0.0; 3], 1.0, vec![ahead, behind]) }]);
    let mut residents = Residents::all(3);
    residents.set(2, false);
    assert_eq!(front(&mut Lakhia::new(options()), &tree, &residents), [1]);
    let all = LakhiaOptions { all_siblings: 1.0, ..options() };
    assert_eq!(front(&mut Lakhia::new(all), &tree, &residents), [0]);
    assert_eq!(front(&mut Lakhia::new(all), &tree, &Residents::all(3)), [1]);
}

#[test]
fn traversal_is_breadth_first() {
    let pair = |y: f64| {
        let leaf = || sketch([11.0, y, 0.0], 0.1, vec![]);
        sketch([11.0, y, 0.0], 0.1, vec![leaf(), leaf()])
    };
    // 0 (1 (2 3) 4 (5 6))
    let tree = tree(vec![sketch([11.0, 0.0, 0.0], 0.1, vec![pair(-3.0), pair(3.0)])]);
    let selection = select(&mut Lakhia::new(options()), &tree, &view(), &Residents::all(7));
    let visited: Vec<u32> = selection.requests.iter().map(|&(node, _)| node).collect();
    assert_eq!(visited, [0, 1, 4, 2, 3, 5, 6]);
    assert_eq!(selection.front, [2, 3, 5, 6]);
}

#[test]
fn nothing_below_the_front_is_visited() {
    let leaf = || sketch([11.0, 0.0, 0.0], 100.0, vec![]);
    let middle = sketch([11.0, 0.0, 0.0], 100.0, vec![leaf(), leaf()]);
    let tree = tree(vec![sketch([11.0, 0.0, 0.0], 1.0, vec![middle])]);
    let selection = select(&mut Lakhia::new(options()), &tree, &view(), &Residents::all(4));
    assert_eq!(selection.front, [0]);
    assert_eq!(selection.visited(), 2);
}

#[test]
fn a_share_is_divided_by_priority_and_passed_down() {
    // Two roots of equal cost, one twice as far: 4 to 1. The near one's child costs 7 of 8 ms,
    // the far one's 3 of 2 ms.
    let root = |y: f64, distance: f64, cost: f64| {
        let child = sketch([distance + 1.0, y, 0.0], cost, vec![]);
        sketch([distance + 1.0, y, 0.0], 0.5, vec![child])
    };
    let near_and_far =
        |near: f64, far: f64| tree(vec![root(0.0, 10.0, near), root(0.0, 20.0, far)]);
    let drawn = |near: f64, far: f64| {
        front(&mut Lakhia::new(options()), &near_and_far(near, far), &Residents::all(4))
    };
    assert_eq!(drawn(7.9, 1.9), [1, 3]);
    assert_eq!(drawn(7.9, 2.1), [1, 2]);
    assert_eq!(drawn(8.1, 1.9), [0, 3]);
}

#[test]
fn time_of_what_is_culled_goes_to_the_others() {
    let child = |x: f64| sketch([x, 0.0, 0.0], 9.0, vec![]);
    let root = |x: f64| sketch([x, 0.0, 0.0], 0.5, vec![child(x)]);
    let both = tree(vec![root(11.0), root(11.0)]);
    assert_eq!(front(&mut Lakhia::new(options()), &both, &Residents::all(4)), [0, 2]);
    let one_behind = tree(vec![root(11.0), root(-11.0)]);
    let selection = select(&mut Lakhia::new(options()), &one_behind, &view(), &Residents::all(4));
    assert_eq!(selection.front, [1]);
    assert_eq!(selection.culled, 1);
}

#[test]
fn roots_in_view_are_always_drawn() {
    let roots = (0..50).map(|_| sketch([11.0, 0.0, 0.0], 1000.0, vec![])).collect();
    let tree = tree(roots);
    let mut policy = Lakhia::new(options());
    for _ in 0..20 {
        assert_eq!(front(&mut policy, &tree, &Residents::all(50)).len(), 50);
    }
}

#[test]
fn many_far_roots_do_not_keep_a_near_one_coarse() {
    let near = sketch([6.0, 0.0, 0.0], 1.0, vec![sketch([6.0, 0.0, 0.0], 2.0, vec![])]);
    let far = (0..20).map(|_| sketch([500.0, 0.0, 0.0], 1.0, vec![]));
    let tree = tree(std::iter::once(near).chain(far).collect());
    let mut policy = Lakhia::new(options());
    for _ in 0..50 {
        assert!(front(&mut policy, &tree, &Residents::all(22)).contains(&1));
    }
}

#[test]
fn counters_delay_a_switch_by_their_urgency() {
    // 4.9 of 5 ms fit; then the time for a unit of cost doubles: urgency (5 − 9.8) / 9.8 = −0.49
    // a frame, so that −1 is reached in the third.
    let tree = fork(4.9);
    let slow = LakhiaOptions { hyst_switch: 1.0, v_time_gain: 1.0, ..options() };
    let mut policy = Lakhia::new(slow);
    let residents = Residents::all(3);
    assert_eq!(front(&mut policy, &tree, &residents), [1, 2]);
    policy.drawn(&took(2.0 * 9.8));
    let fronts: Vec<_> = (0..4).map(|_| front(&mut policy, &tree, &residents).len()).collect();
    assert_eq!(fronts, [2, 2, 1, 1]);
}

#[test]
fn counters_remember_no_more_than_the_limit() {
    // Five hundred frames of plenty, then too little: from 3 to −1 at −0.49 a frame.
    let tree = fork(2.0);
    let slow = LakhiaOptions { hyst_switch: 1.0, v_time_gain: 1.0, ..options() };
    let mut policy = Lakhia::new(slow);
    let residents = Residents::all(3);
    for _ in 0..500 {
        assert_eq!(front(&mut policy, &tree, &residents), [1, 2]);
        policy.drawn(&took(4.0));
    }
    policy.drawn(&took(19.6));
    let frames = (0..).find(|_| front(&mut policy, &tree, &residents) == [0]).unwrap();
    assert_eq!(frames, 8, "4 / 0.49 frames");
}

#[test]
fn one_sibling_in_need_is_outweighed_by_others_with_plenty() {
    // Truncated counters sum to 3 − 1: the siblings are drawn although one exceeds its slice.
    let near = Sketch { benefit: 1000.0, ..sketch([11.0, -2.0, 0.0], 1.0, vec![]) };
    let dear = sketch([11.0, 2.0, 0.0], 5.0, vec![]);
    let tree = tree(vec![Sketch { size: 8.0, ..sketch([11.0, 0.0, 0.0], 1.0, vec![near, dear]) }]);
    let mut policy = Lakhia::new(LakhiaOptions { hyst_switch: 1.0, ..options() });
    for _ in 0..20 {
        assert_eq!(front(&mut policy, &tree, &Residents::all(3)), [1, 2]);
    }
}

#[test]
fn the_estimate_is_overhead_and_time_for_the_costs_drawn() {
    let tree = fork(3.0);
    let frame = expecting(&tree, 0.5, 2.0);
    let mut policy = Lakhia::new(LakhiaOptions { v_time_gain: 1.0, ..options() });
    let selection = frame.select(&mut policy);
    assert_eq!(selection.front, [1, 2]);
    assert!((estimated_ms(&selection) - 5.0).abs() < 1e-12);
    policy.drawn(&took(8.0));
    let selection = frame.select(&mut policy);
    assert!((v_time(&selection) - 1.0).abs() < 1e-12);
    let estimate = selection.estimate.unwrap();
    assert!(
        (estimate.ms - 8.0).abs() < 1e-12 && (estimate.without_feedback_ms - 5.0).abs() < 1e-12
    );
}

#[test]
fn unused_time_goes_to_nodes_that_were_refused() {
    // The near root gets four fifths of the time and needs a tenth; the far one's child costs 4.
    let near = sketch([11.0, 0.0, 0.0], 1.0, vec![]);
    let far = sketch([21.0, 0.0, 0.0], 1.0, vec![sketch([21.0, 0.0, 0.0], 4.0, vec![])]);
    let (tree, residents) = (tree(vec![near, far]), Residents::all(3));
    let run = |share_gain: f64| {
        let options = LakhiaOptions { share_gain, ..options() };
        let mut policy = Lakhia::new(options);
        for _ in 0..300 {
            let selection = select(&mut policy, &tree, &view(), &residents);
            policy.drawn(&took(estimated_ms(&selection)));
        }
        front(&mut policy, &tree, &residents)
    };
    assert_eq!(run(0.0), [0, 1]);
    assert_eq!(run(0.05), [0, 2]);
}

#[test]
fn a_root_that_comes_into_view_and_leaves_again_makes_nothing_flicker() {
    // Ahead 9 of 10 ms; in every fourth frame another root at the side takes half of them.
    let child = |at: [f64; 3]| sketch(at, 9.0, vec![]);
    let root = |at: [f64; 3]| sketch(at, 0.5, vec![child(at)]);
    let tree = tree(vec![root([11.0, 0.0, 0.0]), root([0.0, 11.0, 0.0])]);
    let narrow = view();
    let mut pose = narrow.pose;
    pose.fov_y_deg = 179.0;
    let wide = View::new(pose, narrow.velocity, narrow.size);
    let drawn = |hyst_switch: f64| {
        let options = LakhiaOptions { hyst_switch, hyst_limit: 3.0 * hyst_switch, ..options() };
        let mut policy = Lakhia::new(options);
        (0..40)
            .map(|frame| if frame % 4 == 3 { &wide } else { &narrow })
            .map(|view| select(&mut policy, &tree, view, &Residents::all(4)).front)
            .map(|front| front.contains(&1))
            .collect::<Vec<_>>()
    };
    assert!(drawn(10.0).iter().all(|&drawn| drawn));
    assert!(drawn(0.1).iter().any(|&drawn| !drawn), "a narrow band does flicker");
}
