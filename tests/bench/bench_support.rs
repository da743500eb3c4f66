//! Scenes that are built once for all tests, paths over them, and runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use hlod::builder::BuildOptions;
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::camera::{Ground, PathKind, make_path, write_path};
use hlod::format::Scene;
use serde_json::Value;
use tempfile::TempDir;

use crate::support::build_with;
use crate::support::inputs::{small_city, write_city, write_street};

/// The program.
pub fn hlod_bench() -> Command {
    Command::cargo_bin("hlod-bench").unwrap()
}

/// Two blocks with pictures of their own; read only.
pub fn city() -> &'static Path {
    static DIR: LazyLock<PathBuf> = LazyLock::new(|| {
        let mut options = BuildOptions { upper_levels: false, ..build_options(66) };
        options.hierarchy.constants.blocks.divided = 55;
        built("city", &options, |folder| write_city(folder, &small_city()))
    });
    &DIR
}

/// A street whose repeating pictures are shared by its nodes; read only.
pub fn street() -> &'static Path {
    static DIR: LazyLock<PathBuf> =
        LazyLock::new(|| built("street", &build_options(60), |folder| write_street(folder, 24)));
    &DIR
}

fn built(name: &str, options: &BuildOptions, input: impl Fn(&Path) -> PathBuf) -> PathBuf {
    let folder = tempfile::tempdir().unwrap();
    let input = input(folder.path());
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bench-{name}"));
    let _ = fs::remove_dir_all(&out);
    build_with(&[input], &out, options);
    out
}

pub fn build_options(desired_tris: u32) -> BuildOptions {
    let hierarchy = HierarchyOptions { desired_tris, ..HierarchyOptions::default() };
    BuildOptions { hierarchy, ..BuildOptions::default() }
}

/// A folder with a copy of a scene, `out`, which may be damaged, and paths of 30 frames over it:
/// `fly.csv` and `orbit.csv`.
pub struct Place {
    folder: TempDir,
}

impl Place {
    pub fn new(scene: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy(scene, &folder.path().join("out"));
        let place = Self { folder };
        let ground = Ground::read(&place.scene(), &place.out()).unwrap();
        for (kind, name) in [(PathKind::Fly, "fly.csv"), (PathKind::Orbit, "orbit.csv")] {
            let path = make_path(&ground, kind, 30, 30.0, 0).unwrap();
            write_path(&path, &place.path().join(name)).unwrap();
        }
        place
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn out(&self) -> PathBuf {
        self.path().join("out")
    }

    /// The scene, its nodes numbered as in a session.
    pub fn scene(&self) -> Scene {
        Scene::read(&self.out()).unwrap().breadth_first()
    }

    /// Runs the program here.
    pub fn bench(&self, arguments: &[&str]) -> assert_cmd::assert::Assert {
        hlod_bench().current_dir(self.path()).args(arguments).assert()
    }

    /// A result by the name of its folder.
    pub fn summary(&self, result: &str) -> Value {
        let text = fs::read(self.path().join(result).join("summary.json")).unwrap();
        serde_json::from_slice(&text).unwrap()
    }

    pub fn frames(&self, result: &str) -> Frames {
        Frames::parse(&fs::read(self.path().join(result).join("frames.csv")).unwrap())
    }
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let target = to.join(entry.file_name());
        match entry.path().is_dir() {
            true => copy(&entry.path(), &target),
            false => drop(fs::copy(entry.path(), target).unwrap()),
        }
    }
}

/// `frames.csv`, read back.
pub struct Frames {
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
}

impl Frames {
    pub fn parse(bytes: &[u8]) -> Self {
        let mut reader = csv::Reader::from_reader(bytes);
        let header = reader.headers().unwrap().iter().map(String::from).collect();
        let row = |row: csv::Result<csv::StringRecord>| {
            // What was not looked at has no figure.
            let number =
                |field: &str| if field.is_empty() { f64::NAN } else { field.parse().unwrap() };
            row.unwrap().iter().map(number).collect()
        };
        Self { header, rows: reader.records().map(row).collect() }
    }

    pub fn len(&self) -> usize {
        self.rows.len()
    }

    pub fn column(&self, name: &str) -> Vec<f64> {
        let index = self.header.iter().position(|column| column == name);
        let index = index.unwrap_or_else(|| panic!("no column {name}"));
        self.rows.iter().map(|row| row[index]).collect()
    }

    pub fn max(&self, name: &str) -> f64 {
        self.column(name).into_iter().fold(f64::NEG_INFINITY, f64::max)
    }
}
