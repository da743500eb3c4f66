//! The node hierarchy of glTF, flattened.
//!
//! Transforms are taken from the JSON as f64: cities stand at their UTM coordinates through a node's
//! translation, and the f32 that glTF libraries keep would move them by half a metre.

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

/// A mesh where a node places it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Instance {
    /// The node.
    pub(super) node: usize,
    /// The node's mesh.
    pub(super) mesh: usize,
    /// From the mesh's coordinates to the scene's.
    pub(super) world: DMat4,
}

/// All placed meshes of the default scene (the first where none is default; every node where there
/// is no scene), in the order of the hierarchy.
pub(super) fn instances(json: &Value) -> Result<Vec<Instance>, String> {
    let nodes = json["nodes"].as_array().map_or(&[][..], Vec::as_slice);
    let children_of = |node: &Value| indices(&node["children"]);
    let scene = json["scene"].as_u64().unwrap_or(0) as usize;
    let roots = match json["scenes"].get(scene) {
        Some(scene) => indices(&scene["nodes"]),
        None => {
            let mut is_child = vec![false; nodes.len()];
            for child in nodes.iter().flat_map(children_of) {
                if let Some(is_child) = is_child.get_mut(child) {
                    *is_child = true;
                }
            }
            (0..nodes.len()).filter(|node| !is_child[*node]).collect()
        }
    };
    let mut instances = Vec::new();
    let mut visited = vec![false; nodes.len()];
    let mut waiting: Vec<(usize, DMat4)> =
        roots.into_iter().rev().map(|root| (root, DMat4::IDENTITY)).collect();
    while let Some((number, parent)) = waiting.pop() {
        let node = nodes.get(number).ok_or_else(|| format!("there is no node {number}"))?;
        if std::mem::replace(&mut visited[number], true) {
            return Err(format!("node {number} is reached twice; expected a tree of nodes"));
        }
        let world = parent * local(node).map_err(|what| format!("node {number}: {what}"))?;
        if let Some(mesh) = node["mesh"].as_u64() {
            instances.push(Instance { node: number, mesh: mesh as usize, world });
        }
        waiting.extend(children_of(node).into_iter().rev().map(|child| (child, world)));
    }
    Ok(instances)
}

/// A node's own transform: its matrix, or translation · rotation · scale.
fn local(node: &Value) -> Result<DMat4, String> {
    if let Some(matrix) = numbers::<16>(node, "matrix")? {
        return Ok(DMat4::from_cols_array(&matrix));
    }
    let translation = numbers(node, "translation")?.map_or(DVec3::ZERO, DVec3::from_array);
    let scale = numbers(node, "scale")?.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = match numbers(node, "rotation")?.map(DQuat::from_array) {
        // Written with few digits it is not quite of unit length.
        Some(rotation) if rotation.length_squared() > 0.0 => rotation.normalize(),
        _ => DQuat::IDENTITY,
    };
    Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
}

/// The `N` numbers of a field; `None` where there is no such field.
fn numbers<const N: usize>(node: &Value, field: &str) -> Result<Option<[f64; N]>, String> {
    let Some(value) = node.get(field) else { return Ok(None) };
    let numbers: Option<Vec<f64>> =
        value.as_array().and_then(|values| values.iter().map(Value::as_f64).collect());
    numbers
        .and_then(|numbers| numbers.try_into().ok())
        .map(Some)
        .ok_or_else(|| format!("{field} is {value}; expected {N} numbers"))
}

/// The whole numbers of an array.
fn indices(value: &Value) -> Vec<usize> {
    let values = value.as_array().map_or(&[][..], Vec::as_slice);
    values.iter().filter_map(Value::as_u64).map(|value| value as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn transforms_multiply_down_the_tree_in_f64() {
        let json = json!({
            "scenes": [{"nodes": []}, {"nodes": [1, 0]}], "scene": 1,
            "nodes": [
                {"mesh": 0, "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 7,0,0,1]},
                {"children": [2], "translation": [678016.123456789, 5403456.987654321, 0.5]},
                {"mesh": 3, "scale": [2, 2, 2], "rotation": [0, 0, 0.5, 0.5]},
                {"mesh": 9}
            ]
        });
        let found = instances(&json).unwrap();
        assert_eq!(
            found.iter().map(|one| (one.node, one.mesh)).collect::<Vec<_>>(),
            [(2, 3), (0, 0)]
        );
        let position = found[0].world.transform_point3(DVec3::ZERO);
        assert_eq!(position, DVec3::new(678_016.123_456_789, 5_403_456.987_654_321, 0.5));
        let turned = found[0].world.transform_vector3(DVec3::X);
        assert!((turned - DVec3::new(0.0, 2.0, 0.0)).length() < 1e-12, "{turned}");
        assert_eq!(found[1].world.transform_point3(DVec3::ZERO), DVec3::new(7.0, 0.0, 0.0));
    }

    #[test]
    fn without_a_scene_every_root_counts() {
        let json = json!({"nodes": [{"mesh": 1}, {"mesh": 0, "children": [0]}]});
        let found = instances(&json).unwrap();
        assert_eq!(found.iter().map(|one| one.node).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let circle =
            json!({"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]});
        assert!(instances(&circle).unwrap_err().contains("reached twice"));
        let outside = json!({"scenes": [{"nodes": [5]}], "nodes": [{}]});
        assert!(instances(&outside).unwrap_err().contains("no node 5"));
        let short = json!({"scenes": [{"nodes": [0]}], "nodes": [{"translation": [1, 2]}]});
        assert!(instances(&short).unwrap_err().contains("expected 3 numbers"));
    }
}
