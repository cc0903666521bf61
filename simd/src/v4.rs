//! A vector in memory.

use crate::four::Four;

/// Four numbers in memory, aligned as a register; the fourth of a direction is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct V4(pub [f64; 4]);

impl V4 {
    /// A direction.
    #[inline(always)]
    pub fn new(x: f64, y: f64, z: f64) -> Self {
        Self([x, y, z, 0.0])
    }

    /// `self - o`.
    #[inline(always)]
    #[must_use]
    pub fn minus(self, o: Self) -> Self {
        let (v, o) = (self.0, o.0);
        Self([v[0] - o[0], v[1] - o[1], v[2] - o[2], v[3] - o[3]])
    }

    /// Vector product of the first three.
    #[inline(always)]
    #[must_use]
    pub fn cross<S: Four>(self, a: S, o: Self) -> Self {
        let (v, o) = (self.0, o.0);
        Self([
            a.fma(v[1], o[2], -(v[2] * o[1])),
            a.fma(v[2], o[0], -(v[0] * o[2])),
            a.fma(v[0], o[1], -(v[1] * o[0])),
            0.0,
        ])
    }
}
