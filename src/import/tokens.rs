//! Words, numbers and face corners of an OBJ line, from bytes.

/// Splits off the first word of `rest`; `None` where only white space is left. Control characters
/// count as white space, so that one comparison a byte is enough.
#[inline]
pub(super) fn word<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let start = rest.iter().position(|byte| *byte > b' ')?;
    let tail = &rest[start..];
    let end = tail.iter().position(|byte| *byte <= b' ').unwrap_or(tail.len());
    *rest = &tail[end..];
    Some(&tail[..end])
}

/// Powers of ten that f64 holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// Reads a decimal number; correctly rounded. `None` where it is none.
///
/// What C runtimes print for a value that is no number (`nan`, `inf`, `-1.#IND`) is NaN or
/// infinite, so that the caller can drop what uses it and go on.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    plain_decimal(word).or_else(|| {
        let text = std::str::from_utf8(word).ok()?;
        text.parse().ok().or_else(|| {
            let text = text.to_ascii_lowercase();
            ["#", "nan", "inf"].iter().any(|mark| text.contains(mark)).then_some(f64::NAN)
        })
    })
}

/// A word that is a plain decimal; see [`plain_decimal_at`].
fn plain_decimal(word: &[u8]) -> Option<f64> {
    plain_decimal_at(word).filter(|(_, rest)| rest.is_empty()).map(|(value, _)| value)
}

/// Reads `[+-]digits[.digits]` whose digits fit 2^53 from the front of `bytes`; returns it and
/// what follows. Mantissa and power of ten are exact in f64, and one correctly rounded division
/// of the two is the correctly rounded value (Clinger 1990).
#[inline]
pub(super) fn plain_decimal_at(bytes: &[u8]) -> Option<(f64, &[u8])> {
    let (negative, digits) = match bytes {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    let (whole, length) = leading_digits(digits, 0);
    let (mantissa, fraction_digits, end) = match digits.get(length) {
        Some(b'.') => {
            let (mantissa, more) = leading_digits(&digits[length + 1..], whole);
            (mantissa, more, length + 1 + more)
        }
        _ => (whole, 0, length),
    };
    // 18 digits cannot overflow the u64.
    let count = length + fraction_digits;
    if count == 0 || count > 18 || mantissa > 1 << 53 {
        return None;
    }
    let value = mantissa as f64 / EXACT_POWERS[fraction_digits];
    Some((if negative { -value } else { value }, &digits[end..]))
}

/// Appends the decimal digits at the front of `bytes` to `value`; also returns how many there
/// are. Wraps around where they are too many.
#[inline]
fn leading_digits(bytes: &[u8], mut value: u64) -> (u64, usize) {
    let mut length = 0;
    for byte in bytes {
        let digit = byte.wrapping_sub(b'0');
        if digit > 9 {
            break;
        }
        value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
        length += 1;
    }
    (value, length)
}

/// What an index of 0 is read as: counted back from the last, it is before the first element of any
/// file. No index has a larger magnitude.
pub(super) const NO_ELEMENT: i64 = -(1 << 60);

/// A corner of a face: `v`, `v/vt`, `v//vn` or `v/vt/vn`. Each index counts from 1 or, negative,
/// back from the last; it is 0 where the file gives none and [`NO_ELEMENT`] where the file says 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Corner {
    pub(super) position: i64,
    pub(super) texcoord: i64,
    pub(super) normal: i64,
}

/// Reads a face's corner. `None` where it is none.
#[inline]
pub(super) fn corner(word: &[u8]) -> Option<Corner> {
    corner_at(word).filter(|(_, rest)| rest.is_empty()).map(|(corner, _)| corner)
}

/// Reads a face's corner from the front of `bytes`; returns it and what follows. `None` where it
/// is none, or is not followed by white space or the end.
#[inline]
pub(super) fn corner_at(bytes: &[u8]) -> Option<(Corner, &[u8])> {
    let (position, mut rest) = index(bytes)?;
    let mut corner = Corner { position, texcoord: 0, normal: 0 };
    if let [b'/', after @ ..] = rest {
        rest = after;
        if !matches!(rest, [] | [b'/' | ..=b' ', ..]) {
            (corner.texcoord, rest) = index(rest)?;
        }
        if let [b'/', after @ ..] = rest {
            rest = after;
            if !matches!(rest, [] | [..=b' ', ..]) {
                (corner.normal, rest) = index(rest)?;
            }
        }
    }
    matches!(rest, [] | [..=b' ', ..]).then_some((corner, rest))
}

/// Reads an integer from the front of `bytes`, [`NO_ELEMENT`] for 0; returns it and what follows.
#[inline]
fn index(bytes: &[u8]) -> Option<(i64, &[u8])> {
    let (negative, digits) = match bytes {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    let (value, length) = leading_digits(digits, 0);
    // What may have wrapped around is larger than any index there can be.
    let value = if length > 18 { beyond(&digits[..length]) } else { value as i64 };
    if value == 0 {
        return (length > 0).then(|| (NO_ELEMENT, &digits[length..]));
    }
    Some((if negative { -value } else { value }, &digits[length..]))
}

/// The value of many digits, at most -[`NO_ELEMENT`].
#[cold]
fn beyond(digits: &[u8]) -> i64 {
    digits.iter().fold(0, |value: i64, digit| {
        value.saturating_mul(10).saturating_add(i64::from(digit - b'0')).min(-NO_ELEMENT)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_equal_the_standard_librarys() {
        for text in [
            "0",
            "-0",
            "1",
            "-1.5",
            "+2.25",
            "678031.705",
            "5403578.539",
            "-7.32421875682121e-06",
            "40.646532816113904",
            "0.00000000000000001",
            "123456789012345678",
            "1e300",
            "1e-320",
            "9007199254740993",
            "9007199254740992",
            ".5",
            "5.",
            "1837595.750",
            "-0.000",
            "12345678901234567.9",
        ] {
            let expected: f64 = text.parse().unwrap();
            assert_eq!(number(text.as_bytes()).unwrap().to_bits(), expected.to_bits(), "{text}");
        }
    }

    #[test]
    fn words_for_no_number_are_nan_and_others_are_refused() {
        for text in ["nan", "-nan(ind)", "1.#QNAN", "-1.#IND"] {
            assert!(number(text.as_bytes()).unwrap().is_nan(), "{text}");
        }
        assert_eq!(number(b"-inf"), Some(f64::NEG_INFINITY));
        for text in ["", ".", "-", "1,5", "1.2.3", "abc", "0x10", "\u{e9}"] {
            assert_eq!(number(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn corners_in_all_their_forms() {
        let read =
            |text: &str| corner(text.as_bytes()).map(|corner| (corner.position, corner.texcoord));
        assert_eq!(read("7"), Some((7, 0)));
        assert_eq!(read("7/8"), Some((7, 8)));
        assert_eq!(read("7/8/9"), Some((7, 8)));
        assert_eq!(read("7//9"), Some((7, 0)));
        assert_eq!(read("-1/-2/-3"), Some((-1, -2)));
        assert_eq!(read("7/"), Some((7, 0)));
        assert_eq!(read("7//"), Some((7, 0)));
        assert_eq!(read("7/8/"), Some((7, 8)));
        assert_eq!(read("99999999999999999999999"), Some((-NO_ELEMENT, 0)));
        assert_eq!(read("0/-0/0"), Some((NO_ELEMENT, NO_ELEMENT)));
        assert_eq!(read("7/00000000000000000000"), Some((7, NO_ELEMENT)));
        for text in ["", "-", "a", "7/a", "7/-", "7/8/a", "7/8/9/1", "1.5", "/1", "--1"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn what_follows_a_number_or_a_corner_is_left() {
        let decimal = plain_decimal_at(b"-1.25 7").unwrap();
        assert_eq!((decimal.0, decimal.1), (-1.25, &b" 7"[..]));
        assert_eq!(plain_decimal_at(b"12e3").unwrap().1, b"e3");
        for text in ["", "-", ".", "x", "1234567890123456789", "9007199254740993"] {
            assert_eq!(plain_decimal_at(text.as_bytes()), None, "{text}");
        }
        let corner = Corner { position: 1, texcoord: 2, normal: 0 };
        let with_normal = Corner { normal: 3, ..corner };
        assert_eq!(corner_at(b"1/2/3\r\n"), Some((with_normal, &b"\r\n"[..])));
        assert_eq!(corner_at(b"1/2/ 3"), Some((corner, &b" 3"[..])));
        assert_eq!(corner_at(b"1/2#"), None);
        assert_eq!(corner_at(b"1\\"), None);
    }

    #[test]
    fn words_are_split_at_any_white_space() {
        let mut rest: &[u8] = b" \tf  1/2\t3 ";
        assert_eq!(word(&mut rest), Some(&b"f"[..]));
        assert_eq!(word(&mut rest), Some(&b"1/2"[..]));
        assert_eq!(word(&mut rest), Some(&b"3"[..]));
        assert_eq!(word(&mut rest), None);
    }
}
