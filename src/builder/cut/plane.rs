//! Where a chunk is cut.
//!
//! Across the longest side of its box, in the middle, as the thesis does it (section 3.2), chunks
//! stay compact. But a cut costs a border, of which every level keeps a part; and halves with few
//! triangles make nodes that save nothing. So planes at many places across all three sides are
//! compared by what they cross, by how evenly they divide triangles and space, and by how compact
//! the halves are.

use crate::builder::constants::CutConstants;
use crate::mesh::{Coordinate, Mesh};

/// A box and what to make of it.
#[derive(Clone, Copy, Debug)]
pub struct Region {
    /// Least coordinates.
    pub low: [f64; 3],
    /// Greatest coordinates.
    pub high: [f64; 3],
    /// The share of the triangles that is to be below the plane, over 0 and under 1.
    pub share: f64,
    /// Triangles that reach no farther beyond a plane are not crossed by it, metres: their vertices
    /// will count as on it ([`crate::builder::cut::split::CutTolerance`]).
    pub touching: f64,
}

/// The axis and the coordinate of the plane that is best to cut at within `region`; `None` where
/// `mesh` has no extent there.
///
/// A plane costs the triangles that it crosses and as many as one through an even surface would,
/// times what its unevenness adds; across a side that is shorter than the longest by a factor it
/// costs more by the power 3/4 of that, since the border is longer. Near the best of the places that
/// are compared, the plane goes where it crosses the fewest: through the vertices of a row, if there
/// are rows.
pub fn best_plane<C: Coordinate>(
    mesh: &Mesh<C>,
    region: &Region,
    constants: &CutConstants,
) -> Option<(usize, f64)> {
    let Region { low, high, share, .. } = *region;
    let side = |axis: usize| high[axis] - low[axis];
    let longest = (1..3).fold(0, |best, axis| if side(axis) > side(best) { axis } else { best });
    if !(side(longest) > 0.0 && side(longest).is_finite()) || mesh.triangles.is_empty() {
        return None;
    }
    let mut best: Option<(f64, usize, f64)> = None;
    for axis in [longest, (longest + 1) % 3, (longest + 2) % 3] {
        let ratio = side(axis) / side(longest);
        if ratio.is_nan() || ratio < constants.shortest_side {
            continue;
        }
        // Square roots are alike on all machines, powers are not.
        let quarter = ratio.sqrt().sqrt();
        let longer = 1.0 / (quarter * quarter * quarter);
        for (cost, at) in places(mesh, axis, region, constants) {
            if best.is_none_or(|(least, ..)| cost * longer < least) {
                best = Some((cost * longer, axis, at));
            }
        }
    }
    let (axis, at) = match best {
        Some((_, axis, at)) => (axis, least_crossed(mesh, axis, at, region, constants)),
        None => (longest, quantile(mesh, longest, share)),
    };
    (at > low[axis] && at < high[axis]).then_some((axis, at))
}

/// The places across a side at which both halves have enough triangles, with what they cost.
fn places<C: Coordinate>(
    mesh: &Mesh<C>,
    axis: usize,
    region: &Region,
    constants: &CutConstants,
) -> Vec<(f64, f64)> {
    let count = constants.places;
    let (low, side) = (region.low[axis], region.high[axis] - region.low[axis]);
    let total = mesh.triangles.len() as f64;
    // Of the slabs between places, how many triangles begin, end and are centred in each.
    let mut counts = vec![[0u32; 3]; count];
    let slab = |coordinate: f64| {
        let at = (coordinate - low) / side * count as f64;
        (at.max(0.0) as usize).min(count - 1)
    };
    for triangle in &mesh.triangles {
        let along = triangle.map(|vertex| mesh.positions[vertex as usize][axis].wide());
        let least = along.into_iter().fold(f64::INFINITY, f64::min);
        let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
        counts[slab(least)][0] += 1;
        counts[slab(most)][1] += 1;
        counts[slab((along[0] + along[1] + along[2]) / 3.0)][2] += 1;
    }
    let share = region.share;
    let smaller = share.min(1.0 - share);
    let (mut begun, mut ended, mut below) = (0u32, 0u32, 0u32);
    let mut places = Vec::with_capacity(count);
    for (place, [begin, end, centred]) in (1..count).zip(counts) {
        begun += begin;
        ended += end;
        below += centred;
        let of_space = place as f64 / count as f64;
        let off = [f64::from(below) / total, of_space].map(|of| (of - share) / smaller);
        if off[0].abs() <= constants.least_share {
            let [triangles, space] = off.map(|off| off * off);
            let uneven =
                1.0 + constants.uneven_triangles * triangles + constants.uneven_space * space;
            let crossing = f64::from(begun - ended);
            places.push(((crossing + total.sqrt()) * uneven, low + side * of_space));
        }
    }
    places
}

/// Of the coordinates at which triangles begin or end, within a slab of a place, the one at which a
/// plane crosses the fewest triangles, if that is a row; of several the nearest, and else the place.
fn least_crossed<C: Coordinate>(
    mesh: &Mesh<C>,
    axis: usize,
    place: f64,
    region: &Region,
    constants: &CutConstants,
) -> f64 {
    let slab = (region.high[axis] - region.low[axis]) / constants.places as f64;
    let (from, to) = (place - slab, place + slab);
    // Planes over the first of these coordinates and below the second cross a triangle.
    let (mut starts, mut ends, mut candidates) = (Vec::new(), Vec::new(), vec![place]);
    for triangle in &mesh.triangles {
        let along = triangle.map(|vertex| mesh.positions[vertex as usize][axis].wide());
        let least = along.into_iter().fold(f64::INFINITY, f64::min);
        let most = along.into_iter().fold(f64::NEG_INFINITY, f64::max);
        if least > to || most < from {
            continue;
        }
        candidates.extend([least, most].into_iter().filter(|at| (from..=to).contains(at)));
        let (start, end) = (least + region.touching, most - region.touching);
        if start < end {
            starts.push(start);
            ends.push(end);
        }
    }
    for coordinates in [&mut starts, &mut ends, &mut candidates] {
        coordinates.sort_unstable_by(f64::total_cmp);
    }
    candidates.dedup();
    let (mut started, mut ended) = (0, 0);
    let crossed = candidates.into_iter().map(|at| {
        started += starts[started..].iter().take_while(|&&start| start < at).count();
        ended += ends[ended..].iter().take_while(|&&end| end <= at).count();
        (started - ended, at)
    });
    let crossed: Vec<(usize, f64)> = crossed.collect();
    let at_place = crossed.iter().find(|&&(_, at)| at == place).map_or(0, |&(crossed, _)| crossed);
    let least = crossed.into_iter().min_by(|a, b| {
        let off = |at: f64| (at - place).abs();
        a.0.cmp(&b.0).then_with(|| off(a.1).total_cmp(&off(b.1)))
    });
    let row = least.filter(|&(crossed, _)| crossed <= at_place / constants.row);
    row.map_or(place, |(_, at)| at)
}

/// The coordinate below which this share of the triangles' centres lies.
fn quantile<C: Coordinate>(mesh: &Mesh<C>, axis: usize, share: f64) -> f64 {
    let centre = |triangle: &[u32; 3]| {
        let along = triangle.map(|vertex| mesh.positions[vertex as usize][axis].wide());
        (along[0] + along[1] + along[2]) / 3.0
    };
    let mut centres: Vec<f64> = mesh.triangles.iter().map(centre).collect();
    let at = ((centres.len() as f64 * share) as usize).min(centres.len() - 1);
    *centres.select_nth_unstable_by(at, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Walls of so many squares at these heights and, over the middle, a ground that joins them,
    /// all along x.
    fn yard(rows: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for row in 0..=rows {
            for column in 0..=10u16 {
                mesh.positions.push([f32::from(column), row as f32, f32::from(column % 2)]);
                mesh.materials.push(0);
            }
        }
        for row in 0..rows {
            for column in 0..10 {
                let at = row * 11 + column;
                mesh.triangles.extend([[at, at + 1, at + 12], [at, at + 12, at + 11]]);
            }
        }
        mesh
    }

    fn region(mesh: &Mesh, share: f64) -> Region {
        let (low, high) = mesh.bounds().unwrap();
        Region { low: low.map(f64::from), high: high.map(f64::from), share, touching: 1e-6 }
    }

    #[test]
    fn an_even_mesh_is_cut_across_its_longest_side_at_the_share() {
        let mesh = yard(30);
        let (axis, at) = best_plane(&mesh, &region(&mesh, 0.5), &CutConstants::default()).unwrap();
        assert!(axis == 1 && (at - 15.0).abs() < 2.5, "{axis} {at}");
        let (axis, at) =
            best_plane(&mesh, &region(&mesh, 1.0 / 3.0), &CutConstants::default()).unwrap();
        assert!(axis == 1 && (at - 10.0).abs() < 2.5, "{axis} {at}");
    }

    #[test]
    fn where_triangles_are_dense_on_one_side_both_halves_have_enough() {
        let mut mesh = yard(30);
        // All but the last rows within a tenth of the length.
        mesh.positions.iter_mut().for_each(|p| p[1] = if p[1] < 27.0 { p[1] * 0.1 } else { p[1] });
        let (axis, at) = best_plane(&mesh, &region(&mesh, 0.5), &CutConstants::default()).unwrap();
        let below = mesh.positions.iter().filter(|p| f64::from(p[axis]) < at).count();
        let share = below as f64 / mesh.positions.len() as f64;
        assert!((0.2..=0.8).contains(&share), "{share} below {at} on {axis}");
    }

    #[test]
    fn a_plane_near_a_row_goes_through_it_and_a_step_makes_no_difference() {
        let rows = yard(37);
        let (axis, at) = best_plane(&rows, &region(&rows, 0.5), &CutConstants::default()).unwrap();
        assert!(axis == 1 && (at == 18.0 || at == 19.0), "{axis} {at}");
        let mut shifted = rows.clone();
        // A row that is not quite straight.
        for (number, p) in shifted.positions.iter_mut().enumerate() {
            p[1] += [0.0, 1e-3, -1e-3][number % 3];
        }
        let touching = Region { touching: 4e-3, ..region(&shifted, 0.5) };
        let (axis, at) = best_plane(&shifted, &touching, &CutConstants::default()).unwrap();
        assert!(axis == 1 && (at - at.round()).abs() < 2e-3, "{at}");
    }

    #[test]
    fn a_gap_is_found_and_points_are_not_cut() {
        let mut mesh = yard(30);
        mesh.triangles.retain(|t| !(187..209).contains(&t[0]));
        let (axis, at) = best_plane(&mesh, &region(&mesh, 0.5), &CutConstants::default()).unwrap();
        assert!(axis == 1 && at > 17.0 && at < 19.0, "{axis} {at}");
        let mut point = yard(2);
        point.positions.iter_mut().for_each(|p| *p = [1.0; 3]);
        assert_eq!(best_plane(&point, &region(&point, 0.5), &CutConstants::default()), None);
        assert_eq!(
            best_plane(&Mesh::<f32>::default(), &region(&mesh, 0.5), &CutConstants::default()),
            None
        );
    }
}
