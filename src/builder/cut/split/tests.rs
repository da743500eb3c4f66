use super::*;
use crate::mesh::Material;
use crate::texture::BakeClasses;

/// Without levels.
fn rule() -> KeepRule<'static> {
    KeepRule {
        shares: Vec::new(),
        most: Vec::new(),
        first_level: 1,
        collinear: 0.0,
        baked: None,
        constants: Default::default(),
    }
}

/// At x = 2 on a lattice of whole metres, without any tolerance.
fn at_2<'a>(rule: &'a KeepRule<'a>) -> Cut<'a, f32> {
    Cut {
        axis: 0,
        coordinate: 2.0,
        lattice: Some(Lattice { step: 1.0 }),
        tolerance: CutTolerance { sliver_share: 0.0, sliver_steps: 0.0 },
        whole: WholeComponents::default(),
        rule,
    }
}

/// Cuts triangles over these positions at x = 2 on a lattice of whole metres.
fn cut_at_2(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> [Chunk; 2] {
    let mesh = Mesh {
        positions: positions.to_vec(),
        materials: vec![0; positions.len()],
        triangles: triangles.to_vec(),
        ..Mesh::default()
    };
    let border = Border::interior(positions.len());
    let moved = Some(vec![0.0; positions.len()]);
    let rule = KeepRule { shares: vec![1.0], ..rule() };
    let how = at_2(&rule);
    let (below, above) = cut(Chunk { mesh, border, moved, ..Chunk::default() }, &how);
    [below, above]
}

#[test]
fn what_crossings_are_beside_their_edges_is_remembered() {
    let corners = [[0.0, 0.0, 0.0], [7.0, 3.0, 1.0], [5.0, 9.0, 5.0]];
    for chunk in cut_at_2(&corners, &[[0, 1, 2]]) {
        let moved = chunk.moved.as_ref().unwrap();
        assert_eq!(moved.len(), chunk.mesh.positions.len());
        for (&position, &moved) in chunk.mesh.positions.iter().zip(moved) {
            let beside = |[from, to]: [[f32; 3]; 2]| {
                let (from, along) = (wide(from), wide(to) - wide(from));
                let way = wide(position) - from;
                (way - along * (2.0 / along.x)).length()
            };
            let made = position[0] == 2.0;
            assert_eq!(made, moved > 0.0);
            if made {
                let edges = [[corners[0], corners[1]], [corners[0], corners[2]]];
                let off = edges.map(beside).into_iter().fold(f64::INFINITY, f64::min);
                assert!((f64::from(moved) - off).abs() < 1e-6, "{moved}, {off}");
            }
        }
        assert!(chunk.most_moved() > 0.1 && chunk.most_moved() <= 0.5f64.sqrt());
    }
}

/// A strip along x = 2 whose one side is cut up into two materials at (2, 1, 0), where the other
/// side has a corner of the first alone.
#[test]
fn a_seam_that_one_side_alone_sees_fixes_the_vertex_for_both() {
    let positions = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 1.0],
        [2.0, 2.0, 0.0],
        [4.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 2.0, 0.0],
        [2.0, 1.0, 1.0],
    ];
    let triangles = [[0, 1, 2], [0, 7, 5], [5, 2, 6], [6, 2, 3], [1, 4, 2], [2, 4, 3]];
    let mut mesh = Mesh {
        positions: positions.to_vec(),
        materials: vec![0; 8],
        triangles: triangles.to_vec(),
        ..Mesh::default()
    };
    mesh.materials[7] = 1;
    let all = ["a", "b"].map(Material::plain);
    let classes = BakeClasses::new(&all, |_| true, |_| true);
    for (baked, level) in [(None, 1), (Some(&classes), 2)] {
        let rule = KeepRule { shares: vec![0.0, 1.0], baked, ..rule() };
        let how = at_2(&rule);
        let border = Border::interior(8);
        let chunk = Chunk { mesh: mesh.clone(), border, ..Chunk::default() };
        let (below, above) = cut(chunk, &how);
        for side in [below, above] {
            let at = side.mesh.positions.iter().position(|&p| p == positions[2]).unwrap();
            assert_eq!((side.border.planes[at], side.border.keep[at]), (1, level));
        }
    }
}

#[test]
fn a_tip_whose_crossings_meet_stays_only_for_its_vertex() {
    let positions =
        [[0.0, 0.0, 0.0], [10.0, 1.0, 0.0], [10.0, 0.0, 0.0], [-5.0, 0.0, 0.0], [0.0, 5.0, 0.0]];
    let needle = [0, 1, 2];
    let [alone, _] = cut_at_2(&positions, &[needle]);
    assert_eq!(alone.mesh.triangles.len(), 1);
    assert!(alone.mesh.positions.contains(&positions[0]));
    let [joined, above] = cut_at_2(&positions, &[needle, [0, 4, 3]]);
    assert_eq!(joined.mesh.triangles.len(), 1);
    assert_eq!(joined.mesh.area(), 12.5);
    assert!(!above.mesh.triangles.is_empty());
}
