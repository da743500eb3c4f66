//! A built scene that is open for runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock};

use super::{
    BenchOptions, BrokenFiles, ClockConstants, Context, FrameInspector, FrameRecord, ModelBackend,
    ModelFiles, Replay, Run, Size, run, unseen_scene,
};
use crate::camera::CameraPath;
use crate::engine::{CostModel, FarFieldMode, NodeOcclusion, Occluders, Policy};
use crate::format::Scene;
use crate::format::cells::{CELLS_FILE, Cells};
use crate::loading::NodeFiles;
use crate::render::content::{TextureFormat, held_bytes, picture_bytes};
use crate::runtime::SceneTree;
use crate::runtime::residency::{Residency, Sizes};
use crate::{Error, Result};

/// Triangles of the surfaces that tell what hides what, at most: some 6 MB,
const OCCLUDER_TRIANGLES: u64 = 200_000;

/// or this part of the memory cap, where each takes so many bytes with its vertices.
const OCCLUDER_PART: u64 = 8;
const OCCLUDER_BYTES: u64 = 32;

/// Triangles that are drawn at the start of a run to learn what things take, unless the roots have more.
#[cfg(feature = "render")]
const TIMED_TRIANGLES: u64 = 200_000;

/// How many triangles they may have in a run.
fn occluder_triangles(options: &BenchOptions) -> u64 {
    let cap = options.residency.max_memory_bytes;
    (cap / OCCLUDER_PART / OCCLUDER_BYTES).min(OCCLUDER_TRIANGLES)
}

/// A built scene that is open for runs.
#[derive(Clone, Debug)]
pub struct Session {
    dir: PathBuf,
    scene: Arc<Scene>,
    tree: SceneTree,
    /// By how many triangles they may have, read where a policy first asks for them.
    occluders: Arc<Mutex<BTreeMap<u64, Arc<Occluders>>>>,
    /// For runs in which nothing is drawn.
    model_files: Arc<ModelFiles>,
    /// Result of checking all files when the run began.
    broken: Arc<OnceLock<BrokenFiles>>,
    cells: Option<Arc<Cells>>,
}

impl Session {
    /// Opens what `hlod-build` wrote into `dir`.
    pub fn open(dir: &Path) -> Result<Self> {
        let scene = Arc::new(Scene::read(dir)?.breadth_first());
        let tree = SceneTree::new(&scene);
        let model_files = Arc::new(ModelFiles::new(NodeFiles::new(dir, Arc::clone(&scene))));
        let (dir, occluders, broken) = (dir.to_owned(), Arc::default(), Arc::default());
        Ok(Self { dir, scene, tree, occluders, model_files, broken, cells: None })
    }

    /// Whether cells were made of it, or of an earlier build.
    pub fn has_cells(&self) -> bool {
        self.dir.join(CELLS_FILE).exists()
    }

    /// Reads the cells that `hlod-build cells` made of it; fails where there are none, or those of another
    /// build.
    pub fn read_cells(&mut self) -> Result<()> {
        let Some(cells) = Cells::read(&self.dir)? else {
            let what = "there are no cells; make some with `hlod-build cells`";
            return Err(Error::input(self.dir.join(CELLS_FILE), what));
        };
        cells.check_scene(&self.scene, &self.dir)?;
        self.cells = Some(Arc::new(cells));
        // These have files too.
        self.model_files = Arc::new(ModelFiles::new(self.files()));
        self.broken = Arc::default();
        Ok(())
    }

    /// Its cells, where they were read.
    pub fn cells(&self) -> Option<&Arc<Cells>> {
        self.cells.as_ref()
    }

    /// The output folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// The hierarchy as selection sees it.
    pub fn tree(&self) -> &SceneTree {
        &self.tree
    }

    /// Refuses a path, read from `file`, no frame of which shows the scene in an image of a size.
    pub fn check_path(&self, path: &CameraPath, file: &Path, size: Size) -> Result<()> {
        if unseen_scene::is_ever_in_view(&self.tree, path, size.0) {
            return Ok(());
        }
        let positions = self.positions(path, 0);
        Err(Error::input(file, format!("no frame shows the scene: {positions}")))
    }

    /// Says where scene and camera are, if more than half of a run does not show the scene.
    pub fn unseen_warning(&self, path: &CameraPath, run: &Run) -> Option<String> {
        let is_unseen = |frame: &FrameRecord| frame.report.without_scene;
        let unseen = run.frames.iter().filter(|frame| is_unseen(frame)).count();
        let first = run.frames.iter().position(is_unseen)?;
        (2 * unseen > run.frames.len()).then(|| {
            let positions = self.positions(path, first);
            format!("{unseen} of {} frames do not show the scene: {positions}", run.frames.len())
        })
    }

    fn positions(&self, path: &CameraPath, index: usize) -> String {
        let at = &path.frames[index];
        unseen_scene::positions(self.tree.bounds(), at.frame, at.pose.position)
    }

    /// The files of the scene, and of its cells where they were read.
    pub fn files(&self) -> NodeFiles {
        let files = NodeFiles::new(&self.dir, Arc::clone(&self.scene));
        match &self.cells {
            Some(cells) => files.with_faces(cells),
            None => files,
        }
    }

    /// Files that are missing, of another size or without their header; all are looked at once.
    fn broken(&self) -> BrokenFiles {
        let look = || {
            let mut broken = BrokenFiles::default();
            self.files().unusable().iter().for_each(|error| broken.add(error));
            broken
        };
        self.broken.get_or_init(look).clone()
    }

    /// The hierarchy with the costs of a machine.
    fn tree_for(&self, constants: &ClockConstants) -> SceneTree {
        self.tree.clone().with_textured_weight(&self.scene, constants.textured_weight)
    }

    /// The format of textures that suits this scene under a cap: `preferred` where it would not all fit as
    /// decoded, and otherwise RGBA8, which loses nothing.
    pub fn suitable_textures(
        &self,
        max_memory_bytes: u64,
        preferred: TextureFormat,
    ) -> TextureFormat {
        let sizes = self.sizes(TextureFormat::Rgba8);
        let nodes = sizes.nodes.iter().map(|node| node.held_bytes);
        let all: u64 = nodes.chain(sizes.textures.iter().map(|texture| texture.held_bytes)).sum();
        if all > max_memory_bytes { preferred } else { TextureFormat::Rgba8 }
    }

    /// What nodes take in memory with their textures in a format.
    pub fn sizes(&self, format: TextureFormat) -> Sizes {
        Sizes::new(
            &self.scene,
            |vertices, triangles, own| held_bytes(vertices, triangles, own, format),
            |size| picture_bytes(size, format),
        )
    }

    fn residency(
        &self,
        options: &BenchOptions,
        policy: &dyn Policy,
        cells: Option<&Cells>,
    ) -> Result<Arc<Mutex<Residency>>> {
        // Held for as long as the roots are.
        let mut beside_roots: BTreeMap<u32, u64> = BTreeMap::new();
        if policy.wants_seen_areas() {
            for node in self.occluding_nodes(occluder_triangles(options)) {
                let at = self.tree.node(node);
                *beside_roots.entry(self.tree.root_of(node)).or_default() +=
                    Occluders::most_bytes(at.vertices, at.triangles);
            }
        }
        let occlusion = |node: u32| {
            let at = self.tree.node(node);
            let hides =
                if options.cull_hidden { NodeOcclusion::most_bytes(at.triangles) } else { 0 };
            hides + beside_roots.get(&node).copied().unwrap_or(0)
        };
        let mut sizes = self.sizes(options.textures).with_beside(occlusion);
        if let Some(cells) = cells {
            sizes = sizes.with_faces(&cells.faces, |vertices, triangles, own| {
                held_bytes(vertices, triangles, own, options.textures)
            });
        }
        Ok(Arc::new(Mutex::new(Residency::new(&self.tree, sizes, options.residency)?)))
    }

    /// Its cells, where what is far is drawn from them.
    fn cells_for(&self, options: &BenchOptions) -> Result<Option<Arc<Cells>>> {
        match (options.far_field, &self.cells) {
            (FarFieldMode::Off, _) => Ok(None),
            (_, Some(cells)) => Ok(Some(Arc::clone(cells))),
            (_, None) => Err(Error::Internal("cells are wanted and were not read".into())),
        }
    }

    /// Nodes whose surfaces tell what is seen: a coarse front of so many triangles, and all above it.
    fn occluding_nodes(&self, triangles: u64) -> BTreeSet<u32> {
        let front = self.scene.coarse_front(triangles);
        let above = |&node: &u32| self.tree.node(node).parent;
        front.into_iter().flat_map(|node| std::iter::successors(Some(node), above)).collect()
    }

    /// Coarse surfaces, for policies that ask what hides what. A file that cannot be used hides nothing;
    /// the run tells of it.
    fn occluders(
        &self,
        options: &BenchOptions,
        policy: &dyn Policy,
    ) -> Result<Option<Arc<Occluders>>> {
        if !policy.wants_seen_areas() {
            return Ok(None);
        }
        let triangles = occluder_triangles(options);
        let read = || {
            let mut occluders = Occluders::default();
            for node in self.occluding_nodes(triangles) {
                if let Ok(mesh) = self.files().read_mesh(node) {
                    occluders.add(node, self.tree.node(node).bbox, &mesh);
                }
            }
            Arc::new(occluders)
        };
        let mut known = self
            .occluders
            .lock()
            .map_err(|_| Error::Internal("a thread that read surfaces died".into()))?;
        Ok(Some(Arc::clone(known.entry(triangles).or_insert_with(read))))
    }

    fn context(&self, options: BenchOptions, path: &CameraPath, policy: &dyn Policy) -> Context {
        Context {
            scene_name: self.dir.display().to_string(),
            path_name: String::new(), // a path does not know where it is from
            options,
            policy: policy.name(),
            diagnostics: policy.diagnostics(),
            clock: "model",
            constants: ClockConstants::default(),
            scene_fingerprint: hexadecimal(&self.scene.fingerprint),
            path_fingerprint: path_fingerprint(path),
            adapter: None,
            broken: Vec::new(),
            reference: None,
            levels: self.scene.level_count(),
        }
    }

    /// Replays a path by the model clock: nothing is drawn unless an `inspector` does so, and every
    /// machine gives the same.
    pub fn run_model(
        &self,
        path: &CameraPath,
        options: BenchOptions,
        constants: ClockConstants,
        inspector: Option<&mut dyn FrameInspector>,
        progress: impl FnMut(&FrameRecord) -> bool,
    ) -> Result<(Run, Context)> {
        options.check()?;
        let cells = self.cells_for(&options)?;
        let mut policy = options.policy.make()?;
        let tree = self.tree_for(&constants);
        let mut context = Context { constants, ..self.context(options.clone(), path, &*policy) };
        let occluders = self.occluders(&options, &*policy)?;
        let mut backend = ModelBackend::new(&tree, constants, options.seed)
            .with_files(Arc::clone(&self.model_files), options.cull_hidden)
            .with_broken(self.broken())
            .with_cells(cells.clone());
        let residency = self.residency(&options, &*policy, cells.as_deref())?;
        let replay = Replay {
            tree: &tree,
            path,
            policy: &mut *policy,
            residency,
            backend: &mut backend,
            costs: CostModel::new(&constants.prices),
            occluders,
            cells: cells.clone(),
            inspector: match inspector {
                Some(inspector) => Some(inspector), // for as long as this run
                None => None,
            },
            options,
        };
        let run = run(replay, progress)?;
        context.broken = backend.broken().messages().to_vec();
        Ok((run, context))
    }

    /// Replays a path on a graphics adapter, by the clock on the wall. Where `constants` are
    /// given, their prices are what is expected of time at first; otherwise coarse nodes are timed
    /// from places on the path.
    #[cfg(feature = "render")]
    pub fn run_wall(
        &self,
        path: &CameraPath,
        options: BenchOptions,
        constants: Option<ClockConstants>,
        renderer: &mut crate::render::Renderer,
        snapshots: Option<super::Snapshots>,
        inspector: Option<&mut dyn FrameInspector>,
        progress: impl FnMut(&FrameRecord) -> bool,
    ) -> Result<(Run, Context)> {
        options.check()?;
        let cells = self.cells_for(&options)?;
        renderer.check_textures(options.textures)?;
        // Roots that do not fit are told of before anything is loaded.
        let mut policy = options.policy.make()?;
        let residency = self.residency(&options, &*policy, cells.as_deref())?;
        let files = self.files().with_textures(options.textures);
        let weight = constants.unwrap_or_default();
        let tree = self.tree_for(&weight);
        let constants = match constants {
            Some(constants) => constants,
            None => ClockConstants {
                prices: super::measure_start(
                    renderer,
                    &tree,
                    files.clone(),
                    &self.scene.coarse_front(TIMED_TRIANGLES),
                    path,
                )?,
                ..ClockConstants::default()
            },
        };
        let adapter = serde_json::to_value(renderer.adapter()).map_err(|error| {
            crate::Error::Internal(format!("an adapter without JSON form: {error}"))
        })?;
        let mut context = Context {
            constants,
            clock: "wall",
            adapter: Some(adapter),
            ..self.context(options.clone(), path, &*policy)
        };
        let occluders = self.occluders(&options, &*policy)?;
        let mut backend = super::GpuBackend::new(
            &tree,
            if options.cull_hidden { files.with_occlusion() } else { files },
            renderer,
            Arc::clone(&residency),
            snapshots,
        )
        .with_broken(self.broken());
        let replay = Replay {
            tree: &tree,
            path,
            policy: &mut *policy,
            residency,
            backend: &mut backend,
            costs: CostModel::new(&constants.prices),
            occluders,
            cells: cells.clone(),
            inspector: match inspector {
                Some(inspector) => Some(inspector), // for as long as this run
                None => None,
            },
            options,
        };
        let run = run(replay, progress)?;
        context.broken = backend.broken().messages().to_vec();
        Ok((run, context))
    }

    /// Measures the constants of the model clock over this scene, from places on a path.
    #[cfg(feature = "render")]
    pub fn calibrate(
        &self,
        path: &CameraPath,
        renderer: &mut crate::render::Renderer,
    ) -> Result<super::Calibration> {
        super::calibrate(renderer, &self.tree_for(&ClockConstants::default()), self.files(), path)
    }
}

/// BLAKE3 over times and poses, so that equal paths are known as such whatever their files.
fn path_fingerprint(path: &CameraPath) -> String {
    let mut hasher = blake3::Hasher::new();
    for frame in &path.frames {
        let pose = &frame.pose;
        let numbers = [frame.time_s, pose.fov_y_deg]
            .into_iter()
            .chain(pose.position.to_array())
            .chain(pose.rotation.to_array());
        numbers.for_each(|number| {
            hasher.update(&number.to_le_bytes());
        });
    }
    hexadecimal(hasher.finalize().as_bytes())
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_that_hide_take_no_more_than_a_part_of_the_memory() {
        let triangles = |bytes: u64| {
            let mut options = BenchOptions::default();
            options.residency.max_memory_bytes = bytes;
            occluder_triangles(&options)
        };
        assert_eq!(triangles(BenchOptions::default().residency.max_memory_bytes), 200_000);
        assert_eq!(triangles(6_400_000), 25_000);
        assert_eq!(triangles(0), 0);
    }
}
