//! Colours of the source in linear light.

/// One sRGB component, 0–1, as linear light (IEC 61966-2-1). Outside 0–1 it is clamped.
pub(super) fn srgb_to_linear(value: f64) -> f64 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

/// A component in 0–1 as `u16`, 65535 being 1.
pub(super) fn to_unorm16(value: f64) -> u16 {
    (value.clamp(0.0, 1.0) * 65535.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_meets_its_ends_and_its_knee() {
        assert_eq!(srgb_to_linear(0.0), 0.0);
        assert_eq!(srgb_to_linear(1.0), 1.0);
        assert_eq!(srgb_to_linear(7.0), 1.0);
        assert!((srgb_to_linear(0.04045) - 0.04045 / 12.92).abs() < 1e-12);
        assert!((srgb_to_linear(0.5) - 0.214_041).abs() < 1e-6);
        assert_eq!(to_unorm16(1.0), 65535);
        assert_eq!(to_unorm16(-1.0), 0);
    }
}
