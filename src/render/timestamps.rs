//! How long the graphics card took, by its own clock.

use wgpu::{
    Buffer, BufferDescriptor, BufferUsages, CommandEncoder, Features, MapMode, QuerySet,
    QuerySetDescriptor, QueryType, RenderPassTimestampWrites,
};

use super::device::Device;

/// What it needs of a device.
pub(super) const FEATURES: Features = Features::TIMESTAMP_QUERY;

/// Bytes of the times at which a pass began and ended.
const BYTES: u64 = 16;

/// The times at which a pass began and ended on the graphics card, where it tells.
pub(super) struct Timestamps {
    queries: QuerySet,
    resolved: Buffer,
    read_back: Buffer,
    /// Milliseconds of a tick.
    tick_ms: f64,
}

impl Timestamps {
    /// `None` where the device does not tell.
    pub fn new(device: &Device) -> Option<Self> {
        let gpu = &device.device;
        if !gpu.features().contains(FEATURES) {
            return None;
        }
        let buffer = |usage| {
            gpu.create_buffer(&BufferDescriptor {
                label: Some("timestamps"),
                size: BYTES,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: gpu.create_query_set(&QuerySetDescriptor {
                label: Some("timestamps"),
                ty: QueryType::Timestamp,
                count: 2,
            }),
            resolved: buffer(BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC),
            read_back: buffer(BufferUsages::COPY_DST | BufferUsages::MAP_READ),
            tick_ms: f64::from(device.queue.get_timestamp_period()) / 1e6,
        })
    }

    /// What a pass is to write.
    pub fn writes(&self) -> RenderPassTimestampWrites<'_> {
        RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Has the times read back once the pass is over.
    pub fn resolve(&self, encoder: &mut CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.read_back, 0, BYTES);
        encoder.map_buffer_on_submit(&self.read_back, MapMode::Read, .., |_| ());
    }

    /// Milliseconds of the pass, once the submission that resolves it was waited for; `None` where
    /// it tells none.
    pub fn ms(&self) -> Option<f64> {
        let times = self.read_back.get_mapped_range(..).ok().and_then(|mapped| {
            let (times, _) = mapped.as_chunks::<8>();
            let [begin, end] = times.try_into().ok()?;
            Some([begin, end].map(u64::from_le_bytes))
        });
        self.read_back.unmap();
        let [begin, end] = times?;
        // A pass that ends as it begins, or before it, was not timed.
        let ticks = end.checked_sub(begin).filter(|&ticks| ticks > 0)?;
        Some(ticks as f64 * self.tick_ms)
    }
}
