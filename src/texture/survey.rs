//! Measurements on real data: texels against the source's, time, and pictures to look at.
//!
//! `HLOD_SURVEY=model.obj HLOD_SURVEY_OUT=folder cargo test --release -- --ignored survey --nocapture`

use std::path::Path;
use std::time::Instant;

use super::*;
use crate::format::NodeImageData;
use crate::import::decode_texture;
use crate::mesh::{Group, Material, Mesh, Model, Part, TextureData, TextureSource};

/// Reads an OBJ just well enough for measuring.
fn load(path: &Path) -> (Model, Mesh) {
    let options = tobj::LoadOptions { single_index: true, triangulate: true, ..Default::default() };
    let (objects, materials) = tobj::load_obj(path, &options).expect("reads");
    let materials = materials.expect("materials");
    let mut textures: Vec<TextureSource> = Vec::new();
    let materials: Vec<Material> = materials
        .iter()
        .map(|source| {
            let mut material = Material::plain(&source.name);
            if let Some(name) = &source.diffuse_texture {
                let index = textures.iter().position(|t| t.name == *name).unwrap_or_else(|| {
                    let data = TextureData::File(path.with_file_name(name));
                    textures.push(TextureSource { name: name.clone(), data, opacity: None });
                    textures.len() - 1
                });
                material.texture = Some(index as u32);
            }
            material
        })
        .collect();
    let mut mesh = Mesh::default();
    let mut parts = Vec::new();
    for object in objects {
        let object = object.mesh;
        let base = mesh.positions.len() as u32;
        let vertices = object.positions.len() / 3;
        let material = object.material_id.unwrap_or(0) as u32;
        let texcoords: Vec<[f32; 2]> = if object.texcoords.is_empty() {
            vec![[0.0; 2]; vertices]
        } else {
            object.texcoords.chunks(2).map(|uv| [uv[0] as f32, 1.0 - uv[1] as f32]).collect()
        };
        mesh.positions
            .extend(object.positions.chunks(3).map(|p| [p[0] as f32, p[1] as f32, p[2] as f32]));
        mesh.texcoords.extend_from_slice(&texcoords);
        mesh.materials.extend(vec![material; vertices]);
        mesh.triangles
            .extend(object.indices.chunks(3).map(|t| [t[0] + base, t[1] + base, t[2] + base]));
        parts.push(Part {
            group: 0,
            material,
            positions: object.positions.chunks(3).map(|p| [p[0], p[1], p[2]]).collect(),
            texcoords,
            colors: Vec::new(),
            indices: object.indices,
        });
    }
    let model = Model {
        source: path.into(),
        dependencies: Vec::new(),
        groups: vec![Group { name: "all".into() }],
        parts,
        materials,
        textures,
        up: None,
        warnings: Default::default(),
    };
    (model, mesh)
}

/// The piece of a mesh with these triangles.
fn piece(mesh: &Mesh, triangles: &[[u32; 3]]) -> Mesh {
    let mut remap = vec![u32::MAX; mesh.positions.len()];
    let mut result = Mesh::default();
    for triangle in triangles {
        result.triangles.push(triangle.map(|vertex| {
            let slot = &mut remap[vertex as usize];
            if *slot == u32::MAX {
                *slot = result.positions.len() as u32;
                result.positions.push(mesh.positions[vertex as usize]);
                result.texcoords.push(mesh.texcoords[vertex as usize]);
                result.materials.push(mesh.materials[vertex as usize]);
            }
            *slot
        }));
    }
    result
}

/// Cuts triangles into four along the longest side, as planes would.
fn quarter(mesh: &Mesh, mut triangles: Vec<[u32; 3]>) -> Vec<Vec<[u32; 3]>> {
    let centre = |t: &[u32; 3], axis: usize| {
        t.iter().map(|v| mesh.positions[*v as usize][axis]).sum::<f32>()
    };
    let extent = |axis: usize| {
        let values = triangles.iter().map(|t| centre(t, axis));
        values.clone().fold(f32::MIN, f32::max) - values.fold(f32::MAX, f32::min)
    };
    let axis = (0..3).max_by(|a, b| extent(*a).total_cmp(&extent(*b))).unwrap_or(0);
    triangles.sort_by(|a, b| centre(a, axis).total_cmp(&centre(b, axis)));
    triangles.chunks(triangles.len().div_ceil(4)).map(<[_]>::to_vec).collect()
}

#[test]
#[ignore = "a measurement on data of one's own"]
fn survey() {
    let Some(path) = std::env::var_os("HLOD_SURVEY") else { return };
    let out = std::env::var_os("HLOD_SURVEY_OUT");
    let (model, mesh) = load(Path::new(&path));
    let plan = TexturePlan::new(&model);
    let uses: Vec<_> = (0..model.textures.len() as u32).map(|t| plan.texture_use(t)).collect();
    println!("{} triangles, textures {uses:?}", mesh.triangles.len());

    let mut factors = vec![mesh.triangles.len() as f64 / 900.0];
    while factors[factors.len() - 1] >= 1.0 {
        factors.push(factors[factors.len() - 1] / 4.0);
    }
    if let Some(last) = factors.last_mut() {
        *last = 1.0;
    }
    let factors = texture_factors(&factors, 4.0);
    let shared = SharedTextures::new();
    let cache = TextureCache::new(&model, &plan, std::iter::once(0..model.materials.len() as u32));
    let start = Instant::now();
    for texture in &model.textures {
        decode_texture(texture).expect("decodes");
    }
    let decode = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let block = BlockTextures::prepare(&cache, &shared, &mesh, &factors, TextureOptions::default());
    println!(
        "decode alone {decode:.3} s, prepare with decoding {:.3} s",
        start.elapsed().as_secs_f64()
    );
    println!("used texels {}", block.used_texels());

    let mut pieces = vec![mesh.triangles.clone()];
    let mut total = 0;
    for (level, factor) in factors.iter().enumerate() {
        let meshes: Vec<Mesh> = pieces.iter().map(|triangles| piece(&mesh, triangles)).collect();
        let start = Instant::now();
        let nodes: Vec<TexturedNode> = meshes
            .iter()
            .map(|mesh| block.node_mesh(mesh, &[], level, [0.0; 3]).expect("builds"))
            .collect();
        let seconds = start.elapsed().as_secs_f64();
        let texels: u64 = nodes.iter().map(|node| node.own_texels).sum();
        total += texels;
        println!(
            "level {level} factor {factor:.2}: {} nodes, {texels} texels, ×{:.3} of its share, {seconds:.3} s, {:.0} Mpx/s",
            nodes.len(),
            texels as f64 * factor / block.used_texels().max(1) as f64,
            texels as f64 / seconds / 1e6
        );
        if let Some(out) = &out {
            for (index, node) in nodes.iter().enumerate().step_by(nodes.len().div_ceil(6)) {
                for (page, image) in node.mesh.images.iter().enumerate() {
                    if let NodeImageData::Embedded { bytes, .. } = &image.data {
                        let name = format!("l{level}_n{index}_p{page}.png");
                        let picture = image::load_from_memory(bytes).expect("decodes");
                        picture.save(Path::new(out).join(name)).expect("writes");
                    }
                }
            }
        }
        pieces = pieces.into_iter().flat_map(|triangles| quarter(&mesh, triangles)).collect();
    }
    println!("total ×{:.3} of the used texels", total as f64 / block.used_texels().max(1) as f64);
    drop(block);
    for file in shared.into_files() {
        println!("{} {} bytes", file.name, file.bytes.len());
    }
}
