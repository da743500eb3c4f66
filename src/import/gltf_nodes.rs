//! The node hierarchy of glTF, flattened.
//!
//! Transforms are taken from the JSON as f64: cities stand at their UTM coordinates through a node's
//! translation, and the f32 that glTF libraries keep would move them by half a metre.

use std::collections::BTreeSet;

use glam::{DMat4, DQuat, DVec3};
use serde_json::Value;

/// A mesh where a node places it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Placement {
    /// The node.
    pub(super) node: usize,
    /// The node's mesh.
    pub(super) mesh: usize,
    /// From the mesh's coordinates to the scene's; with instances, from the node's coordinates.
    pub(super) world: DMat4,
    /// The node's skin. `world` is that of its first joint then, since a skin alone places its mesh
    /// (glTF 2.0, section 3.7.3.3).
    pub(super) skin: Option<usize>,
    /// EXT_mesh_gpu_instancing: the mesh is placed once for each element of these accessors.
    pub(super) instances: Option<InstanceAccessors>,
    /// True if an animation moves the node or one above it.
    pub(super) is_animated: bool,
}

/// Accessors of the transforms of a node's instances; what is absent is the identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct InstanceAccessors {
    pub(super) translation: Option<usize>,
    pub(super) rotation: Option<usize>,
    pub(super) scale: Option<usize>,
}

impl InstanceAccessors {
    /// Those of a node; `None` if it has no instances or no attribute says where they are.
    fn read(node: &Value) -> Option<Self> {
        let attributes = &node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        let accessor = |name: &str| attributes[name].as_u64().map(|index| index as usize);
        let read = Self {
            translation: accessor("TRANSLATION"),
            rotation: accessor("ROTATION"),
            scale: accessor("SCALE"),
        };
        read.any().map(|_| read)
    }

    /// One of the accessors. All must have the same number of elements.
    pub(super) fn any(&self) -> Option<usize> {
        self.translation.or(self.rotation).or(self.scale)
    }
}

/// All placed meshes of the default scene (the first where none is default or the default is not
/// there; every node where there is no scene), in the order of the hierarchy. The file's CESIUM_RTC
/// moves all of them; nodes that KHR_node_visibility hides, and those below, are left out.
pub(super) fn placements(json: &Value) -> Result<Vec<Placement>, String> {
    let nodes = json["nodes"].as_array().map_or(&[][..], Vec::as_slice);
    let children_of = |node: &Value| indices(&node["children"]);
    let scene = json["scene"].as_u64().unwrap_or(0) as usize;
    let scenes = &json["scenes"];
    let roots = match scenes.get(scene).or_else(|| scenes.get(0)) {
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
    let animated = animated_nodes(json);
    let center = numbers(&json["extensions"]["CESIUM_RTC"], "center")
        .map_err(|what| format!("CESIUM_RTC: {what}"))?;
    let root = DMat4::from_translation(center.map_or(DVec3::ZERO, DVec3::from_array));
    let mut placements = Vec::new();
    let mut visited = vec![false; nodes.len()];
    let mut worlds = vec![None; nodes.len()];
    let mut waiting: Vec<(usize, DMat4, bool)> =
        roots.into_iter().rev().map(|node| (node, root, false)).collect();
    while let Some((number, parent, is_animated)) = waiting.pop() {
        let node = nodes.get(number).ok_or_else(|| format!("there is no node {number}"))?;
        if std::mem::replace(&mut visited[number], true) {
            return Err(format!("node {number} is reached twice; expected a tree of nodes"));
        }
        if node["extensions"]["KHR_node_visibility"]["visible"] == false {
            continue;
        }
        let is_animated = is_animated || animated.contains(&number);
        let world = parent * local(node).map_err(|what| format!("node {number}: {what}"))?;
        worlds[number] = Some(world);
        if let Some(mesh) = node["mesh"].as_u64() {
            placements.push(Placement {
                node: number,
                mesh: mesh as usize,
                world,
                skin: node["skin"].as_u64().map(|skin| skin as usize),
                instances: InstanceAccessors::read(node),
                is_animated,
            });
        }
        let children = children_of(node).into_iter().rev();
        waiting.extend(children.map(|child| (child, world, is_animated)));
    }
    for placement in &mut placements {
        let joint = placement.skin.and_then(|skin| json["skins"][skin]["joints"][0].as_u64());
        let joint = joint.and_then(|joint| *worlds.get(joint as usize)?);
        placement.world = joint.unwrap_or(placement.world);
    }
    Ok(placements)
}

/// The nodes that are the target of an animation.
fn animated_nodes(json: &Value) -> BTreeSet<usize> {
    let animations = json["animations"].as_array().map_or(&[][..], Vec::as_slice);
    let channels = animations.iter().filter_map(|animation| animation["channels"].as_array());
    let targets = channels.flatten().filter_map(|channel| channel["target"]["node"].as_u64());
    targets.map(|node| node as usize).collect()
}

/// A node's own transform: its matrix, or translation · rotation · scale.
fn local(node: &Value) -> Result<DMat4, String> {
    if let Some(matrix) = numbers::<16>(node, "matrix")? {
        return Ok(DMat4::from_cols_array(&matrix));
    }
    let translation = numbers(node, "translation")?.map_or(DVec3::ZERO, DVec3::from_array);
    let scale = numbers(node, "scale")?.map_or(DVec3::ONE, DVec3::from_array);
    let rotation = numbers(node, "rotation")?.map_or(DQuat::IDENTITY, unit_quaternion);
    Ok(DMat4::from_scale_rotation_translation(scale, rotation, translation))
}

/// A rotation whose quaternion, written with few digits, is not quite of unit length.
pub(super) fn unit_quaternion(components: [f64; 4]) -> DQuat {
    let quaternion = DQuat::from_array(components);
    match quaternion.length_squared() > 0.0 {
        true => quaternion.normalize(),
        false => DQuat::IDENTITY,
    }
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
        let found = placements(&json).unwrap();
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
        let found = placements(&json).unwrap();
        assert_eq!(found.iter().map(|one| one.node).collect::<Vec<_>>(), [1, 0]);
    }

    #[test]
    fn what_is_no_tree_is_refused() {
        let circle =
            json!({"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]});
        assert!(placements(&circle).unwrap_err().contains("reached twice"));
        let outside = json!({"scenes": [{"nodes": [5]}], "nodes": [{}]});
        assert!(placements(&outside).unwrap_err().contains("no node 5"));
        let short = json!({"scenes": [{"nodes": [0]}], "nodes": [{"translation": [1, 2]}]});
        assert!(placements(&short).unwrap_err().contains("expected 3 numbers"));
    }
}
