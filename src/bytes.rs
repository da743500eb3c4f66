//! Numbers of bytes as people write them.

use std::fmt;
use std::str::FromStr;

/// A number of bytes, with or without KiB, MiB, GiB or TiB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes(pub u64);

impl Bytes {
    /// So many, to the next MiB.
    pub fn megabytes(bytes: u64) -> Self {
        Self(bytes.div_ceil(1 << 20) << 20)
    }
}

impl fmt::Display for Bytes {
    /// In the largest unit of which it is a whole number.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let units = [("TiB", 40), ("GiB", 30), ("MiB", 20), ("KiB", 10)];
        match units.iter().find(|(_, shift)| self.0 > 0 && self.0.is_multiple_of(1 << shift)) {
            Some((unit, shift)) => write!(f, "{}{unit}", self.0 >> shift),
            None => write!(f, "{}", self.0),
        }
    }
}

impl FromStr for Bytes {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let units = [
            ("KiB", 10),
            ("MiB", 20),
            ("GiB", 30),
            ("TiB", 40),
            ("K", 10),
            ("M", 20),
            ("G", 30),
            ("T", 40),
            ("B", 0),
        ];
        let (number, shift) = units
            .iter()
            .find_map(|&(unit, shift)| text.strip_suffix(unit).map(|number| (number, shift)))
            .unwrap_or((text, 0));
        let wanted = "expected bytes such as 1048576, 512MiB or 1.5GiB";
        let number: f64 = number.trim().parse().map_err(|_| wanted.to_owned())?;
        let bytes = number * (1u64 << shift) as f64;
        if bytes.is_finite() && (0.0..=1e18).contains(&bytes) {
            Ok(Self(bytes as u64))
        } else {
            Err(wanted.to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_unit_is_read_and_written() {
        for (text, shift) in [("KiB", 10), ("MiB", 20), ("GiB", 30), ("TiB", 40)] {
            let bytes = Bytes(3 << shift);
            assert_eq!(bytes.to_string(), format!("3{text}"));
            assert_eq!(format!("3 {text}").parse(), Ok(bytes));
            assert_eq!(format!("3{}", &text[..1]).parse(), Ok(bytes));
        }
        assert_eq!("1.5GiB".parse(), Ok(Bytes(3 << 29)));
        for wrong in ["", "GiB", "-1", "NaN", "inf", "1e7TiB", "3 XiB"] {
            assert!(wrong.parse::<Bytes>().is_err(), "{wrong}");
        }
    }
}
