//! Coordinate reference systems by EPSG code, through the definitions of `crs-definitions` and the
//! projections of `proj4rs`.

use glam::DVec3;
use proj4rs::Proj;

use super::ellipsoid::wgs84_to_ecef;
use crate::{Error, Result};

/// Where source coordinates of a coordinate reference system are on the Earth.
#[derive(Debug)]
pub struct Crs {
    code: u16,
    definition: &'static str,
    source: Proj,
    wgs84: Proj,
    /// Added to source heights, metres.
    height_offset: f64,
}

const GEODETIC: &str = "+proj=longlat +datum=WGS84 +no_defs";

impl Crs {
    /// A system of metres (or feet) by its EPSG code; `height_offset` metres are added to the
    /// source's heights to make them heights over the ellipsoid.
    pub fn new(code: u32, height_offset: f64) -> Result<Self> {
        let crs = Self::of_any_unit(code, height_offset)?;
        if crs.source.is_latlong() {
            return Err(crs.unsupported(
                "its coordinates are degrees; add --origin LON,LAT,HEIGHT, a place near the model, \
                 and it is built in metres east, north and up of there",
            ));
        }
        Ok(crs)
    }

    /// A system of degrees, longitude first, by its EPSG code.
    pub fn geographic(code: u32, height_offset: f64) -> Result<Self> {
        let crs = Self::of_any_unit(code, height_offset)?;
        if !crs.source.is_latlong() {
            return Err(crs.unsupported(
                "its coordinates are metres or feet and say where they are; expected no --origin \
                 beside it, which is for degrees",
            ));
        }
        Ok(crs)
    }

    fn of_any_unit(code: u32, height_offset: f64) -> Result<Self> {
        let unknown = || {
            Error::Usage(format!(
                "--crs EPSG:{code}: not a known coordinate reference system; expected the code of \
                 a projected one, such as EPSG:25832 (ETRS89 / UTM zone 32N)"
            ))
        };
        let small = u16::try_from(code).map_err(|_| unknown())?;
        let definition = crs_definitions::from_code(small).ok_or_else(unknown)?.proj4;
        let source = Proj::from_proj_string(definition)
            .map_err(|error| unsupported(small, definition, &format!("not supported: {error}")))?;
        let wgs84 = Proj::from_proj_string(GEODETIC)
            .map_err(|error| Error::Internal(format!("WGS 84: {error}")))?;
        let crs = Self { code: small, definition, source, wgs84, height_offset };
        if definition.contains("+nadgrids=") && !definition.contains("+nadgrids=@null") {
            return Err(crs.unsupported("it needs a grid of corrections, which is not at hand"));
        }
        if !crs.source.is_normalized_axis() {
            return Err(crs.unsupported("its axes are not east, north and up"));
        }
        Ok(crs)
    }

    fn unsupported(&self, what: &str) -> Error {
        unsupported(self.code, self.definition, what)
    }

    /// What limits the accuracy of positions beside the projection itself; `None` where nothing
    /// does.
    pub fn caveat(&self) -> Option<String> {
        let find = |key: &str| self.definition.split_whitespace().find_map(|w| w.strip_prefix(key));
        let zero = |numbers: &str| numbers.split(',').all(|number| number.parse() == Ok(0.0f64));
        let code = self.code;
        match (find("+datum="), find("+towgs84=")) {
            (Some("WGS84"), _) => None,
            (None, Some(shift)) if zero(shift) => None,
            // The sphere of web maps.
            (None, None) if find("+nadgrids=") == Some("@null") => None,
            (None, None) => Some(format!("EPSG:{code} has no known tie to WGS 84; taken for it")),
            _ => Some(format!(
                "EPSG:{code} has a datum of its own, which an average shift brings to WGS 84: \
                 right to some decimetres or metres"
            )),
        }
    }

    /// The Earth-centred WGS84 coordinates of a point: metres east, north and up in this system, or
    /// degrees east and north and metres up.
    /// `None` where the system has no such point.
    pub fn to_ecef(&self, point: DVec3) -> Option<DVec3> {
        if self.source.is_geocent() {
            return point.is_finite().then_some(point);
        }
        let [lon, lat, height] = self.to_geodetic(point)?;
        Some(wgs84_to_ecef(lon, lat, height))
    }

    fn to_geodetic(&self, point: DVec3) -> Option<[f64; 3]> {
        let [x, y] =
            [point.x, point.y].map(|c| if self.source.is_latlong() { c.to_radians() } else { c });
        let mut moved = (x, y, point.z + self.height_offset);
        proj4rs::transform::transform(&self.source, &self.wgs84, &mut moved).ok()?;
        let (lon, lat, height) = moved;
        let sound = lon.abs() <= std::f64::consts::PI
            && lat.abs() <= std::f64::consts::FRAC_PI_2
            && height.is_finite();
        sound.then_some([lon, lat, height])
    }

    /// Why a point can hardly be one of this system: it has no place on the Earth, does not come
    /// back from there, or lies so far from the system's middle that the projection is torn.
    pub fn misfit(&self, point: DVec3) -> Option<String> {
        let DVec3 { x, y, z } = point;
        let place = format!("({x}, {y}, {z})");
        if self.source.is_geocent() {
            let radius = point.length();
            return (!(6.3e6..6.5e6).contains(&radius)).then(|| {
                format!("{place} is {radius:.0} m from the Earth's centre, not on its surface")
            });
        }
        let Some([lon, lat, height]) = self.to_geodetic(point) else {
            return Some(format!("{place} has no place on the Earth"));
        };
        let mut back = (lon, lat, height);
        let returned = proj4rs::transform::transform(&self.wgs84, &self.source, &mut back);
        let off = (back.0 - x).hypot(back.1 - y);
        if returned.is_err() || off.is_nan() || off > ROUND_TRIP {
            return Some(format!("{place} is outside of where the projection can be inverted"));
        }
        if !HEIGHTS.contains(&height) {
            return Some(format!("{place} would be {height:.0} m over the ellipsoid"));
        }
        let metre = self.source.to_meter();
        let from_corner = (x * metre).hypot(y * metre);
        let has_offset = self.source.false_easting().abs() > 3.0 * LOCAL
            || self.source.false_northing().abs() > 3.0 * LOCAL;
        if has_offset && from_corner < LOCAL {
            return Some(format!(
                "{place} is next to the system's corner, far from any place that it is made for; \
                 the coordinates look like local metres"
            ));
        }
        let narrow = matches!(self.source.projname(), "utm" | "tmerc" | "etmerc");
        let away = (lon - self.source.longitude_of_origin()).to_degrees();
        let away = (away + 540.0).rem_euclid(360.0) - 180.0;
        if narrow && away.abs() > WIDEST_STRIP {
            return Some(format!(
                "{place} is {:.0}° from the meridian that the system is made for",
                away.abs()
            ));
        }
        None
    }

    /// The definition, in the words of PROJ.
    pub fn definition(&self) -> &'static str {
        self.definition
    }
}

fn unsupported(code: u16, definition: &str, what: &str) -> Error {
    Error::Usage(format!("--crs EPSG:{code} ({}): {what}", definition.trim()))
}

/// A point that comes back farther than this from where it was is outside of the projection.
const ROUND_TRIP: f64 = 1e-3;
/// Heights of anything that stands on the Earth, metres over the ellipsoid.
const HEIGHTS: std::ops::Range<f64> = -12_000.0..30_000.0;
/// Coordinates smaller than this, in a system whose own begin far away, are local metres.
const LOCAL: f64 = 30_000.0;
/// Degrees from the central meridian up to which strips are in use anywhere (Norway in one zone).
const WIDEST_STRIP: f64 = 23.0;

#[cfg(test)]
mod tests {
    use super::*;

    /// Longitude and latitude in radians to metres east and north.
    fn forward(definition: &str, lon: f64, lat: f64) -> [f64; 2] {
        let geodetic: String = definition
            .split_whitespace()
            .filter(|word| word.starts_with("+ellps") || word.starts_with("+datum"))
            .collect::<Vec<_>>()
            .join(" ");
        let from = Proj::from_proj_string(&format!("+proj=longlat {geodetic} +no_defs")).unwrap();
        let to = Proj::from_proj_string(definition).unwrap();
        let mut point = (lon, lat, 0.0);
        proj4rs::transform::transform(&from, &to, &mut point).unwrap();
        [point.0, point.1]
    }

    fn degrees(d: f64, m: f64, s: f64) -> f64 {
        (d.abs() + m / 60.0 + s / 3600.0).to_radians() * d.signum()
    }

    /// Worked examples of IOGP Guidance Note 7-2 (Coordinate Conversions and Transformations
    /// including Formulas), each on its own datum.
    #[test]
    fn published_examples_of_projections() {
        let examples = [
            // British National Grid, Transverse Mercator.
            (
                "+proj=tmerc +lat_0=49 +lon_0=-2 +k=0.9996012717 +x_0=400000 +y_0=-100000 \
                 +ellps=airy +no_defs",
                [degrees(0.0, 30.0, 0.0), degrees(50.0, 30.0, 0.0)],
                [577_274.99, 69_740.50],
            ),
            // Amersfoort / RD New, Oblique Stereographic.
            (
                "+proj=sterea +lat_0=52.15616055555555 +lon_0=5.38763888888889 +k=0.9999079 \
                 +x_0=155000 +y_0=463000 +ellps=bessel +no_defs",
                [degrees(6.0, 0.0, 0.0), degrees(53.0, 0.0, 0.0)],
                [196_105.283, 557_057.739],
            ),
            // JAD69 / Jamaica National Grid, Lambert Conic Conformal with one parallel.
            (
                "+proj=lcc +lat_1=18 +lat_0=18 +lon_0=-77 +k_0=1 +x_0=250000 +y_0=150000 \
                 +ellps=clrk66 +no_defs",
                [degrees(-76.0, 56.0, 37.26), degrees(17.0, 55.0, 55.80)],
                [255_966.58, 142_493.51],
            ),
        ];
        for (definition, [lon, lat], published) in examples {
            let found = forward(definition, lon, lat);
            let off = (found[0] - published[0]).hypot(found[1] - published[1]);
            assert!(off < 0.01, "{definition}: {found:?}, published {published:?}");
        }
    }
}
