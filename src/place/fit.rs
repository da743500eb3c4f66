//! The affine map that is nearest to a curved one over a box.
//!
//! A tile's transform is affine, a map projection is not: over a box of side `s` its grid differs
//! from the best affine map by about `s² / 8R` (R the Earth's radius), 2 mm for 300 m.

use glam::{DAffine3, DMat3, DVec3};

/// An affine map `p → linear (p − from) + to`, kept so that large coordinates lose no digits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// The linear part.
    pub linear: DMat3,
    /// A point of the box.
    pub from: DVec3,
    /// Where it goes.
    pub to: DVec3,
}

impl Fit {
    /// From an affine map.
    pub fn from_affine(affine: DAffine3) -> Self {
        Self { linear: affine.matrix3, from: DVec3::ZERO, to: affine.translation }
    }

    /// The affine map nearest to `map` over a box: secants through its faces' centres, moved so
    /// that the largest differences to either side are equal. `None` where `map` has no value.
    pub fn new(map: impl Fn(DVec3) -> Option<DVec3>, low: DVec3, high: DVec3) -> Option<Self> {
        let from = (low + high) * 0.5;
        // A box may be flat; secants of a metre are as good as any then.
        let half = ((high - low) * 0.5).max(DVec3::ONE);
        let secant = |axis: DVec3, reach: f64| {
            Some((map(from + axis * reach)? - map(from - axis * reach)?) / (2.0 * reach))
        };
        let linear = DMat3::from_cols(
            secant(DVec3::X, half.x)?,
            secant(DVec3::Y, half.y)?,
            secant(DVec3::Z, half.z)?,
        );
        let mut fit = Self { linear, from, to: map(from)? };
        let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for point in grid(low, high) {
            let off = map(point)? - fit.apply(point);
            least = least.min(off);
            most = most.max(off);
        }
        fit.to += (least + most) * 0.5;
        Some(fit)
    }

    /// Where a point goes.
    pub fn apply(&self, point: DVec3) -> DVec3 {
        self.linear * (point - self.from) + self.to
    }

    /// The largest distance to `map` over a box, metres; infinite where `map` has no value.
    pub fn residual(&self, map: impl Fn(DVec3) -> Option<DVec3>, low: DVec3, high: DVec3) -> f64 {
        grid(low, high)
            .map(|point| map(point).map_or(f64::INFINITY, |to| to.distance(self.apply(point))))
            .fold(0.0, f64::max)
    }

    /// This map in the frame of another: `outer ∘ result = self`. `None` where `outer` is flat.
    pub fn within(&self, outer: &Self) -> Option<DAffine3> {
        if outer.linear.determinant().abs() < f64::MIN_POSITIVE {
            return None;
        }
        let inverse = outer.linear.inverse();
        let linear = inverse * self.linear;
        // `from` of both are near each other where the maps are of one city, so that what is
        // multiplied is small.
        let translation =
            inverse * (self.to - outer.to) + outer.from + (DMat3::IDENTITY - linear) * self.from
                - self.from;
        Some(DAffine3 { matrix3: linear, translation })
    }

    /// As an affine map from the origin.
    pub fn affine(&self) -> DAffine3 {
        DAffine3 { matrix3: self.linear, translation: self.to - self.linear * self.from }
    }
}

/// Points of a box, its corners among them.
fn grid(low: DVec3, high: DVec3) -> impl Iterator<Item = DVec3> {
    const STEPS: usize = 4;
    let share = |i: usize| i as f64 / STEPS as f64;
    (0..=STEPS).flat_map(move |x| {
        (0..=STEPS).flat_map(move |y| {
            [0, STEPS].into_iter().map(move |z| {
                let t = DVec3::new(share(x), share(y), share(z));
                low + (high - low) * t
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS: f64 = 6.4e6;

    fn globe(p: DVec3) -> Option<DVec3> {
        Some(DVec3::new(p.x, p.y, p.z - (p.x * p.x + p.y * p.y) / (2.0 * RADIUS)))
    }

    #[test]
    fn a_curved_map_is_met_within_a_quarter_of_its_sagitta() {
        let (low, high) = (DVec3::new(-150.0, -150.0, 0.0), DVec3::new(150.0, 150.0, 50.0));
        let fit = Fit::new(globe, low, high).unwrap();
        let bound = 2.0 * 150.0f64.powi(2) / (4.0 * RADIUS);
        let residual = fit.residual(globe, low, high);
        assert!(residual < bound * 1.01 && residual > bound * 0.5, "{residual} of {bound}");
    }

    #[test]
    fn a_map_within_another_composes_to_itself() {
        let shift = |p: DVec3| globe(p - DVec3::new(678_000.0, 5_403_000.0, 0.0));
        let corner = DVec3::new(678_016.0, 5_403_456.0, 400.0);
        let outer = Fit::new(shift, corner, corner + 3000.0).unwrap();
        let inner = Fit::new(shift, corner, corner + 100.0).unwrap();
        let relative = inner.within(&outer).unwrap();
        for point in grid(corner, corner + 100.0) {
            let composed = outer.apply(relative.transform_point3(point));
            assert!(composed.distance(inner.apply(point)) < 1e-7);
        }
        assert!(outer.affine().transform_point3(corner).distance(outer.apply(corner)) < 1e-8);
    }

    #[test]
    fn a_map_with_holes_has_no_fit() {
        assert_eq!(Fit::new(|_| None, DVec3::ZERO, DVec3::ONE), None);
    }
}
