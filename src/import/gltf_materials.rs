//! Materials and textures of glTF.

use gltf_json::extensions::texture::TextureTransform;
use gltf_json::material as json_material;
use gltf_json::texture::{Info, WrappingMode};
use gltf_json::validation::Checked;
use gltf_json::{Root, image};
use serde_json::Value;

use super::gltf_buffers::{Buffers, find_uri, read_uri};
use super::paths::Finder;
use super::textures::Textures;
use crate::mesh::{AlphaMode, Material, TextureData, TextureSource, Warnings, Wrap};

/// A material, and which texture coordinates its texture takes in what way.
#[derive(Clone, Debug)]
pub(super) struct GltfMaterial {
    pub(super) material: Material,
    /// The `n` of `TEXCOORD_n`.
    pub(super) texcoord_set: u32,
    pub(super) transform: Transform,
}

/// KHR_texture_transform: scale, then rotation, then offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    offset: [f64; 2],
    /// Sine and cosine.
    rotation: (f64, f64),
    scale: [f64; 2],
}

impl Default for Transform {
    fn default() -> Self {
        Self { offset: [0.0; 2], rotation: (0.0, 1.0), scale: [1.0; 2] }
    }
}

impl Transform {
    fn new(json: &TextureTransform) -> Self {
        Self {
            offset: json.offset.0.map(f64::from),
            rotation: f64::from(json.rotation.0).sin_cos(),
            scale: json.scale.0.map(f64::from),
        }
    }

    /// A positive angle turns counter-clockwise as seen, which with v downwards is (c, s; −s, c).
    pub(super) fn apply(&self, [u, v]: [f64; 2]) -> [f32; 2] {
        let (u, v) = (u * self.scale[0], v * self.scale[1]);
        let (sine, cosine) = self.rotation;
        let turned = [cosine * u + sine * v, cosine * v - sine * u];
        [(turned[0] + self.offset[0]) as f32, (turned[1] + self.offset[1]) as f32]
    }
}

/// The image of each texture: that of an extension which `image` reads, or the texture's own.
pub(super) fn texture_images(json: &Value) -> Vec<Option<usize>> {
    let textures = json["textures"].as_array().map_or(&[][..], Vec::as_slice);
    let source = |texture: &Value| {
        let webp = &texture["extensions"]["EXT_texture_webp"]["source"];
        webp.as_u64().or_else(|| texture["source"].as_u64()).map(|index| index as usize)
    };
    textures.iter().map(source).collect()
}

/// Makes materials as primitives use them, each once.
pub(super) struct Materials<'a> {
    root: &'a Root,
    /// The image of each texture, from [`texture_images`].
    images: &'a [Option<usize>],
    /// How messages begin: the file.
    file: String,
    pub(super) textures: Textures,
    /// By the image's index: its texture, or that it cannot be had.
    loaded: Vec<Option<Option<u32>>>,
}

impl<'a> Materials<'a> {
    pub(super) fn new(root: &'a Root, images: &'a [Option<usize>], file: String) -> Self {
        let loaded = vec![None; root.images.len()];
        Self { root, images, file, textures: Textures::default(), loaded }
    }

    /// The material of that index, or glTF's default for `None`.
    pub(super) fn make(
        &mut self,
        index: Option<usize>,
        buffers: &Buffers,
        finder: &mut Finder,
        warnings: &mut Warnings,
    ) -> GltfMaterial {
        let mut result = GltfMaterial {
            material: Material {
                base_color: [1.0; 4],
                double_sided: false,
                ..Material::plain(String::new())
            },
            texcoord_set: 0,
            transform: Transform::default(),
        };
        let Some((index, json)) =
            index.and_then(|index| Some((index, self.root.materials.get(index)?)))
        else {
            return result;
        };
        let material = &mut result.material;
        material.name = json.name.clone().unwrap_or_else(|| format!("material {index}"));
        material.double_sided = json.double_sided;
        material.is_unlit =
            json.extensions.as_ref().is_some_and(|extensions| extensions.unlit.is_some());
        material.alpha = match json.alpha_mode {
            Checked::Valid(json_material::AlphaMode::Mask) => {
                AlphaMode::Mask { cutoff: json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0) }
            }
            Checked::Valid(json_material::AlphaMode::Blend) => AlphaMode::Blend,
            _ => AlphaMode::Opaque,
        };
        let glossiness = json
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.pbr_specular_glossiness.as_ref());
        let (color, info) = match glossiness {
            Some(glossiness) => (glossiness.diffuse_factor.0, &glossiness.diffuse_texture),
            None => {
                let pbr = &json.pbr_metallic_roughness;
                (pbr.base_color_factor.0, &pbr.base_color_texture)
            }
        };
        material.base_color =
            color.map(|part| if part.is_nan() { 1.0 } else { part.clamp(0.0, 1.0) });
        if let Some(info) = info {
            self.set_texture(&mut result, info, buffers, finder, warnings);
        }
        result
    }

    fn set_texture(
        &mut self,
        result: &mut GltfMaterial,
        info: &Info,
        buffers: &Buffers,
        finder: &mut Finder,
        warnings: &mut Warnings,
    ) {
        let index = info.index.value();
        let image = self.images.get(index).copied().flatten();
        match image.and_then(|image| self.load(image, buffers, finder, warnings)) {
            Some(texture) => result.material.texture = Some(texture),
            None => return,
        }
        result.texcoord_set = info.tex_coord;
        let extension = info.extensions.as_ref();
        if let Some(json) = extension.and_then(|extension| extension.texture_transform.as_ref()) {
            result.transform = Transform::new(json);
            result.texcoord_set = json.tex_coord.unwrap_or(info.tex_coord);
        }
        let sampler = self.root.textures.get(index).and_then(|texture| texture.sampler);
        if let Some(sampler) = sampler.and_then(|sampler| self.root.samplers.get(sampler.value())) {
            result.material.wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
        }
    }

    /// The texture of an image; `None`, with a warning at the first time, where it cannot be had.
    fn load(
        &mut self,
        image: usize,
        buffers: &Buffers,
        finder: &mut Finder,
        warnings: &mut Warnings,
    ) -> Option<u32> {
        let json = self.root.images.get(image)?;
        if let Some(known) = self.loaded[image] {
            return known;
        }
        let name = json.name.clone().filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| format!("image {image}"));
        let texture = self.read(json, &name, buffers, finder).map_err(|what| {
            warnings.add(format!("{}: {name}: {what}", self.file), 1);
        });
        self.loaded[image] = Some(texture.ok());
        texture.ok()
    }

    fn read(
        &mut self,
        json: &image::Image,
        name: &str,
        buffers: &Buffers,
        finder: &mut Finder,
    ) -> Result<u32, String> {
        let bytes = match (json.buffer_view, json.uri.as_deref()) {
            (Some(view), _) => buffers.view(view)?.to_vec(),
            (None, Some(uri)) if uri.starts_with("data:") => read_uri(uri, finder)?.0,
            (None, Some(uri)) => {
                let file = find_uri(uri, finder).map_err(|what| format!("texture {what}"))?;
                return Ok(self.textures.file(uri, file, None));
            }
            (None, None) => return Err("image without data".to_owned()),
        };
        let list = &mut self.textures.list;
        list.push(TextureSource {
            name: name.to_owned(),
            data: TextureData::Embedded(bytes.into()),
            opacity: None,
        });
        Ok(list.len() as u32 - 1)
    }
}

fn wrap(mode: Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texture_transforms_scale_turn_and_move() {
        let quarter = std::f64::consts::FRAC_PI_2.sin_cos();
        let transform = Transform { offset: [0.5, 0.25], rotation: quarter, scale: [2.0, 4.0] };
        let [u, v] = transform.apply([1.0, 0.0]);
        assert!((u - 0.5).abs() < 1e-6 && (v - (0.25 - 2.0)).abs() < 1e-6, "{u} {v}");
        let [u, v] = transform.apply([0.0, 1.0]);
        assert!((u - 4.5).abs() < 1e-6 && (v - 0.25).abs() < 1e-6, "{u} {v}");
        assert_eq!(Transform::default().apply([0.25, 3.0]), [0.25, 3.0]);
    }
}
