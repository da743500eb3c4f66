//! A share of a build's inputs, so that several machines build one result.

use std::cmp::Reverse;
use std::path::{Path, PathBuf};

use crate::format::SUBSETS_DIR;
use crate::{Error, Result};

/// One of so many shares of a build's inputs: `3/8` is the third of eight.
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

    /// Those of all inputs that are of this share: the same on every machine that sees the same files.
    /// The largest are given out first, each to the share that has the fewest bytes.
    pub fn pick(self, inputs: &[PathBuf]) -> Result<Vec<PathBuf>> {
        if inputs.len() < self.of as usize {
            return Err(Error::Usage(format!(
                "--subset {self}: expected as many subsets as there are inputs at most, found {}",
                inputs.len()
            )));
        }
        let bytes = |input: &PathBuf| std::fs::metadata(input).map_or(0, |facts| facts.len());
        let sizes: Vec<u64> = inputs.iter().map(bytes).collect();
        Ok(self.picked(&sizes).into_iter().map(|at| inputs[at].clone()).collect())
    }

    /// The places of those of this share among inputs of so many bytes, in order.
    fn picked(self, sizes: &[u64]) -> Vec<usize> {
        let mut largest_first: Vec<usize> = (0..sizes.len()).collect();
        largest_first.sort_by_key(|&at| (Reverse(sizes[at]), at));
        // Bytes and inputs of each share: empty files are given out evenly too.
        let mut shares = vec![(0u64, 0usize); self.of as usize];
        let mut picked = Vec::new();
        for at in largest_first {
            let least = (0..shares.len()).min_by_key(|&share| shares[share]).unwrap_or(0);
            let (bytes, inputs) = &mut shares[least];
            *bytes += sizes[at];
            *inputs += 1;
            if least + 1 == self.number as usize {
                picked.push(at);
            }
        }
        picked.sort_unstable();
        picked
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
            let shares: Vec<Vec<usize>> =
                Subset::all(of).map(|subset| subset.picked(&sizes)).collect();
            let mut all = shares.concat();
            all.sort_unstable();
            assert_eq!(all, (0..40).collect::<Vec<_>>());
            let bytes = |share: &Vec<usize>| share.iter().map(|&at| sizes[at]).sum::<u64>();
            let least = shares.iter().map(bytes).min().unwrap();
            let most = shares.iter().map(bytes).max().unwrap();
            assert!(most - least <= *sizes.iter().max().unwrap(), "{least} {most}");
        }
        let empty: Vec<usize> = Subset::all(3).map(|subset| subset.picked(&[0; 6]).len()).collect();
        assert_eq!(empty, [2, 2, 2]);
    }
}
