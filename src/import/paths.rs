//! Finds the files that a model names, also when the names come from another machine.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};

use encoding_rs::Encoding;

use super::names::{folded, forms, unescaped};
use crate::side_file;

/// Folders beside the model in which exporters put textures.
const USUAL_FOLDERS: [&str; 5] = ["textures", "texture", "tex", "images", "maps"];

/// Longest path that systems allow, in bytes.
const LONGEST_PATH: usize = 4096;

/// Looks up file names on behalf of one model.
pub(super) struct Finder {
    folder: PathBuf,
    /// The entries of each folder that was searched.
    listings: BTreeMap<PathBuf, Listing>,
    /// See [`Finder::absent`].
    absent: Vec<PathBuf>,
    /// See [`Finder::encoding`].
    encoding: Option<&'static Encoding>,
}

/// The entries of a folder by [`folded`] name; of several that differ in case alone, the first in
/// the order of names.
#[derive(Default)]
struct Listing {
    files: BTreeMap<Vec<u8>, PathBuf>,
    folders: BTreeMap<Vec<u8>, PathBuf>,
}

impl Finder {
    /// For the model at `model`.
    pub(super) fn new(model: &Path) -> Self {
        let folder = model.parent().unwrap_or(Path::new("")).to_path_buf();
        Self { folder, listings: BTreeMap::new(), absent: Vec::new(), encoding: None }
    }

    /// The file that `name` means, as [`Self::existing`] finds it. Where there is none, remembers
    /// that it is missing.
    pub(super) fn find(&mut self, name: impl AsRef<[u8]>) -> Option<PathBuf> {
        let name = name.as_ref();
        let found = self.existing(name);
        if found.is_none() {
            let candidates = self.first_candidates(name);
            self.absent.extend(candidates);
        }
        found
    }

    /// The paths at which a file is looked for first.
    fn first_candidates(&self, name: &[u8]) -> Vec<PathBuf> {
        if !is_possible(name) {
            return Vec::new();
        }
        let slashed = with_slashes(&unescaped(name));
        let base_name = components(&slashed).last().map(|name| name.to_vec());
        let names = [Some(slashed.clone()), base_name].into_iter().flatten();
        names.map(|name| self.folder.join(path_of(&name))).collect()
    }

    /// Says of a name for which there is no file that it was not found, or what is there instead.
    pub(super) fn why_missing(&self, name: &[u8]) -> String {
        let is_absence = |error: &io::Error| {
            use io::ErrorKind::{InvalidFilename, NotADirectory, NotFound};
            matches!(error.kind(), NotFound | NotADirectory | InvalidFilename)
        };
        let faults = self.first_candidates(name).into_iter();
        let mut faults = faults.filter_map(|path| side_file::check(&path).err());
        match faults.find(|error| !is_absence(error)) {
            Some(error) => format!("cannot be read: {error}"),
            None => "not found".to_owned(),
        }
    }

    /// The file that `name` means, where there is one. Tries the name in each of its [`forms`]: as
    /// written (relative to the model's folder); with backslashes as slashes; the end of the path
    /// below the model's folder, longest first; the same in another case of letters and another
    /// normal form; and the base name in a folder for textures beside the model.
    pub(super) fn existing(&mut self, name: impl AsRef<[u8]>) -> Option<PathBuf> {
        let name = name.as_ref();
        if !is_possible(name) {
            return None;
        }
        let literal = name.trim_ascii();
        let unescaped = unescaped(name);
        let spellings = [literal, &unescaped];
        let count = if literal == &unescaped[..] { 1 } else { 2 };
        for form in spellings[..count].iter().flat_map(|spelling| forms(spelling)) {
            let slashed = with_slashes(&form.name);
            let components = components(&slashed);
            let found = self.exactly(&form.name, &components).or_else(|| self.alike(&components));
            if found.is_some() {
                self.encoding = self.encoding.or(form.encoding);
                return found;
            }
        }
        None
    }

    /// The file at `name` as it is written, relative to the model's folder.
    pub(super) fn as_written(&self, name: &[u8]) -> Option<PathBuf> {
        let file = self.folder.join(path_of(name));
        (is_possible(name) && side_file::check(&file).is_ok()).then_some(file)
    }

    fn exactly(&self, name: &[u8], components: &[&[u8]]) -> Option<PathBuf> {
        let slashed = with_slashes(name);
        let ends = (0..components.len()).map(|from| components[from..].join(&b'/'));
        let mut candidates = [name.to_vec(), slashed].into_iter().chain(ends);
        candidates.find_map(|candidate| self.as_written(&candidate))
    }

    fn alike(&mut self, components: &[&[u8]]) -> Option<PathBuf> {
        let here = self.folder.clone();
        let below = (0..components.len()).find_map(|from| self.walk(&here, &components[from..]));
        below.or_else(|| {
            let base_name = components.last()?;
            let usual: Vec<PathBuf> = self.listing(&here).usual_folders().collect();
            usual.iter().find_map(|folder| self.walk(folder, &[base_name]))
        })
    }

    /// The file that is reached from `folder` by these names, without regard to case and normal
    /// form.
    fn walk(&mut self, folder: &Path, components: &[&[u8]]) -> Option<PathBuf> {
        let (name, parents) = components.split_last()?;
        let mut folder = folder.to_path_buf();
        for parent in parents {
            folder = match *parent {
                b".." => folder.join(".."),
                parent => self.listing(&folder).folders.get(&folded(parent))?.clone(),
            };
        }
        self.listing(&folder).files.get(&folded(name)).cloned()
    }

    fn listing(&mut self, folder: &Path) -> &Listing {
        if !self.listings.contains_key(folder) {
            self.listings.insert(folder.to_path_buf(), Listing::of(folder));
        }
        &self.listings[folder]
    }

    /// The encoding of the first name that is not UTF-8 and whose file was found: that of the
    /// model's names.
    pub(super) fn encoding(&self) -> Option<&'static Encoding> {
        self.encoding
    }

    /// Where files that were asked for and not found would be looked for first: should one appear
    /// there, the model is another.
    pub(super) fn absent(self) -> Vec<PathBuf> {
        self.absent
    }
}

impl Listing {
    /// Lists a folder; the list is empty where it is none or cannot be read.
    fn of(folder: &Path) -> Self {
        // A model named without a folder lies in the current one.
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let mut names: Vec<_> = here
            .read_dir()
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name())
            .collect();
        names.sort();
        let mut listing = Self::default();
        for name in names {
            let path = folder.join(&name);
            let entries = match side_file::check(&path) {
                Ok(()) => &mut listing.files,
                Err(_) if path.is_dir() => &mut listing.folders,
                Err(_) => continue,
            };
            entries.entry(folded(name.as_encoded_bytes())).or_insert(path);
        }
        listing
    }

    fn usual_folders(&self) -> impl Iterator<Item = PathBuf> {
        let is_usual = |name: &[u8]| USUAL_FOLDERS.iter().any(|usual| usual.as_bytes() == name);
        let folders = self.folders.iter().filter(move |(name, _)| is_usual(name));
        folders.map(|(_, folder)| folder.clone())
    }
}

/// The path that a model's bytes mean.
#[cfg(unix)]
fn path_of(name: &[u8]) -> &Path {
    use std::os::unix::ffi::OsStrExt;
    Path::new(std::ffi::OsStr::from_bytes(name))
}

/// The path that a model's bytes mean, on systems whose file names are Unicode.
#[cfg(not(unix))]
fn path_of(name: &[u8]) -> PathBuf {
    String::from_utf8_lossy(name).into_owned().into()
}

/// False of what no file is called.
fn is_possible(name: &[u8]) -> bool {
    let name = name.trim_ascii();
    !name.is_empty() && name.len() <= LONGEST_PATH && !name.contains(&0)
}

fn with_slashes(name: &[u8]) -> Vec<u8> {
    name.iter().map(|byte| if *byte == b'\\' { b'/' } else { *byte }).collect()
}

/// The names along a path.
fn components(path: &[u8]) -> Vec<&[u8]> {
    path.split(|byte| *byte == b'/').filter(|name| !matches!(name, [] | [b'.'])).collect()
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

    #[cfg(target_os = "linux")]
    #[test]
    fn names_in_other_encodings_normal_forms_and_case_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("Bilder")).unwrap();
        let gbk = encoding_rs::GBK.encode("墙.png").0.into_owned();
        for name in ["大地.png".as_bytes(), "cafe\u{301}.png".as_bytes(), "my wall.png".as_bytes()]
        {
            std::fs::write(root.join(path_of(name)), "").unwrap();
        }
        std::fs::write(root.join("Bilder/u\u{308}ber.png"), "").unwrap();
        std::fs::write(root.join(path_of(&gbk)), "").unwrap();
        let mut finder = Finder::new(&root.join("city.obj"));
        let mut found = |name: &[u8]| {
            let found = finder.find(name)?;
            Some(found.strip_prefix(root).unwrap().as_os_str().as_encoded_bytes().to_vec())
        };
        for (name, expected) in [
            ("Caf\u{e9}.PNG", "cafe\u{301}.png"),
            ("bilder\\\u{dc}BER.png", "Bilder/u\u{308}ber.png"),
            ("my\\ wall.png", "my wall.png"),
            ("\"my wall.png\"", "my wall.png"),
        ] {
            assert_eq!(found(name.as_bytes()).unwrap(), expected.as_bytes(), "{name}");
        }
        assert_eq!(found(&encoding_rs::GBK.encode("大地.png").0).unwrap(), "大地.png".as_bytes());
        assert_eq!(found("墙.png".as_bytes()).unwrap(), gbk);
        assert_eq!(found(&gbk).unwrap(), gbk);
        assert_eq!(found("壁.png".as_bytes()), None);
        assert_eq!(finder.encoding().map(Encoding::name), Some("gb18030"));
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
