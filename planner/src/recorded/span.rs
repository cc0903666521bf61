//! A recording divided into the commands of its program.

use std::ops::Range;

use crcl::Located;
use nalgebra::Isometry3;

use super::arm::Arm;
use super::finding::{Measure, RuleReport, Subject};
use super::row::RecordedSample;
use super::rule::Rule;
use crate::modal::Modal;
use crate::task::Task;

/// A recorded motion with the arm it is of.
pub(super) struct Recording<'a> {
    pub arm: Arm<'a>,
    pub rows: &'a [RecordedSample],
    /// Time between two rows, s; a run may leave some out.
    pub period: f64,
}

impl Recording<'_> {
    /// Whether it is of a run rather than of a plan.
    pub(super) fn is_run(&self) -> bool {
        self.rows.first().is_some_and(|row| row.run.is_some())
    }

    /// Time from row `index` to the next one, or a period where there is none, s.
    pub(super) fn time_after(&self, index: usize) -> f64 {
        match (self.rows.get(index), self.rows.get(index + 1)) {
            (Some(row), Some(next)) => next.t_s - row.t_s,
            _ => self.period,
        }
    }
}

/// One command and the rows that belong to it.
pub(super) struct Span<'a> {
    pub index: usize,
    pub located: &'a Located,
    /// The task of the command; `None` if it may not be executed.
    pub task: Option<Task>,
    /// Its own rows; the row before them is where it starts.
    pub own: Range<usize>,
    /// The controlled point when it starts.
    pub start: Isometry3<f64>,
    /// From the flange to the controlled point, before it and after it.
    pub tools: [Isometry3<f64>; 2],
    /// Those of the later commands without rows: a run shows them at its end.
    pub later_tools: Vec<Isometry3<f64>>,
    /// Nominal time of a gripper or tool changer, s.
    pub tool_time: f64,
    /// The first row after its own, if the arm still rests there: no move was in between.
    pub rest_after: Option<usize>,
}

impl Span<'_> {
    /// Its rows and the one before them.
    pub(super) fn shown(&self) -> Range<usize> {
        self.own.start.saturating_sub(1)..self.own.end
    }

    /// Whether the command may have rows of its own.
    fn takes_time(&self) -> bool {
        match &self.task {
            None | Some(Task::Move(_) | Task::Tool(_)) => true,
            Some(Task::Dwell { seconds }) => *seconds > 0.0,
            Some(_) => false,
        }
    }
}

/// Gives each command its rows, and resolves it from the position of the arm then. Returns each
/// with its findings so far; `whole` is about the recording.
pub(super) fn spans<'a>(
    recording: &Recording<'_>,
    mut modal: Modal,
    commands: &'a [Located],
    whole: &mut RuleReport,
) -> Vec<(Span<'a>, RuleReport)> {
    let rows = recording.rows;
    let mut at = 0;
    let mut flange = recording.arm.flange(&rows[0].joints);
    let mut spans: Vec<(Span<'a>, RuleReport)> = Vec::with_capacity(commands.len());
    for (index, located) in commands.iter().enumerate() {
        let count = rows[at..].iter().take_while(|row| row.command == index);
        let own = at..at + count.count();
        at = own.end;
        let mut report = RuleReport::of(index, located.line, located.command.name());
        let before = modal.tooling().flange_from_tool();
        let task = modal.resolve(&located.command, &flange);
        if let Err(error) = &task {
            report.refuse(error.to_string(), rows[own.start.saturating_sub(1)].t_s);
        }
        let stands = own.start.saturating_sub(1);
        let task = task
            .ok()
            .map(|task| of_point(recording, task, stands, &before));
        let tool_time = match &task {
            Some(Task::Tool(action)) => modal.tooling().nominal_time(*action),
            _ => 0.0,
        };
        let after = modal.tooling().flange_from_tool();
        let span = Span {
            index,
            located,
            task,
            start: flange * before,
            tools: [before, after],
            own,
            later_tools: Vec::new(),
            tool_time,
            rest_after: None,
        };
        flange = flange_after(recording, &span, &flange);
        column(recording, &span, &mut report);
        spans.push((span, report));
    }
    find_rests(&mut spans);
    if recording.is_run() {
        show_later_tools(&mut spans);
    }
    if let Some(row) = rows.get(at) {
        let subject = Subject::The("the number of a command out of its order");
        let measure = Measure::at_most(row.command as f64, f64::NAN, "");
        whole.hold(Rule::CommandColumn, subject, row.t_s, measure);
    }
    spans
}

/// A move of single joints, or a screw, as one of the controlled point, from where the arm stands in a row.
fn of_point(
    recording: &Recording<'_>,
    task: Task,
    row: usize,
    flange_from_tool: &Isometry3<f64>,
) -> Task {
    match task {
        Task::Joints(motion) => {
            let mut joints = recording.rows[row].joints.clone();
            motion.apply(&mut joints);
            Task::Move(motion.of_point(recording.arm.flange(&joints) * flange_from_tool))
        }
        Task::Screw(motion) => {
            let joints = &recording.rows[row].joints;
            let from = recording.arm.flange(joints) * flange_from_tool;
            Task::Move(motion.of_point(&from))
        }
        Task::Legs(legs) => Task::Move(legs.motion),
        task => task,
    }
}

/// Finds where the arm is at rest after a command.
fn find_rests(spans: &mut [(Span<'_>, RuleReport)]) {
    let mut rest = None;
    for (span, _) in spans.iter_mut().rev() {
        span.rest_after = rest;
        if span.task.is_none() || matches!(span.task, Some(Task::Move(_))) {
            rest = None;
        } else if !span.own.is_empty() {
            rest = Some(span.own.start);
        }
    }
}

/// Rows of a run while a tool works belong to the move before.
fn show_later_tools(spans: &mut [(Span<'_>, RuleReport)]) {
    let mut later = Vec::new();
    for (span, _) in spans.iter_mut().rev() {
        if !span.own.is_empty() {
            span.later_tools = std::mem::take(&mut later);
        }
        if span.tools[0] != span.tools[1] {
            later.push(span.tools[1]);
        }
    }
}

/// Pose of the flange after a command: where the rows show it at rest, otherwise as the program
/// says.
fn flange_after(
    recording: &Recording<'_>,
    span: &Span<'_>,
    before: &Isometry3<f64>,
) -> Isometry3<f64> {
    let Some(Task::Move(motion)) = &span.task else {
        return *before;
    };
    let last = recording.rows[span.shown()].last();
    match (last, motion.poses.last()) {
        (Some(row), _) if !span.own.is_empty() && row.rests() => recording.arm.flange(&row.joints),
        (_, Some(goal)) => goal * span.tools[1].inverse(),
        _ => *before,
    }
}

/// Commands that take no time have no rows; the first row may be of the first command, and a run
/// waits there for its first motion.
fn column(recording: &Recording<'_>, span: &Span<'_>, report: &mut RuleReport) {
    if span.takes_time() || span.own.is_empty() {
        return;
    }
    let allowed = match (span.index, recording.is_run()) {
        (0, true) => span.own.len(),
        (0, false) => 1,
        _ => 0,
    };
    let subject = Subject::The("rows of a command that takes no time");
    let measure = Measure::at_most(span.own.len() as f64, allowed as f64, "");
    let time = recording.rows[span.own.start].t_s;
    report.hold(Rule::CommandColumn, subject, time, measure);
}
