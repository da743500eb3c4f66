//! Polygons to triangles: concave ones too, without losing corners that lie on an edge.
//!
//! Ear clipping (earcut) in the plane of the polygon's Newell normal. earcut leaves out corners on a
//! straight line; here they are put back by dividing the triangle on whose edge they lie, because
//! the neighbouring face has a corner there as well and the surface would crack.
//!
//! earcut takes quadratic time for some rings, and makes one fan of a convex one. A ring of many
//! corners is first reduced by [`clip_ears`].

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::ears::clip_ears;

/// Corners of a ring for earcut, at most.
const MOST_CORNERS: usize = 80;

/// Turns polygons into triangles; keeps its buffers from one polygon to the next.
#[derive(Default)]
pub(crate) struct Triangulator {
    /// Built at the first polygon that needs it.
    earcut: Option<earcut::Earcut<f64>>,
    /// Corners without consecutive repetitions, as indices into the caller's.
    ring: Vec<u32>,
    flat: Vec<[f64; 2]>,
    clipped: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

impl Triangulator {
    /// The triangles of a polygon, as indices into its `corners`, in its winding.
    ///
    /// Corners must be finite. Consecutive corners at the same position count as one. None where the
    /// polygon has no area.
    pub(crate) fn triangulate(&mut self, corners: &[[f64; 3]]) -> &[[u32; 3]] {
        self.triangles.clear();
        self.ring.clear();
        for (at, corner) in corners.iter().enumerate() {
            let before = corners[if at == 0 { corners.len() - 1 } else { at - 1 }];
            if *corner != before {
                self.ring.push(at as u32);
            }
        }
        // Offsets from the first corner: UTM coordinates squared would leave no digits.
        let position = |at: u32| DVec3::from(corners[at as usize]) - DVec3::from(corners[0]);
        match *self.ring.as_slice() {
            [a, b, c] => self.triangles.push([a, b, c]),
            [a, b, c, d] if quad(&mut self.triangles, [a, b, c, d], [a, b, c, d].map(position)) => {
            }
            [_, _, _, _, ..] => {
                let positions: Vec<DVec3> = self.ring.iter().map(|at| position(*at)).collect();
                self.clip(&positions);
            }
            _ => {}
        }
        &self.triangles
    }

    /// Ear clipping of the ring whose corners are at `positions`.
    fn clip(&mut self, positions: &[DVec3]) {
        if !flatten(positions, &mut self.flat) {
            return;
        }
        if self.ring.len() > MOST_CORNERS {
            self.reduce();
        }
        let earcut = self.earcut.get_or_insert_with(earcut::Earcut::new);
        earcut.earcut(self.flat.iter().copied(), &[] as &[u32], &mut self.clipped);
        let position = |at: u32| DVec2::from(self.flat[at as usize]);
        // The ring is counter-clockwise in the plane, and so shall be its triangles.
        let wound = |&[a, b, c]: &[u32; 3]| {
            let turned = (position(b) - position(a)).perp_dot(position(c) - position(a)) < 0.0;
            if turned { [a, c, b] } else { [a, b, c] }
        };
        let mut triangles: Vec<[u32; 3]> = self.clipped.as_chunks().0.iter().map(wound).collect();
        // A ring of n corners has n − 2 triangles; fewer, and a corner was left out somewhere.
        if triangles.len() + 2 < self.ring.len() {
            restore_corners(&self.flat, &mut triangles);
        }
        let of_caller = |triangle: [u32; 3]| triangle.map(|corner| self.ring[corner as usize]);
        self.triangles.extend(triangles.into_iter().map(of_caller));
    }

    /// Clips ears off the ring until earcut may have it.
    fn reduce(&mut self) {
        let left = clip_ears(&self.flat, MOST_CORNERS, &mut self.triangles);
        for corner in self.triangles.as_flattened_mut() {
            *corner = self.ring[*corner as usize];
        }
        self.flat = left.iter().map(|&corner| self.flat[corner as usize]).collect();
        self.ring = left.iter().map(|&corner| self.ring[corner as usize]).collect();
    }
}

/// Divides a convex or concave quadrilateral along the better of its diagonals that lie inside:
/// the one whose smaller triangle is the larger. False where neither is inside.
fn quad(triangles: &mut Vec<[u32; 3]>, ring: [u32; 4], at: [DVec3; 4]) -> bool {
    let normal = (at[2] - at[0]).cross(at[3] - at[1]);
    let area = |a: usize, b: usize, c: usize| (at[b] - at[a]).cross(at[c] - at[a]).dot(normal);
    let first = area(0, 1, 2).min(area(0, 2, 3));
    let second = area(1, 2, 3).min(area(1, 3, 0));
    let [a, b, c, d] = ring;
    if first > 0.0 && first >= second {
        triangles.extend([[a, b, c], [a, c, d]]);
    } else if second > 0.0 {
        triangles.extend([[b, c, d], [b, d, a]]);
    } else {
        return false;
    }
    true
}

/// Projects the ring along the axis that its Newell normal is nearest to, counter-clockwise, which
/// keeps the coordinates' bits and with them what lies on a line. False where it has no area.
fn flatten(positions: &[DVec3], flat: &mut Vec<[f64; 2]>) -> bool {
    let mut normal = DVec3::ZERO;
    for (at, position) in positions.iter().enumerate() {
        let next = positions[(at + 1) % positions.len()];
        normal += position.cross(next);
    }
    let size = normal.abs();
    flat.clear();
    let project: fn(&DVec3) -> [f64; 2] = match normal.abs().max_position() {
        0 if normal.x > 0.0 => |p| [p.y, p.z],
        0 => |p| [p.z, p.y],
        1 if normal.y > 0.0 => |p| [p.z, p.x],
        1 => |p| [p.x, p.z],
        _ if normal.z > 0.0 => |p| [p.x, p.y],
        _ => |p| [p.y, p.x],
    };
    flat.extend(positions.iter().map(project));
    size.is_finite() && size.max_element() > 0.0
}

/// Divides triangles at the corners that lie on their edges without being theirs.
///
/// A directed edge of a triangle should have its reverse in another one, or be an edge of the
/// ring. Where it is neither, the other side has corners on it: a chain of edges along the same
/// line, each of the ring and used by no triangle, or the reverse of another triangle's edge that
/// has no partner. The triangle is then divided at each corner of that chain.
fn restore_corners(flat: &[[f64; 2]], triangles: &mut Vec<[u32; 3]>) {
    let count = flat.len() as u32;
    let follows = |a: u32, b: u32| (a + 1) % count == b;
    // Each division adds a triangle, and there are never more than n − 2 of them.
    while triangles.len() + 2 < flat.len() {
        let mut uses: BTreeMap<(u32, u32), i32> = BTreeMap::new();
        for triangle in triangles.iter() {
            for edge in 0..3 {
                *uses.entry((triangle[edge], triangle[(edge + 1) % 3])).or_default() += 1;
            }
        }
        let used = |a: u32, b: u32| uses.contains_key(&(a, b));
        let open = |a: u32, b: u32| !follows(a, b) && !used(b, a);
        // What the open edges' other sides are made of, by the corner at which each begins.
        let mut wanted: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for at in 0..count {
            if !used(at, (at + 1) % count) {
                wanted.entry(at).or_default().push((at + 1) % count);
            }
        }
        for &(a, b) in uses.keys().filter(|&&(a, b)| open(a, b)) {
            wanted.entry(b).or_default().push(a);
        }
        let mut divided = Vec::with_capacity(flat.len() - 2);
        let mut any = false;
        for &triangle in triangles.iter() {
            let chain = (0..3).find_map(|edge| {
                let (a, b) = (triangle[edge], triangle[(edge + 1) % 3]);
                let chain = open(a, b).then(|| chain(flat, &wanted, a, b)).flatten()?;
                Some((chain, triangle[(edge + 2) % 3]))
            });
            match chain {
                Some((chain, apex)) => {
                    any = true;
                    divided.extend(chain.windows(2).map(|pair| [pair[0], pair[1], apex]));
                }
                None => divided.push(triangle),
            }
        }
        *triangles = divided;
        if !any {
            return;
        }
    }
}

/// The corners from `a` to `b` along wanted edges that lie on the line between them, both ends
/// included; `None` where there is no such chain of more than one edge.
fn chain(flat: &[[f64; 2]], wanted: &BTreeMap<u32, Vec<u32>>, a: u32, b: u32) -> Option<Vec<u32>> {
    let position = |at: u32| DVec2::from(flat[at as usize]);
    let (start, along) = (position(a), position(b) - position(a));
    let length = along.length_squared();
    let mut chain = vec![a];
    let (mut at, mut reached) = (a, 0.0);
    while at != b {
        let (next, distance) = wanted.get(&at)?.iter().find_map(|&next| {
            let offset = position(next) - start;
            let distance = along.dot(offset);
            // earcut leaves out what is exactly straight, and so the tolerance is rounding alone.
            let straight = along.perp_dot(offset).abs() <= STRAIGHT * length;
            let onward = distance > reached && (next == b || distance < length);
            (straight && onward && (at, next) != (a, b)).then_some((next, distance))
        })?;
        chain.push(next);
        (at, reached) = (next, distance);
    }
    (chain.len() > 2).then_some(chain)
}

/// How far from a line, as a part of its length, a corner counts as on it.
const STRAIGHT: f64 = 1e-9;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use crate::scaling::assert_scales;

    /// Twice the vector area.
    fn area(corners: &[[f64; 3]], ring: &[u32]) -> DVec3 {
        let at = |index: usize| DVec3::from(corners[ring[index % ring.len()] as usize]);
        (1..ring.len()).map(|index| (at(index) - at(0)).cross(at(index + 1) - at(0))).sum()
    }

    /// Triangulates and checks what every triangulation must keep: area, winding, and edges of
    /// which each is the ring's or has its reverse in another triangle.
    fn check(corners: &[[f64; 3]]) -> Vec<[u32; 3]> {
        let mut triangulator = Triangulator::default();
        let triangles = triangulator.triangulate(corners).to_vec();
        let ring: Vec<u32> = (0..corners.len() as u32).collect();
        let whole = area(corners, &ring);
        let mut sum = DVec3::ZERO;
        let mut edges = BTreeMap::new();
        for triangle in &triangles {
            let own = area(corners, triangle);
            assert!(own.dot(whole) >= 0.0, "{triangle:?} is turned: {triangles:?}");
            sum += own;
            for edge in 0..3 {
                *edges.entry((triangle[edge], triangle[(edge + 1) % 3])).or_insert(0) += 1;
            }
        }
        assert!((sum - whole).length() <= 1e-9 * whole.length(), "{sum} for {whole}");
        for (&(a, b), count) in &edges {
            let at = |index: u32| corners[index as usize];
            assert_eq!(*count, 1, "edge {a} {b} of {triangles:?}");
            let next_place = (a as usize + 1..a as usize + corners.len())
                .map(|index| (index % corners.len()) as u32)
                .find(|index| at(*index) != at(a));
            let border = Some(at(b)) == next_place.map(at);
            assert!(border || edges.contains_key(&(b, a)), "edge {a} {b} of {triangles:?}");
        }
        triangles
    }

    fn flat(corners: &[[f64; 2]]) -> Vec<[f64; 3]> {
        corners.iter().map(|[x, y]| [x + 678_016.0, y + 5_403_456.0, 12.5]).collect()
    }

    #[test]
    fn convex_and_concave_quads() {
        assert_eq!(check(&flat(&[[0., 0.], [1., 0.], [1., 1.], [0., 1.]])), [[0, 1, 2], [0, 2, 3]]);
        // Concave at corner 1, then at corner 2: the diagonal starts there.
        let dart = flat(&[[0., 0.], [1., 0.5], [2., 0.], [1., 3.]]);
        assert_eq!(check(&dart), [[1, 2, 3], [1, 3, 0]]);
        let dart = flat(&[[1., 3.], [0., 0.], [1., 0.5], [2., 0.]]);
        assert_eq!(check(&dart), [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn a_quad_with_a_straight_corner_uses_it() {
        let triangles = check(&flat(&[[0., 0.], [1., 0.], [2., 0.], [1., 2.]]));
        assert_eq!(triangles, [[1, 2, 3], [1, 3, 0]]);
    }

    #[test]
    fn an_l_shape_in_both_windings_and_all_planes() {
        let shape = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]];
        for turned in [false, true] {
            for axis in 0..3 {
                let mut corners: Vec<[f64; 3]> = shape
                    .iter()
                    .map(|[x, y]| {
                        let mut corner = [*x + 1e6, *y - 1e6, 7.0 + x * 0.25];
                        corner.rotate_left(axis);
                        corner
                    })
                    .collect();
                if turned {
                    corners.reverse();
                }
                assert_eq!(check(&corners).len(), 4, "axis {axis}, turned {turned}");
            }
        }
    }

    #[test]
    fn corners_on_edges_are_all_used() {
        // A square with three further corners on each side, and a notch with corners on its edges.
        let mut square = Vec::new();
        for (from, to) in [([0, 0], [4, 0]), ([4, 0], [4, 4]), ([4, 4], [0, 4]), ([0, 4], [0, 0])] {
            for step in 0..4 {
                square.push([0, 1].map(|axis| {
                    f64::from(from[axis]) + f64::from(to[axis] - from[axis]) * f64::from(step) / 4.0
                }));
            }
        }
        assert_eq!(check(&flat(&square)).len(), square.len() - 2);
        let notch = [
            [0., 0.],
            [2., 0.],
            [6., 0.],
            [6., 4.],
            [4., 4.],
            [4., 3.],
            [4., 2.],
            [3., 2.],
            [2., 2.],
            [2., 3.],
            [2., 4.],
            [1., 4.],
            [0., 4.],
            [0., 2.],
        ];
        assert_eq!(check(&flat(&notch)).len(), notch.len() - 2);
    }

    #[test]
    fn repeated_corners_survive() {
        let square =
            [[0., 0.], [0., 0.], [2., 0.], [2., 2.], [2., 2.], [2., 2.], [0., 2.], [0., 0.]];
        assert_eq!(check(&flat(&square)).len(), 2);
        let triangle = [[0., 0.], [1., 0.], [1., 0.], [0., 1.]];
        assert_eq!(check(&flat(&triangle)).len(), 1);
    }

    #[test]
    fn a_hole_reached_through_a_slit_stays_open() {
        let keyhole = flat(&[
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 1.],
            [1., 1.],
        ]);
        let triangles = Triangulator::default().triangulate(&keyhole).to_vec();
        let sum: f64 = triangles.iter().map(|triangle| area(&keyhole, triangle).length()).sum();
        assert!((sum / 2.0 - 12.0).abs() < 1e-9, "{sum}");
    }

    #[test]
    fn without_area_there_is_no_triangle() {
        let mut triangulator = Triangulator::default();
        let mut count = |corners: &[[f64; 2]]| triangulator.triangulate(&flat(corners)).len();
        assert_eq!(count(&[[0., 0.], [1., 0.], [2., 0.], [3., 0.], [1.5, 0.]]), 0);
        assert_eq!(count(&[[0., 0.], [0., 0.], [0., 0.], [0., 0.]]), 0);
        assert_eq!(count(&[[0., 0.], [1., 1.], [0., 0.], [1., 1.]]), 0);
    }

    /// A ring of `count` corners at these distances from its middle.
    fn star(count: usize, distance: impl Fn(usize) -> f64) -> Vec<[f64; 2]> {
        let corner = |at: usize| {
            let (sin, cos) = (at as f64 / count as f64 * std::f64::consts::TAU).sin_cos();
            [distance(at) * cos, distance(at) * sin]
        };
        (0..count).map(corner).collect()
    }

    /// A corridor that winds inwards, as wide as the walls are apart.
    fn spiral(count: usize) -> Vec<[f64; 2]> {
        let wall = |at: usize, beside: f64| {
            let (sin, cos) = (at as f64 * 0.1).sin_cos();
            let distance = 10.0 + at as f64 * 0.1 + beside;
            [distance * cos, distance * sin]
        };
        let half = count / 2;
        let outer = (0..half).map(|at| wall(at, 2.0));
        outer.chain((0..half).rev().map(|at| wall(at, 0.0))).collect()
    }

    /// Slanted teeth along a line.
    fn comb(count: usize) -> Vec<[f64; 2]> {
        let tooth = |at: usize| [at as f64, 0.0].map(|x| x + (at % 2 * count) as f64);
        let mut ring: Vec<[f64; 2]> = (0..count - 1).map(tooth).collect();
        ring.push([count as f64 / 2.0, -1.0]);
        ring
    }

    /// A square with corners along its sides.
    fn square(count: usize) -> Vec<[f64; 2]> {
        let side = count / 4;
        let corner = |at: usize| {
            let along = (at % side) as f64;
            let back = side as f64 - along;
            let side = side as f64;
            [[along, 0.0], [side, along], [back, side], [0.0, back]][at / side as usize]
        };
        (0..4 * side).map(corner).collect()
    }

    /// A square around a row of square holes, each reached by a slit from the bottom.
    fn keyholes(count: usize) -> Vec<[f64; 2]> {
        let holes = count / 6;
        let mut ring = Vec::new();
        for hole in 0..holes {
            let x = hole as f64 * 2.0 + 1.0;
            ring.extend([[x, 0.0], [x, 1.0], [x, 2.0], [x + 1.0, 2.0], [x + 1.0, 1.0], [x, 1.0]]);
            ring.push([x, 0.0]);
        }
        let width = holes as f64 * 2.0 + 1.0;
        ring.extend([[width, 0.0], [width, 3.0], [0.0, 3.0], [0.0, 0.0]]);
        ring
    }

    /// As files have them.
    fn rounded(ring: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        ring.into_iter().map(|at| at.map(|part| (part * 1e3).round() / 1e3)).collect()
    }

    /// Rings by the number of their corners.
    const RINGS: [(&str, fn(usize) -> Vec<[f64; 2]>); 7] = [
        ("convex", |count| star(count, |_| 100.0)),
        ("nearly convex", |count| rounded(star(count, |_| 1000.0))),
        ("star", |count| star(count, |at| if at % 2 == 0 { 100.0 } else { 50.0 })),
        ("spiral", spiral),
        ("comb", comb),
        ("square", square),
        ("keyholes", keyholes),
    ];

    #[test]
    fn rings_of_many_corners_keep_area_and_use_each_corner() {
        for (name, ring) in RINGS {
            let ring = flat(&ring(2000));
            let triangles = Triangulator::default().triangulate(&ring).to_vec();
            let whole = area(&ring, &(0..ring.len() as u32).collect::<Vec<_>>());
            let areas = triangles.iter().map(|triangle| area(&ring, triangle));
            let sums = areas
                .fold((DVec3::ZERO, 0.0), |(sum, total), area| (sum + area, total + area.length()));
            assert!((sums.0 - whole).length() <= 1e-9 * whole.length(), "{name}: {}", sums.0);
            assert!((sums.1 - whole.length()).abs() <= 1e-9 * whole.length(), "{name}: {}", sums.1);
            assert_eq!(triangles.len(), ring.len() - 2, "{name}");
        }
    }

    #[test]
    fn a_convex_ring_is_no_fan() {
        let ring = flat(&star(4096, |_| 100.0));
        let mut uses = vec![0; ring.len()];
        let mut triangulator = Triangulator::default();
        for &corner in triangulator.triangulate(&ring).as_flattened() {
            uses[corner as usize] += 1;
        }
        assert!(uses.into_iter().max() < Some(MOST_CORNERS + 20));
    }

    #[test]
    fn time_scales_with_the_corners_of_a_ring() {
        let soup = |count: usize| {
            let mut random = Random::new(3, 0);
            (0..count).map(|_| [0; 2].map(|_| random.between(0.0, 100.0))).collect()
        };
        for ring in RINGS.into_iter().map(|(_, ring)| ring).chain([soup as fn(usize) -> _]) {
            assert_scales(
                1000,
                |size| flat(&ring(size)),
                |ring| Triangulator::default().triangulate(&ring).len(),
            );
        }
    }

    #[test]
    fn random_stars_on_a_coarse_lattice_keep_area_and_edges() {
        let mut random = Random::new(7, 0);
        for _ in 0..500 {
            // Columns of rising x, a jagged lower and upper side: simple, often straight.
            let columns = 2 + random.below(12) as i32;
            let mut ring: Vec<[f64; 2]> =
                (0..columns).map(|x| [f64::from(x), -1.0 - random.below(3) as f64]).collect();
            ring.extend((0..columns).rev().map(|x| [f64::from(x), 1.0 + random.below(3) as f64]));
            assert_eq!(check(&flat(&ring)).len(), ring.len() - 2, "{ring:?}");
        }
    }
}
