//! The numbers that were chosen by measuring, in one place.
//!
//! `scripts/constants` builds real data with each of them smaller and larger and writes what that
//! changes to `docs/constants.md`; `examples/build_with.rs` builds with others. None of them
//! changes what a result promises: errors hold, borders are closed and leaves are the source
//! whatever they are. What follows from arithmetic (rounding, eight lanes, 64 planes) is a constant
//! where it is used.

use serde::{Deserialize, Serialize};

/// All of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Constants {
    /// How inputs become blocks.
    pub blocks: BlockConstants,
    /// How deep trees are.
    pub tree: TreeConstants,
    /// Which borders touch.
    pub stitch: StitchConstants,
    /// Where cutting planes go.
    pub cut: CutConstants,
    /// What borders keep, and what closes them.
    pub border: BorderConstants,
    /// Which way of simplifying is taken.
    pub simplify: SimplifyConstants,
    /// Extruded footprints for small bodies.
    pub prisms: PrismConstants,
    /// What coarse nodes keep of their source's outline.
    pub outline: OutlineConstants,
    /// How errors are found.
    pub measure: MeasureConstants,
}

/// Constants of the partition into blocks ([`crate::builder::partition`]). Sizes are in budgets of
/// `desired_tris` triangles each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BlockConstants {
    /// Blocks have at most so many budgets, 1 or more (the thesis's have 87 on average).
    pub divided: usize,
    /// Source texels of a block at most, if each texture is spread evenly over its triangles. All images of
    /// a block are in memory at once.
    pub texels: u64,
    /// A separate body with at most the triangles of a block divided by this is not cut, 1 or more.
    pub uncut: usize,
}

impl Default for BlockConstants {
    fn default() -> Self {
        Self { divided: 128, texels: 1 << 26, uncut: 32 }
    }
}

/// Which borders of the source touch ([`crate::builder::stitch`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StitchConstants {
    /// Borders touch that are no farther apart than this share of the surface's resolution, 0 or
    /// more; 0: none do.
    pub resolution: f64,
    /// Parts with fewer triangles have the resolution of the whole input, 0 or more.
    pub small_part: usize,
    /// The resolution is found from about so many triangles, 1 or more.
    pub sampled: usize,
}

impl Default for StitchConstants {
    fn default() -> Self {
        Self { resolution: 0.8, small_part: 256, sampled: 4096 }
    }
}

/// How deep trees are ([`crate::builder::hierarchy::shape`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TreeConstants {
    /// A chunk at the last resolution but one is a leaf up to so many times the triangles of
    /// others, 1 or more: cuts are not perfectly even, and another level for a few triangles more
    /// would be of tiny nodes.
    pub last_step_tolerance: f64,
}

impl Default for TreeConstants {
    fn default() -> Self {
        Self { last_step_tolerance: 2.0 }
    }
}

/// Where cutting planes go ([`crate::builder::cut`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CutConstants {
    /// Places that are compared across each side, 2 or more.
    pub places: usize,
    /// Sides shorter than this share of the longest are not cut, 0–1: the halves would be thin
    /// sheets.
    pub shortest_side: f64,
    /// The smaller of the halves has at least this share of the triangles that it should have, 0–1.
    pub least_share: f64,
    /// Weight of the squared relative deviation of the triangles' share from the one that was asked
    /// for, 0 or more.
    pub uneven_triangles: f64,
    /// The same of the space's.
    pub uneven_space: f64,
    /// Vertices are a row where a plane through them crosses no more than one in so many of the
    /// triangles that it crosses beside them, 1 or more. Planes through rows that are not quite
    /// straight would leave many vertices beside them, which every level keeps.
    pub row: usize,
    /// Bodies that extend over no more than this share of a slab are not cut, 0 or more.
    pub uncut: f64,
}

impl Default for CutConstants {
    fn default() -> Self {
        Self {
            places: 64,
            shortest_side: 0.25,
            least_share: 0.5,
            uneven_triangles: 8.0,
            uneven_space: 0.25,
            row: 4,
            uncut: 0.5,
        }
    }
}

/// What borders keep, and what closes them ([`crate::builder::border`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BorderConstants {
    /// A node keeps at most one border vertex on a plane for so many triangles of its budget, over
    /// 0: each costs about a triangle of the mesh and two of a skirt, and a node has two planes.
    pub triangles_per_vertex: f64,
    /// The squared distance of a polyline beside its vertex counts with this share of the squared
    /// length of the edges there, next to the areas of the triangles, 0 or more. Along a flat
    /// surface nothing else counts, but the wider a polyline swings there, the wider are its
    /// skirts.
    pub line_weight: f64,
    /// A triangle is taken for a skirt rather than a rectangle where it is at most so many times as
    /// high, 1 or more. With twice the height it has the rectangle's area.
    pub triangle_height: f64,
    /// It may stand over the ends of its polyline by at most this share of its length, 0 or more.
    pub overhang: f64,
    /// And by at most so many times as far as the polyline is off, 0 or more: from the corner of a
    /// house a long one would stick out into the street.
    pub overhang_heights: f64,
    /// One skirt may stand for so many spans, 1 or more.
    pub spans: usize,
    /// What stands for several spans may be so many times as high as polylines are far from their
    /// edges on average, over 0.
    pub shared_height: f64,
    /// Nor higher than so many times as the farthest is from its edge, 2 or more, which leaves room
    /// for as much on both sides: no skirt is much farther from the source than the node's border.
    pub shared_height_most: f64,
}

impl Default for BorderConstants {
    fn default() -> Self {
        Self {
            triangles_per_vertex: 24.0,
            line_weight: 0.5,
            triangle_height: 2.2,
            overhang: 0.1,
            overhang_heights: 4.0,
            spans: 16,
            shared_height: 8.0,
            shared_height_most: 2.5,
        }
    }
}

/// Which way of simplifying is taken ([`crate::builder::simplify::ladder`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimplifyConstants {
    /// Edge collapse that moves the surface by more than this share of the side of a square as
    /// large as a triangle may have is compared with the other methods, 0 or more: it may have removed
    /// what another method keeps.
    pub doubtful: f64,
    /// Up to this share of faces that turn or go leaves edge collapse as free as it was, 0–1. A
    /// closed surface that folded flat somewhere on a finer level has two faces in one place there;
    /// both stay, and it stays closed.
    pub few_faces: f64,
    /// A part of which nothing is left comes back where all that is left is farther away than so
    /// many times the side of a square as large as a triangle may be, 0 or more.
    pub far_part: f64,
}

impl Default for SimplifyConstants {
    fn default() -> Self {
        Self { doubtful: 0.1, few_faces: 0.02, far_part: 1.0 }
    }
}

/// Extruded footprints for small bodies (`crate::builder::simplify::aggregate::prisms`).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PrismConstants {
    /// Of the grid over a node's bodies at most, 0 or more; 0: there are no prisms.
    pub cells: usize,
    /// Bodies become prisms where the budget leaves fewer triangles than this to each, 0 or more.
    pub triangles_per_body: usize,
    /// Cells along the side of a square as large as the footprints have for each triangle, over 0.
    pub resolution: f64,
    /// Gaps may be filled that are at most so many times as wide as that square, 0 or more.
    pub gap: f64,
    /// A region that is given up counts so many times what is changed, 1 or more.
    pub footprint_penalty: f64,
    /// Heights of a body that rise by more than this from cell to cell, as a share of a cell's
    /// side, are regions of their own, over 0.
    pub slope: f64,
    /// Holes and what is left of regions beside their largest part go to a neighbour up to this
    /// share of that square, 0 or more.
    pub min_region: f64,
    /// A roof is by so many standard deviations of the heights that it stands for above their
    /// mean, 0 or more: a gable's ridge is part of the skyline.
    pub roof_deviations: f64,
    /// A body is at least so high for the side of a square as large as its footprint, 0 or more: a
    /// sloping road is not.
    pub least_height: f64,
    /// It has at least this share of the walls of the box around it, 0–1.
    pub least_walls: f64,
    /// A surface is a wall where its normal's rise is at most this, 0–1.
    pub wall_rise: f64,
}

impl Default for PrismConstants {
    fn default() -> Self {
        Self {
            cells: 1 << 20,
            triangles_per_body: 12,
            resolution: 5.0,
            gap: 2.0,
            footprint_penalty: 10.0,
            slope: 1.0,
            min_region: 0.5,
            roof_deviations: 0.5,
            least_height: 0.1,
            least_walls: 0.3,
            wall_rise: 0.5,
        }
    }
}

/// What coarse nodes keep of the outline of their source ([`crate::mesh::OutlineFrame`]).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OutlineConstants {
    /// A coarse node that keeps a smaller share of the covered ground or of the skyline is given more
    /// triangles, and where that is not enough it is not written, 0–1; 0: all are as they are.
    pub least_kept: f64,
    /// What is lost falls roughly by this root of the triangles, over 0: how many more are tried.
    pub exponent: f64,
    /// But no more than this share of those of its children, 0–1.
    pub most_triangles: f64,
    /// Along the longer side of a node's ground, and columns of each skyline, 1 or more.
    pub cells: usize,
}

impl Default for OutlineConstants {
    fn default() -> Self {
        Self { least_kept: 0.88, exponent: 1.25, most_triangles: 0.9, cells: 256 }
    }
}

/// How errors are found ([`crate::builder::error`]): what is found holds and is as tight as
/// [`crate::builder::error::TIGHTNESS`] whatever these are, as long as the divisions suffice.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureConstants {
    /// Points of a surface for the mean, 1 or more: fewer leave it to chance, more cost time.
    pub points: usize,
    /// Leaves whose first triangles are measured before all others, 1 or more.
    pub seeds: usize,
    /// A triangle that is walked over is made smaller by moving its corners inward by this share of
    /// the distance that is to be proven, over 0 and under 1: its edges often lie at a border or a
    /// fold of the other surface, a little beyond it or within. What then remains is for the
    /// height.
    pub aside: f32,
    /// No triangle is made smaller by more than this share of itself, over 0 and under 1.
    pub most_smaller: f32,
    /// More triangles are not visited on one walk, 1 or more.
    pub most_visited: usize,
    /// A polygon so many times as large as the region that it would be clipped to is bisected, 1 or
    /// more.
    pub much_larger: f64,
    /// Polygons that one triangle is divided into at once, 1 or more. What is then left waits until
    /// that of all other triangles is known, and is taken up with the largest bound first.
    pub polygons_per_triangle: usize,
    /// Polygons that wait are divided so many times in all, 1 or more.
    pub divisions: usize,
    /// Or so many times for each triangle of both surfaces, 0 or more.
    pub divisions_per_triangle: usize,
}

impl Default for MeasureConstants {
    fn default() -> Self {
        Self {
            points: 512,
            seeds: 64,
            aside: 0.3,
            most_smaller: 0.9,
            most_visited: 512,
            much_larger: 16.0,
            polygons_per_triangle: 256,
            divisions: 4096,
            divisions_per_triangle: 4,
        }
    }
}
