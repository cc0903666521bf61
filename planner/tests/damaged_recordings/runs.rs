//! Damage to columns that only a recording of a run has: path time and measured columns.

use nalgebra::Vector3;
use planner::recorded::{RecordedSample, Rule, RunColumns};

use crate::damage::{Kind, run};
use crate::times::of;

const JOINT: usize = 4;
const SMOOTH: usize = 8;

pub(crate) const KINDS: [Kind; 8] = [
    run("path time: faster than time", &[Rule::PathTime], |rows| {
        columns(rows, |run| run.path_time_s *= 1.01);
    }),
    run("path time: goes back", &[Rule::PathTime], |rows| {
        let own = of(rows, SMOOTH);
        let at = own.start + own.len() / 2;
        set(&mut rows[at], |run| run.path_time_s -= 0.1);
    }),
    run(
        "path time: stands while the arm moves",
        &[Rule::PathTime],
        |rows| {
            columns(rows, |run| run.path_time_s = 0.0);
        },
    ),
    run(
        "measured: a joint far from the published one",
        &[Rule::Measured],
        |rows| {
            let own = of(rows, JOINT);
            set(&mut rows[own.start + 20], |run| run.measured[1] += 0.1);
        },
    ),
    run(
        "measured: the point of other joints",
        &[Rule::Measured],
        |rows| {
            columns(rows, |run| run.measured_point.z += 1e-6);
        },
    ),
    run(
        "run: times closed up over missing rows",
        &[Rule::Derivatives],
        |rows| {
            let own = of(rows, SMOOTH);
            let at = own.start + own.len() / 2;
            rows.drain(at..at + 10);
            for row in &mut rows[at..] {
                row.t_s -= 10.0 * crate::PERIOD;
            }
        },
    ),
    run(
        "run: a time that is no whole period",
        &[Rule::Time],
        |rows| {
            rows[40].t_s += 0.3 * crate::PERIOD;
        },
    ),
    run(
        "run: the arm creeps while it waits",
        &[Rule::Standstill],
        |rows| {
            for at in of(rows, 0) {
                rows[at].joints[0] += 1e-9 * at as f64;
            }
        },
    ),
];

fn set(row: &mut RecordedSample, change: impl Fn(&mut RunColumns)) {
    row.run.iter_mut().for_each(change);
}

fn columns(rows: &mut [RecordedSample], change: impl Fn(&mut RunColumns)) {
    rows.iter_mut().for_each(|row| set(row, &change));
}

/// The recording of a run that goes as planned: it waits first, tools belong to the move before,
/// and the measured arm is where it should be.
pub(crate) fn as_run(rows: &[RecordedSample]) -> Vec<RecordedSample> {
    let wait = (0..20).map(|_| rows[0].clone());
    let mut all: Vec<RecordedSample> = wait.chain(rows.iter().cloned()).collect();
    let (mut start, mut command) = (0.0, 0);
    for (index, row) in all.iter_mut().enumerate() {
        row.t_s = index as f64 * crate::PERIOD;
        let is_tool = [6, 9].contains(&row.command);
        if row.command != command && !is_tool {
            command = row.command;
            start = row.t_s - crate::PERIOD;
        }
        let waits = is_tool || command == 0;
        row.command = command;
        row.run = Some(RunColumns {
            path_time_s: if waits { 0.0 } else { row.t_s - start },
            measured: row.joints.clone(),
            measured_point: Vector3::from(row.pose.translation.vector),
        });
    }
    all
}
