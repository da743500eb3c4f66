use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::io::Write as _;

use glam::DVec3;

use super::*;
use crate::random::Random;

/// Hills of squares, triangles and pentagons in groups and materials, with colours, some faces of vertices
/// counted back, some without texture coordinates.
fn hills(side: usize) -> String {
    let mut random = Random::new(8, 0);
    let mut text = String::from("mtllib none.mtl\n# hills\n");
    for row in 0..=side {
        for column in 0..=side {
            let at = [678_000.5 + 3.0 * column as f64, 5_403_000.25 + 3.0 * row as f64];
            let height = 400.0 + random.unit();
            write!(text, "v {} {} {height}", at[0] + 0.3 * random.unit(), at[1]).unwrap();
            if column % 7 == 0 {
                write!(text, " {} 0.5 {}", random.unit(), random.unit()).unwrap();
            }
            writeln!(text, "\nvt {} {}", column as f64 / 7.0, row as f64 / -3.0).unwrap();
        }
    }
    let count = (side + 1) * (side + 1);
    for row in 0..side {
        for column in 0..side {
            match column % 16 {
                0 => writeln!(text, "g row {}", row / 4).unwrap(),
                3 => writeln!(text, "usemtl {}", ["roof", "wall"][row % 2]).unwrap(),
                _ => {}
            }
            let a = row * (side + 1) + column + 1;
            let [b, c, d] = [a + 1, a + side + 2, a + side + 1];
            match (row + column) % 3 {
                0 => writeln!(text, "f {a}/{a} {b}/{b} {c}/{c} {d}/{d}").unwrap(),
                1 => writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").unwrap(),
                _ => {
                    let back = |at: usize| at as i64 - count as i64 - 1;
                    let [a, b, c, d] = [a, b, c, d].map(back);
                    writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}\nf {c}/{c} {d}/{d} {a}/{a}").unwrap();
                }
            }
        }
    }
    text
}

fn tiled(path: &Path, vertices: u64) -> Result<Tiling> {
    let dir = path.parent().unwrap();
    let bounds = super::super::bounds(path)?;
    Tiling::of(path, bounds, Some(UpAxis::Z), vertices, dir)
}

#[test]
fn the_up_axis_is_that_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let text = hills(40);
    // The same with Y up: (x, y, z) becomes (x, z, -y).
    let turned = |line: &str| match line.strip_prefix("v ") {
        Some(rest) => {
            let mut words = rest.splitn(4, ' ');
            let mut next = || words.next().unwrap_or_default();
            let (x, y, z, rest) = (next(), next(), next(), next());
            format!("v {x} {z} -{y} {rest}")
        }
        None => line.to_owned(),
    };
    let turned: Vec<String> = text.lines().map(turned).collect();
    for (up, text) in [(UpAxis::Z, text), (UpAxis::Y, turned.join("\n"))] {
        let path = folder.path().join("hills.obj");
        fs::write(&path, text).unwrap();
        let bounds = super::super::bounds(&path).unwrap();
        let whole = UpEvidence::of(&super::super::load(&path).unwrap()).guess();
        assert_eq!(whole, UpGuess { axis: up, is_clear: true });
        for vertices in [100, 1 << 20] {
            let dir = folder.path();
            let tiling = Tiling::of(&path, bounds, None, vertices, dir);
            let tiling = tiling.unwrap();
            assert_eq!(tiling.up(), up);
            assert_eq!(tiling.tiles() > 1, vertices == 100);
        }
    }
}

/// Area on the ground by names of group and material.
fn areas(model: &Model, areas: &mut BTreeMap<(String, String), f64>) {
    for part in &model.parts {
        let group = model.groups[part.group as usize].name.clone();
        let material = model.materials[part.material as usize].name.clone();
        let area = areas.entry((group, material)).or_default();
        for corners in part.indices.as_chunks::<3>().0 {
            let [a, b, c] = corners.map(|corner| part.positions[corner as usize]);
            *area += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2.0;
        }
    }
}

#[test]
fn tiles_have_all_of_a_file_and_nothing_twice() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hills.obj");
    fs::write(&path, hills(60)).unwrap();
    let whole = super::super::load(&path).unwrap();
    let mut expected = BTreeMap::new();
    areas(&whole, &mut expected);
    assert!(expected.len() > 20, "{expected:?}");
    for vertices in [300, 1200] {
        let tiling = tiled(&path, vertices).unwrap();
        assert!(tiling.tiles() >= 3720 / vertices as usize, "{}", tiling.tiles());
        let mut found = BTreeMap::new();
        for tile in 0..tiling.tiles() {
            let model = tiling.load(tile).unwrap();
            assert_eq!(model.bounds(), tiling.bounds(tile));
            assert_eq!(model.dependencies, whole.dependencies);
            assert_eq!(model.parts[0].colors.is_empty(), whole.parts[0].colors.is_empty());
            areas(&model, &mut found);
        }
        assert_eq!(found.keys().collect::<Vec<_>>(), expected.keys().collect::<Vec<_>>());
        for (name, area) in &expected {
            let off = (found[name] - area).abs();
            assert!(off < 1e-4 * area.abs(), "{name:?}: {} of {area}", found[name]);
        }
    }
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 1, "nothing is left on disk");
}

#[test]
fn a_single_tile_is_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hills.obj");
    for (text, faces) in [(hills(20), 400), (format!("\u{feff}{}", hills(3)), 9)] {
        fs::write(&path, text).unwrap();
        let (whole, tiling) = (super::super::load(&path).unwrap(), tiled(&path, 1 << 20).unwrap());
        assert_eq!(tiling.tiles(), 1);
        let tile = tiling.load(0).unwrap();
        assert!(whole.triangle_count() > faces);
        assert_eq!((&tile.parts, &tile.groups), (&whole.parts, &whole.groups));
        assert_eq!(
            tile.warnings.iter().collect::<Vec<_>>(),
            whole.warnings.iter().collect::<Vec<_>>()
        );
    }
}

#[test]
fn neighbours_have_their_border_in_common() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hills.obj");
    fs::write(&path, hills(60)).unwrap();
    let tiling = tiled(&path, 300).unwrap();
    // How many edges go from one place to another less those back: a border of the hills, not of tiles.
    let mut edges: BTreeMap<[[u64; 3]; 2], i32> = BTreeMap::new();
    for tile in 0..tiling.tiles() {
        for part in tiling.load(tile).unwrap().parts {
            for corners in part.indices.as_chunks::<3>().0 {
                for side in 0..3 {
                    let ends = [corners[side], corners[(side + 1) % 3]]
                        .map(|corner| part.positions[corner as usize].map(f64::to_bits));
                    match ends[0] < ends[1] {
                        true => *edges.entry(ends).or_default() += 1,
                        false => *edges.entry([ends[1], ends[0]]).or_default() -= 1,
                    }
                }
            }
        }
    }
    let open = edges.into_iter().filter(|(_, uses)| *uses != 0);
    let inside = open.filter(|(ends, _)| {
        ends.iter().any(|end| {
            let [x, y, _] = end.map(f64::from_bits);
            (678_002.0..678_179.0).contains(&x) && (5_403_002.0..5_403_179.0).contains(&y)
        })
    });
    // Where three tiles meet, one has a corner on the straight edge of another.
    let lengths: Vec<f64> = inside
        .map(|([a, b], _)| {
            let [a, b] = [a, b].map(|end| glam::DVec3::from(end.map(f64::from_bits)));
            a.distance(b)
        })
        .collect();
    assert!(lengths.len() <= 3 * tiling.tiles(), "{}", lengths.len());
}

#[test]
fn small_bodies_stay_whole_in_the_tile_of_their_middle() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("houses.obj");
    let mut text = String::new();
    for house in 0..900 {
        let low = [f64::from(house % 30) * 10.0, f64::from(house / 30) * 10.0];
        for corner in 0..8 {
            let at = [0, 1].map(|axis| low[axis] + f64::from(corner >> axis & 1) * 9.0);
            writeln!(text, "v {} {} {}", at[0], at[1], corner >> 2).unwrap();
        }
        writeln!(text, "o {house}").unwrap();
        for [a, b, c, d] in
            [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]]
        {
            let [a, b, c, d] = [a, b, c, d].map(|corner| house * 8 + corner);
            writeln!(text, "f {a} {b} {c} {d}").unwrap();
        }
    }
    fs::write(&path, text).unwrap();
    let tiling = tiled(&path, 1000).unwrap();
    assert!(tiling.tiles() >= 8, "{}", tiling.tiles());
    let mut triangles: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for tile in 0..tiling.tiles() {
        let model = tiling.load(tile).unwrap();
        assert!(model.triangle_count() < 2500, "{}", model.triangle_count());
        for part in &model.parts {
            let of = triangles.entry(model.groups[part.group as usize].name.clone());
            of.or_default().push(part.indices.len() / 3);
        }
    }
    assert_eq!(triangles.len(), 900);
    assert!(triangles.values().all(|of| *of == [12]), "{triangles:?}");
}

#[test]
fn what_is_wrong_is_told_as_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.obj");
    let said = |text: &str| {
        fs::write(&path, text).unwrap();
        tiled(&path, 2).and_then(|tiling| tiling.load(0)).unwrap_err().to_string()
    };
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    assert!(
        said(&format!("{corners}f 1 2 3\nf 1 2\nf 1 x 3\n")).contains("line 6: face corner \"x\"")
    );
    assert!(said(&format!("{corners}v 1 x 0\n")).contains("line 4: vertex coordinate \"x\""));
    assert!(said("\0").contains("not a text file"));
    let said = said(corners);
    assert!(said.contains("no face"), "{said}");
}

#[test]
fn what_is_imperfect_is_counted_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("odd.obj");
    let odd = "v nan 0 0\nf 1 2 -1\nl 1 2\nv 678000 5403000 1 2 0 0\nf 1 2 999999\nf 1/0 2/0 4/0\n";
    fs::write(&path, format!("{}{odd}", hills(20))).unwrap();
    let count = |model: Model, what: &str| -> u64 {
        model.warnings.iter().filter(|(text, _)| text.contains(what)).map(|(_, times)| times).sum()
    };
    let tiling = tiled(&path, 100).unwrap();
    let load = |tile| tiling.load(tile).unwrap();
    for what in [
        "not finite, dropped",
        "free-form element",
        "colour out of range",
        "vertex index that is 0 or out of range",
        "texture coordinate index that is 0 or out of range",
    ] {
        let in_tiles: u64 = (0..tiling.tiles()).map(|tile| count(load(tile), what)).sum();
        let whole = count(super::super::load(&path).unwrap(), what);
        assert_eq!((in_tiles, whole), (1, 1), "{what}");
    }
}

/// Colours, their range and the encoding of names are those of the whole file, also in tiles that
/// show nothing of them.
#[test]
fn tiles_share_what_is_known_of_the_whole_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("hills.obj");
    let name = encoding_rs::WINDOWS_1251.encode("кирпичная стена дома").0.into_owned();
    let mut text = Vec::new();
    for line in hills(40).replace(" 0.5 ", " 9 ").lines() {
        // Colours in one corner alone, as bytes, and names in a code page.
        let words: Vec<&str> = line.split(' ').collect();
        match words[..] {
            ["v", x, y, z, ..] => {
                let color = if x < "678030" && y < "5403030" { " 255 0 128" } else { "" };
                writeln!(text, "v {x} {y} {z}{color}").unwrap();
            }
            ["g", ..] => text.extend([b"g ", &name[..], b"\n"].concat()),
            _ => writeln!(text, "{line}").unwrap(),
        }
    }
    fs::write(&path, text).unwrap();
    let tiling = tiled(&path, 200).unwrap();
    assert!(tiling.tiles() > 4);
    let whole = super::super::load(&path).unwrap();
    let bytes = |model: &Model| {
        model.warnings.iter().filter(|(text, _)| text.contains("divided by 255")).count()
    };
    assert_eq!(bytes(&whole), 1);
    let mut colors = std::collections::BTreeSet::new();
    for tile in 0..tiling.tiles() {
        let model = tiling.load(tile).unwrap();
        assert!(model.materials.iter().all(|material| material.base_color == [1.0; 4]));
        assert!(model.groups.iter().skip(1).all(|group| group.name == "кирпичная стена дома"));
        assert_eq!(bytes(&model), usize::from(tile == 0));
        colors.extend(model.parts.into_iter().flat_map(|part| part.colors));
    }
    let in_whole = whole.parts.into_iter().flat_map(|part| part.colors);
    assert!(in_whole.into_iter().all(|color| colors.contains(&color)));
}

/// Normals of a tile are those of the file; where a face was cut, between those of its corners.
#[test]
fn normals_are_kept_in_tiles() {
    let side = 40;
    let vector = |[x, y, _]: [f64; 3]| DVec3::new(0.02 * x, 0.01 * y, 1.0);
    let mut text = String::new();
    for number in 0..(side + 1) * (side + 1) {
        let at = [number % (side + 1), number / (side + 1)].map(f64::from);
        let DVec3 { x, y, z } = vector([at[0], at[1], 0.0]);
        writeln!(text, "v {} {} 0\nvn {x} {y} {z}", at[0], at[1]).unwrap();
    }
    for number in (0..side * (side + 1)).filter(|number| number % (side + 1) < side) {
        let [a, b, c, d] = [1, 2, side + 3, side + 2].map(|step| number + step);
        writeln!(text, "f {a}//{a} {b}//{b} {c}//{c} {d}//{d}").unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sheet.obj");
    fs::write(&path, text).unwrap();
    let known: BTreeMap<[u64; 3], Normal> = super::super::load(&path)
        .unwrap()
        .parts
        .iter()
        .flat_map(|part| part.positions.iter().zip(&part.normals))
        .map(|(position, normal)| (position.map(f64::to_bits), *normal))
        .collect();
    let tiling = tiled(&path, 300).unwrap();
    let mut cut = 0;
    for tile in 0..tiling.tiles() {
        for part in tiling.load(tile).unwrap().parts {
            assert_eq!(part.normals.len(), part.positions.len());
            for (position, normal) in part.positions.iter().zip(&part.normals) {
                if let Some(known) = known.get(&position.map(f64::to_bits)) {
                    assert_eq!(normal, known);
                    continue;
                }
                cut += 1;
                let off = normal.vector().unwrap().angle_between(vector(*position));
                assert!(off < 1e-3, "{position:?}: {off}");
            }
        }
    }
    assert!(tiling.tiles() > 4 && cut > 40, "{} tiles, {cut} new vertices", tiling.tiles());
}
