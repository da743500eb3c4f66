//! Geometry written by hand.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::{NodeOcclusion, Occluders, SeenAreas};
use crate::camera::View;
use crate::format::{NodeMesh, Primitive, Surface};
use crate::mesh::{AlphaMode, UpAxis, Wrap};
use crate::random::Random;
use crate::runtime::test_tree::{sketch, tree};

/// Opaque triangles without textures, drawn from either side.
pub(super) fn mesh(triangles: &[[[f32; 3]; 3]]) -> NodeMesh {
    let positions = triangles.concat();
    NodeMesh {
        origin: [0.0; 3],
        images: Vec::new(),
        primitives: vec![Primitive {
            indices: (0..positions.len() as u32).collect(),
            positions,
            texcoords: Vec::new(),
            colors: Vec::new(),
            normals: Vec::new(),
            skirt_triangles: 0,
            surface: Surface {
                base_color: [1.0; 4],
                image: None,
                wrap: [Wrap::Repeat; 2],
                alpha: AlphaMode::Opaque,
                double_sided: true,
                is_unlit: false,
            },
        }],
    }
}

/// A square across x, about a point.
fn square([x, y, z]: [f32; 3], width: f32) -> NodeMesh {
    let [a, b, c, d] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
        .map(|[along, up]| [x, y + along * width, z + up * width]);
    mesh(&[[a, b, c], [a, c, d]])
}

/// A square of 6 m across x, so many metres away.
pub(in crate::engine) fn test_wall(distance: f32) -> Arc<NodeOcclusion> {
    Arc::new(NodeOcclusion::new(&square([distance, 0.0, 0.0], 6.0), UpAxis::Z))
}

/// What is seen of nodes behind and in squares across x, each about a point and so wide.
pub(in crate::engine) fn seen_past(view: &View, squares: &[([f32; 3], f32)]) -> SeenAreas {
    let mut occluders = Occluders::default();
    for (node, &(middle, width)) in (0..).zip(squares) {
        let [min, max] = [-0.5, 0.5].map(|part| Vec3::from(middle) + part * width);
        occluders.add(node, [min, max].map(Vec3::as_dvec3), &square(middle, width));
    }
    let of = |&(middle, _): &([f32; 3], f32)| sketch(middle.map(f64::from), 1.0, vec![]);
    let mut seen = SeenAreas::new(Arc::new(occluders), 0.1);
    seen.look(&tree(squares.iter().map(of).collect()), view, 0.0);
    seen
}

/// A wall of 12 by 8 m at x = 0 with bumps, of which some triangles are missing, and some others stand
/// about.
pub(super) fn bumpy_wall(random: &mut Random) -> Vec<[[f32; 3]; 3]> {
    let bumps = random.between(0.0, 0.4);
    let points: Vec<[f32; 3]> = (0..13 * 9)
        .map(|at| {
            let bump = random.between(-bumps, bumps) as f32;
            [bump, (at % 13) as f32 - 6.0, (at / 13) as f32]
        })
        .collect();
    let mut triangles = Vec::new();
    for at in (0..8 * 13).filter(|at| at % 13 < 12) {
        for corners in [[at, at + 1, at + 14], [at, at + 14, at + 13]] {
            if random.unit() > 0.01 {
                triangles.push(corners.map(|at| points[at]));
            }
        }
    }
    let mut corner = || [0; 3].map(|_| random.between(-4.0, 4.0) as f32);
    triangles.extend((0..10).map(|_| [0; 3].map(|_| corner())));
    triangles
}

/// Whether any triangle is met between two points, a hair's breadth beside it included.
pub(super) fn meets(triangles: &[[[f32; 3]; 3]], from: DVec3, to: DVec3) -> bool {
    triangles.iter().any(|triangle| {
        let [a, b, c] = triangle.map(|at| Vec3::from(at).as_dvec3());
        let (normal, along) = ((b - a).cross(c - a), to - from);
        let part = (a - from).dot(normal) / along.dot(normal);
        let at = from + along * part;
        let is_left = |a: DVec3, b: DVec3| (b - a).cross(at - a).dot(normal) >= -1e-6;
        (0.0..=1.0).contains(&part) && is_left(a, b) && is_left(b, c) && is_left(c, a)
    })
}
