//! What an index has around its contents, whatever it is of.
//!
//! ```text
//! magic [u8; 8] · version u32 · flags u32 · file length u64
//! contents
//! CRC-32 u32 of all that precedes
//! ```

use super::bytes::{Cursor, CutShort};
use super::sink::Sink;

/// Bytes of magic, version, flags and length.
const PREFIX: usize = 24;
/// Where the length of the file stands.
const LENGTH_AT: usize = 16;

/// A kind of index.
pub(super) struct IndexFile {
    /// The first bytes of every file of it, whatever its version.
    pub magic: [u8; 8],
    /// The version that this crate writes, and the only one that it reads.
    pub version: u32,
    /// For messages: it is not ….
    pub what: &'static str,
    /// For messages: what has another version, and what to do then.
    pub version_of: &'static str,
    pub then: &'static str,
}

/// Why bytes are not a whole file of a kind.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotWhole {
    #[error("not {what}: expected it to begin with {expected:02x?}, found {found:02x?}")]
    Magic { what: &'static str, expected: [u8; 8], found: Vec<u8> },
    #[error("{of}: expected {expected}, found {found}; {then}")]
    Version { of: &'static str, expected: u32, found: u32, then: &'static str },
    #[error("expected {expected} bytes, found {found}: the file is truncated or was appended to")]
    Length { expected: u64, found: usize },
    #[error("damaged: expected CRC-32 {expected:08x}, found {found:08x}")]
    Checksum { expected: u32, found: u32 },
    #[error("truncated: {0}")]
    CutShort(#[from] CutShort),
}

impl IndexFile {
    /// The first bytes of one, to which its contents are appended.
    pub fn begin(&self, flags: u32, capacity: usize) -> Sink {
        let mut out = Sink(Vec::with_capacity(PREFIX + capacity));
        out.0.extend(self.magic);
        out.u32(self.version);
        out.u32(flags);
        out.u64(0); // the length, once it is known
        out
    }

    /// A whole file, once its contents are there.
    pub fn end(out: Sink) -> Vec<u8> {
        let mut bytes = out.0;
        let length = bytes.len() as u64 + 4;
        bytes[LENGTH_AT..LENGTH_AT + 8].copy_from_slice(&length.to_le_bytes());
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        bytes
    }

    /// The flags of a file, and its contents.
    pub fn open<'a>(&self, bytes: &'a [u8]) -> Result<(u32, Cursor<'a>), NotWhole> {
        let mut prefix = Cursor::new(bytes);
        let magic = &bytes[..bytes.len().min(self.magic.len())];
        // A file that is cut within the magic is called truncated, not foreign.
        if !self.magic.starts_with(magic) || magic.is_empty() {
            let &Self { what, magic: expected, .. } = self;
            return Err(NotWhole::Magic { what, expected, found: magic.to_vec() });
        }
        prefix.take(self.magic.len() as u64, "magic")?;
        let found = prefix.u32("version")?;
        if found != self.version {
            let &Self { version: expected, version_of: of, then, .. } = self;
            return Err(NotWhole::Version { of, expected, found, then });
        }
        let flags = prefix.u32("flags")?;
        let expected = prefix.u64("file length")?;
        if expected != bytes.len() as u64 {
            return Err(NotWhole::Length { expected, found: bytes.len() });
        }
        let (body, seal) = match bytes.split_last_chunk::<4>() {
            Some((body, seal)) if body.len() >= PREFIX => (body, u32::from_le_bytes(*seal)),
            _ => {
                return Err(NotWhole::Length { expected: PREFIX as u64 + 4, found: bytes.len() });
            }
        };
        let found = crc32fast::hash(body);
        if found != seal {
            return Err(NotWhole::Checksum { expected: seal, found });
        }
        let mut contents = Cursor::new(body);
        contents.take(PREFIX as u64, "header")?;
        Ok((flags, contents))
    }
}

/// Changed contents of a file, with its length and checksum set right.
#[cfg(test)]
pub(super) fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.truncate(bytes.len() - 4);
    IndexFile::end(Sink(bytes))
}

/// Checks that nothing is read of a file that is cut short or damaged, and that reading ends whatever is in one
/// whose checksum is right.
#[cfg(test)]
pub(super) fn check_damage<T>(bytes: &[u8], read: impl Fn(&[u8]) -> Result<T, String>) {
    for length in 0..bytes.len() {
        assert!(read(&bytes[..length]).is_err(), "{length}");
    }
    for at in 0..bytes.len() {
        for bits in [0x10, 0x55] {
            let mut damaged = bytes.to_vec();
            damaged[at] ^= bits;
            assert!(read(&damaged).is_err(), "{at}");
            drop(read(&sealed(damaged)));
        }
    }
}
