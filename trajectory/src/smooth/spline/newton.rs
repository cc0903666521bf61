//! Barrier value, gradient and Hessian of an iterate, and the Newton step.

use super::ball::Ball;
use super::band::Band;
use super::basis::{FIRST, SECOND, THIRD};
use super::iterate::{Iterate, Sum, outer};
use super::passes::Passes;
use super::problem::{Point, Problem, Room, sample_weights, square};
use simd::{Build, Four, Op, V4};

/// Gradient and Hessian of the barrier: a band for the control points, one
/// border column for `z`. `B` is `5 D` and the spare diagonals of [`Band`]; or `5 * 3` of them, where
/// position and orientation stand apart, coupled only by [`Passes`].
pub(crate) struct System<const D: usize, const B: usize> {
    pub(super) band: Band<B>,
    /// Columns of the blocks that limits and corridors add to the band, by group, row and distance from
    /// the diagonal. In the band they would overlap in memory, and each sum would wait for the one before.
    blocks: Vec<[V4; 3]>,
    /// Gradient and border, side by side.
    pub(super) sides: Vec<[f64; 2]>,
    pub(super) gradient_z: f64,
    pub(super) hessian_z: f64,
    pub(super) passes: Passes,
    /// The balls of the iterate.
    pub(super) around: Vec<Ball<D>>,
}

/// A direction in control points and `z`, and the fall of the barrier along it.
pub(crate) struct Step {
    pub(crate) control: Vec<f64>,
    pub(crate) z: f64,
    /// By how much each passing time moves, in knots.
    pub(crate) times: Vec<f64>,
    /// Square of the Newton decrement.
    pub(crate) decrement: f64,
}

/// Fraction of each slack that a step must leave: an iterate too close to a constraint then moves
/// only slowly along it, since norms are curved.
pub(crate) const KEEP: f64 = 0.02;

/// Product of slacks, as shares of their bounds, with rare logarithms.
struct Slacks<'a> {
    product: f64,
    sum: f64,
    /// Slacks before the step; none when empty.
    before: &'a [f64],
    /// Share of each that has to be left.
    keep: f64,
    seen: &'a mut Vec<f64>,
}

impl Slacks<'_> {
    /// Adds the slack of `square <= bound`; false if too little is left.
    fn take(&mut self, square: f64, bound: f64) -> bool {
        let slack = 1.0 - square / bound;
        let least = self
            .before
            .get(self.seen.len())
            .map_or(0.0, |s| self.keep * s);
        if slack <= least || slack.is_nan() {
            return false;
        }
        self.seen.push(slack);
        self.product *= slack;
        if !(1e-200..1e200).contains(&self.product) {
            self.sum += self.product.ln();
            self.product = 1.0;
        }
        true
    }
}

/// The barrier at an iterate, without the share of the weight.
#[derive(Clone, Debug)]
pub(crate) struct Seen {
    rest: f64,
    /// All slacks, as shares of their bounds.
    pub(crate) slacks: Vec<f64>,
}

/// The barrier with a weight on `z`.
#[derive(Clone, Copy)]
pub(crate) struct Barrier<'a, const D: usize> {
    pub(crate) problem: &'a Problem<D>,
    pub(crate) room: &'a Room,
    pub(crate) weight: f64,
    /// Share of each slack that a step must leave.
    pub(crate) keep: f64,
}

impl<const D: usize> Barrier<'_, D> {
    /// Value at an iterate.
    pub(crate) fn value(&self, point: &Point<D>, seen: &Seen) -> f64 {
        self.weight * point.z + seen.rest
    }

    /// The value without the weight's share, and the slacks; `None` outside of the domain, and if a slack
    /// is only a small fraction of its value `before`.
    pub(crate) fn look(&self, point: &Point<D>, before: &[f64]) -> Option<Seen> {
        let mut slacks = Vec::with_capacity(before.len());
        let rest = self.rest(point, before, &mut slacks)?;
        Some(Seen { rest, slacks })
    }

    fn rest(&self, point: &Point<D>, before: &[f64], seen: &mut Vec<f64>) -> Option<f64> {
        seen.clear();
        let mut slacks = Slacks {
            product: 1.0,
            sum: 0.0,
            before,
            keep: self.keep,
            seen,
        };
        let mut bounds = 0.0;
        let heavy = self.problem.heavy(point);
        for g in 0..Problem::<D>::GROUPS {
            bounds += self.limits(point, g, &mut slacks)?;
            let balls = &self.room.balls[g];
            for (i, radius) in balls.iter().enumerate() {
                let miss = super::project::miss(self.problem, point, i, g);
                if !slacks.take(miss * miss, radius * radius) {
                    return None;
                }
                if heavy > 1.0 {
                    slacks.sum += (heavy - 1.0) * slacks.seen[slacks.seen.len() - 1].ln();
                }
            }
            if self.problem.groups[g].width.is_finite() {
                for k in 0..point.samples() {
                    let place = point.sample(k, g);
                    let away = self.problem.nearest(&place, self.room.legs[k], g).offset;
                    if !slacks.take(square(&away), self.room.widths[g][k].powi(2)) {
                        return None;
                    }
                }
            }
        }
        Some(-bounds - slacks.sum - slacks.product.ln())
    }

    /// Adds the slacks of speed, acceleration and jerk; returns the sum of the logarithms of their
    /// bounds, which depend on `z`.
    fn limits(&self, point: &Point<D>, g: usize, slacks: &mut Slacks<'_>) -> Option<f64> {
        let caps = [1, 2, 3].map(|k| self.problem.cap(g, k, point.z, self.room)[0].powi(2));
        let last = point.control.len() - 1;
        for k in 0..last {
            let mut ok = slacks.take(square(&point.sum(k, &FIRST, g)), caps[0]);
            if k + 2 <= last {
                ok &= slacks.take(square(&point.sum(k, &SECOND, g)), caps[1]);
            }
            if k + 3 <= last {
                ok &= slacks.take(square(&point.sum(k, &THIRD, g)), caps[2]);
            }
            if !ok {
                return None;
            }
        }
        let count = [last, last.saturating_sub(1), last.saturating_sub(2)];
        Some((0..3).map(|k| count[k] as f64 * caps[k].ln()).sum())
    }
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Whether the groups stand one behind the other in the band.
    pub(super) const APART: bool = B < 5 * D;
    /// Rows from one control point to the next.
    pub(super) const STRIDE: usize = if Self::APART { 3 } else { D };

    /// Room for an iterate with its control points.
    pub(crate) fn new(point: &Point<D>) -> Self {
        let size = D * point.control.len().saturating_sub(8);
        let times = if Self::APART {
            point.crossings.len()
        } else {
            0
        };
        Self {
            band: Band::zeros(size),
            blocks: vec![NO_BLOCK; WIDE * size / 3],
            sides: vec![[0.0; 2]; size],
            gradient_z: 0.0,
            hessian_z: 0.0,
            passes: Passes::new(times, size, B),
            around: Vec::with_capacity(point.crossings.len()),
        }
    }

    /// The row of the first coordinate of group `g` of the free control point `k`, of `free` in all.
    #[inline(always)]
    pub(super) fn row(free: usize, k: usize, g: usize) -> usize {
        if Self::APART {
            3 * (g * free + k)
        } else {
            k * D + 3 * g
        }
    }

    /// The Newton step of the barrier with weight `t` on `z`.
    pub(crate) fn step(
        &mut self,
        problem: &Problem<D>,
        point: &Point<D>,
        room: &Room,
        t: f64,
    ) -> Option<Step> {
        self.band.clear();
        self.blocks.fill(NO_BLOCK);
        self.sides.fill([0.0; 2]);
        (self.gradient_z, self.hessian_z) = (t, 0.0);
        let at = Iterate {
            problem,
            point,
            room,
            pinned: problem.pinned(point.z),
            slides: problem.slides(point),
        };
        Build::detect().run(Norms {
            system: self,
            at: &at,
        });
        self.place_blocks();
        self.balls(&at);
        self.solve(&at.slides)
    }

    fn solve(&mut self, slides: &[[f64; D]]) -> Option<Step> {
        if !self.band.factor() {
            return None;
        }
        let size = self.sides.len();
        let [mut along, mut border] = [0, 1].map(|m| {
            let values = self.sides.iter().map(|side| side[m]);
            values.chain([0.0; B]).collect::<Vec<_>>()
        });
        self.band.lower([&mut along, &mut border], 0..size);
        let eliminated = self.passes.eliminate(&self.band, [&along, &border])?;
        let pivot = self.hessian_z - eliminated.bent;
        if pivot <= 0.0 || pivot.is_nan() {
            return None;
        }
        let z = -(self.gradient_z - eliminated.cross) / pivot;
        for (step, border) in along[..size].iter_mut().zip(&border) {
            *step = -*step - border * z;
        }
        self.passes.take(&eliminated, z, &mut along[..size]);
        self.band.upper(&mut along);
        let falls = self.sides.iter().zip(&along);
        let falls: f64 = falls.map(|(side, step)| side[0] * step).sum();
        let free = size / D;
        let entry = |i: usize| along[Self::row(free, i / D, i % D / 3) + i % 3];
        let mut control: Vec<f64> = (0..size).map(entry).collect();
        for (step, slide) in control.iter_mut().zip(slides.iter().skip(4).flatten()) {
            *step += slide * z;
        }
        let times: Vec<f64> = self.around.iter().map(|ball| ball.time(&control)).collect();
        let passes = self.around.iter().zip(&times);
        let passing: f64 = passes.map(|(ball, time)| ball.slope() * time).sum();
        let slope = self.gradient_z * z + falls + passing;
        (slope < 0.0 && slope.is_finite()).then_some(Step {
            control,
            z,
            times,
            decrement: -slope,
        })
    }

    /// Speed, acceleration and jerk of one group.
    #[inline(always)]
    fn limits<S: Four>(&mut self, simd: S, at: &Iterate<'_, D>, g: usize) {
        let last = at.point.control.len() - 1;
        let caps = [1, 2, 3].map(|k| at.problem.cap(g, k, at.point.z, at.room));
        for k in 0..last {
            self.norm(simd, at, &Sum::new(k, &FIRST, g), &caps[0]);
            if k + 2 <= last {
                self.norm(simd, at, &Sum::new(k, &SECOND, g), &caps[1]);
            }
            if k + 3 <= last {
                self.norm(simd, at, &Sum::new(k, &THIRD, g), &caps[2]);
            }
        }
    }

    /// One term `-log(R(z)^2 - |y|^2)`, `y` a difference of control points.
    #[inline(always)]
    fn norm<S: Four, const M: usize>(
        &mut self,
        simd: S,
        at: &Iterate<'_, D>,
        sum: &Sum<'_, M>,
        [r, r1, r2]: &[f64; 3],
    ) {
        let Sum { first, w, g } = *sum;
        let y = at.point.sum(first, w, g);
        let slack = 1.0 / (r * r - square(&y));
        let gradient = y.map(|x| 2.0 * x * slack);
        let hessian = outer(&y, 2.0 * slack, 4.0 * slack * slack);
        let cross = -4.0 * r * r1 * slack * slack;
        let mut border = y.map(|x| x * cross);
        self.gradient_z -= 2.0 * r * r1 * slack;
        self.hessian_z += -2.0 * (r1 * r1 + r * r2) * slack + (2.0 * r * r1 * slack).powi(2);
        if let Some(slide) = at.slide(sum) {
            for d in 0..3 {
                let bent: f64 = (0..3).map(|e| hessian[d][e] * slide[e]).sum();
                self.gradient_z += gradient[d] * slide[d];
                self.hessian_z += slide[d] * (2.0 * border[d] + bent);
                border[d] += bent;
            }
        }
        self.add(simd, sum, [&gradient, &border], &hessian);
    }

    /// Corridor samples of one group.
    #[inline(always)]
    fn corridor<S: Four>(&mut self, simd: S, at: &Iterate<'_, D>, g: usize) {
        let (problem, point, room) = (at.problem, at.point, at.room);
        for k in 0..point.samples() {
            let foot = problem.nearest(&point.sample(k, g), room.legs[k], g);
            let (y, slide) = (foot.offset, problem.slide(&foot, g));
            let width = room.widths[g][k];
            let slack = 1.0 / (width * width - square(&y));
            let gradient = y.map(|x| 2.0 * x * slack);
            let mut hessian = outer(&y, 2.0 * slack, 4.0 * slack * slack);
            for a in 0..3 {
                for b in 0..3 {
                    hessian[a][b] -= 2.0 * slack * slide[a] * slide[b];
                }
            }
            let (first, w) = sample_weights(k);
            let sum = Sum::new(first, w, g);
            let mut border = [0.0; 3];
            if !at.slides.is_empty()
                && let Some(slide) = at.slide(&sum)
            {
                for d in 0..3 {
                    border[d] = (0..3).map(|e| hessian[d][e] * slide[e]).sum();
                    self.gradient_z += gradient[d] * slide[d];
                    self.hessian_z += slide[d] * border[d];
                }
            }
            self.add(simd, &sum, [&gradient, &border], &hessian);
        }
    }

    /// Adds a term in the weighted sum of consecutive control points.
    #[inline(always)]
    fn add<S: Four, const M: usize>(
        &mut self,
        simd: S,
        sum: &Sum<'_, M>,
        [gradient, border]: [&[f64; 3]; 2],
        h: &[[f64; 3]; 3],
    ) {
        let Sum { first, w, g } = *sum;
        let columns = [0, 1, 2].map(|b| simd.load(&[h[b][0], h[b][1], h[b][2], 0.0]));
        let free = self.sides.len() / D;
        for i in 0..M {
            if first + i < 4 || first + i - 4 >= free || w[i] == 0.0 {
                continue;
            }
            let k = first + i - 4;
            let row = Self::row(free, k, g);
            for d in 0..3 {
                self.sides[row + d][0] += w[i] * gradient[d];
                self.sides[row + d][1] += w[i] * border[d];
            }
            let blocks = &mut self.blocks[(g * free + k) * WIDE..][..WIDE];
            for j in (0..=i).filter(|j| first + j >= 4) {
                let both = simd.splat(w[i] * w[j]);
                for (to, column) in blocks[i - j].iter_mut().zip(columns) {
                    let sum = simd.add(simd.load(&to.0), simd.mul(both, column));
                    simd.store(sum, &mut to.0);
                }
            }
        }
    }

    /// Writes the blocks into the band.
    fn place_blocks(&mut self) {
        let free = self.sides.len() / D;
        let mut rows = self.blocks.chunks_exact(WIDE);
        for g in 0..Problem::<D>::GROUPS {
            for (k, blocks) in rows.by_ref().take(free).enumerate() {
                for (back, block) in blocks[..WIDE.min(k + 1)].iter().enumerate() {
                    let row = Self::row(free, k - back, g);
                    for (b, column) in self.band.columns[row..row + 3].iter_mut().enumerate() {
                        let above = if back == 0 { b } else { 0 };
                        for a in above..3 {
                            column[back * Self::STRIDE + a - b] = block[b].0[a];
                        }
                    }
                }
            }
        }
    }
}

/// Blocks in a row of the band, the diagonal with them.
const WIDE: usize = 5;

/// A block of zeros.
const NO_BLOCK: [V4; 3] = [V4([0.0; 4]); 3];

/// The terms of limits and corridors of a system.
struct Norms<'a, const D: usize, const B: usize> {
    system: &'a mut System<D, B>,
    at: &'a Iterate<'a, D>,
}

impl<const D: usize, const B: usize> Op for Norms<'_, D, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Four>(self, simd: S) {
        for g in 0..Problem::<D>::GROUPS {
            self.system.limits(simd, self.at, g);
            if self.at.problem.groups[g].width.is_finite() {
                self.system.corridor(simd, self.at, g);
            }
        }
    }
}
