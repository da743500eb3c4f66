//! What a node looks like at points of its triangles, from its own file and images.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::surface_appearance::{Color, SurfaceAppearance};
use crate::decode::{DecodedTexture, decode_texture};
use crate::format::{
    NODES_DIR, NodeImageData, NodeMesh, Scene, TEXTURES_DIR, read_glb, read_regular,
};
use crate::mesh::{AlphaMode, TextureData, TextureSource};

/// Decodes images of nodes. Those that nodes share are decoded once and kept; a node's own only
/// while it is looked at.
pub(super) struct NodeTextures<'a> {
    out: PathBuf,
    scene: &'a Scene,
    shared: Vec<OnceLock<Option<DecodedTexture>>>,
}

/// A point of a node: number of a triangle in its file, and weights of its corners.
pub(super) type NodePoint = (u32, [f64; 3]);

impl<'a> NodeTextures<'a> {
    /// Of the scene in `out`.
    pub fn new(out: &Path, scene: &'a Scene) -> Self {
        let shared = scene.shared_textures.iter().map(|_| OnceLock::new()).collect();
        Self { out: out.into(), scene, shared }
    }

    /// Colours at points of a node; `None` where it is see-through or cannot be read.
    pub fn colors(&self, node: u32, points: &[NodePoint]) -> Vec<Option<Color>> {
        let nothing = || vec![None; points.len()];
        let file = &self.scene.nodes[node as usize].file;
        let Ok(bytes) = read_regular(&self.out.join(NODES_DIR).join(file)) else {
            return nothing();
        };
        let Ok(mesh) = read_glb(&bytes, Path::new(file)) else { return nothing() };
        let appearances: Vec<Option<SurfaceAppearance>> = points
            .iter()
            .map(|&(triangle, weights)| appearance(&mesh, triangle, weights))
            .collect();
        let mut own: Vec<OnceLock<Option<DecodedTexture>>> = Vec::new();
        own.resize_with(mesh.images.len(), OnceLock::new);
        appearances
            .into_iter()
            .map(|appearance| {
                let appearance = appearance?;
                let Some(number) = appearance.image else { return appearance.color(None) };
                let image = &mesh.images[number as usize];
                let image = match &image.data {
                    NodeImageData::Embedded { bytes, .. } => own[number as usize]
                        .get_or_init(|| decode(TextureData::Embedded(bytes.as_slice().into()))),
                    NodeImageData::Shared { file_name } => {
                        let shared = self.scene.shared_textures.iter();
                        let number =
                            shared.zip(0..).find(|(shared, _)| *shared.file_name == **file_name)?.1;
                        let path = self.out.join(TEXTURES_DIR).join(&**file_name);
                        let slot: &OnceLock<_> = &self.shared[number as usize];
                        slot.get_or_init(|| decode(TextureData::File(path)))
                    }
                };
                appearance.color(Some(image.as_ref()?))
            })
            .collect()
    }

    /// The numbers of the triangles of a node whose material has cut-outs, ascending; none where the node cannot be
    /// read.
    pub fn cut_out(&self, node: u32) -> Vec<u32> {
        let file = &self.scene.nodes[node as usize].file;
        let bytes = read_regular(&self.out.join(NODES_DIR).join(file)).ok();
        let mesh = bytes.and_then(|bytes| read_glb(&bytes, Path::new(file)).ok());
        let mut numbers = Vec::new();
        let mut first = 0;
        for primitive in mesh.iter().flat_map(|mesh| &mesh.primitives) {
            let end = first + primitive.indices.len() as u32 / 3;
            if matches!(primitive.surface.alpha, AlphaMode::Mask { .. }) {
                numbers.extend(first..end);
            }
            first = end;
        }
        numbers
    }
}

fn decode(data: TextureData) -> Option<DecodedTexture> {
    decode_texture(&TextureSource { name: "image".into(), data, opacity: None }).ok()
}

/// How a point of a triangle looks; triangles are numbered primitive by primitive.
fn appearance(mesh: &NodeMesh, triangle: u32, weights: [f64; 3]) -> Option<SurfaceAppearance> {
    let mut number = triangle as usize;
    let primitive = mesh.primitives.iter().find(|primitive| {
        let count = primitive.indices.len() / 3;
        let inside = number < count;
        if !inside {
            number -= count;
        }
        inside
    })?;
    let corners: [usize; 3] =
        std::array::from_fn(|corner| primitive.indices[3 * number + corner] as usize);
    let surface = &primitive.surface;
    let mut factor: [f64; 3] = std::array::from_fn(|i| f64::from(surface.base_color[i]));
    if !primitive.colors.is_empty() {
        for (channel, factor) in factor.iter_mut().enumerate() {
            let value: f64 =
                (0..3).map(|i| weights[i] * f64::from(primitive.colors[corners[i]][channel])).sum();
            *factor *= value / 65535.0;
        }
    }
    let texcoord = match surface.image {
        Some(_) => std::array::from_fn(|axis| {
            let at = |i: usize| f64::from(primitive.texcoords[corners[i]][axis]);
            (0..3).map(|i| weights[i] * at(i)).sum()
        }),
        None => [0.0; 2],
    };
    let image = surface.image.map(|image| image as u32);
    Some(SurfaceAppearance { image, texcoord, wrap: surface.wrap, alpha: surface.alpha, factor })
}
