//! Decoded images, shared between the blocks that use them and dropped after the last.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::plan::TexturePlan;
use crate::decode::{self, DecodedTexture};
use crate::mesh::{Model, Warnings};

/// A decoded image and what names it.
#[derive(Debug)]
pub(crate) struct Decoded {
    pub image: Arc<DecodedTexture>,
    hash: OnceLock<blake3::Hash>,
}

impl Decoded {
    pub fn new(image: DecodedTexture) -> Self {
        Self { image: Arc::new(image), hash: OnceLock::new() }
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

/// The images of one input. Each is decoded when the first block takes it, and let go of when
/// the last one has taken it.
#[derive(Debug)]
pub struct TextureCache<'a> {
    model: &'a Model,
    plan: &'a TexturePlan,
    slots: Vec<Mutex<Slot>>,
}

#[derive(Debug, Default)]
struct Slot {
    takers: u32,
    state: State,
    findings: Findings,
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
fn is_obj(model: &Model) -> bool {
    model.source.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"))
}

impl<'a> TextureCache<'a> {
    /// A cache for blocks that use these materials (one list a block, in any order, repeats
    /// allowed). Decodes nothing yet.
    pub fn new<M: IntoIterator<Item = u32>>(
        model: &'a Model,
        plan: &'a TexturePlan,
        blocks: impl IntoIterator<Item = M>,
    ) -> Self {
        let mut slots: Vec<Slot> = Vec::new();
        slots.resize_with(plan.texture_count(), Slot::default);
        for materials in blocks {
            for texture in plan.textures_of(materials) {
                slots[texture as usize].takers += 1;
            }
        }
        Self { model, plan, slots: slots.into_iter().map(Mutex::new).collect() }
    }

    /// The model whose images these are.
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// What is cut up and what is kept whole.
    pub fn plan(&self) -> &'a TexturePlan {
        self.plan
    }

    /// The image, decoded now if it is not yet; `None` where it cannot be. To be called once
    /// for each block that was announced.
    pub(crate) fn take(&self, texture: u32) -> Option<Arc<Decoded>> {
        let slot = self.slots.get(texture as usize)?;
        let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
        slot.takers = slot.takers.saturating_sub(1);
        if matches!(slot.state, State::Waiting) {
            (slot.state, slot.findings) = self.decode(texture);
        }
        let State::Decoded(decoded) = &slot.state else { return None };
        let decoded = Arc::clone(decoded);
        if slot.takers == 0 {
            slot.state = State::Waiting;
        }
        Some(decoded)
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
        let mut warnings = Warnings::default();
        for (slot, source) in self.slots.iter().zip(&self.model.textures) {
            let slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
            if let State::Failed(what) = &slot.state {
                warnings.add(format!("{what}; drawn without texture"), 1);
            }
            if slot.findings.is_cut_short {
                let what = format!(
                    "{}: texture {} is a JPEG without its end; what is missing of it is grey",
                    self.model.source.display(),
                    source.name
                );
                warnings.add(what, 1);
            }
            if slot.findings.has_unused_alpha && is_obj(self.model) {
                let what = format!(
                    "{}: texture {} has transparency that its material does not use, drawn opaque; \
                     a map_d of the same file uses it",
                    self.model.source.display(),
                    source.name
                );
                warnings.add(what, 1);
            }
        }
        warnings
    }
}
