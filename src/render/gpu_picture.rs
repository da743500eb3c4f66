//! A picture on the graphics card.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Extent3d,
    Origin3d, Queue, TexelCopyBufferLayout, TexelCopyTextureInfo, Texture, TextureAspect,
    TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
};

use super::content::{self, Picture};
use super::samplers::Samplers;
use crate::mesh::Wrap;

/// A picture on the graphics card, with all its levels.
pub(super) struct GpuPicture {
    texture: Texture,
    pub bytes: u64,
    /// One for each way in which it goes on.
    bindings: Vec<([Wrap; 2], BindGroup)>,
}

impl GpuPicture {
    /// Copies a picture. Of one that is larger than the card can take, the largest levels are
    /// left away.
    pub fn new(device: &wgpu::Device, queue: &Queue, picture: &Picture) -> Self {
        let longest = device.limits().max_texture_dimension_2d;
        let levels = picture.levels().skip_while(|(size, _)| size[0].max(size[1]) > longest);
        let levels: Vec<_> = levels.collect();
        let extent = |[width, height]: [u32; 2]| Extent3d { width, height, ..Default::default() };
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("picture"),
            size: extent(levels[0].0),
            mip_level_count: levels.len() as u32,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: gpu_format(picture.format()),
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let format = picture.format();
        let mut bytes = 0;
        for (&(size, texels), mip_level) in levels.iter().zip(0..) {
            bytes += texels.len() as u64;
            queue.write_texture(
                TexelCopyTextureInfo {
                    texture: &texture,
                    mip_level,
                    origin: Origin3d::ZERO,
                    aspect: TextureAspect::All,
                },
                texels,
                TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(format.blocks(size)[0] * format.block_bytes()),
                    rows_per_image: None,
                },
                // Whole blocks, also where they reach beyond the level.
                extent(format.blocks(size).map(|blocks| blocks * format.block_side())),
            );
        }
        Self { texture, bytes, bindings: Vec::new() }
    }

    /// Makes what draws bind, for pictures that go on in this way, unless it is there.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        layout: &BindGroupLayout,
        samplers: &mut Samplers,
        wrap: [Wrap; 2],
    ) {
        if self.binding(wrap).is_some() {
            return;
        }
        let view = self.texture.create_view(&Default::default());
        let binding = device.create_bind_group(&BindGroupDescriptor {
            label: Some("picture"),
            layout,
            entries: &[
                BindGroupEntry { binding: 0, resource: BindingResource::TextureView(&view) },
                BindGroupEntry {
                    binding: 1,
                    resource: BindingResource::Sampler(samplers.get(device, wrap)),
                },
            ],
        });
        self.bindings.push((wrap, binding));
    }

    /// What drivers that compile for the picture at hand tell apart: whether its sides are powers
    /// of two, whether it has more than one level, and its format.
    pub fn kind(&self) -> PictureKind {
        let Self { texture, .. } = self;
        PictureKind {
            powers_of_two: [texture.width(), texture.height()].map(u32::is_power_of_two),
            has_levels: texture.mip_level_count() > 1,
            format: texture.format(),
        }
    }

    /// What draws bind, once it was prepared.
    pub fn binding(&self, wrap: [Wrap; 2]) -> Option<&BindGroup> {
        self.bindings.iter().find(|(found, _)| *found == wrap).map(|(_, binding)| binding)
    }
}

/// What drivers may compile for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PictureKind {
    powers_of_two: [bool; 2],
    has_levels: bool,
    format: TextureFormat,
}

/// What a format is to the graphics card: colours are sRGB-encoded.
fn gpu_format(format: content::TextureFormat) -> TextureFormat {
    match format {
        content::TextureFormat::Rgba8 => TextureFormat::Rgba8UnormSrgb,
        content::TextureFormat::Bc7 => TextureFormat::Bc7RgbaUnormSrgb,
    }
}

impl Drop for GpuPicture {
    /// Its memory is free as soon as no frame uses it, rather than when the last binding is gone.
    fn drop(&mut self) {
        self.texture.destroy();
    }
}
