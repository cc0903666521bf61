//! Barrier value, gradient and Hessian of an iterate, and the Newton step.

use super::band::Band;
use super::basis::{FIRST, SECOND, THIRD, weights};
use super::problem::{Point, Problem, Room, part, sample_weights, square};
use simd::{Build, Four, Op};

/// Gradient and Hessian of the barrier: a band for the control points, one
/// border column for `z`. `B` is `5 D` and the spare diagonals of [`Band`].
pub(crate) struct System<const D: usize, const B: usize> {
    band: Band<B>,
    /// Gradient and border, side by side.
    sides: Vec<[f64; 2]>,
    gradient_z: f64,
    hessian_z: f64,
}

/// A direction in control points and `z`, and the fall of the barrier along it.
pub(crate) struct Step {
    pub(crate) control: Vec<f64>,
    pub(crate) z: f64,
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
    /// Value at an iterate, and its slacks in `seen`; `None` outside of the domain, and if a slack
    /// is only a small fraction of its value `before`.
    pub(crate) fn value(
        &self,
        point: &Point<D>,
        before: &[f64],
        seen: &mut Vec<f64>,
    ) -> Option<f64> {
        seen.clear();
        let mut slacks = Slacks {
            product: 1.0,
            sum: 0.0,
            before,
            keep: self.keep,
            seen,
        };
        let mut bounds = 0.0;
        for g in 0..Problem::<D>::GROUPS {
            bounds += self.limits(point, g, &mut slacks)?;
            let balls = &self.room.balls[g];
            for (i, radius) in balls.iter().enumerate() {
                let miss = super::project::miss(self.problem, point, i, g);
                if !slacks.take(miss * miss, radius * radius) {
                    return None;
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
        Some(self.weight * point.z - bounds - slacks.sum - slacks.product.ln())
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
    /// Room for an iterate of `knots` control points.
    pub(crate) fn new(knots: usize) -> Self {
        let size = D * knots.saturating_sub(8);
        Self {
            band: Band::zeros(size),
            sides: vec![[0.0; 2]; size],
            gradient_z: 0.0,
            hessian_z: 0.0,
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
        self.balls(&at);
        self.solve(&at.slides)
    }

    fn solve(&mut self, slides: &[[f64; D]]) -> Option<Step> {
        if !self.band.factor() {
            return None;
        }
        let [mut along, mut border] = [0, 1].map(|m| {
            let values = self.sides.iter().map(|side| side[m]);
            values.chain([0.0; B]).collect::<Vec<_>>()
        });
        self.band.solve([&mut along, &mut border]);
        let solved = self.sides.iter().zip(along.iter().zip(&border));
        let (mut cross, mut bent) = (0.0, 0.0);
        for (side, (along, border)) in solved.clone() {
            cross += side[1] * along;
            bent += side[1] * border;
        }
        let pivot = self.hessian_z - bent;
        if pivot <= 0.0 || pivot.is_nan() {
            return None;
        }
        let z = -(self.gradient_z - cross) / pivot;
        let mut slope = self.gradient_z * z;
        let mut control = Vec::with_capacity(self.sides.len());
        for (side, (along, border)) in solved {
            let step = -along - border * z;
            slope += side[0] * step;
            control.push(step);
        }
        for (step, slide) in control.iter_mut().zip(slides.iter().skip(4).flatten()) {
            *step += slide * z;
        }
        (slope < 0.0 && slope.is_finite()).then_some(Step {
            control,
            z,
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
        // Columns of the symmetric block, whole and from the diagonal on.
        let whole = [0, 1, 2].map(|b| simd.load(&[h[b][0], h[b][1], h[b][2], 0.0]));
        let second = simd.load(&[h[1][1], h[1][2], 0.0, 0.0]);
        let lower = [whole[0], second, simd.load(&[h[2][2], 0.0, 0.0, 0.0])];
        let free = self.sides.len() / D;
        for i in 0..M {
            if first + i < 4 || first + i - 4 >= free || w[i] == 0.0 {
                continue;
            }
            let row = (first + i - 4) * D + 3 * g;
            for d in 0..3 {
                self.sides[row + d][0] += w[i] * gradient[d];
                self.sides[row + d][1] += w[i] * border[d];
            }
            for j in 0..=i {
                if first + j < 4 {
                    continue;
                }
                let (back, both) = ((i - j) * D, simd.splat(w[i] * w[j]));
                let block = if i == j { &lower } else { &whole };
                let columns = &mut self.band.columns[row - back..row - back + 3];
                for (b, column) in columns.iter_mut().enumerate() {
                    let to = &mut column[back.saturating_sub(b)..];
                    let sum = simd.add(simd.load(to), simd.mul(both, block[b]));
                    simd.store(sum, to);
                }
            }
        }
    }

    /// Balls, each at its closest approach: the passing time is eliminated, so there is no
    /// curvature in the direction of motion.
    fn balls(&mut self, at: &Iterate<'_, D>) {
        let (problem, point, room) = (at.problem, at.point, at.room);
        for (i, goal) in problem.inner().iter().enumerate() {
            let (span, share) = point.locate(point.crossings[i]);
            let w = weights(share);
            let [p, v, a] = point.at(point.crossings[i]);
            let (mut gradient, mut hessian) = ([0.0; D], [[0.0; D]; D]);
            let mut damping = 0.0;
            for g in 0..Problem::<D>::GROUPS {
                let y = [0, 1, 2].map(|d| p[3 * g + d] - goal[3 * g + d]);
                let slack = 1.0 / (room.balls[g][i].powi(2) - square(&y));
                let block = outer(&y, 2.0 * slack, 4.0 * slack * slack);
                damping += 2.0 * slack * (square(&y) * square(&part(&a, g))).sqrt();
                for d in 0..3 {
                    gradient[3 * g + d] = 2.0 * slack * y[d];
                    hessian[3 * g + d][3 * g..3 * g + 3].copy_from_slice(&block[d]);
                }
            }
            let mut bent = [0.0; D];
            for d in 0..D {
                bent[d] = (0..D).map(|e| hessian[d][e] * v[e]).sum();
            }
            let stiff: f64 = (0..D).map(|d| bent[d] * v[d]).sum::<f64>() + damping;
            if stiff > 0.0 {
                for d in 0..D {
                    for e in 0..D {
                        hessian[d][e] -= bent[d] * bent[e] / stiff;
                    }
                }
            }
            let mut border = [0.0; D];
            if !at.slides.is_empty() {
                let mut slide = [0.0; D];
                for (weight, change) in w[0].iter().zip(&at.slides[span..]) {
                    for d in 0..D {
                        slide[d] += weight * change[d];
                    }
                }
                for d in 0..D {
                    border[d] = (0..D).map(|e| hessian[d][e] * slide[e]).sum();
                    self.gradient_z += gradient[d] * slide[d];
                    self.hessian_z += slide[d] * border[d];
                }
            }
            self.add_ball(span, &w[0], [&gradient, &border], &hessian);
        }
    }

    /// Adds a term that couples all coordinates.
    fn add_ball(
        &mut self,
        first: usize,
        w: &[f64; 5],
        [gradient, border]: [&[f64; D]; 2],
        hessian: &[[f64; D]; D],
    ) {
        let free = self.sides.len() / D;
        for i in 0..5 {
            if first + i < 4 || first + i - 4 >= free {
                continue;
            }
            let row = (first + i - 4) * D;
            for d in 0..D {
                self.sides[row + d][0] += w[i] * gradient[d];
                self.sides[row + d][1] += w[i] * border[d];
            }
            for j in 0..=i {
                if first + j < 4 {
                    continue;
                }
                let (back, both) = ((i - j) * D, w[i] * w[j]);
                let columns = &mut self.band.columns[row - back..row - back + D];
                for (b, column) in columns.iter_mut().enumerate() {
                    for a in (if i == j { b } else { 0 })..D {
                        column[back + a - b] += both * hessian[a][b];
                    }
                }
            }
        }
    }
}

/// An iterate with what the terms of its barrier need.
struct Iterate<'a, const D: usize> {
    problem: &'a Problem<D>,
    point: &'a Point<D>,
    room: &'a Room,
    /// The control points that the start fixes, and their derivatives to `z`.
    pinned: [[[f64; D]; 2]; 4],
    /// How each control point moves with `z` if the end is in motion; empty if it rests.
    slides: Vec<[f64; D]>,
}

impl<const D: usize> Iterate<'_, D> {
    /// How a sum of control points moves with `z`, if some of them are pinned.
    #[inline(always)]
    fn slide<const M: usize>(&self, sum: &Sum<'_, M>) -> Option<[f64; 3]> {
        let Sum { first, w, g } = *sum;
        let mut slide = [0.0; 3];
        let mut add = |weight: f64, change: &[f64; D]| {
            for d in 0..3 {
                slide[d] += weight * change[3 * g + d];
            }
        };
        if !self.slides.is_empty() {
            for (weight, change) in w.iter().zip(&self.slides[first..]) {
                add(*weight, change);
            }
        } else if first < 4 {
            for (weight, pin) in w.iter().zip(&self.pinned[first..]) {
                add(*weight, &pin[1]);
            }
        } else {
            return None;
        }
        Some(slide)
    }
}

/// A weighted sum of consecutive control points, of the coordinates of one group.
#[derive(Clone, Copy)]
struct Sum<'a, const M: usize> {
    first: usize,
    w: &'a [f64; M],
    g: usize,
}

impl<'a, const M: usize> Sum<'a, M> {
    #[inline(always)]
    fn new(first: usize, w: &'a [f64; M], g: usize) -> Self {
        Self { first, w, g }
    }
}

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

/// `diagonal I + scale y y^T`.
#[inline(always)]
fn outer(y: &[f64; 3], diagonal: f64, scale: f64) -> [[f64; 3]; 3] {
    let mut result = [[0.0; 3]; 3];
    for a in 0..3 {
        for b in 0..3 {
            result[a][b] = scale * y[a] * y[b];
        }
        result[a][a] += diagonal;
    }
    result
}
