//! The distance from a source that is not at hand, through surfaces that are known to be near it.
//!
//! Nodes that are written know how far they are off the source. A surface that is made of them is off it
//! by no more than it is off them and they are, added up (the triangle inequality), place by place.
//! That is much too much where they are coarse; so those that decide are replaced by the nodes
//! below them, until the bound is near a distance that is sure to be there.

use std::sync::Arc;

use super::directed::{Directed, Largest, seed};
use super::original::Original;
use super::{NEAR_ROUNDING, RELATIVE_ROUNDING, SurfaceError, exact, rounding, statistics};
use crate::Result;
use crate::builder::constants::MeasureConstants;
use crate::mesh::Mesh;

/// Parts are looked at in more detail together where their bounds are no less than this share of the
/// largest.
const WORST: f64 = 0.85;

/// And wherever they are off by this share of the bound: they will have to be, sooner or later.
const COARSE: f64 = 0.3;

/// This share of the bound is much to be off by where it is not known what makes a bound so large.
const MUCH: f64 = 0.1;

/// Triangles of parts, from which on none is looked at in more detail: what decides may be anywhere in a large
/// city, and memory and time to find it would grow with that. What parts are off is in the bound then.
const MOST_TRIANGLES: usize = 100_000;

/// A surface, how far it is off the source, and what there is of it in more detail.
pub trait Detail: Sized {
    /// Of part of the source, and none of it twice.
    fn surface(&self) -> Arc<Original>;

    /// How far it is off that part. Nothing where the surface is the source.
    fn off(&self) -> SurfaceError;

    /// Surfaces that together stand for the same part, each less far off; none where there are none.
    fn finer(&self) -> Result<Vec<Self>>;
}

/// A part of the source.
struct Part<D> {
    detail: D,
    surface: Arc<Original>,
    off: SurfaceError,
    /// No point of the surface is farther from the mesh.
    bound: f64,
}

impl<D: Detail> Part<D> {
    fn new(detail: D) -> Option<Self> {
        let (surface, off) = (detail.surface(), detail.off());
        (!surface.is_empty()).then_some(Self { detail, surface, off, bound: f64::INFINITY })
    }
}

/// How far a mesh is from the source that `parts` stand for, both ways. The bound is at most `loose` times
/// a distance that is sure to be there, as far as there is detail.
pub fn error_through<D: Detail>(
    parts: Vec<D>,
    mesh: &Mesh,
    loose: f64,
    constants: MeasureConstants,
) -> Result<SurfaceError> {
    let mesh = Original::of(mesh, constants);
    let mut parts: Vec<Part<D>> = parts.into_iter().filter_map(Part::new).collect();
    if mesh.is_empty() || parts.is_empty() {
        let boxes = parts.iter().map(|part| part.surface.diagonal());
        return Ok(SurfaceError::everywhere(boxes.fold(mesh.diagonal(), f64::max)));
    }
    // Sure to be there.
    let mut least = 0f64;
    let mut asked = false;
    loop {
        for part in parts.iter_mut().filter(|part| part.bound.is_infinite()) {
            let (found, bound) = farthest(part, &mesh, least);
            part.bound = bound;
            least = least.max(found - part.off.bound);
        }
        let by_part = |part: &Part<D>| part.bound + part.off.bound;
        let bound = parts.iter().map(by_part).fold(0.0, f64::max);
        // The worst first: what they turn out to be may be enough for the others.
        let worst = |bound: f64| (least * loose).max(bound * WORST);
        let is_open =
            |part: &Part<D>| by_part(part) > worst(bound) || part.off.bound > bound * COARSE;
        let open: Vec<bool> = parts.iter().map(is_open).collect();
        if bound > least * loose && refine(&mut parts, &open)? {
            continue;
        }
        let union = Original::union(parts.iter().map(|part| Arc::clone(&part.surface)).collect());
        let of_parts =
            parts.iter().flat_map(|part| part.surface.parts.iter().map(|_| part.off.bound as f32));
        let union = union.with_offs(of_parts);
        let way = Way::from(&mesh, &union, least);
        // What was found has what the part there may be off in it, once.
        least = least.max(way.found - 2.0 * f64::from(union.most_off()));
        if way.bound <= least * loose {
            return Ok(total(&parts, &mesh, &union, bound.max(way.bound)));
        }
        let bound = bound.max(way.bound);
        // What the farthest point of the mesh is near; where that was not enough, whatever is off by
        // much, and then all.
        let deciding = way.near(&parts).filter(|_| !std::mem::replace(&mut asked, true));
        let open = |of: &dyn Fn(usize, &Part<D>) -> bool| -> Vec<bool> {
            parts.iter().enumerate().map(|(number, part)| of(number, part)).collect()
        };
        let choices = [
            open(&|number, _| deciding == Some(number)),
            open(&|_, part| part.off.bound > bound * MUCH),
            open(&|_, _| true),
        ];
        let mut refined = false;
        for open in &choices {
            refined = refined || refine(&mut parts, open)?;
        }
        if !refined {
            return Ok(total(&parts, &mesh, &union, bound));
        }
    }
}

/// Replaces parts by what there is of them in more detail, as far as that is not too much; whether there was any.
fn refine<D: Detail>(parts: &mut Vec<Part<D>>, open: &[bool]) -> Result<bool> {
    let mut any = false;
    let triangles = |part: &Part<D>| part.surface.triangle_count();
    let mut all_triangles: usize = parts.iter().map(triangles).sum();
    let mut all = Vec::with_capacity(parts.len());
    for (part, &open) in std::mem::take(parts).into_iter().zip(open) {
        let is_off = part.off.bound > 0.0 && all_triangles < MOST_TRIANGLES;
        let finer = if open && is_off { part.detail.finer()? } else { Vec::new() };
        if finer.is_empty() {
            all.push(part);
        } else {
            any = true;
            let before = all.len();
            all_triangles -= triangles(&part);
            all.extend(finer.into_iter().filter_map(Part::new));
            all_triangles += all[before..].iter().map(triangles).sum::<usize>();
        }
    }
    *parts = all;
    Ok(any)
}

/// The largest distance from a part to a mesh, found and at most; it is not told apart where it does not raise
/// what is sure to be there.
fn farthest<D>(part: &Part<D>, mesh: &Original, least: f64) -> (f64, f64) {
    let Way { found, bound, .. } = Way::from(&part.surface, mesh, least - part.off.bound);
    (found, bound)
}

/// From one surface to another.
struct Way {
    /// Some point is so far; 0 where it is not told apart.
    found: f64,
    /// None is farther.
    bound: f64,
    /// The part of the other surface that is nearest to the farthest point, where one was found.
    near: Option<u32>,
}

impl Way {
    fn from(from: &Original, to: &Original, least: f64) -> Self {
        let rounding = rounding(from, to);
        let start = (least as f32).max(2.0 * rounding);
        let mut largest = Largest::at_least(start);
        seed(from, to, &mut largest);
        let (largest, _) = Directed::new(from, to, largest, rounding).run();
        let bound = f64::from(largest.bound()) * (1.0 + RELATIVE_ROUNDING) + f64::from(rounding);
        let is_near = largest.found <= NEAR_ROUNDING * rounding;
        if let Some(exact) = is_near.then(|| exact::one_way(from, to)).flatten() {
            let bound = bound.min(exact.bound + f64::from(to.most_off()));
            return Self { found: exact.found, bound, near: None };
        }
        let is_found = largest.found > start;
        let found = f64::from(largest.found) * (1.0 - RELATIVE_ROUNDING) - f64::from(rounding);
        Self {
            found: if is_found { found } else { 0.0 },
            bound,
            near: is_found.then_some(largest.near),
        }
    }

    /// The part that has the surface that is nearest.
    fn near<D>(&self, parts: &[Part<D>]) -> Option<usize> {
        let mut left = self.near? as usize;
        parts.iter().position(|part| {
            let here = part.surface.parts.len();
            let is_here = left < here;
            left = left.wrapping_sub(here);
            is_here
        })
    }
}

/// The error, of which the mean is that of points of the mesh and of the parts, with what these are off.
fn total<D>(parts: &[Part<D>], mesh: &Original, union: &Original, bound: f64) -> SurfaceError {
    let (mean, rms, p95) = statistics(union, mesh, bound);
    let area =
        |part: &Part<D>| -> f64 { part.surface.parts.iter().map(|one| one.samples.area).sum() };
    let all: f64 = parts.iter().map(area).sum();
    let share = |part: &Part<D>| if all > 0.0 { area(part) / all } else { 0.0 };
    let off = parts.iter().fold(SurfaceError::default(), |sum, part| {
        let share = share(part);
        let SurfaceError { mean, rms, p95, .. } = part.off;
        sum.plus(&SurfaceError {
            bound: 0.0,
            mean: mean * share,
            rms: rms * share,
            p95: p95 * share,
        })
    });
    let SurfaceError { mean, rms, p95, .. } = SurfaceError { bound, mean, rms, p95 }.plus(&off);
    SurfaceError { bound, mean: mean.min(bound), rms: rms.min(bound), p95: p95.min(bound) }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::super::surface_error;
    use super::super::tests::{mesh, surface_of};
    use super::*;

    /// A strip of hills of 1 m between two places, simplified by leaving out vertices.
    struct Strip<'a> {
        from: usize,
        to: usize,
        step: usize,
        opened: &'a Cell<usize>,
    }

    fn height(at: usize) -> f32 {
        ((at * 7919) % 23) as f32 * 0.02 + if at == 70 { 3.0 } else { 0.0 }
    }

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

    impl Detail for Strip<'_> {
        fn surface(&self) -> Arc<Original> {
            Arc::new(surface_of(&strip(self.from, self.to, self.step)))
        }

        fn off(&self) -> SurfaceError {
            let source = surface_of(&strip(self.from, self.to, 1));
            surface_error(&source, &strip(self.from, self.to, self.step))
        }

        fn finer(&self) -> Result<Vec<Self>> {
            if self.step == 1 {
                return Ok(Vec::new());
            }
            self.opened.set(self.opened.get() + 1);
            let &Self { from, to, step, opened } = self;
            let middle = from + (to - from) / 2 / step * step;
            let half = |from, to| Strip { from, to, step: step / 4, opened };
            Ok(vec![half(from, middle), half(middle, to)])
        }
    }

    fn through(loose: f64, coarse: &Mesh) -> (SurfaceError, usize) {
        let opened = Cell::new(0);
        let strips =
            [0, 64, 128, 192].map(|from| Strip { from, to: from + 64, step: 16, opened: &opened });
        let found = error_through(strips.into(), coarse, loose, MeasureConstants::default());
        (found.unwrap(), opened.get())
    }

    #[test]
    fn bounds_hold_and_only_what_decides_is_looked_at_in_detail() {
        let source = surface_of(&strip(0, 256, 1));
        let coarse = strip(0, 256, 64);
        let true_error = surface_error(&source, &coarse);
        assert!(true_error.bound > 2.5, "{true_error:?}");
        let (tight, opened) = through(1.2, &coarse);
        assert!(tight.bound >= true_error.bound / 1.1, "{tight:?} {true_error:?}");
        assert!(tight.bound <= 1.25 * true_error.bound, "{tight:?} {true_error:?}");
        assert!((1..=4).contains(&opened), "{opened}");
        assert!(tight.mean >= 0.8 * true_error.mean && tight.mean <= 2.0 * true_error.mean);
        let (loose, less) = through(2.5, &coarse);
        assert!(loose.bound >= tight.bound && less <= opened, "{loose:?} {less} {opened}");
    }

    #[test]
    fn what_is_known_exactly_is_exact() {
        let coarse = strip(0, 256, 1);
        let (found, _) = through(1.2, &coarse);
        let off = surface_error(&surface_of(&strip(0, 256, 1)), &coarse);
        assert_eq!(off.bound, 0.0);
        assert!(found.bound < 1e-3, "{found:?}");
    }

    #[test]
    fn a_mesh_without_triangles_is_as_far_as_can_be() {
        let (found, _) = through(1.2, &Mesh::default());
        assert!(found.bound > 60.0 && found.bound.is_finite(), "{found:?}");
    }
}
