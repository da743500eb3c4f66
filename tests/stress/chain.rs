//! The whole chain: built, verified against its source, replayed by the model clock.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use glam::{DMat3, DQuat, DVec3};
use hlod::Result;
use hlod::bench::{BenchOptions, ClockConstants, PolicyChoice, Session};
use hlod::builder::hierarchy::HierarchyOptions;
use hlod::builder::progress::Silent;
use hlod::builder::{BuildOptions, build};
use hlod::camera::{CameraPath, Ground, PathKind, make_path};
use hlod::mesh::UpAxis;
use hlod::verify::{self, VerifyOptions, VerifyReport, verify};
use tempfile::TempDir;

use crate::figures::Figures;
use crate::support::result::Built;

/// Frames of a replay.
const FRAMES: usize = 150;

/// A build that was verified.
pub struct Chain {
    pub folder: TempDir,
    pub report: VerifyReport,
    pub built: Built,
}

/// A folder for a test's inputs, by a relative path: ids of nodes depend on paths and what
/// verification draws on ids, so that all machines have the same figures.
pub fn inputs() -> PathBuf {
    static HERE: LazyLock<()> = LazyLock::new(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stress");
        std::fs::create_dir_all(&place).unwrap();
        std::env::set_current_dir(place).unwrap();
    });
    LazyLock::force(&HERE);
    // One for each test, which run beside each other.
    let name = std::thread::current().name().unwrap_or("main").replace("::", "-");
    std::fs::create_dir_all(&name).unwrap();
    name.into()
}

/// Small budgets: a few thousand triangles have four levels.
pub fn options() -> BuildOptions {
    let hierarchy = HierarchyOptions { desired_tris: 150, ..HierarchyOptions::default() };
    BuildOptions { hierarchy, up: Some(UpAxis::Z), ..BuildOptions::default() }
}

impl Chain {
    /// Builds and verifies; an error is a refusal.
    pub fn new(input: &Path, options: &BuildOptions) -> Result<Self> {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let inputs: [PathBuf; 1] = [input.to_owned()];
        build(&inputs, &out, options, &Silent)?;
        let limits =
            VerifyOptions { samples: Some(20_000), front: Some(0.1), ..VerifyOptions::default() };
        let report = verify(&out, &inputs, &limits, &verify::Silent)?;
        let built = Built::read(&out);
        Ok(Self { folder, report, built })
    }

    pub fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    /// A path that begins in the streets and ends above.
    pub fn path(&self) -> CameraPath {
        let ground = Ground::read(&self.built.scene, &self.out()).unwrap();
        make_path(&ground, PathKind::Fly, FRAMES, 30.0, 0).unwrap()
    }

    /// Names of checks that failed, with the first failure of each.
    pub fn failures(&self) -> Vec<String> {
        let failed = self.report.checks.iter().filter(|check| !check.passed);
        failed.map(|check| format!("{}: {:?}", check.name, check.failures.first())).collect()
    }

    /// The figures over a path of its own.
    pub fn own_figures(&self) -> Figures {
        self.figures(&self.path(), 1.0)
    }

    /// The figures of build and verification, and of a path replayed. `scale` is by how much all
    /// of it is larger than its twin.
    pub fn figures(&self, path: &CameraPath, scale: f64) -> Figures {
        let mut figures = Figures::default();
        figures.add_build(&self.built, &self.report, scale);
        let session = Session::open(&self.out()).unwrap();
        let (run, _) = session
            .run_model(path, bench_options(), ClockConstants::default(), None, |_| true)
            .unwrap();
        figures.add_run(&run);
        figures
    }
}

/// A target that shows some of all levels.
pub fn bench_options() -> BenchOptions {
    BenchOptions { target_ms: 10.0, ..BenchOptions::default() }
}

/// The thesis's policy, which looks at costs, benefits and normals, with counters that switch
/// within so few frames.
pub fn thesis_options(fore: f64) -> BenchOptions {
    let set = [("hyst_switch", 10.0), ("hyst_limit", 30.0), ("fore", fore)];
    let settings = set.map(|(name, value)| (name.to_owned(), value)).into();
    let policy = PolicyChoice::new("lakhia", &settings).unwrap();
    BenchOptions { policy, ..bench_options() }
}

/// A change of place: `scale × turn × point + offset`.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    pub scale: f64,
    pub turn: DMat3,
    pub offset: DVec3,
}

impl Placement {
    pub const SAME: Self = Self { scale: 1.0, turn: DMat3::IDENTITY, offset: DVec3::ZERO };

    pub fn point(&self, point: DVec3) -> DVec3 {
        self.turn * point * self.scale + self.offset
    }

    pub fn is_mirrored(&self) -> bool {
        self.turn.determinant() < 0.0
    }

    /// The same path over what was moved. In a mirror, left and right of the picture change
    /// places, which nothing depends on.
    pub fn path(&self, path: &CameraPath) -> CameraPath {
        let mut path = path.clone();
        for frame in &mut path.frames {
            let pose = &mut frame.pose;
            pose.position = self.point(pose.position);
            let [right, up, forward] =
                [pose.right(), pose.up(), pose.forward()].map(|axis| self.turn * axis);
            let right = if self.is_mirrored() { -right } else { right };
            pose.rotation = DQuat::from_mat3(&DMat3::from_cols(right, up, -forward)).normalize();
        }
        path
    }
}
