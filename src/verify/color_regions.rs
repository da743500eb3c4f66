//! Measures the share of a level's surface that has another colour than the source, region by region.
//!
//! The colour of single points says little: a coarse texture is a blurred one, and a coarse surface is
//! off by the node's error, so that details are elsewhere. So the mean colour of regions is compared, in
//! linear light as textures are reduced: cubes with the node's error as their side, or larger where
//! points are few. A wrong material is another colour over all of a region.

use glam::DVec3;

use super::points::Points;
use super::surface_appearance::Color;
use crate::color::{linear_to_srgb, srgb_to_linear};
use crate::format::Scene;

/// Mean colours of a region that differ by more than this in some channel, sRGB, 0–255, are two
/// colours.
const OTHER_COLOR: f64 = 64.0;

/// Points that a flat surface has in a region, on average, at least.
const POINTS: f64 = 16.0;

/// The mean colour of fewer points says nothing.
const FEWEST: usize = 6;

/// A point of the source with its colour there and on a level.
#[derive(Clone, Copy, Debug)]
pub(super) struct ComparedPoint {
    /// Number among the points.
    pub number: u32,
    /// The node of the level that shows it.
    pub node: u32,
    pub shown: Color,
    pub source: Color,
}

/// The regions of a level.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ColorRegions {
    /// Points in regions that were compared.
    pub points: u64,
    /// Those of these points that are in regions of another colour.
    pub wrong: u64,
    /// The node that has most of the wrong points, how many it has, and one of them.
    pub worst: Option<(u32, u64, DVec3)>,
}

impl ColorRegions {
    /// Divides a level into regions and compares their colours.
    pub fn new(scene: &Scene, points: &Points, compared: &[ComparedPoint]) -> Self {
        let least = if points.density > 0.0 { (POINTS / points.density).sqrt() } else { 1.0 };
        let region = |point: &ComparedPoint| {
            let side = scene.nodes[point.node as usize].geometric_error.max(least);
            let at = points.all[point.number as usize].point / side;
            // Surfaces at whole coordinates lie within a region, not between two.
            let cube = (at + 0.5).floor().to_array().map(|side| side as i64);
            (point.node, cube, point.number)
        };
        let mut compared: Vec<_> = compared.iter().map(|point| (region(point), point)).collect();
        compared.sort_unstable_by_key(|&(region, _)| region);
        let mut regions = Self::default();
        for of_node in compared.chunk_by(|((a, ..), _), ((b, ..), _)| a == b) {
            let mut wrong: Option<(u64, DVec3)> = None;
            let of_regions = of_node.chunk_by(|((_, a, _), _), ((_, b, _), _)| a == b);
            for region in of_regions.filter(|region| region.len() >= FEWEST) {
                let count = region.len() as u64;
                regions.points += count;
                if is_other_color(region.iter().map(|&(_, point)| point)) {
                    let at = points.all[region[0].1.number as usize].point;
                    wrong.get_or_insert((0, at)).0 += count;
                }
            }
            let Some((count, at)) = wrong else { continue };
            regions.wrong += count;
            if regions.worst.is_none_or(|(_, most, _)| count > most) {
                regions.worst = Some((of_node[0].1.node, count, at));
            }
        }
        regions
    }

    /// Share of the compared surface that has another colour; `None` where nothing was compared.
    pub fn wrong_share(&self) -> Option<f64> {
        (self.points > 0).then(|| self.wrong as f64 / self.points as f64)
    }
}

/// True if the mean colours of points differ.
fn is_other_color<'a>(points: impl Iterator<Item = &'a ComparedPoint>) -> bool {
    let (mut shown, mut source, mut count) = ([0.0; 3], [0.0; 3], 0.0);
    for point in points {
        for channel in 0..3 {
            let light = |color: Color| srgb_to_linear(f64::from(color[channel]) / 255.0);
            shown[channel] += light(point.shown);
            source[channel] += light(point.source);
        }
        count += 1.0;
    }
    let encoded = |sum: f64| linear_to_srgb(sum / count) * 255.0;
    (0..3).any(|channel| (encoded(shown[channel]) - encoded(source[channel])).abs() > OTHER_COLOR)
}

#[cfg(test)]
mod tests {
    use super::super::geometry::NodeGeometry;
    use super::*;
    use crate::format::test_scene::scene;

    const ASPHALT: Color = [90.0, 90.0, 95.0];
    const GRASS: Color = [80.0, 170.0, 60.0];

    /// A square of 90 m; what a level shows at each of its points is `shown`.
    fn regions(shown: impl Fn(DVec3) -> Color, source: impl Fn(DVec3) -> Color) -> ColorRegions {
        let mut scene = scene();
        scene.nodes[0].geometric_error = 1.0;
        let square = [[0.0, 0.0, 0.0], [90.0, 0.0, 0.0], [90.0, 90.0, 0.0], [0.0, 90.0, 0.0]];
        let geometry = NodeGeometry {
            positions: square.to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..NodeGeometry::default()
        };
        let points = Points::new(&[0], &[geometry], 20_000, 1);
        let compared: Vec<ComparedPoint> = (0..)
            .zip(&points.all)
            .map(|(number, at)| {
                let [shown, source] = [shown(at.point), source(at.point)];
                ComparedPoint { number, node: 0, shown, source }
            })
            .collect();
        ColorRegions::new(&scene, &points, &compared)
    }

    #[test]
    fn a_wrong_material_is_found_by_its_share_of_the_surface() {
        let third = |at: DVec3| if at.x < 30.0 { GRASS } else { ASPHALT };
        let found = regions(third, |_| ASPHALT);
        let share = found.wrong_share().unwrap();
        assert!((share - 1.0 / 3.0).abs() < 0.03, "{share}");
        let (node, count, at) = found.worst.unwrap();
        assert_eq!((node, count), (0, found.wrong));
        assert!(at.x < 31.0);
        assert_eq!(regions(third, third).wrong_share(), Some(0.0));
    }

    #[test]
    fn blurred_and_shifted_details_are_not_wrong() {
        // A chessboard of 0.5 m, twice as fine as the node's error, and its mean in linear light.
        let board = |at: DVec3| {
            let is_white = (at.x * 2.0).floor() as i64 + (at.y * 2.0).floor() as i64;
            if is_white % 2 == 0 { [255.0; 3] } else { [0.0; 3] }
        };
        let share = regions(|_| [187.5; 3], board).wrong_share().unwrap();
        assert!(share < 0.05, "{share}");
        let shifted = regions(|at| board(at + DVec3::X * 0.25), board).wrong_share().unwrap();
        assert!(shifted < 0.15, "{shifted}");
        let black = regions(|_| [0.0; 3], board).wrong_share().unwrap();
        assert!(black > 0.95, "{black}");
    }
}
