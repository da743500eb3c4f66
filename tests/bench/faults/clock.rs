//! Clocks that jump.

use hlod::engine::policies::POLICIES;

use super::rig::{Fault, Frames, Ground, SECOND, frames};
use super::steady::{Detail, assert_steady};

/// The frame after which the clock jumps.
const JUMP: usize = 300;

const ROOM: u64 = 1 << 30;

/// No frame makes up for more seconds than these.
const MOST_FRAME_S: f64 = 0.1;

/// Jumps between frames, and frames that are said to have taken what none takes.
fn jumps() -> Vec<(&'static str, Fault)> {
    let interval = |interval_s: f64| Fault { interval_s, ..Fault::default() };
    let said = |ms: f64| Fault { said_ms: Some(ms), ..Fault::default() };
    vec![
        ("an hour later", interval(3600.0)),
        ("a year later", interval(3.2e7)),
        ("at once", interval(0.0)),
        ("an hour before", interval(-3600.0)),
        ("never", interval(f64::INFINITY)),
        ("at no time", interval(f64::NAN)),
        ("took an hour", said(3.6e6)),
        ("took no time", said(0.0)),
        ("took a microsecond", said(1e-3)),
        ("took less than none", said(-5.0)),
        ("took for ever", said(f64::INFINITY)),
        ("took no number", said(f64::NAN)),
    ]
}

fn run(ground: &Ground, policy: &str, cap_bytes: u64, jump: Fault) -> Frames {
    let fault = |frame| if frame == JUMP { jump } else { Fault::default() };
    frames(ground, policy, JUMP + 160, cap_bytes, |frame| ground.walk(frame), fault)
}

#[test]
fn a_second_after_a_jump_all_is_as_before() {
    for ground in [Ground::city(), Ground::street()] {
        let undisturbed = run(&ground, "gain-over-price", ROOM, Fault::default());
        for (what, jump) in jumps() {
            let jumped = run(&ground, "gain-over-price", ROOM, jump);
            let what = format!("{} {what}", ground.name);
            assert_steady(&what, &jumped, &undisturbed, JUMP + 1, Detail::AtOnce);
        }
    }
}

/// The engine checks all fronts.
#[test]
fn every_policy_goes_on_after_jumps() {
    let ground = Ground::street();
    for kind in POLICIES {
        for (what, jump) in jumps() {
            let reports = run(&ground, kind.name, ROOM, jump).reports;
            let nodes = reports[JUMP + 1..].iter().map(|frame| frame.nodes).min();
            assert!(nodes > Some(0), "{} {what}", kind.name);
        }
    }
}

#[test]
fn what_was_loaded_in_an_hour_is_not_uploaded_in_a_frame() {
    let upload_bytes_per_s = 1_000_000;
    let mut ground = Ground::street();
    ground.upload_bytes_per_s = upload_bytes_per_s;
    // Slow, so that much is still to come.
    ground.constants.load_bytes_per_ms = 100.0;
    let jump = 60;
    let fault = |frame| match frame {
        _ if frame == jump => Fault { interval_s: 3600.0, ..Fault::default() },
        _ => Fault::default(),
    };
    let run = frames(&ground, "gain-over-price", 2 * jump, ROOM, |_| ground.walk(0), fault);
    let uploads: Vec<u64> = run.reports[jump..].iter().map(|frame| frame.uploaded_bytes).collect();
    let most = (upload_bytes_per_s as f64 * MOST_FRAME_S) as u64;
    assert!(uploads.iter().all(|&bytes| bytes <= most), "{uploads:?}");
    assert!(uploads[1] > most / 2 && uploads[2] > 0, "more than a frame's was there: {uploads:?}");
}

/// There is no room for all.
#[test]
fn a_jump_does_not_empty_memory() {
    let ground = Ground::street();
    let cap = ground.least_bytes() + 1_000_000;
    let hour = Fault { interval_s: 3600.0, ..Fault::default() };
    let runs = [Fault::default(), hour].map(|jump| run(&ground, "gain-over-price", cap, jump));
    let [of_other, evictions] = [0, 1].map(|at: usize| runs[at].evictions(JUMP..JUMP + 2 * SECOND));
    let resident = runs[1].reports[JUMP].resident;
    assert!(runs[1].evictions(0..JUMP) > 0, "there is room for all");
    assert!(evictions <= of_other + u64::from(resident / 20), "{evictions}, otherwise {of_other}");
}
