//! Blocks that are welded to each other.
//!
//! Groups of a source may be one surface all the same: a terrain in hundreds of polygons, each with
//! the vertices of its neighbours. Blocks made of such groups meet along ragged lines, whose
//! vertices no level may do without ([`crate::builder::border::shared`]); where these are many, nothing is
//! left of a root's budget for what lies between. Such blocks are made one, and cut where it suits
//! the tree: borders at cutting planes thin from level to level.

use std::collections::BTreeMap;

use crate::builder::blocks::block_plan::{BlockPlan, BlockSize, Division};
use crate::builder::border::shared::{Bounds, bounds_of, each_shared};
use crate::builder::stitch::Stitch;
use crate::mesh::{Model, Part};

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
        plans.into_iter().reduce(|mut all, plan| {
            all.parts.extend(plan.parts);
            all.parts.sort_unstable();
            all.divide = Division::Halves(most);
            all
        })
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
/// in common: that with the most in common with others is joined with the one that it has most in
/// common with, until none has more than `most`.
fn joined(count: usize, shared: &BTreeMap<[usize; 2], usize>, most: usize) -> Vec<usize> {
    let mut set_of: Vec<usize> = (0..count).collect();
    let mut common: Vec<BTreeMap<usize, usize>> = vec![BTreeMap::new(); count];
    for (&[a, b], &vertices) in shared {
        common[a].insert(b, vertices);
        common[b].insert(a, vertices);
    }
    let mut totals: Vec<usize> = common.iter().map(|others| others.values().sum()).collect();
    loop {
        // Of equals the first.
        let heaviest = (0..count).rev().max_by_key(|&set| totals[set]);
        let Some(heaviest) = heaviest.filter(|&set| totals[set] > most) else { return set_of };
        let nearest = common[heaviest].iter().rev().max_by_key(|(_, vertices)| **vertices);
        let Some((&nearest, _)) = nearest else { return set_of };
        let (stays, goes) = (heaviest.min(nearest), heaviest.max(nearest));
        set_of.iter_mut().filter(|set| **set == goes).for_each(|set| *set = stays);
        for (other, vertices) in std::mem::take(&mut common[goes]) {
            common[other].remove(&goes);
            if other != stays {
                *common[stays].entry(other).or_default() += vertices;
                *common[other].entry(stays).or_default() += vertices;
            }
        }
        totals[goes] = 0;
        totals[stays] = common[stays].values().sum();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Group, Warnings};

    #[test]
    fn the_heaviest_is_joined_first_and_what_is_light_then_stays() {
        let shared = BTreeMap::from([([0, 1], 60), ([1, 2], 70), ([2, 3], 20), ([3, 4], 5)]);
        assert_eq!(joined(5, &shared, 200), [0, 1, 2, 3, 4], "none has so many");
        // 1 has 130 and goes with 2; both together have 80 and go with 0, which leaves 20.
        assert_eq!(joined(5, &shared, 75), [0, 0, 0, 3, 4]);
        assert_eq!(joined(5, &shared, 19), [0, 0, 0, 0, 4]);
        assert_eq!(joined(5, &shared, 0), [0; 5]);
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
