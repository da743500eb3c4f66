//! Giving every triangle one material again after a collapse across material borders.
//!
//! Such a collapse leaves triangles whose corners belong to different materials. A triangle keeps
//! the material of most of its corners; a corner of another material is doubled, and its texture
//! coordinate continues the texture from the two corners that have it, as a picture on a flat
//! wall goes on beyond them: by the similarity that maps their edge to its texture coordinates.

use rustc_hash::FxHashMap;

use crate::builder::border::vertex::Border;
use crate::mesh::{Mesh, wide};

/// Mends `mesh`, which came from `source`.
pub fn split_mixed_triangles(mesh: &mut Mesh, border: &mut Border, source: &Mesh) {
    let mixed = |mesh: &Mesh, [a, b, c]: [u32; 3]| {
        let of = |vertex: u32| mesh.materials[vertex as usize];
        of(a) != of(b) || of(b) != of(c)
    };
    if !mesh.triangles.iter().any(|&triangle| mixed(mesh, triangle)) {
        return;
    }
    let mirrored = mirrored_materials(source);
    let mut made: FxHashMap<(u32, u32, [u32; 2]), u32> = FxHashMap::default();
    for number in 0..mesh.triangles.len() {
        let triangle = mesh.triangles[number];
        if !mixed(mesh, triangle) {
            continue;
        }
        let of = triangle.map(|vertex| mesh.materials[vertex as usize]);
        let material = if of[1] == of[2] { of[1] } else { of[0] };
        let known: Vec<u32> = (0..3).filter(|&i| of[i] == material).map(|i| triangle[i]).collect();
        let flip = mirrored.get(&material).copied().unwrap_or(false);
        mesh.triangles[number] = triangle.map(|vertex| {
            if mesh.materials[vertex as usize] == material {
                return vertex;
            }
            let texcoord = continued(mesh, triangle, &known, vertex, flip);
            let identity = (vertex, material, texcoord.map(f32::to_bits));
            *made.entry(identity).or_insert_with(|| {
                let copy = mesh.push_copy(vertex as usize);
                border.planes.push(border.planes[vertex as usize]);
                border.keep.push(border.keep[vertex as usize]);
                mesh.materials[copy as usize] = material;
                if let Some(slot) = mesh.texcoords.get_mut(copy as usize) {
                    *slot = texcoord;
                }
                if !mesh.colors.is_empty() {
                    mesh.colors[copy as usize] = mesh.colors[known[0] as usize];
                }
                copy
            })
        });
    }
}

/// The texture coordinate at `vertex` of a triangle of which `known` corners have one.
fn continued(mesh: &Mesh, triangle: [u32; 3], known: &[u32], vertex: u32, flip: bool) -> [f32; 2] {
    let Some(&first) = known.first().filter(|_| !mesh.texcoords.is_empty()) else {
        return [0.0; 2];
    };
    let texcoord = |vertex: u32| glam::Vec2::from(mesh.texcoords[vertex as usize]).as_dvec2();
    let (from, Some(&second)) = (texcoord(first), known.get(1)) else {
        return mesh.texcoords[first as usize];
    };
    let point = |vertex: u32| wide(mesh.positions[vertex as usize]);
    let edge = point(second) - point(first);
    let along = edge.normalize_or_zero();
    let [a, b, c] = triangle.map(point);
    let across = (b - a).cross(c - a).cross(along).normalize_or_zero();
    let reach = point(vertex) - point(first);
    let scale = edge.length().max(f64::MIN_POSITIVE);
    let (x, y) = (reach.dot(along) / scale, reach.dot(across) / scale);
    // Seen from the front, v grows downwards: the picture turns the other way than the surface.
    let y = if flip { y } else { -y };
    let step = texcoord(second) - from;
    let result = from + step * x + step.perp() * y;
    result.as_vec2().into()
}

/// Whether a material's texture is mostly mirrored: as seen from the front, with v downwards, its
/// texture triangles then turn as the surface's do.
fn mirrored_materials(mesh: &Mesh) -> FxHashMap<u32, bool> {
    let mut turn: FxHashMap<u32, f64> = FxHashMap::default();
    if !mesh.texcoords.is_empty() {
        for &triangle in &mesh.triangles {
            let [a, b, c] =
                triangle.map(|v| glam::Vec2::from(mesh.texcoords[v as usize]).as_dvec2());
            *turn.entry(mesh.triangle_material(triangle)).or_insert(0.0) += (b - a).perp_dot(c - a);
        }
    }
    turn.into_iter().map(|(material, sum)| (material, sum > 0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A unit quad of material 0 whose texture is 1 m a unit, and a triangle of material 1 beside
    /// it; the shared corner is then taken by the wrong material.
    #[test]
    fn the_picture_goes_on_beyond_its_own_corners() {
        let source = Mesh {
            positions: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [3.0, 0.0, 2.0]],
            texcoords: vec![[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.5, 0.5]],
            materials: vec![0, 0, 0, 1],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        let mut mesh = source.clone();
        mesh.triangles = vec![[0, 1, 3]];
        let mut border = Border::interior(4);
        split_mixed_triangles(&mut mesh, &mut border, &source);
        let [a, b, c] = mesh.triangles[0];
        assert_eq!([a, b], [0, 1]);
        assert_eq!(mesh.materials[c as usize], 0);
        assert_eq!(mesh.positions[c as usize], [3.0, 0.0, 2.0]);
        // Three units to the right, two up: v is 1 at the bottom and grows downwards.
        let [u, v] = mesh.texcoords[c as usize];
        assert!((u - 3.0).abs() < 1e-5 && (v + 1.0).abs() < 1e-5, "{u} {v}");
        assert_eq!(border.planes.len(), mesh.positions.len());
    }

    #[test]
    fn triangles_of_one_material_stay_as_they_are() {
        let mesh = Mesh {
            positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            materials: vec![4; 3],
            triangles: vec![[0, 1, 2]],
            ..Default::default()
        };
        let mut same = mesh.clone();
        split_mixed_triangles(&mut same, &mut Border::interior(3), &mesh);
        assert_eq!(same, mesh);
    }
}
