//! A share of a build's blocks, so that several machines build one result.

use std::ops::Range;
use std::path::{Path, PathBuf};

use super::SUBSETS_DIR;

/// One of so many shares of a build's blocks: `3/8` is the third of eight.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
pub struct Subset {
    /// Which, from 1 to [`of`](Self::of).
    pub number: u32,
    /// How many there are.
    pub of: u32,
}

impl std::str::FromStr for Subset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match numbers {
            Some((Ok(number), Ok(of))) if 0 < number && number <= of => Ok(Self { number, of }),
            _ => Err(format!("expected K/N, K from 1 to N, such as 3/8, found {text}")),
        }
    }
}

impl std::fmt::Display for Subset {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "{}/{}", self.number, self.of)
    }
}

impl Subset {
    /// All of so many.
    pub fn all(of: u32) -> impl Iterator<Item = Self> {
        (1..=of).map(move |number| Self { number, of })
    }

    /// The folder of its result, in that of the whole.
    pub fn dir(self, out: &Path) -> PathBuf {
        out.join(SUBSETS_DIR).join(format!("{}-of-{}", self.number, self.of))
    }

    /// Reads the name of such a folder.
    pub fn of_dir(name: &str) -> Option<Self> {
        let (number, of) = name.split_once("-of-")?;
        let subset = format!("{number}/{of}").parse().ok();
        subset.filter(|subset: &Self| subset.dir(Path::new("")).ends_with(name))
    }

    /// The places of those of this share among things of so many triangles or bytes. Each share has one at
    /// least.
    pub fn picked(self, sizes: &[u64]) -> Range<usize> {
        // Empty files are shared out evenly too.
        let sizes: Vec<u64> = sizes.iter().map(|size| size + 1).collect();
        let (mut first, mut rest) = (0, sizes.iter().sum::<u64>());
        for number in 1..=self.of {
            let after = (self.of - number) as usize;
            // What is left is shared out evenly among this and those after it.
            let share = rest / (after as u64 + 1);
            let mut end = first + 1;
            let mut bytes = sizes[first];
            // An input goes to the share that has the larger part of it.
            while end < sizes.len() - after && (after == 0 || bytes + sizes[end] / 2 < share) {
                bytes += sizes[end];
                end += 1;
            }
            if number == self.number {
                return first..end;
            }
            (first, rest) = (end, rest - bytes);
        }
        first..sizes.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn is_read_as_it_is_written() {
        for text in ["1/1", "3/8", "12/12"] {
            let subset: Subset = text.parse().unwrap();
            assert_eq!(subset.to_string(), text);
            let dir = subset.dir(Path::new("out"));
            let name = dir.file_name().unwrap().to_str().unwrap();
            assert_eq!(Subset::of_dir(name), Some(subset));
        }
        for text in ["", "3", "0/8", "9/8", "1/0", "-1/8", "a/b", "1/2/3"] {
            assert!(text.parse::<Subset>().is_err(), "{text}");
        }
        for name in ["1-of-", "01-of-2", "3-of-2", "1-of-2-of-3", ".1-of-2.hlod-partial-7-0"] {
            assert_eq!(Subset::of_dir(name), None, "{name}");
        }
    }

    #[test]
    fn every_input_is_of_one_share_and_shares_are_alike() {
        let mut random = Random::new(5, 0);
        for of in [1, 2, 3, 7] {
            let sizes: Vec<u64> = (0..40).map(|_| (random.unit() * 1e6) as u64).collect();
            let shares: Vec<Range<usize>> =
                Subset::all(of).map(|subset| subset.picked(&sizes)).collect();
            assert_eq!(
                shares.iter().cloned().flatten().collect::<Vec<_>>(),
                (0..40).collect::<Vec<_>>()
            );
            let bytes = |share: &Range<usize>| sizes[share.clone()].iter().sum::<u64>();
            let least = shares.iter().map(bytes).min().unwrap();
            let most = shares.iter().map(bytes).max().unwrap();
            assert!(most - least <= 2 * *sizes.iter().max().unwrap(), "{least} {most}");
        }
        let lengths = |sizes: &[u64]| -> Vec<usize> {
            Subset::all(3).map(|subset| subset.picked(sizes).len()).collect()
        };
        assert_eq!(lengths(&[0; 6]), [2; 3]);
        assert_eq!(lengths(&[1, 1, 900]), [1; 3]);
        assert_eq!(lengths(&[900, 1, 1]), [1; 3]);
        assert_eq!(lengths(&[5; 6]), [2; 3]);
    }
}
