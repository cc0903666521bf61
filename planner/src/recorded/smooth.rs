//! Rules for smooth moves: the poses are passed in order within tolerance, along the straight legs.
//!
//! There must be passing times, not decreasing, such that the controlled point is within the
//! tolerance of each intermediate pose at its time and, from each to the next, within the corridor
//! of the leg between them. Whether there are is decided exactly for the samples: from each one to
//! the next, the set of legs that the motion may be on.

use std::ops::Range;

use nalgebra::{Isometry3, Vector3};
use trajectory::smooth::off_segment;

use super::arm::{ToolState, angle_between};
use super::between::{Quintic, from_rest, off_quintic};
use super::ends::ARRIVED;
use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};
use super::straight::STRAIGHT;
use super::verdict::PassFound;
use crate::task::Move;

/// Number of places between two samples that are checked.
const PARTS: usize = 8;

/// A smooth move with what was recorded of it.
pub(super) struct SmoothMove<'a> {
    pub recording: &'a Recording<'a>,
    pub span: &'a Span<'a>,
    pub states: &'a [ToolState],
    pub motion: &'a Move,
    /// Largest angle at a pass, rad.
    pub angular_tolerance: f64,
    /// Largest distance of the controlled point per radian or metre of each joint, m.
    pub levers: Vec<f64>,
}

/// How near the motion comes to a pose from one sample to the next.
#[derive(Clone, Copy, Debug)]
struct Approach {
    distance: f64,
    time: f64,
    /// Whether the pose may be passed here: position alone, and with its orientation.
    passes: [bool; 2],
    /// Least angle within the ball, rad.
    angle: f64,
}

/// The legs that the motion may be on, as far as samples show.
struct Way {
    /// Whether it may be on a leg: position alone, and with the orientation at every pass.
    on: Vec<[bool; 2]>,
    /// How near it came to each pose while on the leg to it.
    best: Vec<Option<Approach>>,
    /// Where it left the last possible corridor: time (s), distance (m), leg.
    lost: Option<(f64, f64, usize)>,
    /// The legs among which those are that it may be on.
    legs: Range<usize>,
}

impl SmoothMove<'_> {
    /// Checks it against its rules; returns how each intermediate pose was passed.
    pub(super) fn check(&self, report: &mut RuleReport) -> Vec<PassFound> {
        let legs = self.motion.poses.len();
        let mut way = Way {
            on: vec![[false; 2]; legs],
            best: vec![None; legs - 1],
            lost: None,
            legs: 0..1,
        };
        way.on[0] = [true; 2];
        for sample in 1..self.states.len() {
            self.pass(sample, &mut way);
            self.leave(sample, &mut way);
        }
        self.unseen(&mut way.on);
        self.report(&way, report);
        self.passes(&way.best)
    }

    /// From the sample before to this one, poses may be passed.
    fn pass(&self, sample: usize, way: &mut Way) {
        let row = self.span.shown().start + sample - 1;
        let mut leg = way.legs.start;
        while leg < way.legs.end && leg + 1 < way.on.len() {
            if way.on[leg][0] {
                let near = self.approach(row, leg);
                way.best[leg] = Some(nearer(way.best[leg], near));
                for rule in 0..2 {
                    way.on[leg + 1][rule] |= way.on[leg][rule] && near.passes[rule];
                }
                if way.on[leg + 1][0] {
                    way.legs.end = way.legs.end.max(leg + 2);
                }
            }
            leg += 1;
        }
    }

    /// Legs whose corridor the motion is out of at a sample are left.
    fn leave(&self, sample: usize, way: &mut Way) {
        let point = self.states[sample].point();
        let mut least: Option<(f64, usize)> = None;
        for leg in way.legs.clone() {
            if !way.on[leg][0] {
                continue;
            }
            let off = self.off_leg(leg, &point);
            if off > self.corridor() {
                way.on[leg] = [false; 2];
                if least.is_none_or(|(known, _)| off < known) {
                    least = Some((off, leg));
                }
            }
        }
        while way.legs.start < way.legs.end && !way.on[way.legs.start][0] {
            way.legs.start += 1;
        }
        if let (true, Some((off, leg)), None) = (way.legs.is_empty(), least, way.lost) {
            let time = self.recording.rows[self.span.shown().start + sample].t_s;
            way.lost = Some((time, off, leg));
        }
    }

    /// After its last row the move continues for less than the time to the next row, and comes to
    /// rest: poses within that distance of the last one may be passed.
    fn unseen(&self, on: &mut [[bool; 2]]) {
        let last = self.span.own.end - 1;
        let Some(goal) = self.motion.poses.last() else {
            return;
        };
        if self.recording.rows[last].rests() {
            return;
        }
        let arm = &self.recording.arm;
        let left = self.recording.time_after(last);
        let by = |joint| from_rest(arm.limits, joint, left)[0];
        let (reach, _) = arm.spread(&self.levers, by);
        for leg in 0..on.len() - 1 {
            let pose = &self.motion.poses[leg];
            let off = (pose.translation.vector - goal.translation.vector).norm();
            if off <= self.tolerance() + reach {
                let [point, both] = on[leg];
                on[leg + 1][0] |= point;
                on[leg + 1][1] |= both;
            }
        }
    }

    fn report(&self, way: &Way, report: &mut RuleReport) {
        let end = self.recording.rows[self.span.shown().end - 1].t_s;
        let [arrived, turned] = way.on.last().copied().unwrap_or([true; 2]);
        if let Some((time, off, leg)) = way.lost {
            let measure = Measure::at_most(off, self.corridor(), "m");
            report.hold(Rule::Corridor, Subject::Pose(leg), time, measure);
        }
        if !arrived {
            let missed = |near: &Option<Approach>| near.is_none_or(|near| !near.passes[0]);
            // The first pose that is missed; later ones were not searched for.
            match way.best.iter().position(missed) {
                Some(index) => {
                    let near = way.best[index];
                    let off = near.map_or(f64::INFINITY, |near| near.distance);
                    let time = near.map_or(end, |near| near.time);
                    let measure = Measure::at_most(off, self.tolerance(), "m");
                    report.hold(Rule::Pass, Subject::Pose(index), time, measure);
                }
                None if way.lost.is_none() => {
                    let subject = Subject::The("poses passed in order");
                    let measure = Measure::at_least(0.0, way.best.len() as f64, "");
                    report.hold(Rule::Pass, subject, end, measure);
                }
                None => {}
            }
        } else if !turned {
            let turns = |near: &&Approach| near.passes == [true, false];
            let near = way.best.iter().flatten().enumerate();
            for (index, near) in near.filter(|(_, near)| turns(near)) {
                let measure = Measure::at_most(near.angle, self.angular_tolerance, "rad");
                report.hold(
                    Rule::PassOrientation,
                    Subject::Pose(index),
                    near.time,
                    measure,
                );
            }
        }
    }

    /// The passes of the intermediate poses.
    fn passes(&self, best: &[Option<Approach>]) -> Vec<PassFound> {
        let mut found = Vec::with_capacity(best.len() + 1);
        for (index, near) in best.iter().enumerate() {
            found.push(PassFound {
                index: index + 1,
                deviation_m: near.map_or(f64::INFINITY, |near| near.distance),
                tolerance_m: self.tolerance(),
                time_s: near.map_or(f64::NAN, |near| near.time),
                within: near.is_some_and(|near| near.passes[0]),
            });
        }
        found
    }

    /// Radius of the balls, m.
    fn tolerance(&self) -> f64 {
        self.motion.tolerance.max(ARRIVED.0)
    }

    /// Half width of the corridor, m.
    fn corridor(&self) -> f64 {
        self.motion.tolerance + STRAIGHT
    }

    /// Distance of a point from a leg, m.
    fn off_leg(&self, leg: usize, point: &Vector3<f64>) -> f64 {
        let from = match leg.checked_sub(1) {
            Some(before) => self.motion.poses[before].translation.vector,
            None => self.span.start.translation.vector,
        };
        off_segment(point, &[from, self.motion.poses[leg].translation.vector])
    }

    /// How near the motion comes to the pose at the end of a leg between row `row` and the next; if
    /// it is clearly outside the ball, by the nearer row.
    fn approach(&self, row: usize, leg: usize) -> Approach {
        let rows = self.recording.rows;
        let (from, to) = (&rows[row], &rows[row + 1]);
        let h = to.t_s - from.t_s;
        let offset = row - self.span.shown().start;
        let pose = &self.motion.poses[leg];
        let (a, b) = (&self.states[offset], &self.states[offset + 1]);
        let off = |state: &ToolState| (state.point() - pose.translation.vector).norm();
        // Nothing is nearer than what the faster end leads to in half the time, twice over.
        let way = h * (a.velocity.norm() + b.velocity.norm())
            + h * h * (a.acceleration.norm() + b.acceleration.norm());
        let near = off(a).min(off(b));
        let slack = self.slack(h);
        if near > self.tolerance() + way + slack.0 {
            let time = if off(a) < off(b) { from.t_s } else { to.t_s };
            return Approach {
                distance: near,
                time,
                passes: [false; 2],
                angle: f64::INFINITY,
            };
        }
        let between = Between::new(self, row);
        let (distance, angle) = (self.tolerance() + slack.0, self.angular_tolerance + slack.1);
        between.approach(pose, distance, angle)
    }

    /// How far the tool may be from the interpolation between two samples `h` (s) apart: m, rad.
    fn slack(&self, h: f64) -> (f64, f64) {
        let arm = &self.recording.arm;
        let (way, turn) = arm.spread(&self.levers, |joint| off_quintic(arm.limits, joint, h));
        (way + 1e-9, turn + 1e-9)
    }
}

/// The motion from one row to the next.
struct Between<'a> {
    smooth: &'a SmoothMove<'a>,
    joints: Vec<Quintic>,
    start: f64,
    time: f64,
}

impl<'a> Between<'a> {
    fn new(smooth: &'a SmoothMove<'a>, row: usize) -> Self {
        let rows = smooth.recording.rows;
        let (from, to) = (&rows[row], &rows[row + 1]);
        let time = to.t_s - from.t_s;
        let state = |row: &super::RecordedSample, joint: usize| {
            [
                row.joints[joint],
                row.rates[joint],
                row.accelerations[joint],
            ]
        };
        let joints = (0..smooth.recording.arm.dof())
            .map(|joint| Quintic::new(state(from, joint), state(to, joint), time))
            .collect();
        Self {
            smooth,
            joints,
            start: from.t_s,
            time,
        }
    }

    fn pose(&self, share: f64) -> Isometry3<f64> {
        let joints: Vec<f64> = self.joints.iter().map(|joint| joint.at(share)).collect();
        self.smooth.recording.arm.flange(&joints) * self.smooth.span.tools[1]
    }

    /// How near the motion comes to a pose: it passes within `distance` (m), with its orientation
    /// within `angle` (rad).
    fn approach(&self, goal: &Isometry3<f64>, distance: f64, angle: f64) -> Approach {
        let rotation = &goal.rotation;
        let off =
            |pose: &Isometry3<f64>| (pose.translation.vector - goal.translation.vector).norm();
        let places: Vec<_> = (0..=PARTS)
            .map(|part| part as f64 / PARTS as f64)
            .map(|share| (share, self.pose(share)))
            .collect();
        let at = (0..=PARTS)
            .min_by(|a, b| off(&places[*a].1).total_cmp(&off(&places[*b].1)))
            .unwrap_or(0);
        let window = places[at.saturating_sub(1)].0..places[(at + 1).min(PARTS)].0;
        let share = least(window, |share| off(&self.pose(share)));
        let closest = self.pose(share);
        let inside = off(&closest) <= distance;
        // Orientation: at the closest approach, or anywhere else in the ball.
        let mut least_angle = angle_between(&closest.rotation, rotation);
        for pair in places.windows(2) {
            let [(_, a), (_, b)] = pair else { continue };
            let turn = angle_between(&a.rotation, &b.rotation);
            for pose in [a, b] {
                if off(pose) <= distance {
                    // Between two places it may be nearer by half of the rotation between them.
                    let near = angle_between(&pose.rotation, rotation) - turn / 2.0;
                    least_angle = least_angle.min(near.max(0.0));
                }
            }
        }
        Approach {
            distance: off(&closest),
            time: self.start + share * self.time,
            passes: [inside, inside && least_angle <= angle],
            angle: if inside { least_angle } else { f64::INFINITY },
        }
    }
}

/// The better of two approaches: one that passes, then the nearer.
fn nearer(known: Option<Approach>, other: Approach) -> Approach {
    let Some(known) = known else { return other };
    let rank = |approach: &Approach| {
        let [point, both] = approach.passes;
        (!both, !point)
    };
    match rank(&known).cmp(&rank(&other)) {
        std::cmp::Ordering::Less => known,
        std::cmp::Ordering::Greater => other,
        std::cmp::Ordering::Equal => {
            let turns_less = known.passes == [true, false] && other.angle < known.angle;
            let closer = known.passes != [true, false] && other.distance < known.distance;
            if turns_less || closer { other } else { known }
        }
    }
}

/// The minimum of a unimodal function, by golden section.
fn least(within: Range<f64>, value: impl Fn(f64) -> f64) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let (mut low, mut high) = (within.start, within.end);
    let mut left = high - GOLDEN * (high - low);
    let mut right = low + GOLDEN * (high - low);
    let (mut at_left, mut at_right) = (value(left), value(right));
    for _ in 0..40 {
        if at_left <= at_right {
            (high, right, at_right) = (right, left, at_left);
            left = high - GOLDEN * (high - low);
            at_left = value(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = low + GOLDEN * (high - low);
            at_right = value(right);
        }
    }
    if at_left <= at_right { left } else { right }
}
