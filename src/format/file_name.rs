//! Which file names an output folder may use.

/// True for a name that is safe to join to a folder and to stand in a URI on every system:
/// letters, digits, `.`, `_` and `-` of ASCII, not beginning with a dot, at most 200 bytes.
///
/// Names in a scene file pass this test or the scene is refused, so that no file outside the
/// output folder can be named.
pub fn is_plain_file_name(name: &str) -> bool {
    !name.is_empty()
        && name.len() <= 200
        && !name.starts_with('.')
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"._-".contains(&byte))
}

#[cfg(test)]
mod tests {
    use super::is_plain_file_name;

    #[test]
    fn folders_and_odd_characters_are_refused() {
        assert!(is_plain_file_name("b0007-2-13.glb"));
        let long = "x".repeat(201);
        for name in ["", ".", "..", ".hidden", "a/b", "../x.glb", "a\\b", "c:x", "a b", "é", &long]
        {
            assert!(!is_plain_file_name(name), "{name:?}");
        }
    }
}
