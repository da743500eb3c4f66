use std::sync::Arc;

use super::*;
use crate::builder::error::tests::{mesh, surface_of};
use crate::mesh::Mesh;

const SIDE: u32 = 12;

/// A sheet of 11 by 11 squares, each cut in two, that waves a little.
fn sheet() -> Mesh {
    let wave = |x: u32, y: u32| if (x * 7 + y * 5).is_multiple_of(4) { 0.0 } else { 0.05 };
    let positions: Vec<[f32; 3]> = (0..SIDE * SIDE)
        .map(|at| (at % SIDE, at / SIDE))
        .map(|(x, y)| [x as f32, y as f32, wave(x, y)])
        .collect();
    let corners = (0..SIDE * (SIDE - 1)).filter(|at| at % SIDE != SIDE - 1);
    let squares = corners.flat_map(|a| {
        let [b, c, d] = [a + 1, a + SIDE + 1, a + SIDE];
        [[a, b, c], [a, c, d]]
    });
    mesh(&positions, &squares.collect::<Vec<_>>())
}

/// What can be proven of a large triangle over the sheet, from each triangle of it on.
fn bounds(original: &SearchableSurface) -> Vec<Option<f32>> {
    let large = [[1.2, 1.1, 0.0], [9.7, 2.3, 0.0], [4.1, 9.4, 0.0]];
    let large = Triangle::new(large.map(Vec3::from));
    let mut overlay = Overlay::new(original);
    let mut bounds = Vec::new();
    for (part, of_part) in (0..).zip(&original.parts) {
        for (leaf, &count) in (0..).zip(&of_part.bvh.counts) {
            for lane in 0..count.into() {
                let start = TriangleId { part, leaf, lane };
                bounds.push(overlay.bound(&large, 0, start, 0.5, 1e-5));
            }
        }
    }
    bounds
}

#[test]
fn a_triangle_over_a_sheet_is_as_far_as_the_sheet_waves() {
    let bounds = bounds(&surface_of(&sheet()));
    let found: Vec<f32> = bounds.iter().flatten().copied().collect();
    // From those that are under it.
    assert!(found.len() * 4 > bounds.len() && found.len() < bounds.len());
    assert!(found.iter().all(|&bound| {
        (0.05..=0.05f32.hypot(0.5 * MeasureConstants::default().aside) * 1.01).contains(&bound)
    }));
}

/// Of two meshes that meet along a line.
#[test]
fn walks_lead_from_part_to_part() {
    let whole = sheet();
    let middle = SIDE as f32 / 2.0;
    let half = |is_left: bool| {
        let of_half =
            |t: &&[u32; 3]| t.iter().all(|&v| whole.positions[v as usize][0] <= middle) == is_left;
        let triangles = whole.triangles.iter().filter(of_half).copied().collect();
        Arc::new(surface_of(&Mesh { triangles, ..whole.clone() }))
    };
    let count = |bounds: Vec<Option<f32>>| bounds.into_iter().flatten().count();
    let of_halves = count(bounds(&SearchableSurface::union(&[half(true), half(false)])));
    assert_eq!(of_halves, count(bounds(&surface_of(&whole))));
}

#[test]
fn nothing_is_proven_over_a_hole() {
    let mut torn = sheet();
    let under = |t: &[u32; 3]| {
        t.iter().all(|&v| {
            let [x, y, _] = torn.positions[v as usize];
            (4.0..=5.0).contains(&x) && (4.0..=5.0).contains(&y)
        })
    };
    let first = torn.triangles.iter().position(under).unwrap_or_default();
    torn.triangles.remove(first);
    assert!(bounds(&surface_of(&torn)).iter().all(Option::is_none));
}

/// Edges have two triangles each, and yet there is nothing over part of the triangle.
#[test]
fn nothing_is_proven_where_the_surface_turns_back() {
    let mut folded = sheet();
    // Mirrored across a line, from the middle on.
    for [x, _, z] in &mut folded.positions {
        if *x > 5.0 {
            (*x, *z) = (10.0 - *x, *z + 0.01);
        }
    }
    assert!(bounds(&surface_of(&folded)).iter().all(Option::is_none));
}

#[test]
fn what_stands_out_is_too_far() {
    let mut spiked = sheet();
    let middle = SIDE * (SIDE / 3) + SIDE / 3;
    spiked.positions[middle as usize][2] = 0.6;
    assert!(bounds(&surface_of(&spiked)).iter().all(Option::is_none));
    // But not where only what is beside the triangle does.
    let mut beside = sheet();
    beside.positions[(SIDE * SIDE - 1) as usize][2] = 0.6;
    assert!(bounds(&surface_of(&beside)).iter().any(Option::is_some));
}

/// A walk that fails may have settled triangles on its way, whose distance must count.
#[test]
fn what_failed_walks_settle_counts() {
    let mut torn = sheet();
    torn.triangles.truncate(torn.triangles.len() * 2 / 3);
    let original = surface_of(&torn);
    let large = [[1.2, 1.1, 0.0], [9.7, 2.3, 0.0], [4.1, 9.4, 0.0]];
    let large = Triangle::new(large.map(Vec3::from));
    let mut overlay = Overlay::new(&original);
    for (leaf, &count) in (0..).zip(&original.parts[0].bvh.counts) {
        for lane in 0..count.into() {
            let start = TriangleId { part: 0, leaf, lane };
            assert_eq!(overlay.bound(&large, 0, start, 0.5, 1e-5), None);
        }
    }
    let visit_states = overlay.into_visit_states();
    assert!(visit_states.slots.iter().any(|(_, mark)| mark.is_settled()));
    assert!((0.05..=0.5).contains(&visit_states.farthest), "{}", visit_states.farthest);
}
