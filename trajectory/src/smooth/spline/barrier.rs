//! The barrier of an iterate: its value and the slacks of all constraints, four at a time.

use simd::{Build, F4, Four, LANES, Op};

use super::basis::{FIRST, SECOND, THIRD};
use super::coordinates::Coordinates;
use super::problem::{Point, Problem, Room, square};
use super::project::miss;

/// Fraction of each slack that a step must leave: an iterate too close to a constraint then moves
/// only slowly along it, since norms are curved.
pub(crate) const KEEP: f64 = 0.02;

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
        Build::detect().run(self.at(point, before))
    }

    /// Whether an iterate, wherever it passes its poses, is within the limits of speed, acceleration and jerk, with enough left of the
    /// slacks `before`: what [`Barrier::look`] asks for first, and only a small part of it.
    pub(crate) fn is_limited(&self, point: &Point<D>, before: &[f64]) -> bool {
        Build::detect().run(Limited(self.at(point, before)))
    }

    /// A look at an iterate.
    fn at<'b>(&'b self, point: &'b Point<D>, before: &'b [f64]) -> Look<'b, D> {
        Look {
            barrier: self,
            point,
            before,
        }
    }
}

/// Product of slacks, as shares of their bounds, with rare logarithms.
struct Slacks<'a, S: Four> {
    product: F4<S>,
    sum: f64,
    /// Slacks before the step; none when empty.
    before: &'a [f64],
    /// Share of each that has to be left.
    keep: f64,
    seen: Vec<f64>,
}

/// Products below this are turned into logarithms: after it some more slacks are multiplied, each at least the
/// smallest difference to 1.
const SMALL: f64 = 1e-200;

impl<'a, S: Four> Slacks<'a, S> {
    #[inline(always)]
    fn new(simd: S, keep: f64, before: &'a [f64], room: usize) -> Self {
        Self {
            product: F4::splat(simd, 1.0),
            sum: 0.0,
            before,
            keep,
            seen: Vec::with_capacity(room),
        }
    }

    /// Adds the slack of `square <= bound`; false if too little is left.
    #[inline(always)]
    fn take(&mut self, square: f64, bound: f64) -> bool {
        let slack = 1.0 - square / bound;
        if !self.see(slack) {
            return false;
        }
        let simd = self.product.build();
        self.product = self.product * F4::new(simd, [slack, 1.0, 1.0, 1.0]);
        self.fold();
        true
    }

    /// Adds a slack that may be greater than 1; false if too little is left.
    #[inline(always)]
    fn take_linear(&mut self, slack: f64) -> bool {
        let seen = self.see(slack);
        if seen {
            self.sum += slack.ln();
        }
        seen
    }

    /// Whether enough is left of a slack, which is then one of those seen.
    #[inline(always)]
    fn see(&mut self, slack: f64) -> bool {
        let before = self.before.get(self.seen.len());
        let least = before.map_or(0.0, |s| self.keep * s);
        let left = slack > least;
        if left {
            self.seen.push(slack);
        }
        left
    }

    /// Adds four slacks; false if too little is left of one.
    #[inline(always)]
    fn take_four(&mut self, squares: F4<S>, bounds: F4<S>) -> bool {
        let simd = self.product.build();
        let slack = F4::splat(simd, 1.0) - squares / bounds;
        let mut least = F4::splat(simd, f64::MIN_POSITIVE);
        if let Some(before) = self.before.get(self.seen.len()..self.seen.len() + LANES) {
            least = (F4::load(simd, before) * self.keep).max(least);
        }
        if least.le(slack).bits() != 0b1111 {
            return false;
        }
        self.seen.extend_from_slice(&slack.array());
        self.product = self.product * slack;
        true
    }

    /// Keeps the product within the range of numbers.
    #[inline(always)]
    fn fold(&mut self) {
        let simd = self.product.build();
        if self.product.le(F4::splat(simd, SMALL)).bits() != 0 {
            self.sum += self.logarithm();
            self.product = F4::splat(simd, 1.0);
        }
    }

    /// The logarithm of the product.
    #[inline(always)]
    fn logarithm(&self) -> f64 {
        let [a, b, c, d] = self.product.array();
        (a.ln() + b.ln()) + (c.ln() + d.ln())
    }
}

/// [`Barrier::look`].
struct Look<'a, const D: usize> {
    barrier: &'a Barrier<'a, D>,
    point: &'a Point<D>,
    before: &'a [f64],
}

impl<const D: usize> Op for Look<'_, D> {
    type Output = Option<Seen>;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> Option<Seen> {
        let Barrier { problem, room, .. } = *self.barrier;
        let coordinates = Coordinates::of(&self.point.control);
        let points = self.point.control.len() + self.point.crossings.len();
        let count = Problem::<D>::GROUPS * 5 * points;
        let mut slacks = Slacks::new(simd, self.barrier.keep, self.before, count);
        let mut bounds = 0.0;
        for g in 0..Problem::<D>::GROUPS {
            bounds += self.limits(&mut slacks, &coordinates, g)?;
            self.balls(&mut slacks, g)?;
            if problem.groups[g].width.is_finite() {
                self.corridor(&mut slacks, &coordinates, (g, room))?;
            }
        }
        bounds += self.joints(&mut slacks)?;
        bounds += self.forward(&mut slacks)?;
        Some(Seen {
            rest: -bounds - slacks.sum - slacks.logarithm(),
            slacks: slacks.seen,
        })
    }
}

/// [`Barrier::is_limited`].
struct Limited<'a, const D: usize>(Look<'a, D>);

impl<const D: usize> Op for Limited<'_, D> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Four>(self, simd: S) -> bool {
        let Self(look) = self;
        let coordinates = Coordinates::of(&look.point.control);
        (0..Problem::<D>::GROUPS).all(|g| {
            let before = look.before.get(look.first_of(g)..).unwrap_or_default();
            let mut slacks = Slacks::new(simd, look.barrier.keep, before, before.len());
            look.limits(&mut slacks, &coordinates, g).is_some()
        })
    }
}

impl<const D: usize> Look<'_, D> {
    /// How many differences of order 1 to 3 the control points have.
    fn differences(&self) -> [usize; 3] {
        [1, 2, 3].map(|order| self.point.control.len().saturating_sub(order))
    }

    /// The place of the first slack of a group among all.
    fn first_of(&self, g: usize) -> usize {
        let Self { barrier, point, .. } = *self;
        let limits: usize = self.differences().iter().sum();
        let before = barrier.problem.groups.iter().take(g);
        let corridors = before.filter(|group| group.width.is_finite()).count();
        g * (limits + point.crossings.len()) + corridors * point.samples()
    }

    /// Adds the slacks of speed, acceleration and jerk; returns the sum of the logarithms of their
    /// bounds, which depend on `z`.
    #[inline(always)]
    fn limits<S: Four>(
        &self,
        slacks: &mut Slacks<'_, S>,
        coordinates: &Coordinates,
        g: usize,
    ) -> Option<f64> {
        let simd = slacks.product.build();
        let Self { barrier, point, .. } = *self;
        let cap = |k: usize| barrier.problem.cap(g, k, point.z, barrier.room)[0].powi(2);
        let caps = [cap(1), cap(2), cap(3)];
        let last = point.control.len() - 1;
        // Groups of four in which all three differences have all their points.
        let whole = last.saturating_sub(2) / LANES;
        for k in (0..whole).map(|group| LANES * group) {
            let [first, second, third] = coordinates.differences(simd, g, k);
            let (speed, acceleration, jerk) = (squares(first), squares(second), squares(third));
            let held = slacks.take_four(speed, F4::splat(simd, caps[0]))
                && slacks.take_four(acceleration, F4::splat(simd, caps[1]))
                && slacks.take_four(jerk, F4::splat(simd, caps[2]));
            if !held {
                return None;
            }
            slacks.fold();
        }
        for k in LANES * whole..last {
            let held = slacks.take(square(&point.sum(k, &FIRST, g)), caps[0])
                && (k + 2 > last || slacks.take(square(&point.sum(k, &SECOND, g)), caps[1]))
                && (k + 3 > last || slacks.take(square(&point.sum(k, &THIRD, g)), caps[2]));
            if !held {
                return None;
            }
        }
        let count = self.differences();
        let logarithm = |k: usize| count[k] as f64 * caps[k].ln();
        Some(logarithm(0) + logarithm(1) + logarithm(2))
    }

    /// Adds the slacks of all joints; returns the sum of the logarithms of their bounds that depend on `z`.
    #[inline(always)]
    fn joints<S: Four>(&self, slacks: &mut Slacks<'_, S>) -> Option<f64> {
        let (simd, problem) = (slacks.product.build(), self.barrier.problem);
        let h = problem.spacing(self.point.z);
        let mut bounds = 0.0;
        for joint in &problem.joints {
            bounds += joint.look(simd, (&self.point.control, h), |squares, bound| {
                let held = slacks.take_four(squares, bound);
                slacks.fold();
                held
            })?;
        }
        Some(bounds)
    }

    /// Adds the slacks where the place goes forward only; returns the sum of the logarithms of their bounds, which depend on `z`.
    #[inline(always)]
    fn forward<S: Four>(&self, slacks: &mut Slacks<'_, S>) -> Option<f64> {
        let Barrier { problem, room, .. } = *self.barrier;
        for (ahead, behind) in problem.ahead(self.point).zip(&room.forward) {
            if !slacks.take_linear(ahead + behind) {
                return None;
            }
        }
        Some(problem.forward.len() as f64 * problem.stride(self.point.z).ln())
    }

    /// Adds the slacks of the balls.
    #[inline(always)]
    fn balls<S: Four>(&self, slacks: &mut Slacks<'_, S>, g: usize) -> Option<()> {
        let Barrier { problem, room, .. } = *self.barrier;
        let heavy = problem.heavy(self.point);
        for (i, radius) in room.balls[g].iter().enumerate() {
            let miss = miss(problem, self.point, i, g);
            if !slacks.take(miss * miss, radius * radius) {
                return None;
            }
            if heavy > 1.0 {
                slacks.sum += (heavy - 1.0) * slacks.seen[slacks.seen.len() - 1].ln();
            }
        }
        Some(())
    }

    /// Adds the slacks of the corridor samples: four knots, the four middles after them, and so on.
    #[inline(always)]
    fn corridor<S: Four>(
        &self,
        slacks: &mut Slacks<'_, S>,
        coordinates: &Coordinates,
        (g, room): (usize, &Room),
    ) -> Option<()> {
        let simd = slacks.product.build();
        let spans = self.point.spans();
        let whole = spans / LANES;
        for k in (0..whole).map(|group| LANES * group) {
            let Some([knots, middles]) = self.beside(simd, coordinates, (g, k)) else {
                for sample in [0, 2, 4, 6, 1, 3, 5, 7] {
                    self.sample(slacks, 2 * k + sample, (g, room))?;
                }
                continue;
            };
            let width = |i: usize| room.widths[g][2 * k + i] * room.widths[g][2 * k + i];
            let at_knots = F4::new(simd, [width(0), width(2), width(4), width(6)]);
            let at_middles = F4::new(simd, [width(1), width(3), width(5), width(7)]);
            if !slacks.take_four(knots, at_knots) || !slacks.take_four(middles, at_middles) {
                return None;
            }
            slacks.fold();
        }
        for k in 2 * LANES * whole..2 * spans {
            self.sample(slacks, k, (g, room))?;
        }
        Some(())
    }

    /// Adds the slack of one corridor sample.
    #[inline(always)]
    fn sample<S: Four>(
        &self,
        slacks: &mut Slacks<'_, S>,
        k: usize,
        (g, room): (usize, &Room),
    ) -> Option<()> {
        let place = self.point.sample(k, g);
        let foot = self.barrier.problem.nearest(&place, room.legs[k], g);
        let held = slacks.take(square(&foot.offset), room.widths[g][k].powi(2));
        held.then_some(())
    }

    /// Squares of the distances from the path of four knots from `k` on, and of the middles after them, if all
    /// belong to one leg and are beside it.
    #[inline(always)]
    fn beside<S: Four>(
        &self,
        simd: S,
        coordinates: &Coordinates,
        (g, k): (usize, usize),
    ) -> Option<[F4<S>; 2]> {
        let Barrier { problem, room, .. } = *self.barrier;
        let legs = &room.legs[2 * k..][..2 * LANES];
        if legs.iter().any(|leg| *leg != legs[0]) {
            return None;
        }
        let way = problem.way(legs[0], g);
        let [knots, middles] = coordinates.samples(simd, g, k);
        Some([squares(way.beside(knots)?), squares(way.beside(middles)?)])
    }
}

/// Sums of squares of four vectors, by coordinate.
#[inline(always)]
fn squares<S: Four>([x, y, z]: [F4<S>; 3]) -> F4<S> {
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::spline::problem::Group;
    use crate::smooth::spline::project::{miss, project};
    use crate::smooth::spline::start;

    /// Corners of a path of so many vertices, from rest or from motion.
    fn problem<const D: usize>(vertices: usize, speed: f64) -> Problem<D> {
        let vertex = |i: usize| std::array::from_fn(|d| 0.1 * (i as f64 * (1.3 + d as f64)).sin());
        let vertices: Vec<[f64; D]> = (0..vertices).map(vertex).collect();
        let group = Group {
            caps: [0.5, 5.0, 100.0],
            radius: 0.01,
            width: 0.02,
        };
        let moving = std::array::from_fn(|d| speed * (vertices[1][d] - vertices[0][d]));
        Problem {
            start: [vertices[0], moving, [0.0; D], [0.0; D]],
            ..Problem::at_rest(vertices, [group; 2])
        }
    }

    /// The barrier without the share of the weight, one term after the other.
    fn one_by_one<const D: usize>(barrier: &Barrier<'_, D>, point: &Point<D>) -> f64 {
        let Barrier { problem, room, .. } = *barrier;
        let log = |square: f64, bound: f64| -(bound * bound - square).ln();
        let relative = |square: f64, bound: f64| -(1.0 - square / (bound * bound)).ln();
        let mut sum = 0.0;
        for g in 0..D / 3 {
            let cap = |k: usize| problem.cap(g, k, point.z, room)[0];
            for k in 0..point.control.len() - 1 {
                sum += log(square(&point.sum(k, &FIRST, g)), cap(1));
                if k + 2 < point.control.len() {
                    sum += log(square(&point.sum(k, &SECOND, g)), cap(2));
                }
                if k + 3 < point.control.len() {
                    sum += log(square(&point.sum(k, &THIRD, g)), cap(3));
                }
            }
            for (i, radius) in room.balls[g].iter().enumerate() {
                let miss = miss(problem, point, i, g);
                sum += problem.heavy(point) * relative(miss * miss, *radius);
            }
            for k in 0..point.samples() {
                let foot = problem.nearest(&point.sample(k, g), room.legs[k], g);
                sum += relative(square(&foot.offset), room.widths[g][k]);
            }
        }
        sum
    }

    /// Looks at the first iterate of a problem.
    fn check<const D: usize>(vertices: usize, speed: f64) {
        let mut problem = problem::<D>(vertices, speed);
        let mut point = start::first(
            &mut problem,
            (speed > 0.0).then_some(1.0),
            start::KNOTS_PER_RAMP,
        );
        problem.pin(&mut point);
        project(&problem, &mut point, None, 20);
        let room = &Room::new(&problem, &point);
        let barrier = Barrier {
            problem: &problem,
            room,
            weight: 3.0,
            keep: 0.1,
        };
        let seen = barrier.look(&point, &[]).unwrap();
        let wanted = one_by_one(&barrier, &point);
        let got = barrier.value(&point, &seen) - 3.0 * point.z;
        assert!((got - wanted).abs() < 1e-9 * wanted.abs(), "{got} {wanted}");
        let plain = Build::Plain.run(barrier.at(&point, &[])).unwrap();
        assert_eq!((plain.rest, plain.slacks), (seen.rest, seen.slacks.clone()));
        // One slack after the other falls below a tenth of what it was.
        let mut broken = 0;
        for i in 0..seen.slacks.len() {
            for (factor, held) in [(11.0, false), (9.0, true)] {
                let mut before = seen.slacks.clone();
                before[i] *= factor;
                let there = barrier.look(&point, &before);
                assert_eq!(there.is_some(), held, "slack {i} of {}", seen.slacks.len());
                broken += usize::from(!barrier.is_limited(&point, &before));
                assert!(!held || barrier.is_limited(&point, &before), "slack {i}");
            }
        }
        // Those of the limits are seen without the passes.
        let last = point.control.len() - 1;
        assert_eq!(broken, D / 3 * (3 * last - 3));
        // Outside of the domain there is no value.
        point.z *= 1e-6;
        assert!(barrier.look(&point, &[]).is_none());
    }

    /// Four at a time, the barrier and its slacks are what they are one by one, in both builds.
    #[test]
    fn four_at_a_time_are_as_one_by_one() {
        for vertices in 2..7 {
            check::<3>(vertices, 0.0);
            check::<6>(vertices, 0.0);
            check::<6>(vertices, 0.5);
        }
    }
}
