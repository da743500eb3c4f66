//! Where an input ends.

use crate::builder::blocks::plan::BlockMode;
use crate::builder::constants::BlockConstants;
use crate::builder::hierarchy::{BorderMode, Resolutions};
use crate::builder::options::BuildOptions;
use crate::builder::stitch::{OpenEdge, open_edges};
use crate::mesh::Model;

/// Least and greatest coordinates.
pub type BoundingBox = [[f64; 3]; 2];

/// Whether a box is within `distance` of another on every axis, all of it.
pub fn is_within(
    [low, high]: &BoundingBox,
    [other_low, other_high]: &BoundingBox,
    distance: f64,
) -> bool {
    (0..3).all(|i| high[i] <= other_high[i] + distance && other_low[i] <= low[i] + distance)
}

/// Whether two boxes come within `distance` of each other on every axis.
pub fn come_near(
    [low, high]: &BoundingBox,
    [other_low, other_high]: &BoundingBox,
    distance: f64,
) -> bool {
    (0..3).all(|i| low[i] <= other_high[i] + distance && other_low[i] <= high[i] + distance)
}

/// The edges at which an input ends, as far as others are near.
#[derive(Clone, Debug)]
pub struct Rim {
    /// Of all of the input.
    pub bounds: BoundingBox,
    /// In order of position.
    pub edges: Vec<OpenEdge>,
    /// How much of its borders each level keeps, the roots' first; the last is the leaves'.
    pub keeps: Vec<Keep>,
}

/// How much of a border is kept at a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keep {
    /// Of its vertices, 0–1.
    pub share: f64,
    /// Vertices along a whole side, at most.
    pub most: f64,
}

impl Rim {
    /// Of a model, as far as the box around an edge `is_near` others.
    pub fn new(
        model: &Model,
        is_near: impl Fn(&BoundingBox) -> bool,
        options: &BuildOptions,
    ) -> Self {
        let mut edges = open_edges(&model.parts);
        edges.retain(|edge| {
            let [a, b] = edge.ends;
            let axes = [0, 1, 2];
            is_near(&[axes.map(|i| a[i].min(b[i])), axes.map(|i| a[i].max(b[i]))])
        });
        edges.shrink_to_fit();
        Self { bounds: model.bounds(), edges, keeps: keeps(model, options) }
    }

    /// The edges that are within `distance` of a box.
    pub fn near(&self, other: &BoundingBox, distance: f64) -> impl Iterator<Item = &OpenEdge> {
        self.edges.iter().filter(move |edge| is_near(edge, other, distance))
    }
}

/// As at cuts within the blocks of a model.
fn keeps(model: &Model, options: &BuildOptions) -> Vec<Keep> {
    let hierarchy = &options.hierarchy;
    if hierarchy.borders == BorderMode::Locked {
        return vec![Keep { share: 1.0, most: f64::INFINITY }];
    }
    let of_block = block_triangles(model, options);
    let blocks = model.triangle_count() as f64 / of_block as f64;
    let across = f64::from(hierarchy.level_factor).sqrt();
    // A tile has four sides, where a node within a block has two planes of its own.
    let of_node =
        f64::from(hierarchy.desired_tris) / hierarchy.constants.border.triangles_per_vertex / 2.0;
    let resolutions = Resolutions::new(of_block, hierarchy);
    let keep = |(level, factor): (i32, &f64)| Keep {
        share: 1.0 / factor.sqrt(),
        most: (of_node * blocks.max(1.0).sqrt() * across.powi(level)).ceil(),
    };
    (0..).zip(resolutions.factors()).map(keep).collect()
}

/// About how many triangles the blocks of a model will have, as most of its triangles see it.
fn block_triangles(model: &Model, options: &BuildOptions) -> usize {
    let mut of_group = vec![0usize; model.groups.len()];
    model.parts.iter().for_each(|part| of_group[part.group as usize] += part.indices.len() / 3);
    let all: usize = of_group.iter().sum();
    let squares: f64 = of_group.iter().map(|&triangles| (triangles as f64).powi(2)).sum();
    let group = (squares / all as f64) as usize;
    let BlockConstants { small_group, merged, large_group, divided, .. } =
        options.hierarchy.constants.blocks;
    let budgets = |budgets: usize| budgets.saturating_mul(options.hierarchy.desired_tris as usize);
    let triangles = match options.blocks {
        BlockMode::Groups => group,
        BlockMode::Auto if group <= budgets(small_group) => budgets(merged),
        BlockMode::Auto if group <= budgets(large_group) && model.groups.len() > 1 => group,
        BlockMode::Auto => budgets(divided),
        BlockMode::Grid(metres) => {
            let [low, high] = model.bounds();
            let mut sides: [f64; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
            sides.sort_by(f64::total_cmp);
            let squares = |side: f64| (side / metres).ceil().max(1.0);
            (all as f64 / (squares(sides[1]) * squares(sides[2]))) as usize
        }
    };
    triangles.clamp(1, all.max(1))
}

fn is_near(edge: &OpenEdge, other: &BoundingBox, distance: f64) -> bool {
    edge.ends.iter().all(|end| come_near(&[*end, *end], other, distance))
}
