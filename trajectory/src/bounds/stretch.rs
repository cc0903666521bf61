//! Bounds of the tool's motion over an interval of time.

use nalgebra::{SVector, Vector3};
use realtime::Piece;

use super::{Held, JointsToTool};
use crate::found::{Found, TOLERANCE};
use crate::limit::Limit;
use crate::{JointPoint, ToolPoint, Trajectory};

/// The limits of the tool, in the order used in this file.
pub(super) const LIMITS: [Limit; 6] = [
    Limit::ToolSpeed,
    Limit::ToolAcceleration,
    Limit::ToolJerk,
    Limit::AngularSpeed,
    Limit::AngularAcceleration,
    Limit::AngularJerk,
];

/// Largest sum of the rotations of all joints (rad) over a first interval.
const TURN: f64 = 0.8;
/// Largest error of a ratio with which an interval is not divided.
const ERROR: f64 = 1e-3;
/// A stretch is divided at most this often.
const DEPTH: u32 = 16;

/// The largest value of `t (t - 1/4) (t - 1/2) (t - 3/4) (1 - t)` from 0 to 1: times the fifth
/// Taylor coefficient, it bounds the error of the quartic through five samples.
///
/// # Source
/// Error of polynomial interpolation (P. J. Davis, Interpolation and Approximation, 1963, theorem
/// 3.1.1). It holds for the component of a vector along any direction, so it holds for the norm
/// too.
const NODES: f64 = 0.003_55;
/// The same of `t² (t - 1/2) (1 - t)²`, for the quartic through three samples with the slopes at both ends.
///
/// # Source
/// Error of Hermite interpolation (Davis 1963, theorem 3.1.1 with repeated points).
const HERMITE: f64 = 0.008_95;
/// The same of `t (t - 1/2) (1 - t)`: times the third Taylor coefficient, it bounds the error of the
/// parabola through three samples.
const PARABOLA: f64 = 0.048_12;
/// Largest error of a ratio with which three samples are enough.
const FINE: f64 = 1e-5;

/// The tool over a stretch of time.
#[derive(Clone, Debug)]
pub(super) struct Stretch {
    /// When it starts, and how long it is (s).
    pub start: f64,
    pub duration: f64,
    /// The bound of each ratio; 0 where the limit is infinite.
    pub upper: [f64; 6],
    /// Each quantity over its limit, in Bernstein form, within `error`.
    control: [[Vector3<f64>; 5]; 6],
    error: [f64; 6],
    /// The place (m), within `place_error`.
    pub place: [Vector3<f64>; 5],
    pub place_error: f64,
    /// The piece that it belongs to, and its start in that piece (s).
    piece: usize,
    since: f64,
}

/// A part of a piece.
#[derive(Clone, Copy)]
struct PiecePart {
    /// The piece, from 0.
    index: usize,
    /// Its start in the piece, and its length (s).
    since: f64,
    width: f64,
}

impl PiecePart {
    fn halves(self) -> [Self; 2] {
        let width = 0.5 * self.width;
        [self.since, self.since + width].map(|since| Self {
            since,
            width,
            ..self
        })
    }
}

impl Stretch {
    /// The part of a piece that it is.
    fn part(&self) -> PiecePart {
        PiecePart {
            index: self.piece,
            since: self.since,
            width: self.duration,
        }
    }

    /// The end of the stretch (s).
    pub(super) fn end(&self) -> f64 {
        self.start + self.duration
    }

    /// Makes it `factor` times as long; `scales` are the powers of the inverse of the factor.
    pub(super) fn slow_down(&mut self, factor: f64, scales: &[f64; 3]) {
        self.start *= factor;
        self.duration *= factor;
        self.since *= factor;
        for q in 0..6 {
            let scale = scales[q % 3];
            self.upper[q] *= scale;
            self.error[q] *= scale;
            self.control[q].iter_mut().for_each(|c| *c *= scale);
        }
    }
}

/// The tool over a part of a piece, in Bernstein form.
struct Curves {
    /// Each quantity over its limit.
    control: [[Vector3<f64>; 5]; 6],
    /// The place (m).
    place: [Vector3<f64>; 5],
}

/// Looks at the tool of one motion.
struct Looker<'a, T, const N: usize> {
    trajectory: &'a Trajectory<N>,
    tool: &'a T,
    /// One over each limit; 0 where it is infinite.
    narrow: [f64; 6],
    /// Largest error of the place (m).
    place: f64,
}

impl<T: JointsToTool<N>, const N: usize> Looker<'_, T, N> {
    /// The interval of a part of a piece.
    fn stretch(&self, part: PiecePart) -> Stretch {
        let PiecePart {
            index,
            since,
            width,
        } = part;
        let piece = &self.trajectory.pieces()[index];
        let (p, w) = self.tool.growth(&taylor(piece, since, width));
        // The fifth coefficient of each derivative, from those of place and angular velocity; for three samples
        // the third of the highest.
        let five = [
            6.0 * p[6],
            42.0 * p[7],
            336.0 * p[8],
            w[5],
            6.0 * w[6],
            42.0 * w[7],
        ];
        let mut three = five;
        (three[2], three[5]) = (120.0 * p[6], 20.0 * w[5]);
        let factors = [HERMITE, HERMITE, PARABOLA];
        let error = self.errors(three, factors, width);
        let place_error = HERMITE * p[5];
        let fine = place_error <= self.place && error.iter().all(|error| *error <= FINE);
        let (curves, error, place_error) = if fine {
            (self.through_three(part), error, place_error)
        } else {
            let error = self.errors(five, [NODES; 3], width);
            (self.through_five(part), error, NODES * p[5])
        };
        let Curves { control, place } = curves;
        // Not by `map` of arrays, which would be calls.
        let mut upper = error;
        for (upper, control) in upper.iter_mut().zip(&control) {
            *upper += hull(control);
        }
        Stretch {
            start: self.trajectory.times()[index] + since,
            duration: width,
            upper,
            control,
            error,
            place,
            place_error,
            piece: index,
            since,
        }
    }

    /// Errors of the ratios of interpolated derivatives, from their Taylor coefficients and the factors of
    /// derivatives 1 to 3; 0 where the limit is infinite.
    fn errors(&self, coefficients: [f64; 6], factors: [f64; 3], width: f64) -> [f64; 6] {
        let mut errors = [0.0; 6];
        let powers = [width, width.powi(2), width.powi(3)];
        for q in (0..6).filter(|q| self.narrow[*q] > 0.0) {
            errors[q] = coefficients[q] * factors[q % 3] / powers[q % 3] * self.narrow[q];
        }
        errors
    }

    /// The curves through the ends and the middle of a part, with the slopes at the ends where these are known.
    fn through_three(&self, part: PiecePart) -> Curves {
        let seen = [0.0, 0.5, 1.0].map(|share| self.seen(part, share));
        let slope = 0.25 * part.width;
        let mut control = [[Vector3::zeros(); 5]; 6];
        for (q, control) in control.iter_mut().enumerate() {
            let narrow = self.narrow[q];
            let value = |i: usize, order: usize| {
                let parts = if q < 3 {
                    &seen[i].linear
                } else {
                    &seen[i].angular
                };
                parts[order] * narrow
            };
            let order = q % 3;
            let values = [value(0, order), value(1, order), value(2, order)];
            *control = if order == 2 {
                parabola(values)
            } else {
                hermite(
                    values,
                    [value(0, order + 1) * slope, value(2, order + 1) * slope],
                )
            };
        }
        let [first, middle, last] = seen.each_ref().map(|seen| seen.pose.translation.vector);
        let slopes = [seen[0].linear[0] * slope, seen[2].linear[0] * slope];
        Curves {
            control,
            place: hermite([first, middle, last], slopes),
        }
    }

    /// The curves through five places of a part.
    fn through_five(&self, part: PiecePart) -> Curves {
        let mut values = [[Vector3::zeros(); 5]; 6];
        let mut places = [Vector3::zeros(); 5];
        for i in 0..5 {
            let seen = self.seen(part, 0.25 * i as f64);
            places[i] = seen.pose.translation.vector;
            for k in 0..3 {
                values[k][i] = seen.linear[k] * self.narrow[k];
                values[k + 3][i] = seen.angular[k] * self.narrow[k + 3];
            }
        }
        let mut control = values;
        for (control, values) in control.iter_mut().zip(&values) {
            *control = quartic(values);
        }
        Curves {
            control,
            place: quartic(&places),
        }
    }

    /// The tool at a share of a part of a piece.
    fn seen(&self, part: PiecePart, share: f64) -> ToolPoint {
        let s = self.trajectory.pieces()[part.index].sample(part.since + part.width * share);
        let q = [s.position, s.velocity, s.acceleration, s.jerk];
        self.tool.motion(&JointPoint { q })
    }

    /// Adds the intervals of a part of a piece, each short enough for its error.
    fn divide(&self, part: PiecePart, depth: u32, out: &mut Vec<Stretch>) {
        let stretch = self.stretch(part);
        let good =
            stretch.error.iter().all(|error| *error <= ERROR) && stretch.place_error <= self.place;
        if good || depth == 0 {
            out.push(stretch);
            return;
        }
        let [first, second] = part.halves();
        self.divide(first, depth - 1, out);
        self.divide(second, depth - 1, out);
    }

    /// All stretches of the motion.
    fn stretches(&self) -> Vec<Stretch> {
        let mut out = Vec::with_capacity(self.trajectory.pieces().len() + 64);
        for (index, piece) in self.trajectory.pieces().iter().enumerate() {
            if piece.duration <= 0.0 {
                continue;
            }
            let turn = taylor(piece, 0.0, piece.duration)[1].sum();
            // NaN gives one interval, whose bound is NaN too.
            let parts = (turn / TURN).ceil().clamp(1.0, 1e4) as usize;
            let width = piece.duration / parts as f64;
            for part in 0..parts {
                let since = width * part as f64;
                self.divide(
                    PiecePart {
                        index,
                        since,
                        width,
                    },
                    DEPTH,
                    &mut out,
                );
            }
        }
        out
    }

    /// Adds one quantity over an interval to a search; if the error is too large, the interval is
    /// halved.
    fn search(&self, stretch: &Stretch, q: usize, depth: u32, found: &mut Found) {
        if stretch.upper[q] <= found.bound {
            return;
        }
        let hidden = stretch.error[q] > 0.25 * TOLERANCE * found.reached;
        if hidden && depth > 0 && !found.enough(stretch.upper[q]) {
            for part in stretch.part().halves() {
                let closer = self.stretch(part);
                found.reached = found.reached.max(ends(&closer, q));
                self.search(&closer, q, depth - 1, found);
            }
            return;
        }
        let when = stretch.start..stretch.end();
        found.take(&stretch.control[q], when, stretch.error[q], Vector3::norm);
    }
}

/// The largest norm of some points; NaN if one of them is NaN.
fn hull(control: &[Vector3<f64>; 5]) -> f64 {
    let larger = |most: f64, x: f64| if x > most || x.is_nan() { x } else { most };
    control.iter().map(Vector3::norm).fold(0.0, larger)
}

/// The larger value of a quantity at the ends of an interval.
fn ends(stretch: &Stretch, q: usize) -> f64 {
    stretch.control[q][0]
        .norm()
        .max(stretch.control[q][4].norm())
}

/// Ratios below this count as zero.
const FLOOR: f64 = 1e-6;

/// The intervals of a motion, and the bound of each finite limit of the tool.
pub(super) fn bound<T: JointsToTool<N>, const N: usize>(
    trajectory: &Trajectory<N>,
    tool: &T,
    held: &Held<'_, N>,
) -> (Vec<Stretch>, [Option<Found>; 6]) {
    let limits = held.tool;
    let values = [
        limits.speed,
        limits.acceleration,
        limits.jerk,
        limits.angular_speed,
        limits.angular_acceleration,
        limits.angular_jerk,
    ];
    let looker = Looker {
        trajectory,
        tool,
        narrow: values.map(|limit| 1.0 / limit),
        place: held.place,
    };
    let stretches = looker.stretches();
    let mut found = [None; 6];
    for q in (0..6).filter(|q| values[*q].is_finite()) {
        let reached = stretches.iter().map(|s| ends(s, q)).fold(0.0, f64::max);
        let mut search = Found {
            reached,
            floor: FLOOR,
            ..Found::default()
        };
        // The highest first, so that few have to be refined.
        let highest = stretches
            .iter()
            .max_by(|a, b| a.upper[q].total_cmp(&b.upper[q]));
        for stretch in highest.into_iter().chain(&stretches) {
            looker.search(stretch, q, DEPTH, &mut search);
        }
        found[q] = Some(search);
    }
    (stretches, found)
}

/// Bernstein points of the quartic through values at equal steps, ends included.
fn quartic(f: &[Vector3<f64>; 5]) -> [Vector3<f64>; 5] {
    let beside = |a: usize, b: usize, c: usize, d: usize, e: usize| {
        (f[a] * -13.0 + f[b] * 48.0 - f[c] * 36.0 + f[d] * 16.0 - f[e] * 3.0) / 12.0
    };
    let sides = (f[0] + f[4]) * 13.0 - (f[1] + f[3]) * 64.0;
    [
        f[0],
        beside(0, 1, 2, 3, 4),
        (sides + f[2] * 120.0) / 18.0,
        beside(4, 3, 2, 1, 0),
        f[4],
    ]
}

/// Bernstein points of the quartic through the values at both ends and in the middle that has the slopes at
/// the ends, given as a quarter of the change over the whole interval.
fn hermite(
    [first, middle, last]: [Vector3<f64>; 3],
    slopes: [Vector3<f64>; 2],
) -> [Vector3<f64>; 5] {
    let (second, fourth) = (first + slopes[0], last - slopes[1]);
    let third = (middle * 16.0 - first - last - (second + fourth) * 4.0) / 6.0;
    [first, second, third, fourth, last]
}

/// The same of the parabola through these values.
fn parabola([first, middle, last]: [Vector3<f64>; 3]) -> [Vector3<f64>; 5] {
    let bend = middle * 2.0 - (first + last) * 0.5;
    let third = (first + bend * 4.0 + last) / 6.0;
    [
        first,
        (first + bend) * 0.5,
        third,
        (bend + last) * 0.5,
        last,
    ]
}

/// Bounds of the Taylor coefficients of each joint over `[since, since + width]` (s) of a piece, in
/// units of the width: from those at the middle, half a width away at most.
fn taylor<const N: usize>(piece: &Piece<N>, since: f64, width: f64) -> [SVector<f64, N>; 6] {
    let mut at = piece.coefficients;
    let middle = since + 0.5 * width;
    for low in 0..5 {
        for k in (low..5).rev() {
            at[k] += at[k + 1] * middle;
        }
    }
    let mut power = 1.0;
    for c in &mut at {
        *c = c.abs() * power;
        power *= width;
    }
    // The same shift by half a width, with magnitudes.
    for low in 0..5 {
        for k in (low..5).rev() {
            at[k] += at[k + 1] * 0.5;
        }
    }
    at
}
