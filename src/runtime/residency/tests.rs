//! Loading, eviction and the cap, on small hierarchies, with whoever loads played by the test.

use super::*;
use crate::random::Random;
use crate::runtime::SceneTree;
use crate::runtime::test_tree::{Sketch, sketch, tree};

/// Seconds of a frame.
pub(super) const FRAME_S: f64 = 1.0 / 30.0;

pub(super) const HELD: u64 = 500;
pub(super) const FILE: u64 = 1000;

pub(super) fn sizes(nodes: usize) -> Sizes {
    let node = NodeSize { file_bytes: FILE, held_bytes: HELD, ..NodeSize::default() };
    Sizes { nodes: vec![node; nodes], textures: Vec::new() }
}

pub(super) fn options(max_memory_bytes: u64) -> ResidencyOptions {
    ResidencyOptions { max_memory_bytes, chunk_bytes: 400, ..ResidencyOptions::default() }
}

pub(super) fn leaf() -> Sketch {
    sketch([0.0; 3], 1.0, vec![])
}

/// 0 (1 (2 3) 4 (5 6))
pub(super) fn two_levels() -> SceneTree {
    let pair = || sketch([0.0; 3], 1.0, vec![leaf(), leaf()]);
    tree(vec![sketch([0.0; 3], 1.0, vec![pair(), pair()])])
}

pub(super) fn started(tree: &SceneTree, sizes: Sizes, options: ResidencyOptions) -> Residency {
    let mut residency = Residency::new(tree, sizes, options).unwrap();
    for &root in tree.roots() {
        let step = residency.load_root(root);
        assert!(residency.chunk_read(root, step.bytes));
        residency.loaded(root);
    }
    assert_eq!(residency.begin_frame(FRAME_S).arrived, tree.roots());
    residency
}

/// Invariants of residency, recomputed.
pub(super) fn check(residency: &Residency, tree: &SceneTree, sizes: &Sizes, cap: u64) {
    assert!(residency.used_bytes() <= cap && residency.peak_bytes() <= cap);
    let mut used = 0;
    // What is in memory counts until drawing was told to let go of it.
    let in_memory = (0..sizes.textures.len() as u32).map(|texture| residency.has_texture(texture));
    let mut textures: Vec<bool> = in_memory.collect();
    for node in 0..tree.len() as u32 {
        let state = residency.state(node);
        let held = !matches!(state, NodeState::Absent | NodeState::Broken);
        let size = &sizes.nodes[node as usize];
        if held {
            used += size.bytes();
            size.textures.iter().for_each(|&texture| textures[texture as usize] = true);
        }
        if matches!(state, NodeState::Loading { .. }) {
            used += residency.files_of_load(node);
        }
        if let (true, Some(parent)) = (held, tree.node(node).parent) {
            let above = residency.state(parent);
            let both = state == NodeState::Leaving && above == NodeState::Leaving;
            assert!(above == NodeState::Resident || both, "{above:?} above node {node}");
        }
    }
    for (texture, size) in textures.iter().zip(&sizes.textures) {
        used += if *texture { size.held_bytes } else { 0 };
    }
    assert_eq!(residency.used_bytes(), used);
}

/// Reads until there is nothing to do; the nodes loaded, in order.
pub(super) fn load_all(residency: &mut Residency) -> Vec<u32> {
    let mut loaded = Vec::new();
    while let Some(step) = residency.next_step() {
        if residency.chunk_read(step.node, step.bytes) {
            residency.loaded(step.node);
            loaded.push(step.node);
        }
    }
    loaded
}

/// Frames until nothing changes any more, for which what nodes were worth lately has to be
/// forgotten; the nodes loaded and left, in order.
pub(super) fn settle(residency: &mut Residency, priorities: &[(u32, f64)]) -> (Vec<u32>, Vec<u32>) {
    let (mut loaded, mut left) = (Vec::new(), Vec::new());
    for _ in 0..130 {
        left.extend(residency.begin_frame(FRAME_S).left);
        residency.set_priorities(priorities, &[]);
        loaded.extend(load_all(residency));
    }
    (loaded, left)
}

#[test]
fn the_most_important_node_is_loaded_first_and_children_after_their_parent() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    let priorities = [(0, 9.0), (1, 3.0), (4, 5.0), (2, 8.0), (3, 7.0), (5, 1.0), (6, 2.0)];
    residency.set_priorities(&priorities, &[]);
    assert_eq!(load_all(&mut residency), [4, 1], "children wait for their parents to arrive");
    residency.begin_frame(FRAME_S);
    residency.set_priorities(&priorities, &[]);
    assert_eq!(load_all(&mut residency), [2, 3, 6, 5]);
}

#[test]
fn a_load_is_suspended_for_a_more_important_one_and_resumed() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 2.0)], &[]);
    let step = residency.next_step().unwrap();
    assert_eq!(step, Step { node: 1, from: 0, bytes: 400 });
    assert!(!residency.chunk_read(1, 400));
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 4.0)], &[]);
    assert_eq!(residency.next_step(), Some(Step { node: 4, from: 0, bytes: 400 }));
    assert_eq!(residency.state(1), NodeState::Loading { read: 400 });
    assert_eq!(residency.counters().suspensions, 1);
    residency.set_priorities(&[(0, 9.0), (1, 5.0), (4, 4.0)], &[]);
    assert_eq!(residency.next_step(), Some(Step { node: 1, from: 400, bytes: 400 }));
    assert!(!residency.chunk_read(1, 400));
    assert_eq!(residency.next_step(), Some(Step { node: 1, from: 800, bytes: 200 }));
    assert!(residency.chunk_read(1, 200));
}

#[test]
fn what_somebody_reads_or_decodes_is_left_to_them() {
    let tree = two_levels();
    let sizes = sizes(tree.len());
    let mut residency = started(&tree, sizes, options(1 << 20));
    residency.set_priorities(&[(0, 9.0), (1, 2.0), (4, 1.0)], &[]);
    let first = residency.next_step().unwrap();
    residency.take_up(first.node);
    let second = residency.next_step().unwrap();
    assert_eq!((first.node, second.node), (1, 4));
    residency.take_up(second.node);
    assert_eq!(residency.next_step(), None);
    assert_eq!(residency.counters().suspensions, 0, "both go on");
    residency.chunk_read(first.node, first.bytes);
    residency.put_down(first.node);
    let Step { node, from, .. } = residency.next_step().unwrap();
    assert_eq!((node, from), (1, first.bytes));
}

#[test]
fn what_is_no_longer_visited_is_not_loaded() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 2.0)], &[]);
    residency.set_priorities(&[(0, 9.0)], &[]);
    assert_eq!(residency.next_step(), None);
    assert_eq!(residency.waiting(), 0);
}

#[test]
fn what_may_be_wanted_soon_is_loaded_at_a_tenth_of_the_rate_and_given_up_when_it_is_not() {
    let tree = two_levels();
    let many = ResidencyOptions { upload_bytes_per_s: 100 * HELD, ..options(1 << 20) };
    let mut residency = started(&tree, sizes(7), many);
    let ahead = [(1, 2.0), (2, 1.5), (4, 1.0), (5, 1.0)];
    let mut loaded = Vec::new();
    for _ in 0..20 {
        residency.begin_frame(0.01);
        residency.set_priorities(&[(0, 9.0)], &[]);
        residency.set_ahead(&ahead);
        assert_eq!(residency.waiting(), 0, "nothing is missing yet");
        loaded.push(load_all(&mut residency));
    }
    // A tenth of a node in each frame: one at once, and one each time that it is paid for.
    assert_eq!(loaded.concat(), [1, 2, 4]);
    assert!(loaded[0] == [1] && loaded.iter().all(|nodes| nodes.len() <= 1));
    // What is visited does not wait.
    residency.begin_frame(0.01);
    residency.set_priorities(&[(0, 9.0), (4, 3.0), (5, 3.0)], &[]);
    assert_eq!(load_all(&mut residency), [5]);
    residency.set_ahead(&[(6, 1.0)]);
    residency.set_priorities(&[(0, 9.0)], &[]);
    residency.begin_frame(10.0);
    assert_eq!(residency.next_step(), None);
}

#[test]
fn nothing_is_evicted_for_what_may_be_wanted_soon() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(2 * HELD + HELD + FILE));
    assert_eq!(settle(&mut residency, &[(0, 9.0), (1, 3.0), (4, 2.0)]), (vec![1, 4], vec![]));
    for _ in 0..130 {
        assert!(residency.begin_frame(FRAME_S).left.is_empty());
        residency.set_priorities(&[(0, 9.0), (1, 3.0)], &[(4, 0.1)]);
        residency.set_ahead(&[(2, 2.0)]);
        assert!(load_all(&mut residency).is_empty());
    }
    // For what is visited it is.
    assert_eq!(settle(&mut residency, &[(0, 9.0), (1, 3.0), (2, 2.0)]), (vec![2], vec![4]));
}

#[test]
fn the_cap_holds_and_less_important_nodes_are_evicted() {
    let tree = two_levels();
    // Root, one more held, and the file of a third.
    let cap = 2 * HELD + HELD + FILE;
    let mut residency = started(&tree, sizes(7), options(cap));
    let (loaded, left) = settle(&mut residency, &[(0, 9.0), (1, 3.0), (4, 2.0)]);
    assert_eq!((loaded, left), (vec![1, 4], vec![]));
    // No room to read a fourth: 2 is worth more than 4, so 4 leaves.
    let priorities = [(0, 9.0), (1, 3.0), (4, 0.5), (2, 2.0), (3, 0.1)];
    let (loaded, left) = settle(&mut residency, &priorities);
    assert_eq!((loaded, left), (vec![2], vec![4]));
    check(&residency, &tree, &sizes(7), cap);
}

#[test]
fn roots_and_the_ancestors_of_what_is_loaded_stay() {
    let tree = two_levels();
    let cap = 2 * HELD + FILE;
    let mut residency = started(&tree, sizes(7), options(cap));
    settle(&mut residency, &[(0, 0.1), (1, 0.2), (4, 0.1)]);
    assert_eq!(residency.state(1), NodeState::Resident);
    let (loaded, left) = settle(&mut residency, &[(0, 0.1), (1, 0.2), (2, 99.0), (3, 99.0)]);
    assert_eq!((loaded, left), (vec![], vec![]), "only the root and 2's parent could leave");
    assert_eq!(residency.used_bytes(), 2 * HELD);
}

#[test]
fn nearly_equal_priorities_do_not_push_each_other_out() {
    let tree = two_levels();
    let cap = 2 * HELD + FILE;
    let mut residency = started(&tree, sizes(7), options(cap));
    settle(&mut residency, &[(0, 9.0), (1, 1.0), (4, 0.99)]);
    let before = residency.counters();
    for frame in 0..200 {
        let sway = if frame % 2 == 0 { 0.04 } else { -0.04 };
        residency.begin_frame(FRAME_S);
        residency.set_priorities(&[(0, 9.0), (1, 1.0 + sway), (4, 1.0 - sway)], &[]);
        load_all(&mut residency);
        check(&residency, &tree, &sizes(7), cap);
    }
    assert_eq!(residency.counters(), before);
    // A difference beyond the margin does.
    let (loaded, left) = settle(&mut residency, &[(0, 9.0), (1, 1.0), (4, 1.2)]);
    assert_eq!((loaded, left), (vec![4], vec![1]));
}

#[test]
fn nothing_is_evicted_in_vain() {
    let tree = two_levels();
    let mut sizes = sizes(7);
    sizes.nodes[4].held_bytes = 1 << 20;
    let cap = 4 * HELD + FILE;
    let mut residency = started(&tree, sizes.clone(), options(cap));
    let (loaded, left) = settle(&mut residency, &[(0, 9.0), (1, 1.0), (4, 50.0)]);
    assert_eq!((loaded, left), (vec![1], vec![]), "4 never fits, 1 does");
    check(&residency, &tree, &sizes, cap);
}

#[test]
fn a_broken_node_is_never_asked_for_again_and_gives_its_memory_back() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 2.0)], &[]);
    assert_eq!(residency.next_step().unwrap().node, 1);
    residency.broken(1);
    assert_eq!(residency.state(1), NodeState::Broken);
    check(&residency, &tree, &sizes(7), 1 << 20);
    let (loaded, _) = settle(&mut residency, &[(0, 9.0), (1, 3.0), (4, 2.0), (2, 8.0)]);
    assert_eq!(loaded, [4]);
}

#[test]
fn a_cap_below_the_roots_is_refused_with_what_they_need() {
    let tree = tree(vec![leaf(), leaf(), leaf()]);
    let needed = 3 * HELD + FILE;
    assert!(Residency::new(&tree, sizes(3), options(needed)).is_ok());
    let error = Residency::new(&tree, sizes(3), options(needed - 1)).unwrap_err().to_string();
    assert!(error.contains(&format!("at least {needed} bytes")), "{error}");
    assert!(error.contains(&format!("found {}", needed - 1)), "{error}");
}

#[test]
fn a_shared_picture_is_held_once_and_leaves_with_its_last_user() {
    let tree = two_levels();
    let mut sizes = sizes(7);
    sizes.textures = vec![TextureSize { file_bytes: 10, held_bytes: 70 }];
    sizes.nodes[1].textures = vec![0];
    sizes.nodes[4].textures = vec![0];
    let cap = 3 * HELD + 70 + FILE;
    let mut residency = started(&tree, sizes.clone(), options(cap));
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 2.0)], &[]);
    load_all(&mut residency);
    residency.begin_frame(FRAME_S);
    // The second user finds the picture in memory and reads its own file only.
    assert_eq!(residency.counters().read_bytes, 3 * FILE + 10);
    assert_eq!(residency.used_bytes(), 3 * HELD + 70);
    check(&residency, &tree, &sizes, cap);
    let gone = settle(&mut residency, &[(0, 9.0), (1, 3.0), (4, 0.1), (2, 2.0)]);
    assert_eq!(gone, (vec![2], vec![4]));
    assert!(residency.has_texture(0));
    assert_eq!(residency.used_bytes(), 3 * HELD + 70);
    check(&residency, &tree, &sizes, cap);
}

#[test]
fn uploads_of_a_second_are_bounded_but_one_always_comes() {
    let tree = tree(vec![sketch([0.0; 3], 1.0, (0..5).map(|_| leaf()).collect())]);
    let bounded = ResidencyOptions { upload_bytes_per_s: 100 * HELD, ..options(1 << 20) };
    // Frames of 20 ms have room for two nodes, those of 40 ms for four, and those that stalled
    // for no more than ten.
    for (frame_s, expected) in [
        (0.02, &[&[1, 2][..], &[3, 4], &[5], &[]][..]),
        (0.04, &[&[1, 2, 3, 4], &[5], &[]]),
        (1e3, &[&[1, 2, 3, 4, 5], &[]]),
    ] {
        let mut residency = started(&tree, sizes(6), bounded);
        let all = [(0, 9.0), (1, 5.0), (2, 4.0), (3, 3.0), (4, 2.0), (5, 1.0)];
        residency.set_priorities(&all, &[]);
        load_all(&mut residency);
        let frames = 0..expected.len();
        let arrived: Vec<_> = frames.map(|_| residency.begin_frame(frame_s).arrived).collect();
        assert_eq!(arrived, expected, "{frame_s} s");
    }
    let slow = ResidencyOptions { upload_bytes_per_s: 30 * HELD, ..options(1 << 20) };
    let mut residency = started(&tree, sizes(6), slow);
    residency.set_priorities(&[(0, 9.0), (1, 5.0), (2, 4.0), (3, 3.0), (4, 2.0), (5, 1.0)], &[]);
    load_all(&mut residency);
    assert_eq!(
        residency.begin_frame(1e3).arrived,
        [1, 2, 3],
        "a stall makes up for a tenth of a second"
    );
    let tiny = ResidencyOptions { upload_bytes_per_s: 1, ..options(1 << 20) };
    let mut residency = started(&tree, sizes(6), tiny);
    residency.set_priorities(&[(0, 9.0), (1, 5.0), (2, 4.0)], &[]);
    load_all(&mut residency);
    assert_eq!(residency.begin_frame(FRAME_S).arrived, [1]);
}

#[test]
fn uploads_are_bounded_by_what_there_is_time_for() {
    let tree = tree(vec![sketch([0.0; 3], 1.0, (0..5).map(|_| leaf()).collect())]);
    let options = ResidencyOptions { upload_bytes_per_s: 100 * HELD, ..options(1 << 20) };
    let mut residency = started(&tree, sizes(6), options);
    let all = [(0, 9.0), (1, 5.0), (2, 4.0), (3, 3.0), (4, 2.0), (5, 1.0)];
    residency.set_priorities(&all, &[]);
    load_all(&mut residency);
    // The rate allows four in 40 ms.
    let arrived = [2 * HELD, 0, u64::MAX].map(|bytes| {
        residency.limit_uploads(bytes);
        residency.begin_frame(0.04).arrived
    });
    assert_eq!(arrived, [vec![1, 2], vec![3], vec![4, 5]]);
}

#[test]
fn nodes_in_memory_that_nobody_visits_come_up_in_turn() {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    let all = [(0, 9.0), (1, 8.0), (4, 7.0), (2, 6.0), (3, 5.0), (5, 4.0), (6, 3.0)];
    settle(&mut residency, &all);
    residency.set_priorities(&[(0, 9.0), (1, 8.0), (4, 7.0)], &[]);
    let mut seen = std::collections::BTreeSet::new();
    let mut stale = Vec::new();
    for _ in 0..4 {
        residency.begin_frame(1.0 / 2_000.0);
        residency.stale(&mut stale);
        assert!(stale.len() <= 1);
        seen.extend(stale.iter().copied());
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), [2, 3, 5, 6]);
    // More in a longer frame.
    residency.begin_frame(FRAME_S);
    residency.stale(&mut stale);
    assert_eq!(stale.len(), 4);
}

/// Random priorities, chunks, failures, caps and frames: every promise at every step.
#[test]
fn promises_hold_whatever_happens() {
    let mut numbers = Random::new(7, 0);
    let mut random = move |below: u64| numbers.below(below as usize) as u64;
    for round in 0..60 {
        let mut deep = || {
            let pair = |n: u64| sketch([0.0; 3], 1.0, (0..n).map(|_| leaf()).collect());
            let children = (0..1 + random(3)).map(|_| pair(random(4))).collect();
            sketch([0.0; 3], 1.0, children)
        };
        let tree = tree(vec![deep(), deep()]);
        let mut sizes = Sizes {
            nodes: (0..tree.len())
                .map(|_| NodeSize {
                    file_bytes: 1 + random(900),
                    held_bytes: 1 + random(600),
                    beside_bytes: random(100),
                    textures: (0..random(3)).map(|texture| texture as u32).collect(),
                })
                .collect(),
            textures: vec![
                TextureSize { file_bytes: 300, held_bytes: 200 },
                TextureSize { file_bytes: 100, held_bytes: 400 },
            ],
        };
        sizes.nodes.iter_mut().for_each(|size| size.textures.dedup());
        let mut cap = 3000 + 400 * (round % 7);
        let Ok(_) = Residency::new(&tree, sizes.clone(), options(cap)) else { continue };
        let mut residency = started(&tree, sizes.clone(), options(cap));
        let mut most = cap;
        for _ in 0..300 {
            if random(10) == 0 {
                let other = 1000 + random(5000);
                match residency.set_max_memory(other) {
                    Ok(()) => (cap, most) = (other, most.max(other)),
                    Err(_) => {
                        assert!(Residency::new(&tree, sizes.clone(), options(other)).is_err())
                    }
                }
            }
            match random(4) {
                0 => {
                    let changes = residency.begin_frame(FRAME_S);
                    assert!(residency.used_bytes() <= cap, "{} of {cap}", residency.used_bytes());
                    for &node in changes.left.iter().chain(&changes.dropped) {
                        assert_eq!(residency.state(node), NodeState::Absent);
                    }
                    let visited: Vec<(u32, f64)> = (0..tree.len() as u32)
                        .map(|node| (node, random(4), random(1000) as f64))
                        .filter(|&(_, skipped, _)| skipped > 0)
                        .map(|(node, _, priority)| (node, priority))
                        .collect();
                    residency.set_priorities(&visited, &[]);
                }
                _ => {
                    let before = residency.used_bytes();
                    if let Some(step) = residency.next_step() {
                        let used = residency.used_bytes();
                        assert!(used <= cap.max(before), "{used} of {cap}, {before} before");
                        check(&residency, &tree, &sizes, most);
                        if residency.chunk_read(step.node, step.bytes) {
                            match random(12) {
                                0 => residency.broken(step.node),
                                _ => residency.loaded(step.node),
                            }
                        }
                    }
                }
            }
            check(&residency, &tree, &sizes, most);
            for &root in tree.roots() {
                assert_eq!(residency.state(root), NodeState::Resident);
            }
        }
    }
}

/// A load that is given up may be the last to need a shared picture that drawing holds still.
#[test]
fn pictures_that_only_a_load_kept_are_let_go_of_when_it_is_given_up() {
    const PICTURE: u64 = 4000;
    let tree = tree(vec![sketch([0.0; 3], 1.0, vec![leaf(), leaf(), leaf()])]);
    let mut sizes = sizes(4);
    sizes.textures = vec![TextureSize { file_bytes: 100, held_bytes: PICTURE }];
    sizes.nodes[1].textures = vec![0];
    sizes.nodes[2].textures = vec![0];
    let cap = 2 * HELD + PICTURE + (HELD + FILE) + 1000;
    let mut residency = started(&tree, sizes.clone(), options(cap));
    residency.set_priorities(&[(0, 9.0), (1, 1.0)], &[]);
    assert_eq!(load_all(&mut residency), [1]);
    residency.begin_frame(FRAME_S);
    // Another child begins to load and relies on the picture.
    residency.set_priorities(&[(0, 9.0), (2, 7.9)], &[(1, 0.1)]);
    assert_eq!(residency.next_step().map(|step| step.node), Some(2));
    assert_eq!(residency.files_of_load(2), FILE);
    // The child that brought it is evicted for a third.
    residency.set_priorities(&[(0, 9.0), (2, 7.9), (3, 8.0)], &[(1, 0.1)]);
    assert_eq!(residency.next_step().map(|step| step.node), Some(2));
    assert_eq!(residency.state(1), NodeState::Leaving);
    let changes = residency.begin_frame(FRAME_S);
    assert_eq!((changes.left, changes.left_textures), (vec![1], vec![]));
    let before = residency.used_bytes();
    residency.broken(2);
    assert_eq!(residency.used_bytes(), before - HELD - FILE, "drawing holds the picture still");
    assert!(residency.has_texture(0));
    assert_eq!(residency.begin_frame(FRAME_S).left_textures, [0]);
    assert!(!residency.has_texture(0));
    check(&residency, &tree, &sizes, cap);
}

/// Selection as far as residency knows it: children are drawn where all of them are there.
fn select(
    residency: &Residency,
    tree: &SceneTree,
    priority: &[f64],
) -> (Vec<(u32, f64)>, Vec<u32>) {
    let (mut visited, mut front) = (Vec::new(), Vec::new());
    let mut queue = tree.roots().to_vec();
    queue.iter().for_each(|&root| visited.push((root, priority[root as usize])));
    while let Some(node) = queue.pop() {
        let children = tree.children(node);
        visited.extend(children.iter().map(|&child| (child, priority[child as usize])));
        let there = |&child: &u32| residency.state(child) == NodeState::Resident;
        match !children.is_empty() && children.iter().all(there) {
            true => queue.extend(children),
            false => front.push(node),
        }
    }
    (visited, front)
}

/// Frames of a camera that stands still; what was loaded and evicted in each.
fn stand(tree: &SceneTree, residency: &mut Residency, priority: &[f64], frames: usize) -> Vec<u64> {
    (0..frames)
        .map(|_| {
            let before = residency.counters();
            residency.begin_frame(FRAME_S);
            let (visited, front) = select(residency, tree, priority);
            residency.set_priorities(&visited, &[]);
            residency.set_needed(front);
            load_all(residency);
            let now = residency.counters();
            now.loads + now.evictions - before.loads - before.evictions
        })
        .collect()
}

/// A node far down matters more than a sibling of its parent, without which neither is drawn.
#[test]
fn a_node_does_not_push_out_what_selection_comes_to_it_by() {
    let tree = two_levels();
    for spare in 0..6 {
        let cap = (2 + spare) * HELD + FILE;
        let mut residency = started(&tree, sizes(7), options(cap));
        let priority = [9.0, 3.0, 8.0, 7.0, 1.0, 0.5, 0.4];
        let done = stand(&tree, &mut residency, &priority, 60);
        assert_eq!(done[20..].iter().sum::<u64>(), 0, "spare {spare}: {done:?}");
        check(&residency, &tree, &sizes(7), cap);
    }
}

#[test]
fn a_frame_evicts_for_several_nodes() {
    let tree = tree(vec![sketch([0.0; 3], 1.0, (0..8).map(|_| leaf()).collect())]);
    // Room for the root and four children, and to read four more at once.
    let cap = 5 * HELD + 4 * FILE;
    let mut residency = started(&tree, sizes(9), options(cap));
    let half = |first: u32| {
        let other = first ^ 4;
        (first..first + 4).map(|n| (n + 1, 5.0)).chain((other..other + 4).map(|n| (n + 1, 0.1)))
    };
    let first: Vec<_> = [(0, 9.0)].into_iter().chain(half(0)).collect();
    settle(&mut residency, &first);
    let then: Vec<_> = [(0, 9.0)].into_iter().chain(half(4)).collect();
    let mut frames = 0;
    let settled = |residency: &Residency| (5..9).all(|n| residency.state(n) == NodeState::Resident);
    // What was worth more lately stays for a while.
    while !settled(&residency) {
        residency.begin_frame(FRAME_S);
        residency.set_priorities(&then, &[]);
        load_all(&mut residency);
        check(&residency, &tree, &sizes(9), cap);
        let swapped = residency.counters().evictions > 0;
        frames += usize::from(swapped);
        assert!(frames < 5, "{frames} frames for four nodes");
    }
}

/// Of two halves of the nodes one is in view at a time, and there is room for one of them.
#[test]
fn looking_to_and_fro_loads_nothing_again() {
    let tree = tree(vec![sketch([0.0; 3], 1.0, (0..8).map(|_| leaf()).collect())]);
    let cap = 5 * HELD + FILE;
    let mut residency = started(&tree, sizes(9), options(cap));
    let mut late = 0;
    for frame in 0..600 {
        let seen = |node: u32| ((node - 1) / 4 == frame / 15 % 2) as u8 as f64;
        let all = (1..9).map(|node| (node, 1.0 + 1.275 * seen(node) + 0.01 * f64::from(node)));
        residency.begin_frame(FRAME_S);
        residency.set_priorities(&[(0, 9.0)].into_iter().chain(all).collect::<Vec<_>>(), &[]);
        let loaded = load_all(&mut residency);
        late += if frame > 60 { loaded.len() } else { 0 };
        check(&residency, &tree, &sizes(9), cap);
    }
    assert_eq!(late, 0);
}
