//! What a viewer that refines by screen-space error is told of each node.

use super::Scene;

/// What viewers are told of a node as a multiple of the distance that 95 of 100 points are within.
const VIEWER_PERCENTILES: f64 = 4.0;

impl Scene {
    /// By index of a node: the error in metres by which viewers choose its level, 3D Tiles'
    /// `geometricError`.
    ///
    /// It is four times the distance that 95 of 100 points are within (or the mean, where few points
    /// are very far away and that is larger), the bound where that is less, and never less than that
    /// of a node below. At the 16 pixels that viewers begin with, a node is drawn
    /// of which 95 of 100 points are within 4 pixels, or all within 16. The bound alone is that of the
    /// worst point: one chimney without a counterpart makes it as large as the house, and refines the
    /// node from far away. docs/choices.md compares them by the images of equally many triangles.
    ///
    /// The scene was [checked](Scene::check).
    pub fn viewer_errors(&self) -> Vec<f64> {
        let mut errors: Vec<f64> = self
            .nodes
            .iter()
            .map(|node| {
                let typical = node.p95_error.max(node.mean_error);
                (VIEWER_PERCENTILES * typical).min(node.geometric_error)
            })
            .collect();
        // Deepest first, so that each node is final before its parent takes it.
        let mut deepest: Vec<usize> = (0..self.nodes.len()).collect();
        deepest.sort_by_key(|&index| std::cmp::Reverse(self.nodes[index].level));
        for index in deepest {
            if let Some(parent) = self.nodes[index].parent {
                errors[parent as usize] = errors[parent as usize].max(errors[index]);
            }
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use crate::format::test_scene::scene;

    #[test]
    fn errors_are_percentiles_that_do_not_grow_downwards() {
        let mut scene = scene();
        // 0 (1 (3 2)) 4
        let errors = [(40.0, 1.0, 2.0), (30.0, 3.0, 1.0), (0.0, 0.0, 0.0), (28.0, 0.5, 5.0)];
        for (node, (bound, mean, p95)) in scene.nodes.iter_mut().zip(errors) {
            (node.geometric_error, node.mean_error, node.p95_error) = (bound, mean, p95);
        }
        let errors = scene.viewer_errors();
        // That of node 3 is handed up to both above it, and one of a single level stays its own.
        assert_eq!(errors[..4], [20.0, 20.0, 0.0, 20.0]);
        scene.nodes[3].p95_error = 0.25;
        assert_eq!(scene.viewer_errors()[..4], [12.0, 12.0, 0.0, 2.0]);
        // The bound is never exceeded.
        scene.nodes[0].p95_error = 20.0;
        assert_eq!(scene.viewer_errors()[0], 40.0);
    }
}
