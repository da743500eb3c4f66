//! Borders of a district that reach as far as the skirts of its members.
//!
//! The strips that members have over what they left of the original border go into the polylines
//! between the vertices that a district keeps, so that its own skirts cover them.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;

use crate::builder::border::chain::{Chain, CutPlane};
use crate::builder::border::span::BorderSpan;
use crate::builder::border::vertex::Path;
use crate::builder::districts::cuts::is_strip;
use crate::mesh::wide;

/// What a strip's corners may be off, as a share of its sides.
const ROUNDING: f64 = 1e-3;

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
    pub fn by(skirts: &[Vec<DVec3>], path: &Path, spans: Vec<BorderSpan>) -> Self {
        let mut wider = Path::default();
        let mut places = Vec::with_capacity(path.len());
        for bit in 0..path.len() as u32 {
            let plane = path.plane(bit);
            let polygon =
                |skirt: &Vec<DVec3>| Polygon::new(skirt, plane.axis, plane.coordinate.into());
            let polygons: Vec<Polygon> = skirts.iter().filter_map(polygon).collect();
            let is_own = own_edges(bit, &plane.chains, &spans);
            let beside = beside_edges(&plane.chains, &is_own, plane.axis, &polygons);
            let chains = plane.chains.iter().zip(beside);
            let chains = chains.map(|(chain, beside)| {
                let at = |at: &DVec2| raised(*at, plane.axis, plane.coordinate);
                let beside = beside.iter().map(|all| all.iter().map(at).collect());
                widened(chain, beside.collect())
            });
            let (chains, of_plane): (Vec<Chain>, Vec<Vec<u32>>) = chains.unzip();
            let plane = CutPlane::from_chains(plane.axis, plane.coordinate, chains);
            wider = wider.with(Arc::new(plane));
            places.push(of_plane);
        }
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

/// By chain and edge, corners of what polygons cover beside it.
fn beside_edges(
    chains: &[Chain],
    is_own: &[Vec<bool>],
    axis: usize,
    polygons: &[Polygon],
) -> Vec<Vec<Vec<DVec2>>> {
    let flat: Vec<Vec<DVec2>> = chains
        .iter()
        .map(|chain| chain.positions.iter().map(|&at| flattened(wide(at), axis)).collect())
        .collect();
    let mut beside: Vec<Vec<Vec<DVec2>>> =
        flat.iter().map(|chain| vec![Vec::new(); chain.len()]).collect();
    for polygon in polygons {
        let mut has_edge = false;
        for ((flat, is_own), beside) in flat.iter().zip(is_own).zip(&mut beside) {
            let contains = |&edge: &usize| polygon.contains(0.5 * (flat[edge] + flat[edge + 1]));
            let mut first = 0;
            while first + 1 < flat.len() {
                let count = (first..flat.len() - 1).take_while(contains).count();
                if count > 0 {
                    has_edge |= is_own[first..first + count].contains(&true);
                    polygon
                        .share_out(&flat[first..=first + count], &mut beside[first..first + count]);
                }
                first += count + 1;
            }
        }
        // A strip may have another one between it and the edge.
        if !has_edge && let Some((chain, edge)) = polygon.nearest_edge(&flat, is_own) {
            beside[chain][edge].extend(&polygon.corners);
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
    beside
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

/// The coordinates of a point in a plane across `axis`.
fn flattened(point: DVec3, axis: usize) -> DVec2 {
    match axis {
        0 => DVec2::new(point.y, point.z),
        1 => DVec2::new(point.x, point.z),
        _ => DVec2::new(point.x, point.y),
    }
}

/// The way back from [`flattened`].
fn raised(point: DVec2, axis: usize, coordinate: f32) -> [f32; 3] {
    let [u, v] = point.as_vec2().to_array();
    match axis {
        0 => [coordinate, u, v],
        1 => [u, coordinate, v],
        _ => [u, v, coordinate],
    }
}

fn bits(point: DVec2) -> [u64; 2] {
    point.to_array().map(f64::to_bits)
}

/// A convex polygon in a plane, counter-clockwise.
struct Polygon {
    corners: Vec<DVec2>,
    /// Where it has a corner beside the plane: that, and the nearest of those in the plane, to which the
    /// border goes on from there.
    joint: Option<[DVec2; 2]>,
}

impl Polygon {
    /// `None` where a skirt is not in the plane, or has no area there.
    fn new(skirt: &[DVec3], axis: usize, coordinate: f64) -> Option<Self> {
        if !is_strip(&skirt.iter().map(|at| at.to_array()).collect::<Vec<_>>(), axis, coordinate) {
            return None;
        }
        let mut corners: Vec<DVec2> = skirt.iter().map(|&at| flattened(at, axis)).collect();
        let in_plane = |corner: &usize| skirt[*corner][axis] == coordinate;
        let mut beside = (0..skirt.len()).filter(|corner| !in_plane(corner));
        let joint = match [beside.next(), beside.next()] {
            [Some(end), None] => {
                let from = |corner: &usize| skirt[*corner].distance_squared(skirt[end]);
                let next = (0..skirt.len()).filter(in_plane);
                let next = next.min_by(|a, b| from(a).total_cmp(&from(b)));
                next.map(|next| [corners[end], corners[next]])
            }
            _ => None,
        };
        let next = |at: usize| (at + 1) % corners.len();
        let area: f64 = (0..corners.len()).map(|at| corners[at].perp_dot(corners[next(at)])).sum();
        if area < 0.0 {
            corners.reverse();
        }
        (area != 0.0).then_some(Self { corners, joint })
    }

    /// Whether a point is in it, or beside one of its sides by no more than rounding leaves of being on it.
    fn contains(&self, point: DVec2) -> bool {
        (0..self.corners.len()).all(|at| {
            let (a, b) = (self.corners[at], self.corners[(at + 1) % self.corners.len()]);
            let along = b - a;
            along.perp_dot(point - a) >= -ROUNDING * along.length_squared()
        })
    }

    /// The chain and edge of the district that its middle is nearest to, no farther than it reaches itself.
    fn nearest_edge(&self, chains: &[Vec<DVec2>], is_own: &[Vec<bool>]) -> Option<(usize, usize)> {
        let middle = self.corners.iter().sum::<DVec2>() / self.corners.len() as f64;
        let reach = self.corners.iter().map(|at| at.distance(middle)).fold(0.0, f64::max);
        let edges = chains.iter().enumerate().flat_map(|(chain, points)| {
            points.windows(2).enumerate().map(move |(edge, ends)| (chain, edge, ends))
        });
        let edges = edges.filter(|&(chain, edge, _)| is_own[chain][edge]);
        let off = |ends: &[DVec2]| {
            let along = ends[1] - ends[0];
            let at = (middle - ends[0]).dot(along) / along.length_squared();
            let at = if at.is_nan() { 0.0 } else { at.clamp(0.0, 1.0) };
            middle.distance(ends[0] + along * at)
        };
        let nearest = edges.map(|(chain, edge, ends)| (off(ends), chain, edge));
        let nearest = nearest.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (nearest.0 <= reach).then_some((nearest.1, nearest.2))
    }

    /// Divides it among the edges of a polyline, across the line from its first to its last point, and
    /// adds the corners of each share to what is beside that edge. Together they are all of it.
    fn share_out(&self, line: &[DVec2], beside: &mut [Vec<DVec2>]) {
        let along = line[line.len() - 1] - line[0];
        let mut rest = self.corners.clone();
        let mut from = f64::NEG_INFINITY;
        for (edge, beside) in beside.iter_mut().enumerate() {
            if edge + 2 == line.len() {
                beside.append(&mut rest);
                break;
            }
            // Where the polyline turns back, what was shared out already stays.
            from = from.max(line[edge + 1].dot(along));
            beside.append(&mut clip(&rest, -along, -from));
            rest = clip(&rest, along, from);
        }
    }
}

/// What of a polygon is not before `least` along a direction.
fn clip(corners: &[DVec2], along: DVec2, least: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(corners.len() + 2);
    for (at, &corner) in corners.iter().enumerate() {
        let next = corners[(at + 1) % corners.len()];
        let (here, there) = (corner.dot(along) - least, next.dot(along) - least);
        if here >= 0.0 {
            kept.push(corner);
        }
        if (here > 0.0) != (there > 0.0) && here != there {
            kept.push(corner + (next - corner) * (here / (here - there)));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip is nearest to the edges of a neighbour that kept more, and is the district's all the same.
    #[test]
    fn strips_go_to_edges_of_the_district() {
        let chain = |positions: &[[f32; 3]]| Chain {
            positions: positions.to_vec(),
            keep: vec![0; positions.len()],
        };
        let ends = [[0.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
        let chains = [chain(&[ends[0], [0.0, 5.0, 1.0], ends[1]]), chain(&ends)];
        // Off its base by what joined vertices moved.
        let strip = [(0.0, 0.1), (10.0, 0.1), (5.0, 1.0)].map(|(y, z)| DVec3::new(0.0, y, z));
        let polygons = [Polygon::new(&strip, 0, 0.0).unwrap()];
        let is_own = [vec![false; 3], vec![true; 2]];
        let beside = beside_edges(&chains, &is_own, 0, &polygons);
        assert!(!beside[1][0].is_empty());
    }

    /// A strip whose end is beside the plane: what it goes on to is next to that end.
    #[test]
    fn ends_beside_the_plane_are_joined_with_what_was_next_to_them() {
        let chain = Chain { positions: vec![[0.0, 0.0, 0.0], [0.25, 10.0, 0.0]], keep: vec![0, 0] };
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let closing = [corner(0.25, 10.0, 0.0), corner(0.0, 7.0, 1.0), corner(0.0, 0.0, 0.0)];
        // Reaches beyond what the end is joined with.
        let strip = [
            corner(0.0, 0.0, 0.0),
            corner(0.0, 7.5, 1.1),
            corner(0.0, 7.4, 1.3),
            corner(0.0, -0.1, 0.2),
        ];
        let polygons: Vec<Polygon> =
            [&closing[..], &strip].map(|skirt| Polygon::new(skirt, 0, 0.0).unwrap()).into();
        let beside = beside_edges(&[chain], &[vec![true; 2]], 0, &polygons);
        assert_eq!(beside[0][0].last(), Some(&DVec2::new(7.0, 1.0)));
        assert!(strip.iter().all(|at| beside[0][0].contains(&flattened(*at, 0))));
    }
}
