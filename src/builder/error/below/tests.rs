use super::*;
use crate::builder::error::measure;
use crate::builder::error::tests::{mesh, surface_error, surface_of};
use crate::mesh::Mesh;

/// Metres: as long as it has points.
const LENGTH: usize = 256;

fn height(at: usize) -> f32 {
    ((at * 7919) % 23) as f32 * 0.02 + if at == 70 { 3.0 } else { 0.0 }
}

/// A part of a strip of hills, simplified by leaving out vertices.
fn strip(from: usize, to: usize, step: usize) -> Mesh {
    let mut places: Vec<usize> = (from..to).step_by(step).collect();
    places.push(to);
    let row = |y: f32| places.iter().map(move |&at| [at as f32, y, height(at)]);
    let positions: Vec<[f32; 3]> = row(0.0).chain(row(5.0)).collect();
    let count = places.len() as u32;
    let squares = (0..count - 1)
        .flat_map(|at| [[at, at + 1, at + 1 + count], [at, at + 1 + count, at + count]]);
    mesh(&positions, &squares.collect::<Vec<_>>())
}

/// Makes what the parent of two nodes is measured against. They keep every `step`th vertex of the source.
fn made(from: usize, to: usize, step: usize) -> Below {
    if step == 1 {
        return Below::source(surface_of(&strip(from, to, 1)), 0.0);
    }
    let middle = (from + to) / 2;
    let below = Below::join(vec![made(from, middle, step / 4), made(middle, to, step / 4)]);
    let node = surface_of(&strip(from, to, step));
    let bound = measure(&below, &node, &surface_of(&Mesh::default())).error.bound;
    below.above(node, bound)
}

#[test]
fn bounds_hold_level_by_level() {
    let source = surface_of(&strip(0, LENGTH, 1));
    for step in [4, 16, 64] {
        let bound = made(0, LENGTH, step).bound();
        let true_error = surface_error(&source, &strip(0, LENGTH, step)).bound;
        assert!(true_error > 2.5 && bound >= true_error / 1.1, "{step}: {bound} {true_error}");
        assert!(bound <= 1.3 * true_error, "{step}: {bound} {true_error}");
    }
}

/// A node by its number, of which there are many triangles.
struct Numbered(u32, f64, Vec<Numbered>);

impl BoundedNode for Numbered {
    fn bound(&self) -> f64 {
        self.1
    }

    fn triangles(&self) -> usize {
        MOST_TRIANGLES / 4 + 1
    }

    fn children(&self) -> &[Self] {
        &self.2
    }
}

fn numbers(children: &[Numbered]) -> Vec<u32> {
    measured_against(children).into_iter().map(|node| node.0).collect()
}

#[test]
fn nodes_are_measured_two_levels_below_and_further_where_bounds_are_large() {
    let leaf = |number| Numbered(number, 0.0, Vec::new());
    let parent = |number, bound| Numbered(number, bound, vec![leaf(number + 1), leaf(number + 2)]);
    let tree = |bounds: [f64; 2]| {
        [leaf(0), Numbered(1, 8.0, vec![parent(2, bounds[0]), parent(5, bounds[1])])]
    };
    assert_eq!(numbers(&tree([0.25, 0.5])), [0, 2, 5]);
    assert_eq!(numbers(&tree([0.25, 0.6])), [0, 2, 6, 7]);
    // One more makes it too many.
    assert_eq!(numbers(&tree([4.0, 5.0])), [0, 2, 6, 7]);
    assert_eq!(numbers(&tree([5.0, 4.0])), [0, 3, 5, 4]);
}

/// The offset of a surface counts at that surface only.
#[test]
fn offs_count_where_they_are() {
    let [near, far] = [(0, 64), (64, 128)].map(|(from, to)| strip(from, to, 1));
    let lifted = |by: f32| {
        let mut all = strip(0, 128, 1);
        all.positions.iter_mut().filter(|p| p[0] < 63.5).for_each(|p| p[2] += by);
        surface_of(&all)
    };
    let surface = |off: [f64; 2]| {
        let parts = [
            surface_of(&near).with_surface_offset(off[0]),
            surface_of(&far).with_surface_offset(off[1]),
        ];
        let nodes = parts.into_iter().map(|part| Surface::new(Arc::new(part), 0.0)).collect();
        Below { nodes, ..Below::source(surface_of(&strip(0, 128, 1)), 0.0) }
    };
    let none = surface_of(&Mesh::default());
    let bound = |off, by| measure(&surface(off), &lifted(by), &none).error.bound;
    let apart = bound([0.0, 0.0], 2.0);
    assert!(apart > 1.0, "{apart}");
    let ratio = bound([0.5, 0.0], 2.0) / (apart + 0.5);
    assert!((1.0 / 1.1..=1.1).contains(&ratio), "{ratio}");
    let ratio = bound([0.0, 0.5], 2.0) / apart;
    assert!((1.0 / 1.1..=1.1).contains(&ratio), "{ratio}");
    let alone = bound([0.0, 0.5], 0.0);
    assert!((0.5..=0.55).contains(&alone), "{alone}");
}

#[test]
fn the_bound_is_no_less_than_that_of_the_next_level() {
    let source = Below::source(surface_of(&strip(0, 64, 1)), 0.0);
    let below = source.above(surface_of(&strip(0, 64, 2)), 7.0);
    let error = measure(&below, &surface_of(&strip(0, 64, 4)), &surface_of(&Mesh::default())).error;
    assert_eq!(error.bound, 7.0);
    assert!(error.p95 < 1.0, "{error:?}");
}

/// A sheet of two squares, of which the node lacks one: a skirt that hangs there stands for nothing.
#[test]
fn skirts_cover_no_hole_and_must_be_near() {
    let square = |x: f32| [[x, 0.0, 0.0], [x + 4.0, 0.0, 0.0], [x + 4.0, 4.0, 0.0], [x, 4.0, 0.0]];
    let triangles = [[0, 1, 2], [0, 2, 3]];
    let both = [square(0.0), square(4.0)].concat();
    let sheet = mesh(&both, &[[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    let below = Below::source(surface_of(&sheet), 0.0);
    let node = surface_of(&mesh(&square(0.0), &triangles));
    let bound = |beside: &Mesh| measure(&below, &node, &surface_of(beside)).error.bound;
    let without = bound(&Mesh::default());
    assert!((4.0..=4.4).contains(&without), "{without}");
    let over_the_hole = bound(&mesh(&square(4.0), &triangles));
    assert_eq!(over_the_hole, without);
    let hanging = [[4.0, 0.0, 0.0], [4.0, 4.0, 0.0], [4.0, 4.0, -9.0]];
    let far = bound(&mesh(&hanging, &[[0, 1, 2]]));
    assert!((9.0..=9.9).contains(&far), "{far}");
}
