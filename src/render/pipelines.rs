//! The ways to draw triangles, made when a node first needs them.

use std::num::NonZeroU64;

use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType,
    BufferBindingType, CompareFunction, DepthStencilState, Device, Face, FragmentState,
    MultisampleState, PipelineCompilationOptions, PipelineLayout, PipelineLayoutDescriptor,
    PrimitiveState, RenderPipeline, RenderPipelineDescriptor, SamplerBindingType, ShaderModule,
    ShaderStages, TextureFormat, TextureSampleType, TextureViewDimension, VertexAttribute,
    VertexBufferLayout, VertexState, VertexStepMode, vertex_attr_array,
};

use super::camera::Camera;
use super::content::{Alpha, Draw, DrawPicture, Vertex};
use super::instance::Instance;
use super::options::{RenderOptions, Shading, Side};
use super::target::{COLOR_FORMAT, DEPTH_FORMAT};

/// What divides the ways to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    texture: Texture,
    /// 0 opaque, 1 mask, 2 screen.
    alpha: u8,
    cull: bool,
    /// Cut at the box.
    cut: bool,
}

/// Where texture coordinates come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Texture {
    None,
    /// None, and no light.
    Unlit,
    Mapped,
    Projected,
}

impl PipelineKey {
    pub fn of(draw: &Draw, options: &RenderOptions) -> Self {
        Self {
            texture: match (draw.picture, draw.projection) {
                (DrawPicture::None, _) if draw.is_unlit => Texture::Unlit,
                (DrawPicture::None, _) => Texture::None,
                (_, None) => Texture::Mapped,
                (_, Some(_)) => Texture::Projected,
            },
            alpha: match draw.alpha {
                Alpha::Opaque => 0,
                Alpha::Mask { .. } => 1,
                Alpha::Screen => 2,
            },
            cull: options.cull && !draw.double_sided,
            cut: false,
        }
    }

    /// For what is cut at the box. What is projected never is.
    pub fn when_cut(self) -> Self {
        Self { cut: self.texture != Texture::Projected, ..self }
    }

    /// Itself, and what is needed where nodes may be cut.
    pub fn and_cut(self, options: &RenderOptions) -> impl Iterator<Item = Self> {
        let cut = options.cut.map(|_| self.when_cut());
        std::iter::once(self).chain(cut.filter(|&cut| cut != self))
    }

    /// Below [`PIPELINES`]; opaque ones first, and what is projected, which is far, last of them.
    pub fn number(self) -> usize {
        let texture = match (self.texture, self.cut) {
            (Texture::None, cut) => usize::from(cut),
            (Texture::Unlit, cut) => 2 + usize::from(cut),
            (Texture::Mapped, cut) => 4 + usize::from(cut),
            (Texture::Projected, _) => 6,
        };
        usize::from(self.alpha) * 14 + texture * 2 + usize::from(self.cull)
    }
}

const PIPELINES: usize = 42;

const VERTEX: [VertexAttribute; 3] =
    vertex_attr_array![0 => Float32x3, 1 => Float32x2, 2 => Unorm8x4];
const INSTANCE: [VertexAttribute; 4] =
    vertex_attr_array![3 => Float32x3, 4 => Float32, 5 => Float32x3, 6 => Float32x4];

/// The ways to draw triangles.
pub(super) struct Pipelines {
    /// Of the camera.
    pub camera_layout: BindGroupLayout,
    /// Of a picture and its sampler.
    pub picture_layout: BindGroupLayout,
    shader: ShaderModule,
    plain: PipelineLayout,
    textured: PipelineLayout,
    shading: Shading,
    cut: Option<Side>,
    made: [Option<RenderPipeline>; PIPELINES],
}

impl Pipelines {
    pub fn new(device: &Device, options: &RenderOptions) -> Self {
        let camera_layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("camera"),
            entries: &[entry(
                0,
                ShaderStages::VERTEX_FRAGMENT,
                BindingType::Buffer {
                    ty: BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: NonZeroU64::new(size_of::<Camera>() as u64),
                },
            )],
        });
        let picture_layout = device.create_bind_group_layout(&BindGroupLayoutDescriptor {
            label: Some("picture"),
            entries: &[
                entry(
                    0,
                    ShaderStages::FRAGMENT,
                    BindingType::Texture {
                        sample_type: TextureSampleType::Float { filterable: true },
                        view_dimension: TextureViewDimension::D2,
                        multisampled: false,
                    },
                ),
                entry(
                    1,
                    ShaderStages::FRAGMENT,
                    BindingType::Sampler(SamplerBindingType::Filtering),
                ),
            ],
        });
        let layout = |layouts: &[Option<&BindGroupLayout>]| {
            device.create_pipeline_layout(&PipelineLayoutDescriptor {
                label: None,
                bind_group_layouts: layouts,
                immediate_size: 0,
            })
        };
        Self {
            shader: device.create_shader_module(wgpu::include_wgsl!("shader.wgsl")),
            plain: layout(&[Some(&camera_layout)]),
            textured: layout(&[Some(&camera_layout), Some(&picture_layout)]),
            camera_layout,
            picture_layout,
            shading: options.shading,
            cut: options.cut,
            made: [const { None }; PIPELINES],
        }
    }

    /// Makes a way to draw unless it is there.
    pub fn prepare(&mut self, device: &Device, key: PipelineKey) {
        if self.made[key.number()].is_none() {
            self.made[key.number()] = Some(self.make(device, key));
        }
    }

    /// A way that was prepared.
    pub fn get(&self, number: usize) -> Option<&RenderPipeline> {
        self.made.get(number)?.as_ref()
    }

    fn make(&self, device: &Device, key: PipelineKey) -> RenderPipeline {
        let (layout, vertex, fragment) = match (key.texture, key.cut) {
            (Texture::None | Texture::Unlit, false) => (&self.plain, "place_plain", "shade_plain"),
            (Texture::None | Texture::Unlit, true) => {
                (&self.plain, "place_boxed_plain", "shade_boxed_plain")
            }
            (Texture::Mapped, false) => (&self.textured, "place_textured", "shade_textured"),
            (Texture::Mapped, true) => {
                (&self.textured, "place_boxed_textured", "shade_boxed_textured")
            }
            (Texture::Projected, _) => (&self.textured, "place_projected", "shade_projected"),
        };
        let lit = match self.shading {
            Shading::Photo => key.texture == Texture::None,
            Shading::HeadLight => true,
            Shading::Unlit => false,
        };
        let flag = |flag: bool| f64::from(u8::from(flag));
        let constants = [
            ("LIT", flag(lit)),
            ("MASK", flag(key.alpha == 1)),
            ("SCREEN", flag(key.alpha == 2)),
            ("INSIDE", flag(self.cut == Some(Side::Inside))),
            ("OUTSIDE", flag(self.cut == Some(Side::Outside))),
        ];
        device.create_render_pipeline(&RenderPipelineDescriptor {
            label: None,
            layout: Some(layout),
            vertex: VertexState {
                module: &self.shader,
                entry_point: Some(vertex),
                compilation_options: PipelineCompilationOptions::default(),
                buffers: &[
                    Some(VertexBufferLayout {
                        array_stride: size_of::<Vertex>() as u64,
                        step_mode: VertexStepMode::Vertex,
                        attributes: &VERTEX,
                    }),
                    Some(VertexBufferLayout {
                        array_stride: size_of::<Instance>() as u64,
                        step_mode: VertexStepMode::Instance,
                        attributes: &INSTANCE,
                    }),
                ],
            },
            primitive: PrimitiveState {
                cull_mode: key.cull.then_some(Face::Back),
                ..Default::default()
            },
            depth_stencil: Some(DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                // Reversed: near is 1.
                depth_compare: Some(CompareFunction::GreaterEqual),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: MultisampleState::default(),
            fragment: Some(FragmentState {
                module: &self.shader,
                entry_point: Some(fragment),
                compilation_options: PipelineCompilationOptions {
                    constants: &constants,
                    ..Default::default()
                },
                targets: &[Some(target(COLOR_FORMAT))],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

fn target(format: TextureFormat) -> wgpu::ColorTargetState {
    wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL }
}

fn entry(binding: u32, visibility: ShaderStages, ty: BindingType) -> BindGroupLayoutEntry {
    BindGroupLayoutEntry { binding, visibility, ty, count: None }
}
