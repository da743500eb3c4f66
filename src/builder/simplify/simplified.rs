//! What simplification gives.

use crate::builder::border::vertex::Border;
use crate::mesh::Mesh;

/// A simplified chunk.
#[derive(Clone, Debug)]
pub struct Simplified {
    /// Its geometry, with source texture coordinates.
    pub mesh: Mesh,
    /// Border facts of its vertices.
    pub border: Border,
    /// An upper estimate of the distance that it moved from the input, metres.
    pub error: f64,
    /// How it was made.
    pub step: LadderStep,
}

impl Simplified {
    /// Adds another mesh, whose vertices lie on no border or on the same ones.
    pub fn append(&mut self, other: Mesh, border: Border) {
        self.mesh.append(other);
        self.border.planes.extend(border.planes);
        self.border.keep.extend(border.keep);
    }
}

impl Simplified {
    /// Adds a surface that was simplified beside this one. The step is that of the larger; cards, which have no
    /// seams, do not count.
    pub fn join(&mut self, other: Self) {
        let is_larger = other.mesh.triangles.len() > self.mesh.triangles.len();
        if is_larger && other.step != LadderStep::Cards {
            self.step = other.step;
        }
        self.error = self.error.max(other.error);
        self.append(other.mesh, other.border);
    }
}

/// The step of the ladder that gave a node its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LadderStep {
    /// The chunk as it is: a leaf.
    Original,
    /// Edge collapse inside texture seams.
    Collapse,
    /// Edge collapse across texture seams and material borders, with the smallest separate parts left out.
    Prune,
    /// Edge collapse across texture seams and material borders of faces that wind one way.
    Oriented,
    /// Vertex clustering.
    Clustering,
    /// Extruded footprints in place of separate bodies, and edge collapse of the rest.
    Prisms,
    /// Fewer and larger boxes in place of separate bodies, and edge collapse of the rest.
    Boxes,
    /// Fewer and larger cards of leaves.
    Cards,
    /// The largest triangles alone, where simplification would leave nothing.
    Fallback,
}

impl LadderStep {
    /// For reports.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Original => "original geometry",
            Self::Collapse => "edge collapse within texture seams",
            Self::Prune => "edge collapse without the smallest separate parts",
            Self::Oriented => "edge collapse of faces turned one way",
            Self::Clustering => "vertex clustering",
            Self::Prisms => "extruded footprints of separate bodies",
            Self::Boxes => "fewer and larger boxes for separate bodies",
            Self::Cards => "fewer and larger cards",
            Self::Fallback => "the largest triangles alone",
        }
    }
}
