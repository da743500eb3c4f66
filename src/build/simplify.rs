//! Bringing a node to its triangle budget: the ladder from careful to sure.
//!
//! 1. Quadric edge collapse with attributes (Garland & Heckbert as meshoptimizer has it, with
//!    vertex positions and attributes solved for afterwards), inside texture seams.
//! 2. The same, allowed to collapse across texture seams but not across material borders.
//! 3. Where that misses the budget, or moves the surface far for the triangles that it leaves,
//!    whichever of these and it is measured to stay nearest to the input on average:
//!    - the same, across material borders too; triangles then get one material each again
//!      ([`super::mend_materials`]);
//!    - the same, also leaving out the smallest separate parts;
//!    - the same as the first, of faces that wind one way ([`super::windings`]);
//!    - vertex clustering ([`super::cluster`]), which has no topology to respect.
//!
//! Where the mesh is many separate bodies and the budget leaves few triangles to each, boxes for
//! them (`super::aggregate`) are tried against what the ladder gave, by the same measure.
//!
//! Border vertices that the level keeps are locked throughout.

use std::cmp::Ordering;

use meshopt::{SimplifyOptions, SimplifyVertex};
use rustc_hash::FxHashMap;

use super::aggregate::{Aggregated, aggregate};
use super::border::{Border, Fate, Path};
use super::cluster::cluster;
use super::compact::compact;
use super::distance::MeanDistance;
use super::mend_materials::mend_materials;
use super::windings::{has_doubles, wound_one_way};
use crate::mesh::{Mesh, PositionKey, UpAxis, key};

/// Which method makes the coarse levels.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Simplifier {
    /// Quadric error metrics, with the ladder below it.
    #[default]
    Qem,
    /// Vertex clustering alone (Cozzi & Loo, section 3).
    Clustering,
}

/// The step of the ladder that gave a node its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LadderStep {
    /// The piece as it is: a leaf.
    Original,
    /// Edge collapse inside texture seams.
    Collapse,
    /// Edge collapse across texture seams.
    Permissive,
    /// Edge collapse across texture seams and material borders.
    Across,
    /// Edge collapse across texture seams and material borders, with the smallest separate parts left out.
    Prune,
    /// Edge collapse across texture seams and material borders of faces that wind one way.
    Wound,
    /// Vertex clustering.
    Clustering,
    /// Boxes in place of small separate bodies, and edge collapse of the rest.
    Boxes,
    /// The largest triangles alone, where simplification would leave nothing.
    Remnant,
}

impl LadderStep {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Original => "original geometry",
            Self::Collapse => "edge collapse within texture seams",
            Self::Permissive => "edge collapse across texture seams",
            Self::Across => "edge collapse across material borders",
            Self::Prune => "edge collapse without the smallest separate parts",
            Self::Wound => "edge collapse of faces turned one way",
            Self::Clustering => "vertex clustering",
            Self::Boxes => "boxes for small separate bodies",
            Self::Remnant => "the largest triangles alone",
        }
    }
}

/// Weights of the appearance against the geometry.
#[derive(Clone, Copy, Debug)]
pub struct AppearanceWeights {
    /// A shift of the texture by one metre of surface counts as this many metres of distance.
    pub texture: f32,
    /// A change of vertex colour from 0 to 1 counts as this share of the piece's extent.
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

/// A node may exceed its budget by this factor before the ladder goes on.
pub const BUDGET_TOLERANCE: f64 = 1.1;

/// A simplified piece.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// Its geometry, with source texture coordinates.
    pub mesh: Mesh,
    /// Border facts of its vertices.
    pub border: Border,
    /// An upper estimate of the distance that it moved from the input, metres.
    pub error: f64,
    /// How it was made.
    pub step: LadderStep,
}

/// How pieces are simplified.
#[derive(Clone, Copy, Debug)]
pub struct Method<'a> {
    /// See [`Simplifier`].
    pub simplifier: Simplifier,
    /// See [`AppearanceWeights`].
    pub weights: AppearanceWeights,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// Of each material, whether its faces may turn ([`super::windings`]).
    pub turnable: &'a [bool],
}

/// Edge collapse that moves the surface by more than this share of the side of a square as large as
/// a triangle may have may have worn away what else would be kept, and is compared with other ways.
/// Of what comparing everywhere gains, 80 to 99 % are gained so; of the nodes of scans, where
/// hardly any gain, 5 % are compared.
const DOUBTFUL: f64 = 0.2;

/// Simplifies `mesh`, whose border is thinned already ([`super::thin_border`]), to at most about
/// `target` triangles as a node of `path` at `level`.
pub fn simplify(
    mesh: &Mesh,
    border: &Border,
    path: &Path,
    level: u8,
    target: usize,
    method: &Method,
) -> Simplified {
    let &Method { simplifier, weights, up, turnable } = method;
    let (mesh, border) = compact(mesh, border);
    let locked: Vec<bool> = border
        .planes
        .iter()
        .zip(&border.keep)
        .map(|(&planes, &keep)| path.fate(planes, keep, level) != Fate::Free)
        .collect();
    let limit = (target as f64 * BUDGET_TOLERANCE) as usize;
    if simplifier == Simplifier::Clustering {
        return clustered(&mesh, &border, &locked, target);
    }
    let source = Simplified { mesh, border, error: 0.0, step: LadderStep::Collapse };
    if source.mesh.triangles.len() <= target {
        return source;
    }
    let collapsed = |step| collapse(&source.mesh, &source.border, &locked, target, step, weights);
    let boxes = boxes(&source, &locked, up, target, weights);
    let mut best = collapsed(LadderStep::Collapse);
    if best.mesh.triangles.len() > limit {
        let permissive = collapsed(LadderStep::Permissive);
        if permissive.mesh.triangles.len() < best.mesh.triangles.len() {
            best = permissive;
        }
    }
    let mut candidates = Vec::new();
    let doubtful = DOUBTFUL * (source.mesh.area() / target as f64).sqrt();
    if best.mesh.triangles.len() > limit || best.error > doubtful || has_doubles(&source.mesh) {
        if has_seams(&source.mesh) {
            candidates.push(collapsed(LadderStep::Across));
        }
        candidates.push(collapsed(LadderStep::Prune));
        candidates.push(clustered(&source.mesh, &source.border, &locked, target));
        candidates.extend(wound(&source, &locked, target, weights, turnable));
    }
    candidates.extend(boxes);
    if candidates.is_empty() {
        return best;
    }
    let share = (source.mesh.area() / target as f64).sqrt();
    let mut from_source = MeanDistance::from(&source.mesh);
    let mut rank = |candidate: &Simplified, best: (Rank, f64)| {
        let nearest = if best.0 == Rank::Near { best.1 } else { f64::INFINITY };
        let distance = || from_source.to(&candidate.mesh, nearest);
        Rank::of(candidate.mesh.triangles.len(), limit, distance, share)
    };
    let mut best = (rank(&best, (Rank::FarOver, f64::INFINITY)), best);
    for candidate in candidates {
        let rank = rank(&candidate, best.0);
        if !candidate.mesh.triangles.is_empty() && rank.partial_cmp(&best.0) == Some(Ordering::Less)
        {
            best = (rank, candidate);
        }
    }
    best.1
}

/// How a candidate does, the best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Within the budget: the nearest to the input is taken.
    Near,
    /// Over it, by half of itself at most: that with the fewest triangles.
    Over,
    /// On average farther from the input than a square is wide that is as large as a triangle may
    /// be, so that whole sides are gone: the nearest.
    Far,
    /// Far over the budget: that with the fewest triangles.
    FarOver,
}

impl Rank {
    /// The rank of a candidate with so many triangles and so far from the input, and by what it is
    /// compared with those of the same rank; less is better.
    fn of(
        triangles: usize,
        limit: usize,
        distance: impl FnOnce() -> f64,
        share: f64,
    ) -> (Self, f64) {
        if triangles > 2 * limit {
            return (Self::FarOver, triangles as f64);
        }
        let distance = distance();
        match (triangles <= limit, distance <= share) {
            (true, true) => (Self::Near, distance),
            (false, true) => (Self::Over, triangles as f64),
            (_, false) => (Self::Far, distance),
        }
    }
}

/// Whether vertices may differ in more than their place.
fn has_seams(mesh: &Mesh) -> bool {
    !mesh.texcoords.is_empty()
        || !mesh.colors.is_empty()
        || mesh.materials.windows(2).any(|pair| pair[0] != pair[1])
}

/// Edge collapse of faces that wind one way, each there once; `None` where they do already.
fn wound(
    source: &Simplified,
    locked: &[bool],
    target: usize,
    weights: AppearanceWeights,
    turnable: &[bool],
) -> Option<Simplified> {
    let triangles = wound_one_way(&source.mesh, turnable)?;
    let mesh = Mesh { triangles, ..source.mesh.clone() };
    let step = LadderStep::Wound;
    if mesh.triangles.len() > target {
        return Some(collapse(&mesh, &source.border, locked, target, step, weights));
    }
    let (mesh, border) = compact(&mesh, &source.border);
    Some(Simplified { mesh, border, error: 0.0, step })
}

/// Boxes for small bodies, and the rest collapsed; `None` where there are too few bodies.
fn boxes(
    source: &Simplified,
    locked: &[bool],
    up: UpAxis,
    target: usize,
    weights: AppearanceWeights,
) -> Option<Simplified> {
    let Aggregated { boxes, rest } = aggregate(&source.mesh, locked, up, target)?;
    let for_rest = target.saturating_sub(boxes.triangles.len()).max(1);
    let rest = Mesh { triangles: rest, ..source.mesh.clone() };
    let mut result = if rest.triangles.len() > for_rest {
        // Nothing is left out here: that is for small bodies, which are boxes.
        collapse(&rest, &source.border, locked, for_rest, LadderStep::Across, weights)
    } else {
        let (mesh, border) = compact(&rest, &source.border);
        Simplified { mesh, border, error: 0.0, step: LadderStep::Collapse }
    };
    result.step = LadderStep::Boxes;
    let first = result.mesh.positions.len() as u32;
    result.mesh.triangles.extend(boxes.triangles.iter().map(|t| t.map(|vertex| first + vertex)));
    result.border.planes.resize(result.border.planes.len() + boxes.positions.len(), 0);
    result.border.keep.resize(result.border.keep.len() + boxes.positions.len(), 0);
    result.mesh.positions.extend(boxes.positions);
    result.mesh.colors.extend(boxes.colors);
    result.mesh.materials.extend(boxes.materials);
    Some(result)
}

fn clustered(mesh: &Mesh, border: &Border, locked: &[bool], target: usize) -> Simplified {
    let (mesh, border, error) = cluster(mesh, border, locked, target);
    Simplified { mesh, border, error, step: LadderStep::Clustering }
}

/// One run of meshoptimizer's edge collapse.
fn collapse(
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
    let mut locks: Vec<SimplifyVertex> = locked
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
    if step == LadderStep::Permissive {
        protect_material_borders(mesh, &mut locks);
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
        materials: mesh.materials.clone(),
        triangles,
    };
    move_texcoords(&mut attributes, attribute_weights.len(), far);
    write_attributes(&mut result, &attributes, attribute_weights.len());
    let mut border = border.clone();
    mend_materials(&mut result, &mut border, mesh);
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

/// Marks the vertices at which two materials meet.
fn protect_material_borders(mesh: &Mesh, locks: &mut [SimplifyVertex]) {
    let mut first: FxHashMap<PositionKey<f32>, (u32, bool)> = FxHashMap::default();
    for (vertex, &position) in mesh.positions.iter().enumerate() {
        let material = mesh.materials[vertex];
        let entry = first.entry(key(position)).or_insert((material, false));
        entry.1 |= entry.0 != material;
    }
    for (vertex, lock) in locks.iter_mut().enumerate() {
        if first[&key(mesh.positions[vertex])].1 {
            *lock |= SimplifyVertex::Protect;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
            MeanDistance::from(mesh).to(&found, f64::INFINITY)
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

    #[test]
    fn a_budget_is_no_reason_to_leave_out_whole_sides() {
        // The second of each pair is worse; the share of a triangle is 4 m wide.
        let of = |triangles, distance| Rank::of(triangles, 100, || distance, 4.0);
        for [better, worse] in [
            [of(90, 1.0), of(20, 2.0)],
            [of(90, 3.9), of(101, 0.0)],
            [of(150, 3.0), of(160, 1.0)],
            [of(200, 3.0), of(6, 12.0)],
            [of(90, 5.0), of(150, 6.0)],
            [of(90, f64::INFINITY), of(201, 0.0)],
        ] {
            assert!(better < worse, "{better:?} {worse:?}");
        }
    }

    /// Houses of 12 triangles each, all apart.
    fn houses(count: u16) -> Mesh {
        let mut mesh = Mesh::default();
        for house in 0..count {
            let (x, y) = (f32::from(house % 20) * 14.0, f32::from(house / 20) * 18.0);
            let first = mesh.positions.len() as u32;
            for z in [0.0, 6.0] {
                let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 11.0], [0.0, 11.0]];
                mesh.positions.extend(corners.map(|[i, j]| [x + i, y + j, z]));
            }
            let mut triangles = vec![[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]];
            for (i, j) in [(0, 1), (1, 2), (2, 3), (3, 0)] {
                triangles.extend([[i, j, j + 4], [i, j + 4, i + 4]]);
            }
            mesh.triangles.extend(triangles.iter().map(|t| t.map(|vertex| first + vertex)));
        }
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    #[test]
    fn many_houses_with_few_triangles_each_become_boxes() {
        let mesh = houses(200);
        let border = Border::interior(mesh.positions.len());
        let simplified = |target| {
            let weights = AppearanceWeights::default();
            let (simplifier, up, turnable) = (Simplifier::Qem, UpAxis::Z, &[true][..]);
            let method = Method { simplifier, weights, up, turnable };
            simplify(&mesh, &border, &Path::default(), 0, target, &method)
        };
        let few = simplified(600);
        assert_eq!(few.step, LadderStep::Boxes);
        assert!(few.mesh.triangles.len() <= 660, "{}", few.mesh.triangles.len());
        assert_eq!(few.border.keep.len(), few.mesh.positions.len());
        let alone = collapse(
            &mesh,
            &border,
            &vec![false; mesh.positions.len()],
            600,
            LadderStep::Across,
            AppearanceWeights::default(),
        );
        let to = |other: &Mesh| MeanDistance::from(&mesh).to(other, f64::INFINITY);
        assert!(to(&few.mesh) < to(&alone.mesh), "{} {}", to(&few.mesh), to(&alone.mesh));
        assert_ne!(simplified(2400).step, LadderStep::Boxes, "enough for all");
    }
}
