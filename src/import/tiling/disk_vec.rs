//! A list on disk that grows at its end and is read wherever one likes.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;
use std::path::Path;

use bytemuck::Pod;

/// Elements that are written and read together.
const PAGE: usize = 1 << 12;

/// Pages that are held in memory once they were read: what a file's faces use stands mostly together.
const HELD: usize = 64;

/// A list of which a few pages are in memory, the others in a file that goes with it.
pub(super) struct DiskVec<T> {
    file: File,
    /// What was added behind the last page that is written.
    tail: Vec<T>,
    written: usize,
    /// By page number over [`HELD`], what is left: the page and its number.
    held: Vec<Option<(usize, Vec<T>)>>,
    elements: PhantomData<T>,
}

impl<T: Pod> DiskVec<T> {
    /// An empty list, whose file is in `dir` and has no name there, so that it is gone however the program
    /// ends.
    pub fn new(dir: &Path) -> io::Result<Self> {
        Ok(Self {
            file: tempfile::tempfile_in(dir)?,
            tail: Vec::with_capacity(PAGE),
            written: 0,
            held: std::iter::repeat_with(|| None).take(HELD).collect(),
            elements: PhantomData,
        })
    }

    pub fn len(&self) -> usize {
        self.written + self.tail.len()
    }

    pub fn push(&mut self, element: T) -> io::Result<()> {
        self.tail.push(element);
        if self.tail.len() == PAGE {
            let at = self.written * size_of::<T>();
            self.file.seek(SeekFrom::Start(at as u64))?;
            self.file.write_all(bytemuck::cast_slice(&self.tail))?;
            self.written += PAGE;
            self.tail.clear();
        }
        Ok(())
    }

    pub fn extend(&mut self, elements: impl IntoIterator<Item = T>) -> io::Result<()> {
        elements.into_iter().try_for_each(|element| self.push(element))
    }

    /// `None` behind the end.
    #[inline]
    pub fn get(&mut self, index: usize) -> io::Result<Option<T>> {
        if index >= self.written {
            return Ok(self.tail.get(index - self.written).copied());
        }
        let (page, within) = (index / PAGE, index % PAGE);
        let held = &mut self.held[page % HELD];
        if let Some((number, elements)) = held
            && *number == page
        {
            return Ok(elements.get(within).copied());
        }
        let mut elements = held.take().map_or_else(|| vec![T::zeroed(); PAGE], |(_, page)| page);
        let at = page * PAGE * size_of::<T>();
        self.file.seek(SeekFrom::Start(at as u64))?;
        self.file.read_exact(bytemuck::cast_slice_mut(&mut elements))?;
        let element = elements.get(within).copied();
        *held = Some((page, elements));
        Ok(element)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn what_was_added_is_found_wherever_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let mut list = DiskVec::new(folder.path()).unwrap();
        assert_eq!(list.get(0).unwrap(), None);
        let count = (HELD + 3) * PAGE + 17;
        list.extend((0..count as u64).map(|at| [at, !at])).unwrap();
        assert_eq!((list.len(), list.get(count).unwrap()), (count, None));
        let mut random = Random::new(3, 0);
        let ends = [0, PAGE - 1, PAGE, HELD * PAGE, count - 18, count - 17, count - 1];
        let anywhere = (0..20_000).map(|_| (random.unit() * count as f64) as usize);
        for at in ends.into_iter().chain(anywhere) {
            assert_eq!(list.get(at).unwrap(), Some([at as u64, !(at as u64)]));
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "no name is left");
    }
}
