//! What a frame was and took.

use super::ToggleCauses;

/// What a frame was and took.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameReport {
    /// Milliseconds that drawing was expected to take.
    pub estimated_ms: f64,
    /// The same without feedback from earlier frames.
    pub estimated_without_feedback_ms: f64,
    /// Milliseconds that choosing and drawing took, which is what was estimated.
    pub actual_ms: f64,
    /// Milliseconds of the whole frame: the same with what arrived from the loader.
    pub frame_ms: f64,
    /// Milliseconds to choose what is drawn.
    pub select_ms: f64,
    /// Milliseconds to upload what was loaded and to free what left.
    pub upload_ms: f64,
    /// Milliseconds to draw.
    pub draw_ms: f64,
    /// Milliseconds of this that the graphics card took by its own clock, where it has one.
    pub gpu_ms: Option<f64>,
    /// Milliseconds that the whole frame was expected to take by the engine's cost model.
    pub modelled_ms: f64,
    /// Standard deviation of that.
    pub modelled_deviation_ms: f64,
    /// The frame belongs to the loading phase: no frame yet, from the first drawn on, needed nothing
    /// that was not in memory. The phase ends after two seconds at the latest.
    pub loading_phase: bool,
    /// The view does not show the scene: [`SceneTree::is_in_view`](crate::runtime::SceneTree::is_in_view).
    pub without_scene: bool,
    /// What the policy says of itself, by [`Policy::diagnostics`](super::Policy::diagnostics).
    pub diagnostics: Vec<f64>,
    /// Nodes that gave way to their children.
    pub toggles_up: u32,
    /// Nodes that replaced their children.
    pub toggles_down: u32,
    /// The same toggles, by what brought them about.
    pub toggle_causes: ToggleCauses,
    /// A node that was drawn could have been refined: all of its children in view are in memory.
    pub finer_resident: bool,
    /// Nodes drawn.
    pub nodes: u32,
    /// Triangles drawn.
    pub triangles: u64,
    /// Nodes of the front that were not drawn, since what was drawn hides them.
    pub hidden_nodes: u32,
    /// Triangles of these.
    pub hidden_triangles: u64,
    /// Faces of cells drawn, in the place of nodes outside of a cull box.
    pub faces: u32,
    /// Triangles of these.
    pub face_triangles: u64,
    /// Whether what is far is drawn from another cell than in the frame before, or from one for the first
    /// time, or no more.
    pub far_changed: bool,
    /// Nodes visited by selection.
    pub visited: u32,
    /// Of these, nodes outside of the view.
    pub culled: u32,
    /// Bytes in use, loads under way included, at their most in this frame.
    pub memory_bytes: u64,
    /// Nodes in memory.
    pub resident: u32,
    /// Bytes read from files during the frame.
    pub read_bytes: u64,
    /// Of these, bytes of nodes that had been in memory before and were evicted.
    pub reread_bytes: u64,
    /// Bytes that were uploaded before it.
    pub uploaded_bytes: u64,
    /// Nodes that became resident before it.
    pub arrived: u32,
    /// Nodes that are asked for and not in memory.
    pub waiting: u32,
    /// Nodes that would have been drawn, in place of coarser ones, had they been in memory.
    pub lacking: u32,
    /// Nodes evicted during the frame.
    pub evictions: u64,
    /// Nodes drawn, by level.
    pub nodes_by_level: Vec<u32>,
    /// Triangles drawn, by level.
    pub triangles_by_level: Vec<u64>,
}

impl FrameReport {
    /// Toggles in both directions.
    pub fn toggles(&self) -> u32 {
        self.toggles_up + self.toggles_down
    }
}
