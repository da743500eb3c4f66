//! What is connected (union-find): each set is known by its least member, its root. Paths are halved
//! on the way to a root (Tarjan and van Leeuwen 1984).

/// The numbers from 0, divided into disjoint sets.
pub(crate) struct DisjointSet(Vec<u32>);

impl DisjointSet {
    /// So many numbers, each a set of its own.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Adds the next number, a set of its own, and returns it.
    pub fn push(&mut self) -> u32 {
        let number = self.0.len() as u32;
        self.0.push(number);
        number
    }

    /// How many numbers there are.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// The least member of the number's set.
    pub fn root(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            self.0[number as usize] = self.0[self.0[number as usize] as usize];
            number = self.0[number as usize];
        }
        number
    }

    /// Makes one set of the sets of two numbers.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_numbers_have_one_root() {
        let mut sets = DisjointSet::new(4);
        assert_eq!((sets.push(), sets.len()), (4, 5));
        sets.join(3, 1);
        sets.join(4, 3);
        assert_eq!([0, 1, 2, 3, 4].map(|number| sets.root(number)), [0, 1, 2, 1, 1]);
    }
}
