//! Limits of a block: cells are not divided further below them.

/// A block has about so much at most, where no grid says what blocks are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Most {
    /// Triangles.
    pub triangles: u64,
    /// Texels of the source.
    pub texels: f64,
}

/// The method that divides inputs into blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BlockSplit {
    /// Cells are divided until none has too many triangles.
    #[default]
    Auto,
    /// Squares of this side (metres) on the ground.
    Grid(f64),
}

impl std::str::FromStr for BlockSplit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "auto" {
            return Ok(Self::Auto);
        }
        text.strip_prefix("grid:")
            .and_then(|metres| metres.trim().parse::<f64>().ok())
            .filter(|metres| metres.is_finite() && *metres > 0.0)
            .map(Self::Grid)
            .ok_or_else(|| "expected auto, or grid:METRES with METRES > 0".into())
    }
}

impl std::fmt::Display for BlockSplit {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => out.write_str("auto"),
            Self::Grid(metres) => write!(out, "grid:{metres}"),
        }
    }
}
