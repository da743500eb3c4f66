//! Meshes as OBJ has them, to be put together and moved.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::chain::Placement;
use crate::support::Random;
use crate::support::inputs::write;

/// A mesh as text has it: positions and texture coordinates in f64, by group.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    pub positions: Vec<DVec3>,
    /// One a position, or none.
    pub texcoords: Vec<[f64; 2]>,
    /// Corners from 0.
    pub faces: Vec<[usize; 3]>,
}

/// Metres that a hill is high.
const HEIGHT: f64 = 3.0;

/// The height of the hills at a place: smooth, and of no symmetry.
pub fn hill(x: f64, y: f64) -> f64 {
    let (x, y) = (x / 7.3, y / 9.1);
    HEIGHT * ((x + 0.3 * y).sin() * (y - 0.2 * x).cos() + 0.3 * (2.7 * x + 1.9 * y).sin())
}

impl Shape {
    /// Hills over given columns and rows.
    pub fn hills_at(columns: &[f64], rows: &[f64]) -> Self {
        let mut shape = Self::default();
        for &y in rows {
            for &x in columns {
                shape.positions.push(DVec3::new(x, y, hill(x, y)));
                shape.texcoords.push([x / 64.0, y / 64.0]);
            }
        }
        let width = columns.len();
        for row in 0..rows.len() - 1 {
            for column in 0..width - 1 {
                let [a, b] = [row, row + 1].map(|row| row * width + column);
                shape.faces.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
            }
        }
        shape
    }

    /// Hills of 64 m, two triangles a square metre.
    pub fn hills() -> Self {
        let lines: Vec<f64> = (0..=64).map(f64::from).collect();
        Self::hills_at(&lines, &lines)
    }

    pub fn triangle(&mut self, corners: [DVec3; 3]) {
        let first = self.positions.len();
        self.faces.push([first, first + 1, first + 2]);
        self.positions.extend(corners);
        if !self.texcoords.is_empty() {
            self.texcoords.extend(corners.map(|p| [p.x / 64.0, p.y / 64.0]));
        }
    }

    pub fn without_texture(mut self) -> Self {
        self.texcoords.clear();
        self
    }

    /// Moved by less than what coordinates are rounded by; 0 leaves it alone.
    pub fn shaken(self, seed: u64) -> Self {
        self.shaken_by(seed, 1.0)
    }

    /// Moved by so many times as much.
    pub fn shaken_by(mut self, seed: u64, times: f64) -> Self {
        let mut random = Random::new(seed, 0);
        if seed > 0 {
            self.positions.iter_mut().for_each(|p| *p += half_a_step(&mut random) * times);
        }
        self
    }

    pub fn placed(mut self, placement: &Placement) -> Self {
        self.positions.iter_mut().for_each(|p| *p = placement.point(*p));
        if placement.is_mirrored() {
            self.faces.iter_mut().for_each(|face| face.swap(1, 2));
        }
        self
    }

    /// The text; digits enough for every bit of a coordinate.
    pub fn obj(&self) -> String {
        let mut text = String::from("mtllib hard.mtl\nusemtl hard\n");
        for p in &self.positions {
            let _ = writeln!(text, "v {} {} {}", p.x, p.y, p.z);
        }
        for [u, v] in &self.texcoords {
            let _ = writeln!(text, "vt {u} {v}");
        }
        for corners in &self.faces {
            let [a, b, c] = corners.map(|corner| corner + 1);
            let _ = match self.texcoords.is_empty() {
                true => writeln!(text, "f {a} {b} {c}"),
                false => writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}"),
            };
        }
        text
    }

    /// Writes it beside a material with a picture of bands and spots.
    pub fn write(&self, folder: &Path) -> PathBuf {
        write(folder, "hard.mtl", "newmtl hard\nKd 1 1 1\nmap_Kd hard.png\n");
        picture(256, 256).save(folder.join("hard.png")).unwrap();
        write(folder, "hard.obj", self.obj())
    }
}

/// Less than half a step of the lattice over 64 m along each axis.
pub fn half_a_step(random: &mut Random) -> DVec3 {
    DVec3::from([(); 3].map(|()| random.between(-3e-6, 3e-6)))
}

/// Bands and spots, the same at any resolution: sRGB at a place of the picture.
pub fn paint(u: f64, v: f64) -> [u8; 3] {
    let wave = |t: f64| (127.5 + 100.0 * (t * std::f64::consts::TAU).sin()) as u8;
    [wave(3.0 * u), wave(2.0 * v), wave(u + v)]
}

/// A picture of them.
pub fn picture(width: u32, height: u32) -> image::RgbImage {
    picture_of(width, height, paint)
}

/// A picture of colours by place, 0 to 1 each way.
pub fn picture_of(width: u32, height: u32, color: impl Fn(f64, f64) -> [u8; 3]) -> image::RgbImage {
    let part = |at: u32, of: u32| (f64::from(at) + 0.5) / f64::from(of);
    image::RgbImage::from_fn(width, height, |x, y| {
        image::Rgb(color(part(x, width), part(y, height)))
    })
}
