//! Meshes and a sink in memory for the tests of the build.
#![allow(dead_code)]

pub mod rays;

use std::sync::Mutex;

use hlod::builder::border::vertex::Border;
use hlod::builder::constants::{Constants, OutlineConstants};
use hlod::builder::cut::split::Chunk;
use hlod::builder::hierarchy::{
    BlockBuilder, Forest, HierarchyOptions, NodeDraft, NodeSink, Resolutions,
};
use hlod::builder::simplify::Extrudable;
use hlod::builder::simplify::simplified::LadderStep;
use hlod::lattice::Lattice;
use hlod::mesh::{Mesh, PositionKey, key};
pub use hlod::random::Random;
use hlod::texture::BakePlan;

/// A closed surface: a cube's faces as grids of `n` by `n` quads, each vertex where `place` puts
/// its grid point, whose coordinates run from -1 to 1.
fn blown_up(n: usize, mut place: impl FnMut(glam::DVec3) -> glam::DVec3) -> Mesh<f64> {
    let mut mesh = Mesh::<f64>::default();
    let mut numbers = std::collections::BTreeMap::new();
    for face in 0..6 {
        let axis = face / 2;
        let sign = if face % 2 == 0 { 1i64 } else { -1 };
        let m = n as i64;
        for i in 0..n as i64 {
            for j in 0..n as i64 {
                let corner = |di: i64, dj: i64| {
                    let mut at = [0i64; 3];
                    at[axis] = sign * m;
                    at[(axis + 1) % 3] = 2 * (i + di) - m;
                    at[(axis + 2) % 3] = 2 * (j + dj) - m;
                    at
                };
                let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let mut index = |at: [i64; 3]| {
                    *numbers.entry(at).or_insert_with(|| {
                        let p = glam::DVec3::from(at.map(|coordinate| coordinate as f64));
                        mesh.positions.push(place(p / n as f64).into());
                        mesh.materials.push(0);
                        mesh.positions.len() as u32 - 1
                    })
                };
                let [a, b, c, d] = quad.map(&mut index);
                let (t1, t2) = ([a, b, c], [a, c, d]);
                for t in [t1, t2] {
                    mesh.triangles.push(if sign > 0 { t } else { [t[0], t[2], t[1]] });
                }
            }
        }
    }
    mesh
}

/// A closed bumpy ball: a cube's faces as grids of `n` by `n` quads, blown up.
pub fn ball(n: usize, radius: f64, bump: f64, seed: u64) -> Mesh<f64> {
    let mut random = Random::new(seed, 0);
    blown_up(n, |p| p.normalize() * radius * (1.0 + bump * (random.unit() - 0.5)))
}

/// A closed bumpy slab, like a chunk of ground with its underside.
pub fn slab(n: usize, half_size: [f64; 3], bump: f64, seed: u64) -> Mesh<f64> {
    let mut random = Random::new(seed, 0);
    blown_up(n, |p| {
        let noise: [f64; 3] = std::array::from_fn(|_| bump * (random.unit() - 0.5));
        p * glam::DVec3::from(half_size) + glam::DVec3::from(noise)
    })
}

/// An open, textured, bumpy wall of `n` by `m` quads, two charts side by side, with holes.
pub fn wall(n: usize, m: usize, seed: u64) -> Mesh<f64> {
    let mut random = Random::new(seed, 0);
    let heights: Vec<f64> = (0..(n + 1) * (m + 1)).map(|_| random.unit() * 0.03).collect();
    let mut mesh = Mesh::<f64>::default();
    for chart in 0..2 {
        let (from, to) = if chart == 0 { (0, n / 2) } else { (n / 2, n) };
        let first = mesh.positions.len() as u32;
        for i in from..=to {
            for j in 0..=m {
                mesh.positions.push([i as f64 * 0.1, heights[i * (m + 1) + j], j as f64 * 0.1]);
                let u = (i - from) as f32 / n as f32 + 0.5 * chart as f32;
                mesh.texcoords.push([u, 1.0 - j as f32 / m as f32]);
                mesh.materials.push(0);
            }
        }
        for i in 0..to - from {
            for j in 0..m {
                let at = |i: usize, j: usize| first + (i * (m + 1) + j) as u32;
                if random.unit() < 0.01 {
                    continue;
                }
                mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    mesh
}

/// An open sheet of `n` by `n` quads of 0.1 m, as bumpy as hills: every upright line meets it once.
pub fn hills(n: usize, seed: u64) -> Mesh<f64> {
    let mut random = Random::new(seed, 0);
    let mut mesh = Mesh::<f64>::default();
    for i in 0..=n {
        for j in 0..=n {
            let [x, y] = [i, j].map(|at| at as f64 * 0.1);
            let z = 0.6 * (1.3 * x).sin() * (0.9 * y).cos() + 0.06 * random.unit();
            mesh.positions.push([x, y, z]);
            mesh.materials.push(0);
        }
    }
    for i in 0..n {
        for j in 0..n {
            let [a, b] = [i * (n + 1) + j, (i + 1) * (n + 1) + j].map(|at| at as u32);
            mesh.triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    mesh
}

/// The mesh with a texture in charts by where triangles lie, squares of `side` on the least inclined
/// plane; each chart of one of `materials` materials. Vertices between charts are there twice.
pub fn in_charts(mesh: &Mesh<f64>, side: f64, materials: u32) -> Mesh<f64> {
    let mut result = Mesh::<f64>::default();
    let mut numbers = std::collections::BTreeMap::new();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| glam::DVec3::from(mesh.positions[vertex as usize]));
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).to_array();
        let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap();
        let along = [(axis + 1) % 3, (axis + 2) % 3];
        let middle = corners.iter().sum::<glam::DVec3>() / 3.0;
        let square = along.map(|axis| (middle[axis] / side).floor() as i64);
        let chart = (axis, normal[axis] > 0.0, square);
        let material = (axis as i64 + square[0] + square[1]).rem_euclid(materials.into()) as u32;
        result.triangles.push(triangle.map(|vertex| {
            *numbers.entry((vertex, chart)).or_insert_with(|| {
                let position = mesh.positions[vertex as usize];
                result.positions.push(position);
                result.texcoords.push(along.map(|axis| (position[axis] / 64.0 + 0.5) as f32));
                result.materials.push(material);
                result.positions.len() as u32 - 1
            })
        }));
    }
    result
}

/// A gathered mesh as a block at the origin.
pub fn block(mesh: Mesh<f64>) -> (Chunk, Lattice) {
    let (low, high) = mesh.bounds().unwrap();
    let extent = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
    let lattice = Lattice::for_extent(extent, extent);
    let border = Border::interior(mesh.positions.len());
    let chunk = Chunk { mesh, border, ..Chunk::default() };
    (hlod::builder::gather::localise(chunk, [0.0; 3], lattice, false).0, lattice)
}

/// A node as the sink saw it.
#[derive(Clone, Debug)]
pub struct WrittenNode {
    pub mesh: Mesh,
    pub skirts: Vec<hlod::builder::border::skirt::Skirt>,
    pub level: usize,
    pub child_path: Vec<u32>,
    pub budget: usize,
    pub error: f64,
    pub step: LadderStep,
    pub locked: usize,
}

impl WrittenNode {
    pub fn is_leaf(&self) -> bool {
        self.step == LadderStep::Original
    }
}

/// The nodes of a level and the leaves above it.
pub fn at_level(nodes: &[WrittenNode], level: usize) -> Vec<&WrittenNode> {
    let of = |node: &&WrittenNode| node.level == level || node.level < level && node.is_leaf();
    nodes.iter().filter(of).collect()
}

/// Every coarse node is written with its own budget, however little it keeps of its source's outline.
pub fn all_nodes() -> Constants {
    let outline = OutlineConstants { least_kept: 0.0, ..Default::default() };
    Constants { outline, ..Default::default() }
}

/// Keeps all nodes.
#[derive(Default)]
pub struct MemorySink(pub Mutex<Vec<WrittenNode>>);

impl NodeSink for MemorySink {
    type Record = ();

    fn take(&self, node: &NodeDraft) -> hlod::Result<()> {
        self.0.lock().unwrap().push(WrittenNode {
            mesh: node.mesh.clone(),
            skirts: node.skirts.to_vec(),
            level: node.level(),
            child_path: node.child_path.to_vec(),
            budget: node.budget,
            error: node.error.bound,
            step: node.step,
            locked: node.locked,
        });
        Ok(())
    }
}

/// Builds a block in memory; nodes sorted by level and place.
pub fn build(chunk: Chunk, lattice: Lattice, options: &HierarchyOptions) -> Vec<WrittenNode> {
    build_baked(chunk, lattice, options, None)
}

/// Builds a block in memory whose coarse nodes are given textures of their own as `bake` says.
pub fn build_baked(
    chunk: Chunk,
    lattice: Lattice,
    options: &HierarchyOptions,
    bake: Option<BakePlan>,
) -> Vec<WrittenNode> {
    let sink = MemorySink::default();
    let builder = BlockBuilder {
        options,
        resolutions: Resolutions::new(chunk.mesh.triangles.len(), options),
        bake,
        lattice,
        quantization: None,
        up: hlod::mesh::UpAxis::Z,
        reorientable: &[true; 8],
        alpha: &[],
        repeats: Vec::new(),
        extrudable: &Extrudable::default(),
        sink: &sink,
        stages: &Default::default(),
    };
    let _forest: Forest<()> = builder.build(chunk).unwrap();
    let mut nodes = sink.0.into_inner().unwrap();
    nodes.sort_by(|a, b| (a.level, &a.child_path).cmp(&(b.level, &b.child_path)));
    nodes
}

/// Uses of each edge by position; an edge is its two ends in key order.
pub fn edge_uses<'a>(
    meshes: impl IntoIterator<Item = &'a Mesh>,
) -> std::collections::BTreeMap<[PositionKey<f32>; 2], u32> {
    let mut uses = std::collections::BTreeMap::new();
    for mesh in meshes {
        for &[a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let mut ends = [from, to].map(|v| key(mesh.positions[v as usize]));
                ends.sort();
                *uses.entry(ends).or_insert(0) += 1;
            }
        }
    }
    uses
}

/// Edges that are not used an even number of times.
pub fn odd_edges<'a>(meshes: impl IntoIterator<Item = &'a Mesh>) -> usize {
    edge_uses(meshes).values().filter(|&&uses| uses % 2 == 1).count()
}
