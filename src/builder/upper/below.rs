//! Reads the surfaces that an upper node is measured against from the files of nodes below it.

use std::path::Path;
use std::sync::Arc;

use crate::builder::constants::MeasureConstants;
use crate::builder::emit::disk_sink::NodeRecord;
use crate::builder::error::{
    Below, BoundedNode, SearchableSurface, Surface, SurfaceError, measured_against,
};
use crate::builder::hierarchy::Tree;
use crate::format::{NODES_DIR, NodeMesh, read_glb_without_normals};
use crate::mesh::{Mesh, all_differ};
use crate::{Error, Result};

/// Reads node files into common coordinates.
pub struct Files<'a> {
    /// The output folder.
    pub out: &'a Path,
    /// Origin of the common coordinates, in source coordinates.
    pub origin: [f64; 3],
    /// Constants of measuring.
    pub constants: MeasureConstants,
}

impl BoundedNode for Tree<NodeRecord> {
    fn bound(&self) -> f64 {
        self.record.geometric_error
    }

    fn triangles(&self) -> usize {
        self.record.attributes.triangles as usize
    }

    fn children(&self) -> &[Self] {
        &self.children
    }
}

impl Files<'_> {
    /// Returns the surfaces below the parent of these members.
    pub fn below(&self, members: &[Tree<NodeRecord>]) -> Result<Below> {
        let mut surfaces = Vec::new();
        let (mut area, mut mean, mut p95) = (0.0, 0.0, 0.0);
        for Tree { record, .. } in measured_against(members) {
            let surface = self.read(record)?;
            // Distances are sampled by area, so means are weighted by area.
            let of_node = surface.area();
            area += of_node;
            mean += record.mean_error * of_node;
            p95 += record.p95_error * of_node;
            surfaces.push(Arc::new(surface.with_surface_offset(record.geometric_error)));
        }
        let [mean, p95] = [mean, p95].map(|sum| if area > 0.0 { sum / area } else { 0.0 });
        let off = SurfaceError { bound: 0.0, mean, rms: mean, p95 };
        let source = Arc::new(SearchableSurface::union(&surfaces));
        let bound = members.iter().map(BoundedNode::bound).fold(0.0, f64::max);
        let nodes = vec![Surface::new(Arc::clone(&source), bound)];
        Ok(Below { source, off, nodes })
    }

    fn read(&self, record: &NodeRecord) -> Result<SearchableSurface> {
        let path = self.out.join(NODES_DIR).join(&record.file);
        let bytes = crate::format::read_regular(&path)
            .map_err(|error| Error::output(&path, format!("cannot be read again: {error}")))?;
        let mesh = surface(&read_glb_without_normals(&bytes, &path)?, self.origin);
        Ok(SearchableSurface::of(&mesh, self.constants))
    }
}

/// The triangles of a node without its skirts.
fn surface(node: &NodeMesh, origin: [f64; 3]) -> Mesh {
    let mut mesh = Mesh::default();
    for primitive in &node.primitives {
        let first = mesh.positions.len() as u32;
        let at = |position: &[f32; 3]| {
            std::array::from_fn(|axis| {
                (node.origin[axis] - origin[axis] + f64::from(position[axis])) as f32 + 0.0
            })
        };
        mesh.positions.extend(primitive.positions.iter().map(at));
        let surface = primitive.indices.len() - 3 * primitive.skirt_triangles;
        let triangles = primitive.indices[..surface].as_chunks::<3>().0.iter();
        let triangles = triangles.map(|corners| corners.map(|corner| first + corner));
        let positions = &mesh.positions;
        mesh.triangles.extend(triangles.filter(|t| all_differ(t.map(|v| positions[v as usize]))));
    }
    mesh
}
