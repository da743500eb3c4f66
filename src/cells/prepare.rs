//! Makes cells and writes them.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;

use super::cull_box::cull_m;
use super::face::{BEHIND_PX, Capture, DIRECTIONS, Layer, Made};
use super::options::CellOptions;
use crate::bench::Session;
use crate::bench::write_beside;
use crate::format::cells::{CELLS_DIR, CELLS_FILE, Cell, Cells, Face};
use crate::format::{Encoding, NodeId, NodeLabel, file_crc, write_glb_encoded};
use crate::{Error, Result};

/// The index is written again after so many cells, so that a run that is killed loses no more.
const CELLS_BETWEEN: usize = 16;

/// How faces are stored: three quarters of their bytes are vertices and indices otherwise.
const FORM: Encoding = Encoding { step: None, compress: true };

/// Those corners of a cell from which pictures are taken, from its middle, in halves of its side. From the
/// others, which are opposite, none is.
pub(super) const CORNERS: [[f64; 3]; 4] =
    [[-1.0, -1.0, -1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]];

/// Is told how far it is.
pub trait Progress {
    /// So many cells are to be made; `known` are there from an earlier run.
    fn begin(&self, cells: usize, known: usize);
    /// A cell is made.
    fn done(&self);
}

/// What was made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Prepared {
    /// Cells that there are now.
    pub cells: usize,
    /// Of these, those that an earlier run had made.
    pub known: usize,
    /// Their faces.
    pub faces: usize,
    /// Triangles of all faces.
    pub triangles: u64,
    /// Bytes of all faces.
    pub bytes: u64,
    /// The least and the most metres from a cell to the sides of its cull box.
    pub cull_m: [f64; 2],
}

/// Makes those cells of a built scene that are not there yet, and writes them into its folder. Cells that
/// were made with the same options stay, others go. Fails where a file of the scene cannot be used: a face
/// would have a hole in the place of what is in it.
pub fn prepare(
    out: &Path,
    places: &[[i64; 3]],
    options: &CellOptions,
    adapter: Option<&str>,
    progress: &dyn Progress,
) -> Result<Prepared> {
    options.check()?;
    let session = Session::open(out)?;
    let mut cells = earlier(out, &session, options)?;
    let mut missing: Vec<[i64; 3]> = places.to_vec();
    missing.sort_unstable();
    missing.dedup();
    missing.retain(|&place| cells.cell(place).is_none());
    let known = cells.cells.len();
    progress.begin(known + missing.len(), known);
    let mut capture = Capture::new(&session, options, adapter)?;
    let kind = &kind(&cells);
    let dir = out.join(CELLS_DIR);
    std::fs::create_dir_all(&dir)
        .map_err(|error| Error::output(&dir, format!("cannot make the folder: {error}")))?;
    add(out, &mut cells, &missing, progress, |place| {
        cell(out, &mut capture, &session, place, options, kind)
    })?;
    remove_others(&dir, &cells);
    Ok(Prepared {
        cells: cells.cells.len(),
        known,
        faces: cells.faces.len(),
        triangles: cells.faces.iter().map(|face| u64::from(face.triangles)).sum(),
        bytes: cells.faces.iter().map(|face| face.file_bytes).sum(),
        cull_m: cull_m_of(&cells),
    })
}

/// Adds cells and writes the index, now and then and at the end; also where one cannot be made, since another
/// run goes on from there.
fn add(
    out: &Path,
    cells: &mut Cells,
    places: &[[i64; 3]],
    progress: &dyn Progress,
    mut make: impl FnMut([i64; 3]) -> Result<(Cell, Vec<Face>)>,
) -> Result<()> {
    let mut write = |more: Vec<(Cell, Vec<Face>)>| {
        cells.add(more);
        write_beside(&out.join(CELLS_FILE), &cells.to_bytes()?)
    };
    for part in places.chunks(CELLS_BETWEEN) {
        let mut more = Vec::with_capacity(part.len());
        for &place in part {
            match make(place) {
                Ok(made) => more.push(made),
                Err(error) if more.is_empty() => return Err(error),
                Err(error) => return write(more).and(Err(error)),
            }
            progress.done();
        }
        write(more)?;
    }
    // Also where none was missing: what was damaged and is not asked for any more is gone from it.
    write(Vec::new())
}

/// The least and the most metres from a cell to the sides of its cull box.
fn cull_m_of(cells: &Cells) -> [f64; 2] {
    let metres = |cell: &Cell| cells.bounds(cell.place)[0][0] - cell.cull_box[0][0];
    let mut all: Vec<f64> = cells.cells.iter().map(metres).collect();
    all.sort_by(f64::total_cmp);
    [all.first(), all.last()].map(|metres| metres.copied().unwrap_or(0.0))
}

/// The cells of an earlier run that can stay: made of the same build with the same options, and whole.
fn earlier(out: &Path, session: &Session, options: &CellOptions) -> Result<Cells> {
    let parameters = serde_json::to_value(options)
        .map_err(|error| Error::Internal(format!("options without JSON form: {error}")))?;
    let scene = session.scene().fingerprint;
    let (cells, faces) = (Vec::new(), Vec::new());
    let (size, texel) = (options.cell_m, 1.0 / options.focal_px());
    let none = Cells { scene, parameters, size, texel, cells, faces };
    let Ok(Some(mut found)) = Cells::read(out) else { return Ok(none) };
    if (&found.scene, &found.parameters) != (&none.scene, &none.parameters) {
        return Ok(none);
    }
    let is_whole = |face: &Face| {
        crate::format::read_regular(&out.join(CELLS_DIR).join(&face.file))
            .is_ok_and(|bytes| file_crc(&bytes) == face.file_crc)
    };
    found.retain(|faces| faces.iter().all(is_whole));
    Ok(found)
}

/// What names of faces end with: another for other options and another build, so that a run that dies
/// leaves those that an earlier index knows.
fn kind(cells: &Cells) -> String {
    let made_with = cells.parameters.to_string();
    format!("{:08x}", crc32fast::hash(&[cells.scene.as_slice(), made_with.as_bytes()].concat()))
}

/// Removes faces of cells that are no more. What cannot be removed does no harm.
fn remove_others(dir: &Path, cells: &Cells) {
    let known: BTreeSet<&OsStr> = cells.faces.iter().map(|face| face.file.as_ref()).collect();
    for entry in std::fs::read_dir(dir).into_iter().flatten().flatten() {
        let is_face = entry.path().extension().is_some_and(|kind| kind == "glb");
        if is_face && !known.contains(entry.file_name().as_os_str()) {
            drop(std::fs::remove_file(entry.path()));
        }
    }
}

/// The least corner of a cell, and the box outside of which faces show what there is.
pub(super) fn boxes(cell: &Cell, options: &CellOptions) -> (DVec3, [DVec3; 2]) {
    let min = DVec3::from_array(cell.place.map(|at| at as f64)) * options.cell_m;
    let [low, high] = cell.cull_box.map(DVec3::from_array);
    let overlap = DVec3::splat(options.overlap_m(min.x - low.x));
    (min, [low + overlap, high - overlap])
}

/// Draws, makes and writes the faces of a cell.
fn cell(
    out: &Path,
    capture: &mut Capture,
    session: &Session,
    place: [i64; 3],
    options: &CellOptions,
    kind: &str,
) -> Result<(Cell, Vec<Face>)> {
    let min = DVec3::from_array(place.map(|at| at as f64)) * options.cell_m;
    let max = min + DVec3::splat(options.cell_m);
    let around = |metres: f64| [min - DVec3::splat(metres), max + DVec3::splat(metres)];
    let cull_m = cull_m(session.tree(), session.scene().up, (min + max) / 2.0, options);
    let cull_box = around(cull_m);
    let shown = around(cull_m - options.overlap_m(cull_m));
    // Vertices are relative to it, and it stands in a file of f32.
    let eye = ((min + max) / 2.0).as_vec3().as_dvec3();
    let mut layers: [Vec<Layer>; DIRECTIONS.len()] = Default::default();
    let nearest_m = eye.x - shown[0].x;
    for offset in viewpoints(options, nearest_m) {
        // The surface is made for an eye that moves from where the camera stands to anywhere in the cell.
        let reach_m = options.reach_m() + offset.length();
        let is_middle = offset == DVec3::ZERO;
        let mut captured = Vec::new();
        for (direction, layers) in DIRECTIONS.into_iter().zip(&layers) {
            // Where nothing is seen from the middle, what is from elsewhere is beside it, and so in the face
            // of another direction.
            captured.push(match is_middle || !layers.is_empty() {
                true => capture.draw(eye + offset, shown, direction, options)?,
                false => None,
            });
        }
        capture.check()?;
        let known = &layers;
        let more: Vec<Option<Layer>> = captured
            .into_par_iter()
            .map(|captured| {
                let Some(mut captured) = captured else { return Ok(None) };
                let is_new =
                    is_middle || captured.keep_uncovered(known.iter().flatten(), eye, options);
                if is_new { captured.layer(eye, reach_m, options) } else { Ok(None) }
            })
            .collect::<Result<_>>()?;
        layers.iter_mut().zip(more).for_each(|(layers, more)| layers.extend(more));
    }
    let made = layers.map(|layers| Made::of(layers, eye));
    let mut faces = Vec::new();
    for (made, direction) in made.into_iter().zip(0..) {
        let Some(mut made) = made else { continue };
        FORM.prepare(&mut made.mesh);
        let [i, j, k] = place;
        let file = format!("c{i}_{j}_{k}-{direction}-{kind}.glb");
        let label = NodeLabel { id: NodeId(direction), level: 0 };
        let scene = session.scene();
        let bytes = write_glb_encoded(&made.mesh, scene.up, label, FORM, scene.copyright())?;
        write_beside(&out.join(CELLS_DIR).join(&file), &bytes)?;
        let primitives = &made.mesh.primitives;
        faces.push(Face {
            file,
            file_bytes: bytes.len() as u64,
            file_crc: file_crc(&bytes),
            vertices: primitives.iter().map(|part| part.positions.len() as u32).sum(),
            triangles: primitives.iter().map(|part| part.indices.len() as u32 / 3).sum(),
            bounds: made.bounds,
            error: made.error,
            views: made.views,
        });
    }
    let cull_box = cull_box.map(|corner| corner.to_array());
    Ok((Cell { place, cull_box, faces: 0..0 }, faces))
}

/// Where pictures are taken, metres from a cell's middle: there, and from every other of its corners, from
/// where most is seen that is hidden from there. Not where all that is shown is as far as `nearest_m` metres and
/// moves by so little that what is behind it, which goes on under it, covers what comes to be seen.
fn viewpoints(options: &CellOptions, nearest_m: f64) -> Vec<DVec3> {
    if options.reach_m() * options.focal_px() <= BEHIND_PX * nearest_m {
        return vec![DVec3::ZERO];
    }
    let half = options.cell_m / 2.0;
    let corners = CORNERS.map(|corner| DVec3::from(corner) * half);
    std::iter::once(DVec3::ZERO).chain(corners).collect()
}

#[cfg(test)]
mod tests {
    use std::cell::Cell as Counter;

    use super::*;

    struct Count(Counter<usize>);

    impl Progress for Count {
        fn begin(&self, _: usize, _: usize) {}

        fn done(&self) {
            self.0.set(self.0.get() + 1);
        }
    }

    #[test]
    fn what_was_made_before_an_adapter_was_lost_stays() {
        let out = tempfile::tempdir().unwrap();
        let mut cells = Cells {
            scene: [1; 32],
            parameters: serde_json::json!({}),
            size: 4.0,
            texel: 0.004,
            cells: Vec::new(),
            faces: Vec::new(),
        };
        let places: Vec<[i64; 3]> = (0..40).map(|at| [at, 0, 0]).collect();
        let progress = Count(Counter::new(0));
        let failed = add(out.path(), &mut cells, &places, &progress, |place| match place {
            [20, ..] => Err(Error::Graphics("lost".into())),
            place => Ok((Cell { place, cull_box: [[-9.0; 3], [200.0; 3]], faces: 0..0 }, vec![])),
        });
        assert!(matches!(failed, Err(Error::Graphics(_))), "{failed:?}");
        assert_eq!(progress.0.get(), 20);
        let found = Cells::read(out.path()).unwrap().unwrap();
        let found: Vec<[i64; 3]> = found.cells.iter().map(|cell| cell.place).collect();
        assert_eq!(found, places[..20]);
    }

    #[test]
    fn what_moves_by_less_than_what_is_behind_goes_on_is_seen_from_the_middle_alone() {
        let options = CellOptions::default();
        let moves_px = |metres: f64| options.reach_m() * options.focal_px() / metres;
        for (nearest_m, many) in [(100.0, 5), (290.0, 5), (295.0, 1), (480.0, 1)] {
            assert_eq!(viewpoints(&options, nearest_m).len(), many, "{nearest_m} m");
            assert_eq!(moves_px(nearest_m) <= 3.0, many == 1);
        }
        let middle = viewpoints(&options, 100.0).iter().sum::<DVec3>();
        assert_eq!(middle, DVec3::ZERO, "corners around the middle");
    }
}
