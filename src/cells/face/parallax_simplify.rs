//! Fewer triangles for a surface, within pixels of it as seen from anywhere in its cell.

use meshopt::{SimplifyOptions, VertexDataAdapter, simplify};

use super::depths::Depths;
use super::parallax_mesh::ParallaxMesh;
use super::raster::triangle;
use crate::{Error, Result};

/// What quadrics estimate is a mean; where the largest error is more, so much less is asked of them.
const LESS: f32 = 0.6;

/// So many pixels of those seen may be missed beside what the whole surface misses: what is a pixel wide is no
/// surface.
const MISSED: f64 = 1e-3;

/// So often at most.
const ROUNDS: usize = 6;

/// A simplified surface, with what was measured of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Simplified {
    /// Its points are some of the first one's.
    pub mesh: ParallaxMesh,
    /// Pixels in which something is seen.
    pub seen: usize,
    /// Those of them with nothing of the surface within the bound, in the pixels around neither.
    pub missed: usize,
    /// The farthest that the others' parallax is from the surface there or in one of the pixels around,
    /// pixels.
    pub most_error: f32,
}

/// Collapses edges as long as pixels of the picture move by no more than `most_error` pixels, wherever in
/// its cell the eye is; the surface as it is where nothing can be left out.
pub fn simplified(mesh: &ParallaxMesh, depths: &Depths<'_>, most_error: f32) -> Result<Simplified> {
    // Points that were made for triangles which are none are of no part.
    let mesh = &used(mesh, &mesh.triangles);
    let bytes: &[u8] = bytemuck::cast_slice(&mesh.points);
    let points = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0)
        .map_err(|error| Error::Internal(format!("points of a depth mesh: {error}")))?;
    let whole = measured(mesh, depths, most_error);
    let allowed = whole.missed + (MISSED * whole.seen as f64) as usize;
    let mut asked = most_error;
    for _ in 0..ROUNDS {
        let indices = mesh.triangles.as_flattened();
        let options = SimplifyOptions::ErrorAbsolute;
        let fewer = simplify(indices, &points, 0, asked, options, None);
        let fewer = used(mesh, fewer.as_chunks::<3>().0);
        let found = measured(&fewer, depths, most_error);
        if found.missed <= allowed {
            return Ok(Simplified { mesh: fewer, ..found });
        }
        asked *= LESS;
    }
    Ok(Simplified { mesh: mesh.clone(), ..whole })
}

/// Triangles over some of the points, and no others.
fn used(mesh: &ParallaxMesh, triangles: &[[u32; 3]]) -> ParallaxMesh {
    let mut new = vec![u32::MAX; mesh.points.len()];
    let mut points = Vec::new();
    let mut of = |point: u32| {
        let at = &mut new[point as usize];
        if *at == u32::MAX {
            *at = points.len() as u32;
            points.push(mesh.points[point as usize]);
        }
        *at
    };
    let triangles = triangles.iter().map(|corners| corners.map(&mut of)).collect();
    ParallaxMesh { points, triangles }
}

/// Draws a surface and compares it with the picture that it is of; leaves the mesh away.
fn measured(mesh: &ParallaxMesh, depths: &Depths<'_>, bound: f32) -> Simplified {
    let (width, height) = (depths.width as isize, depths.height() as isize);
    let at = |x: isize, y: isize| (y * width + x) as usize;
    // How far each pixel's parallax is from the nearest that is drawn over it, and where that is too far,
    // from the nearest around it.
    let mut errors = vec![f32::INFINITY; depths.metres.len()];
    draw(mesh, depths, |x, y, parallax| {
        if let Some(expected) = depths.parallax(x, y) {
            let error = &mut errors[at(x, y)];
            *error = error.min((parallax - expected).abs());
        }
    });
    let around = |[x, y]: [isize; 2]| {
        let ends = |at: isize, end: isize| (at - 1).max(0)..(at + 2).min(end);
        ends(y, height).flat_map(move |y| ends(x, width).map(move |x| [x, y]))
    };
    let mut is_near_far_off = vec![false; errors.len()];
    for y in 0..height {
        for x in 0..width {
            if errors[at(x, y)] > bound && depths.parallax(x, y).is_some() {
                around([x, y]).for_each(|[x, y]| is_near_far_off[at(x, y)] = true);
            }
        }
    }
    draw(mesh, depths, |x, y, parallax| {
        if !is_near_far_off[at(x, y)] {
            return;
        }
        for [x, y] in around([x, y]) {
            let error = &mut errors[at(x, y)];
            if *error > bound
                && let Some(expected) = depths.parallax(x, y)
            {
                *error = error.min((parallax - expected).abs());
            }
        }
    });
    let mut found = Simplified::default();
    for y in 0..height {
        for x in 0..width {
            if depths.parallax(x, y).is_none() {
                continue;
            }
            found.seen += 1;
            match errors[at(x, y)] {
                error if error <= bound => found.most_error = found.most_error.max(error),
                _ => found.missed += 1,
            }
        }
    }
    found
}

/// Calls `pixel` with column, row and parallax for every pixel whose middle is in a triangle.
fn draw(mesh: &ParallaxMesh, depths: &Depths<'_>, mut pixel: impl FnMut(isize, isize, f32)) {
    for corners in &mesh.triangles {
        let corners = corners.map(|point| mesh.points[point as usize]);
        triangle(corners, [depths.width, depths.height()], &mut pixel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 64;
    const APART: f32 = 0.5;
    const ERROR: f32 = 0.5;

    fn of(metres: impl Fn(f32, f32) -> f32) -> (ParallaxMesh, Simplified) {
        let metres: Vec<f32> = (0..WIDTH * WIDTH)
            .map(|at| metres((at % WIDTH) as f32 + 0.5, (at / WIDTH) as f32 + 0.5))
            .collect();
        let depths = Depths { metres: &metres, width: WIDTH, pixel_metres: 200.0 };
        let mesh = ParallaxMesh::new(&depths, APART);
        let fewer = simplified(&mesh, &depths, ERROR).unwrap();
        (mesh, fewer)
    }

    #[test]
    fn a_plane_is_left_with_two_triangles() {
        let (_, fewer) = of(|x, _| 200.0 / (4.0 + 0.5 * x));
        assert_eq!((fewer.mesh.triangles.len(), fewer.missed), (2, 0));
        assert!(fewer.most_error < 1e-3, "{}", fewer.most_error);
    }

    #[test]
    fn points_of_no_triangle_go_also_where_nothing_can_be_left_out() {
        // Islands of three pixels, which are gone when any of their edges is.
        let is_island = |at: usize| at % WIDTH % 8 < 3 && at / WIDTH % 8 < 3;
        let metres: Vec<f32> =
            (0..WIDTH * WIDTH).map(|at| if is_island(at) { 20.0 } else { f32::INFINITY }).collect();
        let depths = Depths { metres: &metres, width: WIDTH, pixel_metres: 200.0 };
        let mut mesh = ParallaxMesh::new(&depths, APART);
        mesh.points.insert(0, [5.5, 5.5, 10.0]);
        mesh.triangles.as_flattened_mut().iter_mut().for_each(|point| *point += 1);
        let found = simplified(&mesh, &depths, 100.0).unwrap();
        assert_eq!(found.mesh.triangles.len(), mesh.triangles.len());
        let corners = found.mesh.triangles.as_flattened();
        let is_used = |point: usize| corners.contains(&(point as u32));
        assert!((0..found.mesh.points.len()).all(is_used));
    }

    #[test]
    fn a_street_keeps_to_the_bound_with_few_triangles() {
        // Ground under the eye, façades 8 m to either side, a tower 60 m ahead, sky.
        let (mesh, fewer) = of(|x, y| {
            let [across, down] = [(x - 32.0) / 32.0, (y - 32.0) / 32.0];
            let ground = if down > 0.0 { 1.7 / down } else { f32::INFINITY };
            let wall = 8.0 / across.abs();
            let wall = if wall * -down < 12.0 { wall } else { f32::INFINITY };
            let tower = if across.abs() < 0.1 && -down < 0.3 { 60.0 } else { f32::INFINITY };
            ground.min(wall).min(tower)
        });
        let [before, after] = [mesh.triangles.len(), fewer.mesh.triangles.len()];
        let allowed = MISSED * fewer.seen as f64;
        assert!(fewer.missed as f64 <= allowed, "{} of {}", fewer.missed, fewer.seen);
        // With what goes on behind edges for three pixels, of which a picture of 64 has many: a twentieth
        // without.
        assert!(after < before / 10, "{before} to {after}");
    }

    #[test]
    fn hills_keep_to_the_bound() {
        let (mesh, fewer) = of(|x, y| 20.0 + 4.0 * libm::sinf(x / 7.0) * libm::cosf(y / 5.0));
        assert_eq!(fewer.missed, 0);
        assert!(fewer.mesh.triangles.len() < mesh.triangles.len() / 4);
    }

    #[test]
    fn nothing_seen_is_nothing_drawn() {
        let (_, fewer) = of(|_, _| f32::INFINITY);
        assert_eq!(fewer, Simplified::default());
    }
}
