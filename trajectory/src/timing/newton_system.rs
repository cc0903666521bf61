//! The Newton system of a law: what each row adds to it.

use super::band::Band;
use super::block::{LANE, Lane, dot, lanes, times, times_two};
use super::evaluate::Spots;
use super::lines::{Jerks, Lines, Values};
use super::problem::{Basis, Problem};
use super::state::{ConstraintRow, Norm, State};
use simd::{F4, Four, Op};

/// Gradient and curvature at a place, over `a`, `b`, `c` there.
#[derive(Clone, Copy)]
struct NewtonBlock<S: Four> {
    simd: S,
    aa: F4<S>,
    ab: F4<S>,
    ac: F4<S>,
    bb: F4<S>,
    bc: F4<S>,
    cc: F4<S>,
    ga: F4<S>,
    gb: F4<S>,
    gc: F4<S>,
}

/// Weight of a row's curvature and force of its gradient, for `g² <= 1` with centring `mu`.
#[inline(always)]
fn weigh<S: Four>(simd: S, row: &ConstraintRow, mu: F4<S>) -> (F4<S>, F4<S>) {
    let g = F4::load(simd, &row.g);
    let twice = g + g;
    let pull = twice / (F4::splat(simd, 1.0) - g * g);
    let curve = F4::splat(simd, 2.0) + twice * pull;
    (F4::load(simd, &row.multiplier) * curve, mu * pull)
}

/// Weights of a row bounded in norm: of its dot products and of their squares in the matrix, and of the
/// right side.
#[inline(always)]
fn norm_weights<S: Four>(simd: S, row: &Norm, mu: F4<S>) -> [F4<S>; 3] {
    let slack = F4::splat(simd, 1.0) - F4::load(simd, &row.square);
    let twice = F4::splat(simd, 2.0) / slack;
    let flat = F4::load(simd, &row.multiplier) * 2.0;
    [flat, flat * twice, mu * twice]
}

impl<S: Four> NewtonBlock<S> {
    #[inline(always)]
    fn zero(simd: S) -> Self {
        let zero = F4::splat(simd, 0.0);
        Self {
            simd,
            aa: zero,
            ab: zero,
            ac: zero,
            bb: zero,
            bc: zero,
            cc: zero,
            ga: zero,
            gb: zero,
            gc: zero,
        }
    }

    /// The block as a function of the law `x` further to the left.
    #[inline(always)]
    fn moved(&self, x: F4<S>) -> Self {
        let (y, twice) = (x * x, x + x);
        let (aa, ab, ac) = (self.aa, self.ab, self.ac);
        let ab2 = twice * aa + ab;
        let ac2 = y * aa + x * ab + ac;
        let skew = y * ab + x * self.bb + self.bc;
        Self {
            ab: ab2,
            ac: ac2,
            bb: twice * (ab2 + ab) + self.bb,
            bc: twice * ac2 + skew,
            cc: y * (ac2 + ac) + x * (skew + self.bc) + self.cc,
            gb: twice * self.ga + self.gb,
            gc: y * self.ga + x * self.gb + self.gc,
            ..*self
        }
    }

    #[inline(always)]
    fn add(&mut self, other: &Self) {
        self.aa += other.aa;
        self.ab += other.ab;
        self.ac += other.ac;
        self.bb += other.bb;
        self.bc += other.bc;
        self.cc += other.cc;
        self.ga += other.ga;
        self.gb += other.gb;
        self.gc += other.gc;
    }

    /// Adds acceleration rows `[p, q]` with centring `mu`.
    #[inline(always)]
    fn accelerations(&mut self, lines: &[[Lane; 2]], rows: &[ConstraintRow], mu: F4<S>) {
        for (line, row) in lines.iter().zip(rows) {
            let (p, q) = (F4::load(self.simd, &line[0]), F4::load(self.simd, &line[1]));
            let (weight, force) = weigh(self.simd, row, mu);
            let (wp, wq) = (weight * p, weight * q);
            self.aa += wq * q;
            self.ab += wp * q;
            self.bb += wp * p;
            self.ga += force * q;
            self.gb += force * p;
        }
    }

    /// Adds jerk rows `[x, y, z]` as if they were `|x a + y b + z c| <= 1`.
    #[inline(always)]
    fn jerks(&mut self, lines: &[[Lane; 3]], rows: &[ConstraintRow], mu: F4<S>) {
        for (line, row) in lines.iter().zip(rows) {
            let [x, y, z] = lanes(self.simd, line);
            let (weight, force) = weigh(self.simd, row, mu);
            let (wx, wy) = (weight * x, weight * y);
            self.aa += wx * x;
            self.ab += wx * y;
            self.ac += wx * z;
            self.bb += wy * y;
            self.bc += wy * z;
            self.cc += weight * z * z;
            self.ga += force * x;
            self.gb += force * y;
            self.gc += force * z;
        }
    }

    /// The block of rows `sqrt(a) |x a + y b + z c| <= 1` from that of `|x a + y b + z c| <= 1`:
    /// the derivative of the former to `a` is `sqrt(a)` times `3/2 x + b/(2a) y + c/(2a) z`.
    #[inline(always)]
    fn rooted(&self, spot: Spots<S>) -> Self {
        let (a, root) = (spot.a, spot.a.sqrt());
        let half = F4::splat(self.simd, 0.5) / a;
        let row = [F4::splat(self.simd, 1.5), spot.b * half, spot.c * half];
        let [x, y, z] = self.times(row);
        Self {
            simd: self.simd,
            aa: a * dot(row, [x, y, z]),
            ab: a * y,
            ac: a * z,
            bb: a * self.bb,
            bc: a * self.bc,
            cc: a * self.cc,
            ga: root * dot(row, [self.ga, self.gb, self.gc]),
            gb: root * self.gb,
            gc: root * self.gc,
        }
    }

    /// Adds a jerk row bounded in norm, `line` its dot products, where the law is `law`: `sqrt(a)` times
    /// `a`, `b` and `c`.
    #[inline(always)]
    fn norm(&mut self, line: [F4<S>; 6], law: [F4<S>; 3], row: &Norm, mu: F4<S>) {
        let [ta, tb, tc] = times(line, law);
        let ([aa, ab, ac, bb, bc, cc], [flat, steep, force]) =
            (line, norm_weights(self.simd, row, mu));
        let (sa, sb, sc) = (steep * ta, steep * tb, steep * tc);
        self.aa += flat * aa + sa * ta;
        self.ab += flat * ab + sa * tb;
        self.ac += flat * ac + sa * tc;
        self.bb += flat * bb + sb * tb;
        self.bc += flat * bc + sb * tc;
        self.cc += flat * cc + sc * tc;
        self.ga += force * ta;
        self.gb += force * tb;
        self.gc += force * tc;
    }

    /// Adds the cap `cap a <= 1` and the time `weight / sqrt(a)`.
    #[inline(always)]
    fn value(&mut self, value: &[Lane; 2], row: &ConstraintRow, a: F4<S>, mu: F4<S>) {
        let (weight, cap) = (
            F4::load(self.simd, &value[0]),
            F4::load(self.simd, &value[1]),
        );
        let g = F4::load(self.simd, &row.g);
        let pull = cap / (F4::splat(self.simd, 1.0) - g);
        let slope = weight / (a * a.sqrt());
        self.aa += slope * 0.75 / a + F4::load(self.simd, &row.multiplier) * pull * cap;
        self.ga += mu * pull - slope * 0.5;
    }

    /// Adds a slot of values.
    #[inline(always)]
    fn values(&mut self, slot: Values<'_>, spot: Spots<S>, mu: F4<S>) {
        self.accelerations(slot.joints.0, slot.joints.1, mu);
        for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
            let line = lanes(self.simd, line);
            let [ta, tb] = times_two(line, [spot.a, spot.b]);
            let ([aa, ab, bb], [flat, steep, force]) = (line, norm_weights(self.simd, norm, mu));
            let (sa, sb) = (steep * ta, steep * tb);
            self.aa += flat * aa + sa * ta;
            self.ab += flat * ab + sa * tb;
            self.bb += flat * bb + sb * tb;
            self.ga += force * ta;
            self.gb += force * tb;
        }
    }

    /// The share of a jerk slot.
    #[inline(always)]
    fn of_jerks(slot: Jerks<'_>, spot: Spots<S>, mu: F4<S>) -> Self {
        let simd = spot.a.build();
        let mut share = Self::zero(simd);
        share.jerks(slot.joints.0, slot.joints.1, mu);
        let root = spot.a.sqrt();
        let law = [root * spot.a, root * spot.b, root * spot.c];
        for (line, norm) in slot.tools.0.iter().zip(slot.tools.1) {
            share.norm(lanes(simd, line), law, norm, mu);
        }
        share.rooted(spot)
    }

    /// Entries that the cells of a block add to the Newton system: six of the matrix over the
    /// unknowns of the cell, three of the right-hand side.
    #[inline(always)]
    fn entries(&self, basis: &Basis) -> [Lane; 9] {
        let lane = |x: &Lane| F4::load(self.simd, x);
        let (left, right, inverse) = (lane(&basis.left), lane(&basis.right), lane(&basis.inverse));
        let zero = F4::splat(self.simd, 0.0);
        let a = [lane(&basis.first), lane(&basis.second), zero];
        let b = [zero - left, left, zero];
        let c = [
            left * inverse,
            zero - (left + right) * inverse,
            right * inverse,
        ];
        let columns = [[a[0], b[0], c[0]], [a[1], b[1], c[1]], [a[2], b[2], c[2]]];
        let rows = [
            self.times(columns[0]),
            self.times(columns[1]),
            self.times(columns[2]),
        ];
        let force = [self.ga, self.gb, self.gc];
        [
            dot(rows[0], columns[0]).array(),
            dot(rows[0], columns[1]).array(),
            dot(rows[0], columns[2]).array(),
            dot(rows[1], columns[1]).array(),
            dot(rows[1], columns[2]).array(),
            dot(rows[2], columns[2]).array(),
            dot(force, columns[0]).array(),
            dot(force, columns[1]).array(),
            dot(force, columns[2]).array(),
        ]
    }

    /// The curvature times a column.
    #[inline(always)]
    fn times(&self, column: [F4<S>; 3]) -> [F4<S>; 3] {
        let matrix = [self.aa, self.ab, self.ac, self.bb, self.bc, self.cc];
        times(matrix, column)
    }
}

/// Fills the Newton system of the law `x` for the centring `mu`.
pub(super) struct AssembleNewton<'a> {
    pub problem: &'a Problem,
    pub x: &'a [f64],
    pub state: &'a mut State,
    pub mu: f64,
    pub matrix: &'a mut Band,
    pub step: &'a mut [f64],
}

impl Op for AssembleNewton<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        self.matrix.fill([0.0; 3]);
        self.step.fill(0.0);
        let mu = F4::splat(simd, self.mu);
        let (mut lines, blocks) = Lines::all(self.problem, self.state);
        for (i, (basis, value, cap)) in blocks.enumerate() {
            let left = Spots::left(simd, basis, &self.x[LANE * i..]);
            let width = F4::load(simd, &basis.width);
            let half = width * 0.5;
            let middle = left.moved(half);
            let (mut total, mut inner) = (NewtonBlock::zero(simd), NewtonBlock::zero(simd));
            total.value(&value[0], &cap[0], left.a, mu);
            inner.value(&value[1], &cap[1], middle.a, mu);
            total.values(lines.values(), left, mu);
            inner.values(lines.values(), middle, mu);
            for share in self.problem.jerk_shares(i) {
                let slot = lines.jerks();
                if *share == 0.0 {
                    total.add(&NewtonBlock::of_jerks(slot, left, mu));
                } else if *share == 0.5 {
                    inner.add(&NewtonBlock::of_jerks(slot, middle, mu));
                } else {
                    let x = width * *share;
                    total.add(&NewtonBlock::of_jerks(slot, left.moved(x), mu).moved(x));
                }
            }
            total.add(&inner.moved(half));
            scatter(&total.entries(basis), LANE * i, self.matrix, self.step);
        }
    }
}

/// Adds the entries of a block that begins with unknown `first` to the Newton system.
#[inline(always)]
fn scatter(entries: &[Lane; 9], first: usize, matrix: &mut [[f64; 3]], step: &mut [f64]) {
    let (Some(matrix), Some(step)) = (
        matrix[first..].first_chunk_mut::<{ LANE + 2 }>(),
        step[first..].first_chunk_mut::<{ LANE + 2 }>(),
    ) else {
        return;
    };
    let [m00, m01, m02, m11, m12, m22, f0, f1, f2] = entries;
    for l in 0..LANE {
        matrix[l][0] += m00[l];
        matrix[l][1] += m01[l];
        matrix[l][2] += m02[l];
        matrix[l + 1][0] += m11[l];
        matrix[l + 1][1] += m12[l];
        matrix[l + 2][0] += m22[l];
        step[l] -= f0[l];
        step[l + 1] -= f1[l];
        step[l + 2] -= f2[l];
    }
}

#[cfg(test)]
mod tests {
    use super::super::evaluate::{Evaluate, Multipliers, Turn};
    use super::super::law::swaying;
    use super::*;
    use simd::Build;

    /// Time and barrier of the law `x`; the right-hand side is their descent direction.
    fn barrier(problem: &Problem, x: &[f64], state: &mut State, mu: f64) -> f64 {
        let worth = Build::Plain.run(Evaluate { problem, x, state });
        let mut logs = 0.0;
        for row in state.acceleration.iter().chain(&state.jerk) {
            logs += row.g.iter().map(|g| (1.0 - g * g).ln()).sum::<f64>();
        }
        for row in state.cap.iter().flatten() {
            logs += row.g.iter().map(|g| (1.0 - g).ln()).sum::<f64>();
        }
        for norm in state.norm_acceleration.iter().chain(&state.norm_jerk) {
            for l in 0..LANE {
                logs += (1.0 - norm.square[l]).ln();
            }
        }
        worth.time - mu * logs
    }

    #[test]
    fn the_right_side_is_the_descent_of_time_and_barrier() {
        let problem = swaying(11);
        let (mut state, mu) = (State::new(&problem), 0.01);
        let mut x: Vec<f64> = (0..problem.unknowns())
            .map(|i| 0.04 + 0.004 * (i as f64).sin())
            .collect();
        barrier(&problem, &x, &mut state, mu);
        let turn = Turn::Balance(mu);
        let multipliers = &mut state;
        Build::Plain.run(Multipliers {
            state: multipliers,
            turn,
        });
        let mut matrix = vec![[0.0; 3]; x.len()];
        let mut step = vec![0.0; x.len()];
        Build::detect().run(AssembleNewton {
            problem: &problem,
            x: &x,
            state: &mut state,
            mu,
            matrix: &mut matrix,
            step: &mut step,
        });
        let most = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        for i in 0..problem.cells() + 2 {
            let (middle, h) = (x[i], 1e-6);
            let [more, less] = [h, -h].map(|h| {
                x[i] = middle + h;
                barrier(&problem, &x, &mut state, mu)
            });
            x[i] = middle;
            let slope = (more - less) / (2.0 * h);
            assert!(
                (slope + step[i]).abs() < 1e-6 * most,
                "{i}: {slope} {}",
                step[i]
            );
            assert!(matrix[i][0] > 0.0);
        }
    }
}
