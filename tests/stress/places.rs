//! The same city at other places, in other units, turned and mirrored.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use hlod::city::CityOptions;

use crate::chain::{Chain, Placement, options};
use crate::shape::{Shape, half_a_step};
use crate::support::Random;
use crate::support::inputs::{small_city, write, write_city};
use crate::table::{Bounds, Table, Twin};

/// Twins that differ by less than rounding.
const TWINS: u64 = 7;

/// Winding decides which of two equal edges comes first, and so what is left of both.
const MIRRORED: [(&str, f64); 7] = [
    ("RMS", 0.2),
    ("stored", 0.1),
    ("colour", 0.08),
    ("leaf colour", 0.08),
    ("toggles", 0.05),
    ("nodes", 0.05),
    ("triangles drawn", 0.05),
];

/// The RMS of a level of two nodes is that of a few dozen edges, of which twins keep others.
const ROUNDED: [(&str, f64); 5] = [
    ("RMS", 0.15),
    ("stored", 0.05),
    ("colour", 0.03),
    ("leaf colour", 0.03),
    // Three steps may be open between two levels, and steps are powers of two: up to twice as large
    // for what is scaled otherwise.
    ("widest gap", 0.05),
];

/// Writes the city `city.obj` with its vertices moved: as they are, rounded to 1/1024 m, or
/// shaken by less than what they are rounded by.
fn place(folder: &Path, placement: &Placement, round: bool, shake: u64) -> PathBuf {
    let text = std::fs::read_to_string(folder.join("city.obj")).unwrap();
    let mut moved = String::new();
    for line in text.lines() {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let _ = match fields[..] {
            ["v", x, y, z] => {
                let mut p = DVec3::from([x, y, z].map(|c| c.parse().unwrap()));
                if round {
                    p = (p * 1024.0).round() / 1024.0;
                }
                if shake > 0 {
                    // The same for all vertices of one place, or it would tear.
                    let place = p.to_array().map(f64::to_bits);
                    let seed = place.iter().fold(shake, |s, bits| s.rotate_left(21) ^ bits);
                    p += half_a_step(&mut Random::new(seed, 0));
                }
                let p = placement.point(p);
                writeln!(moved, "v {} {} {}", p.x, p.y, p.z)
            }
            ["f", a, b, c] if placement.is_mirrored() => writeln!(moved, "f {a} {c} {b}"),
            // What a face begins with should matter as little as a last bit.
            ["f", a, b, c] if shake % 2 == 1 => writeln!(moved, "f {c} {a} {b}"),
            _ => writeln!(moved, "{line}"),
        };
    }
    write(folder, "hard.obj", moved)
}

fn offset(x: f64, y: f64, z: f64) -> Placement {
    Placement { offset: DVec3::new(x, y, z), ..Placement::SAME }
}

fn scaled(scale: f64) -> Placement {
    Placement { scale, ..Placement::SAME }
}

fn turned(turn: DMat3) -> Placement {
    Placement { turn, ..Placement::SAME }
}

fn mirrored() -> Placement {
    turned(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))
}

#[test]
fn a_city_is_the_same_anywhere() {
    let mut table = Table::new("1-places", "The same city elsewhere");
    let folder = crate::chain::inputs();
    write_city(&folder, &CityOptions { triangles: 8_000, ..small_city() });
    let at_origin = |round, shake| {
        let input = place(&folder, &Placement::SAME, round, shake);
        Chain::new(&input, &options()).unwrap()
    };

    // Coordinates that every offset and scale here leaves exact: nothing at all may change.
    let exact = at_origin(true, 0);
    let path = exact.path();
    let exact = Twin::one("at the origin, in 1/1024 m", exact.figures(&path, 1.0));
    let mut check = |name: &str, placement: Placement, round: bool, twin: &Twin| {
        let input = place(&folder, &placement, round, 0);
        let chain = Chain::new(&input, &options()).unwrap();
        table.verified(name, chain.failures());
        let figures = chain.figures(&placement.path(&path), placement.scale);
        let (bounds, why): (Bounds, _) = match round {
            true => (&[], ""),
            false if placement.is_mirrored() => (&MIRRORED, "edges are met in another order"),
            false => (&ROUNDED, "two nodes on the coarsest level: last bits decide"),
        };
        table.within(name, &figures, twin, bounds, why);
    };
    check(
        "in 1/1024 m at 678,016 / 5,403,456",
        offset(678_016.0, 5_403_456.0, 412.0),
        true,
        &exact,
    );
    check("in 1/1024 m, ECEF", offset(4_075_540.0, 931_735.0, 4_801_629.0), true, &exact);
    check("in 1/1024 m at 1e8 m on three axes", offset(1e8, -1e8, 1e8), true, &exact);
    check("in 1/1024 m, scaled by 2^-13", scaled(2f64.powi(-13)), true, &exact);
    check("in 1/1024 m, scaled by 2^13", scaled(2f64.powi(13)), true, &exact);

    // Decimals, which each place rounds its own way.
    let all = (0..TWINS).map(|shake| {
        let chain = at_origin(false, shake);
        chain.figures(&path, 1.0)
    });
    let twin = Twin::several("at the origin", all.collect());
    check("at 678,016 / 5,403,456", offset(678_016.0, 5_403_456.0, 412.3), false, &twin);
    check("ECEF", offset(4_075_539.9, 931_735.3, 4_801_629.4), false, &twin);
    check("at 6.4e6 m on three axes", offset(6.4e6, -6.4e6, 6.4e6), false, &twin);
    check("at 1e8 m on three axes", offset(1e8, -1e8, 1e8), false, &twin);
    check("scaled by 1e-4", scaled(1e-4), false, &twin);
    check("scaled by 1e4", scaled(1e4), false, &twin);
    check("mirrored", mirrored(), false, &twin);
    table.finish();
}

#[test]
fn what_is_turned_is_as_good() {
    let mut table = Table::new("2-turned", "Turned by an odd angle");
    let folder = crate::chain::inputs();
    let odd = turned(DMat3::from_rotation_z(37.3f64.to_radians()));
    // Rows of vertices wind, so that no plane runs along them, as none does in what is turned.
    let rows: Vec<f64> = (0..=64).map(f64::from).collect();
    let hills = |placement: &Placement, shake| {
        let mut shape = Shape::hills_at(&rows, &rows);
        for p in &mut shape.positions {
            let inner = |at: f64| (at * (64.0 - at) / 8.0).clamp(0.0, 0.45);
            let [x, y] = [p.x, p.y];
            p.x += inner(x) * (1.7 * y).sin();
            p.y += inner(y) * (1.3 * x).sin();
        }
        let shape = shape.shaken(shake).placed(placement);
        Chain::new(&shape.write(&folder), &options()).unwrap()
    };
    let path = hills(&Placement::SAME, 0).path();
    let all = (0..TWINS).map(|shake| hills(&Placement::SAME, shake).figures(&path, 1.0));
    let twin = Twin::several("hills", all.collect());
    let chain = hills(&odd, 0);
    table.verified("hills", chain.failures());
    let bounds: Bounds = &[
        ("leaf triangles", 0.1),
        ("triangles, level", 0.1),
        ("RMS", 0.6),
        ("colour RMS", 0.15),
        ("leaf colour", 0.3),
        ("stored error", 1.5),
        ("nodes", 0.4),
        ("triangles drawn", 0.2),
        ("toggles", 0.2),
        // They follow the nodes and triangles drawn, and the part of the image under the boxes,
        // which are larger around what is turned.
        ("frame", 0.25),
        ("expected", 0.25),
    ];
    let why = "other planes cut other chunks, small ones at the corners of the box";
    table.within("hills, by 37.3°", &chain.figures(&odd.path(&path), 1.0), &twin, bounds, why);
    table.finish();
}
