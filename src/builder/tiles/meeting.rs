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
    let [low, high] = one.bounds;
    let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let magnitude = low.into_iter().chain(high).fold(0.0, |most: f64, at| most.max(at.abs()));
    let is_locked = keeps.len() == 1 && keeps[0].most.is_infinite();
    KeepRule {
        shares: keeps.iter().map(|keep| keep.share).collect(),
        most: keeps[..keeps.len() - 1].iter().map(|keep| keep.most).collect(),
        first_level: 0,
        collinear: if is_locked { -1.0 } else { Lattice::for_extent(extent, magnitude).step },
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
            joined.push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
        }
        joined.sort_unstable();
        joined.dedup();
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
