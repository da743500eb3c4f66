use super::*;
use crate::random::Random;

/// Clusters of 64 triangles at random places of a square.
fn city(count: usize, side: f64, at: [f64; 2], seed: u64) -> Vec<Cluster> {
    let mut random = Random::new(seed, 0);
    (0..count)
        .map(|_| {
            let place = [at[0] + random.between(0.0, side), at[1] + random.between(0.0, side), 3.0];
            let around = CellBox { low: place, high: place };
            Cluster { triangles: 64, texels: 0.0, middles: around, largest: 1.0, around }
        })
        .collect()
}

/// Blocks of so many triangles at most, whatever they have of texels.
fn triangles(triangles: u64) -> Most {
    Most { triangles, texels: f64::INFINITY }
}

#[test]
fn blocks_have_no_more_texels_than_they_may() {
    let mut clusters = city(1024, 700.0, [0.0, 0.0], 6);
    // The east has fine textures.
    let is_fine = |cluster: &&mut Cluster| cluster.middles.low[0] > 350.0;
    clusters.iter_mut().filter(is_fine).for_each(|cluster| cluster.texels = 1000.0);
    let most = Most { triangles: 1 << 20, texels: 100_000.0 };
    let partition = Partition::new(clusters, BlockSplit::Auto, most, UpAxis::Z);
    let blocks = partition.blocks();
    assert!((6..=32).contains(&blocks.len()), "{}", blocks.len());
    let west = blocks.iter().filter(|&&block| partition.cell(block).place.high[0] <= 350.0);
    assert!(west.count() <= 2, "there is nothing to divide");
}

#[test]
fn the_coarsest_multiple_between_two_numbers_is_found() {
    assert_eq!(coarsest_between(3.0, 5.5), Some(4.0));
    assert_eq!(coarsest_between(-5.5, -3.0), Some(-4.0));
    assert_eq!(coarsest_between(-1.0, 7.0), Some(0.0));
    assert_eq!(coarsest_between(5.1, 5.4), Some(5.25));
    assert_eq!(coarsest_between(678_100.0, 678_420.0), Some(678_400.0));
    assert_eq!(coarsest_between(2.0, 1.0), None);
    assert_eq!(coarsest_between(f64::NAN, 1.0), None);
}

#[test]
fn blocks_fit_and_fill_space_without_overlap() {
    let clusters = city(4000, 700.0, [678_000.0, 5_403_000.0], 1);
    let partition =
        Partition::new(clusters.clone(), BlockSplit::Auto, triangles(16_000), UpAxis::Z);
    let blocks = partition.blocks();
    assert!(blocks.len() >= 16 && blocks.len() <= 64, "{}", blocks.len());
    let mut in_blocks = 0;
    for &block in &blocks {
        let cell = partition.cell(block);
        assert!(cell.triangles <= 16_000);
        in_blocks += cell.triangles;
    }
    assert_eq!(in_blocks, 4000 * 64);
    for cluster in clusters {
        let block = partition.block_at(cluster.middles.low);
        let CellBox { low, high } = partition.cell(block).place;
        assert!(
            (0..3).all(|i| low[i] <= cluster.middles.low[i] && cluster.middles.low[i] < high[i])
        );
        let mut meeting = Vec::new();
        partition.blocks_meeting(&cluster.middles, &mut |other| meeting.push(other));
        assert!(meeting.contains(&block));
    }
}

#[test]
fn what_is_beyond_a_side_has_the_same_side() {
    let clusters = city(3000, 900.0, [-450.0, 120.0], 2);
    let partition = Partition::new(clusters, BlockSplit::Auto, triangles(9000), UpAxis::Z);
    let mut pairs = 0;
    for block in partition.blocks() {
        for (axis, upper) in [(0, false), (0, true), (1, false), (1, true)] {
            for other in partition.beyond(block, axis, upper) {
                assert!(partition.beyond(other, axis, !upper).contains(&block));
                pairs += 1;
            }
        }
    }
    assert!(pairs > 40, "{pairs}");
}

#[test]
fn a_change_in_one_place_moves_no_plane_elsewhere() {
    let all = city(4000, 1000.0, [0.0, 0.0], 3);
    let changed: Vec<Cluster> = all
        .iter()
        .filter(|cluster| !(cluster.middles.low[0] > 800.0 && cluster.middles.low[1] > 800.0))
        .chain(&city(100, 190.0, [805.0, 805.0], 4))
        .copied()
        .collect();
    let places = |clusters: Vec<Cluster>| {
        let partition = Partition::new(clusters, BlockSplit::Auto, triangles(10_000), UpAxis::Z);
        let blocks = partition.blocks().into_iter();
        blocks.map(|block| partition.cell(block).place).collect::<Vec<_>>()
    };
    let (before, after) = (places(all), places(changed));
    let far = |place: &&CellBox| place.high[0] <= 750.0 || place.high[1] <= 750.0;
    let gone: Vec<&CellBox> =
        before.iter().filter(far).filter(|place| !after.contains(place)).collect();
    assert!(before.iter().filter(far).count() > 10 && gone.is_empty(), "{gone:?}");
}

#[test]
fn squares_of_a_grid_are_blocks() {
    let clusters = city(3000, 100.0, [0.0, 0.0], 5);
    let partition = Partition::new(clusters, BlockSplit::Grid(25.0), triangles(0), UpAxis::Z);
    let blocks = partition.blocks();
    assert_eq!(blocks.len(), 16);
    for block in blocks {
        let CellBox { low, high } = partition.cell(block).place;
        for axis in 0..2 {
            assert!(low[axis].is_infinite() || low[axis] % 25.0 == 0.0);
            assert!(high[axis].is_infinite() || high[axis] % 25.0 == 0.0);
        }
    }
}

#[test]
fn places_in_one_point_are_not_divided_for_ever() {
    let around = CellBox { low: [1.0; 3], high: [1.0; 3] };
    let point = Cluster { triangles: 1 << 20, texels: 0.0, middles: around, largest: 0.5, around };
    let partition = Partition::new(vec![point; 9], BlockSplit::Auto, triangles(1000), UpAxis::Z);
    assert_eq!(partition.blocks().len(), 1);
    let partition = Partition::new(Vec::new(), BlockSplit::Auto, triangles(1000), UpAxis::Z);
    assert_eq!(partition.blocks(), [0]);
}
