//! How a motion keeps what is asked of a window of poses.

use nalgebra::Isometry3;

use super::certificate::{Certificate, corridor_of_legs};
use super::crossing::Crossing;
use super::span::Span;

/// What a motion keeps of what is asked.
pub(super) struct Judged {
    pub(super) certificate: Certificate,
    pub(super) crossings: Vec<Crossing>,
    /// Whether the passes do not change with what comes after it.
    pub(super) settled: bool,
}

impl Judged {
    pub(super) fn holds(&self) -> bool {
        self.certificate.holds() && self.settled
    }

    /// Whether it keeps all but the corridor.
    pub(super) fn only_leaves(&self) -> bool {
        let certificate = &self.certificate;
        let outside = certificate.corridor.ratio > 1.0;
        outside && self.settled && certificate.in_order && certificate.worst_limit() <= 1.0
    }

    /// The greatest distance of its `spans` from each leg over half the width of the corridor (m), by the pose at the end of the leg.
    pub(super) fn outside(
        &self,
        spans: &[Span],
        poses: &[Isometry3<f64>],
        corridor: f64,
    ) -> Vec<f64> {
        corridor_of_legs(spans, poses, &self.crossings, corridor)
    }
}
