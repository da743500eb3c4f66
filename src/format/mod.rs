//! What stands in `out/`: the whole contract between the build side and the run side.
//!
//! ```text
//! out/scene.hlod      the hierarchy: Scene
//! out/nodes/*.glb     one file per node: NodeMesh
//! out/nodes/textures/* repeating textures that many nodes share
//! out/tileset.json    the same for viewers that read 3D Tiles
//! out/tilesets/*      regions of it, where the city is large
//! out/build.json      what the build did, for people and scripts
//! out/borders/         the borders of blocks, for the next build
//! out/scans.hlod       where triangles of inputs are, for the next build
//! out/cells.hlod      cells in which viewers are, where such were prepared: Cells
//! out/cells/*.glb     what is far from each of them, as pictures with depth
//! ```

pub mod attributes;
mod breadth_first;
mod bytes;
pub mod cells;
mod corner_normals;
mod encoding;
mod file_name;
mod glb_packed;
mod glb_read;
mod glb_schema;
#[cfg(test)]
mod glb_tests;
mod glb_write;
mod index_file;
mod node_id;
mod node_mesh;
mod output_dir;
#[cfg(test)]
mod output_dir_tests;
mod quantized;
mod regular_file;
mod scene;
mod scene_check;
mod scene_read;
#[cfg(test)]
mod scene_tests;
mod scene_write;
mod sink;
mod subset;
#[cfg(test)]
mod test_mesh;
#[cfg(test)]
pub(crate) mod test_scene;
mod viewer_error;

pub use encoding::Encoding;
pub use file_name::is_plain_file_name;
pub use glb_read::{read_glb, read_glb_without_normals};
pub use glb_write::{NodeLabel, write_glb, write_glb_encoded};
pub use node_id::NodeId;
pub use node_mesh::{NodeImage, NodeImageData, NodeMesh, Primitive, Surface};
pub(crate) use output_dir::resolve;
pub use output_dir::{OutputDir, Unfinished, check_apart};
pub use quantized::fits_in_steps;
pub(crate) use regular_file::{check_regular, open_regular, read_regular};
pub use scene::{BlockInfo, COPYRIGHT, Children, Node, Scene, SharedTexture};
pub use scene_check::{Element, SceneDefect};
pub use subset::Subset;

/// The 3D Tiles tileset that a viewer opens, inside an output folder.
pub const TILESET_FILE: &str = "tileset.json";
/// The folder of tilesets of regions inside an output folder.
pub const TILESETS_DIR: &str = "tilesets";
/// The folder of results of subsets inside an output folder, until they are merged.
pub const SUBSETS_DIR: &str = "subsets";
/// The folder of blocks' borders inside an output folder, which the next build needs and no viewer.
pub const BORDERS_DIR: &str = "borders";
/// File of the inputs' histograms inside an output folder, for the next build.
pub const SCANS_FILE: &str = "scans.hlod";
/// The scene description inside an output folder.
pub const SCENE_FILE: &str = "scene.hlod";
/// The folder of node files inside an output folder.
pub const NODES_DIR: &str = "nodes";
/// The folder of shared textures inside an output folder. It lies below [`NODES_DIR`], so that node
/// files refer to it without `..`, which some readers refuse.
pub const TEXTURES_DIR: &str = "nodes/textures";
/// [`TEXTURES_DIR`] as node files refer to it: relative to [`NODES_DIR`].
const TEXTURES_URI: &str = "textures";
/// The report of the build inside an output folder.
pub const REPORT_FILE: &str = "build.json";

/// The first bytes of every scene file, whatever its version. The last one stops programs that
/// take it for text.
pub const SCENE_MAGIC: [u8; 8] = *b"HLODSCN\x1a";
/// The version of the scene file that this crate writes, and the only one that it reads.
pub const SCENE_VERSION: u32 = 4;

/// CRC-32 (ISO-HDLC, as in zip and PNG) of a node's file, as [`Node::file_crc`] keeps it.
pub fn file_crc(bytes: &[u8]) -> u32 {
    crc32fast::hash(bytes)
}
