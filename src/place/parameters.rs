//! A scene's place among its parameters.

use super::Placement;
use crate::{Error, Result};

/// The parameter of a scene that holds its [`Placement`].
pub const PLACEMENT: &str = "placement";

/// Where a scene's parameters say that it stands.
pub fn placement_of(parameters: &serde_json::Value) -> Result<Placement> {
    match parameters.get(PLACEMENT) {
        None => Ok(Placement::Local),
        Some(placement) => serde_json::from_value(placement.clone())
            .map_err(|error| Error::Usage(format!("the scene's placement: {error}"))),
    }
}
