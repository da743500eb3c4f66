//! The colours that the leaves' files show, read without the library's own eyes for source colours.

use std::path::Path;

use hlod::format::{NodeImageData, Primitive, TEXTURES_DIR};
use image::RgbaImage;

use crate::chain::Chain;

/// Mean sRGB colour over the area of all leaves, 0 to 255.
pub fn mean_color(chain: &Chain) -> [f64; 3] {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (index, mesh) in chain.built.meshes.iter().enumerate() {
        if !chain.built.is_leaf(index) {
            continue;
        }
        for primitive in &mesh.primitives {
            let image = primitive.surface.image.map(|image| match &mesh.images[image].data {
                NodeImageData::Embedded { bytes, .. } => image::load_from_memory(bytes).unwrap(),
                NodeImageData::Shared { file_name } => {
                    image::open(chain.out().join(TEXTURES_DIR).join(Path::new(&**file_name)))
                        .unwrap()
                }
            });
            let image = image.map(|image| image.to_rgba8());
            for corners in primitive.indices.chunks_exact(3) {
                let at =
                    |corner: u32| glam::Vec3::from(primitive.positions[corner as usize]).as_dvec3();
                let [a, b, c] = [corners[0], corners[1], corners[2]].map(at);
                let area = (b - a).cross(c - a).length();
                let color = middle(primitive, image.as_ref(), corners);
                (0..3).for_each(|channel| sum[channel] += color[channel] * area);
                total += area;
            }
        }
    }
    sum.map(|channel| channel / total)
}

/// The colour in the middle of a triangle.
fn middle(primitive: &Primitive, image: Option<&RgbaImage>, corners: &[u32]) -> [f64; 3] {
    let linear = |value: f64| match value {
        value if value <= 0.04045 => value / 12.92,
        value => ((value + 0.055) / 1.055).powf(2.4),
    };
    let encoded = |value: f64| match value {
        value if value <= 0.003_130_8 => value * 12.92,
        value => 1.055 * value.powf(1.0 / 2.4) - 0.055,
    };
    let base = [0, 1, 2].map(|channel| f64::from(primitive.surface.base_color[channel]));
    let texel = image.map_or([1.0; 3], |image| {
        let mean = |axis: usize| {
            let sum: f64 =
                corners.iter().map(|&c| f64::from(primitive.texcoords[c as usize][axis])).sum();
            (sum / 3.0).rem_euclid(1.0)
        };
        let (width, height) = image.dimensions();
        let pixel = |part: f64, size: u32| ((part * f64::from(size)) as u32).min(size - 1);
        let found = image.get_pixel(pixel(mean(0), width), pixel(mean(1), height));
        [0, 1, 2].map(|channel| linear(f64::from(found[channel]) / 255.0))
    });
    [0, 1, 2].map(|channel| 255.0 * encoded(base[channel] * texel[channel]))
}
