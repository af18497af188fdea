//! The floor: reading memory once, below which nothing that looks at all data can be.

use std::hint::black_box;

use crate::alternation::seconds_of;

/// Sums that run beside each other, so that no addition waits for another.
const SUMS: usize = 32;

/// The sum of all numbers, at the speed of memory.
pub(crate) fn sum_bytes(numbers: &[f64]) -> f64 {
    let mut sums = [0.0; SUMS];
    let chunks = numbers.chunks_exact(SUMS);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for (sum, number) in sums.iter_mut().zip(chunk) {
            *sum += number;
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// Seconds that reading numbers once takes.
pub(crate) fn read_once(numbers: &[f64]) -> f64 {
    seconds_of(1, || {
        black_box(sum_bytes(black_box(numbers)));
    })
}

/// As many numbers as no cache holds, to watch memory by where a workload is smaller.
pub(crate) fn beyond_caches() -> Vec<f64> {
    (0..8_000_000_u32).map(f64::from).collect()
}
