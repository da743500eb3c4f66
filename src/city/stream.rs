//! Blocks made in parallel and written in order, a few at a time.

use rayon::prelude::*;

use crate::Result;

/// Makes, numbers, encodes and writes `count` items. Making and encoding run in parallel;
/// numbering and writing see the items one after another, in order, so that the result is the same
/// at any number of threads. While a batch is written the next one is made; a batch is two items
/// for each thread of the current rayon pool, which bounds the memory.
pub(super) fn in_order<M: Send, N: Send, T: Send>(
    count: usize,
    make: impl Fn(usize) -> Result<M> + Sync,
    mut number: impl FnMut(&M) -> N + Send,
    encode: impl Fn(usize, M, N) -> Result<T> + Sync,
    mut write: impl FnMut(T) -> Result<()> + Send,
) -> Result<()> {
    let batch = 2 * rayon::current_num_threads();
    let mut pending: Vec<T> = Vec::new();
    for start in (0..count).step_by(batch) {
        let indices = start..count.min(start + batch);
        let (written, encoded) = rayon::join(
            || pending.drain(..).try_for_each(&mut write),
            || -> Result<Vec<T>> {
                let made: Vec<M> =
                    indices.clone().into_par_iter().map(&make).collect::<Result<_>>()?;
                let numbers: Vec<N> = made.iter().map(&mut number).collect();
                let numbered: Vec<_> = indices.clone().zip(made).zip(numbers).collect();
                numbered
                    .into_par_iter()
                    .map(|((index, item), number)| encode(index, item, number))
                    .collect()
            },
        );
        written?;
        pending = encoded?;
    }
    pending.drain(..).try_for_each(&mut write)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    #[test]
    fn items_are_numbered_and_written_in_order() {
        let mut next = 0;
        let mut written = Vec::new();
        in_order(
            1000,
            |index| Ok(index % 7),
            |size| {
                next += size;
                next - size
            },
            |index, size, first| Ok((index, size, first)),
            |item| {
                written.push(item);
                Ok(())
            },
        )
        .unwrap();
        let mut first = 0;
        for (expected, item) in written.iter().enumerate() {
            assert_eq!(*item, (expected, expected % 7, first));
            first += expected % 7;
        }
        assert_eq!(written.len(), 1000);
    }

    #[test]
    fn the_first_failure_ends_it() {
        let result = in_order(
            100,
            |index| if index == 60 { Err(Error::Usage("60".into())) } else { Ok(index) },
            |_| (),
            |_, index, ()| Ok(index),
            |index| if index < 60 { Ok(()) } else { Err(Error::Usage("too far".into())) },
        );
        assert_eq!(result.unwrap_err().to_string(), "60");
    }
}
