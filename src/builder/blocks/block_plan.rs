//! What a block will be made of.

/// A block before its geometry is gathered.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockPlan {
    /// For people: the group's name, or that of the first of several.
    pub name: String,
    /// Indices into [`Model::parts`](crate::mesh::Model::parts).
    pub parts: Vec<usize>,
    /// How it is divided further, if it is.
    pub divide: Division,
}

/// How a planned block is cut into several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Division {
    /// It stays whole.
    Whole,
    /// Halved until no chunk has more triangles than this.
    Halves {
        /// Triangles.
        most: usize,
    },
    /// Cut along the lines of a grid of this side in metres, on these two axes.
    Grid {
        /// Metres.
        metres: f64,
        /// The horizontal axes.
        axes: [usize; 2],
    },
}
