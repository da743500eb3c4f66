//! The text of a tile: an OBJ of its own, but for what stands beside the file that it is of.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::sync::Arc;

use rustc_hash::FxHashMap;

use super::super::bounds::joined;
use super::division::Corner;
use crate::color::linear_to_srgb;
use crate::mesh::Normal;

/// What a file says of a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaceCorner {
    pub at: [f64; 3],
    pub texcoord: Option<[f64; 2]>,
    /// Linear light.
    pub color: Option<[u16; 4]>,
    pub normal: Option<Normal>,
    /// Numbers of its position, texture coordinate and normal, where the file has them.
    pub source: Option<[u32; 3]>,
}

impl Corner for FaceCorner {
    fn at(&self) -> [f64; 3] {
        self.at
    }

    fn between(&self, other: &Self, part: f64, at: [f64; 3]) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * part;
        let texcoords = self.texcoord.zip(other.texcoord);
        let colors = self.color.zip(other.color);
        let vector = |corner: &Self| corner.normal.and_then(Normal::vector);
        let normals = vector(self).zip(vector(other));
        Self {
            at,
            texcoord: texcoords.map(|(a, b)| [0, 1].map(|i| mix(a[i], b[i]))),
            color: colors.map(|(a, b)| {
                std::array::from_fn(|i| mix(f64::from(a[i]), f64::from(b[i])).round() as u16)
            }),
            normal: normals.map(|(a, b)| Normal::along(a.lerp(b, part))),
            source: None,
        }
    }
}

/// What faces belong to, by their numbers among all statements of the kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) struct Belongs {
    /// 0 before the first.
    pub group: usize,
    pub material: usize,
}

/// The names that all statements so far give to faces, in the encoding of the file.
#[derive(Default)]
pub(super) struct Names {
    pub libraries: Vec<Vec<u8>>,
    pub groups: Vec<Vec<u8>>,
    pub materials: Vec<Vec<u8>>,
}

/// A tile whose text is being written.
#[derive(Default)]
pub(super) struct TileText {
    /// Where its text is in the file of all tiles, piece by piece.
    pub pieces: Vec<(u64, u32)>,
    /// Least and greatest coordinates.
    pub bounds: Option<[[f64; 3]; 2]>,
    /// What is not in the file yet.
    corners: Vec<[u32; 3]>,
    faces: Vec<(u32, Belongs)>,
    positions: Vec<([f64; 3], Option<[u16; 4]>)>,
    texcoords: Vec<[f64; 2]>,
    normals: Vec<Normal>,
    known: [FxHashMap<u32, u32>; 3],
    /// What the text says so far.
    libraries: usize,
    belongs: Belongs,
}

/// No texture coordinate or normal.
pub(super) const NONE: u32 = u32::MAX;

impl TileText {
    /// Corners of faces that are not in the file yet.
    pub fn pending(&self) -> usize {
        self.corners.len()
    }

    pub fn add(&mut self, corners: &[FaceCorner], belongs: Belongs) {
        for corner in corners {
            let number = |kind: usize, known: &mut [FxHashMap<u32, u32>; 3], next: usize| {
                let new = next as u32;
                corner.source.map_or(new, |of| *known[kind].entry(of[kind]).or_insert(new))
            };
            let position = number(0, &mut self.known, self.positions.len());
            if position as usize == self.positions.len() {
                self.positions.push((corner.at, corner.color));
                let bounds = self.bounds.get_or_insert([corner.at; 2]);
                *bounds = joined(*bounds, [corner.at; 2]);
            }
            let texcoord = corner.texcoord.map_or(NONE, |texcoord| {
                let number = number(1, &mut self.known, self.texcoords.len());
                if number as usize == self.texcoords.len() {
                    self.texcoords.push(texcoord);
                }
                number
            });
            let normal = corner.normal.map_or(NONE, |normal| {
                let number = number(2, &mut self.known, self.normals.len());
                if number as usize == self.normals.len() {
                    self.normals.push(normal);
                }
                number
            });
            self.corners.push([position, texcoord, normal]);
        }
        self.faces.push((corners.len() as u32, belongs));
    }

    /// Writes what is not in the file yet to its end, which is at `end`.
    pub fn flush(&mut self, names: &Names, mut file: &File, end: &mut u64) -> io::Result<()> {
        if self.faces.is_empty() {
            return Ok(());
        }
        let text = self.text(names)?;
        let length = u32::try_from(text.len()).map_err(io::Error::other)?;
        file.seek(SeekFrom::Start(*end))?;
        file.write_all(&text)?;
        self.pieces.push((*end, length));
        *end += u64::from(length);
        self.corners.clear();
        self.faces.clear();
        self.positions.clear();
        self.texcoords.clear();
        self.normals.clear();
        self.known.iter_mut().for_each(FxHashMap::clear);
        Ok(())
    }

    fn text(&mut self, names: &Names) -> io::Result<Vec<u8>> {
        let mut text = Vec::with_capacity(64 * self.corners.len());
        // In the places that they have in the file, since materials are those known by then.
        for library in &names.libraries[self.libraries..] {
            text.extend([b"mtllib ", &library[..], b"\n"].concat());
        }
        self.libraries = names.libraries.len();
        for (at, color) in &self.positions {
            let [x, y, z] = at;
            write!(text, "v {x} {y} {z}")?;
            if let Some(color) = color {
                for part in &color[..3] {
                    write!(text, " {}", linear_to_srgb(f64::from(*part) / 65535.0))?;
                }
            }
            text.push(b'\n');
        }
        for [u, v] in &self.texcoords {
            writeln!(text, "vt {u} {v}")?;
        }
        for normal in &self.normals {
            // Zero where the file's has no direction. 32 bits say more than is kept.
            let [x, y, z] = normal.vector().unwrap_or_default().as_vec3().to_array();
            writeln!(text, "vn {x} {y} {z}")?;
        }
        let mut corners = self.corners.iter();
        let counts = [self.positions.len(), self.texcoords.len(), self.normals.len()]
            .map(|count| count as i64);
        for &(count, belongs) in &self.faces {
            if belongs.group != self.belongs.group {
                text.extend([b"o ", &names.groups[belongs.group - 1][..], b"\n"].concat());
            }
            if belongs.material != self.belongs.material {
                let name = &names.materials[belongs.material - 1][..];
                text.extend([b"usemtl ", name, b"\n"].concat());
            }
            self.belongs = belongs;
            text.push(b'f');
            for &[position, texcoord, normal] in corners.by_ref().take(count as usize) {
                // Counted back from the end.
                write!(text, " {}", i64::from(position) - counts[0])?;
                if texcoord != NONE {
                    write!(text, "/{}", i64::from(texcoord) - counts[1])?;
                }
                if normal != NONE {
                    let slashes = if texcoord == NONE { "//" } else { "/" };
                    write!(text, "{slashes}{}", i64::from(normal) - counts[2])?;
                }
            }
            text.push(b'\n');
        }
        Ok(text)
    }
}

/// The text of a tile, piece by piece.
pub(super) struct TileReader<'a> {
    pub file: Arc<File>,
    pub pieces: std::slice::Iter<'a, (u64, u32)>,
    /// What is left of the piece at hand.
    pub piece: (u64, u32),
}

impl Read for TileReader<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.piece.1 == 0 {
            match self.pieces.next() {
                Some(piece) => self.piece = *piece,
                None => return Ok(0),
            }
        }
        let (at, left) = &mut self.piece;
        let most = into.len().min(*left as usize);
        let count = read_at(&self.file, &mut into[..most], *at)?;
        if count == 0 && most > 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        *at += count as u64;
        *left -= count as u32;
        Ok(count)
    }
}

/// Reads from a position of a file, which other threads may do at the same time.
fn read_at(file: &File, into: &mut [u8], at: u64) -> io::Result<usize> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_at(file, into, at);
    #[cfg(windows)]
    return std::os::windows::fs::FileExt::seek_read(file, into, at);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{srgb_to_linear, unorm16};

    #[test]
    fn colours_are_the_same_once_they_were_written_and_read() {
        for part in 0..=u16::MAX {
            let text = linear_to_srgb(f64::from(part) / 65535.0).to_string();
            assert_eq!(unorm16(srgb_to_linear(text.parse().unwrap())), part);
        }
    }
}
