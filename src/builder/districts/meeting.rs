//! Where the districts of a level meet: what of them is nearly one and is joined, where each ends, and how their
//! borders thin.
//!
//! All of it is decided for the level together. What an earlier result knew of a district is taken over where it is
//! made of the same ([`made_of`]), and none of its members is read.

use glam::DVec3;

use super::border::{LevelBorder, rim_of};
use super::cuts::Cuts;
use super::made_of;
use super::near::Joined;
use super::{Level, Surface};
use crate::Result;
use crate::builder::border::shared::{Bounds, bounds_of, holds, meet};
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::builder::stages::Stage;
use crate::builder::threads::in_parallel;
use crate::format::rims::KnownRim;
use crate::lattice::Lattice;

/// A district that is to be made.
pub struct Planned {
    /// Its file.
    pub file: String,
    /// What it stands for.
    pub members: Vec<Tree<NodeRecord>>,
    /// Around what each of its members has, wherever it is moved to.
    pub own: Vec<Bounds>,
    /// Around all of them.
    pub around: Bounds,
    /// As `own`, of the members of others, those that meet it.
    pub others: Vec<Bounds>,
}

impl Planned {
    fn hash(&self, lattice: Lattice, joined: Option<&Joined>) -> made_of::Hash {
        made_of::of_members(&self.members, lattice, &self.around, joined)
    }

    /// What closes gaps between members is of no use where no other district is.
    pub fn keep_skirts(&self, skirts: &mut Vec<Vec<DVec3>>) {
        skirts.retain(|skirt| {
            let around = bounds_of(skirt.iter().map(|at| at.to_array()));
            self.others.iter().any(|other| meet(&around, other))
        });
    }

    /// Whether another member may be there, too, of this one or another.
    fn is_of_several(&self, at: &[f64; 3]) -> bool {
        let all = self.own.iter().chain(&self.others);
        all.filter(|bounds| holds(bounds, at)).nth(1).is_some()
    }
}

/// Edges at which a district's members end.
type Ends = Vec<[[f64; 3]; 2]>;

/// Where the districts of a level meet; nowhere where there is one.
#[derive(Default)]
pub struct Meeting {
    /// What of them is nearly one, where inputs touch.
    pub joined: Option<Joined>,
    /// Of each district.
    pub rims: Vec<KnownRim>,
    /// How they thin.
    pub borders: LevelBorder,
}

impl Meeting {
    /// Of the districts of a level, and of the planes that divided what they stand for, of which those that are nearly
    /// one become one.
    pub fn of(
        level: &Level<'_>,
        districts: &[Planned],
        cuts: &mut Vec<(usize, f64)>,
        lattice: Lattice,
    ) -> Result<Self> {
        if districts.len() < 2 {
            return Ok(Self::default());
        }
        let stages = level.target.stages;
        let mut ends: Vec<Ends> = vec![Ends::new(); districts.len()];
        let mut joined = None;
        if level.meet {
            let of_cuts = Joined::of_cuts(cuts);
            ends = in_parallel(districts.iter().collect(), |_, district: &Planned| {
                ends_of(level, district, lattice, &of_cuts)
            })?;
            *cuts = of_cuts.cuts().to_vec();
            joined = Some(stages.time(Stage::Gather, || of_cuts.with_ends(&ends)));
        }
        let cuts = Cuts::new(cuts);
        let ending: Vec<(&Planned, Ends)> = districts.iter().zip(ends).collect();
        let rims = in_parallel(ending, |_, (district, ends)| {
            rim(level, district, ends, lattice, &cuts, joined.as_ref())
        })?;
        let rule = level.keep_rule(lattice);
        let borders = || LevelBorder::between(&rims, &cuts, &rule);
        let borders = stages.time(Stage::Gather, borders);
        Ok(Self { joined, rims, borders })
    }

    /// A hash of all that one of the districts is made of.
    pub fn made_of(&self, number: usize, district: &Planned, lattice: Lattice) -> String {
        let Self { joined, rims, borders } = self;
        let members = district.hash(lattice, joined.as_ref());
        let surface = made_of::of_surface(&members, &district.around, joined.as_ref());
        made_of::of_district(&surface, rims.get(number), borders, &district.members)
    }
}

/// Edges at which the members of a district end where others may be, with planes of cuts joined.
fn ends_of(
    level: &Level<'_>,
    district: &Planned,
    lattice: Lattice,
    joined: &Joined,
) -> Result<Ends> {
    let made_of = made_of::of_ends(&district.hash(lattice, Some(joined)), &district.others);
    let known = level.known_rim(&district.file);
    if let Some(known) = known.filter(|known| known.ends_made_of == made_of) {
        return Ok(known.ends.clone());
    }
    let read = level.read(&district.members, lattice, Some(joined))?;
    let mut ends = level.target.stages.time(Stage::Gather, || Joined::ends(&read));
    ends.retain(|ends| ends.iter().any(|end| district.is_of_several(end)));
    Ok(ends)
}

fn rim(
    level: &Level<'_>,
    district: &Planned,
    ends: Ends,
    lattice: Lattice,
    cuts: &Cuts,
    joined: Option<&Joined>,
) -> Result<KnownRim> {
    let Planned { file, members, around, others, .. } = district;
    let ends_made_of = made_of::of_ends(&district.hash(lattice, joined), others);
    let made_of = made_of::of_rim(&ends_made_of, around, cuts, joined);
    if let Some(known) = level.known_rim(file).filter(|known| known.made_of == made_of) {
        return Ok(known.clone());
    }
    let mut read = level.read(members, lattice, joined)?;
    district.keep_skirts(&mut read.skirts);
    let Surface { chunk, skirts, .. } = level.surface(read, None);
    let rim = || rim_of(&chunk.mesh, cuts, others);
    let rim = level.target.stages.time(Stage::Gather, rim);
    Ok(KnownRim { ends_made_of, ends, made_of, skirts: made_of::of_skirts(&skirts), rim })
}
