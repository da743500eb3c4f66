//! The screen that a build ends with.

use std::fmt::Write;
use std::path::Path;

use super::build_report::{BuildReport, Quantized, UpFrom};
use crate::place::placement_of;
use crate::place::{Place, Placement};

/// Warnings that are shown; the rest is in `build.json`.
const SHOWN_WARNINGS: usize = 8;

/// After a build.
pub fn built(report: &BuildReport, out: &Path) -> String {
    let rate = report.source_triangles as f64 / report.seconds.max(1e-9);
    let rate = format!(", {:.0} thousand triangles/s", rate / 1e3);
    summary(report, out, &rate)
}

/// After joining subsets, whose triangles were built before.
pub fn merged(report: &BuildReport, out: &Path) -> String {
    summary(report, out, "")
}

fn summary(report: &BuildReport, out: &Path, rate: &str) -> String {
    let mut text = String::new();
    let nodes: u64 = report.levels.iter().map(|level| level.nodes).sum();
    let shared = report.shared_textures;
    let bytes = report.levels.iter().map(|level| level.bytes).sum::<u64>() + shared.bytes;
    let texels = report.levels.iter().map(|level| level.texels).sum::<u64>() + shared.texels;
    // Writing to a string cannot fail, hence `let _`.
    let _ = writeln!(
        text,
        "{}: {} triangles in {nodes} nodes, {} levels, {:.1} MB",
        out.display(),
        report.source_triangles,
        report.levels.len(),
        bytes as f64 / 1e6
    );
    let _ = writeln!(text, "  level    nodes   triangles   Mtexels       MB");
    for level in &report.levels {
        let _ = writeln!(
            text,
            "  {:>5} {:>8} {:>11} {:>9.2} {:>8.1}",
            level.level,
            level.nodes,
            level.triangles,
            level.texels as f64 / 1e6,
            level.bytes as f64 / 1e6
        );
    }
    if shared.files > 0 {
        let _ = writeln!(
            text,
            "  {:<26} {:>9.2} {:>8.1}",
            format!("{} shared textures", shared.files),
            shared.texels as f64 / 1e6,
            shared.bytes as f64 / 1e6
        );
    }
    if report.source_texels > 0 {
        let _ = writeln!(
            text,
            "  texels: {:.2} times those that the source uses",
            texels as f64 / report.source_texels as f64
        );
    }
    let _ = writeln!(
        text,
        "  {:.2} s{rate}, peak memory {:.0} MB",
        report.seconds,
        report.peak_memory_bytes as f64 / 1e6
    );
    let _ = writeln!(text, "  {}", orientation(report));
    let stitched: u64 = report.blocks.iter().map(|block| block.stitched_edges).sum();
    if stitched > 0 {
        let _ = writeln!(
            text,
            "  {stitched} border edges touch others without shared vertices: joined on coarse levels"
        );
    }
    let left_out: usize = report.blocks.iter().map(|block| block.left_out.len()).sum();
    if left_out > 0 {
        let nodes = if left_out == 1 { "node" } else { "nodes" };
        let _ = writeln!(
            text,
            "  {left_out} coarse {nodes} left out: too little of the covered ground or of the \
             skyline was kept (left_out in build.json)"
        );
    }
    if let Some(quantized) = &report.quantized {
        let Quantized { step_metres, bound_metres, large_nodes } = quantized;
        let _ = write!(
            text,
            "  positions in steps of {step_metres} m: within {bound_metres:.2e} m of the source's"
        );
        let _ = match large_nodes {
            0 => writeln!(text),
            1 => writeln!(text, "; 1 node is too large for 16 bits"),
            _ => writeln!(text, "; {large_nodes} nodes are too large for 16 bits"),
        };
    }
    let stages: Vec<String> = report
        .stages
        .iter()
        .filter(|stage| stage.seconds >= 0.005)
        .map(|stage| format!("{} {:.2}", stage.stage, stage.seconds))
        .collect();
    if !stages.is_empty() {
        let _ = writeln!(text, "  processor seconds: {}", stages.join(", "));
    }
    for warning in report.warnings.iter().take(SHOWN_WARNINGS) {
        let _ = writeln!(text, "  warning: {} ({} times)", warning.text, warning.count);
    }
    if report.warnings.len() > SHOWN_WARNINGS {
        let more = report.warnings.len() - SHOWN_WARNINGS;
        let _ = writeln!(text, "  and {more} more warnings in build.json");
    }
    text
}

/// Which axis points at the sky, and how that is known; of the first input, whose word counts.
fn orientation(report: &BuildReport) -> String {
    let Some(input) = report.inputs.first() else { return String::new() };
    let from = match input.up_from {
        Some(UpFrom::Option) => " (--up)",
        Some(UpFrom::Format) => " (the format says so)",
        Some(UpFrom::Shape) => " (assumed from the shape; --up says otherwise)",
        Some(UpFrom::Degrees) => " (assumed of degrees; --up says otherwise)",
        None => "",
    };
    let place = match placement_of(&report.parameters) {
        Ok(Placement::Crs { epsg, height_offset }) => {
            let heights = if height_offset == 0.0 {
                "heights taken as over the ellipsoid".into()
            } else {
                format!("heights raised by {height_offset} m")
            };
            format!("; coordinates of EPSG:{epsg}, {heights}")
        }
        Ok(Placement::Origin(origin)) => metres_from(origin),
        Ok(Placement::Degrees { epsg, origin, .. }) => {
            format!("; degrees of EPSG:{epsg}, built in{}", &metres_from(origin)[1..])
        }
        _ => "; no place on the Earth (--crs, --origin)".into(),
    };
    format!("{:?} is up{from}{place}", input.up)
}

fn metres_from(Place { lon, lat, height }: Place) -> String {
    format!("; metres from {lon}° east, {lat}° north, {height} m over the ellipsoid")
}

/// After finding that nothing had changed.
pub fn up_to_date(report: &BuildReport, out: &Path) -> String {
    format!(
        "{}: up to date with {} input{}, nothing done (--force builds all the same)\n",
        out.display(),
        report.inputs.len(),
        if report.inputs.len() == 1 { "" } else { "s" }
    )
}
