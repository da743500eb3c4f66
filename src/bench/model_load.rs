//! What a frame asks of a machine, for the model clock: tile by tile of the image.
//!
//! Apart from draw calls, vertices and triangles it shares nothing with the engine's cost model,
//! whose fragments are hidden by the whole of what is nearer, wherever in the image that is.

use glam::DVec3;

use crate::camera::View;
use crate::format::cells::Face;
use crate::runtime::{SceneTree, TreeNode};

/// Tiles across and up the image.
const TILES: [usize; 2] = [32, 18];

/// What a frame asks of a machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ModelLoad {
    pub draws: f64,
    pub vertices: f64,
    pub triangles: f64,
    /// Fragments that are shaded without a texture.
    pub plain_fragments: f64,
    /// Fragments that are shaded with a texture.
    pub textured_fragments: f64,
    /// Fragments behind others.
    pub hidden_fragments: f64,
    /// Pixels along the edges of triangles: machines shade in blocks of two by two or more, and what
    /// of a block is outside of a triangle is wasted.
    pub edge_fragments: f64,
}

impl ModelLoad {
    /// The same without textures.
    #[cfg(feature = "render")]
    pub fn stripped(self) -> Self {
        let plain_fragments = self.plain_fragments + self.textured_fragments;
        Self { plain_fragments, textured_fragments: 0.0, ..self }
    }
}

/// What is drawn of a front at once.
struct Drawn {
    bbox: [DVec3; 2],
    draws: f64,
    vertices: f64,
    triangles: f64,
    /// The part that is textured, 0 to 1.
    textured: f64,
    /// The part of what is under its box that it fills, 0 to 1.
    filled: f64,
}

impl Drawn {
    fn of_node(node: &TreeNode) -> Self {
        let triangles = f64::from(node.triangles);
        Self {
            bbox: node.bbox,
            draws: f64::from(node.draws),
            vertices: f64::from(node.vertices),
            triangles,
            textured: f64::from(node.textured_triangles) / triangles.max(1.0),
            filled: 1.0,
        }
    }

    fn of_face(face: &Face, view: &View) -> Self {
        let bbox = face.bounds.map(DVec3::from_array);
        let [width, height] = view.size.map(f64::from);
        let angle: f64 = face.views.iter().map(|at| f64::from(at.solid_angle)).sum();
        let pixels = angle * view.pixels_per_metre() * view.pixels_per_metre();
        let under = view.frustum.covered(bbox) * width * height;
        Self {
            bbox,
            draws: face.views.len() as f64,
            vertices: f64::from(face.vertices),
            triangles: f64::from(face.triangles),
            textured: 1.0,
            filled: if under > 0.0 { (pixels / under).min(1.0) } else { 0.0 },
        }
    }
}

/// Sums up what fronts ask for; keeps its memory from one to the next.
#[derive(Clone, Debug, Default)]
pub(super) struct TileLoad {
    /// Squared distance and node.
    near_to_far: Vec<(f64, u32)>,
    /// How much of each tile is covered, 0 to 1.
    covered: Vec<f64>,
}

impl TileLoad {
    /// Numbers in `front` from the number of nodes on are those of faces of cells.
    pub fn of(
        &mut self,
        tree: &SceneTree,
        faces: &[Face],
        front: &[u32],
        view: &View,
    ) -> ModelLoad {
        let nodes = tree.len() as u32;
        let face = |number: u32| number.checked_sub(nodes).map(|at| &faces[at as usize]);
        let eye = view.pose.position;
        let distance = |number: u32| {
            let [min, max] = match face(number) {
                Some(face) => face.bounds.map(DVec3::from_array),
                None => tree.node(number).bbox,
            };
            // Faces are around the eye, and drawn after all else.
            let after = if number < nodes { 0.0 } else { f64::MAX / 2.0 };
            (after + eye.distance_squared(eye.clamp(min, max)), number)
        };
        self.near_to_far.clear();
        self.near_to_far.extend(front.iter().map(|&node| distance(node)));
        self.near_to_far.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        self.covered.clear();
        self.covered.resize(TILES[0] * TILES[1], 0.0);

        let pixels = view.size.map(f64::from).iter().product::<f64>();
        let mut load = ModelLoad::default();
        for at in 0..self.near_to_far.len() {
            let number = self.near_to_far[at].1;
            let drawn = match face(number) {
                Some(face) => Drawn::of_face(face, view),
                None => Drawn::of_node(tree.node(number)),
            };
            let (under, shaded) = match view.frustum.rectangle(drawn.bbox) {
                Some(rectangle) => self.cover(rectangle),
                None => (0.0, 0.0),
            };
            let (under, shaded) = (under * pixels * drawn.filled, shaded * pixels * drawn.filled);
            load.draws += drawn.draws;
            load.vertices += drawn.vertices;
            load.triangles += drawn.triangles;
            load.textured_fragments += shaded * drawn.textured;
            load.plain_fragments += shaded * (1.0 - drawn.textured);
            load.hidden_fragments += under - shaded;
            // Triangles of a pixel have an edge of a pixel; smaller ones are not drawn.
            load.edge_fragments += (under * drawn.triangles.min(under)).sqrt();
        }
        load
    }

    /// Covers what is under a rectangle; the part of the image that it is, and of that what nothing
    /// covered before. Within a tile, covers lie anyhow.
    fn cover(&mut self, rectangle: [[f64; 2]; 2]) -> (f64, f64) {
        let [across, up] = [0, 1].map(|axis| {
            let tiles = TILES[axis] as f64;
            rectangle[axis].map(|end| (end + 1.0) / 2.0 * tiles)
        });
        // The part of a tile that is between two ends.
        let part = |ends: [f64; 2], tile: usize| {
            let tile = tile as f64;
            (ends[1].min(tile + 1.0) - ends[0].max(tile)).max(0.0)
        };
        let range = |ends: [f64; 2], tiles: usize| {
            ends[0].max(0.0) as usize..(ends[1].ceil().max(0.0) as usize).min(tiles)
        };
        let (mut under, mut shaded) = (0.0, 0.0);
        for row in range(up, TILES[1]) {
            for column in range(across, TILES[0]) {
                let part = part(across, column) * part(up, row);
                let covered = &mut self.covered[row * TILES[0] + column];
                let new = part * (1.0 - *covered);
                *covered += new;
                under += part;
                shaded += new;
            }
        }
        let tiles = (TILES[0] * TILES[1]) as f64;
        (under / tiles, shaded / tiles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{Sketch, sketch, tree, view};

    #[test]
    fn what_is_beside_something_near_is_not_hidden_by_it() {
        // Two cubes of a tenth of the image's height side by side, and one behind the first.
        let at = |x: f64, y: f64| sketch([x, y, 0.0], 1.0, vec![]);
        let tree = tree(vec![at(11.0, -4.0), at(11.0, 4.0), at(21.0, 8.0)]);
        let view = view();
        let mut loads = TileLoad::default();
        let of = |loads: &mut TileLoad, front: &[u32]| loads.of(&tree, &[], front, &view);
        let [one, pair] = [&[0][..], &[0, 1]].map(|front| of(&mut loads, front));
        assert!((pair.plain_fragments - 2.0 * one.plain_fragments).abs() < 1e-9);
        assert!(pair.hidden_fragments < 1e-9);
        let behind = of(&mut loads, &[2, 1]);
        assert!(behind.hidden_fragments > 0.7 * of(&mut loads, &[2]).plain_fragments);
    }

    #[test]
    fn what_is_shaded_and_hidden_is_all_that_is_under_boxes() {
        let wall = |x: f64| Sketch { size: 100.0, ..sketch([x, 0.0, 0.0], 1.0, vec![]) };
        let tree = tree(vec![wall(51.0), wall(160.0)]);
        let load = TileLoad::default().of(&tree, &[], &[1, 0], &view());
        assert!((load.plain_fragments - 1e4).abs() < 1e-6, "{load:?}");
        let far = view().frustum.covered(tree.node(1).bbox) * 1e4;
        assert!((load.hidden_fragments - far).abs() < 1e-6, "{load:?}");
        assert_eq!((load.triangles, load.draws), (20.0, 2.0));
        // Ten triangles in the image: each of a side of √1000 pixels.
        let edges = (10.0 * 1e4f64).sqrt() + (10.0 * far).sqrt();
        assert!((load.edge_fragments - edges).abs() < 1e-6);
    }
}
