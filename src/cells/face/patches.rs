//! The parts of a surface that are not joined with each other.

use super::parallax_mesh::ParallaxMesh;
use super::raster::triangle;
use crate::texture::Patch;

/// Pixels around what a patch shows that are taken with it, so that what is filtered at its border is its own.
const MARGIN_PX: usize = 2;

/// The patches of a surface over a picture of a size, and of which each of its points is.
pub(super) fn patches(mesh: &ParallaxMesh, size: [u32; 2]) -> (Vec<Patch>, Vec<u32>) {
    let of_points = components(mesh);
    let count = of_points.iter().map(|&patch| patch + 1).max().unwrap_or(0);
    let mut pixels: Vec<Vec<[usize; 2]>> = vec![Vec::new(); count as usize];
    for corners in &mesh.triangles {
        let pixels = &mut pixels[of_points[corners[0] as usize] as usize];
        let corners = corners.map(|point| mesh.points[point as usize]);
        triangle(corners, size.map(|side| side as usize), |x, y, _| {
            pixels.push([x as usize, y as usize]);
        });
        // What is narrower than a pixel may be over the middle of none.
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
            let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()).ceil().max(1.0);
            pixels.extend((0..steps as u32).map(|step| {
                [0, 1].map(|axis| {
                    let at = from[axis] + (to[axis] - from[axis]) * step as f32 / steps;
                    (at.max(0.0) as usize).min(size[axis] as usize - 1)
                })
            }));
        }
    }
    let around = |pixels: &Vec<[usize; 2]>| Patch::around(pixels, MARGIN_PX, size);
    (pixels.iter().filter_map(around).collect(), of_points)
}

/// For each point the number of its part, in the order of first points.
fn components(mesh: &ParallaxMesh) -> Vec<u32> {
    let mut first: Vec<u32> = (0..mesh.points.len() as u32).collect();
    fn root(first: &mut [u32], mut at: u32) -> u32 {
        while first[at as usize] != at {
            first[at as usize] = first[first[at as usize] as usize];
            at = first[at as usize];
        }
        at
    }
    for &[a, b, c] in &mesh.triangles {
        for other in [b, c] {
            let (a, b) = (root(&mut first, a), root(&mut first, other));
            first[a.max(b) as usize] = a.min(b);
        }
    }
    let mut number = vec![u32::MAX; mesh.points.len()];
    let mut count = 0;
    for at in 0..mesh.points.len() as u32 {
        let root = root(&mut first, at);
        if root == at {
            number[at as usize] = count;
            count += 1;
        }
        number[at as usize] = number[root as usize];
    }
    number
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_what_triangles_join() {
        let points = (0..7).map(|at| [at as f32, (at % 2) as f32 * 3.0, 1.0]).collect();
        let mesh = ParallaxMesh { points, triangles: vec![[6, 4, 5], [0, 1, 2], [3, 2, 1]] };
        assert_eq!(components(&mesh), [0, 0, 0, 0, 1, 1, 1]);
        let (patches, of_points) = patches(&mesh, [8, 8]);
        assert_eq!((patches.len(), of_points.len()), (2, 7));
    }
}
