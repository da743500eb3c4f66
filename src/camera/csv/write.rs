//! Writes a path so that reading it gives the same bits.

use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use crate::camera::{CameraPath, PathFrame};
use crate::{Error, Result};

/// Writes a path into a file: beside it, renamed at the end, so that a failure leaves what was
/// there. Missing folders are made.
pub fn write_path(path: &CameraPath, out: &Path) -> Result<()> {
    for frame in &path.frames {
        check(frame)?;
    }
    let failed = |error: io::Error| {
        Error::output(out, format!("the camera path could not be written: {error}"))
    };
    if out.is_dir() {
        return Err(failed(io::ErrorKind::IsADirectory.into()));
    }
    let folder = match out.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder).map_err(failed)?;
    // A temporary folder rather than a temporary file: the file gets a new file's usual mode.
    let scratch =
        tempfile::Builder::new().prefix(".hlod-path-").tempdir_in(folder).map_err(failed)?;
    let partial = scratch.path().join("path.csv");
    let mut file = BufWriter::new(fs::File::create_new(&partial).map_err(failed)?);
    format_path(path, &mut file).and_then(|()| file.flush()).map_err(failed)?;
    drop(file);
    fs::rename(&partial, out).map_err(failed)
}

/// Writes a path as text, with the quaternion and as many digits as give the same bits again.
pub fn format_path(path: &CameraPath, mut out: impl Write) -> io::Result<()> {
    out.write_all(b"frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg\n")?;
    let mut line = String::new();
    for PathFrame { frame, time_s, pose } in &path.frames {
        line.clear();
        let _ = write!(line, "{frame},{time_s}");
        for number in pose.position.to_array().into_iter().chain(pose.rotation.to_array()) {
            let _ = write!(line, ",{number}");
        }
        let _ = writeln!(line, ",{}", pose.fov_y_deg);
        out.write_all(line.as_bytes())?;
    }
    Ok(())
}

/// Nothing is written that could not be read again.
fn check(frame: &PathFrame) -> Result<()> {
    let pose = &frame.pose;
    let holds = frame.time_s.is_finite()
        && pose.position.is_finite()
        && pose.rotation.is_normalized()
        && pose.fov_y_deg > 0.0
        && pose.fov_y_deg < 180.0;
    match holds {
        true => Ok(()),
        false => Err(Error::Internal(format!("frame {} has no camera: {frame:?}", frame.frame))),
    }
}
