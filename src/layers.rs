//! A test: modules use those of lower layers alone, as `lib.rs` and `builder/mod.rs` list them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The layer of each module that a file's documentation lists: lines such as `//! 2. [mesh]: …`, names in backticks,
/// the lowest first, and lines that go on from these.
fn layers(text: &str) -> BTreeMap<String, usize> {
    let mut layers = BTreeMap::new();
    let mut layer = 0;
    for line in text.lines().take_while(|line| line.starts_with("//!")) {
        let line = line.trim_start_matches("//!");
        let number = line.trim_start().split_once(". ").and_then(|(number, _)| number.parse().ok());
        layer = match number {
            Some(number) => number,
            None if line.starts_with("    ") => layer,
            None => 0,
        };
        for name in line.split('`').skip(1).step_by(2).filter(|_| layer > 0) {
            layers.insert(name.trim_start_matches("mod@").to_owned(), layer);
        }
    }
    layers
}

/// The names that follow `prefix` in code, comments and tests left out.
fn used(text: &str, prefix: &str) -> BTreeSet<String> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let code: Vec<&str> =
        code.lines().map(|line| line.split("//").next().unwrap_or_default()).collect();
    let code = code.join("\n");
    let mut names = BTreeSet::new();
    for rest in code.split(prefix).skip(1) {
        if !rest.starts_with('{') {
            names.insert(name_of(rest));
            continue;
        }
        let mut depth = 0;
        for (at, letter) in rest.char_indices() {
            match letter {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                break;
            }
            if depth == 1 && matches!(letter, '{' | ',') {
                names.insert(name_of(rest[at + 1..].trim_start()));
            }
        }
    }
    names
}

fn name_of(text: &str) -> String {
    text.chars().take_while(|&letter| letter.is_alphanumeric() || letter == '_').collect()
}

/// Lists modules without a layer, and modules that use one that is not below them. `code` has the source
/// files, each with its module's name.
fn faults(
    layers: &BTreeMap<String, usize>,
    code: &[(String, String)],
    prefix: &str,
) -> Vec<String> {
    let mut faults = Vec::new();
    for (module, text) in code {
        let Some(own) = layers.get(module) else {
            faults.push(format!("{module} has no layer"));
            continue;
        };
        for other in used(text, prefix) {
            if other != *module && layers.get(&other).is_some_and(|layer| layer >= own) {
                faults.push(format!("{module} uses {other}, which is not below it"));
            }
        }
    }
    faults.dedup();
    faults
}

/// The files below a folder, each with the module of the folder that it is of.
fn files(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(inner) = folders.pop() {
        for entry in std::fs::read_dir(&inner).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let inside = path.strip_prefix(folder).unwrap().with_extension("");
            let inside = inside.to_str().unwrap().replace('\\', "/");
            let (module, name) = inside.split_once('/').unwrap_or((&inside, &inside));
            let of_tests = |name: &str| {
                name.split('/').any(|part| part.ends_with("tests") || part.starts_with("test_"))
            };
            let alone = ["lib", "mod", "bin", "layers", "scaling"];
            if path.extension().is_some_and(|end| end == "rs")
                && !of_tests(name)
                && !alone.contains(&module)
            {
                found.push((module.to_owned(), std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    found.sort();
    found
}

#[test]
fn modules_use_lower_layers_alone() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (folder, list, prefix) in
        [("", "lib.rs", "crate::"), ("builder", "builder/mod.rs", "crate::builder::")]
    {
        let layers = layers(&std::fs::read_to_string(source.join(list)).unwrap());
        let files = files(&source.join(folder));
        assert!(
            layers.len() > 20 && files.len() > layers.len(),
            "{} {}",
            layers.len(),
            files.len()
        );
        assert_eq!(faults(&layers, &files, prefix), [""; 0], "{list}");
    }
}

#[test]
fn a_module_that_uses_a_higher_one_is_found() {
    let layers =
        layers("//! Text.\n//! 1. [`low`]: first,\n//!    [`beside`]\n//! 2. [`mod@high`]\n");
    assert_eq!(layers.len(), 3);
    let faults = |module: &str, code: &str| {
        faults(&layers, &[(module.into(), code.into())], "crate::").join(", ")
    };
    assert_eq!(faults("high", "use crate::low::A;\nuse crate::{beside, low::{B, C}};"), "");
    assert_eq!(faults("low", "// crate::high\nuse crate::low::D;"), "");
    let higher = "low uses high, which is not below it";
    assert_eq!(faults("low", "use crate::high::A;"), higher);
    assert_eq!(faults("low", "use crate::{\n    low::A,\n    high::B,\n};"), higher);
    assert_eq!(faults("low", "let a = crate::high::a();"), higher);
    assert_eq!(faults("low", "#[cfg(test)]\nmod tests {\n    use crate::high::A;\n}"), "");
    assert_eq!(faults("low", "use crate::beside::A;"), "low uses beside, which is not below it");
    assert_eq!(faults("other", ""), "other has no layer");
}
