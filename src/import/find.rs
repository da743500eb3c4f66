//! From the command line's files and folders to model files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// What an input may be, for messages.
pub(super) const EXPECTED: &str = "expected .obj, .gltf or .glb";

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0, JSON or binary.
    Gltf,
}

/// The format that a file's extension announces, in either case of letters.
pub(super) fn kind(path: &Path) -> Option<Kind> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "obj" => Some(Kind::Obj),
        "gltf" | "glb" => Some(Kind::Gltf),
        _ => None,
    }
}

/// Files and folders of the command line to model files (`obj`, `gltf`, `glb`).
///
/// Folders are searched recursively; entries whose name begins with a dot are passed over. The
/// result is sorted, and a file that is reached twice is there once, under the path that sorts
/// first. A missing path, a file of another kind and a folder without models are errors.
pub fn find_inputs(arguments: &[PathBuf]) -> Result<Vec<PathBuf>> {
    let mut found = Found::default();
    for argument in arguments {
        let metadata = argument.metadata().map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => {
                Error::input(argument, format!("no such file or folder; {EXPECTED} or a folder"))
            }
            _ => Error::input(argument, format!("cannot be read: {error}")),
        })?;
        if metadata.is_dir() {
            if search(argument, &mut found)? == 0 {
                let what = format!("no model in this folder or below it; {EXPECTED}");
                return Err(Error::input(argument, what));
            }
        } else if !metadata.is_file() {
            // It is read several times, and a pipe can be read once.
            let what = "expected a regular file or a folder, found a pipe, socket or device";
            return Err(Error::input(argument, what));
        } else if kind(argument).is_some() {
            found.add(argument.clone());
        } else {
            return Err(Error::input(
                argument,
                format!("not a model by its extension; {EXPECTED}"),
            ));
        }
    }
    let mut inputs: Vec<PathBuf> = found.files.into_values().collect();
    inputs.sort();
    Ok(inputs)
}

/// Model files by canonical path, with the path under which each was given.
#[derive(Default)]
struct Found {
    files: BTreeMap<PathBuf, PathBuf>,
}

impl Found {
    fn add(&mut self, path: PathBuf) {
        let canonical = path.canonicalize().unwrap_or_else(|_| path.clone());
        self.files
            .entry(canonical)
            .and_modify(|known| {
                if path < *known {
                    known.clone_from(&path);
                }
            })
            .or_insert(path);
    }
}

/// Adds the models below `root` and returns how many it met.
fn search(root: &Path, found: &mut Found) -> Result<usize> {
    let mut models = 0;
    // Linked folders may form circles, so each real folder is entered once.
    let mut entered = std::collections::BTreeSet::new();
    let mut waiting = vec![root.to_path_buf()];
    while let Some(folder) = waiting.pop() {
        if !entered.insert(folder.canonicalize().unwrap_or_else(|_| folder.clone())) {
            continue;
        }
        let unreadable = |error| Error::input(&folder, format!("cannot be searched: {error}"));
        for entry in folder.read_dir().map_err(unreadable)? {
            let entry = entry.map_err(unreadable)?;
            if entry.file_name().as_encoded_bytes().starts_with(b".") {
                continue;
            }
            let path = entry.path();
            if path.is_dir() {
                waiting.push(path);
            } else if kind(&path).is_some() && path.is_file() {
                models += 1;
                found.add(path);
            }
        }
    }
    Ok(models)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn folders_are_searched_below_and_sorted_without_duplicates() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        fs::create_dir_all(root.join("b/c")).unwrap();
        fs::create_dir(root.join(".hidden")).unwrap();
        for name in ["z.obj", "b/a.GLB", "b/c/x.gltf", "b/readme.txt", ".hidden/no.obj"] {
            fs::write(root.join(name), "").unwrap();
        }
        let found = find_inputs(&[root.join("z.obj"), root.into(), root.join("b")]).unwrap();
        let expected: Vec<_> =
            ["b/a.GLB", "b/c/x.gltf", "z.obj"].iter().map(|name| root.join(name)).collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_not_a_model_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        let refusal = |path: &Path| find_inputs(&[path.into()]).unwrap_err();
        assert_eq!(refusal(root).exit_code(), 3);
        assert!(refusal(root).to_string().contains("no model in this folder"));
        assert!(refusal(&root.join("absent.obj")).to_string().contains("no such file"));
        fs::write(root.join("city.fbx"), "").unwrap();
        assert!(refusal(&root.join("city.fbx")).to_string().contains("expected .obj"));
    }

    #[cfg(unix)]
    #[test]
    fn a_named_pipe_is_refused_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("city.obj");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        if !made.is_ok_and(|status| status.success()) {
            println!("skipped: no mkfifo");
            return;
        }
        let refusal = find_inputs(&[pipe]).unwrap_err();
        assert!(refusal.exit_code() == 3 && refusal.to_string().contains("regular file"));
    }

    #[cfg(unix)]
    #[test]
    fn a_circle_of_links_ends() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a.obj"), "").unwrap();
        std::os::unix::fs::symlink(folder.path(), folder.path().join("again")).unwrap();
        assert_eq!(find_inputs(&[folder.path().into()]).unwrap().len(), 1);
    }
}
