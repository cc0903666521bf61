//! Efforts of the joints as feed-forward.

use std::fmt;
use std::sync::Arc;

use nalgebra::SVector;

/// The efforts (Nm, N) that joints at given positions (rad, m), velocities and accelerations need.
type Efforts<const N: usize> = dyn Fn(&[SVector<f64, N>; 3]) -> SVector<f64, N> + Send + Sync;

/// Computes the efforts that each setpoint carries. It is called in the period, so the function must
/// not use heap, lock or log.
///
/// ```
/// use nalgebra::{SVector, vector};
/// let weight = servo::FeedForward::new(|[q, _, _]: &[SVector<f64, 1>; 3]| q.map(|q| 9.81 * q.cos()));
/// let rest = vector![0.0];
/// assert_eq!(weight.efforts(&[rest, rest, rest]), vector![9.81]);
/// ```
#[derive(Clone)]
pub struct FeedForward<const N: usize>(Arc<Efforts<N>>);

impl<const N: usize> FeedForward<N> {
    /// From a function of positions, velocities and accelerations.
    pub fn new(
        efforts: impl Fn(&[SVector<f64, N>; 3]) -> SVector<f64, N> + Send + Sync + 'static,
    ) -> Self {
        Self(Arc::new(efforts))
    }

    /// The efforts for positions (rad, m), velocities and accelerations.
    #[must_use]
    pub fn efforts(&self, joints: &[SVector<f64, N>; 3]) -> SVector<f64, N> {
        (self.0)(joints)
    }
}

impl<const N: usize> fmt::Debug for FeedForward<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "FeedForward<{N}>")
    }
}
