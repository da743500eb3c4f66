//! Models in degrees, brought to metres before anything else: neither distances nor errors can be
//! measured in longitudes and latitudes.

use glam::DVec3;

use super::{Crs, FARTHEST, Fit, Place, east_north_up};
use crate::mesh::{Model, UpAxis};
use crate::{Error, Result};

/// From longitude, latitude (degrees) and height (metres) of a geographic coordinate reference
/// system to metres east, north and up of a place.
#[derive(Debug)]
pub struct Degrees {
    crs: Crs,
    axes: Fit,
}

impl Degrees {
    /// Of the geographic system with this EPSG code, around `origin`; `height_offset` metres are
    /// added to heights to make them heights over the ellipsoid.
    pub fn new(epsg: u32, height_offset: f64, origin: Place) -> Result<Self> {
        let Place { lon, lat, height } = origin;
        let axes = east_north_up(lon.to_radians(), lat.to_radians(), height);
        Ok(Self { crs: Crs::geographic(epsg, height_offset)?, axes: Fit::from_affine(axes) })
    }

    /// Metres east, north and up of the place; `None` where there is no such point on the Earth.
    pub fn to_local(&self, point: DVec3) -> Option<DVec3> {
        // The axes are orthonormal: their transpose is their inverse.
        let ecef = self.crs.to_ecef(point)?;
        Some(self.axes.linear.transpose() * (ecef - self.axes.to) + self.axes.from)
    }

    /// Brings a model's vertices to metres; its axes stay as they are, so that of a model with Y up
    /// the coordinates are longitude, height and latitude southwards.
    pub fn localise(&self, model: &mut Model, up: UpAxis) -> Result<()> {
        for part in &mut model.parts {
            for position in &mut part.positions {
                let point = up.z_up(DVec3::from(*position));
                let local = self.to_local(point).filter(|local| local.is_finite());
                let near = local.filter(|local| local.abs().max_element() <= FARTHEST);
                let Some(near) = near else {
                    let why = match local {
                        Some(local) => format!("{:.0} km from --origin", local.length() / 1000.0),
                        None => "not on the Earth".into(),
                    };
                    return Err(Error::input(
                        &model.source,
                        format!(
                            "longitude {}, latitude {}, height {} is {why}; expected degrees, \
                             longitude first, within {:.0} km of it",
                            point.x,
                            point.y,
                            point.z,
                            FARTHEST / 1000.0
                        ),
                    ));
                };
                *position = up.from_z_up(near).to_array();
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Placement, to_ecef};
    use super::*;
    use crate::mesh::{Part, Warnings};

    const ORIGIN: Place = Place { lon: 11.42, lat: 48.76, height: 370.0 };

    fn model(positions: &[[f64; 3]]) -> Model {
        Model {
            source: "m.obj".into(),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts: vec![Part { positions: positions.to_vec(), ..Part::default() }],
            materials: Vec::new(),
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        }
    }

    /// Against the arcs of the ellipsoid there, in closed form.
    #[test]
    fn small_steps_are_as_long_as_arcs() {
        let degrees = Degrees::new(4326, 0.0, ORIGIN).unwrap();
        let at = |lon: f64, lat: f64, up: f64| {
            let point = DVec3::new(ORIGIN.lon + lon, ORIGIN.lat + lat, ORIGIN.height + up);
            degrees.to_local(point).unwrap()
        };
        assert!(at(0.0, 0.0, 0.0).length() < 1e-6);
        assert!((at(0.0, 0.0, 12.0) - DVec3::new(0.0, 0.0, 12.0)).length() < 1e-6);
        let (a, f) = (6_378_137.0, 1.0 / 298.257_223_563);
        let e2: f64 = f * (2.0 - f);
        let sin = ORIGIN.lat.to_radians().sin();
        let n = a / (1.0 - e2 * sin * sin).sqrt();
        let m = a * (1.0 - e2) / (1.0 - e2 * sin * sin).powf(1.5);
        let step = 1e-4f64;
        let east = (n + ORIGIN.height) * ORIGIN.lat.to_radians().cos() * step.to_radians();
        let north = (m + ORIGIN.height) * step.to_radians();
        assert!((at(step, 0.0, 0.0) - DVec3::new(east, 0.0, 0.0)).length() < 1e-4);
        assert!((at(0.0, step, 0.0) - DVec3::new(0.0, north, 0.0)).length() < 1e-4);
    }

    #[test]
    fn a_model_is_on_the_globe_where_it_was_before() {
        let points = [[11.42, 48.76, 370.0], [11.43, 48.765, 400.0], [11.41, 48.75, 380.0]];
        let placement = Placement::Degrees { epsg: 4979, height_offset: 0.0, origin: ORIGIN };
        let globe = placement.globe().unwrap().unwrap();
        for up in [UpAxis::Z, UpAxis::Y] {
            let turned = |[x, y, z]: [f64; 3]| match up {
                UpAxis::Z => [x, y, z],
                UpAxis::Y => [x, z, -y],
            };
            let mut model = model(&points.map(turned));
            placement.localise(&mut model, up).unwrap();
            for (local, [lon, lat, height]) in model.parts[0].positions.iter().zip(points) {
                let [x, y, z] = *local;
                let z_up = match up {
                    UpAxis::Z => DVec3::new(x, y, z),
                    UpAxis::Y => DVec3::new(x, -z, y),
                };
                let expected = to_ecef(
                    6_378_137.0,
                    298.257_223_563,
                    lon.to_radians(),
                    lat.to_radians(),
                    height,
                );
                let off = globe.to_ecef(z_up).unwrap().distance(expected);
                assert!(off < 1e-6, "{off}");
            }
        }
    }

    #[test]
    fn what_is_far_away_or_no_degrees_is_refused() {
        let degrees = Degrees::new(4326, 0.0, ORIGIN).unwrap();
        for (point, word) in [
            ([48.76, 11.42, 370.0], "longitude first"),
            ([678_016.0, 5_403_456.0, 370.0], "not on the Earth"),
            ([11.42, 48.76, f64::MAX], "expected degrees"),
        ] {
            let text = degrees.localise(&mut model(&[point]), UpAxis::Z).unwrap_err().to_string();
            assert!(text.contains(word) && text.contains("m.obj"), "{text}");
        }
        let text = Degrees::new(25832, 0.0, ORIGIN).unwrap_err().to_string();
        assert!(text.contains("EPSG:25832") && text.contains("metres"), "{text}");
    }
}
