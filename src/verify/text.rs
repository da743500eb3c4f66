//! The report for people: on one or two screens, ending in pass or fail.

use std::fmt::Write;

use super::report::{Check, Distance, VerifyReport};
use crate::tileset::FirstView;

/// The report as text.
pub fn text(report: &VerifyReport) -> String {
    let mut out = String::new();
    let mut line = |text: String| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{text}");
    };
    if let Some(scene) = &report.scene {
        line(format!(
            "{}: {} nodes on {} levels, {} triangles in {} leaves; diagonal {:.1} m, lattice {:.1e} m",
            report.out,
            scene.nodes,
            scene.levels,
            scene.leaf_triangles,
            scene.leaves,
            scene.diagonal,
            scene.step
        ));
    }
    match &report.source[..] {
        [] => line("Against its own leaves, which stand for the source: name it with --source to check the leaves".into()),
        [one] => line(format!("Against {one}")),
        [first, others @ ..] => line(format!("Against {first} and {} more", others.len())),
    }
    for other in &report.other_sources {
        line(format!("{other} is not the file that the scene was built from (build.json)"));
    }
    if !report.levels.is_empty() {
        line(format!(
            "\nDistance of each level, with the leaves above it, to the source, two-sided, in metres and in 1e-4 of the diagonal; \
             ground covered and skylines kept; colour RMS of 255, and surface of another colour\n\
             {:>5} {:>7} {:>7} {:>10} {:>9} {:>7} {:>9} {:>7} {:>9} {:>7} {:>7} {:>7} {:>7} {:>7} {:>12}",
            "level",
            "nodes",
            "leaves",
            "triangles",
            "mean m",
            "e-4",
            "RMS m",
            "e-4",
            "max m",
            "e-4",
            "area %",
            "skyl. %",
            "colour",
            "other %",
            "wrong tiles"
        ));
        let levels = report.levels.iter().map(|figures| (figures.level.to_string(), figures));
        for (name, level) in levels.chain(report.front.iter().map(|front| ("front".into(), front)))
        {
            let Distance { mean, rms, max, mean_relative, rms_relative, max_relative, .. } =
                level.two_sided;
            let color = level.color_rms.map_or("-".into(), |rms| format!("{rms:.2}"));
            let tiles = level.tiles.map_or("-".into(), |tiles| match tiles.wrong_share() {
                Some(share) if tiles.clear * 20 >= tiles.samples => {
                    format!("{:.2} %", share * 100.0)
                }
                _ => "too coarse".into(),
            });
            line(format!(
                "{:>5} {:>7} {:>7} {:>10} {:>9.4} {:>7.3} {:>9.4} {:>7.3} {:>9.4} {:>7.2} {:>7} {:>7} {:>7} {:>7} {:>12}",
                name,
                level.nodes,
                level.leaves_above,
                level.triangles,
                mean,
                mean_relative,
                rms,
                rms_relative,
                max,
                max_relative,
                percent(level.kept.area),
                percent(level.kept.skyline),
                color,
                percent(level.other_color_share),
                tiles
            ));
        }
    }
    let kept: Vec<String> = report
        .levels
        .iter()
        .filter_map(|level| level.cut_outs_kept)
        .map(|kept| percent(Some(kept)))
        .collect();
    if !kept.is_empty() {
        line(format!(
            "\nVisible area of cut-outs, as of trees, in % of that of the leaves, by level: {}",
            kept.join(", ")
        ));
    }
    if let Some(FirstView { requests, bytes, tiles, draws }) = report.first_view {
        line(format!(
            "\nFirst view of the whole, 1,080 rows, 16 pixels: {requests} requests, {:.1} MB, {tiles} tiles, \
             {draws} draw calls",
            bytes as f64 / 1e6
        ));
    }
    if !report.worst_nodes.is_empty() {
        line(format!(
            "\nWorst nodes\n{:>5} {:>10} {:>10} {:>10} {:>10}  at, file",
            "level", "stored m", "measured m", "to front", "to source"
        ));
        for node in &report.worst_nodes {
            let [x, y, z] = node.farthest;
            line(format!(
                "{:>5} {:>10.4} {:>10.4} {:>10.4} {:>10.4}  {x:.2} {y:.2} {z:.2}, {}",
                node.level,
                node.geometric_error,
                node.measured,
                node.to_front.max,
                node.to_source.max,
                node.file
            ));
        }
    }
    if !report.gaps.is_empty() {
        line(format!(
            "\nWidest gaps where two levels meet at a cut\n{:>7} {:>10} {:>16} {:>12} {:>14}",
            "levels", "points", "without skirts m", "of the error", "left open m"
        ));
        for gap in &report.gaps {
            line(format!(
                "{:>3} | {:<1} {:>10} {:>16.4} {:>12.2} {:>14.2e}",
                gap.a, gap.b, gap.points, gap.bare, gap.bare_relative, gap.open
            ));
        }
    }
    line(String::new());
    for check in &report.checks {
        line(format!("{}  {}: {}", verdict(check), check.name, check.summary));
        failures(check, &mut line);
    }
    line(format!("\n{}", if report.passed { "PASS" } else { "FAIL" }));
    out
}

fn failures(check: &Check, line: &mut impl FnMut(String)) {
    for failure in &check.failures {
        line(format!("        {}: {}", failure.place, failure.what));
    }
    let more = check.failure_count - check.failures.len() as u64;
    if more > 0 {
        line(format!("        … and {more} more"));
    }
    for warning in &check.warnings {
        line(format!("        warning: {}: {}", warning.place, warning.what));
    }
    let noted = check.failures.iter().chain(&check.warnings);
    let mut hints: Vec<&str> = noted.map(|failure| failure.hint).collect();
    hints.dedup();
    for hint in hints {
        line(format!("        try: {hint}"));
    }
}

fn verdict(check: &Check) -> &'static str {
    match (check.passed, check.warnings.is_empty()) {
        (true, true) => "pass",
        (true, false) => "warn",
        (false, _) => "FAIL",
    }
}

/// A share in percent, as tables have it.
fn percent(share: Option<f64>) -> String {
    share.map_or("-".into(), |share| format!("{:.1}", share * 100.0))
}
