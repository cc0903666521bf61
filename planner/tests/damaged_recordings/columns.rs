//! Damage to single columns, which then contradict the others.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use planner::recorded::{RecordedSample, Rule};

use crate::damage::{Kind, rows};

pub(crate) const KINDS: [Kind; 30] = [
    rows("q: one sample off by 1e-6", &[Rule::Derivatives], |rows| {
        middle(rows).joints[1] += 1e-6;
    }),
    rows("q: a joint off by 0.01 all along", &[Rule::Pose], |rows| {
        each(rows, |row| row.joints[2] += 0.01);
    }),
    rows("q: two joints changed places", &[Rule::Pose], |rows| {
        each(rows, |row| row.joints.swap(1, 2));
    }),
    rows("q: scaled by 1.001", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.joints.iter_mut().for_each(|q| *q *= 1.001));
    }),
    rows("q: rounded to 1e-5", &[Rule::Derivatives], |rows| {
        each(rows, |row| {
            for q in &mut row.joints {
                *q = (*q * 1e5).round() / 1e5;
            }
        });
    }),
    rows("q: one period late", &[Rule::Derivatives], |rows| {
        late(rows, |from, to| to.joints.clone_from(&from.joints));
    }),
    rows(
        "q: noise of 1e-5",
        &[Rule::Derivatives, Rule::Standstill],
        |rows| {
            for (index, row) in rows.iter_mut().enumerate() {
                row.joints[3] += 1e-5 * ((index * 7919 % 13) as f64 - 6.0) / 6.0;
            }
        },
    ),
    rows("q: a joint stands still", &[Rule::Derivatives], |rows| {
        let first = rows[0].joints[0];
        each(rows, |row| row.joints[0] = first);
    }),
    rows("q: beyond its range", &[Rule::JointRange], |rows| {
        each(rows, |row| row.joints[1] += 20.0);
    }),
    rows("dq: scaled by 1.01", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.rates.iter_mut().for_each(|v| *v *= 1.01));
    }),
    rows("dq: zero", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.rates.fill(0.0));
    }),
    rows("dq: sign of one joint", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.rates[1] = -row.rates[1]);
    }),
    rows("dq: one period late", &[Rule::Derivatives], |rows| {
        late(rows, |from, to| to.rates.clone_from(&from.rates));
    }),
    rows(
        "dq: two joints changed places",
        &[Rule::Derivatives],
        |rows| {
            each(rows, |row| row.rates.swap(1, 2));
        },
    ),
    rows(
        "dq: off by 0.01 all along",
        &[Rule::Derivatives, Rule::Standstill],
        |rows| {
            each(rows, |row| row.rates[4] += 0.01);
        },
    ),
    rows(
        "dq: one sample beyond the limit",
        &[Rule::JointVelocity],
        |rows| {
            middle(rows).rates[0] = 100.0;
        },
    ),
    rows("dq: in degrees", &[Rule::Derivatives], |rows| {
        each(rows, |row| {
            row.rates.iter_mut().for_each(|v| *v = v.to_degrees())
        });
    }),
    rows(
        "ddq: scaled by 1.2",
        &[
            Rule::Derivatives,
            Rule::AngularAcceleration,
            Rule::ToolAcceleration,
        ],
        |rows| {
            each(rows, |row| {
                row.accelerations.iter_mut().for_each(|a| *a *= 1.2)
            });
        },
    ),
    rows("ddq: zero", &[Rule::Derivatives], |rows| {
        each(rows, |row| row.accelerations.fill(0.0));
    }),
    rows("ddq: sign", &[Rule::Derivatives], |rows| {
        each(rows, |row| {
            row.accelerations.iter_mut().for_each(|a| *a = -*a)
        });
    }),
    rows(
        "ddq: two joints changed places",
        &[Rule::Derivatives],
        |rows| {
            each(rows, |row| row.accelerations.swap(1, 2));
        },
    ),
    rows(
        "ddq: one sample beyond the limit",
        &[Rule::JointAcceleration],
        |rows| {
            middle(rows).accelerations[0] = 1e4;
        },
    ),
    rows(
        "ddq: one sample jumps",
        &[Rule::JointJerk, Rule::AngularAcceleration],
        |rows| {
            middle(rows).accelerations[0] += 5.0;
        },
    ),
    rows(
        "ddq: off by 0.5 all along",
        &[Rule::Derivatives, Rule::Standstill],
        |rows| {
            each(rows, |row| row.accelerations[3] += 0.5);
        },
    ),
    rows(
        "pose: x off by 1e-6 m in one sample",
        &[Rule::Pose],
        |rows| {
            middle(rows).pose.translation.x += 1e-6;
        },
    ),
    rows(
        "pose: in the frame of the base of another station",
        &[Rule::Pose],
        |rows| {
            let moved = Isometry3::translation(0.0, 0.0, 1e-4);
            each(rows, |row| row.pose = moved * row.pose);
        },
    ),
    rows("pose: turned by 1e-6 rad", &[Rule::Pose], |rows| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 1e-6, 0.0));
        each(rows, |row| row.pose.rotation *= turn);
    }),
    rows("pose: quaternion conjugated", &[Rule::Pose], |rows| {
        each(rows, |row| row.pose.rotation = row.pose.rotation.inverse());
    }),
    rows(
        "pose: of the flange instead of the tool",
        &[Rule::Pose],
        |rows| {
            let back = Translation3::new(0.0, 0.0, -0.12);
            each(rows, |row| row.pose *= back);
        },
    ),
    rows("pose: one period late", &[Rule::Pose], |rows| {
        late(rows, |from, to| to.pose = from.pose);
    }),
];

/// A row in which the arm moves, about the middle of the recording.
pub(crate) fn middle(rows: &mut [RecordedSample]) -> &mut RecordedSample {
    let half = rows.len() / 2;
    let fast = |row: &RecordedSample| row.rates.iter().map(|rate| rate.abs()).fold(0.0, f64::max);
    let most = rows.iter().map(fast).fold(0.0, f64::max);
    let at = (half..rows.len())
        .chain(0..half)
        .find(|&at| fast(&rows[at]) > 0.3 * most)
        .unwrap();
    &mut rows[at]
}

pub(crate) fn each(rows: &mut [RecordedSample], change: impl Fn(&mut RecordedSample)) {
    rows.iter_mut().for_each(change);
}

/// Gives each row something of the row before it.
fn late(rows: &mut [RecordedSample], change: impl Fn(&RecordedSample, &mut RecordedSample)) {
    let before = rows.to_vec();
    for (from, to) in before.iter().zip(&mut rows[1..]) {
        change(from, to);
    }
}
