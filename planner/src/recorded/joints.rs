//! Rules for the joint columns: limits, and each column against the others.

use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};

/// Largest accepted ratio to a limit: tolerance for rounding on both sides.
pub(super) const ALLOWED: f64 = 1.0 + 1e-9;

/// Rounding of positions, velocities and accelerations where pieces of a motion meet.
const ROUNDING: [f64; 3] = [2e-12, 1e-10, 1e-8];

/// Limits at every sample.
pub(super) fn limits(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    let limits = recording.arm.limits;
    for row in &recording.rows[span.own.clone()] {
        let time = row.t_s;
        for joint in 0..recording.arm.dof() {
            let subject = Subject::Joint(joint);
            let [place, speed, change, _] = recording.arm.unit(joint);
            let q = row.joints[joint];
            let upper = Measure::at_most(q, limits.upper[joint] + 1e-9, place);
            let lower = Measure::at_least(q, limits.lower[joint] - 1e-9, place);
            report.hold(Rule::JointRange, subject, time, upper);
            report.hold(Rule::JointRange, subject, time, lower);
            let most = limits.speed(joint, q, row.rates[joint]) * ALLOWED;
            let measure = Measure::at_most(row.rates[joint].abs(), most, speed);
            report.hold(Rule::JointVelocity, subject, time, measure);
            let most = limits.acceleration[joint] * ALLOWED;
            let measure = Measure::at_most(row.accelerations[joint].abs(), most, change);
            report.hold(Rule::JointAcceleration, subject, time, measure);
        }
    }
}

/// Each sample against the one before it.
///
/// A motion of bounded jerk leads from one sample to the next if and only if three weighted means
/// of its jerk are possible. With `y` from 1 at the one to 0 at the other, the weights are 1 for
/// the acceleration, `h (y - 1/2)` for the velocity and `h^2 (y^2 - y + 1/6) / 2` for the position:
/// the errors of the trapezoid rule without and with its first correction. Their integrals are `h`,
/// `h^2 / 4` and `sqrt(3) / 54 h^3`.
///
/// # Source
/// Trapezoid rule and Euler-Maclaurin correction: P. Davis, P. Rabinowitz, Methods of Numerical
/// Integration, 2nd edition 1984, section 2.9.
pub(super) fn derivatives(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    let limits = recording.arm.limits;
    for pair in recording.rows[span.shown()].windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let h = to.t_s - from.t_s;
        for joint in 0..recording.arm.dof() {
            let subject = Subject::Joint(joint);
            let [place, speed, _, jolt] = recording.arm.unit(joint);
            let jerk = limits.jerk[joint] * ALLOWED;
            let change = to.accelerations[joint] - from.accelerations[joint];
            let measure = Measure::at_most(change.abs() / h, jerk + ROUNDING[2] / h, jolt);
            report.hold(Rule::JointJerk, subject, to.t_s, measure);
            let sum = to.accelerations[joint] + from.accelerations[joint];
            let off = to.rates[joint] - from.rates[joint] - h * sum / 2.0;
            let most = jerk * h * h / 4.0 + ROUNDING[1] + h * ROUNDING[2];
            let measure = Measure::at_most(off.abs(), most, speed);
            report.hold(Rule::Derivatives, subject, to.t_s, measure);
            let sum = to.rates[joint] + from.rates[joint];
            let way = h * sum / 2.0 - h * h * change / 12.0;
            let off = to.joints[joint] - from.joints[joint] - way;
            let most = 3_f64.sqrt() / 54.0 * jerk * h * h * h
                + ROUNDING[0]
                + h * ROUNDING[1]
                + h * h * ROUNDING[2];
            let measure = Measure::at_most(off.abs(), most, place);
            report.hold(Rule::Derivatives, Subject::Joint(joint), to.t_s, measure);
        }
    }
}
