//! A text file, statement by statement, with line numbers.

use std::borrow::Cow;
use std::io::{self, BufRead};

/// Reads statements: lines without their ending, those that end in a backslash joined with the next.
pub(super) struct Lines<R> {
    reader: R,
    buffer: Vec<u8>,
    /// Number of the line that was read last, from 1.
    last: u64,
    /// Number of the statement's first line, from 1.
    first: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(reader: R) -> Self {
        Self { reader, buffer: Vec::new(), last: 0, first: 0 }
    }

    /// The next statement with the number of its first line; `None` at the end of the file.
    pub(super) fn next(&mut self) -> io::Result<Option<(u64, &[u8])>> {
        self.buffer.clear();
        self.first = self.last + 1;
        loop {
            let start = self.buffer.len();
            if self.reader.read_until(b'\n', &mut self.buffer)? == 0 {
                if start == 0 {
                    return Ok(None);
                }
                break;
            }
            self.last += 1;
            while matches!(self.buffer[start..].last(), Some(b'\n' | b'\r')) {
                self.buffer.pop();
            }
            if self.buffer[start..].last() != Some(&b'\\') {
                break;
            }
            self.buffer.pop();
            self.buffer.push(b' ');
        }
        Ok(Some((self.first, &self.buffer)))
    }

    /// Lines read so far.
    pub(super) fn count(&self) -> u64 {
        self.last
    }
}

impl<'a> Lines<&'a [u8]> {
    /// What has not been read yet.
    pub(super) fn rest(&self) -> &'a [u8] {
        self.reader
    }

    /// Goes on at `rest`, where a line was read by other means.
    pub(super) fn go_on_at(&mut self, rest: &'a [u8]) {
        self.reader = rest;
        self.last += 1;
    }
}

/// The end of the first statement that does not end before `from`: just behind its line feed.
/// `None` where the text ends before it does.
pub(super) fn statement_end(text: &[u8], from: usize) -> Option<usize> {
    memchr::memchr_iter(b'\n', text.get(from..)?).map(|at| from + at).find_map(|at| {
        let last = text[..at].iter().rev().find(|byte| **byte != b'\r');
        (last != Some(&b'\\')).then_some(at + 1)
    })
}

/// Bytes of a text file as text: UTF-8, or where it is none Latin-1, which exporters of western
/// systems wrote for names with accents.
pub(super) fn text(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => Cow::Owned(bytes.iter().map(|byte| char::from(*byte)).collect()),
    }
}

/// Why the first bytes of a file are not those of a text file; `None` where they may be.
pub(super) fn not_text(head: &[u8]) -> Option<&'static str> {
    if head.iter().any(|byte| {
        *byte == 0
            || (*byte < 0x20 && !byte.is_ascii_whitespace() && *byte != 0x1a && *byte != 0x0b)
    }) {
        return Some("is not a text file; expected a Wavefront OBJ");
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(u64, String)> {
        let mut lines = Lines::new(text.as_bytes());
        let mut found = Vec::new();
        while let Some((number, line)) = lines.next().unwrap() {
            found.push((number, String::from_utf8(line.to_vec()).unwrap()));
        }
        found
    }

    #[test]
    fn statements_keep_the_number_of_their_first_line() {
        let found = all("v 1\r\nf 1 \\\n2 \\\r\n3\n\nend");
        let expected = [(1, "v 1"), (2, "f 1  2  3"), (5, ""), (6, "end")];
        assert_eq!(found, expected.map(|(number, line)| (number, line.to_owned())));
    }

    #[test]
    fn a_continuation_at_the_end_of_the_file_ends() {
        assert_eq!(all("f 1\\"), [(1, "f 1 ".to_owned())]);
    }

    #[test]
    fn a_statement_ends_where_its_last_line_does() {
        let text = b"v 1\r\nf 1 \\\n2 \\\r\n3\n\nend";
        let ends: Vec<_> = (0..=text.len()).map(|from| statement_end(text, from)).collect();
        let expected = [(5, Some(5)), (13, Some(18)), (1, Some(19)), (4, None)];
        let expected: Vec<_> =
            expected.iter().flat_map(|(times, end)| vec![*end; *times]).collect();
        assert_eq!(ends, expected);
        assert_eq!(statement_end(text, 99), None);
    }

    #[test]
    fn latin_1_is_understood() {
        assert_eq!(text(b"fa\xe7ade"), "façade");
        assert_eq!(text("façade".as_bytes()), "façade");
    }

    #[test]
    fn binaries_are_recognised() {
        assert!(not_text(b"\x7fELF\x02\x01\x01\x00").is_some());
        assert!(not_text("# façade\r\n\tv 0 0 0".as_bytes()).is_none());
    }
}
