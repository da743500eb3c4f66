//! Measures what the bound on the distance between simplified chunks and the original costs and how
//! tight it is: chunks of a model, simplified to 1/4, 1/16 and 1/64 of their triangles. Processor
//! time is not told from waiting: compare numbers of one run.
//!
//! usage: measure_errors TRIANGLES MODEL...

use std::error::Error;
use std::path::Path;
use std::time::{Duration, Instant};

use hlod::builder::border::vertex::{self, Border};
use hlod::builder::constants::Constants;
use hlod::builder::error::{Below, SearchableSurface, measure};
use hlod::builder::gather::gather;
use hlod::builder::simplify::ladder::{
    AppearanceWeights, BodyPlacement, Ladder, Method, Simplifier,
};
use hlod::mesh::{Mesh, UpAxis};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [most, models @ ..] = &arguments[..] else {
        return Err("usage: measure_errors TRIANGLES MODEL...".into());
    };
    println!(
        "model | 1 of | chunks | us per triangle: original | error | bound of largest | exhausted"
    );
    for path in models {
        let model = hlod::import::load(Path::new(path))?;
        let bounds = model.bounds();
        let mesh = gather(&model.materials, &model.parts, &[]).mesh;
        let local = |p: &[f64; 3]| std::array::from_fn(|i| (p[i] - bounds[0][i]) as f32);
        let mesh = Mesh {
            positions: mesh.positions.iter().map(local).collect(),
            texcoords: mesh.texcoords,
            colors: mesh.colors,
            normals: mesh.normals,
            materials: mesh.materials,
            triangles: mesh.triangles,
        };
        let mut chunks = Vec::new();
        divide(mesh, most.parse()?, &mut chunks);
        let reorientable = vec![false; model.materials.len()];
        let extrudable: Vec<bool> =
            model.materials.iter().map(|material| material.texture.is_none()).collect();
        for ratio in [4, 16, 64] {
            let constants = Constants::default();
            let method = Method {
                simplifier: Simplifier::Qem,
                weights: AppearanceWeights::default(),
                up: model.up.unwrap_or(UpAxis::Z),
                reorientable: &reorientable,
                extrudable: &extrudable,
                without: None,
                constants: &constants,
            };
            let (mut made, mut measured) = (Duration::ZERO, Duration::ZERO);
            let (mut triangles, mut exhausted, mut tightness) = (0, 0, Vec::new());
            for chunk in &chunks {
                let border = Border::interior(chunk.positions.len());
                let target = (chunk.triangles.len() / ratio).max(8);
                let path = vertex::Path::default();
                let simplified = Ladder::new(chunk, &border, &path, 0, method)
                    .simplified(target, BodyPlacement::InPlace)
                    .mesh;
                let begin = Instant::now();
                let below = Below::source(SearchableSurface::of(chunk, constants.measure), 0.0);
                made += begin.elapsed();
                let begin = Instant::now();
                let node = SearchableSurface::of(&simplified, constants.measure);
                let none = SearchableSurface::of(&Mesh::default(), constants.measure);
                let result = measure(&below, &node, &none);
                measured += begin.elapsed();
                triangles += chunk.triangles.len();
                exhausted += usize::from(result.exhausted);
                if result.largest > 0.0 {
                    tightness.push(result.error.bound / result.largest);
                }
            }
            tightness.sort_by(f64::total_cmp);
            let each = |time: Duration| time.as_secs_f64() * 1e6 / triangles as f64;
            println!(
                "{path} | {ratio} | {} | {:.3} | {:.3} | {:.4} | {exhausted}",
                chunks.len(),
                each(made),
                each(measured),
                tightness.last().unwrap_or(&1.0),
            );
        }
    }
    Ok(())
}

/// Halves of halves, at the median along the longest side.
fn divide(mesh: Mesh, most: usize, chunks: &mut Vec<Mesh>) {
    let Some((low, high)) = mesh.bounds().filter(|_| mesh.triangles.len() > most) else {
        return chunks.push(mesh);
    };
    let size = |axis: &usize| high[*axis] - low[*axis];
    let axis = (0..3).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let mut triangles = mesh.triangles.clone();
    triangles.sort_by(|[a, ..], [b, ..]| {
        mesh.positions[*a as usize][axis].total_cmp(&mesh.positions[*b as usize][axis])
    });
    for half in triangles.chunks(triangles.len().div_ceil(2)) {
        let mut vertices = half.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |v: u32| vertices.binary_search(&v).map_or(0, |number| number as u32);
        let half = half.iter().map(|triangle| triangle.map(number)).collect();
        divide(mesh.with_vertices(&vertices, half), most, chunks);
    }
}
