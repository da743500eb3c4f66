//! Numbers as text, without going through floating point: exact and fast.

/// Two digits of every number below 100.
const PAIRS: [[u8; 2]; 100] = {
    let mut pairs = [[0; 2]; 100];
    let mut number = 0;
    while number < 100 {
        pairs[number] = [b'0' + (number / 10) as u8, b'0' + (number % 10) as u8];
        number += 1;
    }
    pairs
};

/// Appends a whole number.
pub(super) fn push_whole(text: &mut Vec<u8>, mut number: u64) {
    let mut digits = [0u8; 20];
    let mut start = digits.len();
    while number >= 100 {
        start -= 2;
        digits[start..start + 2].copy_from_slice(&PAIRS[(number % 100) as usize]);
        number /= 100;
    }
    let pair = PAIRS[number as usize];
    if number >= 10 {
        start -= 2;
        digits[start..start + 2].copy_from_slice(&pair);
    } else {
        start -= 1;
        digits[start] = pair[1];
    }
    text.extend_from_slice(&digits[start..]);
}

/// Appends `number / 10^PAIRS_AFTER_POINT·2` in decimals, all of them.
pub(super) fn push_fixed<const PAIRS_AFTER_POINT: usize>(text: &mut Vec<u8>, number: i64) {
    if number < 0 {
        text.push(b'-');
    }
    let mut rest = number.unsigned_abs();
    let mut decimals = [[0u8; 2]; PAIRS_AFTER_POINT];
    for pair in decimals.iter_mut().rev() {
        *pair = PAIRS[(rest % 100) as usize];
        rest /= 100;
    }
    push_whole(text, rest);
    text.push(b'.');
    text.extend_from_slice(decimals.as_flattened());
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(write: impl FnOnce(&mut Vec<u8>)) -> String {
        let mut bytes = Vec::new();
        write(&mut bytes);
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn whole_numbers_are_what_the_standard_library_writes() {
        for number in [0, 9, 10, 99, 100, 101, 12_345, 999_999, u64::MAX] {
            assert_eq!(text(|bytes| push_whole(bytes, number)), number.to_string());
        }
    }

    #[test]
    fn decimals_keep_sign_and_zeros() {
        let cases = [
            (0, "0.0000"),
            (-1, "-0.0001"),
            (10_000, "1.0000"),
            (-54_034_560_078, "-5403456.0078"),
        ];
        for (number, expected) in cases {
            assert_eq!(text(|bytes| push_fixed::<2>(bytes, number)), expected);
        }
        assert_eq!(text(|bytes| push_fixed::<3>(bytes, 1_000_000)), "1.000000");
    }
}
