//! Writes an output folder beside the old one and puts it in its place at the end.
//!
//! All files go into `.NAME.hlod-partial-PID-N` in the parent of the output, so that the last
//! step is one exchange of names within one file system. Whoever stops before that, in whatever
//! way, leaves the old folder as it was. A partial folder is locked while its process lives;
//! those that nobody locks are swept away by the next build.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::{
    BORDERS_DIR, NODES_DIR, REPORT_FILE, SCANS_FILE, SCENE_FILE, SCENE_MAGIC, SUBSETS_DIR,
    TEXTURES_DIR, TILESET_FILE, TILESETS_DIR,
    cells::{CELLS_DIR, CELLS_FILE},
};
use crate::format::Subset;
use crate::{Error, Result};

/// The folder of shared textures in results of versions whose node files named `../textures/`.
const EARLIER_TEXTURES_DIR: &str = "textures";
/// File of earlier versions with the borders of upper nodes.
const EARLIER_RIMS_FILE: &str = "rims.hlod";
/// Extensions of shared textures.
const IMAGE_KINDS: &[&str] = &["jpg", "png"];

const PARTIAL: &str = "hlod-partial-";
const ASIDE: &str = "hlod-old";

/// An output folder in the making. Dropped without [`commit`](OutputDir::commit), it vanishes
/// and what stood there before stays.
#[derive(Debug)]
pub struct OutputDir {
    /// Where the result will stand; absolute, links resolved.
    target: PathBuf,
    /// Where it is written.
    partial: PathBuf,
    /// Folders above `target` that had to be made, the innermost first.
    made: Vec<PathBuf>,
    /// Holds the lock on `partial`.
    lock: Option<File>,
    committed: bool,
    /// What is in it stays where it is not committed.
    kept: AtomicBool,
}

impl OutputDir {
    /// Begins a result that will stand at `path`.
    ///
    /// `path` may not exist, may be an empty folder, or may be the result of an earlier build;
    /// anything else is refused and left as it is.
    pub fn create(path: &Path) -> Result<Self> {
        let target = resolve(path).map_err(|error| cannot(path, "be written", &error))?;
        refuse_foreign(path, &target)?;
        let (Some(parent), Some(name)) = (target.parent(), target.file_name()) else {
            return Err(Error::output(path, "expected a folder that has a parent; name one"));
        };
        if is_mount_point(&target, parent) {
            let busy = io::Error::from(ErrorKind::ResourceBusy);
            return Err(cannot(path, "be replaced at the end", &busy));
        }
        let made = make_folders(parent).map_err(|error| cannot(parent, "be made", &error))?;
        put_back(&target, &aside(parent, name));
        sweep(parent, name);
        let made_partial = make_partial(parent, name)
            .map_err(|error| cannot(parent, "be written into, and the output goes there", &error));
        match made_partial {
            Ok((partial, lock)) => {
                let kept = AtomicBool::new(false);
                Ok(Self { target, partial, made, lock, committed: false, kept })
            }
            Err(error) => {
                made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
                Err(error)
            }
        }
    }

    /// Where files stand until the end.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Where the result will stand: absolute, links resolved. An earlier result is still there.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Writes a file, `relative` to the output folder; the folders of its path are made. May be
    /// called from many threads at once. Each file is written once.
    pub fn write(&self, relative: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
        let relative = relative.as_ref();
        let path = self.place(relative)?;
        let mut file = in_folder(&path, || File::create_new(&path))
            .map_err(|error| self.failed(relative, &error))?;
        file.write_all(bytes).map_err(|error| self.failed(relative, &error))
    }

    /// Writes a file of which there may be an older one, which is there until the new one is whole.
    pub fn write_over(&self, relative: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
        let relative = relative.as_ref();
        let path = self.place(relative)?;
        let beside = path.with_extension("new");
        let write = || fs::write(&beside, bytes).and_then(|()| fs::rename(&beside, &path));
        write().map_err(|error| self.failed(relative, &error))
    }

    /// From now on what is written stays, also where there is no [`commit`](Self::commit), until another build
    /// [goes on](Unfinished) from it, or begins anew.
    pub fn keep(&self) {
        self.kept.store(true, Ordering::Relaxed);
    }

    /// Takes over a file of an earlier result unchanged: by a hard link, or a copy where the
    /// file system has none.
    pub fn reuse(&self, earlier: &Path, relative: impl AsRef<Path>) -> Result<()> {
        let relative = relative.as_ref();
        let path = self.place(relative)?;
        let source = earlier.join(relative);
        in_folder(&path, || match fs::hard_link(&source, &path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(error),
            Err(error) if error.kind() == ErrorKind::NotFound => Err(error),
            Err(_) => fs::copy(&source, &path).map(drop),
            Ok(()) => Ok(()),
        })
        .map_err(|error| self.failed(relative, &error))
    }

    /// Puts the result in its place; an earlier one is removed. Either all of the old result or
    /// all of the new one is there at any time.
    pub fn commit(mut self) -> Result<()> {
        let replaces = self.target.exists();
        if replaces {
            // Looked at again: a build takes long, and someone may have put a file there.
            refuse_foreign(&self.target, &self.target)?;
            // A first result can be built again after a power failure; an earlier one that is
            // removed must not be lost before its successor is on the disk.
            flush(&self.partial).map_err(|error| cannot(&self.partial, "be flushed", &error))?;
        }
        if let Ok(earlier) = fs::metadata(&self.target) {
            drop(fs::set_permissions(&self.partial, earlier.permissions()));
        }
        let swapped = if replaces {
            self.replace()
        } else {
            fs::rename(&self.partial, &self.target).map(|()| None)
        };
        let old = swapped.map_err(|error| cannot(&self.target, "be replaced", &error))?;
        self.committed = true;
        if let Some(old) = old {
            // What cannot be removed now is swept away by the next build.
            drop(fs::remove_dir_all(old));
        }
        Ok(())
    }

    /// Exchanges old and new, and says where the old one is now.
    fn replace(&self) -> io::Result<Option<PathBuf>> {
        if exchange(&self.partial, &self.target)? {
            return Ok(Some(self.partial.clone()));
        }
        // Without an exchange there is a moment with neither; `put_back` heals a stop in it.
        let parent = self.target.parent().unwrap_or(Path::new("."));
        let old = aside(parent, self.target.file_name().unwrap_or_default());
        fs::rename(&self.target, &old)?;
        if let Err(error) = fs::rename(&self.partial, &self.target) {
            fs::rename(&old, &self.target)?;
            return Err(error);
        }
        Ok(Some(old))
    }

    fn place(&self, relative: &Path) -> Result<PathBuf> {
        let plain = relative.components().all(|part| matches!(part, Component::Normal(_)));
        if !plain || relative.as_os_str().is_empty() {
            return Err(Error::Internal(format!("output file {}", relative.display())));
        }
        Ok(self.partial.join(relative))
    }

    /// Names the file as the user will know it, not where it is being written.
    fn failed(&self, relative: &Path, error: &io::Error) -> Error {
        cannot(&self.target.join(relative), "be written", error)
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        if !self.committed && !self.kept.load(Ordering::Relaxed) {
            drop(fs::remove_dir_all(&self.partial));
            self.made.iter().for_each(|folder| drop(fs::remove_dir(folder)));
        }
        drop(self.lock.take());
    }
}

/// An output that was [kept](OutputDir::keep) by a build that was stopped. While it is held, no other build
/// sweeps it away.
#[derive(Debug)]
pub struct Unfinished {
    dir: PathBuf,
    _lock: File,
}

impl Unfinished {
    /// Of the output at `path`, the one in which most is finished.
    pub fn find(path: &Path) -> Option<Self> {
        let target = resolve(path).ok()?;
        let stem = hidden(target.file_name()?, PARTIAL);
        let entries = fs::read_dir(target.parent()?).ok()?.flatten().filter_map(|entry| {
            let is_partial =
                entry.file_name().as_encoded_bytes().starts_with(stem.as_encoded_bytes());
            let dir = entry.path();
            let scene = fs::metadata(dir.join(SCENE_FILE)).ok().filter(|_| is_partial)?;
            Some((scene.len(), dir))
        });
        let mut found: Vec<(u64, PathBuf)> = entries.collect();
        found.sort();
        let held = |(_, dir): (u64, PathBuf)| lock(&dir).map(|lock| Self { dir, _lock: lock });
        found.into_iter().rev().find_map(held)
    }

    /// Where what is finished is.
    pub fn path(&self) -> &Path {
        &self.dir
    }

    /// Removes it.
    pub fn remove(self) {
        drop(fs::remove_dir_all(&self.dir));
    }
}

/// Refuses an output that is an input, lies within one, or has one within it: it would be
/// overwritten, or be read as a model by the next build.
pub fn check_apart<P: AsRef<Path>>(
    output: &Path,
    inputs: impl IntoIterator<Item = P>,
) -> Result<()> {
    let Ok(target) = resolve(output) else {
        return Ok(()); // `create` says why
    };
    for input in inputs {
        let Ok(input) = fs::canonicalize(&input) else { continue };
        let how = if input == target {
            "is an input"
        } else if target.starts_with(&input) {
            "lies within the input"
        } else if input.starts_with(&target) {
            "would be replaced, with an input in it:"
        } else {
            continue;
        };
        let what = format!("{how} {}; choose another folder for the output", input.display());
        return Err(Error::output(output, what));
    }
    Ok(())
}

/// `path`, absolute and with links resolved as far as it exists.
pub(crate) fn resolve(path: &Path) -> io::Result<PathBuf> {
    let path = std::path::absolute(path)?;
    match fs::canonicalize(&path) {
        Ok(real) => Ok(real),
        Err(error) if error.kind() == ErrorKind::NotFound => {
            if fs::symlink_metadata(&path).is_ok() {
                return Err(io::Error::other("it is a link to something that does not exist"));
            }
            match (path.parent(), path.file_name()) {
                (Some(parent), Some(name)) => Ok(resolve(parent)?.join(name)),
                _ => Err(error),
            }
        }
        Err(error) => Err(error),
    }
}

/// Refuses what is neither empty nor the result of an earlier build; `path` is for messages.
fn refuse_foreign(path: &Path, target: &Path) -> Result<()> {
    let listing = match fs::read_dir(target) {
        Ok(listing) => listing,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            return Err(Error::output(path, "expected a folder, found a file"));
        }
        Err(error) => return Err(cannot(path, "be read", &error)),
    };
    let names = sorted_names(listing).map_err(|error| cannot(path, "be read", &error))?;
    if names.is_empty() {
        return Ok(());
    }
    let what = match first_foreign(target, &names) {
        Some(name) => format!("holds {}, which is not of an earlier build", name.display()),
        None if names.iter().all(|name| name == SUBSETS_DIR) => return Ok(()),
        None if !begins_with_magic(&target.join(SCENE_FILE)) => {
            format!("is not empty, and its {SCENE_FILE} is not of an earlier build")
        }
        None => return Ok(()),
    };
    Err(Error::output(path, format!("{what}; choose an empty or a new folder")))
}

fn sorted_names(listing: fs::ReadDir) -> io::Result<Vec<OsString>> {
    let mut names = listing
        .map(|entry| entry.map(|entry| entry.file_name()))
        .collect::<io::Result<Vec<_>>>()?;
    names.sort();
    Ok(names)
}

/// The first thing in a folder that no build writes, relative to the folder.
fn first_foreign(target: &Path, names: &[OsString]) -> Option<PathBuf> {
    names.iter().find_map(|name| {
        let kinds: &[&str] = match name.to_str() {
            Some(SCENE_FILE | REPORT_FILE | TILESET_FILE | SCANS_FILE | CELLS_FILE) => return None,
            Some(EARLIER_RIMS_FILE) => return None,
            Some(NODES_DIR | CELLS_DIR) => &["glb"],
            Some(EARLIER_TEXTURES_DIR) => IMAGE_KINDS,
            Some(TILESETS_DIR) => &["json"],
            Some(BORDERS_DIR) => &["border"],
            Some(SUBSETS_DIR) if is_of_subsets(&target.join(name)) => return None,
            _ => return Some(name.into()),
        };
        foreign_in(target, Path::new(name), kinds)
    })
}

/// The first thing below a folder that is neither a file of these kinds nor a shared texture,
/// relative to `target`; the folder itself where it is not one or cannot be listed.
fn foreign_in(target: &Path, folder: &Path, kinds: &[&str]) -> Option<PathBuf> {
    let Ok(names) = fs::read_dir(target.join(folder)).and_then(sorted_names) else {
        return Some(folder.into());
    };
    names.iter().map(|name| folder.join(name)).find_map(|path| {
        if path == Path::new(TEXTURES_DIR) {
            return foreign_in(target, &path, IMAGE_KINDS);
        }
        let kind = path.extension().unwrap_or_default();
        (!kinds.iter().any(|ours| kind == *ours)).then_some(path)
    })
}

/// Whether there is nothing in a folder but results of subsets, finished or not.
fn is_of_subsets(folder: &Path) -> bool {
    let Ok(names) = fs::read_dir(folder).and_then(sorted_names) else { return false };
    let is_ours = |name: &OsString| {
        let name = name.to_string_lossy();
        let unfinished = name.strip_prefix('.').and_then(|name| name.split_once('.'));
        match unfinished {
            Some((subset, rest)) => {
                Subset::of_dir(subset).is_some()
                    && (rest.starts_with(PARTIAL) || rest.starts_with(ASIDE))
            }
            None => {
                Subset::of_dir(&name).is_some()
                    && begins_with_magic(&folder.join(&*name).join(SCENE_FILE))
            }
        }
    };
    names.iter().all(is_ours)
}

fn begins_with_magic(path: &Path) -> bool {
    let mut magic = [0; SCENE_MAGIC.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut magic)).is_ok()
        && magic == SCENE_MAGIC
}

/// Makes a folder and those above it; returns those that were not there, the innermost first.
fn make_folders(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let missing: Vec<_> =
        folder.ancestors().take_while(|folder| !folder.exists()).map(Path::to_owned).collect();
    fs::create_dir_all(folder)?;
    Ok(missing)
}

/// A new locked folder for the files of one build.
fn make_partial(parent: &Path, name: &OsStr) -> io::Result<(PathBuf, Option<File>)> {
    let stem = hidden(name, PARTIAL);
    for attempt in 0..1000 {
        let mut file_name = stem.clone();
        file_name.push(format!("{}-{attempt}", std::process::id()));
        let partial = parent.join(file_name);
        match fs::create_dir(&partial) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            Err(error) => return Err(error),
            Ok(()) => {}
        }
        let lock = lock(&partial);
        // Another build may have swept it away before it was locked.
        if partial.exists() {
            return Ok((partial, lock));
        }
    }
    Err(io::Error::other("too many unfinished outputs beside it"))
}

/// Removes what builds of the same output left behind when they were killed.
fn sweep(parent: &Path, name: &OsStr) {
    let stem = hidden(name, PARTIAL);
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let is_partial = entry.file_name().as_encoded_bytes().starts_with(stem.as_encoded_bytes());
        if is_partial && let Some(_lock) = lock(&entry.path()) {
            drop(fs::remove_dir_all(entry.path()));
        }
    }
}

/// Where the old result stands for a moment on systems that cannot exchange names.
fn aside(parent: &Path, name: &OsStr) -> PathBuf {
    parent.join(hidden(name, ASIDE))
}

/// Heals a stop between the two renames of [`OutputDir::replace`].
fn put_back(target: &Path, old: &Path) {
    if !old.exists() {
        return;
    }
    if target.exists() {
        drop(fs::remove_dir_all(old));
    } else {
        drop(fs::rename(old, target));
    }
}

/// `.NAME.KIND`; long names are shortened, since systems limit the length of names.
fn hidden(name: &OsStr, kind: &str) -> OsString {
    let name: String = name.to_string_lossy().chars().take(40).collect();
    OsString::from(format!(".{name}.{kind}"))
}

/// Runs `act` and, where the folder of `path` does not exist, makes it and runs `act` again.
fn in_folder<T>(path: &Path, act: impl Fn() -> io::Result<T>) -> io::Result<T> {
    match (act(), path.parent()) {
        (Err(error), Some(folder)) if error.kind() == ErrorKind::NotFound => {
            fs::create_dir_all(folder)?;
            act()
        }
        (done, _) => done,
    }
}

/// Says what happened and what to try.
pub(super) fn cannot(path: &Path, what: &str, error: &io::Error) -> Error {
    let hint = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            ": the disk is full; make room or choose another place"
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "; choose a place that you may write to"
        }
        ErrorKind::ResourceBusy | ErrorKind::CrossesDevices => {
            "; a mount point cannot be replaced, so name a folder within it"
        }
        _ => "",
    };
    Error::output(path, format!("cannot {what}: {error}{hint}"))
}

/// True where a folder is the top of another file system than its parent's.
#[cfg(unix)]
fn is_mount_point(folder: &Path, parent: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    match (fs::metadata(folder), fs::metadata(parent)) {
        (Ok(folder), Ok(parent)) => folder.dev() != parent.dev(),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_mount_point(_folder: &Path, _parent: &Path) -> bool {
    false
}

/// Locks a folder for as long as the file is open; `None` where someone else has locked it or
/// the system has no such locks.
#[cfg(unix)]
fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    rustix::fs::flock(&file, rustix::fs::FlockOperation::NonBlockingLockExclusive).ok()?;
    Some(file)
}

#[cfg(not(unix))]
fn lock(_folder: &Path) -> Option<File> {
    None
}

/// Exchanges two names in one step; false where the system or the file system cannot.
#[cfg(target_os = "linux")]
fn exchange(one: &Path, other: &Path) -> io::Result<bool> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    match renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE) {
        Ok(()) => Ok(true),
        Err(Errno::INVAL | Errno::NOSYS | Errno::NOTSUP) => Ok(false),
        Err(error) => Err(error.into()),
    }
}

#[cfg(not(target_os = "linux"))]
fn exchange(_one: &Path, _other: &Path) -> io::Result<bool> {
    Ok(false)
}

/// Brings all that was written to the disk.
#[cfg(target_os = "linux")]
fn flush(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(File::open(folder)?)?)
}

#[cfg(not(target_os = "linux"))]
fn flush(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            flush(&entry.path())?;
        } else {
            // Windows flushes a file only if it is open for writing. Elsewhere files that were made read-only
            // can be flushed too.
            File::options().read(true).write(cfg!(windows)).open(entry.path())?.sync_all()?;
        }
    }
    Ok(())
}
