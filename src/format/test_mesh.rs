//! A small node mesh for tests, with everything that a node file can hold.

use std::sync::Arc;

use super::node_mesh::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
use crate::mesh::{AlphaMode, Normal, Wrap};

/// A PNG of 2 × 1 opaque texels.
pub(crate) fn png() -> Vec<u8> {
    let picture = image::RgbImage::from_raw(2, 1, vec![255, 0, 0, 0, 0, 255]).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Four primitives: own picture, shared picture with a cut-out, colours, and plain like the
/// third; the last two have normals.
pub(crate) fn mesh() -> NodeMesh {
    let square = vec![[0.0, 0.0, 0.125], [1.0, -0.0, 0.1], [1.0, 1.0, -3.25], [0.0, 1.0, 1e-7]];
    let texcoords = vec![[0.0, 0.0], [2.5, 0.1], [2.5, -1.0], [0.0, 1.0 / 3.0]];
    let indices = vec![0, 1, 2, 0, 2, 3];
    // Both vertices of the edge between the triangles have two normals.
    let folded = [[0.0, 0.0, 1.0], [0.5, -0.25, -0.75]]
        .into_iter()
        .flat_map(|normal| [Normal::along(normal.into()); 3])
        .collect();
    let plain = Surface {
        base_color: [0.1, 0.2, 1.0 / 3.0, 1.0],
        image: None,
        wrap: [Wrap::Repeat; 2],
        alpha: AlphaMode::Opaque,
        double_sided: true,
        is_unlit: false,
    };
    let photograph = Surface {
        base_color: [1.0; 4],
        image: Some(0),
        wrap: [Wrap::Clamp; 2],
        alpha: AlphaMode::Opaque,
        double_sided: false,
        is_unlit: false,
    };
    let fence = Surface {
        image: Some(1),
        wrap: [Wrap::Repeat, Wrap::Mirror],
        alpha: AlphaMode::Mask { cutoff: 0.1 },
        ..plain.clone()
    };
    NodeMesh {
        origin: [678_016.5, 5_403_456.0, -12.25],
        images: vec![
            NodeImage {
                width: 2,
                height: 1,
                data: NodeImageData::Embedded { mime: "image/png", bytes: png(), file_name: None },
            },
            NodeImage {
                width: 64,
                height: 32,
                data: NodeImageData::Shared { file_name: Arc::from("fence-64.png") },
            },
        ],
        primitives: vec![
            Primitive {
                positions: square.clone(),
                texcoords: texcoords.clone(),
                colors: vec![],
                indices: indices.clone(),
                normals: Vec::new(),
                skirt_triangles: 0,
                surface: photograph,
            },
            Primitive {
                positions: square.clone(),
                texcoords,
                colors: vec![[65535, 0, 1, 65535]; 4],
                indices: indices.clone(),
                normals: Vec::new(),
                skirt_triangles: 0,
                surface: fence,
            },
            Primitive {
                positions: square.clone(),
                texcoords: vec![],
                colors: vec![[1, 2, 3, 65535]; 4],
                indices: indices.clone(),
                normals: folded,
                skirt_triangles: 0,
                surface: plain.clone(),
            },
            Primitive {
                positions: square[..3].to_vec(),
                texcoords: vec![],
                colors: vec![],
                indices: vec![2, 1, 0],
                normals: vec![Normal::along(glam::DVec3::NEG_X); 3],
                skirt_triangles: 0,
                surface: plain,
            },
        ],
    }
}
