//! First iterate from the motion of an arm, and how its joints move with the control points.
//!
//! Its places at even times are control points, as those of any motion that is known. Orientations are rolled out, so that a
//! difference of them is a turn of the tool; where the poses are is told by the passes.

use nalgebra::Vector3;

use super::basis;
use super::build::Task;
use super::frame::Frame;
use super::joint::{Joint, dot};
use super::problem::{Point, Problem, ways};
use crate::line::body_turn;
use crate::smooth::arm::{ArmMotion, ArmState};
use crate::smooth::seed::Seed;

/// Spans for each leg, for each of a long list, and the least number of all; the same where the tool turns, for which each costs
/// several times as much.
const SPANS: [usize; 3] = [30, 8, 100];
const TURNING: [usize; 3] = [8, 6, 40];
/// Spans from which on a list is long.
const LONG: usize = 400;

/// Knots that pass before the motion begins and after it has ended.
const REST: usize = 3;
/// Control points at either end that do not move.
const FIXED: usize = 4;
/// A joint that is beyond its range, or nearer to its end than this (rad, m), may stay there.
const AT_END: f64 = 1e-3;

/// What the arm has at the control points.
struct Sampled {
    states: Vec<ArmState>,
    /// The orientations, rolled out from the first.
    turns: Vec<Vector3<f64>>,
    /// Knot spacing, s.
    spacing: f64,
}

impl Sampled {
    fn new(arm: &ArmMotion<'_>, (legs, turns): (usize, bool)) -> Option<Self> {
        let [each, at_least, fewest] = if turns { TURNING } else { SPANS };
        let spans = (each * legs).clamp(fewest, LONG.max(at_least * legs));
        let spacing = arm.duration / spans as f64;
        let time = |k: usize| (k as f64 - REST as f64) * spacing;
        let states = (0..=spans + 2 * REST).map(|k| arm.state(time(k)));
        let states: Vec<ArmState> = states.collect::<Option<_>>()?;
        let mut turns = vec![Vector3::zeros()];
        for pair in states.windows(2) {
            let turn = body_turn(&pair[0].pose.rotation, &pair[1].pose.rotation);
            turns.push(turns[turns.len() - 1] + turn);
        }
        Some(Self {
            states,
            turns,
            spacing,
        })
    }

    /// The rolled-out orientation at a time, s.
    fn turn(&self, time: f64) -> Vector3<f64> {
        let at = time / self.spacing + REST as f64;
        let k = (at.max(0.0) as usize).min(self.turns.len() - 2);
        let share = (at - k as f64).clamp(0.0, 1.0);
        self.turns[k] * (1.0 - share) + self.turns[k + 1] * share
    }
}

/// A first iterate, the control points that a spline through its places has, and the arm there.
type Begin<const D: usize> = (Point<D>, Vec<[f64; D]>, Vec<ArmState>);

impl Task<'_> {
    /// The first iterate along the motion of an arm, whose joints the problem gets; its vertices are where that motion sees
    /// the poses.
    pub(super) fn of_arm<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        arm: &ArmMotion<'_>,
        used: [bool; 2],
    ) -> Option<Point<D>> {
        let seed = arm
            .onward
            .filter(|seed| seed.fits(D, problem.vertices.len()));
        let (point, places, states) = match seed {
            // What a rough search has found needs more knots to come nearer to the optimum.
            Some(seed) if !arm.rough && Problem::<D>::TURNS => {
                self.onward(problem, (arm, used), &seed.refined())?
            }
            Some(seed) => self.onward(problem, (arm, used), seed)?,
            None => self.sampled(problem, arm, used)?,
        };
        problem.joints = (0..arm.bounds.len())
            .map(|j| self.joint(&places, (arm, &states), (j, used)))
            .collect();
        Some(point)
    }

    /// An iterate through the places of an arm at even times, and the arm there.
    fn sampled<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        arm: &ArmMotion<'_>,
        used: [bool; 2],
    ) -> Option<Begin<D>> {
        let sampled = Sampled::new(arm, (self.poses.len() - 1, Problem::<D>::TURNS))?;
        let states = &sampled.states;
        problem.scale = sampled.spacing;
        let spare = Problem::<D>::SPARE;
        let mut control: Vec<[f64; D]> = Vec::with_capacity(states.len());
        for (state, turn) in states.iter().zip(&sampled.turns) {
            let mut c = self.pack(used, &state.pose.translation.vector, turn);
            if let Some(spare) = spare {
                c[spare] = state.spare;
            }
            control.push(c);
        }
        self.see_poses(problem, (arm, &sampled), used)?;
        problem.frames = frames(states, (&sampled.turns, used));
        if let Some(spare) = spare {
            problem.start[0][spare] = control[0][spare];
        }
        let end = control[control.len() - 1];
        for d in 0..D {
            sharpen(&mut control, |c| &mut c[d]);
        }
        let knots = (control.len() - FIXED) as f64;
        let pass = |time: &f64| (time / sampled.spacing + 1.5).min(knots);
        let mut point = Point {
            control,
            z: 1.0,
            crossings: arm.passes.iter().map(pass).collect(),
        };
        let goal = problem.vertices[problem.vertices.len() - 1];
        for c in point.control.iter_mut().rev().take(FIXED) {
            *c = goal;
        }
        problem.pin(&mut point);
        if let Some(spare) = spare {
            let before = point.control.len() - FIXED - 1;
            point.control[before][spare] = end[spare];
        }
        point.end_spare();
        let places = point.control.clone();
        Some((point, places, sampled.states))
    }

    /// The iterate with which a search ended, and the arm at its control points; the vertices are where it sees the poses.
    fn onward<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        (arm, used): (&ArmMotion<'_>, [bool; 2]),
        seed: &Seed,
    ) -> Option<Begin<D>> {
        let point = Point {
            control: Seed::used(&seed.control),
            z: 1.0,
            crossings: seed.crossings.clone(),
        };
        problem.scale = seed.spacing;
        problem.vertices = Seed::used(&seed.vertices);
        if let Some(spare) = Problem::<D>::SPARE {
            problem.start[0][spare] = point.control[0][spare];
        }
        // The times at which the control points count most, in knots.
        let times = (0..point.control.len()).map(|k| k as f64 - 1.5);
        let states = times.clone().map(|time| arm.state(time * seed.spacing));
        let states: Vec<ArmState> = states.collect::<Option<_>>()?;
        let place = |time: f64| point.at(time.clamp(0.0, point.spans() as f64))[0];
        let mut places: Vec<[f64; D]> = times.map(place).collect();
        let turns: Vec<Vector3<f64>> = places.iter().map(Problem::<D>::turn).collect();
        problem.frames = frames(&states, (&turns, used));
        self.see_aims(problem, &point);
        for d in 0..D {
            sharpen(&mut places, |c| &mut c[d]);
        }
        Some((point, places, states))
    }

    /// Moves the inner vertices of orientations to where an iterate sees the poses.
    pub(super) fn see_aims<const D: usize>(&self, problem: &mut Problem<D>, point: &Point<D>) {
        if Problem::<D>::TURNS {
            let aims = self.aims(problem, point);
            let last = problem.vertices.len() - 1;
            problem.vertices[1..last].copy_from_slice(&aims);
        }
        problem.ways = ways(&problem.vertices);
    }

    /// Where a search has ended.
    pub(super) fn seed<const D: usize>(problem: &Problem<D>, point: &Point<D>) -> Seed {
        Seed {
            coordinates: D,
            control: Seed::widened(&point.control),
            vertices: Seed::widened(&problem.vertices),
            crossings: point.crossings.clone(),
            spacing: problem.spacing(point.z),
        }
    }

    /// Moves the vertices of orientations to where the motion of an arm sees the poses.
    fn see_poses<const D: usize>(
        &self,
        problem: &mut Problem<D>,
        (arm, sampled): (&ArmMotion<'_>, &Sampled),
        used: [bool; 2],
    ) -> Option<()> {
        if !used[1] {
            return Some(());
        }
        let times = arm.passes.iter().chain([&arm.duration]);
        for (i, time) in times.enumerate() {
            let pose = arm.state(*time)?.pose;
            let off = body_turn(&pose.rotation, &self.poses[i + 1].rotation);
            let seen = sampled.turn(*time) + off;
            problem.vertices[i + 1][Problem::<D>::LAST..][..3].copy_from_slice(seen.as_slice());
        }
        problem.ways = ways(&problem.vertices);
        Some(())
    }

    /// How joint `j` moves with the control points of the first iterate, which are at these places.
    fn joint<const D: usize>(
        &self,
        places: &[[f64; D]],
        (arm, states): (&ArmMotion<'_>, &[ArmState]),
        (j, used): (usize, [bool; 2]),
    ) -> Joint<D> {
        let mut positions: Vec<f64> = states
            .iter()
            .map(|state| state.joints[j].position)
            .collect();
        sharpen(&mut positions, |q| q);
        let changes: Vec<[f64; D]> = states
            .iter()
            .map(|state| {
                let [x, y, z, a, b, c, with_spare] = state.joints[j].changes;
                let (along, about) = (Vector3::new(x, y, z), Vector3::new(a, b, c));
                let mut change = self.pack(used, &along, &about);
                if let Some(spare) = Problem::<D>::SPARE {
                    change[spare] = with_spare;
                }
                change
            })
            .collect();
        let all = positions.iter().zip(&changes).zip(places);
        let base = all.map(|((q, change), c)| q - dot(change, c));
        let bounds = &arm.bounds[j];
        let [low, high] = bounds.position;
        let least = positions.iter().copied().fold(f64::INFINITY, f64::min);
        let most = positions.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = (low.min(least - AT_END), high.max(most + AT_END));
        let range = |q: &f64| {
            let (low, high) = (low.max(q - arm.far), high.min(q + arm.far));
            [0.5 * (low + high), 0.5 * (high - low)]
        };
        Joint {
            caps: bounds.rates,
            range: positions.iter().map(range).collect(),
            base: base.collect(),
            changes,
        }
    }
}

/// The known motion at the control points, which stand for these rotation vectors; none where it does not turn.
fn frames(states: &[ArmState], (turns, used): (&[Vector3<f64>], [bool; 2])) -> Vec<Frame> {
    let all = states.iter().zip(turns).filter(|_| used[1]);
    let frame = |(state, turn): (&ArmState, &Vector3<f64>)| Frame {
        rotation: state.pose.rotation,
        vector: *turn,
    };
    all.map(frame).collect()
}

/// [`basis::reproduce`] of all places but those that do not move.
fn sharpen<T>(places: &mut [T], number: impl Fn(&mut T) -> &mut f64) {
    let inner = FIXED..places.len() - FIXED;
    let share = |k: usize| if inner.contains(&k) { 1.0 } else { 0.0 };
    basis::reproduce(places, number, share);
}
