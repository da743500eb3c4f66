//! Boxes along the axes, of cells and of what is in them.

use crate::lattice::Lattice;

/// A box; the least and the greatest corner, infinite where nothing bounds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellBox {
    /// Least coordinates.
    pub low: [f64; 3],
    /// Greatest coordinates.
    pub high: [f64; 3],
}

impl CellBox {
    /// All of space.
    pub const ALL: Self = Self { low: [f64::NEG_INFINITY; 3], high: [f64::INFINITY; 3] };

    /// Nothing.
    pub const NONE: Self = Self { low: [f64::INFINITY; 3], high: [f64::NEG_INFINITY; 3] };

    /// The box around places.
    pub fn around(places: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let of_place = |place: [f64; 3]| Self { low: place, high: place };
        places.into_iter().fold(Self::NONE, |all, place| all.and(&of_place(place)))
    }

    /// The box around both.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    /// Returns what both have.
    pub fn common(&self, other: &Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].max(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].min(other.high[axis])),
        }
    }

    /// The box of all places that are no farther from this one along any axis, in metres.
    pub fn larger(&self, by: f64) -> Self {
        Self { low: self.low.map(|at| at - by), high: self.high.map(|at| at + by) }
    }

    /// Returns whether `other` lies strictly inside.
    pub fn holds_within(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] < other.low[axis] && other.high[axis] < self.high[axis])
    }

    /// Returns whether the boxes intersect or touch.
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }

    /// The coordinate of a side: the lower or the upper one across an axis.
    pub fn side(&self, axis: usize, upper: bool) -> f64 {
        if upper { self.high[axis] } else { self.low[axis] }
    }

    /// The length along an axis, metres; negative where there is nothing.
    pub fn length(&self, axis: usize) -> f64 {
        self.high[axis] - self.low[axis]
    }

    /// The greatest length, metres; 0 where there is nothing.
    pub fn longest(&self) -> f64 {
        (0..3).map(|axis| self.length(axis)).fold(0.0, f64::max)
    }

    /// The middle.
    pub fn middle(&self) -> [f64; 3] {
        std::array::from_fn(|axis| 0.5 * (self.low[axis] + self.high[axis]))
    }

    /// The largest absolute coordinate of those that are finite, metres.
    pub fn magnitude(&self) -> f64 {
        let all = self.low.iter().chain(&self.high).filter(|at| at.is_finite());
        all.fold(0.0, |most, at| most.max(at.abs()))
    }

    /// The lattice that a mesh within may have.
    pub fn lattice(&self) -> Lattice {
        Lattice::for_extent(self.longest(), self.magnitude())
    }

    /// Both corners.
    pub fn corners(&self) -> [[f64; 3]; 2] {
        [self.low, self.high]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_around_places_holds_them_and_no_more() {
        let around = CellBox::around([[1.0, -2.0, 3.0], [4.0, 0.0, 3.0]]);
        assert_eq!(around, CellBox { low: [1.0, -2.0, 3.0], high: [4.0, 0.0, 3.0] });
        assert_eq!((around.longest(), around.magnitude(), around.length(2)), (3.0, 4.0, 0.0));
        assert_eq!(around.middle(), [2.5, -1.0, 3.0]);
        assert_eq!(around.and(&CellBox::NONE), around);
        assert_eq!(around.common(&CellBox::ALL), around);
        assert!(CellBox::ALL.holds_within(&around) && !around.holds_within(&around));
        assert!(around.meets(&around) && !around.meets(&CellBox::NONE));
        let beside = CellBox::around([[5.0, -1.0, 3.0]]);
        assert!(!around.meets(&beside) && around.larger(1.0).meets(&beside));
        assert_eq!((CellBox::NONE.longest(), CellBox::NONE.magnitude()), (0.0, 0.0));
    }
}
