//! The numeric solver: damped Newton steps inside the joint limits.
//!
//! One descent is a pure function of chain, goal and seed; restarts are a fixed
//! sequence, so the same question has the same answer on every run.

use super::goal::Target;
use crate::arith::{Arith, Op};
use crate::chain::Chain;
use nalgebra::SVector;

/// When a descent stops.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stop {
    /// Largest distance from the goal that counts as reached, m.
    pub(crate) position: f64,
    /// Largest angle from the goal that counts as reached, rad.
    pub(crate) rotation: f64,
    /// Most steps.
    pub(crate) steps: u32,
    /// Whether joints stay inside their limits.
    pub(crate) limits: bool,
}

/// Where a descent ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Landing<const N: usize> {
    pub(crate) q: SVector<f64, N>,
    /// Distance from the goal, m.
    pub(crate) position: f64,
    /// Angle from the goal, rad.
    pub(crate) rotation: f64,
    /// Whether both are small enough.
    pub(crate) reached: bool,
}

/// Largest step of a joint, rad (or m divided by [`super::goal::LENGTH`]).
const LONGEST_STEP: f64 = 1.2;
/// Steps after which the squared distance must have halved.
const PATIENCE: u32 = 4;

/// A descent from a seed as a dispatched computation.
pub(crate) struct Descent<'a, const N: usize> {
    pub(crate) chain: &'a Chain<N>,
    pub(crate) target: &'a Target,
    pub(crate) seed: SVector<f64, N>,
    pub(crate) stop: Stop,
}

impl<const N: usize> Op for Descent<'_, N> {
    type Output = Landing<N>;

    /// Levenberg-Marquardt with damping in proportion to the squared distance.
    ///
    /// # Source
    /// T. Sugihara, "Solvability-unconcerned inverse kinematics by the
    /// Levenberg-Marquardt method", IEEE Trans. Robotics 27(5), 2011, eq. 8 and 23.
    #[inline(always)]
    fn run<A: Arith>(self, a: A) -> Landing<N> {
        let Self {
            chain,
            target,
            stop,
            mut seed,
        } = self;
        let mut best = Landing {
            q: seed,
            position: f64::INFINITY,
            rotation: f64::INFINITY,
            reached: false,
        };
        let mut best_square = f64::INFINITY;
        let (mut mark, mut marked_at) = (f64::INFINITY, 0);
        for step in 0..=stop.steps {
            let (tool, mut rows) = chain.jacobian_rows(a, &seed);
            let miss = target.miss(a, &tool);
            let square = miss.rows.iter().fold(0.0, |sum, e| a.fma(*e, *e, sum));
            if square < best_square {
                best_square = square;
                best = Landing {
                    q: seed,
                    position: miss.position,
                    rotation: miss.rotation,
                    reached: false,
                };
                if miss.position <= stop.position && miss.rotation <= stop.rotation {
                    best.reached = true;
                    return best;
                }
            }
            if square < 0.5 * mark {
                (mark, marked_at) = (square, step);
            } else if step - marked_at >= PATIENCE || !square.is_finite() {
                break;
            }
            target.shape(a, &tool, &mut rows);
            let gradient = gradient(a, &rows, &miss.rows);
            if stop.limits {
                freeze(chain, &seed, &gradient, &mut rows);
            }
            let damping = a.fma(0.03, square, 1e-12);
            let step = solve_damped::<A, N>(a, &rows, gradient, damping);
            advance(chain, &mut seed, &step, stop.limits);
        }
        best
    }
}

/// `J^T e`.
#[inline(always)]
fn gradient<A: Arith>(a: A, rows: &[[f64; 8]; 6], miss: &[f64; 6]) -> [f64; 8] {
    let mut gradient = [0.0; 8];
    for (row, e) in rows.iter().zip(miss) {
        for i in 0..8 {
            gradient[i] = a.fma(row[i], *e, gradient[i]);
        }
    }
    gradient
}

/// Takes joints out that stand at a limit and would be pushed beyond it.
#[inline(always)]
fn freeze<const N: usize>(
    chain: &Chain<N>,
    q: &SVector<f64, N>,
    gradient: &[f64; 8],
    rows: &mut [[f64; 8]; 6],
) {
    for i in 0..N {
        let outward = (q[i] >= chain.upper()[i] && gradient[i] > 0.0)
            || (q[i] <= chain.lower()[i] && gradient[i] < 0.0);
        if outward {
            for row in rows.iter_mut() {
                row[i] = 0.0;
            }
        }
    }
}

/// Solves `(J^T J + damping) x = b` by elimination; the matrix is positive definite.
#[inline(always)]
pub(crate) fn solve_damped<A: Arith, const N: usize>(
    a: A,
    rows: &[[f64; 8]; 6],
    mut b: [f64; 8],
    damping: f64,
) -> [f64; 8] {
    let mut m = [[0.0; 8]; N];
    for i in 0..N {
        for row in rows {
            for j in 0..8 {
                m[i][j] = a.fma(row[i], row[j], m[i][j]);
            }
        }
        m[i][i] += damping;
    }
    let mut inverse = [0.0; N];
    for k in 0..N {
        inverse[k] = 1.0 / m[k][k];
        for i in k + 1..N {
            // The lower half is never stored: it mirrors the upper one.
            let factor = -m[k][i] * inverse[k];
            let pivot = m[k];
            for j in 0..8 {
                m[i][j] = a.fma(factor, pivot[j], m[i][j]);
            }
            b[i] = a.fma(factor, b[k], b[i]);
        }
    }
    let mut x = [0.0; 8];
    for k in (0..N).rev() {
        let mut sum = b[k];
        for j in k + 1..N {
            sum = a.fma(-m[k][j], x[j], sum);
        }
        x[k] = sum * inverse[k];
    }
    x
}

/// Takes a step, shortened as a whole where a joint would go too far.
#[inline(always)]
fn advance<const N: usize>(
    chain: &Chain<N>,
    q: &mut SVector<f64, N>,
    step: &[f64; 8],
    limits: bool,
) {
    let longest = step
        .iter()
        .take(N)
        .fold(0.0_f64, |longest, x| longest.max(x.abs()));
    let scale = if longest > LONGEST_STEP {
        LONGEST_STEP / longest
    } else {
        1.0
    };
    for i in 0..N {
        let mut next = q[i] + step[i] * scale;
        if limits {
            next = next.min(chain.upper()[i]).max(chain.lower()[i]);
        }
        q[i] = next;
    }
}

/// The fixed sequence of seeds for restarts: evenly spread, at most one turn wide.
///
/// # Source
/// M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018:
/// multiples of powers of the root of `x^(N+1) = x + 1`.
pub(crate) fn restart<const N: usize>(chain: &Chain<N>, index: u32) -> SVector<f64, N> {
    let mut root = 1.5_f64;
    for _ in 0..32 {
        root = (1.0 + root).powf(1.0 / (N as f64 + 1.0));
    }
    SVector::from_fn(|i, _| {
        let step = root.powi(-(i as i32 + 1));
        let unit = (0.5 + step * f64::from(index)).fract();
        let (low, high) = window(chain, i);
        low + (high - low) * unit
    })
}

/// The part of a joint's range that restarts draw from.
pub(crate) fn window<const N: usize>(chain: &Chain<N>, joint: usize) -> (f64, f64) {
    use std::f64::consts::PI;
    let (low, high) = (chain.lower()[joint], chain.upper()[joint]);
    if chain.prismatic()[joint] || high - low <= 2.0 * PI {
        return (low, high);
    }
    // One turn about zero, shifted into the range.
    let middle = 0.0_f64.clamp(low + PI, high - PI);
    (middle - PI, middle + PI)
}
