//! Having the driver compile before a frame needs it.
//!
//! A driver may compile a pipeline when it is first drawn with, and again for each kind of
//! picture and sampler that it meets. On lavapipe that takes 0.1 s: a frame that a node first
//! appears in would seem to cost many times what it does.

use rustc_hash::FxHashSet;
use wgpu::BindGroup;

use super::content::DrawPicture;
use super::device::Device;
use super::gpu_node::{GpuDraw, GpuNode};
use super::gpu_picture::{GpuPicture, PictureKind};
use super::pipelines::{PipelineKey, Pipelines};
use super::target::Target;
use crate::Result;
use crate::mesh::Wrap;

/// What has been compiled, and where.
pub(super) struct WarmUp {
    /// So that the last frame stays as it is.
    target: Target,
    done: FxHashSet<Kind>,
}

/// What a driver may compile for.
type Kind = (PipelineKey, Option<([Wrap; 2], PictureKind)>);

impl WarmUp {
    pub fn new(device: &Device) -> Self {
        Self { target: Target::tiny(&device.device), done: FxHashSet::default() }
    }

    /// Draws nothing, so that a driver which starts threads when it first draws has done so.
    pub fn threads(&self, device: &Device) -> Result<()> {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        drop(self.target.begin(&mut encoder, false, None));
        device.wait(device.queue.submit([encoder.finish()]))
    }

    /// Draws one triangle of each kind that a node has and that was not drawn yet. Draws whose
    /// shared picture is not there are left for later.
    pub fn node<'a>(
        &mut self,
        device: &Device,
        pipelines: &Pipelines,
        camera: &BindGroup,
        instances: &wgpu::Buffer,
        node: &'a GpuNode,
        shared: impl Fn(u32) -> Option<&'a GpuPicture>,
    ) -> Result<()> {
        let mut encoder = device.device.create_command_encoder(&Default::default());
        let mut pass = self.target.begin(&mut encoder, false, None);
        let mut some = false;
        for draw in &node.draws {
            let picture = match draw.picture {
                DrawPicture::None => None,
                DrawPicture::Own(own) => node.pictures.get(own as usize),
                DrawPicture::Shared(texture) => shared(texture),
            };
            for key in [draw.pipeline, draw.pipeline.when_cut()] {
                let Some(kind) = kind(key, draw, picture) else { continue };
                // Those for cut nodes are made only where nodes may be cut.
                let Some(pipeline) = pipelines.get(key.number()) else { continue };
                if !self.done.insert(kind) {
                    continue;
                }
                some = true;
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, camera, &[]);
                if let Some(picture) = picture {
                    pass.set_bind_group(1, picture.binding(draw.wrap), &[]);
                }
                pass.set_vertex_buffer(0, node.vertices.slice(..));
                pass.set_vertex_buffer(1, instances.slice(..));
                pass.set_index_buffer(node.indices.slice(..), node.index_format);
                pass.draw_indexed(draw.indices.start..draw.indices.start + 3, 0, 0..1);
            }
        }
        drop(pass);
        if some { device.wait(device.queue.submit([encoder.finish()])) } else { Ok(()) }
    }
}

/// `None` where the picture that it needs is not there.
fn kind(key: PipelineKey, draw: &GpuDraw, picture: Option<&GpuPicture>) -> Option<Kind> {
    match (draw.picture, picture) {
        (DrawPicture::None, _) => Some((key, None)),
        (_, Some(picture)) => {
            picture.binding(draw.wrap)?;
            Some((key, Some((draw.wrap, picture.kind()))))
        }
        (_, None) => None,
    }
}
