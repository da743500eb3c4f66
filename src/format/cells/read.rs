//! Reads `cells.hlod`: nothing in it is trusted. The layout stands in `write.rs`.

use std::path::Path;

use super::super::bytes::{Cursor, CutShort};
use super::super::index_file::NotWhole;
use super::super::{Scene, is_plain_file_name};
use super::write::CELLS;
use super::{CELLS_FILE, Cell, Cells, Face, FaceView};
use crate::{Error, Result};

/// Bytes of a cell without faces.
const CELL_SIZE: usize = 76;
/// Bytes of a face with an empty file name and no views.
const FACE_SIZE: usize = 84;
/// Bytes of a view.
const VIEW_SIZE: usize = 28;

/// Why bytes are not an index of cells.
#[derive(Debug, thiserror::Error)]
enum Unreadable {
    #[error(transparent)]
    NotWhole(#[from] NotWhole),
    #[error("truncated: {0}")]
    CutShort(#[from] CutShort),
    #[error("parameters: expected JSON: {0}")]
    Parameters(serde_json::Error),
    #[error("expected the checksum after the last cell, found {0} bytes more")]
    Trailing(usize),
    #[error("{what}: expected a length above 0, found {found}")]
    Length { what: &'static str, found: f64 },
    #[error("cell {cell}: {what}")]
    Unsound { cell: usize, what: String },
}

impl Cells {
    /// Reads the cells of an output folder; none where it has no index of them.
    pub fn read(dir: &Path) -> Result<Option<Self>> {
        let path = dir.join(CELLS_FILE);
        match crate::format::read_regular(&path) {
            Ok(bytes) => Self::from_bytes(&bytes, &path).map(Some),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(Error::input(path, format!("cannot read the cells: {error}"))),
        }
    }

    /// Reads cells from the bytes of their file; `path` is for messages only.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        contents(bytes).map_err(|why| Error::input(path, why.to_string()))
    }

    /// Refuses cells of another build than this scene.
    pub fn check_scene(&self, scene: &Scene, path: &Path) -> Result<()> {
        if self.scene == scene.fingerprint {
            return Ok(());
        }
        let short = |fingerprint: &[u8; 32]| {
            fingerprint[..4].iter().map(|byte| format!("{byte:02x}")).collect::<String>()
        };
        Err(Error::input(
            path.join(CELLS_FILE),
            format!(
                "expected cells of this build ({}), found those of another ({}); prepare them again",
                short(&scene.fingerprint),
                short(&self.scene)
            ),
        ))
    }
}

fn contents(bytes: &[u8]) -> Result<Cells, Unreadable> {
    let (_, mut cursor) = CELLS.open(bytes)?;
    let cursor = &mut cursor;
    let scene = cursor.array("fingerprint")?;
    let length = cursor.count(1, "parameters")?;
    let parameters = serde_json::from_slice(cursor.take(length as u64, "parameters")?)
        .map_err(Unreadable::Parameters)?;
    let [size, texel] = [a_length(cursor, "size of cells")?, a_length(cursor, "texel of a face")?];
    let count = cursor.count(CELL_SIZE, "number of cells")?;
    let mut cells: Vec<Cell> = Vec::with_capacity(count);
    let mut faces = Vec::new();
    for number in 0..count {
        let cell = cell(cursor, number, &mut faces)?;
        if cells.last().is_some_and(|last| last.place >= cell.place) {
            let what = format!("place {:?}: expected the order of places", cell.place);
            return Err(Unreadable::Unsound { cell: number, what });
        }
        cells.push(cell);
    }
    match cursor.left() {
        0 => Ok(Cells { scene, parameters, size, texel, cells, faces }),
        left => Err(Unreadable::Trailing(left)),
    }
}

fn a_length(cursor: &mut Cursor<'_>, what: &'static str) -> Result<f64, Unreadable> {
    let found = cursor.f64(what)?;
    match found > 0.0 && found.is_finite() {
        true => Ok(found),
        false => Err(Unreadable::Length { what, found }),
    }
}

fn cell(cursor: &mut Cursor<'_>, number: usize, faces: &mut Vec<Face>) -> Result<Cell, Unreadable> {
    let unsound = |what: String| Unreadable::Unsound { cell: number, what };
    let mut place = [0; 3];
    for at in &mut place {
        *at = cursor.u64("place")? as i64;
    }
    let cull_box = bounds(cursor, "cull box").map_err(|cut| cut.or_else(unsound))?;
    let count = cursor.count(FACE_SIZE, "number of faces")?;
    let first = faces.len() as u32;
    for _ in 0..count {
        faces.push(face(cursor).map_err(|cut| cut.or_else(unsound))?);
    }
    Ok(Cell { place, cull_box, faces: first..faces.len() as u32 })
}

/// Bytes are missing, or say what cannot be.
enum Fault {
    CutShort(CutShort),
    Unsound(String),
}

impl Fault {
    fn or_else(self, unsound: impl Fn(String) -> Unreadable) -> Unreadable {
        match self {
            Self::CutShort(cut) => Unreadable::CutShort(cut),
            Self::Unsound(what) => unsound(what),
        }
    }
}

impl From<CutShort> for Fault {
    fn from(cut: CutShort) -> Self {
        Self::CutShort(cut)
    }
}

fn bounds(cursor: &mut Cursor<'_>, what: &'static str) -> Result<[[f64; 3]; 2], Fault> {
    let bounds = [cursor.f64x3(what)?, cursor.f64x3(what)?];
    let is_box = (0..3).all(|axis| bounds[0][axis] <= bounds[1][axis]);
    match is_box && bounds.as_flattened().iter().all(|at| at.is_finite()) {
        true => Ok(bounds),
        false => Err(Fault::Unsound(format!("{what}: expected a box, found {bounds:?}"))),
    }
}

fn face(cursor: &mut Cursor<'_>) -> Result<Face, Fault> {
    let unsound = |what: String| Err(Fault::Unsound(what));
    let length = cursor.count(1, "file name")?;
    let file = String::from_utf8_lossy(cursor.take(length as u64, "file name")?).into_owned();
    if !is_plain_file_name(&file) {
        return unsound(format!("file name {file:?}: expected a plain one"));
    }
    let file_bytes = cursor.u64("bytes of a face")?;
    let file_crc = cursor.u32("CRC-32 of a face")?;
    let (vertices, triangles) = (cursor.u32("vertices")?, cursor.u32("triangles")?);
    let bounds = bounds(cursor, "bounding box of a face")?;
    let error = cursor.f64("error of a face")?;
    if !(error >= 0.0 && error.is_finite()) {
        return unsound(format!("error of {file}: expected 0 or more, found {error}"));
    }
    let count = cursor.count(VIEW_SIZE, "number of views")?;
    let mut views = Vec::with_capacity(count);
    for _ in 0..count {
        let size = [cursor.u32("width")?, cursor.u32("height")?];
        let solid_angle = cursor.f32("solid angle")?;
        let mut projection = [0.0; 4];
        for number in &mut projection {
            *number = cursor.f32("projection")?;
        }
        let is_finite = projection.iter().chain([&solid_angle]).all(|number| number.is_finite());
        if size.contains(&0) || !is_finite || solid_angle < 0.0 {
            return unsound(format!("a view of {file}: found {size:?}, {projection:?}"));
        }
        views.push(FaceView { size, solid_angle, projection });
    }
    Ok(Face { file, file_bytes, file_crc, vertices, triangles, bounds, error, views })
}
