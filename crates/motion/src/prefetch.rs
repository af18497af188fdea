//! Asking for memory before it is read.
//!
//! Safe Rust has no way to do so, and one pass over more positions than caches hold takes half as long again without: a
//! processor asks ahead by itself, but not over the ends of pages.

/// Bytes ahead of those that are read at which memory is asked for: what comes while a few frames are worked on.
pub(crate) const AHEAD: usize = 6 << 10;

/// Asks for the memory so many bytes on from where a number is. Nothing is read, and what is asked for need not exist.
#[inline(always)]
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "the instruction's only safe form"))]
pub(crate) fn ahead_of(here: *const f64, bytes: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: a prefetch never faults and changes nothing but what is in caches; `wrapping_add` makes no claim that
        // the address is within an allocation. SSE is part of every x86-64.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(here.wrapping_byte_add(bytes).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (here, bytes);
}
