//! What a renderer is asked for.

/// How surfaces are lit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Shading {
    /// As node files say: pictures hold their own light and are shown as they are; what has no
    /// picture is lit from above and one side of the scene, the same from wherever it is seen.
    #[default]
    Photo,
    /// A light behind the viewer, slightly above (Cossutti, section 4.5), on everything. It
    /// brings out geometry; faces are flat, as their own planes are.
    HeadLight,
    /// Nothing is lit: colours are those of the file.
    Unlit,
}

/// What a renderer is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderOptions {
    /// Width and height of the picture in pixels, at least 1 each; 1280 × 720.
    pub size: [u32; 2],
    /// Which graphics adapter: part of its name in any case, or its number among
    /// [`adapters`](super::adapters). `None` takes the fastest kind there is: a discrete card
    /// before an integrated one, and the processor (lavapipe) last.
    pub adapter: Option<String>,
    /// How surfaces are lit; as pictures.
    pub shading: Shading,
    /// Tint nodes by their level ([`level_tint`](super::level_tint)); no.
    pub show_levels: bool,
    /// Leave away the backs of triangles whose surface is not double-sided; no. City meshes often
    /// turn their triangles as they like, and then have holes where this is asked for.
    pub cull: bool,
    /// Colour where nothing is drawn, sRGB.
    pub background: [u8; 3],
    /// Keep depths after drawing, for [`draw_over`](super::Renderer::draw_over) and
    /// [`depths`](super::Renderer::depths); no.
    pub keep_depths: bool,
    /// What of nodes is drawn where they [are cut](super::Renderer::cut_at) at a box; nodes are whole.
    pub cut: Option<Side>,
}

/// A side of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// What is in it.
    Inside,
    /// What is not.
    Outside,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            adapter: None,
            shading: Shading::default(),
            show_levels: false,
            cull: false,
            background: [178, 198, 216],
            keep_depths: false,
            cut: None,
        }
    }
}
