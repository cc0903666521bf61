//! Rules for the time column and the command column.

use super::finding::{Measure, RuleReport, Subject};
use super::row::RecordedSample;
use super::rule::Rule;

/// Largest error of a time, in periods: rounding of the written numbers.
const ROUNDING: f64 = 1e-6;

/// Checks the time column against its rule; returns the period (s), or `None` if times do not grow
/// and nothing else can be checked.
pub(super) fn period(rows: &[RecordedSample], report: &mut RuleReport) -> Option<f64> {
    let subject = Subject::The("the time column");
    let first = rows.first().map_or(f64::NAN, |row| row.t_s);
    let from_zero = Measure::at_most(first.abs(), 1e-9, "s");
    report.hold(Rule::Time, subject, first, from_zero);
    let steps = || {
        rows.windows(2)
            .map(|pair| (pair[1].t_s - pair[0].t_s, pair[1].t_s))
    };
    let mut grows = !rows.is_empty();
    for (step, time) in steps() {
        // A step of zero is not a step.
        let measure = Measure::at_least(step, f64::MIN_POSITIVE, "s");
        grows &= report.hold(Rule::Time, subject, time, measure);
    }
    if !grows {
        return None;
    }
    let period = steps().map(|(step, _)| step).fold(f64::INFINITY, f64::min);
    if period.is_infinite() {
        // A single row: nothing takes time.
        return Some(0.0);
    }
    let is_run = rows.iter().any(|row| row.run.is_some());
    for (step, time) in steps() {
        let periods = step / period;
        let whole = if is_run { periods.round() } else { 1.0 };
        // Times of many periods carry the rounding of their own size.
        let limit = ROUNDING + 8.0 * f64::EPSILON * time / period;
        let measure = Measure::at_most((periods - whole).abs(), limit, "periods");
        report.hold(
            Rule::Time,
            Subject::The("the step of the time column"),
            time,
            measure,
        );
    }
    Some(period)
}
