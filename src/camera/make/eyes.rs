//! Everywhere that eyes are.

use glam::DVec3;

use super::ground::Ground;
use super::streets::Streets;

/// Places of eyes along all streets and squares that [`make_path`](super::make_path) walks through, in source
/// coordinates: one for each cell of the map; none where there is no room to go.
pub fn street_eyes(ground: &Ground) -> Vec<DVec3> {
    let Some(streets) = Streets::find(ground) else { return Vec::new() };
    let eye = |&cell: &usize| {
        let at = ground.surfaces.cells.middle(cell);
        let height = f64::from(ground.height[cell]) + ground.eye_height();
        ground.plan.source(at.extend(height))
    };
    streets.open.iter().map(eye).collect()
}

/// Places of eyes over all of the scene, in source coordinates: `spacing` metres apart, and `height` metres
/// above the ground.
pub fn eyes_over(ground: &Ground, spacing: f64, height: f64) -> Vec<DVec3> {
    let [min, max] = ground.bounds;
    let count = |length: f64| (length / spacing).ceil().max(1.0) as usize;
    let (columns, rows) = (count(max.x - min.x), count(max.y - min.y));
    let eye = |at: usize| {
        let part = glam::DVec2::new((at % columns) as f64, (at / columns) as f64) + 0.5;
        let place = min.truncate() + part * spacing;
        ground.plan.source(place.extend(ground.height_at(place) + height))
    };
    (0..columns * rows).map(eye).collect()
}
