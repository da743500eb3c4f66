//! The contents of a file as a reader finds them, in figures that do not depend on the order of anything.

use std::collections::{BTreeMap, HashSet};
use std::hash::{BuildHasher, BuildHasherDefault};

use glam::DVec3;
use rustc_hash::{FxHashMap, FxHasher};

use super::texture::{Image, Sample, Samples};
use crate::color::linear_to_srgb;
use crate::decode::decode_texture;
use crate::mesh::{Model, Wrap};

/// The figures of one file.
pub(in crate::verify) struct Content {
    /// Triangles, fewest and most: readers may drop what is degenerate or there twice.
    pub triangles: [u64; 2],
    /// Their area, least and largest, square metres.
    pub area: [f64; 2],
    /// Least and greatest coordinates of what has area, and of all: readers may drop the rest.
    pub low: [DVec3; 2],
    pub high: [DVec3; 2],
    /// By name.
    pub materials: BTreeMap<String, MaterialContent>,
}

impl Default for Content {
    fn default() -> Self {
        Self {
            triangles: [0; 2],
            area: [0.0; 2],
            low: [DVec3::INFINITY; 2],
            high: [DVec3::NEG_INFINITY; 2],
            materials: BTreeMap::new(),
        }
    }
}

/// A material's colour counts as known where at most this share of its area is without one: what
/// is degenerate, and sums in another order.
const KNOWN: f64 = 1e-6;

/// The surface of one material.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::verify) struct MaterialContent {
    pub area: f64,
    /// Area whose colour is known, and the sum over it of area times linear light.
    colored: f64,
    light: [f64; 3],
}

impl MaterialContent {
    pub fn add(&mut self, area: f64, light: [f64; 3]) {
        self.colored += area;
        for (sum, light) in self.light.iter_mut().zip(light) {
            *sum += area * light;
        }
    }

    /// The mean colour, sRGB, 0–255; `None` where that of some of the area is not known.
    pub fn mean_color(&self) -> Option<[f64; 3]> {
        let mean = |sum: f64| linear_to_srgb(sum / self.colored) * 255.0;
        let is_known = self.colored > 0.0 && self.colored >= self.area * (1.0 - KNOWN);
        is_known.then(|| self.light.map(mean))
    }
}

impl Content {
    /// The contents as the importer found them.
    pub fn of(model: &Model) -> Self {
        let [low, high] = model.bounds().map(DVec3::from);
        let count = model.triangle_count() as u64;
        let (low, high) = ([low; 2], [high; 2]);
        let mut content = Self { triangles: [count; 2], low, high, ..Self::default() };
        let mut samples: FxHashMap<u32, Samples> = FxHashMap::default();
        for part in &model.parts {
            let material = &model.materials[part.material as usize];
            let texture = material.texture.filter(|_| !part.texcoords.is_empty());
            let factor = [0, 1, 2].map(|channel| f64::from(material.base_color[channel]));
            let of_material = content.materials.entry(material.name.clone()).or_default();
            for corners in part.indices.as_chunks::<3>().0 {
                let corners = corners.map(|vertex| vertex as usize);
                let area = area(corners.map(|vertex| DVec3::from(part.positions[vertex])));
                content.area[0] += area;
                of_material.area += area;
                let vertex_light = match &part.colors[..] {
                    [] => [1.0; 3],
                    colors => mean(corners.map(|vertex| colors[vertex])),
                };
                let light = [0, 1, 2].map(|channel| factor[channel] * vertex_light[channel]);
                match texture {
                    None => of_material.add(area, light),
                    Some(texture) => {
                        let texcoords = corners.map(|vertex| part.texcoords[vertex]);
                        let sample = Sample { texcoords, area, light };
                        samples.entry(texture).or_default().push(&material.name, sample);
                    }
                }
            }
        }
        content.area[1] = content.area[0];
        let wraps = model.materials.iter().filter_map(|m| Some((m.texture?, m.wrap)));
        let wraps: FxHashMap<u32, [Wrap; 2]> = wraps.collect();
        let mut textures: Vec<_> = samples.into_iter().collect();
        textures.sort_unstable_by_key(|&(texture, _)| texture);
        for (texture, samples) in textures {
            let Ok(decoded) = decode_texture(&model.textures[texture as usize]) else { continue };
            let image = Image {
                size: [decoded.width, decoded.height],
                channels: decoded.channels.into(),
                pixels: decoded.pixels,
            };
            samples.take(&image, wraps[&texture], &mut content.materials);
        }
        content
    }
}

/// Counts polygons, and those that are there twice.
#[derive(Default)]
pub(super) struct Polygons {
    seen: HashSet<u64, BuildHasherDefault<FxHasher>>,
    hasher: BuildHasherDefault<FxHasher>,
}

impl Polygons {
    /// Adds a polygon to what a reader found.
    pub fn add(&mut self, places: &[DVec3], material: &str, content: &mut Content) {
        if places.len() < 3 || places.iter().any(|at| !at.is_finite()) {
            return;
        }
        let [least, largest] = areas(places);
        // Two that have the same hash by chance widen what is expected, no more.
        let is_new = self.seen.insert(self.hasher.hash_one((canonical(places), material)));
        content.triangles[1] += places.len() as u64 - 2;
        content.triangles[0] += u64::from(is_new && least > 0.0);
        content.area[0] += if is_new { least } else { 0.0 };
        content.area[1] += largest;
        for of in usize::from(least <= 0.0)..2 {
            for &at in places {
                content.low[of] = content.low[of].min(at);
                content.high[of] = content.high[of].max(at);
            }
        }
    }
}

/// Least and largest area that triangles of a polygon may have. Those of a flat polygon have that of
/// Newell's normal; a bent one depends on how it is divided.
fn areas(places: &[DVec3]) -> [f64; 2] {
    if let [a, b, c] = *places {
        return [area([a, b, c]); 2];
    }
    let first = places[0];
    let fans = places.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first) * 0.5);
    let normal: DVec3 = fans.clone().sum();
    let fan: f64 = fans.map(DVec3::length).sum();
    let newell = normal.length();
    let unit = normal.normalize_or_zero();
    let bent = places.iter().map(|&at| (at - first).dot(unit).abs()).fold(0.0, f64::max);
    let next = places.iter().cycle().skip(1);
    let perimeter: f64 = places.iter().zip(next).map(|(a, b)| a.distance(*b)).sum();
    [newell, fan.max(newell + 2.0 * perimeter * bent)]
}

/// The corners from the least one on: equal where a polygon is there twice.
fn canonical(places: &[DVec3]) -> Vec<[u64; 3]> {
    let mut keys: Vec<[u64; 3]> =
        places.iter().map(|at| (*at + 0.0).to_array().map(f64::to_bits)).collect();
    let least = (0..keys.len()).min_by_key(|&at| keys[at]).unwrap_or(0);
    keys.rotate_left(least);
    keys
}

/// Area of a triangle.
pub(super) fn area([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length() * 0.5
}

fn mean(colors: [[u16; 4]; 3]) -> [f64; 3] {
    [0, 1, 2].map(|channel| {
        colors.iter().map(|color| f64::from(color[channel])).sum::<f64>() / (3.0 * 65535.0)
    })
}
