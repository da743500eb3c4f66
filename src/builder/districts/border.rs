//! Where the districts of a level meet: how their common borders thin, alike on all sides.
//!
//! Members of neighbouring districts have the same vertices along the cutting planes that divided
//! their blocks. What a plane's border keeps at the next level is decided once for both sides
//! ([`CutPlane`]), from the surfaces of both. What skirts of members cover is [`super::widened`]'s
//! business.
//!
//! Vertices that members share elsewhere are no border of a plane, and stay.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::sync::Arc;

use blake3::Hasher;
use rustc_hash::{FxHashMap, FxHashSet};

use crate::builder::border::chain::{BorderVertex, CutPlane, KeepRule};
use crate::builder::border::rank::SurfaceQuadric;
use crate::builder::border::shared::{Bounds, bounds_of, holds, mark_border, shared_positions};
use crate::builder::cut::split::Chunk;
use crate::builder::districts::cuts::{Cuts, PlaneKey};
use crate::builder::districts::made_of::{Hash, update};
use crate::format::rims::{KnownRim, Rim};
use crate::mesh::{DisjointSet, Mesh, PositionKey, key, wide};

/// A district has at most so many planes around it; at what is beyond them nothing thins.
const MOST_PLANES: usize = 60;

type EdgeKey = [PositionKey<f64>; 2];

/// The borders between the districts of a level.
#[derive(Debug, Default)]
pub struct LevelBorder {
    planes: BTreeMap<PlaneKey, RankedPlane>,
    /// Vertices that stay.
    kept: FxHashSet<PositionKey<f64>>,
    /// The vertices of the planes.
    on_planes: FxHashSet<PositionKey<f64>>,
}

/// A plane, and a hash of what is kept along it.
#[derive(Debug)]
struct RankedPlane {
    plane: Arc<CutPlane<f64>>,
    hash: Hash,
}

/// The border vertices of a plane, numbered, and their edges.
#[derive(Default)]
struct PlaneEdges {
    numbers: FxHashMap<PositionKey<f64>, u32>,
    vertices: Vec<[f64; 3]>,
    edges: Vec<[u32; 2]>,
}

impl PlaneEdges {
    fn vertex(&mut self, position: [f64; 3]) -> u32 {
        let next = self.vertices.len() as u32;
        *self.numbers.entry(key(position)).or_insert_with(|| {
            self.vertices.push(position);
            next
        })
    }
}

/// The rim of a district whose members are this surface; no other is out of the boxes of `others`. `cuts` are the
/// planes that divided their blocks.
pub fn rim_of(mesh: &Mesh<f64>, cuts: &Cuts, others: &[Bounds]) -> Rim {
    let is_of_others = |at: &&[f64; 3]| others.iter().any(|bounds| holds(bounds, at));
    let is_in_plane =
        |ends: &[[f64; 3]; 2]| cuts.of(ends).next().is_some() || cuts.along(ends).next().is_some();
    let mut open = open_edges(mesh, cuts);
    open.retain(|ends| is_in_plane(ends) || ends.iter().all(|end| is_of_others(&end)));
    let in_planes = open.iter().filter(|ends| is_in_plane(ends)).flatten();
    let ends: FxHashSet<PositionKey<f64>> = in_planes.map(|end| key(*end)).collect();
    let corners = mesh.triangles.iter();
    let corners = corners.map(|corners| corners.map(|at| mesh.positions[at as usize]));
    let is_at_end = |corners: &[[f64; 3]; 3]| corners.iter().any(|at| ends.contains(&key(*at)));
    Rim {
        bounds: bounds_of(mesh.positions.iter().copied()),
        positions: mesh.positions.iter().filter(is_of_others).copied().collect(),
        triangles: corners.filter(is_at_end).collect(),
        open,
    }
}

impl LevelBorder {
    /// Between districts of which these are the rims, of which `rule` says what is kept. `cuts` are the
    /// planes that divided their blocks.
    pub fn between(districts: &[KnownRim], cuts: &Cuts, rule: &KeepRule) -> Self {
        let districts: Vec<&Rim> = districts.iter().map(|known| &known.rim).collect();
        let bounds: Vec<Bounds> = districts.iter().map(|rim| rim.bounds).collect();
        let positions = |district: usize| districts[district].positions.iter().copied();
        let shared = shared_positions(&bounds, positions);
        if shared.is_empty() {
            return Self::default();
        }
        let open = || districts.iter().flat_map(|rim| &rim.open);
        let is_shared = |ends: &[[f64; 3]; 2]| ends.iter().all(|end| shared.contains(&key(*end)));
        let common = || open().filter(|ends| is_shared(ends));
        let mut edges_in: BTreeMap<PlaneKey, usize> = BTreeMap::new();
        for plane in common().flat_map(|ends| cuts.along(ends)) {
            *edges_in.entry(plane).or_default() += 1;
        }
        // An edge along a cut may be in another by chance: the plane that others are in, too.
        let best = |ends: &[[f64; 3]; 2]| {
            let rank = |plane: &PlaneKey| (edges_in.get(plane), Reverse(*plane));
            match is_shared(ends) {
                true => cuts.along(ends).max_by_key(rank),
                false => cuts.of(ends).max_by_key(rank),
            }
        };
        let mut planes: BTreeMap<PlaneKey, PlaneEdges> =
            common().filter_map(best).map(|plane| (plane, PlaneEdges::default())).collect();
        // Also those of one side alone, where the other closed up.
        let mut seen: FxHashSet<EdgeKey> = FxHashSet::default();
        let mut kept: FxHashSet<PositionKey<f64>> = FxHashSet::default();
        for ends in open() {
            if !seen.insert(edge_key(*ends)) {
                continue;
            }
            match best(ends).filter(|plane| planes.contains_key(plane)) {
                Some(plane) => {
                    let plane = planes.entry(plane).or_default();
                    let edge = ends.map(|end| plane.vertex(end));
                    plane.edges.push(edge);
                }
                // Not along a plane, though both ends are of another district too.
                None if is_shared(ends) => kept.extend(ends.map(key)),
                None => {}
            }
        }
        // Shared vertices of no border at all.
        let mut on_planes: FxHashMap<PositionKey<f64>, u32> = FxHashMap::default();
        for &vertex in planes.values().flat_map(|plane| &plane.vertices) {
            *on_planes.entry(key(vertex)).or_default() += 1;
        }
        kept.extend(shared.iter().filter(|position| !on_planes.contains_key(position)));
        let surfaces = surfaces(&districts, &on_planes);
        let ranked = |plane: PlaneEdges, (axis, bits): PlaneKey| {
            let coordinate = f64::from_bits(bits);
            let rounding = 2.0 * rule.collinear.max(0.0);
            let vertex = |&position: &[f64; 3]| {
                let at = key(position);
                // A strip in the plane would not reach what is beside it by more than rounding.
                let is_beside = (position[axis] - coordinate).abs() > rounding;
                let fixed = is_beside || kept.contains(&at) || on_planes[&at] > 1;
                BorderVertex { position, fixed, surface: surfaces[&at] }
            };
            let vertices: Vec<_> = plane.vertices.iter().map(vertex).collect();
            RankedPlane::new(CutPlane::new(axis, coordinate, &vertices, &plane.edges, rule))
        };
        let planes = planes
            .into_iter()
            .filter(|(_, plane)| !plane.edges.is_empty())
            .map(|(at, plane)| (at, ranked(plane, at)))
            .collect();
        Self { planes, kept, on_planes: on_planes.into_keys().collect() }
    }

    /// Whether a place is a vertex that districts have in common, or one of a plane along which they meet.
    pub fn has(&self, position: [f64; 3]) -> bool {
        let at = key(position);
        self.kept.contains(&at) || self.on_planes.contains(&at)
    }

    /// Gives a district its part of the borders.
    pub fn mark(&self, chunk: &mut Chunk<f64>) {
        let planes = self.planes.values().map(|ranked| &ranked.plane);
        mark_border(chunk, planes, &self.kept, MOST_PLANES);
    }

    /// Adds to a hash all that it says of the district that has this rim.
    pub fn hash(&self, rim: &Rim, hasher: &mut Hasher) {
        let ends = rim.positions.iter().chain(rim.open.as_flattened());
        let mut borders: Vec<[f64; 3]> = ends.copied().filter(|&at| self.has(at)).collect();
        borders.sort_unstable_by_key(|&at| key(at));
        borders.dedup();
        for position in &borders {
            position.iter().for_each(|at| update(hasher, *at));
            let at = key(*position);
            let of = [self.kept.contains(&at), self.on_planes.contains(&at)];
            hasher.update(&of.map(u8::from));
        }
        for RankedPlane { plane, hash } in self.planes.values() {
            if borders.iter().any(|&position| plane.keep_level(position).is_some()) {
                hasher.update(hash);
            }
        }
    }
}

impl RankedPlane {
    fn new(plane: CutPlane<f64>) -> Self {
        let mut hasher = Hasher::new();
        hasher.update(&[plane.axis as u8]);
        update(&mut hasher, plane.coordinate);
        for chain in &plane.chains {
            hasher.update(&(chain.keep.len() as u64).to_le_bytes());
            chain.positions.as_flattened().iter().for_each(|at| update(&mut hasher, *at));
            hasher.update(&chain.keep);
        }
        Self { plane: Arc::new(plane), hash: hasher.finalize().into() }
    }
}

fn edge_key(ends: [[f64; 3]; 2]) -> EdgeKey {
    let [a, b] = ends.map(key);
    if a <= b { [a, b] } else { [b, a] }
}

/// The edges at which a surface ends, or its part without lids, in order of their ends. A lid
/// closes what a cut opened: around it the border goes on, whether what is behind it is still there or
/// not.
fn open_edges(mesh: &Mesh<f64>, cuts: &Cuts) -> Vec<[[f64; 3]; 2]> {
    struct Uses {
        all: u32,
        beside: u32,
        ends: [u32; 2],
    }
    let is_lid = lids(mesh, cuts);
    let mut uses: FxHashMap<EdgeKey, Uses> = FxHashMap::default();
    for (triangle, is_lid) in mesh.triangles.iter().zip(is_lid) {
        for ends in edges(*triangle) {
            let positions = ends.map(|end| mesh.positions[end as usize]);
            let uses = uses.entry(edge_key(positions)).or_insert(Uses { all: 0, beside: 0, ends });
            uses.all += 1;
            uses.beside += u32::from(!is_lid);
        }
    }
    let is_open = |(_, uses): &(EdgeKey, Uses)| uses.all % 2 == 1 || uses.beside % 2 == 1;
    let mut open: Vec<(EdgeKey, [u32; 2])> =
        uses.into_iter().filter(is_open).map(|(edge, uses)| (edge, uses.ends)).collect();
    open.sort_unstable();
    open.into_iter().map(|(_, ends)| ends.map(|end| mesh.positions[end as usize])).collect()
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

/// Of each triangle whether it is of a lid: of a patch in the plane of a cut that has the surface around it on
/// one side of the plane. One that has it on both is where a surface passes through the plane.
fn lids(mesh: &Mesh<f64>, cuts: &Cuts) -> Vec<bool> {
    let plane_of = |triangle: &[u32; 3]| {
        cuts.of(&triangle.map(|corner| mesh.positions[corner as usize])).next()
    };
    let planes: Vec<Option<PlaneKey>> = mesh.triangles.iter().map(plane_of).collect();
    if planes.iter().all(Option::is_none) {
        return vec![false; planes.len()];
    }
    let in_planes = || (0..).zip(&planes).filter(|(_, plane)| plane.is_some());
    let edges_of = |triangle: u32| {
        edges(mesh.triangles[triangle as usize])
            .map(|ends| edge_key(ends.map(|end| mesh.positions[end as usize])))
    };
    let mut patches = DisjointSet::new(mesh.triangles.len());
    let mut first_at: FxHashMap<EdgeKey, u32> = FxHashMap::default();
    for (triangle, _) in in_planes() {
        for edge in edges_of(triangle) {
            let first = *first_at.entry(edge).or_insert(triangle);
            if planes[first as usize] == planes[triangle as usize] {
                patches.join(first, triangle);
            }
        }
    }
    // The sides of its plane on which there is surface around each patch.
    let mut sides: FxHashMap<u32, [bool; 2]> = FxHashMap::default();
    for (triangle, corners) in (0u32..).zip(&mesh.triangles) {
        for edge in edges_of(triangle) {
            let Some(&first) = first_at.get(&edge) else { continue };
            let Some((axis, bits)) = planes[first as usize] else { continue };
            if planes[triangle as usize] == planes[first as usize] {
                continue;
            }
            let off = |corner: &u32| mesh.positions[*corner as usize][axis] - f64::from_bits(bits);
            let farthest = corners.iter().map(off).max_by(|a, b| a.abs().total_cmp(&b.abs()));
            let is_above = farthest.is_some_and(|off| off > 0.0);
            sides.entry(patches.root(first)).or_default()[usize::from(is_above)] = true;
        }
    }
    let mut is_lid = |(triangle, plane): (u32, &Option<PlaneKey>)| {
        plane.is_some() && sides.get(&patches.root(triangle)) != Some(&[true; 2])
    };
    (0..).zip(&planes).map(&mut is_lid).collect()
}

/// The surfaces around vertices, on all sides.
fn surfaces(
    districts: &[&Rim],
    vertices: &FxHashMap<PositionKey<f64>, u32>,
) -> FxHashMap<PositionKey<f64>, SurfaceQuadric> {
    let mut surfaces: FxHashMap<PositionKey<f64>, SurfaceQuadric> =
        vertices.keys().map(|&vertex| (vertex, SurfaceQuadric::default())).collect();
    for corners in districts.iter().flat_map(|rim| &rim.triangles) {
        for corner in corners {
            if let Some(surface) = surfaces.get_mut(&key(*corner)) {
                surface.add_triangle(corners.map(wide));
            }
        }
    }
    surfaces
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::builder::blocks::gather::localise;
    use crate::builder::border::cover::deviation;
    use crate::builder::border::span::{join_spans, original_spans};
    use crate::builder::border::vertex::BorderVertexState;
    use crate::builder::constants::BorderConstants;
    use crate::builder::districts::widened::Widened;
    use crate::lattice::Lattice;

    const ACROSS: usize = 17;
    const CUTS: [(usize, f64); 2] = [(0, 16.0), (1, 16.0)];

    /// A hilly field of squares of 1 m.
    fn field(low: [f64; 2], height: impl Fn(f64, f64) -> f64) -> Mesh<f64> {
        let mut mesh = Mesh::<f64>::default();
        for at in 0..ACROSS * ACROSS {
            let [x, y] = [low[0] + (at % ACROSS) as f64, low[1] + (at / ACROSS) as f64];
            mesh.positions.push([x, y, height(x, y)]);
            mesh.materials.push(0);
        }
        for at in (0..ACROSS * (ACROSS - 1)).filter(|at| at % ACROSS != ACROSS - 1) {
            let [a, b] = [at as u32, (at + ACROSS) as u32];
            mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
        }
        mesh
    }

    fn hills(x: f64, y: f64) -> f64 {
        ((x * 12.9 + y * 78.2).sin() * 8.0).round() / 16.0
    }

    fn rule() -> KeepRule<'static> {
        KeepRule {
            shares: vec![0.5, 1.0],
            most: Vec::new(),
            first_level: 0,
            collinear: 1e-6,
            baked: None,
            constants: BorderConstants::default(),
        }
    }

    /// Between districts that may be anywhere.
    fn between(meshes: &[&Mesh<f64>]) -> LevelBorder {
        let cuts = Cuts::new(&CUTS);
        let anywhere = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
        let known = |mesh: &&Mesh<f64>| KnownRim {
            rim: rim_of(mesh, &cuts, &[anywhere]),
            ..KnownRim::default()
        };
        let rims: Vec<KnownRim> = meshes.iter().map(known).collect();
        LevelBorder::between(&rims, &cuts, &rule())
    }

    fn chunk(mesh: &Mesh<f64>, borders: &LevelBorder) -> Chunk<f64> {
        let mut chunk = Chunk { mesh: mesh.clone(), ..Chunk::default() };
        borders.mark(&mut chunk);
        chunk
    }

    fn states(chunk: &Chunk<f64>) -> FxHashMap<PositionKey<f64>, BorderVertexState> {
        let state = |vertex: usize| {
            chunk.path.state(chunk.border.planes[vertex], chunk.border.keep[vertex], 0)
        };
        let positions = chunk.mesh.positions.iter().enumerate();
        positions.map(|(vertex, &position)| (key(position), state(vertex))).collect()
    }

    #[test]
    fn borders_along_planes_thin_alike_on_all_sides_and_what_is_shared_elsewhere_stays() {
        let across = (ACROSS - 1) as f64;
        let corners = [[0.0, 0.0], [across, 0.0], [0.0, across], [across, across]];
        let mut meshes = corners.map(|low| field(low, hills));
        // One vertex on the way is beside the plane, on both sides.
        for mesh in &mut meshes {
            for position in mesh.positions.iter_mut().filter(|at| at[0] == across && at[1] == 5.0) {
                position[0] += 0.25;
            }
        }
        let borders = between(&meshes.each_ref());
        let chunks = meshes.each_ref().map(|mesh| chunk(mesh, &borders));
        let all = chunks.each_ref().map(states);
        let count = |of: BorderVertexState| all[0].values().filter(|&&state| state == of).count();
        // Of the 33 along both planes.
        assert!(
            (10..=18).contains(&count(BorderVertexState::Gone)),
            "{}",
            count(BorderVertexState::Gone)
        );
        assert_eq!(count(BorderVertexState::Kept) + count(BorderVertexState::Gone), 33);
        for (position, state) in all.iter().flatten() {
            for other in &all {
                assert!(other.get(position).is_none_or(|other| other == state), "{position:?}");
            }
        }
        let at = |position: [f64; 3]| all[0][&key(position)];
        let beside = [across + 0.25, 5.0, hills(across, 5.0)];
        assert_eq!(at(beside), BorderVertexState::Kept);
        assert_eq!(
            at([across, across, hills(across, across)]),
            BorderVertexState::Kept,
            "a corner"
        );
        // Open, but of no other district.
        assert_eq!(at([0.0, 3.0, hills(0.0, 3.0)]), BorderVertexState::Free);
    }

    /// Fields that are level meet in the plane that they lie in, which divided nothing.
    #[test]
    fn only_planes_that_divided_the_source_are_borders() {
        // Beside no plane across another axis.
        let slanted = |low: [f64; 2]| {
            let mut mesh = field(low, |_, _| 2.0);
            mesh.positions.iter_mut().for_each(|at| at[0] += at[1] * 0.25);
            mesh
        };
        let meshes = [[0.0, 0.0], [(ACROSS - 1) as f64, 0.0]].map(slanted);
        let borders = between(&meshes.each_ref());
        assert!(borders.planes.is_empty());
        assert_eq!(borders.kept.len(), ACROSS);
        let states = states(&chunk(&meshes[0], &borders));
        let kept = states.values().filter(|&&state| state == BorderVertexState::Kept);
        assert_eq!(kept.count(), ACROSS, "what is shared stays");
    }

    /// A house that a cut left open, closed by a lid in its plane: around it the border goes on, also
    /// where nothing but the lid is left.
    #[test]
    fn the_border_goes_on_around_lids() {
        let section = [[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [2.5, 5.0], [0.0, 3.0]];
        let half = |far: f64, lid: bool, walls: bool| {
            let mut mesh = Mesh::<f64>::default();
            for x in [16.0, far] {
                mesh.positions.extend(section.map(|[y, z]| [x, y, z]));
            }
            mesh.materials = vec![0; mesh.positions.len()];
            for at in (0..5).filter(|_| walls) {
                let next = (at + 1) % 5;
                mesh.triangles.extend([[at, next, next + 5], [at, next + 5, at + 5]]);
            }
            if lid {
                mesh.triangles.extend([[0, 1, 2], [0, 2, 3], [0, 3, 4]]);
            }
            mesh
        };
        let border = |lid, walls| {
            let meshes = [half(8.0, lid, walls), half(24.0, false, true)];
            let borders = between(&meshes.each_ref());
            let [chunk, other] = meshes.each_ref().map(|mesh| chunk(mesh, &borders));
            assert_eq!(chunk.border.keep[..5], other.border.keep[..5], "{lid} {walls}");
            borders
                .planes
                .values()
                .flat_map(|plane| plane.plane.chains.iter())
                .map(|chain| chain.positions.len())
                .sum::<usize>()
        };
        let open = border(false, true);
        assert!(open >= 5);
        assert_eq!(border(true, true), open);
        assert_eq!(border(true, false), open);
    }

    /// What is hashed of a district's borders is what it is given of them.
    #[test]
    fn the_hash_of_borders_says_what_a_district_has_of_them() {
        let across = (ACROSS - 1) as f64;
        let lows = [[0.0, 0.0], [across, 0.0], [0.0, across], [across, across]];
        let cuts = Cuts::new(&CUTS);
        let anywhere = ([f64::NEG_INFINITY; 3], [f64::INFINITY; 3]);
        let of = |height: &dyn Fn(f64, f64) -> f64| -> Vec<(blake3::Hash, Chunk<f64>)> {
            let meshes = lows.map(|low| field(low, height));
            let borders = between(&meshes.each_ref());
            let hash = |mesh: &Mesh<f64>| {
                let mut hasher = Hasher::new();
                borders.hash(&rim_of(mesh, &cuts, &[anywhere]), &mut hasher);
                (hasher.finalize(), chunk(mesh, &borders))
            };
            meshes.iter().map(hash).collect()
        };
        let is = of(&hills);
        // Higher where the last meets the second, or the third, or within it.
        for at in [[24.0, 16.0], [16.0, 24.0], [24.0, 24.0]] {
            let near = |x: f64, y: f64| (x - at[0]).abs() + (y - at[1]).abs() < 0.5;
            let now = of(&|x, y| if near(x, y) { 2.0 } else { hills(x, y) });
            for (number, (was, is)) in is.iter().zip(&now).enumerate() {
                let given = |(_, chunk): &(blake3::Hash, Chunk<f64>)| {
                    let planes = (0..chunk.path.len() as u32).map(|bit| {
                        let plane = chunk.path.plane(bit);
                        let chains = plane.chains.iter();
                        let kept =
                            chains.map(|chain| (chain.positions.clone(), chain.keep.clone()));
                        (plane.axis, kept.collect::<Vec<_>>())
                    });
                    (chunk.border.keep.clone(), planes.collect::<Vec<_>>())
                };
                assert_eq!(was.0 == is.0, given(was) == given(is), "{at:?} {number}");
            }
            let changed = is.iter().zip(&now).filter(|(was, is)| was.0 != is.0).count();
            assert_eq!(changed > 0, at != [24.0, 24.0], "{at:?}");
        }
    }

    #[test]
    fn one_district_alone_has_no_border() {
        let mesh = field([0.0, 0.0], hills);
        let borders = between(&[&mesh]);
        assert!(chunk(&mesh, &borders).path.is_empty());
    }

    /// What was covered below a district between two of its vertices is covered by it.
    #[test]
    fn polylines_go_around_what_skirts_cover_between_their_vertices() {
        let across = (ACROSS - 1) as f64;
        let meshes =
            [[0.0, 0.0], [across, 0.0]].map(|low| field(low, |_, y| (y as i64 % 2) as f64));
        let borders = between(&meshes.each_ref());
        let chunk = chunk(&meshes[0], &borders);
        let lattice = Lattice { step: 1.0 / 1024.0 };
        let (chunk, _) = localise(chunk, [0.0; 3], lattice, false);
        // A triangle below the edges from y = 2 to y = 4, and one that is not in the plane.
        let corner = |y: f64, z: f64| DVec3::new(across, y, z);
        let skirt = vec![corner(1.9, 1.2), corner(3.0, -4.0), corner(4.1, 1.2)];
        let other = skirt.iter().map(|&at| at + 0.5 * DVec3::X - 9.0 * DVec3::Z).collect();
        let spans = original_spans(&chunk.mesh, &chunk.border, &chunk.path);
        assert_eq!(spans.len(), ACROSS - 1);
        let wider = Widened::by(&[skirt, other], &chunk.path, spans.clone());
        assert_eq!(wider.spans.len(), spans.len());
        for (before, after) in spans.iter().zip(&wider.spans) {
            assert_eq!(before.edge(&chunk.path), after.edge(&wider.path), "the same ends");
            let y = after.points(&wider.path).iter().map(|at| at[1]);
            let (from, to) = y.fold((f32::MAX, f32::MIN), |(a, b), y| (a.min(y), b.max(y)));
            let depth = deviation(after.points(&wider.path));
            let is_below = from >= 1.0 && to <= 5.0 && depth > 1e-3;
            let y = [0, 1].map(|_| {
                0.5 * (before.points(&chunk.path)[0][1] + before.points(&chunk.path)[1][1])
            });
            assert_eq!(is_below, (2.0..=4.0).contains(&y[0]), "{from} {to} {depth}");
        }
        let lowest = wider.spans.iter().flat_map(|span| span.points(&wider.path)).map(|at| at[2]);
        let lowest = lowest.fold(f32::MAX, f32::min);
        assert!((lowest + 4.0).abs() < 1e-3, "{lowest}");
        let joined = join_spans(wider.spans.clone(), &wider.path, 0, &chunk.mesh, &chunk.border);
        assert!(joined.len() >= ACROSS - 1, "all vertices are there");
    }
}
