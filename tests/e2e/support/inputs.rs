//! Inputs: generated cities and meshes written by hand.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use hlod::city::{self, CityOptions, TextureSize};

use super::Random;

/// A city small enough to be built a hundred times.
pub fn small_city() -> CityOptions {
    CityOptions {
        blocks: 2,
        triangles: 5_000,
        texture: TextureSize::PerTriangle(17.0),
        seed: 7,
        ..CityOptions::default()
    }
}

/// Writes a city as one OBJ.
pub fn write_city(folder: &Path, options: &CityOptions) -> PathBuf {
    let path = folder.join("city.obj");
    city::write(options, &path).unwrap();
    path
}

/// Writes a small model file and returns its path.
pub fn write(folder: &Path, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path
}

/// A square of two triangles.
pub const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";

/// A hilly street: `side` by `side` quads of 1 m with a repeating picture, each fourth row with
/// a cut-out one, each seventh without, beside loose coloured triangles.
pub fn write_street(folder: &Path, side: usize) -> PathBuf {
    let mut random = Random::new(11, 0);
    let mut text = String::from("mtllib street.mtl\n");
    for i in 0..=side {
        for j in 0..=side {
            let z = random.between(0.0, 0.2);
            let _ = writeln!(text, "v {i} {j} {z:.4}\nvt {} {}", i as f64 * 0.5, j as f64 * 0.25);
        }
    }
    for i in 0..side {
        let material = match i {
            _ if i % 7 == 0 => "plain",
            _ if i % 4 == 0 => "leaves",
            _ => "brick",
        };
        let _ = writeln!(text, "g row_{i}\nusemtl {material}");
        for j in 0..side {
            let at = |i: usize, j: usize| i * (side + 1) + j + 1;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let _ = writeln!(text, "f {a}/{a} {b}/{b} {c}/{c} {d}/{d}");
        }
    }
    let first = (side + 1) * (side + 1) + 1;
    let _ = writeln!(text, "g loose\nusemtl plain");
    for n in 0..400 {
        let centre: [f64; 3] = std::array::from_fn(|_| random.between(0.0, side as f64));
        for _ in 0..3 {
            let [x, y, z] = centre.map(|c| c + random.between(-1.0, 1.0));
            let [r, g, b]: [f64; 3] = std::array::from_fn(|_| random.unit());
            let _ = writeln!(text, "v {x:.4} {y:.4} {z:.4} {r:.3} {g:.3} {b:.3}");
        }
        let v = first + 3 * n;
        let _ = writeln!(text, "f {v} {} {}", v + 1, v + 2);
    }
    write(
        folder,
        "street.mtl",
        "newmtl plain\nKd 0.5 0.4 0.3\nnewmtl brick\nmap_Kd brick.png\n\
         newmtl leaves\nmap_Kd leaves.png\nmap_d leaves.png\n",
    );
    let brick = image::RgbImage::from_fn(64, 32, |x, y| image::Rgb([(x * 4) as u8, y as u8, 99]));
    brick.save(folder.join("brick.png")).unwrap();
    let leaves = image::RgbaImage::from_fn(32, 32, |x, y| {
        image::Rgba([
            20,
            (x * 8) as u8,
            (y * 8) as u8,
            if (x / 4 + y / 4) % 2 == 0 { 255 } else { 0 },
        ])
    });
    leaves.save(folder.join("leaves.png")).unwrap();
    write(folder, "street.obj", text)
}

/// A soup: triangles of all sizes, some twice, some mirrored, some without area, all in one group.
pub fn write_soup(folder: &Path, triangles: usize, seed: u64) -> PathBuf {
    let mut random = Random::new(seed, 0);
    let mut text = String::new();
    let mut corners: Vec<[f64; 3]> = Vec::new();
    for _ in 0..triangles {
        let size = 10f64.powf(random.between(-2.0, 0.7));
        let centre: [f64; 3] = std::array::from_fn(|_| random.between(0.0, 40.0));
        let made: [[f64; 3]; 3] =
            std::array::from_fn(|_| centre.map(|c| c + random.between(-size, size)));
        let last = corners.len().saturating_sub(3);
        match random.below(20) {
            0 if corners.len() >= 3 => corners.extend_from_within(last..),
            1 if corners.len() >= 3 => {
                let [a, b, c] = [corners[last], corners[last + 1], corners[last + 2]];
                corners.extend([a, c, b]);
            }
            2 => corners.extend([made[0], made[1], made[0]]),
            // Joined to the triangle before it.
            3..10 if corners.len() >= 3 => {
                corners.extend([corners[last + 2], corners[last + 1], made[0]]);
            }
            _ => corners.extend(made),
        }
    }
    for [x, y, z] in &corners {
        let _ = writeln!(text, "v {x:.5} {y:.5} {z:.5}");
    }
    for n in 0..corners.len() / 3 {
        let _ = writeln!(text, "f {} {} {}", 3 * n + 1, 3 * n + 2, 3 * n + 3);
    }
    write(folder, "soup.obj", text)
}
