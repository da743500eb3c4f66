//! Reads a path, and says of a bad one what is wrong where.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

use csv::{ByteRecord, ErrorKind, ReaderBuilder, Terminator, Trim};
use glam::{DQuat, DVec3};

use super::DEFAULT_FOV_Y_DEG;
use super::columns::{Columns, Orientation, shown};
use super::time_unit::check_seconds;
use crate::camera::{CameraPath, PathFrame, Pose, from_angles, looking_at};
use crate::mesh::UpAxis;
use crate::{Error, Result};

/// A quaternion whose squared length is this close to 1 is kept as it is, bit for bit.
const UNIT_TOLERANCE: f64 = 1e-12;

/// Reads the path in a file. Angles and targets are relative to the sky of the scene, `up`.
pub fn read_path(path: &Path, up: UpAxis) -> Result<CameraPath> {
    let file = File::open(path)
        .and_then(|file| match file.metadata()?.is_dir() {
            true => Err(std::io::Error::from(std::io::ErrorKind::IsADirectory)),
            false => Ok(file),
        })
        .map_err(|error| Error::input(path, format!("cannot read the camera path: {error}")))?;
    parse_path(BufReader::new(file), path, up)
}

/// Reads a path; `path` is for messages only.
pub fn parse_path(text: impl Read, path: &Path, up: UpAxis) -> Result<CameraPath> {
    parse(text, up).map_err(|what| Error::input(path, what))
}

fn parse(text: impl Read, up: UpAxis) -> Result<CameraPath, String> {
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .comment(Some(b'#'))
        // A carriage return before it is trimmed; lines are counted by line feeds.
        .terminator(Terminator::Any(b'\n'))
        // The last line ends as the others do, so that it is counted as they are.
        .from_reader(text.chain(&b"\n"[..]));
    let mut record = ByteRecord::new();
    if !next(&mut reader, &mut record)? {
        return Err("expected a header that names the columns, found nothing".to_owned());
    }
    let header = line_of(&reader, &record);
    let names = header_names(&record).map_err(|what| format!("line {header}: {what}"))?;
    let columns = Columns::new(names).map_err(|what| format!("line {header}: {what}"))?;
    let mut frames: Vec<PathFrame> = Vec::new();
    let mut lines = Vec::new();
    while next(&mut reader, &mut record)? {
        let row = Row { columns: &columns, record: &record };
        let line = line_of(&reader, &record);
        let before = frames.last().zip(lines.last().copied());
        let frame = row.frame(up, before).map_err(|what| format!("line {line}: {what}"))?;
        frames.push(frame);
        lines.push(line);
    }
    if frames.is_empty() {
        return Err("expected a row for each frame after the header, found none".to_owned());
    }
    check_numbers(&frames, &lines, &columns)?;
    let stamps: Vec<f64> = frames.iter().map(|frame| frame.time_s).collect();
    check_seconds(&stamps).map_err(|wrong| {
        let (line, column) = (lines[wrong.row], columns.time + 1);
        format!("line {line}: column {column} (time_s): expected seconds, found {}", wrong.found)
    })?;
    Ok(CameraPath { frames })
}

/// Refuses a frame number that comes twice: reports name frames by it.
fn check_numbers(frames: &[PathFrame], lines: &[u64], columns: &Columns) -> Result<(), String> {
    let mut known: BTreeMap<u64, u64> = BTreeMap::new();
    for (frame, &line) in frames.iter().zip(lines) {
        if let Some(first) = known.insert(frame.frame, line) {
            return Err(format!(
                "line {line}: column {} (frame): expected each number once, found {} as in line \
                 {first}; number the frames anew",
                columns.frame + 1,
                frame.frame
            ));
        }
    }
    Ok(())
}

/// Reads the next line that is not blank; false at the end.
fn next<R: Read>(reader: &mut csv::Reader<R>, record: &mut ByteRecord) -> Result<bool, String> {
    loop {
        let found = reader.read_byte_record(record).map_err(|error| match error.kind() {
            ErrorKind::Io(error) => format!("cannot read the camera path: {error}"),
            _ => error.to_string(),
        })?;
        if !found || record.len() != 1 || !record[0].is_empty() {
            return Ok(found);
        }
    }
}

/// The line that a record begins in. The reader's own count takes comments and empty lines before
/// a record for a part of it, so this counts back from the record's end.
fn line_of<R: Read>(reader: &csv::Reader<R>, record: &ByteRecord) -> u64 {
    let within = record.as_slice().iter().filter(|&&byte| byte == b'\n').count() as u64;
    reader.position().line().saturating_sub(1 + within).max(1)
}

fn header_names(record: &ByteRecord) -> Result<Vec<String>, String> {
    let name = |(index, bytes): (usize, &[u8])| {
        let text = std::str::from_utf8(bytes)
            .map_err(|_| format!("column {}: expected text in UTF-8", index + 1))?;
        // What spreadsheets put before the text of a file.
        let text = if index == 0 { text.trim_start_matches('\u{feff}') } else { text };
        Ok(text.trim().to_owned())
    };
    record.iter().enumerate().map(name).collect()
}

/// A row and what its columns mean.
struct Row<'a> {
    columns: &'a Columns,
    record: &'a ByteRecord,
}

impl Row<'_> {
    /// The frame of this row. `before` is that of the row before, with its line.
    fn frame(&self, up: UpAxis, before: Option<(&PathFrame, u64)>) -> Result<PathFrame, String> {
        let (columns, found) = (self.columns, self.record.len());
        if found != columns.names.len() {
            return Err(format!("expected {} columns, found {found}", columns.names.len()));
        }
        let frame = self.frame_number()?;
        let time_s = self.number(columns.time)?;
        if let Some((before, line)) = before.filter(|(before, _)| time_s < before.time_s) {
            return Err(format!(
                "column {} (time_s): time runs backwards, from {} in line {line} to {time_s}; sort \
                 the rows by time, or put joined recordings into files of their own",
                columns.time + 1,
                before.time_s
            ));
        }
        let position = DVec3::from_array(self.numbers(columns.eye)?);
        let rotation = self.rotation(up, position)?;
        let fov_y_deg = match columns.fov {
            None => DEFAULT_FOV_Y_DEG,
            Some(column) => match self.number(column)? {
                degrees if degrees > 0.0 && degrees < 180.0 => degrees,
                _ => return Err(self.wrong(column, "more than 0 and less than 180 degrees")),
            },
        };
        Ok(PathFrame { frame, time_s, pose: Pose { position, rotation, fov_y_deg } })
    }

    fn rotation(&self, up: UpAxis, eye: DVec3) -> Result<DQuat, String> {
        match self.columns.orientation {
            Orientation::Quaternion(columns) => unit(self.numbers(columns)?).ok_or_else(|| {
                format!("{}: expected a quaternion, found 0,0,0,0", self.span(&columns))
            }),
            Orientation::Angles(columns, roll) => {
                let [yaw, pitch] = self.numbers(columns)?;
                let roll = roll.map_or(Ok(0.0), |column| self.number(column))?;
                Ok(from_angles(up, yaw, pitch, roll))
            }
            Orientation::Target(columns) => {
                let target = DVec3::from_array(self.numbers(columns)?);
                looking_at(up, eye, target).ok_or_else(|| {
                    format!(
                        "{}: expected a target away from the eye at {},{},{}, found {},{},{}",
                        self.span(&columns),
                        eye.x,
                        eye.y,
                        eye.z,
                        target.x,
                        target.y,
                        target.z
                    )
                })
            }
        }
    }

    fn frame_number(&self) -> Result<u64, String> {
        let column = self.columns.frame;
        self.text(column)
            .and_then(|text| text.parse().ok())
            .ok_or_else(|| self.wrong(column, "a whole number"))
    }

    fn numbers<const N: usize>(&self, columns: [usize; N]) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for (number, column) in numbers.iter_mut().zip(columns) {
            *number = self.number(column)?;
        }
        Ok(numbers)
    }

    fn number(&self, column: usize) -> Result<f64, String> {
        self.text(column)
            .and_then(|text| text.parse().ok())
            .filter(|number: &f64| number.is_finite())
            .ok_or_else(|| self.wrong(column, "a finite number"))
    }

    fn text(&self, column: usize) -> Option<&str> {
        std::str::from_utf8(self.record.get(column)?).ok()
    }

    fn wrong(&self, column: usize, expected: &str) -> String {
        let place = format!("column {} ({})", column + 1, self.columns.names[column]);
        match self.text(column) {
            Some("") => format!("{place}: expected {expected}, found nothing"),
            Some(text) => format!("{place}: expected {expected}, found {:?}", shown(text)),
            None => format!("{place}: expected {expected}, found bytes that are not UTF-8"),
        }
    }

    fn span(&self, columns: &[usize]) -> String {
        let numbers: Vec<_> = columns.iter().map(|column| (column + 1).to_string()).collect();
        let names: Vec<_> = columns.iter().map(|&at| self.columns.names[at].as_str()).collect();
        format!("columns {} ({})", numbers.join(","), names.join(","))
    }
}

/// The quaternion of length 1 in the same direction; `None` where there is no direction.
fn unit(numbers: [f64; 4]) -> Option<DQuat> {
    let quat = DQuat::from_array(numbers);
    if (quat.length_squared() - 1.0).abs() <= UNIT_TOLERANCE {
        return Some(quat);
    }
    // Squares of very large and very small numbers leave the range of f64.
    let most = numbers.iter().fold(0.0f64, |most, number| most.max(number.abs()));
    (most > 0.0).then(|| DQuat::from_array(numbers.map(|number| number / most)).normalize())
}
