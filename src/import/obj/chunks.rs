//! A text in chunks of whole statements, for several threads to parse.

use std::io::{self, Read};

use super::super::lines::statement_end;

/// Read beyond a chunk's length at first, to find the end of its last statement.
const SLACK_BYTES: usize = 1 << 12;

/// Divides what a reader gives.
pub(in crate::import) struct Chunks<R> {
    reader: R,
    /// What was read and not handed out.
    text: Vec<u8>,
    bytes: usize,
    /// The reader has no more to give.
    ended: bool,
    failure: Option<io::Error>,
}

impl<R: Read> Chunks<R> {
    /// Chunks of about so many bytes of `head` and what the reader has behind it.
    pub(in crate::import) fn new(head: Vec<u8>, reader: R, bytes: usize) -> Self {
        Self { reader, text: head, bytes: bytes.max(1), ended: false, failure: None }
    }

    /// The next chunk; `None` at the end. Where reading fails, what came before is handed out
    /// first.
    pub(in crate::import) fn next(&mut self) -> io::Result<Option<Vec<u8>>> {
        let mut wanted = self.bytes + SLACK_BYTES;
        loop {
            if let Some(end) = statement_end(&self.text, self.bytes - 1) {
                let mut rest = Vec::with_capacity(self.bytes + SLACK_BYTES);
                rest.extend_from_slice(&self.text[end..]);
                self.text.truncate(end);
                return Ok(Some(std::mem::replace(&mut self.text, rest)));
            }
            if self.ended {
                let text = std::mem::take(&mut self.text);
                if !text.is_empty() {
                    return Ok(Some(text));
                }
                return self.failure.take().map_or(Ok(None), Err);
            }
            self.fill(wanted);
            wanted = self.text.len() * 2;
        }
    }

    /// Reads on until there is as much text as wanted, or no more.
    fn fill(&mut self, wanted: usize) {
        let missing = wanted.saturating_sub(self.text.len()).max(1);
        match (&mut self.reader).take(missing as u64).read_to_end(&mut self.text) {
            Ok(found) => self.ended = found < missing,
            Err(failure) => {
                // The statement in which it failed is not whole.
                let whole = memchr::memrchr(b'\n', &self.text).map_or(0, |at| at + 1);
                self.text.truncate(whole);
                (self.ended, self.failure) = (true, Some(failure));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &[u8], head: usize, bytes: usize) -> Vec<Vec<u8>> {
        let mut chunks = Chunks::new(text[..head].to_vec(), &text[head..], bytes);
        std::iter::from_fn(|| chunks.next().unwrap()).collect()
    }

    #[test]
    fn chunks_of_any_length_are_whole_statements() {
        let text = b"v 1\r\nf 1 \\\n2 \\\r\n3\n\nend";
        for head in [0, 3, 9, text.len()] {
            for bytes in 0..text.len() + 2 {
                let chunks = all(text, head, bytes);
                assert_eq!(chunks.concat(), text);
                for chunk in &chunks[..chunks.len() - 1] {
                    assert_eq!(statement_end(chunk, chunk.len() - 1), Some(chunk.len()));
                    assert!(chunk.len() >= bytes);
                }
            }
            assert_eq!(
                all(text, head, 1),
                [&b"v 1\r\n"[..], b"f 1 \\\n2 \\\r\n3\n", b"\n", b"end"]
            );
        }
        assert!(all(b"", 0, 8).is_empty());
    }

    #[test]
    fn long_statements_are_read_to_their_end() {
        let text = [b"f ".as_slice(), &b"1 \\\n".repeat(20_000), b"1\nv 0 0 0\n"].concat();
        let chunks = all(&text, 0, 16);
        assert_eq!(chunks.len(), 2);
        assert_eq!(chunks[1], b"v 0 0 0\n");
    }

    #[test]
    fn what_came_before_a_failure_is_handed_out() {
        struct Failing;
        impl Read for Failing {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::other("gone"))
            }
        }
        let mut chunks = Chunks::new(Vec::new(), b"v 1\nv 2".chain(Failing), 64);
        assert_eq!(chunks.next().unwrap().unwrap(), b"v 1\n");
        assert!(chunks.next().is_err());
    }
}
