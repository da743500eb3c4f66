//! Identities of nodes.

use std::fmt;
use std::num::ParseIntError;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// The identity of a node: unique within its scene, and the same in every build of the same source.
///
/// Its text is 16 hexadecimal digits, which order as the numbers do. JSON holds this text: programs
/// that read JSON numbers as `f64`, JavaScript among them, would round numbers above 2^53.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(into = "String", try_from = "String")]
pub struct NodeId(pub u64);

impl NodeId {
    /// The first 64 bits of the BLAKE3 hash of a node's file name. Among ten million nodes, two have
    /// the same id with a probability of 3e-6.
    pub fn of_file(file: &str) -> Self {
        let hash = blake3::hash(file.as_bytes());
        let [a, b, c, d, e, f, g, h, ..] = *hash.as_bytes();
        Self(u64::from_be_bytes([a, b, c, d, e, f, g, h]))
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

impl FromStr for NodeId {
    type Err = ParseIntError;

    fn from_str(text: &str) -> Result<Self, ParseIntError> {
        u64::from_str_radix(text, 16).map(Self)
    }
}

impl From<NodeId> for String {
    fn from(id: NodeId) -> Self {
        id.to_string()
    }
}

impl TryFrom<String> for NodeId {
    type Error = ParseIntError;

    fn try_from(text: String) -> Result<Self, ParseIntError> {
        text.parse()
    }
}

#[cfg(test)]
mod tests {
    use super::NodeId;

    #[test]
    fn json_keeps_all_64_bits() {
        for number in [0, (1 << 53) + 1, u64::MAX] {
            let json = serde_json::to_value(NodeId(number)).unwrap();
            assert_eq!(json.as_str().unwrap().len(), 16);
            assert_eq!(serde_json::from_value::<NodeId>(json).unwrap(), NodeId(number));
        }
        assert!(serde_json::from_str::<NodeId>("1").is_err());
        assert!("10000000000000000".parse::<NodeId>().is_err());
    }

    #[test]
    fn ids_of_files_use_all_64_bits() {
        let ids: Vec<u64> =
            (0..64).map(|file| NodeId::of_file(&format!("n{file}.glb")).0).collect();
        assert_eq!(ids.iter().fold(0, |all, id| all | id), u64::MAX);
        assert_eq!(ids.iter().fold(u64::MAX, |all, id| all & id), 0);
    }
}
