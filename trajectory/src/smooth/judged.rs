//! How a motion keeps what is asked of a window of poses.

use super::certificate::Certificate;
use super::crossing::Crossing;

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
}
