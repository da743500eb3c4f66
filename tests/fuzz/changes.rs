//! Seeded changes of files.

use hlod::random::Random;

/// Words that readers of text stumble over, and numbers that readers of counts do.
const WORDS: [&[u8]; 22] = [
    b"nan",
    b"-inf",
    b"1e999",
    b"-1e308",
    b"1e-320",
    b"0",
    b"-0",
    b"-1",
    b"4294967295",
    b"18446744073709551616",
    b"2147483648",
    b"1e6",
    b"\"",
    b"{",
    b"]",
    b"\\\n",
    b"#",
    b"\r",
    b"\0",
    b"\xff\xfe",
    b"null",
    b"../",
];
const NUMBERS: [[u8; 4]; 8] = [
    [0; 4],
    [255; 4],
    [255, 255, 255, 127],
    [0, 0, 0, 128],
    [0, 0, 128, 127],
    [0, 0, 192, 127],
    [1, 0, 0, 0],
    [0, 0, 1, 0],
];

/// A fixed sequence of changes.
pub struct Changes(Random);

impl Changes {
    pub fn new(seed: u64) -> Self {
        Self(Random::new(seed, 0))
    }

    /// A changed copy; `others` are what parts may come from.
    pub fn apply(mut self, whole: &[u8], others: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = whole.to_vec();
        for _ in 0..1 + self.0.below(4) {
            if bytes.is_empty() {
                break;
            }
            let at = self.0.below(bytes.len());
            let length = 1 + self.0.below(64);
            let end = (at + length).min(bytes.len());
            match self.0.below(9) {
                0 => bytes[at] ^= 1 << self.0.below(8),
                1 => bytes[at] = self.0.bits() as u8,
                2 => drop(bytes.drain(at..end)),
                3 => bytes.truncate(at),
                4 => {
                    let part = bytes[at..end].to_vec();
                    let to = self.0.below(bytes.len());
                    bytes.splice(to..to, part);
                }
                5 => {
                    let other = &others[self.0.below(others.len())];
                    let from = self.0.below(other.len().max(1));
                    let part = &other[from..(from + length).min(other.len())];
                    bytes.splice(at..end, part.iter().copied());
                }
                6 => {
                    let number = NUMBERS[self.0.below(NUMBERS.len())];
                    let aligned = at / 4 * 4;
                    let room = (bytes.len() - aligned).min(4);
                    bytes[aligned..aligned + room].copy_from_slice(&number[..room]);
                }
                _ => self.word(&mut bytes, at),
            }
        }
        bytes
    }

    /// Puts another word in a word's place.
    fn word(&mut self, bytes: &mut Vec<u8>, at: usize) {
        let is_end = |byte: &u8| b" \n,:[]{}/\"".contains(byte);
        let start = bytes[..at].iter().rposition(is_end).map_or(0, |before| before + 1);
        let end = bytes[start..].iter().position(is_end).map_or(bytes.len(), |end| start + end);
        let word = WORDS[self.0.below(WORDS.len())];
        bytes.splice(start..end, word.iter().copied());
    }
}
