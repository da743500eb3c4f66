//! What stands for a chunk that simplification would make vanish: its largest triangles.

use crate::builder::border::vertex::Border;
use crate::builder::simplify::compact::compact;
use crate::builder::simplify::simplified::{LadderStep, Simplified};
use crate::mesh::Mesh;

/// The largest `most` triangles of a mesh, at least one, in their order.
pub fn fallback_triangles(mesh: &Mesh, border: &Border, most: usize) -> Simplified {
    let mut order: Vec<usize> = (0..mesh.triangles.len()).collect();
    let area = |&triangle: &usize| mesh.triangle_area(mesh.triangles[triangle]);
    order.sort_by(|a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    order.truncate(most.max(1));
    order.sort_unstable();
    let triangles = order.into_iter().map(|triangle| mesh.triangles[triangle]).collect();
    let (mesh, border) = compact(&Mesh { triangles, ..mesh.clone() }, border);
    // How far it is from the whole is measured, as for every node.
    Simplified { mesh, border, error: 0.0, step: LadderStep::Fallback }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_triangles_stay_in_their_order() {
        let corner = |size: f32, z: f32| [[0.0, 0.0, z], [size, 0.0, z], [0.0, size, z]];
        let positions: Vec<[f32; 3]> =
            [corner(1.0, 0.0), corner(3.0, 1.0), corner(1.0, 2.0), corner(2.0, 3.0)].concat();
        let mesh = Mesh {
            materials: vec![0; positions.len()],
            positions,
            triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]],
            ..Mesh::default()
        };
        let heights = |most: usize| -> Vec<f32> {
            let kept = fallback_triangles(&mesh, &Border::interior(12), most);
            assert_eq!(kept.mesh.positions.len(), kept.border.planes.len());
            kept.mesh.triangles.iter().map(|t| kept.mesh.positions[t[0] as usize][2]).collect()
        };
        assert_eq!(heights(3), [0.0, 1.0, 3.0], "of two alike the first");
        assert_eq!(heights(0), [1.0], "never nothing");
        assert_eq!(heights(9).len(), 4);
    }
}
