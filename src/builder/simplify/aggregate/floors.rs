//! What nobody sees of bodies.

use crate::builder::simplify::parts::{Part, parts};
use crate::mesh::{Mesh, UpAxis, wide};

/// A part is a body where it is at least so high for the side of a square as large as it is from
/// above.
const HIGH: f64 = 0.1;

/// The floor is in the lowest share of a body's height.
const LOWEST: f64 = 0.1;

/// Floors rise by less than the other share of their length.
const LEVEL: f64 = 0.9;

/// The triangles of a mesh without the floors of its bodies.
pub fn without_floors(mesh: &Mesh, up: UpAxis) -> Mesh {
    let at = |vertex: u32| up.z_up(wide(mesh.positions[vertex as usize]));
    let of_part = |Part { triangles, .. }: Part| {
        let heights = triangles.as_flattened().iter().map(|&vertex| at(vertex).z);
        let (low, high) = heights
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let normal = |[a, b, c]: [u32; 3]| (at(b) - at(a)).cross(at(c) - at(a)) * 0.5;
        // Seen twice, from above and from below.
        let footprint: f64 = triangles.iter().map(|&t| normal(t).z.abs()).sum::<f64>() * 0.5;
        let is_body = high - low > HIGH * footprint.sqrt();
        let most = low + LOWEST * (high - low);
        let is_floor = move |&triangle: &[u32; 3]| {
            let normal = normal(triangle);
            is_body
                && normal.z.abs() > LEVEL * normal.length()
                && triangle.iter().all(|&vertex| at(vertex).z <= most)
        };
        triangles.into_iter().filter(move |triangle| !is_floor(triangle)).collect::<Vec<_>>()
    };
    Mesh { triangles: parts(mesh).into_iter().flat_map(of_part).collect(), ..mesh.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floors_of_houses_go_and_roofs_walls_and_roads_stay() {
        // A house of 8 by 8 by 5 m, a part of its walls, a road below it, and a table's top.
        let mut positions = Vec::new();
        for z in [0.0, 5.0] {
            positions.extend([[0.0, 0.0, z], [8.0, 0.0, z], [8.0, 8.0, z], [0.0, 8.0, z]]);
        }
        positions.extend([[20.0, 0.0, -1.0], [60.0, 0.0, 0.0], [60.0, 9.0, 0.0]]);
        let triangles = vec![
            [0, 2, 1],
            [0, 3, 2],
            [4, 5, 6],
            [4, 6, 7],
            [0, 1, 5],
            [0, 5, 4],
            [2, 3, 7],
            [2, 7, 6],
            [8, 9, 10],
        ];
        let materials = vec![0; positions.len()];
        for turned in [false, true] {
            let turn = |[a, b, c]: [u32; 3]| if turned { [a, c, b] } else { [a, b, c] };
            let triangles: Vec<[u32; 3]> = triangles.iter().map(|&t| turn(t)).collect();
            let mesh = Mesh {
                positions: positions.clone(),
                materials: materials.clone(),
                triangles: triangles.clone(),
                ..Mesh::default()
            };
            assert_eq!(without_floors(&mesh, UpAxis::Z).triangles, triangles[2..]);
        }
    }
}
