//! Repeating textures: kept whole, stored once for each resolution, shared between nodes.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::cache::Decoded;
use super::encode;
use super::level;
use crate::format::{NodeImage, NodeImageData};
use crate::{Error, Result};

/// Coarse resolutions stop here: a side is not made shorter than this many texels.
const MIN_SIDE: u32 = 8;

/// A file of `textures/`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedFile {
    /// Its name, without folders; only `[a-z0-9._-]`.
    pub name: Arc<str>,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The encoded image.
    pub bytes: Vec<u8>,
}

/// All repeating textures of a build, by name. Whoever needs one first makes it.
#[derive(Debug, Default)]
pub struct SharedTextures {
    files: Mutex<BTreeMap<Arc<str>, Arc<OnceLock<Result<SharedFile, String>>>>>,
    /// Texels of each image at full resolution, by content.
    sources: Mutex<BTreeMap<[u8; 32], u64>>,
}

impl SharedTextures {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    /// The texels of all images at full resolution, each once: what the source uses of them.
    pub fn source_texels(&self) -> u64 {
        self.sources.lock().unwrap_or_else(PoisonError::into_inner).values().sum()
    }

    /// All files, sorted by name.
    pub fn into_files(self) -> Vec<SharedFile> {
        let files = self.files.into_inner().unwrap_or_else(PoisonError::into_inner);
        files
            .into_values()
            .filter_map(|file| Arc::try_unwrap(file).ok()?.into_inner()?.ok())
            .collect()
    }

    /// The image at a resolution for texels `step` times as wide as the source's, at least 1.
    pub(crate) fn image(
        &self,
        texture_name: &str,
        decoded: &Decoded,
        step: f64,
        quality: u8,
    ) -> Result<NodeImage> {
        let image = &decoded.image;
        let [width, height] = resolution([image.width, image.height], step);
        let extension = encode::extension(usize::from(image.channels));
        let stem = sanitised_stem(texture_name);
        let hash = &decoded.hash().to_hex()[..8];
        let name: Arc<str> = format!("{stem}-{hash}-{width}x{height}.{extension}").into();

        let slot = {
            let mut files = self.files.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(files.entry(Arc::clone(&name)).or_default())
        };
        let made = slot.get_or_init(|| {
            let mut sources = self.sources.lock().unwrap_or_else(PoisonError::into_inner);
            sources.insert(*decoded.hash().as_bytes(), image.texels());
            drop(sources);
            let size = [width as usize, height as usize];
            let channels = usize::from(image.channels);
            let encoded = if [width, height] == [image.width, image.height] {
                encode::encode(&image.pixels, size, channels, quality)
            } else {
                let scaled = level::resize_whole(image, size);
                encode::encode(&scaled.pixels, size, channels, quality)
            };
            let bytes = encoded.map_err(|error| error.to_string())?.bytes;
            Ok(SharedFile { name: Arc::clone(&name), width, height, bytes })
        });
        match made {
            Ok(file) => Ok(NodeImage {
                width,
                height,
                data: NodeImageData::Shared { file_name: Arc::clone(&file.name) },
            }),
            Err(what) => Err(Error::Internal(what.clone())),
        }
    }
}

/// The finest power-of-two fraction of the size that is not finer than one texel in `step`, but
/// never below the smallest side; at least as fine as asked for.
fn resolution(size: [u32; 2], step: f64) -> [u32; 2] {
    let halvings = if step >= 2.0 { (step.log2() + 1e-9) as u32 } else { 0 };
    size.map(|side| {
        let smallest = side.min(MIN_SIDE);
        (side >> halvings.min(31)).max(smallest).max(1)
    })
}

/// The file name without folders and extension, in lower case, other signs as `_`.
fn sanitised_stem(name: &str) -> String {
    let base = name.rsplit(['/', '\\']).next().unwrap_or(name);
    let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
    let clean: String = stem
        .chars()
        .take(48)
        .map(|sign| match sign.to_ascii_lowercase() {
            sign @ ('a'..='z' | '0'..='9' | '-' | '_') => sign,
            _ => '_',
        })
        .collect();
    if clean.is_empty() { "texture".into() } else { clean }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode::DecodedTexture;

    fn decoded(width: u32, height: u32) -> Decoded {
        let pixels = (0..width * height * 3).map(|i| (i * 31) as u8).collect::<Vec<u8>>();
        Decoded::new(DecodedTexture { width, height, channels: 3, pixels })
    }

    #[test]
    fn resolutions_are_halvings_and_stop() {
        assert_eq!(resolution([256, 64], 1.0), [256, 64]);
        assert_eq!(resolution([256, 64], 1.99), [256, 64]);
        assert_eq!(resolution([256, 64], 2.0), [128, 32]);
        assert_eq!(resolution([256, 64], 16.0), [16, 8]);
        assert_eq!(resolution([256, 3], 1e9), [8, 3]);
    }

    #[test]
    fn names_are_tame() {
        assert_eq!(sanitised_stem("C:\\Tex Files\\Brick Wall.1.JPG"), "brick_wall_1");
        assert_eq!(sanitised_stem("dir/.png"), "texture");
        assert_eq!(sanitised_stem("straße"), "stra_e");
    }

    #[test]
    fn each_resolution_is_stored_once() {
        let store = SharedTextures::new();
        let source = decoded(64, 32);
        let first = store.image("a/Wall.jpg", &source, 1.0, 90).expect("encodes");
        let again = store.image("a/Wall.jpg", &source, 1.4, 90).expect("encodes");
        let half = store.image("a/Wall.jpg", &source, 2.8, 90).expect("encodes");
        assert_eq!(first, again);
        assert_eq!((half.width, half.height), (32, 16));
        assert_eq!(store.source_texels(), 64 * 32);
        let files = store.into_files();
        assert_eq!(files.len(), 2);
        assert!(files[0].name < files[1].name && files[0].name.starts_with("wall-"));
        assert!(files.iter().all(|file| file.bytes.starts_with(&[0xff, 0xd8])));
    }
}
