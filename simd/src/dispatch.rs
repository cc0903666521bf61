//! The choice between both builds.

use crate::four::{Four, Plain};
use crate::fused::Fused;

/// A computation that is compiled for both builds. `run` and all that it calls must be
/// `#[inline(always)]`.
pub trait Op {
    /// What it computes.
    type Output;
    /// Computes it.
    fn run<S: Four>(self, simd: S) -> Self::Output;
}

/// Which build to use: SIMD, with the proof that the processor has it, or plain.
#[derive(Clone, Copy, Debug)]
pub enum Build {
    /// The build for every processor.
    Plain,
    /// AVX2 and FMA, with the proof.
    #[cfg(target_arch = "x86_64")]
    Wide(pulp::x86::V3),
    /// Fused multiply-adds, which every such processor has.
    #[cfg(target_arch = "aarch64")]
    Wide,
}

impl Build {
    /// The best that this processor has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            pulp::x86::V3::try_new().map_or(Self::Plain, Self::Wide)
        }
        #[cfg(target_arch = "aarch64")]
        {
            Self::Wide
        }
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        {
            Self::Plain
        }
    }

    /// Runs a computation in this build.
    #[inline(always)]
    pub fn run<O: Op>(self, op: O) -> O::Output {
        match self {
            Self::Plain => plain(op),
            #[cfg(target_arch = "x86_64")]
            Self::Wide(simd) => simd.vectorize(Wide(op, simd)),
            #[cfg(target_arch = "aarch64")]
            Self::Wide => op.run(Fused(())),
        }
    }
}

/// The plain build of a computation; not inlined, so it is compiled once.
#[inline(never)]
fn plain<O: Op>(op: O) -> O::Output {
    op.run(Plain)
}

/// Adapter for `pulp`, which compiles `call` with SIMD instructions.
#[cfg(target_arch = "x86_64")]
struct Wide<O>(O, pulp::x86::V3);

#[cfg(target_arch = "x86_64")]
impl<O: Op> pulp::NullaryFnOnce for Wide<O> {
    type Output = O::Output;

    #[inline(always)]
    fn call(self) -> O::Output {
        self.0.run(Fused(self.1))
    }
}
