//! One chunk's statements, without knowing what came before the chunk.
//!
//! An index that counts back may reach before the chunk, so it is kept relative to the chunk's
//! beginning, and the parser records how many elements the chunk needs before it. A chunk that
//! needs more than there are is parsed once more, face by face ([`Statements::settle`]).

use std::borrow::Cow;

use glam::DVec3;

use super::super::clean::CleanStats;
use super::super::lines::{Lines, text};
use super::super::plain_text::BYTE_ORDER_MARK;
use super::super::tokens::{Corner, NO_ELEMENT, corner, corner_at, number, plain_decimal_at, word};
use super::colors::Colors;
use super::index_faults::IndexFaults;
use crate::mesh::Normal;

/// Most corners of a face: beyond this the ear clipping's own indices could overflow.
const MOST_CORNERS: usize = 1 << 20;

/// Most vertices of a file, so that every index fits 32 bits with room for markers.
pub(in crate::import) const MOST_VERTICES: usize = u32::MAX as usize - 64;

/// Added to indices that are relative to the chunk's beginning; above twice any other index.
const RELATIVE: i64 = 1 << 62;
/// Stands for an index that is not there.
const ABSENT: i64 = i64::MIN;

/// A corner's index, from 0.
#[derive(Clone, Copy, Debug)]
pub(in crate::import) struct Reference(i64);

impl Reference {
    /// The element that is meant, where so many come before the chunk; `None` where none is.
    #[inline]
    pub(in crate::import) fn resolve(self, before: usize) -> Option<u32> {
        match self.0 {
            ABSENT => None,
            from_start if from_start < RELATIVE / 2 => Some(from_start as u32),
            relative => Some((relative - RELATIVE + before as i64) as u32),
        }
    }

    /// The index as the file gives it (0 for [`NO_ELEMENT`]) where it means none of the elements:
    /// `before` precede the chunk and `local` of the chunk precede the face.
    fn out_of_range(self, before: usize, local: usize) -> Option<i64> {
        let (before, local) = (before as i64, local as i64);
        match self.0 {
            ABSENT => None,
            from_start if from_start < RELATIVE / 2 => {
                (from_start >= before + local).then_some(from_start + 1)
            }
            relative => {
                let index = relative - RELATIVE - local;
                let given = if index == NO_ELEMENT { 0 } else { index };
                (relative - RELATIVE < -before).then_some(given)
            }
        }
    }
}

/// A statement that changes what the faces behind it belong to, with the name or names that it
/// gives, of unknown encoding.
#[derive(Debug)]
pub(in crate::import) enum Change {
    Group(Vec<u8>),
    Material(Vec<u8>),
    Libraries(Vec<u8>),
}

impl Change {
    /// The name that the statement gives.
    pub(in crate::import) fn name(&self) -> &[u8] {
        match self {
            Self::Group(name) | Self::Material(name) | Self::Libraries(name) => name,
        }
    }
}

/// A chunk's statements.
#[derive(Default)]
pub(in crate::import) struct Statements {
    pub(in crate::import) positions: Vec<[f64; 3]>,
    pub(in crate::import) colors: Colors,
    pub(in crate::import) texcoords: Vec<[f64; 2]>,
    /// [`Normal::NONE`] where the file's has no direction.
    pub(in crate::import) normals: Vec<Normal>,
    /// Position, texture coordinate and normal of all faces' corners.
    pub(in crate::import) corners: Vec<[Reference; 3]>,
    /// How many corners each face has, at least 3.
    pub(in crate::import) faces: Vec<u32>,
    /// With the number of faces before each.
    pub(in crate::import) changes: Vec<(usize, Change)>,
    /// The least numbers of positions, texture coordinates and normals before the chunk.
    needed: [i64; 3],
    /// How many there are, once that is known; then indices out of range are left out.
    before: Option<[usize; 3]>,
    pub(in crate::import) index_faults: IndexFaults,
    pub(in crate::import) stats: CleanStats,
    pub(in crate::import) lines: u64,
    /// What cannot be read, and its line from 1; nothing behind it was read.
    pub(in crate::import) problem: Option<(u64, String)>,
}

impl Statements {
    pub(super) fn of(chunk: &[u8]) -> Self {
        Self::parse(chunk, None)
    }

    /// Parses the chunk, of this text, once more where an index is out of range, now that it is
    /// known how many positions, texture coordinates and normals come before it. A face whose position
    /// is out of range is left out; one whose texture coordinate or normal is loses all of them.
    pub(in crate::import) fn settle(&mut self, text: &[u8], before: [usize; 3]) {
        if (0..3).any(|kind| self.needed[kind] > before[kind] as i64) {
            *self = Self::parse(text, Some(before));
        }
    }

    fn parse(chunk: &[u8], before: Option<[usize; 3]>) -> Self {
        let mut result = Self { before, ..Self::default() };
        let mut lines = Lines::new(chunk);
        loop {
            while before.is_none()
                && let Some(rest) = result.common(lines.rest())
            {
                lines.go_on_at(rest);
            }
            // Bytes in memory can always be read.
            let Ok(Some((line, statement))) = lines.next() else { break };
            if let Err(what) = result.statement(statement, line) {
                result.problem = Some((line, what));
                break;
            }
        }
        result.lines = lines.count();
        result
    }

    /// Refuses a chunk that cannot be read, where so many positions, texture coordinates and normals
    /// and so many lines come before it.
    pub(in crate::import) fn check(
        &mut self,
        before: [usize; 3],
        lines: u64,
    ) -> Result<(), String> {
        if let Some((line, what)) = self.problem.take() {
            return Err(format!("line {}: {what}", lines + line));
        }
        if before[0] + self.positions.len() > MOST_VERTICES
            || before[1] + self.texcoords.len() > MOST_VERTICES
            || before[2] + self.normals.len() > MOST_VERTICES
        {
            return Err(format!("more than {MOST_VERTICES} vertices; divide the file"));
        }
        Ok(())
    }

    /// Reads the line at the front of `text` where it is one of those that files are full of, and
    /// returns what follows. Whatever is out of the ordinary is left to [`Self::statement`].
    #[inline]
    fn common<'a>(&mut self, text: &'a [u8]) -> Option<&'a [u8]> {
        match text {
            [b'v', b' ', rest @ ..] => {
                let ([x, y, z], rest) = plain_decimals(rest)?;
                let rest = line_end(rest)?;
                self.colors.push_none();
                self.positions.push([x, y, z]);
                Some(rest)
            }
            [b'v', b't', b' ', rest @ ..] => {
                // 18 digits are always finite in f32.
                let ([u, v], rest) = plain_decimals(rest)?;
                let rest = line_end(rest)?;
                self.texcoords.push([u, v]);
                Some(rest)
            }
            [b'f', b' ', rest @ ..] => {
                let first = self.corners.len();
                let mut rest = rest;
                let end = loop {
                    rest = blanks(rest);
                    if let Some(end) = line_end(rest) {
                        break Some(end);
                    }
                    let Some((corner, after)) = corner_at(rest) else { break None };
                    self.corner(corner);
                    rest = after;
                };
                let count = self.corners.len() - first;
                if end.is_none() || !(3..=MOST_CORNERS).contains(&count) {
                    self.corners.truncate(first);
                    return None;
                }
                self.faces.push(count as u32);
                end
            }
            [b'v', b'n', b' ', rest @ ..] => {
                let (vector, rest) = plain_decimals(rest)?;
                let rest = line_end(rest)?;
                self.normals.push(Normal::along(DVec3::from_array(vector)));
                Some(rest)
            }
            [b'#', ..] => {
                let end = memchr::memchr(b'\n', text)?;
                (!matches!(text[end - 1], b'\\' | b'\r')).then_some(&text[end + 1..])
            }
            _ => None,
        }
    }

    /// Reads a statement that begins in this line of the chunk.
    fn statement(&mut self, statement: &[u8], line: u64) -> Result<(), String> {
        let mut rest = statement;
        let Some(keyword) = word(&mut rest) else { return Ok(()) };
        // Files that were joined may have a mark in their middle.
        let keyword = keyword.strip_prefix(BYTE_ORDER_MARK).unwrap_or(keyword);
        let name = |rest: &[u8]| rest.trim_ascii().to_vec();
        let change = match &lower_case(keyword)[..] {
            b"v" => return self.position(rest),
            b"vt" => return self.texcoord(rest),
            b"vn" => {
                self.normal(rest);
                return Ok(());
            }
            b"f" | b"fo" => return self.face(rest, line),
            b"o" | b"g" => Change::Group(name(rest)),
            b"usemtl" => Change::Material(name(rest)),
            b"mtllib" => Change::Libraries(name(rest)),
            b"p" | b"l" | b"curv" | b"curv2" | b"surf" => {
                self.stats.not_triangles += 1;
                return Ok(());
            }
            // Comments, smoothing groups, display attributes.
            _ => return Ok(()),
        };
        self.changes.push((self.faces.len(), change));
        Ok(())
    }

    /// `v x y z`, `v x y z w` (the weight matters to curves alone), `v x y z r g b [a]`.
    fn position(&mut self, mut rest: &[u8]) -> Result<(), String> {
        let mut values = [0.0; 7];
        let mut count = 0;
        while let Some(word) = word(&mut rest) {
            if word[0] == b'#' || count == values.len() {
                break;
            }
            values[count] = number(word).ok_or_else(|| {
                format!("vertex coordinate \"{}\"; expected a number", text(word))
            })?;
            count += 1;
        }
        if count < 3 {
            return Err(format!("vertex of {count} coordinates; expected 3"));
        }
        if count >= 6 {
            self.colors.push([values[3], values[4], values[5]], self.positions.len());
        } else {
            self.colors.push_none();
        }
        self.positions.push([values[0], values[1], values[2]]);
        Ok(())
    }

    fn texcoord(&mut self, mut rest: &[u8]) -> Result<(), String> {
        let mut read = || -> Result<Option<f64>, String> {
            match word(&mut rest) {
                Some(word) if word[0] != b'#' => number(word).map(Some).ok_or_else(|| {
                    format!("texture coordinate \"{}\"; expected a number", text(word))
                }),
                _ => Ok(None),
            }
        };
        let u = read()?.ok_or("texture coordinate without a value; expected u and v")?;
        let v = read()?.unwrap_or(0.0);
        // Beyond f32's range is infinite where it is used.
        if (u as f32).is_finite() && (v as f32).is_finite() {
            self.texcoords.push([u, v]);
        } else {
            self.stats.texcoords_not_finite += 1;
            self.texcoords.push([0.0, 1.0]);
        }
        Ok(())
    }

    /// A normal that cannot be read is one without direction: it may be that nothing uses it.
    fn normal(&mut self, mut rest: &[u8]) {
        let mut read = || word(&mut rest).and_then(number).unwrap_or(f64::NAN);
        let vector = DVec3::from_array([read(), read(), read()]);
        self.normals.push(Normal::along(vector));
    }

    fn face(&mut self, mut rest: &[u8], line: u64) -> Result<(), String> {
        let first = self.corners.len();
        while let Some(word) = word(&mut rest) {
            if word[0] == b'#' {
                break;
            }
            let corner = corner(word).ok_or_else(|| {
                format!("face corner \"{}\"; expected v, v/vt, v//vn or v/vt/vn", text(word))
            })?;
            self.corner(corner);
        }
        let count = self.corners.len() - first;
        if count > MOST_CORNERS {
            return Err(format!("face of {count} corners; expected at most {MOST_CORNERS}"));
        }
        if count < 3 {
            self.stats.not_triangles += 1;
            self.corners.truncate(first);
        } else if self.settle_face(first, line) {
            self.faces.push(count as u32);
        }
        Ok(())
    }

    /// Once it is known what comes before the chunk: leaves out of the face, whose corners begin at
    /// `first`, what is out of range. Returns false where nothing is left of it.
    fn settle_face(&mut self, first: usize, line: u64) -> bool {
        let Some(before) = self.before else { return true };
        let local = [self.positions.len(), self.texcoords.len(), self.normals.len()];
        let face = &mut self.corners[first..];
        let mut is_faulty = |kind: usize, face: &[[Reference; 3]]| {
            let fault =
                face.iter().find_map(|corner| corner[kind].out_of_range(before[kind], local[kind]));
            if let Some(index) = fault {
                self.index_faults.count(kind, line, index, before[kind] + local[kind]);
            }
            fault.is_some()
        };
        if is_faulty(0, face) {
            self.corners.truncate(first);
            return false;
        }
        for kind in [1, 2] {
            if is_faulty(kind, face) {
                face.iter_mut().for_each(|corner| corner[kind] = Reference(ABSENT));
            }
        }
        true
    }

    #[inline]
    fn corner(&mut self, corner: Corner) {
        let counts = [self.positions.len(), self.texcoords.len(), self.normals.len()];
        let mut reference = |index: i64, kind: usize| {
            let count = counts[kind] as i64;
            let (needed, reference) = if index > 0 {
                (index - count, index - 1)
            } else {
                let place = count + index;
                (-place, RELATIVE + place)
            };
            self.needed[kind] = self.needed[kind].max(needed);
            Reference(reference)
        };
        let position = reference(corner.position, 0);
        let mut attribute = |index: i64, kind: usize| match index {
            0 => Reference(ABSENT),
            index => reference(index, kind),
        };
        let (texcoord, normal) = (attribute(corner.texcoord, 1), attribute(corner.normal, 2));
        self.corners.push([position, texcoord, normal]);
    }
}

/// A keyword in lower case.
fn lower_case(keyword: &[u8]) -> Cow<'_, [u8]> {
    match keyword.iter().any(u8::is_ascii_uppercase) {
        true => Cow::Owned(keyword.to_ascii_lowercase()),
        false => Cow::Borrowed(keyword),
    }
}

/// Plain decimals at the front of `text`, each followed by white space or the end.
#[inline]
fn plain_decimals<const N: usize>(mut text: &[u8]) -> Option<([f64; N], &[u8])> {
    let mut values = [0.0; N];
    for value in &mut values {
        (*value, text) = plain_decimal_at(blanks(text))?;
        if !matches!(text, [] | [..=b' ', ..]) {
            return None;
        }
    }
    Some((values, text))
}

/// What follows the spaces and tabulators at the front of `text`.
#[inline]
fn blanks(mut text: &[u8]) -> &[u8] {
    while let [b' ' | b'\t', rest @ ..] = text {
        text = rest;
    }
    text
}

/// What follows the line whose end alone is at the front of `text`.
#[inline]
fn line_end(text: &[u8]) -> Option<&[u8]> {
    match blanks(text) {
        [b'\n', rest @ ..] | [b'\r', b'\n', rest @ ..] => Some(rest),
        _ => None,
    }
}
