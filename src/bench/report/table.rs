//! The figures of a run beside those of the thesis (sections 6.1 to 6.5).

use serde_json::Value;

/// A part of the table.
pub(super) struct Group {
    pub title: &'static str,
    pub rows: Vec<Row>,
}

/// What it is, what it is here and what the thesis gives.
pub(super) struct Row(pub &'static str, pub String, pub &'static str);

/// The whole table for a summary.
pub(super) fn groups(summary: &Value) -> Vec<Group> {
    let number = |key: &str| summary.pointer(key).and_then(Value::as_f64);
    let show = |value: Option<f64>, text: &dyn Fn(f64) -> String| {
        value.filter(|value| value.is_finite()).map_or_else(|| "–".to_owned(), text)
    };
    let share = |key: &str| show(number(key), &|share| format!("{:.1} %", share * 100.0));
    let off = |key: &str| show(number(key), &|off| format!("{off:+.2} %").replace('-', "−"));
    let percent = |key: &str| show(number(key), &|part| format!("{part:.2} %"));
    let ms = |key: &str| show(number(key), &|ms| format!("{ms:.1} ms"));
    let fine = |key: &str| show(number(key), &|ms| format!("{ms:.3} ms"));
    let mib =
        |key: &str| show(number(key), &|bytes| format!("{:.1} MiB", bytes / f64::from(1 << 20)));
    let whole = |key: &str| show(number(key), &|count| format!("{count:.0}"));
    let one = |key: &str| show(number(key), &|count| format!("{count:.1}"));
    let rate = |key: &str| show(number(key), &|rate| format!("{rate:.4}"));
    let ratio = |part: &str, whole: &str| Some(number(part)? / number(whole)?);
    let as_share = |value| show(value, &|share: f64| format!("{:.1} %", share * 100.0));
    let start = as_share(ratio("/memory/start_bytes", "/memory/cap_bytes"));
    let roots = as_share(ratio("/levels/0/nodes", "/nodes_mean"));
    // Where nothing toggled there is no such number.
    let per_toggle = match number("/toggles/frames_per_toggle") {
        Some(frames) => format!("{frames:.1}"),
        None => "none toggled".into(),
    };
    // The model takes choosing as free.
    let modelled = summary.pointer("/clock").and_then(Value::as_str) == Some("model");
    let choosing = |key: &str| if modelled { "not measured".into() } else { fine(key) };

    let mut groups = vec![
        Group {
            title: "Memory (6.1)",
            rows: vec![
                Row("cap", mib("/memory/cap_bytes"), ""),
                Row("in use once the roots are loaded", start, "16 % of the cap"),
                Row("most in use", mib("/memory/peak_bytes"), ""),
                Row("its share of the cap", share("/memory/peak_share"), "about 93 %"),
                Row("read from files", mib("/loading/read_bytes"), ""),
                Row("nodes that arrived", whole("/loading/arrived"), ""),
                Row("nodes evicted", whole("/loading/evictions"), ""),
                Row("still wanted at the end", whole("/loading/waiting_last"), ""),
            ],
        },
        Group {
            title: "Detail (6.2)",
            rows: vec![
                Row("nodes a frame", one("/nodes_mean"), ""),
                Row("triangles a frame", whole("/triangles_mean"), ""),
                Row("roots among the nodes", roots, "walk 20 to 45 %, fly 80 to 90 %"),
                Row("nodes visited by selection", one("/visited_mean"), ""),
            ],
        },
        Group {
            title: "Estimated time (6.3)",
            rows: vec![
                Row("off on average", off("/estimate_error_percent/mean"), "−2.01 %"),
                Row("standard deviation", percent("/estimate_error_percent/sd"), "3.89 %"),
                Row(
                    "without feedback, on average",
                    off("/without_feedback/estimate_error_percent/mean"),
                    "+4.39 %",
                ),
                Row(
                    "without feedback, deviation",
                    percent("/without_feedback/estimate_error_percent/sd"),
                    "15.19 %",
                ),
            ],
        },
        Group {
            title: "Frame time (6.4)",
            rows: vec![
                Row("target", ms("/parameters/target_ms"), "30 ms"),
                Row("mean", ms("/frame_ms/mean"), ""),
                Row("median (p50)", ms("/frame_ms/p50"), ""),
                Row("p95", ms("/frame_ms/p95"), ""),
                Row("p99", ms("/frame_ms/p99"), ""),
                Row("longest", ms("/frame_ms/max"), ""),
                Row("frames over the target", share("/over_target_share"), "occasional, slight"),
                Row("frames over it by more than a tenth", share("/late_share"), ""),
                Row("part of the target that is used", share("/utilisation"), ""),
                Row("choosing, mean", choosing("/select_ms/mean"), ""),
                Row("choosing, longest", choosing("/select_ms/max"), ""),
            ],
        },
        Group {
            title: "Loading phase",
            rows: vec![
                Row("frames", whole("/loading_phase/frames"), ""),
                Row("frame time, mean", ms("/loading_phase/frame_ms/mean"), ""),
                Row("frames over 1.1 × target", share("/loading_phase/late_share"), ""),
                Row("frames after it", whole("/warm/frames"), ""),
                Row("frame time after it, mean", ms("/warm/frame_ms/mean"), ""),
                Row("p95", ms("/warm/frame_ms/p95"), ""),
                Row("frames over 1.1 × target", share("/warm/late_share"), ""),
                Row("frames that do not show the scene", whole("/frames_without_scene"), ""),
            ],
        },
        Group {
            title: "Toggles (6.5)",
            rows: vec![
                Row("up", whole("/toggles/up"), ""),
                Row("down", whole("/toggles/down"), ""),
                Row("a frame", rate("/toggles/per_frame"), "walk 0.008"),
                Row("frames for each", per_toggle, "walk 133, drive 11"),
                Row("a frame, in the second half", rate("/toggles/second_half/per_frame"), ""),
                Row("most frames in a row with one", whole("/toggles/longest_run"), ""),
                Row("most frames in a row without", whole("/toggles/longest_pause"), ""),
            ],
        },
    ];
    if summary.pointer("/accuracy").is_some_and(Value::is_object) {
        groups.push(Group {
            title: "Accuracy after the loading phase",
            rows: vec![
                Row("frames looked at", whole("/accuracy/warm_frames"), ""),
                Row("FLIP, mean", rate("/accuracy/flip_mean/mean"), ""),
                Row(
                    "FLIP in the loading phase, mean",
                    rate("/accuracy/loading_phase/flip_mean/mean"),
                    "",
                ),
                Row("FLIP of the worst frame", rate("/accuracy/flip_mean/max"), ""),
                Row("FLIP of 95 in a hundred pixels, mean", rate("/accuracy/flip_p95/mean"), ""),
                Row("SSIM, mean", rate("/accuracy/ssim/mean"), ""),
                Row("PSNR over all, dB", one("/accuracy/psnr_db/all"), ""),
                Row("gap pixels", whole("/accuracy/gap_pixels/sum"), ""),
                Row("in 100,000 pixels", one("/accuracy/gap_pixels/per_100000"), ""),
                Row("of them within the outline", whole("/accuracy/inner_gap_pixels/sum"), ""),
                Row("surface too much, pixels", whole("/accuracy/extra_pixels/sum"), ""),
                Row("FLIP of frames with toggles, mean", rate("/accuracy/pop_flip/mean"), ""),
            ],
        });
    }
    groups
}
