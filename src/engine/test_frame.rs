//! What policies see, for their tests.

use super::policies::{PolicyKind, Settings};
use super::{
    CostModel, CoveredParts, FrameInput, Policy, Prices, Residents, Selection, Visibility,
};
use crate::camera::View;
use crate::runtime::SceneTree;
use crate::runtime::residency::MemoryUse;
use crate::runtime::test_tree::{Sketch, sketch, tree, view};

/// A tree from a camera at the origin, all of it in memory, 10 ms a frame, 1 ms for each triangle.
pub(crate) struct TestFrame {
    pub tree: SceneTree,
    pub view: View,
    /// Remembers nothing.
    pub visibility: Visibility,
    pub covered: CoveredParts,
    pub residents: Residents,
    pub costs: CostModel,
    pub memory: MemoryUse,
    pub target_ms: f64,
    pub dt_s: f64,
}

/// Only triangles take time.
pub(crate) fn triangles_alone(ms: f64) -> Prices {
    Prices {
        frame: 0.0,
        draw: 0.0,
        vertex: 0.0,
        triangle: ms,
        plain_fragment: 0.0,
        textured_fragment: 0.0,
        hidden_fragment: 0.0,
        uploaded_byte: 0.0,
    }
}

impl TestFrame {
    pub fn new(tree: SceneTree) -> Self {
        Self {
            residents: Residents::all(tree.len()),
            tree,
            view: view(),
            visibility: Visibility::default(),
            covered: CoveredParts::default(),
            costs: CostModel::new(&triangles_alone(1.0)),
            memory: MemoryUse { cap_bytes: 1 << 30, used_bytes: 0, requested_bytes: 0 },
            target_ms: 10.0,
            dt_s: 1.0 / 30.0,
        }
    }

    pub fn input(&self) -> FrameInput<'_> {
        FrameInput {
            tree: &self.tree,
            view: &self.view,
            visibility: &self.visibility,
            covered: &self.covered,
            seen: None,
            hidden: None,
            predicted: &[],
            residents: &self.residents,
            memory: self.memory,
            costs: &self.costs,
            target_ms: self.target_ms,
            budget_ms: self.target_ms,
            dt_s: self.dt_s,
        }
    }

    pub fn select(&self, policy: &mut dyn Policy) -> Selection {
        let mut out = Selection::default();
        policy.select(&self.input(), &mut out);
        out
    }

    /// The front, sorted.
    pub fn front(&self, policy: &mut dyn Policy) -> Vec<u32> {
        let mut front = self.select(policy).front;
        front.sort_unstable();
        front
    }
}

/// A root at a distance, with children of 10 triangles each; refining it takes 10 ms for every
/// child after the first.
pub(crate) fn root(distance: f64, error: f64, children: usize) -> Sketch {
    let at = [distance + 1.0, 0.0, 0.0];
    let children = (0..children).map(|_| sketch(at, 1.0, vec![])).collect();
    Sketch { error, ..sketch(at, 1.0, children) }
}

/// For policies that go by gain over price: of two nodes, what the nearer gains is not in memory.
pub(crate) fn passes_over_what_is_not_in_memory(policy: &mut dyn Policy) {
    let mut frame = TestFrame::new(tree(vec![root(10.0, 0.1, 2), root(40.0, 0.1, 2)]));
    frame.residents.set(1, false);
    frame.target_ms = 30.0;
    let selection = frame.select(policy);
    let mut front = selection.front.clone();
    front.sort_unstable();
    assert_eq!(front, [0, 4, 5]);
    assert!(selection.requests.iter().any(|&(node, utility)| node == 1 && utility > 0.0));
}

/// Settings by which a policy's counters go from one end to the other within a minute rather than
/// many.
pub(crate) fn quick(kind: PolicyKind) -> Settings {
    let counters = [("hyst_switch", 50.0), ("hyst_limit", 150.0)];
    let mut settings = Settings::from(counters.map(|(name, value)| (name.into(), value)));
    settings.retain(|name, _| kind.parameters().iter().any(|known| known.name == name));
    settings
}
