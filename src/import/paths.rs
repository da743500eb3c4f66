//! Finds the files that a model names, also when the names come from another machine.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Folders beside the model in which exporters put textures.
const USUAL_FOLDERS: [&str; 5] = ["textures", "texture", "tex", "images", "maps"];

/// Looks up file names on behalf of one model.
pub(super) struct Finder {
    folder: PathBuf,
    /// Files of the model's folder and the usual ones below it by lower-case name, listed when
    /// first needed.
    listing: Option<BTreeMap<String, PathBuf>>,
    /// See [`Finder::absent`].
    absent: Vec<PathBuf>,
}

impl Finder {
    /// For the model at `model`.
    pub(super) fn new(model: &Path) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).to_path_buf();
        Self { folder, listing: None, absent: Vec::new() }
    }

    /// The file that `name` means: as written (relative to the model's folder); with backslashes
    /// as slashes; the end of the path below the model's folder, longest first; and the base name
    /// in that folder or one for textures beside the model, in whatever case of letters.
    pub(super) fn find(&mut self, name: &str) -> Option<PathBuf> {
        let name = name.trim().trim_matches('"');
        if name.is_empty() || name.contains('\0') {
            return None;
        }
        let slashed = name.replace('\\', "/");
        let components: Vec<&str> =
            slashed.split('/').filter(|part| !part.is_empty() && *part != ".").collect();
        let ends = (0..components.len()).map(|from| components[from..].join("/"));
        let found = [name.to_owned(), slashed.clone()]
            .into_iter()
            .chain(ends)
            .map(|candidate| self.folder.join(candidate))
            .find(|candidate| candidate.is_file())
            .or_else(|| self.listing().get(&components.last()?.to_lowercase()).cloned());
        if found.is_none() {
            let base_name = components.last().map(|&name| name.to_owned());
            let places = [Some(slashed.clone()), base_name].into_iter().flatten();
            self.absent.extend(places.map(|place| self.folder.join(place)));
        }
        found
    }

    /// Where files that were asked for and not found would be looked for first: should one appear
    /// there, the model is another.
    pub(super) fn absent(self) -> Vec<PathBuf> {
        self.absent
    }

    fn listing(&mut self) -> &BTreeMap<String, PathBuf> {
        self.listing.get_or_insert_with(|| {
            let mut files = BTreeMap::new();
            // A model named without a folder lies in the current one.
            let here =
                if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
            let entries = sorted_entries(here);
            let usual = entries.iter().filter(|path| {
                let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase());
                name.is_some_and(|name| USUAL_FOLDERS.contains(&name.as_str()))
            });
            let below: Vec<PathBuf> = usual.flat_map(|folder| sorted_entries(folder)).collect();
            for path in entries.iter().chain(&below) {
                let Some(name) = path.file_name() else { continue };
                // The model's own folder goes first, and the order is that of names.
                let key = name.to_string_lossy().to_lowercase();
                if !files.contains_key(&key) && path.is_file() {
                    files.insert(key, self.folder.join(path.strip_prefix(here).unwrap_or(path)));
                }
            }
            files
        })
    }
}

/// What is in `folder`, sorted; nothing where it is no folder or cannot be read.
fn sorted_entries(folder: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> =
        folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_from_other_machines_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        for name in ["a b.JPG", "sub/c.png", "sub/d.png", "Textures/D.png", "tex/e.png"] {
            let path = root.join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let mut finder = Finder::new(&root.join("city.obj"));
        for (name, expected) in [
            ("a b.JPG", Some("a b.JPG")),
            ("A B.jpg", Some("a b.JPG")),
            (r"C:\Users\me\my city\a b.jpg", Some("a b.JPG")),
            ("/home/me/a b.jpg", Some("a b.JPG")),
            (r"sub\c.png", Some("sub/c.png")),
            (r"C:\city\sub\d.png", Some("sub/d.png")),
            ("d.png", Some("Textures/D.png")),
            ("./tex//e.png", Some("tex/e.png")),
            ("../elsewhere/E.PNG", Some("tex/e.png")),
            ("sub", None),
            ("absent.png", None),
            ("", None),
            ("..", None),
        ] {
            assert_eq!(
                finder.find(name).map(normal),
                expected.map(|name| root.join(name)),
                "{name}"
            );
        }
    }

    /// Without `.` components, which `Path` equality ignores only in the middle.
    fn normal(path: PathBuf) -> PathBuf {
        path.components().collect()
    }

    #[test]
    fn an_absolute_path_of_this_machine_is_taken_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("far.png");
        std::fs::write(&file, "").unwrap();
        let mut finder = Finder::new(Path::new("elsewhere/city.obj"));
        assert_eq!(finder.find(file.to_str().unwrap()), Some(file));
    }
}
