//! The different normals that corners have at each vertex.

use super::Normal;

/// Normals of one vertex that are closer than this count as one: the cosine of 0.25°, which is half of
/// what 8 bits round by. Triangles of one plane differ by rounding.
pub(crate) const SAME_NORMAL: f64 = 0.999_990_48;

/// The different normals at each vertex, as lists of entries. Most vertices have one to three.
pub(crate) struct VertexNormals {
    /// By vertex: the first of its entries.
    first: Vec<u32>,
    entries: Vec<Entry>,
}

struct Entry {
    vertex: u32,
    normal: Normal,
    /// The vertex's next entry.
    next: u32,
}

/// No entry.
const END: u32 = u32::MAX;

impl VertexNormals {
    /// None for each of so many vertices.
    pub fn new(vertices: usize) -> Self {
        Self { first: vec![END; vertices], entries: Vec::with_capacity(vertices) }
    }

    /// The entry of a vertex's normal.
    pub fn entry(&mut self, vertex: u32, normal: Normal) -> u32 {
        self.find(vertex, |known| known == normal).unwrap_or_else(|| self.add(vertex, normal))
    }

    /// The entry of a vertex that has this normal, or else the first that has nearly this normal.
    pub fn near_entry(&mut self, vertex: u32, normal: Normal) -> u32 {
        self.find(vertex, |known| known == normal)
            .or_else(|| self.find(vertex, |known| known.is_within(normal, SAME_NORMAL)))
            .unwrap_or_else(|| self.add(vertex, normal))
    }

    /// The entries of a vertex in the order in which they were made.
    pub fn entries_of(&self, vertex: u32) -> impl Iterator<Item = u32> {
        let to = |at: u32| (at != END).then_some(at);
        let first = to(self.first[vertex as usize]);
        std::iter::successors(first, move |&at| to(self.entries[at as usize].next))
    }

    /// The normal of an entry.
    pub fn normal(&self, entry: u32) -> Normal {
        self.entries[entry as usize].normal
    }

    /// The number of entries.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Vertices with one normal each: a vertex keeps its number for its first entry and gets a copy
    /// for each other. Returns the vertex of each entry, and of which vertex each copy is.
    pub fn with_copies(&self) -> (Vec<u32>, Vec<u32>) {
        let mut copies = Vec::new();
        let vertices = (0..)
            .zip(&self.entries)
            .map(|(number, entry)| {
                if self.first[entry.vertex as usize] == number {
                    return entry.vertex;
                }
                copies.push(entry.vertex);
                (self.first.len() + copies.len() - 1) as u32
            })
            .collect();
        (vertices, copies)
    }

    fn find(&self, vertex: u32, is_same: impl Fn(Normal) -> bool) -> Option<u32> {
        self.entries_of(vertex).find(|&entry| is_same(self.normal(entry)))
    }

    fn add(&mut self, vertex: u32, normal: Normal) -> u32 {
        let new = self.entries.len() as u32;
        let last = self.entries_of(vertex).last();
        self.entries.push(Entry { vertex, normal, next: END });
        match last {
            Some(last) => self.entries[last as usize].next = new,
            None => self.first[vertex as usize] = new,
        }
        new
    }
}
