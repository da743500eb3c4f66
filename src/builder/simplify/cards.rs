//! Leaves and trees that are cards: many small separate parts with cut-out textures.
//!
//! Edge collapse can only drop cards, and a forest goes bare. As in stochastic simplification of aggregate detail
//! (Cook, Halstead, Planck & Ryu 2007), some cards stay, spread evenly, and are enlarged so that the area is kept.
//! If its texture repeats, a card becomes a row: it is widened, and shows the whole texture several times side by
//! side. Other cards are scaled from their foot, so that they stay on the ground.

use glam::{DVec2, DVec3};

use crate::builder::border::vertex::Border;
use crate::builder::simplify::compact::with_triangles;
use crate::builder::simplify::morton::places;
use crate::builder::simplify::parts::{Part, parts};
use crate::builder::simplify::simplified::{LadderStep, Simplified};
use crate::mesh::{Mesh, UpAxis, wide};
use crate::random::{hash, unit};

/// A part with more triangles is no card: two crossed quads, with backs, are one.
const MOST_TRIANGLES: usize = 8;

/// A card is no wider than so many times the ground that the cards measure across that it stands for.
const WIDEST: f64 = 4.0;

/// The card that stays in one place has at least this share of the area of the largest one there.
const LARGE: f64 = 0.75;

/// A card and where it is.
struct Card {
    part: Part,
    material: u32,
    /// Its middle, Z up.
    middle: DVec3,
    /// The point below its middle at its lowest height, Z up.
    foot: DVec3,
    /// Sides of the box around it, seen from above.
    extent: DVec2,
}

/// The cards of a mesh, in an order in which neighbours in the list are neighbours in space.
pub struct Cards {
    mesh: Mesh,
    border: Border,
    up: UpAxis,
    cards: Vec<Card>,
}

impl Cards {
    /// Takes the cards out of the triangles of a mesh: parts of few triangles that all have a material with cut-outs,
    /// and no `locked` vertex. The other triangles are returned, too.
    pub fn of(
        mesh: &Mesh,
        border: &Border,
        up: UpAxis,
        is_cut_out: impl Fn(u32) -> bool,
        locked: &[bool],
    ) -> (Self, Vec<[u32; 3]>) {
        let (cut_out, mut rest): (Vec<[u32; 3]>, Vec<[u32; 3]>) = mesh
            .triangles
            .iter()
            .partition(|triangle| is_cut_out(mesh.triangle_material(**triangle)));
        let mut cards = Vec::new();
        if !cut_out.is_empty() {
            let all = Mesh { triangles: cut_out, ..mesh.clone() };
            for part in parts(&all) {
                let is_free = || !part.triangles.iter().flatten().any(|&v| locked[v as usize]);
                if part.triangles.len() <= MOST_TRIANGLES && is_free() {
                    cards.push(Card::of(mesh, part, up));
                } else {
                    rest.extend(part.triangles);
                }
            }
        }
        let middles: Vec<DVec3> = cards.iter().map(|card| card.middle).collect();
        let places = places(&middles);
        let mut order: Vec<usize> = (0..cards.len()).collect();
        order.sort_by_key(|&card| (cards[card].material, places[card]));
        let mut cards: Vec<Option<Card>> = cards.into_iter().map(Some).collect();
        let cards: Vec<Card> = order.into_iter().filter_map(|card| cards[card].take()).collect();
        let triangles: Vec<[u32; 3]> =
            cards.iter().flat_map(|card| &card.part.triangles).copied().collect();
        let mesh = Mesh { triangles, ..mesh.clone() };
        (Self { mesh, border: border.clone(), up, cards }, rest)
    }

    /// Tells whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cards.is_empty()
    }

    /// Square metres.
    pub fn area(&self) -> f64 {
        self.cards.iter().map(|card| card.part.area).sum()
    }

    /// Returns as many cards as have about `target` triangles, at least one of each material. `repeats` tells by
    /// material whether its texture may be shown beyond its sides.
    pub fn simplified(&self, target: usize, repeats: impl Fn(u32) -> bool) -> Simplified {
        let Self { mesh, border, up, cards } = self;
        let step = LadderStep::Cards;
        let share = target as f64 / mesh.triangles.len() as f64;
        if share >= 1.0 {
            let (mesh, border) = with_triangles(mesh, border, &mesh.triangles);
            return Simplified { mesh, border, error: 0.0, step };
        }
        let bounds = bounds(cards);
        let mut kept = Vec::new();
        let mut enlarged = mesh.clone();
        for of_material in cards.chunk_by(|a, b| a.material == b.material) {
            let all = of_material.len();
            let count = ((all as f64 * share).round() as usize).clamp(1, all);
            let repeats = repeats(of_material[0].material);
            let mut owed = 0.0;
            for number in 0..count {
                let around = &of_material[number * all / count..(number + 1) * all / count];
                let card = chosen(around, number as u64);
                kept.extend_from_slice(&card.part.triangles);
                let area = around.iter().map(|card| card.part.area).sum::<f64>();
                let wanted = (area + owed).max(card.part.area);
                let widest = WIDEST * across(around);
                let got = card.enlarge(&mut enlarged, *up, wanted, widest, repeats);
                card.move_inside(&mut enlarged, *up, bounds);
                // The next cards make up for the area that whole copies lack or have too much.
                owed = (area + owed - got).clamp(-area, area);
            }
        }
        let (mesh, border) = with_triangles(&enlarged, border, &kept);
        Simplified { mesh, border, error: 0.0, step }
    }
}

impl Card {
    fn of(mesh: &Mesh, part: Part, up: UpAxis) -> Self {
        let material = mesh.triangle_material(part.triangles[0]);
        let corners = || {
            part.triangles.as_flattened().iter().map(|&v| up.z_up(wide(mesh.positions[v as usize])))
        };
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let middle = (low + high) * 0.5;
        let foot = middle.with_z(low.z);
        Self { part, material, middle, foot, extent: (high - low).truncate() }
    }

    /// Enlarges it to so much area, but to no more than `widest` metres across; what it then has, square metres.
    fn enlarge(&self, mesh: &mut Mesh, up: UpAxis, area: f64, widest: f64, repeats: bool) -> f64 {
        let at = |vertex: u32| up.z_up(wide(mesh.positions[vertex as usize]));
        let doubled = |[a, b, c]: [u32; 3]| (at(b) - at(a)).cross(at(c) - at(a));
        let doubled: Vec<DVec3> = self.part.triangles.iter().map(|&t| doubled(t)).collect();
        let most = (widest / self.extent.max_element()).max(1.0);
        let larger = (area / self.part.area).sqrt().min(most);
        if !larger.is_finite() {
            return self.part.area;
        }
        // Wider by a factor, what is upright grows by it and what is level by its square.
        let area_at = |factor: f64| {
            let grown = |n: &DVec3| {
                DVec3::new(n.x * factor, n.y * factor, n.z * factor * factor).length() * 0.5
            };
            doubled.iter().map(grown).sum::<f64>()
        };
        let (mut low, mut high) = (1.0, most);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            *if area_at(middle) < area { &mut low } else { &mut high } = middle;
        }
        let copies = high.round();
        match self.repeated(mesh, up, copies).filter(|_| repeats) {
            Some(texcoords) => {
                for (vertex, texcoord) in texcoords {
                    mesh.texcoords[vertex as usize] = texcoord;
                }
                self.scale(mesh, up, DVec3::new(copies, copies, 1.0));
                area_at(copies)
            }
            None => {
                self.scale(mesh, up, DVec3::splat(larger));
                self.part.area * larger * larger
            }
        }
    }

    /// Moves it sideways to where no part of it is outside of these bounds, or as much inside as outside.
    fn move_inside(&self, mesh: &mut Mesh, up: UpAxis, [low, high]: [DVec2; 2]) {
        let vertices = self.vertices();
        let at = |&vertex: &u32| up.z_up(wide(mesh.positions[vertex as usize])).truncate();
        let own_low = vertices.iter().map(at).fold(DVec2::INFINITY, DVec2::min);
        let own_high = vertices.iter().map(at).fold(DVec2::NEG_INFINITY, DVec2::max);
        let (up_by, down_by) =
            ((low - own_low).max(DVec2::ZERO), (high - own_high).min(DVec2::ZERO));
        let aside = (up_by + down_by).extend(0.0);
        for vertex in vertices {
            let position = &mut mesh.positions[vertex as usize];
            *position = up.from_z_up(up.z_up(wide(*position)) + aside).as_vec3().to_array();
        }
    }

    fn vertices(&self) -> Vec<u32> {
        let mut vertices = self.part.triangles.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// Scales its vertices from the middle of its foot.
    fn scale(&self, mesh: &mut Mesh, up: UpAxis, factors: DVec3) {
        for vertex in self.vertices() {
            let position = &mut mesh.positions[vertex as usize];
            let scaled = self.foot + (up.z_up(wide(*position)) - self.foot) * factors;
            *position = up.from_z_up(scaled).as_vec3().to_array();
        }
    }

    /// The texture coordinates of its vertices where it becomes a row of so many copies. `None` where copies would
    /// show something else beside it, since it does not have the whole texture, or a side that is not upright.
    fn repeated(&self, mesh: &Mesh, up: UpAxis, copies: f64) -> Option<Vec<(u32, [f32; 2])>> {
        let texcoord = |vertex: u32| mesh.texcoords.get(vertex as usize).map(|&t| wide2(t));
        let vertices = self.vertices();
        let texcoords: Vec<DVec2> = vertices.iter().map(|&v| texcoord(v)).collect::<Option<_>>()?;
        let low = texcoords.iter().copied().reduce(DVec2::min)?;
        let high = texcoords.iter().copied().reduce(DVec2::max)?;
        let whole = (high - low).round();
        let mut moved: Vec<(u32, DVec2)> = Vec::new();
        for (&vertex, &texcoord_of_vertex) in vertices.iter().zip(&texcoords) {
            let triangle = self.part.triangles.iter().find(|t| t.contains(&vertex))?;
            let [a, b, c] = triangle.map(|v| up.z_up(wide(mesh.positions[v as usize])));
            let [p, q, r] = triangle.map(texcoord);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            if normal.z.abs() > UPRIGHT {
                return None;
            }
            // Texture coordinates go on as they do in the triangle.
            let position = up.z_up(wide(mesh.positions[vertex as usize]));
            let aside = (position - self.foot) * DVec3::new(copies - 1.0, copies - 1.0, 0.0);
            let (ab, ac) = (b - a, c - a);
            let (d, e, f) = (ab.length_squared(), ab.dot(ac), ac.length_squared());
            let (x, y) = (aside.dot(ab), aside.dot(ac));
            let determinant = d * f - e * e;
            let v = (f * x - e * y) / determinant;
            let w = (d * y - e * x) / determinant;
            let aside = (q? - p?) * v + (r? - p?) * w;
            moved.push((vertex, texcoord_of_vertex + aside));
        }
        let new_low = moved.iter().map(|&(_, at)| at).reduce(DVec2::min)?;
        let new_high = moved.iter().map(|&(_, at)| at).reduce(DVec2::max)?;
        for axis in 0..2 {
            let (before, after) = (high[axis] - low[axis], new_high[axis] - new_low[axis]);
            let is_moved = (after - before).abs() > NOT_WHOLE;
            let is_whole = whole[axis] >= 1.0 && (before - whole[axis]).abs() < NOT_WHOLE;
            if !after.is_finite() || is_moved && !is_whole {
                return None;
            }
        }
        // The row begins where a copy does.
        let shift = low - new_low;
        let at = |(vertex, at): (u32, DVec2)| (vertex, (at + shift).as_vec2().to_array());
        Some(moved.into_iter().map(at).collect())
    }
}

/// A card is upright whose normal rises by no more than this, 0–1.
const UPRIGHT: f64 = 0.1;

/// A card may have so much less or more than a whole texture along each axis.
const NOT_WHOLE: f64 = 0.02;

fn wide2(texcoord: [f32; 2]) -> DVec2 {
    DVec2::from(texcoord.map(f64::from))
}

/// Halvings of the range of factors: more do not show.
const BISECTIONS: usize = 40;

/// The card that stays of some: one of the large, which one is left to chance, since cards of one tree, which are
/// crossed, follow each other in a fixed order.
fn chosen(cards: &[Card], number: u64) -> &Card {
    let most = cards.iter().map(|card| card.part.area).fold(0.0, f64::max);
    let large: Vec<&Card> = cards.iter().filter(|card| card.part.area >= LARGE * most).collect();
    let place = unit(hash(0, number, cards.len() as u64)) * large.len() as f64;
    large.get(place as usize).copied().unwrap_or(&cards[0])
}

/// Returns the diagonal of the box around cards, seen from above, metres.
fn across(cards: &[Card]) -> f64 {
    let [low, high] = bounds(cards);
    (high - low).length()
}

/// The lowest and the highest corner of cards, seen from above.
fn bounds(cards: &[Card]) -> [DVec2; 2] {
    let corners =
        |sign: f64| cards.iter().map(move |c| c.middle.truncate() + sign * 0.5 * c.extent);
    let low = corners(-1.0).fold(DVec2::INFINITY, DVec2::min);
    let high = corners(1.0).fold(DVec2::NEG_INFINITY, DVec2::max);
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trees of two crossed cards, 5 m wide and `height` high, on a grid of 10 m, and a triangle of ground.
    fn forest(side: u16, height: f32) -> Mesh {
        let mut mesh = Mesh::default();
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let (x, y) = (f32::from(x) * 10.0, f32::from(y) * 10.0);
            for [dx, dy] in [[2.5, 0.0], [0.0, 2.5]] {
                let first = mesh.positions.len() as u32;
                for (sign, z) in [(-1.0, 0.0), (1.0, 0.0), (1.0, height), (-1.0, height)] {
                    mesh.positions.push([x + sign * dx, y + sign * dy, z]);
                    mesh.materials.push(1);
                }
                mesh.triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|v| first + v)));
            }
        }
        let first = mesh.positions.len() as u32;
        mesh.positions.extend([[0.0, 0.0, 0.0], [500.0, 0.0, 0.0], [0.0, 500.0, 0.0]]);
        mesh.materials.extend([0; 3]);
        mesh.triangles.push([first, first + 1, first + 2]);
        mesh
    }

    fn cards(mesh: &Mesh, locked: &[bool]) -> (Cards, Vec<[u32; 3]>) {
        let border = Border::interior(mesh.positions.len());
        Cards::of(mesh, &border, UpAxis::Z, |material| material == 1, locked)
    }

    #[test]
    fn fewer_cards_keep_the_area_the_ground_and_both_directions() {
        let mesh = forest(20, 8.0);
        let (cards, rest) = cards(&mesh, &vec![false; mesh.positions.len()]);
        assert_eq!(rest, mesh.triangles[1600..]);
        assert_eq!(cards.simplified(2000, |_| false).mesh.triangles.len(), 1600, "all");
        for target in [800, 320, 100] {
            let fewer = cards.simplified(target, |_| false).mesh;
            assert_eq!(fewer.triangles.len(), target);
            let area = 800.0 * 40.0;
            assert!((fewer.area() - area).abs() < 1e-3 * area, "{target}: {}", fewer.area());
            assert_eq!(fewer.bounds().unwrap().0[2], 0.0);
            let along_x = |t: &&[u32; 3]| {
                let [a, b, c] = fewer.corners(**t);
                (b - a).cross(c - a).normalize().y.abs() > 0.5
            };
            let share = fewer.triangles.iter().filter(along_x).count() as f64 / target as f64;
            assert!((0.3..0.7).contains(&share), "{target}: {share}");
        }
    }

    #[test]
    fn where_textures_repeat_cards_become_rows() {
        let mut mesh = forest(20, 8.0);
        let whole = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        mesh.texcoords = whole.into_iter().cycle().take(mesh.positions.len()).collect();
        let free = vec![false; mesh.positions.len()];
        let (all, _) = cards(&mesh, &free);
        let rows = all.simplified(160, |_| true).mesh;
        let area = 800.0 * 40.0;
        assert!((rows.area() - area).abs() < 0.01 * area, "{}", rows.area());
        let (low, high) = rows.bounds().unwrap();
        assert_eq!((low[2], high[2]), (0.0, 8.0), "trees are not higher");
        let (of_all, to_all) = all.mesh.bounds().unwrap();
        for axis in [0, 1] {
            assert!(low[axis] >= of_all[axis] - 1e-3 && high[axis] <= to_all[axis] + 1e-3);
        }
        for &triangle in &rows.triangles {
            // A tree of the row is as wide as one was, and the row has whole ones.
            let [a, b, c] = rows.corners(triangle);
            let width = (b - a).truncate().length().max((c - a).truncate().length());
            let u = triangle.map(|vertex| f64::from(rows.texcoords[vertex as usize][0]));
            let copies = u.into_iter().fold(0.0, f64::max) - u.into_iter().fold(9e9, f64::min);
            assert!((width - 5.0 * copies).abs() < 1e-3, "{width} {copies}");
            assert!(u.iter().all(|u| (u - u.round()).abs() < 1e-3), "{u:?}");
        }
        // Part of an image, as of an atlas, has something else beside it.
        mesh.texcoords.iter_mut().for_each(|[u, _]| *u *= 0.5);
        let (all, _) = cards(&mesh, &free);
        let larger = all.simplified(160, |_| true).mesh;
        assert!(larger.texcoords.iter().all(|[u, _]| (0.0..=0.5).contains(u)));
        assert!((larger.area() - area).abs() < 0.01 * area, "{}", larger.area());
        assert!(larger.bounds().unwrap().1[2] > 16.0);
    }

    #[test]
    fn cards_are_spread_and_do_not_become_wider_than_what_they_stand_for() {
        let mesh = forest(20, 8.0);
        let (cards, _) = cards(&mesh, &vec![false; mesh.positions.len()]);
        // Two triangles for 800 cards: 32,000 m² would be 4 km wide.
        let one = cards.simplified(2, |_| false).mesh;
        let (low, high) = one.bounds().unwrap();
        let width = f64::from(high[0] - low[0]).hypot(f64::from(high[1] - low[1]));
        assert!(width < 1.01 * WIDEST * (195.0 * 2f64.sqrt()), "{width}");
        // In each quarter a quarter of them.
        let fewer = cards.simplified(200, |_| false).mesh;
        for [x, y] in [[0.0, 0.0], [100.0, 0.0], [0.0, 100.0], [100.0, 100.0]] {
            let middle = |t: &[u32; 3]| fewer.corners(*t).into_iter().sum::<DVec3>() / 3.0;
            let inside = fewer.triangles.iter().map(middle).filter(|p| {
                (x - 5.0..x + 95.0).contains(&p.x) && (y - 5.0..y + 95.0).contains(&p.y)
            });
            let count = inside.count();
            assert!((35..=65).contains(&count), "{x} {y}: {count}");
        }
    }

    #[test]
    fn borders_other_materials_and_large_parts_are_left_alone() {
        let mesh = forest(2, 8.0);
        let mut locked = vec![false; mesh.positions.len()];
        locked[0] = true;
        let (cards, rest) = cards(&mesh, &locked);
        assert_eq!((cards.cards.len(), rest.len()), (7, 3));
        let mut strip = Mesh::default();
        for n in 0..12u8 {
            strip.positions.extend([[f32::from(n), 0.0, 0.0], [f32::from(n), 0.0, 2.0]]);
        }
        strip.materials = vec![1; 24];
        strip.triangles = (0..22).map(|n| [n, n + 1, n + 2]).collect();
        let border = Border::interior(24);
        let (cards, rest) = Cards::of(&strip, &border, UpAxis::Z, |_| true, &[false; 24]);
        assert!(cards.is_empty());
        assert_eq!(rest.len(), 22);
    }

    #[test]
    fn what_is_level_grows_both_ways() {
        let mut mesh = forest(10, 8.0);
        // Laid down.
        mesh.positions.iter_mut().for_each(|[_, y, z]| (*y, *z) = (*y + *z, 0.0));
        mesh.triangles.truncate(400);
        let area = mesh.area();
        let (cards, _) = cards(&mesh, &vec![false; mesh.positions.len()]);
        let fewer = cards.simplified(100, |_| false).mesh;
        assert!((fewer.area() - area).abs() < 0.1 * area, "{} {area}", fewer.area());
    }
}
