//! Drawing nodes offscreen.
//!
//! [`content`] turns a node's file into what is held of it in memory, and says how much that is;
//! it needs no graphics card. The rest draws such content through wgpu (feature `render`):
//! [`Renderer`] holds what it was given and draws the nodes that it is told to, no more and no
//! others. Which those are, when they are loaded and what they may cost is not decided here.

pub mod content;

#[cfg(feature = "render")]
mod adapter;
#[cfg(feature = "render")]
mod camera;
#[cfg(feature = "render")]
mod device;
#[cfg(feature = "render")]
mod gpu_node;
#[cfg(feature = "render")]
mod gpu_picture;
#[cfg(feature = "render")]
mod instance;
#[cfg(feature = "render")]
mod options;
#[cfg(feature = "render")]
mod pipelines;
#[cfg(feature = "render")]
mod renderer;
#[cfg(feature = "render")]
mod samplers;
#[cfg(feature = "render")]
mod target;
#[cfg(feature = "render")]
mod thread_affinity;
#[cfg(feature = "render")]
mod timestamps;
#[cfg(feature = "render")]
mod warm_up;

#[cfg(feature = "render")]
pub use adapter::{AdapterLabel, adapters};
#[cfg(feature = "render")]
pub use instance::level_tint;
#[cfg(feature = "render")]
pub use options::{RenderOptions, Shading, Side};
#[cfg(feature = "render")]
pub use renderer::{DrawTimes, Renderer};
