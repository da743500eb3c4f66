use std::collections::HashSet;

use serde_json::json;

use super::*;
use crate::bench::{
    Accuracy, BenchOptions, ClockConstants, FrameRecord, ReferenceContext, WorstFrame, summary,
};
use crate::engine::FrameReport;
use crate::random::Random;

/// A run of made-up frames that has a little of everything.
fn frames(count: usize, levels: usize) -> Run {
    let mut random = Random::new(1, 0);
    let mut noise = move || random.unit();
    let frame = |index: usize| {
        let nodes_by_level: Vec<u32> = (0..levels).map(|_| (noise() * 90.0) as u32).collect();
        let triangles_by_level: Vec<u64> =
            nodes_by_level.iter().map(|&nodes| u64::from(nodes) * 900).collect();
        let ms = 20.0 + 12.0 * noise();
        FrameRecord {
            frame: index as u64,
            time_s: index as f64 / 30.0,
            report: FrameReport {
                estimated_ms: ms * (0.95 + 0.1 * noise()),
                estimated_without_feedback_ms: ms * (0.8 + 0.4 * noise()),
                actual_ms: ms,
                frame_ms: ms + noise(),
                diagnostics: vec![0.0025 + 0.0002 * noise()],
                toggles_up: u32::from(noise() < 0.1) * 3,
                toggles_down: u32::from(noise() < 0.1),
                nodes: nodes_by_level.iter().sum(),
                triangles: triangles_by_level.iter().sum(),
                memory_bytes: (noise() * 1e9) as u64,
                read_bytes: (noise() * 1e6) as u64,
                arrived: (noise() * 10.0) as u32,
                waiting: (noise() * 500.0) as u32,
                evictions: (noise() * 10.0) as u64,
                nodes_by_level,
                triangles_by_level,
                ..FrameReport::default()
            },
            ..FrameRecord::default()
        }
    };
    Run {
        frames: (0..count).map(frame).collect(),
        start_bytes: 160 << 20,
        peak_bytes: 1_000_000_000,
        scene_bytes: 2_000_000_000,
    }
}

fn context(levels: usize) -> Context {
    Context {
        scene_name: "city".into(),
        path_name: "walk.csv".into(),
        options: BenchOptions::default(),
        policy: "lakhia",
        diagnostics: &["v_time"],
        clock: "model",
        constants: ClockConstants::default(),
        scene_fingerprint: "5ce9e".into(),
        path_fingerprint: "9a74".into(),
        adapter: None,
        broken: Vec::new(),
        reference: None,
        levels,
    }
}

fn page(run: &Run, context: &Context) -> String {
    report_html(run, context, &summary(run, context)).unwrap()
}

fn count(page: &str, words: &str) -> usize {
    page.matches(words).count()
}

/// What holds of every page.
fn check(page: &str) {
    for words in ["NaN", "inf ", "Infinity", "http:", "https:", "<script", "url(", "@import"] {
        assert_eq!(count(page, words), 0, "{words}");
    }
    // Pictures are within the page.
    assert_eq!(count(page, "src="), count(page, "src=\"data:image/jpeg;base64,"));
    assert_eq!(count(page, "<svg"), count(page, "</svg>"));
    assert_eq!(count(page, "<figure>"), count(page, "<svg"));
    assert_eq!(count(page, "<figcaption>"), count(page, "<figure>"));
}

#[test]
fn a_page_has_each_figure_with_axes_legend_and_a_sentence() {
    let page = page(&frames(500, 4), &context(4));
    check(&page);
    for number in [
        "6.1",
        "6.2, 6.3 (a)",
        "6.2, 6.3 (b)",
        "6.4 (a)",
        "6.4 (b)",
        "6.4 (c)",
        "6.4 (d)",
        "6.5",
        "6.6",
    ] {
        assert!(page.contains(&format!("thesis figure {number}<")), "{number}");
    }
    for words in [
        "Memory in use",
        "Loads waiting",
        "Bytes read",
        "Distribution of frame time",
        "level 0 (roots)",
        "level 3",
        "time on the path, s",
        "µs a unit of cost",
        "thousand triangles",
        "city along walk.csv",
        "5ce9e",
        "policy.constants.dwell_s",
        "−2.01 %",
        "15.19 %",
        "walk 133, drive 11",
    ] {
        assert!(page.contains(words), "{words}");
    }
    // Every plot has a name at each of its axes, and every figure a legend that is not empty.
    assert_eq!(count(&page, "<ul class=\"legend\"><li>"), count(&page, "<svg"));
    assert!(count(&page, "rotate(270") >= count(&page, "<svg"));
}

#[test]
fn the_same_run_gives_the_same_page() {
    let run = frames(3000, 5);
    assert!(page(&run, &context(5)) == page(&run.clone(), &context(5)));
}

#[test]
fn frames_that_were_compared_with_the_leaves_have_figures_and_the_worst_pictures() {
    let mut run = frames(60, 2);
    for (index, frame) in run.frames.iter_mut().enumerate().step_by(10) {
        frame.accuracy = Some(Accuracy {
            flip_mean: 0.01 * index as f64,
            flip_p95: 0.1,
            squared_error: 3.0,
            ssim: Some(0.97),
            reference_triangles: 9_000,
            reference_pixels: 50_000,
            gap_pixels: 7,
            inner_gap_pixels: 1,
            extra_pixels: 9,
            pop_flip: (index == 30).then_some(0.02),
        });
    }
    let [drawn, reference, difference] = [[1u8; 9], [2; 9], [3; 9]].map(Vec::from);
    let accuracy = run.frames[50].accuracy.clone().unwrap();
    let worst =
        WorstFrame { frame: 50, loading_phase: false, accuracy, drawn, reference, difference };
    let looked = ReferenceContext { every: 10, worst: vec![worst], ..Default::default() };
    let context = Context { reference: Some(looked), ..context(2) };
    let page = page(&run, &context);
    check(&page);
    assert_eq!((count(&page, "<figure>"), count(&page, "<img")), (19, 3));
    for words in [
        "<td>gap pixels</td><td>42</td>",
        "<td>in 100,000 pixels</td><td>14.0</td>",
        "<td>FLIP, mean</td><td>0.2500</td>",
        "<td>FLIP of frames with toggles, mean</td><td>0.0200</td>",
        "Frame 50",
        "base64,AQEBAQEBAQEB",
    ] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn names_are_shown_as_they_are_and_never_become_markup() {
    let nasty = r#"<b>"R&D's"</b>"#;
    let context = Context {
        scene_name: nasty.into(),
        path_name: format!("{nasty}.csv"),
        adapter: Some(json!({ "name": nasty })),
        broken: vec![format!("{nasty}: truncated")],
        ..context(3)
    };
    let page = page(&frames(10, 3), &context);
    check(&page);
    assert_eq!(count(&page, "<b>"), 0);
    assert!(count(&page, "&lt;b&gt;&quot;R&amp;D") >= 5, "title, heading, facts, adapter, file");
    assert!(page.contains("Files that could not be used"));
}

#[test]
fn ten_thousand_frames_of_many_levels_stay_below_a_megabyte() {
    let page = page(&frames(10_000, 12), &context(12));
    check(&page);
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    assert!(page.contains("level 7 and below"));
}

#[test]
fn one_frame_and_none_and_frames_of_nothing_have_a_page_too() {
    for run in [frames(1, 1), frames(2, 1), Run::default()] {
        let page = page(&run, &context(1));
        check(&page);
        assert_eq!(count(&page, "<figure>"), 16);
    }
    let report = FrameReport {
        nodes_by_level: vec![0; 2],
        triangles_by_level: vec![0; 2],
        ..FrameReport::default()
    };
    let nothing = FrameRecord { report, ..FrameRecord::default() };
    let still = Run { frames: vec![nothing; 50], ..Run::default() };
    let page = page(&still, &context(2));
    check(&page);
    assert!(page.contains("<td>frames for each</td><td>none toggled</td>"), "no toggles");
}

#[test]
fn frames_that_are_no_numbers_do_not_reach_the_page() {
    let mut run = frames(100, 2);
    run.frames[3].report.frame_ms = f64::NAN;
    run.frames[4].report.estimated_ms = 0.0;
    run.frames[5].report.actual_ms = f64::INFINITY;
    run.frames[6].report.diagnostics = vec![f64::NAN];
    check(&page(&run, &context(2)));
}

#[test]
fn levels_have_colours_of_their_own() {
    for count in 1..=8 {
        let colours: HashSet<_> = plot::steps(count).into_iter().map(|c| (c.0, c.1, c.2)).collect();
        assert_eq!(colours.len(), count);
    }
}
