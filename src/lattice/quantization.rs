//! Quantised builds: everything lies on one coarse lattice, so that files can store positions in 16
//! bits without any further rounding.
//!
//! The step is the same for the whole city. Source vertices are rounded to its multiples before
//! anything is cut, cut vertices when they are made, and what simplification moved before its error
//! is measured. So what is stored is what was measured, and neighbours stay equal in every bit.

use crate::lattice::Lattice;
use crate::mesh::{Model, Part, all_differ};
use crate::{Error, Result};

/// The parameter of a scene that holds the step, metres.
const PARAMETER: &str = "quantize";

/// The least and the largest step that can be asked for, metres.
pub const STEPS: [f64; 2] = [1e-6, 1e3];

/// Steps that a city must have across it.
const LEAST_ACROSS: f64 = 1000.0;

/// Steps that a coordinate may have: beyond, f64 has no integers between them.
const MOST_STEPS: f64 = (1u64 << 52) as f64;

/// The lattice of a quantised build.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantization {
    /// Metres, a power of two.
    pub step: f64,
}

impl Quantization {
    /// With the largest power of two that is not above `metres`, which lies within [`STEPS`].
    pub fn not_above(metres: f64) -> Self {
        const EXPONENT: u64 = 0x7FF << 52;
        Self { step: f64::from_bits(metres.to_bits() & EXPONENT) }
    }

    /// As a scene's or a report's parameters say; `None` where the build was not quantised.
    pub fn of(parameters: &serde_json::Value) -> Option<Self> {
        let step = parameters.get(PARAMETER)?.as_f64()?;
        (step > 0.0 && step.is_finite()).then_some(Self { step })
    }

    /// Notes it among the parameters.
    pub fn note(&self, parameters: &mut serde_json::Value) {
        parameters[PARAMETER] = self.step.into();
    }

    /// How far a vertex may be from where the source has it, metres: half a step along each axis.
    pub fn bound(&self) -> f64 {
        self.step * 0.5 * 3f64.sqrt()
    }

    /// A coordinate rounded to the lattice.
    pub fn round(&self, coordinate: f64) -> f64 {
        // Adding 0 turns -0 into 0.
        Lattice { step: self.step }.round(coordinate) + 0.0
    }

    /// Refuses a model whose coordinates have no place on the lattice.
    pub fn check(&self, model: &Model) -> Result<()> {
        let [low, high] = model.bounds();
        let largest = low.iter().chain(&high).fold(0f64, |most, c| most.max(c.abs()));
        if largest / self.step < MOST_STEPS {
            return Ok(());
        }
        let what = format!(
            "coordinates of {largest:e} m cannot be rounded to steps of {} m; set --quantize to more",
            self.step
        );
        Err(Error::input(&model.source, what))
    }

    /// Refuses a city with fewer steps across than would leave its shape; `extent` is its longest
    /// side, metres.
    pub fn check_extent(&self, extent: f64) -> Result<()> {
        if extent / self.step >= LEAST_ACROSS {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "quantization: a step of {} m leaves {:.0} steps across a city of {extent} m, expected \
             {LEAST_ACROSS} at least",
            self.step,
            extent / self.step
        )))
    }

    /// Rounds all vertices of a model. Triangles of which two corners meet are left out; returns
    /// how many.
    pub fn snap(&self, model: &mut Model) -> u64 {
        let before = model.triangle_count();
        for part in &mut model.parts {
            let Part { positions, indices, .. } = part;
            positions.iter_mut().flatten().for_each(|c| *c = self.round(*c));
            let apart =
                |corners: &[u32; 3]| all_differ(corners.map(|vertex| positions[vertex as usize]));
            let kept: Vec<[u32; 3]> =
                indices.as_chunks::<3>().0.iter().copied().filter(apart).collect();
            if kept.len() * 3 < indices.len() {
                *indices = kept.into_flattened();
            }
        }
        model.parts.retain(|part| !part.indices.is_empty());
        (before - model.triangle_count()) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_step_is_the_power_of_two_below() {
        for (metres, step) in [(0.01, 1.0 / 128.0), (1.0, 1.0), (1.999, 1.0), (0.001, 1.0 / 1024.0)]
        {
            assert_eq!(Quantization::not_above(metres).step, step);
        }
    }

    #[test]
    fn parameters_keep_the_step() {
        let mut parameters = serde_json::json!({ "level_factor": 4 });
        assert_eq!(Quantization::of(&parameters), None);
        let quantization = Quantization::not_above(0.01);
        quantization.note(&mut parameters);
        assert_eq!(Quantization::of(&parameters), Some(quantization));
    }

    #[test]
    fn cities_of_few_steps_are_refused() {
        let quantization = Quantization { step: 0.5 };
        let across = |metres: f64| quantization.check_extent(metres);
        across(500.0).unwrap();
        assert!(across(499.0).unwrap_err().to_string().contains("998 steps"));
    }

    #[test]
    fn vertices_are_rounded_and_triangles_that_collapse_are_left_out() {
        let part = |positions: &[[f64; 3]]| Part {
            positions: positions.to_vec(),
            indices: (0..positions.len() as u32).collect(),
            ..Part::default()
        };
        let far = [5_403_456.3, 0.1, -0.1];
        let mut model = Model {
            source: "city.obj".into(),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts: vec![
                part(&[far, [5_403_460.0, 0.0, 9.0], [5_403_450.0, 9.0, 0.0]]),
                part(&[[0.0; 3], [0.2, 0.0, 0.0], [9.0, 9.0, 9.0]]),
            ],
            materials: Vec::new(),
            textures: Vec::new(),
            up: None,
            warnings: Default::default(),
        };
        let quantization = Quantization { step: 0.5 };
        assert_eq!(quantization.snap(&mut model), 1);
        assert_eq!(model.parts.len(), 1);
        assert_eq!(model.parts[0].positions[0], [5_403_456.5, 0.0, 0.0]);
        assert_eq!(model.parts[0].positions[0][2].to_bits(), 0, "no negative zero");
        quantization.check(&model).unwrap();
        Quantization { step: 1e-10 }.check(&model).unwrap_err();
    }
}
