//! The interior point method that makes a time law the fastest.
//!
//! Every iterate is feasible, so the search may stop at any time.
//!
//! # Source
//! Primal-dual interior point method for convex inequalities (Boyd and Vandenberghe, Convex
//! Optimization, 2004, section 11.7). A pair of bounds `|g| <= 1` is the one inequality
//! `g² - 1 <= 0`. The jerk row `g = sqrt(a) x` is not convex: it enters with the Gauss-Newton
//! part of its curvature, which is the convex inner approximation by its tangent.

use nalgebra::Vector3;

use super::band;
use super::lanes::{LANE, Lane, largest, sum};
use super::problem::{Problem, Spot};

/// A law under way, with the multipliers of its rows.
#[derive(Clone, Debug)]
pub(super) struct Interior<'a> {
    problem: &'a Problem,
    /// The unknowns: see [`Problem`].
    pub x: Vec<f64>,
    step: Vec<f64>,
    matrix: band::Band,
    acceleration: Vec<Row>,
    jerk: Vec<Row>,
    cap: Vec<[f64; 3]>,
    norm_acceleration: Vec<Norm>,
    norm_jerk: Vec<Norm>,
    /// Newton steps taken.
    pub iterations: usize,
}

/// Values `g`, multipliers and their steps of a group of rows.
#[derive(Clone, Copy, Debug)]
struct Row {
    g: Lane,
    multiplier: Lane,
    change: Lane,
}

/// Value, multiplier and its step of a row bounded in norm.
#[derive(Clone, Copy, Debug)]
struct Norm {
    g: Vector3<f64>,
    multiplier: f64,
    change: f64,
}

/// Gradient and curvature at a place, over `a`, `b`, `c` there.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    aa: f64,
    ab: f64,
    ac: f64,
    bb: f64,
    bc: f64,
    cc: f64,
    ga: f64,
    gb: f64,
    gc: f64,
}

/// How far a step may go: reciprocals of the largest factors.
#[derive(Clone, Copy, Debug, Default)]
struct Reach {
    primal: f64,
    dual: f64,
}

impl Share {
    /// The share as a function of the law `x` further to the left.
    fn moved(&self, x: f64) -> Self {
        let y = x * x;
        let (aa, ab, ac) = (self.aa, self.ab, self.ac);
        let ab2 = 2.0 * x * aa + ab;
        let ac2 = y * aa + x * ab + ac;
        Self {
            aa,
            ab: ab2,
            ac: ac2,
            bb: 2.0 * x * ab2 + 2.0 * x * ab + self.bb,
            bc: 2.0 * x * ac2 + y * ab + x * self.bb + self.bc,
            cc: y * ac2 + x * (y * ab + x * self.bb + self.bc) + (y * ac + x * self.bc + self.cc),
            ga: self.ga,
            gb: 2.0 * x * self.ga + self.gb,
            gc: y * self.ga + x * self.gb + self.gc,
        }
    }

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
    fn accelerations(&mut self, rows: &[[Lane; 2]], states: &[Row], mu: f64) {
        let mut lanes = [[0.0; LANE]; 5];
        for ([p, q], state) in rows.iter().zip(states) {
            for l in 0..LANE {
                let g = state.g[l];
                let inverse = 1.0 / (1.0 - g * g);
                let pull = 2.0 * g * inverse;
                let weight = state.multiplier[l] * (2.0 + 2.0 * g * pull);
                let force = mu * pull;
                let (wp, wq) = (weight * p[l], weight * q[l]);
                lanes[0][l] += wq * q[l];
                lanes[1][l] += wp * q[l];
                lanes[2][l] += wp * p[l];
                lanes[3][l] += force * q[l];
                lanes[4][l] += force * p[l];
            }
        }
        self.aa += sum(&lanes[0]);
        self.ab += sum(&lanes[1]);
        self.bb += sum(&lanes[2]);
        self.ga += sum(&lanes[3]);
        self.gb += sum(&lanes[4]);
    }

    /// Adds jerk rows `[x, y, z]` where the law is `a`.
    fn jerks(&mut self, rows: &[[Lane; 3]], states: &[Row], a: f64, mu: f64) {
        let root = a.sqrt();
        let half = 0.5 / a;
        let mut lanes = [[0.0; LANE]; 9];
        for ([x, y, z], state) in rows.iter().zip(states) {
            for l in 0..LANE {
                let g = state.g[l];
                let inverse = 1.0 / (1.0 - g * g);
                let pull = 2.0 * g * inverse;
                let weight = state.multiplier[l] * (2.0 + 2.0 * g * pull);
                let force = mu * pull;
                let (ra, rb, rc) = (root * x[l] + g * half, root * y[l], root * z[l]);
                let (wa, wb, wc) = (weight * ra, weight * rb, weight * rc);
                lanes[0][l] += wa * ra;
                lanes[1][l] += wa * rb;
                lanes[2][l] += wa * rc;
                lanes[3][l] += wb * rb;
                lanes[4][l] += wb * rc;
                lanes[5][l] += wc * rc;
                lanes[6][l] += force * ra;
                lanes[7][l] += force * rb;
                lanes[8][l] += force * rc;
            }
        }
        let [aa, ab, ac, bb, bc, cc, ga, gb, gc] = lanes.map(|lane| sum(&lane));
        self.add(&Self {
            aa,
            ab,
            ac,
            bb,
            bc,
            cc,
            ga,
            gb,
            gc,
        });
    }

    /// Adds a row bounded in norm, with the derivatives of its vector to `a`, `b`, `c`.
    fn norm(&mut self, [ra, rb, rc]: [Vector3<f64>; 3], state: &Norm, mu: f64) {
        let g = state.g;
        let inverse = 1.0 / (1.0 - g.norm_squared());
        let (ta, tb, tc) = (g.dot(&ra), g.dot(&rb), g.dot(&rc));
        let (flat, steep) = (2.0 * state.multiplier, 4.0 * state.multiplier * inverse);
        let force = 2.0 * mu * inverse;
        self.add(&Self {
            aa: flat * ra.norm_squared() + steep * ta * ta,
            ab: flat * ra.dot(&rb) + steep * ta * tb,
            ac: flat * ra.dot(&rc) + steep * ta * tc,
            bb: flat * rb.norm_squared() + steep * tb * tb,
            bc: flat * rb.dot(&rc) + steep * tb * tc,
            cc: flat * rc.norm_squared() + steep * tc * tc,
            ga: force * ta,
            gb: force * tb,
            gc: force * tc,
        });
    }

    /// Adds the cap `cap a <= 1` and the time `weight / sqrt(a)`.
    fn value(&mut self, a: f64, [weight, cap]: [f64; 2], state: &[f64; 3], mu: f64) {
        let [g, multiplier, _] = *state;
        let inverse = 1.0 / (1.0 - g);
        let slope = weight / (a * a.sqrt());
        self.aa += 0.75 * slope / a + multiplier * inverse * cap * cap;
        self.ga += mu * inverse * cap - 0.5 * slope;
    }
}

impl Reach {
    /// Takes in a group of rows that change by `dg`, and writes the step of their multipliers.
    #[inline(always)]
    fn rows(&mut self, state: &mut Row, dg: &Lane, mu: f64) {
        let (mut primal, mut dual) = ([0.0; LANE], [0.0; LANE]);
        for l in 0..LANE {
            let (g, d, m) = (state.g[l], dg[l], state.multiplier[l]);
            let inverse = 1.0 / (1.0 - g * g);
            let up = d * (1.0 + g);
            let down = -d * (1.0 - g);
            primal[l] = if up > down { up } else { down } * inverse;
            let change = (mu + 2.0 * m * g * d) * inverse - m;
            state.change[l] = change;
            dual[l] = -change / m;
        }
        self.primal = self.primal.max(largest(&primal));
        self.dual = self.dual.max(largest(&dual));
    }

    /// Takes in a row bounded in norm that changes by `dg`.
    fn norm(&mut self, state: &mut Norm, dg: Vector3<f64>, mu: f64) {
        let slack = 1.0 - state.g.norm_squared();
        let (half, square) = (state.g.dot(&dg), dg.norm_squared());
        // |g + t dg| = 1, for 1 / t: slack r² - 2 half r - square = 0.
        let ratio = (half + (half * half + slack * square).sqrt()) / slack;
        self.primal = self.primal.max(ratio);
        state.change = (mu + 2.0 * state.multiplier * half) / slack - state.multiplier;
        self.dual = self.dual.max(-state.change / state.multiplier);
    }

    /// Takes in a cap whose row changes by `dg`, and `a` that changes by `da`.
    fn value(&mut self, state: &mut [f64; 3], dg: f64, da_over_a: f64, mu: f64) {
        let [g, multiplier, _] = *state;
        let inverse = 1.0 / (1.0 - g);
        self.primal = self.primal.max(dg * inverse).max(-da_over_a);
        state[2] = (mu + multiplier * dg) * inverse - multiplier;
        self.dual = self.dual.max(-state[2] / multiplier);
    }
}

impl<'a> Interior<'a> {
    /// Starts from the law `x`, slowed down so that each row keeps a slack. With `moving` set the
    /// law cannot be slowed and has to be feasible already.
    pub(super) fn new(problem: &'a Problem, x: Vec<f64>) -> Self {
        let cells = problem.cells();
        let row = Row {
            g: [0.0; LANE],
            multiplier: [0.0; LANE],
            change: [0.0; LANE],
        };
        let norm = Norm {
            g: Vector3::zeros(),
            multiplier: 0.0,
            change: 0.0,
        };
        let mut interior = Self {
            problem,
            step: vec![0.0; x.len()],
            matrix: vec![[0.0; 3]; x.len()],
            x,
            acceleration: vec![row; problem.lanes * (2 * cells + 1)],
            jerk: vec![row; problem.jerk.len()],
            cap: vec![[0.0; 3]; 2 * cells + 1],
            norm_acceleration: vec![norm; problem.norm_acceleration.len()],
            norm_jerk: vec![norm; problem.norm_jerk.len()],
            iterations: 0,
        };
        interior.slow_down();
        interior
    }

    /// The law at the left end of cell `k`.
    fn spot(&self, k: usize) -> Spot {
        self.problem.spot(k, &self.x)
    }

    /// Rows in all.
    fn rows(&self) -> usize {
        LANE * (self.acceleration.len() + self.jerk.len())
            + self.cap.len()
            + self.norm_acceleration.len()
            + self.norm_jerk.len()
    }

    /// Computes the value of every row. Returns the largest squared ratio of rows that shrink like
    /// `a`, and of jerk rows; infinite when `a` is not positive somewhere.
    fn evaluate(&mut self) -> (f64, f64) {
        let (mut flat, mut steep) = (0.0_f64, 0.0_f64);
        let cells = self.problem.cells();
        for k in 0..cells {
            let (left, h) = (self.spot(k), self.problem.widths[k]);
            let (middle, right) = (left.moved(0.5 * h), left.moved(h));
            if !(left.a > 0.0 && middle.a > 0.0 && right.a > 0.0) {
                return (f64::INFINITY, f64::INFINITY);
            }
            flat = flat.max(self.evaluate_values(2 * k, left));
            flat = flat.max(self.evaluate_values(2 * k + 1, middle));
            let problem = self.problem;
            for (i, x) in problem.jerk_spots(k) {
                steep = steep.max(self.evaluate_jerks(i, left.moved(x)));
            }
            if k + 1 == cells {
                flat = flat.max(self.evaluate_values(2 * cells, right));
            }
        }
        (flat, steep)
    }

    /// The rows at location `i` that do not know the jerk.
    fn evaluate_values(&mut self, i: usize, spot: Spot) -> f64 {
        let width = self.problem.lanes;
        let range = i * width..(i + 1) * width;
        let mut most = [0.0; LANE];
        let rows = self.problem.acceleration[range.clone()].iter();
        for ([p, q], state) in rows.zip(&mut self.acceleration[range]) {
            for l in 0..LANE {
                let g = p[l] * spot.b + q[l] * spot.a;
                state.g[l] = g;
                most[l] = if g * g > most[l] { g * g } else { most[l] };
            }
        }
        let cap = self.problem.cap[i] * spot.a;
        self.cap[i][0] = cap;
        let mut most = largest(&most).max(cap * cap);
        let width = self.problem.norm_accelerations();
        let range = i * width..(i + 1) * width;
        let rows = self.problem.norm_acceleration[range.clone()].iter();
        for ([p, q], state) in rows.zip(&mut self.norm_acceleration[range]) {
            state.g = p * spot.b + q * spot.a;
            most = most.max(state.g.norm_squared());
        }
        most
    }

    /// The rows at jerk place `i`.
    fn evaluate_jerks(&mut self, i: usize, spot: Spot) -> f64 {
        let root = spot.a.sqrt();
        let width = self.problem.lanes;
        let range = i * width..(i + 1) * width;
        let mut most = [0.0; LANE];
        let rows = self.problem.jerk[range.clone()].iter();
        for ([x, y, z], state) in rows.zip(&mut self.jerk[range]) {
            for l in 0..LANE {
                let g = root * (x[l] * spot.a + y[l] * spot.b + z[l] * spot.c);
                state.g[l] = g;
                most[l] = if g * g > most[l] { g * g } else { most[l] };
            }
        }
        let mut most = largest(&most);
        let width = self.problem.norm_jerks();
        let range = i * width..(i + 1) * width;
        let rows = self.problem.norm_jerk[range.clone()].iter();
        for ([x, y, z], state) in rows.zip(&mut self.norm_jerk[range]) {
            state.g = (x * spot.a + y * spot.b + z * spot.c) * root;
            most = most.max(state.g.norm_squared());
        }
        most
    }

    /// Scales the law so that the nearest row keeps a slack, then sets the values of all rows.
    fn slow_down(&mut self) {
        let (flat, steep) = self.evaluate();
        let worst = flat.sqrt().max(steep.cbrt());
        if !self.problem.moving && worst.is_finite() && worst > 0.0 {
            let factor = 0.75 / worst;
            self.x.iter_mut().for_each(|x| *x *= factor);
            self.evaluate();
        }
    }

    /// Whether every row of the law has a slack.
    fn feasible(&mut self) -> bool {
        let (flat, steep) = self.evaluate();
        flat < 1.0 && steep < 1.0
    }

    /// Improves the law until the relative gap of its duration is below `gap`, at most `most`
    /// Newton steps. `first` is the relative gap that the start is taken to have.
    pub(super) fn solve(&mut self, gap: f64, first: f64, most: usize) {
        let mut time = self.problem.time(&self.x);
        let count = self.rows() as f64;
        let mut mu = first * time / count;
        self.start_multipliers(mu);
        let mut sigma = 0.3;
        for _ in 0..most {
            self.assemble(sigma * mu);
            band::solve(&mut self.matrix, &mut self.step);
            let reach = self.measure(sigma * mu);
            let dual = (0.95 / reach.dual).min(1.0);
            let Some(primal) = self.advance((0.95 / reach.primal).min(1.0)) else {
                break;
            };
            self.advance_multipliers(dual);
            self.iterations += 1;
            let before = time;
            time = self.problem.time(&self.x);
            let total = self.complementarity();
            mu = total / count;
            let best = primal.min(dual);
            if total < gap * time && best > 0.5 && (before - time).abs() < gap * time {
                break;
            }
            sigma = (1.0 - best).powi(2).clamp(0.06, 0.7);
        }
    }

    /// Goes towards the middle of what is feasible, `steps` Newton steps, without regard to time.
    pub(super) fn center(&mut self, steps: usize) {
        let mu = 100.0 * self.problem.time(&self.x) / self.rows() as f64;
        self.start_multipliers(mu);
        for _ in 0..steps {
            self.assemble(mu);
            band::solve(&mut self.matrix, &mut self.step);
            let reach = self.measure(mu);
            if self.advance((0.9 / reach.primal).min(1.0)).is_none() {
                break;
            }
            self.advance_multipliers((0.9 / reach.dual).min(1.0));
            self.iterations += 1;
        }
    }

    /// The largest ratio of any row to its limit.
    pub(super) fn worst(&mut self) -> f64 {
        let (flat, steep) = self.evaluate();
        flat.max(steep).sqrt()
    }

    /// Multipliers in balance with the slacks.
    fn start_multipliers(&mut self, mu: f64) {
        for row in self.acceleration.iter_mut().chain(&mut self.jerk) {
            for l in 0..LANE {
                row.multiplier[l] = mu / (1.0 - row.g[l] * row.g[l]);
            }
        }
        for cap in &mut self.cap {
            cap[1] = mu / (1.0 - cap[0]);
        }
        for row in self.norm_acceleration.iter_mut().chain(&mut self.norm_jerk) {
            row.multiplier = mu / (1.0 - row.g.norm_squared());
        }
    }

    /// The sum of multiplier times slack.
    fn complementarity(&self) -> f64 {
        let mut lanes = [0.0; LANE];
        for row in self.acceleration.iter().chain(&self.jerk) {
            for l in 0..LANE {
                lanes[l] += row.multiplier[l] * (1.0 - row.g[l] * row.g[l]);
            }
        }
        let caps: f64 = self.cap.iter().map(|cap| cap[1] * (1.0 - cap[0])).sum();
        let norms = self.norm_acceleration.iter().chain(&self.norm_jerk);
        let norms: f64 = norms
            .map(|row| row.multiplier * (1.0 - row.g.norm_squared()))
            .sum();
        sum(&lanes) + caps + norms
    }

    /// The share of location `i` without its jerk rows.
    fn share(&self, i: usize, spot: Spot, mu: f64) -> Share {
        let problem = self.problem;
        let mut share = Share::default();
        share.value(
            spot.a,
            [problem.weight(i), problem.cap[i]],
            &self.cap[i],
            mu,
        );
        let range = i * problem.lanes..(i + 1) * problem.lanes;
        let rows = &problem.acceleration[range.clone()];
        share.accelerations(rows, &self.acceleration[range], mu);
        let width = problem.norm_accelerations();
        for j in i * width..(i + 1) * width {
            let [p, q] = problem.norm_acceleration[j];
            share.norm([q, p, Vector3::zeros()], &self.norm_acceleration[j], mu);
        }
        share
    }

    /// The share of the rows at jerk place `i`.
    fn share_jerks(&self, i: usize, a: f64, mu: f64) -> Share {
        let mut share = Share::default();
        let problem = self.problem;
        let range = i * problem.lanes..(i + 1) * problem.lanes;
        share.jerks(&problem.jerk[range.clone()], &self.jerk[range], a, mu);
        let (width, root) = (problem.norm_jerks(), a.sqrt());
        for j in i * width..(i + 1) * width {
            let [x, y, z] = problem.norm_jerk[j];
            let state = &self.norm_jerk[j];
            share.norm(
                [x * root + state.g * (0.5 / a), y * root, z * root],
                state,
                mu,
            );
        }
        share
    }

    /// Fills the Newton system.
    fn assemble(&mut self, mu: f64) {
        self.matrix.fill([0.0; 3]);
        self.step.fill(0.0);
        let cells = self.problem.cells();
        for k in 0..cells {
            let (left, h) = (self.spot(k), self.problem.widths[k]);
            let (middle, right) = (left.moved(0.5 * h), left.moved(h));
            let mut total = self.share(2 * k, left, mu);
            total.add(&self.share(2 * k + 1, middle, mu).moved(0.5 * h));
            for (i, x) in self.problem.jerk_spots(k) {
                total.add(&self.share_jerks(i, left.moved(x).a, mu).moved(x));
            }
            if k + 1 == cells {
                total.add(&self.share(2 * cells, right, mu).moved(h));
            }
            self.scatter(k, &total);
        }
        if self.problem.moving {
            self.matrix[0] = [1.0, 0.0, 0.0];
            self.matrix[1] = [1.0, 0.0, 0.0];
            self.step[0] = 0.0;
            self.step[1] = 0.0;
        }
    }

    /// Adds the share of cell `k` to the Newton system.
    fn scatter(&mut self, k: usize, s: &Share) {
        let [a, b, c] = self.problem.basis(k);
        for i in 0..3 {
            let ha = s.aa * a[i] + s.ab * b[i] + s.ac * c[i];
            let hb = s.ab * a[i] + s.bb * b[i] + s.bc * c[i];
            let hc = s.ac * a[i] + s.bc * b[i] + s.cc * c[i];
            for j in i..3 {
                self.matrix[k + i][j - i] += ha * a[j] + hb * b[j] + hc * c[j];
            }
            self.step[k + i] -= s.ga * a[i] + s.gb * b[i] + s.gc * c[i];
        }
    }

    /// How far the step may go; also computes the steps of the multipliers.
    fn measure(&mut self, mu: f64) -> Reach {
        let mut reach = Reach {
            primal: 1e-9,
            dual: 1e-9,
        };
        let cells = self.problem.cells();
        for k in 0..cells {
            let h = self.problem.widths[k];
            let (left, change) = (self.spot(k), self.problem.spot(k, &self.step));
            let (middle, right) = (left.moved(0.5 * h), left.moved(h));
            self.measure_values(&mut reach, 2 * k, (left.a, change), mu);
            self.measure_values(&mut reach, 2 * k + 1, (middle.a, change.moved(0.5 * h)), mu);
            let problem = self.problem;
            for (i, x) in problem.jerk_spots(k) {
                self.measure_jerks(&mut reach, i, (left.moved(x).a, change.moved(x)), mu);
            }
            if k + 1 == cells {
                self.measure_values(&mut reach, 2 * cells, (right.a, change.moved(h)), mu);
            }
        }
        reach
    }

    /// The rows at location `i` without jerk.
    fn measure_values(&mut self, reach: &mut Reach, i: usize, (a, d): (f64, Spot), mu: f64) {
        let problem = self.problem;
        reach.value(&mut self.cap[i], problem.cap[i] * d.a, d.a / a, mu);
        let range = i * problem.lanes..(i + 1) * problem.lanes;
        let rows = problem.acceleration[range.clone()].iter();
        for ([p, q], state) in rows.zip(&mut self.acceleration[range]) {
            let mut dg = [0.0; LANE];
            for l in 0..LANE {
                dg[l] = p[l] * d.b + q[l] * d.a;
            }
            reach.rows(state, &dg, mu);
        }
        let width = problem.norm_accelerations();
        for j in i * width..(i + 1) * width {
            let [p, q] = problem.norm_acceleration[j];
            reach.norm(&mut self.norm_acceleration[j], p * d.b + q * d.a, mu);
        }
    }

    /// The rows at jerk place `i`, by their tangents.
    fn measure_jerks(&mut self, reach: &mut Reach, i: usize, (a, d): (f64, Spot), mu: f64) {
        let problem = self.problem;
        let (root, half) = (a.sqrt(), 0.5 * d.a / a);
        let range = i * problem.lanes..(i + 1) * problem.lanes;
        let rows = problem.jerk[range.clone()].iter();
        for ([x, y, z], state) in rows.zip(&mut self.jerk[range]) {
            let mut dg = [0.0; LANE];
            for l in 0..LANE {
                dg[l] = root * (x[l] * d.a + y[l] * d.b + z[l] * d.c) + half * state.g[l];
            }
            reach.rows(state, &dg, mu);
        }
        let width = problem.norm_jerks();
        for j in i * width..(i + 1) * width {
            let [x, y, z] = problem.norm_jerk[j];
            let state = &mut self.norm_jerk[j];
            let dg = (x * d.a + y * d.b + z * d.c) * root + state.g * half;
            reach.norm(state, dg, mu);
        }
    }

    /// Goes `factor` of the step, less where a jerk row bends into the way. `None` when no part of
    /// it is possible; the law then stays as it was.
    fn advance(&mut self, factor: f64) -> Option<f64> {
        let before = self.x.clone();
        let mut factor = factor;
        for _ in 0..30 {
            for ((x, old), step) in self.x.iter_mut().zip(&before).zip(&self.step) {
                *x = old + factor * step;
            }
            if self.feasible() {
                return Some(factor);
            }
            factor *= 0.7;
        }
        self.x = before;
        self.evaluate();
        None
    }

    /// Goes `factor` of the steps of the multipliers.
    fn advance_multipliers(&mut self, factor: f64) {
        for row in self.acceleration.iter_mut().chain(&mut self.jerk) {
            for l in 0..LANE {
                row.multiplier[l] += factor * row.change[l];
            }
        }
        for cap in &mut self.cap {
            cap[1] += factor * cap[2];
        }
        for row in self.norm_acceleration.iter_mut().chain(&mut self.norm_jerk) {
            row.multiplier += factor * row.change;
        }
    }
}
