//! Rules for straight moves: on the line, never back, rotation in proportion to the distance.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::arm::ToolState;
use super::finding::{Measure, RuleReport, Subject};
use super::rule::Rule;
use super::span::{Recording, Span};

/// Largest distance from the line, m.
pub(super) const STRAIGHT: f64 = 1e-5;
/// Largest distance by which the controlled point may go back along the line (m), and angle by
/// which the tool may turn back or out of proportion (rad): effects of the joints' fit to the line.
const BACK: (f64, f64) = (2e-6, 1e-5);
/// Rotations nearer to half a turn than this may go in either direction, rad.
const HALF_TURN: f64 = 1e-6;

/// Checks the states of a straight move from `span.start` to `goal` against its rules; returns the
/// largest distance from the line, m.
pub(super) fn straight(
    recording: &Recording<'_>,
    span: &Span<'_>,
    states: &[ToolState],
    goal: &Isometry3<f64>,
    report: &mut RuleReport,
) -> f64 {
    // The row before its own is up to a period before the start.
    let own = &states[states.len() - span.own.len()..];
    let turn = span.start.rotation.inverse() * goal.rotation;
    let line = Line::new(&span.start, goal, turn_of(&turn));
    let other = Line {
        turn: line.turn * -(std::f64::consts::TAU - line.turn.norm()) / line.turn.norm(),
        ..line
    };
    let half = (line.turn.norm() - std::f64::consts::PI).abs() < HALF_TURN;
    let line = if half && other.off_axis(own) < line.off_axis(own) {
        other
    } else {
        line
    };
    let times = recording.rows[span.own.clone()].iter().map(|row| row.t_s);
    let (mut reached, mut worst) = (Progress::default(), 0.0_f64);
    for (state, time) in own.iter().zip(times) {
        worst = worst.max(line.along(&state.point()).1);
        for (rule, what, measure) in line.measures(state, &mut reached) {
            report.hold(rule, Subject::The(what), time, measure);
        }
    }
    worst
}

/// The greatest distance along the line (m) and angle about the axis (rad) so far.
#[derive(Clone, Copy, Default)]
struct Progress {
    along: f64,
    angle: f64,
}

/// A line of the controlled point with the rotation about one axis of the tool.
#[derive(Clone, Copy)]
struct Line {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
    length: f64,
    start: UnitQuaternion<f64>,
    /// Rotation vector in the axes of the tool at the start, rad.
    turn: Vector3<f64>,
}

impl Line {
    fn new(start: &Isometry3<f64>, goal: &Isometry3<f64>, turn: Vector3<f64>) -> Self {
        let way = goal.translation.vector - start.translation.vector;
        let length = way.norm();
        let direction = if length > 0.0 { way / length } else { way };
        Self {
            origin: start.translation.vector,
            direction,
            length,
            start: start.rotation,
            turn,
        }
    }

    /// The values to check at one state; `reached` is the progress so far.
    fn measures(
        &self,
        state: &ToolState,
        reached: &mut Progress,
    ) -> [(Rule, &'static str, Measure); 5] {
        let (along, off) = self.along(&state.point());
        let (angle, tilt) = self.turned(&state.pose.rotation);
        let (way_back, turn_back) = (reached.along - along, reached.angle - angle);
        reached.along = reached.along.max(along);
        reached.angle = reached.angle.max(angle);
        // On a line of no length the tool turns on the spot, so there is no proportion to check.
        let rate = if self.length > 0.0 {
            self.turn.norm() / self.length
        } else {
            0.0
        };
        let step = if rate > 0.0 {
            (angle - rate * along).abs()
        } else {
            0.0
        };
        let (most, turn) = (BACK.1 + rate * BACK.0, Rule::OrientationInStep);
        let at_most = Measure::at_most;
        [
            (
                Rule::StraightLine,
                "the distance from the line",
                at_most(off, STRAIGHT, "m"),
            ),
            (
                Rule::NoReturn,
                "the way back",
                at_most(way_back, BACK.0, "m"),
            ),
            (
                Rule::NoReturn,
                "the turn back",
                at_most(turn_back, BACK.1, "rad"),
            ),
            (
                turn,
                "the turn about another axis",
                at_most(tilt, BACK.1, "rad"),
            ),
            (turn, "the angle out of step", at_most(step, most, "rad")),
        ]
    }

    /// Way along the line, and distance from it (and from its ends), m.
    fn along(&self, point: &Vector3<f64>) -> (f64, f64) {
        let way = point - self.origin;
        let along = way.dot(&self.direction);
        let nearest = self.direction * along.clamp(0.0, self.length);
        (along, (way - nearest).norm())
    }

    /// Angle turned about the axis, and about others, rad.
    fn turned(&self, rotation: &UnitQuaternion<f64>) -> (f64, f64) {
        let turn = self.start.inverse() * rotation;
        let (real, vector) = (turn.w, turn.imag());
        let Some(axis) = self.turn.try_normalize(0.0) else {
            return (0.0, 2.0 * vector.norm().atan2(real.abs()));
        };
        let along = vector.dot(&axis);
        let tilt = 2.0 * (vector - axis * along).norm().min(1.0).asin();
        // Half angles are in the first quadrant, except for rounding.
        let sign = if real + along < 0.0 { -1.0 } else { 1.0 };
        (2.0 * (sign * along).atan2(sign * real), tilt)
    }

    /// Largest turn about another axis or back.
    fn off_axis(&self, states: &[ToolState]) -> f64 {
        let worst = |state: &ToolState| {
            let (angle, tilt) = self.turned(&state.pose.rotation);
            tilt.max(-angle)
        };
        states.iter().map(worst).fold(0.0, f64::max)
    }
}

/// Rotation vector of a rotation, the shorter way, rad.
fn turn_of(turn: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if turn.w < 0.0 { -1.0 } else { 1.0 };
    let vector = turn.imag() * sign;
    let sine = vector.norm();
    if sine == 0.0 {
        return vector;
    }
    vector * (2.0 * sine.atan2(turn.w * sign) / sine)
}
