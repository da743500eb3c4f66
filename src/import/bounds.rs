//! Where a model is, without reading all of it.

use std::path::Path;

use rayon::prelude::*;

use super::find::{Kind, kind};
use super::obj::chunks::Chunks;
use super::tokens::{number, word};
use crate::{Error, Result};

/// Text that one thread looks through at a time.
const CHUNK_BYTES: usize = 1 << 20;

/// Least and greatest coordinates of a model file's vertices, also of those that no triangle has: of an OBJ
/// these are read alone, in a tenth of the time that [`load`](super::load) takes.
pub fn bounds(path: &Path) -> Result<[[f64; 3]; 2]> {
    match kind(path) {
        Some(Kind::Obj) => obj_bounds(path),
        _ => super::load(path).map(|model| model.bounds()),
    }
}

/// Of no vertex.
const NONE: [[f64; 3]; 2] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

fn joined([low, high]: [[f64; 3]; 2], [other_low, other_high]: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [
        std::array::from_fn(|axis| low[axis].min(other_low[axis])),
        std::array::from_fn(|axis| high[axis].max(other_high[axis])),
    ]
}

fn obj_bounds(path: &Path) -> Result<[[f64; 3]; 2]> {
    let mut chunks = Chunks::new(Vec::new(), super::open(path)?, CHUNK_BYTES);
    let mut all = NONE;
    loop {
        let mut texts: Vec<Vec<u8>> = Vec::new();
        while texts.len() < 2 * rayon::current_num_threads() {
            let text = chunks.next();
            match text.map_err(|error| Error::input(path, format!("cannot be read: {error}")))? {
                Some(text) => texts.push(text),
                None => break,
            }
        }
        if texts.is_empty() {
            return Ok(all);
        }
        all = joined(all, texts.par_iter().map(|text| of_text(text)).reduce(|| NONE, joined));
    }
}

/// Of whole statements. Those that cannot be read are [`load`](super::load)'s business.
fn of_text(text: &[u8]) -> [[f64; 3]; 2] {
    let starts = std::iter::once(0).chain(memchr::memchr_iter(b'\n', text).map(|end| end + 1));
    let vertex = |start: usize| {
        let line = text.get(start..)?;
        let mut rest = &line[line.iter().position(|byte| !matches!(byte, b' ' | b'\t'))?..];
        if !matches!(rest, [b'v', b' ' | b'\t', ..]) {
            return None;
        }
        rest = &rest[1..];
        // A statement may go on in the next line, behind a backslash.
        let mut words = std::iter::from_fn(|| word(&mut rest)).filter(|word| *word != b"\\");
        let vertex = [words.next()?, words.next()?, words.next()?];
        let [x, y, z] = vertex.map(number);
        Some([x?, y?, z?]).filter(|vertex| vertex.iter().all(|at| at.is_finite()))
    };
    starts.filter_map(vertex).fold(NONE, |all, vertex| joined(all, [vertex; 2]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_found_wherever_chunks_end_and_nothing_else_is() {
        let text =
            b"v 1 2 3\nvt 9 9\nvn -7 -7 -7\n  v\t-1 5 2 0.5 0.5 0.5\nv 4 \\\n0 7\n# v 99 99 99\n\
            v nan 50 50\nv x y z\nf 1 2 3\no v 80 80 80\nv 0 0";
        assert_eq!(of_text(text), [[-1.0, 0.0, 2.0], [4.0, 5.0, 7.0]]);
        assert_eq!(of_text(b""), NONE);
    }
}
