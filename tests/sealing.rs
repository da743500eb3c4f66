//! Any mixture of levels covers the block: no ray gets inside a closed block past the front's
//! triangles, however different the levels are that meet at a cut.
//!
//! Rays are aimed at what is open between the meshes of a front, from all directions and most of
//! them along the surface, where gaps show. One that reaches a point inside the source, deeper
//! below its surface than the front may be away from it, before it meets any triangle, has
//! leaked. Through an open sheet of hills, a steep ray has leaked that meets nothing. Skirts are the
//! triangles that go into the files.

mod common;

use std::collections::BTreeSet;

use common::rays::{Ray, Soup};
use common::*;
use glam::DVec3;
use hlod::builder::border::skirt;
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions};
use hlod::builder::simplify::ladder::Simplifier;
use hlod::lattice::Lattice;
use hlod::mesh::{AlphaMode, Material, Mesh, PositionKey};
use hlod::texture::{BakeClasses, BakePlan, BakeReason};

/// Rays at each front.
const RAYS: usize = 300;

/// Nodes of a mixture of levels, one over every part of the block.
type Front<'a> = Vec<&'a WrittenNode>;

/// The front that stops at nodes for which `stop` says so, and at leaves.
fn front<'a>(nodes: &'a [WrittenNode], mut stop: impl FnMut(&WrittenNode) -> bool) -> Front<'a> {
    let mut front = Vec::new();
    let mut open = vec![&nodes[0]];
    while let Some(node) = open.pop() {
        let children: Vec<&WrittenNode> = nodes
            .iter()
            .filter(|child| {
                child.level == node.level + 1 && child.child_path.starts_with(&node.child_path)
            })
            .collect();
        if children.is_empty() || (node.level > 0 && stop(node)) {
            front.push(node);
        } else {
            open.extend(children);
        }
    }
    front
}

/// Fronts with neighbours as different as can be, and random ones.
fn mixed_fronts(nodes: &[WrittenNode], seed: u64) -> Vec<(String, Front<'_>)> {
    let deepest = nodes.iter().map(|node| node.level).max().unwrap();
    let mut fronts = Vec::new();
    // The largest subtrees as they are beside leaves, and the other way round.
    for parity in 0..2 {
        let stop = |node: &WrittenNode| node.child_path[0] % 2 == parity;
        fronts.push((format!("subtrees of parity {parity} beside leaves"), front(nodes, stop)));
    }
    // Alternating at every depth, by all the numbers of the place.
    for parity in 0..2 {
        let stop = |node: &WrittenNode| node.child_path.iter().sum::<u32>() % 2 == parity;
        fronts.push((format!("checkerboard {parity}"), front(nodes, stop)));
    }
    // Two levels apart everywhere: a coarse border meets several finer ones.
    for coarse in 1..deepest.saturating_sub(1) {
        let stop = |node: &WrittenNode| {
            let odd = node.child_path[coarse - 1] % 2 == 1;
            node.level == if odd { coarse } else { coarse + 2 }
        };
        let stop = |node: &WrittenNode| node.level >= coarse && stop(node);
        fronts.push((format!("levels {coarse} and {}", coarse + 2), front(nodes, stop)));
    }
    let mut random = Random::new(seed, 0);
    for share in [0.2, 0.4, 0.6] {
        fronts.push((format!("random {share}"), front(nodes, |_| random.unit() < share)));
    }
    fronts
}

/// The node's triangles as its file has them.
fn drawn(node: &WrittenNode, with_skirts: bool) -> Mesh {
    let mut mesh = node.mesh.clone();
    if with_skirts {
        skirt::append(&mut mesh, &node.skirts);
    }
    mesh
}

/// Edges at which the meshes of a front are open.
fn open_edges(front: &Front) -> Vec<[DVec3; 2]> {
    let uses = edge_uses(front.iter().map(|node| &node.mesh));
    let mut ends = std::collections::BTreeMap::new();
    for mesh in front.iter().map(|node| &node.mesh) {
        for &position in &mesh.positions {
            ends.insert(hlod::mesh::key(position), DVec3::from(position.map(f64::from)));
        }
    }
    let odd: BTreeSet<[PositionKey<f32>; 2]> =
        uses.into_iter().filter(|(_, uses)| uses % 2 == 1).map(|(edge, _)| edge).collect();
    odd.into_iter().map(|edge| edge.map(|end| ends[&end])).collect()
}

/// A ray through a point beside an open edge, in the plane across the cut that made it.
fn aimed(edges: &[[DVec3; 2]], reach: f64, far: f64, random: &mut Random) -> Ray {
    let mut signed = || random.unit() * 2.0 - 1.0;
    let mut direction = DVec3::new(signed(), signed(), signed());
    let [a, b] = edges[((random.unit() * edges.len() as f64) as usize).min(edges.len() - 1)];
    let mut beside = DVec3::from([0; 3].map(|_| random.unit() * 2.0 - 1.0));
    // From a whole error away down to where only rounding counts.
    beside *= reach * 10f64.powf(-5.0 * random.unit());
    if let Some(axis) = (0..3).find(|&axis| a[axis] == b[axis]) {
        beside[axis] = 0.0;
        // Most rays cross the cut steeply, along the surface.
        for other in (0..3).filter(|&other| other != axis) {
            direction[other] *= random.unit();
        }
    }
    let aim = a.lerp(b, random.unit()) + beside;
    let direction = direction.normalize_or(DVec3::X);
    [aim - direction * far, direction]
}

/// Whether a ray passes an edge so closely: what is open by rounding alone has no skirt, and is no
/// wider than a fraction of a pixel is from anywhere.
fn passes_by([origin, direction]: Ray, edges: &[[DVec3; 2]], closely: f64) -> bool {
    edges.iter().any(|&[a, b]| {
        // The distance of two lines, where they are nearest within the edge.
        let along = b - a;
        let across = along - direction * along.dot(direction);
        let from = (origin - a) - direction * (origin - a).dot(direction);
        let length = across.length_squared();
        let share = if length > 0.0 { (from.dot(across) / length).clamp(0.0, 1.0) } else { 0.0 };
        from.distance(across * share) <= closely
    })
}

/// Leaking rays out of [`RAYS`], with and without skirts. `rounding` is what new vertices at cuts
/// may lie beside the source's surface.
fn leaks(source: &Soup, front: &Front, far: f64, rounding: f64) -> [usize; 2] {
    let edges = open_edges(front);
    if edges.is_empty() {
        return [0, 0];
    }
    let reach = front.iter().map(|node| node.error).fold(0.0, f64::max);
    let boxes: Vec<(DVec3, DVec3, f64)> = front
        .iter()
        .map(|node| {
            let (low, high) = node.mesh.bounds().unwrap();
            let corner = |corner: [f32; 3]| DVec3::from(corner.map(f64::from));
            (corner(low) - node.error, corner(high) + node.error, node.error)
        })
        .collect();
    // Where a node may be, the surface may be as far from the source's as that node's error.
    let bound = |point: DVec3| {
        let near = |(low, high, _): &&(DVec3, DVec3, f64)| point.clamp(*low, *high) == point;
        boxes.iter().filter(near).map(|(_, _, error)| *error).fold(rounding, f64::max)
    };
    let drawn = [true, false]
        .map(|skirts| Soup::new(front.iter().map(|node| drawn(node, skirts)).collect::<Vec<_>>()));
    let mut random = Random::new(5, 0);
    let mut found = [0, 0];
    for _ in 0..RAYS {
        let ray = aimed(&edges, reach, far, &mut random);
        let inside = source.crossings(ray);
        for (soup, found) in drawn.iter().zip(&mut found) {
            let stopped = soup.crossings(ray).first().copied().unwrap_or(f64::INFINITY);
            let is_deep = source.is_deep(ray, &inside, stopped, bound);
            *found += usize::from(is_deep && !passes_by(ray, &edges, 0.5 * rounding));
        }
    }
    found
}

/// Steep rays out of [`RAYS`] that meet nothing of a sheet far from where it ends, with and without
/// skirts. `side` is that of the square that it covers.
fn leaks_of_sheet(front: &Front, side: f64) -> [usize; 2] {
    let reach = front.iter().map(|node| node.error).fold(0.0, f64::max);
    let far = 10.0;
    // Where the sheet ends it may recede by the error; rays lean by as much as 0.3.
    let margin = reach + 0.5;
    let within = |end: &DVec3| (0..2).all(|i| end[i] > margin && end[i] < side - margin);
    let edges: Vec<[DVec3; 2]> =
        open_edges(front).into_iter().filter(|edge| edge.iter().all(within)).collect();
    if edges.is_empty() {
        return [0, 0];
    }
    let drawn = [true, false]
        .map(|skirts| Soup::new(front.iter().map(|node| drawn(node, skirts)).collect::<Vec<_>>()));
    let mut random = Random::new(7, 0);
    let mut found = [0, 0];
    for _ in 0..RAYS {
        let [origin, direction] = aimed(&edges, reach, far, &mut random);
        let aim = origin + direction * far;
        if !within(&aim) {
            continue;
        }
        let lean = DVec3::new(direction.x, direction.y, 0.0) * 0.3;
        let direction = (lean - DVec3::Z).normalize();
        let ray = [aim - direction * far, direction];
        for (soup, found) in drawn.iter().zip(&mut found) {
            *found += usize::from(soup.crossings(ray).is_empty());
        }
    }
    found
}

fn every_option(borders: BorderMode) -> Vec<HierarchyOptions> {
    let mut all = Vec::new();
    for level_factor in [2, 4] {
        for simplifier in [Simplifier::Qem, Simplifier::Clustering] {
            all.push(HierarchyOptions {
                desired_tris: 150,
                level_factor,
                simplifier,
                borders,
                constants: all_nodes(),
                ..Default::default()
            });
        }
    }
    all
}

/// Builds a mesh in every way and demands that no ray leaks through any front, and that rays leak
/// where the same fronts are drawn without their skirts.
fn demand_sealed(
    mesh: Mesh<f64>,
    ways: &[HierarchyOptions],
    bake: Option<BakePlan>,
    leaks: impl Fn(&Front, Lattice) -> [usize; 2],
) {
    let (piece, lattice) = block(mesh);
    let mut without = 0;
    for options in ways {
        let nodes = build_baked(piece.clone(), lattice, options, bake);
        for (kind, front) in mixed_fronts(&nodes, 11) {
            let [leaked, leaked_without] = leaks(&front, lattice);
            assert_eq!(leaked, 0, "of {RAYS} rays at {kind} of {options:?}");
            without += leaked_without;
        }
    }
    assert!(without > 25 * ways.len() / 2, "only {without} leaks without skirts: badly aimed rays");
}

/// Slits between the children of a node are not left open in it: the root of a closed mesh without
/// seams, which no plane bounds, is closed.
#[test]
fn roots_of_closed_meshes_are_closed() {
    for (solid, name) in
        [(ball(36, 5.0, 0.03, 31), "ball"), (slab(32, [12.0, 8.0, 5.0], 0.3, 71), "slab")]
    {
        let (piece, lattice) = block(solid);
        for options in every_option(BorderMode::Skirts) {
            // Clustering folds meshes.
            if options.simplifier == Simplifier::Qem {
                let nodes = build(piece.clone(), lattice, &options);
                let open = open_edges(&vec![&nodes[0]]);
                assert!(open.is_empty(), "{name} of {options:?}: {open:?}");
            }
        }
    }
}

fn skirts_cover(solid: Mesh<f64>, far: f64, ways: &[HierarchyOptions], bake: Option<BakePlan>) {
    let source = Soup::new([block(solid.clone()).0.mesh]);
    demand_sealed(solid, ways, bake, |front, lattice| {
        leaks(&source, front, far, 4.0 * lattice.step)
    });
}

/// Both ways to simplify by collapse, for meshes with seams.
fn collapse_options() -> Vec<HierarchyOptions> {
    let mut all = every_option(BorderMode::Skirts);
    all.retain(|options| options.level_factor == 4 && options.simplifier == Simplifier::Qem);
    all
}

/// Which of some materials may share a texture of a node's own, always.
fn all_baked(materials: usize) -> BakeClasses {
    let materials: Vec<Material> =
        (0..materials).map(|number| Material::plain(number.to_string())).collect();
    BakeClasses::new(&materials, |_| true, |_| true)
}

fn always(classes: &BakeClasses) -> Option<BakePlan<'_>> {
    Some(BakePlan {
        classes,
        always: Some(BakeReason::Torn),
        where_over_budget: true,
        textures: None,
    })
}

#[test]
fn skirts_cover_a_ball_whatever_levels_meet() {
    let ways = every_option(BorderMode::Skirts);
    skirts_cover(ball(36, 5.0, 0.03, 31), 40.0, &ways, None);
}

#[test]
fn skirts_cover_a_slab_whatever_levels_meet() {
    let ways = every_option(BorderMode::Skirts);
    skirts_cover(slab(32, [12.0, 8.0, 5.0], 0.3, 71), 60.0, &ways, None);
}

#[test]
fn skirts_cover_a_ball_of_many_charts_and_materials() {
    for materials in [1, 3] {
        let solid = in_charts(&ball(36, 5.0, 0.03, 31), 2.5, materials);
        skirts_cover(solid, 40.0, &collapse_options(), None);
    }
}

#[test]
fn skirts_cover_a_ball_whose_coarse_nodes_have_textures_of_their_own() {
    for materials in [1, 3] {
        let solid = in_charts(&ball(36, 5.0, 0.03, 31), 2.5, materials);
        skirts_cover(solid, 40.0, &collapse_options(), always(&all_baked(materials as usize)));
    }
    // Of three materials one keeps its own texture, and seams around it.
    let mut materials = ["a", "b", "c"].map(Material::plain);
    materials[0].alpha = AlphaMode::Mask { cutoff: 0.5 };
    let classes = BakeClasses::new(&materials, |_| true, |_| true);
    let solid = in_charts(&ball(36, 5.0, 0.03, 31), 2.5, 3);
    skirts_cover(solid, 40.0, &collapse_options(), always(&classes));
}

#[test]
fn skirts_cover_an_open_sheet_with_and_without_seams() {
    const QUADS: usize = 96;
    let sheet = hills(QUADS, 17);
    fn sealed(mesh: Mesh<f64>, ways: &[HierarchyOptions], bake: Option<BakePlan>) {
        demand_sealed(mesh, ways, bake, |front, _| leaks_of_sheet(front, QUADS as f64 * 0.1));
    }
    sealed(sheet.clone(), &every_option(BorderMode::Skirts), None);
    for materials in [1, 3] {
        let charts = in_charts(&sheet, 1.7, materials);
        sealed(charts.clone(), &collapse_options(), None);
        let classes = all_baked(materials as usize);
        sealed(charts, &collapse_options(), always(&classes));
    }
}

#[test]
fn locked_borders_leave_nothing_to_cover() {
    for (solid, far) in [(ball(16, 5.0, 0.03, 3), 40.0), (slab(16, [12.0, 8.0, 5.0], 0.3, 7), 60.0)]
    {
        let (piece, lattice) = block(solid);
        let source = Soup::new([piece.mesh.clone()]);
        for options in every_option(BorderMode::Locked) {
            let nodes = build(piece.clone(), lattice, &options);
            for (kind, front) in mixed_fronts(&nodes, 13) {
                if options.simplifier == Simplifier::Qem {
                    assert_eq!(open_edges(&front).len(), 0, "{kind} of {options:?}");
                }
                // Clustering may fold the mesh over an edge, which looks open then.
                let [leaked, _] = leaks(&source, &front, far, 4.0 * lattice.step);
                assert_eq!(leaked, 0, "of {RAYS} rays at {kind} of {options:?}");
            }
        }
    }
}
