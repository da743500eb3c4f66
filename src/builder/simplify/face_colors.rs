//! Colours of coarse triangles, where colours belong to faces.
//!
//! Plain materials are no property of vertices: collapsed with these, a roof's red runs down the
//! walls. A coarse triangle gets the one colour that covers most of what it stands for: each point
//! of the original votes for the triangle that is nearest to it, and counts by how much it faces the
//! same way, so that the walls of a courtyard that was built over do not colour its roof.

use std::collections::BTreeMap;

use glam::Vec3;
use rustc_hash::FxHashMap;

use crate::builder::border::skirt::Skirt;
use crate::builder::error::{Face, NearestTriangle, SearchableSurface, point_of};
use crate::mesh::Mesh;

/// Points of the original that vote for each coarse triangle on average, if both have the same area.
const POINTS: f64 = 8.0;

/// The most points for each on average, where the original has many times the area: rooms behind walls.
const MOST_POINTS: f64 = 64.0;

/// What does not face the way of a triangle counts for so much, where nothing does.
const ASIDE: f64 = 0.01;

/// A mesh whose triangles have each the colour of most of the original that is nearest to them, and
/// its skirts; `None` where the original's colours are not those of faces.
pub fn with_face_colors(
    mesh: &Mesh,
    skirts: &[Skirt],
    original: &SearchableSurface,
) -> Option<(Mesh, Vec<Skirt>)> {
    let votes = votes(mesh, original)?;
    let mut painted = mesh.clone();
    // The first triangle of a vertex paints it; others get copies.
    let mut colored: Vec<Option<[u16; 4]>> = vec![None; mesh.positions.len()];
    let mut copies: FxHashMap<(u32, [u16; 4]), u32> = FxHashMap::default();
    let mut edges: FxHashMap<[u32; 2], [u32; 2]> = FxHashMap::default();
    for (number, votes) in votes.iter().enumerate() {
        let corners = mesh.triangles[number];
        let material = mesh.materials[corners[0] as usize];
        let fitting = votes.iter().filter(|(face, _)| face.material == material);
        let most = fitting.max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)));
        // What is nearest to nothing looks like what is nearest to it.
        let nearest = || {
            let sum: Vec3 = corners.iter().map(|&v| Vec3::from(mesh.positions[v as usize])).sum();
            original.face_near(sum / 3.0).filter(|face| face.material == material)
        };
        let color = match most.map(|(face, _)| *face).or_else(nearest) {
            Some(face) => face.color,
            None => mesh.colors[corners[0] as usize],
        };
        let new = corners.map(|vertex| {
            let own = &mut colored[vertex as usize];
            if *own.get_or_insert(color) == color {
                painted.colors[vertex as usize] = color;
                return vertex;
            }
            *copies.entry((vertex, color)).or_insert_with(|| {
                let copy = painted.push_copy(vertex as usize);
                painted.colors[copy as usize] = color;
                copy
            })
        });
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            edges.insert([corners[from], corners[to]], [new[from], new[to]]);
        }
        painted.triangles[number] = new;
    }
    let of_edge = |skirt: &Skirt| {
        let [a, b] = skirt.edge;
        let back = || edges.get(&[b, a]).map(|&[b, a]| [a, b]);
        let edge = edges.get(&[a, b]).copied().or_else(back).unwrap_or([a, b]);
        Skirt { edge, ..skirt.clone() }
    };
    Some((painted, skirts.iter().map(of_edge).collect()))
}

/// By triangle, the points of the original of each colour that are nearest to it, each by how much it faces its
/// way.
fn votes(mesh: &Mesh, original: &SearchableSurface) -> Option<Vec<BTreeMap<Face, f64>>> {
    if mesh.colors.is_empty() {
        return None;
    }
    let nearest = NearestTriangle::of(mesh)?;
    let mut nearest = nearest.search();
    let mut votes = vec![BTreeMap::new(); mesh.triangles.len()];
    let (_, _, first) = original.faces()?.next()?;
    if original.faces()?.all(|(_, _, face)| face.color == first.color) {
        return None;
    }
    let area: f64 = original.faces()?.map(|(_, area, _)| area).sum();
    let points = (POINTS * area / mesh.area()).clamp(POINTS, MOST_POINTS);
    let share = area / (points * mesh.triangles.len() as f64);
    let corners = |triangle: &[u32; 3]| triangle.map(|v| Vec3::from(mesh.positions[v as usize]));
    let normals: Vec<Vec3> = mesh.triangles.iter().map(|t| normal(corners(t))).collect();
    let (mut passed, mut number) = (0.0, 0);
    for (corners, area, face) in original.faces()? {
        passed += area;
        let own = normal(corners);
        while (number as f64 + 0.5) * share < passed {
            let triangle = nearest(point_of(corners, number)) as usize;
            let facing = f64::from(own.dot(normals[triangle]).max(0.0));
            *votes[triangle].entry(face).or_insert(0.0) += (facing * facing).max(ASIDE);
            number += 1;
        }
    }
    Some(votes)
}

/// Of unit length; zero where a triangle has no area.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::constants::MeasureConstants;

    const RED: [u16; 4] = [60_000, 5_000, 5_000, u16::MAX];
    const WHITE: [u16; 4] = [u16::MAX; 4];

    /// A sheet of squares over [0, 10]², each with vertices of its own of one colour.
    fn sheet(squares: u16, color: impl Fn(f32) -> [u16; 4]) -> Mesh {
        let mut mesh = Mesh::default();
        let side = 10.0 / f32::from(squares);
        for (x, y) in (0..squares).flat_map(|y| (0..squares).map(move |x| (x, y))) {
            let first = mesh.positions.len() as u32;
            let at = |dx: u16, dy: u16| [f32::from(x + dx) * side, f32::from(y + dy) * side, 0.0];
            mesh.positions.extend([at(0, 0), at(1, 0), at(1, 1), at(0, 1)]);
            mesh.colors.extend([color((f32::from(x) + 0.5) * side); 4]);
            mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v)));
        }
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    /// Two triangles and a narrow one beside them, of shared vertices and no sensible colours.
    fn coarse() -> Mesh {
        let positions: Vec<[f32; 3]> =
            [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0], [-0.1, 5.0]]
                .map(|[x, y]| [x, y, 0.1])
                .to_vec();
        Mesh {
            colors: (0..positions.len() as u16).map(|n| [n, 77, 99, u16::MAX]).collect(),
            materials: vec![0; positions.len()],
            triangles: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]],
            positions,
            ..Mesh::default()
        }
    }

    fn original(mesh: &Mesh) -> SearchableSurface {
        SearchableSurface::of(mesh, MeasureConstants::default())
    }

    fn looks(mesh: &Mesh) -> Vec<Option<[u16; 4]>> {
        mesh.triangles.iter().map(|&t| Face::of(mesh, t).map(|face| face.color)).collect()
    }

    #[test]
    fn a_triangle_has_the_colour_of_most_of_what_is_nearest_to_it() {
        // Red to x = 6: two thirds of the left triangle and a third of the right one.
        let source = sheet(20, |x| if x < 6.0 { RED } else { WHITE });
        let skirt = |edge| Skirt { edge, corners: vec![([0.0; 3], 0)], triangles: vec![[0, 1, 2]] };
        let (painted, skirts) =
            with_face_colors(&coarse(), &[skirt([1, 2]), skirt([2, 3])], &original(&source))
                .unwrap();
        assert_eq!(looks(&painted), [Some(WHITE), Some(RED), Some(RED)]);
        // No place moved: copies of the two vertices on the border of both colours.
        assert_eq!(painted.positions.len(), 7);
        for (new, old) in painted.triangles.iter().zip(coarse().triangles) {
            let places = |mesh: &Mesh, t: [u32; 3]| t.map(|v| mesh.positions[v as usize]);
            assert_eq!(places(&painted, *new), places(&coarse(), old));
        }
        // Skirts look like the triangle that they hang from.
        let of = |skirt: &Skirt| skirt.edge.map(|vertex| painted.colors[vertex as usize]);
        assert_eq!(skirts.iter().map(of).collect::<Vec<_>>(), [[WHITE; 2], [RED; 2]]);
    }

    #[test]
    fn votes_are_areas_not_triangles() {
        // As many triangles left of x = 1 as right of it.
        let mut source = sheet(20, |_| RED);
        for (position, color) in source.positions.iter_mut().zip(&mut source.colors) {
            let x = position[0];
            position[0] = if x <= 5.0 { x * 0.2 } else { 1.0 + (x - 5.0) * 1.8 };
            *color = WHITE;
        }
        for square in (0..400).filter(|square| square % 20 < 10) {
            source.colors[square * 4..square * 4 + 4].fill(RED);
        }
        let (painted, _) = with_face_colors(&coarse(), &[], &original(&source)).unwrap();
        assert_eq!(looks(&painted)[..2], [Some(WHITE); 2]);
    }

    #[test]
    fn walls_of_a_court_below_do_not_colour_a_roof() {
        // Of a red sheet a fifth is left, above white walls of ten times its area and a white floor.
        let mut source = sheet(20, |x| if x < 2.0 { RED } else { WHITE });
        for (position, color) in source.positions.iter_mut().zip(&source.colors) {
            position[2] = if *color == RED { 0.0 } else { -3.0 };
        }
        for t in &mut source.triangles {
            if source.colors[t[0] as usize] == WHITE {
                *t = [t[0], t[2], t[1]];
            }
        }
        for n in 0..20u8 {
            let (first, x) = (source.positions.len() as u32, 2.0 + f32::from(n) * 0.4);
            source.positions.extend([[x, 0.0, 0.0], [x, 10.0, 0.0], [x, 5.0, -8.0]]);
            source.colors.extend([WHITE; 3]);
            source.materials.extend([0; 3]);
            source.triangles.push([first, first + 1, first + 2]);
        }
        let (painted, _) = with_face_colors(&coarse(), &[], &original(&source)).unwrap();
        assert_eq!(looks(&painted)[1], Some(RED));
        // Where nothing faces its way it looks like what there is.
        let mut turned = sheet(20, |x| if x < 6.0 { RED } else { WHITE });
        turned.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        let (painted, _) = with_face_colors(&coarse(), &[], &original(&turned)).unwrap();
        assert_eq!(looks(&painted), [Some(WHITE), Some(RED), Some(RED)]);
    }

    #[test]
    fn smooth_colours_one_colour_and_none_are_left_alone() {
        let mut smooth = sheet(4, |_| RED);
        smooth.colors[0] = WHITE;
        assert!(with_face_colors(&coarse(), &[], &original(&smooth)).is_none());
        assert!(with_face_colors(&coarse(), &[], &original(&sheet(4, |_| RED))).is_none());
        let plain = Mesh { colors: Vec::new(), ..sheet(4, |_| RED) };
        let uncolored = Mesh { colors: Vec::new(), ..coarse() };
        assert!(with_face_colors(&uncolored, &[], &original(&plain)).is_none());
    }
}
