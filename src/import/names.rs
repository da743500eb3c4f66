//! Names in text files whose encoding is unknown.
//!
//! A name is kept as the bytes that the file has. Two names that are not equal may still mean the
//! same: one may be in a code page and the other in UTF-8, in another normal form of Unicode (HFS+
//! stores decomposed characters, editors write composed ones) or in other letters' case.

use std::borrow::Cow;

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::*;
use unicode_normalization::UnicodeNormalization;

/// Encodings in which exporters of localised systems write names. The order matters only where a
/// name means something that exists in two of them.
fn code_pages() -> [&'static Encoding; 23] {
    [
        GB18030,
        SHIFT_JIS,
        BIG5,
        EUC_KR,
        EUC_JP,
        WINDOWS_1252,
        WINDOWS_1251,
        WINDOWS_1250,
        WINDOWS_1253,
        WINDOWS_1254,
        WINDOWS_1255,
        WINDOWS_1256,
        WINDOWS_1257,
        WINDOWS_1258,
        WINDOWS_874,
        KOI8_R,
        KOI8_U,
        IBM866,
        MACINTOSH,
        X_MAC_CYRILLIC,
        ISO_8859_2,
        ISO_8859_5,
        ISO_8859_7,
    ]
}

/// A way in which a name may be written elsewhere.
pub(super) struct Form<'a> {
    pub(super) name: Cow<'a, [u8]>,
    /// The encoding of the original name, where this is the original in UTF-8.
    pub(super) encoding: Option<&'static Encoding>,
}

/// The ways in which a name may be written elsewhere: as it is, decoded from a code page, and
/// encoded in one.
pub(super) fn forms(name: &[u8]) -> impl Iterator<Item = Form<'_>> {
    let original = Form { name: Cow::Borrowed(name), encoding: None };
    let pages = code_pages().into_iter().filter(|_| !name.is_ascii());
    let others = pages.flat_map(move |encoding| {
        let decoded = encoding.decode_without_bom_handling_and_without_replacement(name);
        let decoded = decoded.map(|text| Form {
            name: Cow::Owned(text.into_owned().into_bytes()),
            encoding: Some(encoding),
        });
        let encoded = std::str::from_utf8(name).ok().and_then(|text| {
            let (bytes, _, has_errors) = encoding.encode(text);
            let name = Cow::Owned(bytes.into_owned());
            (!has_errors).then_some(Form { name, encoding: None })
        });
        decoded.into_iter().chain(encoded)
    });
    std::iter::once(original).chain(others)
}

/// A name without what is no difference between names: the normal form of its characters and their
/// case. Of a name that is not UTF-8, the case of ASCII letters.
pub(super) fn folded(name: &[u8]) -> Vec<u8> {
    match std::str::from_utf8(name) {
        Ok(text) if !text.is_ascii() => {
            let lower_case: String = text.nfc().flat_map(char::to_lowercase).collect();
            lower_case.nfc().collect::<String>().into_bytes()
        }
        _ => name.to_ascii_lowercase(),
    }
}

/// A name without quotation marks around it, with `\ ` as a space.
pub(super) fn unescaped(name: &[u8]) -> Cow<'_, [u8]> {
    let name = name.trim_ascii();
    let name = match name {
        [b'"', inner @ .., b'"'] => inner,
        _ => name,
    };
    if memchr::memmem::find(name, b"\\ ").is_none() {
        return Cow::Borrowed(name);
    }
    let mut result = Vec::with_capacity(name.len());
    for (at, byte) in name.iter().enumerate() {
        if *byte != b'\\' || name.get(at + 1) != Some(&b' ') {
            result.push(*byte);
        }
    }
    Cow::Owned(result)
}

/// A name without the comment behind it: a `#` after white space.
pub(super) fn without_comment(name: &[u8]) -> &[u8] {
    let comment = (1..name.len()).find(|&at| name[at] == b'#' && name[at - 1] <= b' ');
    comment.map_or(name, |at| name[..at].trim_ascii_end())
}

/// A name as text for people: in this encoding where it can be, else as UTF-8. Names of two or three
/// bytes in a code page may be UTF-8 by chance.
pub(super) fn display(name: &[u8], encoding: Option<&'static Encoding>) -> String {
    let decoded = encoding.and_then(|encoding| {
        encoding.decode_without_bom_handling_and_without_replacement(name).map(Cow::into_owned)
    });
    let as_utf_8 = || std::str::from_utf8(name).ok().map(str::to_owned);
    decoded.or_else(as_utf_8).unwrap_or_else(|| {
        let encoding = encoding.unwrap_or(WINDOWS_1252);
        encoding.decode_without_bom_handling(name).0.into_owned()
    })
}

/// Guesses the encoding of a text that is not UTF-8.
pub(super) fn guess(text: &[u8]) -> &'static Encoding {
    let mut sample = NameSample::default();
    sample.add(text);
    sample.guess().unwrap_or(WINDOWS_1252)
}

/// Bytes of names that are enough to guess from.
const SAMPLE_BYTES: usize = 1 << 16;

/// Names of a file, as far as a guess of their encoding needs them.
#[derive(Default)]
pub(super) struct NameSample {
    /// Names that are not UTF-8, a line each.
    bytes: Vec<u8>,
    /// The number of names that are not UTF-8, less those that are UTF-8 and not ASCII.
    excess: i64,
}

impl NameSample {
    /// Adds a name.
    pub(super) fn add(&mut self, name: &[u8]) {
        if name.is_ascii() {
            return;
        }
        if std::str::from_utf8(name).is_ok() {
            self.excess -= 1;
            return;
        }
        self.excess += 1;
        let missing = SAMPLE_BYTES.saturating_sub(self.bytes.len());
        if missing > 0 {
            self.bytes.extend_from_slice(&name[..name.len().min(missing)]);
            self.bytes.push(b'\n');
        }
    }

    /// The likely encoding; `None` where most names are UTF-8.
    pub(super) fn guess(&self) -> Option<&'static Encoding> {
        if self.bytes.is_empty() || self.excess < 0 {
            return None;
        }
        let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
        detector.feed(&self.bytes, true);
        Some(detector.guess(None, Utf8Detection::Deny))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn same(one: &[u8], other: &[u8]) -> bool {
        forms(one).any(|form| folded(&form.name) == folded(other))
    }

    #[test]
    fn names_in_code_pages_are_those_in_utf_8_either_way() {
        for (text, encoding) in [
            ("大地形", GBK),
            ("墙", GBK),
            ("壁テクスチャ", SHIFT_JIS),
            ("Стена", WINDOWS_1251),
            ("façade", WINDOWS_1252),
            ("Mauer_weiß", WINDOWS_1252),
            ("벽", EUC_KR),
            ("牆壁", BIG5),
            ("Стена", KOI8_R),
            ("Стена", IBM866),
        ] {
            let (bytes, ..) = encoding.encode(text);
            assert!(same(&bytes, text.as_bytes()), "{text}");
            assert!(same(text.as_bytes(), &bytes), "{text}");
            assert!(!same(&bytes, "other".as_bytes()));
        }
    }

    #[test]
    fn normal_form_and_case_make_no_difference() {
        let composed = "Caf\u{e9} \u{c5}ngstr\u{f6}m";
        let decomposed = "cafe\u{301} a\u{30a}ngstro\u{308}m";
        assert!(same(composed.as_bytes(), decomposed.as_bytes()));
        assert!(same(decomposed.as_bytes(), composed.as_bytes()));
        assert!(same(b"WALL", b"wall") && !same(b"wall", b"walls"));
        assert_eq!(folded(b"A\xff"), b"a\xff");
    }

    #[test]
    fn quotation_marks_escapes_and_comments_are_taken_off() {
        for (name, expected) in [
            (&b"\"my wall\""[..], &b"my wall"[..]),
            (b" my\\ wall ", b"my wall"),
            (b"C:\\tex\\a.png", b"C:\\tex\\a.png"),
            (b"\"", b"\""),
            (b"", b""),
        ] {
            assert_eq!(&unescaped(name)[..], expected);
        }
        for (name, expected) in [
            (&b"wall # red"[..], &b"wall"[..]),
            (b"wall\t#", b"wall"),
            (b"wall#2", b"wall#2"),
            (b"#2", b"#2"),
            (b"", b""),
        ] {
            assert_eq!(without_comment(name), expected);
        }
    }

    #[test]
    fn the_encoding_is_guessed_for_people_to_read() {
        let mut sample = NameSample::default();
        sample.add(b"wall");
        assert_eq!(sample.guess(), None);
        let (name, ..) = WINDOWS_1251.encode("Кирпичная стена дома");
        sample.add(&name);
        assert_eq!(display(&name, sample.guess()), "Кирпичная стена дома");
        assert_eq!(display("façade".as_bytes(), None), "façade");
        assert_eq!(display(b"fa\xe7ade", None), "façade");
        sample.add("façade".as_bytes());
        assert!(sample.guess().is_some());
        sample.add("大地".as_bytes());
        assert_eq!(sample.guess(), None, "most are UTF-8");
    }
}
