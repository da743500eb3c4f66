//! What must hold of a scene: checked before it is written and after it is read.

use std::fmt;

use rustc_hash::FxHashMap;

use super::file_name::is_plain_file_name;
use super::node_id::NodeId;
use super::scene::{Node, Scene};

/// How many defects [`Scene::check`] collects before it stops looking.
const ENOUGH: usize = 16;

/// How far from 1 the length of an average normal may be: f32 rounding with room to spare.
const NORMAL_LENGTH_TOLERANCE: f32 = 1e-3;

/// A part of a scene that a defect is about, by its index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// Of [`Scene::nodes`].
    Node(u32),
    /// Of [`Scene::blocks`].
    Block(u32),
    /// Of [`Scene::shared_textures`].
    SharedTexture(u32),
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Node(index) => write!(f, "node {index}"),
            Self::Block(index) => write!(f, "block {index}"),
            Self::SharedTexture(index) => write!(f, "shared texture {index}"),
        }
    }
}

/// Something that must hold of a scene and does not.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SceneDefect {
    /// Nothing to draw.
    #[error("expected at least one node, found none")]
    NoNodes,
    /// An index that points past the end of its table.
    #[error("{element}: {field}: expected an index below {limit}, found {found}")]
    IndexOutOfRange {
        /// Whose index.
        element: Element,
        /// Which index.
        field: &'static str,
        /// The length of the table.
        limit: usize,
        /// The index.
        found: u32,
    },
    /// A node that stands in another's list of children but names a different parent.
    #[error("node {child}: expected parent {parent}, which lists it, found {}", or_none(*found))]
    ParentDisagrees {
        /// The child.
        child: u32,
        /// The node that lists it.
        parent: u32,
        /// The parent that it names.
        found: Option<u32>,
    },
    /// A node that stands in lists of children more than once.
    #[error("node {child}: expected in one list of children, found in that of {parent} as well")]
    SeveralParents {
        /// The child.
        child: u32,
        /// The node that lists it the second time.
        parent: u32,
    },
    /// A node whose parent does not list it.
    #[error("node {child}: expected among the children of its parent {parent}, not found there")]
    NotListed {
        /// The child.
        child: u32,
        /// The parent that it names.
        parent: u32,
    },
    /// A root with a next sibling.
    #[error("node {node}: expected no next sibling at a root, found {found}")]
    RootWithSibling {
        /// The root.
        node: u32,
        /// Its next sibling.
        found: u32,
    },
    /// A node that is its own ancestor, or below one that is.
    #[error("node {node}: expected a root above it, found a cycle")]
    Cycle {
        /// The node of lowest index.
        node: u32,
    },
    /// A level that is not the number of steps from the root.
    #[error("node {node}: expected level {expected}, found {found}")]
    Level {
        /// The node.
        node: u32,
        /// Steps from the root.
        expected: u32,
        /// What it says.
        found: u32,
    },
    /// A child with more error than its parent.
    #[error(
        "node {child}: geometric error: expected at most the {parent_error} m of its parent \
         {parent}, found {found} m"
    )]
    ErrorNotMonotone {
        /// The child.
        child: u32,
        /// Its parent.
        parent: u32,
        /// The parent's error in metres.
        parent_error: f64,
        /// The child's error in metres.
        found: f64,
    },
    /// Pictures that do not have as many texels as the node says.
    #[error("node {node}: expected {texels} texels in its pictures, found {found}")]
    Pictures {
        /// The node.
        node: u32,
        /// The texels that it says it has.
        texels: u64,
        /// Those of its pictures.
        found: u64,
    },
    /// More vertices than corners of triangles.
    #[error("node {node}: expected at most {expected} vertices, found {found}")]
    Vertices {
        /// The node.
        node: u32,
        /// Three a triangle.
        expected: u64,
        /// What it says.
        found: u32,
    },
    /// A child of another block than its parent's.
    #[error("node {child}: expected block {parent_block} like its parent, found {}", or_none(*found))]
    BlockChanges {
        /// The child.
        child: u32,
        /// The parent's block.
        parent_block: u32,
        /// The child's.
        found: Option<u32>,
    },
    /// A number outside its range, or none at all.
    #[error("{element}: {field}: expected {expected}, found {found}")]
    Number {
        /// Whose number.
        element: Element,
        /// Which number.
        field: &'static str,
        /// Its range.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A box whose least corner is beyond its greatest.
    #[error(
        "node {node}: bounding box: expected least ≤ greatest along {axis}, found {min} > {max}"
    )]
    Box {
        /// The node.
        node: u32,
        /// x, y or z.
        axis: char,
        /// The least coordinate.
        min: f64,
        /// The greatest coordinate.
        max: f64,
    },
    /// More textured triangles than triangles.
    #[error("node {node}: expected at most {triangles} textured triangles, found {found}")]
    TexturedTriangles {
        /// The node.
        node: u32,
        /// Its triangles.
        triangles: u32,
        /// Its textured triangles.
        found: u32,
    },
    /// A file name with folders or odd characters.
    #[error("{element}: expected a plain file name, found {found:?}")]
    FileName {
        /// Whose file.
        element: Element,
        /// The name.
        found: String,
    },
    /// Two elements with one file.
    #[error("{element}: expected a file of its own, found {found:?}, which is that of {other}")]
    SameFile {
        /// The later one.
        element: Element,
        /// The earlier one.
        other: Element,
        /// The name.
        found: String,
    },
    /// Two nodes with one id.
    #[error("node {node}: expected an id of its own, found {found}, which is that of node {other}")]
    SameId {
        /// The later one.
        node: u32,
        /// The earlier one.
        other: u32,
        /// The id.
        found: NodeId,
    },
}

fn or_none(index: Option<u32>) -> String {
    index.map_or_else(|| "none".into(), |index| index.to_string())
}

impl Scene {
    /// Everything that is wrong with the scene, at most the first 16 defects; empty where it is
    /// sound.
    pub fn check(&self) -> Vec<SceneDefect> {
        let mut check = Check { scene: self, defects: Vec::new() };
        check.tables();
        check.nodes();
        check.links();
        check.defects.truncate(ENOUGH);
        check.defects
    }
}

struct Check<'a> {
    scene: &'a Scene,
    defects: Vec<SceneDefect>,
}

impl Check<'_> {
    fn full(&self) -> bool {
        self.defects.len() >= ENOUGH
    }

    fn tables(&mut self) {
        if self.scene.nodes.is_empty() {
            self.defects.push(SceneDefect::NoNodes);
        }
        for (block, index) in self.scene.blocks.iter().zip(0..) {
            for coordinate in block.origin {
                self.number(Element::Block(index), "origin", Range::Finite, coordinate);
            }
        }
        let mut files = FxHashMap::default();
        for (texture, index) in self.scene.shared_textures.iter().zip(0..) {
            let element = Element::SharedTexture(index);
            self.file(&mut files, element, &texture.file_name);
            for (field, size) in [("width", texture.width), ("height", texture.height)] {
                self.number(element, field, Range::AtLeastOne, f64::from(size));
            }
        }
    }

    fn nodes(&mut self) {
        let mut files = FxHashMap::default();
        let mut ids = FxHashMap::default();
        for (node, index) in self.scene.nodes.iter().zip(0..) {
            if self.full() {
                return;
            }
            self.file(&mut files, Element::Node(index), &node.file);
            if let Some(other) = ids.insert(node.id, index) {
                self.defects.push(SceneDefect::SameId { node: index, other, found: node.id });
            }
            self.attributes(index, node);
        }
    }

    fn attributes(&mut self, index: u32, node: &Node) {
        let element = Element::Node(index);
        for coordinate in node.origin {
            self.number(element, "origin", Range::SinglePrecision, coordinate);
        }
        self.number(element, "cost", Range::NotNegative, node.cost);
        self.number(element, "static benefit", Range::NotNegative, node.static_benefit);
        self.number(element, "geometric error", Range::NotNegative, node.geometric_error);
        self.number(element, "mean error", Range::NotNegative, node.mean_error);
        self.number(element, "95th percentile of the error", Range::NotNegative, node.p95_error);
        self.number(element, "average normal", Range::Direction, length(node.average_normal));
        for axis in 0..3 {
            let (min, max) = (node.bbox_min[axis], node.bbox_max[axis]);
            self.number(element, "bounding box", Range::Finite, min);
            self.number(element, "bounding box", Range::Finite, max);
            if min > max {
                let axis = ['x', 'y', 'z'][axis];
                self.defects.push(SceneDefect::Box { node: index, axis, min, max });
            }
        }
        if node.textured_triangles > node.triangles {
            self.defects.push(SceneDefect::TexturedTriangles {
                node: index,
                triangles: node.triangles,
                found: node.textured_triangles,
            });
        }
        let corners = 3 * u64::from(node.triangles);
        if u64::from(node.vertices) > corners {
            let (expected, found) = (corners, node.vertices);
            self.defects.push(SceneDefect::Vertices { node: index, expected, found });
        }
        let area = |&[width, height]: &[u32; 2]| u64::from(width) * u64::from(height);
        let found = node.pictures.iter().map(area).fold(0, u64::saturating_add);
        if found != node.texels {
            self.defects.push(SceneDefect::Pictures { node: index, texels: node.texels, found });
        }
        if let Some(block) = node.block {
            self.index(element, "block", self.scene.blocks.len(), block);
        }
        for &texture in &node.shared_textures {
            self.index(element, "shared texture", self.scene.shared_textures.len(), texture);
        }
    }

    /// The links form a forest, and what is inherited along them is in order.
    fn links(&mut self) {
        let scene = self.scene;
        let count = scene.nodes.len();
        let before = self.defects.len();
        for (node, index) in scene.nodes.iter().zip(0..) {
            let links = [
                ("parent", node.parent),
                ("first child", node.first_child),
                ("next sibling", node.next_sibling),
            ];
            for (field, link) in links {
                if let Some(link) = link {
                    self.index(Element::Node(index), field, count, link);
                }
            }
        }
        if self.defects.len() > before || self.full() {
            return; // nothing can be said about where the links lead
        }

        // Every list of children, once; a node that is met again ends the list, so rings end too.
        let mut listed = vec![false; count];
        for (node, parent) in scene.nodes.iter().zip(0..) {
            let mut next = node.first_child;
            while let Some(child) = next {
                let member = &scene.nodes[child as usize];
                if std::mem::replace(&mut listed[child as usize], true) {
                    self.defects.push(SceneDefect::SeveralParents { child, parent });
                    break;
                }
                if member.parent != Some(parent) {
                    let found = member.parent;
                    self.defects.push(SceneDefect::ParentDisagrees { child, parent, found });
                }
                next = member.next_sibling;
            }
        }
        for (node, index) in scene.nodes.iter().zip(0..) {
            match (node.parent, node.next_sibling) {
                (Some(parent), _) if !listed[index as usize] => {
                    self.defects.push(SceneDefect::NotListed { child: index, parent });
                }
                (None, Some(found)) => {
                    self.defects.push(SceneDefect::RootWithSibling { node: index, found });
                }
                _ => {}
            }
        }
        if self.defects.len() == before {
            self.inheritance();
        }
    }

    /// Walks down from the roots: who is not reached hangs in a cycle.
    fn inheritance(&mut self) {
        let scene = self.scene;
        let mut reached = vec![false; scene.nodes.len()];
        let mut stack: Vec<(u32, u32)> = scene.roots().map(|root| (root, 0)).collect();
        while let Some((index, level)) = stack.pop() {
            if self.full() {
                return;
            }
            reached[index as usize] = true;
            let node = &scene.nodes[index as usize];
            if node.level != level {
                let (expected, found) = (level, node.level);
                self.defects.push(SceneDefect::Level { node: index, expected, found });
            }
            for child in scene.children(index) {
                self.inherited(index, node, child);
                stack.push((child, level + 1));
            }
        }
        if let Some(node) = reached.iter().position(|&reached| !reached) {
            self.defects.push(SceneDefect::Cycle { node: node as u32 });
        }
    }

    fn inherited(&mut self, parent: u32, node: &Node, child: u32) {
        let below = &self.scene.nodes[child as usize];
        if below.geometric_error > node.geometric_error {
            self.defects.push(SceneDefect::ErrorNotMonotone {
                child,
                parent,
                parent_error: node.geometric_error,
                found: below.geometric_error,
            });
        }
        if let Some(parent_block) = node.block
            && below.block != Some(parent_block)
        {
            let found = below.block;
            self.defects.push(SceneDefect::BlockChanges { child, parent_block, found });
        }
    }

    fn index(&mut self, element: Element, field: &'static str, limit: usize, found: u32) {
        if found as usize >= limit {
            self.defects.push(SceneDefect::IndexOutOfRange { element, field, limit, found });
        }
    }

    fn number(&mut self, element: Element, field: &'static str, range: Range, found: f64) {
        if !range.holds(found) {
            let expected = range.words();
            self.defects.push(SceneDefect::Number { element, field, expected, found });
        }
    }

    fn file<'a>(
        &mut self,
        files: &mut FxHashMap<&'a str, Element>,
        element: Element,
        name: &'a str,
    ) {
        let found = || name.to_owned();
        if !is_plain_file_name(name) {
            self.defects.push(SceneDefect::FileName { element, found: found() });
        } else if let Some(other) = files.insert(name, element) {
            self.defects.push(SceneDefect::SameFile { element, other, found: found() });
        }
    }
}

/// The ranges that numbers of a scene may have.
#[derive(Clone, Copy)]
enum Range {
    Finite,
    NotNegative,
    AtLeastOne,
    SinglePrecision,
    Direction,
}

impl Range {
    fn holds(self, found: f64) -> bool {
        found.is_finite()
            && match self {
                Self::Finite => true,
                Self::NotNegative => found >= 0.0,
                Self::AtLeastOne => found >= 1.0,
                Self::SinglePrecision => f64::from(found as f32) == found,
                Self::Direction => {
                    found == 0.0 || (found - 1.0).abs() <= f64::from(NORMAL_LENGTH_TOLERANCE)
                }
            }
    }

    fn words(self) -> &'static str {
        match self {
            Self::Finite => "a finite number",
            Self::NotNegative => "a finite number of 0 or more",
            Self::AtLeastOne => "1 or more",
            Self::SinglePrecision => "a finite number that fits in 32 bits",
            Self::Direction => "length 1 or 0",
        }
    }
}

fn length(direction: [f32; 3]) -> f64 {
    glam::DVec3::from_array(direction.map(f64::from)).length()
}
