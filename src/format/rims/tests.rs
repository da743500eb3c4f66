use std::path::Path;

use super::super::index_file::{check_damage, sealed};
use super::*;

fn rims() -> Rims {
    let square = [[0.0, 0.0, 3.5], [1e6, 0.0, 3.5], [1e6, 0.125, 3.5], [-0.0, 0.125, 3.5]];
    let [a, b, c, d] = square;
    let rim = Rim {
        bounds: (a, c),
        positions: vec![b, a, b],
        open: vec![[a, b], [c, b]],
        triangles: vec![[c, a, b], [a, c, d]],
    };
    let known = KnownRim {
        ends_made_of: [1; 32],
        ends: vec![[d, a]],
        made_of: [2; 32],
        skirts: [3; 32],
        rim,
    };
    let nothing = KnownRim::default();
    let named = |level, file: &str, known: &KnownRim| ((level, file.to_owned()), known.clone());
    Rims([named(0, "b.glb", &known), named(0, "c.glb", &nothing), named(1, "a.glb", &known)].into())
}

fn read(bytes: &[u8]) -> Result<Rims, String> {
    Rims::from_bytes(bytes, Path::new("rims.hlod")).map_err(|error| error.to_string())
}

#[test]
fn what_is_written_is_read_to_the_bit() {
    let read = read(&rims().to_bytes().unwrap()).unwrap();
    assert_eq!(read, rims());
    let corner = read.0[&(0, "b.glb".to_owned())].rim.triangles[1][2];
    assert!(corner[0].is_sign_negative());
    let nothing = Rims::default();
    assert_eq!(self::read(&nothing.to_bytes().unwrap()), Ok(nothing));
}

#[test]
fn damage_is_named_and_never_believed() {
    check_damage(&rims().to_bytes().unwrap(), read);
}

#[test]
fn order_is_checked() {
    let mut bytes = rims().to_bytes().unwrap();
    let name = bytes.windows(5).position(|bytes| bytes == b"b.glb").unwrap();
    bytes[name] = b'd';
    let error = read(&sealed(bytes)).unwrap_err();
    assert!(error.contains("c.glb: expected the order of levels and files"), "{error}");
}
