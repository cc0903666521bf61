//! How near the measured tool must come to the end of a command.

use nalgebra::{SMatrix, SVector, Vector3};

/// How near the measured tool must come to the end of a command before it is done and the next one
/// moves. It is pushed in front of the last segment of its command.
///
/// The distance of the tool is that of the joints times the Jacobian at the end. The joints are within
/// milliradians there, so what it leaves out is micrometres.
///
/// ```
/// use nalgebra::{SMatrix, vector};
/// use servo::EndTolerance;
/// // An arm of one joint, 0.8 m long, that ends at 0.5 rad: within half a millimetre.
/// let end = EndTolerance {
///     command: 7,
///     joints: vector![0.5],
///     jacobian: SMatrix::<f64, 6, 1>::new(0.0, 0.8, 0.0, 0.0, 0.0, 1.0),
///     point: 5e-4,
///     angle: f64::INFINITY,
/// };
/// assert!(end.off(&vector![0.5006]).is_within());
/// assert!(!end.off(&vector![0.5007]).is_within());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndTolerance<const N: usize> {
    /// Index of the command.
    pub command: u32,
    /// Where the joints are at its end (rad, m).
    pub joints: SVector<f64, N>,
    /// Jacobian of the controlled point there: three rows for its place, three for its rotation.
    pub jacobian: SMatrix<f64, 6, N>,
    /// How far the controlled point may be from its place (m).
    pub point: f64,
    /// How far its orientation may be turned (rad).
    pub angle: f64,
}

/// How far the measured tool is from the end of a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OffEnd {
    /// Distance of the controlled point (m).
    pub point: f64,
    /// Angle to its orientation (rad).
    pub angle: f64,
    /// The larger of the two as a part of its tolerance.
    pub share: f64,
}

impl OffEnd {
    /// Not yet measured.
    pub const UNKNOWN: Self = Self {
        point: f64::INFINITY,
        angle: f64::INFINITY,
        share: f64::INFINITY,
    };

    /// Whether point and orientation are within their tolerances.
    pub fn is_within(&self) -> bool {
        self.share <= 1.0
    }
}

impl<const N: usize> EndTolerance<N> {
    /// How far the tool is from the end when the joints are at `measured` (rad, m).
    pub fn off(&self, measured: &SVector<f64, N>) -> OffEnd {
        let twist = self.jacobian * (measured - self.joints);
        let [vx, vy, vz, wx, wy, wz] = twist.data.0[0];
        let point = Vector3::new(vx, vy, vz).norm();
        let angle = Vector3::new(wx, wy, wz).norm();
        OffEnd {
            point,
            angle,
            share: (point / self.point).max(angle / self.angle),
        }
    }
}
