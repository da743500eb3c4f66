//! The values of MTL's `map_Kd` and `map_d`: `-s 2 2 1 -clamp on my facade.png`.
//!
//! The format puts options before the file name, whose end is that of the line. Exporters write them
//! behind it too, write options that the format does not define, and comments. So the file name is
//! the first run of words that is a file, the longest of those that begin at the same word.

use std::ops::Range;
use std::path::PathBuf;

use super::mtl::{FIRST_TILE, UvTransform};
use super::names::without_comment;
use super::paths::Finder;
use super::words::Words;

/// The tiles that are looked for to tell whether a name with [`UDIM`] is one of files.
const LIKELY_TILES: Range<u32> = FIRST_TILE..FIRST_TILE + 100;

/// The placeholder of a tile's number in a file name, in lower case.
const UDIM: &[u8] = b"<udim>";

/// True where a statement names a file for each UDIM tile.
pub(super) fn has_udim(statement: &[u8]) -> bool {
    udim_at(statement).is_some()
}

fn udim_at(name: &[u8]) -> Option<usize> {
    name.windows(UDIM.len()).position(|part| part.eq_ignore_ascii_case(UDIM))
}

/// A name with the number of a UDIM tile.
fn with_tile(name: &[u8], tile: u32) -> Vec<u8> {
    match udim_at(name) {
        Some(at) => [&name[..at], tile.to_string().as_bytes(), &name[at + UDIM.len()..]].concat(),
        None => name.to_vec(),
    }
}

/// A texture statement, taken apart.
#[derive(Debug, PartialEq)]
pub(super) struct TextureStatement {
    /// As it is written.
    pub(super) name: Vec<u8>,
    /// `None` where it was not found.
    pub(super) file: Option<PathBuf>,
    pub(super) transform: UvTransform,
    pub(super) is_clamped: bool,
    /// A fault in the values of `-s` or `-o`.
    pub(super) problem: Option<&'static str>,
}

/// A texture may repeat so often from one texture coordinate to the next whole one, and be moved by
/// so many repeats. f32 keeps 2^-8 of a repeat there.
const MOST_REPEATS: f64 = 65536.0;

impl TextureStatement {
    /// Takes a statement apart, with the file of a UDIM tile where its name has one for each.
    pub(super) fn of_tile(statement: &[u8], tile: Option<u32>, finder: &mut Finder) -> Self {
        let mut parsed = Self::parse(statement, finder);
        if has_udim(&parsed.name) {
            parsed.name = with_tile(&parsed.name, tile.unwrap_or(FIRST_TILE));
            parsed.file = finder.find(&parsed.name);
        }
        parsed
    }

    /// Takes a statement apart. Where its name is of UDIM tiles, the file is that of one of them.
    pub(super) fn parse(statement: &[u8], finder: &mut Finder) -> Self {
        let mut parsed = Self::taken_apart(statement, finder);
        parsed.check_transform();
        parsed
    }

    /// Ignores a transform beyond what can be sampled, and notes what hides the texture.
    fn check_transform(&mut self) {
        let UvTransform { scale, offset } = self.transform;
        if scale.iter().chain(&offset).any(|value| value.abs() > MOST_REPEATS) {
            self.transform = UvTransform::default();
            self.problem = Some("-s or -o of more than 65536, both ignored");
        } else if scale.contains(&0.0) {
            self.problem = Some("-s of 0, one row or column of it is shown");
        }
    }

    fn taken_apart(statement: &[u8], finder: &mut Finder) -> Self {
        let statement = statement.trim_ascii();
        let mut parsed = Self {
            name: statement.to_vec(),
            file: finder.as_written(statement),
            transform: UvTransform::default(),
            is_clamped: false,
            problem: None,
        };
        if parsed.file.is_some() {
            return parsed;
        }
        let words = Words::of(statement);
        let mut unknown = None;
        let mut at = 0;
        while at < words.len() {
            // Before the file is known, the last word is its name rather than an option's value.
            let values_end = words.len() - usize::from(parsed.file.is_none());
            if let Some(option) = option(&words, at).filter(|_| at < values_end) {
                at = parsed.read_option(option, &words, at + 1..values_end);
                continue;
            }
            if parsed.file.is_none()
                && let Some((end, file)) = longest_file(&words, at, finder)
            {
                parsed.name = words.run(at..end).to_vec();
                parsed.file = Some(file);
                at = end;
                continue;
            }
            if at > 0 && words.run(at..at + 1).starts_with(b"#") {
                break;
            }
            // An option that is not defined is a name only where there is nothing else.
            if unknown.is_none_or(|first| is_dashed(&words, first)) {
                unknown = Some(at);
            }
            at += 1;
        }
        if let (None, Some(first)) = (&parsed.file, unknown) {
            let name = words.run(first..next_option(&words, first + 1));
            parsed.name = without_comment(name).to_vec();
            parsed.file = finder.find(&parsed.name);
        }
        parsed
    }

    /// Reads an option's values at the beginning of these words; returns the word behind them.
    fn read_option(&mut self, option: &[u8], words: &Words, values: Range<usize>) -> usize {
        let Range { start: at, end } = values;
        let numbers = |most: usize| -> Vec<f64> {
            (at..end.min(at + most)).map_while(|word| words.number(word)).collect()
        };
        let vector = |default: f64| {
            let numbers = numbers(3);
            let [u, v] = [0, 1].map(|axis| numbers.get(axis).copied().unwrap_or(default));
            ([u, v], at + numbers.len())
        };
        let if_next = |is_value: &dyn Fn(&[u8]) -> bool| {
            at + usize::from(at < end && is_value(words.run(at..at + 1)))
        };
        let is_switch =
            |word: &[u8]| word.eq_ignore_ascii_case(b"on") || word.eq_ignore_ascii_case(b"off");
        match option {
            b"-s" => {
                let (scale, next) = vector(1.0);
                self.transform.scale = scale;
                next
            }
            b"-o" => {
                let (offset, next) = vector(0.0);
                self.transform.offset = offset;
                next
            }
            b"-t" => vector(0.0).1,
            b"-mm" => at + numbers(2).len(),
            b"-bm" | b"-boost" | b"-texres" => at + numbers(1).len(),
            b"-clamp" => {
                let next = if_next(&is_switch);
                self.is_clamped = next > at && words.run(at..next).eq_ignore_ascii_case(b"on");
                next
            }
            b"-imfchan" => if_next(&|word| word.len() == 1),
            b"-type" => if_next(&|_| true),
            _ => if_next(&is_switch),
        }
    }
}

/// Options that the format defines for texture maps.
const OPTIONS: [&[u8]; 13] = [
    b"-s",
    b"-o",
    b"-t",
    b"-clamp",
    b"-blendu",
    b"-blendv",
    b"-cc",
    b"-mm",
    b"-bm",
    b"-boost",
    b"-texres",
    b"-imfchan",
    b"-type",
];

/// The option that a word is, in lower case.
fn option(words: &Words, word: usize) -> Option<&'static [u8]> {
    let word = words.run(word..word + 1);
    OPTIONS.into_iter().find(|option| word.eq_ignore_ascii_case(option))
}

/// The first word from `at` on that is an option, or the end.
fn next_option(words: &Words, at: usize) -> usize {
    (at..words.len()).find(|&word| option(words, word).is_some()).unwrap_or(words.len())
}

/// True where a word looks like an option.
fn is_dashed(words: &Words, word: usize) -> bool {
    matches!(words.run(word..word + 1), [b'-', letter, ..] if letter.is_ascii_alphabetic())
}

/// The longest run of words from `at` on that is a file's name, or that of UDIM tiles: its end, and
/// the file.
fn longest_file(words: &Words, at: usize, finder: &mut Finder) -> Option<(usize, PathBuf)> {
    words.longest_file(at, next_option(words, at + 1), |name| {
        match (is_dashed(words, at), has_udim(name)) {
            (true, _) => finder.as_written(name),
            (false, false) => finder.existing(name),
            (false, true) => {
                LIKELY_TILES.into_iter().find_map(|tile| finder.existing(with_tile(name, tile)))
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn finder(folder: &Path, files: &[&str]) -> Finder {
        for file in files {
            std::fs::write(folder.join(file), "").unwrap();
        }
        Finder::new(&folder.join("city.obj"))
    }

    /// Name, scale, offset, clamping and file of a statement beside these files.
    fn parse(text: &str, files: &[&str]) -> (String, [f64; 2], [f64; 2], bool, Option<String>) {
        let folder = tempfile::tempdir().unwrap();
        let mut finder = finder(folder.path(), files);
        let parsed = TextureStatement::parse(text.as_bytes(), &mut finder);
        let file = parsed.file.and_then(|file| Some(file.file_name()?.to_str()?.to_owned()));
        let name = String::from_utf8(parsed.name).unwrap();
        (name, parsed.transform.scale, parsed.transform.offset, parsed.is_clamped, file)
    }

    #[test]
    fn options_are_taken_apart_also_where_the_file_is_missing() {
        let plain = |name: &str| (name.to_owned(), [1.0; 2], [0.0; 2], false, None);
        assert_eq!(parse("my facade.png", &[]), plain("my facade.png"));
        assert_eq!(parse("\"my facade.png\"", &[]), plain("\"my facade.png\""));
        assert_eq!(parse("-bm 0.5 -mm 0 1 -type sphere -imfchan m a.png", &[]), plain("a.png"));
        assert_eq!(parse("-bm a.png", &[]), plain("a.png"));
        assert_eq!(parse("-x.png", &[]), plain("-x.png"));
        assert_eq!(parse("-s", &[]), plain("-s"));
        assert_eq!(parse("a.png # brick", &[]), plain("a.png"));
        assert_eq!(parse("a.png # -s 2 3 1", &[]), plain("a.png"));
        assert_eq!(parse("a.png # was b.png", &["b.png"]), plain("a.png"));
        assert_eq!(
            parse("-CLAMP On -s 2 3 1 -o 0.5 -0.25 b c.png", &[]),
            ("b c.png".into(), [2.0, 3.0], [0.5, -0.25], true, None)
        );
        let numbered = ("6.png".into(), [2.0, 4.0], [0.0; 2], false, None);
        assert_eq!(parse("-s 2 4 5 6.png", &[]), numbered);
        assert_eq!(parse("-s 2 4 5", &[]), ("5".into(), [2.0, 4.0], [0.0; 2], false, None));
        let behind = ("b c.png".into(), [2.0, 3.0], [0.0; 2], false, None);
        assert_eq!(parse("b c.png -s 2 3 1", &[]), behind);
    }

    #[test]
    fn the_file_is_found_among_options_comments_and_spaces() {
        for (text, files, expected, scale) in [
            ("t.png -s 2 3 1", &["t.png"][..], "t.png", [2.0, 3.0]),
            ("t.png -s 2 3", &["t.png"], "t.png", [2.0, 3.0]),
            ("-s 2 3 t.png -bm 1 -clamp off", &["t.png"], "t.png", [2.0, 3.0]),
            ("-colorspace sRGB t.png", &["t.png"], "t.png", [1.0; 2]),
            ("-foo 1 -s 2 3 1 tex/my t.png", &["my t.png"], "my t.png", [2.0, 3.0]),
            ("my t.png -colorspace sRGB -s 2 3", &["my t.png"], "my t.png", [2.0, 3.0]),
            ("\"my t.png\" -s 2 3 1", &["my t.png"], "my t.png", [2.0, 3.0]),
            ("my\\ t.png -s 2 3 1", &["my t.png"], "my t.png", [2.0, 3.0]),
            ("t.png # 2", &["t.png # 2", "t.png"], "t.png # 2", [1.0; 2]),
            ("t.png # -s 2 3 1", &["t.png"], "t.png", [1.0; 2]),
            ("t.png #-s 2 3", &["t.png"], "t.png", [1.0; 2]),
            ("-s 2 3 #t.png # -s 4 5", &["#t.png"], "#t.png", [2.0, 3.0]),
            ("-s 2 3 t.png # was u.png", &["t.png", "u.png"], "t.png", [2.0, 3.0]),
            ("a -t 1.png", &["a -t 1.png", "a"], "a -t 1.png", [1.0; 2]),
            ("-x.png", &["-x.png"], "-x.png", [1.0; 2]),
            ("wall 2.png", &["wall", "wall 2.png"], "wall 2.png", [1.0; 2]),
            ("C:\\my tex\\t.png -s 2 3", &["t.png"], "t.png", [2.0, 3.0]),
        ] {
            let found = parse(text, files);
            assert_eq!((found.4.as_deref(), found.1), (Some(expected), scale), "{text}");
        }
    }

    #[test]
    fn a_statement_of_very_many_words_ends() {
        let text = "a/b ".repeat(20_000);
        assert_eq!(parse(&text, &["t.png"]).4, None);
    }

    #[test]
    fn udim_is_the_number_of_a_tile() {
        let folder = tempfile::tempdir().unwrap();
        let mut finder = finder(folder.path(), &["my t.1001.png", "my t.1012.png"]);
        let statement = b"-s 2 2 my t.<udim>.png # tiles";
        for (tile, exists) in [(None, true), (Some(1012), true), (Some(1002), false)] {
            let parsed = TextureStatement::of_tile(statement, tile, &mut finder);
            assert_eq!(parsed.file.is_some(), exists, "{tile:?}");
            assert_eq!(parsed.name, format!("my t.{}.png", tile.unwrap_or(1001)).as_bytes());
            assert_eq!(parsed.transform.scale, [2.0; 2]);
        }
    }
}
