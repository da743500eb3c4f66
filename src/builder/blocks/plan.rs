//! Dividing an input into blocks, the unit at the top of each tree.
//!
//! A block should have a few tens of thousands of triangles and be compact. Groups of the source
//! are blocks where they are of that size; tiny ones are merged with their neighbours, and so are
//! those of one surface ([`crate::builder::blocks::merge_adjacent`]); where there are no groups, or one is huge, the mesh is
//! cut, exactly as nodes are (see [`crate::builder::cut::split`]). So is what has more buildings than
//! its root has triangles for ([`crate::builder::simplify::BodyRules::crowd`]).

use crate::builder::blocks::block_plan::{BlockPlan, BlockSize, Division};
use crate::builder::blocks::merge_adjacent::merge_adjacent;
use crate::builder::constants::BlockConstants;
use crate::builder::simplify::aggregate::BodyRules;
use crate::builder::stitch::Stitch;
use crate::mesh::{Mesh, Model, Part, UpAxis};

/// How blocks are made.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BlockMode {
    /// Groups where they make sense, merged where tiny or one surface, divided where huge, absent or
    /// of more buildings than a root can stand for.
    #[default]
    Auto,
    /// Every group of the source is a block.
    Groups,
    /// Squares of this side (metres) on the ground.
    Grid(f64),
}

impl std::str::FromStr for BlockMode {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "groups" => Ok(Self::Groups),
            _ => text
                .strip_prefix("grid:")
                .and_then(|metres| metres.trim().parse::<f64>().ok())
                .filter(|metres| metres.is_finite() && *metres > 0.0)
                .map(Self::Grid)
                .ok_or_else(|| "expected auto, groups, or grid:METRES with METRES > 0".into()),
        }
    }
}

impl std::fmt::Display for BlockMode {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Auto => out.write_str("auto"),
            Self::Groups => out.write_str("groups"),
            Self::Grid(metres) => write!(out, "grid:{metres}"),
        }
    }
}

/// Facts of a group that planning needs.
struct GroupFacts {
    group: usize,
    parts: Vec<usize>,
    size: BlockSize,
    centre: [f64; 3],
}

/// Plans the blocks of a model.
pub fn plan(
    model: &Model,
    mode: BlockMode,
    desired_tris: u32,
    stitches: &[Stitch],
    constants: &BlockConstants,
    rules: &BodyRules,
) -> Vec<BlockPlan> {
    let &BlockConstants { small_group, merged, large_group, divided, welded, .. } = constants;
    let groups = group_facts(model, rules);
    let name = |group: usize| model.groups[group].name.clone();
    let whole = |facts: &GroupFacts| BlockPlan {
        name: name(facts.group),
        parts: facts.parts.clone(),
        divide: Division::Whole,
    };
    let budget = desired_tris as usize;
    match mode {
        BlockMode::Groups => groups.iter().map(whole).collect(),
        BlockMode::Grid(metres) => {
            let axes = match rules.up {
                UpAxis::Y => [0, 2],
                UpAxis::Z => [0, 1],
            };
            vec![BlockPlan {
                name: name(groups.first().map_or(0, |facts| facts.group)),
                parts: (0..model.parts.len()).collect(),
                divide: Division::Grid { metres, axes },
            }]
        }
        BlockMode::Auto => {
            let large = if groups.len() == 1 { divided } else { large_group } * budget;
            let bodies = rules.most_bodies(budget);
            let of_budgets = |budgets: usize| BlockSize { triangles: budgets * budget, bodies };
            let mut plans: Vec<(usize, BlockPlan)> = Vec::new();
            let mut small = Vec::new();
            for facts in groups {
                if facts.size.fits(of_budgets(small_group)) && model.groups.len() > 1 {
                    small.push(facts);
                } else {
                    let mut block = whole(&facts);
                    if !facts.size.fits(BlockSize { triangles: large, bodies }) {
                        block.divide = Division::Halves(of_budgets(divided));
                    }
                    plans.push((facts.group, block));
                }
            }
            for cluster in merge_small(small, of_budgets(merged)) {
                let first = cluster.iter().map(|facts| facts.group).min().unwrap_or(0);
                let mut parts: Vec<usize> =
                    cluster.iter().flat_map(|facts| facts.parts.iter().copied()).collect();
                parts.sort_unstable();
                plans
                    .push((first, BlockPlan { name: name(first), parts, divide: Division::Whole }));
            }
            plans.sort_by_key(|(first, _)| *first);
            let plans = plans.into_iter().map(|(_, plan)| plan).collect();
            merge_adjacent(model, plans, stitches, budget / welded, of_budgets(merged))
        }
    }
}

fn group_facts(model: &Model, rules: &BodyRules) -> Vec<GroupFacts> {
    let mut parts: Vec<Vec<usize>> = vec![Vec::new(); model.groups.len()];
    for (number, part) in model.parts.iter().enumerate() {
        parts[part.group as usize].push(number);
    }
    parts
        .into_iter()
        .enumerate()
        .filter(|(_, parts)| !parts.is_empty())
        .map(|(group, parts)| {
            let triangles = parts.iter().map(|&part| model.parts[part].indices.len() / 3).sum();
            let bodies = bodies_of(parts.iter().map(|&part| &model.parts[part]), rules);
            let mut low = [f64::INFINITY; 3];
            let mut high = [f64::NEG_INFINITY; 3];
            for position in parts.iter().flat_map(|&part| &model.parts[part].positions) {
                for i in 0..3 {
                    low[i] = low[i].min(position[i]);
                    high[i] = high[i].max(position[i]);
                }
            }
            let centre = std::array::from_fn(|i| (low[i] + high[i]) * 0.5);
            GroupFacts { group, parts, size: BlockSize { triangles, bodies }, centre }
        })
        .collect()
}

/// The bodies of some parts together.
fn bodies_of<'a>(parts: impl Iterator<Item = &'a Part>, rules: &BodyRules) -> usize {
    let mut mesh = Mesh::<f64>::default();
    for part in parts {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(&part.positions);
        mesh.materials.resize(mesh.positions.len(), part.material);
        let triangles = part.indices.as_chunks::<3>().0.iter();
        mesh.triangles.extend(triangles.map(|corners| corners.map(|vertex| first + vertex)));
    }
    rules.crowd(&mesh)
}

/// Halves the groups along the longest side of their centres, at the middle by triangles, until
/// no cluster is larger than `most`.
fn merge_small(groups: Vec<GroupFacts>, most: BlockSize) -> Vec<Vec<GroupFacts>> {
    let mut clusters = Vec::new();
    let mut stack = vec![groups];
    while let Some(mut groups) = stack.pop() {
        let mut total = BlockSize::default();
        groups.iter().for_each(|facts| total += facts.size);
        if groups.is_empty() {
            continue;
        }
        if total.fits(most) || groups.len() == 1 {
            clusters.push(groups);
            continue;
        }
        let side = |axis: usize| {
            let of = groups.iter().map(|facts| facts.centre[axis]);
            of.clone().fold(f64::NEG_INFINITY, f64::max) - of.fold(f64::INFINITY, f64::min)
        };
        let axis = (1..3).fold(0, |best, axis| if side(axis) > side(best) { axis } else { best });
        groups
            .sort_by(|a, b| a.centre[axis].total_cmp(&b.centre[axis]).then(a.group.cmp(&b.group)));
        let mut sum = 0;
        let middle = groups
            .iter()
            .position(|facts| {
                sum += facts.size.triangles;
                2 * sum >= total.triangles
            })
            .map_or(1, |at| (at + 1).clamp(1, groups.len() - 1));
        let upper = groups.split_off(middle);
        stack.push(upper);
        stack.push(groups);
    }
    clusters
}
