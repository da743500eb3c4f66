//! Between sRGB bytes and linear light in 16 bits (65535 is 1), by table.

use std::sync::LazyLock;

/// Linear light of each sRGB byte.
static TO_LINEAR: LazyLock<[u16; 256]> = LazyLock::new(|| {
    std::array::from_fn(|byte| {
        let encoded = byte as f64 / 255.0;
        (linear_of(encoded) * 65535.0).round() as u16
    })
});

/// Linear values to one entry of the table back. Near black, neighbouring bytes are 20 apart in
/// linear light, so that this loses no shade, and the table stays in the fastest cache.
const PER_ENTRY: usize = 8;

/// The nearest sRGB byte of the middle of each entry's linear values.
static TO_BYTE: LazyLock<[u8; 65536 / PER_ENTRY]> = LazyLock::new(|| {
    let mut byte = 0u8;
    std::array::from_fn(|entry| {
        let middle = (entry * PER_ENTRY + PER_ENTRY / 2) as f64;
        // Half way between two bytes, as they are encoded, lies their border.
        while byte < 255 && linear_of((f64::from(byte) + 0.5) / 255.0) * 65535.0 <= middle {
            byte += 1;
        }
        byte
    })
});

/// IEC 61966-2-1.
fn linear_of(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The table from sRGB bytes to linear light.
pub(crate) fn to_linear() -> &'static [u16; 256] {
    &TO_LINEAR
}

/// From linear light to sRGB bytes, by table.
#[derive(Clone, Copy)]
pub(crate) struct ToByte(&'static [u8; 65536 / PER_ENTRY]);

impl ToByte {
    /// The sRGB byte of a linear value.
    pub fn of(self, linear: u16) -> u8 {
        self.0[usize::from(linear) / PER_ENTRY]
    }
}

/// The table from linear light to sRGB bytes.
pub(crate) fn to_byte() -> ToByte {
    ToByte(&TO_BYTE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        for byte in 0..=255u8 {
            assert_eq!(to_byte().of(to_linear()[usize::from(byte)]), byte);
        }
    }

    #[test]
    fn half_of_white_is_188() {
        assert_eq!(to_byte().of(32768), 188);
        assert_eq!((to_linear()[0], to_linear()[255]), (0, 65535));
    }
}
