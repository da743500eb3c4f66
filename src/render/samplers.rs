//! How pictures go on outside of 0–1: a sampler for each of the nine ways, made when needed.

use wgpu::{AddressMode, Device, FilterMode, MipmapFilterMode, Sampler, SamplerDescriptor};

use crate::mesh::Wrap;

/// A sampler for each way in which a picture goes on.
#[derive(Default)]
pub(super) struct Samplers([Option<Sampler>; 9]);

impl Samplers {
    /// Filters between texels and between sizes.
    pub fn get(&mut self, device: &Device, wrap: [Wrap; 2]) -> &Sampler {
        self.0[number(wrap[0]) * 3 + number(wrap[1])].get_or_insert_with(|| {
            device.create_sampler(&SamplerDescriptor {
                label: Some("picture"),
                address_mode_u: address(wrap[0]),
                address_mode_v: address(wrap[1]),
                mag_filter: FilterMode::Linear,
                min_filter: FilterMode::Linear,
                mipmap_filter: MipmapFilterMode::Linear,
                ..Default::default()
            })
        })
    }
}

fn number(wrap: Wrap) -> usize {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    }
}

fn address(wrap: Wrap) -> AddressMode {
    match wrap {
        Wrap::Repeat => AddressMode::Repeat,
        Wrap::Mirror => AddressMode::MirrorRepeat,
        Wrap::Clamp => AddressMode::ClampToEdge,
    }
}
