//! Closing the slits between the children of a node where they are joined.
//!
//! Both sides of a plane thin their border alike, but for one vertex: where a later plane, which cuts
//! one side only, meets it. There that side keeps a vertex, since it is a corner between three
//! chunks, that the other side does without. Between nodes skirts cover what is open; between the
//! children of one node it would stay open for ever. Joined, no plane needs that vertex any more: it
//! is collapsed along the border, as if it had been gone on both sides.

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHashSet};

use super::thin::{EdgeKey, collapse_along, edge_key};
use super::vertex::Border;
use crate::mesh::{Mesh, PositionKey, key, wide};

/// Collapses vertices that lie on a plane between joined children and that only one side of it has.
/// `released` says which vertices lie on such planes; `border` is what remains, whose vertices stay.
/// Vertices on a seam of texture stay too: what they would be collapsed onto looks otherwise.
pub fn close_slits(mesh: &mut Mesh, border: &Border, released: &[bool]) {
    let edges = open_edges(mesh, released);
    if edges.is_empty() {
        return;
    }
    let mut gone = vec![false; mesh.positions.len()];
    for vertex in one_sided(mesh, &edges) {
        gone[vertex as usize] = border.planes[vertex as usize] == 0;
    }
    collapse_along(mesh, &edges, |vertex| released[vertex], &mut gone);
}

/// The edges between released vertices that an odd number of triangles has, each as the first
/// triangle that has it winds.
fn open_edges(mesh: &Mesh, released: &[bool]) -> Vec<[u32; 2]> {
    let mut count: FxHashMap<EdgeKey, (u32, [u32; 2])> = FxHashMap::default();
    for &[a, b, c] in &mesh.triangles {
        for ends in [[a, b], [b, c], [c, a]] {
            if ends.iter().all(|&end| released[end as usize]) {
                count.entry(edge_key(mesh, ends)).or_insert((0, ends)).0 += 1;
            }
        }
    }
    let open = count.into_values().filter(|(uses, _)| uses % 2 == 1);
    let mut edges: Vec<[u32; 2]> = open.map(|(_, ends)| ends).collect();
    edges.sort_unstable();
    edges
}

/// Of the ends of edges, those whose edges lie in one plane across an axis, and whose triangles all
/// lie on one side of it.
fn one_sided(mesh: &Mesh, edges: &[[u32; 2]]) -> Vec<u32> {
    // By position: the axis and coordinate of the plane, and which sides have triangles.
    let mut planes: FxHashMap<PositionKey<f32>, Option<(usize, f32)>> = FxHashMap::default();
    let mut ends: Vec<u32> = edges.iter().flatten().copied().collect();
    ends.sort_unstable();
    ends.dedup();
    for edge in edges {
        let [a, b] = edge.map(|end| mesh.positions[end as usize]);
        let mut axes = (0..3).filter(|&axis| a[axis] == b[axis]);
        // An edge along an axis lies in two such planes, and one whose other end is beside its plane
        // in none; the vertex's other edge decides.
        let (Some(axis), None) = (axes.next(), axes.next()) else { continue };
        let plane = Some((axis, a[axis]));
        for end in [a, b] {
            let known = planes.entry(key(end)).or_insert(plane);
            if *known != plane {
                *known = None;
            }
        }
    }
    let mut sides: FxHashMap<PositionKey<f32>, [bool; 2]> = FxHashMap::default();
    for triangle in &mesh.triangles {
        let corners = triangle.map(|vertex| mesh.positions[vertex as usize]);
        for corner in corners {
            if let Some(Some((axis, at))) = planes.get(&key(corner)) {
                let middle = corners.map(wide).into_iter().sum::<DVec3>()[*axis] / 3.0;
                let [below, above] = sides.entry(key(corner)).or_default();
                *below |= middle < f64::from(*at);
                *above |= middle > f64::from(*at);
            }
        }
    }
    let one: FxHashSet<PositionKey<f32>> = sides
        .into_iter()
        .filter(|(_, [below, above])| below != above)
        .map(|(position, _)| position)
        .collect();
    ends.retain(|&end| one.contains(&key(mesh.positions[end as usize])));
    ends
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sheets that meet at x = 0 between `y = 0` and `y = 4`: below it with these border
    /// vertices, above it with those.
    fn sheets(below: &[[f32; 2]], above: &[[f32; 2]]) -> Mesh {
        let mut mesh = Mesh::default();
        let mut at = |position: [f32; 3]| match mesh.positions.iter().position(|&p| p == position) {
            Some(known) => known as u32,
            None => {
                mesh.positions.push(position);
                mesh.positions.len() as u32 - 1
            }
        };
        let mut triangles = Vec::new();
        for (x, border) in [(-3.0, below), (3.0, above)] {
            let far = at([x, 2.0, 0.0]);
            let line: Vec<u32> = border.iter().map(|&[y, z]| at([0.0, y, z])).collect();
            triangles.extend(line.windows(2).map(|ends| [ends[0], ends[1], far]));
        }
        mesh.triangles = triangles;
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    fn closed(mut mesh: Mesh) -> (Mesh, usize) {
        let released: Vec<bool> = mesh.positions.iter().map(|p| p[0] == 0.0).collect();
        let border = Border::interior(mesh.positions.len());
        close_slits(&mut mesh, &border, &released);
        let open = open_edges(&mesh, &released).len();
        (mesh, open)
    }

    #[test]
    fn what_one_side_has_alone_goes_and_both_meet() {
        let straight = [[0.0, 0.0], [4.0, 0.0]];
        let bent = [[0.0, 0.0], [1.0, 0.3], [4.0, 0.0]];
        let other = [[0.0, 0.0], [3.0, -0.2], [3.5, 0.1], [4.0, 0.0]];
        for (below, above) in [(&straight[..], &bent[..]), (&bent, &straight), (&bent, &other)] {
            let before = sheets(below, above);
            let released = vec![true; before.positions.len()];
            let slit = below.len() + above.len() - 2;
            assert_eq!(
                open_edges(&before, &released)
                    .iter()
                    .filter(|e| e.iter().all(|&v| before.positions[v as usize][0] == 0.0))
                    .count(),
                slit
            );
            let (mesh, open) = closed(before);
            assert_eq!(open, 0);
            assert_eq!(mesh.triangles.len(), 2);
        }
    }

    #[test]
    fn what_both_sides_have_stays_and_so_does_a_border_of_the_node() {
        let both = [[0.0, 0.0], [1.0, 0.3], [4.0, 0.0]];
        let mesh = sheets(&both, &both);
        assert_eq!(closed(mesh.clone()).0, mesh);
        let mut mesh = sheets(&both, &both[..2]);
        let before = mesh.clone();
        let released = vec![true; mesh.positions.len()];
        let border = Border {
            planes: vec![1; mesh.positions.len()],
            ..Border::interior(mesh.positions.len())
        };
        close_slits(&mut mesh, &border, &released);
        assert_eq!(mesh, before);
    }
}
