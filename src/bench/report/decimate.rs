//! Thins out series to what a picture can show.

/// Points of which no column of the picture has more than two: its lowest and its highest, in the
/// order in which they came. So no spike is lost, however many frames there are. `points` go from
/// left to right over `range`.
pub(super) fn decimate(points: &[[f64; 2]], range: [f64; 2], columns: usize) -> Vec<[f64; 2]> {
    if points.len() <= 2 * columns {
        return points.to_vec();
    }
    let scale = columns as f64 / (range[1] - range[0]);
    let column = |point: &[f64; 2]| ((point[0] - range[0]) * scale).floor();
    let mut kept = Vec::with_capacity(2 * columns + 2);
    for points in points.chunk_by(|a, b| column(a) == column(b)) {
        let order = |a: &&[f64; 2], b: &&[f64; 2]| a[1].total_cmp(&b[1]);
        let (Some(low), Some(high)) = (points.iter().min_by(order), points.iter().max_by(order))
        else {
            continue;
        };
        // Ties are one point.
        match low[0].total_cmp(&high[0]) {
            _ if low[1] == high[1] => kept.push(*low),
            std::cmp::Ordering::Greater => kept.extend([*high, *low]),
            _ => kept.extend([*low, *high]),
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spike_of_one_frame_stays_and_few_points_do() {
        let mut points: Vec<[f64; 2]> = (0..10_000).map(|x| [f64::from(x), 5.0]).collect();
        points[4321][1] = 900.0;
        points[8765][1] = -900.0;
        let kept = decimate(&points, [0.0, 9999.0], 500);
        assert!(kept.len() <= 1002, "{}", kept.len());
        assert!(kept.contains(&[4321.0, 900.0]) && kept.contains(&[8765.0, -900.0]));
        assert!(kept.is_sorted_by(|a, b| a[0] < b[0]));
    }

    #[test]
    fn few_points_are_as_they_were() {
        let points: Vec<[f64; 2]> = (0..1000).map(|x| [f64::from(x), f64::from(x % 7)]).collect();
        assert_eq!(decimate(&points, [0.0, 999.0], 500), points);
    }
}
