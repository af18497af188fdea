//! Numbers that begin where a cache line does, so that no register of them lies across two.

use std::ops::{Deref, DerefMut};

/// Bytes of a cache line, which are those of the widest register.
const LINE: usize = 64;

/// Numbers whose first is at the start of a cache line.
#[derive(Debug, Default)]
pub(super) struct Aligned {
    room: Vec<f64>,
    start: usize,
    length: usize,
}

impl Aligned {
    /// So many zeros.
    pub(super) fn zeros(length: usize) -> Self {
        Self::default().resized(length)
    }

    /// The same room with so many numbers in it, whatever they are.
    pub(super) fn resized(mut self, length: usize) -> Self {
        self.room.resize(self.room.len().max(length + LINE / size_of::<f64>()), 0.0);
        let start = self.room.as_ptr().align_offset(LINE);
        // Where nobody can tell, numbers start anywhere.
        self.start = if start < LINE { start } else { 0 };
        self.length = length;
        self
    }
}

impl Clone for Aligned {
    fn clone(&self) -> Self {
        let mut other = Self::zeros(self.length);
        other.copy_from_slice(self);
        other
    }
}

impl Deref for Aligned {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.room[self.start..self.start + self.length]
    }
}

impl DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.room[self.start..self.start + self.length]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_begin_at_a_line_and_are_copied_with_it() {
        for length in [0, 1, 8, 1001] {
            let mut numbers = Aligned::zeros(length);
            numbers.iter_mut().zip(1..).for_each(|(number, k)| *number = f64::from(k));
            let copy = numbers.clone().resized(length);
            assert_eq!(numbers[..], copy[..]);
            assert!([&numbers, &copy].iter().all(|numbers| (numbers.as_ptr() as usize).is_multiple_of(LINE)));
        }
    }
}
