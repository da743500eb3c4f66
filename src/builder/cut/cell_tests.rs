//! Blocks that are cut each by itself are together what was there, and meet.

use std::collections::BTreeMap;

use super::cell::CellCut;
use super::section::Triangle;
use crate::builder::border::chain::KeepRule;
use crate::builder::constants::BorderConstants;
use crate::builder::cut::face::{FaceBorder, SideTriangle};
use crate::builder::partition::{BlockSplit, CellBox, Most, Partition, Scan};
use crate::lattice::Lattice;
use crate::mesh::{Model, Part, PositionKey, UpAxis, key, wide};
use crate::random::Random;

fn model(positions: Vec<[f64; 3]>, indices: Vec<u32>) -> Model {
    Model::of_parts(vec![Part { positions, indices, ..Part::default() }])
}

/// Hills over a square, their vertices moved at random and some of them onto round coordinates.
fn hills(count: u32, side: f64, at: [f64; 3], lattice: Lattice, seed: u64) -> Model {
    let mut random = Random::new(seed, 0);
    let mut positions = Vec::new();
    for row in 0..=count {
        for column in 0..=count {
            let step = side / f64::from(count);
            let mut place = [f64::from(column) * step, f64::from(row) * step, 0.0];
            if random.unit() > 0.2 {
                place[0] += random.between(-0.4, 0.4) * step;
                place[1] += random.between(-0.4, 0.4) * step;
            }
            place[2] = 5.0 * (place[0] * 0.1).sin() * (place[1] * 0.07).cos();
            positions.push(std::array::from_fn(|axis| lattice.round(place[axis] + at[axis])));
        }
    }
    let mut indices = Vec::new();
    for row in 0..count {
        for column in 0..count {
            let a = row * (count + 1) + column;
            let [b, c, d] = [a + 1, a + count + 1, a + count + 2];
            indices.extend([a, b, d, a, d, c]);
        }
    }
    model(positions, indices)
}

/// Long triangles in all directions.
fn soup(count: u32, side: f64, lattice: Lattice, seed: u64) -> Model {
    let mut random = Random::new(seed, 0);
    let mut point =
        || -> [f64; 3] { std::array::from_fn(|_| lattice.round(random.between(-side, side))) };
    let positions = (0..3 * count).map(|_| point()).collect();
    model(positions, (0..3 * count).collect())
}

/// The pieces of all triangles in each block.
struct Cut {
    partition: Partition,
    pieces: BTreeMap<u32, Vec<[[f64; 3]; 3]>>,
    lattice: Lattice,
}

fn cut(model: &Model, most: u64, lattice: Lattice) -> Cut {
    let clusters = Scan::of(model, &[], 1.0).clusters;
    let most = Most { triangles: most, texels: f64::INFINITY };
    let partition = Partition::new(clusters, BlockSplit::Auto, most, UpAxis::Z);
    let mut pieces: BTreeMap<u32, Vec<[[f64; 3]; 3]>> = BTreeMap::new();
    let part = &model.parts[0];
    for block in partition.blocks() {
        let cell = CellCut::new(&partition, block);
        for corners in part.indices.as_chunks::<3>().0 {
            let corners = corners.map(|vertex| part.positions[vertex as usize]);
            let piece = cell.piece(&Triangle { corners, lattice });
            pieces.entry(block).or_default().extend(
                piece.triangles.iter().map(|t| t.map(|at| piece.places[at as usize].position)),
            );
        }
    }
    Cut { partition, pieces, lattice }
}

fn area(corners: [[f64; 3]; 3]) -> f64 {
    let [a, b, c] = corners.map(wide);
    (b - a).cross(c - a).length() * 0.5
}

/// The edges that an odd number of triangles has.
fn open_edges(triangles: impl Iterator<Item = [[f64; 3]; 3]>) -> Vec<[PositionKey<f64>; 2]> {
    let mut uses: BTreeMap<[PositionKey<f64>; 2], u32> = BTreeMap::new();
    for [a, b, c] in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]].map(|ends| ends.map(key)) {
            *uses.entry([from.min(to), from.max(to)]).or_default() += 1;
        }
    }
    uses.into_iter().filter(|(_, uses)| uses % 2 == 1).map(|(edge, _)| edge).collect()
}

#[test]
fn pieces_of_all_blocks_are_the_whole_and_meet_without_a_gap() {
    let place = [678_016.0, 5_403_456.0, 300.0];
    for (seed, step) in [(1, 1e-9), (2, 0.0625), (3, 1e-9), (4, 0.125)] {
        let lattice = Lattice { step: f64::max(step, 2f64.powi(-28)) };
        for at in [[-31.0, -17.0, 2.0], place] {
            let model = hills(24, 64.0, at, lattice, seed);
            let whole: Vec<[[f64; 3]; 3]> = model.parts[0]
                .indices
                .as_chunks::<3>()
                .0
                .iter()
                .map(|t| t.map(|vertex| model.parts[0].positions[vertex as usize]))
                .collect();
            let Cut { partition, pieces, .. } = cut(&model, 60, lattice);
            assert!(partition.blocks().len() > 12, "{}", partition.blocks().len());
            let all = || pieces.values().flatten().copied();
            let (before, after): (f64, f64) =
                (whole.iter().map(|t| area(*t)).sum(), all().map(area).sum());
            // Rounded, a surface is a little larger or smaller.
            let most = 1e-9 + 0.5 * lattice.step;
            assert!((after / before - 1.0).abs() < most, "{seed} {step}: {before} {after}");
            // Open edges lie on the border of the whole mesh, which cuts divide.
            let of_whole = open_edges(whole.into_iter());
            let on_border: Vec<PositionKey<f64>> = of_whole.iter().flatten().copied().collect();
            let open = open_edges(all());
            let corners = open.iter().flatten().filter(|at| on_border.contains(at)).count();
            assert_eq!(corners, on_border.len(), "{seed} {step}: each border vertex twice");
            assert!(open.len() >= of_whole.len());
            let more = open.len() - of_whole.len();
            assert!(more <= 4 * 24, "{seed} {step}: {more} more open edges");
        }
    }
}

#[test]
fn pieces_lie_within_their_blocks_and_keep_their_facing() {
    let lattice = Lattice { step: 2f64.powi(-20) };
    let model = soup(60, 40.0, lattice, 7);
    let Cut { partition, pieces, .. } = cut(&model, 8, lattice);
    let sum: f64 = pieces.values().flatten().map(|t| area(*t)).sum();
    let part = &model.parts[0];
    let whole: f64 = part
        .indices
        .as_chunks::<3>()
        .0
        .iter()
        .map(|t| area(t.map(|vertex| part.positions[vertex as usize])))
        .sum();
    assert!((sum / whole - 1.0).abs() < 1e-6, "{sum} {whole}");
    for (block, pieces) in &pieces {
        let CellBox { low, high } = partition.cell(*block).place;
        for at in pieces.as_flattened() {
            assert!((0..3).all(|i| low[i] <= at[i] && at[i] <= high[i]), "{at:?}");
        }
    }
}

#[test]
fn what_lies_in_a_plane_is_of_one_block() {
    let lattice = Lattice { step: 2f64.powi(-10) };
    // Upright squares in planes that are likely to divide, and something on both sides.
    let mut positions = Vec::new();
    for x in [-4.0, -2.0, 0.0, 2.0, 4.0] {
        positions.extend([[x, 0.0, 0.0], [x, 3.0, 0.0], [x, 3.0, 3.0], [x, 0.0, 3.0]]);
    }
    let squares = 0..5u32;
    let indices = squares.flat_map(|n| [0, 1, 2, 0, 2, 3].map(|corner| 4 * n + corner)).collect();
    let model = model(positions, indices);
    let Cut { partition, pieces, .. } = cut(&model, 2, lattice);
    assert!(partition.blocks().len() >= 3);
    let sum: f64 = pieces.values().flatten().map(|t| area(*t)).sum();
    assert_eq!(sum, 45.0);
}

/// The borders of two blocks that have a side in common, as each finds them.
#[test]
fn both_sides_rank_their_border_alike() {
    let mut compared = 0;
    for seed in 1..9 {
        let lattice = Lattice { step: if seed % 2 == 0 { 2f64.powi(-24) } else { 0.03125 } };
        let model = hills(20, 50.0, [-20.0, 7.0, 0.0], lattice, seed);
        let Cut { partition, lattice, .. } = cut(&model, 90, lattice);
        let part = &model.parts[0];
        let rule = KeepRule {
            shares: vec![0.25, 0.5, 1.0],
            most: Vec::new(),
            first_level: 0,
            collinear: 0.0,
            baked: None,
            constants: BorderConstants::default(),
        };
        // Each block has the triangles that meet it, in an order of its own.
        let triangles = |block: u32| -> Vec<SideTriangle> {
            let place = partition.cell(block).place;
            let mut own: Vec<SideTriangle> = part
                .indices
                .as_chunks::<3>()
                .0
                .iter()
                .filter(|corners| {
                    let own = CellBox::around(corners.map(|at| part.positions[at as usize]));
                    (0..3).all(|i| own.low[i] <= place.high[i] && place.low[i] <= own.high[i])
                })
                .map(|corners| SideTriangle::new(part, *corners, lattice))
                .collect();
            if block.is_multiple_of(2) {
                own.reverse();
            }
            own
        };
        let chains = |block: u32, axis: usize, upper: bool, patch: &CellBox| {
            let cut = CellCut::new(&partition, block);
            let side = cut.sides().iter().find(|s| s.plane.axis == axis && s.is_upper == upper);
            let face = FaceBorder::new(side.unwrap(), &triangles(block), &rule);
            let inside =
                |at: &[f64; 3]| (0..3).all(|i| patch.low[i] <= at[i] && at[i] <= patch.high[i]);
            let chains = face.plane.chains.iter();
            chains
                .filter(|chain| chain.positions.iter().all(inside))
                .map(|chain| (chain.positions.clone(), chain.keep.clone()))
                .collect::<Vec<_>>()
        };
        for block in partition.blocks() {
            for (axis, upper) in [(0, true), (1, true)] {
                for other in partition.beyond(block, axis, upper) {
                    let at = partition.cell(block).place.side(axis, upper);
                    let [one, two] = [block, other].map(|block| partition.cell(block).place);
                    let mut patch = CellBox {
                        low: std::array::from_fn(|i| one.low[i].max(two.low[i])),
                        high: std::array::from_fn(|i| one.high[i].min(two.high[i])),
                    };
                    (patch.low[axis], patch.high[axis]) = (at, at);
                    let sides =
                        [chains(block, axis, upper, &patch), chains(other, axis, !upper, &patch)];
                    assert_eq!(sides[0], sides[1], "seed {seed}, {block} and {other}");
                    compared += sides[0].len();
                }
            }
        }
    }
    assert!(compared > 100, "{compared}");
}
