//! How faces look beside what they show.

/// How a cell's faces look from its corners that no picture was taken from.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct SeenFaces {
    /// The cell.
    pub place: [i64; 3],
    /// Pixels in which either the scene or a face is, without what is inside of the cull box.
    pub pixels: u64,
    /// Of these, those in which nothing is shown that is.
    pub missing: u64,
    /// Those that show something where there is nothing, or farther away or nearer than it is.
    pub wrong: u64,
}
