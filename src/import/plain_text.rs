//! Text files as the parsers expect them: bytes in which ASCII characters are ASCII bytes, without a
//! byte-order mark, with a line feed at the end of each line.
//!
//! UTF-16 becomes UTF-8. Line ends are LF or CR LF, as they are, or become LF where a file uses CR
//! alone, as classic Mac OS did. The beginning of the file decides, and the rest follows as it is
//! read; other files pass unchanged.

use std::io::{self, Cursor, Read};

use encoding_rs::{Decoder, Encoding, UTF_8, UTF_16BE, UTF_16LE};

/// Bytes at the beginning of a file that decide how it is read.
const HEAD_BYTES: u64 = 1 << 20;

/// Bytes of UTF-16 that are decoded at a time.
const DECODED_BYTES: usize = 1 << 16;

/// The mark with which some editors begin a UTF-8 text.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// A text file.
pub(super) struct PlainText<'a> {
    /// The beginning.
    pub(super) head: Vec<u8>,
    /// The bytes that follow.
    pub(super) rest: Box<dyn Read + Send + 'a>,
}

impl<'a> PlainText<'a> {
    /// The text of a file, from its first byte.
    pub(super) fn new(mut file: impl Read + Send + 'a) -> io::Result<Self> {
        let mut head = head_of(&mut file)?;
        let mut rest: Box<dyn Read + Send + 'a> = Box::new(file);
        let (encoding, mark_bytes) =
            Encoding::for_bom(&head).unwrap_or_else(|| (without_mark(&head), 0));
        head.drain(..mark_bytes);
        if encoding != UTF_8 {
            let bytes = Cursor::new(head).chain(rest);
            let mut decoded = Utf16Reader::new(bytes, encoding);
            head = head_of(&mut decoded)?;
            rest = Box::new(decoded);
        }
        if has_lone_returns(&head) {
            let mut reader = ReturnReader { reader: rest, after_return: false };
            let length = reader.convert(&mut head);
            head.truncate(length);
            rest = Box::new(reader);
        }
        Ok(Self { head, rest })
    }

    /// All of a file's bytes as text.
    pub(super) fn of_bytes(bytes: &[u8]) -> io::Result<Vec<u8>> {
        let PlainText { mut head, mut rest } = PlainText::new(bytes)?;
        rest.read_to_end(&mut head)?;
        Ok(head)
    }
}

fn head_of(reader: &mut impl Read) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    reader.take(HEAD_BYTES).read_to_end(&mut head)?;
    Ok(head)
}

/// The encoding of a text without a byte-order mark: UTF-16 where the first two characters are ASCII
/// characters of two bytes, otherwise a superset of ASCII, which the parsers need not know.
fn without_mark(head: &[u8]) -> &'static Encoding {
    match head {
        [(1..), 0, (1..), 0, ..] => UTF_16LE,
        [0, (1..), 0, (1..), ..] => UTF_16BE,
        _ => UTF_8,
    }
}

/// True where some line ends in CR without LF.
fn has_lone_returns(head: &[u8]) -> bool {
    memchr::memchr_iter(b'\r', head)
        .any(|at| head.get(at + 1).is_some_and(|next| !matches!(next, b'\n' | b'\r')))
}

/// UTF-16 as UTF-8.
struct Utf16Reader<R> {
    reader: R,
    decoder: Decoder,
    bytes: Vec<u8>,
    text: Vec<u8>,
    /// The number of bytes of `text` that were handed out.
    at: usize,
    ended: bool,
}

impl<R: Read> Utf16Reader<R> {
    fn new(reader: R, encoding: &'static Encoding) -> Self {
        let decoder = encoding.new_decoder_without_bom_handling();
        Self { reader, decoder, bytes: Vec::new(), text: Vec::new(), at: 0, ended: false }
    }
}

impl<R: Read> Read for Utf16Reader<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        while self.at == self.text.len() {
            if self.ended {
                return Ok(0);
            }
            self.bytes.resize(DECODED_BYTES, 0);
            let count = self.reader.read(&mut self.bytes)?;
            self.ended = count == 0;
            // Three bytes of UTF-8 for two of UTF-16, and what the decoder held back.
            self.text.resize(2 * count + 16, 0);
            let (_, _, written, _) =
                self.decoder.decode_to_utf8(&self.bytes[..count], &mut self.text, self.ended);
            self.text.truncate(written);
            self.at = 0;
        }
        let count = into.len().min(self.text.len() - self.at);
        into[..count].copy_from_slice(&self.text[self.at..self.at + count]);
        self.at += count;
        Ok(count)
    }
}

/// Text whose line ends are LF, CR LF or CR alone, with LF.
struct ReturnReader<R> {
    reader: R,
    /// The last byte was a CR.
    after_return: bool,
}

impl<R> ReturnReader<R> {
    /// Converts in place, and returns how many bytes are left.
    fn convert(&mut self, bytes: &mut [u8]) -> usize {
        let mut kept = 0;
        for at in 0..bytes.len() {
            let byte = bytes[at];
            if byte != b'\n' || !self.after_return {
                bytes[kept] = if byte == b'\r' { b'\n' } else { byte };
                kept += 1;
            }
            self.after_return = byte == b'\r';
        }
        kept
    }
}

impl<R: Read> Read for ReturnReader<R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        loop {
            let count = self.reader.read(into)?;
            let kept = self.convert(&mut into[..count]);
            if kept > 0 || count == 0 {
                return Ok(kept);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives a few bytes at a time.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            let count = self.1.min(into.len());
            self.0.read(&mut into[..count])
        }
    }

    fn read(bytes: &[u8]) -> Vec<u8> {
        let whole = PlainText::of_bytes(bytes).unwrap();
        for step in [1, 2, 3, 7] {
            let PlainText { mut head, mut rest } = PlainText::new(Slow(bytes, step)).unwrap();
            rest.read_to_end(&mut head).unwrap();
            assert_eq!(head, whole);
        }
        whole
    }

    fn utf16(text: &str, bytes_of: fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(bytes_of).collect()
    }

    #[test]
    fn utf_16_becomes_utf_8_with_and_without_a_mark() {
        let text = "v 1 2 3\r\nusemtl façade 大地 \u{1f3e0}\n".repeat(1500);
        for bytes_of in [u16::to_le_bytes, u16::to_be_bytes] {
            assert_eq!(read(&utf16(&text, bytes_of)), text.as_bytes());
            assert_eq!(read(&utf16(&format!("\u{feff}{text}"), bytes_of)), text.as_bytes());
        }
        assert_eq!(read(b"\xff\xfev\0"), b"v");
        assert_eq!(read(b"\xff\xfev"), "\u{fffd}".as_bytes());
    }

    #[test]
    fn lone_returns_become_line_feeds() {
        assert_eq!(read(b"v 1\rv 2\r\nv 3\nv 4\r\rv 5\r"), b"v 1\nv 2\nv 3\nv 4\n\nv 5\n");
        assert_eq!(read(&utf16("a\rb\r", u16::to_be_bytes)), b"a\nb\n");
        let long = b"v 1 2 3\r".repeat(HEAD_BYTES as usize / 4);
        assert_eq!(read(&long), b"v 1 2 3\n".repeat(HEAD_BYTES as usize / 4));
    }

    #[test]
    fn other_texts_stay_as_they_are() {
        for text in [&b"v 1\r\nv 2\r\r\n"[..], b"", b"fa\xe7ade\n", b"\0\0", b"v 1\n\r"] {
            assert_eq!(read(text), text);
        }
        assert_eq!(read(b"\xef\xbb\xbfv 1"), b"v 1");
    }
}
