//! What reads files that others wrote, each as a function of bytes that may hold anything. None may
//! panic; what is refused is refused as an input; what is accepted is sound.
//!
//! Used by the fuzz targets beside it, and by `tests/fuzz`, which runs it over seeded changes of
//! sound files.

// Each target uses one of them alone.
#![allow(dead_code)]

use std::path::Path;

use hlod::bench::ClockConstants;
use hlod::camera::{format_path, parse_path};
use hlod::format::{NodeId, NodeLabel, Scene, file_crc, read_glb, write_glb};
use hlod::mesh::{Model, UpAxis};
use hlod::{Error, Result};
use hlod::{decode, import};

/// What can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    Obj,
    Mtl,
    Gltf,
    Glb,
    Png,
    Jpeg,
    Scene,
    Node,
    Path,
    Clock,
}

impl Reader {
    pub const ALL: [Self; 10] = [
        Self::Obj,
        Self::Mtl,
        Self::Gltf,
        Self::Glb,
        Self::Png,
        Self::Jpeg,
        Self::Scene,
        Self::Node,
        Self::Path,
        Self::Clock,
    ];

    /// Reads bytes; `folder` is empty at first and may be written to. Returns true where they were
    /// accepted.
    pub fn read(self, bytes: &[u8], folder: &Path) -> bool {
        match self {
            Self::Obj => model(folder, "m.obj", bytes),
            Self::Mtl => {
                put(folder, "m.mtl", bytes);
                model(folder, "m.obj", OBJ_OF_MTL)
            }
            Self::Gltf => model(folder, "m.gltf", bytes),
            Self::Glb => model(folder, "m.glb", bytes),
            Self::Png => picture(folder, "p.png", bytes),
            Self::Jpeg => picture(folder, "p.jpg", bytes),
            Self::Scene => scene(bytes) | scene(&sealed(bytes)),
            Self::Node => node(bytes),
            Self::Path => path(bytes),
            Self::Clock => {
                put(folder, "clock.json", bytes);
                refused_or(ClockConstants::read(&folder.join("clock.json"))).is_some()
            }
        }
    }
}

const OBJ_OF_MTL: &[u8] = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n\
    usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 2/1 3/2 1/3\n";

fn put(folder: &Path, name: &str, bytes: &[u8]) {
    std::fs::write(folder.join(name), bytes).unwrap();
}

/// What was read, or nothing where it was refused as an input.
fn refused_or<T>(found: Result<T>) -> Option<T> {
    match found {
        Ok(found) => Some(found),
        Err(error @ Error::Input { .. }) => {
            assert_eq!(error.exit_code(), 3);
            assert!(!error.to_string().is_empty());
            None
        }
        Err(error) => panic!("the bytes are at fault, not {error}"),
    }
}

fn model(folder: &Path, name: &str, bytes: &[u8]) -> bool {
    put(folder, name, bytes);
    let model = refused_or(import::load(&folder.join(name)));
    model.inspect(check_model).is_some()
}

/// What [`Model`] promises.
fn check_model(model: &Model) {
    assert!(!model.parts.is_empty());
    for part in &model.parts {
        let vertices = part.positions.len();
        assert!(!part.indices.is_empty() && part.indices.len() % 3 == 0);
        assert!(part.indices.iter().all(|&at| (at as usize) < vertices));
        assert!(part.positions.as_flattened().iter().all(|c| c.is_finite()));
        assert!(part.texcoords.as_flattened().iter().all(|c| c.is_finite()));
        assert!(part.texcoords.is_empty() || part.texcoords.len() == vertices);
        assert!(part.colors.is_empty() || part.colors.len() == vertices);
        assert!((part.material as usize) < model.materials.len());
        assert!((part.group as usize) < model.groups.len());
    }
    for material in &model.materials {
        assert!(material.texture.is_none_or(|texture| (texture as usize) < model.textures.len()));
    }
}

fn picture(folder: &Path, name: &str, bytes: &[u8]) -> bool {
    put(folder, name, bytes);
    let text = format!("newmtl a\nmap_Kd {name}\nnewmtl b\nmap_Kd {name}\n");
    put(folder, "m.mtl", text.as_bytes());
    put(folder, "m.obj", OBJ_OF_MTL);
    let model = import::load(&folder.join("m.obj")).unwrap();
    let Some(texture) = model.textures.first() else { return false };
    let size = refused_or(decode::texture_size(texture));
    let decoded = refused_or(decode::decode_texture(texture));
    if let (Some(size), Some(decoded)) = (size, &decoded) {
        assert_eq!((decoded.width, decoded.height), size, "header and picture");
    }
    decoded.is_some()
}

/// The same with the checksum that belongs to it, which hides all other faults.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    let body = &bytes[..bytes.len().saturating_sub(4)];
    [body, &file_crc(body).to_le_bytes()].concat()
}

fn scene(bytes: &[u8]) -> bool {
    let scene = refused_or(Scene::from_bytes(bytes, Path::new("scene.hlod")));
    let scene = scene.inspect(|scene| {
        assert_eq!(scene.check(), []);
        // Of a name that stands twice in the parameters, which are JSON, the last one counts: what
        // was read may be written shorter, but only once.
        let written = scene.to_bytes().unwrap();
        let again = Scene::from_bytes(&written, Path::new("scene.hlod")).unwrap();
        assert!(again.to_bytes().unwrap() == written, "one scene has one file");
    });
    scene.is_some()
}

fn node(bytes: &[u8]) -> bool {
    let mesh = refused_or(read_glb(bytes, Path::new("node.glb")));
    let mesh = mesh.inspect(|mesh| {
        for primitive in &mesh.primitives {
            let vertices = primitive.positions.len();
            assert!(primitive.indices.iter().all(|&at| (at as usize) < vertices));
            assert!(primitive.surface.image.is_none_or(|image| image < mesh.images.len()));
        }
        let again = write_glb(mesh, UpAxis::Z, NodeLabel { id: NodeId(1), level: 0 });
        if let Ok(again) = again {
            assert!(read_glb(&again, Path::new("node.glb")).is_ok());
        }
    });
    mesh.is_some()
}

fn path(bytes: &[u8]) -> bool {
    let found = refused_or(parse_path(bytes, Path::new("path.csv"), UpAxis::Z));
    let found = found.inspect(|path| {
        assert!(!path.frames.is_empty());
        for frame in &path.frames {
            assert!(frame.pose.position.is_finite() && frame.pose.rotation.is_normalized());
            assert!(frame.pose.fov_y_deg > 0.0 && frame.pose.fov_y_deg < 180.0);
        }
        let mut text = Vec::new();
        format_path(path, &mut text).unwrap();
        let again = parse_path(&text[..], Path::new("path.csv"), UpAxis::Z).unwrap();
        assert_eq!(again.frames.len(), path.frames.len());
    });
    found.is_some()
}
