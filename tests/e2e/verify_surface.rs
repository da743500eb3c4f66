//! `hlod-build verify`: sound scenes pass whatever their borders are, and faults of the leaves'
//! surface and at cuts fail the checks that look for them.

use std::collections::BTreeMap;
use std::fs;

use hlod::format::{NodeMesh, Primitive, read_glb};
use hlod::mesh::{PositionKey, key};
use hlod::verify::text;

use crate::verify::{Broken, SOUND, failed, repaint, report, textured_leaf};

#[test]
fn a_sound_scene_passes_with_its_source_and_without() {
    let out = SOUND.folder.path().join("skirts");
    let with = report(&out, true);
    assert!(with.passed, "{}", text(&with));
    let leaves = with.leaves.as_ref().unwrap();
    assert!(leaves.area_difference < 1e-6 && leaves.missing_vertices == 0);
    assert!(leaves.tiles.unwrap().clear > 100, "the city's tiles were told");
    let coarse: Vec<f64> = with.levels.iter().map(|level| level.two_sided.rms).collect();
    assert!(coarse.len() >= 2 && coarse.is_sorted_by(|a, b| a > b), "{coarse:?}");
    assert!(with.levels.iter().all(|level| level.color_rms.unwrap() > 0.0));
    assert!(with.gaps.iter().any(|gap| gap.bare > 0.01), "there were gaps to be closed");
    assert!(with.gaps.iter().all(|gap| gap.open < 1e-4), "and skirts close them");

    let without = report(&out, false);
    assert!(without.passed && without.leaves.is_none() && without.source.is_empty());
    for (a, b) in with.levels.iter().zip(&without.levels) {
        let off = (a.two_sided.rms - b.two_sided.rms).abs();
        assert!(off < 1e-4 * a.two_sided.rms + 1e-5, "leaves stand for the source: {off}");
    }
}

#[test]
fn locked_borders_are_sound_too() {
    let report = report(&SOUND.folder.path().join("locked"), true);
    assert!(report.passed, "{}", text(&report));
    // Locked vertices leave no more than rounding.
    assert!(report.gaps.iter().all(|gap| gap.open <= 1e-3));
}

#[test]
fn gaps_that_no_skirt_covers() {
    let mut broken = Broken::new("skirts");
    for node in 0..broken.scene.nodes.len() {
        broken.rewrite(node, |mesh| mesh.primitives.iter_mut().for_each(remove_skirts));
    }
    let report = broken.report(true);
    assert_eq!(failed(&report), ["gaps"]);
    assert!(report.gaps.iter().any(|gap| gap.a != gap.b && gap.open > 0.01), "{}", text(&report));
}

fn remove_skirts(primitive: &mut Primitive) {
    let corners = primitive.indices.len() - 3 * std::mem::take(&mut primitive.skirt_triangles);
    primitive.indices.truncate(corners);
    primitive.normals.truncate(corners);
}

/// The vertices of a primitive that lie well inside its box.
fn inner_vertex(primitive: &Primitive) -> Option<usize> {
    let at = |axis: usize| primitive.positions.iter().map(move |position| position[axis]);
    let sides = [0, 1, 2].map(|axis| {
        (at(axis).fold(f32::INFINITY, f32::min), at(axis).fold(f32::NEG_INFINITY, f32::max))
    });
    primitive.positions.iter().position(|position| {
        sides.iter().zip(position).all(|(&(low, high), &here)| {
            let margin = (high - low) * 0.2;
            here >= low + margin && here <= high - margin
        })
    })
}

#[test]
fn a_moved_vertex() {
    let mut broken = Broken::new("skirts");
    let leaf = textured_leaf(&broken);
    broken.rewrite(leaf, |mesh| {
        let place = mesh
            .primitives
            .iter()
            .find_map(|primitive| Some(primitive.positions[inner_vertex(primitive)?]));
        let place = place.unwrap();
        for primitive in &mut mesh.primitives {
            for position in primitive.positions.iter_mut().filter(|p| **p == place) {
                position[1] += 0.02;
            }
        }
    });
    let report = broken.report(true);
    assert_eq!(failed(&report)[0], "faithful leaves", "{}", text(&report));
    let leaves = report.leaves.unwrap();
    assert_eq!(leaves.missing_vertices, 1);
    assert!(leaves.farthest > 1e-3 && leaves.farthest < 0.021, "{}", leaves.farthest);
}

/// Twice the area of each triangle of a primitive.
fn areas(primitive: &Primitive) -> impl Iterator<Item = f32> {
    primitive.indices.as_chunks::<3>().0.iter().map(|corners| {
        let [a, b, c] =
            corners.map(|vertex| glam::Vec3::from(primitive.positions[vertex as usize]));
        (b - a).cross(c - a).length()
    })
}

/// Takes away the triangle of a leaf that is chosen by the areas of all.
fn lose_triangle(mesh: &mut NodeMesh, choose: impl Fn(&Primitive, &[f32]) -> usize) {
    let primitive = &mut mesh.primitives[0];
    let lost = choose(primitive, &areas(primitive).collect::<Vec<_>>());
    primitive.indices.drain(3 * lost..3 * lost + 3);
}

#[test]
fn a_lost_triangle() {
    let mut broken = Broken::new("skirts");
    let leaf = textured_leaf(&broken);
    let largest = |_: &Primitive, areas: &[f32]| {
        (0..areas.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b])).unwrap()
    };
    broken.rewrite(leaf, |mesh| lose_triangle(mesh, largest));
    let report = broken.report(true);
    assert_eq!(failed(&report)[..2], ["faithful leaves", "leaves meet"], "{}", text(&report));
    assert!(report.leaves.unwrap().area_difference > 1e-6);
}

/// The smallest triangle, not below 0.1 cm², whose vertices others have too.
fn tiny_triangle(primitive: &Primitive, areas: &[f32]) -> Option<usize> {
    let uses = |vertex| primitive.indices.iter().filter(|&&other| other == vertex).count();
    let inner = |at: usize| primitive.indices[3 * at..3 * at + 3].iter().all(|&v| uses(v) > 2);
    let fits = |&at: &usize| areas[at] >= 1e-5 && inner(at);
    (0..areas.len()).filter(fits).min_by(|&a, &b| areas[a].total_cmp(&areas[b]))
}

/// A hole too small to be seen in the area.
#[test]
fn a_lost_triangle_that_is_tiny() {
    let mut broken = Broken::new("skirts");
    let tiniest = |leaf: usize| {
        let path = broken.file(leaf);
        let mesh = read_glb(&fs::read(&path).unwrap(), &path).unwrap();
        let primitive = &mesh.primitives[0];
        let areas: Vec<f32> = areas(primitive).collect();
        Some((areas[tiny_triangle(primitive, &areas)?], leaf))
    };
    let nodes = &broken.scene.nodes;
    let leaves = (0..nodes.len()).filter(|&node| nodes[node].first_child.is_none());
    let (_, leaf) = leaves.filter_map(tiniest).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    broken.rewrite(leaf, |mesh| lose_triangle(mesh, |a, b| tiny_triangle(a, b).unwrap()));
    let report = broken.report(true);
    assert!(failed(&report).contains(&"leaves meet"), "{}", text(&report));
    assert!(report.leaves.unwrap().area_difference < 1e-6);
}

/// An edge of a leaf that a neighbour has too, as a primitive and a corner.
fn common_edge(broken: &Broken) -> (usize, usize, usize) {
    let nodes = &broken.scene.nodes;
    let leaves = (0..nodes.len()).filter(|&node| nodes[node].first_child.is_none());
    let mut seen: BTreeMap<[PositionKey<f64>; 2], (usize, usize, usize)> = BTreeMap::new();
    for leaf in leaves {
        let path = broken.file(leaf);
        let mesh = read_glb(&fs::read(&path).unwrap(), &path).unwrap();
        for (number, primitive) in mesh.primitives.iter().enumerate() {
            for corner in 0..primitive.indices.len() {
                let next = corner - corner % 3 + (corner + 1) % 3;
                let mut ends = [corner, next].map(|corner| {
                    let offset = primitive.positions[primitive.indices[corner] as usize];
                    key::<f64>(std::array::from_fn(|i| mesh.origin[i] + f64::from(offset[i])))
                });
                ends.sort_unstable();
                let &mut (other, ..) = seen.entry(ends).or_insert((leaf, number, corner));
                if other != leaf {
                    return (leaf, number, corner);
                }
            }
        }
    }
    panic!("no two leaves meet")
}

/// A vertex in the middle of a common edge, on one side only: the surface is the same, but for what
/// rounding shows between the halves of the edge and the whole.
#[test]
fn a_vertex_that_the_neighbour_does_not_have() {
    let mut broken = Broken::new("skirts");
    let (leaf, primitive, corner) = common_edge(&broken);
    broken.rewrite(leaf, |mesh| {
        let primitive = &mut mesh.primitives[primitive];
        let first = corner - corner % 3;
        let at = [0, 1, 2].map(|turn| primitive.indices[first + (corner % 3 + turn) % 3]);
        let [a, b, c] = at.map(|vertex| vertex as usize);
        let middle = primitive.positions.len() as u32;
        let half = |of: &mut Vec<[f32; 2]>| {
            if !of.is_empty() {
                of.push(std::array::from_fn(|i| (of[a][i] + of[b][i]) * 0.5));
            }
        };
        half(&mut primitive.texcoords);
        if !primitive.colors.is_empty() {
            primitive.colors.push(primitive.colors[a]);
        }
        let place = |i: usize| (primitive.positions[a][i] + primitive.positions[b][i]) * 0.5;
        primitive.positions.push([place(0), place(1), place(2)]);
        let halves = [at[0], middle, c as u32, middle, at[1], c as u32];
        primitive.indices.splice(first..first + 3, halves);
    });
    let report = broken.report(true);
    assert_eq!(failed(&report)[0], "leaves meet", "{}", text(&report));
    let torn = report.checks.iter().find(|check| check.name == "leaves meet").unwrap();
    assert_eq!(torn.failure_count, 3, "two halves and a whole");
}

#[test]
fn misplaced_texels() {
    let mut broken = Broken::new("skirts");
    let leaf = textured_leaf(&broken);
    broken.rewrite(leaf, |mesh| repaint(mesh, image::imageops::flip_horizontal_in_place));
    let failed = broken.failed();
    assert!(failed.contains(&"tiles of the leaves"), "{failed:?}");
}
