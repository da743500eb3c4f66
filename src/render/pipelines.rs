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
use super::options::{RenderOptions, Shading};
use super::target::{COLOR_FORMAT, DEPTH_FORMAT};

/// What divides the ways to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct PipelineKey {
    textured: bool,
    /// 0 opaque, 1 mask, 2 screen.
    alpha: u8,
    cull: bool,
}

impl PipelineKey {
    pub fn of(draw: &Draw, options: &RenderOptions) -> Self {
        Self {
            textured: draw.picture != DrawPicture::None,
            alpha: match draw.alpha {
                Alpha::Opaque => 0,
                Alpha::Mask { .. } => 1,
                Alpha::Screen => 2,
            },
            cull: options.cull && !draw.double_sided,
        }
    }

    /// Below [`PIPELINES`]; opaque ones first.
    pub fn number(self) -> usize {
        usize::from(self.alpha) * 4 + usize::from(self.textured) * 2 + usize::from(self.cull)
    }
}

const PIPELINES: usize = 12;

const VERTEX: [VertexAttribute; 3] =
    vertex_attr_array![0 => Float32x3, 1 => Float32x2, 2 => Unorm8x4];
const INSTANCE: [VertexAttribute; 3] =
    vertex_attr_array![3 => Float32x3, 4 => Float32, 5 => Float32x3];

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
    made: [Option<RenderPipeline>; PIPELINES],
}

impl Pipelines {
    pub fn new(device: &Device, shading: Shading) -> Self {
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
            shading,
            made: Default::default(),
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
        let (layout, vertex, fragment) = if key.textured {
            (&self.textured, "place_textured", "shade_textured")
        } else {
            (&self.plain, "place_plain", "shade_plain")
        };
        let lit = match self.shading {
            Shading::Photo => !key.textured,
            Shading::HeadLight => true,
            Shading::Unlit => false,
        };
        let flag = |flag: bool| f64::from(u8::from(flag));
        let constants =
            [("LIT", flag(lit)), ("MASK", flag(key.alpha == 1)), ("SCREEN", flag(key.alpha == 2))];
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
