//! The rules that a planned program is checked against, from its samples alone.

use k::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use planner::dry_run::{Plan, PlanSample, PlannedCommand};
use system_tests::arm::Arm;

use crate::kinematics::{State, state};
use crate::programs::{Meaning, Move, Shape};
use crate::tally::Tally;

/// Servo rate of the plans, Hz, and time between samples, s.
pub(crate) const RATE: f64 = 1000.0;
const PERIOD: f64 = 1e-3;

/// Finite arithmetic on both sides of a limit.
const ALLOWED: f64 = 1.0 + 1e-6;
/// Rounding of accelerations; over a period it makes a jerk.
const NOISE: f64 = 1e-7;
/// Largest distance (m) and angle (rad) from the last pose.
const ARRIVED: f64 = 2e-6;
/// Largest distance from a straight line, m.
const STRAIGHT: f64 = 1e-5;
/// The orientation rule of the language: inside a ball the tool may be turned away from the pose by
/// the radius over this length (m), and at most by this angle (rad).
const BALL_LEVER: f64 = 0.05;
const BALL_ANGLE: f64 = 0.2;
/// Angles (rad) that count as zero.
const EXACT_ANGLE: f64 = 1e-6;

/// Checks a plan; `meanings` has one entry per command of the program.
pub(crate) fn judge(arm: &Arm, meanings: &[Meaning], plan: &Plan, tally: &mut Tally) {
    let samples: Vec<PlanSample> = plan.samples(PERIOD).collect();
    joints(arm, &samples, tally);
    ticks(plan, &samples, tally);
    let tool = arm.flange_from_tool(arm.mounted);
    let mut stands = arm.flange(&arm.home) * tool;
    for command in &plan.commands {
        let from = row_at(command.start_s);
        let to = row_at(command.start_s + command.duration_s).min(samples.len() - 1);
        let part = &samples[from..=to];
        match &meanings[command.index] {
            Meaning::Still(seconds) => {
                let still =
                    |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
                let zero = vec![0.0; part[0].q.len()];
                let rests =
                    |sample: &PlanSample| still(&sample.q, &part[0].q) && still(&sample.dq, &zero);
                tally.must("standstill", part.iter().all(rests));
                tally.at_most("a wait is not short", seconds - command.duration_s, 1e-9);
            }
            Meaning::Move(motion) => {
                let states: Vec<State> =
                    part.iter().map(|row| tool_state(arm, row, &tool)).collect();
                let seen = Seen {
                    arm,
                    motion,
                    command,
                    samples: part,
                    states: &states,
                    start: stands,
                };
                seen.judge(tally);
                stands = seen.states[seen.states.len() - 1].pose;
            }
        }
    }
}

fn row_at(time: f64) -> usize {
    (time / PERIOD).round() as usize
}

fn tool_state(arm: &Arm, row: &PlanSample, tool: &Isometry3<f64>) -> State {
    let pose = arm.flange(&row.q) * tool;
    state(&arm.axes(), [&row.dq[..], &row.ddq[..]], pose)
}

/// The recorded pose as `k` has poses.
fn recorded(row: &PlanSample) -> Isometry3<f64> {
    let (point, turn) = (
        row.workstation_from_tool.translation,
        row.workstation_from_tool.rotation,
    );
    Isometry3::from_parts(
        Translation3::new(point.x, point.y, point.z),
        UnitQuaternion::from_quaternion(Quaternion::new(turn.w, turn.i, turn.j, turn.k)),
    )
}

/// Limits of the joints, and each column as the derivative of the one before.
fn joints(arm: &Arm, samples: &[PlanSample], tally: &mut Tally) {
    for (index, row) in samples.iter().enumerate() {
        for (joint, &[lower, upper, velocity]) in arm.joints.iter().enumerate() {
            let q = row.q[joint];
            tally.at_most("joint position", (lower - q).max(q - upper), 1e-9);
            tally.at_most("joint velocity", row.dq[joint].abs(), velocity * ALLOWED);
            let most = arm.acceleration[joint] * ALLOWED;
            tally.at_most("joint acceleration", row.ddq[joint].abs(), most);
            let jerk = arm.jerk[joint] * ALLOWED;
            tally.at_most("joint jerk", row.dddq[joint].abs(), jerk);
            let Some(before) = index.checked_sub(1).map(|index| &samples[index]) else {
                continue;
            };
            let h = row.t_s - before.t_s;
            let change = row.ddq[joint] - before.ddq[joint];
            tally.at_most("joint jerk by differences", change.abs(), jerk * h + NOISE);
            let mean = 0.5 * (row.ddq[joint] + before.ddq[joint]);
            let off = (row.dq[joint] - before.dq[joint] - h * mean).abs();
            tally.at_most(
                "acceleration integrates to velocity",
                off,
                jerk * h * h / 4.0 + 1e-9,
            );
            let mean = 0.5 * (row.dq[joint] + before.dq[joint]) - h * change / 12.0;
            let off = (row.q[joint] - before.q[joint] - h * mean).abs();
            let most = 3f64.sqrt() / 54.0 * jerk * h.powi(3) + 1e-11;
            tally.at_most("velocity integrates to position", off, most);
        }
    }
}

/// Commands begin and end at rest on ticks, one after the other.
fn ticks(plan: &Plan, samples: &[PlanSample], tally: &mut Tally) {
    let mut end = 0.0;
    for command in &plan.commands {
        let ticks = command.start_s * RATE;
        tally.at_most("start on a tick", (ticks - ticks.round()).abs(), 1e-6);
        let ticks = command.duration_s * RATE;
        tally.at_most("whole ticks", (ticks - ticks.round()).abs(), 1e-6);
        tally.at_most("one after the other", (command.start_s - end).abs(), 1e-9);
        end = command.start_s + command.duration_s;
        if let Some(row) = samples.get(row_at(end)) {
            let most = |list: &[f64]| list.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            tally.at_most("rest at the end: velocity", most(&row.dq), 1e-9);
            tally.at_most("rest at the end: acceleration", most(&row.ddq), 1e-6);
        }
    }
    tally.at_most("length of the plan", (plan.duration_s - end).abs(), 1e-9);
}

/// A move as its samples show it.
struct Seen<'a> {
    arm: &'a Arm,
    motion: &'a Move,
    command: &'a PlannedCommand,
    samples: &'a [PlanSample],
    states: &'a [State],
    start: Isometry3<f64>,
}

impl Seen<'_> {
    fn judge(&self, tally: &mut Tally) {
        for (row, state) in self.samples.iter().zip(self.states) {
            let gap = apart(&recorded(row), &state.pose);
            tally.at_most("recorded point is that of the joints", gap.0, 1e-9);
            tally.at_most("recorded orientation is that of the joints", gap.1, 1e-7);
        }
        self.caps(tally);
        self.ends(tally);
        match self.motion.shape {
            Shape::Joint => {}
            Shape::Straight => self.straight(tally),
            Shape::Smooth => self.smooth(tally),
        }
        self.certificate(tally);
    }

    fn caps(&self, tally: &mut Tally) {
        let (arm, motion) = (self.arm, self.motion);
        let speed = motion.speed * arm.tool_speed;
        let acceleration = motion.acceleration * arm.tool_acceleration;
        let spin = motion.speed * arm.angular[0];
        let spin_rate = motion.acceleration * arm.angular[1];
        for (index, state) in self.states.iter().enumerate() {
            tally.at_most("tool speed", state.velocity.norm(), speed * ALLOWED + 1e-9);
            let most = acceleration * ALLOWED + NOISE;
            tally.at_most("tool acceleration", state.acceleration.norm(), most);
            tally.at_most("angular speed", state.spin.norm(), spin * ALLOWED + 1e-9);
            let most = spin_rate * ALLOWED + NOISE;
            tally.at_most("angular acceleration", state.spin_rate.norm(), most);
            let Some(before) = index.checked_sub(1).map(|index| &self.states[index]) else {
                continue;
            };
            let change = (state.acceleration - before.acceleration).norm();
            let most = arm.tool_jerk * ALLOWED * PERIOD + NOISE;
            tally.at_most(
                self.named([
                    "tool jerk, joint",
                    "tool jerk, straight",
                    "tool jerk, smooth",
                ]),
                change,
                most,
            );
            let change = (state.spin_rate - before.spin_rate).norm();
            let most = arm.angular[2] * ALLOWED * PERIOD + NOISE;
            tally.at_most(
                self.named([
                    "angular jerk, joint",
                    "angular jerk, straight",
                    "angular jerk, smooth",
                ]),
                change,
                most,
            );
        }
    }

    fn named(&self, names: [&'static str; 3]) -> &'static str {
        match self.motion.shape {
            Shape::Joint => names[0],
            Shape::Straight => names[1],
            Shape::Smooth => names[2],
        }
    }

    fn ends(&self, tally: &mut Tally) {
        let gap = apart(&self.start, &self.states[0].pose);
        tally.at_most("begins where the arm stands", gap.0.max(gap.1), 1e-9);
        let goal = &self.motion.poses[self.motion.poses.len() - 1];
        let gap = apart(goal, &self.states[self.states.len() - 1].pose);
        tally.at_most("ends in its last point", gap.0, ARRIVED);
        tally.at_most("ends in its last orientation", gap.1, ARRIVED);
    }

    fn straight(&self, tally: &mut Tally) {
        let goal = &self.motion.poses[0];
        let origin = self.start.translation.vector;
        let way = goal.translation.vector - origin;
        let length = way.norm();
        let direction = if length > 0.0 { way / length } else { way };
        let turn = self.start.rotation.rotation_to(&goal.rotation);
        let (axis, angle) = turn.axis_angle().unwrap_or((Vector3::x_axis(), 0.0));
        let mut reached = 0.0;
        for state in self.states {
            let here = state.pose.translation.vector - origin;
            let along = here.dot(&direction);
            tally.at_most("straightness", (here - direction * along).norm(), STRAIGHT);
            tally.at_most("never back on a straight line", reached - along, 2e-6);
            reached = f64::max(reached, along);
            if length > 1e-6 && angle < 3.1 {
                let share = (along / length).clamp(0.0, 1.0);
                let expected =
                    UnitQuaternion::from_axis_angle(&axis, angle * share) * self.start.rotation;
                let off = apart_angle(&expected, &state.pose.rotation);
                let most = 1e-5 + 2e-6 * angle / length;
                tally.at_most("orientation in step on a straight line", off, most);
            }
        }
    }

    /// Largest angle (rad) between the tool and an intermediate pose where it is passed.
    fn angular_tolerance(&self) -> f64 {
        let of_ball = (self.motion.tolerance / BALL_LEVER).min(BALL_ANGLE);
        of_ball.min(self.motion.angular_tolerance)
    }

    /// Whether a pose may be passed between two samples: within its ball, with its orientation. No
    /// time between them is farther from a sample than half of the rotation between them.
    fn passes(&self, pair: &[State], pose: &Isometry3<f64>) -> [bool; 2] {
        let tolerance = self.motion.tolerance.max(1e-6) + 1e-9;
        let inside = nearest(pair, &pose.translation.vector) <= tolerance;
        let [a, b] = [&pair[0].pose.rotation, &pair[1].pose.rotation];
        let angle = apart_angle(a, &pose.rotation).min(apart_angle(b, &pose.rotation));
        let most = self.angular_tolerance() + 0.5 * apart_angle(a, b) + EXACT_ANGLE;
        [inside, inside && angle <= most]
    }

    /// There are passing times in order, with the balls at them and the corridor between them: the
    /// earliest and the latest samples by which each leg may be reached. There also are such times
    /// with the orientation of each pose.
    fn smooth(&self, tally: &mut Tally) {
        let poses = &self.motion.poses;
        let legs = poses.len();
        if self.states.len() < 2 {
            // No time passes: everything is at the position of the arm.
            let here = self.states[0].pose.translation.vector;
            let off = poses
                .iter()
                .map(|pose| (pose.translation.vector - here).norm());
            tally.at_most(
                "a move of no time goes nowhere",
                off.fold(0.0, f64::max),
                ARRIVED,
            );
            return;
        }
        // The legs that the motion may be on: by the places alone, and with the orientations.
        let mut on = vec![[false; 2]; legs];
        on[0] = [true; 2];
        for pair in self.states.windows(2) {
            for leg in 0..legs - 1 {
                if !on[leg][0] {
                    continue;
                }
                let passes = self.passes(pair, &poses[leg]);
                for kind in 0..2 {
                    on[leg + 1][kind] |= on[leg][kind] && passes[kind];
                }
            }
            let point = pair[1].pose.translation.vector;
            for (leg, on) in on.iter_mut().enumerate() {
                let from = if leg == 0 { self.start } else { poses[leg - 1] };
                let ends = [from.translation.vector, poses[leg].translation.vector];
                let inside = to_segment(&point, &ends) <= self.motion.tolerance + STRAIGHT;
                *on = on.map(|on| on && inside);
            }
        }
        tally.must(
            "poses passed in order, within tolerance and corridor",
            on[legs - 1][0],
        );
        tally.must(
            "poses passed with their orientation",
            on[legs - 1][1] || !on[legs - 1][0],
        );
    }

    /// Checks that the passes in the certificate are those of the samples.
    fn certified_passes(&self, between: &[Isometry3<f64>], tally: &mut Tally) {
        let Some(said) = &self.command.certificate else {
            return;
        };
        let mut before = 0.0;
        for (pass, pose) in said.poses.iter().zip(between) {
            tally.at_most(
                "certificate: passing times never fall",
                before - pass.time_s,
                0.0,
            );
            before = pass.time_s;
            tally.at_most(
                "certificate: passes end with the move",
                before,
                said.duration_s + 1e-9,
            );
            let most = self.motion.tolerance.max(1e-6);
            tally.at_most("certificate: deviations", pass.deviation_m, most);
            let index =
                ((pass.time_s / PERIOD).floor() as usize).min(self.states.len().saturating_sub(2));
            let pair = &self.states[index..(index + 2).min(self.states.len())];
            let speed = pair
                .iter()
                .map(|state| state.velocity.norm())
                .fold(0.0, f64::max);
            let point = pose.translation.vector;
            let off = (pair[0].pose.translation.vector - point).norm();
            let most = self.angular_tolerance().max(EXACT_ANGLE) + 1e-9;
            tally.at_most("certificate: angles of passes", pass.angle_rad, most);
            let spin = pair
                .iter()
                .map(|state| state.spin.norm())
                .fold(0.0, f64::max);
            let angle = apart_angle(&pair[0].pose.rotation, &pose.rotation);
            let law = "certificate: the angle is that of its time";
            let most = 1.5 * spin * PERIOD + EXACT_ANGLE;
            tally.at_most(law, (angle - pass.angle_rad).abs(), most);
            // In a period the controlled point goes no farther than this.
            let most = 1.5 * speed * PERIOD + 1e-6;
            let law = "certificate: the deviation is that of its time";
            tally.at_most(law, (off - pass.deviation_m).abs(), most);
        }
    }

    /// Checks the claims of the certificate against the samples.
    fn certificate(&self, tally: &mut Tally) {
        let Some(said) = &self.command.certificate else {
            tally.must("a move has a certificate", false);
            return;
        };
        let off = self.command.duration_s - said.duration_s;
        tally.at_most("certificate: duration", off.abs(), 1.0 / RATE + 1e-9);
        tally.at_most(
            "certificate: lower bound",
            said.lower_bound_s,
            said.duration_s + 1e-9,
        );
        tally.at_most(
            "certificate: no limit beyond 1",
            said.peaks.largest(),
            1.0 + 1e-9,
        );
        let within = said.end_deviation_m.max(said.end_angle_rad);
        tally.at_most("certificate: end", within, 1e-6);
        if let Some(off) = said.straightness_m {
            tally.at_most("certificate: straightness", off, STRAIGHT);
        }
        let poses = &self.motion.poses;
        let between = match self.motion.shape {
            Shape::Smooth => &poses[..poses.len() - 1],
            _ => &poses[..0],
        };
        tally.must(
            "certificate: a pass for every pose",
            said.poses.len() == between.len(),
        );
        tally.must("certificate: in order", said.in_order);
        self.certified_passes(between, tally);
    }
}

/// Distance (m) and angle (rad) between two poses.
fn apart(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let way = (a.translation.vector - b.translation.vector).norm();
    (way, apart_angle(&a.rotation, &b.rotation))
}

fn apart_angle(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    let between = a.inverse() * b;
    2.0 * between.imag().norm().atan2(between.w.abs())
}

/// The nearest that the point comes to another one between two samples: a cubic through both, with
/// their velocities.
fn nearest(pair: &[State], target: &Vector3<f64>) -> f64 {
    let [a, b] = [&pair[0], &pair[1]];
    let [p, q] = [a, b].map(|state| state.pose.translation.vector);
    let [v, w] = [a, b].map(|state| state.velocity * PERIOD);
    let off = |x: f64| {
        let (x2, x3) = (x * x, x * x * x);
        let point = p * (2.0 * x3 - 3.0 * x2 + 1.0)
            + v * (x3 - 2.0 * x2 + x)
            + q * (3.0 * x2 - 2.0 * x3)
            + w * (x3 - x2);
        (point - target).norm()
    };
    if off(0.0) > 0.1 {
        return off(0.0);
    }
    let best = (0..=16)
        .map(|part| f64::from(part) / 16.0)
        .min_by(|a, b| off(*a).total_cmp(&off(*b)))
        .unwrap_or(0.0);
    let (mut low, mut high) = ((best - 0.0625).max(0.0), (best + 0.0625).min(1.0));
    for _ in 0..40 {
        let (left, right) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if off(left) < off(right) {
            high = right;
        } else {
            low = left;
        }
    }
    off(0.5 * (low + high))
}

fn to_segment(point: &Vector3<f64>, ends: &[Vector3<f64>; 2]) -> f64 {
    let way = ends[1] - ends[0];
    let square = way.norm_squared();
    let share = if square > 0.0 {
        ((point - ends[0]).dot(&way) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point - ends[0] - way * share).norm()
}
