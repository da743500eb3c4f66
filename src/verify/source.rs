//! The source as it was imported: its surface and what it looks like.

use std::path::PathBuf;

use glam::DVec3;
use rayon::prelude::*;

use super::progress::Progress;
use super::seams::open_edges;
use super::second_reader::{Comparison, compare};
use super::surface_appearance::SurfaceAppearance;
use crate::import::{find_inputs, load};
use crate::lattice::Quantization;
use crate::mesh::Surface;
use crate::mesh::{Model, TextureSource, UpAxis};
use crate::place::Placement;
use crate::{Error, Result};

/// Model files, read and joined.
pub(super) struct Source {
    /// All triangles.
    pub surface: Surface,
    /// The same with vertices rounded to the lattice of a quantised scene.
    rounded: Option<Surface>,
    /// What a second reader found in the files.
    pub second_readings: Vec<Comparison>,
    models: Vec<Model>,
    parts: Vec<PartPlace>,
    /// Number of each model's first image.
    first_texture: Vec<u32>,
}

/// Where the triangles of a part begin among all.
struct PartPlace {
    first_triangle: u32,
    first_vertex: u32,
    model: u32,
    part: u32,
}

impl Source {
    /// Reads models and folders of them, as the build does of a city that stands there and with
    /// that axis up.
    pub fn load(
        arguments: &[PathBuf],
        placement: &Placement,
        up: UpAxis,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let inputs = find_inputs(arguments)?;
        progress.phase("reading the source", inputs.len() as u64 + 1);
        let (mut positions, mut triangles): (Vec<DVec3>, Vec<[u32; 3]>) = Default::default();
        let (mut models, mut parts, mut first_texture) = (Vec::new(), Vec::new(), vec![0]);
        let mut second_readings = Vec::with_capacity(inputs.len());
        for input in &inputs {
            let mut model = load(input)?;
            second_readings.push(compare(input, &model));
            placement.localise(&mut model, up)?;
            for (number, part) in (0..).zip(&mut model.parts) {
                let first_vertex = positions.len() as u32;
                parts.push(PartPlace {
                    first_triangle: triangles.len() as u32,
                    first_vertex,
                    model: models.len() as u32,
                    part: number,
                });
                positions.extend(std::mem::take(&mut part.positions).into_iter().map(DVec3::from));
                let corners = std::mem::take(&mut part.indices);
                triangles
                    .extend(corners.as_chunks::<3>().0.iter().map(|t| t.map(|v| first_vertex + v)));
                if u32::try_from(positions.len()).is_err() || triangles.len() > i32::MAX as usize {
                    return Err(Error::input(input, "more triangles than can be verified at once"));
                }
            }
            first_texture.push(first_texture[models.len()] + model.textures.len() as u32);
            models.push(model);
            progress.done(1);
        }
        let surface = Surface::new(positions, triangles);
        progress.done(1);
        Ok(Self { surface, rounded: None, second_readings, models, parts, first_texture })
    }

    /// Makes it known on what lattice the scene lies.
    pub fn round(&mut self, lattice: Quantization) {
        let rounded = |at: &DVec3| at.to_array().map(|c| lattice.round(c)).into();
        let positions = self.surface.positions().iter().map(rounded).collect();
        self.rounded = Some(Surface::new(positions, self.surface.triangles().to_vec()));
    }

    /// The surface as the scene has it: rounded where that is known.
    pub fn built(&self) -> &Surface {
        self.rounded.as_ref().unwrap_or(&self.surface)
    }

    /// The files, as given or found.
    pub fn names(&self) -> Vec<String> {
        self.models.iter().map(|model| model.source.to_string_lossy().into_owned()).collect()
    }

    /// The edges at which each model ends, model by model: those that touch are not one surface.
    pub fn open_edges(&self) -> Vec<[DVec3; 2]> {
        let first = |model: u32| {
            let range = self.parts.partition_point(|range| range.model < model);
            self.parts
                .get(range)
                .map_or((self.surface.positions().len(), self.surface.triangles().len()), |range| {
                    (range.first_vertex as usize, range.first_triangle as usize)
                })
        };
        let models: Vec<u32> = (0..self.models.len() as u32).collect();
        let edges: Vec<Vec<[DVec3; 2]>> = models
            .into_par_iter()
            .map(|model| {
                let ((vertex, triangle), (vertices, triangles)) = (first(model), first(model + 1));
                let corners = self.surface.triangles()[triangle..triangles].iter();
                open_edges(
                    &self.surface.positions()[vertex..vertices],
                    corners.map(|corners| corners.map(|corner| corner - vertex as u32)),
                )
            })
            .collect();
        edges.concat()
    }

    /// How the surface looks at a point of a triangle.
    pub fn appearance(&self, triangle: u32, weights: [f64; 3]) -> SurfaceAppearance {
        let range = self.parts.partition_point(|range| range.first_triangle <= triangle) - 1;
        let range = &self.parts[range];
        let model = &self.models[range.model as usize];
        let part = &model.parts[range.part as usize];
        let material = &model.materials[part.material as usize];
        let corners = self.surface.triangles()[triangle as usize]
            .map(|vertex| (vertex - range.first_vertex) as usize);
        let mut factor: [f64; 3] = std::array::from_fn(|i| f64::from(material.base_color[i]));
        if !part.colors.is_empty() {
            let colors = corners.map(|vertex| part.colors[vertex]);
            for (channel, factor) in factor.iter_mut().enumerate() {
                let value: f64 = (0..3).map(|i| weights[i] * f64::from(colors[i][channel])).sum();
                *factor *= value / 65535.0;
            }
        }
        let image = material
            .texture
            .filter(|_| !part.texcoords.is_empty())
            .map(|texture| self.first_texture[range.model as usize] + texture);
        let texcoord = match image {
            Some(_) => std::array::from_fn(|axis| {
                let at = |i: usize| f64::from(part.texcoords[corners[i]][axis]);
                (0..3).map(|i| weights[i] * at(i)).sum()
            }),
            None => [0.0; 2],
        };
        SurfaceAppearance { image, texcoord, wrap: material.wrap, alpha: material.alpha, factor }
    }

    /// All images, by number.
    pub fn images(&self) -> impl Iterator<Item = (u32, &TextureSource)> {
        (0..).zip(self.models.iter().flat_map(|model| &model.textures))
    }
}
