//! The hierarchy of a scene, for programs and for people.

use std::fmt::Write;

use serde_json::{Value, json};

use super::build_report::{SharedTexturesReport, level_reports};
use super::decimal::shortest;
use crate::format::{Node, SCENE_VERSION, Scene};

/// Children of one node that [`text`] shows before it sums up the rest.
const MOST_CHILDREN: usize = 8;
/// Levels below a root that [`text`] shows.
const MOST_LEVELS: usize = 8;

/// The whole scene as one object. Nodes refer to each other by `id`; `block` is an index into
/// `blocks` and `shared_textures` of a node are indices into that of the scene.
pub fn json(scene: &Scene) -> Value {
    let [bbox_min, bbox_max] = scene.bounds().unwrap_or_default();
    json!({
        "format_version": SCENE_VERSION,
        "parameters": scene.parameters,
        "fingerprint": hexadecimal(&scene.fingerprint),
        "up": scene.up,
        "textured": scene.is_textured(),
        "bbox_min": bbox_min,
        "bbox_max": bbox_max,
        "blocks": scene.blocks.iter().map(|block| json!({
            "name": block.name,
            "input": block.input,
            "origin": block.origin,
        })).collect::<Vec<_>>(),
        "shared_textures": scene.shared_textures.iter().map(|texture| json!({
            "file": texture.file_name,
            "width": texture.width,
            "height": texture.height,
            "file_bytes": texture.bytes,
        })).collect::<Vec<_>>(),
        "nodes": scene.nodes.iter().map(|node| node_json(scene, node)).collect::<Vec<_>>(),
    })
}

fn node_json(scene: &Scene, node: &Node) -> Value {
    let id = |link: Option<u32>| link.and_then(|link| Some(scene.nodes.get(link as usize)?.id));
    json!({
        "id": node.id,
        "parent": id(node.parent),
        "first_child": id(node.first_child),
        "next_sibling": id(node.next_sibling),
        "level": node.level,
        "block": node.block,
        "triangles": node.triangles,
        "textured_triangles": node.textured_triangles,
        "vertices": node.vertices,
        "bbox_min": node.bbox_min,
        "bbox_max": node.bbox_max,
        "cost": node.cost,
        "static_benefit": node.static_benefit,
        "average_normal": node.average_normal.map(shortest),
        "geometric_error": node.geometric_error,
        "mean_error": node.mean_error,
        "p95_error": node.p95_error,
        "texels": node.texels,
        "pictures": node.pictures,
        "shared_texels": node.shared_texels,
        "origin": node.origin,
        "file": node.file,
        "file_bytes": node.file_bytes,
        "shared_textures": node.shared_textures,
    })
}

/// The scene in some dozens of lines: facts, a table of levels, and at most `max_blocks` trees.
pub fn text(scene: &Scene, max_blocks: usize) -> String {
    let mut out = String::new();
    facts(&mut out, scene);
    table(&mut out, scene);
    let roots: Vec<u32> = scene.roots().collect();
    for &root in roots.iter().take(max_blocks) {
        out.push('\n');
        tree(&mut out, scene, root);
    }
    if roots.len() > max_blocks {
        push(&mut out, format_args!("\n… and {} trees more", roots.len() - max_blocks));
    }
    out
}

/// Writing to a string cannot fail.
fn push(out: &mut String, line: std::fmt::Arguments<'_>) {
    let _ = writeln!(out, "{line}");
}

fn facts(out: &mut String, scene: &Scene) {
    let levels = level_reports(scene);
    let leaves = scene.nodes.iter().filter(|node| node.first_child.is_none());
    let leaf_triangles: u64 = leaves.map(|node| u64::from(node.triangles)).sum();
    let shared = SharedTexturesReport::of(scene);
    let bytes = levels.iter().map(|level| level.bytes).sum::<u64>() + shared.bytes;
    let texels = levels.iter().map(|level| level.texels).sum::<u64>() + shared.texels;
    let [min, max] = scene.bounds().unwrap_or_default();
    let [x, y, z] = std::array::from_fn(|axis| max[axis] - min[axis]);
    push(
        out,
        format_args!(
            "{} nodes on {} levels, {} trees, {} blocks",
            scene.nodes.len(),
            levels.len(),
            scene.roots().count(),
            scene.blocks.len()
        ),
    );
    push(
        out,
        format_args!(
            "{leaf_triangles} triangles at the leaves, {} texels{}, {}",
            quantity(texels),
            if scene.is_textured() { "" } else { " (untextured)" },
            size(bytes)
        ),
    );
    push(
        out,
        format_args!(
            "{x:.1} × {y:.1} × {z:.1} m from ({:.2}, {:.2}, {:.2}), {} up",
            min[0],
            min[1],
            min[2],
            if scene.up == crate::mesh::UpAxis::Z { 'Z' } else { 'Y' }
        ),
    );
    if !scene.shared_textures.is_empty() {
        let SharedTexturesReport { files, texels, bytes } = shared;
        let (texels, bytes) = (quantity(texels), size(bytes));
        push(out, format_args!("of this {files} shared textures, {texels} texels, {bytes}"));
    }
    push(out, format_args!("fingerprint {}", hexadecimal(&scene.fingerprint[..8])));
    push(out, format_args!("parameters {}\n", scene.parameters));
}

fn table(out: &mut String, scene: &Scene) {
    push(out, format_args!("{:>28} {:>59}", "triangles", "geometric error"));
    push(
        out,
        format_args!(
            "{:>5} {:>6} {:>7} {:>7} {:>7} {:>8} {:>9} {:>10} {:>10} {:>10}",
            "level", "nodes", "least", "mean", "most", "sum", "texels", "bytes", "median", "most"
        ),
    );
    for level in level_reports(scene) {
        let nodes = || scene.nodes.iter().filter(|node| node.level == level.level);
        let mut errors: Vec<f64> = nodes().map(|node| node.geometric_error).collect();
        errors.sort_by(f64::total_cmp);
        push(
            out,
            format_args!(
                "{:>5} {:>6} {:>7} {:>7} {:>7} {:>8} {:>9} {:>10} {:>10} {:>10}",
                level.level,
                level.nodes,
                nodes().map(|node| node.triangles).min().unwrap_or(0),
                level.triangles / level.nodes.max(1),
                nodes().map(|node| node.triangles).max().unwrap_or(0),
                quantity(level.triangles),
                quantity(level.texels),
                size(level.bytes),
                metres(errors.get(errors.len() / 2).copied().unwrap_or(0.0)),
                metres(errors.last().copied().unwrap_or(0.0)),
            ),
        );
    }
}

/// One tree, indented by level: the way down its first children in full, the rest summed up.
fn tree(out: &mut String, scene: &Scene, root: u32) {
    let Some(node) = scene.nodes.get(root as usize) else { return };
    match node.block.and_then(|block| scene.blocks.get(block as usize)) {
        Some(block) => push(out, format_args!("{} ({})", block.name, block.input)),
        None => push(out, format_args!("above the blocks")),
    }
    node_line(out, scene, root, 0);
    let mut parent = root;
    let mut after = Vec::new();
    for depth in 1..=MOST_LEVELS {
        let children: Vec<u32> = scene.children(parent).collect();
        let Some((&first, others)) = children.split_first() else { break };
        node_line(out, scene, first, depth);
        after.push((depth, others.to_vec()));
        parent = first;
    }
    // The siblings of the way down, the deepest first, each below its own parent.
    for (depth, others) in after.into_iter().rev() {
        let (shown, rest) = others.split_at(others.len().min(MOST_CHILDREN - 1));
        shown.iter().for_each(|&node| node_line(out, scene, node, depth));
        if !rest.is_empty() {
            let (nodes, _) = sum_below(scene, rest);
            push(out, format_args!("{}… and {nodes} nodes more", indent(depth)));
        }
    }
}

fn indent(depth: usize) -> String {
    "  ".repeat(depth)
}

/// One node, and a word on what is below it where that is not the way that is shown.
fn node_line(out: &mut String, scene: &Scene, index: u32, depth: usize) {
    let Some(node) = scene.nodes.get(index as usize) else { return };
    let textures = match node.texels {
        0 => String::new(),
        texels => format!(", {} texels", quantity(texels)),
    };
    let below = match sum_below(scene, &[index]) {
        (1, _) => String::new(),
        (nodes, triangles) => {
            format!(", {} nodes and {} triangles below", nodes - 1, quantity(triangles))
        }
    };
    push(
        out,
        format_args!(
            "{}{}: {} triangles{textures}, {}, error {} (mean {}), cost {:.1}{below}",
            indent(depth),
            node.file,
            node.triangles,
            size(node.file_bytes),
            metres(node.geometric_error),
            metres(node.mean_error),
            node.cost
        ),
    );
}

/// Number of nodes of the trees whose roots are `tops`, and triangles at their leaves.
fn sum_below(scene: &Scene, tops: &[u32]) -> (u64, u64) {
    let (mut nodes, mut triangles) = (0, 0);
    let mut stack = tops.to_vec();
    while let Some(index) = stack.pop() {
        let Some(node) = scene.nodes.get(index as usize) else { continue };
        nodes += 1;
        if node.first_child.is_none() {
            triangles += u64::from(node.triangles);
        }
        stack.extend(scene.children(index));
        if nodes > scene.nodes.len() as u64 {
            break; // a scene that was never checked may have cycles
        }
    }
    (nodes, triangles)
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// A count with a decimal prefix: 1234567 is `1.23 M`.
fn quantity(count: u64) -> String {
    scaled(count, &["", " k", " M", " G", " T"], 1000.0)
}

/// A size with a binary prefix: 1536 is `1.50 KiB`.
fn size(bytes: u64) -> String {
    scaled(bytes, &[" B", " KiB", " MiB", " GiB", " TiB"], 1024.0)
}

fn scaled(count: u64, units: &[&str], step: f64) -> String {
    let mut value = count as f64;
    let mut unit = 0;
    // 999.5 would be printed as 1000: it takes the next prefix instead.
    while value >= step - 0.5 && unit + 1 < units.len() {
        value /= step;
        unit += 1;
    }
    let digits = match value {
        _ if unit == 0 => 0,
        value if value < 9.995 => 2,
        value if value < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.digits$}{}", units[unit])
}

/// A length: millimetres below a metre.
fn metres(length: f64) -> String {
    match length {
        0.0 => "0".into(),
        length if length < 1e-4 => format!("{:.1e} m", length),
        length if length < 1.0 => format!("{:.1} mm", length * 1e3),
        length => format!("{length:.2} m"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::NodeId;
    use crate::format::test_scene::scene;

    #[test]
    fn json_names_nodes_by_id() {
        let value = json(&scene());
        let nodes = value["nodes"].as_array().unwrap();
        assert_eq!(nodes.len(), 5);
        assert_eq!(nodes[0]["parent"], Value::Null);
        assert_eq!(nodes[0]["block"], Value::Null);
        let id = |number: u64| NodeId(number).to_string();
        assert_eq!(nodes[1]["parent"], id(100));
        assert_eq!(nodes[1]["first_child"], id(103));
        assert_eq!(nodes[3]["next_sibling"], id(102));
        let wanted = [
            "id",
            "parent",
            "level",
            "block",
            "triangles",
            "textured_triangles",
            "bbox_min",
            "bbox_max",
            "cost",
            "static_benefit",
            "average_normal",
            "geometric_error",
            "mean_error",
            "p95_error",
            "texels",
            "file",
            "file_bytes",
        ];
        for node in nodes {
            assert!(wanted.iter().all(|key| node.get(key).is_some()), "{node}");
        }
        assert_eq!(nodes[2]["bbox_min"], json!([678_016.25, 5_403_456.5, -1.0]));
    }

    #[test]
    fn text_shows_trees_in_order_and_says_what_it_leaves_out() {
        let text = text(&scene(), 1);
        let place = |what: &str| text.find(what).unwrap_or_else(|| panic!("{what} not in {text}"));
        assert!(place("5 nodes on 3 levels, 2 trees, 2 blocks") < place("n0.glb"));
        assert!(place("\nn0.glb") < place("\n  n1.glb"));
        assert!(place("\n  n1.glb") < place("\n    n3.glb"), "first child first");
        assert!(place("\n    n3.glb") < place("\n    n2.glb"));
        assert!(text.ends_with("\n… and 1 trees more\n"));
        assert!(!text.contains("n4.glb"));
    }

    #[test]
    fn many_children_are_summed_up() {
        let mut scene = scene();
        scene.nodes.truncate(1);
        for child in 1..=1000u32 {
            let mut node = scene.nodes[0].clone();
            node.id = NodeId(u64::from(1000 + child));
            node.file = format!("c{child}.glb");
            node.parent = Some(0);
            node.level = 1;
            node.next_sibling = (child < 1000).then_some(child + 1);
            node.first_child = None;
            scene.nodes.push(node);
        }
        assert_eq!(scene.check(), []);
        let text = text(&scene, 10);
        assert!(text.contains("1000 nodes and 900 k triangles below"));
        assert!(text.contains("  c8.glb") && !text.contains("c9.glb"));
        assert!(text.contains("\n  … and 992 nodes more\n"), "{text}");
    }

    #[test]
    fn prefixes_change_where_the_digits_would() {
        assert_eq!(
            [999, 1000, 999_499, 999_999].map(quantity),
            ["999", "1.00 k", "999 k", "1.00 M"]
        );
        assert_eq!([1023, 1024, 1536].map(size), ["1023 B", "1.00 KiB", "1.50 KiB"]);
        assert_eq!([0.0, 0.25, 2.0].map(metres), ["0", "250.0 mm", "2.00 m"]);
    }
}
