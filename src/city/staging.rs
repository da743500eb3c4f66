//! Output written beside its place and renamed at the end, so that a failure leaves what was there.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Files and folders in the making. Dropped before [`Staging::commit`], it leaves nothing.
pub(super) struct Staging {
    scratch: tempfile::TempDir,
    parent: PathBuf,
    names: Vec<String>,
}

/// An error that names the file or folder and what was tried.
pub(super) fn failed(path: &Path, attempt: &'static str) -> impl Fn(io::Error) -> Error {
    let path = path.to_path_buf();
    move |error| Error::output(path.clone(), format!("cannot {attempt}: {error}"))
}

impl Staging {
    /// A place for files that will stand in `parent`, which is created where it is missing.
    pub(super) fn new(parent: &Path) -> Result<Self> {
        let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
        fs::create_dir_all(parent).map_err(failed(parent, "create the folder"))?;
        let scratch = tempfile::Builder::new()
            .prefix(".make-city-")
            .tempdir_in(parent)
            .map_err(failed(parent, "write to the folder"))?;
        Ok(Self { scratch, parent: parent.to_path_buf(), names: Vec::new() })
    }

    /// Creates a file that will be named `name`.
    pub(super) fn file(&mut self, name: &str) -> Result<File> {
        let file = self.scratch_file(name)?;
        self.names.push(name.to_owned());
        Ok(file)
    }

    /// Creates a folder that will be named `name` and returns where it stands meanwhile.
    pub(super) fn folder(&mut self, name: &str) -> Result<PathBuf> {
        let path = self.scratch.path().join(name);
        fs::create_dir(&path).map_err(failed(&path, "create the folder"))?;
        self.names.push(name.to_owned());
        Ok(path)
    }

    /// Creates a file that is gone at the end.
    pub(super) fn scratch_file(&self, name: &str) -> Result<File> {
        let path = self.scratch.path().join(name);
        File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path)
            .map_err(failed(&path, "create the file"))
    }

    /// Renames everything into place, in the order of creation: what refers to others comes last.
    pub(super) fn commit(self) -> Result<()> {
        for name in &self.names {
            let (from, to) = (self.scratch.path().join(name), self.parent.join(name));
            if from.is_dir() && to.is_dir() {
                let old = self.scratch.path().join(format!("{name}.old"));
                fs::rename(&to, &old).map_err(failed(&to, "replace the folder"))?;
            }
            fs::rename(&from, &to).map_err(failed(&to, "write"))?;
        }
        Ok(())
    }
}

/// Refuses a folder that holds anything but files named as a city's blocks are.
pub(super) fn check_replaceable(folder: &Path, extensions: &[&str]) -> Result<()> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(failed(folder, "write to the folder")(error)),
    };
    for entry in entries {
        let path = entry.map_err(failed(folder, "read the folder"))?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let extension = path.extension().and_then(|end| end.to_str()).unwrap_or_default();
        let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
        let is_ours = stem.strip_prefix("block_").is_some_and(is_number)
            && extensions.contains(&extension)
            && path.is_file();
        if !is_ours {
            return Err(Error::output(
                folder,
                format!(
                    "the folder holds {}, which is not part of an earlier city; \
                     remove it or choose another place",
                    path.file_name().unwrap_or_default().display()
                ),
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn nothing_shows_before_the_commit_and_old_folders_are_replaced() {
        let place = tempfile::tempdir().unwrap();
        fs::create_dir(place.path().join("tiles")).unwrap();
        fs::write(place.path().join("tiles/block_1.jpg"), "old").unwrap();
        let seen = || {
            let mut names: Vec<_> = fs::read_dir(place.path())
                .unwrap()
                .map(|entry| entry.unwrap().file_name().into_string().unwrap())
                .filter(|name| !name.starts_with('.'))
                .collect();
            names.sort();
            names
        };
        let make = || {
            let mut staging = Staging::new(place.path()).unwrap();
            let folder = staging.folder("tiles").unwrap();
            fs::write(folder.join("block_2.jpg"), "new").unwrap();
            staging.file("city.obj").unwrap().write_all(b"o").unwrap();
            staging
        };
        drop(make());
        assert_eq!(seen(), ["tiles"]);
        assert!(place.path().join("tiles/block_1.jpg").exists());
        make().commit().unwrap();
        assert_eq!(seen(), ["city.obj", "tiles"]);
        assert!(!place.path().join("tiles/block_1.jpg").exists());
        assert!(place.path().join("tiles/block_2.jpg").exists());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 2, "scratch is gone");
    }

    #[test]
    fn a_folder_with_something_else_is_kept() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("x");
        assert!(check_replaceable(&folder, &["jpg"]).is_ok());
        fs::create_dir(&folder).unwrap();
        fs::write(folder.join("block_0001.jpg"), "").unwrap();
        assert!(check_replaceable(&folder, &["jpg"]).is_ok());
        fs::write(folder.join("thesis.doc"), "").unwrap();
        let error = check_replaceable(&folder, &["jpg"]).unwrap_err();
        assert_eq!(error.exit_code(), 4);
        assert!(error.to_string().contains("thesis.doc"), "{error}");
    }
}
