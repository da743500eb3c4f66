//! Blocks that are welded to each other.
//!
//! Groups of a source may be one surface all the same: a terrain in hundreds of polygons, each with
//! the vertices of its neighbours. Blocks made of such groups meet along ragged lines, whose
//! vertices no level may do without ([`crate::builder::border::shared`]); where these are many, nothing is
//! left of a root's budget for what lies between. Such blocks are made one, and cut where it suits
//! the tree: borders at cutting planes thin from level to level.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use crate::builder::blocks::block_plan::{BlockPlan, BlockSize, Division};
use crate::builder::border::shared::{Bounds, bounds_of, each_shared};
use crate::builder::stitch::Stitch;
use crate::mesh::{DisjointSet, Model, Part};

/// Joins the plans that have more than `most` vertices in common with others, or as many `stitches`
/// to them, each with the plan that it has most in common with, until none has. The results are at
/// most as large as `limit` or as the largest of those joined, cut if need be.
pub fn merge_adjacent(
    model: &Model,
    plans: Vec<BlockPlan>,
    stitches: &[Stitch],
    most: usize,
    limit: BlockSize,
) -> Vec<BlockPlan> {
    let mut shared: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let positions =
        |plan: usize| parts_of(model, &plans[plan]).flat_map(|part| &part.positions).copied();
    let bounds: Vec<Bounds> = (0..plans.len()).map(|plan| bounds_of(positions(plan))).collect();
    each_shared(&bounds, positions, |_, first, other| {
        *shared.entry([first, other]).or_default() += 1;
    });
    let plan_of = plan_of_parts(&plans, model.parts.len());
    for stitch in stitches {
        let [a, b] = stitch.parts.map(|part| plan_of[part as usize]);
        if a != b {
            *shared.entry([a.min(b), a.max(b)]).or_default() += 1;
        }
    }
    let set_of = joined(plans.len(), &shared, most);
    let mut sets: BTreeMap<usize, Vec<BlockPlan>> = BTreeMap::new();
    for (plan, set) in plans.into_iter().zip(set_of) {
        sets.entry(set).or_default().push(plan);
    }
    let size = |plan: &BlockPlan| match plan.divide {
        Division::Halves(most) => most,
        _ => {
            let triangles = parts_of(model, plan).map(|part| part.indices.len() / 3).sum();
            BlockSize { triangles, bodies: 0 }
        }
    };
    let together = |plans: Vec<BlockPlan>| {
        let most = plans.iter().map(size).fold(limit, BlockSize::max);
        let mut all = plans.into_iter().reduce(|mut all, plan| {
            all.parts.extend(plan.parts);
            all.divide = Division::Halves(most);
            all
        })?;
        all.parts.sort_unstable();
        Some(all)
    };
    sets.into_values().filter_map(together).collect()
}

/// Of each part of a model the plan that has it.
pub fn plan_of_parts(plans: &[BlockPlan], parts: usize) -> Vec<usize> {
    let mut plan_of = vec![usize::MAX; parts];
    for (number, plan) in plans.iter().enumerate() {
        plan.parts.iter().for_each(|&part| plan_of[part] = number);
    }
    plan_of
}

fn parts_of<'a>(model: &'a Model, plan: &'a BlockPlan) -> impl Iterator<Item = &'a Part> {
    plan.parts.iter().map(|&part| &model.parts[part])
}

/// The set of each of `count` things, by its least member, where `shared` tells how much pairs have
/// in common: the set with the most in common with others is joined with the one that it has most in
/// common with, until none has more than `most`.
///
/// Each join moves the links of the set with fewer links, so that a link moves log n times at most.
fn joined(count: usize, shared: &BTreeMap<[usize; 2], usize>, most: usize) -> Vec<usize> {
    let mut sets = DisjointSet::new(count);
    let mut links = vec![Links::default(); count];
    for (&[a, b], &vertices) in shared {
        links[a].set(b, vertices);
        links[b].set(a, vertices);
    }
    // The first of equals is taken.
    let mut order: BTreeSet<(usize, Reverse<usize>)> =
        links.iter().enumerate().map(|(set, links)| (links.total, Reverse(set))).collect();
    while let Some((total, Reverse(heaviest))) = order.pop_last()
        && total > most
        && let Some(nearest) = links[heaviest].largest()
    {
        order.remove(&(links[nearest].total, Reverse(nearest)));
        sets.join(heaviest as u32, nearest as u32);
        let size = |set: usize| (links[set].of.len(), Reverse(set));
        let is_larger = size(heaviest) > size(nearest);
        let (stays, goes) = if is_larger { (heaviest, nearest) } else { (nearest, heaviest) };
        for (other, vertices) in std::mem::take(&mut links[goes]).of {
            if other == stays {
                links[stays].set(goes, 0);
                continue;
            }
            let both = vertices + links[stays].of.get(&other).copied().unwrap_or(0);
            links[stays].set(other, both);
            links[other].set(goes, 0);
            links[other].set(stays, both);
        }
        order.insert((links[stays].total, Reverse(stays)));
    }
    (0..count as u32).map(|member| sets.root(member) as usize).collect()
}

/// Links of a set to the sets that it shares vertices with.
#[derive(Clone, Default)]
struct Links {
    of: BTreeMap<usize, usize>,
    by_vertices: BTreeSet<(usize, Reverse<usize>)>,
    total: usize,
}

impl Links {
    /// Sets what it has in common with another set; 0 is nothing.
    fn set(&mut self, other: usize, vertices: usize) {
        let before = match vertices {
            0 => self.of.remove(&other),
            _ => self.of.insert(other, vertices),
        };
        if let Some(before) = before {
            self.by_vertices.remove(&(before, Reverse(other)));
            self.total -= before;
        }
        if vertices > 0 {
            self.by_vertices.insert((vertices, Reverse(other)));
            self.total += vertices;
        }
    }

    /// The set that it has most in common with; of equals the first.
    fn largest(&self) -> Option<usize> {
        self.by_vertices.last().map(|&(_, Reverse(other))| other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Group, Warnings};
    use crate::scaling::assert_scales;

    #[test]
    fn the_heaviest_is_joined_first_and_what_is_light_then_stays() {
        let shared = BTreeMap::from([([0, 1], 60), ([1, 2], 70), ([2, 3], 20), ([3, 4], 5)]);
        assert_eq!(joined(5, &shared, 200), [0, 1, 2, 3, 4], "none has so many");
        // 1 has 130 and goes with 2; both together have 80 and go with 0, which leaves 20.
        assert_eq!(joined(5, &shared, 75), [0, 0, 0, 3, 4]);
        assert_eq!(joined(5, &shared, 19), [0, 0, 0, 0, 4]);
        assert_eq!(joined(5, &shared, 0), [0; 5]);
    }

    #[test]
    fn time_scales_with_the_number_of_sets() {
        let link = |a: usize, b: usize, vertices: usize| ([a.min(b), a.max(b)], vertices);
        // One that all others have something in common with, a chain, and a lattice.
        let hub = |count: usize| (1..count).map(|at| link(0, at, 1 + at % 7)).collect();
        let chain = |count: usize| (1..count).map(|at| link(at - 1, at, 1 + at % 7)).collect();
        let lattice = |count: usize| {
            let beside = |at: usize| [link(at, at + 1, 3 + at % 5), link(at, at + 30, 4 + at % 3)];
            (0..count - 30).flat_map(beside).collect()
        };
        let shapes: [&dyn Fn(usize) -> BTreeMap<[usize; 2], usize>; 3] = [&hub, &chain, &lattice];
        for shape in shapes {
            assert_scales(
                1000,
                |count| (count, shape(count)),
                |(count, shared)| {
                    assert!(joined(count, &shared, 0).iter().all(|&set| set == 0));
                },
            );
        }
    }

    /// A strip of squares along x, cut into groups of `each` squares that share their borders.
    fn strips(groups: u32, each: u32, across: u32) -> Model {
        let mut model = Model {
            source: "strips.obj".into(),
            dependencies: Vec::new(),
            groups: Vec::new(),
            parts: Vec::new(),
            materials: Vec::new(),
            textures: Vec::new(),
            up: None,
            warnings: Warnings::default(),
        };
        for group in 0..groups {
            let mut part = Part { group, ..Part::default() };
            for x in 0..=each {
                let row = (0..=across).map(|y| [f64::from(group * each + x), f64::from(y), 0.0]);
                part.positions.extend(row);
            }
            for corner in 0..each * (across + 1) {
                if corner % (across + 1) != across {
                    let [a, b, c, d] = [0, across + 1, across + 2, 1].map(|step| corner + step);
                    part.indices.extend([a, b, c, a, c, d]);
                }
            }
            model.parts.push(part);
            model.groups.push(Group { name: group.to_string() });
        }
        model
    }

    #[test]
    fn groups_of_one_surface_become_one_plan_that_is_cut() {
        let model = strips(4, 3, 40);
        let plan = |group: usize| BlockPlan {
            name: group.to_string(),
            parts: vec![group],
            divide: Division::Whole,
        };
        let plans: Vec<BlockPlan> = (0..4).map(plan).collect();
        let limit = |triangles: usize| BlockSize { triangles, bodies: usize::MAX };
        // 41 vertices on each of three lines; the inner groups have two.
        assert_eq!(merge_adjacent(&model, plans.clone(), &[], 82, limit(1)), plans);
        let two = merge_adjacent(&model, plans.clone(), &[], 81, limit(1));
        assert_eq!(two.len(), 2, "both inner groups with the first: {two:?}");
        assert_eq!(two[1], plans[3]);
        let one = merge_adjacent(&model, plans.clone(), &[], 40, limit(300));
        let [one] = &one[..] else { panic!("{one:?}") };
        assert_eq!((&one.parts[..], &one.name[..]), (&[0, 1, 2, 3][..], "0"));
        assert_eq!(one.divide, Division::Halves(limit(300)));
        let [one] = &merge_adjacent(&model, plans, &[], 40, limit(1))[..] else { panic!() };
        assert_eq!(one.divide, Division::Halves(limit(240)), "no smaller than they were");
    }
}
