//! Pictures that nodes share, as files.

use std::collections::BTreeMap;

use crate::Result;
use crate::format::{OutputDir, SharedTexture, TEXTURES_DIR};
use crate::texture::SharedTextures;

/// Writes new shared textures beside those of earlier results: all of them, by name.
pub fn write_textures(
    shared: SharedTextures,
    mut textures: BTreeMap<String, SharedTexture>,
    output: &OutputDir,
) -> Result<BTreeMap<String, SharedTexture>> {
    for file in shared.into_files() {
        let texture = SharedTexture {
            file_name: file.name.to_string(),
            width: file.width,
            height: file.height,
            bytes: file.bytes.len() as u64,
        };
        if textures.insert(file.name.to_string(), texture).is_none() {
            output.write(format!("{TEXTURES_DIR}/{}", file.name), &file.bytes)?;
        }
    }
    Ok(textures)
}
