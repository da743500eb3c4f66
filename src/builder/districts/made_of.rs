//! Hashes of all that districts are made of, by which the next build knows what is as it was.
//!
//! The surface of a district depends on its members and on what is joined in its box; what of it is a rim, and which
//! skirts of members it has, on the boxes of others that meet its own, and on the planes of cuts in and next to it, too.
//! How it thins depends on what the borders of its level say of its rim. Nothing else is asked for, so that no file
//! has to be read to know.

use blake3::Hasher;
use glam::DVec3;

use super::border::LevelBorder;
use super::cuts::Cuts;
use super::near::Joined;
use crate::builder::border::shared::Bounds;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::hierarchy::Tree;
use crate::format::rims::KnownRim;
use crate::lattice::Lattice;

/// BLAKE3.
pub type Hash = [u8; 32];

/// Of members' surfaces, once planes of cuts that are nearly one were joined. All that they have is in the box
/// `around`.
pub fn of_members(
    members: &[Tree<NodeRecord>],
    lattice: Lattice,
    around: &Bounds,
    joined: Option<&Joined>,
) -> Hash {
    let mut hasher = Hasher::new();
    for Tree { record, .. } in members {
        hasher.update(record.file.as_bytes());
        hasher.update(&record.file_crc.to_le_bytes());
    }
    update(&mut hasher, lattice.step);
    if let Some(joined) = joined {
        joined.hash_cuts(around, &mut hasher);
    }
    hasher.finalize().into()
}

/// Of the edges at which members end where others may be: all others that meet `around`.
pub fn of_ends(members: &Hash, others: &[Bounds]) -> Hash {
    let mut hasher = Hasher::new();
    hasher.update(members);
    for (low, high) in others {
        low.iter().chain(high).for_each(|at| update(&mut hasher, *at));
    }
    hasher.finalize().into()
}

/// Of a rim and of the skirts that are kept, with the hash of ends.
pub fn of_rim(ends: &Hash, around: &Bounds, cuts: &Cuts, joined: Option<&Joined>) -> Hash {
    let mut hasher = Hasher::new();
    hasher.update(ends);
    if let Some(joined) = joined {
        joined.hash_moved(around, &mut hasher);
    }
    cuts.hash(around, &mut hasher);
    hasher.finalize().into()
}

/// Of skirts themselves.
pub fn of_skirts(skirts: &[Vec<DVec3>]) -> Hash {
    let mut hasher = Hasher::new();
    for corners in skirts {
        hasher.update(&(corners.len() as u64).to_le_bytes());
        corners.iter().flat_map(DVec3::to_array).for_each(|at| update(&mut hasher, at));
    }
    hasher.finalize().into()
}

/// Of a district, of whose surface `surface` is a hash; without a rim where it is the only one.
pub fn of_district(
    surface: &Hash,
    known: Option<&KnownRim>,
    borders: &LevelBorder,
    members: &[Tree<NodeRecord>],
) -> String {
    let mut hasher = Hasher::new();
    hasher.update(surface);
    if let Some(KnownRim { skirts, rim, .. }) = known {
        hasher.update(skirts);
        borders.hash(rim, &mut hasher);
    }
    for Tree { record, .. } in members {
        for error in [record.geometric_error, record.mean_error, record.p95_error] {
            update(&mut hasher, error);
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// Of a surface whose members have this hash.
pub fn of_surface(members: &Hash, around: &Bounds, joined: Option<&Joined>) -> Hash {
    let mut hasher = Hasher::new();
    hasher.update(members);
    if let Some(joined) = joined {
        joined.hash_moved(around, &mut hasher);
    }
    hasher.finalize().into()
}

/// Adds a number.
pub fn update(hasher: &mut Hasher, number: f64) {
    hasher.update(&number.to_le_bytes());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::builder::border::shared::Bounds;

    const AROUND: Bounds = ([10.0; 3], [20.0; 3]);

    fn of_cuts(cuts: &[(usize, f64)], ends: &[[[f64; 3]; 2]]) -> [Hash; 2] {
        let joined = Joined::of_cuts(cuts).with_ends(&[ends.to_vec()]);
        let cuts = Cuts::new(joined.cuts());
        let members = of_members(&[], Lattice { step: 0.125 }, &AROUND, Some(&joined));
        let surface = of_surface(&members, &AROUND, Some(&joined));
        [surface, of_rim(&of_ends(&members, &[]), &AROUND, &cuts, Some(&joined))]
    }

    /// Two edges of which one end each is nearly the same.
    fn nearly_one(at: f64) -> [[[f64; 3]; 2]; 2] {
        [[[at, 11.0, 11.0], [at, 13.0, 11.0]], [[at + 0.001, 11.0, 11.0], [at, 9.0, 11.0]]]
    }

    #[test]
    fn a_rim_depends_on_cuts_in_its_box_and_the_next_ones_alone() {
        let cuts = [(0, 1.0), (0, 8.0), (0, 15.0), (0, 23.0), (0, 30.0)];
        let is = of_cuts(&cuts, &[]);
        let with = |number: usize, coordinate: f64| {
            let mut changed = cuts;
            changed[number].1 = coordinate;
            let [surface, rim] = of_cuts(&changed, &[]);
            assert_eq!(surface, is[0]);
            rim == is[1]
        };
        let same = [with(0, 2.0), with(1, 7.0), with(2, 16.0), with(3, 22.0), with(4, 31.0)];
        assert_eq!(same, [true, false, false, false, true]);
        assert_ne!(of_cuts(&[(1, 1.0), (0, 8.0), (0, 15.0), (0, 23.0)], &[]), is, "another axis");
    }

    #[test]
    fn it_depends_on_what_is_joined_in_its_box_alone() {
        let is = of_cuts(&[], &[]);
        assert_eq!(of_cuts(&[], &nearly_one(25.0)), is);
        assert_ne!(of_cuts(&[], &nearly_one(15.0))[0], is[0]);
        // A plane that goes to one that is nearly the same.
        let cuts = [(0, 12.0), (0, 12.002), (0, 40.0), (0, 40.002)];
        let [is, _] = of_cuts(&cuts, &[]);
        assert_eq!(of_cuts(&cuts[..3], &[])[0], is);
        assert_ne!(of_cuts(&[cuts[0], cuts[2], cuts[3]], &[])[0], is);
    }

    #[test]
    fn ends_depend_on_where_others_are() {
        let of = |others: &[Bounds]| of_ends(&[7; 32], others);
        let others = [([0.0; 3], [11.0; 3]), ([19.0; 3], [30.0; 3])];
        assert_ne!(of(&others), of(&others[..1]));
        assert_ne!(of(&others[..1]), of(&others[1..]));
    }
}
