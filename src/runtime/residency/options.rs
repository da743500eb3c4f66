//! What a person may set about memory and loading.

/// What a person may set about memory and loading.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ResidencyOptions {
    /// `maxMemory`: bytes that everything in memory takes at most, loads under way included.
    pub max_memory_bytes: u64,
    /// Bytes that are read before the list is looked at again, at least 1.
    pub chunk_bytes: u64,
    /// Bytes of nodes that become resident in a second; in a frame at least one node does.
    pub upload_bytes_per_s: u64,
    /// A node is evicted for another only where that one's priority is higher by this part, so
    /// that two of nearly the same do not push each other out in turn; at least 0.
    pub evict_margin: f64,
}

impl ResidencyOptions {
    /// A gigabyte, and what keeps frames even where it is the processor that draws.
    pub const DEFAULT: Self = Self {
        max_memory_bytes: 1 << 30,
        chunk_bytes: 64 << 10,
        upload_bytes_per_s: 128 << 20,
        evict_margin: 0.1,
    };
}

impl Default for ResidencyOptions {
    fn default() -> Self {
        Self::DEFAULT
    }
}
