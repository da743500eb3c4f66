//! Reading little-endian fields from bytes that are not trusted.

use std::fmt;

/// A field that does not fit into what remains of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CutShort {
    what: &'static str,
    at: usize,
    expected: u64,
    found: usize,
}

impl std::error::Error for CutShort {}

impl fmt::Display for CutShort {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, at, expected, found } = self;
        write!(f, "{what} at byte {at}: expected {expected} bytes, found {found} left")
    }
}

/// A place in a byte slice. Every read is bounded by the bytes that remain.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(super) fn at(&self) -> usize {
        self.at
    }

    pub(super) fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(super) fn take(&mut self, count: u64, what: &'static str) -> Result<&'a [u8], CutShort> {
        let rest = &self.bytes[self.at..];
        match usize::try_from(count).ok().and_then(|count| rest.get(..count)) {
            Some(taken) => {
                self.at += taken.len();
                Ok(taken)
            }
            None => Err(CutShort { what, at: self.at, expected: count, found: rest.len() }),
        }
    }

    pub(super) fn array<const N: usize>(
        &mut self,
        what: &'static str,
    ) -> Result<[u8; N], CutShort> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64, what)?);
        Ok(array)
    }

    pub(super) fn u32(&mut self, what: &'static str) -> Result<u32, CutShort> {
        self.array(what).map(u32::from_le_bytes)
    }

    pub(super) fn u64(&mut self, what: &'static str) -> Result<u64, CutShort> {
        self.array(what).map(u64::from_le_bytes)
    }

    pub(super) fn f32(&mut self, what: &'static str) -> Result<f32, CutShort> {
        self.array(what).map(f32::from_le_bytes)
    }

    pub(super) fn f64(&mut self, what: &'static str) -> Result<f64, CutShort> {
        self.array(what).map(f64::from_le_bytes)
    }

    pub(super) fn f64x3(&mut self, what: &'static str) -> Result<[f64; 3], CutShort> {
        Ok([self.f64(what)?, self.f64(what)?, self.f64(what)?])
    }

    /// A count of things of which each takes at least `size` bytes: refused where the bytes that
    /// remain cannot hold so many, so that it is safe to allocate for.
    pub(super) fn count(&mut self, size: usize, what: &'static str) -> Result<usize, CutShort> {
        let at = self.at;
        let count = self.u32(what)?;
        let expected = u64::from(count) * size as u64;
        if expected > self.left() as u64 {
            return Err(CutShort { what, at, expected, found: self.left() });
        }
        Ok(count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::Cursor;

    #[test]
    fn counts_are_bounded_by_what_remains() {
        let mut bytes = 3u32.to_le_bytes().to_vec();
        bytes.extend([0; 11]);
        let error = Cursor::new(&bytes).count(4, "things").unwrap_err();
        assert_eq!(error.to_string(), "things at byte 0: expected 12 bytes, found 11 left");
        bytes.push(0);
        assert_eq!(Cursor::new(&bytes).count(4, "things"), Ok(3));
    }

    #[test]
    fn reading_past_the_end_is_an_error() {
        let mut cursor = Cursor::new(&[1, 0, 0, 0, 9]);
        assert_eq!(cursor.u32("number"), Ok(1));
        assert!(cursor.u32("number").is_err());
        assert!(cursor.take(u64::MAX, "text").is_err());
        assert_eq!(cursor.take(1, "byte"), Ok(&[9][..]));
    }
}
