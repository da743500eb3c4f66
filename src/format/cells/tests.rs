use std::path::Path;

use super::super::index_file::check_damage;
use super::*;

fn cells() -> Cells {
    let face = Face {
        file: "c-1_2_0-0.glb".into(),
        file_bytes: 1234,
        file_crc: 7,
        vertices: 4,
        triangles: 2,
        bounds: [[0.0; 3], [1.0; 3]],
        error: 0.004,
        views: vec![FaceView {
            size: [512, 99],
            solid_angle: 0.5,
            projection: [1.0, 0.0, 0.0, 2.0],
        }],
    };
    let cell = |i: i64, faces| Cell { place: [i, 2, 0], cull_box: [[-10.0; 3], [20.0; 3]], faces };
    Cells {
        scene: [3; 32],
        parameters: serde_json::json!({"cell": 4.0}),
        size: 4.0,
        texel: 0.004,
        cells: vec![cell(-1, 0..1), cell(3, 1..1)],
        faces: vec![face],
    }
}

fn read(bytes: &[u8]) -> Result<Cells, String> {
    Cells::from_bytes(bytes, Path::new("cells.hlod")).map_err(|error| error.to_string())
}

#[test]
fn what_is_written_is_read() {
    let cells = cells();
    assert_eq!(read(&cells.to_bytes().unwrap()), Ok(cells));
}

#[test]
fn a_point_is_in_the_cell_around_it() {
    let cells = cells();
    assert_eq!(cells.place_of([-0.5, 11.9, 4.0]), [-1, 2, 1]);
    let [min, max] = cells.bounds([-1, 2, 1]);
    assert_eq!((min, max), ([-4.0, 8.0, 4.0], [0.0, 12.0, 8.0]));
}

#[test]
fn damage_is_named_and_never_believed() {
    check_damage(&cells().to_bytes().unwrap(), read);
}

#[test]
fn what_cannot_be_is_refused() {
    let refused = |change: &dyn Fn(&mut Cells), expected: &str| {
        let mut cells = cells();
        change(&mut cells);
        let error = read(&cells.to_bytes().unwrap()).unwrap_err();
        assert!(error.contains(expected), "{error}");
    };
    refused(&|cells| cells.size = 0.0, "above 0");
    refused(&|cells| cells.cells.reverse(), "order of places");
    refused(&|cells| cells.faces[0].file = "../x.glb".into(), "plain");
    refused(&|cells| cells.cells[0].cull_box[0][1] = f64::NAN, "cull box");
    refused(&|cells| cells.faces[0].views[0].projection[3] = f32::INFINITY, "a view of");
}

#[test]
fn cells_come_and_go_with_their_faces() {
    let mut some = cells();
    let face = Face { file: "other.glb".into(), ..some.faces[0].clone() };
    let cell = Cell { place: [0, 0, 0], cull_box: [[0.0; 3]; 2], faces: 0..0 };
    some.add(vec![(cell, vec![face.clone(), face])]);
    let places: Vec<i64> = some.cells.iter().map(|cell| cell.place[0]).collect();
    let files = |cells: &Cells, place| -> Vec<String> {
        let of_cell = cells.faces_of(cells.cell(place).unwrap());
        of_cell.iter().map(|face| face.file.clone()).collect()
    };
    assert_eq!(places, [-1, 0, 3]);
    assert_eq!(files(&some, [0, 0, 0]), ["other.glb"; 2]);
    assert_eq!(files(&some, [-1, 2, 0]), ["c-1_2_0-0.glb"]);
    assert_eq!(files(&some, [3, 2, 0]), [""; 0]);
    some.retain(|faces| faces.iter().all(|face| face.file != "other.glb"));
    assert_eq!(some, cells());
}
