//! OBJ and MTL.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use super::fixed::{push_fixed, push_whole};
use super::scan::{STEPS_PER_METRE, Scan, TEXCOORD_STEPS};
use super::staging::{Staging, check_replaceable, failed};
use super::summary::BlockFacts;
use super::{City, CitySummary, Jpeg, stream};
use crate::{Error, Result};

/// The colours that materials name: façades without texture, and roofs and ground. sRGB.
const FACADE_COLOR: &str = "0.78 0.74 0.68";
const ROOF_COLOR: &str = "0.55 0.55 0.57";

/// A block's mesh and texture before it is text.
struct Made {
    scan: Scan,
    jpeg: Option<Jpeg>,
}

/// The OBJ numbers of a block's first vertex and first texture coordinate.
#[derive(Clone, Copy)]
struct First {
    vertex: u64,
    texcoord: u64,
}

/// A block's text and texture, ready to be written.
struct Encoded {
    index: usize,
    text: Vec<u8>,
    jpeg: Option<Jpeg>,
    facts: BlockFacts,
}

/// Writes one file, with a group for each block.
pub(super) fn write_single(city: &City, out: &Path) -> Result<CitySummary> {
    let name = utf8_name(out.file_name(), out)?;
    let stem = utf8_name(out.file_stem(), out)?;
    let parent = out.parent().unwrap_or(Path::new(""));
    let (mtl_name, folder_name) = (format!("{stem}.mtl"), format!("{stem}_textures"));
    let mut staging = Staging::new(parent)?;
    refuse_folder(out)?;
    refuse_folder(&parent.join(&mtl_name))?;
    if city.is_textured() {
        check_replaceable(&parent.join(&folder_name), &["jpg"])?;
    }

    let folder = city.is_textured().then(|| staging.folder(&folder_name)).transpose()?;
    let mut mtl = String::new();
    for index in 0..city.len() {
        let block = city.block_name(index);
        push_material(&mut mtl, city, index, &format!("{folder_name}/{block}.jpg"));
    }
    push_roof_material(&mut mtl);
    staging.file(&mtl_name)?.write_all(mtl.as_bytes()).map_err(failed(out, "write the MTL"))?;
    let mut file = staging.file(name)?;
    let header = header(city, &mtl_name);
    file.write_all(header.as_bytes()).map_err(failed(out, "write"))?;

    let mut summary = CitySummary::new(city);
    summary.bytes = (mtl.len() + header.len()) as u64;
    let mut next = First { vertex: 1, texcoord: 1 };
    stream::in_order(
        city.len(),
        |index| make(city, index),
        |made| {
            let first = next;
            next.vertex += made.scan.positions.len() as u64;
            next.texcoord += made.scan.texcoords.len() as u64;
            first
        },
        |index, made, first| Ok(encode(city, index, made, first, String::new())),
        |block| {
            file.write_all(&block.text).map_err(failed(out, "write"))?;
            if let Some(folder) = &folder {
                write_texture(folder, city, &block)?;
            }
            count(&mut summary, &block);
            Ok(())
        },
    )?;
    staging.commit()?;
    Ok(summary)
}

/// Writes a folder with an OBJ, an MTL and a texture for each block.
pub(super) fn write_split(city: &City, out: &Path) -> Result<CitySummary> {
    let name = utf8_name(out.file_name(), out)?;
    check_replaceable(out, &["obj", "mtl", "jpg"])?;
    let mut staging = Staging::new(out.parent().unwrap_or(Path::new("")))?;
    let folder = staging.folder(name)?;
    let mut summary = CitySummary::new(city);
    stream::in_order(
        city.len(),
        |index| make(city, index),
        |_| First { vertex: 1, texcoord: 1 },
        |index, made, first| {
            let header = header(city, &format!("{}.mtl", city.block_name(index)));
            Ok(encode(city, index, made, first, header))
        },
        |block| {
            let name = city.block_name(block.index);
            let mut mtl = String::new();
            push_material(&mut mtl, city, block.index, &format!("{name}.jpg"));
            push_roof_material(&mut mtl);
            write_file(&folder.join(format!("{name}.mtl")), mtl.as_bytes())?;
            write_file(&folder.join(format!("{name}.obj")), &block.text)?;
            write_texture(&folder, city, &block)?;
            summary.bytes += mtl.len() as u64;
            count(&mut summary, &block);
            Ok(())
        },
    )?;
    staging.commit()?;
    Ok(summary)
}

fn utf8_name<'a>(name: Option<&'a std::ffi::OsStr>, out: &Path) -> Result<&'a str> {
    name.and_then(|name| name.to_str()).filter(|name| !name.contains(char::is_control)).ok_or_else(
        || Error::Usage(format!("{}: expected a printable UTF-8 file name", out.display())),
    )
}

fn refuse_folder(path: &Path) -> Result<()> {
    if path.is_dir() {
        return Err(Error::output(path, "there is a folder of that name; choose another"));
    }
    Ok(())
}

fn write_file(path: &PathBuf, bytes: &[u8]) -> Result<()> {
    File::create(path).and_then(|mut file| file.write_all(bytes)).map_err(failed(path, "write"))
}

fn write_texture(folder: &Path, city: &City, block: &Encoded) -> Result<()> {
    let Some(jpeg) = &block.jpeg else { return Ok(()) };
    let path = folder.join(format!("{}.jpg", city.block_name(block.index)));
    fs::write(&path, &jpeg.bytes).map_err(failed(&path, "write"))
}

fn count(summary: &mut CitySummary, block: &Encoded) {
    summary.bytes += block.text.len() as u64;
    summary.bytes += block.jpeg.as_ref().map_or(0, |jpeg| jpeg.bytes.len() as u64);
    summary.add(&block.facts);
}

fn make(city: &City, index: usize) -> Result<Made> {
    Ok(Made { scan: city.scan(&city.plans[index]), jpeg: city.jpeg(index)? })
}

fn header(city: &City, mtl_name: &str) -> String {
    let version = env!("CARGO_PKG_VERSION");
    let seed = city.options.seed;
    format!("# make-city {version}, seed {seed}; metres, z up\nmtllib {mtl_name}\n")
}

fn facade_material(index: usize) -> String {
    format!("facade_{index:04}")
}

fn push_material(mtl: &mut String, city: &City, index: usize, texture: &str) {
    let name = facade_material(index);
    if city.is_textured() {
        mtl.push_str(&format!("newmtl {name}\nKd 1 1 1\nmap_Kd {texture}\n\n"));
    } else {
        mtl.push_str(&format!("newmtl {name}\nKd {FACADE_COLOR}\n\n"));
    }
}

fn push_roof_material(mtl: &mut String) {
    mtl.push_str(&format!("newmtl roof_ground\nKd {ROOF_COLOR}\n"));
}

fn encode(city: &City, index: usize, made: Made, first: First, header: String) -> Encoded {
    let Made { scan, jpeg } = made;
    let origin = city.origin(&city.plans[index]);
    let facts = BlockFacts::new(origin, &scan, jpeg.as_ref());
    let mut text = header.into_bytes();
    // A vertex takes up to 40 bytes, its texture coordinate 20 and a triangle 50.
    text.reserve(scan.positions.len() * 60 + scan.triangles.len() * 50);
    text.extend_from_slice(format!("o {}\n", city.block_name(index)).as_bytes());
    let base = origin.map(|metres| metres * STEPS_PER_METRE as i64);
    for position in &scan.positions {
        text.push(b'v');
        for (steps, base) in position.iter().zip(base) {
            text.push(b' ');
            push_fixed::<2>(&mut text, base + i64::from(*steps));
        }
        text.push(b'\n');
    }
    if city.is_textured() {
        for &[u, v] in &scan.texcoords {
            text.extend_from_slice(b"vt ");
            push_fixed::<3>(&mut text, u.into());
            text.push(b' ');
            // OBJ's v grows upwards.
            push_fixed::<3>(&mut text, (TEXCOORD_STEPS - v).into());
            text.push(b'\n');
        }
    }
    let (facade, rest) = scan.triangles.split_at(scan.facade_triangles);
    text.extend_from_slice(format!("usemtl {}\n", facade_material(index)).as_bytes());
    let texcoord = city.is_textured().then_some(first.texcoord);
    facade.iter().for_each(|&triangle| push_face(&mut text, triangle, first.vertex, texcoord));
    text.extend_from_slice(b"usemtl roof_ground\n");
    rest.iter().for_each(|&triangle| push_face(&mut text, triangle, first.vertex, None));
    Encoded { index, text, jpeg, facts }
}

fn push_face(text: &mut Vec<u8>, triangle: [u32; 3], vertex: u64, texcoord: Option<u64>) {
    text.push(b'f');
    for corner in triangle {
        text.push(b' ');
        push_whole(text, vertex + u64::from(corner));
        if let Some(texcoord) = texcoord {
            text.push(b'/');
            push_whole(text, texcoord + u64::from(corner));
        }
    }
    text.push(b'\n');
}
