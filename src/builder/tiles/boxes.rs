//! Where inputs are, found once for all machines that build shares of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;

use rayon::prelude::*;

use super::rim::BoundingBox;
use crate::builder::inputs::text_of;
use crate::builder::sources::Sources;
use crate::format::BOXES_DIR;
use crate::{Result, import};

/// The boxes of all inputs' vertices, as files have them; `known` has those that need not be looked for. Where
/// others look for them too, what one has found is left for all in the folder `subsets`, and each begins with
/// inputs of its own, from `first` on.
pub fn boxes(
    inputs: &[PathBuf],
    known: &[Option<BoundingBox>],
    sources: &Sources,
    subsets: Option<&Path>,
    first: usize,
) -> Result<Vec<BoundingBox>> {
    let dir = subsets.map(|subsets| subsets.join(BOXES_DIR));
    let mut order: Vec<usize> = (0..inputs.len()).collect();
    order.rotate_left(first);
    let known = |at: usize| known[at].or_else(|| sources.bounds(&inputs[at]));
    let found = |&at: &usize| (at, known(at).map_or_else(|| find(&inputs[at], dir.as_deref()), Ok));
    // Not in few large pieces: others are at work on the same.
    let mut all: Vec<(usize, Result<BoundingBox>)> =
        order.par_iter().with_max_len(1).map(found).collect();
    all.sort_by_key(|(at, _)| *at);
    // Of several that cannot be read the first is told of.
    all.into_iter().map(|(_, found)| found).collect()
}

fn find(input: &Path, dir: Option<&Path>) -> Result<BoundingBox> {
    let Some(file) = dir.and_then(|dir| Some(dir.join(name(input)?))) else {
        return import::bounds(input);
    };
    if let Some(found) = fs::read(&file).ok().and_then(|text| serde_json::from_slice(&text).ok()) {
        return Ok(found);
    }
    let found = import::bounds(input)?;
    // Who cannot leave it there has found it all the same.
    drop(leave(&file, &found));
    Ok(found)
}

/// By path, size and time of the last change. `None` where there is no such file.
fn name(input: &Path) -> Option<String> {
    let facts = fs::metadata(input).ok()?;
    let changed = facts.modified().ok()?.duration_since(UNIX_EPOCH).ok()?.as_nanos();
    let text = format!("{}\n{}\n{changed}", text_of(input), facts.len());
    Some(format!("{}.json", &blake3::hash(text.as_bytes()).to_hex()[..24]))
}

fn leave(file: &Path, found: &BoundingBox) -> std::io::Result<()> {
    let dir = file.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(dir)?;
    let beside = tempfile::NamedTempFile::new_in(dir)?;
    fs::write(beside.path(), serde_json::to_vec(found)?)?;
    beside.persist(file)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_has_found_others_take() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (name, x) in [("a.obj", 1), ("b.obj", 5)] {
            fs::write(at(name), format!("v {x} 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n")).unwrap();
        }
        let inputs = [at("a.obj"), at("b.obj")];
        let of = |x: f64| [[0.0; 3], [x, 1.0, 1.0]];
        let (subsets, files) = (at("subsets"), Sources::default());
        assert_eq!(
            boxes(&inputs, &[None; 2], &files, Some(&subsets), 1).unwrap(),
            [of(1.0), of(5.0)]
        );
        let dir = subsets.join(BOXES_DIR);
        assert_eq!(fs::read_dir(&dir).unwrap().count(), 2);
        // Of the same input another's word is taken; of one that has changed since it is not.
        let file = dir.join(name(&inputs[0]).unwrap());
        fs::write(&file, serde_json::to_vec(&of(2.0)).unwrap()).unwrap();
        assert_eq!(
            boxes(&inputs, &[None; 2], &files, Some(&subsets), 0).unwrap(),
            [of(2.0), of(5.0)]
        );
        fs::write(&inputs[0], "v 33 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n").unwrap();
        assert_eq!(
            boxes(&inputs, &[None; 2], &files, Some(&subsets), 0).unwrap(),
            [of(33.0), of(5.0)]
        );
        assert_eq!(
            boxes(&inputs, &[Some(of(7.0)), None], &files, None, 0).unwrap(),
            [of(7.0), of(5.0)]
        );
        // A damaged file is no word.
        fs::write(dir.join(name(&inputs[1]).unwrap()), "[").unwrap();
        assert_eq!(
            boxes(&inputs, &[None; 2], &files, Some(&subsets), 0).unwrap(),
            [of(33.0), of(5.0)]
        );
    }
}
