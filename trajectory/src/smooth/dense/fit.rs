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

use super::basis::{self, ORDER};
use super::places::parts;
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
/// Least number of targets in a knot interval.
const DENSITY: f64 = 2.0;

/// Diagonals of the system, with those that its solver needs free.
const BAND: usize = 12;

/// Where the orientation of a curve counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Orientation {
    /// All along the list, where the curve is nearest in place and orientation together.
    Along,
    /// At the poses only, where the curve is nearest in place, which is where they are passed.
    AtPoses,
}

/// The balls that a curve has to pass.
#[derive(Clone, Debug)]
pub(super) struct Balls {
    /// Radius for each point, as a share of the tolerance.
    pub(super) radii: Vec<f64>,
    pub(super) orientation: Orientation,
}

/// A place that the curve has to pass.
#[derive(Clone, Copy, Debug)]
struct Target<const D: usize> {
    point: SVector<f64, D>,
    /// Radius of the ball, as a share of the tolerance.
    radius: f64,
    /// Parameter at which it is passed.
    at: f64,
    /// The way it stands for, in knot intervals.
    share: f64,
    /// Whether it is a pose of the list.
    given: bool,
}

/// A uniform quintic B-spline over `0 ..= spans()`.
#[derive(Clone, Debug)]
pub(super) struct Fit<const D: usize> {
    pub(super) control: Vec<SVector<f64, D>>,
    /// Parameter at which each point of the list is passed.
    pub(super) parameters: Vec<f64>,
}

impl<const D: usize> Fit<D> {
    /// The curve through balls around `points`, passed about at `parameters`, from the first point
    /// to the last exactly, or the point that is missed most when some ball cannot be kept.
    pub(super) fn new(
        points: &[SVector<f64, D>],
        parameters: &[f64],
        balls: &Balls,
    ) -> Result<Self, usize> {
        let spans = parameters
            .last()
            .map_or(1, |end| end.round().max(1.0) as usize);
        let (targets, given) = targets(points, parameters, &balls.radii);
        let mut fitting = Fitting {
            orientation: balls.orientation,
            fit: Self {
                control: vec![SVector::zeros(); spans + ORDER - 1],
                parameters: Vec::new(),
            },
            targets,
            levels: vec![FIRST; spans + 1],
            band: Band::zeros(spans + ORDER - 1),
            sides: std::array::from_fn(|_| vec![0.0; spans + ORDER - 1 + BAND]),
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

    /// Number of knot intervals.
    pub(super) fn spans(&self) -> usize {
        self.control.len() + 1 - ORDER
    }

    /// First control point of the span at `at`, and the share of the span.
    fn locate(&self, at: f64) -> (usize, f64) {
        let span = (at.max(0.0) as usize).min(self.spans() - 1);
        (span, (at - span as f64).clamp(0.0, 1.0))
    }

    /// Sum of the control points of a span.
    fn sum(&self, span: usize, weights: [f64; ORDER]) -> SVector<f64, D> {
        let mut sum = SVector::zeros();
        for (c, w) in self.control[span..span + ORDER].iter().zip(weights) {
            sum += c * w;
        }
        sum
    }

    /// The point at a parameter.
    pub(super) fn point(&self, at: f64) -> SVector<f64, D> {
        let (span, x) = self.locate(at);
        self.sum(span, basis::value(x))
    }

    /// The point at a parameter and its three derivatives.
    pub(super) fn derivatives(&self, at: f64) -> [SVector<f64, D>; 4] {
        let (span, x) = self.locate(at);
        [
            basis::value(x),
            basis::first(x),
            basis::second(x),
            basis::third(x),
        ]
        .map(|weights| self.sum(span, weights))
    }
}

/// The points as targets, with more on long legs; and which target each point is.
fn targets<const D: usize>(
    points: &[SVector<f64, D>],
    parameters: &[f64],
    radii: &[f64],
) -> (Vec<Target<D>>, Vec<usize>) {
    let mut targets: Vec<Target<D>> = Vec::with_capacity(2 * points.len());
    let mut given = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let (at, radius) = (parameters[i], radii[i]);
        if i > 0 {
            let (from, before) = (points[i - 1], parameters[i - 1]);
            let parts = (DENSITY * (at - before)).ceil().max(1.0);
            for part in 1..parts as usize {
                let share = part as f64 / parts;
                targets.push(Target {
                    point: from + (point - from) * share,
                    radius: radius.min(radii[i - 1]),
                    at: before + (at - before) * share,
                    share: 0.0,
                    given: false,
                });
            }
        }
        given.push(targets.len());
        targets.push(Target {
            point: *point,
            radius,
            at,
            share: 0.0,
            given: true,
        });
    }
    // Each target weighs as much as the way it stands for.
    let last = targets.len() - 1;
    for i in 1..last {
        let share = 0.5 * (targets[i + 1].at - targets[i - 1].at);
        targets[i].share = share.max(1e-6);
    }
    (targets, given)
}

/// A fit under way.
struct Fitting<const D: usize> {
    orientation: Orientation,
    fit: Fit<D>,
    targets: Vec<Target<D>>,
    /// Logarithm of the weight at each knot.
    levels: Vec<f64>,
    band: Band<BAND>,
    sides: [Vec<f64>; D],
}

impl<const D: usize> Fitting<D> {
    /// Fits until every ball holds; else the target that is missed most.
    fn run(&mut self) -> Result<(), usize> {
        let mut missed = self.targets.len() / 2;
        for round in 0..ROUNDS + MORE {
            if !self.solve() {
                return Err(missed);
            }
            let again = round >= ROUNDS && self.orientation == Orientation::AtPoses;
            if (round % MOVED == MOVED - 1 && round < ROUNDS) || again {
                self.reproject();
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
        let last = self.targets.len() - 1;
        for (i, target) in self.targets.iter().enumerate() {
            let weight = if i == 0 || i == last {
                ENDS
            } else {
                self.weight(target)
            };
            let (span, x) = self.fit.locate(target.at);
            let w = basis::value(x);
            for i in 0..ORDER {
                let scaled = weight * w[i];
                for j in 0..=i {
                    self.band.columns[span + j][i - j] += scaled * w[j];
                }
                for (d, side) in self.sides.iter_mut().enumerate() {
                    side[span + i] += scaled * target.point[d];
                }
            }
        }
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
        let count = self.levels.len();
        let (last, mut worst) = (self.targets.len() - 1, (0.0_f64, 0));
        let mut errors = vec![0.0_f64; count];
        for (i, target) in self.targets[..last].iter().enumerate().skip(1) {
            let (span, x) = self.fit.locate(target.at);
            let [place, turn] = parts(&(self.fit.sum(span, basis::value(x)) - target.point));
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

    /// Weight of a target: its share of the way times the level there.
    fn weight(&self, target: &Target<D>) -> f64 {
        let (span, x) = self.fit.locate(target.at);
        let level = self.levels[span] * (1.0 - x) + self.levels[span + 1] * x;
        target.share * level.exp()
    }

    /// Moves the curve, by next to nothing, so that it meets both ends to the last digit.
    fn meet_ends(&mut self) {
        let end = self.fit.spans() as f64;
        let last = self.targets.len() - 1;
        let first = self.targets[0].point - self.fit.point(0.0);
        let second = self.targets[last].point - self.fit.point(end);
        for (j, c) in self.fit.control.iter_mut().enumerate() {
            // A linear function has the value j - 2 at control point j.
            let share = (j as f64 - 2.0) / end;
            *c += first * (1.0 - share) + second * share;
        }
    }
}
