//! The curve of least change of curvature through the balls of a list.
//!
//! A uniform quintic B-spline over a parameter that each pose has beforehand. Its third
//! derivative, squared and integrated, is least under the condition that it passes each pose within
//! its ball. The multipliers of that condition are weights of a least-squares fit: they are raised
//! where the fit is too far away and lowered where it is near, and the fit is repeated. One round
//! costs as many operations as there are poses and knots.
//!
//! # Source
//! Smoothing splines: C. H. Reinsch, "Smoothing by spline functions", Numerische Mathematik 10,
//! 1967. Weights by the size of the error: C. L. Lawson, "Contributions to the theory of linear
//! least maximum approximation", 1961. Parameters moved to the nearest point: J. Hoschek,
//! "Intrinsic parametrization for approximation", CAGD 5, 1988.

use nalgebra::SVector;
use simd::{Build, LANES};

use super::basis::{self, ORDER};
use super::fit::{Balls, Fit, Orientation};
use super::targets::{Assemble, Look, Miss, Seen, Target, targets};
use crate::smooth::spline::Band;

/// Share of the balls that the weights aim at.
const AIM: f64 = 0.85;
/// Logarithm of the first weight of all poses in one knot interval together.
const FIRST: f64 = -7.0;
/// Weight of both ends.
const ENDS: f64 = 1e8;
/// Rounds in which weights rise and fall, and rounds in which they only rise until all balls hold.
const ROUNDS: usize = 14;
const MORE: usize = 40;
/// Largest change of the logarithm of a weight in one round, down and up, and the power of the
/// error by which it changes.
const CHANGE: [f64; 2] = [-2.0, 2.0];
const POWER: f64 = 1.5;
/// Range of the logarithms of the weights.
const WEIGHTS: [f64; 2] = [-23.0, 16.0];
/// Knots to both sides over which weights change alike.
const SPREAD: usize = 2;
/// After so many rounds the parameters move.
const MOVED: usize = 3;
/// Below this share of the square of its speed, in radii of the balls, the place of a pose rests and
/// only its orientation changes.
const RESTS: f64 = 1e-4;
/// Diagonals of the system, with those that its solver needs free.
const BAND: usize = 12;

impl<const D: usize> Fit<D> {
    /// The curve through balls around `points`, passed about at `parameters`, from the first point
    /// to the last exactly, or the point that is missed most when some ball cannot be kept.
    pub(super) fn new(
        points: &[SVector<f64, D>],
        parameters: &[f64],
        balls: &Balls,
    ) -> Result<Self, usize> {
        let end = parameters.last().copied().unwrap_or(1.0);
        let part = Part {
            spans: end.round().max(1.0) as usize,
            ends: [true, true],
        };
        Self::of(part, (points, parameters, &balls.radii), balls.orientation)
    }

    /// The same for a part of a list: points, parameters and radii.
    pub(super) fn of(
        part: Part,
        (points, parameters, radii): (&[SVector<f64, D>], &[f64], &[f64]),
        orientation: Orientation,
    ) -> Result<Self, usize> {
        let (targets, given) = targets(points, parameters, radii);
        let knots = part.spans + ORDER - 1;
        let mut fitting = Fitting {
            part,
            orientation,
            fit: Self {
                control: vec![SVector::zeros(); knots],
                parameters: Vec::new(),
            },
            targets,
            seen: Vec::new(),
            weights: Vec::new(),
            missed: Vec::new(),
            levels: vec![FIRST; part.spans + 1],
            band: Band::zeros(knots),
            sides: std::array::from_fn(|_| vec![0.0; knots + BAND]),
            flat: vec![0.0; D * knots + LANES],
            build: Build::detect(),
        };
        let found = fitting.run();
        let Fitting {
            mut fit, targets, ..
        } = fitting;
        fit.parameters = given.iter().map(|i| targets[*i].at).collect();
        match found {
            Ok(()) => Ok(fit),
            Err(target) => Err(given.partition_point(|i| *i < target)),
        }
    }
}

/// What is fitted of a list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// Knot intervals.
    pub(super) spans: usize,
    /// Whether it begins and ends with the list: then the curve meets that point exactly.
    pub(super) ends: [bool; 2],
}

/// A fit under way.
struct Fitting<const D: usize> {
    part: Part,
    orientation: Orientation,
    fit: Fit<D>,
    targets: Vec<Target<D>>,
    /// Where each target is on the spline, its weight, and how far the spline is from it.
    seen: Vec<Seen>,
    weights: Vec<f64>,
    missed: Vec<[f64; 2]>,
    /// Logarithm of the weight at each knot.
    levels: Vec<f64>,
    band: Band<BAND>,
    sides: [Vec<f64>; D],
    /// The control points one after the other, and zeros.
    flat: Vec<f64>,
    build: Build,
}

impl<const D: usize> Fitting<D> {
    /// Fits until every ball holds; else the target that is missed most.
    fn run(&mut self) -> Result<(), usize> {
        let mut missed = self.targets.len() / 2;
        self.look();
        for round in 0..ROUNDS + MORE {
            if !self.solve() {
                return Err(missed);
            }
            let again = round >= ROUNDS && self.orientation == Orientation::AtPoses;
            if (round % MOVED == MOVED - 1 && round < ROUNDS) || again {
                self.reproject();
                self.look();
            }
            let (worst, target) = self.reweigh(round < ROUNDS);
            if round >= ROUNDS && worst <= 1.0 {
                self.meet_ends();
                return Ok(());
            }
            missed = target;
        }
        Err(missed)
    }

    /// Finds where each target is on the spline.
    fn look(&mut self) {
        self.build.run(Look {
            targets: &self.targets,
            spans: self.part.spans,
            seen: &mut self.seen,
        });
    }

    /// Solves the least-squares problem for the present weights.
    fn solve(&mut self) -> bool {
        let gram = basis::gram();
        self.band.clear();
        for side in &mut self.sides {
            side.fill(0.0);
        }
        for span in 0..self.fit.spans() {
            for i in 0..ORDER {
                for j in 0..=i {
                    self.band.columns[span + j][i - j] += gram[i][j];
                }
            }
        }
        self.weigh();
        self.build.run(Assemble {
            targets: &self.targets,
            seen: &self.seen,
            weights: &self.weights,
            columns: &mut self.band.columns,
            sides: &mut self.sides,
        });
        for column in &mut self.band.columns {
            column[0] *= 1.0 + 1e-14;
        }
        if !self.band.factor() {
            return false;
        }
        let mut sides = self.sides.iter_mut();
        let mut views: [&mut [f64]; D] = std::array::from_fn(|_| <&mut [f64]>::default());
        for view in &mut views {
            if let Some(side) = sides.next() {
                *view = side;
            }
        }
        self.band.solve(views);
        for (j, c) in self.fit.control.iter_mut().enumerate() {
            *c = SVector::from_fn(|d, _| self.sides[d][j]);
            self.flat[D * j..D * (j + 1)].copy_from_slice(c.as_slice());
        }
        true
    }

    /// Moves each parameter to where the curve comes closest, in order.
    fn reproject(&mut self) {
        let at_poses = self.orientation == Orientation::AtPoses;
        let (last, mut before) = (self.targets.len() - 1, 0.0);
        let end = self.fit.spans() as f64;
        for target in &mut self.targets[1..last] {
            let (span, x) = self.fit.locate(target.at);
            let off = self.fit.sum(span, basis::value(x)) - target.point;
            let slope = self.fit.sum(span, basis::first(x));
            let bend = self.fit.sum(span, basis::second(x));
            let product = |a: &SVector<f64, D>, b: &SVector<f64, D>| {
                let place: f64 = (0..3).map(|d| a[d] * b[d]).sum();
                (place, a.dot(b))
            };
            let (place, both) = product(&slope, &slope);
            let only = at_poses && place > RESTS * both;
            let part = |(place, both): (f64, f64)| if only { place } else { both };
            let fall = part((place, both));
            let curvature = (fall + part(product(&off, &bend))).max(0.5 * fall);
            if curvature > 0.0 {
                target.at -= (part(product(&off, &slope)) / curvature).clamp(-0.5, 0.5);
            }
            target.at = target.at.clamp(before, end);
            before = target.at;
        }
    }

    /// Changes the weights by the errors; the largest error over the radius of its ball, and its
    /// target.
    ///
    /// Neighbours change alike: a curve held at single places would bend there.
    fn reweigh(&mut self, fall: bool) -> (f64, usize) {
        self.build.run(Miss {
            targets: &self.targets,
            seen: &self.seen,
            control: &self.flat,
            missed: &mut self.missed,
        });
        let count = self.levels.len();
        let (last, mut worst) = (self.targets.len() - 1, (0.0_f64, 0));
        let mut errors = vec![0.0_f64; count];
        for (i, target) in self.targets[..last].iter().enumerate().skip(1) {
            let (span, [place, turn]) = (self.seen[i].span, self.missed[i]);
            let free = !target.given && self.orientation == Orientation::AtPoses;
            let error = place.max(if free { 0.0 } else { turn }) / target.radius;
            if error.is_nan() || error > worst.0 {
                worst = (error, i);
            }
            for slot in &mut errors[span..span + 2] {
                *slot = slot.max(error);
            }
        }
        let change = |k: usize| {
            let near = k.saturating_sub(SPREAD)..(k + SPREAD + 1).min(count);
            let error = errors[near].iter().copied().fold(0.0, f64::max);
            let change = POWER * (error / AIM).ln();
            change.clamp(if fall { CHANGE[0] } else { 0.0 }, CHANGE[1])
        };
        let changes: Vec<f64> = (0..count).map(change).collect();
        for (k, level) in self.levels.iter_mut().enumerate() {
            let near = k.saturating_sub(SPREAD)..(k + SPREAD + 1).min(count);
            let mean = changes[near.clone()].iter().sum::<f64>() / near.len() as f64;
            *level = (*level + mean).clamp(WEIGHTS[0], WEIGHTS[1]);
        }
        worst
    }

    /// Weight of each target: its share of the way times the level there.
    fn weigh(&mut self) {
        let (levels, spans) = (&self.levels, self.part.spans);
        let weight = |target: &Target<D>| {
            let span = (target.at.max(0.0) as usize).min(spans - 1);
            let x = (target.at - span as f64).clamp(0.0, 1.0);
            let level = levels[span] * (1.0 - x) + levels[span + 1] * x;
            target.share * level.exp()
        };
        self.weights.clear();
        self.weights.extend(self.targets.iter().map(weight));
        let [first, last] = self.part.ends;
        if let (true, Some(weight)) = (first, self.weights.first_mut()) {
            *weight = ENDS;
        }
        if let (true, Some(weight)) = (last, self.weights.last_mut()) {
            *weight = ENDS;
        }
    }

    /// Moves the curve, by next to nothing, so that it meets both ends to the last digit.
    fn meet_ends(&mut self) {
        let end = self.part.spans as f64;
        let last = self.targets.len() - 1;
        let [meets_first, meets_last] = self.part.ends;
        let mut first = self.targets[0].point - self.fit.point(0.0);
        let mut second = self.targets[last].point - self.fit.point(end);
        if !meets_first {
            first = SVector::zeros();
        }
        if !meets_last {
            second = SVector::zeros();
        }
        for (j, c) in self.fit.control.iter_mut().enumerate() {
            // A linear function has the value j - 2 at control point j.
            let share = (j as f64 - 2.0) / end;
            *c += first * (1.0 - share) + second * share;
        }
    }
}
