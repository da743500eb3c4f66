//! Materials and the textures that they name, as imported.

use std::path::PathBuf;
use std::sync::Arc;

/// How a texture continues outside 0–1 along one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default)]
pub enum Wrap {
    /// The texture repeats (the default of OBJ and glTF).
    #[default]
    Repeat,
    /// The texture repeats, every second time mirrored.
    Mirror,
    /// The last texel goes on for ever.
    Clamp,
}

/// What a material's alpha does.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// Texels whose alpha is below the cutoff (0–1) are holes.
    Mask {
        /// Alpha below this is a hole, 0–1.
        cutoff: f32,
    },
    /// Alpha blends.
    Blend,
}

/// One material of an input file.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// The name in the source, unique within a [`Model`](super::Model).
    pub name: String,
    /// Diffuse colour, linear light, RGBA in 0–1; multiplies texture and vertex colour.
    pub base_color: [f32; 4],
    /// Index into [`Model::textures`](super::Model::textures); `None` where untextured.
    pub texture: Option<u32>,
    /// Wrapping along u and v.
    pub wrap: [Wrap; 2],
    /// What alpha does.
    pub alpha: AlphaMode,
    /// Both sides of a triangle are drawn. OBJ says nothing of sides, so it is true there.
    pub double_sided: bool,
    /// It is shown without light (KHR_materials_unlit). A texture is always shown so.
    pub is_unlit: bool,
}

impl Material {
    /// A plain grey, opaque, untextured, two-sided material.
    pub fn plain(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            base_color: [0.6038, 0.6038, 0.6038, 1.0],
            texture: None,
            wrap: [Wrap::Repeat; 2],
            alpha: AlphaMode::Opaque,
            double_sided: true,
            is_unlit: false,
        }
    }
}

/// Where a texture's encoded bytes are. Nothing is decoded at import.
#[derive(Clone, Debug)]
pub enum TextureData {
    /// A file of its own.
    File(PathBuf),
    /// Bytes inside the model's file.
    Embedded(Arc<[u8]>),
}

/// A texture named by one or more materials.
#[derive(Clone, Debug)]
pub struct TextureSource {
    /// For messages and file names: the path as the material gave it, or the glTF image's name.
    pub name: String,
    /// The encoded bytes.
    pub data: TextureData,
    /// MTL's `map_d`: a second texture whose alpha (or, where it has none, luminance) is the
    /// opacity of this one. `None` where it is the same file or absent.
    pub opacity: Option<PathBuf>,
}
