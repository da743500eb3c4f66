//! Where a model is, without reading all of it.

use std::path::Path;

use rayon::prelude::*;

use super::find::{Kind, kind};
use super::obj::chunks::Chunks;
use super::plain_text::PlainText;
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

/// The box around two boxes.
pub(super) fn joined(
    [low, high]: [[f64; 3]; 2],
    [other_low, other_high]: [[f64; 3]; 2],
) -> [[f64; 3]; 2] {
    [
        std::array::from_fn(|axis| low[axis].min(other_low[axis])),
        std::array::from_fn(|axis| high[axis].max(other_high[axis])),
    ]
}

fn obj_bounds(path: &Path) -> Result<[[f64; 3]; 2]> {
    let add = |all, vertex| joined(all, [vertex; 2]);
    fold_vertices(path, || NONE, add, joined)
}

/// Goes through the vertices of an OBJ, also those that no triangle has, on several threads: from `first` on
/// by `add`, and what comes of it by `join`, whose order must not matter.
pub(super) fn fold_vertices<T: Send>(
    path: &Path,
    first: impl Fn() -> T + Sync + Send,
    add: impl Fn(T, [f64; 3]) -> T + Sync,
    join: impl Fn(T, T) -> T + Sync + Send,
) -> Result<T> {
    let PlainText { head, rest } = super::open_text(path)?;
    let mut chunks = Chunks::new(head, rest, CHUNK_BYTES);
    let mut all = first();
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
        let of_texts = texts.par_iter().fold(&first, |all, text| vertices(text).fold(all, &add));
        all = join(all, of_texts.reduce(&first, &join));
    }
}

/// Of whole statements. Those that cannot be read are [`load`](super::load)'s business.
fn vertices(text: &[u8]) -> impl Iterator<Item = [f64; 3]> {
    let starts = std::iter::once(0).chain(memchr::memchr_iter(b'\n', text).map(|end| end + 1));
    let vertex = |start: usize| {
        let line = text.get(start..)?;
        let mut rest = &line[line.iter().position(|byte| !matches!(byte, b' ' | b'\t'))?..];
        if !matches!(rest, [b'v' | b'V', b' ' | b'\t', ..]) {
            return None;
        }
        rest = &rest[1..];
        // A statement may go on in the next line, behind a backslash.
        let mut words = std::iter::from_fn(|| word(&mut rest)).filter(|word| *word != b"\\");
        let vertex = [words.next()?, words.next()?, words.next()?];
        let [x, y, z] = vertex.map(number);
        Some([x?, y?, z?]).filter(|vertex| vertex.iter().all(|at| at.is_finite()))
    };
    starts.filter_map(vertex)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_are_found_wherever_chunks_end_and_nothing_else_is() {
        let text =
            b"v 1 2 3\nvt 9 9\nvn -7 -7 -7\n  v\t-1 5 2 0.5 0.5 0.5\nv 4 \\\n0 7\n# v 99 99 99\n\
            v nan 50 50\nv x y z\nf 1 2 3\no v 80 80 80\nv 0 0";
        let of = |text| vertices(text).fold(NONE, |all, vertex| joined(all, [vertex; 2]));
        assert_eq!(of(text), [[-1.0, 0.0, 2.0], [4.0, 5.0, 7.0]]);
        assert_eq!(of(b""), NONE);
    }
}
