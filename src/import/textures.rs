//! The list of a model's textures: each file once, however many materials use it.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::mesh::{TextureData, TextureSource};

/// Collects textures while materials are read.
#[derive(Default)]
pub(super) struct Textures {
    /// In the order in which they were first used.
    pub(super) list: Vec<TextureSource>,
    files: BTreeMap<(PathBuf, Option<PathBuf>), u32>,
}

impl Textures {
    /// The index of the texture in `file` with the opacity of `opacity`; `name` is for messages.
    pub(super) fn file(&mut self, name: &str, file: PathBuf, opacity: Option<PathBuf>) -> u32 {
        let list = &mut self.list;
        *self.files.entry((file.clone(), opacity.clone())).or_insert_with(|| {
            list.push(TextureSource { name: name.into(), data: TextureData::File(file), opacity });
            list.len() as u32 - 1
        })
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
