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
    /// Halved until no chunk is larger than this.
    Halves(BlockSize),
    /// Cut along the lines of a grid of this side in metres, on these two axes.
    Grid {
        /// Metres.
        metres: f64,
        /// The horizontal axes.
        axes: [usize; 2],
    },
}

/// How large a block is, or may be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockSize {
    /// Triangles.
    pub triangles: usize,
    /// Separate bodies that may become prisms, as
    /// [`BodyRules::crowd`](crate::builder::simplify::BodyRules::crowd) counts them.
    pub bodies: usize,
}

impl BlockSize {
    /// Whether nothing of it is more than that of `most`.
    pub fn fits(self, most: Self) -> bool {
        self.triangles <= most.triangles && self.bodies <= most.bodies
    }

    /// The larger of each.
    pub fn max(self, other: Self) -> Self {
        let Self { triangles, bodies } = other;
        Self { triangles: self.triangles.max(triangles), bodies: self.bodies.max(bodies) }
    }
}

impl std::ops::AddAssign for BlockSize {
    fn add_assign(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.bodies += other.bodies;
    }
}
