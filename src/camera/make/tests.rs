//! What each kind of path promises, on maps drawn by hand.

use clap::ValueEnum;
use glam::{DVec2, DVec3};

use super::plan::Plan;
use super::raster::Surfaces;
use super::*;
use crate::camera::{Frustum, up_vector};
use crate::mesh::UpAxis;

/// A town of 5 × 4 houses of 30 m with streets of 10 m between them, on a slope or with no ground
/// at all, `size` times as large.
fn town(up: UpAxis, size: f64, has_ground: bool) -> Ground {
    let extent = DVec2::new(210.0, 170.0) * size;
    let slope = if has_ground { 0.05 } else { 0.0 };
    let mut places = Vec::new();
    let mut face = |low: DVec2, high: DVec2, up: f64| {
        let at = |x: f64, y: f64| DVec3::new(x, y, x * slope + up);
        let [a, b] = [at(low.x, low.y), at(high.x, low.y)];
        let [c, d] = [at(high.x, high.y), at(low.x, high.y)];
        places.extend([[a, b, c], [a, c, d]]);
    };
    if has_ground {
        face(DVec2::ZERO, extent, 0.0);
    }
    for row in 0..4 {
        for column in 0..5 {
            let low = DVec2::new(10.0 + 40.0 * f64::from(column), 10.0 + 40.0 * f64::from(row));
            for height in [0.0, 12.0 + f64::from(row)] {
                face(low * size, (low + 30.0) * size, height * size);
            }
        }
    }
    ground_of(up, &places)
}

/// The ground of triangles on a map whose origin is far out, as surveyors have it.
fn ground_of(up: UpAxis, triangles: &[[DVec3; 3]]) -> Ground {
    let corners = triangles.iter().flatten().copied();
    let min = corners.clone().reduce(DVec3::min).unwrap();
    let max = corners.reduce(DVec3::max).unwrap();
    let middle = (min + max) / 2.0;
    let plan = Plan::new(up, DVec3::new(678_016.0, 5_403_456.0, 5_000_000.0));
    let bounds = [min - middle, max - middle];
    let scale = ground::scale(max - min);
    let mut surfaces = Surfaces::new(ground::cells(bounds.map(DVec3::truncate), scale));
    for triangle in triangles {
        surfaces.add(triangle.map(|corner| corner - middle));
    }
    Ground::new(plan, scale, bounds, true, surfaces)
}

/// All scenes that paths are tried on, by name.
fn grounds() -> Vec<(String, Ground)> {
    let mut grounds = Vec::new();
    grounds.push(("large".to_owned(), town(UpAxis::Z, 20.0, true)));
    for up in [UpAxis::Y, UpAxis::Z] {
        for (name, size, has_ground) in
            [("town", 1.0, true), ("bare town", 1.0, false), ("toy", 0.005, true)]
        {
            grounds.push((format!("{name}, {up:?}"), town(up, size, has_ground)));
        }
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let wall = [corner(0.0, 0.0, 0.0), corner(30.0, 0.0, 0.0), corner(30.0, 0.0, 9.0)];
        grounds.push((format!("a wall, {up:?}"), ground_of(up, &[wall])));
        let hill = [corner(0.0, 0.0, 0.0), corner(300.0, 0.0, 90.0), corner(0.0, 300.0, 50.0)];
        grounds.push((format!("a hill, {up:?}"), ground_of(up, &[hill])));
        grounds.push((format!("a point, {up:?}"), ground_of(up, &[[DVec3::ONE; 3]])));
    }
    grounds
}

/// Degrees between two rotations.
fn between(a: glam::DQuat, b: glam::DQuat) -> f64 {
    // Of the product rather than the angle's cosine, which is blind to small angles.
    let by = a.inverse() * b;
    2.0 * by.xyz().length().atan2(by.w.abs()).to_degrees()
}

#[test]
fn walks_and_drives_keep_their_speed_and_turn_slowly_in_every_scene() {
    for (name, ground) in grounds() {
        for (kind, speed) in [(PathKind::Walk, WALK_M_S), (PathKind::Drive, DRIVE_M_S)] {
            for fps in [30.0, 7.0] {
                let path = make_path(&ground, kind, 700, fps, 3).unwrap();
                assert_eq!(path.frames.len(), 700);
                for index in 1..path.frames.len() {
                    let found = path.velocity(index).length();
                    assert!((found / speed - 1.0).abs() < 0.01, "{name} {kind:?} {index}: {found}");
                    let [before, now] = [index - 1, index].map(|at| path.frames[at].pose);
                    let turned = between(before.rotation, now.rotation) * fps;
                    assert!(turned < MAX_TURN_DEG_S * 1.001, "{name} {kind:?} {index}: {turned}");
                    let level = now.forward().dot(up_vector(ground.plan.up()));
                    assert!(level.abs() < 1e-9, "{name}");
                }
            }
        }
    }
}

#[test]
fn nobody_walks_into_houses_or_below_the_ground() {
    for (name, ground) in grounds() {
        if !name.contains("town") {
            continue;
        }
        for kind in [PathKind::Walk, PathKind::Drive, PathKind::Still, PathKind::Shake] {
            for seed in 0..5 {
                let path = make_path(&ground, kind, 2000, 30.0, seed).unwrap();
                for frame in &path.frames {
                    let place = ground.plan.map(frame.pose.position);
                    let cell = ground.cells.at(place.truncate()).expect("on the map");
                    // Houses stand every 40 m, 30 m wide, in a rectangle of 190 by 150 m.
                    let street = |along: f64, half: f64| {
                        along.abs() > half || (along + half).rem_euclid(40.0) > 30.0
                    };
                    let is_street = street(place.x, 95.0) || street(place.y, 75.0);
                    assert!(is_street, "{name} {kind:?} {seed}: {place}");
                    assert!(ground.clearance[cell] > 0.0, "{name} {kind:?} {seed}: {place}");
                    let above = place.z - ground.height_at(place.truncate());
                    assert!((above - 1.7).abs() < 0.5, "{name} {kind:?} {seed}: {above}");
                }
            }
        }
    }
}

#[test]
fn drives_follow_the_walks_route() {
    let ground = town(UpAxis::Z, 1.0, true);
    let walk = make_path(&ground, PathKind::Walk, 2000, 30.0, 5).unwrap();
    let drive = make_path(&ground, PathKind::Drive, 200, 30.0, 5).unwrap();
    for (index, frame) in drive.frames.iter().enumerate() {
        let near =
            walk.frames.iter().map(|other| other.pose.position.distance(frame.pose.position));
        let distance = near.fold(f64::INFINITY, f64::min);
        assert!(distance < 0.1, "frame {index}: {distance}");
    }
}

#[test]
fn flights_begin_on_foot_and_end_with_everything_in_view() {
    for (name, ground) in grounds() {
        let path = make_path(&ground, PathKind::Fly, 600, 30.0, 1).unwrap();
        let walk = make_path(&ground, PathKind::Walk, 60, 30.0, 1).unwrap();
        if name.contains("town") || name.contains("large") {
            assert_eq!(path.frames[0].pose.position, walk.frames[0].pose.position, "{name}");
        }
        let [min, max] = ground.bounds;
        let corners: Vec<DVec3> = (0..8)
            .map(|bits| {
                let pick = |axis: usize| if bits >> axis & 1 == 0 { min[axis] } else { max[axis] };
                ground.plan.source(DVec3::new(pick(0), pick(1), pick(2)))
            })
            .collect();
        for (index, frame) in path.frames.iter().enumerate().skip(430) {
            for aspect in [1.0, 16.0 / 9.0] {
                let frustum = Frustum::new(&frame.pose, aspect);
                for &corner in &corners {
                    assert_eq!(frustum.outside([corner, corner]), 0.0, "{name} frame {index}");
                }
            }
        }
        // It passes over: ends on the other side.
        let (middle, _) = ground.sphere();
        let side =
            |index: usize| (ground.plan.map(path.frames[index].pose.position) - middle).truncate();
        assert!(side(430).dot(side(599)) < 0.0, "{name}");
        let sky = up_vector(ground.plan.up());
        for pair in path.frames.windows(2) {
            let turned = between(pair[0].pose.rotation, pair[1].pose.rotation);
            assert!(turned < 5.0, "{name} frame {}: {turned}", pair[1].frame);
            assert!(pair[1].pose.up().dot(sky) > 0.0, "{name}: upside down");
        }
    }
}

#[test]
fn flights_pass_through_nothing() {
    let ground = town(UpAxis::Z, 1.0, true);
    for seed in 0..5 {
        for kind in [PathKind::Fly, PathKind::Orbit] {
            for frame in make_path(&ground, kind, 900, 30.0, seed).unwrap().frames {
                let place = ground.plan.map(frame.pose.position);
                let Some(cell) = ground.cells.at(place.truncate()) else { continue };
                let is_clear = ground.clearance[cell] > 0.0 || place.z > ground.high[cell].into();
                assert!(is_clear, "{kind:?} {seed} frame {}: {place}", frame.frame);
                assert!(place.z > f64::from(ground.height[cell]) + 0.5);
            }
        }
    }
}

#[test]
fn orbits_go_round_the_middle_and_twice_through_it() {
    for (name, ground) in grounds() {
        let frames = 1001;
        let path = make_path(&ground, PathKind::Orbit, frames, 30.0, 1).unwrap();
        let centre = orbit::centre(&ground);
        let poses: Vec<Pose> = path.frames.iter().map(|frame| frame.pose).collect();
        let circle = orbit::circle_frames(frames);
        let distance = poses[0].position.distance(centre);
        let mut angle = 0.0;
        for index in 0..=circle {
            let pose = &poses[index];
            let away = centre - pose.position;
            assert!((away.length() / distance - 1.0).abs() < 1e-6, "{name}");
            assert!((pose.forward() - away.normalize()).length() < 1e-6, "{name}");
            if index > 0 {
                angle += between(poses[index - 1].rotation, pose.rotation);
            }
        }
        assert!(poses[0].position.distance(poses[circle].position) < distance * 1e-6);
        assert!(angle > 180.0, "{name}: {angle}");
        let through = |poses: &[Pose]| {
            let away =
                |pose: &Pose| (ground.plan.map(pose.position) - ground.sphere().0).truncate();
            let least = poses.iter().map(|pose| away(pose).length()).fold(f64::INFINITY, f64::min);
            let last = poses.last().unwrap();
            let gone = Frustum::new(last, 16.0 / 9.0);
            let corners = ground.bounds.map(|corner| ground.plan.source(corner));
            let bbox = [corners[0].min(corners[1]), corners[0].max(corners[1])];
            (least, gone.outside(bbox))
        };
        let width = (ground.bounds[1] - ground.bounds[0]).length().max(1.0);
        for pass in [&poses[560..750], &poses[820..]] {
            let (least, outside) = through(pass);
            assert!(least < width * 0.01, "{name}: {least}");
            assert!(outside > 0.0, "{name}: the end of a pass sees nothing");
        }
    }
}

#[test]
fn who_stands_still_stands_still_and_has_houses_in_view() {
    for (name, ground) in grounds() {
        let path = make_path(&ground, PathKind::Still, 50, 30.0, 1).unwrap();
        let first = path.frames[0].pose;
        assert!(path.frames.iter().all(|frame| frame.pose == first), "{name}");
        let frustum = Frustum::new(&first, 16.0 / 9.0);
        let corners = ground.bounds.map(|corner| ground.plan.source(corner));
        let bbox = [corners[0].min(corners[1]), corners[0].max(corners[1])];
        assert_eq!(frustum.outside(bbox), 0.0, "{name}");
    }
}

#[test]
fn who_shakes_stays_within_the_amplitude_and_returns() {
    for (name, ground) in grounds() {
        let fps = 30.0;
        let path = make_path(&ground, PathKind::Shake, 900, fps, 1).unwrap();
        let middle = path.frames[0].pose;
        let sway = SHAKE_SWAY_M * ground.scale;
        let (mut far, mut wide) = (0.0f64, 0.0f64);
        for frame in &path.frames {
            far = far.max(frame.pose.position.distance(middle.position));
            wide = wide.max(between(frame.pose.rotation, middle.rotation));
        }
        assert!(far < sway * 1.000_001 + 1e-8 && far > sway * 0.99, "{name}: {far}");
        assert!(
            wide < SHAKE_TURN_DEG * 1.000_001 && wide > SHAKE_TURN_DEG * 0.99,
            "{name}: {wide}"
        );
        let again = &path.frames[(SHAKE_PERIOD_S * fps) as usize].pose;
        assert!(again.position.distance(middle.position) < sway * 1e-6 + 1e-8, "{name}");
        assert!(between(again.rotation, middle.rotation) < 1e-6, "{name}");
    }
}

#[test]
fn who_turns_looks_away_and_back_from_one_frame_to_the_next() {
    for (name, ground) in grounds() {
        let path = make_path(&ground, PathKind::Turn, 720, 30.0, 1).unwrap();
        let first = path.frames[0].pose;
        let turns = path.frames.windows(2).filter(|pair| pair[0].pose != pair[1].pose).count();
        assert_eq!(turns, 5, "{name}: every four seconds");
        for frame in &path.frames {
            let angle = between(first.rotation, frame.pose.rotation);
            assert!(frame.pose.position == first.position);
            assert!(angle < 1e-6 || 180.0 - angle < 1e-3, "{name}: {angle}");
        }
        let ahead = path.frames.iter().filter(|frame| frame.pose == first).count();
        assert_eq!(ahead, 360, "{name}");
    }
}

#[test]
fn who_rises_has_all_in_view_a_second_after_the_street() {
    for (name, ground) in grounds() {
        let fps = 30.0;
        let path = make_path(&ground, PathKind::Rise, 1080, fps, 1).unwrap();
        let pose = |second: f64| path.frames[(second * fps) as usize].pose;
        let (street, sky) = (pose(0.0), pose(6.0));
        assert!(pose(4.9) == street && pose(10.9) == sky && pose(12.0) == street, "{name}");
        assert!(pose(5.5) != street && pose(5.5) != sky && pose(11.5) != sky, "{name}");
        let frustum = Frustum::new(&sky, 16.0 / 9.0);
        for corner in 0..8 {
            let at = |axis: usize| ground.bounds[corner >> axis & 1][axis];
            let place = ground.plan.source(DVec3::new(at(0), at(1), at(2)));
            assert!(frustum.outside([place, place]) < 1e-6, "{name}: corner {corner}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bytes_and_another_another_route() {
    let text = |ground: &Ground, kind, frames, seed| {
        let path = make_path(ground, kind, frames, 30.0, seed).unwrap();
        let mut text = Vec::new();
        crate::camera::format_path(&path, &mut text).unwrap();
        text
    };
    let (one, same) = (town(UpAxis::Z, 1.0, true), town(UpAxis::Z, 1.0, true));
    for kind in PathKind::value_variants().iter().copied() {
        assert_eq!(text(&one, kind, 300, 9), text(&same, kind, 300, 9), "{kind:?}");
    }
    for kind in [PathKind::Walk, PathKind::Drive, PathKind::Fly, PathKind::Still] {
        assert_ne!(text(&one, kind, 300, 9), text(&one, kind, 300, 10), "{kind:?}");
    }
    // A longer walk goes on where a shorter one ends.
    let (short, long) = (text(&one, PathKind::Walk, 200, 9), text(&one, PathKind::Walk, 300, 9));
    assert!(long.starts_with(&short));
}

#[test]
fn numbers_out_of_range_are_refused_and_single_frames_made() {
    let ground = town(UpAxis::Y, 1.0, true);
    for kind in PathKind::value_variants().iter().copied() {
        for (frames, fps) in
            [(0, 30.0), (usize::MAX, 30.0), (9, 0.0), (9, -1.0), (9, f64::NAN), (9, f64::INFINITY)]
        {
            let error = make_path(&ground, kind, frames, fps, 1).unwrap_err();
            assert_eq!(error.exit_code(), 2);
        }
        for frames in 1..8 {
            let path = make_path(&ground, kind, frames, 0.1, 1).unwrap();
            assert_eq!(path.frames.len(), frames, "{kind:?}");
        }
        assert_eq!(make_path(&ground, kind, 40, 1000.0, 1).unwrap().frames.len(), 40);
    }
}
