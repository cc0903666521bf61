//! Rules for commands that move nothing: the arm rests, and they last as long as they must.

use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};

/// What a joint may move by rounding, rad or m.
const STILL: f64 = 1e-12;

/// Nothing moves.
pub(super) fn standstill(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    let rows = &recording.rows[span.own.clone()];
    let Some(first) = rows.first() else { return };
    for row in rows {
        for joint in 0..recording.arm.dof() {
            let subject = Subject::Joint(joint);
            let [place, speed, change, _] = recording.arm.unit(joint);
            let moved = (row.joints[joint] - first.joints[joint]).abs();
            let numbers = [
                (moved, STILL, place),
                (row.rates[joint].abs(), 1e-9, speed),
                (row.accelerations[joint].abs(), 1e-9, change),
            ];
            for (value, most, unit) in numbers {
                let measure = Measure::at_most(value, most, unit);
                report.hold(Rule::Standstill, subject, row.t_s, measure);
            }
        }
    }
}

/// It lasts at least `seconds`. It starts not before the last row of the commands before it, and
/// ends before the first row of those after it.
pub(super) fn duration(
    recording: &Recording<'_>,
    span: &Span<'_>,
    seconds: f64,
    report: &mut RuleReport,
) {
    let before = span.own.start.saturating_sub(1);
    let last = span.own.end.saturating_sub(1).max(before);
    let (start, end) = (recording.rows[before].t_s, recording.rows[last].t_s);
    let longest = end + recording.time_after(last) - start;
    // Durations are whole ticks but for rounding.
    let measure = Measure::at_least(longest, seconds - 1e-7, "s");
    report.hold(
        Rule::Duration,
        Subject::The("the time it takes"),
        start,
        measure,
    );
}
