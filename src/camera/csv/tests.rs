use std::path::Path;

use glam::{DQuat, DVec3};
use proptest::prelude::*;

use super::*;
use crate::Error;
use crate::camera::{CameraPath, PathFrame, Pose, from_angles, looking_at};
use crate::mesh::UpAxis;

const HEADER: &str = "frame,time_s,x,y,z,qx,qy,qz,qw,fov_y_deg";

fn parse(text: impl AsRef<[u8]>) -> crate::Result<CameraPath> {
    parse_path(text.as_ref(), Path::new("route.csv"), UpAxis::Z)
}

fn refused(text: impl AsRef<[u8]>) -> String {
    let text = text.as_ref();
    let error = parse(text).expect_err(&String::from_utf8_lossy(text));
    assert_eq!(error.exit_code(), 3);
    let Error::Input { path, what } = error else { panic!("{error}") };
    assert_eq!(path, Path::new("route.csv"));
    what
}

#[test]
fn columns_stand_in_any_order_among_spaces_and_comments() {
    let text = "# by hand\n\n qw , fov_y_deg,z,y,x,time_s,frame,qx,qy,qz\n# first\n\
                1, 45 ,3,2,1,0.5, 7,0,0,0\n";
    let path = parse(text).unwrap();
    let pose =
        Pose { position: DVec3::new(1.0, 2.0, 3.0), rotation: DQuat::IDENTITY, fov_y_deg: 45.0 };
    assert_eq!(path.frames, [PathFrame { frame: 7, time_s: 0.5, pose }]);
    // As a spreadsheet writes it.
    let windows = format!("\u{feff}{}", text.replace('\n', "\r\n").replace("# by hand\r\n", ""));
    assert_eq!(parse(windows).unwrap(), path);
}

#[test]
fn angles_and_targets_go_by_the_scenes_sky() {
    for up in [UpAxis::Y, UpAxis::Z] {
        let name = Path::new("route.csv");
        let angles = "frame,time_s,x,y,z,yaw_deg,pitch_deg\n0,0,1,2,3,30,-10\n";
        let pose = parse_path(angles.as_bytes(), name, up).unwrap().frames[0].pose;
        assert_eq!(pose.rotation, from_angles(up, 30.0, -10.0, 0.0));
        assert_eq!(pose.fov_y_deg, DEFAULT_FOV_Y_DEG);
        let roll = "frame,time_s,x,y,z,roll_deg,yaw_deg,pitch_deg\n0,0,1,2,3,5,30,-10\n";
        let pose = parse_path(roll.as_bytes(), name, up).unwrap().frames[0].pose;
        assert_eq!(pose.rotation, from_angles(up, 30.0, -10.0, 5.0));
        let target = "frame,time_s,x,y,z,tx,ty,tz\n0,0,1,2,3,9,8,7\n";
        let pose = parse_path(target.as_bytes(), name, up).unwrap().frames[0].pose;
        let expected = looking_at(up, DVec3::new(1.0, 2.0, 3.0), DVec3::new(9.0, 8.0, 7.0));
        assert_eq!(Some(pose.rotation), expected);
    }
}

#[test]
fn quaternions_of_any_length_are_normalised() {
    for scale in [1e-300, 1e-9, 3.0, 1e300] {
        let quat = [0.1, 0.2, 0.3, 0.4].map(|part: f64| (part * scale).to_string());
        let row = format!("{HEADER}\n0,0,1,2,3,{},60\n", quat.join(","));
        let rotation = parse(row).unwrap().frames[0].pose.rotation;
        let expected = DQuat::from_xyzw(0.1, 0.2, 0.3, 0.4).normalize();
        assert!(rotation.is_normalized());
        assert!((rotation - expected).length() < 1e-15, "{scale}: {rotation}");
    }
}

#[test]
fn a_bad_row_is_named_with_line_and_column_and_what_was_expected() {
    let good = "0,0,1,2,3,0,0,0,1,60";
    let row = |bad: &str| refused(format!("{HEADER}\n# note\n\n{good}\n{bad}\n{good}\n"));
    for (bad, column, expected) in [
        ("x,0,1,2,3,0,0,0,1,60", "column 1 (frame)", "expected a whole number, found \"x\""),
        ("-1,0,1,2,3,0,0,0,1,60", "column 1 (frame)", "a whole number"),
        ("1,0,1,nan,3,0,0,0,1,60", "column 4 (y)", "expected a finite number, found \"nan\""),
        ("1,0,1,2,inf,0,0,0,1,60", "column 5 (z)", "a finite number"),
        ("1,0,1,2,1e999,0,0,0,1,60", "column 5 (z)", "a finite number"),
        ("1,0,1,,3,0,0,0,1,60", "column 4 (y)", "found nothing"),
        ("1,0,1,2,3,0,0,0,0,60", "columns 6,7,8,9 (qx,qy,qz,qw)", "expected a quaternion"),
        ("1,0,1,2,3,0,0,0,1,0", "column 10 (fov_y_deg)", "less than 180"),
        ("1,0,1,2,3,0,0,0,1,180", "column 10 (fov_y_deg)", "found \"180\""),
        ("1,-1,1,2,3,0,0,0,1,60", "column 2 (time_s)", "backwards, from 0 in line 4 to -1; sort"),
        ("1,0,1,2,3,0,0,0,1", "expected 10 columns", "found 9"),
        ("1,0,1,2,3,0,0,0,1,60,5", "expected 10 columns", "found 11"),
    ] {
        let what = row(bad);
        assert!(what.starts_with(&format!("line 5: {column}")), "{bad}: {what}");
        assert!(what.contains(expected), "{bad}: {what}");
        let windows = format!("{HEADER}\r\n\r\n#\r\n{good}\r\n{bad}\r\n");
        assert_eq!(refused(windows), what);
    }
    let last = refused(format!("{HEADER}\n{good}\n# end\n1,2"));
    assert!(last.starts_with("line 4: "), "no line break at the end: {last}");
    let target = refused("frame,time_s,x,y,z,tx,ty,tz\n0,0,1,2,3,1,2,3\n");
    assert!(target.starts_with("line 2: columns 6,7,8 (tx,ty,tz): expected a target away"));
    let mut bytes = format!("{HEADER}\n0,0,1,2,").into_bytes();
    bytes.extend(b"\xff\xfe,0,0,0,1,60\n");
    assert!(refused(bytes).contains("line 2: column 5 (z): expected a finite number, found bytes"));
}

#[test]
fn what_is_no_finite_number_is_refused_in_every_column_of_every_form() {
    for (header, row) in [
        (HEADER, "0,0,1,2,3,0,0,0,1,60"),
        ("frame,time_s,x,y,z,yaw_deg,pitch_deg,roll_deg", "0,0,1,2,3,30,-10,5"),
        ("frame,time_s,x,y,z,tx,ty,tz", "0,0,1,2,3,9,8,7"),
    ] {
        let names: Vec<_> = header.split(',').collect();
        for (column, name) in names.iter().enumerate() {
            for bad in ["NaN", "-nan", "inf", "-inf", "infinity", "1e309"] {
                let mut fields: Vec<_> = row.split(',').collect();
                fields[column] = bad;
                let text = format!("{header}\n{row}\n{}\n", fields.join(","));
                let error = parse(text).unwrap_err().to_string();
                let place = format!("route.csv: line 3: column {} ({name}): ", column + 1);
                assert!(error.starts_with(&place) && error.contains(bad), "{error}");
            }
        }
    }
}

#[test]
fn a_bad_header_is_named_with_what_was_expected() {
    for (header, expected) in [
        ("", "found nothing"),
        ("\n\n# only this\n", "found nothing"),
        (HEADER, "expected a row for each frame"),
        ("frame,time_s,x,y,z,qx,qy,qz,qw,speed", "line 1: column 10: \"speed\" is not a column"),
        ("frame,time_s,x,y,z,qx,qy,qz", "expected a column qw"),
        ("frame,time_s,x,y,z", "expected columns qx,qy,qz,qw, or"),
        ("time_s,x,y,z,tx,ty,tz", "expected a column frame"),
        ("frame,time_s,x,y,z,roll_deg", "expected a column yaw_deg"),
        ("frame,time_s,x,y,z,tx,ty,tz,qx", "expected only one of"),
        ("frame,time_s,x,x,y,z,tx,ty,tz", "column 4: x stands there twice"),
        ("frame;time_s;x;y;z;tx;ty;tz", "divided by commas"),
        ("0,0,1,2,3,0,0,0,1,60", "the first line names the columns"),
    ] {
        let what = refused(header);
        assert!(what.contains(expected), "{header}: {what}");
    }
    let after_notes = refused("# one\n\n# three\nframe,what\n");
    assert!(after_notes.starts_with("line 4: column 2: \"what\""), "{after_notes}");
    assert!(refused(b"fr\xff,time_s\n").contains("line 1: column 1: expected text in UTF-8"));
    assert!(refused([0u8, 1, 2, 255].repeat(1000)).starts_with("line 1: "));
}

#[test]
fn files_are_replaced_whole_or_not_at_all() {
    let place = tempfile::tempdir().unwrap();
    let file = place.path().join("new/route.csv");
    let path = parse(format!("{HEADER}\n0,0,1,2,3,0,0,0,1,60\n")).unwrap();
    write_path(&path, &file).unwrap();
    assert_eq!(read_path(&file, UpAxis::Y).unwrap(), path);
    let before = std::fs::read(&file).unwrap();
    let mut broken = path.clone();
    broken.frames[0].pose.position.x = f64::NAN;
    assert!(write_path(&broken, &file).is_err());
    assert_eq!(std::fs::read(&file).unwrap(), before);
    assert_eq!(write_path(&path, place.path()).unwrap_err().exit_code(), 4);
    assert_eq!(write_path(&path, &file.join("below")).unwrap_err().exit_code(), 4);
    let names: Vec<_> = std::fs::read_dir(file.parent().unwrap()).unwrap().collect();
    assert_eq!(names.len(), 1, "nothing else is left there");
    for missing in [place.path().join("none.csv"), place.path().to_path_buf()] {
        assert_eq!(read_path(&missing, UpAxis::Z).unwrap_err().exit_code(), 3);
    }
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![-1e7..1e7, proptest::num::f64::NORMAL, Just(-0.0)]
}

fn frames() -> impl Strategy<Value = Vec<PathFrame>> {
    let quat = [-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.01..1.0];
    let frame =
        (any::<u64>(), 0.0..1.0, [coordinate(), coordinate(), coordinate()], quat, 1e-3..179.9);
    proptest::collection::vec(frame, 1..20).prop_map(|rows| {
        let mut time_s = 0.0;
        rows.into_iter()
            .map(|(frame, step, position, quat, fov_y_deg)| {
                time_s += step;
                let rotation = DQuat::from_array(quat).normalize();
                let pose = Pose { position: DVec3::from_array(position), rotation, fov_y_deg };
                PathFrame { frame, time_s, pose }
            })
            .collect()
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_again_bit_for_bit(frames in frames()) {
        let path = CameraPath { frames };
        let mut text = Vec::new();
        format_path(&path, &mut text).unwrap();
        let again = parse(&text).unwrap();
        prop_assert_eq!(&again, &path);
        let mut second = Vec::new();
        format_path(&again, &mut second).unwrap();
        prop_assert_eq!(second, text);
    }

    #[test]
    fn corrupted_files_are_refused_or_read_as_something_finite(
        frames in frames(),
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut text = Vec::new();
        format_path(&CameraPath { frames }, &mut text).unwrap();
        for (place, byte) in changes {
            let place = place.index(text.len());
            text[place] = byte;
        }
        text.truncate(cut.index(text.len()) + 1);
        match parse(&text) {
            Err(error) => prop_assert_eq!(error.exit_code(), 3),
            Ok(path) => {
                prop_assert!(!path.frames.is_empty());
                for frame in &path.frames {
                    prop_assert!(frame.time_s.is_finite() && frame.pose.position.is_finite());
                    prop_assert!(frame.pose.rotation.is_normalized());
                }
            }
        }
    }

    #[test]
    fn any_bytes_are_read_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let _ = parse(&bytes);
        let mut text = HEADER.as_bytes().to_vec();
        text.push(b'\n');
        text.extend(bytes);
        let _ = parse(&text);
    }
}

#[test]
fn a_frame_number_that_comes_twice_is_refused_with_both_lines() {
    let row = |frame: u64| format!("{frame},{frame},1,2,3,0,0,0,1,60\n");
    let text = |frames: &[u64]| -> String {
        [format!("{HEADER}\n"), frames.iter().map(|&frame| row(frame)).collect()].concat()
    };
    let what = refused(text(&[4, 5, 5]));
    assert!(what.starts_with("line 4: column 1 (frame): expected each number once"), "{what}");
    assert!(what.contains("found 5 as in line 3"), "{what}");
    assert!(parse(text(&[4, 7, 9])).is_ok());
}
