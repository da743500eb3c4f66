//! What figures are measured in.

/// What a figure is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// A number of things.
    Count,
    /// Milliseconds.
    Ms,
    /// Bytes; MiB in a table.
    Bytes,
    /// Percent; its rises are percentage points.
    Percent,
    /// A difference of images, 0 to 1.
    Flip,
}

impl Unit {
    /// The symbols that may follow a number, each with how many of this unit it is.
    pub(super) fn symbols(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Count | Self::Flip => &[("", 1.0)],
            Self::Ms => &[("ms", 1.0), ("us", 1e-3), ("µs", 1e-3), ("s", 1e3)],
            Self::Bytes => &[
                ("B", 1.0),
                ("kB", 1e3),
                ("MB", 1e6),
                ("GB", 1e9),
                ("KiB", 1024.0),
                ("MiB", 1048576.0),
                ("GiB", 1073741824.0),
            ],
            Self::Percent => &[("pp", 1.0)],
        }
    }

    /// A value, for messages.
    pub(super) fn example(self) -> &'static str {
        match self {
            Self::Count => "3",
            Self::Ms => "0.5ms",
            Self::Bytes => "10MiB",
            Self::Percent => "2pp",
            Self::Flip => "0.002",
        }
    }

    /// A value as text, with a sign where it is a change.
    pub(super) fn text(self, value: f64, signed: bool) -> String {
        let (value, digits, symbol) = match self {
            _ if !value.is_finite() => return "-".into(),
            Self::Count if value.fract() == 0.0 => (value, 0, ""),
            Self::Count => (value, 1, ""),
            Self::Ms => (value, 3, " ms"),
            Self::Bytes => (value / f64::from(1 << 20), 2, " MiB"),
            Self::Percent => (value, 2, " %"),
            Self::Flip => (value, 5, ""),
        };
        if signed {
            format!("{value:+.digits$}{symbol}")
        } else {
            format!("{value:.digits$}{symbol}")
        }
    }
}
