//! Nodes above the blocks: a city's coarsest views.
//!
//! Without them the coarsest view of a city has a root for each block, and costs in proportion to the city.
//! A district stands for neighbouring nodes ([`grouping`]) as a node stands for its children, and
//! districts stand for districts, until there are few at the top.
//!
//! A district is made from its members' files alone ([`members`]): they are a model, small and with
//! textures of its own, and the district is its root. So blocks of several inputs, of earlier builds
//! and of other machines are one case, and what is needed of a city does not grow with its detail. How far
//! a district is off the source is measured through its members' files and those below them
//! ([`detail`]). Between districts, borders thin alike on both sides ([`border`]).

pub mod border;
pub mod cuts;
pub mod detail;
pub mod grouping;
mod made_of;
mod meeting;
pub mod members;
pub mod near;
mod polygon;
pub mod widened;

use std::collections::BTreeMap;

use glam::DVec3;

use self::border::LevelBorder;
use self::detail::{FileDetail, Files};
use self::grouping::{Item, groups};
use self::meeting::{Meeting, Planned};
use self::members::Members;
use self::near::Joined;
use crate::Result;
use crate::builder::block_setup::{BlockPlace, BlockSetup, Looks, Target};
use crate::builder::blocks::gather::{gather, localise};
use crate::builder::blocks::merge_untextured::merge_untextured;
use crate::builder::border::chain::KeepRule;
use crate::builder::border::shared::{Bounds, bounds_of, meet};
use crate::builder::cut::split::Chunk;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::emit::shared_textures::write_textures;
use crate::builder::error::error_through;
use crate::builder::hierarchy::{Below, BorderMode, Resolutions, Tree};
use crate::builder::options::BuildOptions;
use crate::builder::progress::Progress;
use crate::builder::reuse::Earlier;
use crate::builder::stages::{Stage, Stages};
use crate::builder::stitch::{OpenEdge, stitches};
use crate::builder::threads::in_parallel;
use crate::format::rims::{KnownRim, RIMS_FILE, Rims};
use crate::format::{OutputDir, SharedTexture};
use crate::lattice::Lattice;
use crate::mesh::box_tree::BoxTree;
use crate::mesh::{Model, NEAR, UpAxis, Warnings};
use crate::report::build_report::{BlockCut, DistrictReport};
use crate::texture::{SharedTextures, TextureCache};

/// Districts are made until no more nodes than this are at the top.
const MOST_ROOTS: usize = 8;

/// The bound on a district's error is at most so many times what is sure, as far as its members are known
/// well enough.
const LOOSE: f64 = 1.2;

/// Levels of districts, at most: a city of 8 · 2^24 blocks.
const MOST_LEVELS: usize = 24;

/// The trees of a scene, those of districts with those of their blocks below them.
#[derive(Debug, Default)]
pub struct Districts {
    /// The trees.
    pub trees: Vec<Tree<NodeRecord>>,
    /// How each district was made, in order of files.
    pub reports: Vec<DistrictReport>,
    /// What was imperfect.
    pub warnings: Warnings,
}

/// What districts are built with.
#[derive(Clone, Copy)]
pub struct Above<'a> {
    /// How.
    pub options: &'a BuildOptions,
    /// The output folder, which has the files of what is below.
    pub out: &'a OutputDir,
    /// Where the time goes.
    pub stages: &'a Stages,
    /// Is told of leaves, of which none is made here.
    pub progress: &'a dyn Progress,
    /// A result whose districts are taken over where they are made of the same.
    pub earlier: Option<&'a Earlier>,
    /// Which axis points at the sky.
    pub up: UpAxis,
    /// The planes that divided the source into blocks.
    pub cuts: &'a [BlockCut],
    /// Whether it has several inputs, so that some may change while others do not.
    pub several: bool,
    /// Whether any of them touch.
    pub meet: bool,
}

/// Builds districts above trees, which may come in any order. Shared textures, which are written, are
/// added to `textures`.
pub fn build_districts(
    mut trees: Vec<Tree<NodeRecord>>,
    textures: &mut BTreeMap<String, SharedTexture>,
    above: &Above,
) -> Result<Districts> {
    let &Above { options, out, stages, progress, earlier, up, cuts, several, meet } = above;
    let mut districts = Districts::default();
    let known = earlier.map(Earlier::rims).unwrap_or_default();
    let mut rims = Rims::default();
    let mut cuts: Vec<(usize, f64)> = cuts.iter().map(|cut| (cut.axis, cut.coordinate)).collect();
    for number in 0..MOST_LEVELS {
        if trees.len() <= MOST_ROOTS {
            break;
        }
        let before = trees.len();
        let shared = SharedTextures::new();
        let target = Target { options, out, shared: &shared, stages, progress };
        let reused;
        (trees, reused) = Level { up, meet, target, earlier, known: &known, number }.build(
            trees,
            &mut cuts,
            &mut rims,
            &mut districts,
        )?;
        if let Some(earlier) = earlier {
            earlier.link_textures(reused.keys(), out)?;
        }
        textures.extend(reused);
        // The next level reads them.
        *textures = write_textures(shared, std::mem::take(textures), out)?;
        if trees.len() == before {
            break;
        }
    }
    if several && !rims.0.is_empty() {
        out.write(RIMS_FILE, &rims.to_bytes()?)?;
    }
    sort(&mut trees);
    districts.reports.sort_by(|a, b| a.file.cmp(&b.file));
    districts.trees = trees;
    Ok(districts)
}

/// One level of districts.
struct Level<'a> {
    up: UpAxis,
    meet: bool,
    target: Target<'a>,
    earlier: Option<&'a Earlier>,
    /// The rims of that.
    known: &'a Rims,
    /// From 0 upward.
    number: usize,
}

/// What a district is made of.
struct Surface {
    model: Model,
    looks: Looks,
    skirts: Vec<Vec<DVec3>>,
    chunk: Chunk<f64>,
}

/// What has become of one.
struct Made {
    trees: Vec<Tree<NodeRecord>>,
    report: Option<DistrictReport>,
    reused_textures: BTreeMap<String, SharedTexture>,
    warnings: Warnings,
}

impl Level<'_> {
    /// Of trees, and the planes that divided what they stand for, as their nodes have them; these are as the
    /// level's have them afterwards. Rims are added to `rims`.
    fn build(
        &self,
        mut trees: Vec<Tree<NodeRecord>>,
        cuts: &mut Vec<(usize, f64)>,
        rims: &mut Rims,
        districts: &mut Districts,
    ) -> Result<(Vec<Tree<NodeRecord>>, BTreeMap<String, SharedTexture>)> {
        sort(&mut trees);
        let BuildOptions { hierarchy, .. } = self.target.options;
        let triangles = f64::from(hierarchy.desired_tris) * f64::from(hierarchy.level_factor);
        let items: Vec<Item> = trees.iter().map(|tree| item(&tree.record)).collect();
        let found = groups(&items, triangles, hierarchy.level_factor as usize);
        let lattice = self.lattice(&items, &found);
        let boxes: Vec<Bounds> = items.iter().map(|item| around(item, lattice)).collect();
        let mut district_of = vec![0; items.len()];
        for (district, group) in found.iter().enumerate() {
            group.iter().for_each(|&member| district_of[member] = district);
        }
        let by_place = BoxTree::new(boxes.iter().map(|&(low, high)| [low, high]).collect());
        let mut trees: Vec<Option<Tree<NodeRecord>>> = trees.into_iter().map(Some).collect();
        let mut plan = |(district, group): (usize, Vec<usize>)| {
            let own: Vec<Bounds> = group.iter().map(|&member| boxes[member]).collect();
            let around = bounds_of(own.iter().flat_map(|&(low, high)| [low, high]));
            let meeting = by_place.matching(|&[low, high]| meet(&around, &(low, high)));
            let mut others: Vec<usize> =
                meeting.filter(|&other| district_of[other] != district).collect();
            others.sort_unstable();
            let others = others.into_iter().map(|other| boxes[other]).collect();
            let members: Vec<Tree<NodeRecord>> =
                group.into_iter().filter_map(|member| trees[member].take()).collect();
            Planned { file: file_of(&members), members, own, around, others }
        };
        let planned: Vec<Planned> = found.into_iter().enumerate().map(&mut plan).collect();
        // Rounded from level to level, as vertices are.
        cuts.iter_mut().for_each(|(_, coordinate)| *coordinate = lattice.round(*coordinate));
        let meeting = Meeting::of(self, &planned, cuts, lattice)?;
        let Meeting { joined, borders, .. } = &meeting;
        let names: Vec<String> = planned.iter().map(|district| district.file.clone()).collect();
        let make = |number: usize, district: Planned| {
            let file = district.file.clone();
            let made_of = meeting.made_of(number, &district, lattice);
            let report = DistrictReport { file, made_of };
            if let Some(earlier) = self.earlier
                && let Some((record, reused_textures)) =
                    earlier.take_over_district(&report, self.target.out)?
            {
                let trees = vec![Tree { record, children: district.members }];
                let warnings = Warnings::default();
                return Ok(Made { trees, report: Some(report), reused_textures, warnings });
            }
            let mut read = self.read(&district.members, lattice, joined.as_ref())?;
            district.keep_skirts(&mut read.skirts);
            let surface = self.surface(read, Some(borders));
            self.district(district.members, surface, borders, report, lattice)
        };
        // The higher, the more of what is below has to be read to know how far one is off.
        let made: Vec<Made> = match self.target.options.max_memory {
            Some(_) if self.number > 0 => {
                let made = planned.into_iter().enumerate();
                made.map(|(number, district)| make(number, district)).collect::<Result<_>>()?
            }
            _ => in_parallel(planned, make)?,
        };
        let names = names.into_iter().map(|file| (self.number as u32, file));
        rims.0.extend(names.zip(meeting.rims));
        let mut next = Vec::with_capacity(made.len());
        let mut reused = BTreeMap::new();
        for Made { trees, report, reused_textures, warnings } in made {
            next.extend(trees);
            districts.reports.extend(report);
            reused.extend(reused_textures);
            districts.warnings.extend(warnings);
        }
        Ok((next, reused))
    }

    /// What the earlier result knew of a district.
    fn known_rim(&self, file: &str) -> Option<&KnownRim> {
        self.known.0.get(&(self.number as u32, file.to_owned()))
    }

    /// One lattice for all districts of the level, so that those that meet agree on where.
    fn lattice(&self, items: &[Item], groups: &[Vec<usize>]) -> Lattice {
        let (mut extent, mut magnitude) = (0f64, 0f64);
        for group in groups {
            let corners = group.iter().flat_map(|&member| [items[member].low, items[member].high]);
            let (low, high) = bounds_of(corners);
            for axis in 0..3 {
                extent = extent.max(high[axis] - low[axis]);
                magnitude = magnitude.max(low[axis].abs()).max(high[axis].abs());
            }
        }
        Lattice::for_extent(extent, magnitude).or_coarser(self.target.options.quantization())
    }

    /// As at planes within blocks: triangles go to a quarter and the length of borders to a half.
    fn keep_rule(&self, lattice: Lattice) -> KeepRule<'static> {
        let hierarchy = &self.target.options.hierarchy;
        let share = match hierarchy.borders {
            BorderMode::Locked => 1.0,
            BorderMode::Skirts => 1.0 / f64::from(hierarchy.level_factor).sqrt(),
        };
        KeepRule {
            shares: vec![share, 1.0],
            most: Vec::new(),
            first_level: 0,
            collinear: if hierarchy.borders == BorderMode::Locked { -1.0 } else { lattice.step },
            baked: None,
            constants: hierarchy.constants.border,
        }
    }

    /// Reads members each time that they are needed: those of all districts of a large city would be much to
    /// hold.
    fn read(
        &self,
        members: &[Tree<NodeRecord>],
        lattice: Lattice,
        joined: Option<&Joined>,
    ) -> Result<Members> {
        let Target { out, stages, .. } = self.target;
        let records = members.iter().map(|tree| &tree.record);
        stages.time(Stage::Gather, || {
            let mut read = members::read(out.path(), records, lattice)?;
            if let Some(joined) = joined {
                joined.apply(&mut read);
            }
            Ok(read)
        })
    }

    /// Of members; with strips between those that touch where it is known what is a border with other districts.
    fn surface(&self, members: Members, borders: Option<&LevelBorder>) -> Surface {
        let Target { options, stages, .. } = self.target;
        let hierarchy = &options.hierarchy;
        stages.time(Stage::Gather, || {
            let Members { mut model, skirts } = members;
            merge_untextured(&mut model);
            // What thinned on both sides of a border of members, but not alike, had skirts.
            let looks = Looks::new(&model);
            let kinds = looks.kinds(&model.parts);
            let between = borders.map(|borders| {
                let goes_on = |edge: &OpenEdge| edge.ends.iter().all(|end| borders.has(*end));
                stitches(&model.parts, kinds, &hierarchy.constants.stitch, goes_on)
            });
            let between = between.unwrap_or_default();
            let chunk = gather(&model.materials, &model.parts, &between);
            // They are in the chunk now.
            model.parts = Vec::new();
            Surface { model, looks, skirts, chunk }
        })
    }

    fn district(
        &self,
        members: Vec<Tree<NodeRecord>>,
        surface: Surface,
        borders: &LevelBorder,
        report: DistrictReport,
        lattice: Lattice,
    ) -> Result<Made> {
        let Surface { mut model, looks, skirts, mut chunk } = surface;
        let Target { options, out, stages, .. } = self.target;
        stages.time(Stage::Gather, || borders.mark(&mut chunk));
        let records = members.iter().map(|tree| &tree.record);
        stages.time(Stage::Gather, || members::read_pictures(out.path(), records, &mut model))?;
        let Looks { textures, extrudable, .. } = looks;
        let cache = TextureCache::new(&model, &textures, [chunk.mesh.materials.iter().copied()]);
        let setup = BlockSetup::new(self.target, self.up, &cache, &extrudable);

        let (low, high) = bounds_of(chunk.mesh.positions.iter().copied());
        let origin = lattice.origin_near(std::array::from_fn(|i| (low[i] + high[i]) * 0.5));
        let (chunk, _) = stages.time(Stage::Gather, || localise(chunk, origin, lattice, false));
        let skirts = skirts.into_iter().map(|corners| {
            corners.into_iter().map(|corner| corner - DVec3::from_array(origin)).collect()
        });
        let triangles = chunk.mesh.triangles.len();
        let BuildOptions { hierarchy, .. } = options;
        let budget = (triangles as f64 / f64::from(hierarchy.level_factor)).round();
        // As much as a root may have at most.
        let budget = (budget as usize).clamp(1, hierarchy.desired_tris as usize);
        let resolutions = Resolutions::above(triangles, budget, hierarchy);
        let prefix = prefix_of(&members);
        let place = BlockPlace { prefix, origin, lattice };
        let textures = setup.textures(&chunk.mesh, &resolutions);
        let sink = setup.sink(&textures, &place);
        let builder = setup.builder(&sink, resolutions, lattice);
        let most = |of: fn(&NodeRecord) -> f64| {
            members.iter().map(|tree| of(&tree.record)).fold(0.0, f64::max)
        };
        let bound = most(|record| record.geometric_error);
        let below = Below { chunk, skirts: skirts.collect(), bound };
        let measure = hierarchy.constants.measure;
        let files = Files { out: out.path(), origin, constants: measure };
        let made = builder.above(below, budget, |mesh| {
            let parts = members.iter().map(|tree| FileDetail::read(&files, tree));
            let parts = parts.collect::<Result<Vec<_>>>()?;
            stages.time(Stage::Measure, || error_through(parts, mesh, LOOSE, measure))
        })?;
        let mut warnings = cache.warnings();
        let reused_textures = BTreeMap::new();
        Ok(match made {
            Ok(record) => {
                warnings.extend(record.warnings.clone());
                let trees = vec![Tree { record, children: members }];
                Made { trees, report: Some(report), reused_textures, warnings }
            }
            Err(_) => {
                let what = "district left out, since it would keep too little of the outline";
                warnings.add(what, 1);
                Made { trees: members, report: None, reused_textures, warnings }
            }
        })
    }
}

/// A box around what the file of a node has, wherever it is moved to.
fn around(item: &Item, lattice: Lattice) -> Bounds {
    let reach = 2.0 * (NEAR + lattice.step);
    (item.low.map(|at| at - reach), item.high.map(|at| at + reach))
}

fn sort(trees: &mut [Tree<NodeRecord>]) {
    trees.sort_by(|a, b| item(&a.record).order(&item(&b.record)));
}

fn item(record: &NodeRecord) -> Item<'_> {
    let NodeRecord { attributes, file, .. } = record;
    Item {
        low: attributes.bbox_min,
        high: attributes.bbox_max,
        triangles: attributes.triangles.into(),
        name: file,
    }
}

fn file_of(members: &[Tree<NodeRecord>]) -> String {
    format!("{}.glb", prefix_of(members))
}

/// What the file of a district is called: by what it stands for.
fn prefix_of(members: &[Tree<NodeRecord>]) -> String {
    let mut hasher = blake3::Hasher::new();
    for Tree { record, .. } in members {
        hasher.update(record.file.as_bytes());
        hasher.update(b"\n");
    }
    format!("district-{}", &hasher.finalize().to_hex().as_str()[..12])
}
