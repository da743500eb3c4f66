//! A list that grows without being copied and can be given back piece by piece.
//!
//! Pages are mapped each on its own: what is given back to an allocator in the middle of its heap
//! stays with the process.

use std::marker::PhantomData;

use bytemuck::Pod;
use memmap2::MmapMut;

/// Elements of a page.
const PAGE: usize = 1 << 15;

/// A list in pages.
#[derive(Debug)]
pub(super) struct PagedVec<T> {
    pages: Vec<Page<T>>,
    len: usize,
}

#[derive(Debug)]
enum Page<T> {
    Mapped(MmapMut, PhantomData<T>),
    /// Where mapping fails: a system allows so many.
    Allocated(Vec<T>),
}

/// The number of the page that an element is on.
pub(super) fn page_of(index: usize) -> usize {
    index / PAGE
}

impl<T: Pod> Page<T> {
    fn new() -> Self {
        match MmapMut::map_anon(PAGE * size_of::<T>()) {
            Ok(mapped) => Self::Mapped(mapped, PhantomData),
            Err(_) => Self::Allocated(vec![T::zeroed(); PAGE]),
        }
    }

    #[inline]
    fn elements(&self) -> &[T] {
        match self {
            Self::Mapped(mapped, _) => bytemuck::cast_slice(mapped),
            Self::Allocated(elements) => elements,
        }
    }

    #[inline]
    fn elements_mut(&mut self) -> &mut [T] {
        match self {
            Self::Mapped(mapped, _) => bytemuck::cast_slice_mut(mapped),
            Self::Allocated(elements) => elements,
        }
    }
}

impl<T> Default for PagedVec<T> {
    fn default() -> Self {
        Self { pages: Vec::new(), len: 0 }
    }
}

impl<T: Pod> PagedVec<T> {
    /// How many elements were added.
    pub fn len(&self) -> usize {
        self.len
    }

    pub fn push(&mut self, element: T) {
        if self.len.is_multiple_of(PAGE) {
            self.pages.push(Page::new());
        }
        if let Some(page) = self.pages.last_mut() {
            page.elements_mut()[self.len % PAGE] = element;
        }
        self.len += 1;
    }

    /// `None` behind the end, and where it was given back.
    #[inline]
    pub fn get(&self, index: usize) -> Option<&T> {
        let within = index < self.len;
        within.then(|| self.pages[index / PAGE].elements().get(index % PAGE)).flatten()
    }

    /// The elements in order, without those that were given back.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        let used = |page: usize| (self.len - page * PAGE).min(PAGE);
        let elements = self.pages.iter().enumerate();
        elements.flat_map(move |(number, page)| page.elements().iter().take(used(number)))
    }

    /// See [`Self::iter`].
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        let len = self.len;
        let used = move |page: usize| (len - page * PAGE).min(PAGE);
        let elements = self.pages.iter_mut().enumerate();
        elements.flat_map(move |(number, page)| page.elements_mut().iter_mut().take(used(number)))
    }

    /// Gives a page's memory back.
    pub fn free(&mut self, page: usize) {
        if let Some(page) = self.pages.get_mut(page) {
            *page = Page::Allocated(Vec::new());
        }
    }
}

impl<T: Pod> Extend<T> for PagedVec<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, elements: I) {
        elements.into_iter().for_each(|element| self.push(element));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_stay_where_they_are_until_their_page_goes() {
        let mut list = PagedVec::default();
        list.extend(0..3 * PAGE + 5);
        assert_eq!(list.len(), 3 * PAGE + 5);
        assert!(list.iter().copied().eq(0..3 * PAGE + 5));
        list.iter_mut().for_each(|element| *element += 1);
        for index in [0, PAGE - 1, PAGE, 3 * PAGE + 4] {
            assert_eq!(list.get(index), Some(&(index + 1)));
        }
        assert_eq!(list.get(3 * PAGE + 5), None);
        list.free(page_of(PAGE));
        assert_eq!([list.get(PAGE - 1), list.get(PAGE)], [Some(&PAGE), None]);
        assert!(list.iter().copied().eq((1..=PAGE).chain(2 * PAGE + 1..=3 * PAGE + 5)));
    }
}
