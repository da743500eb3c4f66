//! Gathering a block's geometry from the parts of a model: welded, in f64, then on its lattice.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::chain::{Chain, CutPlane};
use crate::builder::border::vertex::{Border, Path};
use crate::builder::cut::split::Chunk;
use crate::builder::stitch::Stitch;
use crate::lattice::Lattice;
use crate::mesh::{
    Material, Mesh, Normal, Part, PositionKey, all_differ, color_key, key, texcoord_key, wide,
};

/// What makes two source vertices one.
type VertexKey = (PositionKey<f64>, u64, u64, u32, Normal);

/// Joins parts into one chunk; vertices that are equal in position, texture coordinate, colour,
/// material and normal become one. Of `between`, those whose edge and apex are there become its stitches.
pub fn gather(materials: &[Material], parts: &[Part], between: &[Stitch]) -> Chunk<f64> {
    let textured = |part: &Part| {
        materials[part.material as usize].texture.is_some() && !part.texcoords.is_empty()
    };
    let any_textured = parts.iter().any(textured);
    let any_colored = parts.iter().any(|part| !part.colors.is_empty());
    let any_normals = parts.iter().any(|part| !part.normals.is_empty());
    let mut mesh = Mesh::<f64>::default();
    let total: usize = parts.iter().map(|part| part.indices.len() / 3).sum();
    mesh.triangles.reserve_exact(total);
    let mut welded: FxHashMap<VertexKey, u32> = FxHashMap::default();
    welded.reserve(total / 2);
    let mut new_index: Vec<u32> = Vec::new();
    for part in parts {
        let has_texcoords = textured(part);
        new_index.clear();
        new_index.extend((0..part.positions.len()).map(|vertex| {
            let position = part.positions[vertex].map(|coordinate| coordinate + 0.0);
            let texcoord = if has_texcoords { part.texcoords[vertex] } else { [0.0; 2] };
            let color = part.colors.get(vertex).copied().unwrap_or([u16::MAX; 4]);
            let normal = part.normals.get(vertex).copied().unwrap_or(Normal::NONE);
            let same =
                (key(position), texcoord_key(texcoord), color_key(color), part.material, normal);
            *welded.entry(same).or_insert_with(|| {
                mesh.positions.push(position);
                if any_textured {
                    mesh.texcoords.push(texcoord);
                }
                if any_colored {
                    mesh.colors.push(color);
                }
                if any_normals {
                    mesh.normals.push(normal);
                }
                mesh.materials.push(part.material);
                mesh.positions.len() as u32 - 1
            })
        }));
        for corners in part.indices.as_chunks::<3>().0 {
            mesh.triangles.push(corners.map(|vertex| new_index[vertex as usize]));
        }
    }
    let stitches = match between.is_empty() {
        true => Vec::new(),
        false => stitched(&mut mesh, between),
    };
    let border = Border::interior(mesh.positions.len());
    Chunk { mesh, border, stitches, ..Chunk::default() }
}

/// The triangles of stitches over a mesh. Each looks like the vertices of its edge: the apex gets a
/// vertex that looks like the nearer of them, where it has none.
fn stitched(mesh: &mut Mesh<f64>, between: &[Stitch]) -> Vec<[u32; 3]> {
    let of_stitch = |stitch: &Stitch| [stitch.edge[0], stitch.edge[1], stitch.apex].map(key);
    let sought: FxHashSet<PositionKey<f64>> = between.iter().flat_map(of_stitch).collect();
    let vertex_key = |mesh: &Mesh<f64>, position: [f64; 3], like: u32| -> VertexKey {
        let like = like as usize;
        let texcoord = mesh.texcoords.get(like).copied().map_or(0, texcoord_key);
        let color = mesh.colors.get(like).copied().map_or(0, color_key);
        // A vertex with any normal will do: stitches are in no leaf.
        (key(position), texcoord, color, mesh.materials[like], Normal::NONE)
    };
    let mut vertices: FxHashMap<VertexKey, u32> = FxHashMap::default();
    let mut found: FxHashSet<PositionKey<f64>> = FxHashSet::default();
    let mut is_there = vec![false; mesh.positions.len()];
    for (vertex, &position) in (0u32..).zip(&mesh.positions) {
        if sought.contains(&key(position)) {
            vertices.entry(vertex_key(mesh, position, vertex)).or_insert(vertex);
            found.insert(key(position));
            is_there[vertex as usize] = true;
        }
    }
    let mut edges: FxHashMap<[PositionKey<f64>; 2], [u32; 2]> = FxHashMap::default();
    for &[a, b, c] in &mesh.triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            if ends.iter().all(|&end| is_there[end as usize]) {
                edges.insert(ends.map(|end| key(mesh.positions[end as usize])), ends);
            }
        }
    }
    let mut stitches = Vec::with_capacity(between.len());
    for stitch in between {
        let Some(&[a, b]) = edges.get(&stitch.edge.map(key)) else { continue };
        if !found.contains(&key(stitch.apex)) {
            continue;
        }
        let apex = wide(stitch.apex);
        let [from_a, from_b] = stitch.edge.map(|end| wide(end).distance_squared(apex));
        let like = if from_a <= from_b { a } else { b };
        let apex = *vertices.entry(vertex_key(mesh, stitch.apex, like)).or_insert_with(|| {
            let vertex = mesh.push_copy(like as usize);
            mesh.positions[vertex as usize] = stitch.apex;
            vertex
        });
        stitches.push([b, a, apex]);
    }
    stitches
}

/// Brings a chunk to its block's origin and lattice; triangles that collapse on the lattice are
/// dropped and counted. Where `follow` says so, the chunk remembers how far vertices were moved.
pub fn localise(
    chunk: Chunk<f64>,
    origin: [f64; 3],
    lattice: Lattice,
    follow: bool,
) -> (Chunk, u64) {
    let local = |position: [f64; 3]| -> [f32; 3] {
        std::array::from_fn(|i| lattice.offset(position[i], origin[i]) + 0.0)
    };
    let Chunk { mesh, border, path: wide_path, mut stitches, moved } = chunk;
    let moved = follow.then(|| {
        let off = |p: &[f64; 3]| {
            p.map(|c| (lattice.round(c) - c).powi(2)).iter().sum::<f64>().sqrt() as f32
        };
        let before = moved.into_iter().flatten().chain(std::iter::repeat(0.0));
        mesh.positions.iter().zip(before).map(|(at, before)| (before + off(at)).next_up()).collect()
    });
    let mut mesh = Mesh {
        positions: mesh.positions.iter().map(|&position| local(position)).collect(),
        texcoords: mesh.texcoords,
        colors: mesh.colors,
        normals: mesh.normals,
        materials: mesh.materials,
        triangles: mesh.triangles,
    };
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    let is_one = |corners: &[u32; 3]| all_differ(corners.map(|vertex| positions[vertex as usize]));
    mesh.triangles.retain(is_one);
    stitches.retain(is_one);
    let dropped = (before - mesh.triangles.len()) as u64;
    let mut path = Path::default();
    for bit in 0..wide_path.len() as u32 {
        let plane = wide_path.plane(bit);
        let chains = plane
            .chains
            .iter()
            .map(|chain| Chain {
                positions: chain.positions.iter().map(|&position| local(position)).collect(),
                keep: chain.keep.clone(),
            })
            .collect();
        let coordinate = lattice.offset(plane.coordinate, origin[plane.axis]);
        path = path.with(Arc::new(CutPlane::from_chains(plane.axis, coordinate, chains)));
    }
    (Chunk { mesh, border, path, stitches, moved }, dropped)
}
