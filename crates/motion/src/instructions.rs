//! Which of the machine's instructions kernels use.

use std::fmt;
use std::sync::atomic::{AtomicU8, Ordering};

use pulp::Arch;

/// A set of instructions for which the kernels are compiled.
///
/// Every one gives the same bits: kernels sum up in eight lanes whatever the width of a register, and round products and sums
/// once.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Instructions {
    /// One number at a time: on every machine.
    Scalar,
    /// Four numbers at a time, x86-64 with AVX2 and FMA.
    Avx2,
    /// Eight numbers at a time, x86-64 with AVX-512.
    Avx512,
    /// Two numbers at a time, 64-bit ARM.
    Neon,
}

/// What all kernels of this process use, as numbered by [`Instructions`]; [`BEST`] where nobody has chosen.
static CHOSEN: AtomicU8 = AtomicU8::new(BEST);
const BEST: u8 = u8::MAX;

impl Instructions {
    /// All sets, known here or not.
    pub const ALL: [Self; 4] = [Self::Scalar, Self::Avx2, Self::Avx512, Self::Neon];

    /// Those that this machine has, the best last.
    pub fn here() -> Vec<Self> {
        Self::ALL.into_iter().filter(|set| set.arch().is_some()).collect()
    }

    /// Has all kernels of the process use this set from now on. `false` if the machine has not got it.
    pub fn choose(self) -> bool {
        let known = self.arch().is_some();
        if known {
            CHOSEN.store(self as u8, Ordering::Relaxed);
        }
        known
    }

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scalar => "scalar",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
            Self::Neon => "neon",
        }
    }

    pub(crate) fn arch(self) -> Option<Arch> {
        match self {
            Self::Scalar => Some(Arch::Scalar),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => pulp::x86::V3::try_new().map(Arch::V3),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => pulp::x86::V4::try_new().map(Arch::V4),
            #[cfg(target_arch = "aarch64")]
            Self::Neon => pulp::aarch64::Neon::try_new().map(Arch::Neon),
            #[allow(unreachable_patterns, reason = "not on every machine are there others")]
            _ => None,
        }
    }
}

impl fmt::Display for Instructions {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(self.name())
    }
}

/// The sum of what eight lanes hold, in the order in which registers of any width are summed up: halves, and halves of these.
#[expect(clippy::inline_always, reason = "what is not inlined loses the instruction set")]
#[inline(always)]
pub fn sum_of_lanes(lanes: &[f64; 8]) -> f64 {
    let [a, b, c, d] = [0, 1, 2, 3].map(|lane| lanes[lane] + lanes[lane + 4]);
    (a + c) + (b + d)
}

/// What kernels are dispatched by: the best set of the machine, unless another was [chosen](Instructions::choose).
pub fn arch() -> Arch {
    let chosen = CHOSEN.load(Ordering::Relaxed);
    if chosen == BEST {
        return Arch::new();
    }
    let set = Instructions::ALL.into_iter().find(|set| *set as u8 == chosen);
    set.and_then(Instructions::arch).unwrap_or_else(Arch::new)
}
