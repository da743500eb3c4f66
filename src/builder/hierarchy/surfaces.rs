//! The surfaces of a node that are simplified apart.
//!
//! If they were simplified as one, the largest would stand for all: a glass dome for the house in it. So opaque and
//! blended triangles have a ladder each, and their shares of the node's triangles by area. Cut-outs, as leaves, are
//! simplified with the opaque triangles. If they lose their area by that, they become [`Cards`].

use crate::builder::border::vertex::{Border, Path};
use crate::builder::simplify::cards::Cards;
use crate::builder::simplify::ladder::{BodyPlacement, Ladder, Method, locked_vertices};
use crate::builder::simplify::simplified::Simplified;
use crate::mesh::{AlphaMode, Mesh};

/// Cut-outs that keep a smaller share of their area become cards, 0–1.
const KEPT: f64 = 0.95;

/// The properties of materials that decide how their surfaces are simplified, by material.
#[derive(Clone, Copy)]
pub(super) struct Materials<'a> {
    /// Their alpha modes.
    pub alpha: &'a [AlphaMode],
    /// Tells whether their image can be shown several times side by side.
    pub repeats: &'a [bool],
}

impl Materials<'_> {
    fn alpha(&self, material: u32) -> AlphaMode {
        self.alpha.get(material as usize).copied().unwrap_or_default()
    }

    fn is_cut_out(&self, material: u32) -> bool {
        matches!(self.alpha(material), AlphaMode::Mask { .. })
    }

    /// Square metres.
    fn cut_out_area(&self, mesh: &Mesh) -> f64 {
        let triangles = mesh.triangles.iter();
        let cut_out = triangles.filter(|t| self.is_cut_out(mesh.triangle_material(**t)));
        cut_out.map(|&triangle| mesh.triangle_area(triangle)).sum()
    }
}

/// A part of a node's surface, and its share of the triangles that the node may have.
type Shared<T> = (T, f64);

/// The ladders of a node's surfaces, prepared once for all budgets.
pub(super) struct NodeSurfaces<'a> {
    materials: Materials<'a>,
    /// Square metres.
    cut_out_area: f64,
    ladders: Vec<Shared<Ladder<'a>>>,
    /// The ladders of what is no card, and the cards; `None` where there are no cards.
    with_cards: Option<(Vec<Shared<Ladder<'a>>>, Shared<Cards>)>,
}

impl<'a> NodeSurfaces<'a> {
    /// Prepares a mesh whose border is thinned for a node of `path` at `level`.
    pub fn new(
        mesh: &Mesh,
        border: &Border,
        path: &Path,
        level: u8,
        method: Method<'a>,
        materials: Materials<'a>,
    ) -> Self {
        let area = mesh.area();
        let ladders = |triangles: &[[u32; 3]]| {
            let is_see_through = |triangle: &[u32; 3]| {
                materials.alpha(mesh.triangle_material(*triangle)) == AlphaMode::Blend
            };
            let (see_through, solid): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
                triangles.iter().partition(|triangle| is_see_through(triangle));
            let surfaces = [solid, see_through].into_iter().filter(|all| !all.is_empty());
            let shared = |triangles: Vec<[u32; 3]>| {
                let is_all = triangles.len() == mesh.triangles.len();
                let part = Mesh { triangles, ..mesh.clone() };
                let share = if is_all { 1.0 } else { part.area() / area };
                (Ladder::new(&part, border, path, level, method), share)
            };
            surfaces.map(shared).collect::<Vec<_>>()
        };
        let locked = locked_vertices(border, path, level);
        let is_cut_out = |material: u32| materials.is_cut_out(material);
        let (cards, rest) = Cards::of(mesh, border, method.up, is_cut_out, &locked);
        let with_cards = (!cards.is_empty()).then(|| {
            let share = if rest.is_empty() { 1.0 } else { cards.area() / area };
            (ladders(&rest), (cards, share))
        });
        let cut_out_area = materials.cut_out_area(mesh);
        Self { materials, cut_out_area, ladders: ladders(&mesh.triangles), with_cards }
    }

    /// Simplifies all of them to about `target` triangles together; `None` where there is nothing.
    pub fn simplified(&self, target: usize, bodies: BodyPlacement) -> Option<Simplified> {
        let share = |share: f64| ((target as f64 * share).round() as usize).max(1);
        let joined = |ladders: &[Shared<Ladder>]| {
            // If each surface has equally many boxes for a body, those of bodies inside of others are inside, too.
            let all: usize = ladders.iter().map(|(ladder, _)| ladder.bodies()).sum();
            let is_by_bodies = bodies == BodyPlacement::Spread
                && ladders.iter().all(|(ladder, _)| ladder.bodies() > 0);
            let simplified = |(ladder, of_all): &Shared<Ladder>| {
                let by_bodies = ladder.bodies() as f64 / all as f64;
                ladder.simplified(share(if is_by_bodies { by_bodies } else { *of_all }), bodies)
            };
            ladders.iter().map(simplified).reduce(join)
        };
        let without_cards = joined(&self.ladders)?;
        let Some((ladders, (cards, of_all))) = &self.with_cards else {
            return Some(without_cards);
        };
        if self.materials.cut_out_area(&without_cards.mesh) >= KEPT * self.cut_out_area {
            return Some(without_cards);
        }
        let repeats = |material: u32| self.materials.repeats.get(material as usize) == Some(&true);
        let cards = cards.simplified(share(*of_all), repeats);
        joined(ladders).into_iter().chain([cards]).reduce(join)
    }
}

fn join(mut one: Simplified, other: Simplified) -> Simplified {
    one.join(other);
    one
}
