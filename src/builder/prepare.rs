//! An input as it is built: read, its up axis known, in metres.

use std::path::Path;

use crate::builder::options::BuildOptions;
use crate::builder::sources::Sources;
use crate::builder::stages::{Stage, Stages};
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
}

impl Preparing<'_> {
    /// Reads an input.
    pub fn read(&self, input: &Path) -> Result<Prepared> {
        let &Self { options, sources, globe, stages } = self;
        let mut model = stages.time(Stage::Import, || sources.load(input))?;
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
        if let Some(quantization) = options.quantization() {
            quantization.check(&model)?;
        }
        Ok(Prepared { model, up, up_from })
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
