//! Everything that a build can be asked for, checked once.

use crate::builder::blocks::plan::BlockMode;
use crate::builder::hierarchy::HierarchyOptions;
use crate::lattice::{Quantization, STEPS};
use crate::mesh::UpAxis;
use crate::place::{PLACEMENT, Placement, placement_of};
use crate::report::shortest;
use crate::{Error, Result};

/// A build's parameters.
#[derive(Clone, Debug)]
pub struct BuildOptions {
    /// How each block becomes a tree.
    pub hierarchy: HierarchyOptions,
    /// How inputs become blocks.
    pub blocks: BlockMode,
    /// The axis that points at the sky; `None` takes the format's word, or looks at the geometry.
    pub up: Option<UpAxis>,
    /// Where the city stands on the Earth.
    pub placement: Placement,
    /// JPEG quality of leaves, 1–100; coarse levels are a quarter as far from 100.
    pub jpeg_quality: u8,
    /// Longest side of an atlas in texels, 16–65535.
    pub max_atlas: u32,
    /// Round positions to a power of two not above this many metres, and store them in 16 bits.
    pub quantize: Option<f64>,
    /// Compress vertices and indices without loss.
    pub compress: bool,
    /// Weight of textured triangles in the cost (`c_textured`), 0–1.
    pub textured_weight: f64,
    /// Whether there are nodes above the blocks ([`crate::builder::districts`]).
    pub districts: bool,
    /// Build even where nothing has changed.
    pub force: bool,
}

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            hierarchy: HierarchyOptions::default(),
            blocks: BlockMode::Auto,
            up: None,
            placement: Placement::Local,
            jpeg_quality: 85,
            max_atlas: 4096,
            quantize: None,
            compress: false,
            textured_weight: crate::format::attributes::TEXTURED_WEIGHT,
            districts: true,
            force: false,
        }
    }
}

impl BuildOptions {
    /// Refuses what is out of range.
    pub fn check(&self) -> Result<()> {
        let range = |name: &str, value: f64, low: f64, high: f64| {
            if value >= low && value <= high {
                Ok(())
            } else {
                Err(Error::Usage(format!("{name} is {value}, expected {low} to {high}")))
            }
        };
        let hierarchy = &self.hierarchy;
        range("level factor", f64::from(hierarchy.level_factor), 2.0, 64.0)?;
        range("desired triangles", f64::from(hierarchy.desired_tris), 1.0, 1e9)?;
        range("JPEG quality", f64::from(self.jpeg_quality), 1.0, 100.0)?;
        range("largest atlas", f64::from(self.max_atlas), 16.0, 65535.0)?;
        range("textured weight", self.textured_weight, 0.0, 1.0)?;
        let [least, most] = STEPS;
        self.quantize.map_or(Ok(()), |metres| range("quantization step", metres, least, most))
    }

    /// The lattice of a quantised build, of options that were checked.
    pub fn quantization(&self) -> Option<Quantization> {
        self.quantize.map(Quantization::not_above)
    }

    /// The parameters that the result depends on, for `scene.hlod` and `build.json`.
    pub fn to_json(&self) -> serde_json::Value {
        let hierarchy = &self.hierarchy;
        let mut parameters = serde_json::json!({
            "blocks": self.blocks.to_string(),
            "tree": hierarchy.tree,
            "desired_tris": hierarchy.desired_tris,
            "level_factor": hierarchy.level_factor,
            "simplifier": hierarchy.simplifier,
            "simplify_from": hierarchy.simplify_from,
            "borders": hierarchy.borders,
            "seams": hierarchy.seams,
            "texture_weight": shortest(hierarchy.weights.texture),
            "color_weight": shortest(hierarchy.weights.color),
            "up": self.up,
            "jpeg_quality": self.jpeg_quality,
            "max_atlas": self.max_atlas,
            "textured_weight": self.textured_weight,
            "districts": if self.districts { "on" } else { "off" },
        });
        if let Some(quantization) = self.quantization() {
            quantization.note(&mut parameters);
        }
        if self.compress {
            parameters["compress"] = "meshopt".into();
        }
        if self.placement != Placement::Local {
            parameters[PLACEMENT] = serde_json::json!(self.placement);
        }
        parameters
    }
}

/// True where nodes built with these parameters are the same.
pub fn same_nodes(one: &serde_json::Value, other: &serde_json::Value) -> bool {
    let without = |parameters: &serde_json::Value| {
        let mut parameters = parameters.clone();
        let degrees = placement_of(&parameters).is_ok_and(|placement| placement.is_degrees());
        if let Some(parameters) = parameters.as_object_mut().filter(|_| !degrees) {
            parameters.shift_remove(PLACEMENT);
        }
        parameters
    };
    without(one) == without(other)
}
