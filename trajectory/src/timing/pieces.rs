//! Converts a law over the path into quintic pieces in time.

use nalgebra::SVector;
use realtime::{Piece, Sample};

use super::grid::Bounded;
use super::gridpoints::{Gridpoint, Gridpoints};
use super::joint::{Join, Motion};
use super::problem::{Problem, Spot};
use simd::Build;

/// The jerk of a piece may differ from that of the law by this fraction of the limit.
const JERK_FIT: f64 = 2e-3;
/// A cell is halved at most this often.
const DEPTH: usize = 5;

/// Pieces of a motion, with the cell of the law that each belongs to.
#[derive(Clone, Debug)]
pub(super) struct Pieces<const N: usize> {
    /// The joints.
    pub joint: Vec<Piece<N>>,
    /// The path parameter.
    pub law: Vec<Piece<1>>,
    /// The cell of each piece.
    pub cell: Vec<usize>,
    /// Largest distance of a joint from the path (rad), at the middle and quarters.
    pub fit_error: f64,
}

/// The motion at one place of the path.
#[derive(Clone, Copy)]
struct State<const N: usize> {
    joint: Sample<N>,
    law: Sample<1>,
    spot: Spot,
}

impl<const N: usize> State<N> {
    /// The motion at a gridpoint, where the law is `spot`.
    fn new(build: Build, gridpoint: &Gridpoint<N>, spot: Spot) -> Self {
        let root = spot.a.sqrt();
        let joint = build.run(Motion { gridpoint, spot });
        let one = |x: f64| SVector::<f64, 1>::from_element(x);
        let [u, u1, u2, u3] = gridpoint.reparametrization;
        let law = Sample {
            position: one(u),
            velocity: one(u1 * root),
            acceleration: one(u2 * spot.a + u1 * spot.b),
            jerk: one((u3 * spot.a + 3.0 * u2 * spot.b + u1 * spot.c) * root),
        };
        Self { joint, law, spot }
    }
}

/// Makes pieces out of one law.
pub(super) struct Maker<'a, const N: usize> {
    bounded: Bounded<'a, N>,
    gridpoints: &'a Gridpoints<N>,
    /// One over the jerk limits.
    narrow: SVector<f64, N>,
    build: Build,
    out: Pieces<N>,
}

/// An end of a piece: its place in the grid's parameter, and the state there.
#[derive(Clone, Copy)]
struct PieceEnd<'a, const N: usize> {
    w: f64,
    state: &'a State<N>,
}

impl<'a, const N: usize> Maker<'a, N> {
    /// For laws over the grid of `gridpoints`.
    pub(super) fn new(bounded: Bounded<'a, N>, gridpoints: &'a Gridpoints<N>) -> Self {
        let count = 2 * gridpoints.grid.nodes.len();
        let out = Pieces {
            joint: Vec::with_capacity(count),
            law: Vec::with_capacity(count),
            cell: Vec::with_capacity(count),
            fit_error: 0.0,
        };
        Self {
            bounded,
            gridpoints,
            narrow: bounded.joint.jerk.map(|x| 1.0 / x),
            build: Build::detect(),
            out,
        }
    }

    /// The pieces of the law `x`.
    pub(super) fn make(mut self, problem: &Problem, x: &[f64]) -> Pieces<N> {
        let nodes = &self.gridpoints.grid.nodes;
        for k in 0..problem.cells() {
            let (spot, gridpoints) = (problem.spot(k, x), self.gridpoints);
            let start = State::new(self.build, gridpoints.left(k), spot);
            let end = State::new(
                self.build,
                gridpoints.right(k),
                spot.moved(problem.widths[k]),
            );
            let [start, end] =
                [(nodes[k], &start), (nodes[k + 1], &end)].map(|(w, state)| PieceEnd { w, state });
            self.halve(k, start, end, DEPTH);
        }
        self.out
    }

    /// Adds the pieces between two places in cell `k`: one if it is close enough to the path,
    /// otherwise those of both halves.
    fn halve(&mut self, k: usize, from: PieceEnd<'_, N>, to: PieceEnd<'_, N>, depth: usize) {
        let (w0, start) = (from.w, from.state);
        let (w1, end) = (to.w, to.state);
        let duration = passage(start.spot, w1 - w0);
        let (joint, jerk_off) = self.build.run(Join {
            duration,
            start: &start.joint,
            end: &end.joint,
            narrow: &self.narrow,
        });
        // Both ends of the cell have the same third derivative of the law only within it.
        let fits = depth == 0 || jerk_off <= JERK_FIT;
        let law = Piece::hermite(duration, &start.law, &end.law);
        let error = if fits {
            self.fit_error(&joint, &law)
        } else {
            f64::INFINITY
        };
        if depth > 0 && error > self.bounded.options.fit {
            let middle = 0.5 * (w0 + w1);
            let spot = start.spot.moved(middle - w0);
            let state = if depth == DEPTH {
                State::new(self.build, self.gridpoints.middle(k), spot)
            } else {
                let grid = &self.gridpoints.grid;
                State::new(
                    self.build,
                    &grid.place(self.bounded.path, middle, 0.0).0,
                    spot,
                )
            };
            let middle = PieceEnd {
                w: middle,
                state: &state,
            };
            self.halve(k, from, middle, depth - 1);
            self.halve(k, middle, to, depth - 1);
            return;
        }
        self.out.fit_error = self.out.fit_error.max(error);
        self.out.joint.push(joint);
        self.out.law.push(law);
        self.out.cell.push(k);
    }

    /// Distance of the joints from the path in the middle of a piece.
    fn fit_error(&self, joint: &Piece<N>, law: &Piece<1>) -> f64 {
        let t = 0.5 * joint.duration;
        let u = position(law, t)[0];
        let end = self.bounded.path.end();
        let wanted = self.bounded.path.joint_at(u.clamp(0.0, end)).q[0];
        (position(joint, t) - wanted).amax()
    }
}

/// The position of a piece at `t` (s).
fn position<const N: usize>(piece: &Piece<N>, t: f64) -> SVector<f64, N> {
    let [c0, c1, c2, c3, c4, c5] = &piece.coefficients;
    c0 + (c1 + (c2 + (c3 + (c4 + c5 * t) * t) * t) * t) * t
}

/// Time (s) in which the law, which is `spot` here, moves `width` further within the cell.
///
/// # Source
/// Gauss-Legendre quadrature with five points (Abramowitz and Stegun, table 25.4).
fn passage(spot: Spot, width: f64) -> f64 {
    const PLACES: [f64; 3] = [0.0, 0.538_469_310_105_683_1, 0.906_179_845_938_664];
    const WEIGHTS: [f64; 3] = [
        0.568_888_888_888_888_9,
        0.478_628_670_499_366_5,
        0.236_926_885_056_189_1,
    ];
    let slow = |x: f64| 1.0 / spot.moved(0.5 * width * (1.0 + x)).a.sqrt();
    let mut sum = WEIGHTS[0] * slow(0.0);
    for i in 1..3 {
        sum += WEIGHTS[i] * (slow(PLACES[i]) + slow(-PLACES[i]));
    }
    0.5 * width * sum
}
