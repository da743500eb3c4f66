//! Skirts: what closes the gap between two levels that meet at a cutting plane.
//!
//! A node's border follows the original border with fewer vertices. The region between the two
//! lies in the cutting plane; the skirt of a border edge is a triangle or a rectangle in that plane
//! that contains the edge and the original polyline that it stands for. The neighbour's border
//! follows the same polyline and has skirts over its own deviation, so whatever the two levels
//! are, both sides reach the original polyline and nothing shows between them. A leaf follows the
//! original exactly and needs none, and so does an edge that the polyline is off by rounding alone.
//!
//! What covers consecutive spans covers each of them, so several share a skirt where that is hardly
//! higher than those of others are (`cover`). It looks like one of the edges.
//!
//! Where several spans of the border have the same edge, each has a skirt on it. Where the mesh has
//! no such edge, because what ended there closed up when the border thinned, the neighbour is open
//! there all the same: the skirt stands alone, and looks like the nearest edge that there is.
//!
//! An end of the edge may lie beside the plane rather than on it ([`crate::builder::cut::split`]). From there to
//! the polyline's next vertex the region leaves the plane, and a triangle closes that part.

use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::builder::border::cover::{Cover, deviation};
use crate::builder::border::skirt_rules::SkirtRules;
use crate::builder::border::span::{BorderSpan, edges_of};
use crate::builder::border::thin::EdgeKey;
use crate::builder::border::vertex::{Border, Path};
use crate::mesh::{Mesh, wide};
use crate::texture::AppendedSkirts;

/// What covers the region between one border edge and the original polyline.
#[derive(Clone, Debug, PartialEq)]
pub struct Skirt {
    /// The edge's vertices; the skirt looks like them.
    pub edge: [u32; 2],
    /// Positions of its own vertices, and which of the edge's two each looks like.
    pub corners: Vec<([f32; 3], u8)>,
    /// 0 and 1 are the edge's vertices, 2 and on the corners.
    pub triangles: Vec<[u8; 3]>,
}

/// The skirts that a node needs whose border on `path` is made of `spans`.
pub fn skirts(
    mesh: &Mesh,
    border: &Border,
    spans: &[BorderSpan],
    path: &Path,
    rules: &SkirtRules,
) -> Vec<Skirt> {
    let SkirtRules { closed, constants, .. } = rules;
    let far: Vec<f64> = spans.iter().map(|span| deviation(span.points(path))).collect();
    let open: Vec<bool> = far.iter().map(|&far| far > *closed).collect();
    let of_open = || far.iter().zip(&open).filter(|(_, open)| **open).map(|(far, _)| *far);
    let count = of_open().count();
    if count == 0 {
        return Vec::new();
    }
    let (mean, most) = (of_open().sum::<f64>() / count as f64, of_open().fold(0.0, f64::max));
    let height = (constants.shared_height * mean).min(constants.shared_height_most * most);
    let edges = edges_of(spans, path, mesh, border);
    let in_plane = |span: &BorderSpan| {
        let (plane, points) = (path.plane(span.plane()), span.points(path));
        [points[0], points[points.len() - 1]].iter().all(|end| end[plane.axis] == plane.coordinate)
    };
    let mut skirts = Vec::new();
    let mut first = 0;
    while first < spans.len() {
        let goes_on = |&at: &usize| {
            at < spans.len() && spans[at].follows(&spans[at - 1]) && in_plane(&spans[at])
        };
        let mut end = first + 1;
        if in_plane(&spans[first]) {
            end += (end..).take_while(goes_on).count();
            for (part, cover) in parts(&spans[first..end], &open[first..end], path, height, rules) {
                let edge = model_edge(&spans[first..end][part], path, &edges, mesh);
                skirts.extend(edge.map(|(edge, _)| Skirt::over(edge, &cover)));
            }
        } else if open[first] {
            skirts.extend(beside_plane(&spans[first], path, &edges, mesh, rules));
        }
        first = end;
    }
    skirts
}

/// The skirt of one span with an end beside its plane.
fn beside_plane(
    span: &BorderSpan,
    path: &Path,
    edges: &FxHashMap<EdgeKey, [u32; 2]>,
    mesh: &Mesh,
    rules: &SkirtRules,
) -> Option<Skirt> {
    let plane = path.plane(span.plane());
    let points = span.points(path);
    let region = Region { points, axis: plane.axis, coordinate: plane.coordinate };
    let (edge, is_own) = model_edge(std::slice::from_ref(span), path, edges, mesh)?;
    Some(match is_own {
        true => Skirt::new(edge, region, mesh.positions[edge[0] as usize], rules),
        false => Skirt::alone(edge, region, rules),
    })
}

/// How the first spans of several are divided best.
#[derive(Clone, Default)]
struct Division {
    /// Triangles over all of them.
    triangles: usize,
    /// Heights of the polygons over all of them, summed: what decides between equals.
    heights: f64,
    /// Where the last part begins, and what covers it.
    start: usize,
    cover: Option<Cover>,
}

/// Divides consecutive spans, of which some are `open`, into parts that one polygon covers each, no
/// higher than `height` over several, with as few triangles as can be. Parts that need none are left
/// out.
fn parts(
    spans: &[BorderSpan],
    open: &[bool],
    path: &Path,
    height: f64,
    rules: &SkirtRules,
) -> Vec<(Range<usize>, Cover)> {
    let axis = path.plane(spans[0].plane()).axis;
    let mut best = vec![Division::default()];
    for end in 1..=spans.len() {
        let extended = |start: usize, cover: Option<Cover>| Division {
            triangles: best[start].triangles + cover.as_ref().map_or(0, Cover::triangles),
            heights: best[start].heights + cover.as_ref().map_or(0.0, |cover| cover.height),
            start,
            cover,
        };
        let covered =
            |start: usize| Cover::of(spans[start].points_to(&spans[end - 1], path), axis, rules);
        let alone = end - 1;
        let mut least = extended(alone, open[alone].then(|| covered(alone)).flatten());
        for start in (end.saturating_sub(rules.constants.spans)..alone).rev() {
            let Some(cover) = covered(start).filter(|cover| cover.height <= height) else {
                continue;
            };
            let division = extended(start, Some(cover));
            if (division.triangles, division.heights) < (least.triangles, least.heights) {
                least = division;
            }
        }
        best.push(least);
    }
    let mut parts = Vec::new();
    let mut end = spans.len();
    while end > 0 {
        let Division { start, cover, .. } = std::mem::take(&mut best[end]);
        parts.extend(cover.map(|cover| (start..end, cover)));
        end = start;
    }
    parts.reverse();
    parts
}

/// The edge that a skirt over spans looks like: of the span nearest to their middle that has one, its
/// ends in the order of the span; where none has, the nearest of the mesh. And whether it is an edge
/// of the spans.
fn model_edge(
    spans: &[BorderSpan],
    path: &Path,
    edges: &FxHashMap<EdgeKey, [u32; 2]>,
    mesh: &Mesh,
) -> Option<([u32; 2], bool)> {
    let middle = spans.len() / 2;
    let outwards = (0..spans.len()).map(|at| match at % 2 {
        0 => (middle + at / 2) % spans.len(),
        _ => (middle + spans.len() - at.div_ceil(2)) % spans.len(),
    });
    for at in outwards {
        if let Some(&[a, b]) = edges.get(&spans[at].edge(path)) {
            let forwards = mesh.positions[a as usize] == spans[at].points(path)[0];
            return Some((if forwards { [a, b] } else { [b, a] }, true));
        }
    }
    Some((nearest_edge(mesh, spans[middle].points(path)[0])?, false))
}

/// An edge of the triangle corner nearest to a place; the first of equals.
fn nearest_edge(mesh: &Mesh, place: [f32; 3]) -> Option<[u32; 2]> {
    let from =
        |edge: &[u32; 2]| wide(mesh.positions[edge[0] as usize]).distance_squared(wide(place));
    let edges = mesh.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges.min_by(|a, b| from(a).total_cmp(&from(b)))
}

/// The part of a border's original polyline that is still to be covered, and its plane.
struct Region<'a> {
    points: &'a [[f32; 3]],
    /// The axis that the plane is perpendicular to.
    axis: usize,
    coordinate: f32,
}

impl Skirt {
    fn new(edge: [u32; 2], mut region: Region, start: [f32; 3], rules: &SkirtRules) -> Self {
        let mut skirt = Self { edge, corners: Vec::new(), triangles: Vec::new() };
        // The vertices of the edge that the region's ends are.
        let ends = if region.points[0] == start { [0, 1] } else { [1, 0] };
        skirt.close_ends(&mut region, ends);
        if let Some(cover) = Cover::of(region.points, region.axis, rules) {
            skirt.add(&cover, ends);
        }
        skirt
    }

    /// A skirt with corners of its own, in the order of an edge that it looks like.
    fn over(edge: [u32; 2], cover: &Cover) -> Self {
        let mut skirt = Self { edge, corners: Vec::new(), triangles: Vec::new() };
        skirt.add(cover, [0, 1]);
        skirt
    }

    /// A skirt whose ends are no vertices of the mesh, which looks like some edge of it.
    fn alone(edge: [u32; 2], region: Region, rules: &SkirtRules) -> Self {
        let (first, last) = (region.points[0], region.points[region.points.len() - 1]);
        let mut skirt = Self::new(edge, region, first, rules);
        if skirt.triangles.as_flattened().iter().any(|&corner| corner < 2) {
            let ends = [skirt.corner(first, 0), skirt.corner(last, 1)];
            for corner in skirt.triangles.as_flattened_mut().iter_mut().filter(|at| **at < 2) {
                *corner = ends[usize::from(*corner)];
            }
        }
        skirt
    }

    /// Adds a vertex; returns its number among the corners of triangles.
    fn corner(&mut self, position: [f32; 3], like: u8) -> u8 {
        self.corners.push((position, like));
        self.corners.len() as u8 + 1
    }

    /// Covers what leads from ends of the span that lie beside the plane to their neighbours, and
    /// takes such ends away from the span.
    fn close_ends(&mut self, region: &mut Region, ends: [u8; 2]) {
        // The chord over what is left of the span.
        let mut chord = ends;
        for end in 0..2 {
            let points = region.points;
            if points.len() < 3 {
                return;
            }
            let last = points.len() - 1;
            let (at, next, rest) = match end {
                0 => (points[0], points[1], &points[1..]),
                _ => (points[last], points[last - 1], &points[..last]),
            };
            if at[region.axis] != region.coordinate {
                let corner = self.corner(next, ends[end]);
                self.triangles.push([chord[0], corner, chord[1]]);
                chord[end] = corner;
                region.points = rest;
            }
        }
    }

    /// Adds a polygon whose corners look like the ends that they lie at.
    fn add(&mut self, cover: &Cover, ends: [u8; 2]) {
        let all: Vec<u8> =
            cover.corners.iter().map(|&(at, end)| self.corner(at, ends[end])).collect();
        self.triangles.extend((2..all.len()).map(|third| [all[0], all[third - 1], all[third]]));
    }
}

/// Triangles of the skirts.
pub fn triangles_of(skirts: &[Skirt]) -> usize {
    skirts.iter().map(|skirt| skirt.triangles.len()).sum()
}

/// The skirts of `before` on a mesh of the same triangles, some of whose vertices became two: each
/// hangs on the vertices of the triangle that has its edge.
pub fn rehung(skirts: &[Skirt], before: &Mesh, after: &Mesh) -> Vec<Skirt> {
    if skirts.is_empty() {
        return Vec::new();
    }
    let mut edges: FxHashMap<[u32; 2], [u32; 2]> = FxHashMap::default();
    for (&[a, b, c], &[p, q, r]) in before.triangles.iter().zip(&after.triangles) {
        for (edge, own) in [([a, b], [p, q]), ([b, c], [q, r]), ([c, a], [r, p])] {
            edges.entry(edge).or_insert(own);
            edges.entry([edge[1], edge[0]]).or_insert([own[1], own[0]]);
        }
    }
    let rehung = |skirt: &Skirt| {
        let edge = edges.get(&skirt.edge).copied().unwrap_or(skirt.edge);
        Skirt { edge, ..skirt.clone() }
    };
    skirts.iter().map(rehung).collect()
}

/// Appends the skirts to a mesh.
pub fn append(mesh: &mut Mesh, skirts: &[Skirt]) -> AppendedSkirts {
    let mut alike = Vec::with_capacity(skirts.len() * 4);
    for skirt in skirts {
        let first = mesh.positions.len() as u32;
        for &(position, like) in &skirt.corners {
            let model = skirt.edge[usize::from(like)];
            let copy = mesh.push_copy(model as usize);
            mesh.positions[copy as usize] = position;
            alike.push([model, copy]);
        }
        let vertex = |corner: u8| match corner {
            0 | 1 => skirt.edge[usize::from(corner)],
            _ => first + u32::from(corner) - 2,
        };
        mesh.triangles.extend(skirt.triangles.iter().map(|triangle| triangle.map(vertex)));
    }
    AppendedSkirts { triangles: triangles_of(skirts), alike }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::builder::border::chain::{Chain, CutPlane};
    use crate::builder::border::span::{join_spans, original_spans};
    use crate::builder::constants::BorderConstants;
    use crate::lattice::Lattice;

    /// The skirt of the edge from the first to the last of some points, for the plane x = 0.
    fn rules() -> SkirtRules {
        SkirtRules { step: 1e-6, closed: 1e-6, constants: BorderConstants::default() }
    }

    fn over(points: &[[f32; 3]]) -> Skirt {
        let span = Region { points, axis: 0, coordinate: 0.0 };
        Skirt::new([7, 8], span, points[0], &rules())
    }

    #[test]
    fn ends_beside_the_plane_are_closed_by_triangles() {
        // 0.5 beside the plane at the first end, at both, and with nothing left to cover then.
        let [start, end] = [[0.5, 0.0, 0.0], [0.5, 4.0, 0.0]];
        let inner = [[0.0, 1.0, 0.0], [0.0, 2.0, 1.0], [0.0, 3.0, 0.0]];
        let one = over(&[start, inner[0], inner[1], inner[2]]);
        assert_eq!(one.triangles, [[0, 2, 1], [3, 4, 5]]);
        assert_eq!(one.corners[0], (inner[0], 0));
        let both = over(&[start, inner[0], inner[1], inner[2], end]);
        assert_eq!(both.triangles[..2], [[0, 2, 1], [2, 3, 1]]);
        assert_eq!(both.corners[1], (inner[2], 1));
        assert_eq!(both.triangles.len(), 3);
        let least = over(&[start, inner[0], end]);
        assert_eq!(least.triangles, [[0, 2, 1]]);
    }

    /// A polyline in the plane x = 0 of which every `each`-th vertex is kept, as a mesh whose border
    /// it is, each edge with a triangle behind it; and its skirts.
    fn of_border(heights: &[f32], each: usize, quantized: bool) -> (Vec<[f32; 3]>, Vec<Skirt>) {
        let positions: Vec<[f32; 3]> =
            (0..).zip(heights).map(|(y, &z)| [0.0, y as f32, z]).collect();
        let keep = (0..positions.len()).map(|at| if at % each == 0 { 0 } else { 9 }).collect();
        let chain = Chain { positions: positions.clone(), keep };
        let path = Path::default().with(Arc::new(CutPlane::from_chains(0, 0.0, vec![chain])));
        let count = positions.len();
        let fan = |step: usize| {
            let kept: Vec<u32> = (0..count as u32).step_by(step).collect();
            kept.windows(2).map(|w| [w[0], w[1], count as u32]).collect()
        };
        let mut mesh = Mesh { positions: positions.clone(), triangles: fan(1), ..Mesh::default() };
        mesh.positions.push([5.0, 0.0, 0.0]);
        mesh.materials = vec![0; count + 1];
        let mut border = Border::interior(count + 1);
        border.planes[..count].fill(1);
        let spans = original_spans(&mesh, &border, &path);
        mesh.triangles = fan(each);
        let spans = join_spans(spans, &path, 3, &mesh, &border);
        assert_eq!(spans.len(), (count - 1) / each);
        let lattice = Lattice { step: 1e-5 };
        let rules = SkirtRules::of(&lattice, quantized, BorderConstants::default());
        (positions, skirts(&mesh, &border, &spans, &path, &rules))
    }

    #[test]
    fn nothing_covers_what_is_open_by_rounding_alone() {
        assert!(of_border(&[0.0; 33], 4, false).1.is_empty());
        let mut heights = [0.0; 33];
        heights[6] = 1.4e-5;
        assert!(of_border(&heights, 4, false).1.is_empty());
        heights[6] = 0.01;
        assert_eq!(triangles_of(&of_border(&heights, 4, false).1), 1);
    }

    #[test]
    fn a_step_of_a_lattice_that_shows_is_covered_and_nothing_less() {
        let mut heights = [0.0; 33];
        assert!(of_border(&heights, 4, true).1.is_empty());
        heights[6] = 1e-5;
        assert_eq!(of_border(&heights, 4, true).1.len(), 1);
        assert!(of_border(&heights, 4, false).1.is_empty());
    }

    #[test]
    fn spans_of_like_height_share_a_skirt_and_all_are_covered() {
        let zigzag: Vec<f32> = (0..65).map(|at| [0.0, 0.3, -0.3, 0.2][at % 4]).collect();
        let (points, shared) = of_border(&zigzag, 4, false);
        assert_eq!(triangles_of(&shared), 2, "16 spans");
        for &[_, y, z] in &points {
            let covered = shared.iter().any(|skirt| {
                let of = |axis: usize| skirt.corners.iter().map(move |corner| corner.0[axis]);
                let within = |axis: usize, at: f32| {
                    of(axis).fold(f32::MAX, f32::min) < at && at < of(axis).fold(f32::MIN, f32::max)
                };
                within(1, y) && within(2, z)
            });
            assert!(covered, "{y}, {z}");
        }
        // A hill that spans climb and descend is no reason for a skirt as high as it is.
        let hill: Vec<f32> =
            (0..65).map(|at| zigzag[at] + 20.0 - (at as f32 - 32.0).abs()).collect();
        let (_, shared) = of_border(&hill, 4, false);
        assert!(shared.len() > 1);
        // Neither is one spike.
        let mut spike = vec![0.0; 65];
        spike[30] = 5.0;
        let (_, alone) = of_border(&spike, 4, false);
        assert_eq!((alone.len(), triangles_of(&alone)), (1, 1));
    }

    #[test]
    fn a_skirt_without_an_edge_has_all_its_corners() {
        let points = [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 1.0], [0.0, 3.0, 0.0]];
        let span = || Region { points: &points, axis: 0, coordinate: 0.0 };
        let (hung, alone) = (over(&points), Skirt::alone([3, 4], span(), &rules()));
        assert_eq!(alone.edge, [3, 4]);
        let places = |skirt: &Skirt| -> Vec<[[f32; 3]; 3]> {
            let place = |corner: u8| match corner {
                0 => points[0],
                1 => points[3],
                _ => skirt.corners[usize::from(corner) - 2].0,
            };
            skirt.triangles.iter().map(|triangle| triangle.map(place)).collect()
        };
        assert_eq!(places(&hung), places(&alone));
        assert!(alone.triangles.as_flattened().iter().all(|&corner| corner >= 2));
    }

    #[test]
    fn corners_look_like_the_ends_that_they_lie_at() {
        let mut mesh = Mesh {
            positions: (0..9).map(|i| [i as f32, 0.0, 0.0]).collect(),
            materials: (0..9).collect(),
            ..Mesh::default()
        };
        let skirts = [over(&[[0.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.0, 2.0, 0.0]])];
        let AppendedSkirts { triangles, alike } = append(&mut mesh, &skirts);
        assert_eq!(triangles, triangles_of(&skirts));
        assert_eq!(alike.len(), 3);
        assert!(alike.iter().all(|&[model, copy]| mesh.materials[copy as usize] == model));
        assert_eq!([alike[0][0], alike[1][0]], [7, 8], "one at each end");
        assert_eq!(mesh.triangles.len(), triangles_of(&skirts));
    }
}
