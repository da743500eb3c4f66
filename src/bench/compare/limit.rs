//! How much a figure may rise: in its own unit, or in percent of what it was.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

/// Figures rise by this part of themselves through rounding alone; so much is not held against
/// a limit that is met exactly.
const ROUNDING: f64 = 1e-9;

/// What a figure is measured in.
pub trait Dimension: Clone + fmt::Debug {
    /// Units that may follow a number, each with how much of the figure's own unit it is.
    /// Longer ones first where one ends in another.
    const UNITS: &'static [(&'static str, f64)];
    /// An absolute limit, for messages.
    const EXAMPLE: &'static str;
}

/// Numbers of things.
#[derive(Clone, Debug, PartialEq)]
pub struct Count;
/// Milliseconds.
#[derive(Clone, Debug, PartialEq)]
pub struct Milliseconds;
/// Bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Bytes;
/// Differences of pictures, 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip;
/// Percentage points, for figures that are percentages themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Points;

impl Dimension for Count {
    const UNITS: &'static [(&'static str, f64)] = &[("", 1.0)];
    const EXAMPLE: &'static str = "3";
}

impl Dimension for Milliseconds {
    const UNITS: &'static [(&'static str, f64)] =
        &[("ms", 1.0), ("us", 1e-3), ("µs", 1e-3), ("s", 1e3)];
    const EXAMPLE: &'static str = "0.5ms";
}

impl Dimension for Bytes {
    const UNITS: &'static [(&'static str, f64)] = &[
        ("KiB", 1024.0),
        ("MiB", 1048576.0),
        ("GiB", 1073741824.0),
        ("kB", 1e3),
        ("MB", 1e6),
        ("GB", 1e9),
        ("B", 1.0),
    ];
    const EXAMPLE: &'static str = "10MiB";
}

impl Dimension for Flip {
    const UNITS: &'static [(&'static str, f64)] = &[("", 1.0)];
    const EXAMPLE: &'static str = "0.002";
}

impl Dimension for Points {
    const UNITS: &'static [(&'static str, f64)] = &[("pp", 1.0)];
    const EXAMPLE: &'static str = "2pp";
}

/// How much a figure may rise before it is too much: `3`, `0.5ms`, `10MiB`, `2pp`, or `5%` of
/// what it was.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit<D> {
    amount: f64,
    percent: bool,
    text: String,
    dimension: PhantomData<D>,
}

impl<D> Limit<D> {
    /// The most that a figure may be after it was `base`.
    pub fn most(&self, base: f64) -> f64 {
        base + if self.percent { base.abs() * self.amount / 100.0 } else { self.amount }
    }

    /// Whether a figure that was `base` rose too far. What is no number is too much: nothing
    /// shows that it is not.
    pub fn is_exceeded(&self, base: f64, new: f64) -> bool {
        let rounding = ROUNDING * base.abs().max(new.abs());
        // A comparison with NaN is false.
        let within = new <= self.most(base) + rounding;
        !within
    }
}

impl<D> fmt::Display for Limit<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "+{}", self.text)
    }
}

impl<D: Dimension> FromStr for Limit<D> {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let trimmed = text.trim();
        let expected = || {
            format!(
                "expected how much it may rise, such as `{}`, or a part of what it was, such as \
                 `5%`; found `{text}`",
                D::EXAMPLE
            )
        };
        let digits = trimmed.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
        let unit = trimmed[digits.len()..].trim_start();
        let number: f64 = digits.parse().map_err(|_| expected())?;
        if !(number.is_finite() && number >= 0.0) {
            return Err(format!("{}; a limit is at least 0", expected()));
        }
        let percent = unit == "%";
        let factor = match D::UNITS.iter().find(|(name, _)| *name == unit) {
            Some(&(_, factor)) => factor,
            None if percent || (number == 0.0 && unit.is_empty()) => 1.0,
            None => return Err(format!("{}; the unit is one of {}", expected(), units::<D>())),
        };
        let text = trimmed.to_owned();
        Ok(Self { amount: number * factor, percent, text, dimension: PhantomData })
    }
}

/// The units for a message.
fn units<D: Dimension>() -> String {
    let names = D::UNITS.iter().map(|&(name, _)| if name.is_empty() { "none" } else { name });
    names.chain(["%"]).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn most<D: Dimension>(text: &str, base: f64) -> f64 {
        text.parse::<Limit<D>>().unwrap().most(base)
    }

    #[test]
    fn each_figure_has_its_units_and_percent() {
        assert_eq!(most::<Count>("3", 10.0), 13.0);
        assert_eq!(most::<Count>("5%", 200.0), 210.0);
        assert_eq!(most::<Milliseconds>("0.5ms", 1.0), 1.5);
        assert_eq!(most::<Milliseconds>(" 2 s ", 0.0), 2000.0);
        assert_eq!(most::<Milliseconds>("200us", 0.0), 0.2);
        assert_eq!(most::<Bytes>("10MiB", 1.0), 10485761.0);
        assert_eq!(most::<Bytes>("10B", 1.0), 11.0);
        assert_eq!(most::<Bytes>("1kB", 0.0), 1000.0);
        assert_eq!(most::<Points>("2pp", 3.0), 5.0);
        assert_eq!(most::<Points>("0", 3.0), 3.0);
    }

    #[test]
    fn what_is_no_limit_is_refused_with_what_was_expected() {
        for text in ["", "fast", "3", "3 pp", "-1ms", "NaNms", "infms", "1e400ms", "5%%", "%"] {
            let error = text.parse::<Limit<Milliseconds>>().unwrap_err();
            assert!(error.contains("`0.5ms`") && error.contains(&format!("`{text}`")), "{error}");
        }
        let error = "3MiB".parse::<Limit<Count>>().unwrap_err();
        assert!(error.contains("one of none, %"), "{error}");
    }

    #[test]
    fn a_limit_holds_up_to_itself() {
        let exact: Limit<Points> = "0.1pp".parse().unwrap();
        assert!(!exact.is_exceeded(0.3, 0.4)); // 0.4 − 0.3 is more than 0.1 in binary
        assert!(exact.is_exceeded(0.3, 0.4001));
        assert!(!exact.is_exceeded(0.3, 0.1));
        let percent: Limit<Count> = "5%".parse().unwrap();
        assert!(!percent.is_exceeded(100.0, 105.0));
        assert!(percent.is_exceeded(100.0, 106.0));
        // 5 % of nothing is nothing.
        assert!(!percent.is_exceeded(0.0, 0.0));
        assert!(percent.is_exceeded(0.0, 1.0));
        assert!(percent.is_exceeded(f64::NAN, 1.0) && percent.is_exceeded(1.0, f64::NAN));
    }
}
