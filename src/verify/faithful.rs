//! Check: the leaves together are the source, in area, vertices and surface.

use glam::DVec3;
use rayon::prelude::*;

use super::assembly::Assembly;
use super::coverage::{Group, coverage};
use super::geometry::NodeGeometry;
use super::points::Points;
use super::progress::Progress;
use super::report::{Check, LeafFigures};
use super::sample::area;
use super::source::Source;
use super::step::vertex_bounds;
use crate::format::Scene;
use crate::lattice::{Lattice, Quantization};

/// How far a point of a leaf may be from the source for rounding, metres: the [bound](vertex_bounds) of source
/// vertices, and half a step along each axis for each cut on the way to the leaf, since a cut rounds
/// the vertices that it makes. Of a coarse node: the bound of the leaves
/// on its scene's last level. Where the scene is quantised, errors contain the rounding: then a
/// leaf's error is its bound, where that is less, a coarse node's has room for skirts alone.
pub(super) fn rounding(scene: &Scene, node: u32, step: f64, vertex_bound: f64) -> f64 {
    let bound = vertex_bound * 3f64.sqrt() + rounding_of_cuts(scene, node, step);
    match (Quantization::of(&scene.parameters), &scene.nodes[node as usize]) {
        (None, _) => bound,
        (Some(_), leaf) if leaf.first_child.is_none() => {
            bound.min(leaf.geometric_error + step * LAST_BITS)
        }
        (Some(_), _) => step * (SKIRTS + LAST_BITS),
    }
}

/// The most by which the cuts on the way to a leaf may move a vertex, metres: half a step along each axis for
/// each. A coarse node counts as a leaf on its scene's last level.
fn rounding_of_cuts(scene: &Scene, node: u32, step: f64) -> f64 {
    let factor = scene.parameters["level_factor"].as_u64().unwrap_or(4).clamp(2, 64);
    let cuts_each = factor.next_power_of_two().ilog2();
    let level = match &scene.nodes[node as usize] {
        leaf if leaf.first_child.is_none() => leaf.level,
        _ => scene.level_count().saturating_sub(1) as u32,
    };
    step * (0.5 * f64::from(BETWEEN_BLOCKS + level * cuts_each) + LAST_BITS) * 3f64.sqrt()
}

/// Cuts between blocks that a vertex may be made by.
const BETWEEN_BLOCKS: u32 = 2;

/// Room for the last bits of f64 in coordinates, as a share of a step.
const LAST_BITS: f64 = 1e-3;
/// How far the skirts of a quantised scene reach beyond what they cover, in steps: one along and one
/// across, and what their corners are rounded. In planes in which the source has walls they count as
/// surface.
const SKIRTS: f64 = 2.25;
/// Vertices that one thread looks for in one go.
const CHUNK: usize = 4096;

const HINT: &str = "verify with the source that the scene was built from, or build again; if it \
                    stays, this is a fault of the builder";

/// Compares the geometry of all leaves with the source. `steps` are the nodes' lattice steps.
pub(super) fn faithful(
    scene: &Scene,
    source: &Source,
    leaves: &[u32],
    geometry: &[NodeGeometry],
    points: &Points,
    steps: &[f64],
    progress: &dyn Progress,
) -> (LeafFigures, Check) {
    let mut check = Check::new("faithful leaves");
    let surface = &source.surface;
    let assembly = Assembly::new(leaves.iter().copied(), geometry);
    let bounds = vertex_bounds(scene);
    let leaf_steps = || leaves.iter().map(|&leaf| steps[leaf as usize]);
    let leaf_bounds = || leaves.iter().map(|&leaf| bounds[leaf as usize]);
    // Strays lie on a lattice that may be much coarser; all others are looked for first.
    let finest = leaf_steps().fold(f64::INFINITY, f64::min);
    let coarsest = leaf_steps().fold(0.0, f64::max);
    let vertex_bound = leaf_bounds().fold(f64::INFINITY, f64::min);
    let most = leaf_bounds().fold(0.0, f64::max);
    let mut figures = LeafFigures {
        source_area: (0..surface.triangles().len() as u32)
            .map(|triangle| area(surface.corners(triangle)))
            .sum(),
        leaf_area: leaves.iter().map(|&leaf| geometry[leaf as usize].area()).sum(),
        source_vertices: surface.positions().len() as u64,
        vertex_bound: vertex_bound * 3f64.sqrt(),
        ..LeafFigures::default()
    };
    // Where the lattice is known, so is what becomes of the source on it.
    let lattice = Quantization::of(&scene.parameters).filter(|known| known.step == coarsest);
    if lattice.is_some() {
        let rounded = source.built();
        figures.rounded_area = Some(
            (0..rounded.triangles().len() as u32)
                .map(|triangle| area(rounded.corners(triangle)))
                .sum(),
        );
    }
    let expected_area = figures.rounded_area.unwrap_or(figures.source_area);
    figures.area_difference = (figures.leaf_area / expected_area - 1.0).abs();

    progress.phase("leaves on the source", leaves.len() as u64);
    let moved: Vec<f64> = leaves
        .iter()
        .map(|&leaf| match (lattice, steps[leaf as usize]) {
            (Some(_), step) => rounding_of_cuts(scene, leaf, step),
            (None, step) => rounding(scene, leaf, step, bounds[leaf as usize]),
        })
        .collect();
    let reference = if lattice.is_some() { source.built() } else { surface };
    let coverage = coverage(reference, leaves, geometry, &moved, || progress.done(1));
    let is_unseen = |group: &&Group| {
        group.source <= group.bound
            || (group.leaves == 0.0 && vanishes(reference.corners(group.triangle)))
    };
    let wrong = coverage.groups.iter().filter(|group| group.is_wrong() && !is_unseen(group));
    for Group { triangle, source, leaves, bound } in wrong {
        figures.wrong_triangles += 1;
        let at = reference.corners(*triangle)[0];
        check.fail(
            format!("source triangle at {} {} {}", at.x, at.y, at.z),
            format!("the leaves have {leaves:.6} m² of its {source:.6} m², limit ±{bound:.1e} m²"),
            HINT,
        );
    }
    for (leaf, _, at) in &coverage.strays {
        figures.wrong_triangles += 1;
        check.fail(
            &scene.nodes[*leaf as usize].file,
            format!("no source triangle is near its triangle at {} {} {}", at.x, at.y, at.z),
            HINT,
        );
    }
    let unseen = coverage.groups.iter().filter(is_unseen);
    figures.unseen_triangles = unseen.clone().count() as u64;
    figures.unseen_area = unseen.map(|group| group.source).sum();

    progress.phase("looking for vertices", surface.positions().len() as u64);
    let sought = match lattice {
        Some(lattice) => sought_vertices(source, |a, b| {
            (0..3).any(|axis| lattice.round(a[axis]) != lattice.round(b[axis]))
        }),
        None => {
            let step = coarsest.min(2.0 * finest);
            sought_vertices(source, |a, b| (a - b).abs().max_element() > step)
        }
    };
    let found = |vertex: usize| {
        let point = surface.positions()[vertex];
        if let Some(lattice) = lattice {
            let rounded = DVec3::from(point.to_array().map(|c| lattice.round(c)));
            return assembly.surface.within(rounded, finest * LAST_BITS).iter().any(|hit| {
                assembly.surface.corners(hit.triangle).contains(&rounded)
                    && (rounded - point).length() <= lattice.bound() * (1.0 + LAST_BITS)
            });
        }

        [vertex_bound, most].iter().any(|bound| {
            let reach = bound * (1.0 + 2.0 * LAST_BITS) * 3f64.sqrt();
            assembly.surface.within(point, reach).iter().any(|hit| {
                let (leaf, _) = assembly.owner(hit.triangle);
                let each = bounds[leaf as usize] + steps[leaf as usize] * LAST_BITS;
                let corners = assembly.surface.corners(hit.triangle);
                corners.iter().any(|&corner| (corner - point).abs().max_element() <= each)
            })
        })
    };
    let missing: Vec<Vec<usize>> = (0..sought.len())
        .step_by(CHUNK)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|first| {
            let range = first..(first + CHUNK).min(sought.len());
            let count = range.len() as u64;
            let missing = range.filter(|&vertex| sought[vertex] && !found(vertex)).collect();
            progress.done(count);
            missing
        })
        .collect();
    figures.thin_vertices = sought.iter().filter(|sought| !**sought).count() as u64;
    for vertex in missing.into_iter().flatten() {
        figures.missing_vertices += 1;
        let point = surface.positions()[vertex];
        check.fail(
            format!("source vertex at {} {} {}", point.x, point.y, point.z),
            format!("no leaf has it within {vertex_bound:.1e} m along each axis"),
            HINT,
        );
    }

    progress.phase("leaves against the source", leaves.len() as u64);
    let farthest: Vec<f64> = leaves
        .par_iter()
        .enumerate()
        .map(|(index, &leaf)| {
            let vertices = geometry[leaf as usize].surface_vertices();
            let samples = points.of_leaf(index).map(|number| points.all[number].point);
            progress.done(1);
            vertices.into_iter().chain(samples).map(|p| surface.distance(p)).fold(0.0, f64::max)
        })
        .collect();
    for (&leaf, &distance) in leaves.iter().zip(&farthest) {
        figures.farthest = figures.farthest.max(distance);
        let bound = rounding(scene, leaf, steps[leaf as usize], bounds[leaf as usize]);
        if distance > bound {
            check.fail(
                &scene.nodes[leaf as usize].file,
                format!(
                    "a point of the leaf is {distance:.2e} m from the source, limit {bound:.1e}"
                ),
                HINT,
            );
        }
    }
    check.summary = format!(
        "{} source triangles are not covered once ({} too small to tell); area off by {:.1e}; \
         {} of {} source vertices missing ({} of thin triangles not sought), bound {:.1e} m along \
         each axis; leaves at most {:.1e} m from the source",
        figures.wrong_triangles,
        figures.unseen_triangles,
        figures.area_difference,
        figures.missing_vertices,
        figures.source_vertices,
        figures.thin_vertices,
        vertex_bound,
        figures.farthest,
    );
    (figures, check)
}

/// Vertices of triangles whose corners stay apart when rounded. The build leaves out triangles
/// that do not, and says so; what they alone use is not expected in the leaves.
fn sought_vertices(source: &Source, apart: impl Fn(DVec3, DVec3) -> bool) -> Vec<bool> {
    let surface = &source.surface;
    let mut sought = vec![false; surface.positions().len()];
    for (number, triangle) in (0..).zip(surface.triangles()) {
        let [a, b, c] = surface.corners(number);
        if apart(a, b) && apart(b, c) && apart(c, a) && !vanishes([a, b, c]) {
            triangle.iter().for_each(|&vertex| sought[vertex as usize] = true);
        }
    }
    sought
}

/// True if two corners of a triangle may be one on the lattice of any block that holds it, however
/// small the block is. The build leaves such triangles out, and says so.
fn vanishes([a, b, c]: [DVec3; 3]) -> bool {
    let extent = (a.max(b).max(c) - a.min(b).min(c)).max_element();
    let magnitude = [a, b, c].map(|corner| corner.abs().max_element()).into_iter();
    let Lattice { step } = Lattice::for_extent(extent, magnitude.fold(0.0, f64::max));
    [a - b, b - c, c - a].iter().any(|edge| edge.abs().max_element() <= step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_vanish_that_no_lattice_of_their_size_tells_from_a_line() {
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        for (corners, expected) in [
            ([at(0., 0., 0.), at(0., 0., 20.), at(1e15, 1e15, 0.)], true),
            ([at(0., 0., 0.), at(0., 0., 20.), at(1e7, 0., 0.)], false),
            ([at(0., 0., 0.), at(0., 0., 1e-9), at(1., 0., 0.)], true),
            ([at(0., 0., 0.), at(0., 0., 1e-9), at(1e-3, 0., 0.)], false),
            ([at(5e6, 0., 0.), at(5e6, 0., 1.), at(5e6 + 1., 0., 0.)], false),
        ] {
            assert_eq!(vanishes(corners), expected, "{corners:?}");
        }
    }
}
