//! Borders of a district that reach as far as the skirts of its members.
//!
//! The strips that members have over what they left of the original border go into the polylines
//! between the vertices that a district keeps, so that its own skirts cover them.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;

use crate::builder::border::chain::{Chain, CutPlane};
use crate::builder::border::span::BorderSpan;
use crate::builder::border::vertex::Path;
use crate::builder::districts::polygon::{Polygon, Run, Slab, flattened, raised};
use crate::mesh::wide;

/// The borders of a district whose polylines have what skirts of its members cover between two
/// vertices, so that skirts over them cover that too.
pub struct Widened {
    /// The planes.
    pub path: Path,
    /// The district's border, edge by edge.
    pub spans: Vec<BorderSpan>,
}

impl Widened {
    /// Of a path and spans of it, by skirts in its coordinates.
    pub fn by(skirts: &[Vec<DVec3>], path: &Path, mut spans: Vec<BorderSpan>) -> Self {
        let mut wider = Path::default();
        let mut more = Vec::new();
        let mut places = Vec::with_capacity(path.len());
        for bit in 0..path.len() as u32 {
            let plane = path.plane(bit);
            let polygon =
                |skirt: &Vec<DVec3>| Polygon::new(skirt, plane.axis, plane.coordinate.into());
            let polygons: Vec<Polygon> = skirts.iter().filter_map(polygon).collect();
            let mut is_own = own_edges(bit, &plane.chains, &spans);
            // Where planes cross, an edge is in both, and of one; a strip along it may be in the other.
            let corners = spans.iter().filter(|span| span.plane() != bit);
            let corners = corners.filter(|span| span.is_in(plane.axis, plane.coordinate, path));
            let mut chains = plane.chains.clone();
            chains.extend(corners.map(|span| span.chain(path)));
            is_own.resize(chains.len(), vec![true; 2]);
            let at = |at: &DVec2| raised(*at, plane.axis, plane.coordinate);
            let Beside { mut edges, closed, alone } =
                Beside::of(&chains, &is_own, plane.axis, &polygons);
            let corners = plane.chains.len()..chains.len();
            let of_corners = corners.filter(|&corner| !edges[corner][0].is_empty());
            let mut own: Vec<[usize; 2]> = of_corners.map(|corner| [corner, 0]).collect();
            own.extend(closed);
            for polygon in alone {
                let [first, last, others @ ..] = &polygons[polygon].corners[..] else { continue };
                own.push([chains.len(), 0]);
                chains.push(Chain { positions: [first, last].map(at).into(), keep: vec![0; 2] });
                edges.push(vec![others.to_vec(), Vec::new()]);
            }
            more.extend(own.iter().map(|&[chain, edge]| BorderSpan::of_edge(bit, chain, edge)));
            let chains = chains.iter().zip(edges).map(|(chain, beside)| {
                let beside = beside.iter().map(|all| all.iter().map(at).collect());
                widened(chain, beside.collect())
            });
            let (chains, of_plane): (Vec<Chain>, Vec<Vec<u32>>) = chains.unzip();
            let plane = CutPlane::from_chains(plane.axis, plane.coordinate, chains);
            wider = wider.with(Arc::new(plane));
            places.push(of_plane);
        }
        spans.append(&mut more);
        let spans = spans.into_iter().map(|span| span.at(&places)).collect();
        Self { path: wider, spans }
    }
}

/// By chain and edge, whether the district has it: others are of its neighbours alone.
fn own_edges(plane: u32, chains: &[Chain], spans: &[BorderSpan]) -> Vec<Vec<bool>> {
    let mut is_own: Vec<Vec<bool>> =
        chains.iter().map(|chain| vec![false; chain.positions.len()]).collect();
    for span in spans.iter().filter(|span| span.plane() == plane) {
        let (chain, edges) = span.edges();
        is_own[chain][edges].fill(true);
    }
    is_own
}

/// What polygons cover in a plane.
struct Beside {
    /// By chain and edge, corners of what is covered beside it.
    edges: Vec<Vec<Vec<DVec2>>>,
    /// Chains and edges that are covered where the district has none any more, while a neighbour has them.
    closed: BTreeSet<[usize; 2]>,
    /// Polygons where nobody has an edge any more, in order.
    alone: Vec<usize>,
}

impl Beside {
    fn of(chains: &[Chain], is_own: &[Vec<bool>], axis: usize, polygons: &[Polygon]) -> Self {
        let flat: Vec<Vec<DVec2>> = chains
            .iter()
            .map(|chain| chain.positions.iter().map(|&at| flattened(wide(at), axis)).collect())
            .collect();
        let mut beside: Vec<Vec<Vec<DVec2>>> =
            flat.iter().map(|chain| vec![Vec::new(); chain.len()]).collect();
        let mut closed = BTreeSet::new();
        let mut alone = Vec::new();
        for (number, polygon) in polygons.iter().enumerate() {
            let [mut own, others] = polygon.runs(&flat, is_own);
            if own.is_empty() {
                // A strip may have another one between it and the edge.
                own.extend(polygon.nearest_edge(&flat, is_own));
            }
            let line = |(chain, edges): &Run| &flat[*chain][edges.start..=edges.end];
            let slabs: Vec<Slab> = own.iter().map(|run| Slab::around(line(run))).collect();
            for (chain, edges) in others {
                for edge in edges {
                    let ends = &flat[chain][edge..=edge + 1];
                    let is_in = |slab: &Slab| ends.iter().all(|end| slab.contains(*end));
                    if !slabs.iter().any(is_in) {
                        closed.insert([chain, edge]);
                        own.push((chain, edge..edge + 1));
                    }
                }
            }
            if own.is_empty() && !polygons[..number].contains(polygon) {
                alone.push(number);
            }
            for run in own {
                let (chain, edges) = run.clone();
                polygon.share_out(line(&run), &mut beside[chain][edges]);
            }
        }
        let joints = polygons.iter().filter_map(|polygon| polygon.joint);
        let joints: FxHashSet<[[u64; 2]; 2]> = joints.map(|joint| joint.map(bits)).collect();
        for (flat, beside) in flat.iter().zip(&mut beside) {
            for (ends, beside) in flat.windows(2).zip(beside) {
                let along = ends[1] - ends[0];
                beside.sort_by(|a, b| a.dot(along).total_cmp(&b.dot(along)));
                // What an end beside the plane is joined with is next to it.
                let mut joined = |end: usize| {
                    let is_joint = |at: &DVec2| joints.contains(&[ends[end], *at].map(bits));
                    beside.iter().position(is_joint).map(|place| beside.remove(place))
                };
                let [first, last] = [joined(0), joined(1)];
                beside.extend(last);
                beside.splice(0..0, first);
            }
        }
        Self { edges: beside, closed, alone }
    }
}

/// The chain with what is beside its edges, and where its positions are now.
fn widened(chain: &Chain, beside: Vec<Vec<[f32; 3]>>) -> (Chain, Vec<u32>) {
    let mut wider = Chain::default();
    let mut places = Vec::with_capacity(chain.positions.len());
    for ((&position, &keep), beside) in chain.positions.iter().zip(&chain.keep).zip(beside) {
        places.push(wider.positions.len() as u32);
        wider.positions.push(position);
        wider.keep.push(keep);
        wider.keep.extend(beside.iter().map(|_| u8::MAX));
        wider.positions.extend(beside);
    }
    (wider, places)
}

fn bits(point: DVec2) -> [u64; 2] {
    point.to_array().map(f64::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The plane x = 0.
    const AXIS: usize = 0;

    fn polygon(corners: &[(f64, f64)]) -> Polygon {
        Polygon::new(&strip(corners), AXIS, 0.0).unwrap()
    }

    fn strip(corners: &[(f64, f64)]) -> Vec<DVec3> {
        corners.iter().map(|&(y, z)| DVec3::new(0.0, y, z)).collect()
    }

    fn chain(places: &[(f32, f32)]) -> Chain {
        Chain {
            positions: places.iter().map(|&(y, z)| [0.0, y, z]).collect(),
            keep: vec![0; places.len()],
        }
    }

    /// A strip is nearest to the edges of a neighbour that kept more, and is the district's all the same.
    #[test]
    fn strips_go_to_edges_of_the_district() {
        let chains =
            [chain(&[(0.0, 0.0), (5.0, 1.0), (10.0, 0.0)]), chain(&[(0.0, 0.0), (10.0, 0.0)])];
        // Off its base by what joined vertices moved.
        let strip = polygon(&[(0.0, 0.1), (10.0, 0.1), (5.0, 1.0)]);
        let is_own = [vec![false; 3], vec![true; 2]];
        let Beside { edges, closed, alone } = Beside::of(&chains, &is_own, AXIS, &[strip]);
        assert!(!edges[1][0].is_empty());
        assert!(closed.is_empty() && alone.is_empty());
    }

    /// A strip whose end is beside the plane: what it goes on to is next to that end.
    #[test]
    fn ends_beside_the_plane_are_joined_with_what_was_next_to_them() {
        let chain = Chain { positions: vec![[0.0, 0.0, 0.0], [0.25, 10.0, 0.0]], keep: vec![0, 0] };
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let closing = [corner(0.25, 10.0, 0.0), corner(0.0, 7.0, 1.0), corner(0.0, 0.0, 0.0)];
        // Reaches beyond what the end is joined with.
        let strip = strip(&[(0.0, 0.0), (7.5, 1.1), (7.4, 1.3), (-0.1, 0.2)]);
        let polygons: Vec<Polygon> =
            [&closing[..], &strip].map(|skirt| Polygon::new(skirt, AXIS, 0.0).unwrap()).into();
        let Beside { edges, .. } = Beside::of(&[chain], &[vec![true; 2]], AXIS, &polygons);
        assert_eq!(edges[0][0].last(), Some(&DVec2::new(7.0, 1.0)));
        assert!(strip.iter().all(|at| edges[0][0].contains(&flattened(*at, AXIS))));
    }

    /// Strips along a border of which little is left: what closed inside of the district needs none.
    #[test]
    fn strips_go_no_farther_beyond_edges_than_these_are_long() {
        let edge = chain(&[(5.0, 0.0), (5.5, 0.0)]);
        let strips = [
            polygon(&[(0.0, -0.1), (10.0, -0.1), (10.0, 0.1), (0.0, 0.1)]),
            // Not beside the edge.
            polygon(&[(0.0, 0.1), (4.5, 0.1), (4.5, 3.0), (0.0, 3.0)]),
        ];
        let Beside { edges, alone, .. } = Beside::of(&[edge], &[vec![true; 2]], AXIS, &strips);
        let along = edges[0][0].iter().map(|at| at.x);
        let (low, high) = along.fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(y), b.max(y)));
        assert_eq!((low, high), (4.5, 6.0));
        assert_eq!(alone, [1]);
    }

    #[test]
    fn edges_around_a_slit_have_what_covers_it() {
        let slit = chain(&[(4.0, 0.0), (3.0, 0.1), (0.0, 0.0), (4.0, 0.0)]);
        // The neighbour has more vertices.
        let is_own = [vec![false, false, true, false]];
        let strip = polygon(&[(0.0, 0.0), (4.0, 0.0), (3.0, 0.1)]);
        let Beside { edges, closed, .. } = Beside::of(&[slit], &is_own, AXIS, &[strip]);
        assert!(edges[0][2].contains(&DVec2::new(3.0, 0.1)), "{edges:?}");
        assert!(closed.is_empty(), "{closed:?}");
    }

    #[test]
    fn strips_do_not_cover_edges_that_cross_them() {
        let chains = [chain(&[(2.0, -8.0), (2.0, 8.0)]), chain(&[(0.0, 0.0), (5.0, 0.0)])];
        let strip = polygon(&[(0.0, 0.0), (5.0, 0.0), (5.0, 0.1), (0.0, 0.1)]);
        let is_own = [vec![true; 2], vec![true; 2]];
        let Beside { edges, .. } = Beside::of(&chains, &is_own, AXIS, &[strip]);
        assert!(edges[0][0].is_empty() && !edges[1][0].is_empty(), "{edges:?}");
    }

    /// The edges of a district, of its neighbours alone, and strips: with skirts over the spans all strips are
    /// covered.
    #[test]
    fn what_members_covered_stays_covered_where_borders_closed() {
        let own = chain(&[(0.0, 0.0), (1.0, 0.0)]);
        let of_neighbours = chain(&[(10.0, 0.0), (11.0, 0.0)]);
        let plane = CutPlane::from_chains(AXIS, 0.0, vec![own, of_neighbours]);
        // An edge in this plane that is of the one across the other axis.
        let corner =
            Chain { positions: vec![[0.0, 20.0, 0.0], [0.0, 20.0, 1.0]], keep: vec![0; 2] };
        let other = CutPlane::from_chains(1, 20.0, vec![corner]);
        let path = Path::default().with(Arc::new(plane)).with(Arc::new(other));
        let spans = vec![BorderSpan::of_edge(0, 0, 0), BorderSpan::of_edge(1, 0, 0)];
        let above = |y: f64| strip(&[(y, 0.0), (y + 1.0, 0.0), (y + 1.0, 0.5), (y, 0.5)]);
        // The last is where nobody has an edge.
        let beside = strip(&[(20.0, 0.0), (20.5, 0.0), (20.5, 1.0), (20.0, 1.0)]);
        let strips = [above(0.0), above(10.0), beside, above(30.0)];
        let Widened { path, spans } = Widened::by(&strips, &path, spans);
        assert_eq!(spans.len(), 5, "{spans:?}");
        let covered: Vec<Vec<[f32; 3]>> =
            spans.iter().map(|span| span.points(&path).to_vec()).collect();
        for strip in strips {
            let corners = strip.iter().map(|at| at.as_vec3().to_array());
            let is_in = |points: &Vec<[f32; 3]>| corners.clone().all(|at| points.contains(&at));
            assert_eq!(covered.iter().filter(|points| is_in(points)).count(), 1, "{strip:?}");
        }
    }
}
