//! The words of a statement that may be parts of file names with spaces.

use std::ops::Range;
use std::path::PathBuf;

/// Most words of a statement: the last has all that follows. Together with [`MOST_IN_NAME`], so that
/// no line can make the search for files long.
const MOST_WORDS: usize = 128;

/// Most words of a file name, unless it is all of the statement.
const MOST_IN_NAME: usize = 16;

/// The words of a statement. One in quotation marks may have spaces.
pub(super) struct Words<'a> {
    statement: &'a [u8],
    ranges: Vec<Range<usize>>,
}

impl<'a> Words<'a> {
    pub(super) fn of(statement: &'a [u8]) -> Self {
        let mut ranges = Vec::new();
        let mut at = 0;
        while let Some(blanks) = statement[at..].iter().position(|byte| *byte > b' ') {
            let start = at + blanks;
            let to_blank = |from: usize| {
                let length = statement[from..].iter().position(|byte| *byte <= b' ');
                length.map_or(statement.len(), |length| from + length)
            };
            let quoted = statement[start..].strip_prefix(b"\"").and_then(|inner| {
                let length = inner.iter().position(|byte| *byte == b'"')?;
                Some(to_blank(start + 1 + length))
            });
            at = match ranges.len() + 1 == MOST_WORDS {
                true => statement.len(),
                false => quoted.unwrap_or_else(|| to_blank(start)),
            };
            ranges.push(start..at);
        }
        Self { statement, ranges }
    }

    pub(super) fn len(&self) -> usize {
        self.ranges.len()
    }

    /// These words, at least one, as they are written.
    pub(super) fn run(&self, words: Range<usize>) -> &'a [u8] {
        &self.statement[self.ranges[words.start].start..self.ranges[words.end - 1].end]
    }

    pub(super) fn number(&self, word: usize) -> Option<f64> {
        let text = std::str::from_utf8(self.run(word..word + 1)).ok()?;
        text.parse().ok().filter(|value: &f64| value.is_finite())
    }

    /// The longest run of words from `at` on, that ends at `last` or before, for which `find` has a
    /// file: its end, and the file.
    pub(super) fn longest_file(
        &self,
        at: usize,
        last: usize,
        mut find: impl FnMut(&'a [u8]) -> Option<PathBuf>,
    ) -> Option<(usize, PathBuf)> {
        let mut ends = (at + 1..=last.min(at + MOST_IN_NAME)).rev();
        ends.find_map(|end| Some((end, find(self.run(at..end))?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_in_quotation_marks_are_one() {
        let text = b"a \"b c\"  d\"e \"f g";
        let words = Words::of(text);
        let all: Vec<&[u8]> = (0..words.len()).map(|at| words.run(at..at + 1)).collect();
        assert_eq!(all, [&b"a"[..], b"\"b c\"", b"d\"e", b"\"f", b"g"]);
        assert_eq!(words.run(0..words.len()), text);
        assert_eq!(Words::of(b" ").len(), 0);
        let many = b"a ".repeat(9999);
        let words = Words::of(&many);
        assert_eq!(words.len(), MOST_WORDS);
        assert_eq!(words.run(0..MOST_WORDS), many);
    }

    #[test]
    fn the_longest_run_that_is_a_file_is_found() {
        let words = Words::of(b"a b c d");
        let longest = |at: usize, last: usize| {
            let is_file = |name: &[u8]| [&b"a"[..], b"a b c", b"c d"].contains(&name);
            words.longest_file(at, last, |name| is_file(name).then(PathBuf::new))
        };
        let ends = [(0, 4), (0, 2), (1, 4), (2, 4)].map(|(at, last)| longest(at, last));
        assert_eq!(ends.map(|found| found.map(|(end, _)| end)), [Some(3), Some(1), None, Some(4)]);
    }
}
