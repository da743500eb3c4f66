//! The files of a built scene: read in chunks, checked, and decoded.

use std::fs::File;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::engine::NodeOcclusion;
use crate::format::cells::{CELLS_DIR, Cells, Face};
use crate::format::{
    NODES_DIR, NodeMesh, Scene, SharedTexture, TEXTURES_DIR, file_crc, open_regular,
    read_glb_without_normals,
};
use crate::render::content::{Content, DrawPicture, Picture, TextureFormat};
use crate::{Error, Result};

/// The files of a built scene.
#[derive(Clone, Debug)]
pub struct NodeFiles {
    dir: PathBuf,
    scene: Arc<Scene>,
    textures: FxHashMap<String, u32>,
    /// Of cells, in the order of their numbers.
    faces: Arc<[Face]>,
    with_occlusion: bool,
    format: TextureFormat,
}

/// A node that was read and decoded.
#[derive(Debug)]
pub struct Arrival {
    /// Its index in the scene.
    pub node: u32,
    /// Its geometry and pictures.
    pub content: Content,
    /// Shared pictures that were not in memory when its load began, by index.
    pub pictures: Vec<(u32, Picture)>,
    /// What it hides, and how it may be hidden, where that is [asked for](NodeFiles::with_occlusion).
    pub occlusion: Option<NodeOcclusion>,
}

/// The files of one node, half read.
#[derive(Debug)]
pub struct Reading {
    node: u32,
    /// The file of the node, then those of shared pictures, with their sizes.
    files: Vec<(PathBuf, u64)>,
    textures: Vec<u32>,
    /// The file being read, and which.
    open: Option<(usize, File)>,
    bytes: Vec<u8>,
}

impl NodeFiles {
    /// The files of the scene that stands in `dir`.
    pub fn new(dir: &Path, scene: Arc<Scene>) -> Self {
        let textures = scene
            .shared_textures
            .iter()
            .zip(0..)
            .map(|(texture, index)| (texture.file_name.clone(), index))
            .collect();
        Self {
            dir: dir.to_owned(),
            scene,
            textures,
            faces: Arc::new([]),
            with_occlusion: false,
            format: TextureFormat::Rgba8,
        }
    }

    /// Reads the faces of cells as well, whose numbers come after those of nodes.
    pub fn with_faces(self, cells: &Cells) -> Self {
        Self { faces: cells.faces.clone().into(), ..self }
    }

    /// The faces that it reads as well.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The face that a number is of, unless it is of a node.
    fn face(&self, number: u32) -> Option<&Face> {
        let at = (number as usize).checked_sub(self.scene.nodes.len())?;
        self.faces.get(at)
    }

    /// Has nodes arrive with what they hide.
    pub fn with_occlusion(self) -> Self {
        Self { with_occlusion: true, ..self }
    }

    /// Has pictures arrive in a format, as far as they [can be](TextureFormat::of_picture).
    pub fn with_textures(self, format: TextureFormat) -> Self {
        Self { format, ..self }
    }

    /// The format in which pictures arrive that can.
    pub fn texture_format(&self) -> TextureFormat {
        self.format
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// Begins to read a node and the shared pictures that it needs of which `held` says that they
    /// are not in memory.
    pub fn begin(&self, node: u32, held: impl Fn(u32) -> bool) -> Reading {
        if let Some(face) = self.face(node) {
            let files = vec![(self.dir.join(CELLS_DIR).join(&face.file), face.file_bytes)];
            return Reading { node, files, textures: Vec::new(), open: None, bytes: Vec::new() };
        }
        let entry = &self.scene.nodes[node as usize];
        let mut textures = entry.shared_textures.clone();
        textures.sort_unstable();
        textures.dedup();
        textures.retain(|&texture| !held(texture));
        let mut files = vec![(self.dir.join(NODES_DIR).join(&entry.file), entry.file_bytes)];
        files.extend(textures.iter().map(|&texture| {
            let texture = &self.scene.shared_textures[texture as usize];
            (self.dir.join(TEXTURES_DIR).join(&texture.file_name), texture.bytes)
        }));
        Reading { node, files, textures, open: None, bytes: Vec::new() }
    }

    /// Checks and decodes a node all of whose bytes were read. A file over which decoding panics
    /// is one that cannot be used, as any other.
    pub fn finish(&self, reading: Reading) -> Result<Arrival> {
        guarded(reading.path().to_owned(), || self.decode(reading))
    }

    fn decode(&self, reading: Reading) -> Result<Arrival> {
        let Reading { node, files, textures, bytes, .. } = reading;
        let (path, _) = &files[0];
        if let Some(face) = self.face(node) {
            return self.decode_face(node, face, path, &bytes);
        }
        let (glb, rest) = self.checked(node, path, &bytes)?;
        let content = Content::decode(path, glb, |name| self.textures.get(name).copied())?
            .stored_as(self.format);
        let mut pictures = Vec::with_capacity(textures.len());
        self.decode_shared(&textures, &files[1..], rest, |texture, picture| {
            pictures.push((texture, picture.stored_as(self.format)));
        })?;
        let occlusion = || -> Result<_> {
            Ok(NodeOcclusion::new(&read_glb_without_normals(glb, path)?, self.scene.up))
        };
        let occlusion = self.with_occlusion.then(occlusion).transpose()?;
        Ok(Arrival { node, content, pictures, occlusion })
    }

    /// Decodes shared pictures, whose files follow each other in `bytes`.
    fn decode_shared(
        &self,
        textures: &[u32],
        files: &[(PathBuf, u64)],
        mut bytes: &[u8],
        mut take: impl FnMut(u32, Picture),
    ) -> Result<()> {
        for (&texture, (path, size)) in textures.iter().zip(files) {
            let (file, after) = bytes.split_at_checked(*size as usize).ok_or_else(|| {
                Error::input(path, format!("expected {size} bytes, found {}", bytes.len()))
            })?;
            let entry = &self.scene.shared_textures[texture as usize];
            take(texture, Picture::decode(path, file, [entry.width, entry.height])?);
            bytes = after;
        }
        Ok(())
    }

    /// Checks the files of a node or a face as far as [`read`](Self::read) does, and decodes none
    /// of its geometry and own pictures, which the checksum covers. What it hides, where that is
    /// asked for.
    pub fn check(
        &self,
        number: u32,
        held: impl Fn(u32) -> bool,
        with_occlusion: bool,
    ) -> Result<Option<NodeOcclusion>> {
        let mut reading = self.begin(number, held);
        reading.read(reading.left())?;
        let Reading { files, textures, bytes, .. } = reading;
        let (path, _) = &files[0];
        guarded(path.clone(), || {
            let (glb, rest) = self.checked(number, path, &bytes)?;
            self.decode_shared(&textures, &files[1..], rest, |_, _| {})?;
            match with_occlusion && self.face(number).is_none() {
                true => Ok(Some(NodeOcclusion::new(
                    &read_glb_without_normals(glb, path)?,
                    self.scene.up,
                ))),
                false => Ok(None),
            }
        })
    }

    /// The shared textures of a node; none of a face.
    pub fn textures_of(&self, number: u32) -> &[u32] {
        self.scene.nodes.get(number as usize).map_or(&[], |node| &node.shared_textures)
    }

    /// Errors of files that are missing or not of their size, or that do not begin with the header
    /// of a GLB file of that size: those of nodes, shared textures and faces, in this order. Reads
    /// no more than the headers.
    pub fn unusable(&self) -> Vec<Error> {
        let glb = |dir: &str, name: &str, size| (self.dir.join(dir).join(name), size, true);
        let texture =
            |at: &SharedTexture| (self.dir.join(TEXTURES_DIR).join(&at.file_name), at.bytes, false);
        let check = |(path, size, is_glb): (PathBuf, u64, bool)| {
            open(&path, size)
                .and_then(|file| if is_glb { check_header(file, &path, size) } else { Ok(()) })
                .err()
        };
        let scene = &self.scene;
        let nodes = scene.nodes.par_iter().map(|at| glb(NODES_DIR, &at.file, at.file_bytes));
        let textures = scene.shared_textures.par_iter().map(texture);
        let faces = self.faces.par_iter().map(|at| glb(CELLS_DIR, &at.file, at.file_bytes));
        nodes.chain(textures).chain(faces).filter_map(check).collect()
    }

    /// Pictures of a face are projected from where they were taken.
    fn decode_face(&self, number: u32, face: &Face, path: &Path, bytes: &[u8]) -> Result<Arrival> {
        let (glb, _) = self.checked(number, path, bytes)?;
        let mut content = Content::decode(path, glb, |_| None)?.stored_as(self.format);
        let sizes = face.views.iter().map(|view| view.size);
        let found = content.pictures.iter().map(|picture| [picture.width(), picture.height()]);
        if !found.eq(sizes) {
            return Err(Error::input(path, "expected the pictures that the index of cells names"));
        }
        for draw in &mut content.draws {
            if let DrawPicture::Own(own) = draw.picture {
                draw.projection = Some(face.views[own as usize].projection);
            }
        }
        Ok(Arrival { node: number, content, pictures: Vec::new(), occlusion: None })
    }

    /// The bytes of the file of a node or a face, checked, and those after it.
    fn checked<'a>(&self, node: u32, path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], &'a [u8])> {
        let (size, crc) = match self.face(node) {
            Some(face) => (face.file_bytes, face.file_crc),
            None => {
                let entry = &self.scene.nodes[node as usize];
                (entry.file_bytes, entry.file_crc)
            }
        };
        checked(size, crc, path, bytes)
    }

    /// Reads the geometry of a node alone: its pictures stay encoded.
    pub fn read_mesh(&self, node: u32) -> Result<NodeMesh> {
        self.with_mesh(node, |mesh| mesh)
    }

    /// Reads what a node hides, and how it may be hidden.
    pub fn read_occlusion(&self, node: u32) -> Result<NodeOcclusion> {
        self.with_mesh(node, |mesh| NodeOcclusion::new(&mesh, self.scene.up))
    }

    fn with_mesh<T>(&self, node: u32, make: impl FnOnce(NodeMesh) -> T) -> Result<T> {
        let mut reading = self.begin(node, |_| true);
        let bytes = reading.left();
        reading.read(bytes)?;
        let path = reading.path().to_owned();
        guarded(path.clone(), || {
            Ok(make(read_glb_without_normals(self.checked(node, &path, &reading.bytes)?.0, &path)?))
        })
    }

    /// Reads and decodes a node in one go.
    pub fn read(&self, node: u32, held: impl Fn(u32) -> bool) -> Result<Arrival> {
        let mut reading = self.begin(node, held);
        let bytes = reading.left();
        reading.read(bytes)?;
        self.finish(reading)
    }
}

/// Opens a file that has a size.
fn open(path: &Path, size: u64) -> Result<File> {
    let failed = |error: std::io::Error| Error::input(path, format!("cannot read: {error}"));
    let file = open_regular(path).map_err(failed)?;
    let found = file.metadata().map_err(failed)?.len();
    match found == size {
        true => Ok(file),
        false => Err(Error::input(
            path,
            format!("expected {size} bytes, found {found}: not the file of this build"),
        )),
    }
}

/// Refuses what does not begin as a GLB file of a size does.
fn check_header(mut file: File, path: &Path, size: u64) -> Result<()> {
    let mut found = [0; 12];
    let read = file.read_exact(&mut found);
    read.map_err(|error| Error::input(path, format!("cannot read: {error}")))?;
    let words = [u32::from_le_bytes(*b"glTF"), 2, size as u32];
    match found.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).eq(words) {
        true => Ok(()),
        false => Err(Error::input(
            path,
            format!("damaged: expected the header of a GLB file of {size} bytes"),
        )),
    }
}

/// The bytes of a file of a size, whose checksum is right, and those after it.
fn checked<'a>(size: u64, crc: u32, path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], &'a [u8])> {
    let (file, rest) = bytes.split_at_checked(size as usize).ok_or_else(|| {
        Error::input(path, format!("expected {size} bytes, found {}", bytes.len()))
    })?;
    let found = file_crc(file);
    if found != crc {
        let what = format!("damaged: expected CRC-32 {crc:08x}, found {found:08x}");
        return Err(Error::input(path, what));
    }
    Ok((file, rest))
}

/// Turns a panic into an error that names the file.
pub(super) fn guarded<T>(path: PathBuf, decode: impl FnOnce() -> Result<T>) -> Result<T> {
    // What a panic leaves half done is dropped with it.
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<&str>().copied();
        let what = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        let what = what.unwrap_or("no reason was given");
        Err(Error::input(path, format!("cannot decode: a fault of this program, {what}")))
    })
}

impl Reading {
    /// Which node is read.
    #[cfg(test)]
    pub(super) fn node(&self) -> u32 {
        self.node
    }

    /// The file of the node.
    pub(super) fn path(&self) -> &Path {
        &self.files[0].0
    }

    /// Bytes that are to be read in all.
    fn total(&self) -> u64 {
        self.files.iter().map(|(_, size)| size).sum()
    }

    /// Bytes that are left.
    pub fn left(&self) -> u64 {
        self.total() - self.bytes.len() as u64
    }

    /// Bytes that were read.
    pub fn done(&self) -> u64 {
        self.bytes.len() as u64
    }

    /// Reads the next `bytes` bytes, or those that are left.
    pub fn read(&mut self, bytes: u64) -> Result<()> {
        let mut wanted = bytes.min(self.left());
        while wanted > 0 {
            let (which, left) = self.place();
            let part = wanted.min(left);
            self.read_from(which, part)?;
            wanted -= part;
        }
        Ok(())
    }

    /// The file in which the next byte stands, and how many of its bytes are left.
    fn place(&self) -> (usize, u64) {
        let mut end = 0;
        for (which, (_, size)) in self.files.iter().enumerate() {
            end += size;
            if self.done() < end {
                return (which, end - self.done());
            }
        }
        (self.files.len() - 1, 0)
    }

    fn read_from(&mut self, which: usize, bytes: u64) -> Result<()> {
        let (path, size) = &self.files[which];
        let failed = |error: std::io::Error| Error::input(path, format!("cannot read: {error}"));
        let mut file = match self.open.take() {
            Some((open, file)) if open == which => file,
            _ => open(path, *size)?,
        };
        let from = self.bytes.len();
        let read = Read::by_ref(&mut file).take(bytes).read_to_end(&mut self.bytes);
        read.map_err(failed)?;
        if ((self.bytes.len() - from) as u64) < bytes {
            return Err(Error::input(path, format!("expected {size} bytes, found fewer")));
        }
        self.open = Some((which, file));
        Ok(())
    }
}
