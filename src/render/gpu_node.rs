//! A node on the graphics card.

use std::ops::Range;

use glam::DVec3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{Buffer, BufferUsages, IndexFormat, Queue};

use super::content::{Alpha, Content, DrawPicture, Indices};
use super::gpu_picture::GpuPicture;
use super::options::RenderOptions;
use super::pipelines::{PipelineKey, Pipelines};
use super::samplers::Samplers;
use crate::mesh::Wrap;

/// A node on the graphics card.
pub(super) struct GpuNode {
    pub origin: DVec3,
    /// The middle of its vertices, in source coordinates.
    pub centre: DVec3,
    /// Half the size of the box around them.
    pub half: DVec3,
    pub level: u32,
    pub vertices: Buffer,
    pub indices: Buffer,
    pub index_format: IndexFormat,
    pub draws: Vec<GpuDraw>,
    pub pictures: Vec<GpuPicture>,
    pub bytes: u64,
}

/// Triangles that are drawn at once.
pub(super) struct GpuDraw {
    pub indices: Range<u32>,
    pub pipeline: PipelineKey,
    pub alpha: Alpha,
    pub picture: DrawPicture,
    pub wrap: [Wrap; 2],
    pub projection: Option<[f32; 4]>,
}

impl GpuNode {
    pub fn new(
        device: &wgpu::Device,
        queue: &Queue,
        pipelines: &mut Pipelines,
        samplers: &mut Samplers,
        options: &RenderOptions,
        level: u32,
        content: &Content,
    ) -> Self {
        let buffer = |label, contents: &[u8], usage| {
            device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
        };
        let (indices, index_format) = match &content.indices {
            Indices::Short(indices) => (bytemuck::cast_slice(&indices[..]), IndexFormat::Uint16),
            Indices::Long(indices) => (bytemuck::cast_slice(&indices[..]), IndexFormat::Uint32),
        };
        let mut pictures: Vec<GpuPicture> = content
            .pictures
            .iter()
            .map(|picture| GpuPicture::new(device, queue, picture))
            .collect();
        let mut draws: Vec<GpuDraw> = Vec::with_capacity(content.draws.len());
        for draw in &content.draws {
            let pipeline = PipelineKey::of(draw, options);
            pipeline.and_cut(options).for_each(|key| pipelines.prepare(device, key));
            if let DrawPicture::Own(own) = draw.picture
                && let Some(picture) = pictures.get_mut(own as usize)
            {
                picture.prepare(device, &pipelines.picture_layout, samplers, draw.wrap);
            }
            draws.push(GpuDraw {
                indices: draw.indices.clone(),
                pipeline,
                alpha: draw.alpha,
                picture: draw.picture,
                wrap: draw.wrap,
                projection: draw.projection,
            });
        }
        let vertices = bytemuck::cast_slice(&content.vertices[..]);
        let geometry = vertices.len() as u64 + content.indices.bytes();
        let [min, max] = bounds(content);
        Self {
            origin: content.origin,
            centre: content.origin + (min + max) / 2.0,
            half: (max - min) / 2.0,
            level,
            vertices: buffer("vertices", vertices, BufferUsages::VERTEX),
            indices: buffer("indices", indices, BufferUsages::INDEX),
            index_format,
            draws,
            bytes: geometry + pictures.iter().map(|picture| picture.bytes).sum::<u64>(),
            pictures,
        }
    }
}

impl Drop for GpuNode {
    fn drop(&mut self) {
        self.vertices.destroy();
        self.indices.destroy();
    }
}

/// The box around the vertices, relative to the origin.
fn bounds(content: &Content) -> [DVec3; 2] {
    let mut corners = content.vertices.iter().map(|vertex| glam::Vec3::from(vertex.position));
    let first = corners.next().unwrap_or_default();
    let bounds = corners.fold([first; 2], |[min, max], at| [min.min(at), max.max(at)]);
    bounds.map(|corner| corner.as_dvec3())
}
