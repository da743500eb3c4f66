//! Repeating textures: kept whole, made once for each resolution. A node embeds the smallest of
//! those that it needs, as far as its budget goes; the others are files that nodes share.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::cache::Decoded;
use super::encode;
use super::level;
use crate::format::{NodeImage, NodeImageData, NodeMesh};
use crate::{Error, Result};

/// Coarse resolutions stop here: a side is not made shorter than this many texels.
const MIN_SIDE: u32 = 8;

/// A repeating texture at one resolution, encoded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedFile {
    /// Its file name, without folders; only `[a-z0-9._-]`.
    pub name: Arc<str>,
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The MIME type.
    pub mime: &'static str,
    /// The encoded image.
    pub bytes: Vec<u8>,
}

/// A place for one repeating texture.
#[derive(Debug, Default)]
struct Slot {
    made: OnceLock<Result<SharedFile, String>>,
    /// True where a node refers to it as a file.
    is_file: AtomicBool,
}

/// All repeating textures of a build, by name. Whoever needs one first makes it.
#[derive(Debug, Default)]
pub struct SharedTextures {
    slots: Mutex<BTreeMap<Arc<str>, Arc<Slot>>>,
}

impl SharedTextures {
    /// An empty store.
    pub fn new() -> Self {
        Self::default()
    }

    /// The textures that nodes refer to as files, sorted by name.
    pub fn into_files(self) -> Vec<SharedFile> {
        let slots = self.slots.into_inner().unwrap_or_else(PoisonError::into_inner);
        let slots = slots.into_values().filter_map(Arc::into_inner);
        slots
            .filter(|slot| slot.is_file.load(Ordering::Relaxed))
            .filter_map(|slot| slot.made.into_inner()?.ok())
            .collect()
    }

    /// Embeds the smallest of the shared textures of a node, at most `budget` bytes of them; the
    /// others become files. Returns whether any was embedded.
    ///
    /// What a node embeds depends on that node alone, so that its bytes do not change with nodes
    /// elsewhere.
    pub(crate) fn embed(&self, mesh: &mut NodeMesh, budget: usize) -> bool {
        let shared: Vec<(usize, Arc<Slot>)> = {
            let slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            let slot = |image: &NodeImage| match &image.data {
                NodeImageData::Shared { file_name } => slots.get(file_name).cloned(),
                NodeImageData::Embedded { .. } => None,
            };
            let images = mesh.images.iter().enumerate();
            images.filter_map(|(at, image)| Some((at, slot(image)?))).collect()
        };
        let mut files: Vec<(usize, &Slot, &SharedFile)> = shared
            .iter()
            .filter_map(|(at, slot)| Some((*at, &**slot, slot.made.get()?.as_ref().ok()?)))
            .collect();
        files.sort_by_key(|(_, _, file)| (file.bytes.len(), Arc::clone(&file.name)));
        let mut left = Some(budget);
        let mut embedded = false;
        for (at, slot, file) in files {
            left = left.and_then(|left| left.checked_sub(file.bytes.len()));
            if left.is_none() {
                slot.is_file.store(true, Ordering::Relaxed);
                continue;
            }
            embedded = true;
            mesh.images[at].data = NodeImageData::Embedded {
                mime: file.mime,
                bytes: file.bytes.clone(),
                file_name: Some(Arc::clone(&file.name)),
            };
        }
        embedded
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
            let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            Arc::clone(slots.entry(Arc::clone(&name)).or_default())
        };
        let made = slot.made.get_or_init(|| {
            let size = [width as usize, height as usize];
            let channels = usize::from(image.channels);
            let encoded = if [width, height] == [image.width, image.height] {
                encode::encode(&image.pixels, size, channels, quality)
            } else {
                let scaled = level::resize_whole(image, size);
                encode::encode(&scaled.pixels, size, channels, quality)
            };
            let encode::Encoded { mime, bytes } = encoded.map_err(|error| error.to_string())?;
            Ok(SharedFile { name: Arc::clone(&name), width, height, mime, bytes })
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

    fn node(images: &[&NodeImage]) -> NodeMesh {
        let images = images.iter().map(|&image| image.clone()).collect();
        NodeMesh { origin: [0.0; 3], images, primitives: Vec::new() }
    }

    #[test]
    fn the_smallest_are_embedded_within_the_budget_and_no_others() {
        let store = SharedTextures::new();
        let source = decoded(64, 32);
        let steps = [1.0, 2.0, 4.0];
        let images = steps.map(|step| store.image("Wall.jpg", &source, step, 90).expect("encodes"));
        let bytes = {
            let mut all = node(&[&images[0], &images[1], &images[2]]);
            assert!(store.embed(&mut all, usize::MAX));
            [0, 1, 2].map(|at| match &all.images[at].data {
                NodeImageData::Embedded { bytes, .. } => bytes.len(),
                NodeImageData::Shared { .. } => panic!("not embedded"),
            })
        };
        assert!(bytes[2] < bytes[1] && bytes[1] < bytes[0]);
        let embedded = |budget: usize| {
            let mut mesh = node(&[&images[0], &images[1], &images[2]]);
            let any = store.embed(&mut mesh, budget);
            let found: Vec<usize> = (0..3)
                .filter(|&at| matches!(mesh.images[at].data, NodeImageData::Embedded { .. }))
                .collect();
            assert_eq!(any, !found.is_empty());
            // What it is does not depend on where its bytes are.
            assert!(mesh.images.iter().zip(&images).all(|(a, b)| a.repeating() == b.repeating()));
            found
        };
        assert_eq!(embedded(bytes[1] + bytes[2]), [1, 2]);
        assert_eq!(embedded(bytes[2]), [2]);
        let largest = Arc::clone(images[0].repeating().expect("repeats"));
        let middle = Arc::clone(images[1].repeating().expect("repeats"));
        let names: Vec<Arc<str>> = store.into_files().into_iter().map(|file| file.name).collect();
        assert_eq!(names, [middle, largest], "the least is a file nowhere");
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
        store.embed(&mut node(&[&first, &half]), 0);
        let files = store.into_files();
        assert_eq!(files.len(), 2);
        assert!(files[0].name < files[1].name && files[0].name.starts_with("wall-"));
        assert!(files.iter().all(|file| file.bytes.starts_with(&[0xff, 0xd8])));
    }
}
