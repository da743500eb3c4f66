//! Lids: what closes the section of a body whose part on this side of a cut is gone.
//!
//! A cut through a house leaves two halves that are open to each other. Where simplification gives
//! one half up, edges of the border go with it, and who looks from there would see into the other
//! half, whatever level that has. A collapse that ends well leaves the section as a face; where it
//! did not, or other ways than collapse were taken, the section is closed here.
//!
//! An edge that is lost alone bounds no section, but the neighbour is open there: it comes back with the triangle
//! that had it.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use crate::builder::border::chain::{BorderVertex, chains_of};
use crate::builder::border::rank::SurfaceQuadric;
use crate::builder::border::span::{BorderSpan, edges_of};
use crate::builder::border::thin::{EdgeKey, edge_key};
use crate::builder::border::vertex::{Border, Path};
use crate::builder::simplify::simplified::Simplified;
use crate::mesh::{Mesh, PositionKey, Triangulator, key};

/// A mesh whose vertices are found by position.
struct Side<'a> {
    mesh: &'a Mesh,
    border: &'a Border,
    /// The vertices at each position, in order.
    at: FxHashMap<PositionKey<f32>, Vec<u32>>,
}

impl<'a> Side<'a> {
    fn new(mesh: &'a Mesh, border: &'a Border) -> Self {
        let mut at: FxHashMap<PositionKey<f32>, Vec<u32>> = FxHashMap::default();
        for (vertex, &position) in mesh.positions.iter().enumerate() {
            at.entry(key(position)).or_default().push(vertex as u32);
        }
        Self { mesh, border, at }
    }

    /// The vertex at a place, if possible one of a material.
    fn find(&self, place: PositionKey<f32>, material: Option<u32>) -> Option<u32> {
        let all = self.at.get(&place)?;
        let fits = |vertex: &&u32| material == Some(self.mesh.materials[**vertex as usize]);
        all.iter().find(fits).or(all.first()).copied()
    }
}

/// Closes what the edges leave open that `runs` stand for and `result` has not. `thinned` is what
/// it was simplified from, and has them.
pub fn cap_sections(
    result: &mut Simplified,
    runs: &[BorderSpan],
    path: &Path,
    thinned: &Mesh,
    thinned_border: &Border,
) {
    let lost = lost_edges(runs, path, &result.mesh, &result.border);
    if lost.is_empty() {
        return;
    }
    let Some((low, high)) = thinned.bounds() else { return };
    let middle: [f32; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) * 0.5);
    let source = Side::new(thinned, thinned_border);
    let mut triangulator = Triangulator::default();
    let mut of_edge = None;
    for (plane, edges) in lost {
        let plane = path.plane(plane);
        // Lids face away from the other half, to where the rest of this node is.
        let above = middle[plane.axis] > plane.coordinate;
        for section in sections(&edges, &source) {
            if let &[a, b] = &section[..] {
                let of_edge = of_edge.get_or_insert_with(|| border_triangles(&source, path));
                if let Some(triangle) = of_edge.get(&edge_key(thinned, [a, b])) {
                    let vertices = corners_of(triangle, &source, result);
                    result.mesh.triangles.extend(<[u32; 3]>::try_from(vertices));
                }
                continue;
            }
            let corners: Vec<[f64; 3]> = section
                .iter()
                .map(|&vertex| thinned.positions[vertex as usize].map(f64::from))
                .collect();
            let triangles = triangulator.triangulate(&corners);
            if triangles.is_empty() {
                continue;
            }
            let turned = normal_along(plane.axis, &corners, triangles) < 0.0;
            let vertices = corners_of(&section, &source, result);
            result.mesh.triangles.extend(triangles.iter().map(|&[a, b, c]| {
                let triangle = if turned == above { [a, c, b] } else { [a, b, c] };
                triangle.map(|corner| vertices[corner as usize])
            }));
        }
    }
}

/// By plane, the edges that runs stand for and the mesh has not. What has an edge twice is a slit
/// that thinned to a line and has nothing to close.
fn lost_edges(
    runs: &[BorderSpan],
    path: &Path,
    mesh: &Mesh,
    border: &Border,
) -> BTreeMap<u32, Vec<EdgeKey>> {
    let there = edges_of(runs, path, mesh, border);
    let mut lost: BTreeMap<(u32, EdgeKey), u32> = BTreeMap::new();
    for run in runs {
        let edge = run.edge(path);
        if !there.contains_key(&edge) && edge[0] != edge[1] {
            *lost.entry((run.plane(), edge)).or_default() += 1;
        }
    }
    let mut by_plane: BTreeMap<u32, Vec<EdgeKey>> = BTreeMap::new();
    for ((plane, edge), _) in lost.into_iter().filter(|(_, times)| times % 2 == 1) {
        by_plane.entry(plane).or_default().push(edge);
    }
    by_plane
}

/// The polygons that lost edges bound, each as vertices of the source: from one vertex at which
/// they end, part or meet to the next, and straight back; or round.
fn sections(edges: &[EdgeKey], source: &Side) -> Vec<Vec<u32>> {
    let mut numbers: BTreeMap<PositionKey<f32>, u32> = BTreeMap::new();
    let mut vertices: Vec<u32> = Vec::new();
    let mut numbered: Vec<[u32; 2]> = Vec::new();
    for edge in edges {
        let [Some(a), Some(b)] = edge.map(|end| source.find(end, None)) else { continue };
        let ends = [a, b];
        let [a, b] = [0, 1].map(|end| {
            *numbers.entry(edge[end]).or_insert_with(|| {
                vertices.push(ends[end]);
                vertices.len() as u32 - 1
            })
        });
        numbered.push([a, b]);
    }
    let of_border = |&vertex: &u32| {
        let position = source.mesh.positions[vertex as usize];
        BorderVertex { position, fixed: false, surface: SurfaceQuadric::default(), gone: false }
    };
    let all: Vec<BorderVertex> = vertices.iter().map(of_border).collect();
    let mut sections = chains_of(&all, &numbered);
    for section in &mut sections {
        if section.first() == section.last() {
            section.pop();
        }
        section.iter_mut().for_each(|vertex| *vertex = vertices[*vertex as usize]);
    }
    sections.retain(|section| section.len() >= 2);
    sections
}

/// The first triangle that has each edge between vertices of the border.
fn border_triangles(side: &Side, path: &Path) -> FxHashMap<EdgeKey, [u32; 3]> {
    let is_on_border = |&vertex: &u32| side.border.planes[vertex as usize] & path.bits() != 0;
    let mut of_edge = FxHashMap::default();
    for &[a, b, c] in &side.mesh.triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            if ends.iter().all(is_on_border) {
                of_edge.entry(edge_key(side.mesh, ends)).or_insert([a, b, c]);
            }
        }
    }
    of_edge
}

/// Twice the area of triangles, seen along an axis.
fn normal_along(axis: usize, corners: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
    let area = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
        (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u])
    };
    triangles.iter().map(area).sum()
}

/// The corners of a lid as vertices of the result, all of one material: those that it has, and
/// copies of the source's.
fn corners_of(section: &[u32], source: &Side, result: &mut Simplified) -> Vec<u32> {
    let material = source.mesh.materials[section[0] as usize];
    let Simplified { mesh, border, .. } = result;
    let there = Side::new(mesh, border);
    let of = |&vertex: &u32| {
        let place = key(source.mesh.positions[vertex as usize]);
        let own = there.find(place, Some(material));
        own.filter(|&own| mesh.materials[own as usize] == material).ok_or(place)
    };
    let found: Vec<Result<u32, PositionKey<f32>>> = section.iter().map(of).collect();
    let mut take = |place: PositionKey<f32>, vertex: u32| {
        let like = source.find(place, Some(material)).unwrap_or(vertex) as usize;
        let copy = mesh.push_vertex_from(source.mesh, like);
        mesh.materials[copy as usize] = material;
        border.planes.push(source.border.planes[like]);
        border.keep.push(source.border.keep[like]);
        copy
    };
    let corners = section.iter().zip(found);
    corners.map(|(&vertex, found)| found.unwrap_or_else(|place| take(place, vertex))).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::builder::border::chain::{Chain, CutPlane};
    use crate::builder::border::span::original_spans;
    use crate::builder::simplify::compact::compact;
    use crate::builder::simplify::simplified::LadderStep;

    /// The half of a house behind the plane x = 0, 5 wide and 3 high with a ridge at 5, and a
    /// triangle apart.
    fn half(sign: f32) -> (Mesh, Border, Path) {
        let section = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [2.5, 5.0], [0.0, 3.0]];
        let mut mesh = Mesh::default();
        for x in [0.0, 8.0 * sign] {
            mesh.positions.extend(section.map(|[y, z]| [x, y, z]));
        }
        mesh.positions
            .extend([[0.0, 0.0], [9.0, 0.0], [0.0, 9.0]].map(|[y, z]| [50.0 * sign, y, z]));
        for at in 0..5 {
            let next = (at + 1) % 5;
            mesh.triangles.extend([[at, next, next + 5], [at, next + 5, at + 5]]);
        }
        mesh.triangles.extend([[5, 6, 7], [5, 7, 8], [5, 8, 9], [10, 11, 12]]);
        mesh.materials = vec![0; mesh.positions.len()];
        let mut border = Border::interior(mesh.positions.len());
        border.planes[..5].fill(1);
        let mut round: Vec<[f32; 3]> = mesh.positions[..5].to_vec();
        round.push(round[0]);
        let chain = Chain { positions: round, keep: vec![0; 6] };
        let path = Path::default().with(Arc::new(CutPlane::from_chains(0, 0.0, vec![chain])));
        (mesh, border, path)
    }

    /// What a simplification leaves of some triangles, with its lids; the lids' triangles apart.
    fn closed(sign: f32, kept: impl Fn(usize) -> bool) -> (Simplified, Vec<[[f32; 3]; 3]>) {
        let (mesh, border, path) = half(sign);
        let runs = original_spans(&mesh, &border, &path);
        assert_eq!(runs.len(), 5);
        let triangles = (0..mesh.triangles.len()).filter(|&at| kept(at));
        let rest =
            Mesh { triangles: triangles.map(|at| mesh.triangles[at]).collect(), ..mesh.clone() };
        let (rest, rest_border) = compact(&rest, &border);
        let before = rest.triangles.len();
        let step = LadderStep::Collapse;
        let mut result = Simplified { mesh: rest, border: rest_border, error: 0.0, step };
        cap_sections(&mut result, &runs, &path, &mesh, &border);
        let caps = result.mesh.triangles[before..]
            .iter()
            .map(|triangle| triangle.map(|vertex| result.mesh.positions[vertex as usize]))
            .collect();
        (result, caps)
    }

    /// The area of triangles in the plane x = 0, seen along x.
    fn area(triangles: &[[[f32; 3]; 3]]) -> f32 {
        let of = |[a, b, c]: &[[f32; 3]; 3]| {
            assert_eq!([a[0], b[0], c[0]], [0.0; 3]);
            0.5 * ((b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1]))
        };
        triangles.iter().map(of).sum()
    }

    #[test]
    fn a_half_that_is_gone_leaves_a_lid_that_faces_this_way() {
        for sign in [1.0, -1.0] {
            let (result, caps) = closed(sign, |at| at == 13);
            assert_eq!(caps.len(), 3);
            assert_eq!(area(&caps), sign * 20.0);
            assert_eq!(result.mesh.positions.len(), 3 + 5, "each corner once");
            assert_eq!(result.border.planes, [0, 0, 0, 1, 1, 1, 1, 1]);
        }
    }

    #[test]
    fn where_some_edges_are_left_the_rest_is_closed() {
        // The floor and a wall stay.
        let (result, caps) = closed(1.0, |at| at < 4);
        assert_eq!(area(&caps), 0.5 * 2.0 * 5.0 + 0.5 * 3.0 * 5.0);
        assert_eq!(result.mesh.positions.len(), 6 + 2);
        let (_, caps) = closed(1.0, |at| at < 10);
        assert!(caps.is_empty(), "no edge of the border is gone");
    }

    #[test]
    fn an_edge_that_is_lost_alone_comes_back_with_its_triangle() {
        let (mesh, ..) = half(1.0);
        let (result, added) = closed(1.0, |at| at < 8);
        assert_eq!(added, [mesh.triangles[8].map(|vertex| mesh.positions[vertex as usize])]);
        assert_eq!(result.mesh.positions.len(), 10, "the corners are there");
    }
}
