//! Caps that change while nodes are in memory.

use super::tests::{
    FILE, FRAME_S, HELD, check, leaf, load_all, options, settle, sizes, started, two_levels,
};
use super::*;
use crate::runtime::SceneTree;
use crate::runtime::test_tree::{sketch, tree};

/// A root with two children that have two each, all of them in memory.
fn full() -> (SceneTree, Residency, [(u32, f64); 7]) {
    let tree = two_levels();
    let mut residency = started(&tree, sizes(7), options(1 << 20));
    let all = [(0, 9.0), (1, 3.0), (4, 2.0), (2, 8.0), (3, 1.0), (5, 6.0), (6, 7.0)];
    settle(&mut residency, &all);
    assert_eq!((residency.resident(), residency.used_bytes()), (7, 7 * HELD));
    (tree, residency, all)
}

#[test]
fn a_lower_cap_holds_from_the_next_frame_on_and_the_least_useful_leave_from_the_finest_upward() {
    let (tree, mut residency, all) = full();
    let least = HELD + FILE;
    residency.set_max_memory(5 * HELD).unwrap();
    assert_eq!(residency.used_bytes(), 7 * HELD, "drawing holds all still");
    assert_eq!(residency.next_step(), None);
    assert_eq!(residency.begin_frame(FRAME_S).left, [3, 5], "not 4, which has children");
    check(&residency, &tree, &sizes(7), 1 << 20);
    residency.set_priorities(&all, &[]);
    assert_eq!(residency.next_step(), None, "there is no room for their files");
    // 4 is worth less than 2, but 6 has to leave before it.
    residency.set_max_memory(least).unwrap();
    assert_eq!(residency.begin_frame(FRAME_S).left, [6, 4]);
    assert_eq!(residency.used_bytes(), 3 * HELD);
    assert_eq!(residency.memory_use().cap_bytes, least);
    assert_eq!(residency.peak_bytes(), 7 * HELD + FILE, "what there was, under a higher cap");
    check(&residency, &tree, &sizes(7), 1 << 20);
}

#[test]
fn what_the_last_frame_did_not_visit_leaves_first() {
    let (_, mut residency, _) = full();
    residency.set_priorities(&[(0, 9.0), (1, 3.0), (4, 2.0), (3, 1.0), (5, 6.0), (6, 7.0)], &[]);
    residency.set_max_memory(6 * HELD).unwrap();
    assert_eq!(residency.begin_frame(FRAME_S).left, [2], "though it was worth 8 before");
}

#[test]
fn what_may_be_wanted_soon_leaves_before_what_is_in_view() {
    let (_, mut residency, all) = full();
    let (soon, visited): (Vec<_>, Vec<_>) = all.into_iter().partition(|&(node, _)| node == 2);
    residency.set_priorities(&visited, &[]);
    residency.set_ahead(&soon);
    residency.set_max_memory(6 * HELD).unwrap();
    assert_eq!(residency.begin_frame(FRAME_S).left, [2], "though it may be worth 8");
}

#[test]
fn a_cap_that_is_raised_again_is_filled_again() {
    let (tree, mut residency, all) = full();
    residency.set_max_memory(HELD + FILE).unwrap();
    // Raised before drawing has let go of anything.
    residency.set_max_memory(1 << 20).unwrap();
    check(&residency, &tree, &sizes(7), 1 << 20);
    let (loaded, left) = settle(&mut residency, &all);
    assert_eq!((loaded.len(), left.len(), residency.resident()), (4, 4, 7));
}

#[test]
fn a_cap_is_not_lowered_below_what_the_roots_need() {
    let (tree, mut residency, _) = full();
    let before = residency.memory_use();
    let error = residency.set_max_memory(HELD + FILE - 1).unwrap_err();
    assert!(matches!(error, crate::Error::Usage(_)), "{error}");
    assert!(error.to_string().contains(&format!("at least {} bytes", HELD + FILE)), "{error}");
    assert_eq!(residency.memory_use(), before);
    assert_eq!(residency.begin_frame(FRAME_S), Changes::default());
    check(&residency, &tree, &sizes(7), 1 << 20);
}

#[test]
fn loads_under_way_are_given_up_before_arrivals_and_these_before_what_is_in_memory() {
    let tree = tree(vec![sketch([0.0; 3], 1.0, (0..4).map(|_| leaf()).collect())]);
    let mut residency = started(&tree, sizes(5), options(1 << 20));
    let wanted = [(0, 9.0), (1, 5.0), (2, 4.0), (3, 3.0), (4, 6.0)];
    residency.set_priorities(&wanted[..2], &[]);
    assert_eq!(load_all(&mut residency), [1]);
    residency.begin_frame(FRAME_S);
    residency.set_priorities(&wanted[..4], &[]);
    assert_eq!(load_all(&mut residency), [2, 3]);
    residency.set_priorities(&wanted, &[]);
    let step = residency.next_step().unwrap();
    assert_eq!((step.node, residency.used_bytes()), (4, 5 * HELD + FILE));
    residency.set_max_memory(4 * HELD).unwrap();
    assert_eq!((residency.state(4), residency.used_bytes()), (NodeState::Absent, 4 * HELD));
    assert!(!residency.chunk_read(4, step.bytes), "whoever loads is told");
    residency.loaded(4);
    assert_eq!(residency.state(4), NodeState::Absent);
    residency.set_max_memory(3 * HELD).unwrap();
    assert_eq!((residency.state(2), residency.state(3)), (NodeState::Loaded, NodeState::Leaving));
    let changes = residency.begin_frame(FRAME_S);
    assert_eq!((changes.arrived, changes.left, changes.dropped), (vec![2], vec![], vec![3]));
    assert_eq!((residency.used_bytes(), residency.counters().abandoned), (3 * HELD, 2));
    check(&residency, &tree, &sizes(5), 1 << 20);
}

/// A picture comes with an arrival that drawing never takes over.
#[test]
fn pictures_of_dropped_arrivals_are_read_again_and_drawing_never_held_them() {
    const PICTURE: u64 = 4000;
    let tree = tree(vec![sketch([0.0; 3], 1.0, vec![leaf(), leaf()])]);
    let mut sizes = sizes(3);
    sizes.textures = vec![TextureSize { file_bytes: 100, held_bytes: PICTURE }];
    sizes.nodes[1].textures = vec![0];
    sizes.nodes[2].textures = vec![0];
    let mut residency = started(&tree, sizes.clone(), options(1 << 20));
    residency.set_priorities(&[(0, 9.0), (1, 5.0), (2, 4.0)], &[]);
    assert_eq!(load_all(&mut residency), [1, 2]);
    assert_eq!(residency.counters().read_bytes, 3 * FILE + 100, "the second relies on the first");
    residency.set_max_memory(2 * HELD + PICTURE).unwrap();
    assert_eq!((residency.state(1), residency.state(2)), (NodeState::Loaded, NodeState::Leaving));
    assert!(residency.has_texture(0));
    residency.set_max_memory(HELD + FILE).unwrap();
    assert!(!residency.has_texture(0));
    // Before the next frame there is room again: whoever loads now gets no picture from others.
    residency.set_max_memory(1 << 20).unwrap();
    assert_eq!(residency.next_step(), None, "both are still leaving");
    let changes = residency.begin_frame(FRAME_S);
    assert_eq!((changes.dropped, changes.left_textures), (vec![2, 1], vec![]));
    check(&residency, &tree, &sizes, 1 << 20);
    residency.set_priorities(&[(0, 9.0), (1, 5.0), (2, 4.0)], &[]);
    assert_eq!(load_all(&mut residency), [1, 2]);
    assert_eq!(residency.files_of_load(1), FILE + 100, "it is read again");
    residency.begin_frame(FRAME_S);
    check(&residency, &tree, &sizes, 1 << 20);
}
