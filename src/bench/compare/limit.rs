//! The most that a figure may be: an amount, or so much more than it was.

use std::fmt;
use std::str::FromStr;

use super::Unit;
use super::metrics::{METRICS, Metric};

/// Figures rise by this part of themselves through rounding alone; so much is not held against
/// a limit that is met exactly.
const ROUNDING: f64 = 1e-9;

/// A figure by name and the most that it may be: `METRIC=VALUE`.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    pub(super) metric: &'static str,
    bound: Bound,
    text: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Bound {
    /// In the figure's unit.
    Value(f64),
    /// More than it was, in the figure's unit.
    Rise(f64),
    /// More than it was, percent of that.
    RisePercent(f64),
}

impl Limit {
    /// The most that a figure may be after it was `base`.
    pub fn most(&self, base: f64) -> f64 {
        match self.bound {
            Bound::Value(value) => value,
            Bound::Rise(rise) => base + rise,
            Bound::RisePercent(percent) => base + base.abs() * percent / 100.0,
        }
    }

    /// Whether a figure that was `base` is above it. What is no number is too much: nothing shows
    /// that it is not.
    pub fn is_exceeded(&self, base: f64, new: f64) -> bool {
        let rounding = ROUNDING * base.abs().max(new.abs());
        // A comparison with NaN is false.
        let within = new <= self.most(base) + rounding;
        !within
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Limit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or_else(|| {
            format!("expected METRIC=VALUE, such as `toggles=+5%`; found `{text}`")
        })?;
        let metric = METRICS.iter().find(|metric| metric.name == name).ok_or_else(|| {
            let names: Vec<&str> = METRICS.iter().map(|metric| metric.name).collect();
            format!("no metric `{name}`; expected one of {}", names.join(", "))
        })?;
        let text = value.trim().to_owned();
        Ok(Self { metric: metric.name, bound: bound(metric, &text)?, text })
    }
}

fn bound(metric: &Metric, text: &str) -> Result<Bound, String> {
    let unit = metric.unit;
    let expected = || {
        let example = unit.example();
        format!(
            "{}: expected the most that it may be, such as `{example}`, or how much more than it was, \
             such as `+{example}` or `+5%`; found `{text}`",
            metric.name
        )
    };
    let rise = text.strip_prefix('+');
    let amount = rise.unwrap_or(text);
    let digits = amount.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let symbol = amount[digits.len()..].trim_start();
    let number: f64 = digits.trim_start().parse().map_err(|_| expected())?;
    if !(number.is_finite() && number >= 0.0) {
        return Err(format!("{}; a limit is at least 0", expected()));
    }
    if symbol == "%" && rise.is_some() {
        return Ok(Bound::RisePercent(number));
    }
    let known = unit.symbols().iter().find(|(name, _)| *name == symbol);
    let factor = match known {
        Some(&(_, factor)) => factor,
        None if symbol == "%" && unit == Unit::Percent => 1.0,
        None if number == 0.0 && symbol.is_empty() => 1.0,
        None => return Err(format!("{}; the unit is {}", expected(), units(unit))),
    };
    let amount = number * factor;
    Ok(if rise.is_some() { Bound::Rise(amount) } else { Bound::Value(amount) })
}

/// The units for a message.
fn units(unit: Unit) -> String {
    let names = unit.symbols().iter().map(|&(name, _)| if name.is_empty() { "none" } else { name });
    names.collect::<Vec<_>>().join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limit(text: &str) -> Limit {
        text.parse().unwrap()
    }

    #[test]
    fn each_figure_has_its_units_and_rises_in_percent() {
        let most = |text: &str, base: f64| limit(text).most(base);
        assert_eq!(most("toggles=3", 10.0), 3.0);
        assert_eq!(most("toggles=+3", 10.0), 13.0);
        assert_eq!(most("toggles=+5%", 200.0), 210.0);
        assert_eq!(most("frame-time-p95=+0.5ms", 1.0), 1.5);
        assert_eq!(most("frame-time-p95= 2 s ", 7.0), 2000.0);
        assert_eq!(most("selection=+200us", 0.0), 0.2);
        assert_eq!(most("peak-memory=+10MiB", 1.0), 10485761.0);
        assert_eq!(most("peak-memory=+10B", 1.0), 11.0);
        assert_eq!(most("bytes-read=1kB", 0.0), 1000.0);
        assert_eq!(most("late=+2pp", 3.0), 5.0);
        assert_eq!(most("late=2%", 3.0), 2.0);
        assert_eq!(most("late=+10%", 30.0), 33.0);
        assert_eq!(most("late=+0", 3.0), 3.0);
    }

    #[test]
    fn what_is_no_limit_is_refused_with_what_was_expected() {
        for value in
            ["", "fast", "3", "3 pp", "-1ms", "NaNms", "infms", "1e400ms", "5%", "+5%%", "+"]
        {
            let error = format!("frame-time-p95={value}").parse::<Limit>().unwrap_err();
            assert!(error.contains("`+0.5ms`") && error.contains(&format!("`{value}`")), "{error}");
        }
        let error = "toggles=3MiB".parse::<Limit>().unwrap_err();
        assert!(error.contains("the unit is none"), "{error}");
        let error = "frame-time-p95=3MiB".parse::<Limit>().unwrap_err();
        assert!(error.contains("the unit is ms or us"), "{error}");
        let error = "frames=3".parse::<Limit>().unwrap_err();
        assert!(error.contains("no metric `frames`") && error.contains("flip-p95"), "{error}");
        assert!("toggles".parse::<Limit>().unwrap_err().contains("METRIC=VALUE"));
    }

    #[test]
    fn a_limit_holds_up_to_itself() {
        let exact = limit("late=+0.1pp");
        assert!(!exact.is_exceeded(0.3, 0.4)); // 0.4 − 0.3 is more than 0.1 in binary
        assert!(exact.is_exceeded(0.3, 0.4001));
        assert!(!exact.is_exceeded(0.3, 0.1));
        let percent = limit("toggles=+5%");
        assert!(!percent.is_exceeded(100.0, 105.0));
        assert!(percent.is_exceeded(100.0, 106.0));
        // 5 % of nothing is nothing.
        assert!(!percent.is_exceeded(0.0, 0.0));
        assert!(percent.is_exceeded(0.0, 1.0));
        assert!(percent.is_exceeded(f64::NAN, 1.0) && percent.is_exceeded(1.0, f64::NAN));
        let value = limit("toggles=5");
        assert!(!value.is_exceeded(f64::NAN, 5.0) && value.is_exceeded(9.0, 6.0));
        assert!(value.is_exceeded(1.0, f64::NAN));
    }
}
