//! Compressed and quantised files are smaller and hold what they promise.

use std::fs;

use hlod::city::{self, CityOptions, TextureSize};

use crate::gltf_inputs::check_nodes_as_inputs;
use crate::support::inputs::small_city;
use crate::support::run_build;

const ENCODINGS: [&[&str]; 4] = [
    &[],
    &["--compress", "meshopt"],
    &["--quantize", "0.01"],
    &["--quantize", "0.01", "--compress", "meshopt"],
];

#[test]
fn every_encoding_is_verified_against_the_source_and_smaller_than_plain() {
    for up in ["y", "z"] {
        let folder = tempfile::tempdir().unwrap();
        let city = CityOptions {
            offset: [678_016.0, 5_403_456.0, 370.0],
            texture: TextureSize::None,
            triangles: 8_000,
            ..small_city()
        };
        city::write(&city, &folder.path().join("city.obj")).unwrap();
        let mut sizes = Vec::new();
        for (number, encoding) in ENCODINGS.into_iter().enumerate() {
            let out = format!("out-{number}");
            let options = [&["--desired-tris", "250", "--up", up][..], encoding];
            run_build(folder.path(), &[&options.concat()[..], &["city.obj", &out]].concat());
            let verify = ["verify", &out, "--source", "city.obj", "--samples", "20000"];
            run_build(folder.path(), &verify);
            check_nodes_as_inputs(&folder.path().join(&out));
            let nodes = fs::read_dir(folder.path().join(&out).join("nodes")).unwrap();
            sizes.push(nodes.map(|node| node.unwrap().metadata().unwrap().len()).sum::<u64>());
        }
        let [plain, compressed, quantized, both] = sizes[..] else { unreachable!() };
        assert!(compressed < plain * 7 / 10, "{sizes:?}");
        assert!(quantized < plain * 95 / 100 && both < compressed * 8 / 10, "{sizes:?}");
    }
}
