//! Extruded footprints in place of many small separate bodies, or fewer and larger boxes.
//!
//! Edge collapse never joins parts that do not touch. Where a node may spend but a few triangles on
//! each of hundreds of buildings, most fall to slivers or go, and with them the volume and the
//! skyline that a city has from afar. Here they become [`prisms`]: blocks of neighbours of about one
//! height, over their footprint, as high as their roofs are on average, always what changes least of
//! what is seen from above and from the sides.
//!
//! Bodies that stand too far apart for that cannot be joined, and a coarse node that has to keep most of them has
//! as many triangles as its children. There, fewer and larger [`boxes`] can stand for them.
//!
//! Those that go on beyond a border, and what is no body (the ground, roads, fences) stay as they
//! are.

mod appearance;
mod boxes;
mod extrudable;
mod prisms;

use std::cell::OnceCell;

pub use self::extrudable::Extrudable;
use self::prisms::{Body, Footprints};
use crate::builder::constants::PrismConstants;
use crate::builder::simplify::parts::{Part, parts};
use crate::mesh::{Coordinate, Mesh, UpAxis};

/// What counts as a body.
#[derive(Clone, Copy, Debug)]
pub struct ComponentRules<'a> {
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// Of each material, whether prisms may have it: they have no texture coordinates, so a plain
    /// one, or one whose texture is baked anew.
    pub extrudable: &'a [bool],
    /// See [`PrismConstants`].
    pub constants: &'a PrismConstants,
}

impl ComponentRules<'_> {
    /// A part of a mesh as a body, if it is one.
    fn body<C: Coordinate>(&self, mesh: &Mesh<C>, part: &Part) -> Option<Body> {
        let may = |&triangle: &[u32; 3]| {
            let material = mesh.triangle_material(triangle) as usize;
            self.extrudable.get(material).copied().unwrap_or_default()
        };
        let body = || Body::of(mesh, &part.triangles, self.up, self.constants);
        part.triangles.iter().all(may).then(body).flatten()
    }

    /// Whether prisms are wanted at all.
    fn any(&self) -> bool {
        self.constants.cells > 0 && self.extrudable.contains(&true)
    }

    /// How many separate bodies a mesh has; none where prisms are not wanted.
    pub fn count<C: Coordinate>(&self, mesh: &Mesh<C>) -> usize {
        if !self.any() {
            return 0;
        }
        parts(mesh).iter().filter(|part| self.body(mesh, part).is_some()).count()
    }
}

/// A mesh whose bodies are prisms.
pub struct Extruded<'a> {
    /// These.
    pub prisms: Mesh,
    /// The triangles of the mesh that they do not stand for.
    pub rest: &'a [[u32; 3]],
}

/// Tells whether a mesh has so many separate bodies that a node with so many triangles has prisms for
/// them.
pub fn has_many_bodies(mesh: &Mesh, target: usize, rules: &ComponentRules) -> bool {
    are_many(rules.count(mesh), target, rules)
}

fn are_many(bodies: usize, target: usize, rules: &ComponentRules) -> bool {
    bodies * rules.constants.triangles_per_body > target
}

/// The bodies of a mesh, which prisms may stand for.
pub struct Components {
    bodies: Vec<(Part, Body)>,
    /// The triangles that are of no body.
    rest: Vec<[u32; 3]>,
    /// The share of the mesh's area that bodies have.
    share: f64,
    /// Footprints, computed for the first budget.
    footprints: OnceCell<Option<Footprints>>,
}

impl Components {
    /// Finds those of a mesh; nothing that has a `locked` vertex is one.
    pub fn of(mesh: &Mesh, locked: &[bool], rules: &ComponentRules) -> Self {
        let (mut bodies, mut rest) = (Vec::new(), Vec::new());
        let (mut in_bodies, mut area) = (0.0, 0.0);
        let parts = if rules.any() { parts(mesh) } else { Vec::new() };
        for part in parts {
            area += part.area;
            let is_free = !part.triangles.iter().flatten().any(|&vertex| locked[vertex as usize]);
            match is_free.then(|| rules.body(mesh, &part)).flatten() {
                Some(body) => {
                    in_bodies += part.area;
                    bodies.push((part, body));
                }
                None => rest.extend_from_slice(&part.triangles),
            }
        }
        Self { bodies, rest, share: in_bodies / area, footprints: OnceCell::new() }
    }

    /// Returns the number of bodies.
    pub fn count(&self) -> usize {
        self.bodies.len()
    }

    /// Tells whether prisms stand for them in a node with so many triangles.
    pub fn are_many(&self, target: usize, rules: &ComponentRules) -> bool {
        are_many(self.bodies.len(), target, rules)
    }

    /// Replaces all of them by prisms, so that about `target` triangles are left for the whole mesh, by
    /// the same rules, if the rest is simplified too; `None` where there are no bodies, or these have too
    /// many borders for so few triangles. Further budgets use the grid of the first.
    pub fn extruded(
        &self,
        mesh: &Mesh,
        target: usize,
        rules: &ComponentRules,
    ) -> Option<Extruded<'_>> {
        let Self { bodies, rest, footprints, .. } = self;
        if bodies.is_empty() {
            return None;
        }
        let most = self.share_of(target);
        let made = || Footprints::of(mesh, bodies, most, rules);
        let footprints = footprints.get_or_init(made).as_ref()?;
        let prisms = footprints.prisms(mesh, bodies, most, rules)?;
        Some(Extruded { prisms, rest })
    }

    /// Replaces all of them by fewer and larger boxes ([`boxes`]), which do not stand where the bodies do; `None`
    /// where there are no bodies.
    pub fn spread(&self, mesh: &Mesh, target: usize, up: UpAxis) -> Option<Extruded<'_>> {
        let Self { bodies, rest, .. } = self;
        let boxes = || boxes::boxes(mesh, bodies, self.share_of(target), up);
        (!bodies.is_empty()).then(|| Extruded { prisms: boxes(), rest })
    }

    /// Returns how many of `target` triangles bodies get: those that the rest does not need.
    fn share_of(&self, target: usize) -> usize {
        let target = target as f64;
        let for_bodies = (target * self.share).max(target - self.rest.len() as f64);
        (for_bodies as usize).max(boxes::TRIANGLES)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A hundred gabled houses of 14 triangles, on a street grid, and one sheet of ground.
    fn town() -> Mesh {
        let mut mesh = Mesh::default();
        for house in 0..100u8 {
            let (x, y) = (f32::from(house % 10) * 14.0, f32::from(house / 10) * 22.0);
            let first = mesh.positions.len() as u32;
            for height in [0.0, 5.0] {
                let corner = |[i, j]: [f32; 2]| [x + 8.0 * i, y + 10.0 * j, height];
                mesh.positions.extend([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(corner));
            }
            mesh.positions.extend([[x + 4.0, y, 8.0], [x + 4.0, y + 10.0, 8.0]]);
            let walls = [(0, 1), (1, 2), (2, 3), (3, 0)];
            for (i, j) in walls {
                mesh.triangles
                    .extend([[i, j, j + 4], [i, j + 4, i + 4]].map(|t| t.map(|v| v + first)));
            }
            let roof = [[4, 5, 8], [7, 9, 6], [4, 8, 9], [4, 9, 7], [8, 5, 6], [8, 6, 9]];
            mesh.triangles.extend(roof.map(|t| t.map(|v| v + first)));
        }
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[-9.0, -9.0, -0.5], [150.0, -9.0, -0.5], [150.0, 230.0, -0.5]]);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh.materials = vec![0; mesh.positions.len()];
        mesh
    }

    fn rules(constants: &PrismConstants) -> ComponentRules<'_> {
        ComponentRules { up: UpAxis::Z, extrudable: &[true], constants }
    }

    #[test]
    fn a_town_becomes_prisms_of_its_footprint_and_volume() {
        let mesh = town();
        let mut constants = PrismConstants { cells: 1 << 18, ..PrismConstants::default() };
        let free = vec![false; mesh.positions.len()];
        // With 6 triangles a house, rows are joined across gaps of 6 m, which are filled. With 13, each house
        // has its own box.
        for (target, most) in [(600, 1.5), (1300, 1.03)] {
            let rules = rules(&constants);
            let bodies = Components::of(&mesh, &free, &rules);
            let Extruded { prisms, rest, .. } = bodies.extruded(&mesh, target, &rules).unwrap();
            assert_eq!(rest.len(), 1, "the ground");
            let count = prisms.triangles.len();
            assert!(count > target / 2 && count <= target + target / 10, "{count}");
            // Gables from 5 to 8 m: their mean and half of the standard deviation.
            let high = 6.5 + 0.5 * (9.0f64 / 12.0).sqrt();
            let roofs = prisms.positions.iter().map(|p| f64::from(p[2])).filter(|&z| z > 0.01);
            for roof in roofs {
                assert!((roof - high).abs() < 0.1, "{roof}");
            }
            // Of closed walls that face outwards, on the ground, where a floor would add nothing.
            let six = |&t: &[u32; 3]| {
                let [a, b, c] = prisms.corners(t);
                a.dot(b.cross(c))
            };
            let volume = prisms.triangles.iter().map(six).sum::<f64>() / 6.0;
            let covered: f64 = prisms
                .triangles
                .iter()
                .map(|&t| {
                    let [a, b, c] = prisms.corners(t);
                    (b - a).cross(c - a).z.max(0.0) * 0.5
                })
                .sum();
            assert!((volume / covered - high).abs() < 0.1, "{volume} {covered}");
            assert!((0.97..most).contains(&(covered / 8000.0)), "{covered}");
        }
        let mut textured = mesh.clone();
        textured.texcoords = vec![[0.5; 2]; mesh.positions.len()];
        let all = rules(&constants);
        let textured_bodies = Components::of(&textured, &free, &all);
        let baked = textured_bodies.extruded(&textured, 600, &all).unwrap().prisms;
        assert_eq!(baked.texcoords.len(), baked.positions.len());
        let kept = ComponentRules { extrudable: &[false], ..all };
        assert!(Components::of(&textured, &free, &kept).extruded(&textured, 600, &kept).is_none());
        assert_eq!((all.count(&textured), kept.count(&textured)), (100, 0));
        let mut locked = free.clone();
        locked[0] = true;
        let kept = Components::of(&mesh, &locked, &all);
        assert_eq!(kept.extruded(&mesh, 600, &all).unwrap().rest.len(), 1 + 14);
        let free_bodies = Components::of(&mesh, &free, &all);
        assert!(free_bodies.are_many(900, &all) && !free_bodies.are_many(1200, &all));
        constants.cells = 0;
        let none = rules(&constants);
        assert!(Components::of(&mesh, &free, &none).extruded(&mesh, 600, &none).is_none());
    }
}
