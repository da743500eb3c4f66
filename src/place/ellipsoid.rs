//! The WGS84 ellipsoid: geodetic and Earth-centred coordinates, and the axes of a place on it.

use glam::{DAffine3, DMat3, DVec3};

/// Semi-major axis of WGS84, metres.
pub const WGS84_A: f64 = 6_378_137.0;
/// Inverse flattening of WGS84.
pub const WGS84_INVERSE_FLATTENING: f64 = 298.257_223_563;

/// Longitude and latitude in radians and height in metres over an ellipsoid, as Earth-centred
/// coordinates (X to the prime meridian on the equator, Z to the north pole), metres.
pub fn to_ecef(a: f64, inverse_flattening: f64, lon: f64, lat: f64, height: f64) -> DVec3 {
    let flattening = 1.0 / inverse_flattening;
    let e2 = flattening * (2.0 - flattening);
    let (sin, cos) = (libm::sin(lat), libm::cos(lat));
    // Radius of curvature in the prime vertical.
    let n = a / (1.0 - e2 * sin * sin).sqrt();
    DVec3::new(
        (n + height) * cos * libm::cos(lon),
        (n + height) * cos * libm::sin(lon),
        (n * (1.0 - e2) + height) * sin,
    )
}

/// [`to_ecef`] over WGS84.
pub fn wgs84_to_ecef(lon: f64, lat: f64, height: f64) -> DVec3 {
    to_ecef(WGS84_A, WGS84_INVERSE_FLATTENING, lon, lat, height)
}

/// From metres east, north and up of a place on WGS84 to Earth-centred coordinates.
pub fn east_north_up(lon: f64, lat: f64, height: f64) -> DAffine3 {
    let (sin_lon, cos_lon) = (libm::sin(lon), libm::cos(lon));
    let (sin_lat, cos_lat) = (libm::sin(lat), libm::cos(lat));
    DAffine3 {
        matrix3: DMat3::from_cols(
            DVec3::new(-sin_lon, cos_lon, 0.0),
            DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat),
            DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat),
        ),
        translation: wgs84_to_ecef(lon, lat, height),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// IOGP Guidance Note 7-2, "Geographic/Geocentric conversions": its worked example on WGS84.
    #[test]
    fn the_published_example_of_geocentric_coordinates() {
        let lat = (53.0 + 48.0 / 60.0 + 33.820 / 3600.0f64).to_radians();
        let lon = (2.0 + 7.0 / 60.0 + 46.380 / 3600.0f64).to_radians();
        let found = wgs84_to_ecef(lon, lat, 73.0);
        let published = DVec3::new(3_771_793.968, 140_253.342, 5_124_304.349);
        assert!(found.distance(published) < 0.002, "{found}");
    }

    #[test]
    fn axes_are_orthonormal_and_up_is_away_from_the_ground() {
        let (lon, lat) = (0.2f64, 0.85);
        let axes = east_north_up(lon, lat, 100.0);
        let m = axes.matrix3;
        assert!((m * m.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
        assert!((m.determinant() - 1.0).abs() < 1e-14);
        let higher = wgs84_to_ecef(lon, lat, 107.0);
        assert!(axes.transform_point3(DVec3::new(0.0, 0.0, 7.0)).distance(higher) < 1e-8);
        let norther = wgs84_to_ecef(lon, lat + 1e-7, 100.0) - axes.translation;
        assert!(m.y_axis.dot(norther.normalize()) > 1.0 - 1e-9);
    }
}
