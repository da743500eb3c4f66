//! A memory cap that is changed while frames are drawn.

use hlod::Error;
use hlod::engine::policies::POLICIES;

use super::rig::{Fault, Ground, SECOND, frames};
use super::steady::{Detail, assert_steady};
use crate::support::Random;

const FRAMES: usize = 300;

/// Caps by frame: a half, hardly more than the roots need, and room again, at random times.
fn caps(ground: &Ground, random: &mut Random) -> Vec<(usize, u64)> {
    let (all, least) = (ground.all_bytes(), ground.least_bytes());
    let mut caps = vec![(0, all)];
    let mut frame = 0;
    while frame + SECOND < FRAMES {
        frame += 1 + random.below(SECOND);
        let cap = match random.below(4) {
            0 => all,
            1 => least + (all - least) / 2,
            2 => least + (all - least) / 50,
            _ => least + random.below(2000) as u64,
        };
        caps.push((frame, cap));
    }
    caps
}

#[test]
fn a_cap_that_is_lowered_is_held_at_the_next_frame() {
    for ground in [Ground::city(), Ground::street()] {
        let mut random = Random::new(3, 0);
        for kind in POLICIES {
            let caps = caps(&ground, &mut random);
            let changed = |frame: usize| caps.iter().find(|cap| cap.0 == frame).map(|cap| cap.1);
            let fault = |frame| Fault { cap_bytes: changed(frame), ..Fault::default() };
            let pose = |frame: usize| ground.walk(2 * frame);
            let run = frames(&ground, kind.name, FRAMES, ground.all_bytes(), pose, fault);
            assert!(run.refused.is_empty(), "{:?}", run.refused);
            let mut most_bytes = 0;
            for (frame, report) in run.reports.iter().enumerate() {
                let (since, cap) = caps.iter().rfind(|cap| cap.0 <= frame).unwrap();
                let used = report.memory_bytes;
                assert!(used <= *cap, "{} {frame}: {used} of {cap} since {since}", kind.name);
                assert!(report.nodes > 0, "{} {frame}: nothing is drawn", kind.name);
                most_bytes = most_bytes.max(used);
            }
            let peak = run.peak_bytes;
            assert!((most_bytes..=ground.all_bytes()).contains(&peak), "{peak}, {most_bytes}");
        }
    }
}

/// Half, then little more than roots, then room again.
#[test]
fn detail_goes_with_the_cap_and_comes_back_with_it() {
    let ground = Ground::city();
    let still = |_| ground.walk(150);
    let all = ground.all_bytes();
    let run = |caps: [(usize, u64); 3]| {
        let changed = |frame: usize| caps.iter().find(|cap| cap.0 == frame).map(|cap| cap.1);
        let fault = |frame| Fault { cap_bytes: changed(frame), ..Fault::default() };
        frames(&ground, "gain-over-price", 600, all, still, fault)
    };
    let undisturbed = run([(0, all); 3]);
    let used = undisturbed.reports[100].memory_bytes;
    let least = ground.least_bytes();
    let run = run([(100, used / 2), (200, least + 1), (300, all)]);
    let triangles = [95..100, 150..200, 250..300].map(|range| run.triangles(range));
    assert!(triangles[0] > triangles[1] && triangles[1] > triangles[2], "{triangles:?}");
    assert!(run.reports[100].memory_bytes > used / 4, "no more leaves than has to");
    assert_steady("room again", &run, &undisturbed, 330, Detail::AtOnce);
}

#[test]
fn a_cap_below_what_the_roots_need_is_refused_and_changes_nothing() {
    let ground = Ground::street();
    let all = ground.all_bytes();
    let run = |cap_bytes: Option<u64>| {
        let fault = |frame| match frame {
            50 => Fault { cap_bytes, ..Fault::default() },
            _ => Fault::default(),
        };
        frames(&ground, "gain-over-price", 60, all, |frame| ground.walk(frame), fault)
    };
    let least = ground.least_bytes();
    let refused = run(Some(least - 1));
    assert_eq!(refused.reports, run(None).reports);
    let [Error::Usage(what)] = &refused.refused[..] else { panic!("{:?}", refused.refused) };
    assert!(what.contains(&format!("at least {least} bytes")), "{what}");
    assert!(run(Some(least)).refused.is_empty());
}
