//! Gathering a block's geometry from the parts of a model: welded, in f64, then on its lattice.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::blocks::Division;
use super::border::{Border, Path};
use super::chain::{Chain, CutPlane, KeepRule};
use super::cut::{Cut, CutTolerance, Piece, cut};
use super::cut_axis::axis_to_cut;
use super::lattice::Lattice;
use super::quantize::Quantization;
use super::stages::{Stage, Stages};
use super::whole::WholeBodies;
use crate::mesh::{Material, Mesh, Part, PositionKey, all_differ, color_key, key, texcoord_key};

/// What makes two source vertices one.
type VertexKey = (PositionKey<f64>, u64, u64, u32);

/// Joins parts into one piece; vertices that are equal in position, texture coordinate, colour
/// and material become one.
pub fn gather(materials: &[Material], parts: &[Part]) -> Piece<f64> {
    let textured = |part: &Part| {
        materials[part.material as usize].texture.is_some() && !part.texcoords.is_empty()
    };
    let any_textured = parts.iter().any(textured);
    let any_colored = parts.iter().any(|part| !part.colors.is_empty());
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
            let same = (key(position), texcoord_key(texcoord), color_key(color), part.material);
            *welded.entry(same).or_insert_with(|| {
                mesh.positions.push(position);
                if any_textured {
                    mesh.texcoords.push(texcoord);
                }
                if any_colored {
                    mesh.colors.push(color);
                }
                mesh.materials.push(part.material);
                mesh.positions.len() as u32 - 1
            })
        }));
        for corners in part.indices.as_chunks::<3>().0 {
            mesh.triangles.push(corners.map(|vertex| new_index[vertex as usize]));
        }
    }
    let border = Border::interior(mesh.positions.len());
    Piece { mesh, border, ..Piece::default() }
}

/// Cuts a gathered piece into the blocks of a [`Division`], in a fixed order.
pub fn divide(
    piece: Piece<f64>,
    division: Division,
    shares: &[f64],
    quantization: Option<Quantization>,
    stages: &Stages,
) -> Vec<Piece<f64>> {
    let lattice = quantization.map(|Quantization { step }| Lattice { step });
    let rule =
        KeepRule { shares: shares.to_vec(), most: Vec::new(), first_level: 0, collinear: 0.0 };
    let mut done = Vec::new();
    match division {
        Division::Whole => done.push(piece),
        Division::Halves { most } => return halves(piece, most, &rule, lattice, stages),
        Division::Grid { metres, axes } => {
            let mut stack = vec![piece];
            while let Some(piece) = stack.pop() {
                match grid_line(&piece.mesh, metres, axes).filter(|_| piece.path.len() < 40) {
                    None => done.push(piece),
                    Some((axis, line)) => {
                        let (below, above) = stages.time(Stage::Gather, || {
                            cut_at(piece, axis, line, WholeBodies::default(), &rule, lattice)
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

/// A separate body with more than this share of a block's triangles is cut.
const BODIES_PER_BLOCK: usize = 32;

/// Halves a piece ([`super::cut_axis`]) until no part of it has more than `most` triangles.
fn halves(
    piece: Piece<f64>,
    most: usize,
    rule: &KeepRule,
    lattice: Option<Lattice>,
    stages: &Stages,
) -> Vec<Piece<f64>> {
    let triangles = piece.mesh.triangles.len();
    if triangles == 0 {
        return Vec::new();
    }
    let Some((low, high)) = piece.mesh.bounds().filter(|_| triangles > most) else {
        return vec![piece];
    };
    let middle = |axis: usize| {
        let middle = median_of_triangles(&piece.mesh, axis);
        lattice.map_or(middle, |lattice| lattice.round(middle))
    };
    let axis =
        stages.time(Stage::Gather, || axis_to_cut(&piece.mesh, |axis| vec![middle(axis)], 0.0));
    let Some(axis) = axis else { return vec![piece] };
    let middle = middle(axis);
    if !(middle > low[axis] && middle < high[axis]) || piece.path.len() >= 12 {
        return vec![piece];
    }
    let whole = WholeBodies::in_slabs((high[axis] - low[axis]) * 0.5, most / BODIES_PER_BLOCK);
    let (below, above) =
        stages.time(Stage::Gather, || cut_at(piece, axis, middle, whole, rule, lattice));
    let (mut done, above) = rayon::join(
        || halves(below, most, rule, lattice, stages),
        || halves(above, most, rule, lattice, stages),
    );
    done.extend(above);
    done
}

fn cut_at(
    piece: Piece<f64>,
    axis: usize,
    at: f64,
    whole: WholeBodies,
    rule: &KeepRule,
    lattice: Option<Lattice>,
) -> (Piece<f64>, Piece<f64>) {
    // As within blocks, where the lattice shows: source vertices that the plane runs through are on
    // it, and what meets when it is rounded meets here.
    let coordinate = lattice.map_or(at, |lattice| lattice.round(at));
    let tolerance = CutTolerance { sliver_steps: 1.0, ..CutTolerance::default() };
    cut(piece, &Cut { axis, coordinate, lattice, tolerance, whole, rule })
}

/// The coordinate that halves the triangles by their centres.
fn median_of_triangles(mesh: &Mesh<f64>, axis: usize) -> f64 {
    let mut centres: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| t.iter().map(|&v| mesh.positions[v as usize][axis]).sum::<f64>() / 3.0)
        .collect();
    let middle = centres.len() / 2;
    *centres.select_nth_unstable_by(middle, f64::total_cmp).1
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

/// Brings a piece to its block's origin and lattice; triangles that collapse on the lattice are
/// dropped and counted. Where `follow` says so, the piece remembers how far vertices were moved.
pub fn localise(
    piece: Piece<f64>,
    origin: [f64; 3],
    lattice: Lattice,
    follow: bool,
) -> (Piece, u64) {
    let local = |position: [f64; 3]| -> [f32; 3] {
        std::array::from_fn(|i| lattice.offset(position[i], origin[i]) + 0.0)
    };
    let Piece { mesh, border, path: wide_path, moved } = piece;
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
        materials: mesh.materials,
        triangles: mesh.triangles,
    };
    let before = mesh.triangles.len();
    let positions = &mesh.positions;
    mesh.triangles.retain(|corners| all_differ(corners.map(|vertex| positions[vertex as usize])));
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
    (Piece { mesh, border, path, moved }, dropped)
}
