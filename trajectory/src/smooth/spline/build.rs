//! From poses to the spline problem and back to spans.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::basis::{self, START};
use super::problem::{Group, Point, Problem};
use super::solve::{Effort, solve};
use super::start;
use crate::line::body_turn;
use crate::smooth::options::SmoothOptions;
use crate::smooth::span::{Span, Turn};
use crate::ToolPoint;

/// The inner tolerance: sampling at rounding must not read it as exceeded.
const INSIDE: f64 = 0.9999;

/// Share of the corridor that the samples use, since the curve between two
/// samples may lie a little outside of them.
const CORRIDOR: f64 = 0.99;

/// Share of the angular caps; the rest is for turns about changing axes.
const ANGULAR: f64 = 0.985;

/// A start in motion: state and knot spacing of the motion it continues.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moving {
    pub(crate) state: ToolPoint,
    pub(crate) spacing: f64,
}

/// Time-optimal spline from the first pose to the last through balls around
/// those between; with `moving` from that state, the first pose then being the
/// one passed last. `slow` (at most 1) lowers the junction speeds of the first
/// iterate. `None` when no feasible spline was found.
pub(crate) fn plan(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    moving: Option<&Moving>,
    effort: Effort,
    slow: f64,
) -> Option<Vec<Span>> {
    let vectors = unroll(poses);
    let goal = poses.last()?;
    let begin = moving.map_or(poses[0], |m| m.state.pose);
    let far = |pose: &Isometry3<f64>| (pose.translation.vector - begin.translation.vector).norm() > 1e-12;
    let moves = poses.iter().any(far) || moving.is_some_and(|m| m.state.linear[0].norm() > 1e-9);
    let turns = vectors.iter().any(|v| v.norm() > 1e-12)
        || body_turn(&begin.rotation, &goal.rotation).norm() > 1e-12;
    let task = Task { poses, vectors, options, moving, effort, slow };
    match (moves, turns) {
        (true, false) => task.run::<3, 15>([true, false]),
        (false, true) => task.run::<3, 15>([false, true]),
        (true, true) => task.run::<6, 30>([true, true]),
        (false, false) => None,
    }
}

/// Rotation vectors of the poses, unrolled: each leg's turn is the difference
/// of its ends.
fn unroll(poses: &[Isometry3<f64>]) -> Vec<Vector3<f64>> {
    let mut vector = Vector3::zeros();
    let mut result = vec![vector];
    for pair in poses.windows(2) {
        vector += body_turn(&pair[0].rotation, &pair[1].rotation);
        result.push(vector);
    }
    result
}

struct Task<'a> {
    poses: &'a [Isometry3<f64>],
    vectors: Vec<Vector3<f64>>,
    options: &'a SmoothOptions,
    moving: Option<&'a Moving>,
    effort: Effort,
    slow: f64,
}

impl Task<'_> {
    /// Coordinates of a position and a rotation vector: those in use.
    fn pack<const D: usize>(&self, used: [bool; 2], p: &Vector3<f64>, r: &Vector3<f64>) -> [f64; D] {
        let mut result = [0.0; D];
        let parts = [(used[0], p), (used[1], r)];
        for (slot, (_, part)) in parts.iter().filter(|(used, _)| *used).enumerate() {
            for d in 0..3 {
                result[3 * slot + d] = part[d];
            }
        }
        result
    }

    fn groups(&self, used: [bool; 2]) -> [Group; 2] {
        let limits = &self.options.limits;
        let turn = self.options.angular_tolerance();
        let place = Group {
            caps: [limits.speed, limits.acceleration, limits.jerk],
            radius: INSIDE * self.options.tolerance.min(self.options.corridor()),
            width: CORRIDOR * self.options.corridor(),
        };
        let caps = [limits.angular_speed, limits.angular_acceleration, limits.angular_jerk];
        let turn = Group { caps: caps.map(|c| c * ANGULAR), radius: INSIDE * turn, width: turn };
        if used[0] { [place, turn] } else { [turn, place] }
    }

    fn run<const D: usize, const B: usize>(&self, used: [bool; 2]) -> Option<Vec<Span>> {
        let vertices = self.poses.iter().zip(&self.vectors);
        let vertices: Vec<[f64; D]> =
            vertices.map(|(pose, turn)| self.pack(used, &pose.translation.vector, turn)).collect();
        let mut begin = [vertices[0], [0.0; D], [0.0; D], [0.0; D]];
        if let Some(moving) = self.moving {
            let virtual_turn = virtual_start(moving, moving.spacing);
            let offset = body_turn(&self.poses[0].rotation, &moving.state.pose.rotation);
            let state = &moving.state;
            begin[0] = self.pack(used, &state.pose.translation.vector, &(offset + virtual_turn[0]));
            for k in 0..3 {
                begin[k + 1] = self.pack(used, &state.linear[k], &virtual_turn[k + 1]);
            }
        }
        let mut problem = Problem { groups: self.groups(used), vertices, start: begin, scale: 1.0 };
        let spacing = self.moving.map(|m| m.spacing);
        let mut point = start::first(&mut problem, self.moving.is_some(), spacing, self.slow);
        solve::<D, B>(&problem, &mut point, self.effort)?;
        Some(self.spans(&problem, &point, used))
    }

    /// Spans of a solution.
    fn spans<const D: usize>(&self, problem: &Problem<D>, point: &Point<D>, used: [bool; 2]) -> Vec<Span> {
        let h = problem.spacing(point.z);
        let rotations = if used[1] { self.rotations(problem, point, D - 3, h) } else { Vec::new() };
        let fixed = self.poses[0];
        (0..point.spans())
            .map(|k| {
                let mut place = [fixed.translation.vector, Vector3::zeros(), Vector3::zeros(), Vector3::zeros(), Vector3::zeros()];
                if used[0] {
                    for d in 0..3 {
                        let control = [0, 1, 2, 3, 4].map(|i| point.control[k + i][d]);
                        for (c, value) in place.iter_mut().zip(basis::power(&control, h)) {
                            c[d] = value;
                        }
                    }
                }
                let (base, turns) = match rotations.get(k..k + 5) {
                    Some(control) => (control[0], turns(control, h)),
                    None => (fixed.rotation, Vec::new()),
                };
                Span { start: h * k as f64, duration: h, point: place, base, turns }
            })
            .collect()
    }

    /// Control orientations: the control points rolled out from the start, with
    /// the small drift against the poses spread over the way.
    ///
    /// Rolling a polygon of rotation vectors keeps every angular rate; cutting
    /// corners of it changes where it leads, by the square of the tolerance.
    fn rotations<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
        first: usize,
        h: f64,
    ) -> Vec<UnitQuaternion<f64>> {
        let knots = point.control.len();
        let vector = |k: usize| {
            let c = &point.control[k];
            Vector3::new(c[first], c[first + 1], c[first + 2])
        };
        let mut result = match self.moving {
            Some(moving) => start_rotations(moving, h),
            None => [self.poses[0].rotation; 4],
        }
        .to_vec();
        for k in 4..knots {
            let step = UnitQuaternion::from_scaled_axis(vector(k) - vector(k - 1));
            result.push(result[k - 1] * step);
        }
        let mut from = 3;
        let mut anchors = anchors(problem, point);
        anchors.push((knots - 4, self.poses.len() - 1));
        for (to, leg) in anchors {
            let target = if to == knots - 4 {
                self.poses[self.poses.len() - 1].rotation
            } else {
                self.on_leg(&vector(to), leg)
            };
            correct(&mut result, from, to, &target);
            from = to;
        }
        for rotation in result.iter_mut().skip(knots - 4) {
            *rotation = self.poses[self.poses.len() - 1].rotation;
        }
        result
    }

    /// Orientation of a rotation vector near a leg.
    fn on_leg(&self, vector: &Vector3<f64>, leg: usize) -> UnitQuaternion<f64> {
        let way = self.vectors[leg] - self.vectors[leg - 1];
        let off = vector - self.vectors[leg - 1];
        let square = way.norm_squared();
        let share = if square > 0.0 { (off.dot(&way) / square).clamp(0.0, 1.0) } else { 0.0 };
        self.poses[leg - 1].rotation
            * UnitQuaternion::from_scaled_axis(way * share)
            * UnitQuaternion::from_scaled_axis(off - way * share)
    }
}

/// Control points in the middle of a leg, with the leg, at least six apart.
fn anchors<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> Vec<(usize, usize)> {
    let knots = point.control.len();
    let mut result = Vec::new();
    let mut last = 3;
    for leg in 1..problem.vertices.len() {
        let since = if leg == 1 { 0.0 } else { point.passes[leg - 2] };
        let until = point.passes.get(leg - 1).copied().unwrap_or(point.spans() as f64);
        let middle = (0.5 * (since + until) + 1.5).round().max(0.0) as usize;
        if middle >= last + 6 && middle + 10 <= knots {
            result.push((middle, leg));
            last = middle;
        }
    }
    result
}

/// Turns the control orientations after `from` so that the one at `to` becomes
/// `target`, smoothly; those after `to` follow.
fn correct(rotations: &mut [UnitQuaternion<f64>], from: usize, to: usize, target: &UnitQuaternion<f64>) {
    let drift = body_turn(&rotations[to], target);
    let was = rotations[to];
    for k in from + 1..=to {
        let x = (k - from) as f64 / (to - from) as f64;
        let share = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
        rotations[k] *= UnitQuaternion::from_scaled_axis(drift * share);
    }
    let follow = rotations[to] * was.inverse();
    for rotation in rotations.iter_mut().skip(to + 1) {
        *rotation = follow * *rotation;
    }
}

/// The four factors of a span ruled by five control orientations: the
/// cumulative form of the basis.
///
/// # Source
/// M.-J. Kim, M.-S. Kim, S. Y. Shin, "A general construction scheme for unit
/// quaternion curves with simple high order derivatives", SIGGRAPH 1995.
fn turns(control: &[UnitQuaternion<f64>], h: f64) -> Vec<Turn> {
    let mut result = Vec::with_capacity(4);
    for j in 1..5 {
        let axis = body_turn(&control[j - 1], &control[j]);
        let mut sums = [0.0; 5];
        sums[j..].fill(1.0);
        result.push(Turn { axis, angle: basis::power(&sums, h) });
    }
    result
}

/// Position, velocity, acceleration and jerk of the rolled-out rotation vector
/// (axes of the tool) whose spline starts with exactly the given motion.
///
/// Products of turns are not sums of vectors; the difference is of second
/// order in the turn over one knot, so correcting it repeatedly converges.
fn virtual_start(moving: &Moving, h: f64) -> [Vector3<f64>; 4] {
    let state = &moving.state;
    let back = state.pose.rotation.inverse();
    let [w, a, j] = state.angular.map(|x| back * x);
    let mut result = [Vector3::zeros(), w, a, j - w.cross(&a)];
    if w.norm() + a.norm() + j.norm() < 1e-15 {
        return result;
    }
    for _ in 0..40 {
        let control = roll(&state.pose.rotation, &result, h);
        let span = Span {
            start: 0.0,
            duration: h,
            point: [Vector3::zeros(); 5],
            base: control[0],
            turns: turns(&[control[0], control[1], control[2], control[3], control[3]], h),
        };
        let got = span.at(0.0);
        result[0] += body_turn(&got.pose.rotation, &state.pose.rotation);
        for k in 0..3 {
            result[k + 1] += back * (state.angular[k] - got.angular[k]);
        }
    }
    result
}

/// The four control orientations of a start in motion at knot spacing `h`.
fn start_rotations(moving: &Moving, h: f64) -> [UnitQuaternion<f64>; 4] {
    roll(&moving.state.pose.rotation, &virtual_start(moving, h), h)
}

/// Control orientations of a rolled-out motion.
fn roll(base: &UnitQuaternion<f64>, motion: &[Vector3<f64>; 4], h: f64) -> [UnitQuaternion<f64>; 4] {
    let vector = START.map(|w| {
        motion[0] + (motion[1] * w[0] + (motion[2] * w[1] + motion[3] * (w[2] * h)) * h) * h
    });
    let mut result = [*base * UnitQuaternion::from_scaled_axis(vector[0]); 4];
    for k in 1..4 {
        result[k] = result[k - 1] * UnitQuaternion::from_scaled_axis(vector[k] - vector[k - 1]);
    }
    result
}
