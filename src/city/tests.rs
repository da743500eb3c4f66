use std::collections::BTreeMap;

use super::*;

fn small() -> CityOptions {
    CityOptions { blocks: 3, triangles: 12_000, ..CityOptions::default() }
}

fn double_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

#[test]
fn the_asked_number_of_triangles_is_met() {
    for watertight in [false, true] {
        for (blocks, triangles) in [(1, 2_000), (4, 30_000), (9, 200_000)] {
            let options = CityOptions { blocks, triangles, watertight, ..CityOptions::default() };
            let city = City::new(&options).unwrap();
            let found: usize =
                (0..blocks).map(|index| city.block(index).unwrap().triangles.len()).sum();
            let miss = (found as f64 - triangles as f64).abs();
            assert!(miss <= 0.01 * triangles as f64, "{triangles} asked, {found} found");
        }
    }
}

#[test]
fn all_vertices_are_used_and_no_triangle_is_degenerate() {
    for watertight in [false, true] {
        let block = block(&CityOptions { watertight, ..small() }, 1).unwrap();
        let mut used = vec![false; block.positions.len()];
        for triangle in &block.triangles {
            triangle.iter().for_each(|&vertex| used[vertex as usize] = true);
            let [a, b, c] =
                triangle.map(|vertex| glam::DVec3::from(block.positions[vertex as usize]));
            assert!((b - a).cross(c - a).length() > 1e-6, "{a} {b} {c}");
        }
        assert!(used.iter().all(|&used| used));
    }
}

#[test]
fn a_watertight_block_is_closed() {
    for index in 0..3 {
        let block = block(&CityOptions { watertight: true, ..small() }, index).unwrap();
        let mut edges = BTreeMap::new();
        let mut volume = 0.0;
        for triangle in &block.triangles {
            for corner in 0..3 {
                let edge = (triangle[corner], triangle[(corner + 1) % 3]);
                assert_eq!(edges.insert(edge, ()), None, "{edge:?} used twice in one direction");
            }
            let origin = glam::DVec3::from(block.origin);
            let [a, b, c] =
                triangle.map(|vertex| glam::DVec3::from(block.positions[vertex as usize]) - origin);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(edges.keys().all(|&(a, b)| edges.contains_key(&(b, a))));
        // 12 m deep, at least 60 m long and 8 m high; positive where front faces look outward.
        assert!(volume > 12.0 * 60.0 * 8.0 * 0.9, "{volume}");
    }
}

#[test]
fn a_scanned_block_has_holes_and_faces_the_street() {
    for (index, street) in [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
        let block = block(&small(), index).unwrap();
        let mut normal = glam::DVec3::ZERO;
        for triangle in &block.triangles[..block.facade_triangles] {
            let [a, b, c] =
                triangle.map(|vertex| glam::DVec3::from(block.positions[vertex as usize]));
            normal += (b - a).cross(c - a);
        }
        let toward_street = normal.normalize().dot(glam::DVec3::new(street[0], street[1], 0.0));
        assert!(toward_street > 0.99, "{index}: {normal}");
    }
}

#[test]
fn texture_coordinates_are_injective() {
    for watertight in [false, true] {
        let block = block(&CityOptions { watertight, ..small() }, 0).unwrap();
        let texcoord = |vertex: u32| block.texcoords[vertex as usize].map(f64::from);
        let mut covered = 0.0;
        for triangle in &block.triangles[..block.facade_triangles] {
            let [a, b, c] = triangle.map(texcoord);
            assert!([a, b, c].as_flattened().iter().all(|t| (0.0..=1.0).contains(t)));
            // v grows downwards, so front faces run clockwise there; all the same way round and
            // their areas within the unit square means that none overlap on a grid.
            let area = double_area(a, b, c);
            assert!(area < 0.0, "{a:?} {b:?} {c:?}");
            covered -= 0.5 * area;
        }
        assert!((0.2..=1.0).contains(&covered), "{covered}");
        let rest = &block.triangles[block.facade_triangles..];
        let textured = block.texcoords.len() as u32;
        if !watertight {
            assert!(rest.as_flattened().iter().all(|&vertex| vertex >= textured));
        }
    }
}

#[test]
fn an_offset_moves_the_city_and_nothing_else() {
    let offset = [678_016.25, 5_403_456.0, -400.0001];
    let (near, far) =
        (block(&small(), 2).unwrap(), block(&CityOptions { offset, ..small() }, 2).unwrap());
    assert_eq!(near.triangles, far.triangles);
    assert_eq!(near.texcoords, far.texcoords);
    let steps = |metres: f64| (metres * STEPS_PER_METRE).round() as i64;
    for (near, far) in near.positions.iter().zip(&far.positions) {
        for axis in 0..3 {
            assert_eq!(steps(near[axis]) + steps(offset[axis]), steps(far[axis]));
            assert_eq!(steps(far[axis]) as f64 / STEPS_PER_METRE, far[axis], "on the lattice");
        }
    }
    for axis in 0..3 {
        assert_eq!(far.origin[axis], far.origin[axis].floor());
        assert_eq!(f64::from(far.origin[axis] as f32), far.origin[axis]);
    }
}

#[test]
fn seeds_make_different_cities() {
    let other = CityOptions { seed: 2, ..small() };
    assert_ne!(block(&small(), 0).unwrap(), block(&other, 0).unwrap());
    assert_eq!(block(&small(), 0).unwrap(), block(&small(), 0).unwrap());
}

#[test]
fn blocks_past_the_last_are_refused() {
    assert_eq!(block(&small(), 3).unwrap_err().exit_code(), 2);
    let city = City::new(&small()).unwrap();
    assert!(city.texture(3).is_none() && city.tile_at(3, [0.5; 2]).is_none());
}

#[test]
fn textures_have_the_texels_asked_for() {
    for texels in [1.0, 17.0, 105.0] {
        let options = CityOptions { texture: TextureSize::PerTriangle(texels), ..small() };
        let city = City::new(&options).unwrap();
        let found: f64 = (0..3)
            .map(|index| city.tiles(index).unwrap().size.map(f64::from).iter().product::<f64>())
            .sum();
        assert!((found / (12_000.0 * texels) - 1.0).abs() < 0.02, "{texels}: {found}");
    }
}

#[test]
fn tile_numbers_survive_jpeg() {
    let options = CityOptions { triangles: 60_000, ..small() };
    let city = City::new(&options).unwrap();
    for index in 0..3 {
        let jpeg = city.jpeg(index).unwrap().unwrap();
        let image = image::load_from_memory(&jpeg.bytes).unwrap().to_rgb8();
        let (grid, code) = (city.tiles(index).unwrap(), TileCode::new(index));
        assert_eq!([image.width(), image.height()], grid.size);
        let (mut clear, mut wrong, mut tiles) = (0, 0, std::collections::BTreeSet::new());
        for (x, y, pixel) in image.enumerate_pixels() {
            let texcoord = [
                (f64::from(x) + 0.5) / f64::from(grid.size[0]),
                (f64::from(y) + 0.5) / f64::from(grid.size[1]),
            ];
            let sample = city.tile_at(index, texcoord).unwrap();
            if sample.clearance >= 3.0 {
                clear += 1;
                wrong += u32::from(code.tile(pixel.0) != Some(sample.tile));
                tiles.insert(sample.tile);
            }
        }
        assert!(clear > image.width() * image.height() / 3);
        assert!(tiles.len() as f64 > 0.8 * f64::from(grid.count()), "tiles cut off at the border");
        assert_eq!(wrong, 0, "of {clear} texels");
    }
}
