//! Files that an input names: material libraries, textures and buffers.
//!
//! They come from anywhere, and a name may lead to a folder, a device or a file that is not meant to
//! be read whole. All are opened here.

use std::fs::{File, Metadata};
use std::io::{self, Read};
use std::path::Path;

use crate::format::{check_regular, open_regular};

/// Most bytes of such a file: 4 GiB, which is the most that a GLB can hold.
pub(crate) const MOST_BYTES: u64 = 1 << 32;

/// Most bytes of a material library: 256 MiB, about a million materials.
pub(crate) const MOST_LIBRARY_BYTES: u64 = 1 << 28;

/// Checks, without opening it, that there is a regular file of at most [`MOST_BYTES`]. The error
/// says what is there instead.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    check_size(&check_regular(path)?, MOST_BYTES)
}

/// Opens a file that passes [`check`].
pub(crate) fn open(path: &Path) -> io::Result<File> {
    let file = open_regular(path)?;
    check_size(&file.metadata()?, MOST_BYTES)?;
    Ok(file)
}

/// Reads all of a regular file of at most `most_bytes`.
pub(crate) fn read(path: &Path, most_bytes: u64) -> io::Result<Vec<u8>> {
    let file = open_regular(path)?;
    let metadata = file.metadata()?;
    check_size(&metadata, most_bytes)?;
    let mut bytes = Vec::with_capacity(usize::try_from(metadata.len()).unwrap_or(0));
    // Files of /proc and of some network systems are longer than they say.
    file.take(most_bytes + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 <= most_bytes {
        true => Ok(bytes),
        false => Err(too_large(bytes.len() as u64, most_bytes)),
    }
}

fn check_size(metadata: &Metadata, most_bytes: u64) -> io::Result<()> {
    match metadata.len() <= most_bytes {
        true => Ok(()),
        false => Err(too_large(metadata.len(), most_bytes)),
    }
}

fn too_large(bytes: u64, most_bytes: u64) -> io::Error {
    io::Error::other(format!("expected at most {} MiB, found {bytes} bytes", most_bytes >> 20))
}

/// Makes what is no readable file in `folder`, for tests: a pipe, a link to a device, a folder, a
/// link to itself and a sparse file of more than [`MOST_BYTES`], each with what messages say of it.
#[cfg(all(test, unix))]
pub(crate) fn make_faulty_files(folder: &Path) -> [(&'static str, &'static str); 5] {
    use std::os::unix::fs::symlink;
    let is_made = std::process::Command::new("mkfifo").arg(folder.join("pipe")).status();
    assert!(is_made.is_ok_and(|status| status.success()), "mkfifo");
    symlink("/dev/zero", folder.join("device")).unwrap();
    std::fs::create_dir(folder.join("folder")).unwrap();
    symlink("loop", folder.join("loop")).unwrap();
    File::create(folder.join("sparse")).unwrap().set_len(MOST_BYTES + 1).unwrap();
    [
        ("pipe", "found a pipe, socket or device"),
        ("device", "found a pipe, socket or device"),
        ("folder", "found a folder"),
        ("loop", "symbolic links"),
        ("sparse", "expected at most 4096 MiB, found 4294967297 bytes"),
    ]
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_file_of_a_sane_size_is_refused_and_not_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), "text").unwrap();
        assert!(check(&path("file")).is_ok() && open(&path("file")).is_ok());
        assert_eq!(read(&path("file"), 4).unwrap(), b"text");
        assert!(read(&path("file"), 3).unwrap_err().to_string().contains("found 4 bytes"));
        for (name, what) in make_faulty_files(folder.path()) {
            let refusals = [
                check(&path(name)),
                open(&path(name)).map(drop),
                read(&path(name), MOST_BYTES).map(drop),
            ];
            for refusal in refusals {
                let found = refusal.unwrap_err().to_string();
                assert!(found.contains(what), "{name}: {found}");
            }
        }
        let missing = check(&path("missing")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }
}
