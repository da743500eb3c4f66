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
    Ground::new(plan, scale, bounds, surfaces, None)
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
            if up == UpAxis::Y {
                break; // the map is the same whichever axis is up
            }
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
        let driven = route::drive_m_s(&ground);
        for (kind, speed, most) in [
            (PathKind::Walk, WALK_M_S, MAX_TURN_DEG_S),
            (PathKind::Drive, driven, MAX_DRIVING_TURN_DEG_S),
        ] {
            for fps in [30.0, 7.0] {
                let path = make_path(&ground, kind, 700, fps, 3).unwrap();
                assert_eq!(path.frames.len(), 700);
                for index in 1..path.frames.len() {
                    let found = path.velocity(index).length();
                    assert!((found / speed - 1.0).abs() < 0.01, "{name} {kind:?} {index}: {found}");
                    let [before, now] = [index - 1, index].map(|at| path.frames[at].pose);
                    let turned = between(before.rotation, now.rotation) * fps;
                    assert!(turned < most * 1.001, "{name} {kind:?} {index}: {turned}");
                    let right = now.forward().cross(now.up());
                    let level = right.dot(up_vector(ground.plan.up()));
                    assert!(level.abs() < 1e-9, "{name}: upright");
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
                    let cell = ground.surfaces.cells.at(place.truncate()).expect("on the map");
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
fn flights_begin_on_foot_and_pass_over() {
    for (name, ground) in grounds() {
        let path = make_path(&ground, PathKind::Fly, 600, 30.0, 1).unwrap();
        let walk = make_path(&ground, PathKind::Walk, 60, 30.0, 1).unwrap();
        if name.contains("town") || name.contains("large") {
            assert_eq!(path.frames[0].pose.position, walk.frames[0].pose.position, "{name}");
        }
        // It goes over what it looks at in the middle: ends on the other side of it.
        let place = |index: usize| ground.plan.map(path.frames[index].pose.position);
        let side = |index: usize| {
            let ahead = ground.plan.map(ground.plan.origin + path.frames[index].pose.forward());
            ahead.truncate()
        };
        if !name.contains("town") && !name.contains("large") {
            continue;
        }
        assert!(side(430).dot(side(599)) < 0.0, "{name}");
        assert!(place(515).z > place(430).z.min(place(599).z), "{name}");
        let sky = up_vector(ground.plan.up());
        for pair in path.frames.windows(2) {
            let turned = between(pair[0].pose.rotation, pair[1].pose.rotation);
            assert!(turned < 5.0, "{name} frame {}: {turned}", pair[1].frame);
            assert!(pair[1].pose.up().dot(sky) > 0.0, "{name}: upside down");
        }
    }
}

#[test]
fn from_above_all_of_a_city_is_in_view_that_fills_the_picture() {
    let corner = |x: f64, y: f64| DVec3::new(x * 700.0, y * 400.0, 0.0);
    let [a, b, c, d] = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    let ground = ground_of(UpAxis::Z, &[[a, b, c], [a, c, d]]);
    let eye = aerial::above(&ground, ground.focus, DVec2::NEG_Y);
    let rotation = from_angles(UpAxis::Z, eye.yaw_deg, eye.pitch_deg, 0.0);
    let pose = Pose { position: eye.place, rotation, fov_y_deg: DEFAULT_FOV_Y_DEG };
    let frustum = Frustum::new(&pose, 16.0 / 9.0);
    let [min, max] = ground.bounds;
    for place in [min, max, DVec3::new(min.x, max.y, 0.0), DVec3::new(max.x, min.y, 0.0)] {
        assert_eq!(frustum.outside([place, place]), 0.0, "{place}");
    }
}

#[test]
fn flights_pass_through_nothing() {
    let ground = town(UpAxis::Z, 1.0, true);
    for seed in 0..5 {
        for kind in [PathKind::Fly, PathKind::Orbit] {
            for frame in make_path(&ground, kind, 900, 30.0, seed).unwrap().frames {
                let place = ground.plan.map(frame.pose.position);
                let Some(cell) = ground.surfaces.cells.at(place.truncate()) else { continue };
                let is_clear =
                    ground.clearance[cell] > 0.0 || place.z > ground.surfaces.high[cell].into();
                assert!(is_clear, "{kind:?} {seed} frame {}: {place}", frame.frame);
                assert!(place.z > f64::from(ground.height[cell]) + 0.5);
            }
        }
    }
}

#[test]
fn orbits_go_round_and_twice_through_where_most_is() {
    for (name, ground) in grounds() {
        let frames = 1001;
        let path = make_path(&ground, PathKind::Orbit, frames, 30.0, 1).unwrap();
        let places: Vec<DVec3> =
            path.frames.iter().map(|frame| ground.plan.map(frame.pose.position)).collect();
        let around: Vec<DVec2> =
            places.iter().map(|place| (*place - ground.focus).truncate()).collect();
        let circle = orbit::circle_frames(frames);
        let turns = around[..=circle]
            .windows(2)
            .map(|pair| libm::atan2(pair[0].perp_dot(pair[1]), pair[0].dot(pair[1])).to_degrees());
        let angle: f64 = turns.sum();
        assert!((angle.abs() - 360.0).abs() < 1.0, "{name}: {angle}");
        let (gap, away) = (places[0].distance(places[circle]), places[0].distance(ground.focus));
        assert!(gap < 1e-6 * away, "{name}: {gap} of {away}");
        let width = (ground.bounds[1] - ground.bounds[0]).length().max(1.0);
        for pass in [560..750, 820..1001] {
            let least =
                around[pass].iter().map(|place| place.length()).fold(f64::INFINITY, f64::min);
            assert!(least < width * 0.01, "{name}: {least}");
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
        // Who looks down turns by less than the yaw does.
        let expected =
            SHAKE_TURN_DEG * middle.forward().cross(up_vector(ground.plan.up())).length();
        assert!(wide < SHAKE_TURN_DEG * 1.000_001 && wide > expected * 0.9, "{name}: {wide}");
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
            let sky = up_vector(ground.plan.up());
            let [before, now] = [first, frame.pose].map(|pose| pose.forward().reject_from(sky));
            assert!(frame.pose.position == first.position);
            let angle = before.angle_between(now).to_degrees();
            assert!(frame.pose == first || 180.0 - angle < 1e-3, "{name}: {angle}");
        }
        let ahead = path.frames.iter().filter(|frame| frame.pose == first).count();
        assert_eq!(ahead, 360, "{name}");
    }
}

#[test]
fn who_rises_is_above_a_second_after_the_street() {
    for (name, ground) in grounds() {
        let fps = 30.0;
        let path = make_path(&ground, PathKind::Rise, 1080, fps, 1).unwrap();
        let pose = |second: f64| path.frames[(second * fps) as usize].pose;
        let (street, sky) = (pose(0.0), pose(6.0));
        assert!(pose(4.9) == street && pose(10.9) == sky && pose(12.0) == street, "{name}");
        assert!(pose(5.5) != street && pose(5.5) != sky && pose(11.5) != sky, "{name}");
        let height = |pose: Pose| ground.plan.map(pose.position).z;
        let is_point = name.contains("point");
        assert!(is_point || height(sky) > height(street) + ground.eye_height(), "{name}");
        for pair in path.frames[150..=180].windows(2) {
            assert!(is_point || height(pair[1].pose) >= height(pair[0].pose), "{name}");
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

#[test]
fn eyes_of_streets_are_where_walks_go_and_those_over_a_scene_are_everywhere() {
    for up in [UpAxis::Y, UpAxis::Z] {
        let town = town(up, 1.0, true);
        let eyes: Vec<DVec3> = street_eyes(&town).iter().map(|&eye| town.plan.map(eye)).collect();
        let walk = make_path(&town, PathKind::Walk, 300, 30.0, 1).unwrap();
        for frame in &walk.frames {
            let at = town.plan.map(frame.pose.position);
            let nearest = eyes.iter().map(|eye| eye.distance(at)).fold(f64::INFINITY, f64::min);
            assert!(nearest < 1.0, "{nearest} m from {at}");
        }
        // No eye is in a house, and there are none beside the town.
        let is_in_house = |eye: &DVec3| {
            let at = eye.truncate() - town.bounds[0].truncate();
            let within = (at - 10.0).rem_euclid(DVec2::splat(40.0));
            within.cmpgt(DVec2::ZERO).all() && within.cmplt(DVec2::splat(30.0)).all()
        };
        assert!(eyes.len() > 1000 && !eyes.iter().any(is_in_house));

        let over = eyes_over(&town, 20.0, 50.0);
        assert_eq!(over.len(), 11 * 9, "210 m by 170 m");
        for eye in over {
            let at = town.plan.map(eye);
            let above = at.z - town.height_at(at.truncate());
            assert!((above - 50.0).abs() < 1e-6, "{above}");
        }
    }
}
