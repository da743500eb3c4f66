//! Vertices on the planes that cut, next to them, and edges within them.

use hlod::builder::BuildOptions;
use hlod::builder::partition::BlockSplit;

use crate::chain::{Chain, options};
use crate::shape::Shape;
use crate::table::{Bounds, Table, Twin};

/// Hills whose columns are moved by `by(column)`; the outermost stay, and so do all planes.
fn hills(by: impl Fn(f64) -> f64) -> Shape {
    let rows: Vec<f64> = (0..=64).map(f64::from).collect();
    let inner = |&x: &f64| if x == 0.0 || x == 64.0 { x } else { by(x) };
    Shape::hills_at(&rows.iter().map(inner).collect::<Vec<_>>(), &rows)
}

/// The lattice's step over 64 m.
const STEP: f64 = 64.0 / (1 << 23) as f64;

/// Boxes of nodes end elsewhere by as much, and a frame on the edge of a switch may go either way.
const MOVED: [(&str, f64); 5] = [
    ("toggles", 0.06),
    ("nodes", 0.03),
    ("triangles drawn", 0.03),
    ("frame", 0.02),
    ("expected", 0.02),
];

fn check(table: &mut Table, name: &str, options: &BuildOptions, same_blocks: bool) {
    let folder = crate::chain::inputs();
    let chain = |shape: Shape| Chain::new(&shape.write(&folder), options).unwrap();
    let on = chain(hills(|x| x));
    let path = on.path();
    table.verified(name, on.failures());
    let figures_on = on.figures(&path, 1.0);
    // By two steps at most, as far as the cases are.
    let shaken = |shake| chain(hills(|x| x).shaken_by(shake, 4.0)).figures(&path, 1.0);
    let all = (1..5).map(shaken).chain([figures_on.clone()]);
    let twin = Twin::several(&format!("on the planes{name}"), all.collect());
    let odd = |x: f64| x.rem_euclid(2.0) == 1.0;
    let shifts: [(&str, &dyn Fn(f64) -> f64); 7] = [
        ("one ulp above", &f64::next_up),
        ("one ulp below", &f64::next_down),
        ("an ulp above and below in turn", &|x| {
            if odd(x / 16.0) { x.next_up() } else { x.next_down() }
        }),
        ("0.4 of rounding above", &|x| x + 0.4 * STEP),
        ("0.4 of rounding below", &|x| x - 0.4 * STEP),
        ("one step of rounding above", &|x| x + STEP),
        ("one step of rounding below", &|x| x - STEP),
    ];
    for (case, by) in shifts {
        let case = format!("{case}{name}");
        let chain = chain(hills(by));
        table.verified(&case, chain.failures());
        table.within(&case, &chain.figures(&path, 1.0), &twin, &MOVED, "the planes move as well");
    }
    if !same_blocks {
        return;
    }
    // Planes that cross triangles add to these; levels have as many and are as good.
    let apart = [0.3, 0.37, 0.45].map(|by| chain(hills(|x| x + by)).figures(&path, 1.0));
    let bounds: Bounds = &[
        ("leaf triangles", f64::INFINITY),
        ("triangles, level", 0.1),
        ("RMS", 0.3),
        ("nodes", f64::INFINITY),
        ("toggles", f64::INFINITY),
        ("triangles drawn", f64::INFINITY),
        ("frame", 0.1),
        ("expected", 0.1),
        ("stored", 0.6),
        ("colour", 0.02),
    ];
    let why = "fewer triangles, since none is cut; planes amid triangles may be level instead";
    let twin = Twin::several("planes amid triangles", apart.into());
    table.within("vertices on the planes", &figures_on, &twin, bounds, why);
}

#[test]
fn vertices_on_planes_are_as_good_as_others() {
    let mut table = Table::new("5-planes", "Vertices on cutting planes and beside them");
    check(&mut table, "", &options(), true);
    // How many nodes stand above squares follows from how many triangles these have.
    let blocks = BlockSplit::Grid(16.0);
    let grid = BuildOptions { blocks, upper_levels: false, ..options() };
    check(&mut table, ", blocks of 16 m", &grid, false);
    table.finish();
}
