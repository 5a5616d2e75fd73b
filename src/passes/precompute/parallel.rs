//! Parallel chunks: host work that threads take chunk by chunk. The result is independent of the
//! number of threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Items of a chunk: few enough that no thread works alone on the last one, many enough to
/// justify the overhead.
const CHUNK: usize = 2048;

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Calls `work` for chunks of `0..count`, and concatenates the results in the order of the chunks.
pub(super) fn in_chunks<T: Send>(count: usize, work: impl Fn(Range<usize>) -> Vec<T> + Sync) -> Vec<T> {
    in_chunks_of(CHUNK, count, work)
}

/// As [`in_chunks`], with `chunk_size` items a chunk, for expensive items.
pub(super) fn in_chunks_of<T: Send>(
    chunk_size: usize,
    count: usize,
    work: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let threads = threads().min(count.div_ceil(chunk_size));
    if threads <= 1 {
        return work(0..count);
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let chunk = next.fetch_add(1, Ordering::Relaxed);
            let first = chunk * chunk_size;
            if first >= count {
                return done;
            }
            done.push((chunk, work(first..count.min(first + chunk_size))));
        }
    };
    let mut chunks: Vec<(usize, Vec<T>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut chunks = work();
        for worker in workers {
            chunks.extend(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        chunks
    });
    chunks.sort_unstable_by_key(|chunk| chunk.0);
    let mut all = Vec::with_capacity(chunks.iter().map(|chunk| chunk.1.len()).sum());
    chunks.into_iter().for_each(|chunk| all.extend(chunk.1));
    all
}

/// One value for each of `0..count`.
pub(super) fn each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    in_chunks(count, |chunk| chunk.map(&work).collect())
}

/// Sorts in parallel, unstably: equal items must be identical.
pub(super) fn sort<T: Ord + Send>(items: &mut [T]) {
    sort_with(threads(), items);
}

fn sort_with<T: Ord + Send>(threads: usize, items: &mut [T]) {
    if threads <= 1 || items.len() <= CHUNK {
        return items.sort_unstable();
    }
    let (low, _, high) = items.select_nth_unstable(items.len() / 2);
    std::thread::scope(|scope| {
        scope.spawn(|| sort_with(threads / 2, low));
        sort_with(threads - threads / 2, high);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_come_back_in_order() {
        for count in [0, 1, CHUNK - 1, CHUNK, CHUNK + 1, 7 * CHUNK + 13] {
            assert_eq!(each(count, |i| 3 * i), (0..count).map(|i| 3 * i).collect::<Vec<_>>());
            let even = in_chunks(count, |chunk| chunk.filter(|i| i % 2 == 0).collect());
            assert_eq!(even, (0..count).step_by(2).collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_threads_sort_is_sorted() {
        for (count, threads) in [(0, 2), (CHUNK, 3), (CHUNK + 1, 2), (7 * CHUNK + 13, 5)] {
            // A linear congruential generator modulo a prime, with repetitions.
            let mut items: Vec<usize> = (0..count).map(|i| i * 40_503 % 9_973).collect();
            let mut expected = items.clone();
            expected.sort();
            sort_with(threads, &mut items);
            assert_eq!(items, expected);
        }
    }
}
