//! Rules for columns that only a recording of a run has: path time and measured joints.

use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};

/// How far measured joints may be from the published ones (rad or m), and how far behind (s): what
/// the servo thread allows before it stops the arm.
const FOLLOWING: (f64, f64) = (0.02, 0.03);
/// Largest distance of the measured point from that of the measured joints, m.
const POINT: f64 = 1e-9;

/// Planned time grows from 0, never faster than time, and joints move only while it grows.
pub(super) fn path_time(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    for pair in recording.rows[span.shown()].windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let (Some(before), Some(now)) = (&from.run, &to.run) else {
            continue;
        };
        let time = to.t_s;
        let mut hold = |what, measure| {
            report.hold(Rule::PathTime, Subject::The(what), time, measure);
        };
        let moved = (0..recording.arm.dof())
            .map(|joint| (to.joints[joint] - from.joints[joint]).abs())
            .fold(0.0, f64::max);
        // At rest the next command may begin, or a tool may work.
        let begins = from.command != to.command || (to.rests() && now.path_time_s == 0.0);
        let since = if begins { 0.0 } else { before.path_time_s };
        let grown = now.path_time_s - since;
        let h = to.t_s - from.t_s;
        let at_most = Measure::at_most(grown, h * (1.0 + 1e-6) + 1e-9, "s");
        hold("the growth of planned time", at_most);
        let never_back = Measure::at_least(grown, -1e-9, "s");
        hold("the growth of planned time", never_back);
        if grown == 0.0 && !begins {
            let still = Measure::at_most(moved, 1e-12, "rad or m");
            hold("the way while planned time stands", still);
        }
    }
}

/// Checks that the measured joints follow, and that the measured point is that of the measured
/// joints.
pub(super) fn measured(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    for row in &recording.rows[span.own.clone()] {
        let Some(run) = &row.run else { continue };
        for joint in 0..recording.arm.dof() {
            let most = FOLLOWING.0 + FOLLOWING.1 * row.rates[joint].abs();
            let behind = (run.measured[joint] - row.joints[joint]).abs();
            let unit = recording.arm.unit(joint)[0];
            let measure = Measure::at_most(behind, most, unit);
            report.hold(Rule::Measured, Subject::Joint(joint), row.t_s, measure);
        }
        let flange = recording.arm.flange(&run.measured);
        let later = span.later_tools.iter().filter(|_| row.rests());
        let off = span
            .tools
            .iter()
            .chain(later)
            .map(|tool| ((flange * tool).translation.vector - run.measured_point).norm())
            .fold(f64::INFINITY, f64::min);
        let subject = Subject::The("the measured point");
        let measure = Measure::at_most(off, POINT, "m");
        report.hold(Rule::Measured, subject, row.t_s, measure);
    }
}
