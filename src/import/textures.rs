//! The list of a model's textures: each file once, however many materials use it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::opacity::Opacity;
use crate::decode::{alpha_values, white_image};
use crate::mesh::{TextureData, TextureSource};

/// Collects textures while materials are read.
#[derive(Default)]
pub(super) struct Textures {
    /// In the order in which they were first used.
    pub(super) list: Vec<TextureSource>,
    /// By file (`None` for white) and opacity.
    indices: BTreeMap<(Option<PathBuf>, Option<PathBuf>), u32>,
    opacities: OpacityCache,
}

/// The effects of opacity maps, by file and by whether its own alpha channel alone counts: each is decoded
/// once for all parts of a model that are read one after the other.
#[derive(Clone, Default)]
pub(super) struct OpacityCache(Arc<Mutex<BTreeMap<(PathBuf, bool), Result<Opacity, String>>>>);

impl Textures {
    /// An empty list.
    pub(super) fn new(opacities: OpacityCache) -> Self {
        Self { opacities, ..Self::default() }
    }

    /// The index of the texture in `file` with the opacity of `opacity`; `name` is for messages.
    pub(super) fn file(&mut self, name: &str, file: PathBuf, opacity: Option<PathBuf>) -> u32 {
        self.index(name, Some(file), opacity)
    }

    /// The index of a white texture with the opacity of `opacity`; `name` is for messages.
    pub(super) fn white(&mut self, name: &str, opacity: Option<PathBuf>) -> u32 {
        self.index(name, None, opacity)
    }

    fn index(&mut self, name: &str, file: Option<PathBuf>, opacity: Option<PathBuf>) -> u32 {
        let list = &mut self.list;
        *self.indices.entry((file.clone(), opacity.clone())).or_insert_with(|| {
            let data = match file {
                Some(file) => TextureData::File(file),
                None => TextureData::Embedded(white_image()),
            };
            list.push(TextureSource { name: name.into(), data, opacity });
            list.len() as u32 - 1
        })
    }

    /// Returns the effect of the opacity map in `file`, or why it cannot be read. `is_own_alpha`: the same file
    /// gives the colour, so that its alpha channel alone is opacity.
    pub(super) fn opacity(&self, file: &Path, is_own_alpha: bool) -> Result<Opacity, String> {
        let mut known = self.opacities.0.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (file.to_path_buf(), is_own_alpha);
        let opacity = known.entry(key).or_insert_with(|| {
            let image = alpha_values(file, is_own_alpha).map_err(|error| error.to_string())?;
            Ok(Opacity::of(image.width() as usize, image.as_raw()))
        });
        opacity.clone()
    }

    /// The files of all textures.
    pub(super) fn dependencies(&self) -> impl Iterator<Item = PathBuf> {
        self.list.iter().flat_map(|texture| {
            let file = match &texture.data {
                TextureData::File(file) => Some(file.clone()),
                TextureData::Embedded(_) => None,
            };
            file.into_iter().chain(texture.opacity.clone())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_there_once_for_each_opacity() {
        let mut textures = Textures::default();
        let indices = [("a", None), ("b", None), ("a", Some("m")), ("a", None)].map(
            |(file, opacity): (&str, Option<&str>)| {
                textures.file(file, file.into(), opacity.map(PathBuf::from))
            },
        );
        assert_eq!(indices, [0, 1, 2, 0]);
        assert_eq!(textures.dependencies().count(), 4);
    }
}
