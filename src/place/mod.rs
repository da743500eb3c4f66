//! Where a city stands on the Earth.
//!
//! | file | what it knows |
//! |---|---|
//! | `ellipsoid` | geodetic and Earth-centred coordinates, axes of a place |
//! | `crs` | coordinate reference systems by EPSG code |
//! | `degrees` | models in degrees, brought to metres |
//! | `fit` | the affine map nearest to a curved one over a box |

mod crs;
mod degrees;
mod ellipsoid;
mod fit;
mod parameters;
#[cfg(test)]
mod tests;

use glam::DVec3;
use serde::{Deserialize, Serialize};

pub use crs::Crs;
pub use degrees::Degrees;
pub use ellipsoid::{east_north_up, to_ecef, wgs84_to_ecef};
pub use fit::Fit;
pub use parameters::{PLACEMENT, placement_of};

use crate::mesh::{Model, UpAxis};
use crate::{Error, Result};

/// A place on the WGS84 ellipsoid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Longitude, degrees, −180 to 180.
    pub lon: f64,
    /// Latitude, degrees, −90 to 90.
    pub lat: f64,
    /// Height over the ellipsoid, metres.
    pub height: f64,
}

impl Place {
    /// The axes there, to the east, the north and up.
    fn axes(&self) -> Result<Fit> {
        let &Self { lon, lat, height } = self;
        let ok = (-180.0..=180.0).contains(&lon)
            && (-90.0..=90.0).contains(&lat)
            && (-12_000.0..=100_000.0).contains(&height);
        if !ok {
            return Err(Error::Usage(format!(
                "--origin {lon},{lat},{height}: expected a longitude of -180 to 180 and a latitude \
                 of -90 to 90 degrees, and a height of -12000 to 100000 m over the ellipsoid"
            )));
        }
        Ok(Fit::from_affine(east_north_up(lon.to_radians(), lat.to_radians(), height)))
    }
}

/// What is known of a city's place, as it was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// Nothing: a model without a place.
    #[default]
    Local,
    /// Coordinates are metres east, north and up of a place.
    Origin(Place),
    /// Coordinates are those of a coordinate reference system.
    Crs {
        /// Its EPSG code.
        epsg: u32,
        /// Added to heights to make them heights over the ellipsoid, metres.
        height_offset: f64,
    },
    /// Coordinates are longitude and latitude in degrees and height in metres; the hierarchy is
    /// built in metres east, north and up of a place.
    Degrees {
        /// The EPSG code of the geographic coordinate reference system.
        epsg: u32,
        /// Added to heights to make them heights over the ellipsoid, metres.
        height_offset: f64,
        /// The place.
        origin: Place,
    },
}

impl Placement {
    /// The map to the Earth; `None` for a model without a place. Refuses what no place can be.
    pub fn globe(&self) -> Result<Option<Globe>> {
        match *self {
            Self::Local => Ok(None),
            Self::Origin(place) => Ok(Some(Globe::Tangent(place.axes()?))),
            Self::Crs { epsg, height_offset } => {
                check_offset(height_offset)?;
                Ok(Some(Globe::Crs(Box::new(Crs::new(epsg, height_offset)?))))
            }
            Self::Degrees { epsg, height_offset, origin } => {
                check_offset(height_offset)?;
                Degrees::new(epsg, height_offset, origin)?;
                Ok(Some(Globe::Tangent(origin.axes()?)))
            }
        }
    }

    /// Brings a model that is in degrees to metres, as it is built; others stay as they are.
    pub fn localise(&self, model: &mut Model, up: UpAxis) -> Result<()> {
        match *self {
            Self::Local | Self::Origin(_) | Self::Crs { .. } => Ok(()),
            Self::Degrees { epsg, height_offset, origin } => {
                Degrees::new(epsg, height_offset, origin)?.localise(model, up)
            }
        }
    }

    /// Whether coordinates are degrees: the nodes depend on the place then.
    pub fn is_degrees(&self) -> bool {
        matches!(self, Self::Degrees { .. })
    }
}

fn check_offset(height_offset: f64) -> Result<()> {
    if (-1e5..=1e5).contains(&height_offset) {
        return Ok(());
    }
    Err(Error::Usage(format!("--height-offset {height_offset}: expected metres, at most 100000")))
}

/// The map from a city's coordinates, Z up, to Earth-centred ones.
#[derive(Debug)]
pub enum Globe {
    /// A plane that touches the Earth at the origin.
    Tangent(Fit),
    /// A coordinate reference system.
    Crs(Box<Crs>),
}

impl Globe {
    /// Where a point is; `None` where the system has no such point.
    pub fn to_ecef(&self, point: DVec3) -> Option<DVec3> {
        match self {
            Self::Tangent(axes) => Some(axes.apply(point)),
            Self::Crs(crs) => crs.to_ecef(point),
        }
    }

    /// The affine map nearest to this one over a box; exact for a tangent plane.
    pub fn fit(&self, low: DVec3, high: DVec3) -> Option<Fit> {
        match self {
            Self::Tangent(axes) => Some(*axes),
            Self::Crs(crs) => Fit::new(|point| crs.to_ecef(point), low, high),
        }
    }

    /// Why a box can hardly be of this system; `None` where it can.
    pub fn misfit(&self, low: DVec3, high: DVec3) -> Option<String> {
        match self {
            Self::Tangent(_) => {
                let far = low.abs().max(high.abs()).max_element();
                (far > FARTHEST).then(|| {
                    format!(
                        "coordinates are up to {far:.0} m from the origin, where the Earth is long \
                         curved away; expected local metres, or --crs EPSG:CODE for a projected \
                         system"
                    )
                })
            }
            Self::Crs(crs) => corners(low, high).into_iter().find_map(|corner| crs.misfit(corner)),
        }
    }

    /// What limits the accuracy of positions; `None` where nothing does.
    pub fn caveat(&self) -> Option<String> {
        match self {
            Self::Tangent(_) => None,
            Self::Crs(crs) => crs.caveat(),
        }
    }
}

/// Metres from an origin that are no local metres any more: the ground is 780 m below there.
const FARTHEST: f64 = 100_000.0;

/// The corners of a box.
pub fn corners(low: DVec3, high: DVec3) -> [DVec3; 8] {
    std::array::from_fn(|corner| {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(pick(0), pick(1), pick(2))
    })
}

/// A box in source axes as a box with Z up, as tiles have it.
pub fn z_up(up: UpAxis, low: [f64; 3], high: [f64; 3]) -> (DVec3, DVec3) {
    let [a, b] = [low, high].map(|corner| up.z_up(corner.into()));
    (a.min(b), a.max(b))
}
