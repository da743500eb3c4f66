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
            pipelines.prepare(device, pipeline);
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
            });
        }
        let vertices = bytemuck::cast_slice(&content.vertices[..]);
        let geometry = vertices.len() as u64 + content.indices.bytes();
        Self {
            origin: content.origin,
            centre: content.origin + middle(content),
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

/// The middle of the vertices' bounding box, relative to the origin.
fn middle(content: &Content) -> DVec3 {
    let mut corners = content.vertices.iter().map(|vertex| glam::Vec3::from(vertex.position));
    let Some(first) = corners.next() else { return DVec3::ZERO };
    let (min, max) = corners.fold((first, first), |(min, max), at| (min.min(at), max.max(at)));
    (min.as_dvec3() + max.as_dvec3()) / 2.0
}
