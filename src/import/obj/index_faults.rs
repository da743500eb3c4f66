//! Counts of faces with an index that no element of the file has.

use std::path::Path;

use crate::mesh::Warnings;

/// Faces with an index that is 0 or out of range, by the kind of the index: position, texture
/// coordinate, normal. A face counts once for each kind.
#[derive(Debug, Default)]
pub(in crate::import) struct IndexFaults {
    kinds: [Faults; 3],
}

/// What messages say of each kind: its name, what became of the face, and the elements' name.
const KINDS: [[&str; 3]; 3] = [
    ["vertex index", "face dropped", "vertices"],
    ["texture coordinate index", "the face's texture coordinates dropped", "texture coordinates"],
    ["normal index", "the face's normals dropped", "normals"],
];

#[derive(Debug, Default)]
struct Faults {
    faces: u64,
    first: Option<Fault>,
}

/// One such index.
#[derive(Clone, Copy, Debug)]
struct Fault {
    /// From 1.
    line: u64,
    /// As the file gives it.
    index: i64,
    /// How many elements there were.
    elements: usize,
}

impl IndexFaults {
    /// Counts a face in this line with this index of so many elements.
    pub(super) fn count(&mut self, kind: usize, line: u64, index: i64, elements: usize) {
        let faults = &mut self.kinds[kind];
        faults.faces += 1;
        faults.first.get_or_insert(Fault { line, index, elements });
    }

    /// Adds those of a text behind this one, before which there are so many lines.
    pub(in crate::import) fn add(&mut self, other: &Self, lines: u64) {
        for (faults, more) in self.kinds.iter_mut().zip(&other.kinds) {
            faults.faces += more.faces;
            let first = more.first.map(|fault| Fault { line: lines + fault.line, ..fault });
            faults.first = faults.first.or(first);
        }
    }

    /// Adds what was counted to `warnings`, naming the file.
    pub(in crate::import) fn report(&self, file: &Path, warnings: &mut Warnings) {
        for (faults, [index_name, consequence, elements_name]) in self.kinds.iter().zip(KINDS) {
            let Some(Fault { line, index, elements }) = faults.first else { continue };
            let what = format!(
                "{}: {index_name} that is 0 or out of range, {consequence} (first in line {line}: \
                 {index} of {elements} {elements_name})",
                file.display()
            );
            warnings.add(what, faults.faces);
        }
    }
}
