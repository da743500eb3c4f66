//! Between sRGB bytes and linear light in 16 bits (65535 is 1), by table.

use std::sync::LazyLock;

/// Linear light of each sRGB byte.
static TO_LINEAR: LazyLock<[u16; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f64 / 255.0;
        (linear_of(encoded) * 65535.0).round() as u16
    })
});

/// The nearest sRGB byte of each linear value. One entry a value: near black, neighbouring bytes
/// are only 20 apart in linear light, so that a coarser table would lose dark shades.
static TO_BYTE: LazyLock<Box<[u8]>> = LazyLock::new(|| {
    let mut table = vec![0; 65536];
    let mut start = 0;
    for byte in 0..256usize {
        // Half way between two bytes, as they are encoded, lies their border.
        let border = (linear_of((byte as f64 + 0.5) / 255.0) * 65535.0).ceil() as usize;
        let end = if byte == 255 { 65536 } else { border.min(65536) };
        table[start..end].fill(byte as u8);
        start = end;
    }
    table.into_boxed_slice()
});

/// IEC 61966-2-1.
fn linear_of(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The table from sRGB bytes to linear light.
pub(crate) fn to_linear() -> &'static [u16; 256] {
    &TO_LINEAR
}

/// The table from linear light to sRGB bytes.
pub(crate) fn to_byte() -> &'static [u8; 65536] {
    let table: &'static [u8] = &TO_BYTE;
    // The table is built with exactly this length.
    table.try_into().unwrap_or(&[0; 65536])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        for byte in 0..=255u8 {
            assert_eq!(to_byte()[usize::from(to_linear()[usize::from(byte)])], byte);
        }
    }

    #[test]
    fn half_of_white_is_188() {
        assert_eq!(to_byte()[32768], 188);
        assert_eq!((to_linear()[0], to_linear()[255]), (0, 65535));
    }
}
