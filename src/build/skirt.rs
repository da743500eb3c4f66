//! Skirts: what closes the gap between two levels that meet at a cutting plane.
//!
//! A node's border follows the original border with fewer vertices. The region between the two
//! lies in the cutting plane; the skirt of a border edge is the smallest rectangle in that plane
//! that contains the edge and the original polyline that it stands for. The neighbour's border
//! follows the same polyline and has skirts over its own deviation, so whatever the two levels
//! are, both sides reach the original polyline and nothing shows between them. A leaf follows the
//! original exactly and needs none.

use super::border::{Border, Path};
use super::thin_border::border_edges;
use crate::mesh::{Mesh, wide};

/// A rectangle over one border edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Skirt {
    /// The edge's vertices; the rectangle looks like them.
    pub edge: [u32; 2],
    /// Its corners: two beside the first vertex, two beside the second.
    pub corners: [[f32; 3]; 4],
}

/// The rectangles reach this share of their own width beyond the polyline.
const MARGIN: f64 = 0.02;

/// The skirts that a node of `path` at `level` needs. `step` is the lattice step in metres.
pub fn skirts(mesh: &Mesh, border: &Border, path: &Path, level: u8, step: f64) -> Vec<Skirt> {
    let bits = path.bits();
    let mut result = Vec::new();
    for edge in border_edges(mesh, border, path) {
        let [a, b] = edge.map(|vertex| mesh.positions[vertex as usize]);
        let mut common = border.planes[edge[0] as usize] & border.planes[edge[1] as usize] & bits;
        while common != 0 {
            let plane = path.plane(common.trailing_zeros());
            common &= common - 1;
            let Some(run) = plane.run_between(a, b, level) else { continue };
            if run.len() > 2 {
                result.extend(cover(edge, a, b, run, plane.axis, step));
            }
            break;
        }
    }
    result
}

/// The rectangle in the plane perpendicular to `axis` over the edge from `a` to `b` and `run`.
fn cover(
    edge: [u32; 2],
    a: [f32; 3],
    b: [f32; 3],
    run: &[[f32; 3]],
    axis: usize,
    step: f64,
) -> Option<Skirt> {
    let (start, end) = (wide(a), wide(b));
    let along = (end - start).try_normalize()?;
    let mut normal = glam::DVec3::ZERO;
    normal[axis] = 1.0;
    let across = normal.cross(along).try_normalize()?;
    let (mut low, mut high) = (0f64, 0f64);
    let (mut first, mut last) = (0f64, start.distance(end));
    for &point in run {
        let from_start = wide(point) - start;
        let (here, beside) = (from_start.dot(along), from_start.dot(across));
        (low, high) = (low.min(beside), high.max(beside));
        (first, last) = (first.min(here), last.max(here));
    }
    let margin = (high - low) * MARGIN + 2.0 * step;
    let corner = |here: f64, beside: f64| (start + along * here + across * beside).as_vec3().into();
    Some(Skirt {
        edge,
        corners: [
            corner(first, low - margin),
            corner(first, high + margin),
            corner(last, low - margin),
            corner(last, high + margin),
        ],
    })
}

/// Triangles of the skirts.
pub const TRIANGLES_PER_SKIRT: usize = 2;

/// Appends the skirts to a mesh. Returns pairs of vertices that look alike: a skirt's corner and
/// the border vertex that it copies.
pub fn append(mesh: &mut Mesh, skirts: &[Skirt]) -> Vec<[u32; 2]> {
    let mut alike = Vec::with_capacity(skirts.len() * 4);
    for skirt in skirts {
        let first = mesh.positions.len() as u32;
        for (corner, &position) in skirt.corners.iter().enumerate() {
            let model = skirt.edge[corner / 2];
            alike.push([model, mesh.push_copy(model as usize)]);
            mesh.positions[first as usize + corner] = position;
        }
        mesh.triangles.push([first, first + 2, first + 3]);
        mesh.triangles.push([first, first + 3, first + 1]);
    }
    alike
}
