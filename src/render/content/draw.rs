//! The draws of a node: its primitives, those that look alike in one.

use std::ops::Range;

use super::held::MOST_SHORT_VERTICES;
use super::vertex::push_vertices;
use super::{Indices, Vertex};
use crate::format::{Primitive, Surface};
use crate::mesh::{AlphaMode, Wrap};

/// Where a draw's picture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum DrawPicture {
    /// None.
    None,
    /// Index into [`Content::pictures`](super::Content::pictures).
    Own(u32),
    /// Index into [`Scene::shared_textures`](crate::format::Scene::shared_textures).
    Shared(u32),
}

/// What alpha does to a draw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Nothing.
    Opaque,
    /// What has less alpha than the cutoff, 0–1, is not drawn.
    Mask {
        /// Alpha below this is a hole.
        cutoff: f32,
    },
    /// Every pixel is drawn or not by a fixed pattern, as many as alpha says ("screen door"):
    /// the result does not depend on the order of triangles.
    Screen,
}

/// Triangles that are drawn at once.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// Of [`Content::indices`](super::Content::indices).
    pub indices: Range<u32>,
    /// Its picture.
    pub picture: DrawPicture,
    /// How the picture goes on outside of 0–1 along u and v; `Repeat` without a picture.
    pub wrap: [Wrap; 2],
    /// What alpha does.
    pub alpha: Alpha,
    /// Seen from both sides.
    pub double_sided: bool,
    /// Without a picture, and shown without light all the same.
    pub is_unlit: bool,
    /// The picture is what a camera saw, and is projected from there: the depth of a vertex in that camera
    /// is the dot product of this with its position and 1. Texture coordinates alone would bend along
    /// large triangles.
    pub projection: Option<[f32; 4]>,
}

impl Draw {
    fn looks_like(&self, other: &Self) -> bool {
        self.picture == other.picture
            && self.wrap == other.wrap
            && self.alpha == other.alpha
            && self.double_sided == other.double_sided
            && self.is_unlit == other.is_unlit
            && self.projection == other.projection
    }
}

/// Puts primitives together: their vertices in the order in which they come, their triangles
/// ordered by how they look. Colour is in the vertices, so that it divides no draws. `places` are
/// the pictures of the mesh. Fails where a mesh breaks its promises.
pub(super) fn assemble(
    primitives: &[Primitive],
    places: &[DrawPicture],
) -> Result<(Vec<Vertex>, Indices, Vec<Draw>), String> {
    let vertex_count: usize = primitives.iter().map(|primitive| primitive.positions.len()).sum();
    let corner_count: usize = primitives.iter().map(|primitive| primitive.indices.len()).sum();
    if u32::try_from(vertex_count.max(corner_count)).is_err() {
        return Err(format!(
            "{vertex_count} vertices and {corner_count} corners are more than can be drawn"
        ));
    }
    let mut vertices = Vec::with_capacity(vertex_count);
    let mut order = Vec::with_capacity(primitives.len());
    for (primitive, number) in primitives.iter().zip(0..) {
        let looks = looks(&primitive.surface, places)
            .ok_or_else(|| format!("primitive {number}: its picture is missing"))?;
        let count = primitive.positions.len() as u32;
        if primitive.indices.iter().any(|index| *index >= count) {
            return Err(format!("primitive {number}: an index is out of range"));
        }
        order.push((looks, vertices.len() as u32, &primitive.indices[..]));
        push_vertices(&mut vertices, primitive);
    }
    order.sort_by_key(|(draw, ..)| sort_key(draw));

    let mut draws: Vec<Draw> = Vec::new();
    let mut end = 0;
    for (looks, _, corners) in &order {
        let range = end..end + corners.len() as u32;
        end = range.end;
        match draws.last_mut() {
            Some(last) if last.looks_like(looks) => last.indices.end = end,
            _ => draws.push(Draw { indices: range, ..looks.clone() }),
        }
    }
    let corners = order
        .iter()
        .flat_map(|&(_, first, corners)| corners.iter().map(move |corner| first + corner));
    let indices = if vertex_count as u64 <= MOST_SHORT_VERTICES {
        let mut short = Vec::with_capacity(corner_count);
        short.extend(corners.map(|corner| corner as u16));
        Indices::Short(short)
    } else {
        let mut long = Vec::with_capacity(corner_count);
        long.extend(corners);
        Indices::Long(long)
    };
    Ok((vertices, indices, draws))
}

/// An empty draw that looks like a surface.
fn looks(surface: &Surface, places: &[DrawPicture]) -> Option<Draw> {
    let picture = match surface.image {
        Some(image) => *places.get(image)?,
        None => DrawPicture::None,
    };
    let wrap = if surface.image.is_some() { surface.wrap } else { [Wrap::Repeat; 2] };
    let alpha = match surface.alpha {
        AlphaMode::Opaque => Alpha::Opaque,
        // Nothing has less alpha than none.
        AlphaMode::Mask { cutoff } if cutoff <= 0.0 => Alpha::Opaque,
        AlphaMode::Mask { cutoff } => Alpha::Mask { cutoff },
        AlphaMode::Blend => Alpha::Screen,
    };
    let double_sided = surface.double_sided;
    let is_unlit = surface.image.is_none() && surface.is_unlit;
    Some(Draw { indices: 0..0, picture, wrap, alpha, double_sided, is_unlit, projection: None })
}

/// Equal for draws that look alike. Opaque ones come first: they hide what is behind them at the
/// least cost.
fn sort_key(draw: &Draw) -> (u8, u32, DrawPicture, [u8; 2], [bool; 2]) {
    let (kind, cutoff) = match draw.alpha {
        Alpha::Opaque => (0, 0.0f32),
        Alpha::Mask { cutoff } => (1, cutoff),
        Alpha::Screen => (2, 0.0),
    };
    let wrap = draw.wrap.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    (kind, cutoff.to_bits(), draw.picture, wrap, [draw.double_sided, draw.is_unlit])
}
