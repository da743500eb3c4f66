//! Sound files of every kind: fixtures, and what a build of one writes.

use std::io::Cursor;
use std::path::Path;

use hlod::builder::progress::Silent;
use hlod::builder::{BuildOptions, build};
use hlod::city::{self, CityOptions, TextureSize};
use hlod::format::{NODES_DIR, SCENE_FILE};
use image::{DynamicImage, GrayImage, ImageFormat, RgbImage, RgbaImage};

use crate::readers::Reader;

/// The most texels of a picture here.
pub const MOST_TEXELS: usize = 64 * 64;

fn fixture(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)).unwrap()
}

fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.into().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// Files that are read as they are; `folder` is for building some.
pub fn of(reader: Reader, folder: &Path) -> Vec<Vec<u8>> {
    let colors = RgbImage::from_fn(64, 48, |x, y| image::Rgb([x as u8 * 4, y as u8, 99]));
    match reader {
        Reader::Obj => vec![
            fixture("import/shed.obj"),
            b"v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1e6 -3\ng a b\nf 1/1 2/2 3 4\n\
              o c\nusemtl none\nf -4 -3 -2\ns 1\nl 1 2\nf 1//1 3//1 4//1\n"
                .to_vec(),
        ],
        Reader::Mtl => vec![
            fixture("import/shed.mtl"),
            b"newmtl a\nKd 0.5 0.25 1\nd 0.5\nnewmtl b\nmap_Kd -s 2 2 1 -o 0.5 0 -clamp on p.png\n"
                .to_vec(),
        ],
        Reader::Gltf => vec![embedded_gltf()],
        Reader::Glb => {
            let path = folder.join("city.glb");
            let size = TextureSize::Fixed(32, 32);
            let small = CityOptions { blocks: 1, triangles: 2_000, texture: size, ..Default::default() };
            city::write(&small, &path).unwrap();
            vec![std::fs::read(path).unwrap(), node_files(folder).swap_remove(0)]
        }
        Reader::Png => vec![
            encoded(colors, ImageFormat::Png),
            encoded(GrayImage::new(3, 5), ImageFormat::Png),
            encoded(RgbaImage::new(16, 16), ImageFormat::Png),
        ],
        Reader::Jpeg => vec![
            encoded(colors, ImageFormat::Jpeg),
            encoded(GrayImage::new(17, 9), ImageFormat::Jpeg),
        ],
        Reader::Scene => {
            node_files(folder);
            vec![fixture("bench/scene.hlod"), std::fs::read(folder.join("out").join(SCENE_FILE)).unwrap()]
        }
        Reader::Node => node_files(folder),
        Reader::Path => vec![
            fixture("bench/path.csv"),
            b"frame,time_s,x,y,z,yaw_deg,pitch_deg,roll_deg,fov_y_deg\n0,0,1,2,3,10,20,0,60\n1,0.1,1,2,4,10,20,0,60\n".to_vec(),
            b"frame,time_s,x,y,z,tx,ty,tz,fov_y_deg\n0,0,1,2,3,10,20,0,60\n".to_vec(),
        ],
        Reader::Clock => vec![fixture("bench/clock.json")],
    }
}

/// A triangle, its buffer within the text.
fn embedded_gltf() -> Vec<u8> {
    let mut buffer: Vec<u8> = Vec::new();
    for number in [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
        buffer.extend(number.to_le_bytes());
    }
    buffer.extend([0u16, 1, 2].map(u16::to_le_bytes).as_flattened());
    use base64::Engine;
    let data = base64::engine::general_purpose::STANDARD.encode(&buffer);
    let json = serde_json::json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0, "translation": [1, 2, 3], "children": [1] }, { "mesh": 0, "scale": [2, 2, 2] }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [1, 0.5, 0.25, 1] } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] },
            { "bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 36 },
            { "buffer": 0, "byteOffset": 36, "byteLength": 6 },
        ],
        "buffers": [{ "byteLength": 42, "uri": format!("data:application/octet-stream;base64,{data}") }],
    });
    json.to_string().into_bytes()
}

/// Nodes of a small city that was built, the smallest first.
fn node_files(folder: &Path) -> Vec<Vec<u8>> {
    let out = folder.join("out");
    if !out.exists() {
        let city = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/tiny_city/city.obj");
        build(&[city], &out, &BuildOptions::default(), &Silent).unwrap();
    }
    let files = std::fs::read_dir(out.join(NODES_DIR)).unwrap();
    let mut files: Vec<Vec<u8>> =
        files.map(|file| std::fs::read(file.unwrap().path()).unwrap()).collect();
    files.sort_by_key(|bytes| (bytes.len(), bytes.clone()));
    files.truncate(4);
    files
}

/// Files of which each byte becomes as much as it can.
pub fn large() -> [(Reader, Vec<u8>); 3] {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let vertices: String = (0..30_000).map(|n| format!("v {n} {} 0\n", n % 7)).collect();
    let faces: String = (1..29_998).map(|n| format!("f {n} {} {}\n", n + 1, n + 2)).collect();
    let poses: String = (0..20_000).map(|n| format!("{n},{n},1,2,3,0,0,0,1,60\n")).collect();
    [
        (Reader::Obj, format!("{corners}{}", "f 1 2 3\n".repeat(50_000)).into_bytes()),
        (Reader::Obj, format!("{vertices}{faces}").into_bytes()),
        (Reader::Path, format!("frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg\n{poses}").into_bytes()),
    ]
}
