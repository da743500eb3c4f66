//! What stands in `out/` is true: every number recomputed from the files and the source, by code
//! of its own.

use std::collections::{BTreeMap, BTreeSet};

use std::path::{Path, PathBuf};

use glam::DVec3;
use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::{BorderMode, HierarchyOptions};
use hlod::builder::simplify::ladder::Simplifier;
use hlod::city::{City, CityOptions, TextureSize, TileCode};
use hlod::format::{NODES_DIR, NodeImageData, NodeMesh, TEXTURES_DIR, file_crc};
use hlod::mesh::Wrap;
use hlod::report::BuildReport;
use image::RgbImage;
use tempfile::TempDir;

use crate::support::geometry::{Triangle, area, at, barycentric, nearest_of, sample};
use crate::support::inputs::{small_city, write_city, write_soup, write_street};
use crate::support::result::{Built, contents};
use crate::support::{Random, build_with};

/// The thesis's `c_textured`.
const TEXTURED_WEIGHT: f64 = 0.127;

fn options(desired_tris: u32) -> BuildOptions {
    let hierarchy = HierarchyOptions { desired_tris, ..HierarchyOptions::default() };
    BuildOptions { hierarchy, ..BuildOptions::default() }
}

/// One of the inputs, built.
struct Case {
    name: &'static str,
    folder: TempDir,
    built: Built,
}

impl Case {
    fn new(
        name: &'static str,
        options: &BuildOptions,
        write: impl FnOnce(&Path) -> PathBuf,
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let input = write(folder.path());
        let out = folder.path().join("out");
        build_with(&[input], &out, options);
        Self { name, built: Built::read(&out), folder }
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }
}

fn cases() -> Vec<Case> {
    let locked = BuildOptions {
        hierarchy: HierarchyOptions {
            desired_tris: 300,
            borders: BorderMode::Locked,
            ..HierarchyOptions::default()
        },
        ..BuildOptions::default()
    };
    let clustering = BuildOptions {
        hierarchy: HierarchyOptions {
            desired_tris: 300,
            simplifier: Simplifier::Clustering,
            ..HierarchyOptions::default()
        },
        ..BuildOptions::default()
    };
    let city = |folder: &Path| write_city(folder, &small_city());
    let far = CityOptions { offset: [678_016.0, 5_403_456.0, 400.0], ..small_city() };
    let bare = CityOptions { texture: TextureSize::None, ..small_city() };
    vec![
        Case::new("city", &options(300), city),
        Case::new("city with locked borders", &locked, city),
        Case::new("city by clustering", &clustering, city),
        Case::new("far city", &options(300), |folder| write_city(folder, &far)),
        Case::new("bare city", &options(300), |folder| write_city(folder, &bare)),
        Case::new("street", &options(150), |folder| write_street(folder, 30)),
        Case::new("soup", &options(200), |folder| write_soup(folder, 2_500, 3)),
    ]
}

fn assert_near(name: &str, stored: f64, found: f64, tolerance: f64) {
    let slack = tolerance * found.abs().max(1e-9);
    assert!((stored - found).abs() <= slack, "{name}: stored {stored}, found {found}");
}

#[test]
fn attributes_are_those_of_the_files() {
    for case in cases() {
        let Built { scene, meshes, files } = &case.built;
        for (index, node) in scene.nodes.iter().enumerate() {
            let what = format!("{}, {}", case.name, node.file);
            let mesh = &meshes[index];
            assert_eq!(node.file_bytes, files[index].len() as u64, "{what}");
            assert_eq!(node.file_crc, file_crc(&files[index]), "{what}");
            assert_eq!(node.origin, mesh.origin, "{what}");
            let triangles = case.built.triangles(index);
            let textured: usize = mesh
                .primitives
                .iter()
                .filter(|primitive| primitive.surface.image.is_some())
                .map(|primitive| primitive.indices.len() / 3)
                .sum();
            assert_eq!(node.triangles as usize, triangles.len(), "{what}");
            assert_eq!(node.textured_triangles as usize, textured, "{what}");
            let untextured = triangles.len() - textured;
            let cost =
                textured as f64 * TEXTURED_WEIGHT + untextured as f64 * (1.0 - TEXTURED_WEIGHT);
            assert_near(&what, node.cost, cost, 1e-12);
            let total_area: f64 = triangles.iter().copied().map(area).sum();
            let benefit = (triangles.len() as f64 * total_area).sqrt();
            assert_near(&what, node.static_benefit, benefit, 1e-6);
            let corners = || triangles.iter().flatten();
            let low = corners().fold(DVec3::INFINITY, |low, &p| low.min(p));
            let high = corners().fold(DVec3::NEG_INFINITY, |high, &p| high.max(p));
            assert_eq!((node.bbox_min, node.bbox_max), (low.into(), high.into()), "{what}");
            let normal: DVec3 =
                triangles.iter().map(|[a, b, c]| (b - a).cross(c - a)).sum::<DVec3>() / 2.0;
            let stored = DVec3::from(node.average_normal.map(f64::from));
            if normal.length() > 1e-6 * total_area {
                let apart = stored.distance(normal.normalize());
                assert!(apart < 1e-4, "{what}: {stored} against {}", normal.normalize());
            }
            check_pictures(&what, &case, index);
        }
    }
}

/// Texels are those of the pictures, and the pictures are what they say.
fn check_pictures(what: &str, case: &Case, index: usize) {
    let (scene, mesh) = (&case.built.scene, &case.built.meshes[index]);
    let node = &scene.nodes[index];
    let (mut own, mut shared, mut names) = (0, 0, BTreeSet::new());
    let mut pictures = Vec::new();
    for image in &mesh.images {
        let texels = u64::from(image.width) * u64::from(image.height);
        let decoded = match &image.data {
            NodeImageData::Embedded { bytes, .. } => {
                own += texels;
                pictures.push([image.width, image.height]);
                image::load_from_memory(bytes).unwrap()
            }
            NodeImageData::Shared { file_name } => {
                shared += texels;
                names.insert(file_name.to_string());
                image::open(case.out().join(TEXTURES_DIR).join(&**file_name)).unwrap()
            }
        };
        assert_eq!([decoded.width(), decoded.height()], [image.width, image.height], "{what}");
    }
    assert_eq!((node.texels, node.shared_texels), (own, shared), "{what}");
    assert_eq!(node.pictures, pictures, "{what}");
    let vertices: usize = mesh.primitives.iter().map(|primitive| primitive.positions.len()).sum();
    assert_eq!(node.vertices as usize, vertices, "{what}");
    let listed: BTreeSet<String> = node
        .shared_textures
        .iter()
        .map(|&number| scene.shared_textures[number as usize].file_name.clone())
        .collect();
    assert_eq!(listed, names, "{what}");
    let mut used = vec![false; mesh.images.len()];
    for primitive in &mesh.primitives {
        let Some(image) = primitive.surface.image else {
            assert!(primitive.texcoords.is_empty(), "{what}: texture coordinates for nothing");
            continue;
        };
        used[image] = true;
        if mesh.images[image].repeating().is_none() {
            let inside = |uv: &[f32; 2]| uv.iter().all(|t| (0.0..=1.0).contains(t));
            // Charts may go on beyond the sides of an atlas whose opposite sides meet.
            assert!(
                primitive.surface.wrap == [Wrap::Repeat; 2]
                    || primitive.texcoords.iter().all(inside),
                "{what}: outside of its atlas"
            );
        }
    }
    assert!(used.iter().all(|&used| used), "{what}: a picture that nothing shows");
}

/// Nodes embed small repeating textures, for less than a tenth more bytes than where all were shared.
#[test]
fn small_repeating_textures_are_embedded_and_cost_little() {
    let case = Case::new("street", &options(150), |folder| write_street(folder, 30));
    let Built { scene, meshes, files } = &case.built;
    let images = meshes.iter().flat_map(|mesh| &mesh.images);
    let embedded: usize = images
        .filter_map(|image| match &image.data {
            NodeImageData::Embedded { bytes, file_name: Some(_), .. } => Some(bytes.len()),
            _ => None,
        })
        .sum();
    let shared: u64 = scene.shared_textures.iter().map(|texture| texture.bytes).sum();
    let all = files.iter().map(Vec::len).sum::<usize>() + shared as usize;
    assert!(embedded > 0 && shared > 0, "{embedded} and {shared} bytes");
    assert!(10 * embedded < all - embedded, "{embedded} of {all} bytes");
    // The coarsest level, which viewers load first, needs no file but its own.
    let coarsest = scene.nodes.iter().filter(|node| node.level == 0);
    assert!(coarsest.clone().all(|node| node.shared_textures.is_empty()));
    assert!(coarsest.map(|node| node.pictures.len()).sum::<usize>() > 0);
    // Some readers refuse to leave the folder of the file.
    for file in files {
        assert!(!file.windows(4).any(|part| part == b"\"../"));
    }
}

#[test]
fn the_files_are_those_of_the_scene_and_no_others() {
    for case in cases() {
        let scene = &case.built.scene;
        let mut expected: BTreeSet<String> =
            ["scene.hlod", "scans.hlod", "build.json", "tileset.json"].map(String::from).into();
        expected.extend(scene.nodes.iter().map(|node| format!("nodes/{}", node.file)));
        expected.extend(
            scene
                .shared_textures
                .iter()
                .map(|texture| format!("{TEXTURES_DIR}/{}", texture.file_name)),
        );
        let found = contents(&case.out());
        let report: BuildReport = serde_json::from_slice(&found["build.json"]).unwrap();
        expected.extend(report.blocks.iter().map(|block| format!("borders/{}.border", block.name)));
        assert_eq!(found.keys().cloned().collect::<BTreeSet<_>>(), expected, "{}", case.name);
        for texture in &scene.shared_textures {
            let bytes = &found[&format!("{TEXTURES_DIR}/{}", texture.file_name)];
            assert_eq!(texture.bytes, bytes.len() as u64);
        }
        let report: BuildReport = serde_json::from_slice(&found["build.json"]).unwrap();
        let in_folder = |folder: &str| -> u64 {
            let is_in = |name: &String| Path::new(name).parent() == Some(Path::new(folder));
            let files = found.iter().filter(|(name, _)| is_in(name));
            files.map(|(_, bytes)| bytes.len() as u64).sum()
        };
        let of_levels: u64 = report.levels.iter().map(|level| level.bytes).sum();
        assert_eq!(of_levels, in_folder(NODES_DIR), "{}", case.name);
        assert_eq!(report.shared_textures.bytes, in_folder(TEXTURES_DIR), "{}", case.name);
        assert_eq!(report.shared_textures.files, scene.shared_textures.len() as u64);
        assert_eq!(scene.check(), []);
    }
}

#[test]
fn trees_are_sound() {
    for case in cases() {
        let nodes = &case.built.scene.nodes;
        assert!(nodes.iter().any(|node| node.level >= 2), "{} is too flat", case.name);
        for (index, node) in nodes.iter().enumerate() {
            let what = format!("{}, {}", case.name, node.file);
            if case.built.is_leaf(index) {
                assert_eq!(node.geometric_error, 0.0, "{what}");
            } else {
                assert!(node.geometric_error > 0.0, "{what}");
            }
            for child in case.built.scene.children(index as u32) {
                let child = &nodes[child as usize];
                assert_eq!(child.parent, Some(index as u32), "{what}");
                assert_eq!((child.level, child.block), (node.level + 1, node.block), "{what}");
                assert!(child.geometric_error <= node.geometric_error, "{what}");
                let grown = node.geometric_error * (1.0 + 1e-9);
                for axis in 0..3 {
                    let under = node.bbox_min[axis] - child.bbox_min[axis];
                    let over = child.bbox_max[axis] - node.bbox_max[axis];
                    assert!(
                        under <= grown && over <= grown,
                        "{what}: its child {} sticks out by {} m, its error is {} m",
                        child.file,
                        under.max(over),
                        node.geometric_error
                    );
                }
            }
        }
    }
}

/// Positions as whole 1/8192 m, which is coarser than the lattice and finer than the source.
fn place(position: DVec3) -> [i64; 3] {
    (position * 8192.0).round().to_array().map(|c| c as i64)
}

#[test]
fn leaves_are_the_source() {
    for offset in [[0.0; 3], [678_016.0, 5_403_456.0, 400.0]] {
        for way in [BorderMode::Locked, BorderMode::Skirts] {
            let city_options = CityOptions { offset, ..small_city() };
            let mut options = options(200);
            options.hierarchy.borders = way;
            let case = Case::new("city", &options, |folder| write_city(folder, &city_options));
            let city = City::new(&city_options).unwrap();
            let mut leaf_triangles = 0;
            let mut vertices: BTreeMap<[i64; 3], Vec<DVec3>> = BTreeMap::new();
            for node in (0..case.built.meshes.len()).filter(|&node| case.built.is_leaf(node)) {
                let triangles = case.built.triangles(node);
                leaf_triangles += triangles.len();
                for &position in triangles.iter().flatten() {
                    vertices.entry(place(position)).or_default().push(position);
                }
            }
            let (mut source_triangles, mut source_area) = (0, 0.0);
            let mut worst = 0f64;
            for index in 0..city.len() {
                let block = city.block(index).unwrap();
                source_triangles += block.triangles.len();
                let positions: Vec<DVec3> =
                    block.positions.iter().copied().map(DVec3::from).collect();
                source_area += block
                    .triangles
                    .iter()
                    .map(|triangle| area(triangle.map(|vertex| positions[vertex as usize])))
                    .sum::<f64>();
                for &position in &positions {
                    let [x, y, z] = place(position);
                    let near = (-1..=1)
                        .flat_map(|i| (-1..=1).map(move |j| (i, j)))
                        .flat_map(|(i, j)| (-1..=1).map(move |k| [x + i, y + j, z + k]))
                        .filter_map(|place| vertices.get(&place))
                        .flatten()
                        .map(|&found| (found - position).abs().max_element())
                        .fold(f64::INFINITY, f64::min);
                    worst = worst.max(near);
                }
            }
            assert!(leaf_triangles >= source_triangles);
            assert_near("area of the leaves", case.built.leaf_area(), source_area, 1e-6);
            // Offsets of up to 128 m in 23 bits: half a step is 2^-17 m.
            assert!(worst <= 2f64.powi(-17) * 1.001, "a source vertex moved by {worst} m");
        }
    }
}

/// The triangles of the leaves below each node: what it stands for.
fn source_below(built: &Built, node: usize) -> Vec<Triangle> {
    built.leaves_below(node).into_iter().flat_map(|leaf| built.triangles(leaf)).collect()
}

/// Compares each coarse node's error with the distance from random points of what it stands for
/// to its surface. Returns the files of the nodes whose error is less.
fn errors_too_low(case: &Case, samples: usize) -> Vec<String> {
    let mut random = Random::new(5, 0);
    let built = &case.built;
    let (mut ratios, mut too_low) = (Vec::new(), Vec::new());
    for (index, node) in built.scene.nodes.iter().enumerate() {
        if built.is_leaf(index) {
            continue;
        }
        let (surface, source) = (built.triangles(index), source_below(built, index));
        let measured = sample(&source, samples, &mut random)
            .into_iter()
            .map(|(_, point)| nearest_of(point, &surface).2)
            .fold(0.0, f64::max);
        if node.geometric_error < measured {
            let stored = node.geometric_error;
            too_low.push(format!("{}: {stored} m, measured {measured} m", node.file));
        }
        ratios.push(node.geometric_error / measured.max(1e-9));
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!(
        "{}: stored error over that of {samples} points, {} nodes: least {:.2}, median {median:.2}",
        case.name,
        ratios.len(),
        ratios[0],
    );
    assert!(median < 20.0, "{}: errors so large say nothing", case.name);
    too_low
}

#[test]
fn geometric_errors_are_not_below_the_distance_measured_densely() {
    let too_low: Vec<String> =
        cases().iter().flat_map(|case| errors_too_low(case, 4_000)).collect();
    assert_eq!(too_low, [""; 0]);
}

#[test]
fn an_offset_moves_the_result_and_nothing_else() {
    let result = |offset: [f64; 3]| {
        let city = CityOptions { offset, ..small_city() };
        Case::new("city", &options(300), |folder| write_city(folder, &city)).built
    };
    let near = result([0.0; 3]);
    // A multiple of every lattice step, and one that shifts the city between lattice points.
    for (offset, exact) in [
        ([678_016.0, 5_403_456.0, 400.0], true),
        ([678_016.123_4, 5_403_456.432_1, 400.000_7], false),
    ] {
        let far = result(offset);
        assert_eq!(near.scene.nodes.len(), far.scene.nodes.len());
        // Else corners are rounded to other lattice points, and cut points follow them.
        let slack = if exact { 0.0 } else { 1e-3 };
        let (mut same_triangles, mut coarse) = (0, 0);
        for index in 0..near.scene.nodes.len() {
            let (a, b) = (&near.scene.nodes[index], &far.scene.nodes[index]);
            assert_eq!(
                (a.parent, a.first_child, a.next_sibling, a.level, a.block),
                (b.parent, b.first_child, b.next_sibling, b.level, b.block)
            );
            let what = format!("{} at {offset:?}", a.file);
            if near.is_leaf(index) {
                assert_eq!(a.triangles, b.triangles, "{what}");
                let (one, other) = (near.triangles(index), far.triangles(index));
                for (p, q) in one.iter().flatten().zip(other.iter().flatten()) {
                    let apart = (*q - DVec3::from(offset) - *p).abs().max_element();
                    assert!(apart <= slack, "{what}: {p} and {q} are {apart} m apart");
                }
            } else {
                coarse += 1;
                same_triangles += usize::from(a.triangles == b.triangles);
                let ratio = b.geometric_error / a.geometric_error;
                if exact {
                    assert!((ratio - 1.0).abs() <= 0.01, "{what}: errors differ by {ratio}");
                }
            }
        }
        println!("at {offset:?}: {same_triangles} of {coarse} coarse nodes with as many triangles");
    }
}

/// One textured triangle of a node: corners, texture coordinates, and its picture's number.
struct Textured {
    corners: Triangle,
    texcoords: [[f64; 2]; 3],
    image: usize,
}

fn textured_triangles(mesh: &NodeMesh) -> Vec<Textured> {
    let origin = DVec3::from(mesh.origin);
    let mut triangles = Vec::new();
    for primitive in &mesh.primitives {
        let Some(image) = primitive.surface.image else { continue };
        for corners in primitive.indices.chunks_exact(3) {
            let vertex = |corner: usize| corners[corner] as usize;
            triangles.push(Textured {
                corners: std::array::from_fn(|corner| {
                    origin + DVec3::from(primitive.positions[vertex(corner)].map(f64::from))
                }),
                texcoords: std::array::from_fn(|corner| {
                    primitive.texcoords[vertex(corner)].map(f64::from)
                }),
                image,
            });
        }
    }
    triangles
}

fn blend(uvs: [[f64; 2]; 3], weights: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|axis| (0..3).map(|corner| uvs[corner][axis] * weights[corner]).sum())
}

/// The texel of a picture at a texture coordinate.
fn texel(image: &RgbImage, uv: [f64; 2]) -> [u8; 3] {
    let repeated = |t: f64| if (0.0..=1.0).contains(&t) { t } else { t.rem_euclid(1.0) };
    let at = |t: f64, side: u32| ((repeated(t) * f64::from(side)) as u32).min(side - 1);
    image.get_pixel(at(uv[0], image.width()), at(uv[1], image.height())).0
}

/// Random points on every node's textured triangles: the picture there shows the tile that the
/// city shows at the nearest point of the source.
fn check_tiles(jpeg_quality: u8, is_right: impl Fn([u8; 3], usize, u32) -> bool) {
    let city_options = CityOptions {
        triangles: 8_000,
        texture: TextureSize::PerTriangle(60.0),
        jpeg_quality,
        ..small_city()
    };
    let options = BuildOptions { jpeg_quality, ..options(300) };
    let case = Case::new("city", &options, |folder| write_city(folder, &city_options));
    let city = City::new(&city_options).unwrap();
    let built = &case.built;
    let blocks: Vec<(Vec<Triangle>, Vec<[[f64; 2]; 3]>)> = (0..city.len())
        .map(|index| {
            let block = city.block(index).unwrap();
            let facade = &block.triangles[..block.facade_triangles];
            let corners = |triangle: &[u32; 3]| {
                triangle.map(|vertex| DVec3::from(block.positions[vertex as usize]))
            };
            let uvs =
                |triangle: &[u32; 3]| triangle.map(|v| block.texcoords[v as usize].map(f64::from));
            (facade.iter().map(corners).collect(), facade.iter().map(uvs).collect())
        })
        .collect();
    let leaf_level = built.scene.level_count() - 1;
    let mut random = Random::new(17, 0);
    // By level: points whose tile is beyond doubt, and those of them that show another.
    let mut counts = vec![(0u32, 0u32); leaf_level + 1];
    for (index, node) in built.scene.nodes.iter().enumerate() {
        let mesh = &built.meshes[index];
        let triangles = textured_triangles(mesh);
        if triangles.is_empty() {
            continue;
        }
        let images: Vec<RgbImage> = mesh
            .images
            .iter()
            .map(|image| match &image.data {
                NodeImageData::Embedded { bytes, .. } => {
                    image::load_from_memory(bytes).unwrap().to_rgb8()
                }
                NodeImageData::Shared { .. } => panic!("a façade's texture repeats nothing"),
            })
            .collect();
        let corners: Vec<Triangle> = triangles.iter().map(|triangle| triangle.corners).collect();
        let points = [3_000, 800, 400][(node.level as usize).min(2)];
        for (number, point) in sample(&corners, points, &mut random) {
            let triangle = &triangles[number];
            let (_, weights, _) = nearest_of(point, &corners[number..=number]);
            let shown = texel(&images[triangle.image], blend(triangle.texcoords, weights));
            let all = blocks.iter().map(|(source, _)| nearest_of(point, source)).enumerate();
            let nearest = all.min_by(|a, b| a.1.2.total_cmp(&b.1.2)).unwrap();
            let (block, (nearest, weights, distance)) = nearest;
            let source_uvs = &blocks[block].1;
            let Some(expected) = city.tile_at(block, blend(source_uvs[nearest], weights)) else {
                continue;
            };
            // Coarser texels reach farther, and so does a surface that has moved.
            let reduction = 2f64.powi((leaf_level as u32 - node.level) as i32);
            let grid = city.tiles(block).unwrap();
            let texels_per_metre = f64::from(grid.size[0]) / 100.0;
            if expected.clearance < 2.0 + 2.0 * reduction + distance * texels_per_metre {
                continue;
            }
            let level =
                &mut counts[if built.is_leaf(index) { leaf_level } else { node.level as usize }];
            level.0 += 1;
            level.1 += u32::from(!is_right(shown, block, expected.tile));
        }
    }
    for (level, &(points, wrong)) in counts.iter().enumerate() {
        let share = f64::from(wrong) / f64::from(points.max(1));
        println!(
            "quality {jpeg_quality}, level {level}: {wrong} of {points} points show another tile ({share:.4})"
        );
        // A coarse surface slides along its texture; how far is the error's business.
        let most = if level == leaf_level { 0.001 } else { 0.15 };
        assert!(points > 200, "too few points on level {level} say anything");
        assert!(share <= most, "level {level}: {share} of {points} points show another tile");
    }
}

/// Compressed so little that every colour tells its tile.
#[test]
fn pictures_show_the_tiles_that_the_source_shows() {
    check_tiles(97, |shown, block, tile| TileCode::new(block).tile(shown) == Some(tile));
}

/// As compressed as by default, source and result, colours still differ by less than the noise.
#[test]
fn pictures_have_the_colours_of_the_source() {
    check_tiles(85, |shown, block, tile| {
        let expected = TileCode::new(block).color(tile);
        shown.iter().zip(expected).all(|(&shown, expected)| shown.abs_diff(expected) <= 40)
    });
}

/// The weights of a random point add up, so that the checks above look where they mean to.
#[test]
fn the_geometry_of_these_tests_is_right() {
    let triangle = [DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 3.0];
    assert_eq!(area(triangle), 3.0);
    let mut random = Random::new(1, 0);
    for _ in 0..1000 {
        let weights = barycentric(&mut random);
        assert!(weights.iter().all(|&w| (0.0..=1.0).contains(&w)));
        let inside = at(triangle, weights);
        let (_, found, distance) = nearest_of(inside + DVec3::Z * 0.5, &[triangle]);
        assert!((distance - 0.5).abs() < 1e-12);
        assert!(at(triangle, found).distance(inside) < 1e-9);
        // Outside, no point of the triangle that is drawn at random is nearer.
        let point = DVec3::from(std::array::from_fn(|_| random.between(-4.0, 4.0)));
        let (_, _, distance) = nearest_of(point, &[triangle]);
        for (_, other) in sample(&[triangle], 20, &mut random) {
            assert!(point.distance(other) >= distance - 1e-12);
        }
    }
}
