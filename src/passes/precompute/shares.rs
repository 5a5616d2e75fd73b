//! Host work in shares that threads take one after another. What comes out does not depend on how many threads there are.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Items of a share: few enough that no thread is left alone with the last one, many enough to be worth taking.
const SHARE: usize = 2048;

fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Calls `work` for shares of `0..count`, and puts what they return in the order of the shares.
pub(super) fn in_shares<T: Send>(count: usize, work: impl Fn(Range<usize>) -> Vec<T> + Sync) -> Vec<T> {
    in_shares_of(SHARE, count, work)
}

/// The same with so many items to a share, where each of them is much work.
pub(super) fn in_shares_of<T: Send>(
    share_size: usize,
    count: usize,
    work: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> Vec<T> {
    let threads = threads().min(count.div_ceil(share_size));
    if threads <= 1 {
        return work(0..count);
    }
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let share = next.fetch_add(1, Ordering::Relaxed);
            let first = share * share_size;
            if first >= count {
                return done;
            }
            done.push((share, work(first..count.min(first + share_size))));
        }
    };
    let mut shares: Vec<(usize, Vec<T>)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut shares = work();
        for worker in workers {
            shares.extend(worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        shares
    });
    shares.sort_unstable_by_key(|share| share.0);
    let mut all = Vec::with_capacity(shares.iter().map(|share| share.1.len()).sum());
    shares.into_iter().for_each(|share| all.extend(share.1));
    all
}

/// One value for each of `0..count`.
pub(super) fn each<T: Send>(count: usize, work: impl Fn(usize) -> T + Sync) -> Vec<T> {
    in_shares(count, |share| share.map(&work).collect())
}

/// Sorts; equal items must be alike.
pub(super) fn sort<T: Ord + Send>(items: &mut [T]) {
    sort_with(threads(), items);
}

fn sort_with<T: Ord + Send>(threads: usize, items: &mut [T]) {
    if threads <= 1 || items.len() <= SHARE {
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
    fn shares_come_back_in_order() {
        for count in [0, 1, SHARE - 1, SHARE, SHARE + 1, 7 * SHARE + 13] {
            assert_eq!(each(count, |i| 3 * i), (0..count).map(|i| 3 * i).collect::<Vec<_>>());
            let even = in_shares(count, |share| share.filter(|i| i % 2 == 0).collect());
            assert_eq!(even, (0..count).step_by(2).collect::<Vec<_>>());
        }
    }

    #[test]
    fn what_threads_sort_is_sorted() {
        for (count, threads) in [(0, 2), (SHARE, 3), (SHARE + 1, 2), (7 * SHARE + 13, 5)] {
            // A linear congruential generator modulo a prime, with repetitions.
            let mut items: Vec<usize> = (0..count).map(|i| i * 40_503 % 9_973).collect();
            let mut expected = items.clone();
            expected.sort();
            sort_with(threads, &mut items);
            assert_eq!(items, expected);
        }
    }
}
