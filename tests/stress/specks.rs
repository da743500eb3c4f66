//! Triangles that are next to nothing: needles, no area at all, everything in one place.

use glam::DVec3;

use crate::chain::{Chain, options};
use crate::shape::Shape;
use crate::support::Random;
use crate::table::{Bounds, Table, Twin};

/// Triangles that are added to the hills.
const ADDED: usize = 200;
/// Below the hills there is level ground, where they are added: no level is any farther off for
/// them or for their absence.
const GROUND: f64 = -10.0;

fn hills() -> Shape {
    let mut shape = Shape::hills();
    let first = shape.positions.len();
    let lines: Vec<f64> = (0..=32).map(|at| f64::from(2 * at)).collect();
    let mut ground = Shape::hills_at(&lines, &lines);
    ground.positions.iter_mut().for_each(|p| p.z = GROUND);
    shape.positions.extend(ground.positions);
    shape.texcoords.extend(ground.texcoords);
    shape.faces.extend(ground.faces.iter().map(|face| face.map(|corner| corner + first)));
    shape
}

/// These with more triangles, each made from a place and two directions of length 1.
fn hills_with(make: impl Fn(DVec3, [DVec3; 2]) -> [DVec3; 3]) -> Shape {
    let mut shape = hills();
    let mut random = Random::new(5, 0);
    for _ in 0..ADDED {
        let (x, y) = (random.between(12.0, 52.0), random.between(12.0, 52.0));
        let angle = random.between(0.0, std::f64::consts::TAU);
        let along = DVec3::new(angle.cos(), angle.sin(), 0.0);
        shape.triangle(make(DVec3::new(x, y, GROUND), [along, along.cross(DVec3::Z)]));
    }
    shape
}

fn chain(shape: &Shape) -> hlod::Result<Chain> {
    let folder = crate::chain::inputs();
    Chain::new(&shape.write(&folder), &options())
}

#[test]
fn specks_change_nothing() {
    let mut table = Table::new("3-specks", "Needles, triangles without area, all in one place");
    let path = chain(&hills()).unwrap().path();
    let twins = |name: &str, of: &dyn Fn(u64) -> Shape| {
        let figures = |shake| chain(&of(shake)).unwrap().figures(&path, 1.0);
        Twin::several(name, (0..5).map(figures).collect())
    };
    let alone = twins("without them", &|shake| hills().shaken(shake));
    // As many of the same length that are wide enough to be sound, and too small to matter.
    let sound = |length: f64| {
        move |place: DVec3, [along, across]: [DVec3; 2]| {
            [place, place + along * length, place + across * 0.01]
        }
    };
    let sound_long = twins("as many of 1 cm width", &|shake| hills_with(sound(10.0)).shaken(shake));
    let sound_short = twins("as many of 1 cm width", &|shake| hills_with(sound(1.0)).shaken(shake));
    let mut check =
        |name: &str, shape: Shape, twin: &Twin, bounds: Bounds, why: &str| match chain(&shape) {
            Ok(chain) => {
                table.verified(name, chain.failures());
                table.within(name, &chain.figures(&path, 1.0), twin, bounds, why);
            }
            Err(error) => table.verified(name, vec![error.to_string()]),
        };
    let thin: Bounds = &[
        ("leaf triangles", 0.04),
        ("triangles, level", 0.03),
        ("triangles drawn", 0.12),
        ("nodes", 0.12),
        ("toggles", 0.12),
        ("frame", 0.04),
        ("expected", 0.04),
        // Which side of a cut a speck goes to, as a whole, changes what is simplified beside it.
        ("stored", 0.75),
        ("RMS", 0.1),
    ];
    check(
        "needles of 10 m, aspect 1e6",
        hills_with(|place, [along, across]| [place, place + along * 10.0, place + across * 1e-5]),
        &sound_long,
        thin,
        "wide ones keep some of the budget, so that other levels fit",
    );
    check(
        "needles of 1 m, aspect 1e6",
        hills_with(|place, [along, across]| [place, place + along, place + across * 1e-6]),
        &sound_short,
        thin,
        "some are thinner than rounding and left out",
    );
    check(
        "corners in a line, area 0",
        hills_with(|place, [along, _]| [place, place + along, place + along * 0.5]),
        &sound_short,
        thin,
        "some are thinner than rounding and left out",
    );
    check(
        "sides of 1e-10 m, area 1e-20",
        hills_with(|place, [along, across]| [place, place + along * 1e-10, place + across * 1e-10]),
        &alone,
        &[],
        "",
    );
    check("one place thrice", hills_with(|place, _| [place; 3]), &alone, &[], "");
    let mut many = hills();
    for _ in 0..333_334 {
        many.triangle([DVec3::new(20.0, 30.0, GROUND); 3]);
    }
    check("a million vertices in one place", many, &alone, &[], "");

    // Sound triangles around one place, each with a vertex of its own there, or with one for all.
    let fan = |apart: bool| {
        let mut shape = Shape::hills();
        let centre = DVec3::new(32.0, 32.0, 8.0);
        let rim = |n: usize| {
            let angle = n as f64 / 2000.0 * std::f64::consts::TAU;
            centre + DVec3::new(angle.cos() * 8.0, angle.sin() * 8.0, (angle * 7.0).sin())
        };
        if apart {
            (0..2000).for_each(|n| shape.triangle([centre, rim(n), rim(n + 1)]));
            return shape;
        }
        let first = shape.positions.len();
        shape.positions.push(centre);
        shape.positions.extend((0..=2000).map(rim));
        shape.texcoords.extend(shape.positions[first..].iter().map(|p| [p.x / 64.0, p.y / 64.0]));
        shape.faces.extend((1..=2000).map(|n| [first, first + n, first + n + 1]));
        shape
    };
    let one_centre = twins("the same with one vertex", &|shake| fan(false).shaken(shake));
    check("2,000 vertices in one place, a triangle each", fan(true), &one_centre, &[], "");
    table.finish();
}

#[test]
fn what_spans_no_surface_is_refused_or_built() {
    let mut table = Table::new("4-flat", "Everything in a point, a line, a plane");
    let all_at = |to: &dyn Fn(DVec3) -> DVec3| {
        let mut shape = Shape::hills();
        shape.positions.iter_mut().for_each(|p| *p = to(*p));
        shape
    };
    let words = "no triangle is left";
    table.refused("in one point", chain(&all_at(&|_| DVec3::new(1.0, 2.0, 3.0))), words);
    table.refused("in one line", chain(&all_at(&|p| DVec3::new(p.x, 0.0, 0.0))), words);
    // No two vertices in one place.
    let mut line = Shape::default();
    for n in 0..2000 {
        let at = |n: usize| DVec3::X * n as f64;
        line.triangle([at(2 * n), at(2 * n + 1), at(2 * n + 2)]);
    }
    table.refused("in one line, no two in one place", chain(&line), "no triangle is left");
    let nearly = all_at(&|p| DVec3::new(p.x, p.y, p.z * 1e-7));
    let nearly = chain(&nearly).unwrap();
    let path = nearly.path();
    let twin = Twin::one("hills of 0.3 µm", nearly.figures(&path, 1.0));
    let flat = chain(&all_at(&|p| DVec3::new(p.x, p.y, 0.0))).unwrap();
    table.verified("in one plane", flat.failures());
    table.same("in one plane", &flat.figures(&path, 1.0), &twin);
    table.finish();
}
