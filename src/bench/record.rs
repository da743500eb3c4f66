//! What is logged of a frame.

use super::Accuracy;
use crate::engine::FrameReport;

/// What is logged of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameRecord {
    /// Its number in the path.
    pub frame: u64,
    /// Seconds, as the path has them.
    pub time_s: f64,
    /// What the engine says of it.
    pub report: FrameReport,
    /// Bytes of the whole process; 0 where that is not measured.
    pub process_bytes: u64,
    /// How far the image is from that of the leaves, where that was inspected.
    pub accuracy: Option<Accuracy>,
}

impl FrameRecord {
    /// The header of `frames.csv` for a scene with this many levels, and a policy with these
    /// [diagnostics](crate::engine::Policy::diagnostics).
    pub fn header(levels: usize, diagnostics: &[&str]) -> Vec<String> {
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
            "gpu_ms",
            "modelled_ms",
            "modelled_deviation_ms",
            "toggles_up",
            "toggles_down",
            "toggles_chosen",
            "toggles_arrived",
            "toggles_evicted",
            "toggles_came_into_view",
            "finer_resident",
            "nodes",
            "triangles",
            "hidden_nodes",
            "hidden_triangles",
            "faces",
            "face_triangles",
            "far_changed",
            "visited",
            "culled",
            "memory_bytes",
            "resident",
            "read_bytes",
            "reread_bytes",
            "uploaded_bytes",
            "arrived",
            "waiting",
            "lacking",
            "evictions",
            "process_bytes",
            "loading_phase",
            "without_scene",
        ];
        let by_level = |what: &str| (0..levels).map(|l| format!("{what}_level_{l}")).collect();
        let by_level: [Vec<String>; 2] = [by_level("nodes"), by_level("triangles")];
        let fixed = fixed.into_iter().chain(Accuracy::COLUMNS).map(String::from);
        let diagnostics = diagnostics.iter().map(|&name| name.to_owned());
        fixed.chain(by_level.concat()).chain(diagnostics).collect()
    }

    /// The fields in the order of the header.
    pub fn fields(&self) -> Vec<String> {
        let report = &self.report;
        let mut fields = vec![
            self.frame.to_string(),
            self.time_s.to_string(),
            report.estimated_ms.to_string(),
            report.estimated_without_feedback_ms.to_string(),
            report.actual_ms.to_string(),
            report.frame_ms.to_string(),
            report.select_ms.to_string(),
            report.upload_ms.to_string(),
            report.draw_ms.to_string(),
            report.gpu_ms.map(|ms| ms.to_string()).unwrap_or_default(),
            report.modelled_ms.to_string(),
            report.modelled_deviation_ms.to_string(),
            report.toggles_up.to_string(),
            report.toggles_down.to_string(),
            report.toggle_causes.chosen.to_string(),
            report.toggle_causes.arrived.to_string(),
            report.toggle_causes.evicted.to_string(),
            report.toggle_causes.came_into_view.to_string(),
            u8::from(report.finer_resident).to_string(),
            report.nodes.to_string(),
            report.triangles.to_string(),
            report.hidden_nodes.to_string(),
            report.hidden_triangles.to_string(),
            report.faces.to_string(),
            report.face_triangles.to_string(),
            u8::from(report.far_changed).to_string(),
            report.visited.to_string(),
            report.culled.to_string(),
            report.memory_bytes.to_string(),
            report.resident.to_string(),
            report.read_bytes.to_string(),
            report.reread_bytes.to_string(),
            report.uploaded_bytes.to_string(),
            report.arrived.to_string(),
            report.waiting.to_string(),
            report.lacking.to_string(),
            report.evictions.to_string(),
            self.process_bytes.to_string(),
            u8::from(report.loading_phase).to_string(),
            u8::from(report.without_scene).to_string(),
        ];
        match &self.accuracy {
            Some(accuracy) => fields.extend(accuracy.fields()),
            None => fields.extend(Accuracy::COLUMNS.map(|_| String::new())),
        }
        fields.extend(report.nodes_by_level.iter().map(u32::to_string));
        fields.extend(report.triangles_by_level.iter().map(u64::to_string));
        fields.extend(report.diagnostics.iter().map(f64::to_string));
        fields
    }
}
