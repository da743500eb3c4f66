//! Transforms from source coordinates to the Earth.

use super::tile::Tile;
use crate::place::Globe;

/// A tile gets a transform of its own where that of the tile above is farther than this from the
/// map projection, metres. Neighbours may part by twice as much.
const CLOSE: f64 = 0.001;

/// Gives tiles the transforms that take them to the Earth; boxes are those of the content alone.
/// Returns the largest distance, metres, of a leaf's box to where it belongs; `None` where the
/// coordinates have no place.
pub fn place(root: &mut Tile, globe: &Globe) -> Option<f64> {
    let fit = globe.fit(root.low, root.high)?;
    root.fit = Some(fit);
    root.transform = Some(fit.affine());
    let mut farthest = 0.0f64;
    for child in &mut root.children {
        child.fit = Some(fit);
        farthest = farthest.max(descend(child, globe)?);
    }
    Some(farthest)
}

/// `tile.fit` is its parent's.
fn descend(tile: &mut Tile, globe: &Globe) -> Option<f64> {
    let outer = tile.fit?;
    let mut fit = outer;
    let mut residual = outer.residual(|point| globe.to_ecef(point), tile.low, tile.high);
    // Groups draw nothing: what is below them is fitted to its own box.
    if tile.content.is_some() && residual > CLOSE {
        let own = globe.fit(tile.low, tile.high)?;
        let own_residual = own.residual(|point| globe.to_ecef(point), tile.low, tile.high);
        if own_residual < residual {
            tile.transform = Some(own.within(&outer)?);
            (fit, residual) = (own, own_residual);
        }
    }
    tile.fit = Some(fit);
    if tile.children.is_empty() {
        return Some(residual);
    }
    let mut farthest = 0.0f64;
    for child in &mut tile.children {
        child.fit = Some(fit);
        farthest = farthest.max(descend(child, globe)?);
    }
    Some(farthest)
}
