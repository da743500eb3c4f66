//! What is logged of a frame.

use super::Accuracy;

/// What is logged of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameRecord {
    /// Its number in the path.
    pub frame: u64,
    /// Seconds, as the path has them.
    pub time_s: f64,
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
    /// Milliseconds to take over what was loaded and let go of what left.
    pub upload_ms: f64,
    /// Milliseconds to draw.
    pub draw_ms: f64,
    /// `v_time`, milliseconds for a unit of cost.
    pub v_time: f64,
    /// `shareTime` of the roots, milliseconds.
    pub share_ms: f64,
    /// The part of the picture that the nodes were expected to cover, 0 to 1.
    pub covered: f64,
    /// Nodes that gave way to their children.
    pub toggles_up: u32,
    /// Nodes that replaced their children.
    pub toggles_down: u32,
    /// Nodes drawn.
    pub nodes: u32,
    /// Triangles drawn.
    pub triangles: u64,
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
    /// Nodes that became resident before it.
    pub arrived: u32,
    /// Nodes that are wanted and not in memory.
    pub waiting: u32,
    /// Nodes evicted during the frame.
    pub evictions: u64,
    /// Bytes of the whole process; 0 where that is not measured.
    pub process_bytes: u64,
    /// Nodes drawn, by level.
    pub nodes_by_level: Vec<u32>,
    /// Triangles drawn, by level.
    pub triangles_by_level: Vec<u64>,
    /// How far the picture is from that of the leaves, where that was looked at.
    pub accuracy: Option<Accuracy>,
}

impl FrameRecord {
    /// Toggles in both directions.
    pub fn toggles(&self) -> u32 {
        self.toggles_up + self.toggles_down
    }

    /// The header of `frames.csv` for a scene with this many levels.
    pub fn header(levels: usize) -> Vec<String> {
        let fixed = [
            "frame",
            "time_s",
            "estimated_ms",
            "estimated_without_feedback_ms",
            "actual_ms",
            "frame_ms",
            "select_ms",
            "upload_ms",
            "draw_ms",
            "v_time",
            "share_ms",
            "covered",
            "toggles_up",
            "toggles_down",
            "nodes",
            "triangles",
            "visited",
            "culled",
            "memory_bytes",
            "resident",
            "read_bytes",
            "arrived",
            "waiting",
            "evictions",
            "process_bytes",
        ];
        let by_level = |what: &str| (0..levels).map(|l| format!("{what}_level_{l}")).collect();
        let by_level: [Vec<String>; 2] = [by_level("nodes"), by_level("triangles")];
        let fixed = fixed.into_iter().chain(Accuracy::COLUMNS).map(String::from);
        fixed.chain(by_level.concat()).collect()
    }

    /// The fields in the order of the header.
    pub fn fields(&self) -> Vec<String> {
        let mut fields = vec![
            self.frame.to_string(),
            self.time_s.to_string(),
            self.estimated_ms.to_string(),
            self.estimated_without_feedback_ms.to_string(),
            self.actual_ms.to_string(),
            self.frame_ms.to_string(),
            self.select_ms.to_string(),
            self.upload_ms.to_string(),
            self.draw_ms.to_string(),
            self.v_time.to_string(),
            self.share_ms.to_string(),
            self.covered.to_string(),
            self.toggles_up.to_string(),
            self.toggles_down.to_string(),
            self.nodes.to_string(),
            self.triangles.to_string(),
            self.visited.to_string(),
            self.culled.to_string(),
            self.memory_bytes.to_string(),
            self.resident.to_string(),
            self.read_bytes.to_string(),
            self.arrived.to_string(),
            self.waiting.to_string(),
            self.evictions.to_string(),
            self.process_bytes.to_string(),
        ];
        match &self.accuracy {
            Some(accuracy) => fields.extend(accuracy.fields()),
            None => fields.extend(Accuracy::COLUMNS.map(|_| String::new())),
        }
        fields.extend(self.nodes_by_level.iter().map(u32::to_string));
        fields.extend(self.triangles_by_level.iter().map(u64::to_string));
        fields
    }
}
