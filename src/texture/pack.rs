//! Packing shapes of cells into rectangles, by shape rather than by bounding box.
//!
//! Shapes are placed largest first at the lowest, then leftmost position where they fit, upright or
//! transposed, on a page whose opposite sides meet ([`WrappedPage`]). Widths are tried around the
//! square's; each is given the height with which it would beat the best page so far.

use super::open_page;
use super::packing::{Packing, Placement};
use super::shape::Shape;
use super::wrapped_page::{MAX_COLUMNS, PageShape, WrappedPage};

/// Pages whose square is wider than this are packed on a coarser grid.
const WIDEST_SQUARE: usize = 96;

/// The square's side over the least width that is tried; the greatest is as much above.
const SPREAD: f64 = 2.0;

/// The search ends at a page that is larger than its shapes by no more than this.
const GOOD: f64 = 1.03;

/// Shapes placed over all widths, about: with many shapes fewer widths are tried, as they fill
/// any page alike.
const EFFORT: usize = 300;

/// Widths that are tried at least.
const LEAST_WIDTHS: usize = 8;

/// Packs shapes into pages of at most `max` cells a side; one page where they fit, as small as is
/// found. `None` where a shape is larger than a page. Sides of a page that wraps are multiples of
/// `multiple`.
pub(crate) fn pack(shapes: &[&Shape], max: usize, multiple: usize) -> Option<Packing> {
    let widest = shapes.iter().map(|shape| shape.size[0]).max().unwrap_or(1);
    let tallest = shapes.iter().map(|shape| shape.size[1]).max().unwrap_or(1);
    if widest > max || tallest > max {
        return None;
    }
    let area: usize = shapes.iter().map(|shape| shape.area()).sum();
    let side = (area as f64).sqrt();
    let narrowest = shapes.iter().map(|shape| shape.size[0].min(shape.size[1])).max().unwrap_or(1);
    let mut factor = 1;
    while side as usize > WIDEST_SQUARE * factor || narrowest > MAX_COLUMNS * factor {
        factor *= 2;
    }
    let coarse: Vec<Shape> = shapes.iter().map(|shape| shape.coarser(factor)).collect();
    let mut order: Vec<usize> = (0..shapes.len()).collect();
    order.sort_by_key(|index| {
        let [width, height] = coarse[*index].size;
        std::cmp::Reverse((coarse[*index].area(), width * height))
    });
    let limit = max / factor;
    let found = one_page(&coarse, &order, limit, multiple.div_ceil(factor));
    let mut packing = match found {
        Some(packing) => packing,
        None => open_page::pack(&coarse, &order, limit.max(1))?,
    };
    for placement in &mut packing.placements {
        placement.x *= factor;
        placement.y *= factor;
    }
    packing.pages.iter_mut().flatten().for_each(|side| *side *= factor);
    packing.trim(shapes);
    Some(packing)
}

/// The smallest page that is found, of at most `max` cells a side and multiples of `multiple`.
fn one_page(shapes: &[Shape], order: &[usize], max: usize, multiple: usize) -> Option<Packing> {
    let cells: usize = shapes.iter().map(Shape::area).sum();
    let page_shapes: Vec<[PageShape; 2]> = shapes
        .iter()
        .map(|shape| [PageShape::new(shape), PageShape::new(&shape.transposed())])
        .collect();
    let max = max / multiple;
    let side = (cells.max(1) as f64).sqrt() / multiple as f64;
    let widest = max.min(MAX_COLUMNS / multiple);
    let low = ((side / SPREAD) as usize).clamp(1, widest.max(1));
    let high = ((side * SPREAD) as usize + 1).min(widest);
    let count = (EFFORT / shapes.len().max(1)).max(LEAST_WIDTHS);
    let middle = side.round() as usize;
    let mut widths: Vec<usize> =
        (low..=high).step_by(((high + 1).saturating_sub(low) / count).max(1)).collect();
    widths.sort_by_key(|width| width.abs_diff(middle));

    // All in multiples from here on.
    let unit = multiple * multiple;
    let mut best: Option<([usize; 2], Vec<Placement>)> = None;
    for width in widths {
        let least = cells.div_ceil(width * unit).max(1);
        let mut most = match &best {
            Some(([columns, rows], _)) => (columns * rows - 1) / width,
            None => 2 * least + 2,
        }
        .min(max);
        // Where the height that would be better fails, so do lesser ones.
        let mut height = if best.is_some() { most } else { most.min(least + least / 8) };
        let mut fails = least - 1;
        while fails < most && height >= least {
            match place_all(&page_shapes, order, [width * multiple, height * multiple]) {
                Some(placements) => {
                    best = Some(([width, height], placements));
                    most = height - 1;
                }
                None => fails = height,
            }
            height = fails + 1 + most.saturating_sub(fails + 1) / 2;
        }
        if let Some(([columns, rows], _)) = &best
            && (columns * rows * unit) as f64 <= GOOD * cells as f64
        {
            break;
        }
    }
    let (size, placements) = best?;
    Some(Packing { placements, pages: vec![size.map(|side| side * multiple)], wraps: true })
}

/// Places all shapes on one page of this size, or `None`.
fn place_all(
    shapes: &[[PageShape; 2]],
    order: &[usize],
    size: [usize; 2],
) -> Option<Vec<Placement>> {
    let mut page = WrappedPage::new(size[0], size[1]);
    let mut placements = vec![Placement::default(); shapes.len()];
    for (placed, index) in order.iter().enumerate() {
        let [upright, transposed] = &shapes[*index];
        let first = page.find(upright, size[1]);
        let ends = first.map_or(usize::MAX, |at| at[1] + upright.size[1]);
        // Turned where it then ends further up.
        let second = page.find(transposed, ends.saturating_sub(transposed.size[1]).min(size[1]));
        let (at, transposed) = match (first, second) {
            (_, Some(at)) => (at, true),
            (Some(at), None) => (at, false),
            (None, None) => return None,
        };
        if placed + 1 < order.len() {
            page.put(&shapes[*index][usize::from(transposed)], at);
        }
        placements[*index] = Placement { page: 0, x: at[0], y: at[1], transposed };
    }
    Some(placements)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn block(width: usize, height: usize) -> Shape {
        Shape {
            size: [width, height],
            runs: (0..height as u32).map(|row| [row, 0, width as u32]).collect(),
        }
    }

    /// An L: the lower left of a square without its upper right.
    fn corner(size: u32) -> Shape {
        let runs =
            (0..size).map(|row| [row, 0, if row < size / 2 { size / 2 } else { size }]).collect();
        Shape { size: [size as usize; 2], runs }
    }

    fn refs(shapes: &[Shape]) -> Vec<&Shape> {
        shapes.iter().collect()
    }

    fn check(shapes: &[Shape], packing: &Packing, max: usize) {
        let mut pages: Vec<Vec<bool>> =
            packing.pages.iter().map(|[w, h]| vec![false; w * h]).collect();
        assert!(packing.pages.iter().all(|[w, h]| *w <= max && *h <= max));
        let on_page = |at: usize, side: usize| {
            assert!(at < side || packing.wraps);
            at % side
        };
        for (shape, placement) in shapes.iter().zip(&packing.placements) {
            let [width, height] = packing.pages[placement.page];
            for [row, start, end] in &shape.runs {
                for x in *start..*end {
                    let (x, y) = if placement.transposed { (*row, x) } else { (x, *row) };
                    let x = on_page(placement.x + x as usize, width);
                    let y = on_page(placement.y + y as usize, height);
                    let cell = &mut pages[placement.page][y * width + x];
                    assert!(!*cell, "two shapes share a cell");
                    *cell = true;
                }
            }
        }
    }

    #[test]
    fn many_shapes_never_overlap() {
        let mut random = Random::new(1, 0);
        for round in 0..30 {
            let shapes: Vec<Shape> = (0..1 + random.below(80))
                .map(|_| match random.below(2) {
                    0 => block(1 + random.below(40), 1 + random.below(90)),
                    _ => corner(2 + random.below(70) as u32),
                })
                .collect();
            let max = if round % 2 == 0 { 4096 } else { 100 };
            check(&shapes, &pack(&refs(&shapes), max, 1 + round % 2).expect("fits"), max);
        }
    }

    #[test]
    fn shapes_nest_where_boxes_would_not() {
        // Two corners fill a rectangle with a block in their notches.
        let shapes = [corner(8), block(4, 4), corner(8), block(4, 4)];
        let packing = pack(&refs(&shapes), 64, 1).expect("fits");
        check(&shapes, &packing, 64);
        assert!(packing.area() <= 8 * 16 + 16, "{:?}", packing.pages);
    }

    #[test]
    fn large_sets_go_to_a_coarser_grid_and_several_pages() {
        let shapes: Vec<Shape> = (0..60).map(|i| block(150 + i, 130 + i)).collect();
        let one = pack(&refs(&shapes), 4096, 1).expect("fits");
        check(&shapes, &one, 4096);
        assert_eq!(one.pages.len(), 1);
        let many = pack(&refs(&shapes), 400, 1).expect("fits");
        check(&shapes, &many, 400);
        assert!(many.pages.len() > 10);
        assert_eq!(pack(&refs(&shapes), 200, 1), None);
    }

    #[test]
    fn long_strips_fit_a_page_of_their_length() {
        let shapes = [block(1000, 3), block(900, 3), block(3, 3)];
        let packing = pack(&refs(&shapes), 2048, 2).expect("fits");
        check(&shapes, &packing, 2048);
        assert!(packing.area() <= 9 * 1000, "{:?}", packing.pages);
    }

    #[test]
    fn slanted_shapes_need_little_more_than_their_cells() {
        let runs: Vec<[u32; 3]> = (0..40).map(|row| [row, row / 2, row / 2 + 60]).collect();
        let shapes = vec![Shape { size: [79, 40], runs }; 2];
        let packing = pack(&refs(&shapes), 4096, 2).expect("fits");
        check(&shapes, &packing, 4096);
        assert!(packing.wraps && packing.pages[0].iter().all(|side| side % 2 == 0));
        assert!(packing.area() <= 2 * 40 * 60 * 21 / 20, "{:?}", packing.pages);
    }

    #[test]
    fn nothing_packs_to_nothing() {
        assert_eq!(pack(&[], 10, 2).map(|packing| packing.area()), Some(0));
    }
}
