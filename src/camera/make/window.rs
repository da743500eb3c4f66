//! Which part of a city is mapped: all of a small one, the densest square of a large one.

use glam::{DVec2, DVec3};

use super::plan::Plan;
use crate::format::Scene;

/// Longest side of a map, metres. A drive of a minute stays within it, and streets are many cells
/// wide on it.
pub(super) const MAX_SIDE_M: f64 = 1024.0;
/// Parts into which a square is divided along each side to find its densest half.
const PARTS: i32 = 4;

/// The mapped rectangle on `plan`, least and greatest corner: around all nodes where that fits,
/// otherwise where the finest nodes have most triangles.
pub(super) fn choose(scene: &Scene, plan: &Plan, bounds: [DVec3; 2]) -> [DVec2; 2] {
    let [mut min, mut max] = bounds.map(DVec3::truncate);
    let leaves: Vec<(DVec2, u64)> = scene
        .nodes
        .iter()
        .filter(|node| node.first_child.is_none())
        .map(|node| {
            let [low, high] = plan.map_box([node.bbox_min, node.bbox_max]);
            (((low + high) / 2.0).truncate(), u64::from(node.triangles))
        })
        .collect();
    let triangles = |min: DVec2, max: DVec2| -> u64 {
        let inside = |at: &DVec2| at.cmpge(min).all() && at.cmple(max).all();
        leaves.iter().filter(|(at, _)| inside(at)).map(|(_, triangles)| triangles).sum()
    };
    while (max - min).max_element() > MAX_SIDE_M {
        let size = max - min;
        // Only the sides that are too long become shorter.
        let halved = DVec2::select(size.cmpgt(DVec2::splat(MAX_SIDE_M)), size / 2.0, size)
            .max(size.min(DVec2::splat(MAX_SIDE_M)));
        let mut best = None;
        // The middle comes first and wins where others are no denser.
        for (row, column) in from_the_middle() {
            let low = min + (size - halved) * DVec2::new(column, row);
            let found = triangles(low, low + halved);
            if best.is_none_or(|(most, _)| found > most) {
                best = Some((found, low));
            }
        }
        if let Some((_, low)) = best {
            (min, max) = (low, low + halved);
        }
    }
    [min, max]
}

/// Places of a half within a whole, 0 to 1 along each side.
fn from_the_middle() -> impl Iterator<Item = (f64, f64)> {
    let along = || [2, 1, 3, 0, 4].map(|part| f64::from(part) / f64::from(PARTS));
    along().into_iter().flat_map(move |row| along().map(move |column| (row, column)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::test_scene;

    #[test]
    fn a_large_scene_is_cut_to_its_densest_part() {
        let mut scene = test_scene::scene();
        let leaves = [2, 3, 4];
        for (node, (x, triangles)) in leaves.into_iter().zip([(0.0, 9), (41e3, 50), (99e3, 8)]) {
            scene.nodes[node].bbox_min = [x, 500.0, 0.0];
            scene.nodes[node].bbox_max = [x + 1e3, 900.0, 30.0];
            scene.nodes[node].triangles = triangles;
        }
        let plan = Plan::new(scene.up, DVec3::ZERO);
        let bounds = [DVec3::ZERO, DVec3::new(1e5, 1e3, 30.0)];
        let [min, max] = choose(&scene, &plan, bounds);
        assert!((max - min).max_element() <= MAX_SIDE_M);
        assert!((max - min).min_element() > MAX_SIDE_M / 2.0);
        let dense = DVec2::new(41_500.0, 700.0);
        assert!(dense.cmpge(min).all() && dense.cmple(max).all(), "{min} {max}");
        assert!(min.y >= 0.0 && max.y <= 1e3);
        let small = [DVec3::ZERO, DVec3::new(1000.0, 90.0, 30.0)];
        assert_eq!(choose(&scene, &plan, small), small.map(DVec3::truncate));
    }
}
