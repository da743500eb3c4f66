//! Colour: sRGB and linear light, as numbers in 0–1 and by table.

use std::sync::LazyLock;

/// Linear light of each sRGB byte, 65535 being 1.
static TO_LINEAR: LazyLock<[u16; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| unorm16(srgb_to_linear(byte as f64 / 255.0))));

/// The same, 1 being 1.
static TO_LIGHT: LazyLock<[f32; 256]> =
    LazyLock::new(|| TO_LINEAR.map(|linear| f32::from(linear) / 65535.0));

/// Linear values to one entry of the table back. Near black, neighbouring bytes are 20 apart in
/// linear light, so that this loses no shade, and the table stays in the fastest cache.
const PER_ENTRY: usize = 8;

/// The nearest sRGB byte of the middle of each entry's linear values.
static TO_BYTE: LazyLock<[u8; 65536 / PER_ENTRY]> = LazyLock::new(|| {
    let mut byte = 0u8;
    std::array::from_fn(|entry| {
        let middle = (entry * PER_ENTRY + PER_ENTRY / 2) as f64;
        // Half way between two bytes, as they are encoded, lies their border.
        while byte < 255 && srgb_to_linear((f64::from(byte) + 0.5) / 255.0) * 65535.0 <= middle {
            byte += 1;
        }
        byte
    })
});

/// Linear light of an encoded value, both 0–1; clamped (IEC 61966-2-1).
pub fn srgb_to_linear(encoded: f64) -> f64 {
    let encoded = encoded.clamp(0.0, 1.0);
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The encoded value of linear light, both 0–1; clamped (IEC 61966-2-1).
pub fn linear_to_srgb(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        // The same on every machine, unlike the system's.
        1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055
    }
}

/// A value in 0–1 as an integer of which 65535 is 1; clamped.
pub(crate) fn unorm16(value: f64) -> u16 {
    (value.clamp(0.0, 1.0) * 65535.0).round() as u16
}

/// The table from sRGB bytes to linear light, of which 65535 is 1.
pub(crate) fn byte_to_linear() -> &'static [u16; 256] {
    &TO_LINEAR
}

/// The same table with linear light as numbers in 0–1.
pub(crate) fn byte_to_light() -> &'static [f32; 256] {
    &TO_LIGHT
}

/// From linear light to sRGB bytes, by table.
#[derive(Clone, Copy)]
pub(crate) struct LinearToByte(&'static [u8; 65536 / PER_ENTRY]);

impl LinearToByte {
    /// The sRGB byte of a linear value.
    pub fn of(self, linear: u16) -> u8 {
        self.0[usize::from(linear) / PER_ENTRY]
    }
}

/// The table from linear light to sRGB bytes.
pub(crate) fn linear_to_byte() -> LinearToByte {
    LinearToByte(&TO_BYTE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_the_way_there_and_back() {
        for byte in 0..=255u8 {
            assert_eq!(linear_to_byte().of(byte_to_linear()[usize::from(byte)]), byte);
        }
    }

    #[test]
    fn the_curve_meets_its_ends_and_its_knee() {
        assert_eq!([0.0, 1.0, 7.0].map(srgb_to_linear), [0.0, 1.0, 1.0]);
        assert!((srgb_to_linear(0.04045) - 0.04045 / 12.92).abs() < 1e-12);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
        for encoded in [0.0, 0.01, 0.2, 0.9, 1.0] {
            assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-6);
        }
        assert_eq!([-1.0, 1.0].map(unorm16), [0, 65535]);
    }

    #[test]
    fn half_of_white_is_188() {
        assert_eq!(linear_to_byte().of(32768), 188);
        assert_eq!((byte_to_linear()[0], byte_to_linear()[255]), (0, 65535));
    }
}
