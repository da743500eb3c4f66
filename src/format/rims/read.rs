//! Reads `rims.hlod`: nothing in it is trusted. The layout stands in `write.rs`.

use std::path::Path;

use super::super::bytes::{Cursor, CutShort};
use super::super::index_file::NotWhole;
use super::write::RIMS;
use super::{KnownRim, RIMS_FILE, Rim, Rims};
use crate::{Error, Result};

/// Bytes of a rim in which nothing is.
const RIM_SIZE: usize = 192;

/// The codecs' bytes are so many times fewer at most: that of vertices stores 16 equal bytes in 4 bits, that of
/// sequences an index in one byte.
const MOST_BLOW_UP: usize = 64;
/// Bytes beside, such as of a block's first vertex.
const HEADERS: usize = 4096;

/// Why bytes are not rims.
#[derive(Debug, thiserror::Error)]
enum Unreadable {
    #[error(transparent)]
    NotWhole(#[from] NotWhole),
    #[error("truncated: {0}")]
    CutShort(#[from] CutShort),
    #[error("expected the checksum after the last rim, found {0} bytes more")]
    Trailing(usize),
    #[error("rim {rim}: {what}")]
    Unsound { rim: usize, what: String },
}

impl Rims {
    /// Reads the rims of an output folder, which need not have any.
    pub fn read(dir: &Path) -> Result<Self> {
        let path = dir.join(RIMS_FILE);
        let bytes = crate::format::read_regular(&path)
            .map_err(|error| Error::input(&path, format!("cannot read the rims: {error}")))?;
        Self::from_bytes(&bytes, &path)
    }

    /// Reads rims from the bytes of their file; `path` is for messages only.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        contents(bytes).map_err(|why| Error::input(path, why.to_string()))
    }
}

fn contents(bytes: &[u8]) -> Result<Rims, Unreadable> {
    let (_, mut cursor) = RIMS.open(bytes)?;
    let cursor = &mut cursor;
    let mut rims = Rims::default();
    for rim in 0..cursor.count(RIM_SIZE, "number of rims")? {
        let unsound = |what: String| Unreadable::Unsound { rim, what };
        let level = cursor.u32("level")?;
        let length = cursor.count(1, "length of a file's name")?;
        let file = std::str::from_utf8(cursor.take(length as u64, "a file's name")?)
            .map_err(|error| unsound(format!("file: {error}")))?
            .to_owned();
        if rims.0.last_key_value().is_some_and(|(last, _)| (last.0, &last.1) >= (level, &file)) {
            return Err(unsound(format!("{file}: expected the order of levels and files")));
        }
        let known = known(cursor).map_err(|fault| match fault {
            Fault::CutShort(cut) => Unreadable::CutShort(cut),
            Fault::Unsound(what) => unsound(what),
        })?;
        rims.0.insert((level, file), known);
    }
    match cursor.left() {
        0 => Ok(rims),
        left => Err(Unreadable::Trailing(left)),
    }
}

/// Bytes are missing, or say what cannot be.
enum Fault {
    CutShort(CutShort),
    Unsound(String),
}

impl From<CutShort> for Fault {
    fn from(cut: CutShort) -> Self {
        Self::CutShort(cut)
    }
}

fn known(cursor: &mut Cursor<'_>) -> Result<KnownRim, Fault> {
    let ends_made_of = cursor.array("what ends are made of")?;
    let made_of = cursor.array("what a rim is made of")?;
    let skirts = cursor.array("hash of skirts")?;
    let bounds = (cursor.f64x3("bounds")?, cursor.f64x3("bounds")?);
    let (count, coded) = coded(cursor, 24, "positions")?;
    let table = meshopt::decode_vertex_buffer::<[u8; 24]>(coded, count)
        .map_err(|error| Fault::Unsound(format!("positions: {error}")))?;
    let table: Vec<[f64; 3]> = table
        .into_iter()
        .map(|bytes| bytemuck::cast::<_, [[u8; 8]; 3]>(bytes).map(f64::from_le_bytes))
        .collect();
    let ends = sequence::<2>(cursor, &table, "ends")?;
    let positions = sequence::<1>(cursor, &table, "positions")?.into_flattened();
    let open = sequence::<2>(cursor, &table, "open edges")?;
    let triangles = sequence::<3>(cursor, &table, "triangles")?;
    let rim = Rim { bounds, positions, open, triangles };
    Ok(KnownRim { ends_made_of, ends, made_of, skirts, rim })
}

fn sequence<const N: usize>(
    cursor: &mut Cursor<'_>,
    table: &[[f64; 3]],
    what: &'static str,
) -> Result<Vec<[[f64; 3]; N]>, Fault> {
    let unsound = |found: String| Fault::Unsound(format!("{what}: {found}"));
    let (count, coded) = coded(cursor, 4, what)?;
    let indices = meshopt::decode_index_sequence::<u32>(coded, count)
        .map_err(|error| unsound(error.to_string()))?;
    let at = |index: u32| {
        let outside = || unsound(format!("expected an index below {}, found {index}", table.len()));
        table.get(index as usize).copied().ok_or_else(outside)
    };
    let positions = indices.into_iter().map(at).collect::<Result<Vec<_>, _>>()?;
    match positions.as_chunks::<N>() {
        (all, []) => Ok(all.to_vec()),
        _ => Err(unsound(format!("expected a multiple of {N}, found {count}"))),
    }
}

/// How many there are of things of `size` bytes, and their codec's bytes.
fn coded<'a>(
    cursor: &mut Cursor<'a>,
    size: usize,
    what: &'static str,
) -> Result<(usize, &'a [u8]), Fault> {
    let count = cursor.u32(what)? as usize;
    let length = cursor.count(1, what)?;
    let most = length.saturating_mul(MOST_BLOW_UP).saturating_add(HEADERS);
    if count.saturating_mul(size) > most {
        return Err(Fault::Unsound(format!("{what}: {count} do not fit in {length} bytes")));
    }
    Ok((count, cursor.take(length as u64, what)?))
}
