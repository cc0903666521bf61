//! Rows in groups that the compiler turns into vector instructions.

/// Rows in a group.
pub(super) const LANE: usize = 4;

/// One number of each row of a group.
pub(super) type Lane = [f64; LANE];

/// The sum over a group.
pub(super) fn sum(lane: &Lane) -> f64 {
    (lane[0] + lane[1]) + (lane[2] + lane[3])
}

/// The largest of a group.
pub(super) fn largest(lane: &Lane) -> f64 {
    lane[0].max(lane[1]).max(lane[2].max(lane[3]))
}
