//! Reads `scene.hlod`: nothing in it is trusted. The layout stands in `scene_write.rs`.

use std::path::Path;

use super::SCENE_FILE;
use super::bytes::{Cursor, CutShort};
use super::index_file::NotWhole;
use super::node_id::NodeId;
use super::scene::{BlockInfo, Node, Scene, SharedTexture};
use super::scene_check::SceneDefect;
use super::scene_write::{FLAG_TEXTURED, FLAG_Z_UP, SCENE};
use super::sink::NONE;
use crate::mesh::UpAxis;
use crate::{Error, Result};

/// Bytes of a node with an empty file name and no shared textures.
const NODE_SIZE: usize = 188;

/// Why bytes are not a scene.
#[derive(Debug, thiserror::Error)]
enum Unreadable {
    #[error(transparent)]
    NotWhole(#[from] NotWhole),
    #[error("truncated: {0}")]
    CutShort(#[from] CutShort),
    #[error("flags: expected only bits of {known:#x}, found {0:#x}", known = FLAG_TEXTURED | FLAG_Z_UP)]
    Flags(u32),
    #[error("{what} at byte {at}: expected UTF-8, found byte {found:#04x}")]
    Text { what: &'static str, at: usize, found: u8 },
    #[error("parameters: expected JSON: {0}")]
    Parameters(serde_json::Error),
    #[error("expected the checksum after the last node, found {0} bytes more")]
    Trailing(usize),
    #[error("{what}: expected {expected}, as its nodes say, found {found}")]
    Fact { what: &'static str, expected: String, found: String },
    #[error("{}", list(.0))]
    Unsound(Vec<SceneDefect>),
}

fn list(defects: &[SceneDefect]) -> String {
    let lines: Vec<String> = defects.iter().map(ToString::to_string).collect();
    match lines.as_slice() {
        [one] => one.clone(),
        many => format!("{} defects:\n  {}", many.len(), many.join("\n  ")),
    }
}

impl Scene {
    /// Reads the scene of an output folder.
    pub fn read(dir: &Path) -> Result<Self> {
        let path = dir.join(SCENE_FILE);
        match crate::format::read_regular(&path) {
            Ok(bytes) => Self::from_bytes(&bytes, &path),
            Err(error) => Err(Error::input(path, format!("cannot read the scene: {error}"))),
        }
    }

    /// Reads a scene from the bytes of its file; `path` is for messages only.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        parse(bytes).map_err(|why| Error::input(path, why.to_string()))
    }
}

fn parse(bytes: &[u8]) -> Result<Scene, Unreadable> {
    let (flags, mut cursor) = SCENE.open(bytes)?;
    if flags & !(FLAG_TEXTURED | FLAG_Z_UP) != 0 {
        return Err(Unreadable::Flags(flags));
    }
    contents(&mut cursor, flags)
}

fn contents(cursor: &mut Cursor<'_>, flags: u32) -> Result<Scene, Unreadable> {
    let fingerprint = cursor.array("fingerprint")?;
    let bounds = [cursor.f64x3("bounding box")?, cursor.f64x3("bounding box")?];
    let roots = cursor.u32("number of roots")?;
    let length = cursor.count(1, "parameters")?;
    let parameters = serde_json::from_slice(cursor.take(length as u64, "parameters")?)
        .map_err(Unreadable::Parameters)?;
    let count = cursor.count(20, "number of shared textures")?;
    let shared_textures = (0..count).map(|_| shared_texture(cursor)).collect::<Result<_, _>>()?;
    let count = cursor.count(32, "number of blocks")?;
    let blocks = (0..count).map(|_| block(cursor)).collect::<Result<_, _>>()?;
    let count = cursor.count(NODE_SIZE, "number of nodes")?;
    let nodes = (0..count).map(|_| node(cursor)).collect::<Result<_, _>>()?;
    if cursor.left() > 0 {
        return Err(Unreadable::Trailing(cursor.left()));
    }
    let up = if flags & FLAG_Z_UP == 0 { UpAxis::Y } else { UpAxis::Z };
    let scene = Scene { parameters, fingerprint, up, blocks, shared_textures, nodes };
    let defects = scene.check();
    if !defects.is_empty() {
        return Err(Unreadable::Unsound(defects));
    }
    facts(&scene, bounds, roots, flags & FLAG_TEXTURED != 0)?;
    Ok(scene)
}

/// What the header says of the whole agrees with the nodes.
fn facts(
    scene: &Scene,
    bounds: [[f64; 3]; 2],
    roots: u32,
    textured: bool,
) -> Result<(), Unreadable> {
    fn same<T: PartialEq + std::fmt::Debug>(
        what: &'static str,
        expected: T,
        found: T,
    ) -> Result<(), Unreadable> {
        if expected == found {
            return Ok(());
        }
        let (expected, found) = (format!("{expected:?}"), format!("{found:?}"));
        Err(Unreadable::Fact { what, expected, found })
    }
    same("bounding box", scene.bounds(), Some(bounds))?;
    same("number of roots", scene.roots().count(), roots as usize)?;
    same("textured", scene.is_textured(), textured)
}

fn text(cursor: &mut Cursor<'_>, what: &'static str) -> Result<String, Unreadable> {
    let length = cursor.count(1, what)?;
    let at = cursor.at();
    let bytes = cursor.take(length as u64, what)?;
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|error| {
        let offset = error.valid_up_to();
        Unreadable::Text { what, at: at + offset, found: bytes.get(offset).copied().unwrap_or(0) }
    })
}

fn index(cursor: &mut Cursor<'_>, what: &'static str) -> Result<Option<u32>, CutShort> {
    cursor.u32(what).map(|index| (index != NONE).then_some(index))
}

fn shared_texture(cursor: &mut Cursor<'_>) -> Result<SharedTexture, Unreadable> {
    Ok(SharedTexture {
        file_name: text(cursor, "file name of a shared texture")?,
        width: cursor.u32("width of a shared texture")?,
        height: cursor.u32("height of a shared texture")?,
        bytes: cursor.u64("size of a shared texture")?,
    })
}

fn block(cursor: &mut Cursor<'_>) -> Result<BlockInfo, Unreadable> {
    Ok(BlockInfo {
        name: text(cursor, "name of a block")?,
        input: text(cursor, "input of a block")?,
        origin: cursor.f64x3("origin of a block")?,
    })
}

fn node(cursor: &mut Cursor<'_>) -> Result<Node, Unreadable> {
    Ok(Node {
        id: NodeId(cursor.u64("id of a node")?),
        parent: index(cursor, "parent of a node")?,
        first_child: index(cursor, "first child of a node")?,
        next_sibling: index(cursor, "next sibling of a node")?,
        level: cursor.u32("level of a node")?,
        block: index(cursor, "block of a node")?,
        triangles: cursor.u32("triangles of a node")?,
        textured_triangles: cursor.u32("textured triangles of a node")?,
        vertices: cursor.u32("vertices of a node")?,
        bbox_min: cursor.f64x3("bounding box of a node")?,
        bbox_max: cursor.f64x3("bounding box of a node")?,
        cost: cursor.f64("cost of a node")?,
        static_benefit: cursor.f64("static benefit of a node")?,
        geometric_error: cursor.f64("geometric error of a node")?,
        mean_error: cursor.f64("mean error of a node")?,
        p95_error: cursor.f64("95th percentile of the error of a node")?,
        average_normal: [
            cursor.f32("average normal of a node")?,
            cursor.f32("average normal of a node")?,
            cursor.f32("average normal of a node")?,
        ],
        texels: cursor.u64("texels of a node")?,
        shared_texels: cursor.u64("shared texels of a node")?,
        origin: cursor.f64x3("origin of a node")?,
        file: text(cursor, "file name of a node")?,
        file_bytes: cursor.u64("file size of a node")?,
        file_crc: cursor.u32("file checksum of a node")?,
        shared_textures: {
            let count = cursor.count(4, "number of shared textures of a node")?;
            (0..count).map(|_| cursor.u32("shared texture of a node")).collect::<Result<_, _>>()?
        },
        pictures: {
            let count = cursor.count(8, "number of pictures of a node")?;
            let mut side = || cursor.u32("size of a picture of a node");
            (0..count).map(|_| Ok([side()?, side()?])).collect::<Result<_, CutShort>>()?
        },
    })
}
