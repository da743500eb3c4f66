//! Everything that a build can be asked for, checked once.

use crate::builder::hierarchy::HierarchyOptions;
use crate::builder::partition::BlockSplit;
use crate::builder::simplify::collapse::AppearanceWeights;
use crate::bytes::Bytes;
use crate::format::COPYRIGHT;
use crate::import::tiling::TILE_VERTICES;
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
    pub blocks: BlockSplit,
    /// The axis that points at the sky; `None` takes the format's word, or looks at the geometry.
    pub up: Option<UpAxis>,
    /// Where the city stands on the Earth.
    pub placement: Placement,
    /// Copyright notice of the result, for nodes and tileset. A build adds the notices of its inputs; see
    /// [`copyright`](crate::builder::copyright).
    pub copyright: Option<String>,
    /// JPEG quality of leaves, 1–100; coarse levels are a quarter as far from 100.
    pub jpeg_quality: u8,
    /// Longest side of an atlas in texels, 16–65535.
    pub max_atlas: u32,
    /// Round positions to a power of two not above this many metres, and store them in 16 bits.
    pub quantize: Option<f64>,
    /// Compress vertices and indices without loss.
    pub compress: bool,
    /// Write normals for triangles without a texture.
    pub normals: bool,
    /// Weight of textured triangles in the cost (`c_textured`), 0–1.
    pub textured_weight: f64,
    /// Build upper levels: nodes above the blocks ([`crate::builder::upper`]).
    pub upper_levels: bool,
    /// Keep to so many bytes of memory, [`LEAST_MEMORY`] or more: files that are large are built tile by tile
    /// ([`tiling`](crate::import::tiling)). Results are the same for any number, and not those without.
    pub max_memory: Option<u64>,
    /// Go on from what a build that was stopped had finished, and leave what is finished where this one is.
    pub resume: bool,
    /// Build even where nothing has changed.
    pub force: bool,
}

/// No build can keep to less memory, bytes.
pub const LEAST_MEMORY: u64 = 128 << 20;

impl Default for BuildOptions {
    fn default() -> Self {
        Self {
            hierarchy: HierarchyOptions::default(),
            blocks: BlockSplit::Auto,
            up: None,
            placement: Placement::Local,
            copyright: None,
            jpeg_quality: 85,
            max_atlas: 4096,
            quantize: None,
            compress: false,
            normals: true,
            textured_weight: crate::format::attributes::TEXTURED_WEIGHT,
            upper_levels: true,
            max_memory: None,
            resume: false,
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
        let least = Bytes(LEAST_MEMORY);
        if let Some(bytes) = self.max_memory.filter(|bytes| *bytes < least.0) {
            let what = format!("memory of at most {}, expected {least} or more", Bytes(bytes));
            return Err(Error::Usage(what));
        }
        let [least, most] = STEPS;
        self.quantize.map_or(Ok(()), |metres| range("quantization step", metres, least, most))
    }

    /// The lattice of a quantised build, of options that were checked.
    pub fn quantization(&self) -> Option<Quantization> {
        self.quantize.map(Quantization::not_above)
    }

    /// The triangles that a block has at most, where the blocks are no grid.
    pub fn most_in_block(&self) -> u64 {
        let budgets = self.hierarchy.constants.blocks.divided as u64;
        budgets * u64::from(self.hierarchy.desired_tris)
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
            "borders": hierarchy.borders,
            "texture_weight": shortest(hierarchy.weights.texture),
            "color_weight": shortest(hierarchy.weights.color),
            "up": self.up,
            "jpeg_quality": self.jpeg_quality,
            "max_atlas": self.max_atlas,
            "textured_weight": self.textured_weight,
            "normals": on_off(self.normals),
            "upper_levels": on_off(self.upper_levels),
        });
        if let Some(quantization) = self.quantization() {
            quantization.note(&mut parameters);
        }
        if self.compress {
            parameters["compress"] = "meshopt".into();
        }
        if self.max_memory.is_some() {
            parameters[TILES] = TILE_VERTICES.into();
        }
        if let Some(copyright) = &self.copyright {
            parameters[COPYRIGHT] = copyright.as_str().into();
        }
        if self.placement != Placement::Local {
            parameters[PLACEMENT] = serde_json::json!(self.placement);
        }
        parameters
    }

    /// The options of a result of this version, by its parameters.
    pub fn from_json(parameters: &serde_json::Value) -> Result<Self> {
        let hierarchy = HierarchyOptions {
            tree: read(parameters, "tree")?,
            desired_tris: read(parameters, "desired_tris")?,
            level_factor: read(parameters, "level_factor")?,
            simplifier: read(parameters, "simplifier")?,
            borders: read(parameters, "borders")?,
            weights: AppearanceWeights {
                texture: read(parameters, "texture_weight")?,
                color: read(parameters, "color_weight")?,
                ..AppearanceWeights::default()
            },
            ..HierarchyOptions::default()
        };
        let blocks: String = read(parameters, "blocks")?;
        let options = Self {
            hierarchy,
            blocks: blocks.parse().map_err(|what| unknown("blocks", &what))?,
            up: read(parameters, "up")?,
            placement: placement_of(parameters)?,
            copyright: parameters.get(COPYRIGHT).and_then(|text| text.as_str()).map(str::to_owned),
            jpeg_quality: read(parameters, "jpeg_quality")?,
            max_atlas: read(parameters, "max_atlas")?,
            quantize: Quantization::of(parameters).map(|quantization| quantization.step),
            compress: parameters.get("compress").is_some(),
            normals: read_on_off(parameters, "normals")?,
            textured_weight: read(parameters, "textured_weight")?,
            upper_levels: read_on_off(parameters, "upper_levels")?,
            // Tiles do not depend on how much it is.
            max_memory: parameters.get(TILES).map(|_| u64::MAX),
            resume: false,
            force: false,
        };
        options.check()?;
        match options.to_json() == *parameters {
            true => Ok(options),
            false => Err(unknown("all", &"expected those of this version")),
        }
    }
}

/// Vertices of the tiles of a large file, where it was divided.
const TILES: &str = "tile_vertices";

fn read<T: serde::de::DeserializeOwned>(parameters: &serde_json::Value, name: &str) -> Result<T> {
    T::deserialize(&parameters[name]).map_err(|error| unknown(name, &error))
}

/// Returns the text of a switch among the parameters.
fn on_off(is_on: bool) -> &'static str {
    if is_on { "on" } else { "off" }
}

fn read_on_off(parameters: &serde_json::Value, name: &str) -> Result<bool> {
    match read::<String>(parameters, name)?.as_str() {
        "on" => Ok(true),
        "off" => Ok(false),
        other => Err(unknown(name, &format!("expected on or off, found {other:?}"))),
    }
}

fn unknown(name: &str, what: &dyn std::fmt::Display) -> Error {
    Error::Usage(format!("the result's parameters: {name}: {what}"))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::hierarchy::{BorderMode, TreeShape};
    use crate::builder::simplify::ladder::Simplifier;

    #[test]
    fn options_of_a_result_are_those_that_it_was_built_with() {
        let other = BuildOptions {
            hierarchy: HierarchyOptions {
                tree: TreeShape::Thesis,
                desired_tris: 123,
                level_factor: 7,
                simplifier: Simplifier::Clustering,
                borders: BorderMode::Locked,
                ..HierarchyOptions::default()
            },
            blocks: BlockSplit::Grid(12.5),
            up: Some(UpAxis::Y),
            placement: Placement::Crs { epsg: 25832, height_offset: 46.5 },
            copyright: Some("© 2024 City; © Survey".into()),
            jpeg_quality: 71,
            max_atlas: 777,
            quantize: Some(0.01),
            compress: true,
            normals: false,
            upper_levels: false,
            max_memory: Some(LEAST_MEMORY),
            ..BuildOptions::default()
        };
        for options in [BuildOptions::default(), other] {
            let parameters = options.to_json();
            let read = BuildOptions::from_json(&parameters).unwrap();
            assert_eq!(read.to_json(), parameters);
            assert_eq!(read.hierarchy.weights.texture, options.hierarchy.weights.texture);
        }
    }

    #[test]
    fn parameters_that_are_not_known_are_named() {
        let refused = |name: &str, value: serde_json::Value| {
            let mut parameters = BuildOptions::default().to_json();
            parameters[name] = value;
            BuildOptions::from_json(&parameters).unwrap_err().to_string()
        };
        for (name, value) in [("tree", "round".into()), ("level_factor", (-1).into())] {
            let what = refused(name, value);
            assert!(what.contains(name), "{what}");
        }
        assert!(refused("level_factor", 1.into()).contains("level factor is 1"));
        assert!(refused("roofs", "flat".into()).contains("expected those of this version"));
    }
}
