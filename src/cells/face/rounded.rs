//! Vertices in fewer bits, which compression then finds.

/// Bits of a coordinate's fraction that are kept. What is rounded is off by 2^-16 of its distance along each axis at
/// most, and so by about a hundredth of a pixel of a face of 512 pixels, wherever it is.
const BITS: u32 = 15;

/// The nearest number to a finite one that has `BITS` bits.
pub(super) fn rounded(number: f32) -> f32 {
    const DROPPED: u32 = f32::MANTISSA_DIGITS - 1 - BITS;
    // What is carried out of the fraction raises the exponent, as it should.
    let bits = number.to_bits() + (1 << (DROPPED - 1));
    f32::from_bits(bits & !((1 << DROPPED) - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_byte_is_empty_and_the_number_nearly_the_same() {
        let numbers = [0.0, 1.0, -1.0, 1.999_999_9, -340.123_44, 8_123.457, 1.0e-6, 0.724_609_4];
        for number in numbers {
            let found = rounded(number);
            assert_eq!(found.to_bits() & 0xff, 0, "{number}");
            assert!((found - number).abs() <= number.abs() / 65_536.0, "{number} {found}");
            assert_eq!(rounded(found), found);
        }
    }
}
