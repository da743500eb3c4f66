//! Which column of a path file holds what.

/// Where the rotation of the camera comes from, as columns of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    /// `qx,qy,qz,qw`.
    Quaternion([usize; 4]),
    /// `yaw_deg,pitch_deg` and perhaps `roll_deg`.
    Angles([usize; 2], Option<usize>),
    /// `tx,ty,tz`.
    Target([usize; 3]),
}

/// The header of a path file, understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Columns {
    /// The names as they stand in the file, without the spaces around them.
    pub(super) names: Vec<String>,
    pub(super) frame: usize,
    pub(super) time: usize,
    pub(super) eye: [usize; 3],
    pub(super) orientation: Orientation,
    pub(super) fov: Option<usize>,
}

const QUATERNION: [&str; 4] = ["qx", "qy", "qz", "qw"];
const ANGLES: [&str; 2] = ["yaw_deg", "pitch_deg"];
const ROLL: &str = "roll_deg";
const TARGET: [&str; 3] = ["tx", "ty", "tz"];
const FIXED: [&str; 6] = ["frame", "time_s", "x", "y", "z", "fov_y_deg"];
/// Longer names are cut in messages.
const SHOWN_CHARS: usize = 40;

impl Columns {
    /// Understands a header, or says what is wrong with it.
    pub(super) fn new(names: Vec<String>) -> Result<Self, String> {
        let known = || FIXED.iter().chain(&QUATERNION).chain(&ANGLES).chain([&ROLL]).chain(&TARGET);
        for (index, name) in names.iter().enumerate() {
            if !known().any(|known| known == name) {
                return Err(unknown(name, names.len(), index));
            }
            if names[..index].contains(name) {
                return Err(format!("column {}: {name} stands there twice", index + 1));
            }
        }
        let find = |name: &str| names.iter().position(|found| found == name);
        let need = |name: &str| {
            find(name).ok_or_else(|| {
                format!("expected a column {name}, found {}", shown(&names.join(",")))
            })
        };
        let has = |group: &[&str]| group.iter().any(|name| find(name).is_some());
        let has_angles = has(&ANGLES) || has(&[ROLL]);
        let orientation = match (has(&QUATERNION), has_angles, has(&TARGET)) {
            (true, false, false) => Orientation::Quaternion(all(QUATERNION, need)?),
            (false, true, false) => Orientation::Angles(all(ANGLES, need)?, find(ROLL)),
            (false, false, true) => Orientation::Target(all(TARGET, need)?),
            (false, false, false) => {
                return Err(format!(
                    "expected columns qx,qy,qz,qw, or yaw_deg,pitch_deg,roll_deg, or tx,ty,tz, \
                     found {}",
                    shown(&names.join(","))
                ));
            }
            _ => {
                return Err(
                    "expected only one of quaternion, angles and target, found columns of \
                            several"
                        .to_owned(),
                );
            }
        };
        Ok(Self {
            frame: need("frame")?,
            time: need("time_s")?,
            eye: all(["x", "y", "z"], need)?,
            orientation,
            fov: find("fov_y_deg"),
            names,
        })
    }
}

fn all<const N: usize>(
    names: [&str; N],
    need: impl Fn(&str) -> Result<usize, String>,
) -> Result<[usize; N], String> {
    let mut columns = [0; N];
    for (column, name) in columns.iter_mut().zip(names) {
        *column = need(name)?;
    }
    Ok(columns)
}

fn unknown(name: &str, count: usize, index: usize) -> String {
    let hint = if count == 1 && name.contains([';', '\t', ' ']) {
        "; columns are divided by commas"
    } else if name.trim().parse::<f64>().is_ok() {
        "; the first line names the columns"
    } else {
        ""
    };
    format!(
        "column {}: {:?} is not a column of a camera path; expected \
         frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg, or yaw_deg,pitch_deg,roll_deg or tx,ty,tz in \
         place of the quaternion{hint}",
        index + 1,
        shown(name)
    )
}

/// A piece of a file, short enough for a message.
pub(super) fn shown(text: &str) -> String {
    match text.char_indices().nth(SHOWN_CHARS) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
