//! Opens files that must be regular ones.

use std::fs::{self, File, Metadata};
use std::io::{self, Read};
use std::path::Path;

/// Checks that a path leads to a regular file, without opening it: opening a named pipe waits for
/// whoever writes into it. The error says what is there instead.
pub(crate) fn check_regular(path: &Path) -> io::Result<Metadata> {
    let metadata = fs::metadata(path)?;
    if metadata.is_dir() {
        return Err(io::Error::other("expected a file, found a folder"));
    }
    if !metadata.is_file() {
        return Err(io::Error::other("expected a regular file, found a pipe, socket or device"));
    }
    Ok(metadata)
}

/// Opens a regular file. Anything else is refused before it is opened.
pub(crate) fn open_regular(path: &Path) -> io::Result<File> {
    check_regular(path)?;
    File::open(path)
}

/// Reads all of a regular file.
pub(crate) fn read_regular(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = open_regular(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(file.metadata()?.len()).unwrap_or(0));
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}
