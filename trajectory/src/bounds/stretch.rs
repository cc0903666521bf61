//! Bounds of the tool's motion over an interval of time.

use nalgebra::{SVector, Vector3};
use realtime::Piece;

use super::{Held, JointsToTool};
use crate::found::{Found, TOLERANCE};
use crate::limit::Limit;
use crate::{JointPoint, Trajectory};

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
        let mut values = [[Vector3::zeros(); 5]; 6];
        let mut places = [Vector3::zeros(); 5];
        for i in 0..5 {
            let s = piece.sample(since + width * i as f64 * 0.25);
            let q = [s.position, s.velocity, s.acceleration, s.jerk];
            let seen = self.tool.motion(&JointPoint { q });
            places[i] = seen.pose.translation.vector;
            for k in 0..3 {
                values[k][i] = seen.linear[k] * self.narrow[k];
                values[k + 3][i] = seen.angular[k] * self.narrow[k + 3];
            }
        }
        let (p, w) = self.tool.growth(&taylor(piece, since, width));
        let [h1, h2, h3] = [1, 2, 3].map(|k| NODES / width.powi(k));
        // The fifth coefficient of each derivative, from those of place and angular velocity.
        let errors = [
            6.0 * p[6] * h1,
            42.0 * p[7] * h2,
            336.0 * p[8] * h3,
            w[5] * h1,
            6.0 * w[6] * h2,
            42.0 * w[7] * h3,
        ];
        // Not by `map` of arrays, which would be calls.
        let (mut error, mut control, mut upper) = (errors, values, [0.0; 6]);
        for q in 0..6 {
            control[q] = quartic(&values[q]);
            error[q] = if self.narrow[q] > 0.0 {
                errors[q] * self.narrow[q]
            } else {
                0.0
            };
            upper[q] = hull(&control[q]) + error[q];
        }
        Stretch {
            start: self.trajectory.times()[index] + since,
            duration: width,
            upper,
            control,
            error,
            place: quartic(&places),
            place_error: NODES * p[5],
            piece: index,
            since,
        }
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
