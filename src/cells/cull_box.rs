//! How large a cull box is to be.

use glam::DVec3;

use super::options::{Balance, CellOptions};
use crate::camera::{Pose, View, from_angles};
use crate::mesh::UpAxis;
use crate::runtime::SceneTree;

/// The picture for which boxes are balanced: 1280 × 720 under 60°.
const SIZE: [u32; 2] = [1280, 720];
const FOV_Y_DEG: f64 = 60.0;

/// Degrees between the directions that are looked in: pictures overlap.
const YAW_STEP_DEG: f64 = 45.0;

/// Metres from a cell to the sides of its cull box that are tried, each about the root of 2 times the one before.
/// The greatest is that of streets, of which little is seen farther.
const TRIED_M: [f64; 9] = [30.0, 42.0, 60.0, 85.0, 120.0, 170.0, 240.0, 340.0, 480.0];

/// Metres from a cell to the sides of its cull box.
pub(super) fn cull_m(tree: &SceneTree, up: UpAxis, eye: DVec3, options: &CellOptions) -> f64 {
    let Some(balance) = &options.balance else { return options.cull_m };
    let found = TRIED_M.map(|metres| (metres, error(tree, up, eye, metres, options, balance)));
    // Where even the roots are too many, the fewest.
    let less = |a: &Error, b: &Error| a.too_many.cmp(&b.too_many).then(a.px.total_cmp(&b.px));
    found.into_iter().min_by(|a, b| less(&a.1, &b.1)).map_or(options.cull_m, |(metres, _)| metres)
}

/// What a cull box comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Error {
    /// By so many triangles the roots of what is near are more than there may be.
    too_many: u64,
    /// Pixels.
    px: f64,
}

/// By how much what is near is off at the level that the triangles are enough for, and, weighted, what is far,
/// by the balance of Aliaga and others (1999, section 3.3).
fn error(
    tree: &SceneTree,
    up: UpAxis,
    eye: DVec3,
    metres: f64,
    options: &CellOptions,
    balance: &Balance,
) -> Error {
    let half = options.cell_m / 2.0 + metres;
    let within = [eye - DVec3::splat(half), eye + DVec3::splat(half)];
    let mut near = Error { too_many: 0, px: 0.0 };
    let mut far_px: f64 = 0.0;
    for direction in 0..(360.0 / YAW_STEP_DEG) as u32 {
        let rotation = from_angles(up, f64::from(direction) * YAW_STEP_DEG, 0.0, 0.0);
        let pose = Pose { position: eye, rotation, fov_y_deg: FOV_Y_DEG };
        let view = View::new(pose, DVec3::ZERO, SIZE).within(Some(within));
        let found = level(tree, &view, balance.triangles);
        near = Error { too_many: near.too_many.max(found.too_many), px: near.px.max(found.px) };
        // By the skins that span it in the paper, by what the pictures do not show here: how far what is
        // at the box moves where the eye goes from the middle to a corner.
        far_px = view.pixels_per_metre() * options.reach_m() / half;
    }
    Error { px: near.px + balance.far_weight * far_px, ..near }
}

/// The least error within which what a view shows can be drawn with so many triangles; that of the roots where
/// they are more.
fn level(tree: &SceneTree, view: &View, most_triangles: u64) -> Error {
    let mut triangles: i64 = 0;
    // For each node that can be refined its error and how many triangles that adds.
    let mut steps: Vec<(f64, i64)> = Vec::new();
    let mut open: Vec<(u32, f64)> = tree.roots().iter().map(|&root| (root, f64::MAX)).collect();
    let is_seen = |node: u32| view.frustum.outside(tree.node(node).bbox) <= 0.0;
    open.retain(|&(root, _)| is_seen(root));
    triangles += open.iter().map(|&(root, _)| i64::from(tree.node(root).triangles)).sum::<i64>();
    while let Some((node, most)) = open.pop() {
        let at = tree.node(node);
        let children = tree.children(node);
        if children.is_empty() {
            continue;
        }
        // Never refined before its parent.
        let error = (at.viewer_error * tree.pixels_per_metre(node, view)).min(most);
        let seen = children.iter().copied().filter(|&child| is_seen(child));
        let of_children: i64 =
            seen.clone().map(|child| i64::from(tree.node(child).triangles)).sum();
        steps.push((error, of_children - i64::from(at.triangles)));
        open.extend(seen.map(|child| (child, error)));
    }
    let too_many = (triangles as u64).saturating_sub(most_triangles);
    steps.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    for (error, more) in steps {
        triangles += more;
        if triangles > most_triangles as i64 {
            return Error { too_many, px: error };
        }
    }
    Error { too_many, px: 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::runtime::test_tree::{Sketch, sketch, tree};

    /// Houses in a row along x, 10 m apart, 10 triangles each and 40 in their leaves, off by a metre.
    fn row(houses: u32) -> SceneTree {
        let house = |at: u32| {
            let at = [10.0 * f64::from(at) + 10.0, 0.0, 0.0];
            let leaves = (0..2).map(|_| Sketch { triangles: 20, ..sketch(at, 1.0, vec![]) });
            Sketch { error: 1.0, ..sketch(at, 1.0, leaves.collect()) }
        };
        tree((0..houses).map(house).collect())
    }

    fn view() -> View {
        let pose = Pose {
            position: DVec3::ZERO,
            rotation: from_angles(UpAxis::Z, 0.0, 0.0, 0.0),
            fov_y_deg: FOV_Y_DEG,
        };
        View::new(pose, DVec3::ZERO, SIZE)
    }

    #[test]
    fn the_level_is_the_finest_that_the_triangles_are_enough_for() {
        // The row lies along the line of sight of one of the directions.
        let yaws = (0..8).map(|yaw| f64::from(yaw) * YAW_STEP_DEG);
        let looks = |yaw: f64| {
            let rotation = from_angles(UpAxis::Z, yaw, 0.0, 0.0);
            View::new(Pose { rotation, ..view().pose }, DVec3::ZERO, SIZE)
        };
        let houses = row(10);
        let most = |triangles: u64| {
            yaws.clone().map(|yaw| level(&houses, &looks(yaw), triangles).px).fold(0.0, f64::max)
        };
        assert_eq!(most(400), 0.0, "all leaves");
        let errors = [399, 250, 130, 100, 10].map(most);
        assert!(errors[0] > 0.0 && errors.is_sorted(), "{errors:?}");
        assert_eq!(errors[3], errors[4], "of the roots");
        let too_many = |triangles: u64| level(&houses, &looks(0.0), triangles).too_many;
        let ahead = yaws.clone().map(|yaw| level(&houses, &looks(yaw), 70).too_many).max();
        assert_eq!((ahead, too_many(400)), (Some(30), 0));
    }

    #[test]
    fn the_more_triangles_the_larger_is_the_box() {
        let houses = row(40);
        let metres = |triangles: u64| {
            let balance = Some(Balance { triangles, far_weight: 0.15 });
            let options = CellOptions { balance, ..CellOptions::default() };
            cull_m(&houses, UpAxis::Z, DVec3::ZERO, &options)
        };
        let found = [10, 60, 400, 800, 1600].map(metres);
        assert!(found.is_sorted() && found[1] < found[3], "{found:?}");
        assert_eq!([found[0], found[4]], [TRIED_M[0], TRIED_M[8]]);
        let fixed = CellOptions { cull_m: 77.0, balance: None, ..CellOptions::default() };
        assert_eq!(cull_m(&houses, UpAxis::Z, DVec3::ZERO, &fixed), 77.0);
    }
}
