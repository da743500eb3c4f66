use super::*;
use crate::camera::{View, from_angles};
use crate::engine::occlusion::{seen_past, test_wall};
use crate::engine::test_frame::{TestFrame, passes_over_what_is_not_in_memory, root};
use crate::engine::{HiddenNodes, SeenAreas};
use crate::mesh::UpAxis;
use crate::random::Random;
use crate::runtime::test_tree::{Sketch, sketch, tree};

fn policy(settings: &[(&str, f64)]) -> Box<dyn Policy> {
    KIND.make(&settings.iter().map(|&(name, value)| (name.into(), value)).collect()).unwrap()
}

/// What is drawn once the policy has had a minute.
fn settled(frame: &TestFrame, policy: &mut dyn Policy) -> Vec<u32> {
    (0..1800).map(|_| frame.front(policy)).last().unwrap()
}

#[test]
fn the_highest_gain_for_its_price_comes_first_and_no_time_is_left_that_another_fits_in() {
    // Far: 0 → 1, 2 gains little; near: 3 → 4, 5 much; 6 → 7, 8, 9 more but takes twice.
    let trees = vec![root(40.0, 0.1, 2), root(10.0, 0.1, 2), root(10.0, 0.15, 3)];
    let mut frame = TestFrame::new(tree(trees));
    for (target_ms, front) in [
        (30.0, &[0, 3, 6][..]),
        (40.0, &[0, 4, 5, 6]),
        (60.0, &[0, 4, 5, 7, 8, 9]),
        (70.0, &[1, 2, 4, 5, 7, 8, 9]),
        (5.0, &[0, 3, 6]), // roots are never skipped
    ] {
        frame.target_ms = target_ms;
        assert_eq!(settled(&frame, &mut *policy(&[])), front, "{target_ms} ms");
    }
}

#[test]
fn what_is_below_children_that_are_no_better_is_drawn_where_there_is_time() {
    let at = [10.0, 0.0, 0.0];
    let node = |error: f64, children| Sketch { error, ..sketch(at, 1.0, children) };
    let child = || node(0.1, vec![node(0.0, vec![]), node(0.0, vec![])]);
    let mut frame = TestFrame::new(tree(vec![node(0.1, vec![child(), child()])]));
    frame.target_ms = 100.0;
    assert_eq!(settled(&frame, &mut *policy(&[])), [2, 3, 5, 6]);
}

#[test]
fn a_frame_that_would_be_late_is_relieved_at_once_and_detail_returns_later() {
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), root(11.0, 0.1, 2)]));
    let mut policy = policy(&[("dwell_s", 0.5)]);
    frame.target_ms = 40.0;
    assert_eq!(settled(&frame, &mut *policy), [1, 2, 4, 5]);
    frame.target_ms = 30.0;
    assert_eq!(frame.front(&mut *policy), [1, 2, 3], "what gains least, and no more than that");
    frame.target_ms = 40.0;
    let returned = (1..60).find(|_| frame.front(&mut *policy) == [1, 2, 4, 5]).unwrap();
    assert!((15..=16).contains(&returned), "{returned} frames of 1/30 s");
}

#[test]
fn what_gave_way_to_a_machine_that_became_slower_returns_once_it_is_fast_again() {
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), root(11.0, 0.1, 2)]));
    let mut policy = policy(&[]);
    frame.target_ms = 40.0;
    // Refined only just now: it would rest for long, had it given way for its own price.
    assert_eq!((0..30).map(|_| frame.front(&mut *policy)).last().unwrap(), [1, 2, 4, 5]);
    frame.target_ms = 20.0;
    assert_eq!((0..60).map(|_| frame.front(&mut *policy)).last().unwrap(), [0, 3]);
    frame.target_ms = 40.0;
    assert_eq!(frame.front(&mut *policy), [1, 2, 4, 5]);
}

#[test]
fn what_gave_way_to_what_is_far_returns_once_that_is_not_drawn() {
    let trees = vec![root(10.0, 0.1, 2), root(11.0, 0.1, 2), root(40.0, 0.1, 2)];
    let mut frame = TestFrame::new(tree(trees));
    frame.target_ms = 40.0;
    let mut policy = policy(&[]);
    let whole = frame.view;
    let near = whole.within(Some([[-20.0; 3].into(), [20.0; 3].into()]));
    frame.view = near;
    assert_eq!((0..30).map(|_| frame.front(&mut *policy)).last().unwrap(), [1, 2, 4, 5]);
    // Refined only just now: it would rest for long, had it given way for its own price.
    frame.view = whole;
    assert_eq!((0..60).map(|_| frame.front(&mut *policy)).last().unwrap(), [1, 2, 3, 6]);
    frame.view = near;
    assert_eq!(frame.front(&mut *policy), [1, 2, 4, 5]);
}

/// Whether the farther of two is refined rather than the nearer, once the camera went so many metres
/// towards both. From where it begins both rank alike; from further on, the nearer ranks higher.
fn is_farther(metres: &[f64], settings: &[(&str, f64)]) -> Vec<bool> {
    let small = |distance: f64, error: f64| {
        let at = [distance, 0.0, 0.0];
        let small = |children, error| Sketch { size: 0.1, error, ..sketch(at, 1.0, children) };
        small((0..2).map(|_| small(vec![], 0.0)).collect(), error)
    };
    // Gains fall with the square of the distance, and with its root as errors do.
    let farther_error = 0.1 * 1.4f64.powi(5);
    let mut frame = TestFrame::new(tree(vec![small(10.0, 0.1), small(14.0, farther_error)]));
    frame.target_ms = 30.0;
    let mut policy = policy(settings);
    let mut is_farther = Vec::new();
    for &metres in metres {
        let mut pose = frame.view.pose;
        pose.position.x = metres;
        frame.view = View::new(pose, frame.view.velocity, frame.view.size);
        let front = settled(&frame, &mut *policy);
        assert!(front == [0, 4, 5] || front == [1, 2, 3], "{front:?}");
        is_farther.push(front == [0, 4, 5]);
    }
    is_farther
}

#[test]
fn what_ranks_a_little_higher_does_not_take_the_place_of_what_is_drawn() {
    let path = [0.5, -0.5, 0.5, -15.0, 0.5, -0.5, 5.0];
    assert_eq!(is_farther(&path, &[]), [false, false, false, true, true, true, false]);
    let without = is_farther(&path, &[("hysteresis", 1.0)]);
    assert_eq!(without, [false, true, false, true, false, true, false]);
}

/// Changes of what is drawn in each of ten periods of six seconds, in which frames take longer for
/// half of the time.
fn changes(settings: &[(&str, f64)]) -> Vec<usize> {
    let trees = (0..4).map(|at| root(10.0 + f64::from(at), 0.1, 2)).collect();
    let mut frame = TestFrame::new(tree(trees));
    let mut policy = policy(settings);
    let mut fronts = Vec::new();
    for index in 0..1800 {
        frame.target_ms = if index % 180 < 90 { 80.0 } else { 60.0 };
        fronts.push(frame.front(&mut *policy));
        assert!(fronts.last().is_some_and(|front| front.len() as f64 * 10.0 <= frame.target_ms));
    }
    let count = |period: &[Vec<u32>]| period.windows(2).filter(|at| at[0] != at[1]).count();
    fronts.chunks(180).map(count).collect()
}

#[test]
fn a_camera_that_sways_comes_to_rest() {
    let changes_of = changes(&[]);
    assert!(changes_of[0] > 0 && changes_of[5..].iter().all(|&at| at == 0), "{changes_of:?}");
    let without = changes(&[("backoff_s", 0.0)]);
    assert!(without.iter().all(|&at| at > 0), "{without:?}");
}

/// How many of a fan of roots are refined or coarsened in each of ten periods, in which a camera looks to either
/// side: not all of them are in view at a time, and fewer can be refined the more are.
fn changes_in_a_fan() -> Vec<usize> {
    let fan = (-5..20).map(|at| {
        let (sin, cos) = (f64::from(at) * 0.05).sin_cos();
        let at = [20.0 * cos, 20.0 * sin, 0.0];
        let child = || Sketch { size: 0.2, ..sketch(at, 1.0, vec![]) };
        Sketch { size: 0.2, error: 0.1, ..sketch(at, 1.0, vec![child(), child()]) }
    });
    let mut frame = TestFrame::new(tree(fan.collect()));
    frame.target_ms = 250.0;
    let mut policy = policy(&[]);
    let mut refined = std::collections::BTreeMap::new();
    let mut changes = vec![0; 10];
    let ahead = frame.view;
    for index in 0..3600 {
        let yaw = 10.0 * (f64::from(index) / 360.0 * std::f64::consts::TAU).sin();
        let turned = from_angles(UpAxis::Z, yaw, 0.0, 0.0);
        let straight = from_angles(UpAxis::Z, 0.0, 0.0, 0.0);
        let rotation = turned * straight.conjugate() * ahead.pose.rotation;
        let pose = crate::camera::Pose { rotation, ..ahead.pose };
        frame.view = View::new(pose, ahead.velocity, ahead.size);
        // Roots have two children each.
        for node in frame.front(&mut *policy) {
            let is_refined = node % 3 != 0;
            if refined.insert(node / 3, is_refined).is_some_and(|was| was != is_refined) {
                changes[index as usize / 360] += 1;
            }
        }
    }
    changes
}

#[test]
fn what_fills_the_time_at_one_end_of_a_sway_is_not_taken_back_at_the_other_for_good() {
    let changes = changes_in_a_fan();
    assert!(changes[0] > 0 && changes[3..].iter().all(|&at| at == 0), "{changes:?}");
}

/// Frames until all is refined that there is time for, once a camera that swayed stands still, or
/// moves on; no more than five seconds of them.
fn frames_to_refine(stands: bool) -> usize {
    let trees = (0..4).map(|at| root(10.0 + f64::from(at), 0.1, 2)).collect();
    let mut frame = TestFrame::new(tree(trees));
    let mut policy = policy(&[]);
    let mut step = |frame: &mut TestFrame, moves: bool| {
        let mut pose = frame.view.pose;
        pose.position.y += if moves { 1e-3 } else { 0.0 };
        frame.view = View::new(pose, frame.view.velocity, frame.view.size);
        frame.front(&mut *policy).len()
    };
    for index in 0..720 {
        frame.target_ms = if index % 180 < 90 { 80.0 } else { 60.0 };
        step(&mut frame, true);
    }
    frame.target_ms = 80.0;
    (0..150).take_while(|_| step(&mut frame, !stands) < 8).count()
}

#[test]
fn who_stands_still_after_swaying_waits_for_no_detail() {
    let [still, moving] = [true, false].map(frames_to_refine);
    assert!(still <= 20 && moving == 150, "{still} {moving}");
}

#[test]
fn what_was_out_of_view_is_drawn_as_it_was() {
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2)]));
    frame.target_ms = 20.0;
    let mut policy = policy(&[]);
    let ahead = frame.view;
    assert_eq!(settled(&frame, &mut *policy), [1, 2]);
    let pose = crate::camera::Pose {
        rotation: from_angles(UpAxis::Z, 180.0, 0.0, 0.0),
        ..frame.view.pose
    };
    frame.view = View::new(pose, frame.view.velocity, frame.view.size);
    assert!(settled(&frame, &mut *policy).is_empty());
    frame.view = ahead;
    assert_eq!(frame.front(&mut *policy), [1, 2]);
}

#[test]
fn what_is_not_in_memory_is_asked_for_and_passed_over() {
    passes_over_what_is_not_in_memory(&mut *policy(&[]));
}

#[test]
fn what_is_in_memory_does_not_make_way_for_what_ranks_a_little_higher() {
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), root(10.5, 0.1, 2)]));
    frame.target_ms = 20.0;
    let worth = |frame: &TestFrame, settings: &[(&str, f64)], node: u32| {
        let requests = frame.select(&mut *policy(settings)).requests;
        requests.into_iter().find(|&(asked, _)| asked == node).unwrap().1
    };
    frame.residents.set(1, false);
    let (nearer, there) = (worth(&frame, &[], 1), worth(&frame, &[], 4));
    assert!(nearer < there, "{nearer} {there}");
    let without = [("hysteresis", 1.0)];
    assert!(worth(&frame, &without, 1) > worth(&frame, &without, 4));
    frame.residents.set(1, true);
    assert!(worth(&frame, &[], 1) > there, "both in memory");
}

/// A node of 10 to 19 triangles with two or three children in its halves, down to a depth.
fn random_node(random: &mut Random, at: [f64; 3], size: f64, depth: u32) -> Sketch {
    let count = if depth == 0 { 0 } else { 2 + random.below(2) };
    let children: Vec<Sketch> = (0..count)
        .map(|_| {
            let at = at.map(|at| at + (random.unit() - 0.5) * size / 2.0);
            random_node(random, at, size / 2.0, depth - 1)
        })
        .collect();
    let below = children.iter().map(|child| child.error).fold(0.0, f64::max);
    let error = if depth == 0 { 0.0 } else { below + size * random.between(0.002, 0.01) };
    let triangles = 10 + random.below(10) as u32; // fewer than its children have
    Sketch { size, error, triangles, ..sketch(at, 1.0, children) }
}

/// Gain that could be had of a scene in some time if levels could be mixed and nodes refined whose
/// parents are not: no front gains more.
fn relaxed(mut steps: Vec<(f64, f64)>, mut left_ms: f64) -> f64 {
    steps.sort_by(|a, b| (b.0 / b.1).total_cmp(&(a.0 / a.1)));
    let mut sum = 0.0;
    for (gain, ms) in steps {
        sum += gain * (left_ms / ms).clamp(0.0, 1.0);
        left_ms -= ms;
    }
    sum
}

#[test]
fn little_is_lost_against_the_relaxed_optimum() {
    let mut random = Random::new(17, 0);
    for case in 0..20 {
        let roots = (0..6).map(|_| {
            let at = [random.between(20.0, 60.0), random.between(-15.0, 15.0), 0.0];
            random_node(&mut random, at, 10.0, 4)
        });
        let mut frame = TestFrame::new(tree(roots.collect()));
        let whole = f64::from(leaf_triangles(&frame));
        frame.target_ms = whole * random.between(0.2, 0.6);
        let front = settled(&frame, &mut *policy(&[("slack", 0.0)]));

        let mut gains = Gain::default();
        gains.begin_frame(frame.tree.len(), 0.0);
        let input = frame.input();
        let all = 0..frame.tree.len() as u32;
        let inner = all.filter(|&node| !frame.tree.children(node).is_empty());
        let inner = inner.filter(|&node| input.is_visible(node));
        let mut sum = 0.0;
        let mut steps = Vec::new();
        for node in inner {
            let gain = gains.of(&input, node);
            let is_refined = front.iter().any(|&drawn| is_below(&frame, drawn, node));
            sum += if is_refined { gain } else { 0.0 };
            steps.push((gain, refining_ms(&input, node)));
        }
        let roots_ms = front_ms(&input, frame.tree.roots());
        let best = relaxed(steps, frame.target_ms - roots_ms);
        assert!(sum <= best * (1.0 + 1e-9), "case {case}: {sum} of {best}");
        assert!(sum > 0.9 * best, "case {case}: {sum} of {best}");
    }
}

fn leaf_triangles(frame: &TestFrame) -> u32 {
    let leaves = frame.tree.at(0..frame.tree.len() as u32).1.iter();
    leaves.filter(|node| node.children.is_empty()).map(|node| node.triangles).sum()
}

fn is_below(frame: &TestFrame, mut node: u32, above: u32) -> bool {
    while let Some(parent) = frame.tree.node(node).parent {
        if parent == above {
            return true;
        }
        node = parent;
    }
    false
}

/// What of the front that is chosen is drawn, sorted.
fn drawn(
    policy: &mut dyn Policy,
    frame: &TestFrame,
    seen: Option<&SeenAreas>,
    hidden: &mut HiddenNodes,
) -> Vec<u32> {
    hidden.begin_frame(&frame.view, frame.dt_s);
    let mut out = Selection::default();
    policy.select(&FrameInput { hidden: Some(hidden), seen, ..frame.input() }, &mut out);
    hidden.count_on(&out.counted_on);
    let mut drawn = hidden.drawn(&frame.tree, &out.front, &frame.view).to_vec();
    drawn.sort_unstable();
    drawn
}

#[test]
fn what_hides_the_rest_is_refined_though_there_is_time_for_it_only_then() {
    // Near: 0 → 1, 2, which are a wall where 0 is not; behind it: 3 → 4, 5 and 6 → 7, 8.
    let trees = vec![root(10.0, 0.1, 2), root(20.0, 0.01, 2), root(21.0, 0.01, 2)];
    let mut frame = TestFrame::new(tree(trees));
    frame.target_ms = 32.0;
    let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
    hidden.set(1, Some(test_wall(10.5)));
    let run = |frame: &TestFrame, hidden: &mut HiddenNodes, frames: usize| {
        let mut policy = policy(&[]);
        (0..frames).map(|_| drawn(&mut *policy, frame, None, hidden)).collect::<Vec<_>>()
    };
    let fronts = run(&frame, &mut hidden, 60);
    let leapt = fronts.iter().position(|front| *front != [0, 3, 6]).unwrap();
    assert!(leapt < 30, "{leapt}");
    assert!(fronts[leapt..].iter().all(|front| *front == [1, 2]), "{fronts:?}");

    // Nor is there time with it, without what makes the wall, or while it is not in memory.
    frame.target_ms = 19.0;
    assert_eq!(run(&frame, &mut hidden, 60).last().unwrap(), &[0, 3, 6]);
    frame.target_ms = 32.0;
    let mut bare = HiddenNodes::new(frame.tree.len(), 0.1);
    assert_eq!(run(&frame, &mut bare, 60).last().unwrap(), &[0, 3, 6]);
    frame.residents.set(1, false);
    assert_eq!(run(&frame, &mut hidden, 60).last().unwrap(), &[0, 3, 6]);
}

#[test]
fn what_ranks_low_makes_way_for_what_hides_the_rest() {
    // Near: 0 → 1 to 4, of which 1 is a wall; behind it: 5 → 6, 7 and 8 → 9, 10; beside it: 11 → 12, 13.
    let at = [21.0, 10.0, 0.0];
    let children = (0..2).map(|_| sketch(at, 1.0, vec![])).collect();
    let beside = Sketch { error: 0.02, ..sketch(at, 1.0, children) };
    let behind = || root(20.0, 0.0001, 2);
    let mut frame = TestFrame::new(tree(vec![root(10.0, 1.0, 4), behind(), behind(), beside]));
    let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
    hidden.set(1, Some(test_wall(10.5)));
    let mut policy = policy(&[]);
    let mut fronts = |frame: &TestFrame, frames: usize| {
        let fronts = (0..frames).map(|_| drawn(&mut *policy, frame, None, &mut hidden));
        fronts.collect::<Vec<_>>()
    };
    // Of 52 ms four walls take 40, and what is beside them 20, or 10.
    frame.target_ms = 52.0;
    frame.residents.set(1, false);
    assert_eq!(fronts(&frame, 30).last().unwrap(), &[0, 5, 8, 12, 13], "the wall is not there");
    frame.residents.set(1, true);
    assert_eq!(fronts(&frame, 90)[30..], vec![vec![1, 2, 3, 4, 11]; 60]);
    frame.target_ms = 62.0;
    assert_eq!(fronts(&frame, 90).last().unwrap(), &[1, 2, 3, 4, 12, 13]);
}

#[test]
fn where_the_camera_jumps_to_what_hides_itself_nothing_is_relieved() {
    // Near: 0 → 1, 2, of which 1 is a wall; behind it 3 → 4, 5.
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), root(20.0, 0.01, 2)]));
    frame.target_ms = 45.0;
    let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
    let mut policy = policy(&[]);
    let mut drawn =
        |frame: &TestFrame, hidden: &mut HiddenNodes| drawn(&mut *policy, frame, None, hidden);
    let ahead = frame.view;
    let mut pose = ahead.pose;
    pose.position.x = 1000.0;
    let away = View::new(pose, ahead.velocity, ahead.size);
    assert_eq!(drawn(&frame, &mut hidden), [1, 2, 4, 5], "time for all, and no wall yet");
    frame.view = away;
    assert!(drawn(&frame, &mut hidden).is_empty());
    hidden.set(1, Some(test_wall(10.5)));
    (frame.view, frame.target_ms) = (ahead, 22.0);
    for _ in 0..60 {
        assert_eq!(drawn(&frame, &mut hidden), [1, 2], "the wall hides the rest");
    }
    frame.view = away;
    assert!(drawn(&frame, &mut hidden).is_empty());
    (frame.view, frame.target_ms) = (ahead, 19.0);
    assert_eq!(drawn(&frame, &mut hidden), [0, 3], "there is no time for the wall");
}

#[test]
fn time_is_not_left_over_because_children_hide_each_other_only_once_they_are_drawn() {
    // 0 → 1, a wall, and 2 behind it: 12, 10 and 15 ms. All of 0 is seen.
    let behind = Sketch { triangles: 15, ..sketch([21.0, 0.0, 0.0], 1.0, vec![]) };
    let children = vec![sketch([11.0, 0.0, 0.0], 1.0, vec![]), behind];
    let near = Sketch { error: 0.1, triangles: 12, ..sketch([11.0, 0.0, 0.0], 1.0, children) };
    let mut frame = TestFrame::new(tree(vec![near]));
    let seen = seen_past(&frame.view, &[([11.0, 0.0, 0.0], 1.5)]);
    let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
    let mut policy = policy(&[]);
    let mut last = |frame: &TestFrame, hidden: &mut HiddenNodes, frames: usize| {
        (0..frames).map(|_| drawn(&mut *policy, frame, Some(&seen), hidden)).last().unwrap()
    };
    frame.target_ms = 30.0;
    assert_eq!(last(&frame, &mut hidden, 30), [1, 2], "there is time for both");
    frame.target_ms = 22.0;
    assert_eq!(last(&frame, &mut hidden, 30), [0], "there is not, and node 0 rests");
    hidden.set(1, Some(test_wall(10.5)));
    assert_eq!(last(&frame, &mut hidden, 60), [1], "the wall alone fits");
    assert_eq!(last(&frame, &mut hidden, 300), [1]);
}

#[test]
fn what_a_leap_lacks_is_asked_for_no_longer_than_frames_are_full() {
    // 0 → 1 → 2, 3, which are not in memory.
    let below = sketch([11.0, 0.0, 0.0], 1.0, (0..2).map(|_| root(10.0, 0.0, 0)).collect());
    let children = vec![Sketch { error: 0.1, ..below }, root(10.0, 0.0, 0)];
    let near = Sketch { error: 0.5, ..sketch([11.0, 0.0, 0.0], 1.0, children) };
    let mut frame = TestFrame::new(tree(vec![near]));
    frame.target_ms = 12.0;
    frame.residents.set(2, false);
    frame.residents.set(3, false);
    let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
    let mut policy = policy(&[("ahead", 0.0)]);
    let mut asks = |frame: &TestFrame| {
        hidden.begin_frame(&frame.view, frame.dt_s);
        let mut out = Selection::default();
        policy.select(&FrameInput { hidden: Some(&hidden), ..frame.input() }, &mut out);
        hidden.drawn(&frame.tree, &out.front, &frame.view);
        out.requests.iter().any(|&(node, _)| node == 2)
    };
    assert!((0..60).any(|_| asks(&frame)), "there is no time for node 0's children before");
    let mut pose = frame.view.pose;
    pose.position.x = 1000.0;
    frame.view = View::new(pose, frame.view.velocity, frame.view.size);
    assert!(!asks(&frame), "nothing is in view");
}

#[test]
fn where_all_that_is_drawn_is_seen_nothing_is_loaded_for_a_leap() {
    // 0 → 1 → 2, 3, which are not in memory, and 4; beside it, farther away, 5 → 6, 7 and 8 → 9, 10.
    let below = sketch([11.0, 0.0, 0.0], 1.0, (0..2).map(|_| root(10.0, 0.0, 0)).collect());
    let children = vec![Sketch { error: 0.1, ..below }, root(10.0, 0.0, 0)];
    let near = Sketch { error: 0.5, ..sketch([11.0, 0.0, 0.0], 1.0, children) };
    let beside = |y: f64| {
        let at = [21.0, y, 0.0];
        let children = (0..2).map(|_| sketch(at, 1.0, vec![])).collect();
        Sketch { error: 0.01, ..sketch(at, 1.0, children) }
    };
    let mut frame = TestFrame::new(tree(vec![near, beside(4.0), beside(-4.0)]));
    frame.target_ms = 32.0;
    let squares = [[11.0, 0.0, 0.0], [21.0, 4.0, 0.0], [21.0, -4.0, 0.0]].map(|at| (at, 1.5));
    let walled = [([10.5, 0.0, 0.0], 8.0), squares[1], squares[2]];
    frame.residents.set(2, false);
    frame.residents.set(3, false);
    for (squares, asks) in [(squares, false), (walled, true)] {
        let seen = seen_past(&frame.view, &squares);
        let mut hidden = HiddenNodes::new(frame.tree.len(), 0.1);
        let mut policy = policy(&[("ahead", 0.0)]);
        let is_asked = (0..60).any(|_| {
            hidden.begin_frame(&frame.view, frame.dt_s);
            let mut out = Selection::default();
            let input = FrameInput { hidden: Some(&hidden), seen: Some(&seen), ..frame.input() };
            policy.select(&input, &mut out);
            hidden.drawn(&frame.tree, &out.front, &frame.view);
            out.requests.iter().any(|&(node, _)| node == 2)
        });
        assert_eq!(is_asked, asks, "{squares:?}");
    }
}
