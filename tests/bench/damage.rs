//! Files that cannot be used: each is told of once, what stands below it stays away, and all
//! else arrives. Whoever draws is played by the test; `wall.rs` does the same with a renderer.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use hlod::bench::Session;
use hlod::format::{NODES_DIR, Scene, TEXTURES_DIR};
use hlod::runtime::residency::NodeState;

use crate::bench_support::{Place, city, street};
use crate::stress::{Rig, watched};

/// A way to make a file useless, and a word that tells so.
pub struct Damage {
    pub name: &'static str,
    pub word: &'static str,
    pub apply: fn(&Path),
}

pub const DAMAGES: [Damage; 7] = [
    Damage { name: "missing", word: "cannot read", apply: |file| fs::remove_file(file).unwrap() },
    Damage { name: "empty", word: "expected", apply: |file| fs::write(file, []).unwrap() },
    Damage {
        name: "truncated",
        word: "expected",
        apply: |file| {
            let bytes = fs::read(file).unwrap();
            fs::write(file, &bytes[..bytes.len() - 9]).unwrap();
        },
    },
    Damage {
        name: "longer",
        word: "expected",
        apply: |file| fs::write(file, [fs::read(file).unwrap(), vec![0; 5]].concat()).unwrap(),
    },
    Damage { name: "scrambled", word: "", apply: scramble },
    Damage {
        name: "foreign",
        word: "",
        apply: |file| {
            let size = fs::metadata(file).unwrap().len() as usize;
            fs::write(file, vec![b'x'; size]).unwrap();
        },
    },
    Damage {
        name: "a folder",
        word: "",
        apply: |file| {
            fs::remove_file(file).unwrap();
            fs::create_dir(file).unwrap();
        },
    },
];

/// Flips one bit in each of the first bytes: what is found by checksum, or by a header.
fn scramble(file: &Path) {
    let mut bytes = fs::read(file).unwrap();
    bytes.iter_mut().take(24).for_each(|byte| *byte ^= 16);
    fs::write(file, bytes).unwrap();
}

pub fn node_file(place: &Place, node: u32) -> PathBuf {
    place.out().join(NODES_DIR).join(&place.scene().nodes[node as usize].file)
}

/// A node with a parent and with children.
pub fn inner(scene: &Scene) -> u32 {
    let fits = |node: &hlod::format::Node| node.parent.is_some() && node.first_child.is_some();
    scene.nodes.iter().position(fits).unwrap() as u32
}

fn is_below_or_at(scene: &Scene, top: u32, node: u32) -> bool {
    let above = |&at: &u32| scene.nodes[at as usize].parent;
    std::iter::successors(Some(node), above).any(|at| at == top)
}

/// Loads everything; expects one report that names `file`, and that of all nodes those that
/// `lost` names are not there.
fn expect_lost(place: &Place, file: &Path, word: &str, lost: &BTreeSet<u32>, what: &str) {
    let session = Session::open(&place.out()).unwrap();
    let (states, errors) = watched(what, move || {
        let mut rig = Rig::new(&session, None, Default::default());
        rig.settle(|node| Some(1.0 / f64::from(node + 1)));
        // It is not tried again.
        for _ in 0..20 {
            rig.frame(|node| Some(1.0 / f64::from(node + 1)));
            std::thread::sleep(std::time::Duration::from_micros(200));
        }
        let residency = rig.residency.lock().unwrap();
        let states: Vec<_> = (0..rig.tree.len() as u32).map(|node| residency.state(node)).collect();
        (states, rig.errors.clone())
    });
    let distinct: BTreeSet<&String> = errors.iter().collect();
    assert_eq!(distinct.len(), 1, "{what}: {errors:?}");
    let name = file.file_name().unwrap().to_str().unwrap();
    assert!(errors[0].contains(name) && errors[0].contains(word), "{what}: {errors:?}");
    for (node, state) in (0..).zip(states) {
        match lost.contains(&node) {
            true => assert!(
                matches!(state, NodeState::Broken | NodeState::Absent),
                "{what}: node {node} is {state:?}"
            ),
            false => assert_eq!(state, NodeState::Resident, "{what}: node {node}"),
        }
    }
}

fn below(scene: &Scene, top: u32) -> BTreeSet<u32> {
    (0..scene.nodes.len() as u32).filter(|&node| is_below_or_at(scene, top, node)).collect()
}

#[test]
fn a_damaged_node_takes_along_only_what_stands_below_it() {
    for damage in DAMAGES {
        let place = Place::new(city());
        let node = inner(&place.scene());
        let file = node_file(&place, node);
        (damage.apply)(&file);
        expect_lost(&place, &file, damage.word, &below(&place.scene(), node), damage.name);
    }
}

#[test]
fn one_flipped_bit_anywhere_is_found() {
    let whole = Place::new(city());
    let node = inner(&whole.scene());
    let file = node_file(&whole, node);
    let good = fs::read(&file).unwrap();
    let files = Session::open(&whole.out()).unwrap().files();
    assert!(files.read(node, |_| false).is_ok());
    for place in 0..16 {
        let mut bytes = good.clone();
        bytes[place * (good.len() - 1) / 15] ^= 1 << (place % 8);
        fs::write(&file, bytes).unwrap();
        let error = files.read(node, |_| false).unwrap_err().to_string();
        assert!(error.contains("CRC-32"), "{error}");
    }
}

#[test]
fn another_node_in_its_place_is_found() {
    let place = Place::new(city());
    let scene = place.scene();
    let node = inner(&scene);
    let other = scene.nodes.len() as u32 - 1;
    let file = node_file(&place, node);
    // Of the same size, as another build of the same source may give.
    let mut bytes = fs::read(node_file(&place, other)).unwrap();
    assert!(hlod::format::read_glb(&bytes, &file).is_ok());
    fs::write(&file, &bytes).unwrap();
    expect_lost(&place, &file, "", &below(&scene, node), "another node");
    bytes.resize(scene.nodes[node as usize].file_bytes as usize, 0);
    fs::write(&file, &bytes).unwrap();
    expect_lost(&place, &file, "CRC-32", &below(&scene, node), "another node of the same size");
}

#[test]
fn a_damaged_root_takes_along_its_tree_and_no_other() {
    for damage in [&DAMAGES[0], &DAMAGES[4]] {
        let place = Place::new(city());
        let scene = place.scene();
        assert!(scene.roots().count() > 1);
        let root = scene.roots().next().unwrap();
        let file = node_file(&place, root);
        (damage.apply)(&file);
        expect_lost(&place, &file, damage.word, &below(&scene, root), damage.name);
    }
}

#[test]
fn a_damaged_shared_picture_takes_along_the_nodes_that_need_it() {
    for damage in DAMAGES {
        let place = Place::new(street());
        let scene = place.scene();
        assert!(scene.shared_textures.len() > 1, "{:?}", scene.shared_textures);
        // That which the fewest nodes need.
        let users = |texture: u32| {
            let needs = |node: &&hlod::format::Node| node.shared_textures.contains(&texture);
            scene.nodes.iter().filter(needs).count()
        };
        let texture = (0..scene.shared_textures.len() as u32).min_by_key(|&t| users(t)).unwrap();
        let file =
            place.out().join(TEXTURES_DIR).join(&scene.shared_textures[texture as usize].file_name);
        (damage.apply)(&file);
        let lost = (0..scene.nodes.len() as u32)
            .filter(|&node| scene.nodes[node as usize].shared_textures.contains(&texture))
            .flat_map(|node| below(&scene, node))
            .collect();
        expect_lost(&place, &file, damage.word, &lost, damage.name);
    }
}

#[test]
#[cfg(unix)]
fn a_file_that_must_not_be_read_is_a_damaged_one() {
    use std::os::unix::fs::PermissionsExt;
    let place = Place::new(city());
    let node = inner(&place.scene());
    let file = node_file(&place, node);
    fs::set_permissions(&file, fs::Permissions::from_mode(0o000)).unwrap();
    if fs::read(&file).is_ok() {
        println!("skipped: this user may read everything");
        return;
    }
    expect_lost(&place, &file, "cannot read", &below(&place.scene(), node), "no permission");
}
