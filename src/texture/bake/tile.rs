//! A tile of a chart's samples, and which triangles of the chart they belong to.

use std::ops::Range;

use glam::{DVec2, Vec3A};

use super::facet::Facet;

/// A tile of samples; kept between tiles for its memory.
#[derive(Default)]
pub(super) struct Tile {
    /// Samples of the chart.
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    /// By sample, row by row: its triangle's number in the chart, or one beyond all.
    pub owners: Vec<u32>,
    /// The triangles that have samples here and a plane.
    pub members: Vec<Member>,
    /// By triangle of the chart: its place in `members`, if it has one.
    places: Vec<u32>,
}

/// A triangle of the chart in a tile.
pub(super) struct Member {
    /// Its number in the chart.
    pub number: u32,
    /// Samples between which all of its own are.
    pub columns: Range<usize>,
    pub rows: Range<usize>,
}

impl Member {
    /// The box of what is within reach, in samples and metres over the chart.
    pub fn bounds(&self, facet: &Facet) -> [Vec3A; 2] {
        let corner = |x: usize, y: usize| DVec2::new(x as f64, y as f64);
        facet.bounds(
            corner(self.columns.start, self.rows.start),
            corner(self.columns.end, self.rows.end),
        )
    }
}

/// No member yet.
const NONE: u32 = u32::MAX;

impl Tile {
    /// Makes it that of these texels of a chart, with `samples` by `samples` samples each. `owners`
    /// has the numbers of the triangles that a row's texels belong to.
    pub fn fill<'a>(
        &mut self,
        [columns, rows]: [Range<usize>; 2],
        samples: usize,
        owners: impl Fn(usize) -> &'a [u32],
        facets: &[Option<Facet>],
    ) {
        let in_samples = |texels: &Range<usize>| texels.start * samples..texels.end * samples;
        [self.columns, self.rows] = [&columns, &rows].map(in_samples);
        self.owners.clear();
        self.members.clear();
        self.places.clear();
        self.places.resize(facets.len(), NONE);
        for y in rows {
            let row = in_samples(&(y..y + 1));
            let start = self.owners.len();
            let mut x = columns.start;
            for run in owners(y)[columns.clone()].chunk_by(|a, b| a == b) {
                let own = in_samples(&(x..x + run.len()));
                x += run.len();
                self.owners.resize(self.owners.len() + own.len(), run[0]);
                if matches!(facets.get(run[0] as usize), Some(Some(_))) {
                    self.add(run[0], own, row.clone());
                }
            }
            let end = self.owners.len();
            (1..samples).for_each(|_| self.owners.extend_from_within(start..end));
        }
    }

    fn add(&mut self, number: u32, columns: Range<usize>, rows: Range<usize>) {
        let place = &mut self.places[number as usize];
        match self.members.get_mut(*place as usize) {
            Some(member) => {
                let start = member.columns.start.min(columns.start);
                member.columns = start..member.columns.end.max(columns.end);
                member.rows.end = rows.end;
            }
            None => {
                *place = self.members.len() as u32;
                self.members.push(Member { number, columns, rows });
            }
        }
    }

    /// The place of a sample in its arrays.
    pub fn index(&self, column: usize, row: usize) -> usize {
        (row - self.rows.start) * self.columns.len() + column - self.columns.start
    }
}
