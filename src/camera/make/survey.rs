//! Which nodes to read for a map, so that walls stand where they are and little is read.

use std::path::Path;

use glam::{DVec2, DVec3};

use super::plan::Plan;
use super::raster::Surfaces;
use crate::format::{NODES_DIR, Node, Scene, read_glb_without_normals};
use crate::{Error, Result};

/// Triangles to read at most, unless the coarsest nodes have more.
const MAX_TRIANGLES: u64 = 3_000_000;

/// Indices of nodes that together show what stands within `window`, each piece once. Begins at the
/// roots and takes the children of the node with the greatest error until all errors are below
/// `error_m` or the triangles would be too many.
pub(super) fn nodes(scene: &Scene, plan: &Plan, window: [DVec2; 2], error_m: f64) -> Vec<u32> {
    let reaches = |node: &Node| {
        let [min, max] = plan.map_box([node.bbox_min, node.bbox_max]);
        min.truncate().cmple(window[1]).all() && max.truncate().cmpge(window[0]).all()
    };
    let node = |index: u32| &scene.nodes[index as usize];
    // Positive floats order as their bits do; equal errors go by index.
    let keyed = |index: u32| (node(index).geometric_error.max(0.0).to_bits(), index);
    let mut open: std::collections::BinaryHeap<(u64, u32)> =
        scene.roots().filter(|&root| reaches(node(root))).map(keyed).collect();
    let mut triangles: u64 = open.iter().map(|&(_, at)| u64::from(node(at).triangles)).sum();
    let mut chosen = Vec::new();
    while let Some((_, index)) = open.pop() {
        let finer: Vec<u32> = scene.children(index).filter(|&child| reaches(node(child))).collect();
        let more: u64 = finer.iter().map(|&child| u64::from(node(child).triangles)).sum();
        let after = triangles.saturating_sub(u64::from(node(index).triangles)) + more;
        let is_fine = node(index).geometric_error <= error_m;
        if is_fine || node(index).first_child.is_none() || after > MAX_TRIANGLES {
            chosen.push(index);
        } else {
            triangles = after;
            open.extend(finer.into_iter().map(keyed));
        }
    }
    chosen.sort_unstable();
    chosen
}

/// Reads nodes of the scene in the folder `dir` into `surfaces`.
pub(super) fn read(
    scene: &Scene,
    dir: &Path,
    nodes: &[u32],
    plan: &Plan,
    surfaces: &mut Surfaces,
) -> Result<()> {
    for &index in nodes {
        let path = dir.join(NODES_DIR).join(&scene.nodes[index as usize].file);
        let bytes = crate::format::read_regular(&path)
            .map_err(|error| Error::input(&path, format!("cannot read the node: {error}")))?;
        let mesh = read_glb_without_normals(&bytes, &path)?;
        let origin = DVec3::from_array(mesh.origin);
        for primitive in &mesh.primitives {
            let places: Vec<DVec3> = primitive
                .positions
                .iter()
                .map(|place| plan.map(origin + DVec3::from_array(place.map(f64::from))))
                .collect();
            for corners in primitive.indices.chunks_exact(3) {
                let corner = |index: usize| places.get(corners[index] as usize).copied();
                if let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) {
                    surfaces.add([a, b, c]);
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::test_scene;

    #[test]
    fn nodes_are_as_coarse_as_the_error_allows_and_only_those_in_the_window() {
        let mut scene = test_scene::scene();
        // Nodes 0 > 1 > {3, 2} have errors of 4, 2, 1 and 0 metres; node 4 stands alone, far away.
        scene.nodes[4].bbox_min[0] += 5e3;
        scene.nodes[4].bbox_max[0] += 5e3;
        let plan = Plan::new(scene.up, DVec3::from_array(scene.nodes[0].bbox_min));
        let near = [DVec2::ZERO, DVec2::splat(50.0)];
        let chosen = |window, error_m| nodes(&scene, &plan, window, error_m);
        assert_eq!(chosen(near, 9.0), [0]);
        assert_eq!(chosen(near, 2.0), [1]);
        assert_eq!(chosen(near, 0.0), [2, 3]);
        assert_eq!(chosen([DVec2::ZERO, DVec2::splat(1e4)], 2.0), [1, 4]);
        let mut dense = scene.clone();
        dense.nodes[2].triangles = MAX_TRIANGLES as u32;
        assert_eq!(nodes(&dense, &plan, near, 0.0), [1], "the children would be too many");
    }
}
