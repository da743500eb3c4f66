//! What is drawn into, and reading it back.

use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Device, Extent3d, LoadOp, MapMode,
    Operations, Origin3d, RenderPass, RenderPassColorAttachment, RenderPassDepthStencilAttachment,
    RenderPassDescriptor, StoreOp, TexelCopyBufferInfo, TexelCopyBufferLayout,
    TexelCopyTextureInfo, Texture, TextureAspect, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView,
};

use super::timestamps::Timestamps;

/// Stores what is seen, encoded; alpha is 1 where a triangle was drawn, else 0.
pub(super) const COLOR_FORMAT: TextureFormat = TextureFormat::Rgba8UnormSrgb;
/// Floating point, which reversed depth needs.
pub(super) const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// What is drawn into.
pub(super) struct Target {
    size: [u32; 2],
    color: Texture,
    color_view: TextureView,
    depth: Texture,
    depth_view: TextureView,
    keep_depths: bool,
    background: wgpu::Color,
}

/// Which of the two pictures of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layer {
    Color,
    Depth,
}

impl Target {
    pub fn new(device: &Device, size: [u32; 2], background: [u8; 3], keep_depths: bool) -> Self {
        let texture = |label, format, usage| {
            device.create_texture(&TextureDescriptor {
                label: Some(label),
                size: extent(size),
                mip_level_count: 1,
                sample_count: 1,
                dimension: TextureDimension::D2,
                format,
                usage: usage | TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let color = texture("color", COLOR_FORMAT, TextureUsages::COPY_SRC);
        let usage = if keep_depths { TextureUsages::COPY_SRC } else { TextureUsages::empty() };
        let depth = texture("depth", DEPTH_FORMAT, usage);
        let [r, g, b] = background
            .map(|byte| f64::from(crate::color::byte_to_linear()[usize::from(byte)]) / 65535.0);
        Self {
            size,
            color_view: color.create_view(&Default::default()),
            depth_view: depth.create_view(&Default::default()),
            color,
            depth,
            keep_depths,
            background: wgpu::Color { r, g, b, a: 0.0 },
        }
    }

    /// A few pixels to try things on.
    pub fn tiny(device: &Device) -> Self {
        Self::new(device, [8, 8], [0; 3], false)
    }

    /// Bytes of the colour and the depth of all pixels.
    pub fn bytes(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1]) * 8
    }

    /// Begins to draw on an empty picture, or over what was drawn before, whose depths were kept.
    pub fn begin<'a>(
        &self,
        encoder: &'a mut CommandEncoder,
        over: bool,
        timestamps: Option<&Timestamps>,
    ) -> RenderPass<'a> {
        let color = if over { LoadOp::Load } else { LoadOp::Clear(self.background) };
        let depth = if over { LoadOp::Load } else { LoadOp::Clear(0.0) };
        let store = if self.keep_depths { StoreOp::Store } else { StoreOp::Discard };
        encoder.begin_render_pass(&RenderPassDescriptor {
            label: Some("frame"),
            color_attachments: &[Some(RenderPassColorAttachment {
                view: &self.color_view,
                depth_slice: None,
                resolve_target: None,
                ops: Operations { load: color, store: StoreOp::Store },
            })],
            depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(Operations { load: depth, store }),
                stencil_ops: None,
            }),
            timestamp_writes: timestamps.map(Timestamps::writes),
            ..Default::default()
        })
    }

    /// Copies colours or depths to a buffer that can be read: four bytes a pixel either way.
    pub fn copy_out(&self, device: &Device, encoder: &mut CommandEncoder, layer: Layer) -> Buffer {
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some("read back"),
            size: u64::from(self.row_bytes()) * u64::from(self.size[1]),
            usage: BufferUsages::COPY_DST | BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        encoder.copy_texture_to_buffer(
            TexelCopyTextureInfo {
                texture: match layer {
                    Layer::Color => &self.color,
                    Layer::Depth => &self.depth,
                },
                mip_level: 0,
                origin: Origin3d::ZERO,
                aspect: TextureAspect::All,
            },
            TexelCopyBufferInfo {
                buffer: &buffer,
                layout: TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(self.row_bytes()),
                    rows_per_image: None,
                },
            },
            extent(self.size),
        );
        encoder.map_buffer_on_submit(&buffer, MapMode::Read, .., |_| ());
        buffer
    }

    /// The pixels of a buffer that was copied and has arrived, four bytes each; `None` where it
    /// was lost.
    pub fn pixels(&self, buffer: &Buffer) -> Option<Vec<u8>> {
        let mapped = buffer.get_mapped_range(..).ok()?;
        let row = self.size[0] as usize * 4;
        let rows = mapped.chunks_exact(self.row_bytes() as usize);
        Some(rows.flat_map(|padded| &padded[..row]).copied().collect())
    }

    /// Rows are copied to multiples of this many bytes.
    fn row_bytes(&self) -> u32 {
        (self.size[0] * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)
    }
}

fn extent([width, height]: [u32; 2]) -> Extent3d {
    Extent3d { width, height, depth_or_array_layers: 1 }
}
