//! What every policy promises, tried on all of them.

use glam::DVec3;

use super::{POLICIES, PolicyKind, Settings};
use crate::camera::{View, from_angles};
use crate::engine::test_frame::{TestFrame, quick};
use crate::engine::{FrameOutcome, FrontCheck, Policy, Prices, Selection};
use crate::mesh::UpAxis;
use crate::random::Random;
use crate::runtime::SceneTree;
use crate::runtime::test_tree::{Sketch, sketch, tree};

fn make(kind: PolicyKind) -> Box<dyn Policy> {
    kind.make(&Settings::new()).unwrap()
}

/// A node with up to four children in its eighths, down to a depth.
fn random_node(random: &mut Random, at: [f64; 3], size: f64, depth: u32) -> Sketch {
    let children = if depth == 0 || random.unit() < 0.2 { 0 } else { 1 + random.below(4) };
    let children: Vec<Sketch> = (0..children)
        .map(|_| {
            let at = at.map(|at| at + (random.unit() - 0.5) * size / 2.0);
            random_node(random, at, size / 2.0, depth - 1)
        })
        .collect();
    // Errors are never less than those below.
    let below = children.iter().map(|child| child.error).fold(0.0, f64::max);
    Sketch {
        size,
        triangles: 1 + random.below(3000) as u32,
        error: below + random.unit() * size / 10.0,
        benefit: size * (0.5 + random.unit()),
        ..sketch(at, 1.0 + random.unit(), children)
    }
}

fn random_tree(random: &mut Random) -> SceneTree {
    let roots = 1 + random.below(8);
    tree(
        (0..roots)
            .map(|_| {
                let at = [0; 3].map(|_| random.between(-100.0, 100.0));
                random_node(random, at, 40.0, 4)
            })
            .collect(),
    )
}

fn random_view(random: &mut Random) -> View {
    let mut view = crate::runtime::test_tree::view();
    view.pose.position = DVec3::from([0; 3].map(|_| random.between(-120.0, 120.0)));
    let [yaw, pitch] = [random.between(-180.0, 180.0), random.between(-80.0, 80.0)];
    view.pose.rotation = from_angles(UpAxis::Z, yaw, pitch, 0.0);
    let velocity = DVec3::from([0; 3].map(|_| random.between(-10.0, 10.0)));
    View::new(view.pose, velocity, [320, 200])
}

fn prices() -> Prices {
    Prices {
        frame: 0.5,
        draw: 0.02,
        vertex: 1e-4,
        triangle: 2e-4,
        plain_fragment: 1e-5,
        textured_fragment: 2e-5,
        hidden_fragment: 5e-6,
        uploaded_byte: 1e-7,
    }
}

/// A node is resident only where its parent is, as residency keeps it.
fn shuffle_residents(random: &mut Random, frame: &mut TestFrame) {
    for place in frame.tree.at(0..frame.tree.len() as u32).0.to_vec() {
        let parent = frame.tree.node(place).parent;
        let may = parent.is_none_or(|parent| frame.residents.contains(parent));
        let is_root = parent.is_none();
        frame.residents.set(place, may && (is_root || random.unit() < 0.8));
    }
}

#[test]
fn every_front_covers_what_is_in_view_with_what_is_in_memory() {
    for kind in POLICIES {
        let mut random = Random::new(16, 0);
        for _ in 0..20 {
            let mut frame = TestFrame::new(random_tree(&mut random));
            frame.costs = crate::engine::CostModel::new(&prices());
            let (mut policy, mut check) = (make(kind), FrontCheck::default());
            let mut out = Selection::default();
            for step in 0..60 {
                if step % 7 == 0 {
                    shuffle_residents(&mut random, &mut frame);
                }
                if step % 3 == 0 {
                    frame.view = random_view(&mut random);
                }
                frame.target_ms = random.between(0.1, 20.0);
                frame.dt_s = random.between(0.0, 0.2);
                policy.select(&frame.input(), &mut out);
                check
                    .check(&frame.tree, &out.front, &frame.view, &frame.residents)
                    .unwrap_or_else(|fault| panic!("{}, step {step}: {fault}", kind.name));
                sound(kind.name, &frame, &out, policy.diagnostics().len());
                let ms = random.between(0.0, 40.0);
                policy.drawn(&FrameOutcome { actual_ms: ms, frame_ms: ms });
            }
        }
    }
}

/// Requests are of nodes that there are, each once, and their utilities are numbers.
fn sound(name: &str, frame: &TestFrame, out: &Selection, diagnostics: usize) {
    let mut nodes: Vec<u32> = out.requests.iter().map(|&(node, _)| node).collect();
    nodes.sort_unstable();
    assert!(nodes.windows(2).all(|pair| pair[0] != pair[1]), "{name}: asked for twice");
    assert!(nodes.iter().all(|&node| (node as usize) < frame.tree.len()));
    assert!(frame.tree.roots().iter().all(|root| nodes.binary_search(root).is_ok()), "{name}");
    let is_sound = |utility: f64| utility.is_finite() && utility >= 0.0;
    assert!(out.requests.iter().all(|&(_, utility)| is_sound(utility)), "{name}: {out:?}");
    assert_eq!(out.diagnostics.len(), diagnostics, "{name}");
    assert!(out.diagnostics.iter().all(|value| value.is_finite()), "{name}");
}

#[test]
fn all_of_what_is_in_memory_is_worth_a_number() {
    for kind in POLICIES {
        let mut random = Random::new(5, 0);
        let mut frame = TestFrame::new(random_tree(&mut random));
        frame.costs = crate::engine::CostModel::new(&prices());
        let mut policy = make(kind);
        frame.select(&mut *policy);
        for node in 0..frame.tree.len() as u32 {
            let utility = policy.utility(&frame.input(), node);
            assert!(utility.is_finite() && utility >= 0.0, "{} {node}: {utility}", kind.name);
        }
    }
}

/// The engine learns nothing new of a still camera, and the policy neither.
#[test]
fn a_still_camera_converges_and_then_toggles_nothing() {
    for kind in POLICIES {
        let mut random = Random::new(23, 0);
        for _ in 0..5 {
            let mut frame = TestFrame::new(random_tree(&mut random));
            frame.costs = crate::engine::CostModel::new(&prices());
            frame.view = random_view(&mut random);
            let mut policy = kind.make(&quick(kind)).unwrap();
            let mut fronts = Vec::new();
            let mut loads = crate::engine::FrontLoad::default();
            for _ in 0..6000 {
                let selection = frame.select(&mut *policy);
                let load = loads.of(&frame.tree, &selection.front, &frame.view, &frame.covered, 0);
                let ms = frame.costs.estimate(&load).mean_ms;
                policy.drawn(&FrameOutcome { actual_ms: ms, frame_ms: ms });
                fronts.push(selection.front);
            }
            let last = &fronts[fronts.len() - 1000..];
            assert!(last.windows(2).all(|pair| pair[0] == pair[1]), "{}", kind.name);
        }
    }
}

#[test]
fn policies_are_found_by_their_names_and_constants_by_theirs() {
    for kind in POLICIES {
        assert_eq!(PolicyKind::find(kind.name).unwrap().name, kind.name);
        assert_eq!(make(kind).name(), kind.name);
        assert!(!kind.summary.is_empty() && !kind.source.is_empty());
        for parameter in kind.parameters() {
            let [least, most] = parameter.range;
            assert!((least..=most).contains(&parameter.default), "{parameter:?}");
            for (value, fits) in [(least, true), (most, true), (most * 2.0 + 1.0, false)] {
                let settings = Settings::from([(parameter.name.to_owned(), value)]);
                assert_eq!(kind.make(&settings).is_ok(), fits, "{parameter:?} {value}");
            }
        }
        let unknown = kind.make(&Settings::from([("colour".to_owned(), 1.0)]));
        assert!(unknown.is_err_and(|error| error.to_string().contains("colour")));
    }
    let unknown = PolicyKind::find("latest").unwrap_err().to_string();
    assert!(POLICIES.iter().all(|kind| unknown.contains(kind.name)), "{unknown}");
}
