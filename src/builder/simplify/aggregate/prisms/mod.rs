//! Extruded footprints in place of many small separate bodies.
//!
//! Bodies are seen from above, as heights over a grid ([`heights`]); regions of one height are
//! merged with neighbours and with gaps between them, or given up ([`regions`]), and their borders
//! get fewer points ([`outlines`]), all by the volume that changes. A region is a flat roof, and
//! where two meet is a wall; there are no floors, which nobody sees.

mod arcs;
mod body;
mod gaps;
mod heights;
mod outlines;
mod regions;
mod segments;
mod squares;
mod tidy;

use glam::{DVec2, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};

use self::arcs::{Arc, HalfArc, arcs, rings, twice_area};
pub(super) use self::body::Body;
use self::heights::{Grid, Heights, NONE};
use self::outlines::Outlines;
use self::regions::{Labels, Regions};
use super::ComponentRules;
use super::appearance::Appearance;
use crate::builder::constants::PrismConstants;
use crate::builder::simplify::parts::Part;
use crate::mesh::{Mesh, UpAxis, wide};

/// The bodies of a mesh as regions of a grid, from which prisms are made for one budget or several.
pub(super) struct Footprints {
    heights: Heights,
    regions: Regions,
}

impl Footprints {
    /// Bodies with their triangles, by a grid that is fine enough for prisms of about `target` triangles;
    /// `None` where they have no extent.
    pub fn of(
        mesh: &Mesh,
        bodies: &[(Part, Body)],
        target: usize,
        rules: &ComponentRules,
    ) -> Option<Self> {
        let &ComponentRules { up, constants, .. } = rules;
        let footprint: f64 = bodies.iter().map(|(_, body)| body.footprint).sum();
        // The side of a square as large as the footprints have for each triangle.
        let share = (footprint / target as f64).sqrt();
        let heights = seen_from_above(mesh, bodies, up, share, constants)?;
        let gap = constants.gap * share / heights.grid.side;
        let regions = Regions::of(&heights, gap, constants);
        Some(Self { heights, regions })
    }

    /// Prisms with at most about `target` triangles; `None` where borders have too many arcs for so few.
    pub fn prisms(
        &self,
        mesh: &Mesh,
        bodies: &[(Part, Body)],
        target: usize,
        rules: &ComponentRules,
    ) -> Option<Mesh> {
        let &ComponentRules { up, constants, .. } = rules;
        let Self { heights, regions } = self;
        let count = regions.count().min((target as f64 / TRIANGLES_EACH) as usize).max(1);
        let least = (constants.min_region * constants.resolution * constants.resolution) as usize;
        let labels = regions.down_to(count, least);
        let arcs = arcs(&labels.of_cell, &regions.near, &heights.grid);
        let height = |region: u32, other: u32| match labels.regions.get(&region) {
            Some(region) => region.height,
            None => labels.regions.get(&other).map_or(0.0, |region| region.low),
        };
        let step = |[left, right]: [u32; 2]| height(left, right) - height(right, left);
        let lost = |inside: u32, outside: u32| match labels.regions.get(&inside) {
            Some(region) if outside == NONE => {
                constants.footprint_penalty * (region.height - region.low)
            }
            _ => step([inside, outside]).abs(),
        };
        let mut outlines = Outlines::of(&arcs, step, lost);
        // A ring of n corners is n − 2 triangles.
        let corners = target + 2 * labels.regions.len();
        outlines.simplify(corners);
        let over = outlines.triangles().saturating_sub(corners) as f64 / target as f64;
        let walls = Walls { mesh, bodies, up, heights, labels: &labels };
        (over <= MOST_OVER).then(|| walls.built(&arcs, &outlines))
    }
}

/// Triangles for a region on average: a box without a floor has ten, and many regions are larger
/// than a box.
const TRIANGLES_EACH: f64 = 12.5;

/// Prisms may have this share of their triangles more.
const MOST_OVER: f64 = 0.03;

fn seen_from_above(
    mesh: &Mesh,
    bodies: &[(Part, Body)],
    up: UpAxis,
    share: f64,
    constants: &PrismConstants,
) -> Option<Heights> {
    let at = |vertex: &u32| up.z_up(wide(mesh.positions[*vertex as usize]));
    let all = || bodies.iter().flat_map(|(part, _)| part.triangles.as_flattened());
    let low = all().fold(DVec2::INFINITY, |low, vertex| low.min(at(vertex).truncate()));
    let high = all().fold(DVec2::NEG_INFINITY, |high, vertex| high.max(at(vertex).truncate()));
    let size = (high - low).max(DVec2::splat(share));
    let least = (size.x * size.y / constants.cells as f64).sqrt();
    let side = (share / constants.resolution).max(least);
    if !(side > 0.0 && side.is_finite()) {
        return None;
    }
    // Wider than what is near bodies ([`heights::Near`]).
    let margin = (constants.gap * share / side).ceil() as usize + 2;
    let mut heights = Heights::none(Grid::over(low, high, side, margin), bodies.len());
    for (number, (part, _)) in (0..).zip(bodies) {
        for triangle in &part.triangles {
            heights.add(number, [0, 1, 2].map(|corner| at(&triangle[corner])));
        }
    }
    Some(heights)
}

/// What prisms are made from.
struct Walls<'a> {
    mesh: &'a Mesh,
    bodies: &'a [(Part, Body)],
    up: UpAxis,
    heights: &'a Heights,
    labels: &'a Labels,
}

impl Walls<'_> {
    fn built(&self, arcs: &[Arc], outlines: &Outlines) -> Mesh {
        let looks = self.looks();
        let is_left = |ring: &[HalfArc]| !ring.iter().any(|half| outlines.is_gone(half.arc));
        let points: Vec<Vec<DVec2>> = (0..arcs.len()).map(|arc| outlines.points(arc)).collect();
        let mut result = Mesh::default();
        let mut by_region: FxHashMap<u32, Vec<Vec<DVec2>>> = FxHashMap::default();
        for (region, ring) in rings(arcs).into_iter().filter(|(_, ring)| is_left(ring)) {
            by_region.entry(region).or_default().push(outline(&ring, arcs, &points));
        }
        let mut roofed = FxHashSet::default();
        for (&number, region) in &self.labels.regions {
            // What is nothing but a gap, its bodies gone as crumbs, has no look.
            let Some((rings, look)) = by_region.get(&number).zip(looks.get(&number)) else {
                continue;
            };
            for polygon in polygons(rings) {
                self.roof(&mut result, &polygon, region.height, look.roof);
                roofed.insert(number);
            }
        }
        for (number, (arc, points)) in arcs.iter().zip(&points).enumerate() {
            if !outlines.is_gone(number) {
                // Of what is given up as a whole, a tower may be left.
                let sides = arc.sides.map(|side| roofed.contains(&side).then_some(side));
                self.wall(&mut result, sides, arc.nodes.is_none(), points, &looks);
            }
        }
        let has_area = |&triangle: &[u32; 3]| result.triangle_area(triangle) > 0.0;
        let triangles = result.triangles.iter().copied().filter(has_area).collect();
        Mesh { triangles, ..result }
    }

    /// Each region looks like the body that covers most of it.
    fn looks(&self) -> FxHashMap<u32, &Body> {
        let mut cells: FxHashMap<(u32, u32), usize> = FxHashMap::default();
        for (&region, &body) in self.labels.of_cell.iter().zip(&self.heights.body) {
            if region != NONE && body != NONE {
                *cells.entry((region, body)).or_default() += 1;
            }
        }
        let mut most: FxHashMap<u32, (usize, u32)> = FxHashMap::default();
        for ((region, body), count) in cells {
            let known = most.entry(region).or_default();
            *known = (*known).max((count, body));
        }
        most.into_iter()
            .map(|(region, (_, body))| (region, &self.bodies[body as usize].1))
            .collect()
    }

    fn push(&self, result: &mut Mesh, corner: DVec2, height: f64, look: &Appearance) -> u32 {
        let place = self.heights.grid.place(corner).extend(height);
        let place: DVec3 = self.up.from_z_up(place);
        look.push(result, self.mesh, place.as_vec3().to_array())
    }

    fn roof(&self, result: &mut Mesh, polygon: &[Vec<DVec2>], height: f64, look: Appearance) {
        let mut holes: Vec<u32> = Vec::new();
        let mut corners: Vec<DVec2> = Vec::new();
        for ring in polygon {
            if !corners.is_empty() {
                holes.push(corners.len() as u32);
            }
            corners.extend(ring);
        }
        let mut clipped: Vec<u32> = Vec::new();
        earcut::Earcut::new().earcut(corners.iter().map(|p| [p.x, p.y]), &holes, &mut clipped);
        let first = result.positions.len() as u32;
        for &corner in &corners {
            self.push(result, corner, height, &look);
        }
        for triangle in clipped.chunks_exact(3) {
            let [a, b, c] = [triangle[0], triangle[1], triangle[2]];
            let [p, q, r] = [a, b, c].map(|corner| corners[corner as usize]);
            let counter_clockwise = (q - p).perp_dot(r - p) > 0.0;
            let facing_up = if counter_clockwise { [a, b, c] } else { [a, c, b] };
            result.triangles.push(facing_up.map(|corner| first + corner));
        }
    }

    /// The wall between the regions at the left and right of a border, which faces the lower one.
    fn wall(
        &self,
        result: &mut Mesh,
        sides: [Option<u32>; 2],
        is_closed: bool,
        points: &[DVec2],
        looks: &FxHashMap<u32, &Body>,
    ) {
        let height = |side: Option<u32>| side.map(|region| self.labels.regions[&region].height);
        let faces_right = height(sides[0]) >= height(sides[1]);
        let [higher, lower] = if faces_right { sides } else { [sides[1], sides[0]] };
        let Some(region) = higher else { return };
        let (higher, lower) = (self.labels.regions[&region].height, height(lower));
        let base = self.labels.regions[&region].low;
        let look = looks[&region].wall;
        let mut rows = Vec::with_capacity(points.len() + 1);
        for &corner in points {
            let foot = lower.unwrap_or_else(|| self.foot(corner).unwrap_or(base));
            let foot = foot.min(higher);
            let foot = self.push(result, corner, foot, &look);
            rows.push([foot, self.push(result, corner, higher, &look)]);
        }
        if is_closed {
            rows.push(rows[0]);
        }
        for pair in rows.windows(2) {
            let ([p, p_high], [q, q_high]) = (pair[0], pair[1]);
            let right = [[p, q, q_high], [p, q_high, p_high]];
            let facing = right.map(|[a, b, c]| if faces_right { [a, b, c] } else { [a, c, b] });
            result.triangles.extend(facing);
        }
    }

    /// The lowest of what is near a point.
    fn foot(&self, corner: DVec2) -> Option<f64> {
        let around = (-2..=2).flat_map(|y| (-2..=2).map(move |x| DVec2::new(x.into(), y.into())));
        let lows = around.filter_map(|way| {
            let cell = self.heights.grid.cell(corner + way)?;
            Some(self.heights.low[cell]).filter(|low| low.is_finite())
        });
        lows.min_by(f32::total_cmp).map(f64::from)
    }
}

/// The points of a ring.
fn outline(ring: &[HalfArc], arcs: &[Arc], points: &[Vec<DVec2>]) -> Vec<DVec2> {
    let mut outline = Vec::new();
    for half in ring {
        let of_arc = &points[half.arc];
        // The last is the first of the next one.
        let most = if arcs[half.arc].nodes.is_some() { of_arc.len() - 1 } else { of_arc.len() };
        match half.forward {
            true => outline.extend(of_arc.iter().take(most)),
            false => outline.extend(of_arc.iter().rev().take(most)),
        }
    }
    outline
}

/// Outer rings, each with the holes that are in it.
fn polygons(rings: &[Vec<DVec2>]) -> Vec<Vec<Vec<DVec2>>> {
    let (mut outer, holes): (Vec<&Vec<DVec2>>, Vec<&Vec<DVec2>>) =
        rings.iter().partition(|ring| twice_area(ring) > 0.0);
    outer.sort_by(|a, b| twice_area(a).total_cmp(&twice_area(b)));
    let mut polygons: Vec<Vec<Vec<DVec2>>> = outer.iter().map(|&ring| vec![ring.clone()]).collect();
    for hole in holes {
        let around = outer.iter().position(|ring| is_inside(hole[0], ring));
        if let Some(polygon) = around.and_then(|number| polygons.get_mut(number)) {
            polygon.push(hole.clone());
        }
    }
    polygons
}

/// Whether a point is inside a ring.
fn is_inside(p: DVec2, ring: &[DVec2]) -> bool {
    let sides = ring.iter().zip(ring.iter().cycle().skip(1));
    let crossings = sides.filter(|(a, b)| {
        (a.y <= p.y) != (b.y <= p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)
    });
    crossings.count() % 2 == 1
}
