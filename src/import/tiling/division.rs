//! Which squares of the ground the tiles of a file are.

use crate::mesh::UpAxis;

/// Cells along the longer side of the ground, at most: lines between tiles are lines between cells.
const CELLS: f64 = 1024.0;

/// How much more than a half of the vertices may be on one side of a line, of all.
const UNEVEN: f64 = 0.15;

/// Where vertices are: how many in each cell of the ground.
pub(super) struct Counts {
    /// The two axes along the ground.
    axes: [usize; 2],
    /// Of the first cell.
    corner: [f64; 2],
    /// Of a cell; a power of two, so that lines between cells are on every lattice.
    side: f64,
    /// Cells along each axis.
    size: [usize; 2],
    /// Row by row.
    counts: Vec<u32>,
}

impl Counts {
    /// Of a file whose vertices are in this box, with none so far.
    pub fn new([low, high]: [[f64; 3]; 2], up: UpAxis) -> Self {
        let axes = super::ground(up);
        let extent = axes.map(|axis| high[axis] - low[axis]);
        let longest = extent[0].max(extent[1]).max(f64::MIN_POSITIVE);
        let side = libm::exp2(libm::log2(longest / CELLS).ceil());
        let corner = axes.map(|axis| (low[axis] / side).floor() * side);
        let size = [0, 1].map(|at| ((high[axes[at]] - corner[at]) / side) as usize + 1);
        Self { axes, corner, side, size, counts: vec![0; size[0] * size[1]] }
    }

    /// Counts a vertex.
    pub fn add(&mut self, vertex: [f64; 3]) {
        let [column, row] = [0, 1].map(|at| {
            let cell = (vertex[self.axes[at]] - self.corner[at]) / self.side;
            (cell.max(0.0) as usize).min(self.size[at] - 1)
        });
        let count = &mut self.counts[row * self.size[0] + column];
        *count = count.saturating_add(1);
    }

    /// Vertices of each line of cells across an axis, of a rectangle of cells.
    fn across(&self, axis: usize, [columns, rows]: &[std::ops::Range<usize>; 2]) -> Vec<u64> {
        let along = [columns, rows][axis];
        let mut sums = vec![0; along.len()];
        for row in rows.clone() {
            for column in columns.clone() {
                let at = [column, row][axis] - along.start;
                sums[at] += u64::from(self.counts[row * self.size[0] + column]);
            }
        }
        sums
    }
}

enum Place {
    Tile(usize),
    /// A plane across an axis, and the places of what is below it and what is not.
    Cut {
        axis: usize,
        at: f64,
        below: usize,
        above: usize,
    },
}

/// The ground halved where about as much is on either side, the halves likewise, and so on.
#[derive(Default)]
pub(super) struct Division {
    places: Vec<Place>,
    /// How many tiles there are.
    pub tiles: usize,
}

impl Division {
    /// Into tiles of so many vertices at most, or of a single cell.
    pub fn of(counts: &Counts, most: u64) -> Self {
        let mut division = Self { places: Vec::new(), tiles: 0 };
        division.divide(counts, counts.size.map(|size| 0..size), most.max(1));
        division
    }

    /// The place of a rectangle of cells.
    fn divide(&mut self, counts: &Counts, cells: [std::ops::Range<usize>; 2], most: u64) -> usize {
        let place = self.places.len();
        let longer = usize::from(cells[1].len() > cells[0].len());
        let sums = counts.across(longer, &cells);
        let whole: u64 = sums.iter().sum();
        if whole <= most || sums.len() < 2 {
            self.places.push(Place::Tile(self.tiles));
            self.tiles += 1;
            return place;
        }
        // Of lines by which neither side has much more, one through where least is: along a street rather than
        // through a wall.
        let mut below = 0;
        let mut best = (f64::INFINITY, 1);
        for half in 1..sums.len() {
            below += sums[half - 1];
            let off = (below as f64 / whole as f64 - 0.5).abs();
            let along = (sums[half - 1] + sums[half]) as f64 / whole as f64;
            // Out of what is even, the evenest.
            let price = if off <= UNEVEN { along + off * 1e-3 } else { 1.0 + off };
            if price < best.0 {
                best = (price, half);
            }
        }
        let line = cells[longer].start + best.1;
        let at = counts.corner[longer] + line as f64 * counts.side;
        let axis = counts.axes[longer];
        self.places.push(Place::Cut { axis, at, below: 0, above: 0 });
        let mut halves = [cells.clone(), cells];
        halves[0][longer].end = line;
        halves[1][longer].start = line;
        let [below, above] = halves.map(|cells| self.divide(counts, cells, most));
        self.places[place] = Place::Cut { axis, at, below, above };
        place
    }

    /// The tile in which all corners are, if it is one.
    pub fn tile_of(&self, corners: &[[f64; 3]]) -> Option<usize> {
        let mut place = 0;
        loop {
            match self.places[place] {
                Place::Tile(tile) => return Some(tile),
                Place::Cut { axis, at, below, above } => {
                    place = if corners.iter().all(|corner| corner[axis] <= at) {
                        below
                    } else if corners.iter().all(|corner| corner[axis] >= at) {
                        above
                    } else {
                        return None;
                    };
                }
            }
        }
    }

    /// Cuts a flat polygon along the planes between tiles, and gives each tile its part.
    pub fn cut<C: Corner>(&self, polygon: Vec<C>, part: &mut impl FnMut(usize, &[C])) {
        self.cut_from(0, polygon, part);
    }

    fn cut_from<C: Corner>(
        &self,
        place: usize,
        polygon: Vec<C>,
        part: &mut impl FnMut(usize, &[C]),
    ) {
        if polygon.len() < 3 {
            return;
        }
        match self.places[place] {
            Place::Tile(tile) => part(tile, &polygon),
            Place::Cut { axis, at, below, above } => {
                let [one, other] = halves(&polygon, axis, at);
                self.cut_from(below, one, part);
                self.cut_from(above, other, part);
            }
        }
    }
}

/// A corner of a polygon that is cut.
pub(super) trait Corner: Clone {
    /// Where it is.
    fn at(&self) -> [f64; 3];
    /// The one at `at`, this part of the way to another.
    fn between(&self, other: &Self, part: f64, at: [f64; 3]) -> Self;
}

/// What of a polygon is on either side of a plane.
fn halves<C: Corner>(polygon: &[C], axis: usize, plane: f64) -> [Vec<C>; 2] {
    let mut halves = [Vec::with_capacity(polygon.len() + 1), Vec::with_capacity(polygon.len() + 1)];
    for (corner, next) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let [from, to] = [corner, next].map(|corner| corner.at()[axis]);
        if from <= plane {
            halves[0].push(corner.clone());
        }
        if from >= plane {
            halves[1].push(corner.clone());
        }
        if (from < plane && to > plane) || (from > plane && to < plane) {
            let met = met(corner, next, axis, plane);
            halves.iter_mut().for_each(|half| half.push(met.clone()));
        }
    }
    // What only touches the plane is wholly on the other side.
    for (half, is_beside) in halves.iter_mut().zip([f64::lt, f64::gt]) {
        if !half.iter().any(|corner| is_beside(&corner.at()[axis], &plane)) {
            half.clear();
        }
    }
    halves
}

/// Where an edge meets a plane: the same point from whichever end it is looked at.
fn met<C: Corner>(one: &C, other: &C, axis: usize, plane: f64) -> C {
    let [a, b] = [one.at(), other.at()];
    let is_first = a.iter().zip(&b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
    if is_first.is_some_and(std::cmp::Ordering::is_gt) {
        return met(other, one, axis, plane);
    }
    let part = (plane - a[axis]) / (b[axis] - a[axis]);
    let mut at: [f64; 3] = std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part);
    at[axis] = plane;
    one.between(other, part, at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    impl Corner for [f64; 3] {
        fn at(&self) -> [f64; 3] {
            *self
        }

        fn between(&self, _: &Self, _: f64, at: [f64; 3]) -> Self {
            at
        }
    }

    fn area(polygon: &[[f64; 3]]) -> f64 {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>() / 2.0
    }

    /// Dense in one corner.
    fn points(random: &mut Random, count: usize) -> Vec<[f64; 3]> {
        let mut at = || {
            let part = random.unit();
            678_000.0 + 3000.0 * part * part
        };
        (0..count).map(|_| [at(), at(), 7.0]).collect()
    }

    fn divided(points: &[[f64; 3]], most: u64) -> Division {
        let bounds =
            points.iter().fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], p| {
                let of = |i: usize| [f64::min(low[i], p[i]), f64::max(high[i], p[i])];
                [std::array::from_fn(|i| of(i)[0]), std::array::from_fn(|i| of(i)[1])]
            });
        let mut counts = Counts::new(bounds, UpAxis::Z);
        points.iter().for_each(|point| counts.add(*point));
        Division::of(&counts, most)
    }

    #[test]
    fn tiles_have_about_as_many_vertices_and_no_more_than_was_asked() {
        let points = points(&mut Random::new(4, 0), 40_000);
        for most in [500, 9000, 40_000] {
            let division = divided(&points, most as u64);
            let mut counts = vec![0; division.tiles];
            points.iter().for_each(|&point| counts[division.tile_of(&[point]).unwrap()] += 1);
            // On a line a vertex may count on either side.
            assert!(counts.iter().all(|count| (most / 8..=most + 9).contains(count)), "{counts:?}");
        }
        assert_eq!(divided(&points, 40_000).tiles, 1);
        assert_eq!(divided(&points[..1], 1).tiles, 1);
        assert_eq!(divided(&[points[0]; 9], 1).tiles, 1, "all at one place");
    }

    #[test]
    fn parts_of_triangles_cover_them_and_lie_in_their_tiles() {
        let mut random = Random::new(6, 0);
        let division = divided(&points(&mut random, 20_000), 700);
        for _ in 0..300 {
            let triangle = points(&mut random, 3);
            let mut covered = 0.0;
            division.cut(triangle.clone(), &mut |tile, part: &[[f64; 3]]| {
                covered += area(part);
                assert_eq!(division.tile_of(part), Some(tile));
            });
            let whole = area(&triangle);
            assert!((covered - whole).abs() < 1e-3 + 1e-9 * whole.abs(), "{covered} of {whole}");
        }
    }

    #[test]
    fn triangles_with_a_common_edge_meet_planes_at_the_same_points() {
        let mut random = Random::new(7, 0);
        let division = divided(&points(&mut random, 20_000), 700);
        for _ in 0..100 {
            let [a, b, c, d] = [(); 4].map(|()| points(&mut random, 1)[0]);
            // Corners on the edge, by tile.
            let on_edge = |triangle: [[f64; 3]; 3]| {
                let mut found = Vec::new();
                division.cut(triangle.to_vec(), &mut |tile, part: &[[f64; 3]]| {
                    let across = |p: &[f64; 3]| {
                        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
                    };
                    let near = part.iter().filter(|p| across(p).abs() < 1e-3);
                    found.extend(near.map(|p| (tile, p.map(f64::to_bits))));
                });
                found.sort();
                found.dedup();
                found
            };
            assert_eq!(on_edge([a, b, c]), on_edge([b, a, d]));
        }
    }
}
