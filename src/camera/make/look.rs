//! Where to look on the way: as near as can be to where one would like to, so that pictures show
//! enough of the model, turning slowly.

use rayon::prelude::*;

use super::ground::Ground;
use super::panorama::Picture;
use super::{Eye, smooth, travel};

/// The part of a picture with the model that is aimed at.
pub(super) const ENOUGH: f64 = 0.5;
/// Turns begin and end slowly, so that they are faster between.
const CALM: f64 = 0.75;
/// Degrees aside of where one would like to look, in steps all around.
const ASIDE_DEG: f64 = 10.0;
const ASIDE: usize = (360.0 / ASIDE_DEG) as usize;
/// Degrees further down, in steps, and how many of these lead up.
const DOWN_DEG: f64 = 10.0;
const DOWN: usize = 9;
const UP: usize = 3;
/// Nobody looks further up or down than this, unless it is what one would like.
const STEEPEST_DEG: f64 = 85.0;
/// What a picture without any of the model costs; what half of that lacks costs a quarter.
const LACK: f64 = 400.0;
/// What looking 60 degrees aside costs, or 30 down.
const OFF: f64 = 1.0;
/// What a step aside or down costs.
const MOVE: f64 = 0.1;
/// What turning by a degree more than is allowed costs.
const HASTE: f64 = 4.0;
/// Steps aside and down from one decision to the next, at most.
const STEPS: [isize; 2] = [4, 1];
/// Places that are decided together, and how many after them are looked at for it.
const DECIDED: usize = 60;
const AHEAD: usize = 30;

/// How an eye looks for the model.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// Frames from one decision to the next, at least 1.
    pub(super) stride: usize,
    /// Degrees to which one may turn in that time.
    pub(super) most_deg: f64,
    /// The first and the last frame look where they would like to.
    pub(super) keeps_ends: bool,
}

/// A direction: steps to the left, and down from the highest.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Turned {
    aside: usize,
    down: usize,
}

impl Search {
    /// Decides three times a second, and turns by at most so many degrees a second.
    pub(super) fn calm(fps: f64, most_deg_s: f64) -> Self {
        let stride = (fps / 3.0).round().max(1.0);
        let most_deg = most_deg_s * travel::YAW_PART * stride / fps * CALM;
        Self { stride: stride as usize, most_deg, keeps_ends: false }
    }

    /// The same for who flies.
    pub(super) fn flight(fps: f64) -> Self {
        Self::calm(fps, travel::MAX_DRIVING_TURN_DEG_S)
    }

    /// Frames that must be given for the first `frames` to be the same however many follow.
    pub(super) fn frames(&self, frames: usize) -> usize {
        (frames.div_ceil(self.stride * DECIDED) * DECIDED + AHEAD) * self.stride + 1
    }

    /// The same places, with the model in view.
    pub(super) fn look(&self, ground: &Ground, wished: &[Eye]) -> Vec<Eye> {
        let last = wished.len().saturating_sub(1).div_ceil(self.stride);
        let at = |decision: usize| (decision * self.stride).min(wished.len() - 1);
        if wished.is_empty() {
            return Vec::new();
        }
        let prices: Vec<_> = (0..=last)
            .into_par_iter()
            .map(|decision| {
                let is_end = decision == 0 || decision == last;
                self.prices(ground, &wished[at(decision)], self.keeps_ends && is_end)
            })
            .collect();
        let yaws: Vec<f64> = (0..=last).map(|decision| wished[at(decision)].yaw_deg).collect();
        let turned = self.decide(&prices, &yaws);
        // Steps aside without a jump at half a turn.
        let mut aside = vec![signed(turned[0].aside)];
        for pair in turned.windows(2) {
            let step = signed((pair[1].aside + ASIDE - pair[0].aside) % ASIDE);
            aside.push(aside[aside.len() - 1] + step);
        }
        let eye = |(frame, eye): (usize, &Eye)| {
            let (from, to) = (frame / self.stride, (frame / self.stride + 1).min(last));
            let part = smooth((frame - at(from)) as f64 / (at(to) - at(from)).max(1) as f64);
            let between = |from: f64, to: f64| from + (to - from) * part;
            let yaw_deg = eye.yaw_deg + between(aside[from], aside[to]) * ASIDE_DEG;
            let down = between(turned[from].down(), turned[to].down()) * DOWN_DEG;
            Eye { yaw_deg, pitch_deg: lowered(eye.pitch_deg, down), ..*eye }
        };
        wished.iter().enumerate().map(eye).collect()
    }

    /// What each direction from a place costs.
    fn prices(&self, ground: &Ground, wished: &Eye, is_kept: bool) -> Vec<f64> {
        if is_kept {
            let mut prices = vec![f64::INFINITY; ASIDE * DOWN];
            prices[index(Turned { aside: 0, down: UP })] = 0.0;
            return prices;
        }
        let panorama = ground.panorama(wished.place);
        let pitch = |down| lowered(wished.pitch_deg, Turned { aside: 0, down }.down() * DOWN_DEG);
        let pictures: Vec<Picture> = (0..DOWN).map(|down| Picture::new(pitch(down))).collect();
        let price = |index: usize| {
            let turned = turned(index);
            let off = signed(turned.aside) * ASIDE_DEG;
            let part = panorama.part(&pictures[turned.down], wished.yaw_deg + off);
            let (aside, down) = (off / 60.0, turned.down() * DOWN_DEG / 30.0);
            let lack = (1.0 - part / ENOUGH).max(0.0);
            LACK * lack * lack + OFF * (aside * aside + down * down)
        };
        (0..ASIDE * DOWN).map(price).collect()
    }

    /// The cheapest way through all decisions, some at a time (dynamic programming).
    fn decide(&self, prices: &[Vec<f64>], yaws: &[f64]) -> Vec<Turned> {
        let mut chosen: Vec<Turned> = Vec::new();
        while chosen.len() < prices.len() {
            // Begins with what was decided last.
            let begin = chosen.len().saturating_sub(1);
            let end = (begin + DECIDED + AHEAD + 1).min(prices.len());
            let mut least = prices[begin].clone();
            if let Some(last) = chosen.last() {
                least.fill(f64::INFINITY);
                least[index(*last)] = 0.0;
            }
            let mut from = Vec::new();
            for (prices, yaws) in prices[begin + 1..end].iter().zip(yaws[begin..end].windows(2)) {
                let turned = travel::turn(yaws[0], yaws[1]);
                let ways = (0..least.len()).map(|to| self.cheapest(&least, to, turned));
                let (costs, before): (Vec<f64>, Vec<usize>) = ways.unzip();
                least = costs.iter().zip(prices).map(|(cost, price)| cost + price).collect();
                from.push(before);
            }
            let mut at = first_least(&least);
            let mut way = vec![at];
            for before in from.iter().rev() {
                at = before[at];
                way.push(at);
            }
            way.reverse();
            let skipped = usize::from(!chosen.is_empty());
            let count = if end == prices.len() { way.len() } else { DECIDED + 1 };
            chosen.extend(way[skipped..count].iter().map(|&index| turned(index)));
        }
        chosen
    }

    /// The cheapest way to a direction from those before: its cost, and from which. What one would
    /// like to look at turns by so many degrees meanwhile.
    fn cheapest(&self, least: &[f64], to: usize, turned_deg: f64) -> (f64, usize) {
        let Turned { aside, down } = turned(to);
        let mut best = (f64::INFINITY, to);
        for left in -STEPS[0]..=STEPS[0] {
            let aside = (aside as isize - left).rem_euclid(ASIDE as isize) as usize;
            let haste = ((turned_deg + left as f64 * ASIDE_DEG).abs() - self.most_deg).max(0.0);
            for lower in -STEPS[1]..=STEPS[1] {
                let down = down.checked_add_signed(lower).filter(|&down| down < DOWN);
                let Some(down) = down else { continue };
                let before = index(Turned { aside, down });
                let moved = (left.unsigned_abs() + lower.unsigned_abs()) as f64;
                let cost = least[before] + MOVE * moved + HASTE * haste;
                if cost < best.0 {
                    best = (cost, before);
                }
            }
        }
        best
    }
}

impl Turned {
    /// Steps down, negative up.
    fn down(self) -> f64 {
        self.down as f64 - UP as f64
    }
}

fn index(turned: Turned) -> usize {
    turned.aside * DOWN + turned.down
}

fn turned(index: usize) -> Turned {
    Turned { aside: index / DOWN, down: index % DOWN }
}

/// Steps to the left, negative to the right.
fn signed(aside: usize) -> f64 {
    if aside > ASIDE / 2 { aside as f64 - ASIDE as f64 } else { aside as f64 }
}

fn lowered(pitch_deg: f64, down_deg: f64) -> f64 {
    let steepest = STEEPEST_DEG.max(pitch_deg.abs());
    (pitch_deg - down_deg).clamp(-steepest, steepest)
}

fn first_least(costs: &[f64]) -> usize {
    (0..costs.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0)
}
