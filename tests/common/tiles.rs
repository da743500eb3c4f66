//! Cuts a model into files that are squares of the ground, as photogrammetry and exports come.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use hlod::color::linear_to_srgb;
use hlod::mesh::{Model, Part, TextureData};

/// A corner: place and texture coordinate.
type Corner = ([f64; 3], [f32; 2]);

/// A triangle of a part.
type Piece = (usize, [Corner; 3]);

/// Cuts a model into `n` by `n` OBJ files in `dir`, with a material library that names the model's
/// own pictures. Each tile's coordinates are off by what `shift` says of it, in metres. Returns the files.
pub fn cut_into_tiles(
    model: &Model,
    n: usize,
    axes: [usize; 2],
    dir: &Path,
    shift: impl Fn([usize; 2]) -> [f64; 3],
) -> std::io::Result<Vec<PathBuf>> {
    std::fs::create_dir_all(dir)?;
    std::fs::write(dir.join("tiles.mtl"), library(model, dir)?)?;
    let [low, high] = model.bounds();
    let line = |axis: usize, i: usize| low[axis] + (high[axis] - low[axis]) * i as f64 / n as f64;
    let mut columns: Vec<Vec<Piece>> = vec![Vec::new(); n];
    let pieces = (0..).zip(&model.parts).flat_map(|(number, part)| pieces(number, part));
    divide(pieces.collect(), axes[0], &|i| line(axes[0], i), 0, &mut columns);
    let mut files = Vec::new();
    for (x, column) in columns.into_iter().enumerate() {
        let mut rows: Vec<Vec<Piece>> = vec![Vec::new(); n];
        divide(column, axes[1], &|i| line(axes[1], i), 0, &mut rows);
        for (y, row) in rows.into_iter().enumerate().filter(|(_, row)| !row.is_empty()) {
            let file = dir.join(format!("Tile_+{x:03}_+{y:03}.obj"));
            std::fs::write(&file, obj(model, &row, shift([x, y])))?;
            files.push(file);
        }
    }
    Ok(files)
}

fn pieces(number: usize, part: &Part) -> impl Iterator<Item = Piece> {
    part.indices.as_chunks::<3>().0.iter().map(move |corners| {
        let corner = |vertex: u32| {
            let vertex = vertex as usize;
            (part.positions[vertex], part.texcoords.get(vertex).copied().unwrap_or_default())
        };
        (number, corners.map(corner))
    })
}

/// Gives pieces to the slabs between lines across an axis; those from `first` on.
fn divide(
    pieces: Vec<Piece>,
    axis: usize,
    line: &dyn Fn(usize) -> f64,
    first: usize,
    slabs: &mut [Vec<Piece>],
) {
    let [slab, others @ ..] = slabs else { return };
    if others.is_empty() {
        *slab = pieces;
        return;
    }
    let at = line(first + 1);
    let mut beyond = Vec::new();
    for (part, corners) in pieces {
        let below = clip(&corners, axis, at, false);
        let above = clip(&corners, axis, at, true);
        // What lies in the plane goes to one side.
        let in_plane = corners.iter().all(|(position, _)| position[axis] == at);
        slab.extend(below.into_iter().map(|corners| (part, corners)));
        if !in_plane {
            beyond.extend(above.into_iter().map(|corners| (part, corners)));
        }
    }
    divide(beyond, axis, line, first + 1, others);
}

/// What is of a triangle on one side of a plane.
fn clip(corners: &[Corner; 3], axis: usize, at: f64, above: bool) -> Vec<[Corner; 3]> {
    let is_in = |corner: &Corner| match above {
        true => corner.0[axis] >= at,
        false => corner.0[axis] <= at,
    };
    let strictly = |corner: &Corner| is_in(corner) && corner.0[axis] != at;
    let in_plane = corners.iter().all(|corner| corner.0[axis] == at);
    if !corners.iter().any(strictly) && !in_plane {
        return Vec::new();
    }
    let mut polygon: Vec<Corner> = Vec::new();
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if is_in(&from) {
            polygon.push(from);
        }
        if (from.0[axis] < at && to.0[axis] > at) || (from.0[axis] > at && to.0[axis] < at) {
            polygon.push(crossing(from, to, axis, at));
        }
    }
    (1..polygon.len().saturating_sub(1)).map(|i| [polygon[0], polygon[i], polygon[i + 1]]).collect()
}

/// Where an edge meets a plane: the same for both triangles that have it.
fn crossing(one: Corner, other: Corner, axis: usize, at: f64) -> Corner {
    let (from, to) = if one.0.map(f64::to_bits) <= other.0.map(f64::to_bits) {
        (one, other)
    } else {
        (other, one)
    };
    let t = (at - from.0[axis]) / (to.0[axis] - from.0[axis]);
    let mut position: [f64; 3] = std::array::from_fn(|i| from.0[i] + (to.0[i] - from.0[i]) * t);
    position[axis] = at;
    let texcoord = std::array::from_fn(|i| from.1[i] + (to.1[i] - from.1[i]) * t as f32);
    (position, texcoord)
}

fn obj(model: &Model, pieces: &[Piece], shift: [f64; 3]) -> String {
    let mut text = String::from("mtllib tiles.mtl\n");
    let mut faces = String::new();
    let mut numbers: BTreeMap<[u64; 3], usize> = BTreeMap::new();
    let mut texcoords = 0;
    let mut last = None;
    for &(part, corners) in pieces {
        let Part { group, material, .. } = model.parts[part];
        if last != Some(part) {
            let (group, material) =
                (&model.groups[group as usize].name, &model.materials[material as usize].name);
            let _ = writeln!(faces, "g {group}\nusemtl {material}");
            last = Some(part);
        }
        faces.push('f');
        for (position, [u, v]) in corners {
            let next = numbers.len() + 1;
            let number = *numbers.entry(position.map(f64::to_bits)).or_insert(next);
            if number == next {
                let [x, y, z]: [f64; 3] = std::array::from_fn(|i| position[i] + shift[i]);
                let _ = writeln!(text, "v {x} {y} {z}");
            }
            texcoords += 1;
            let _ = writeln!(text, "vt {u} {}", 1.0 - f64::from(v));
            let _ = write!(faces, " {number}/{texcoords}");
        }
        faces.push('\n');
    }
    text + &faces
}

fn library(model: &Model, dir: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    for material in &model.materials {
        let [r, g, b, a] = material.base_color;
        let [r, g, b] = [r, g, b].map(|linear| linear_to_srgb(linear.into()));
        let _ = writeln!(text, "newmtl {}\nKd {r} {g} {b}\nd {a}", material.name);
        let Some(texture) = material.texture else { continue };
        let path = match &model.textures[texture as usize].data {
            TextureData::File(path) => std::path::absolute(path)?,
            TextureData::Embedded(bytes) => {
                let path = dir.join(format!("picture_{texture}.jpg"));
                std::fs::write(&path, bytes)?;
                std::path::absolute(path)?
            }
        };
        let _ = writeln!(text, "map_Kd {}", path.display());
    }
    Ok(text)
}
