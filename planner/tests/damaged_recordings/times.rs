//! Damage to times, to the order of rows and to the command column.

use planner::recorded::{RecordedSample, Rule};

use crate::columns::each;
use crate::damage::{Kind, rows};

/// Commands of the scene's program.
const STRAIGHT: usize = 5;
const GRIPPER: usize = 6;
const DWELL: usize = 7;
const SMOOTH: usize = 8;

pub(crate) const KINDS: [Kind; 25] = [
    rows("time: runs 2 % faster", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.t_s *= 0.98);
    }),
    rows("time: runs 2 % slower", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.t_s *= 1.02);
    }),
    rows("time: begins at 0.5 s", &[Rule::Time], |rows| {
        each(rows, |row| row.t_s += 0.5);
    }),
    rows("time: two rows changed places", &[Rule::Time], |rows| {
        rows.swap(40, 41)
    }),
    rows("time: the same twice", &[Rule::Time], |rows| {
        rows[41].t_s = rows[40].t_s;
    }),
    rows(
        "time: one value off by a tenth of a period",
        &[Rule::Time],
        |rows| {
            rows[41].t_s += 0.1 * (rows[41].t_s - rows[40].t_s);
        },
    ),
    rows("time: a row is missing", &[Rule::Time], |rows| {
        rows.remove(100);
    }),
    rows("time: a gap of 0.1 s", &[Rule::Time], |rows| {
        each(&mut rows[200..], |row| row.t_s += 0.1);
    }),
    rows(
        "rows: one missing, times closed up",
        &[Rule::Derivatives],
        |rows| {
            let at = fast(rows);
            cut(rows, at..at + 1);
        },
    ),
    rows("rows: one doubled", &[Rule::Derivatives], |rows| {
        let at = fast(rows);
        insert(rows, at, 1);
    }),
    rows(
        "rows: the arm stops dead for 0.1 s",
        &[Rule::Derivatives],
        |rows| {
            let at = fast(rows);
            insert(rows, at, 50);
        },
    ),
    rows("rows: the start is missing", &[Rule::Rest], |rows| {
        cut(rows, 0..200);
    }),
    rows("rows: the end is missing", &[Rule::End], |rows| {
        let keep = rows.len() - 300;
        rows.truncate(keep);
    }),
    rows("rows: a whole move is missing", &[Rule::End], |rows| {
        let own = of(rows, STRAIGHT);
        cut(rows, own);
    }),
    rows("rows: none", &[Rule::Time], Vec::clear),
    rows("rows: backwards in time", &[Rule::End], |rows| {
        let times: Vec<f64> = rows.iter().map(|row| row.t_s).collect();
        let commands: Vec<usize> = rows.iter().map(|row| row.command).collect();
        rows.reverse();
        for ((row, time), command) in rows.iter_mut().zip(times).zip(commands) {
            (row.t_s, row.command) = (time, command);
            row.rates.iter_mut().for_each(|rate| *rate = -*rate);
        }
    }),
    rows("Dwell: half of it", &[Rule::Duration], |rows| {
        let own = of(rows, DWELL);
        cut(rows, own.start..own.start + own.len() / 2);
    }),
    rows("Dwell: 5 % shorter", &[Rule::Duration], |rows| {
        let own = of(rows, DWELL);
        cut(rows, own.start..own.start + own.len() / 20);
    }),
    rows("Dwell: a joint creeps", &[Rule::Standstill], |rows| {
        for at in of(rows, DWELL) {
            rows[at].joints[2] += 1e-9 * at as f64;
        }
    }),
    rows("gripper: half of its time", &[Rule::Duration], |rows| {
        let own = of(rows, GRIPPER);
        cut(rows, own.start..own.start + own.len() / 2);
    }),
    rows("command: the next one too early", &[Rule::Rest], |rows| {
        let own = of(rows, SMOOTH);
        for row in &mut rows[own.end - 50..own.end] {
            row.command += 1;
        }
    }),
    rows(
        "command: the next one too late",
        &[Rule::Standstill],
        |rows| {
            let own = of(rows, SMOOTH);
            for row in &mut rows[own.start..own.start + 50] {
                row.command -= 1;
            }
        },
    ),
    rows("command: falls", &[Rule::CommandColumn], |rows| {
        let own = of(rows, SMOOTH);
        for row in &mut rows[own.start..own.start + 50] {
            row.command = 4;
        }
    }),
    rows(
        "command: one that takes no time",
        &[Rule::CommandColumn],
        |rows| {
            for row in &mut rows[1..20] {
                row.command = 2;
            }
        },
    ),
    rows(
        "command: beyond the program",
        &[Rule::CommandColumn],
        |rows| {
            let count = rows.len();
            for row in &mut rows[count - 20..] {
                row.command = 99;
            }
        },
    ),
];

/// Rows of a command.
pub(crate) fn of(rows: &[RecordedSample], command: usize) -> std::ops::Range<usize> {
    let start = rows.iter().position(|row| row.command == command).unwrap();
    let count = rows[start..]
        .iter()
        .take_while(|row| row.command == command);
    start..start + count.count()
}

/// A row of the straight move at which the arm moves.
fn fast(rows: &[RecordedSample]) -> usize {
    let own = of(rows, STRAIGHT);
    own.start + own.len() / 2
}

/// Takes rows out and closes the times up.
fn cut(rows: &mut Vec<RecordedSample>, range: std::ops::Range<usize>) {
    rows.drain(range);
    even(rows);
}

/// Repeats a row.
fn insert(rows: &mut Vec<RecordedSample>, at: usize, times: usize) {
    let row = rows[at].clone();
    rows.splice(at..at, vec![row; times]);
    even(rows);
}

/// Times at even distances.
fn even(rows: &mut [RecordedSample]) {
    for (index, row) in rows.iter_mut().enumerate() {
        row.t_s = index as f64 * crate::PERIOD;
    }
}
