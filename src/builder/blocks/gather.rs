//! Gathering a block's geometry from the parts of a model: welded, in f64, then on its lattice.

use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::blocks::block_plan::{BlockSize, Division};
use crate::builder::border::chain::{Chain, CutPlane, KeepRule};
use crate::builder::border::vertex::{Border, Path};
use crate::builder::constants::Constants;
use crate::builder::cut::plane::{Region, best_plane};
use crate::builder::cut::split::{Chunk, Cut, CutTolerance, cut};
use crate::builder::cut::uncut::UncutComponents;
use crate::builder::simplify::aggregate::BodyRules;
use crate::builder::stages::{Stage, Stages};
use crate::builder::stitch::Stitch;
use crate::lattice::Lattice;
use crate::lattice::Quantization;
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

/// Cuts a gathered chunk into the blocks of a [`Division`], in a fixed order.
pub fn divide(
    chunk: Chunk<f64>,
    division: Division,
    shares: &[f64],
    quantization: Option<Quantization>,
    constants: &Constants,
    rules: &BodyRules,
    stages: &Stages,
) -> Vec<Chunk<f64>> {
    let lattice = quantization.map(|Quantization { step }| Lattice { step });
    let rule = KeepRule {
        shares: shares.to_vec(),
        most: Vec::new(),
        first_level: 0,
        collinear: 0.0,
        baked: None,
        constants: constants.border,
    };
    let mut done = Vec::new();
    match division {
        Division::Whole => done.push(chunk),
        Division::Halves(most) => {
            let halving = Halving { most, keep: &rule, lattice, constants, rules, stages };
            return halving.halves(chunk);
        }
        Division::Grid { metres, axes } => {
            let mut stack = vec![chunk];
            while let Some(chunk) = stack.pop() {
                match grid_line(&chunk.mesh, metres, axes).filter(|_| chunk.path.len() < 40) {
                    None => done.push(chunk),
                    Some((axis, line)) => {
                        let (below, above) = stages.time(Stage::Gather, || {
                            cut_at(chunk, axis, line, UncutComponents::default(), &rule, lattice)
                        });
                        if below.mesh.triangles.is_empty() || above.mesh.triangles.is_empty() {
                            // Everything was on one side but for a vertex within tolerance.
                            done.extend(
                                [below, above].into_iter().filter(|p| !p.mesh.triangles.is_empty()),
                            );
                        } else {
                            stack.extend([above, below]);
                        }
                    }
                }
            }
        }
    }
    done
}

/// How chunks are halved.
struct Halving<'a> {
    most: BlockSize,
    keep: &'a KeepRule<'a>,
    lattice: Option<Lattice>,
    constants: &'a Constants,
    rules: &'a BodyRules<'a>,
    stages: &'a Stages,
}

impl Halving<'_> {
    /// Halves a chunk ([`crate::builder::cut::axis`]) until no part of it is too large.
    fn halves(&self, chunk: Chunk<f64>) -> Vec<Chunk<f64>> {
        let &Self { most, lattice, constants, stages, .. } = self;
        if chunk.mesh.triangles.is_empty() {
            return Vec::new();
        }
        let is_too_large = || stages.time(Stage::Gather, || self.is_too_large(&chunk.mesh));
        let Some((low, high)) = chunk.mesh.bounds().filter(|_| is_too_large()) else {
            return vec![chunk];
        };
        let region = Region { low, high, share: 0.5, touching: 0.0 };
        let plane = stages.time(Stage::Gather, || best_plane(&chunk.mesh, &region, &constants.cut));
        let plane = plane.filter(|_| chunk.path.len() < MOST_HALVINGS);
        let Some((axis, middle)) = plane else { return vec![chunk] };
        let middle = lattice.map_or(middle, |lattice| lattice.round(middle));
        let width = (high[axis] - low[axis]) * 0.5;
        let uncut = most.triangles / constants.blocks.uncut;
        let whole = UncutComponents::in_slabs(width, uncut, &constants.cut);
        let (below, above) =
            stages.time(Stage::Gather, || cut_at(chunk, axis, middle, whole, self.keep, lattice));
        let (mut done, above) = rayon::join(|| self.halves(below), || self.halves(above));
        done.extend(above);
        done
    }

    fn is_too_large(&self, mesh: &Mesh<f64>) -> bool {
        let triangles = mesh.triangles.len();
        let count = || self.rules.crowd(mesh);
        triangles > self.most.triangles
            || triangles > self.most.bodies && count() > self.most.bodies
    }
}

/// A block is not halved more often.
const MOST_HALVINGS: usize = 12;

fn cut_at(
    chunk: Chunk<f64>,
    axis: usize,
    at: f64,
    whole: UncutComponents,
    rule: &KeepRule,
    lattice: Option<Lattice>,
) -> (Chunk<f64>, Chunk<f64>) {
    // As within blocks, where the lattice shows: source vertices that the plane runs through are on
    // it, and what meets when it is rounded meets here.
    let coordinate = lattice.map_or(at, |lattice| lattice.round(at));
    let tolerance = CutTolerance { sliver_steps: 1.0, ..CutTolerance::default() };
    cut(chunk, &Cut { axis, coordinate, lattice, tolerance, whole, rule })
}

/// The grid line nearest to the middle of the longer of the two sides that spans several squares.
/// What reaches less than a hundredth of a square beyond a line counts as within it.
fn grid_line(mesh: &Mesh<f64>, metres: f64, axes: [usize; 2]) -> Option<(usize, f64)> {
    let (low, high) = mesh.bounds()?;
    let slack = metres * 0.01;
    let squares = |axis: usize| {
        let first = ((low[axis] + slack) / metres).floor();
        let last = ((high[axis] - slack) / metres).ceil();
        (first, (last - first).max(1.0))
    };
    let axis = if squares(axes[0]).1 >= squares(axes[1]).1 { axes[0] } else { axes[1] };
    let (first, count) = squares(axis);
    (count > 1.0).then(|| (axis, (first + (count / 2.0).floor()) * metres))
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
