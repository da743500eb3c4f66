//! Planar charts: neighbouring triangles that face about the same way, seen along their mean normal.
//!
//! A chart grows from the largest free triangle over the neighbour that faces most its way. No
//! triangle of it is seen at a steeper angle than [`LEAST_FACING`] allows, so a chart is distorted
//! little and never folded over an edge. That parts of it do not come to lie on each other from
//! afar is looked after where it is drawn ([`super::flat`]).

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use crate::mesh::Mesh;

/// The least cosine between a triangle's normal and the mean normal of the chart that takes it in.
const GROWS_TO: f64 = 0.6;

/// The least cosine between a triangle's normal and its chart's final mean normal.
const LEAST_FACING: f64 = 0.35;

/// Triangles and the direction in which they are seen.
#[derive(Clone, Debug)]
pub(super) struct PlanarChart {
    pub triangles: Vec<u32>,
    /// Area times unit normal, summed over the triangles.
    pub normal: DVec3,
}

/// A free triangle beside a chart; the one with the largest cosine is the greatest.
struct Candidate {
    cosine: f64,
    triangle: u32,
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.cosine.total_cmp(&other.cosine).then(other.triangle.cmp(&self.triangle))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

/// Divides these triangles of a mesh into planar charts, the same way on every machine.
pub(super) fn planar_charts(mesh: &Mesh, members: &[u32]) -> Vec<PlanarChart> {
    let normals: Vec<DVec3> = members
        .iter()
        .map(|&number| {
            let [a, b, c] = mesh.corners(mesh.triangles[number as usize]);
            (b - a).cross(c - a) * 0.5
        })
        .collect();
    let neighbours = neighbours(mesh, members);
    let mut order: Vec<u32> = (0..members.len() as u32).collect();
    let area = |index: u32| normals[index as usize].length_squared();
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)).then(a.cmp(&b)));

    let mut chart_of = vec![FREE; members.len()];
    let mut charts: Vec<PlanarChart> = Vec::new();
    // A chart keeps its seed, so there are fewer free triangles each time.
    while chart_of.contains(&FREE) {
        for &seed in &order {
            if chart_of[seed as usize] == FREE {
                let number = charts.len() as u32;
                charts.push(grow(seed, number, &normals, &neighbours, &mut chart_of));
            }
        }
    }
    absorb(&mut charts, &mut chart_of, &normals, &neighbours);
    charts.retain(|chart| !chart.triangles.is_empty());
    for chart in &mut charts {
        chart.triangles.iter_mut().for_each(|index| *index = members[*index as usize]);
        chart.triangles.sort_unstable();
    }
    charts
}

/// No chart has the triangle yet.
const FREE: u32 = u32::MAX;

/// No triangle beyond the edge, or more than one.
const NONE: u32 = u32::MAX;

/// For each member the members beyond its edges.
fn neighbours(mesh: &Mesh, members: &[u32]) -> Vec<[u32; 3]> {
    let mut edges: Vec<([u32; 2], u32, u32)> = Vec::with_capacity(members.len() * 3);
    for (index, &number) in members.iter().enumerate() {
        let [a, b, c] = mesh.triangles[number as usize];
        for (edge, [from, to]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
            edges.push(([from.min(to), from.max(to)], index as u32, edge as u32));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[NONE; 3]; members.len()];
    for pair in edges.chunk_by(|a, b| a.0 == b.0) {
        if let &[(_, a, edge_a), (_, b, edge_b)] = pair {
            neighbours[a as usize][edge_a as usize] = b;
            neighbours[b as usize][edge_b as usize] = a;
        }
    }
    neighbours
}

fn cosine(normal: DVec3, direction: DVec3) -> f64 {
    let length = normal.length() * direction.length();
    // What has no area fits anywhere.
    if length > 0.0 { normal.dot(direction) / length } else { 1.0 }
}

fn grow(
    seed: u32,
    number: u32,
    normals: &[DVec3],
    neighbours: &[[u32; 3]],
    chart_of: &mut [u32],
) -> PlanarChart {
    let mut chart = PlanarChart { triangles: Vec::new(), normal: DVec3::ZERO };
    let mut open = BinaryHeap::from([Candidate { cosine: 1.0, triangle: seed }]);
    while let Some(Candidate { triangle, .. }) = open.pop() {
        let normal = normals[triangle as usize];
        if chart_of[triangle as usize] != FREE || cosine(normal, chart.normal) < GROWS_TO {
            continue;
        }
        chart_of[triangle as usize] = number;
        chart.triangles.push(triangle);
        chart.normal += normal;
        for &next in &neighbours[triangle as usize] {
            if next != NONE && chart_of[next as usize] == FREE {
                let cosine = cosine(normals[next as usize], chart.normal);
                open.push(Candidate { cosine, triangle: next });
            }
        }
    }
    // The mean turns as the chart grows, and again with each triangle that it left behind, which
    // becomes free.
    loop {
        let (mean, before) = (chart.normal, chart.triangles.len());
        let alone = cosine(normals[seed as usize], mean) < LEAST_FACING;
        chart.triangles.retain(|&triangle| {
            let sees = !alone && cosine(normals[triangle as usize], mean) >= LEAST_FACING;
            let stays = triangle == seed || sees;
            if !stays {
                chart_of[triangle as usize] = FREE;
            }
            stays
        });
        if chart.triangles.len() == before {
            return chart;
        }
        chart.normal = chart.triangles.iter().map(|&triangle| normals[triangle as usize]).sum();
    }
}

/// Gives small charts to a neighbour that still sees all of their triangles well.
fn absorb(
    charts: &mut [PlanarChart],
    chart_of: &mut [u32],
    normals: &[DVec3],
    neighbours: &[[u32; 3]],
) {
    let mut order: Vec<usize> = (0..charts.len()).collect();
    order.sort_by_key(|&number| (charts[number].triangles.len(), number));
    for number in order {
        let mut beside: Vec<u32> = charts[number]
            .triangles
            .iter()
            .flat_map(|&triangle| neighbours[triangle as usize])
            .filter(|&next| next != NONE)
            .map(|next| chart_of[next as usize])
            .filter(|&chart| chart != number as u32)
            .collect();
        beside.sort_unstable();
        let mut best: Option<(usize, f64, usize)> = None;
        for group in beside.chunk_by(|a, b| a == b) {
            let other = group[0] as usize;
            let mean = charts[number].normal + charts[other].normal;
            let worst = charts[number]
                .triangles
                .iter()
                .chain(&charts[other].triangles)
                .map(|&triangle| cosine(normals[triangle as usize], mean))
                .fold(1.0, f64::min);
            if worst >= LEAST_FACING
                && best.is_none_or(|(edges, cosine, _)| (group.len(), worst) > (edges, cosine))
            {
                best = Some((group.len(), worst, other));
            }
        }
        if let Some((_, _, other)) = best {
            let taken = std::mem::take(&mut charts[number].triangles);
            let normal = std::mem::take(&mut charts[number].normal);
            taken.iter().for_each(|&triangle| chart_of[triangle as usize] = other as u32);
            charts[other].triangles.extend(taken);
            charts[other].normal += normal;
        }
    }
}
