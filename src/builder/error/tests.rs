use std::sync::Arc;

use glam::DVec3;

use super::*;
use crate::builder::border::vertex::{Border, Path};
use crate::builder::constants::{Constants, MeasureConstants};
use crate::builder::simplify::ladder::{
    AppearanceWeights, BodyPlacement, Ladder, Method, Simplifier,
};
use crate::mesh::{Mesh, UpAxis};
use crate::random::Random;

fn point(random: &mut Random, size: f32) -> [f32; 3] {
    [(); 3].map(|()| random.unit() as f32 * size)
}

/// To be measured with the constants that builds use.
pub(super) fn surface_of(mesh: &Mesh) -> SearchableSurface {
    SearchableSurface::of(mesh, MeasureConstants::default())
}

/// Measures a mesh against a source.
pub(super) fn measure(source: &SearchableSurface, mesh: &Mesh) -> Measured {
    let (below, none) = (Below::source(source.clone(), 0.0), surface_of(&Mesh::default()));
    super::measure(&below, &surface_of(mesh), &none)
}

pub(super) fn surface_error(source: &SearchableSurface, mesh: &Mesh) -> SurfaceError {
    measure(source, mesh).error
}

pub(super) fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> Mesh {
    Mesh {
        positions: positions.to_vec(),
        materials: vec![0; positions.len()],
        triangles: triangles.to_vec(),
        ..Default::default()
    }
}

/// To the nearest point of a segment.
fn to_segment(p: DVec3, a: DVec3, b: DVec3) -> f64 {
    let way = b - a;
    let squared = way.length_squared();
    let share = if squared > 0.0 { ((p - a).dot(way) / squared).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + way * share)
}

/// To the nearest point of a triangle: the edges, and the plane where the point is above it.
fn to_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let edges = to_segment(p, a, b).min(to_segment(p, b, c)).min(to_segment(p, c, a));
    let normal = (b - a).cross(c - a);
    if normal.length() <= 1e-12 * a.distance_squared(b).max(a.distance_squared(c)) {
        return edges;
    }
    let is_above = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|&(from, to)| (to - from).cross(p - from).dot(normal) >= 0.0);
    if is_above { edges.min(((p - a).dot(normal) / normal.length()).abs()) } else { edges }
}

fn corners(mesh: &Mesh) -> Vec<[DVec3; 3]> {
    let corner = |v: u32| DVec3::from(mesh.positions[v as usize].map(f64::from));
    mesh.triangles.iter().map(|&triangle| triangle.map(corner)).collect()
}

/// The largest distance from points of one mesh, so many on each edge and their square inside, to
/// the other.
fn farthest(from: &Mesh, to: &Mesh, steps: u32) -> f64 {
    let to = corners(to);
    let mut largest = 0f64;
    for [a, b, c] in corners(from) {
        for i in 0..=steps {
            for j in 0..=steps - i {
                let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(steps));
                let point = a + (b - a) * u + (c - a) * v;
                let nearest =
                    to.iter().map(|&t| to_triangle(point, t)).fold(f64::INFINITY, f64::min);
                largest = largest.max(nearest);
            }
        }
    }
    largest
}

/// Checks the bound of two meshes against dense points; how many times as large it is.
fn check(a: &Mesh, b: &Mesh, steps: u32, case: &str) -> f64 {
    let measured = measure(&surface_of(a), b);
    let dense = farthest(a, b, steps).max(farthest(b, a, steps));
    let coordinates = [a, b].into_iter().flat_map(|mesh| mesh.positions.as_flattened());
    let far = coordinates.fold(0f32, |far, x| far.max(x.abs()));
    // What is equal to within rounding is at no distance.
    let rounding = f64::from(f32::EPSILON * far * 32.0);
    let bound = measured.error.bound;
    assert!(
        dense <= bound + if bound == 0.0 { rounding } else { 0.0 },
        "{case}: {dense} beyond {measured:?}"
    );
    assert!(measured.largest <= bound, "{case}: {measured:?}");
    assert!(!measured.exhausted, "{case}: {measured:?}");
    assert!(
        bound <= f64::from(TIGHTNESS) * measured.largest * (1.0 + 1e-5) + rounding,
        "{case}: {measured:?}"
    );
    if dense > rounding { bound / dense } else { 1.0 }
}

/// A bumpy sheet.
fn sheet(random: &mut Random, side: u32, height: f32) -> Mesh {
    let positions: Vec<[f32; 3]> = (0..side * side)
        .map(|at| {
            [
                (at % side) as f32,
                (at / side) as f32,
                height * (random.unit() * random.unit()) as f32,
            ]
        })
        .collect();
    let mut triangles = Vec::new();
    for at in (0..side * (side - 1)).filter(|at| at % side != side - 1) {
        triangles.push([at, at + 1, at + side]);
        triangles.push([at + 1, at + side + 1, at + side]);
    }
    mesh(&positions, &triangles)
}

fn soup(random: &mut Random, count: u32, size: f32) -> Mesh {
    let mut positions = Vec::new();
    for triangle in 0..count {
        let [a, b, c] = [(); 3].map(|()| point(random, size));
        let centre = point(random, 10.0);
        // Triangles, needles, lines and points.
        let [b, c] = match triangle % 8 {
            0 => [b, [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * 0.4 + 1e-5 * c[i])],
            1 => [b, [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * 0.5)],
            2 => [a, b],
            3 => [a, a],
            _ => [b, c],
        };
        positions.extend([a, b, c].map(|p| [0, 1, 2].map(|i| p[i] + centre[i])));
    }
    let triangles: Vec<[u32; 3]> = (0..count).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    mesh(&positions, &triangles)
}

fn moved(m: &Mesh, by: [f32; 3]) -> Mesh {
    let positions: Vec<[f32; 3]> =
        m.positions.iter().map(|p| [0, 1, 2].map(|i| p[i] + by[i])).collect();
    mesh(&positions, &m.triangles)
}

#[test]
fn bounds_hold_and_are_tight() {
    let mut random = Random::new(3, 0);
    let mut ratios = Vec::new();
    for case in 0..60 {
        let height = [0.0, 0.01, 1.0, 5.0][case % 4];
        let mut a = sheet(&mut random, 6, height);
        let mut b = match case % 3 {
            0 => Mesh {
                triangles: a.triangles.iter().copied().filter(|_| random.unit() < 0.7).collect(),
                ..a.clone()
            },
            1 => sheet(&mut random, 4, height),
            _ => moved(&a, [0.01, 0.02, 0.005]),
        };
        if case % 5 == 0 {
            let far = [9_000.0, -7_000.0, 300.0];
            (a, b) = (moved(&a, far), moved(&b, far));
        }
        ratios.push(check(&a, &b, 12, &format!("sheet {case}")));
    }
    for case in 0..60 {
        let a = soup(&mut random, 20, 4.0);
        let b = soup(&mut random, 30, 4.0);
        ratios.push(check(&a, &b, 12, &format!("soup {case}")));
        ratios.push(check(&a, &moved(&a, [0.03, 0.0, 0.01]), 12, &format!("soup moved {case}")));
    }
    ratios.sort_by(f64::total_cmp);
    let loose = ratios.iter().filter(|&&ratio| ratio > f64::from(TIGHTNESS) * 1.02).count();
    assert!(loose * 20 <= ratios.len(), "{ratios:?}");
}

const SQUARE: [[f32; 3]; 4] = [[0.0; 3], [4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [0.0, 4.0, 0.0]];

#[test]
fn equal_meshes_are_at_no_distance_and_a_lifted_one_at_its_lift() {
    let flat = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
    let turned = mesh(&SQUARE, &[[0, 1, 3], [1, 2, 3]]);
    let lifted = moved(&flat, [0.0, 0.0, 0.5]);
    let original = surface_of(&flat);
    assert_eq!(surface_error(&original, &flat).bound, 0.0);
    assert_eq!(surface_error(&original, &turned), SurfaceError::default());
    let SurfaceError { bound, mean, rms, p95 } = surface_error(&original, &lifted);
    for distance in [bound, mean, rms, p95] {
        assert!((distance - 0.5).abs() < 1e-5, "{distance}");
    }
    let far = [8_000.0, 9_000.0, 100.0];
    assert_eq!(surface_error(&surface_of(&moved(&flat, far)), &moved(&turned, far)).bound, 0.0);
}

#[test]
fn nothing_is_as_far_as_what_it_stands_for_is_large() {
    let flat = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
    let (some, none) = (surface_of(&flat), surface_of(&Mesh::default()));
    assert!(none.is_empty() && !some.is_empty());
    let diagonal = f64::from(32f32.sqrt());
    assert_eq!(surface_error(&some, &Mesh::default()).bound, diagonal);
    assert_eq!(surface_error(&none, &flat).bound, diagonal);
    assert_eq!(surface_error(&none, &Mesh::default()), SurfaceError::default());
    assert!(SearchableSurface::union(&[]).is_empty());
}

/// A hole in the middle of a triangle whose corners all stay, which no vertex is far from.
#[test]
fn what_is_missing_between_kept_vertices_is_found() {
    let whole = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
    let half = mesh(&SQUARE, &[[0, 1, 2]]);
    assert!(check(&whole, &half, 20, "half") < 1.15);
    assert!(check(&half, &whole, 20, "half, the other way") < 1.15);
}

/// An edge that leaves the other's outline between vertices that both have.
#[test]
fn an_edge_across_a_shallow_notch_is_found() {
    let corners = [[0.0, 0.0, 0.0], [20.0, 0.0, 0.0], [10.0, 15.0, 0.0], [7.3, 0.04, 0.0]];
    let notched = mesh(&corners, &[[0, 3, 2], [3, 1, 2]]);
    let straight = mesh(&corners[..3], &[[0, 1, 2]]);
    // From the foot of the notch to the nearer of its two edges.
    let deepest = 0.04 * f64::cos(f64::atan(0.04 / 7.3));
    for (a, b) in [(&notched, &straight), (&straight, &notched)] {
        let bound = surface_error(&surface_of(a), b).bound;
        assert!(bound >= deepest && bound <= deepest * 1.2, "{bound} {deepest}");
    }
}

/// Long strips that are divided the other way are no farther for it, and must not hide a small
/// hole: an earlier measure, of points and a fixed number of divisions, found 0 here.
#[test]
fn a_small_hole_amid_long_strips_that_come_back_otherwise_is_found() {
    let mut meshes = [Mesh::default(), Mesh::default()];
    let mut add = |corners: &[[f32; 3]], triangles: [&[[u32; 3]]; 2]| {
        for (mesh, triangles) in meshes.iter_mut().zip(triangles) {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend_from_slice(corners);
            mesh.materials.resize(mesh.positions.len(), 0);
            mesh.triangles.extend(triangles.iter().map(|t| t.map(|v| v + first)));
        }
    };
    for strip in 0..400u16 {
        let y = f32::from(strip);
        let corners = [[0.0, y, 0.0], [100.0, y, 0.0], [100.0, y + 0.7, 0.0], [0.0, y + 0.7, 0.0]];
        add(&corners, [&[[0, 1, 2], [0, 2, 3]], &[[0, 1, 3], [1, 2, 3]]]);
    }
    // Around the hole, and across it.
    let ring = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]];
    let corners = [
        [0.0, 0.0, 9.0],
        [2.0, 0.0, 9.0],
        [1.0, 1.5, 9.0],
        [0.6, 0.1, 9.0],
        [0.9, 0.1, 9.0],
        [0.75, 0.35, 9.0],
    ];
    add(&corners, [&ring, &[[0, 1, 2]]]);
    // The radius of the circle in the hole: twice its area over its edges.
    let radius = 0.3 * 0.25 / (0.3 + 2.0 * 0.15f64.hypot(0.25));
    let measured = measure(&surface_of(&meshes[0]), &meshes[1]);
    let bound = measured.error.bound;
    assert!(bound >= radius && bound <= radius * 1.2, "{measured:?} {radius}");
    assert!(!measured.exhausted);
}

#[test]
fn a_union_is_as_its_parts_in_one() {
    let mut random = Random::new(7, 0);
    let parts: Vec<Mesh> = (0u8..11)
        .map(|i| {
            moved(
                &sheet(&mut random, 7, 1.0),
                [f32::from(i % 4) * 6.0, f32::from(i / 4) * 6.0, 0.0],
            )
        })
        .collect();
    let mut all = Mesh::default();
    for part in &parts {
        let first = all.positions.len() as u32;
        all.positions.extend_from_slice(&part.positions);
        all.materials.resize(all.positions.len(), 0);
        all.triangles.extend(part.triangles.iter().map(|t| t.map(|v| v + first)));
    }
    let some: Vec<Arc<SearchableSurface>> =
        parts.iter().map(|part| Arc::new(surface_of(part))).collect();
    let parts = [&some[..4], &some[4..], &[]].map(|part| Arc::new(SearchableSurface::union(part)));
    let nested = SearchableSurface::union(&parts);
    assert_eq!(nested.triangle_count(), all.triangles.len());
    let other = moved(&sheet(&mut random, 19, 0.5), [0.1, 0.2, 0.3]);
    let [one, of_parts] = [&surface_of(&all), &nested].map(|original| measure(original, &other));
    let tight = f64::from(TIGHTNESS) * (1.0 + 1e-5);
    assert!(one.error.bound <= of_parts.error.bound * tight, "{one:?} {of_parts:?}");
    assert!(of_parts.error.bound <= one.error.bound * tight, "{one:?} {of_parts:?}");
    assert!((one.error.mean / of_parts.error.mean - 1.0).abs() < 0.1, "{one:?} {of_parts:?}");
    assert_eq!(of_parts, measure(&nested, &other));
}

/// Which triangle comes first decides which points are found first, and no more.
#[test]
fn any_order_of_triangles_gives_a_valid_bound() {
    let mut random = Random::new(17, 0);
    let a = sheet(&mut random, 9, 1.0);
    let b = sheet(&mut random, 6, 1.0);
    let largest = measure(&surface_of(&a), &b).largest;
    for _ in 0..10 {
        let mut order = a.clone();
        for i in (1..order.triangles.len()).rev() {
            order.triangles.swap(i, random.below(i + 1));
        }
        order.triangles.iter_mut().for_each(|t| t.rotate_left(random.below(3)));
        let measured = measure(&surface_of(&order), &b);
        assert!(
            measured.error.bound >= largest
                && measured.largest <= largest * f64::from(TIGHTNESS) * 1.001
        );
    }
}

#[test]
fn many_triangles_in_one_place_are_no_harder() {
    const COUNT: u32 = 100_000;
    let mut random = Random::new(23, 0);
    let few = sheet(&mut random, 5, 1.0);
    let all = |triangle: &mut dyn FnMut(u32) -> [[f32; 3]; 3]| {
        let positions: Vec<[f32; 3]> = (0..COUNT).flat_map(triangle).collect();
        let triangles: Vec<[u32; 3]> = (0..COUNT).map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
        mesh(&positions, &triangles)
    };
    let along = |share: f32| [1.0 + 7.0 * share, 2.0 - 3.0 * share, 0.5 + share];
    let cases = [
        all(&mut |_| [SQUARE[0], SQUARE[1], SQUARE[2]]),
        all(&mut |_| [[1.5, 2.5, 3.5]; 3]),
        all(&mut |_| [(); 3].map(|()| along(random.unit() as f32))),
    ];
    for (number, case) in cases.iter().enumerate() {
        let original = surface_of(case);
        let itself = measure(&original, case);
        assert!(itself.error.bound < 1e-5 && !itself.exhausted, "{number}: {itself:?}");
        let measured = measure(&original, &few);
        assert!(!measured.exhausted, "{number}: {measured:?}");
        let farthest = farthest(&few, case_sample(case).as_ref(), 6);
        assert!(measured.error.bound >= farthest * 0.9, "{number}: {measured:?} {farthest}");
    }
}

/// Some triangles of a mesh of which all are alike.
fn case_sample(mesh: &Mesh) -> Box<Mesh> {
    Box::new(Mesh {
        triangles: mesh.triangles.iter().copied().step_by(500).collect(),
        ..mesh.clone()
    })
}

#[test]
fn nothing_is_claimed_of_coordinates_that_are_not_finite() {
    for bad in [f32::INFINITY, f32::NAN, f32::MAX] {
        let mut flat = mesh(&SQUARE, &[[0, 1, 2], [0, 2, 3]]);
        let good = surface_of(&flat);
        flat.positions[1][0] = bad;
        assert_eq!(surface_error(&good, &flat).bound, f64::INFINITY, "{bad}");
        assert_eq!(surface_error(&surface_of(&flat), &flat).bound, f64::INFINITY, "{bad}");
    }
}

/// A plane that comes back exactly, of large triangles over many small ones.
#[test]
fn a_plane_of_fewer_triangles_is_at_no_distance() {
    const SIDE: u32 = 64;
    let mut plane = Mesh::default();
    for y in 0..=SIDE {
        plane.positions.extend((0..=SIDE).map(|x| [x as f32, y as f32, 0.0]));
    }
    plane.materials = vec![0; plane.positions.len()];
    for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
        let at = |x: u32, y: u32| y * (SIDE + 1) + x;
        let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
        plane.triangles.extend([[a, b, c], [a, c, d]]);
    }
    let original = surface_of(&plane);
    for target in [900, 100, 2] {
        let method = Method {
            simplifier: Simplifier::Qem,
            weights: AppearanceWeights::default(),
            up: UpAxis::Z,
            reorientable: &[true],
            extrudable: &[true],
            without: None,
            constants: &Constants::default(),
        };
        let border = Border::interior(plane.positions.len());
        let ladder = Ladder::new(&plane, &border, &Path::default(), 0, method);
        let fewer = ladder.simplified(target, BodyPlacement::InPlace).mesh;
        assert!(fewer.triangles.len() <= target.max(8));
        let measured = measure(&original, &fewer);
        assert_eq!(measured.error.bound, 0.0, "{target}: {measured:?}");
    }
}

/// A sheet of 64 m with a bump, of `side` times `side` squares, each cut in two.
fn square_sheet(side: u32, bump: f32) -> Mesh {
    let size = 64.0 / side as f32;
    let mut sheet = Mesh::default();
    for at in 0..(side + 1) * (side + 1) {
        let [x, y] = [at % (side + 1), at / (side + 1)].map(|at| at as f32 * size);
        let is_bump = at == (side + 1) * (side / 2) + side / 2;
        sheet.positions.push([x, y, if is_bump { bump } else { 0.0 }]);
        if x < 64.0 && y < 64.0 {
            let [a, b, c, d] = [at, at + 1, at + side + 2, at + side + 1];
            sheet.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    sheet.materials = vec![0; sheet.positions.len()];
    sheet
}

/// Flaps that lie on a sheet under the centres of triangles: a walk that begins on one of them
/// comes to its end.
#[test]
fn layers_on_each_other_need_few_divisions() {
    let node = square_sheet(7, 0.0);
    let mut source = square_sheet(16, 0.05);
    for corners in corners(&node) {
        let centre = (corners[0] + corners[1] + corners[2]) / 3.0;
        for _ in 0..2 {
            let first = source.positions.len() as u32;
            let flap = corners.map(|corner| centre.lerp(corner, 0.3).as_vec3().to_array());
            source.positions.extend(flap);
            source.triangles.push([first, first + 1, first + 2]);
        }
    }
    source.materials = vec![0; source.positions.len()];
    let measured = measure(&surface_of(&source), &node);
    assert!((0.05..0.056).contains(&measured.error.bound), "{measured:?}");
    assert!(measured.divisions < 500, "{measured:?}");
}
