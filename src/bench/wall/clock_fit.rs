//! Fits the model clock's equation to frames that were measured.

use crate::bench::ClockConstants;
use crate::bench::model_load::ModelLoad;
use crate::bench::statistics::mean;
use crate::engine::Prices;
use crate::engine::least_squares::LeastSquares;

/// Terms: those of geometry, of fragments, and the frame itself.
const TERMS: usize = 8;

/// Which of them are of geometry.
const GEOMETRY: std::ops::Range<usize> = 1..4;

/// An ordinary load, by which terms are made comparable.
const ORDINARY: [f64; TERMS] = [1.0, 100.0, 1e5, 1e5, 1e6, 1e6, 1e6, 1e6];

/// Weight of the usual constants against that of all frames.
const PRIOR: f64 = 1e-3;

/// Overlaps that are tried, from none to all.
const OVERLAPS: u32 = 20;

/// Rounds in which it settles which of both stages is the longer.
const ROUNDS: usize = 12;

/// A frame as it was measured: what it asked for, and milliseconds.
pub(super) type Measured = (ModelLoad, f64);

/// The constants that explain frames best, others as `usual` has them, and the root of the mean
/// square of the relative errors that are left.
pub(super) fn fit_clock(frames: &[Measured], usual: &ClockConstants) -> (ClockConstants, f64) {
    let tried = (0..=OVERLAPS).map(|step| {
        let overlap = f64::from(step) / f64::from(OVERLAPS);
        let constants = fit_with(frames, &ClockConstants { overlap, ..*usual });
        (constants, deviation(frames, &constants))
    });
    tried.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((*usual, 0.0))
}

/// Root of the mean square of relative errors.
fn deviation(frames: &[Measured], constants: &ClockConstants) -> f64 {
    let error = |(load, ms): &Measured| {
        ((constants.prices.frame + constants.drawing_ms(load)) / ms - 1.0).powi(2)
    };
    mean(frames.iter().map(error)).sqrt()
}

/// The same with the overlap that is given.
fn fit_with(frames: &[Measured], usual: &ClockConstants) -> ClockConstants {
    let expected = weights(usual);
    let mean_ms = mean(frames.iter().map(|(_, ms)| *ms)).max(f64::MIN_POSITIVE);
    let prior = PRIOR * frames.len() as f64 / (mean_ms * mean_ms);
    let (mut found, mut constants) = (expected, *usual);
    for _ in 0..ROUNDS {
        let mut fit = LeastSquares::new(expected, prior);
        for (load, ms) in frames {
            // Of the shorter stage only what does not overlap counts.
            let [geometry, fragments] = constants.stages_ms(load);
            let shorter = 1.0 - constants.overlap;
            let parts = if geometry < fragments { [shorter, 1.0] } else { [1.0, shorter] };
            let mut terms = terms(load);
            for (at, term) in terms.iter_mut().enumerate().skip(1) {
                *term *= parts[usize::from(!GEOMETRY.contains(&at))];
            }
            fit.observe(&terms, *ms, 1.0 / (ms * ms), 1.0);
        }
        fit.fit(&mut found);
        constants = with_weights(usual, &found);
    }
    constants
}

fn terms(load: &ModelLoad) -> [f64; TERMS] {
    let terms = [
        1.0,
        load.draws,
        load.vertices,
        load.triangles,
        load.plain_fragments,
        load.textured_fragments,
        load.hidden_fragments,
        load.edge_fragments,
    ];
    std::array::from_fn(|at| terms[at] / ORDINARY[at])
}

fn weights(constants: &ClockConstants) -> [f64; TERMS] {
    let prices = &constants.prices;
    let weights = [
        prices.frame,
        prices.draw,
        prices.vertex,
        prices.triangle,
        prices.plain_fragment,
        prices.textured_fragment,
        prices.hidden_fragment,
        constants.edge_fragment,
    ];
    std::array::from_fn(|at| weights[at] * ORDINARY[at])
}

fn with_weights(usual: &ClockConstants, weights: &[f64; TERMS]) -> ClockConstants {
    let [
        frame,
        draw,
        vertex,
        triangle,
        plain_fragment,
        textured_fragment,
        hidden_fragment,
        edge_fragment,
    ] = std::array::from_fn(|at| weights[at] / ORDINARY[at]);
    let prices = Prices {
        frame,
        draw,
        vertex,
        triangle,
        plain_fragment,
        textured_fragment,
        hidden_fragment,
        uploaded_byte: usual.prices.uploaded_byte,
    };
    ClockConstants { prices, edge_fragment, ..*usual }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn load(random: &mut Random) -> ModelLoad {
        let triangles = 4e5 * random.unit();
        let under = 2e6 * random.unit();
        let textured = random.unit();
        let hidden = under * random.unit();
        ModelLoad {
            draws: 10.0 + 100.0 * random.unit(),
            vertices: triangles * (0.6 + 0.8 * random.unit()),
            triangles,
            plain_fragments: (under - hidden) * (1.0 - textured),
            textured_fragments: (under - hidden) * textured,
            hidden_fragments: hidden,
            edge_fragments: (under * triangles).sqrt(),
        }
    }

    #[test]
    fn a_machine_is_known_by_its_frames() {
        let usual = ClockConstants::default();
        let machine = ClockConstants {
            prices: Prices { frame: 1.1, triangle: 4e-5, hidden_fragment: 1e-6, ..usual.prices },
            edge_fragment: 2e-6,
            overlap: 0.6,
            ..usual
        };
        let mut random = Random::new(5, 0);
        let frames: Vec<Measured> = (0..80)
            .map(|_| {
                let load = load(&mut random);
                (load, machine.prices.frame + machine.drawing_ms(&load))
            })
            .collect();
        let (found, left) = fit_clock(&frames, &usual);
        assert!(left < 0.01, "{left}");
        assert!((found.overlap - 0.6).abs() < 0.11, "{found:?}");
        for _ in 0..20 {
            let load = load(&mut random);
            let [of, expected] =
                [&found, &machine].map(|at| at.prices.frame + at.drawing_ms(&load));
            assert!((of / expected - 1.0).abs() < 0.05, "{of} {expected}");
        }
    }
}
