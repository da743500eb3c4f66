//! A surface from a picture of depths, cut where something ends before what is behind it.

use rustc_hash::FxHashMap;

use super::depths::Depths;

/// Corners of the square between four pixels, around it.
const CORNERS: [[isize; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

/// What is behind goes on for so many pixels more under what is before it. Seen from elsewhere, what is before
/// moves: slits of a pixel or two were left without.
const GOES_ON_PX: usize = 2;

/// With the edge itself.
pub const BEHIND_PX: f64 = GOES_ON_PX as f64 + 1.0;

/// A surface in the space of [`Depths`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParallaxMesh {
    /// Pixels from the picture's left and upper edges, pixels' middles at .5, and parallax in pixels.
    pub points: Vec<[f32; 3]>,
    /// Counter-clockwise as the picture is seen with y upwards.
    pub triangles: Vec<[u32; 3]>,
}

impl ParallaxMesh {
    /// A point for each pixel. Neighbours are joined where their parallax differs by less than `apart`
    /// pixels, or where the surface on one side of the edge between them goes on in a straight line to
    /// the other side, within as much: no skin is spanned from what is near to what is far.
    ///
    /// What is behind goes on for three pixels under what is before it, so that nothing shows between both;
    /// all else ends half a pixel beyond the middle of its last, as surfaces do on average that end somewhere
    /// in it.
    pub fn new(depths: &Depths<'_>, apart: f32) -> Self {
        let mut surface = Surface {
            depths,
            apart,
            mesh: Self::default(),
            of_pixels: vec![u32::MAX; depths.metres.len()],
            behind: FxHashMap::default(),
            half_way: FxHashMap::default(),
        };
        for y in 0..depths.height().saturating_sub(1) {
            for x in 0..depths.width.saturating_sub(1) {
                surface.square([x as isize, y as isize]);
            }
        }
        surface.go_on_behind();
        surface.mesh
    }
}

/// One that is being made.
struct Surface<'a> {
    depths: &'a Depths<'a>,
    apart: f32,
    mesh: ParallaxMesh,
    /// Points of pixels, row by row; `u32::MAX` where none was needed yet.
    of_pixels: Vec<u32>,
    /// Points behind pixels, row by row.
    behind: FxHashMap<usize, Vec<u32>>,
    /// Points half-way between two pixels.
    half_way: FxHashMap<[usize; 2], Vec<u32>>,
}

impl Surface<'_> {
    fn parallax(&self, [x, y]: [isize; 2]) -> Option<f32> {
        self.depths.parallax(x, y)
    }

    /// Whether neighbours are of one surface.
    fn are_joined(&self, a: [isize; 2], b: [isize; 2]) -> bool {
        let (Some(at_a), Some(at_b)) = (self.parallax(a), self.parallax(b)) else { return false };
        let is_near = |found: f32, expected: f32| (found - expected).abs() <= self.apart;
        let goes_on = |before: [isize; 2], from: f32, to: f32| {
            self.parallax(before).is_some_and(|before| is_near(2.0 * from - before, to))
        };
        is_near(at_a, at_b)
            || goes_on(beyond(a, b), at_a, at_b)
            || goes_on(beyond(b, a), at_b, at_a)
    }

    /// Adds what is between four pixels.
    fn square(&mut self, at: [isize; 2]) {
        let pixels = CORNERS.map(|corner| [at[0] + corner[0], at[1] + corner[1]]);
        let parallax = pixels.map(|pixel| self.parallax(pixel));
        if parallax.iter().all(Option::is_none) {
            return;
        }
        let parts =
            parts([0, 1, 2, 3].map(|side| self.are_joined(pixels[side], pixels[(side + 1) % 4])));
        for part in 0..4 {
            let of_part = [0, 1, 2, 3]
                .map(|corner| if parts[corner] == part { parallax[corner] } else { None });
            if of_part.iter().any(Option::is_some) {
                self.part(pixels, of_part, parallax);
            }
        }
    }

    /// Adds what one surface has of a square: `own` has its corners, `all` those of others too.
    fn part(&mut self, pixels: [[isize; 2]; 4], own: [Option<f32>; 4], all: [Option<f32>; 4]) {
        let mut corners = [None; 4];
        for corner in 0..4 {
            let pixel = pixels[corner];
            corners[corner] = match (own[corner], all[corner]) {
                (Some(parallax), _) => Some((self.point(pixel, parallax), parallax)),
                (None, Some(before)) => self
                    .goes_on_to(pixels, own, corner)
                    .filter(|&parallax| parallax > 0.0 && parallax < before)
                    .map(|parallax| (self.point_behind(pixel, parallax), parallax)),
                (None, None) => None,
            };
        }
        match corners {
            [Some(a), Some(b), Some(c), Some(d)] => self.fill([a, b, c, d]),
            _ => self.fill_part(pixels, corners),
        }
    }

    /// The parallax with which a surface goes on to a corner of a square that is not its own.
    fn goes_on_to(
        &self,
        pixels: [[isize; 2]; 4],
        own: [Option<f32>; 4],
        corner: usize,
    ) -> Option<f32> {
        let beside = [(corner + 1) % 4, (corner + 3) % 4];
        let straight = |from: usize, to: usize| {
            let parallax = own[from]?;
            let before = beyond(pixels[from], pixels[to]);
            match self.are_joined(before, pixels[from]) {
                true => self.parallax(before).map(|before| 2.0 * parallax - before),
                false => Some(parallax),
            }
        };
        match beside.map(|from| straight(from, corner)) {
            [Some(a), Some(b)] => Some((a + b) / 2.0),
            [Some(a), None] | [None, Some(a)] => Some(a),
            [None, None] => {
                let opposite = (corner + 2) % 4;
                let [a, b] = beside.map(|to| straight(opposite, to));
                Some(a? + b? - own[opposite]?)
            }
        }
    }

    /// What goes on behind something for a pixel goes on for some more.
    fn go_on_behind(&mut self) {
        let of_pixel = |(&at, points): (&usize, &Vec<u32>)| {
            points.iter().map(move |&point| (at, point)).collect::<Vec<_>>()
        };
        let mut last: Vec<(usize, u32)> = self.behind.iter().flat_map(of_pixel).collect();
        for _ in 0..GOES_ON_PX {
            // Not in the order of a hash map.
            last.sort_unstable();
            let mut next = Vec::new();
            for (at, point) in last {
                let from = self.pixel(at);
                for step in [[1, 0], [-1, 0], [0, 1], [0, -1]] {
                    let to = [from[0] + step[0], from[1] + step[1]];
                    next.extend(self.go_on_from(from, point, to));
                }
            }
            last = next;
        }
        let mut corners: Vec<usize> = self.behind.keys().copied().collect();
        corners.sort_unstable();
        for at in corners {
            self.fill_behind(self.pixel(at));
        }
    }

    /// Goes on behind another pixel; the new point.
    fn go_on_from(&mut self, from: [isize; 2], point: u32, to: [isize; 2]) -> Option<(usize, u32)> {
        let before = self.parallax(to)?;
        let parallax = self.mesh.points[point as usize][2];
        let slope = self.near_at(beyond(from, to), parallax).map_or(0.0, |other| parallax - other);
        let goes_on = parallax + slope;
        if goes_on <= 0.0 || goes_on + self.apart >= before {
            return None;
        }
        let count = self.mesh.points.len();
        let point = self.point_behind(to, goes_on);
        (self.mesh.points.len() > count).then_some((self.index(to), point))
    }

    /// The parallax of what is seen at a pixel, or goes on behind it, that is nearest to another, if near.
    fn near_at(&self, pixel: [isize; 2], parallax: f32) -> Option<f32> {
        let seen = self.parallax(pixel)?;
        let behind = self.behind.get(&self.index(pixel)).into_iter().flatten();
        let all = behind.map(|&point| self.mesh.points[point as usize][2]).chain([seen]);
        nearest(all.map(|other| (other, other)), parallax, 2.0 * self.apart).map(|at| at.1)
    }

    /// Fills squares all of whose corners are behind something.
    fn fill_behind(&mut self, at: [isize; 2]) {
        let pixels = CORNERS.map(|corner| [at[0] + corner[0], at[1] + corner[1]]);
        if pixels.iter().any(|&pixel| self.parallax(pixel).is_none()) {
            return;
        }
        let points = pixels.map(|pixel| {
            let points = self.behind.get(&self.index(pixel)).into_iter().flatten();
            points.map(|&point| (point, self.mesh.points[point as usize][2])).collect::<Vec<_>>()
        });
        let apart = 2.0 * self.apart;
        let [first, others @ ..] = points;
        for a in first {
            let near = others.each_ref().map(|at| nearest(at.iter().copied(), a.1, apart));
            if let [Some(b), Some(c), Some(d)] = near {
                self.fill([a, b, c, d]);
            }
        }
    }

    /// Two triangles between the corners of a square, along the shorter diagonal.
    fn fill(&mut self, [a, b, c, d]: [(u32, f32); 4]) {
        let triangles = match (a.1 - c.1).abs() <= (b.1 - d.1).abs() {
            true => [[a.0, d.0, c.0], [a.0, c.0, b.0]],
            false => [[a.0, d.0, b.0], [b.0, d.0, c.0]],
        };
        self.mesh.triangles.extend(triangles);
    }

    /// Triangles between those corners of a square that there are, and the middles of the sides between them
    /// and those that there are not.
    fn fill_part(&mut self, pixels: [[isize; 2]; 4], corners: [Option<(u32, f32)>; 4]) {
        let mut outline = Vec::with_capacity(6);
        for side in 0..4 {
            let next = (side + 1) % 4;
            outline.extend(corners[side].map(|at| at.0));
            let (there, gone) = match (corners[side], corners[next]) {
                (Some((_, parallax)), None) => ((side, parallax), next),
                (None, Some((_, parallax))) => ((next, parallax), side),
                _ => continue,
            };
            outline.push(self.point_half_way(pixels[there.0], pixels[gone], there.1));
        }
        for last in 2..outline.len() {
            self.mesh.triangles.push([outline[0], outline[last], outline[last - 1]]);
        }
    }

    fn point(&mut self, pixel: [isize; 2], parallax: f32) -> u32 {
        let at = self.index(pixel);
        if self.of_pixels[at] == u32::MAX {
            self.of_pixels[at] = self.push(pixel, parallax);
        }
        self.of_pixels[at]
    }

    fn point_behind(&mut self, pixel: [isize; 2], parallax: f32) -> u32 {
        let at = self.index(pixel);
        let is_near =
            |&point: &u32| (self.mesh.points[point as usize][2] - parallax).abs() <= self.apart;
        let there = self.behind.get(&at).and_then(|points| points.iter().copied().find(is_near));
        there.unwrap_or_else(|| {
            let point = self.push(pixel, parallax);
            self.behind.entry(at).or_default().push(point);
            point
        })
    }

    /// Half-way from a pixel to another at which its surface is no more, with the parallax with which it goes
    /// on to there.
    fn point_half_way(&mut self, from: [isize; 2], to: [isize; 2], parallax: f32) -> u32 {
        let before = beyond(from, to);
        let slope = match self.parallax(from) {
            Some(own) if own == parallax && self.are_joined(before, from) => {
                self.parallax(before).map_or(0.0, |before| parallax - before)
            }
            _ => 0.0,
        };
        // Never behind the eye, however steep.
        let parallax = (parallax + slope / 2.0).max(parallax / 2.0);
        let key = [self.index(from), self.index(to)];
        let is_near =
            |&point: &u32| (self.mesh.points[point as usize][2] - parallax).abs() <= self.apart;
        let there = self.half_way.get(&key).and_then(|at| at.iter().copied().find(is_near));
        there.unwrap_or_else(|| {
            let [x, y] = [0, 1].map(|axis| (from[axis] + to[axis]) as f32 / 2.0 + 0.5);
            let point = self.push_at([x, y], parallax);
            self.half_way.entry(key).or_default().push(point);
            point
        })
    }

    fn push(&mut self, [x, y]: [isize; 2], parallax: f32) -> u32 {
        self.push_at([x as f32 + 0.5, y as f32 + 0.5], parallax)
    }

    fn push_at(&mut self, [x, y]: [f32; 2], parallax: f32) -> u32 {
        self.mesh.points.push([x, y, parallax]);
        (self.mesh.points.len() - 1) as u32
    }

    fn index(&self, [x, y]: [isize; 2]) -> usize {
        y as usize * self.depths.width + x as usize
    }

    fn pixel(&self, at: usize) -> [isize; 2] {
        [at % self.depths.width, at / self.depths.width].map(|side| side as isize)
    }
}

/// Of what has a parallax, what is nearest to one, within so many pixels.
fn nearest<T>(all: impl Iterator<Item = (T, f32)>, parallax: f32, within: f32) -> Option<(T, f32)> {
    let away = |other: f32| (other - parallax).abs();
    all.filter(|at| away(at.1) <= within).min_by(|a, b| away(a.1).total_cmp(&away(b.1)))
}

/// The pixel before `a` on the line that goes on to `b`.
fn beyond(a: [isize; 2], b: [isize; 2]) -> [isize; 2] {
    [2 * a[0] - b[0], 2 * a[1] - b[1]]
}

/// For each corner of a square the first that it is joined with, from which of its sides join their two.
fn parts(joined: [bool; 4]) -> [usize; 4] {
    let mut parts = [0, 1, 2, 3];
    // Three times around: the first corner may be joined the other way, by all sides but one.
    for side in [0, 1, 2, 3].repeat(3) {
        let [a, b] = [side, (side + 1) % 4];
        if joined[side] {
            let first = parts[a].min(parts[b]);
            (parts[a], parts[b]) = (first, first);
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 12;

    fn mesh(metres: impl Fn(usize, usize) -> f32) -> ParallaxMesh {
        let metres: Vec<f32> =
            (0..WIDTH * WIDTH).map(|at| metres(at % WIDTH, at / WIDTH)).collect();
        ParallaxMesh::new(&Depths { metres: &metres, width: WIDTH, pixel_metres: 100.0 }, 0.5)
    }

    /// Twice the area under a triangle; what faces the eye has more than 0.
    fn area([a, b, c]: [[f32; 3]; 3]) -> f32 {
        -((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    }

    fn triangles(mesh: &ParallaxMesh) -> impl Iterator<Item = [[f32; 3]; 3]> {
        mesh.triangles.iter().map(|corners| corners.map(|point| mesh.points[point as usize]))
    }

    /// Twice the area under all triangles of a range of parallax.
    fn area_of(mesh: &ParallaxMesh, is_it: impl Fn(f32) -> bool) -> f32 {
        let corners = triangles(mesh).filter(|corners| corners.iter().all(|at| is_it(at[2])));
        corners.map(area).sum()
    }

    #[test]
    fn a_plane_is_one_surface_however_steep() {
        // Parallax from 4 to 48 pixels: 4 from pixel to pixel.
        let steep = mesh(|x, _| 100.0 / (4.0 + 4.0 * x as f32));
        assert_eq!((steep.points.len(), steep.triangles.len()), (144, 242));
        assert_eq!(area_of(&steep, |_| true), 242.0);
        assert!(triangles(&steep).all(|corners| area(corners) == 1.0));
    }

    #[test]
    fn nothing_is_spanned_between_what_is_near_and_what_is_far_and_nothing_shows_between_them() {
        let is_near = |x: usize, y: usize| (4..8).contains(&x) && (3..9).contains(&y);
        let box_before = mesh(|x, y| if is_near(x, y) { 10.0 } else { 50.0 });
        // 4 × 6 pixels less their corners, which are cut half-way; behind them all goes on.
        assert_eq!(area_of(&box_before, |at| at == 10.0), 2.0 * (24.0 - 4.0 / 8.0));
        assert_eq!(area_of(&box_before, |at| at == 2.0), 2.0 * 121.0);
        assert_eq!(area_of(&box_before, |_| true), 2.0 * (121.0 + 23.5));
        // Behind 10 × 10 pixels it goes on for three from each side.
        let is_near = |x: usize, y: usize| (1..11).contains(&x) && (1..11).contains(&y);
        let large = mesh(|x, y| if is_near(x, y) { 10.0 } else { 50.0 });
        assert_eq!(area_of(&large, |at| at == 2.0), 2.0 * (121.0 - 25.0));
    }

    #[test]
    fn where_nothing_is_seen_nothing_is_spanned() {
        let before_sky = mesh(|x, _| if x < 6 { 10.0 } else { f32::INFINITY });
        assert_eq!(
            area_of(&before_sky, |_| true),
            2.0 * 5.5 * 11.0,
            "to half a pixel from its last"
        );
        assert!(mesh(|_, _| f32::INFINITY).points.is_empty());
        assert!(mesh(|_, _| f32::NAN).triangles.is_empty());
        assert!(mesh(|_, _| 0.0).triangles.is_empty());
    }

    #[test]
    fn a_plane_goes_on_straight_under_what_is_before_it() {
        let parallax = |x: usize| 2.0 + 0.25 * x as f32;
        let mesh = mesh(|x, _| if x < 6 { 100.0 / parallax(x) } else { 1.0 });
        let behind = mesh.points.iter().filter(|at| at[2] < 50.0 && at[0] == 6.5);
        assert_eq!(behind.map(|at| at[2]).collect::<Vec<_>>(), [parallax(6); 12]);
    }

    #[test]
    fn parts_are_joined_either_way_around() {
        assert_eq!(parts([true; 4]), [0; 4]);
        assert_eq!(parts([false; 4]), [0, 1, 2, 3]);
        assert_eq!(parts([false, true, true, true]), [0; 4]);
        assert_eq!(parts([true, false, true, false]), [0, 0, 2, 2]);
        assert_eq!(parts([false, false, false, true]), [0, 1, 2, 0]);
        assert_eq!(parts([false, true, false, true]), [0, 1, 1, 0]);
    }
}
