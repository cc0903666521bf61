//! The numeric solver: damped Newton steps inside the joint limits.
//!
//! One descent is a pure function of chain, goal and seed. Restarts are a fixed sequence, so the
//! same goal has the same result in every run.

use super::goal::Target;
use crate::chain::Chain;
use nalgebra::SVector;
use simd::{F4, Four, Op};

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

/// The result of a descent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SolverResult<const N: usize> {
    pub(crate) q: SVector<f64, N>,
    /// Distance from the goal, m.
    pub(crate) position: f64,
    /// Angle from the goal, rad.
    pub(crate) rotation: f64,
    /// Whether both are small enough.
    pub(crate) reached: bool,
}

/// Largest step of a joint, rad (or m divided by [`crate::measure::LENGTH`]).
const LONGEST_STEP: f64 = 1.2;
/// How often joints are held at their limits before a step is taken.
const HELD: u32 = 3;
/// Steps after which the squared distance must have halved.
const PATIENCE: u32 = 4;

/// A descent from a seed, compiled for both builds.
pub(crate) struct Descent<'a, const N: usize> {
    pub(crate) chain: &'a Chain<N>,
    pub(crate) target: &'a Target,
    pub(crate) seed: SVector<f64, N>,
    pub(crate) stop: Stop,
}

impl<const N: usize> Op for Descent<'_, N> {
    type Output = SolverResult<N>;

    /// Levenberg-Marquardt with damping in proportion to the squared distance.
    ///
    /// # Source
    /// T. Sugihara, "Solvability-unconcerned inverse kinematics by the
    /// Levenberg-Marquardt method", IEEE Trans. Robotics 27(5), 2011, eq. 8 and 23.
    #[inline(always)]
    fn run<A: Four>(mut self, a: A) -> SolverResult<N> {
        let (target, stop) = (self.target, self.stop);
        let mut best = SolverResult {
            q: self.seed,
            position: f64::INFINITY,
            rotation: f64::INFINITY,
            reached: false,
        };
        let mut best_square = f64::INFINITY;
        let (mut mark, mut marked_at) = (f64::INFINITY, 0);
        for step in 0..=stop.steps {
            let reached = self.chain.reach(a, &self.seed);
            let tool = reached.end.frame();
            let pose_error = target.pose_error(a, &tool);
            let square = pose_error
                .rows
                .iter()
                .fold(0.0, |sum, e| a.fma(*e, *e, sum));
            if square < best_square {
                best_square = square;
                best = SolverResult {
                    q: self.seed,
                    position: pose_error.position,
                    rotation: pose_error.rotation,
                    reached: pose_error.position <= stop.position
                        && pose_error.rotation <= stop.rotation,
                };
                if best.reached {
                    return best;
                }
            }
            if square < 0.5 * mark {
                (mark, marked_at) = (square, step);
            } else if step - marked_at >= PATIENCE || !square.is_finite() {
                break;
            }
            let mut linearized = Linearized {
                rows: self.chain.rows(&reached),
                rest: pose_error.rows,
            };
            target.shape(&tool, &mut linearized.rows);
            let step = linearized.step(a, &self, a.fma(0.03, square, 1e-12));
            advance(self.chain, &mut self.seed, &step, stop.limits);
        }
        best
    }
}

/// The error of the pose to first order in a step of the joints: `rest - rows * step`.
struct Linearized<A: Four> {
    rows: [[F4<A>; 2]; 6],
    rest: [f64; 6],
}

impl<A: Four> Linearized<A> {
    /// The damped Newton step from the seed of a descent, inside the joint limits if they count.
    #[inline(always)]
    fn step<const N: usize>(&mut self, a: A, descent: &Descent<'_, N>, damping: f64) -> [f64; 8] {
        let (chain, q) = (descent.chain, &descent.seed);
        let mut held = [None; 8];
        let mut step = [0.0; 8];
        for round in 0..=HELD {
            let pull = self.gradient(a);
            if descent.stop.limits && round == 0 {
                self.freeze(a, chain, q, &pull);
            }
            step = solve_damped::<A, N>(a, &self.rows, &pull, damping);
            for i in 0..N {
                step[i] = held[i].unwrap_or(step[i]);
            }
            if !descent.stop.limits || !self.hold(a, descent, &step, &mut held) {
                break;
            }
        }
        step
    }

    /// `J^T e`.
    #[inline(always)]
    fn gradient(&self, a: A) -> [f64; 8] {
        let mut sum = [F4::splat(a, 0.0); 2];
        for r in 0..6 {
            let e = F4::splat(a, self.rest[r]);
            sum = [
                self.rows[r][0].fma(e, sum[0]),
                self.rows[r][1].fma(e, sum[1]),
            ];
        }
        let ([a, b, c, d], [e, f, g, h]) = (sum[0].array(), sum[1].array());
        [a, b, c, d, e, f, g, h]
    }

    /// Excludes joints that are at a limit and would be moved beyond it.
    #[inline(always)]
    fn freeze<const N: usize>(
        &mut self,
        a: A,
        chain: &Chain<N>,
        q: &SVector<f64, N>,
        gradient: &[f64; 8],
    ) {
        let mut keep = [[1.0; 4]; 2];
        let mut frozen = false;
        for i in 0..N {
            let outward = (q[i] >= chain.upper()[i] && gradient[i] > 0.0)
                || (q[i] <= chain.lower()[i] && gradient[i] < 0.0);
            if outward {
                keep[i / 4][i % 4] = 0.0;
                frozen = true;
            }
        }
        if frozen {
            let keep = [F4::new(a, keep[0]), F4::new(a, keep[1])];
            for row in &mut self.rows {
                *row = [row[0] * keep[0], row[1] * keep[1]];
            }
        }
    }

    /// Holds joints that a step would move beyond a limit: they move to the limit, and their effect
    /// is subtracted from `rest`, which the other joints must do. Returns whether there are any.
    #[inline(always)]
    fn hold<const N: usize>(
        &mut self,
        a: A,
        descent: &Descent<'_, N>,
        step: &[f64; 8],
        held: &mut [Option<f64>; 8],
    ) -> bool {
        let (lower, upper) = (descent.chain.lower(), descent.chain.upper());
        let q = &descent.seed;
        let (mut keep, mut moved) = ([[1.0; 4]; 2], [[0.0; 4]; 2]);
        let mut any = false;
        for i in 0..N {
            let inside = (q[i] + step[i]).min(upper[i]).max(lower[i]) - q[i];
            if held[i].is_none() && (inside - step[i]).abs() > 1e-9 {
                (keep[i / 4][i % 4], moved[i / 4][i % 4]) = (0.0, inside);
                held[i] = Some(inside);
                any = true;
            }
        }
        if any {
            let keep = [F4::new(a, keep[0]), F4::new(a, keep[1])];
            let moved = [F4::new(a, moved[0]), F4::new(a, moved[1])];
            for (row, rest) in self.rows.iter_mut().zip(&mut self.rest) {
                let [x, y, z, w] = row[0].fma(moved[0], row[1] * moved[1]).array();
                *rest -= x + y + z + w;
                *row = [row[0] * keep[0], row[1] * keep[1]];
            }
        }
        any
    }
}

/// Solves `(J^T J + damping) x = b` by elimination; the matrix is positive definite.
#[inline(always)]
fn solve_damped<A: Four, const N: usize>(
    a: A,
    rows: &[[F4<A>; 2]; 6],
    b: &[f64; 8],
    damping: f64,
) -> [f64; 8] {
    let mut columns = [[0.0; 6]; 8];
    for r in 0..6 {
        for half in 0..2 {
            let part = rows[r][half].array();
            for i in 0..4 {
                columns[4 * half + i][r] = part[i];
            }
        }
    }
    // Only the upper half is kept: the lower one mirrors it.
    let mut m = [[F4::splat(a, 0.0); 2]; N];
    for i in 0..N {
        let mut diagonal = [[0.0; 4]; 2];
        diagonal[i / 4][i % 4] = damping;
        for half in i / 4..2 {
            let mut sum = F4::new(a, diagonal[half]);
            for r in 0..6 {
                sum = rows[r][half].fma(F4::splat(a, columns[i][r]), sum);
            }
            m[i][half] = sum;
        }
    }
    let mut b = *b;
    let (mut upper, mut inverse) = ([[0.0; 8]; N], [0.0; N]);
    for k in 0..N {
        for half in k / 4..2 {
            upper[k][4 * half..4 * half + 4].copy_from_slice(&m[k][half].array());
        }
        inverse[k] = 1.0 / upper[k][k];
        for i in k + 1..N {
            let factor = upper[k][i] * inverse[k];
            for half in i / 4..2 {
                m[i][half] = m[k][half].taken_from(F4::splat(a, factor), m[i][half]);
            }
            b[i] = a.fma(-factor, b[k], b[i]);
        }
    }
    let mut x = [0.0; 8];
    for k in (0..N).rev() {
        let mut sum = b[k];
        for j in k + 1..N {
            sum = a.fma(-upper[k][j], x[j], sum);
        }
        x[k] = sum * inverse[k];
    }
    x
}

/// Takes a step, scaled down if a joint would move too far.
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
pub(crate) struct Restarts<'a, const N: usize> {
    chain: &'a Chain<N>,
    /// From one seed to the next, as a share of each joint's part.
    steps: [f64; N],
}

impl<'a, const N: usize> Restarts<'a, N> {
    /// The sequence for a chain; its steps are powers of the root of `x^(N+1) = x + 1`.
    ///
    /// # Source
    /// M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018.
    pub(crate) fn new(chain: &'a Chain<N>) -> Self {
        let mut root = 1.5_f64;
        for _ in 0..32 {
            root = (1.0 + root).powf(1.0 / (N as f64 + 1.0));
        }
        let steps = std::array::from_fn(|i| root.powi(-(i as i32 + 1)));
        Self { chain, steps }
    }

    /// The seed with this number.
    pub(crate) fn at(&self, index: u32) -> SVector<f64, N> {
        SVector::from_fn(|i, _| {
            let unit = (0.5 + self.steps[i] * f64::from(index)).fract();
            let (low, high) = window(self.chain, i);
            low + (high - low) * unit
        })
    }
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
