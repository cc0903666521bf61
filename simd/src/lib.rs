//! Numbers four at a time: SIMD (AVX2 and FMA) if the processor has it, plain arithmetic otherwise.
//!
//! A computation is an [`Op`], generic over its build, and is compiled twice: [`Build`] chooses the
//! build once and runs the computation in it. [`F4`] has the usual operators on four numbers;
//! [`Frame`] is a rigid transform.
//!
//! Both builds give the same bits, except for fused multiply-adds: [`Four::fma`], [`F4::fma`],
//! [`F4::taken_from`] and everything that uses them, such as [`sin_cos`] and [`Moving`], are rounded
//! once in the SIMD build and twice in the plain one.
//!
//! Everything that a computation calls must be `#[inline(always)]`; otherwise it uses the plain
//! instruction set. The crate knows no robot and no motion, and has no `unsafe`.
//!
//! ```
//! use simd::{Build, F4, Four, Op};
//!
//! struct Norm([f64; 4]);
//!
//! impl Op for Norm {
//!     type Output = f64;
//!
//!     #[inline(always)]
//!     fn run<S: Four>(self, simd: S) -> f64 {
//!         let x = F4::new(simd, self.0);
//!         (x * x).sum().sqrt()
//!     }
//! }
//!
//! assert_eq!(Build::detect().run(Norm([2.0, 4.0, 5.0, 6.0])), 9.0);
//! ```

mod dispatch;
mod f4;
mod four;
mod frame;
mod fused;
mod trigonometry;
mod v4;

pub use dispatch::{Build, Op};
pub use f4::{F4, Mask, groups, transposed};
pub use four::{Four, LANES, Plain};
pub use frame::{Frame, Moving, Turn};
pub use fused::Fused;
pub use trigonometry::{sin_cos, sin_cos_of};
pub use v4::V4;
