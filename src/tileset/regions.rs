//! One root over all blocks. Where there are many, regions of neighbours stand between, so that a
//! viewer looks at the few that it sees.

use super::tile::Tile;
use crate::format::Scene;

/// Tiles directly below a tile without content, at most.
const MOST_CHILDREN: usize = 16;
/// Parts that a region is divided into.
const PARTS: usize = 4;

/// The root of a scene; its boxes enclose nothing yet but their own content.
pub fn root(scene: &Scene) -> Tile {
    let errors = scene.viewer_errors();
    region(scene.roots().map(|root| Tile::of_node(scene, &errors, root)).collect())
}

fn region(tiles: Vec<Tile>) -> Tile {
    if tiles.len() <= MOST_CHILDREN {
        return Tile::group(tiles);
    }
    let mut parts = vec![tiles];
    while parts.len() < PARTS {
        parts = parts.into_iter().flat_map(halves).collect();
    }
    Tile::group(parts.into_iter().map(region).collect())
}

/// Two halves of equal count along the longer side; ties stay in the scene's order.
fn halves(mut tiles: Vec<Tile>) -> [Vec<Tile>; 2] {
    let centres = tiles.iter().map(Tile::centre);
    let low = centres.clone().reduce(|low, centre| low.min(centre)).unwrap_or_default();
    let high = centres.reduce(|high, centre| high.max(centre)).unwrap_or_default();
    let axis = (high - low).max_position();
    tiles.sort_by(|a, b| a.centre()[axis].total_cmp(&b.centre()[axis]));
    let second = tiles.split_off(tiles.len() / 2);
    [tiles, second]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn unit(x: usize, y: usize) -> Tile {
        let low = DVec3::new(x as f64, y as f64, 0.0);
        Tile { low, high: low + 1.0, error: 0.0, ..Tile::group(vec![]) }
    }

    fn leaves(tile: &Tile) -> usize {
        if tile.children.is_empty() { 1 } else { tile.children.iter().map(leaves).sum() }
    }

    #[test]
    fn many_blocks_become_regions_of_neighbours() {
        let root = region((0..400).map(|i| unit(i % 20, i / 20)).collect());
        assert_eq!(leaves(&root), 400);
        assert_eq!(root.children.len(), PARTS);
        assert_eq!(root.children[0].high - root.children[0].low, DVec3::new(10.0, 10.0, 1.0));
        assert!(root.error > root.children[0].error);
    }

    #[test]
    fn few_blocks_are_children_of_the_root() {
        assert_eq!(region((0..16).map(|i| unit(i, 0)).collect()).children.len(), 16);
    }
}
