//! An input file in memory: f64 positions, faces already triangulated, nothing welded or cut.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::DVec3;

use super::{Material, Normal, TextureSource};

/// Which input axis points at the sky.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// glTF's convention.
    Y,
    /// Surveying's convention, and that of most city OBJ files.
    Z,
}

impl UpAxis {
    /// A point or direction of a source whose up axis this is, turned so that Z is up.
    pub fn z_up(self, p: DVec3) -> DVec3 {
        match self {
            Self::Z => p,
            Self::Y => DVec3::new(p.x, -p.z, p.y),
        }
    }

    /// The way back from [`Self::z_up`].
    pub fn from_z_up(self, p: DVec3) -> DVec3 {
        match self {
            Self::Z => p,
            Self::Y => DVec3::new(p.x, p.z, -p.y),
        }
    }
}

/// A named group (`g` or `o` of OBJ, node or mesh of glTF).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// Its name in the source; need not be unique.
    pub name: String,
}

/// The triangles of one group that share one material.
///
/// A vertex is a position with its texture coordinate, colour and normal; a position that is used with
/// two texture coordinates is two vertices. All indices are valid and all coordinates are finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Index into [`Model::groups`].
    pub group: u32,
    /// Index into [`Model::materials`].
    pub material: u32,
    /// Source coordinates in source units and axes, unrounded.
    pub positions: Vec<[f64; 3]>,
    /// One per vertex, or empty. v grows downwards (glTF's convention), so OBJ's v is flipped;
    /// texture transforms are already applied. Not limited to 0–1.
    pub texcoords: Vec<[f32; 2]>,
    /// One per vertex, or empty. RGBA, linear light, 65535 is 1.
    pub colors: Vec<[u16; 4]>,
    /// One per vertex, or empty; those of its triangles where it is [`Normal::NONE`]. Parts with a texture
    /// have none: they are not lit.
    pub normals: Vec<Normal>,
    /// Three per triangle, into this part's vertices, counter-clockwise seen from the front.
    pub indices: Vec<u32>,
}

/// What was imperfect in an input and how often, in the order in which it was first met.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Warnings {
    /// By text.
    entries: BTreeMap<String, Warning>,
}

/// A warning's place in the order in which texts were first met, and how often it applies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Warning {
    place: usize,
    count: u64,
}

impl Warnings {
    /// Counts `times` more of `what`. The text names the file and, where it is one, the element.
    pub fn add(&mut self, what: impl Into<String>, times: u64) {
        if times == 0 {
            return;
        }
        let new = Warning { place: self.entries.len(), count: 0 };
        self.entries.entry(what.into()).or_insert(new).count += times;
    }

    /// Takes over all of `other`.
    pub fn extend(&mut self, other: Warnings) {
        let mut entries: Vec<(String, Warning)> = other.entries.into_iter().collect();
        entries.sort_by_key(|(_, warning)| warning.place);
        for (what, Warning { count, .. }) in entries {
            self.add(what, count);
        }
    }

    /// Text and count of each.
    pub fn iter(&self) -> impl Iterator<Item = (&str, u64)> {
        let mut entries: Vec<(&str, Warning)> =
            self.entries.iter().map(|(what, warning)| (what.as_str(), *warning)).collect();
        entries.sort_by_key(|(_, warning)| warning.place);
        entries.into_iter().map(|(what, Warning { count, .. })| (what, count))
    }

    /// True where nothing was imperfect.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }
}

/// One input file, imported.
#[derive(Clone, Debug)]
pub struct Model {
    /// The file, as given on the command line or found in a folder.
    pub source: PathBuf,
    /// Every file that was read for it or that it names (the model itself, MTL, textures, bin),
    /// sorted and without duplicates; a change in any of them makes the result stale.
    pub dependencies: Vec<PathBuf>,
    /// Groups in order of appearance; at least one.
    pub groups: Vec<Group>,
    /// Triangles by group and material, in order of appearance; no part is empty.
    pub parts: Vec<Part>,
    /// Materials; the index is meaningful, the order is that of the source.
    pub materials: Vec<Material>,
    /// Textures that the materials use.
    pub textures: Vec<TextureSource>,
    /// The sky's direction where the format says (glTF: Y); `None` where it does not (OBJ).
    pub up: Option<UpAxis>,
    /// What was imperfect.
    pub warnings: Warnings,
}

#[cfg(test)]
impl Model {
    /// Of one group and no materials.
    pub(crate) fn of_parts(parts: Vec<Part>) -> Self {
        Self {
            source: "parts.obj".into(),
            dependencies: Vec::new(),
            groups: vec![Group { name: String::new() }],
            parts,
            materials: Vec::new(),
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        }
    }
}

impl Model {
    /// Least and greatest coordinates of all vertices.
    pub fn bounds(&self) -> [[f64; 3]; 2] {
        let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        self.parts.iter().flat_map(|part| &part.positions).fold(empty, |[low, high], p| {
            [std::array::from_fn(|i| low[i].min(p[i])), std::array::from_fn(|i| high[i].max(p[i]))]
        })
    }

    /// The number of triangles in all parts.
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|part| part.indices.len() / 3).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scaling::assert_scales;

    #[test]
    fn warnings_keep_the_order_in_which_they_were_met() {
        let mut warnings = Warnings::default();
        for (what, times) in [("b", 1), ("c", 0), ("a", 2), ("b", 3)] {
            warnings.add(what, times);
        }
        let mut other = Warnings::default();
        other.add("d", 1);
        other.add("a", 1);
        warnings.extend(other);
        assert_eq!(warnings.iter().collect::<Vec<_>>(), [("b", 4), ("a", 3), ("d", 1)]);
    }

    #[test]
    fn time_scales_with_the_number_of_warnings() {
        let texts = |count: usize| (0..count).map(|at| format!("texture {at} not found")).collect();
        assert_scales(2000, texts, |texts: Vec<String>| {
            let mut warnings = Warnings::default();
            texts.into_iter().for_each(|text| warnings.add(text, 1));
            warnings
        });
    }
}
