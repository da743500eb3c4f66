//! Surfaces that are no manifold, or turned inside out, or torn.

use glam::DVec3;
use hlod::camera::CameraPath;

use crate::chain::{Chain, options};
use crate::shape::{Shape, hill};
use crate::table::{Bounds, Table, Twin};

/// A strip of `columns` by `rows` quads over a band that closes after a half turn, or stays open
/// there by a tenth of a millimetre.
fn band(columns: usize, rows: usize, closed: bool) -> Shape {
    let turns = 1.0;
    let point = |column: usize, row: usize| {
        let angle = column as f64 / columns as f64 * std::f64::consts::TAU;
        let across = (row as f64 / rows as f64 - 0.5) * 8.0;
        let lean = angle * turns / 2.0;
        let radius = 20.0 + across * lean.cos();
        DVec3::new(angle.cos() * radius, angle.sin() * radius, across * lean.sin())
    };
    let mut shape = Shape::default();
    let width = rows + 1;
    for column in 0..=columns {
        shape.positions.extend((0..width).map(|row| point(column, row)));
    }
    shape.positions[columns * width..].iter_mut().for_each(|p| p.y -= 1e-4);
    // The last column is the first, upside down.
    let vertex = |column: usize, row: usize| match closed && column == columns {
        true => rows - row,
        false => column * width + row,
    };
    for column in 0..columns {
        for row in 0..rows {
            let [a, b] = [vertex(column, row), vertex(column + 1, row)];
            let [c, d] = [vertex(column + 1, row + 1), vertex(column, row + 1)];
            shape.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    shape
}

/// Fins of 8 m around upright edges of 8 m, `sheets` to an edge; each fin is 8 by 8 quads.
fn fins(sheets: usize, shared: bool) -> Shape {
    let mut shape = Shape::default();
    for edge in 0..4 {
        let centre = DVec3::new(20.0 * (edge % 2) as f64, 20.0 * (edge / 2) as f64, 0.0);
        let column = |shape: &mut Shape, out: DVec3, step: usize| -> Vec<usize> {
            let first = shape.positions.len();
            let at = |z: usize| centre + out * step as f64 + DVec3::Z * z as f64;
            let wave = |p: DVec3| {
                p + out.cross(DVec3::Z) * 0.3 * (p.z + step as f64).sin() * (step as f64 / 8.0)
            };
            shape.positions.extend((0..=8).map(|z| wave(at(z))));
            (first..first + 9).collect()
        };
        let axis = column(&mut shape, DVec3::ZERO, 0);
        for sheet in 0..sheets {
            let angle = sheet as f64 / sheets as f64 * std::f64::consts::TAU;
            let out = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let mut before = match shared {
                true => axis.clone(),
                false => column(&mut shape, out, 0),
            };
            for step in 1..=8 {
                let next = column(&mut shape, out, step);
                for z in 0..8 {
                    let [a, b, c, d] = [before[z], next[z], next[z + 1], before[z + 1]];
                    shape.faces.extend([[a, b, c], [a, c, d]]);
                }
                before = next;
            }
        }
    }
    shape
}

/// Rows of half the columns beside rows of all, so that every other vertex lies within an edge.
fn junctions(joined: bool) -> Shape {
    let mut shape = Shape::default();
    let point = |x: f64, y: f64| {
        DVec3::new(
            x,
            y,
            hill(x - x % 2.0, y) * (1.0 - x % 2.0 / 2.0)
                + hill(x - x % 2.0 + 2.0, y) * (x % 2.0 / 2.0),
        )
    };
    for strip in 0..16 {
        let y = f64::from(strip) * 4.0;
        let mut grid = |columns: usize, low: f64, high: f64| {
            let first = shape.positions.len();
            let step = 64.0 / columns as f64;
            for row in [low, high] {
                shape.positions.extend((0..=columns).map(|x| point(x as f64 * step, row)));
            }
            for x in 0..columns {
                let [a, b] = [first + x, first + x + 1];
                let [c, d] = [b + columns + 1, a + columns + 1];
                shape.faces.extend([[a, b, c], [a, c, d]]);
            }
        };
        grid(64, y, y + 2.0);
        grid(if joined { 64 } else { 32 }, y + 2.0, y + 4.0);
    }
    shape
}

fn chain(shape: &Shape) -> Chain {
    let folder = crate::chain::inputs();
    Chain::new(&shape.write(&folder), &options()).unwrap()
}

/// A sound surface, and the path that is replayed over it and over what is held against it: a path
/// of its own leads elsewhere where a triangle more or less is in the way.
struct Sound {
    twin: Twin,
    path: CameraPath,
}

fn twins(name: &str, shape: &Shape) -> Sound {
    let chains = (0..5).map(|shake| chain(&shape.clone().shaken(shake))).collect::<Vec<_>>();
    let path = chains[0].path();
    let figures = chains.iter().map(|chain| chain.figures(&path, 1.0)).collect();
    Sound { twin: Twin::several(name, figures), path }
}

#[test]
fn odd_surfaces_are_as_good_as_sound_ones() {
    let mut table = Table::new("6-surfaces", "Surfaces that are no manifold");
    let mut check = |name: &str, shape: &Shape, sound: &Sound, bounds: Bounds, why: &str| {
        let chain = chain(shape);
        table.verified(name, chain.failures());
        table.within(name, &chain.figures(&sound.path, 1.0), &sound.twin, bounds, why);
    };
    let hills = twins("sound hills", &Shape::hills());

    check(
        "12 sheets on one edge",
        &fins(12, true),
        &twins("12 sheets apart", &fins(12, false)),
        &[],
        "",
    );
    check(
        "3 sheets on one edge",
        &fins(3, true),
        &twins("3 sheets apart", &fins(3, false)),
        &[],
        "",
    );
    check(
        "Möbius strip",
        &band(400, 8, true),
        &twins("the same, not closed", &band(400, 8, false)),
        &[],
        "",
    );

    let mut inverted = Shape::hills();
    inverted.faces.iter_mut().step_by(3).for_each(|face| face.swap(1, 2));
    check("each third face inverted", &inverted, &hills, &[], "");

    let mut doubled = Shape::hills();
    doubled.faces.extend_from_within(..);
    check("all faces twice", &doubled, &hills, &[], "");
    let mut turned = Shape::hills();
    let faces: Vec<[usize; 3]> = turned.faces.iter().map(|&[a, b, c]| [b, c, a]).collect();
    turned.faces.extend(faces);
    check("all faces twice, turned", &turned, &hills, &[], "");

    let mut both = Shape::hills();
    let faces: Vec<[usize; 3]> = both.faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    both.faces.extend(faces);
    let mut above = Shape::hills();
    let [count, low] = [above.positions.len(), above.faces.len()];
    above.positions.extend_from_within(..);
    above.texcoords.extend_from_within(..);
    above.positions[count..].iter_mut().for_each(|p| p.z += 1e-4);
    above.faces.extend_from_within(..);
    above.faces[low..].iter_mut().for_each(|face| *face = face.map(|v| v + count));
    above.faces[low..].iter_mut().for_each(|face| face.swap(1, 2));
    let nearer: Bounds = &[
        ("RMS", 1.0),
        ("stored", 1.0),
        ("colour", 0.3),
        ("nodes", 0.3),
        ("triangles drawn", 0.3),
        ("toggles", 0.3),
        ("triangles, level", 0.2),
        ("frame", 0.2),
        ("expected", 0.2),
    ];
    let why = "coarse levels have one side alone, and so twice the triangles for it";
    check(
        "all faces from both sides",
        &both,
        &twins("two sides 0.1 mm apart", &above),
        nearer,
        why,
    );

    let fewer: Bounds = &[
        ("leaf triangles", 0.26),
        // All that is in view is drawn from the leaves: three quarters of the triangles a leaf, of
        // three quarters as many leaves, since other planes cut and a path of its own sees 9
        // of 16 rather than 12.
        ("triangles drawn", 0.55),
        // Levels between the root's D and the leaves' N have their geometric mean: the root of 3/4.
        ("triangles, level", 0.16),
        ("nodes", 0.3),
        ("stored", 0.3),
        ("RMS", 0.2),
        // They follow the triangles drawn.
        ("frame", 0.3),
        ("expected", 0.3),
    ];
    let why = "a quarter fewer triangles";
    check("T-junctions", &junctions(false), &twins("joined", &junctions(true)), fewer, why);

    let mut isolated = Shape::hills();
    let far = DVec3::new(1e9, -1e9, 1e9);
    isolated.positions.extend((0..1000).map(|n| far * f64::from(n)));
    isolated.texcoords.extend([[0.5; 2]; 1000]);
    check("1,000 vertices of no face, up to 1e12 m off", &isolated, &hills, &[], "");
    table.finish();
}
