//! Cameras and constants at their limits, over the same hills by the model clock.

use glam::DVec3;
use hlod::bench::{BenchOptions, ClockConstants, Session};
use hlod::camera::{CameraPath, PathFrame, Pose, format_path, looking_at, parse_path};
use hlod::format::{SCENE_FILE, Scene};
use hlod::mesh::UpAxis;

use crate::chain::{Chain, bench_options, options, thesis_options};
use crate::figures::Figures;
use crate::shape::{Shape, hill};
use crate::table::{Bounds, Table, Twin};

/// A camera that stands still for some frames and looks at the middle of the hills.
fn still(position: DVec3, fov_y_deg: f64) -> CameraPath {
    moving(position, DVec3::ZERO, 1.0 / 30.0, fov_y_deg)
}

/// One that goes back and forth by `step` at each frame, `seconds` apart.
fn moving(position: DVec3, step: DVec3, seconds: f64, fov_y_deg: f64) -> CameraPath {
    // Neighbours by less than a millimetre look the same way.
    let eye = (position * 1e3).round() / 1e3;
    let rotation = looking_at(UpAxis::Z, eye, DVec3::new(31.0, 33.0, 0.0)).unwrap_or_default();
    let frame = |frame: u32| PathFrame {
        frame: u64::from(frame),
        time_s: f64::from(frame) * seconds,
        pose: Pose { position: position + step * f64::from(frame % 2), rotation, fov_y_deg },
    };
    CameraPath { frames: (0..90).map(frame).collect() }
}

struct Hills(Chain);

impl Hills {
    fn new(shape: &Shape) -> Self {
        let folder = crate::chain::inputs();
        Self(Chain::new(&shape.write(&folder), &options()).unwrap())
    }

    /// Replays a path that was written and read again.
    fn replay(
        &self,
        path: &CameraPath,
        bench: BenchOptions,
        clock: ClockConstants,
    ) -> hlod::Result<Figures> {
        let file = std::path::Path::new("hard.csv");
        let mut text = Vec::new();
        format_path(path, &mut text).unwrap();
        let path = parse_path(&text[..], file, self.0.built.scene.up)?;
        let session = Session::open(&self.0.out())?;
        let (run, _) = session.run_model(&path, bench, clock, None, |_| true)?;
        let mut figures = Figures::default();
        figures.add_run(&run);
        Ok(figures)
    }

    /// With attributes that no build writes.
    fn with(mut self, edit: impl Fn(&mut Scene)) -> hlod::Result<Self> {
        edit(&mut self.0.built.scene);
        let bytes = self.0.built.scene.to_bytes()?;
        std::fs::write(self.0.out().join(SCENE_FILE), bytes).unwrap();
        Ok(self)
    }
}

/// All is loaded as soon as it is asked for, however short a frame.
fn clock() -> ClockConstants {
    ClockConstants { load_bytes_per_ms: 1e12, ..ClockConstants::default() }
}

/// A scene file with another benefit in a place of its first node's, and a checksum to match.
fn patched(benefit: f64) -> hlod::Result<Scene> {
    const MARK: f64 = 123_456.789;
    let hills = Hills::new(&Shape::hills()).with(|scene| scene.nodes[0].static_benefit = MARK)?;
    let path = hills.0.out().join(SCENE_FILE);
    let mut bytes = std::fs::read(&path).unwrap();
    let at = bytes.windows(8).position(|window| window == MARK.to_le_bytes()).unwrap();
    bytes[at..at + 8].copy_from_slice(&benefit.to_le_bytes());
    let end = bytes.len() - 4;
    let sum = hlod::format::file_crc(&bytes[..end]);
    bytes[end..].copy_from_slice(&sum.to_le_bytes());
    Scene::from_bytes(&bytes, &path)
}

#[test]
fn views_at_their_limits() {
    let mut table = Table::new("9-views", "Cameras and constants at their limits");
    let hills = Hills::new(&Shape::hills());
    // Until what loading brings about at the start has settled.
    let usual = BenchOptions { warm_up_frames: 900, ..bench_options() };
    let replay = |path: &CameraPath| hills.replay(path, usual.clone(), clock());
    let mut check = |name: &str,
                     case: hlod::Result<Figures>,
                     twin: &str,
                     of: hlod::Result<Figures>| match (case, of) {
        (Ok(case), Ok(of)) => table.same(name, &case, &Twin::one(twin, of)),
        (case, of) => table.verified(name, vec![format!("{case:?}, twin {of:?}")]),
    };
    let vertex = DVec3::new(20.0, 30.0, hill(20.0, 30.0));
    let beside = DVec3::new(1e-5, 2e-5, 1e-5);
    check(
        "camera at a vertex",
        replay(&still(vertex, 60.0)),
        "beside it",
        replay(&still(vertex + beside, 60.0)),
    );
    let node = &hills.0.built.scene.nodes[0];
    let [low, high] = [node.bbox_min, node.bbox_max].map(DVec3::from);
    let middle = (low + high) / 2.0;
    check(
        "camera in a node's corner",
        replay(&still(low, 60.0)),
        "beside it",
        replay(&still(low - beside, 60.0)),
    );
    let far = DVec3::new(6e6, 6e6, 6e6);
    check(
        "camera at 1e7 m",
        replay(&still(far, 60.0)),
        "at 9e6 m",
        replay(&still(far * 0.9, 60.0)),
    );
    let place = DVec3::new(-20.0, -10.0, 30.0);
    check(
        "angle of view of 1°",
        replay(&still(place, 1.0)),
        "of 1.001°",
        replay(&still(place, 1.001)),
    );
    check(
        "angle of view of 170°",
        replay(&still(place, 170.0)),
        "of 169.99°",
        replay(&still(place, 169.99)),
    );
    let creeping = moving(place, DVec3::X * 1e-9, 1.0 / 30.0, 60.0);
    check("velocity 0", replay(&still(place, 60.0)), "of 3e-8 m/s", replay(&creeping));
    let standing = moving(place, DVec3::ZERO, 0.0, 60.0);
    check("no time passes", replay(&standing), "standing still", replay(&still(place, 60.0)));
    let leaping = |seconds| moving(place, DVec3::X, seconds, 60.0);
    check("infinite velocity", replay(&leaping(1e-310)), "of 1e300 m/s", replay(&leaping(1e-300)));

    let within = |position, target_ms| {
        let mut bench = usual.clone();
        bench.target_ms = target_ms;
        hills.replay(&still(position, 60.0), bench, clock())
    };
    let target = |target_ms| within(place, target_ms);
    check("target of 0.01 ms", target(0.01), "of 0.02 ms", target(0.02));
    check("target of 10 s", target(1e4), "of 20 s", target(2e4));

    let bare = || Hills::new(&Shape::hills().without_texture());
    let with_cost = |textured_weight| {
        let clock = ClockConstants { textured_weight, ..clock() };
        bare().replay(&still(place, 60.0), thesis_options(0.45), clock)
    };
    check("costs of 0", with_cost(1.0), "of 1e-9 a triangle", with_cost(1.0 - 1e-9));
    let with_benefit = |benefit: f64| {
        let hills =
            bare().with(|scene| scene.nodes.iter_mut().for_each(|n| n.static_benefit = benefit))?;
        hills.replay(&still(place, 60.0), thesis_options(0.45), clock())
    };
    check("benefits of 1e-300", with_benefit(1e-300), "of 1", with_benefit(1.0));
    check("benefits of 1e100", with_benefit(1e100), "of 1", with_benefit(1.0));
    // Where no priority says more than another, siblings share alike.
    check("benefits of 0", with_benefit(0.0), "beyond all bounds (1e308)", with_benefit(1e308));
    let with_normal = |normal: [f32; 3], fore: f64| {
        let hills =
            bare().with(|scene| scene.nodes.iter_mut().for_each(|n| n.average_normal = normal))?;
        hills.replay(&still(place, 60.0), thesis_options(fore), clock())
    };
    check(
        "normals that cancel",
        with_normal([0.0; 3], 0.45),
        "foreshortening off",
        with_normal([0.0, 0.0, 1.0], 0.0),
    );

    // The middle is where four of its children meet: of the same 24 leaves, one more has the eye in its
    // box, and is taken to cover the whole image, .6 ms of 10. There is time for both: at 10 ms they fit
    // into one image and, by a hair, not into the other.
    let leaves = |position| within(position, 12.0).unwrap();
    let bounds: Bounds = &[("frame", 0.07), ("expected", 0.07)];
    table.within(
        "camera in the middle of a node",
        &leaves(middle),
        &Twin::one("beside it", leaves(middle + beside)),
        bounds,
        "one more box has the eye inside",
    );

    table.refused("benefits without end", patched(f64::INFINITY), "static benefit");
    table.refused("benefits of NaN", patched(f64::NAN), "static benefit");
    table.refused("target of 0 ms", target(0.0), "--target-ms");
    table.refused("target of NaN", target(f64::NAN), "--target-ms");
    table.refused("target without end", target(f64::INFINITY), "--target-ms");
    table.refused("angle of view of 0°", replay(&still(place, 0.0)), "fov_y_deg");
    table.refused("angle of view of 180°", replay(&still(place, 180.0)), "fov_y_deg");
    table.refused("camera at infinity", replay(&still(DVec3::INFINITY, 60.0)), "finite");
    table.finish();
}
