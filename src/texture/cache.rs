//! Decoded images, shared between the blocks that use them and dropped after the last.

use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use rustc_hash::FxHashMap;

use super::level::{self, LevelImage};
use super::plan::TexturePlan;
use super::region::Region;
use crate::decode::{self, DecodedTexture};
use crate::mesh::{Model, TextureData, TextureSource, Warnings};

/// A decoded image and what names it.
#[derive(Debug)]
pub(crate) struct Decoded {
    pub image: Arc<DecodedTexture>,
    hash: OnceLock<blake3::Hash>,
    pyramid: OnceLock<Vec<LevelImage>>,
}

impl Decoded {
    pub fn new(image: DecodedTexture) -> Self {
        Self { image: Arc::new(image), hash: OnceLock::new(), pyramid: OnceLock::new() }
    }

    /// The whole image and its halves down to a single texel, which comes first.
    pub fn pyramid(&self) -> &[LevelImage] {
        self.pyramid.get_or_init(|| {
            let size = [self.image.width, self.image.height].map(|side| side as usize);
            let region = Region { origin: [0; 2], size, covered: None };
            level::pyramid(Arc::clone(&self.image), &region, f64::INFINITY)
        })
    }

    /// Of the texels and the size, so that equal images of different inputs are one.
    pub fn hash(&self) -> &blake3::Hash {
        self.hash.get_or_init(|| {
            let mut hasher = blake3::Hasher::new();
            hasher.update(&self.image.width.to_le_bytes());
            hasher.update(&self.image.height.to_le_bytes());
            hasher.update(&[self.image.channels]);
            hasher.update(&self.image.pixels);
            hasher.finalize()
        })
    }
}

/// Identifies a decoded image: its source and opacity.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct ImageKey {
    data: ImageData,
    opacity: Option<PathBuf>,
    needs_alpha: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum ImageData {
    File(PathBuf),
    /// Address of the bytes in memory. A slot keeps them alive.
    Embedded(usize),
}

impl ImageKey {
    fn of(source: &TextureSource, needs_alpha: bool) -> Self {
        let data = match &source.data {
            TextureData::File(path) => ImageData::File(path.clone()),
            TextureData::Embedded(bytes) => ImageData::Embedded(bytes.as_ptr().addr()),
        };
        Self { data, opacity: source.opacity.clone(), needs_alpha }
    }
}

/// At most so many bytes of decoded images are kept for blocks that have not taken them yet. With twice as many, a
/// scan with ten images of 192 MiB is built in 0.96 of the time, and takes 684 MB instead of 613.
const MOST_KEPT: u64 = 128 << 20;

/// The decoded images of a build. Each is decoded when the first block takes it, and let go of when all
/// that have announced themselves have taken it, or when images taken since have more bytes than are kept.
#[derive(Debug)]
pub struct DecodedImages {
    slots: Mutex<FxHashMap<ImageKey, Arc<Slot>>>,
    /// Images that some block has not taken yet, and their bytes; the one taken last comes last.
    kept: Mutex<VecDeque<(Arc<Slot>, u64)>>,
    /// See [`MOST_KEPT`].
    most_kept: u64,
}

impl Default for DecodedImages {
    fn default() -> Self {
        Self { slots: Mutex::default(), kept: Mutex::default(), most_kept: MOST_KEPT }
    }
}

/// The images that a block is going to take.
#[derive(Debug)]
pub struct Announced<'a> {
    images: &'a DecodedImages,
    /// Slot by texture; `None` for textures that are not used.
    slots: Vec<Option<(ImageKey, Arc<Slot>)>>,
    is_taken: Vec<AtomicBool>,
}

impl DecodedImages {
    /// Announces a block that uses these materials of a model (in any order, repeats allowed).
    pub fn announce(
        &self,
        model: &Model,
        plan: &TexturePlan,
        materials: impl IntoIterator<Item = u32>,
    ) -> Announced<'_> {
        let mut slots = Vec::new();
        slots.resize_with(plan.texture_count(), || None);
        let mut all = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        for texture in plan.textures_of(materials) {
            let source = &model.textures[texture as usize];
            let key = ImageKey::of(source, plan.needs_alpha(texture));
            let slot = all.entry(key.clone()).or_insert_with(|| {
                Arc::new(Slot { _source: Some(source.clone()), ..Slot::default() })
            });
            slot.takers.fetch_add(1, Ordering::Relaxed);
            slots[texture as usize] = Some((key, Arc::clone(slot)));
        }
        let is_taken = slots.iter().map(|_| AtomicBool::new(false)).collect();
        Announced { images: self, slots, is_taken }
    }

    /// One taker less. Takers are counted under the lock of all slots.
    fn leave(&self, key: &ImageKey, slot: &Slot) {
        let is_last = {
            let mut all = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
            let is_last = slot.takers.fetch_sub(1, Ordering::Relaxed) == 1;
            if is_last {
                all.remove(key);
            }
            is_last
        };
        if is_last {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            kept.retain(|(other, _)| !std::ptr::eq(&**other, slot));
            drop(kept);
            slot.forget();
        }
    }

    /// Keeps an image for the blocks that have not taken it yet.
    fn keep(&self, slot: &Arc<Slot>, bytes: u64) {
        if bytes > self.most_kept {
            return slot.forget();
        }
        let mut forgotten = Vec::new();
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(other, _)| !Arc::ptr_eq(other, slot));
        kept.push_back((Arc::clone(slot), bytes));
        let mut sum: u64 = kept.iter().map(|(_, bytes)| bytes).sum();
        while sum > self.most_kept
            && let Some((oldest, bytes)) = kept.pop_front()
        {
            sum -= bytes;
            forgotten.push(oldest);
        }
        drop(kept);
        forgotten.iter().for_each(|slot| slot.forget());
    }
}

impl Drop for Announced<'_> {
    fn drop(&mut self) {
        for (slot, is_taken) in self.slots.iter().zip(&self.is_taken) {
            if let (Some((key, slot)), false) = (slot, is_taken.load(Ordering::Relaxed)) {
                self.images.leave(key, slot);
            }
        }
    }
}

/// The images of one block.
#[derive(Debug)]
pub struct TextureCache<'a> {
    model: &'a Model,
    plan: &'a TexturePlan,
    announced: &'a Announced<'a>,
    /// Findings by texture that was decoded.
    found: Mutex<BTreeMap<u32, (Option<String>, Findings)>>,
}

#[derive(Debug, Default)]
struct Slot {
    /// Keeps embedded bytes where they are.
    _source: Option<TextureSource>,
    takers: AtomicU32,
    image: Mutex<(State, Findings)>,
}

impl Slot {
    /// Drops the image. It is decoded again when it is taken next.
    fn forget(&self) {
        let mut image = self.image.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(image.0, State::Decoded(_)) {
            image.0 = State::Waiting;
        }
    }
}

/// The faults of a decoded image.
#[derive(Clone, Copy, Debug, Default)]
struct Findings {
    /// It has an alpha channel that no material uses.
    has_unused_alpha: bool,
    /// It is a JPEG without its end.
    is_cut_short: bool,
}

#[derive(Debug, Default)]
enum State {
    #[default]
    Waiting,
    Decoded(Arc<Decoded>),
    Failed(String),
}

/// True of an OBJ, whose materials use the alpha channel of a texture where they say so.
fn is_obj(source: &Path) -> bool {
    source.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"))
}

impl<'a> TextureCache<'a> {
    /// Creates the cache of a model's announced textures. Decodes nothing yet.
    pub fn new(model: &'a Model, plan: &'a TexturePlan, announced: &'a Announced<'a>) -> Self {
        Self { model, plan, announced, found: Mutex::default() }
    }

    /// The model whose images these are.
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// What is cut up and what is kept whole.
    pub fn plan(&self) -> &'a TexturePlan {
        self.plan
    }

    /// The image, decoded now if it is not yet; `None` where it cannot be. To be called once.
    pub(crate) fn take(&self, texture: u32) -> Option<Arc<Decoded>> {
        let (key, slot) = self.announced.slots.get(texture as usize)?.as_ref()?;
        let (decoded, failed, findings) = {
            let mut image = slot.image.lock().unwrap_or_else(PoisonError::into_inner);
            if matches!(image.0, State::Waiting) {
                *image = self.decode(texture);
            }
            match &*image {
                (State::Decoded(decoded), findings) => (Some(Arc::clone(decoded)), None, *findings),
                (State::Failed(what), findings) => (None, Some(what.clone()), *findings),
                (State::Waiting, findings) => (None, None, *findings),
            }
        };
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        found.insert(texture, (failed, findings));
        drop(found);
        if let Some(decoded) = &decoded
            && slot.takers.load(Ordering::Relaxed) > 1
        {
            self.announced.images.keep(slot, decoded.image.pixels.len() as u64);
        }
        if !self.announced.is_taken[texture as usize].swap(true, Ordering::Relaxed) {
            self.announced.images.leave(key, slot);
        }
        decoded
    }

    fn decode(&self, texture: u32) -> (State, Findings) {
        let source = &self.model.textures[texture as usize];
        let (image, is_cut_short) = match decode::decode_and_check(source) {
            Ok(decoded) => decoded,
            Err(error) => return (State::Failed(error.to_string()), Findings::default()),
        };
        let bytes = image.texels() * u64::from(image.channels);
        if image.texels() == 0 || image.pixels.len() as u64 != bytes {
            let size = format!("{} × {}", image.width, image.height);
            let what = format!("{}: an image of {size} texels", source.name);
            return (State::Failed(what), Findings::default());
        }
        let is_used = self.plan.needs_alpha(texture);
        let has_alpha = image.has_transparency();
        let image = if is_used && has_alpha { image } else { image.into_opaque() };
        let findings = Findings { has_unused_alpha: has_alpha && !is_used, is_cut_short };
        (State::Decoded(Arc::new(Decoded::new(image))), findings)
    }

    /// One warning for each image that could not be decoded or is cut short, and for each of an OBJ
    /// whose alpha channel no material uses, in the model's order.
    pub fn warnings(&self) -> Warnings {
        self.warnings_of(|_| &self.model.source)
    }

    /// The same where each texture has a model of its own.
    pub fn warnings_of<'b>(&self, source_of: impl Fn(usize) -> &'b Path) -> Warnings {
        let mut warnings = Warnings::default();
        let found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        for (&texture, (failed, findings)) in &*found {
            let source = &self.model.textures[texture as usize];
            let model = source_of(texture as usize);
            if let Some(what) = failed {
                warnings.add(format!("{what}; drawn without texture"), 1);
            }
            if findings.is_cut_short {
                let what = format!(
                    "{}: texture {} is a JPEG without its end; what is missing of it is grey",
                    model.display(),
                    source.name
                );
                warnings.add(what, 1);
            }
            if findings.has_unused_alpha && is_obj(model) {
                let what = format!(
                    "{}: texture {} has transparency that its material does not use, drawn opaque; \
                     a map_d of the same file uses it",
                    model.display(),
                    source.name
                );
                warnings.add(what, 1);
            }
        }
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Material, Part};

    #[test]
    fn images_beyond_the_memory_for_them_are_decoded_again() {
        let png = |light: u8| {
            let mut bytes = std::io::Cursor::new(Vec::new());
            let image = image::RgbImage::from_pixel(8, 8, image::Rgb([light; 3]));
            image.write_to(&mut bytes, image::ImageFormat::Png).expect("encodes");
            TextureData::Embedded(bytes.into_inner().into())
        };
        let textures: Vec<TextureSource> = (0..3)
            .map(|light| TextureSource { name: light.to_string(), data: png(light), opacity: None })
            .collect();
        let materials: Vec<Material> = (0..3)
            .map(|texture| Material { texture: Some(texture), ..Material::plain("m") })
            .collect();
        let part = |material| Part {
            material,
            positions: vec![[0.0; 3]; 3],
            texcoords: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
            indices: vec![0, 1, 2],
            ..Part::default()
        };
        let parts = (0..3).map(part).collect();
        let model = Model {
            source: PathBuf::from("three.obj"),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts,
            materials,
            textures,
            up: None,
            warnings: Warnings::default(),
        };
        let plan = TexturePlan::new(&model);
        // Two blocks take three images of 192 bytes each, one by one. Returns which of them they share.
        let shared = |most_kept| {
            let images = DecodedImages { most_kept, ..DecodedImages::default() };
            let announced = [(); 2].map(|()| images.announce(&model, &plan, 0..3));
            let caches = [0, 1].map(|i| TextureCache::new(&model, &plan, &announced[i]));
            let taken = [0, 1].map(|block| {
                [0, 1, 2].map(|texture| caches[block].take(texture).expect("it is an image"))
            });
            let [one, other] = &taken;
            assert!(one.iter().zip(other).all(|(a, b)| a.image.pixels == b.image.pixels));
            assert!(images.kept.lock().expect("no panic").is_empty(), "all were taken");
            one.iter().zip(other).map(|(a, b)| Arc::ptr_eq(a, b)).collect::<Vec<_>>()
        };
        assert_eq!(shared(600), [true, true, true]);
        // The first is forgotten for the third.
        assert_eq!(shared(400), [false, true, true]);
        assert_eq!(shared(100), [false, false, false]);
    }
}
