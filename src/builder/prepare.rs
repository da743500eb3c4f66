//! An input as it is built: read, its up axis known, in metres, on the lattice of a quantised build.

use std::path::Path;

use crate::builder::options::BuildOptions;
use crate::builder::sources::Sources;
use crate::builder::stages::{Stage, Stages};
use crate::lattice::{Lattice, Quantization};
use crate::mesh::{Model, UpAxis, UpEvidence};
use crate::place::{Globe, z_up};
use crate::report::build_report::UpFrom;
use crate::{Error, Result};

/// A model that was prepared.
pub struct Prepared {
    /// The model.
    pub model: Model,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// How that is known.
    pub up_from: UpFrom,
    /// Triangles of the source.
    pub triangles: u64,
    /// Those of them that are thinner than the lattice.
    pub collapsed: u64,
}

/// What inputs are prepared with.
#[derive(Clone, Copy)]
pub struct Preparing<'a> {
    /// What was asked for.
    pub options: &'a BuildOptions,
    /// Where inputs are read from.
    pub sources: &'a Sources,
    /// Where the city is.
    pub globe: Option<&'a Globe>,
    /// Where the time goes.
    pub stages: &'a Stages,
    /// Inputs of the whole build.
    pub inputs: usize,
}

impl Preparing<'_> {
    /// Reads an input.
    pub fn read(&self, input: &Path) -> Result<Prepared> {
        let &Self { options, sources, globe, stages, inputs } = self;
        let mut model = stages.time(Stage::Import, || sources.load(input))?;
        let triangles = model.triangle_count() as u64;
        let (up, up_from) = match (options.up, model.up) {
            (Some(up), _) => (up, UpFrom::Option),
            (None, Some(up)) => (up, UpFrom::Format),
            // Degrees beside metres have no shape.
            (None, None) if options.placement.is_degrees() => (UpAxis::Z, UpFrom::Degrees),
            (None, None) => {
                let up = sources.up_of(input).unwrap_or_else(|| {
                    let guess = stages.time(Stage::Import, || UpEvidence::of(&model).guess());
                    guess.warn(&mut model.warnings);
                    guess.axis
                });
                (up, UpFrom::Shape)
            }
        };
        options.placement.localise(&mut model, up)?;
        check_place(&model, up, globe)?;
        let mut collapsed = 0;
        if let Some(quantization) = options.quantization() {
            quantization.check(&model)?;
            if inputs == 1 {
                quantization.check_extent(model.bounds())?;
            }
            collapsed = stages.time(Stage::Gather, || quantization.snap(&mut model));
            let (source, step) = (model.source.display(), quantization.step);
            let what = format!("{source}: triangle thinner than the lattice of {step} m left out");
            model.warnings.add(what, collapsed);
        } else if inputs > 1 {
            // What is one vertex of a block is one vertex where inputs meet.
            let Lattice { step } = Lattice::for_tile(model.bounds());
            collapsed = stages.time(Stage::Gather, || Quantization { step }.snap(&mut model));
            let what = format!(
                "{}: triangle thinner than its precision ({step:e} m) left out",
                model.source.display()
            );
            model.warnings.add(what, collapsed);
        }
        Ok(Prepared { model, up, up_from, triangles, collapsed })
    }
}

/// Refuses coordinates that cannot be of the place that was asked for.
fn check_place(model: &Model, up: UpAxis, globe: Option<&Globe>) -> Result<()> {
    let Some(globe) = globe else { return Ok(()) };
    let [low, high] = model.bounds();
    let (low, high) = z_up(up, low, high);
    match globe.misfit(low, high) {
        Some(what) => Err(Error::input(&model.source, what)),
        None => Ok(()),
    }
}
