//! What frames take, learned while they are drawn.
//!
//! The time of a frame is a sum of what it draws and uploads, each at a price that is not negative.
//! Prices are fitted by least squares of relative errors over the frames drawn, older ones counting
//! less, and towards what was expected at first as far as frames say nothing. What prices do not
//! explain changes slowly, since views do: how much longer than their sum the last frames took is a
//! factor of the next. Where the graphics card has a clock of its own, what it takes and what the
//! processor takes beside it are fitted apart.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::host_time::HostTime;
use super::least_squares::{LeastSquares, dot};

/// Number of terms.
const TERMS: usize = 8;

/// Seconds after which a frame counts half.
const HALF_LIFE_S: f64 = 10.0;

/// Seconds after which what prices did not explain of a frame counts half. Measured on lavapipe over walks
/// and still cameras: from 0.5 to 0.05 s, deviations differ by a twentieth, and all are a quarter to a
/// third less than without; slower is steadier.
const DRIFT_HALF_LIFE_S: f64 = 0.2;

/// A single frame counts as at most this many times longer or shorter than the ones before, against what
/// was expected: a stall says nothing of the next frame.
const MOST_DRIFT: f64 = 1.6;

/// No frame takes less; what is said to is a clock's fault.
const LEAST_MS: f64 = 1e-6;

/// A frame later than this after the one before forgets no more.
const LONGEST_S: f64 = 1.0;

/// How many frames of an ordinary load the prices at the start are worth.
const PRIOR_FRAMES: f64 = 0.2;

/// What a frame draws and uploads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Load {
    /// Draw calls.
    pub draws: f64,
    /// Vertices.
    pub vertices: f64,
    /// Triangles.
    pub triangles: f64,
    /// Fragments that are shaded without a texture.
    pub plain_fragments: f64,
    /// Fragments that are shaded with a texture.
    pub textured_fragments: f64,
    /// Fragments behind others.
    pub hidden_fragments: f64,
    /// Bytes uploaded.
    pub uploaded_bytes: f64,
}

impl AddAssign for Load {
    fn add_assign(&mut self, more: Self) {
        self.draws += more.draws;
        self.vertices += more.vertices;
        self.triangles += more.triangles;
        self.plain_fragments += more.plain_fragments;
        self.textured_fragments += more.textured_fragments;
        self.hidden_fragments += more.hidden_fragments;
        self.uploaded_bytes += more.uploaded_bytes;
    }
}

/// The terms of what the processor takes: the frame, draw calls, bytes uploaded.
const HOST_TERMS: [usize; 3] = [0, 1, UPLOADED];

/// Uploads are waited for by the processor.
const UPLOADED: usize = 7;

/// An ordinary load, by which terms are made comparable.
const ORDINARY: [f64; TERMS] = [1.0, 100.0, 1e5, 1e5, 1e6, 1e6, 1e6, 1e6];

impl Load {
    /// The terms of the sum in ordinary loads; the first is what every frame has.
    fn terms(&self) -> [f64; TERMS] {
        let terms = [
            1.0,
            self.draws,
            self.vertices,
            self.triangles,
            self.plain_fragments,
            self.textured_fragments,
            self.hidden_fragments,
            self.uploaded_bytes,
        ];
        std::array::from_fn(|at| if terms[at] > 0.0 { terms[at] / ORDINARY[at] } else { 0.0 })
    }
}

/// What things take, milliseconds each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prices {
    /// A frame in which nothing is drawn.
    pub frame: f64,
    /// A draw call.
    pub draw: f64,
    /// A vertex.
    pub vertex: f64,
    /// A triangle.
    pub triangle: f64,
    /// A fragment without a texture.
    pub plain_fragment: f64,
    /// A fragment with a texture.
    pub textured_fragment: f64,
    /// A fragment behind others.
    pub hidden_fragment: f64,
    /// A byte that is uploaded.
    pub uploaded_byte: f64,
}

impl Prices {
    fn ordinary(&self) -> [f64; TERMS] {
        let prices = [
            self.frame,
            self.draw,
            self.vertex,
            self.triangle,
            self.plain_fragment,
            self.textured_fragment,
            self.hidden_fragment,
            self.uploaded_byte,
        ];
        std::array::from_fn(|at| prices[at] * ORDINARY[at])
    }

    fn from_ordinary(prices: [f64; TERMS]) -> Self {
        let [
            frame,
            draw,
            vertex,
            triangle,
            plain_fragment,
            textured_fragment,
            hidden_fragment,
            uploaded_byte,
        ] = std::array::from_fn(|at| prices[at] / ORDINARY[at]);
        Self {
            frame,
            draw,
            vertex,
            triangle,
            plain_fragment,
            textured_fragment,
            hidden_fragment,
            uploaded_byte,
        }
    }
}

/// What a frame should take, milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// On average.
    pub mean_ms: f64,
    /// Standard deviation.
    pub deviation_ms: f64,
}

/// Learns prices from frames.
#[derive(Clone, Debug, PartialEq)]
pub struct CostModel {
    /// In ordinary loads, as are the next; of the graphics card alone once its time is known.
    prices: [f64; TERMS],
    expected: [f64; TERMS],
    prior: f64,
    frames: LeastSquares<TERMS>,
    /// Once the time of the graphics card is known.
    host: Option<HostTime>,
    /// What the last frames took over the sum of their prices. A mean of these, not of their logarithms:
    /// where noise is 15 %, estimates would be low by 1 %.
    drift: f64,
    /// Sums over frames of 1, of relative errors, and of their squares.
    errors: [f64; 3],
}

impl CostModel {
    /// Expects these prices until frames tell otherwise.
    pub fn new(expected: &Prices) -> Self {
        let expected = expected.ordinary();
        let whole: f64 = expected.iter().sum();
        // As frames weigh in which each term is ordinary.
        let prior = if whole > 0.0 { PRIOR_FRAMES / (whole * whole) } else { PRIOR_FRAMES };
        let frames = LeastSquares::new(expected, prior);
        Self { prices: expected, expected, prior, frames, host: None, drift: 1.0, errors: [0.0; 3] }
    }

    /// What things take, as far as is known.
    pub fn prices(&self) -> Prices {
        Prices::from_ordinary(self.sums())
    }

    /// What card and processor take together.
    fn sums(&self) -> [f64; TERMS] {
        let mut sums = self.prices;
        for (price, term) in self.host.iter().flat_map(|host| host.prices()).zip(HOST_TERMS) {
            sums[term] += price;
        }
        sums
    }

    /// What the next frame should take.
    pub fn estimate(&self, load: &Load) -> Estimate {
        let mean_ms = self.priced_ms(load) * self.drift;
        Estimate { mean_ms, deviation_ms: self.relative_deviation() * mean_ms }
    }

    /// The same without what was learned from frames, milliseconds.
    pub fn expected_ms(&self, load: &Load) -> f64 {
        dot(&self.expected, &load.terms())
    }

    /// The sum of what a load takes, milliseconds, whatever the last frames took beside it: what
    /// choices are made by, since the same load is then the same from one frame to the next. By
    /// [`estimate`](Self::estimate), which follows each frame's noise a little, levels toggle two to four
    /// times as often.
    #[inline]
    pub fn priced_ms(&self, load: &Load) -> f64 {
        dot(&self.sums(), &load.terms())
    }

    /// Milliseconds of that which a load adds to a frame that is drawn anyway.
    #[inline]
    pub fn added_ms(&self, load: &Load) -> f64 {
        self.priced_ms(load) - self.sums()[0]
    }

    /// The same of so many draw calls, vertices and triangles more than there are, or fewer.
    #[inline]
    pub fn geometry_ms(&self, draws: f64, vertices: f64, triangles: f64) -> f64 {
        let [_, draw, vertex, triangle, ..] = self.sums();
        let [_, draws_per, vertices_per, triangles_per, ..] = ORDINARY;
        draw * (draws / draws_per)
            + vertex * (vertices / vertices_per)
            + triangle * (triangles / triangles_per)
    }

    /// Mean of (estimated − actual) / actual over the frames of late.
    pub fn relative_bias(&self) -> f64 {
        let [frames, sum, _] = self.errors;
        if frames > 0.0 { sum / frames } else { 0.0 }
    }

    /// Root of the mean square of the same.
    pub fn relative_deviation(&self) -> f64 {
        let [frames, _, squares] = self.errors;
        if frames > 0.0 { (squares / frames).sqrt() } else { 0.0 }
    }

    /// A frame took `actual_ms`, `dt_s` seconds after the one before; `gpu_ms` of this on the graphics
    /// card, where that is known. What is no number or took no time is passed over.
    pub fn observe(&mut self, load: &Load, actual_ms: f64, gpu_ms: Option<f64>, dt_s: f64) {
        let terms = load.terms();
        let is_sound =
            actual_ms > LEAST_MS && terms.iter().chain([&actual_ms]).all(|x| x.is_finite());
        if !is_sound {
            return;
        }
        // After a pause there is nothing newer than what is known.
        let dt_s = if dt_s.is_nan() { LONGEST_S } else { dt_s.clamp(0.0, LONGEST_S) };
        let kept = libm::exp2(-dt_s / HALF_LIFE_S);
        let expected_ms = self.estimate(load).mean_ms;
        let error = expected_ms / actual_ms - 1.0;
        let [frames, sum, squares] = self.errors.map(|sum| sum * kept);
        self.errors = [frames + 1.0, sum + error, squares + error * error];
        // Relative errors count: a frame of 100 ms must not outweigh a hundred of 10, nor one that
        // a clock says took no time all others.
        let relative_to = actual_ms.max(expected_ms / MOST_DRIFT);
        let weight = 1.0 / (relative_to * relative_to);
        self.learn(terms, actual_ms, gpu_ms, weight, kept);
        let unexplained = actual_ms / dot(&self.sums(), &terms).max(LEAST_MS);
        let unexplained = unexplained.clamp(self.drift / MOST_DRIFT, self.drift * MOST_DRIFT);
        self.drift += (1.0 - libm::exp2(-dt_s / DRIFT_HALF_LIFE_S)) * (unexplained - self.drift);
    }

    fn learn(
        &mut self,
        mut terms: [f64; TERMS],
        actual_ms: f64,
        gpu_ms: Option<f64>,
        weight: f64,
        kept: f64,
    ) {
        let of_host = HOST_TERMS.map(|term| terms[term]);
        let known_ms = gpu_ms.filter(|&ms| ms > 0.0 && ms < actual_ms);
        if known_ms.is_some() && self.host.is_none() {
            self.host = Some(HostTime::new([0.0, 0.0, self.prices[UPLOADED]], self.prior));
        }
        let mut card_ms = actual_ms;
        if let Some(host) = &mut self.host {
            match known_ms {
                Some(ms) => {
                    host.observe(of_host, actual_ms - ms, weight, kept);
                    card_ms = ms;
                }
                // The card did not tell this time.
                None => card_ms = (actual_ms - host.ms(of_host)).max(LEAST_MS),
            }
            terms[UPLOADED] = 0.0;
        }
        self.frames.observe(&terms, card_ms, weight, kept);
        self.frames.fit(&mut self.prices);
        if self.host.is_some() {
            self.prices[UPLOADED] = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// A slow machine.
    const PRICES: Prices = Prices {
        frame: 0.7,
        draw: 0.02,
        vertex: 4e-5,
        triangle: 1e-4,
        plain_fragment: 4e-6,
        textured_fragment: 8e-6,
        hidden_fragment: 1e-6,
        uploaded_byte: 2e-7,
    };

    /// A frame of a walk: what it draws changes in ways that are not all alike.
    fn load(random: &mut Random) -> Load {
        let triangles = 2e4 + 6e4 * random.unit();
        Load {
            draws: 10.0 + 40.0 * random.unit(),
            vertices: triangles * (0.6 + 0.6 * random.unit()),
            triangles,
            plain_fragments: 4e5 * random.unit(),
            textured_fragments: 1e6 * random.unit(),
            hidden_fragments: 3e6 * random.unit(),
            uploaded_bytes: if random.unit() < 0.2 { 3e6 * random.unit() } else { 0.0 },
        }
    }

    #[test]
    fn a_frame_that_a_clock_says_took_no_time_says_little_of_the_next() {
        let mut model = CostModel::new(&PRICES);
        let mut random = Random::new(3, 0);
        for _ in 0..300 {
            let load = load(&mut random);
            model.observe(&load, exact(&PRICES, &load), None, 1.0 / 30.0);
        }
        let load = load(&mut random);
        model.observe(&load, 1e-3, None, 1.0 / 30.0);
        let priced = model.priced_ms(&load) / exact(&PRICES, &load);
        assert!(priced > 0.85, "{priced}");
    }

    fn zero() -> Prices {
        Prices::from_ordinary([0.0; TERMS])
    }

    fn exact(prices: &Prices, load: &Load) -> f64 {
        dot(&prices.ordinary(), &load.terms())
    }

    /// Relative errors of the last 100 of some frames: their mean and their deviation.
    fn errors(model: &mut CostModel, prices: &Prices, frames: usize, noise: f64) -> [f64; 2] {
        let mut random = Random::new(7, 0);
        let mut errors = Vec::new();
        for _ in 0..frames {
            let load = load(&mut random);
            let actual = exact(prices, &load) * (1.0 + noise * (2.0 * random.unit() - 1.0));
            errors.push(model.estimate(&load).mean_ms / actual - 1.0);
            model.observe(&load, actual, None, 1.0 / 30.0);
        }
        let late = &errors[frames - 100..];
        let mean = late.iter().sum::<f64>() / 100.0;
        let square = late.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / 100.0;
        [mean, square.sqrt()]
    }

    #[test]
    fn before_any_frame_it_says_what_was_expected() {
        let (model, load) = (CostModel::new(&PRICES), load(&mut Random::new(1, 0)));
        let estimate = model.estimate(&load);
        assert!((estimate.mean_ms - exact(&PRICES, &load)).abs() < 1e-9);
        assert_eq!(estimate.deviation_ms, 0.0);
    }

    #[test]
    fn prices_that_were_expected_wrongly_are_learned() {
        let fast = Prices::from_ordinary(PRICES.ordinary().map(|price| price / 8.0));
        let textured = Prices { textured_fragment: 3e-5, draw: 0.0, ..PRICES };
        for prices in [&fast, &textured, &PRICES] {
            let mut model = CostModel::new(&PRICES);
            let [mean, deviation] = errors(&mut model, prices, 300, 0.0);
            assert!(mean.abs() < 0.01 && deviation < 0.01, "{mean} {deviation} {prices:?}");
        }
    }

    #[test]
    fn noise_is_told_and_not_followed() {
        let mut model = CostModel::new(&PRICES);
        // Even between -0.1 and 0.1: a deviation of 0.058.
        let [mean, deviation] = errors(&mut model, &PRICES, 2000, 0.1);
        assert!(mean.abs() < 0.01, "{mean}");
        assert!((0.05..0.065).contains(&deviation), "{deviation}");
        assert!((0.05..0.065).contains(&model.relative_deviation()));
        assert!(model.relative_bias().abs() < 0.01);
    }

    #[test]
    fn estimates_are_right_on_average_however_far_frames_lie_apart() {
        let mut model = CostModel::new(&PRICES);
        let mut random = Random::new(11, 0);
        let mut errors = Vec::new();
        for frame in 0..6000 {
            let load = load(&mut random);
            // Of mean 1 and deviation 0.2.
            let noise: f64 = 1.0 + (0..3).map(|_| random.between(-0.2, 0.2)).sum::<f64>();
            let actual_ms = exact(&PRICES, &load) * noise;
            if frame >= 1000 {
                errors.push(actual_ms / model.estimate(&load).mean_ms - 1.0);
            }
            model.observe(&load, actual_ms, None, 1.0 / 30.0);
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!(mean.abs() < 0.008, "{mean}");
    }

    #[test]
    fn a_machine_that_becomes_slower_is_followed_within_seconds() {
        let mut model = CostModel::new(&PRICES);
        errors(&mut model, &PRICES, 3000, 0.05);
        let slower = Prices::from_ordinary(PRICES.ordinary().map(|price| price * 2.0));
        errors(&mut model, &slower, 130, 0.05);
        let [mean, _] = errors(&mut model, &slower, 100, 0.05);
        assert!(mean.abs() < 0.02, "{mean}");
    }

    #[test]
    fn what_no_term_explains_is_followed_while_it_lasts() {
        let mut model = CostModel::new(&PRICES);
        let mut random = Random::new(9, 0);
        let mut errors = Vec::new();
        for frame in 0..1200 {
            let load = load(&mut random);
            // Something that is in view for two seconds, and then is not.
            let unseen = if frame / 60 % 2 == 0 { 1.0 } else { 1.3 };
            let actual = exact(&PRICES, &load) * unseen;
            errors.push((model.estimate(&load).mean_ms / actual - 1.0).abs());
            model.observe(&load, actual, None, 1.0 / 30.0);
        }
        let late = &errors[600..];
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        // Without memory of the last frames it would be half of the difference.
        assert!(mean < 0.06, "{mean}");
    }

    #[test]
    fn what_the_processor_takes_is_told_from_what_the_card_takes() {
        // Where every frame has as many triangles for each draw call, its time alone does not tell
        // which of them take it.
        let host = Prices { frame: 0.3, draw: 0.05, uploaded_byte: 2e-7, ..zero() };
        let card = Prices { frame: 0.5, triangle: 1e-4, plain_fragment: 4e-6, ..zero() };
        let expected = Prices { draw: 0.0, vertex: 0.0, ..PRICES };
        let mut models = [CostModel::new(&expected), CostModel::new(&expected)];
        let mut random = Random::new(5, 0);
        for _ in 0..600 {
            let load = load(&mut random);
            let load = Load { draws: load.triangles / 1e3, ..load };
            let [host_ms, card_ms] = [&host, &card].map(|prices| exact(prices, &load));
            let gpu_ms = [Some(card_ms), None];
            for (model, gpu_ms) in models.iter_mut().zip(gpu_ms) {
                model.observe(&load, host_ms + card_ms, gpu_ms, 1.0 / 30.0);
            }
        }
        // Few triangles in many draw calls.
        let odd = Load { draws: 100.0, triangles: 1e4, ..Load::default() };
        let actual = exact(&host, &odd) + exact(&card, &odd);
        let [apart, together] = [0, 1].map(|at| models[at].priced_ms(&odd) / actual - 1.0);
        assert!(apart.abs() < 0.02, "{apart}");
        assert!(together.abs() > 0.1, "{together}: the test shows nothing");
        let uploaded_byte = models[0].prices().uploaded_byte / host.uploaded_byte;
        assert!((uploaded_byte - 1.0).abs() < 0.02, "{uploaded_byte}");
    }

    #[test]
    fn no_price_is_negative_however_frames_fall_out() {
        let mut model = CostModel::new(&PRICES);
        let mut random = Random::new(3, 0);
        for _ in 0..500 {
            let load = load(&mut random);
            // Dearer the less is drawn.
            model.observe(&load, 1e6 / load.triangles, None, 1.0 / 30.0);
            assert!(model.prices.iter().all(|price| *price >= 0.0), "{:?}", model.prices);
        }
    }

    #[test]
    fn odd_frames_leave_sound_figures() {
        let mut model = CostModel::new(&PRICES);
        let odd = [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300, 1e12];
        for actual in odd {
            for value in odd {
                for dt_s in odd {
                    let load = Load { triangles: value, draws: 1.0, ..Load::default() };
                    for gpu_ms in odd {
                        model.observe(&load, actual, Some(gpu_ms), dt_s);
                    }
                    model.observe(&load, actual, None, dt_s);
                }
            }
        }
        let estimate = model.estimate(&load(&mut Random::new(1, 0)));
        assert!(estimate.mean_ms.is_finite() && estimate.deviation_ms.is_finite(), "{estimate:?}");
    }
}
