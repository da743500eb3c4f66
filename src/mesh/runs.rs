//! What is connected: numbers joined into runs (union-find).

/// Numbers from 0, joined into runs.
pub(crate) struct Runs(Vec<u32>);

impl Runs {
    /// So many numbers, each alone.
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// The least number of a run.
    pub fn top(&mut self, mut number: u32) -> u32 {
        while self.0[number as usize] != number {
            self.0[number as usize] = self.0[self.0[number as usize] as usize];
            number = self.0[number as usize];
        }
        number
    }

    /// Joins the runs of two numbers.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.top(a), self.top(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joined_numbers_have_one_top() {
        let mut runs = Runs::new(5);
        runs.join(3, 1);
        runs.join(4, 3);
        assert_eq!([0, 1, 2, 3, 4].map(|number| runs.top(number)), [0, 1, 2, 1, 1]);
    }
}
