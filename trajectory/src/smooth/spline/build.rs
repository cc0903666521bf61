//! From poses to the spline problem and back to spans.

use nalgebra::{Isometry3, Vector3};

use super::aimed::Aims;
use super::basis;
use super::effort::Effort;
use super::ends::rolled;
use super::known::Known;
use super::problem::{Group, Point, Problem};
use super::request::{Moving, Request};
use super::solve::solve;
use super::start::{self, KNOTS_PER_RAMP};
use super::turns::turns;
use crate::ToolPoint;
use crate::line::body_turn;
use crate::smooth::options::SmoothOptions;
use crate::smooth::seed::Seed;
use crate::smooth::span::Span;

/// The inner tolerance: a little smaller, so that rounding in sampling does not exceed it.
const INSIDE: f64 = 0.9999;

/// Fraction of the corridor that samples use; the curve between two may lie a little outside.
const CORRIDOR: f64 = 0.98;

/// Fraction of the angular limits that is used; the rest is for rotations about changing axes.
const ANGULAR: f64 = 0.985;

/// Bound of an angular rate at an end in motion over its value there.
const AT_END: f64 = 1.0 + 1e-5;

/// Most Newton steps of a search from rest to rest that starts from a motion, and those after which it is given up: where
/// the tolerance shows many corners 90 end far from the optimum. With orientations a step takes ten times as long.
const STEPS: usize = 300;
const SEARCH: usize = 200;

/// Knot intervals in one time `A / J` of a curve that stays far from its bounds.
const ROUGH_KNOTS: f64 = 2.0;

/// Time-optimal spline from the first pose to the last through balls around
/// those between. `None` when no feasible spline was found.
pub(crate) fn plan(request: &Request<'_>) -> Option<Found> {
    let task = Task::new(request);
    match request.moves() {
        [true, false] => task.run::<3, 20>([true, false]),
        [true, true] if !request.coupled => task.run::<3, 20>([true, false]),
        [false, true] => task.run::<3, 20>([false, true]),
        [true, true] if request.has_few_poses() => task.run::<6, 20>([true, true]),
        [true, true] => task.run::<6, 36>([true, true]),
        [false, false] => None,
    }
}

/// The same for an arm, between rests.
pub(crate) fn plan_for_arm(request: &Request<'_>) -> Option<Found> {
    let task = Task::new(request);
    match (request.moves(), request.arm?.has_spare) {
        ([true, false], false) => task.run::<3, 20>([true, false]),
        ([true, false], true) => task.run::<4, 24>([true, false]),
        ([false, true], false) => task.run::<3, 20>([false, true]),
        ([false, true], true) => task.run::<4, 24>([false, true]),
        ([true, true], false) => task.run::<6, 36>([true, true]),
        ([true, true], true) => task.run::<7, 40>([true, true]),
        ([false, false], _) => None,
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

/// What a search ends with.
pub(crate) struct Found {
    pub(crate) spans: Vec<Span>,
    pub(crate) seed: Seed,
}

pub(super) struct Task<'a> {
    pub(super) request: &'a Request<'a>,
    pub(super) poses: &'a [Isometry3<f64>],
    pub(super) vectors: Vec<Vector3<f64>>,
    pub(super) options: &'a SmoothOptions,
    pub(super) moving: Option<&'a Moving>,
}

impl<'a> Task<'a> {
    pub(super) fn new(request: &'a Request<'a>) -> Self {
        Self {
            request,
            poses: request.poses,
            vectors: unroll(request.poses),
            options: request.options,
            moving: request.moving,
        }
    }

    /// Coordinates of a position and a rotation vector: those in use.
    pub(super) fn pack<const D: usize>(
        &self,
        used: [bool; 2],
        p: &Vector3<f64>,
        r: &Vector3<f64>,
    ) -> [f64; D] {
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
        let bound = self.turn_bound();
        let caps = [
            limits.angular_speed.min(bound * limits.speed),
            limits.angular_acceleration.min(bound * limits.acceleration),
            limits.angular_jerk.min(bound * limits.jerk),
        ];
        let shares = self.angular_shares();
        let turn = Group {
            caps: [0, 1, 2].map(|k| caps[k] * shares[k]),
            radius: INSIDE * turn,
            width: turn,
        };
        if used[0] {
            [place, turn]
        } else {
            [turn, place]
        }
    }

    /// Knot intervals in one time `A / J`: fewer where the curve need not come near its bounds.
    fn knots_per_ramp(&self) -> f64 {
        if self.options.is_rough() {
            ROUGH_KNOTS
        } else {
            KNOTS_PER_RAMP
        }
    }

    /// Fractions of angular speed, acceleration and jerk in use: not less than both ends in motion have.
    fn angular_shares(&self) -> [f64; 3] {
        let (limits, mut shares) = (&self.options.limits, [ANGULAR; 3]);
        let caps = [
            limits.angular_speed,
            limits.angular_acceleration,
            limits.angular_jerk,
        ];
        let Some((moving, finish)) = self.moving.zip(self.request.finish) else {
            return shares;
        };
        for state in [&moving.state, finish] {
            for (share, (rate, cap)) in shares.iter_mut().zip(state.angular.iter().zip(caps)) {
                *share = share.max(AT_END * rate.norm() / cap).min(1.0);
            }
        }
        shares
    }

    /// Rotation per distance (rad/m) that no part of the motion needs to exceed by much: keeps the
    /// rotation smooth if angular limits are far away. Infinite if a leg turns without moving.
    fn turn_bound(&self) -> f64 {
        let mut most = 0.0_f64;
        for (pair, turn) in self.poses.windows(2).zip(self.vectors.windows(2)) {
            let way = (pair[1].translation.vector - pair[0].translation.vector).norm();
            let angle = (turn[1] - turn[0]).norm();
            if angle > 1e-9 {
                most = most.max(angle / way.max(1e-300));
            }
        }
        2.0 * most.max(1e-3)
    }

    /// The problem, whose knot spacing is not known yet.
    pub(super) fn problem<const D: usize>(&self, used: [bool; 2]) -> Problem<D> {
        let vertices = self.poses.iter().zip(&self.vectors);
        let vertices: Vec<[f64; D]> = vertices
            .map(|(pose, turn)| self.pack(used, &pose.translation.vector, turn))
            .collect();
        let mut problem = Problem::at_rest(vertices, self.groups(used));
        problem.shares = self.request.shares.clone();
        problem.backwards = self.request.backwards;
        if Problem::<D>::TURNS {
            problem.led = self.led();
        }
        if let Some(moving) = self.moving {
            let virtual_turn = rolled(&moving.state, moving.spacing);
            let offset = body_turn(&self.poses[0].rotation, &moving.state.pose.rotation);
            let state = &moving.state;
            problem.start[0] = self.pack(
                used,
                &state.pose.translation.vector,
                &(offset + virtual_turn[0]),
            );
            for k in 0..3 {
                problem.start[k + 1] = self.pack(used, &state.linear[k], &virtual_turn[k + 1]);
            }
            let finish = self.request.finish;
            problem.finish = finish.map(|finish| self.end(used, finish, moving.spacing));
        }
        problem
    }

    fn run<const D: usize, const B: usize>(&self, used: [bool; 2]) -> Option<Found> {
        let mut problem = self.problem(used);
        let (mut point, effort) = self.first(&mut problem, used)?;
        let aims = |problem: &Problem<D>, point: &Point<D>| self.aims(problem, point);
        let aims: Option<Aims<'_, D>> = (used == [true, true]).then_some(&aims);
        solve::<D, B>(&mut problem, &mut point, effort, aims)?;
        if self.request.arm.is_some() {
            self.pass_first::<D, B>((&mut problem, &mut point), (effort, aims), used);
        }
        Some(self.found(&problem, &point, used))
    }

    /// What a search that ended with an iterate has found.
    pub(super) fn found<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
        used: [bool; 2],
    ) -> Found {
        Found {
            spans: self.spans(problem, point, used),
            seed: Self::seed(problem, point),
        }
    }

    /// How far and how long a search goes.
    pub(super) fn effort(&self) -> Effort {
        let effort = self.request.effort;
        // A motion that is known is made feasible from where its start is.
        let from_known = self.request.arm.is_none() && self.request.known.is_some();
        Effort {
            spread: effort.spread.filter(|_| !from_known),
            ..effort
        }
    }

    /// The first iterate of a problem, and how far and how long the search from there goes.
    fn first<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        used: [bool; 2],
    ) -> Option<(Point<D>, Effort)> {
        let mut effort = self.effort();
        let point = match (self.request.arm, self.request.known) {
            (Some(arm), _) => self.of_arm(problem, arm, used)?,
            (_, Some(spans)) => {
                if !Problem::<D>::TURNS && self.moving.is_none() {
                    (effort.steps, effort.search) = (STEPS, SEARCH);
                }
                self.known(problem, spans, used)
            }
            (None, None) => {
                let spread = self.moving.map(|_| effort.spread.unwrap_or(1.0));
                start::first(problem, spread, self.knots_per_ramp())
            }
        };
        Some((point, effort))
    }

    /// First iterate from a known motion.
    fn known<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        spans: &[Span],
        used: [bool; 2],
    ) -> Point<D> {
        let known = Known::new(
            spans,
            (self.poses, self.request.backwards),
            &self.vectors,
            self.options,
        );
        let finish = self.request.finish;
        problem.scale = match (self.moving, finish) {
            (Some(moving), Some(_)) => known.even(moving.spacing),
            (Some(moving), None) => moving.spacing,
            (None, _) => known.spacing(problem),
        };
        let ends = [self.moving.is_some(), finish.is_some()];
        let (control, crossings) = known.control(problem.scale, ends);
        let control = control.iter().map(|[p, r]| self.pack(used, p, r));
        let mut point = Point {
            control: control.collect(),
            z: 1.0,
            crossings,
        };
        let goal = problem.vertices[problem.vertices.len() - 1];
        for c in point.control.iter_mut().rev().take(4) {
            *c = goal;
        }
        point
    }

    /// Spans of a solution.
    pub(super) fn spans<const D: usize>(
        &self,
        problem: &Problem<D>,
        point: &Point<D>,
        used: [bool; 2],
    ) -> Vec<Span> {
        let h = problem.spacing(point.z);
        let rotations = match (used, self.request.moves()[1]) {
            ([_, true], _) => self.rotations(problem, point, h),
            (_, true) => self.following(problem, point, h),
            _ => Vec::new(),
        };
        let fixed = self.poses[0];
        (0..point.spans())
            .map(|k| {
                let mut place = [
                    fixed.translation.vector,
                    Vector3::zeros(),
                    Vector3::zeros(),
                    Vector3::zeros(),
                    Vector3::zeros(),
                ];
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
                Span {
                    start: h * k as f64,
                    duration: h,
                    point: place,
                    base,
                    turns,
                }
            })
            .collect()
    }

    /// Position, velocity, acceleration and jerk of an end in motion, at knot spacing `h`.
    fn end<const D: usize>(&self, used: [bool; 2], state: &ToolPoint, h: f64) -> [[f64; D]; 4] {
        // The pose that is passed last.
        let last = self.poses.len() - 2;
        let offset = body_turn(&self.poses[last].rotation, &state.pose.rotation);
        let turn = rolled(state, h);
        let place = &state.pose.translation.vector;
        let mut end = [[0.0; D]; 4];
        end[0] = self.pack(used, place, &(self.vectors[last] + offset + turn[0]));
        for k in 0..3 {
            end[k + 1] = self.pack(used, &state.linear[k], &turn[k + 1]);
        }
        end
    }
}
