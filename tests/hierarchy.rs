//! Properties of the tree over one block, on small random meshes.

mod common;

use std::collections::{BTreeMap, BTreeSet};

use common::rays::Soup;
use common::*;
use hlod::builder::border::skirt::{append, triangles_of};
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions, TreeShape};
use hlod::builder::simplify::ladder::{BUDGET_TOLERANCE, Simplifier};
use hlod::lattice::Lattice;
use hlod::mesh::{Mesh, key};

fn every_option() -> Vec<HierarchyOptions> {
    let mut all = Vec::new();
    for (tree, level_factor) in [
        (TreeShape::Balanced, 2),
        (TreeShape::Balanced, 3),
        (TreeShape::Balanced, 4),
        (TreeShape::Balanced, 8),
        (TreeShape::Thesis, 3),
        (TreeShape::Thesis, 4),
    ] {
        for borders in [BorderMode::Locked, BorderMode::Skirts] {
            for simplifier in [Simplifier::Qem, Simplifier::Clustering] {
                all.push(HierarchyOptions {
                    tree,
                    desired_tris: 150,
                    level_factor,
                    borders,
                    simplifier,
                    constants: all_nodes(),
                    ..Default::default()
                });
            }
        }
    }
    all
}

#[test]
fn leaves_are_the_source() {
    for (mesh, name) in [(ball(12, 5.0, 0.1, 1), "ball"), (wall(60, 24, 2), "wall")] {
        let (piece, lattice) = block(mesh);
        let area = piece.mesh.area();
        let source: BTreeSet<_> = piece.mesh.positions.iter().map(|&p| key(p)).collect();
        for options in every_option() {
            let nodes = build(piece.clone(), lattice, &options);
            let leaves: Vec<_> = nodes.iter().filter(|node| node.is_leaf()).collect();
            let childless = |node: &&WrittenNode| {
                let is_child = |other: &WrittenNode| {
                    other.level == node.level + 1 && other.child_path.starts_with(&node.child_path)
                };
                !nodes.iter().any(is_child)
            };
            assert_eq!(nodes.iter().filter(childless).count(), leaves.len());
            assert!(leaves.iter().all(|leaf| leaf.skirts.is_empty() && leaf.error == 0.0));
            let leaf_area: f64 = leaves.iter().map(|leaf| leaf.mesh.area()).sum();
            assert!((leaf_area / area - 1.0).abs() < 1e-6, "{name}: {leaf_area} of {area}");
            let found: BTreeSet<_> =
                leaves.iter().flat_map(|leaf| &leaf.mesh.positions).map(|&p| key(p)).collect();
            assert!(source.is_subset(&found), "{name}: a source vertex is lost");
        }
    }
}

/// Edges of a front that only one node has, and that are neither edges of the original border
/// nor under skirts: through these one could see.
fn unsealed(
    front: &[&WrittenNode],
    leaf_edges: &BTreeSet<[hlod::mesh::PositionKey<f32>; 2]>,
    lattice: Lattice,
) -> usize {
    let skirts = Soup::new(front.iter().map(|node| {
        let mut mesh = node.mesh.clone();
        append(&mut mesh, &node.skirts);
        mesh.triangles.drain(..node.mesh.triangles.len());
        mesh
    }));
    let covered = |[a, b]: [glam::DVec3; 2]| {
        (0..=4).all(|at| skirts.is_near(a.lerp(b, f64::from(at) / 4.0), 2.0 * lattice.step))
    };
    let uses = edge_uses(front.iter().map(|node| &node.mesh));
    let mut places = BTreeMap::new();
    for &position in front.iter().flat_map(|node| &node.mesh.positions) {
        places.insert(key(position), glam::Vec3::from(position).as_dvec3());
    }
    let open = uses.iter().filter(|&(edge, uses)| uses % 2 == 1 && !leaf_edges.contains(edge));
    open.filter(|(edge, _)| !covered(edge.map(|end| places[&end]))).count()
}

#[test]
fn a_closed_mesh_with_locked_borders_stays_closed_at_every_level() {
    let (piece, lattice) = block(ball(16, 5.0, 0.05, 3));
    assert_eq!(odd_edges([&piece.mesh]), 0);
    for options in every_option() {
        let nodes = build(piece.clone(), lattice, &options);
        let deepest = nodes.iter().map(|node| node.level).max().unwrap();
        for level in 0..=deepest {
            let front = at_level(&nodes, level).into_iter().map(|node| &node.mesh);
            let locked =
                options.borders == BorderMode::Locked && options.simplifier == Simplifier::Qem;
            if level == deepest || locked {
                assert_eq!(odd_edges(front), 0, "level {level} of {options:?}");
            }
        }
    }
}

#[test]
fn any_front_of_a_closed_mesh_is_sealed() {
    let (piece, lattice) = block(ball(16, 5.0, 0.05, 3));
    let mut random = Random::new(9, 0);
    for options in every_option() {
        if options.borders != BorderMode::Skirts || options.simplifier == Simplifier::Clustering {
            continue;
        }
        let nodes = build(piece.clone(), lattice, &options);
        let leaves = nodes.iter().filter(|node| node.is_leaf());
        let leaf_edges: BTreeSet<_> =
            edge_uses(leaves.map(|node| &node.mesh)).into_keys().collect();
        for _ in 0..20 {
            let mut front = Vec::new();
            let mut open = vec![Vec::new()];
            while let Some(path) = open.pop() {
                let node = nodes.iter().find(|node| node.child_path == path).unwrap();
                let children: Vec<_> = nodes
                    .iter()
                    .filter(|child| {
                        child.level == path.len() + 1 && child.child_path.starts_with(&path)
                    })
                    .map(|child| child.child_path.clone())
                    .collect();
                if children.is_empty() || (node.level > 0 && random.unit() < 0.4) {
                    front.push(node);
                } else {
                    open.extend(children);
                }
            }
            assert_eq!(
                unsealed(&front, &leaf_edges, lattice),
                0,
                "{} nodes of {options:?}",
                front.len()
            );
        }
    }
}

#[test]
fn nodes_keep_their_budget() {
    for mesh in [ball(24, 5.0, 0.05, 3), wall(120, 40, 4)] {
        let (piece, lattice) = block(mesh);
        for options in every_option() {
            for node in build(piece.clone(), lattice, &options) {
                let skirts = triangles_of(&node.skirts);
                let triangles = node.mesh.triangles.len() + skirts;
                let within = |triangles: usize, budget: usize| {
                    triangles <= (budget as f64 * BUDGET_TOLERANCE).ceil() as usize
                };
                // What may stand in the way: a long border's skirts, of which the mesh leaves
                // half of the budget free, and vertices that both sides of a cut keep.
                let long_border = within(node.mesh.triangles.len(), node.budget / 2);
                let locked = 2 * node.locked > node.budget && triangles <= 2 * node.locked;
                assert!(
                    within(triangles, node.budget) || long_border || locked,
                    "{triangles} of {} with {skirts} of skirts and {} locked at level {} {:?} \
                     {options:?}",
                    node.budget,
                    node.locked,
                    node.level,
                    node.step
                );
                assert!(!node.mesh.triangles.is_empty());
            }
        }
    }
}

#[test]
fn errors_grow_towards_the_root() {
    let (piece, lattice) = block(wall(120, 40, 5));
    for options in every_option() {
        let nodes = build(piece.clone(), lattice, &options);
        for node in nodes.iter().filter(|node| node.level > 0) {
            let parent = nodes
                .iter()
                .find(|parent| parent.child_path[..] == node.child_path[..node.level - 1])
                .unwrap();
            assert!(parent.error >= node.error);
        }
    }
}

/// A sheet of 64 by 64 quads of 1 m whose inner columns are moved by `by`.
fn columns_moved(by: f64) -> Mesh<f64> {
    let mut mesh = Mesh::<f64>::default();
    for row in 0..=64 {
        for column in 0..=64 {
            let x = f64::from(column) + if (1..64).contains(&column) { by } else { 0.0 };
            let [a, b] = [f64::from(column), f64::from(row)].map(|at| (at * 0.37).sin());
            mesh.positions.push([x, f64::from(row), a * b]);
            mesh.materials.push(0);
        }
    }
    for row in 0..64 {
        for column in 0..64 {
            let at = row * 65 + column;
            mesh.triangles.extend([[at, at + 1, at + 66], [at, at + 66, at + 65]]);
        }
    }
    mesh
}

#[test]
fn rows_of_vertices_a_step_beside_a_plane_thin_as_those_on_it() {
    let options = HierarchyOptions { desired_tris: 150, ..Default::default() };
    let locked = |by: f64| -> usize {
        let (piece, lattice) = block(columns_moved(by * 2f64.powi(-17)));
        assert_eq!(lattice.step, 2f64.powi(-17));
        build(piece, lattice, &options).iter().map(|node| node.locked).sum()
    };
    let on = locked(0.0);
    for by in [1.0, -1.0, 3.0, -3.0] {
        let beside = locked(by);
        assert!(beside * 20 <= on * 21, "{beside} locked {by} steps beside, {on} on the planes");
    }
}

/// A wall whose first third has sixteen times the triangles of the rest for its area.
fn dense_on_one_side() -> Mesh<f64> {
    let mut mesh = wall(160, 40, 6);
    mesh.positions.iter_mut().filter(|p| p[0] > 4.0).for_each(|p| p[0] = 4.0 + (p[0] - 4.0) * 16.0);
    mesh
}

#[test]
fn chunks_that_fit_are_leaves_whatever_their_siblings_do_and_none_is_tiny() {
    for mesh in [dense_on_one_side(), ball(30, 5.0, 0.05, 3), wall(120, 40, 4)] {
        let (piece, lattice) = block(mesh);
        for level_factor in [2, 3, 4, 8] {
            let options =
                HierarchyOptions { desired_tris: 150, level_factor, ..Default::default() };
            let nodes = build(piece.clone(), lattice, &options);
            let root = f64::from(level_factor).sqrt();
            for node in &nodes {
                let triangles = node.mesh.triangles.len() as f64;
                if node.is_leaf() {
                    assert!(triangles <= 2.0 * root * 150.0, "{triangles} in a leaf");
                    assert!(triangles >= 150.0 / root / 4.0, "{triangles} in a leaf");
                } else {
                    let within = |share: f64| node.budget as f64 <= share * 150.0;
                    assert!(within(2.0 * root) && !within(0.5 / root), "{}", node.budget);
                }
            }
        }
    }
}

#[test]
fn more_cuts_than_planes_can_be_told_apart_end_in_leaves() {
    // One triangle for a node, and 2^k of them halved k times.
    let (piece, lattice) = block(wall(24, 20, 7));
    for (tree, level_factor) in [(TreeShape::Balanced, 2), (TreeShape::Thesis, 64)] {
        let options =
            HierarchyOptions { tree, desired_tris: 1, level_factor, ..Default::default() };
        let nodes = build(piece.clone(), lattice, &options);
        let area: f64 =
            nodes.iter().filter(|node| node.is_leaf()).map(|node| node.mesh.area()).sum();
        assert!((area / piece.mesh.area() - 1.0).abs() < 1e-6);
    }
}
