//! What two inputs have in common, and what becomes of it on coarse levels.
//!
//! Vertices of two inputs that are nearest to each other within [`NEAR`] are one vertex. Each input
//! keeps its own position of it: nothing moves, and both do the same with it at every level, so that a
//! gap between them stays as wide as in the source.
//!
//! Where both end in a plane across an axis, one on either side, as tiles do, they are as if a cut had
//! divided them there ([`CutPlane`]): what is kept is decided once for both. All else that they have in
//! common stays at every level, as between blocks ([`crate::builder::border::shared`]).

use std::sync::Arc;

use glam::DVec3;
use rustc_hash::FxHashMap;

use super::rim::{BoundingBox, Keep, Rim};
use crate::builder::border::chain::{BorderVertex, Chain, CutPlane, KeepRule};
use crate::builder::border::rank::SurfaceQuadric;
use crate::builder::constants::BorderConstants;
use crate::builder::stitch::OpenEdge;
use crate::lattice::Lattice;
use crate::mesh::{Coordinate, NEAR, NearVertices, PositionKey, key, wide};

/// What the digits of text may leave of a plane that a source was cut along, metres.
pub const WRITTEN: f64 = 0.0005;

/// Least share of the length of what two inputs have in common that is in a plane between them.
const LEAST_IN_PLANE: f64 = 0.25;

/// Least share of the length of edges in a plane at which the surface is on the input's side of it.
const LEAST_ON_SIDE: f64 = 0.9;

/// What one of two inputs has in common with the other.
#[derive(Clone, Debug, Default)]
pub struct Share {
    /// Where it ends in planes across axes.
    pub planes: Vec<Arc<CutPlane<f64>>>,
    /// Vertices that stay at every level, in the order of the first input's.
    pub kept: Vec<[f64; 3]>,
}

impl Share {
    /// Whether they have nothing in common.
    pub fn is_empty(&self) -> bool {
        self.planes.is_empty() && self.kept.is_empty()
    }

    /// A hash of all of it.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for plane in &self.planes {
            hasher.update(&(plane.axis as u64).to_le_bytes());
            hasher.update(&plane.coordinate.bits().to_le_bytes());
            for chain in &plane.chains {
                hasher.update(&(chain.keep.len() as u64).to_le_bytes());
                let bits = chain.positions.as_flattened().iter().map(|at| at.bits().to_le_bytes());
                bits.for_each(|bits| {
                    hasher.update(&bits);
                });
                hasher.update(&chain.keep);
            }
        }
        for at in self.kept.as_flattened() {
            hasher.update(&at.bits().to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

/// The border vertices of both, as one.
struct Common<'a> {
    rims: [&'a Rim; 2],
    /// Numbers of each side's vertices.
    numbers: [FxHashMap<PositionKey<f64>, u32>; 2],
    /// Where each side has a vertex; the other's where it has none.
    positions: Vec<[[f64; 3]; 2]>,
    /// Both sides have it.
    is_common: Vec<bool>,
    /// A third input has it too.
    of_third: Vec<bool>,
    /// The farthest that a vertex of one is from that of the other.
    apart: f64,
}

/// An edge of one side.
struct Edge<'a> {
    side: usize,
    ends: [u32; 2],
    open: &'a OpenEdge,
}

/// What two inputs have in common, and with others that are near to both.
pub fn shares(rims: [&Rim; 2], thirds: &[&Rim], constants: BorderConstants) -> [Share; 2] {
    let Some(common) = Common::new(rims, thirds) else { return Default::default() };
    let rule = keep_rule(rims, constants);
    let edges = common.edges();
    let planes: Vec<Plane> = (0..3).filter_map(|axis| common.plane(axis, &edges)).collect();
    let mut shares: [Share; 2] = Default::default();
    let mut in_planes = vec![false; common.positions.len()];
    let mut taken = vec![false; edges.len()];
    for plane in planes {
        let of_plane: Vec<usize> = (0..edges.len())
            .filter(|&at| !taken[at] && common.is_in(&edges[at].ends, &plane))
            .collect();
        for &at in &of_plane {
            taken[at] = true;
            edges[at].ends.iter().for_each(|&end| in_planes[end as usize] = true);
        }
        let of_plane = of_plane.into_iter().map(|at| &edges[at]).collect::<Vec<_>>();
        let chains = common.chains(&plane, &of_plane, &rule);
        for (side, share) in shares.iter_mut().enumerate() {
            let chains = chains.iter().map(|(run, keep)| Chain {
                positions: run.iter().map(|&at| common.positions[at as usize][side]).collect(),
                keep: keep.clone(),
            });
            let plane =
                CutPlane::from_chains(plane.axis, plane.coordinates[side], chains.collect());
            share.planes.push(Arc::new(plane));
        }
    }
    for (number, positions) in common.positions.iter().enumerate() {
        if common.is_common[number] && !in_planes[number] {
            for (share, position) in shares.iter_mut().zip(positions) {
                share.kept.push(*position);
            }
        }
    }
    shares
}

/// What the coarse nodes of either side would keep of a border at each level, whichever is more.
fn keep_rule([one, other]: [&Rim; 2], constants: BorderConstants) -> KeepRule<'static> {
    let (shallow, deep) = match one.keeps.len() <= other.keeps.len() {
        true => (&one.keeps, &other.keeps),
        false => (&other.keeps, &one.keeps),
    };
    // At their last level there are leaves alone, of which nothing goes.
    let coarse = &shallow[..shallow.len() - 1];
    let mut least = Keep { share: 0.0, most: 0.0 };
    let mut keep = |(level, keep): (usize, &Keep)| {
        for keep in coarse.get(level).into_iter().chain([keep]) {
            least.share = least.share.max(keep.share);
            least.most = least.most.max(keep.most);
        }
        least
    };
    let keeps: Vec<Keep> = deep.iter().enumerate().map(&mut keep).collect();
    let is_locked = keeps.len() == 1 && keeps[0].most.is_infinite();
    KeepRule {
        shares: keeps.iter().map(|keep| keep.share).collect(),
        most: keeps[..keeps.len() - 1].iter().map(|keep| keep.most).collect(),
        first_level: 0,
        collinear: if is_locked { -1.0 } else { Lattice::for_tile(one.bounds).step },
        baked: None,
        constants,
    }
}

/// A plane between two inputs.
struct Plane {
    axis: usize,
    /// Where each side ends.
    coordinates: [f64; 2],
    /// What is no farther from it is in it.
    close: f64,
}

impl<'a> Common<'a> {
    fn new(rims: [&'a Rim; 2], thirds: &[&Rim]) -> Option<Self> {
        let [one, other] = rims;
        let sides = [
            NearVertices::new(one.near(&other.bounds, NEAR).map(|edge| edge.ends), NEAR),
            NearVertices::new(other.near(&one.bounds, NEAR).map(|edge| edge.ends), NEAR),
        ];
        let pairs = sides[0].pairs(&sides[1]);
        if pairs.is_empty() {
            return None;
        }
        let apart = pairs.iter().map(|&(_, distance)| distance).fold(0.0, f64::max);
        let mut positions: Vec<[[f64; 3]; 2]> =
            sides[0].positions().iter().map(|&position| [position; 2]).collect();
        let mut numbers: [FxHashMap<PositionKey<f64>, u32>; 2] = Default::default();
        numbers[0] = (0..).zip(sides[0].positions()).map(|(at, p)| (key(*p), at)).collect();
        let mut is_common = vec![false; positions.len()];
        for &([number, of_other], _) in &pairs {
            let position = sides[1].positions()[of_other as usize];
            positions[number as usize][1] = position;
            is_common[number as usize] = true;
            numbers[1].insert(key(position), number);
        }
        for &position in sides[1].positions() {
            let next = positions.len() as u32;
            if *numbers[1].entry(key(position)).or_insert(next) == next {
                positions.push([position; 2]);
                is_common.push(false);
            }
        }
        let near_both = |rim: &&Rim| {
            let here = |edge: &&OpenEdge| {
                let is_near = |bounds: &BoundingBox| {
                    edge.ends.iter().any(|end| super::rim::come_near(&[*end; 2], bounds, NEAR))
                };
                is_near(&one.bounds) && is_near(&other.bounds)
            };
            NearVertices::new(rim.edges.iter().filter(here).map(|edge| edge.ends), NEAR)
        };
        let thirds: Vec<NearVertices> = thirds.iter().map(near_both).collect();
        let is_of = |at: &[[f64; 3]; 2]| {
            thirds.iter().any(|third| at.iter().any(|&position| third.has_near(position)))
        };
        let of_third = positions.iter().map(is_of).collect();
        Some(Self { rims, numbers, positions, is_common, of_third, apart })
    }

    /// The edges of both sides, those of the first side first.
    fn edges(&self) -> Vec<Edge<'a>> {
        let of_side = |side: usize| {
            self.rims[side].edges.iter().filter_map(move |open| {
                let [from, to] = open.ends.map(|end| self.numbers[side].get(&key(end)).copied());
                Some(Edge { side, ends: [from?, to?], open })
            })
        };
        of_side(0).chain(of_side(1)).collect()
    }

    /// The coordinates of both ends as both sides have them.
    fn coordinates(&self, ends: &[u32; 2], axis: usize) -> [f64; 4] {
        let [from, to] = ends.map(|end| self.positions[end as usize]);
        [from[0][axis], from[1][axis], to[0][axis], to[1][axis]]
    }

    fn is_in(&self, ends: &[u32; 2], plane: &Plane) -> bool {
        let [one, other] = plane.coordinates;
        let [a, b, c, d] = self.coordinates(ends, plane.axis);
        [a - one, b - other, c - one, d - other].iter().all(|off| off.abs() <= plane.close)
    }

    /// The plane across an axis in which most of what is common lies, if there is one between them.
    fn plane(&self, axis: usize, edges: &[Edge]) -> Option<Plane> {
        let close = 2.0 * self.apart + WRITTEN;
        let mut common_length = 0.0;
        let mut levels: Vec<(f64, f64)> = Vec::new();
        for edge in
            edges.iter().filter(|edge| edge.ends.iter().all(|&end| self.is_common[end as usize]))
        {
            let length = wide(edge.open.ends[0]).distance(wide(edge.open.ends[1]));
            common_length += length;
            let at = self.coordinates(&edge.ends, axis);
            let (low, high) = (
                at.iter().copied().fold(f64::MAX, f64::min),
                at.iter().copied().fold(f64::MIN, f64::max),
            );
            if high - low <= close {
                levels.push((f64::midpoint(low, high), length));
            }
        }
        levels.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        // The run of close coordinates that has the most length.
        let (mut best, mut first, mut length) = ((0.0, 0.0), 0, 0.0);
        for (at, &(coordinate, of_edge)) in levels.iter().enumerate() {
            length += of_edge;
            while coordinate - levels[first].0 > close {
                length -= levels[first].1;
                first += 1;
            }
            if length > best.0 {
                let middle = levels[first + (at - first) / 2].0;
                best = (length, middle);
            }
        }
        let (length, middle) = best;
        if length < LEAST_IN_PLANE * common_length || length <= 0.0 {
            return None;
        }
        let rough = Plane { axis, coordinates: [middle; 2], close: 2.0 * close };
        // Sides of the plane on which surfaces are, by length, and where each side ends.
        let mut sides = [[0.0f64; 2]; 2];
        let mut ends: [Vec<f64>; 2] = Default::default();
        for edge in edges.iter().filter(|edge| self.is_in(&edge.ends, &rough)) {
            let off = edge.open.corner[axis] - middle;
            let length = wide(edge.open.ends[0]).distance(wide(edge.open.ends[1]));
            if off.abs() > rough.close {
                sides[edge.side][usize::from(off > 0.0)] += length;
            }
            ends[edge.side].extend(edge.open.ends.iter().map(|end| end[axis]));
        }
        let is_on = |[below, above]: [f64; 2], side: usize| {
            [below, above][side] >= LEAST_ON_SIDE * (below + above) && below + above > 0.0
        };
        let [one, other] = sides;
        let is_between = (is_on(one, 0) && is_on(other, 1)) || (is_on(one, 1) && is_on(other, 0));
        let median = |mut of: Vec<f64>| {
            of.sort_by(f64::total_cmp);
            of[of.len() / 2]
        };
        let [one, other] = ends;
        is_between.then(|| Plane { axis, coordinates: [median(one), median(other)], close })
    }

    /// The chains of a plane's edges, and the coarsest level at which each vertex is kept.
    fn chains(&self, plane: &Plane, edges: &[&Edge], rule: &KeepRule) -> Vec<(Vec<u32>, Vec<u8>)> {
        let mut number_of: FxHashMap<u32, u32> = FxHashMap::default();
        let mut vertices: Vec<BorderVertex<f64>> = Vec::new();
        let mut common: Vec<u32> = Vec::new();
        let mut joined: Vec<[u32; 2]> = Vec::new();
        let mut of_sides: Vec<(usize, [u32; 2])> = Vec::new();
        for edge in edges {
            let corners: [DVec3; 3] =
                [wide(edge.open.ends[0]), wide(edge.open.ends[1]), wide(edge.open.corner)];
            let ends = edge.ends.map(|end| {
                let number = *number_of.entry(end).or_insert_with(|| {
                    common.push(end);
                    let position = self.positions[end as usize][0];
                    let fixed = self.of_third[end as usize];
                    let surface = SurfaceQuadric::default();
                    vertices.push(BorderVertex { position, fixed, surface });
                    vertices.len() as u32 - 1
                });
                vertices[number as usize].surface.add_triangle(corners);
                number
            });
            let ends = [ends[0].min(ends[1]), ends[0].max(ends[1])];
            joined.push(ends);
            of_sides.push((edge.side, ends));
        }
        joined.sort_unstable();
        joined.dedup();
        // Where one side ends, the other may go on, by as little as what is left of a triangle that the plane
        // does not quite miss.
        of_sides.sort_unstable();
        of_sides.dedup();
        let mut edges_at = vec![[0u32; 2]; vertices.len()];
        for (side, end) in of_sides.iter().flat_map(|&(side, ends)| ends.map(|end| (side, end))) {
            edges_at[end as usize][side] += 1;
        }
        for (vertex, edges) in vertices.iter_mut().zip(edges_at) {
            vertex.fixed |= edges.contains(&1);
        }
        let ranked = CutPlane::new(plane.axis, plane.coordinates[0], &vertices, &joined, rule);
        // Positions of the first side are those of all.
        let at: FxHashMap<PositionKey<f64>, u32> =
            common.iter().map(|&end| (key(self.positions[end as usize][0]), end)).collect();
        let chain = |chain: &Chain<f64>| {
            (
                chain.positions.iter().map(|position| at[&key(*position)]).collect(),
                chain.keep.clone(),
            )
        };
        ranked.chains.iter().map(chain).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::options::BuildOptions;
    use crate::mesh::{Model, Part};

    /// A hilly square of `n` by `n` cells of a metre with its corner at `x`, `y`, moved by `off`.
    fn ground(n: u32, [x, y]: [f64; 2], off: f64) -> Model {
        let mut part = Part::default();
        for i in 0..=n {
            for j in 0..=n {
                let (x, y) = (x + f64::from(i), y + f64::from(j));
                let z = (x * 1.7).sin() + (y * 2.3).cos() + (x * y * 0.1).sin();
                part.positions.push([x + off, y - off, z + off]);
            }
        }
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] =
                    [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[di, dj]| (i + di) * (n + 1) + j + dj);
                part.indices.extend([a, b, c, a, c, d]);
            }
        }
        Model::of_parts(vec![part])
    }

    /// How high the ground is at `x` = 20.
    fn z(y: f64) -> f64 {
        (20.0 * 1.7f64).sin() + (y * 2.3).cos() + (20.0 * y * 0.1).sin()
    }

    fn rim(model: &Model) -> Rim {
        let mut options = BuildOptions::default();
        options.hierarchy.desired_tris = 100;
        Rim::new(model, |_| true, &options)
    }

    fn between(models: [&Model; 2], thirds: &[&Model]) -> [Share; 2] {
        let rims = models.map(rim);
        let thirds: Vec<Rim> = thirds.iter().map(|model| rim(model)).collect();
        let thirds: Vec<&Rim> = thirds.iter().collect();
        shares([&rims[0], &rims[1]], &thirds, BorderConstants::default())
    }

    /// The levels from which vertices along a border are kept, as a side has it.
    fn keeps(share: &Share, at: impl Fn(f64) -> [f64; 3]) -> Vec<u8> {
        let [plane] = &share.planes[..] else { panic!("{} planes", share.planes.len()) };
        (0..=20).map(|y| plane.keep_level(at(f64::from(y))).unwrap()).collect()
    }

    #[test]
    fn both_sides_of_a_plane_keep_the_same() {
        let (one, other) = (ground(20, [0.0; 2], 0.0), ground(20, [20.0, 0.0], 0.0));
        let [left, right] = between([&one, &other], &[]);
        let kept = keeps(&left, |y| [20.0, y, z(y)]);
        assert_eq!(kept, keeps(&right, |y| [20.0, y, z(y)]));
        assert_eq!((left.planes[0].axis, left.planes[0].coordinate), (0, 20.0));
        assert!(left.kept.is_empty() && right.kept.is_empty());
        let coarse = kept.iter().filter(|&&level| level == 0).count();
        assert!((2..15).contains(&coarse), "{kept:?}");
        assert_eq!(left.hash(), right.hash());
        let [left_again, _] = between([&one, &ground(20, [20.0, 0.0], 0.0)], &[]);
        assert_eq!(left_again.hash(), left.hash());
    }

    #[test]
    fn each_side_keeps_its_own_positions_where_they_nearly_agree() {
        let (one, other) = (ground(20, [0.0; 2], 0.0), ground(20, [20.0, 0.0], 0.002));
        let [left, right] = between([&one, &other], &[]);
        let kept = keeps(&left, |y| [20.0, y, z(y)]);
        assert_eq!(kept, keeps(&right, |y| [20.0 + 0.002, y - 0.002, z(y) + 0.002]));
        assert!(kept.iter().any(|&level| level > 0));
        assert_eq!(right.planes[0].coordinate, 20.0 + 0.002);
        // Two centimetres are too far.
        let apart = between([&one, &ground(20, [20.0, 0.0], 0.02)], &[]);
        assert!(apart.iter().all(Share::is_empty));
    }

    #[test]
    fn a_vertex_of_three_inputs_stays() {
        let models = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0]].map(|at| ground(20, at, 0.0));
        let corner = [20.0, 20.0];
        let [left, _] = between([&models[0], &models[1]], &[&models[2]]);
        let at_corner = models[0].parts[0].positions.iter();
        let at_corner = at_corner.copied().find(|at| at[..2] == corner).unwrap();
        assert_eq!(left.planes[0].keep_level(at_corner), Some(0));
        let [left, _] = between([&models[0], &models[1]], &[]);
        assert_eq!(left.planes[0].keep_level(at_corner), Some(0), "an end stays anyhow");
        // The two that have no more than a point in common have no border.
        let corners = between([&models[0], &models[2]], &[&models[1]]);
        assert!(corners.iter().all(Share::is_empty));
        // Within the border of two, a vertex of a third one.
        let third = ground(10, [20.0, 20.0], 0.0);
        let tall = [[0.0, 10.0], [20.0, 10.0]].map(|at| ground(20, at, 0.0));
        let at = |share: &Share| share.planes[0].keep_level(at_corner).unwrap();
        let [alone, _] = between([&tall[0], &tall[1]], &[]);
        let [beside, _] = between([&tall[0], &tall[1]], &[&third]);
        assert!(at(&alone) > 0 && at(&beside) == 0, "{} {}", at(&alone), at(&beside));
    }

    #[test]
    fn where_one_side_ends_stays_though_the_other_goes_on_by_a_sliver() {
        let (one, mut other) = (ground(20, [0.0; 2], 0.0), ground(20, [20.0, 0.0], 0.0));
        // The last cell along the plane has its corner there, and a vertex within a hair of it.
        let part = &mut other.parts[0];
        let (corner, beside) = (20, part.positions.len() as u32);
        let at = part.positions[corner as usize];
        assert_eq!(at[..2], [20.0, 20.0]);
        part.positions.push([at[0] + 3e-5, at[1], at[2]]);
        let corners = part.indices.as_chunks::<3>().0;
        let last = corners.iter().position(|corners| corners.contains(&corner)).unwrap();
        let [a, c, d] = corners[last];
        assert_eq!(d, corner);
        part.indices.splice(3 * last..3 * last + 3, [a, c, beside, a, beside, d]);
        for at_the_end in between([&one, &other], &[]).map(|share| share.planes[0].keep_level(at)) {
            assert_eq!(at_the_end, Some(0));
        }
    }

    /// A plane that both surfaces lie in does not divide them.
    #[test]
    fn what_is_common_along_a_ragged_line_stays() {
        let flat = |mut model: Model, ragged: bool| {
            for position in &mut model.parts[0].positions {
                let [x, y, _] = *position;
                let beside = if ragged && x == 20.0 { 0.3 * (y * 1.3).sin() } else { 0.0 };
                *position = [x + beside, y, 0.0];
            }
            model
        };
        let [left, right] = between(
            [&flat(ground(20, [0.0; 2], 0.0), true), &flat(ground(20, [20.0, 0.0], 0.0), true)],
            &[],
        );
        assert!(left.planes.is_empty() && right.planes.is_empty());
        assert_eq!([left.kept.len(), right.kept.len()], [21; 2]);
    }
}
