//! One run of edge collapse, by meshoptimizer: what it is given and what is made of its result.

use meshopt::{SimplifyOptions, SimplifyVertex};

use crate::builder::border::vertex::Border;
use crate::builder::simplify::compact::compact;
use crate::builder::simplify::simplified::{LadderStep, Simplified};
use crate::builder::simplify::split_mixed::split_mixed_triangles;
use crate::mesh::Mesh;

/// Weights of the appearance against the geometry.
#[derive(Clone, Copy, Debug)]
pub struct AppearanceWeights {
    /// A shift of the texture by one metre of surface counts as this many metres of distance.
    pub texture: f32,
    /// A change of vertex colour from 0 to 1 counts as this share of the chunk's extent.
    pub color: f32,
    /// Edges over which the surface folds back on itself stay. Thin parts keep their tips so where
    /// no texture does that: all planes near the tip of a needle lie along it, so that quadrics
    /// alone find nothing in shortening it.
    pub keep_folds: bool,
}

impl Default for AppearanceWeights {
    fn default() -> Self {
        Self { texture: 0.25, color: 0.05, keep_folds: false }
    }
}

/// One run of meshoptimizer's edge collapse.
pub(super) fn collapse(
    mesh: &Mesh,
    border: &Border,
    locked: &[bool],
    target: usize,
    step: LadderStep,
    weights: AppearanceWeights,
) -> Simplified {
    let mut indices: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    let mut positions = mesh.positions.clone();
    let (mut attributes, attribute_weights) = attributes_of(mesh, weights);
    let far = far_out(mesh);
    move_texcoords(&mut attributes, attribute_weights.len(), far.map(|at| -at));
    let stride = attribute_weights.len() * size_of::<f32>();
    let locks: Vec<SimplifyVertex> = locked
        .iter()
        .map(|&locked| if locked { SimplifyVertex::Lock } else { SimplifyVertex::None })
        .collect();
    let mut options = SimplifyOptions::ErrorAbsolute;
    if weights.keep_folds {
        options |= SimplifyOptions::PreserveFolds;
    }
    if step != LadderStep::Collapse {
        options |= SimplifyOptions::Permissive;
    }
    if step == LadderStep::Prune {
        options |= SimplifyOptions::Prune;
        join_locked(&mut indices, locked);
    }
    let mut error = 0f32;
    let count = meshopt::simplify_with_update(
        &mut indices,
        &mut positions,
        &mut attributes,
        &attribute_weights,
        stride,
        Some(&locks),
        target * 3,
        f32::MAX,
        options,
        Some(&mut error),
    );
    indices.truncate(count);
    restore_unmoved(&mut positions, &mesh.positions);
    let mut triangles = indices.as_chunks::<3>().0.to_vec();
    triangles.retain(|[_, b, c]| b != c);
    let mut result = Mesh {
        positions,
        texcoords: mesh.texcoords.clone(),
        colors: mesh.colors.clone(),
        normals: mesh.normals.clone(),
        materials: mesh.materials.clone(),
        triangles,
    };
    move_texcoords(&mut attributes, attribute_weights.len(), far);
    write_attributes(&mut result, &attributes, attribute_weights.len());
    let mut border = border.clone();
    split_mixed_triangles(&mut result, &mut border, mesh);
    let (mesh, border) = compact(&result, &border);
    Simplified { mesh, border, error: f64::from(error), step }
}

/// Makes one part of all parts that touch a border: they go on beyond it, so how small they look
/// here says nothing, and where the neighbour keeps its part of one there would be a hole. They go
/// only where all of them together look small. Joined by triangles without area, which take part in
/// nothing but the search for parts.
fn join_locked(indices: &mut Vec<u32>, locked: &[bool]) {
    let mut locked = (0..).zip(locked).filter(|(_, locked)| **locked).map(|(vertex, _)| vertex);
    let Some(first) = locked.next() else { return };
    indices.extend(locked.flat_map(|vertex| [first, vertex, vertex]));
}

/// meshoptimizer scales positions to a unit box and back, so a vertex that it did not move may
/// differ in its last bits; such a vertex gets its exact position again.
fn restore_unmoved(positions: &mut [[f32; 3]], originals: &[[f32; 3]]) {
    let extent = originals
        .iter()
        .fold([0f32; 3], |most, position| std::array::from_fn(|i| most[i].max(position[i].abs())));
    let extent = extent.into_iter().fold(0f32, f32::max);
    let drift = extent * 4.0 * f32::EPSILON;
    for (position, original) in positions.iter_mut().zip(originals) {
        if position.iter().zip(original).all(|(new, old)| (new - old).abs() <= drift) {
            *position = *original;
        }
    }
}

/// Interleaved attributes and their weights. Texture coordinates are weighted so that a shift
/// counts by its length on the surface, whatever the texture's size is.
fn attributes_of(mesh: &Mesh, weights: AppearanceWeights) -> (Vec<f32>, Vec<f32>) {
    let textured = !mesh.texcoords.is_empty();
    let colored = !mesh.colors.is_empty();
    let mut attribute_weights = Vec::new();
    if textured {
        let weight = weights.texture * metres_per_texcoord(mesh) / extent_of(mesh);
        attribute_weights.extend([weight; 2]);
    }
    if colored {
        attribute_weights.extend([weights.color; 3]);
    }
    if textured && !colored {
        return (mesh.texcoords.as_flattened().to_vec(), attribute_weights);
    }
    let mut attributes = Vec::with_capacity(mesh.positions.len() * attribute_weights.len());
    for vertex in 0..mesh.positions.len() {
        if textured {
            attributes.extend(mesh.texcoords[vertex]);
        }
        if colored {
            let [r, g, b, _] = mesh.colors[vertex];
            attributes.extend([r, g, b].map(|channel| f32::from(channel) / 65535.0));
        }
    }
    (attributes, attribute_weights)
}

/// Where texture coordinates lie that are farther from 0 than from each other; 0 elsewhere. Their
/// quadrics hold squares of them, of which f32 keeps too little to tell them apart. Measured from
/// here nothing is lost: the difference of two numbers, one at most twice the other, is exact.
fn far_out(mesh: &Mesh) -> [f32; 2] {
    [0, 1].map(|axis| {
        let along = || mesh.texcoords.iter().map(|texcoord| texcoord[axis]);
        let (low, high) = (along().reduce(f32::min), along().reduce(f32::max));
        match (low.unwrap_or(0.0), high.unwrap_or(0.0)) {
            (low, high) if low > 0.0 && high <= 2.0 * low => low,
            (low, high) if high < 0.0 && low >= 2.0 * high => high,
            _ => 0.0,
        }
    })
}

fn move_texcoords(attributes: &mut [f32], per_vertex: usize, by: [f32; 2]) {
    if by == [0.0; 2] {
        return;
    }
    for values in attributes.chunks_exact_mut(per_vertex) {
        values[0] += by[0];
        values[1] += by[1];
    }
}

fn write_attributes(mesh: &mut Mesh, attributes: &[f32], per_vertex: usize) {
    if per_vertex == 0 {
        return;
    }
    let color_at = if mesh.texcoords.is_empty() { 0 } else { 2 };
    for (vertex, values) in attributes.chunks_exact(per_vertex).enumerate() {
        if let Some(texcoord) = mesh.texcoords.get_mut(vertex) {
            *texcoord = [values[0], values[1]];
        }
        if let Some(color) = mesh.colors.get_mut(vertex) {
            for channel in 0..3 {
                let value = values[color_at + channel].clamp(0.0, 1.0);
                color[channel] = (value * 65535.0).round() as u16;
            }
        }
    }
}

/// The square root of surface area over texture area: how many metres one unit of texture
/// coordinate covers. 0 where nothing is textured.
fn metres_per_texcoord(mesh: &Mesh) -> f32 {
    let (mut surface, mut texture) = (0f64, 0f64);
    for &triangle in &mesh.triangles {
        let [a, b, c] =
            triangle.map(|vertex| glam::Vec2::from(mesh.texcoords[vertex as usize]).as_dvec2());
        let area = (b - a).perp_dot(c - a).abs() * 0.5;
        if area > 0.0 {
            texture += area;
            surface += mesh.triangle_area(triangle);
        }
    }
    if texture > 0.0 { (surface / texture).sqrt() as f32 } else { 0.0 }
}

/// The longest side of the bounding box, metres; never 0.
fn extent_of(mesh: &Mesh) -> f32 {
    mesh.bounds()
        .map_or(1.0, |(low, high)| (0..3).map(|i| high[i] - low[i]).fold(0.0, f32::max))
        .max(f32::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::constants::MeasureConstants;
    use crate::builder::error::MeanDistance;
    use crate::random::Random;

    /// Adds a bumpy sheet of `side` by `side` squares.
    fn add_sheet(mesh: &mut Mesh, at: f32, side: u32, size: f32) {
        let mut random = Random::new(3, 0);
        let first = mesh.positions.len() as u32;
        for place in 0..(side + 1) * (side + 1) {
            let [x, y] = [place / (side + 1), place % (side + 1)].map(|i| i as f32 * size);
            mesh.positions.push([at + x, y, size * random.between(0.0, 1.0) as f32]);
            mesh.materials.push(0);
        }
        for place in (0..side * (side + 1)).filter(|place| place % (side + 1) != side) {
            let [a, b, c, d] = [0, side + 1, side + 2, 1].map(|step| first + place + step);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    #[test]
    fn texture_coordinates_far_out_weigh_no_more_than_others() {
        let mut mesh = Mesh::default();
        add_sheet(&mut mesh, 0.0, 24, 1.0);
        mesh.positions.iter_mut().for_each(|p| p[2] = (p[0] * 0.3).sin() + (p[1] * 0.4).cos());
        let mapped = |out: f32, scale: f32| {
            let place = |p: &[f32; 3]| [out + p[0] * scale, out + p[1] * scale];
            Mesh { texcoords: mesh.positions.iter().map(place).collect(), ..mesh.clone() }
        };
        let error = |mesh: &Mesh| {
            let border = Border::interior(mesh.positions.len());
            let locked = vec![false; mesh.positions.len()];
            let weights = AppearanceWeights::default();
            let found = collapse(mesh, &border, &locked, 100, LadderStep::Collapse, weights).mesh;
            let [low, high] = [f32::min, f32::max].map(|of| {
                let along = |mesh: &Mesh| mesh.texcoords.iter().map(|uv| uv[0]).reduce(of).unwrap();
                (along(&found) - along(mesh)).abs()
            });
            assert!(low.max(high) < 0.1 * (mesh.texcoords[24 * 25][0] - mesh.texcoords[0][0]));
            MeanDistance::from(mesh, MeasureConstants::default()).to(&found, f64::INFINITY)
        };
        // Sizes of the picture are powers of two, which change no digit.
        let near = error(&mapped(0.0, 1.0 / 32.0));
        for (out, scale) in [(0.5, 2f32.powi(-15)), (-16.0, 2f32.powi(-10)), (64.0, 0.03125)] {
            let far = error(&mapped(out, scale));
            assert!(far < 1.25 * near, "{far} at {out}, {near} at 0");
        }
    }

    #[test]
    fn parts_that_touch_a_border_are_not_left_out_for_looking_small() {
        let mut mesh = Mesh::default();
        add_sheet(&mut mesh, 0.0, 12, 1.0);
        let small = mesh.positions.len()..mesh.positions.len() + 9;
        add_sheet(&mut mesh, 20.0, 2, 0.05);
        let prune = |locked: &[bool]| {
            let border = Border::interior(mesh.positions.len());
            let weights = AppearanceWeights::default();
            let step = LadderStep::Prune;
            collapse(&mesh, &border, locked, 24, step, weights).mesh
        };
        let has_small = |mesh: &Mesh| mesh.positions.iter().any(|position| position[0] > 19.0);
        let mut locked = vec![false; mesh.positions.len()];
        assert!(!has_small(&prune(&locked)), "a separate part goes");
        // The border goes through the large part, too.
        locked[0] = true;
        locked[small.start..small.start + 3].fill(true);
        let kept = prune(&locked);
        let places: Vec<[f32; 3]> = mesh.positions[small.start..small.start + 3].to_vec();
        assert!(places.iter().all(|place| kept.positions.contains(place)));
        assert!(kept.triangles.iter().all(|[a, b, c]| a != b && b != c && c != a));
        // What joined them is gone.
        assert!(kept.area() < 400.0, "{}", kept.area());
    }
}
