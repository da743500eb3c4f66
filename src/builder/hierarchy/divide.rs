//! Dividing a chunk into the chunks of a node's children.

use super::BlockBuilder;
use super::node::NodeSink;
use super::options::{BorderMode, TreeShape};
use crate::builder::border::chain::KeepRule;
use crate::builder::cut::plane::{Region, best_plane};
use crate::builder::cut::split::{Chunk, Cut, cut};
use crate::builder::cut::uncut::WholeComponents;
use crate::mesh::Mesh;

/// The box of a chunk without what small components reach beyond the planes that it was cut at
/// ([`crate::builder::cut::uncut`]): slabs stay as even as their planes are.
fn bounds_within_cuts(chunk: &Chunk) -> Option<([f32; 3], [f32; 3])> {
    let (mut low, mut high) = chunk.mesh.bounds()?;
    for bit in 0..chunk.path.len() as u32 {
        let plane = chunk.path.plane(bit);
        let (axis, at) = (plane.axis, plane.coordinate);
        let (below, above) = (at - low[axis], high[axis] - at);
        if below > 0.0 && above > 0.0 {
            if below < above {
                low[axis] = at;
            } else {
                high[axis] = at;
            }
        }
    }
    Some((low, high))
}

impl<S: NodeSink> BlockBuilder<'_, S> {
    /// Cuts the chunk of a node at `resolution` into `level_factor` chunks; those without triangles
    /// are left out.
    pub fn divide(&self, chunk: Chunk, resolution: usize) -> Vec<Chunk> {
        let rule = self.keep_rule(resolution);
        let mut chunks = Vec::with_capacity(self.options.level_factor as usize);
        match self.options.tree {
            TreeShape::Balanced => {
                self.halve(chunk, self.options.level_factor as usize, &rule, &mut chunks)
            }
            TreeShape::Thesis => self.slabs(chunk, &rule, &mut chunks),
        }
        chunks
    }

    /// How many vertices of the planes that divide a node's chunk are kept at the resolutions of
    /// its descendants.
    fn keep_rule(&self, resolution: usize) -> KeepRule<'_> {
        let factors = self.resolutions.factors();
        // Where children are leaves but for some that have too many triangles, these stay at the
        // node's own resolution.
        let first = (resolution + 1).min(self.resolutions.last().saturating_sub(1)).max(resolution);
        let border = self.options.constants.border;
        let locked = self.options.borders == BorderMode::Locked;
        let share = |factor: &f64| if locked { 1.0 } else { 1.0 / factor.sqrt() };
        let shares: Vec<f64> = factors[first..].iter().map(share).collect();
        // The deeper the level, the more nodes share the plane: as many as fit along its length.
        let across = f64::from(self.options.level_factor).sqrt();
        let each = f64::from(self.options.desired_tris) / border.triangles_per_vertex;
        let most = |deeper: usize| {
            if locked { f64::INFINITY } else { (each * across.powi(deeper as i32)).ceil() }
        };
        KeepRule {
            most: (0..shares.len().saturating_sub(1)).map(most).collect(),
            shares,
            first_level: first as u8,
            collinear: if locked { -1.0 } else { self.lattice.step },
            baked: self.bake.filter(|plan| plan.always.is_some()).map(|plan| plan.classes),
            constants: border,
        }
    }

    /// Cuts a chunk in two, so that both have triangles for their share of `parts`, and each half
    /// again; a chunk that fits a node is cut no further.
    fn halve(&self, chunk: Chunk, parts: usize, rule: &KeepRule, chunks: &mut Vec<Chunk>) {
        if chunk.mesh.triangles.is_empty() {
            return;
        }
        let fits = chunk.mesh.triangles.len() <= self.options.desired_tris as usize;
        let region = bounds_within_cuts(&chunk).map(|(low, high)| Region {
            low: low.map(f64::from),
            high: high.map(f64::from),
            share: (parts / 2) as f64 / parts as f64,
            touching: self.options.tolerance.sliver_steps * self.lattice.step,
        });
        let Some(region) = region.filter(|_| parts > 1 && !fits) else {
            chunks.push(chunk);
            return;
        };
        let Some((axis, at)) = best_plane(&chunk.mesh, &region, &self.options.constants.cut) else {
            chunks.push(chunk);
            return;
        };
        let coordinate = self.through_vertices(&chunk.mesh, axis, self.lattice.round(at) as f32);
        let width = (at - region.low[axis]).min(region.high[axis] - at);
        let (below, above) = cut(chunk, &self.cut_at(axis, coordinate, width, rule));
        self.halve(below, parts / 2, rule, chunks);
        self.halve(above, parts - parts / 2, rule, chunks);
    }

    /// Cuts a chunk by `level_factor - 1` planes at even distances across its longest side, as the
    /// thesis does.
    fn slabs(&self, chunk: Chunk, rule: &KeepRule, chunks: &mut Vec<Chunk>) {
        let Some((low, high)) = bounds_within_cuts(&chunk) else { return chunks.push(chunk) };
        let slabs = self.options.level_factor;
        let side = |axis: usize| f64::from(high[axis]) - f64::from(low[axis]);
        let axis = (1..3).fold(0, |best, axis| if side(axis) > side(best) { axis } else { best });
        let width = side(axis) / f64::from(slabs);
        let at = |slab: u32| self.lattice.round(f64::from(low[axis]) + width * f64::from(slab));
        let even = (1..slabs).map(|slab| at(slab) as f32);
        let planes: Vec<f32> =
            even.map(|even| self.through_vertices(&chunk.mesh, axis, even)).collect();
        self.bisect(chunk, axis, &planes, width, rule, chunks);
    }

    /// Cuts at the middle plane, then each half at its own.
    fn bisect(
        &self,
        chunk: Chunk,
        axis: usize,
        planes: &[f32],
        width: f64,
        rule: &KeepRule,
        chunks: &mut Vec<Chunk>,
    ) {
        if chunk.mesh.triangles.is_empty() {
            return;
        }
        if planes.is_empty() {
            chunks.push(chunk);
            return;
        }
        let middle = planes.len() / 2;
        let (below, above) = cut(chunk, &self.cut_at(axis, planes[middle], width, rule));
        self.bisect(below, axis, &planes[..middle], width, rule, chunks);
        self.bisect(above, axis, &planes[middle + 1..], width, rule, chunks);
    }

    /// A cut into slabs of about `width` metres.
    fn cut_at<'r>(
        &self,
        axis: usize,
        coordinate: f32,
        width: f64,
        rule: &'r KeepRule,
    ) -> Cut<'r, f32> {
        let most = self.options.desired_tris as usize / 2;
        Cut {
            axis,
            coordinate,
            lattice: Some(self.lattice),
            tolerance: self.options.tolerance,
            whole: WholeComponents::in_slabs(width, most, &self.options.constants.cut),
            rule,
        }
    }

    /// The coordinate of a plane, moved to that of the most vertices that are so near it that they
    /// count as on it ([`crate::builder::cut::split::CutTolerance::sliver_steps`]), of several the
    /// nearest. Vertices beside their plane stay at every level; rows of a grid are often beside it
    /// by a step.
    fn through_vertices(&self, mesh: &Mesh, axis: usize, even: f32) -> f32 {
        let step = self.lattice.step as f32;
        let most = self.options.tolerance.sliver_steps as i32;
        let reach = most as f32 * step;
        let mut counts = vec![0u32; 2 * most as usize + 1];
        for position in &mesh.positions {
            // Multiples of the step, all of them: differences and quotients are exact.
            let beside = position[axis] - even;
            if beside.abs() <= reach {
                counts[((beside / step) as i32 + most) as usize] += 1;
            }
        }
        let best = (-most..=most).max_by_key(|&at| (counts[(at + most) as usize], -at.abs(), at));
        even + best.unwrap_or(0) as f32 * step
    }
}
