//! temp
use super::*;
use nalgebra::Isometry3;
/// x
#[derive(Clone, Debug)]
pub struct Windows { plan: SmoothPlan }
impl Windows {
    /// x
    /// # Errors
    /// x
    pub fn new(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<Self, SmoothError> { Ok(Self { plan: plan(poses, options)? }) }
    /// x
    pub fn next(&mut self) {}
    /// x
    pub fn finish(self) -> SmoothPlan { self.plan }
}
