//! The source of a district, as the files below it show it.

use std::path::Path;
use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::builder::constants::MeasureConstants;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::error::{Detail, Original, SurfaceError};
use crate::builder::hierarchy::Tree;
use crate::format::{NODES_DIR, NodeMesh, read_glb_without_normals};
use crate::mesh::{Mesh, all_differ, key};
use crate::{Error, Result};

/// Where files are, and what coordinates they are brought to.
pub struct Files<'a> {
    /// The output folder.
    pub out: &'a Path,
    /// In source coordinates.
    pub origin: [f64; 3],
    /// How distances are measured.
    pub constants: MeasureConstants,
}

/// A node's file.
pub struct FileDetail<'a> {
    files: &'a Files<'a>,
    tree: &'a Tree<NodeRecord>,
    surface: Arc<Original>,
}

impl<'a> FileDetail<'a> {
    /// Reads the file of the root of a tree.
    pub fn read(files: &'a Files<'a>, tree: &'a Tree<NodeRecord>) -> Result<Self> {
        let path = files.out.join(NODES_DIR).join(&tree.record.file);
        let bytes = crate::format::read_regular(&path)
            .map_err(|error| Error::output(&path, format!("cannot be read again: {error}")))?;
        let mesh = surface(&read_glb_without_normals(&bytes, &path)?, files.origin);
        Ok(Self { files, tree, surface: Arc::new(Original::of(&mesh, files.constants)) })
    }
}

impl Detail for FileDetail<'_> {
    fn surface(&self) -> Arc<Original> {
        Arc::clone(&self.surface)
    }

    fn off(&self) -> SurfaceError {
        let &NodeRecord { geometric_error, mean_error, p95_error, .. } = &self.tree.record;
        SurfaceError { bound: geometric_error, mean: mean_error, rms: mean_error, p95: p95_error }
    }

    fn finer(&self) -> Result<Vec<Self>> {
        self.tree.children.iter().map(|child| Self::read(self.files, child)).collect()
    }
}

/// The triangles of a node without its skirts, welded by position.
fn surface(node: &NodeMesh, origin: [f64; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    let mut numbers: FxHashMap<_, u32> = FxHashMap::default();
    for primitive in &node.primitives {
        let vertices: Vec<u32> = primitive
            .positions
            .iter()
            .map(|position| {
                let at: [f32; 3] = std::array::from_fn(|axis| {
                    (node.origin[axis] - origin[axis] + f64::from(position[axis])) as f32 + 0.0
                });
                *numbers.entry(key(at)).or_insert_with(|| {
                    mesh.positions.push(at);
                    mesh.materials.push(0);
                    mesh.positions.len() as u32 - 1
                })
            })
            .collect();
        let surface = primitive.indices.len() - 3 * primitive.skirt_triangles;
        let triangles = primitive.indices[..surface].as_chunks::<3>().0.iter();
        let triangles = triangles.map(|corners| corners.map(|corner| vertices[corner as usize]));
        mesh.triangles.extend(triangles.filter(|&corners| all_differ(corners)));
    }
    mesh
}
