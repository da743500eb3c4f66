//! The copyright notice of a result: those of its inputs and of the command line.

use std::path::PathBuf;

use rayon::prelude::*;

use crate::import;

/// Separates notices. Viewers divide glTF's `asset.copyright` at semicolons.
const SEPARATOR: char = ';';

/// The notices of all inputs in their order, then `more`, each once; `None` if there is none.
pub fn joined(inputs: &[PathBuf], more: Option<&str>) -> Option<String> {
    let texts: Vec<Option<String>> =
        inputs.par_iter().map(|input| import::copyright(input)).collect();
    let mut notices: Vec<&str> = Vec::new();
    for text in texts.iter().flatten().map(String::as_str).chain(more) {
        for notice in text.split(SEPARATOR).map(str::trim).filter(|notice| !notice.is_empty()) {
            if !notices.contains(&notice) {
                notices.push(notice);
            }
        }
    }
    (!notices.is_empty()).then(|| notices.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn notices_are_joined_in_order_each_once() {
        let folder = tempfile::tempdir().unwrap();
        let input = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).unwrap();
            file
        };
        let inputs = [
            input("a.gltf", r#"{"asset": {"version": "2.0", "copyright": "© B; CC BY <A> "}}"#),
            input("b.obj", "asset copyright"),
            input("c.gltf", r#"{"asset": {"version": "2.0", "copyright": 7}}"#),
            input("d.gltf", "no JSON"),
            input("e.gltf", r#"{"asset": {"copyright": "© C;© B"}}"#),
            folder.path().join("absent.glb"),
        ];
        assert_eq!(joined(&inputs, Some("© D; © C")).unwrap(), "© B; CC BY <A>; © C; © D");
        assert_eq!(joined(&inputs[1..4], Some(" ; ")), None);
        assert_eq!(joined(&[], None), None);
    }
}
