//! Drawing what it is told to, from what it was given.

use std::time::Instant;

use glam::{DVec3, Vec3};
use image::RgbaImage;
use rustc_hash::FxHashMap;
use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, Buffer, BufferDescriptor, BufferUsages,
};

use super::adapter::AdapterLabel;
use super::camera::Camera;
use super::content::{Content, DrawPicture, Picture, TextureFormat};
use super::device::Device;
use super::gpu_node::GpuNode;
use super::gpu_picture::GpuPicture;
use super::instance::{Instance, level_tint};
use super::options::{RenderOptions, Side};
use super::pipelines::{PipelineKey, Pipelines};
use super::samplers::Samplers;
use super::target::{Layer, Target};
use super::thread_affinity;
use super::timestamps::Timestamps;
use super::warm_up::WarmUp;
use crate::camera::Pose;
use crate::{Error, Result};

/// How long a frame took, and what it drew.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrawTimes {
    /// Until the graphics card was told what to do, milliseconds.
    pub encode_ms: f64,
    /// From then until it had done it, milliseconds.
    pub gpu_wait_ms: f64,
    /// The same by the card's own clock, where it has one.
    pub gpu_ms: Option<f64>,
    /// Draw calls.
    pub draw_calls: u32,
    /// Triangles, seen or not.
    pub triangles: u64,
}

/// Draws nodes offscreen. Nodes and shared pictures are called by their index in the scene.
pub struct Renderer {
    options: RenderOptions,
    device: Device,
    target: Target,
    timestamps: Option<Timestamps>,
    pipelines: Pipelines,
    samplers: Samplers,
    warm_up: WarmUp,
    camera: Buffer,
    camera_binding: BindGroup,
    instances: Buffer,
    nodes: FxHashMap<u32, GpuNode>,
    shared: FxHashMap<u32, GpuPicture>,
    /// Bytes of the nodes and shared pictures.
    bytes: u64,
    /// Two corners of the box at which nodes are cut.
    cut_at: Option<[DVec3; 2]>,
    /// Of the frame before, so that they are not allocated again.
    jobs: Vec<Job>,
    instance_data: Vec<Instance>,
}

/// One draw of a frame.
struct Job {
    pipeline: usize,
    /// Square metres from the eye to the node's middle.
    distance: f64,
    /// Index in the scene.
    node: u32,
    /// Index in the node.
    draw: u32,
}

/// Instances for which there is room at first.
const INSTANCES: usize = 256;

impl Renderer {
    /// Opens a graphics adapter. Nothing is shown: it needs no window and no display.
    pub fn new(options: &RenderOptions) -> Result<Self> {
        let device = Device::open(options.adapter.as_deref())?;
        let longest = device.device.limits().max_texture_dimension_2d;
        let [width, height] = options.size;
        if !(1..=longest).contains(&width) || !(1..=longest).contains(&height) {
            return Err(Error::Usage(format!(
                "a picture of {width} x {height} pixels cannot be drawn; {} draws 1 to {longest} a \
                 side",
                device.label
            )));
        }
        let target =
            Target::new(&device.device, options.size, options.background, options.keep_depths);
        let pipelines = Pipelines::new(&device.device, options);
        let camera = device.device.create_buffer(&BufferDescriptor {
            label: Some("camera"),
            size: size_of::<Camera>() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let camera_binding = device.device.create_bind_group(&BindGroupDescriptor {
            label: Some("camera"),
            layout: &pipelines.camera_layout,
            entries: &[BindGroupEntry { binding: 0, resource: camera.as_entire_binding() }],
        });
        let instances = instance_buffer(&device, INSTANCES);
        device.check()?;
        let warm_up = WarmUp::new(&device);
        if device.label.is_processor {
            // llvmpipe's threads have no names before they have drawn.
            warm_up.threads(&device)?;
            thread_affinity::bind_rasteriser_threads();
        }
        Ok(Self {
            options: options.clone(),
            warm_up,
            timestamps: Timestamps::new(&device),
            device,
            target,
            pipelines,
            samplers: Samplers::default(),
            camera,
            camera_binding,
            instances,
            nodes: FxHashMap::default(),
            shared: FxHashMap::default(),
            bytes: 0,
            cut_at: None,
            jobs: Vec::new(),
            instance_data: Vec::new(),
        })
    }

    /// The adapter that draws.
    pub fn adapter(&self) -> &AdapterLabel {
        &self.device.label
    }

    /// The format for pictures that suits the adapter: compressed where it is a graphics card that
    /// samples it. Processors decode every texel they sample, which takes them longer than reading
    /// four times the bytes.
    pub fn preferred_textures(&self) -> TextureFormat {
        match self.device.label.is_processor || !self.device.samples(TextureFormat::Bc7) {
            true => TextureFormat::Rgba8,
            false => TextureFormat::Bc7,
        }
    }

    /// Fails where the adapter cannot sample a format, before anything is uploaded in it.
    pub fn check_textures(&self, format: TextureFormat) -> Result<()> {
        match self.device.samples(format) {
            true => Ok(()),
            false => Err(Error::NoAdapter(format!(
                "{} cannot sample BC7; ask for textures in rgba8",
                self.device.label
            ))),
        }
    }

    /// What was asked for.
    pub fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Copies a node's content to the graphics card; one that was there under this index gives
    /// way. `level` is the node's, for its tint.
    ///
    /// The first node of its kind takes longer, as the driver compiles for it. Shared pictures
    /// should come before the nodes that use them: otherwise a frame waits for that.
    pub fn upload(&mut self, node: u32, level: u32, content: &Content) -> Result<()> {
        self.remove(node);
        let Self { device, pipelines, samplers, options, .. } = self;
        let (gpu, queue) = (&device.device, &device.queue);
        let held = GpuNode::new(gpu, queue, pipelines, samplers, options, level, content);
        self.bytes += held.bytes;
        self.nodes.insert(node, held);
        self.start_copies().and_then(|()| self.warm_up(node)).inspect_err(|_| self.remove(node))
    }

    /// Has the driver compile now what the node needs and none before it did.
    fn warm_up(&mut self, node: u32) -> Result<()> {
        let Some(held) = self.nodes.get(&node) else { return Ok(()) };
        let layout = &self.pipelines.picture_layout;
        for draw in &held.draws {
            if let DrawPicture::Shared(texture) = draw.picture
                && let Some(picture) = self.shared.get_mut(&texture)
            {
                picture.prepare(&self.device.device, layout, &mut self.samplers, draw.wrap);
            }
        }
        let (camera, instances) = (&self.camera_binding, &self.instances);
        let shared = |texture: u32| self.shared.get(&texture);
        self.warm_up.node(&self.device, &self.pipelines, camera, instances, held, shared)
    }

    /// Copies a shared picture to the graphics card; one that was there under this index gives
    /// way.
    pub fn upload_shared(&mut self, texture: u32, picture: &Picture) -> Result<()> {
        self.remove_shared(texture);
        let held = GpuPicture::new(&self.device.device, &self.device.queue, picture);
        self.bytes += held.bytes;
        self.shared.insert(texture, held);
        self.start_copies().inspect_err(|_| self.remove_shared(texture))
    }

    /// Has what was written copied now rather than within the next frame.
    fn start_copies(&self) -> Result<()> {
        self.device.queue.submit([]);
        self.device.check()
    }

    /// Waits until all that was uploaded has arrived, so that the next frame does not.
    pub fn finish_uploads(&self) -> Result<()> {
        let submission = self.device.queue.submit([]);
        self.device.wait(submission)
    }

    /// Frees a node's memory; does nothing where it is not there.
    pub fn remove(&mut self, node: u32) {
        self.bytes -= self.nodes.remove(&node).map_or(0, |held| held.bytes);
    }

    /// Frees a shared picture's memory; does nothing where it is not there.
    pub fn remove_shared(&mut self, texture: u32) {
        self.bytes -= self.shared.remove(&texture).map_or(0, |held| held.bytes);
    }

    /// Bytes that nodes and shared pictures take on the graphics card. Where no picture is larger
    /// than the card can take, it is the sum of what they take here.
    pub fn gpu_bytes(&self) -> u64 {
        self.bytes
    }

    /// Bytes of what is drawn into, whatever is drawn.
    pub fn target_bytes(&self) -> u64 {
        self.target.bytes()
    }

    /// From now on, of nodes no more is drawn than what is on [the side](RenderOptions::cut) of a box that
    /// was asked for, which is given by its least and greatest corner. Pictures that are projected are not
    /// cut. Without such a side, nodes are whole.
    pub fn cut_at(&mut self, cut_at: Option<[DVec3; 2]>) {
        self.cut_at = cut_at.filter(|_| self.options.cut.is_some());
    }

    /// Draws exactly these nodes and waits until they are drawn. All must have been uploaded, and
    /// the shared pictures that they use. Nothing nearer than `near` metres (above 0) is seen; how
    /// small that is costs no precision.
    pub fn draw(&mut self, front: &[u32], pose: &Pose, near: f32) -> Result<DrawTimes> {
        self.draw_on(false, front, pose, near)
    }

    /// The same without beginning anew: what was drawn last, from the same pose, stays where it is
    /// nearer. Scenes larger than what is held can be drawn so part by part. Depths must be
    /// [kept](RenderOptions::keep_depths).
    pub fn draw_over(&mut self, nodes: &[u32], pose: &Pose, near: f32) -> Result<DrawTimes> {
        self.check_depths()?;
        self.draw_on(true, nodes, pose, near)
    }

    fn check_depths(&self) -> Result<()> {
        match self.options.keep_depths {
            true => Ok(()),
            false => Err(Error::Internal("depths are wanted and were not kept".into())),
        }
    }

    fn draw_on(&mut self, over: bool, front: &[u32], pose: &Pose, near: f32) -> Result<DrawTimes> {
        let begin = Instant::now();
        self.order(front, pose.position)?;
        let triangles = self.write(pose, near)?;
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        self.encode(&mut encoder, over)?;
        let submission = self.device.queue.submit([encoder.finish()]);
        let encoded = Instant::now();
        self.device.wait(submission)?;
        let ms = |duration: std::time::Duration| duration.as_secs_f64() * 1e3;
        Ok(DrawTimes {
            encode_ms: ms(encoded - begin),
            gpu_wait_ms: ms(encoded.elapsed()),
            gpu_ms: self.timestamps.as_ref().and_then(Timestamps::ms),
            draw_calls: self.jobs.len() as u32,
            triangles,
        })
    }

    /// Sorts what is to be drawn: what is opaque first, then from near to far, so that most of
    /// what is hidden is found out before it is shaded.
    fn order(&mut self, front: &[u32], eye: DVec3) -> Result<()> {
        self.jobs.clear();
        for &node in front {
            let held = self.nodes.get(&node).ok_or_else(|| missing("node", node))?;
            let distance = held.centre.distance_squared(eye);
            // One that is whole on the wrong side costs time, and nothing else.
            let is_cut =
                self.cut_at.is_some_and(|cut_at| !is_whole(held, cut_at, self.options.cut));
            let pipeline = |key: PipelineKey| if is_cut { key.when_cut() } else { key };
            self.jobs.extend(held.draws.iter().zip(0..).map(|(part, draw)| Job {
                pipeline: pipeline(part.pipeline).number(),
                distance,
                node,
                draw,
            }));
        }
        self.jobs.sort_by(|a, b| {
            (a.pipeline.cmp(&b.pipeline))
                .then(a.distance.total_cmp(&b.distance))
                .then(a.node.cmp(&b.node))
                .then(a.draw.cmp(&b.draw))
        });
        Ok(())
    }

    /// Writes camera and instances; the number of triangles.
    fn write(&mut self, pose: &Pose, near: f32) -> Result<u64> {
        let mut triangles = 0;
        self.instance_data.clear();
        for job in &self.jobs {
            let Some(held) = self.nodes.get(&job.node) else { continue };
            let draw = &held.draws[job.draw as usize];
            let tint =
                if self.options.show_levels { level_tint(held.level).into() } else { Vec3::ONE };
            let instance =
                Instance::new(pose.position, held.origin, draw.alpha, tint, draw.projection);
            self.instance_data.push(instance);
            triangles += draw.indices.len() as u64 / 3;
            if let DrawPicture::Shared(texture) = draw.picture {
                let picture = self.shared.get_mut(&texture);
                let picture = picture.ok_or_else(|| missing("shared picture", texture))?;
                let layout = &self.pipelines.picture_layout;
                picture.prepare(&self.device.device, layout, &mut self.samplers, draw.wrap);
            }
        }
        let camera = Camera::new(pose, self.options.size, near, self.cut_at, self.options.shading);
        self.device.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(&camera));
        let bytes: &[u8] = bytemuck::cast_slice(&self.instance_data);
        if bytes.len() as u64 > self.instances.size() {
            let room = self.instance_data.len().next_power_of_two();
            self.instances = instance_buffer(&self.device, room);
        }
        if !bytes.is_empty() {
            self.device.queue.write_buffer(&self.instances, 0, bytes);
        }
        Ok(triangles)
    }

    fn encode(&self, encoder: &mut wgpu::CommandEncoder, over: bool) -> Result<()> {
        let mut pass = self.target.begin(encoder, over, self.timestamps.as_ref());
        pass.set_bind_group(0, &self.camera_binding, &[]);
        pass.set_vertex_buffer(1, self.instances.slice(..));
        let (mut pipeline, mut node, mut binding) = (None, None, None);
        for (job, slot) in self.jobs.iter().zip(0..) {
            let Some(held) = self.nodes.get(&job.node) else { continue };
            let draw = &held.draws[job.draw as usize];
            if pipeline != Some(job.pipeline) {
                let made = self.pipelines.get(job.pipeline);
                pass.set_pipeline(made.ok_or_else(|| missing("pipeline", job.pipeline as u32))?);
                pipeline = Some(job.pipeline);
            }
            if node != Some(job.node) {
                pass.set_vertex_buffer(0, held.vertices.slice(..));
                pass.set_index_buffer(held.indices.slice(..), held.index_format);
                node = Some(job.node);
            }
            let picture = match draw.picture {
                DrawPicture::None => None,
                DrawPicture::Own(own) => held.pictures.get(own as usize),
                DrawPicture::Shared(texture) => self.shared.get(&texture),
            };
            if draw.picture != DrawPicture::None {
                let found = picture.and_then(|picture| picture.binding(draw.wrap));
                let found = found.ok_or_else(|| missing("picture of node", job.node))?;
                if binding != Some(found) {
                    pass.set_bind_group(1, found, &[]);
                    binding = Some(found);
                }
            }
            pass.draw_indexed(draw.indices.clone(), 0, slot..slot + 1);
        }
        drop(pass);
        if let Some(timestamps) = &self.timestamps {
            timestamps.resolve(encoder);
        }
        Ok(())
    }

    /// The frame that was drawn last.
    pub fn snapshot(&self) -> Result<RgbaImage> {
        let mut image = self.surface()?;
        image.pixels_mut().for_each(|pixel| pixel.0[3] = 255);
        Ok(image)
    }

    /// Where a triangle was drawn in the last frame (255), and where none was (0).
    pub fn coverage(&self) -> Result<image::GrayImage> {
        let image = self.surface()?;
        Ok(image::GrayImage::from_fn(image.width(), image.height(), |x, y| {
            image::Luma([image.get_pixel(x, y).0[3]])
        }))
    }

    /// Both at once: the frame that was drawn last, with alpha 255 where a triangle was drawn and
    /// 0 where none was.
    pub fn surface(&self) -> Result<RgbaImage> {
        let [width, height] = self.options.size;
        RgbaImage::from_raw(width, height, self.read_back(Layer::Color)?).ok_or_else(lost)
    }

    /// Metres along the view to what is seen at each pixel of the last frame, row by row; infinite
    /// where nothing is. `near` is that of the frame. Depths must be
    /// [kept](RenderOptions::keep_depths).
    pub fn depths(&self, near: f32) -> Result<Vec<f32>> {
        self.check_depths()?;
        let bytes = self.read_back(Layer::Depth)?;
        let depths = bytes.as_chunks::<4>().0.iter().map(|&bytes| f32::from_le_bytes(bytes));
        Ok(depths.map(|depth| near / depth).collect())
    }

    /// The last frame, four bytes a pixel.
    fn read_back(&self, layer: Layer) -> Result<Vec<u8>> {
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let buffer = self.target.copy_out(&self.device.device, &mut encoder, layer);
        self.device.wait(self.device.queue.submit([encoder.finish()]))?;
        self.target.pixels(&buffer).ok_or_else(lost)
    }
}

/// Whether all of a node is on a side of a box.
fn is_whole(node: &GpuNode, [min, max]: [DVec3; 2], side: Option<Side>) -> bool {
    let (low, high) = (node.centre - node.half, node.centre + node.half);
    match side {
        Some(Side::Inside) => low.cmpge(min).all() && high.cmple(max).all(),
        Some(Side::Outside) => low.cmpgt(max).any() || high.cmplt(min).any(),
        None => true,
    }
}

fn lost() -> Error {
    Error::Graphics("the picture could not be read back".into())
}

fn instance_buffer(device: &Device, room: usize) -> Buffer {
    device.device.create_buffer(&BufferDescriptor {
        label: Some("instances"),
        size: (room * size_of::<Instance>()) as u64,
        usage: BufferUsages::VERTEX | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// The caller asked for what it never gave.
fn missing(what: &str, index: u32) -> Error {
    Error::Internal(format!("{what} {index} is to be drawn but was not uploaded"))
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn an_adapter_that_is_lost_is_named_and_ends_nothing() {
        let options = RenderOptions { size: [64, 64], ..RenderOptions::default() };
        let mut renderer = match Renderer::new(&options) {
            Ok(renderer) => renderer,
            Err(error) => {
                let is_required = std::env::var("HLOD_REQUIRE_GPU").is_ok_and(|value| value == "1");
                assert!(!is_required && matches!(error, Error::NoAdapter(_)), "{error}");
                return println!("skipped: {error}");
            }
        };
        let pose = Pose { position: DVec3::ZERO, rotation: DQuat::IDENTITY, fov_y_deg: 60.0 };
        renderer.draw(&[], &pose, 0.1).unwrap();
        renderer.device.device.destroy();
        let label = renderer.device.label.to_string();
        let picture = Picture::new(4, 4, vec![0; 64]).unwrap();
        // And again.
        for _ in 0..2 {
            let failures = [
                renderer.draw(&[], &pose, 0.1).err(),
                renderer.snapshot().err(),
                renderer.upload_shared(0, &picture).err(),
            ];
            for failure in failures {
                let Some(Error::Graphics(what)) = failure else { panic!("{failure:?}") };
                assert!(what.contains(&label) && what.contains("was lost"), "{what}");
            }
        }
        renderer.remove_shared(0);
    }
}
