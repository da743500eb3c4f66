//! Writes `rims.hlod`.
//!
//! ```text
//! head: see `index_file.rs`
//! number of rims u32, then each, in order of level and file
//!   level u32 · file text
//!   hashes [u8; 32]: what the ends are made of · what the rim is made of · skirts
//!   bounds [f64; 6]
//!   positions of all of it: number u32 · bytes u32 · meshoptimizer's vertex codec, 24 bytes each
//!   ends, positions, open edges, triangles: number u32 · bytes u32 · its index sequence codec, into these
//! CRC-32 u32 of all that precedes
//! ```

use rustc_hash::FxHashMap;

use super::super::index_file::IndexFile;
use super::super::sink::Sink;
use super::{KnownRim, RIMS_FILE, Rim, Rims};
use crate::{Error, Result};

pub(super) const RIMS: IndexFile = IndexFile {
    magic: *b"HLODRIM\x1a",
    version: 1,
    what: "a file of rims",
    version_of: "version of the rims",
    then: "build again",
};

/// Of meshoptimizer's vertex codec: the newest.
const VERTEX_VERSION: Option<i32> = Some(1);
const VERTEX_LEVEL: i32 = 2;

impl Rims {
    /// Their bytes as a file.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut out = RIMS.begin(0, 0);
        out.count(self.0.len())?;
        for ((level, file), known) in &self.0 {
            out.u32(*level);
            out.text(file)?;
            known.write(&mut out)?;
        }
        Ok(IndexFile::end(out))
    }
}

impl KnownRim {
    fn write(&self, out: &mut Sink) -> Result<()> {
        let Self { ends_made_of, ends, made_of, skirts, rim } = self;
        let Rim { bounds: (low, high), positions, open, triangles } = rim;
        out.0.extend(ends_made_of);
        out.0.extend(made_of);
        out.0.extend(skirts);
        out.f64s(&[*low, *high].concat());
        let mut table = Table::default();
        let sequences = [
            table.indices(ends.as_flattened()),
            table.indices(positions),
            table.indices(open.as_flattened()),
            table.indices(triangles.as_flattened()),
        ];
        table.write(out)?;
        for indices in sequences {
            let coded = meshopt::encode_index_sequence(&indices, table.positions.len());
            write_coded(out, indices.len(), coded)?;
        }
        Ok(())
    }
}

/// Positions, each once.
#[derive(Default)]
struct Table {
    positions: Vec<[f64; 3]>,
    numbers: FxHashMap<[u64; 3], u32>,
}

impl Table {
    fn indices(&mut self, positions: &[[f64; 3]]) -> Vec<u32> {
        let mut number = |&position: &[f64; 3]| {
            let next = self.positions.len() as u32;
            *self.numbers.entry(position.map(f64::to_bits)).or_insert_with(|| {
                self.positions.push(position);
                next
            })
        };
        positions.iter().map(&mut number).collect()
    }

    fn write(&self, out: &mut Sink) -> Result<()> {
        let bytes =
            |position: &[f64; 3]| -> [u8; 24] { bytemuck::cast(position.map(f64::to_le_bytes)) };
        let bytes: Vec<[u8; 24]> = self.positions.iter().map(bytes).collect();
        let coded = meshopt::encode_vertex_buffer_level(&bytes, VERTEX_LEVEL, VERTEX_VERSION);
        write_coded(out, bytes.len(), coded)
    }
}

fn write_coded(out: &mut Sink, number: usize, coded: meshopt::Result<Vec<u8>>) -> Result<()> {
    let coded = coded.map_err(|error| Error::Internal(format!("{RIMS_FILE}: {error}")))?;
    out.count(number)?;
    out.count(coded.len())?;
    out.0.extend(coded);
    Ok(())
}
