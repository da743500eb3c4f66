//! A vertex as the graphics card reads it.

use crate::color;
use crate::format::Primitive;

/// A vertex as the graphics card reads it, 24 bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Vertex {
    /// Metres from the node's origin.
    pub position: [f32; 3],
    /// Texture coordinate; v grows downwards. Zero without a picture.
    pub texcoord: [f32; 2],
    /// The surface's colour times the vertex's: sRGB-encoded, since 8 bits of linear light would
    /// lose the dark half of what is seen, and linear alpha. The shader decodes it before it is
    /// interpolated.
    pub color: [u8; 4],
}

/// Appends the vertices of a primitive.
pub(super) fn push_vertices(vertices: &mut Vec<Vertex>, primitive: &Primitive) {
    let base = primitive.surface.base_color;
    let plain = encoded(base);
    vertices.extend(primitive.positions.iter().enumerate().map(|(vertex, &position)| {
        let color = match primitive.colors.get(vertex) {
            Some(color) => encoded(std::array::from_fn(|channel| {
                base[channel] * f32::from(color[channel]) / 65535.0
            })),
            None => plain,
        };
        let texcoord = primitive.texcoords.get(vertex).copied().unwrap_or_default();
        Vertex { position, texcoord, color }
    }));
}

/// A linear colour as bytes: sRGB-encoded, alpha linear.
fn encoded(linear: [f32; 4]) -> [u8; 4] {
    let table = color::linear_to_byte();
    let [r, g, b] = [linear[0], linear[1], linear[2]]
        .map(|channel| table.of((channel.clamp(0.0, 1.0) * 65535.0 + 0.5) as u16));
    [r, g, b, (linear[3].clamp(0.0, 1.0) * 255.0 + 0.5) as u8]
}
