//! A place that goes forward only: a bound of the search beside the limits, balls and corridor.
//!
//! At a corner a tool may have to turn for longer than its place needs. A motion that is as fast may then leave the ball and come
//! back, and a pose counts as passed on the first approach, where the tool is not turned yet. Where the place goes forward along
//! the leg before the pass until it passes, and then along the leg after it, there is no other approach.

use std::collections::BTreeSet;

use super::iterate::Iterate;
use super::newton::System;
use super::problem::{Point, Problem, part, square};

/// How far the place goes forward at least from one control point to the next, as a share of what it covers at its greatest speed
/// in one knot interval; the same from which on the bound need not be widened.
const AHEAD: f64 = 1e-4;
const CLEAR: f64 = 1.5 * AHEAD;

/// What an iterate leaves at least of a widened bound, as a share of how far it goes forward or back.
const LEFT: f64 = 0.03;

/// The share of the time on a leg, before its vertex, in which the place comes nearer all the time; the distance, in radii of the
/// ball, and the time to the pass, in knots, below which it need not.
const BESIDE: f64 = 0.5;
const NEAR: f64 = 0.3;
const SOON: f64 = 1.5;

/// Control points at either end that a step does not move.
const FIXED: usize = 4;

/// A control point lies before another place, along a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Forward {
    /// Index of the control point.
    control: usize,
    /// The direction, of length one.
    along: [f64; 3],
    /// What it lies before: this place, or else the next control point.
    place: Option<[f64; 3]>,
}

impl Forward {
    /// By how much its control point lies before the other place, m.
    fn ahead<const D: usize>(&self, control: &[[f64; D]]) -> f64 {
        let from = &control[self.control];
        let to = self
            .place
            .unwrap_or_else(|| part(&control[self.control + 1], 0));
        (0..3).map(|d| self.along[d] * (to[d] - from[d])).sum()
    }

    /// The control points that it depends on, with the sign of each.
    fn ends(&self) -> impl Iterator<Item = (usize, f64)> + use<> {
        let next = (self.control + 1, 1.0);
        let next = Some(next).filter(|_| self.place.is_none());
        [(self.control, -1.0)].into_iter().chain(next)
    }

    /// The bound for an iterate that lies before by a share: how far it may lie behind; below 0 at the true bound.
    pub(super) fn narrowed(before: f64, ahead: f64) -> f64 {
        if ahead >= CLEAR {
            return -AHEAD;
        }
        before.min(AHEAD.max(LEFT * ahead.abs()) - ahead)
    }

    /// Whether a bound is the true one.
    pub(super) fn is_tight(behind: f64) -> bool {
        behind <= -AHEAD
    }
}

/// Where the place is to go forward only: on the legs before some inner vertices, and perhaps on those after them.
#[derive(Clone, Debug)]
pub(super) struct Stretch<'a> {
    /// These inner vertices.
    pub(super) vertices: &'a BTreeSet<usize>,
    /// Those of them to which the place comes nearer all the time, from the middle of the leg on.
    pub(super) nearer: &'a BTreeSet<usize>,
    /// Whether the motion will be made from its end to its start: then a leg after a vertex is one before it.
    pub(super) backwards: bool,
    /// Whether the place goes forward on both legs beside a vertex.
    pub(super) both: bool,
}

/// One end of a leg.
struct End {
    /// Index of the inner vertex.
    vertex: usize,
    /// 1 before the vertex, -1 after it.
    sign: f64,
    /// Time to its pass, or since then, as a share of that on the leg.
    away: f64,
}

impl Stretch<'_> {
    /// The sign of an end of a leg from which its vertex is approached.
    fn first(&self) -> f64 {
        if self.backwards { -1.0 } else { 1.0 }
    }

    /// The ends of a leg beside which the place goes forward, after a share of the time on it; leg 0 begins at the start.
    fn ends(&self, leg: usize, share: f64) -> impl Iterator<Item = End> {
        let end = move |vertex: usize, sign: f64, away: f64| End { vertex, sign, away };
        let end = move |vertex: &usize| match leg {
            _ if leg == *vertex => Some(end(*vertex, 1.0, 1.0 - share)),
            _ if leg == vertex + 1 => Some(end(*vertex, -1.0, share)),
            _ => None,
        };
        let ends = self.vertices.iter().filter_map(end);
        ends.filter(|end| self.both || end.sign == self.first())
    }

    /// Whether the place comes nearer to an end all the time.
    fn is_nearer(&self, end: &End) -> bool {
        end.sign == self.first() && end.away <= BESIDE && self.nearer.contains(&end.vertex)
    }
}

impl<const D: usize> Point<D> {
    /// The leg on which it is at a time in knots, the first being 0, and the share of the time on it that has passed.
    fn leg(&self, time: f64) -> (usize, f64) {
        let leg = self.crossings.partition_point(|pass| *pass <= time);
        let pass = |i: Option<usize>| i.and_then(|i| self.crossings.get(i)).copied();
        let from = pass(leg.checked_sub(1)).unwrap_or(0.0);
        let to = pass(Some(leg)).unwrap_or(self.spans() as f64);
        (leg, (time - from) / (to - from))
    }
}

impl<const D: usize> Problem<D> {
    /// Bounds the place to go forward there.
    pub(super) fn go_forward(&mut self, point: &Point<D>, stretch: &Stretch<'_>) {
        let moving = FIXED..point.control.len().saturating_sub(FIXED + 1);
        let bounds = moving.flat_map(|control| self.bounds(point, stretch, control));
        self.forward = bounds.collect();
    }

    /// The bounds of one control point, which moves with a step as the next one does.
    fn bounds(&self, point: &Point<D>, stretch: &Stretch<'_>, control: usize) -> Vec<Forward> {
        // When the difference to the next control point counts most.
        let time = control as f64 - 1.0;
        let (leg, share) = point.leg(time);
        let along = self.way(leg + 1, 0).direction();
        let ends: Vec<End> = stretch.ends(leg, share).collect();
        if ends.is_empty() || along == [0.0; 3] {
            return Vec::new();
        }
        let nearer = ends.iter().filter(|end| stretch.is_nearer(end));
        let mut straight = nearer.filter_map(|end| self.straight(point, end, time));
        let forward = |along: [f64; 3], place: Option<[f64; 3]>| Forward {
            control,
            along,
            place,
        };
        let next = forward(straight.next().unwrap_or(along), None);
        let passed = ends.iter().map(|end| {
            let place = part(&self.vertices[end.vertex + 1], 0);
            forward(along.map(|x| end.sign * x), Some(place))
        });
        [next].into_iter().chain(passed).collect()
    }

    /// The direction of the straight way to a vertex, or from it, at a time that is not too near to its pass.
    fn straight(&self, point: &Point<D>, end: &End, time: f64) -> Option<[f64; 3]> {
        let (here, goal) = (
            point.place(time, 0),
            part(&self.vertices[end.vertex + 1], 0),
        );
        let way: [f64; 3] = std::array::from_fn(|d| end.sign * (goal[d] - here[d]));
        let far = square(&way).sqrt();
        let near = far <= NEAR * self.groups[0].radius
            || (time - point.crossings[end.vertex]).abs() < SOON;
        (!near).then(|| way.map(|x| x / far))
    }

    /// What the place covers at its greatest speed in one knot interval, m.
    pub(super) fn stride(&self, z: f64) -> f64 {
        self.groups[0].caps[0] * self.spacing(z)
    }

    /// How far forward the place goes at each of these bounds, in strides.
    pub(super) fn ahead<'a>(&'a self, point: &'a Point<D>) -> impl Iterator<Item = f64> + 'a {
        let stride = self.stride(point.z);
        let all = self.forward.iter();
        all.map(move |forward| forward.ahead(&point.control) / stride)
    }
}

impl<const D: usize, const B: usize> System<D, B> {
    /// Adds the bounds of a place that goes forward.
    pub(super) fn forward(&mut self, at: &Iterate<'_, D>) {
        let (problem, z) = (at.problem, at.point.z);
        let steep = if at.shifts.is_none() { 1.0 } else { 0.0 };
        let stride = problem.stride(z);
        let all = problem.forward.iter().zip(problem.ahead(at.point));
        for ((forward, ahead), behind) in all.zip(&at.room.forward) {
            let slack = (ahead + behind) * stride;
            let slides = forward
                .ends()
                .filter_map(|(k, sign)| Some((at.slides.get(k)?, sign)));
            let slides = slides.map(|(slide, sign)| sign * along(forward, slide));
            // How the slack changes with `z`.
            let rise = behind * stride / (3.0 * z) + slides.sum::<f64>();
            let bend = -2.0 * behind * stride / (9.0 * z * z);
            self.gradient_z -= steep * rise / slack;
            self.hessian_z += (rise / slack).powi(2) - bend / slack;
            self.ends(forward, [steep, rise / slack], slack);
        }
    }

    /// Adds what one bound with a `slack` that rises by a share of it with `z` has of its control points.
    fn ends(&mut self, forward: &Forward, [steep, rise]: [f64; 2], slack: f64) {
        let free = self.sides.len() / D;
        let slope = forward.along.map(|x| x / slack);
        let row = |k: usize| {
            Some(Self::row(
                free,
                k.checked_sub(FIXED).filter(|k| *k < free)?,
                0,
            ))
        };
        let ends = || forward.ends().filter_map(|(k, sign)| Some((row(k)?, sign)));
        for (row, sign) in ends() {
            for d in 0..3 {
                self.sides[row + d][0] -= steep * sign * slope[d];
                self.sides[row + d][1] += sign * slope[d] * rise;
            }
            for (other, with) in ends() {
                for (d, e) in (0..9).map(|i| (i / 3, i % 3)) {
                    // The band has the entries below the diagonal.
                    if let Some(below) = (other + d).checked_sub(row + e) {
                        self.band.columns[row + e][below] += sign * with * slope[d] * slope[e];
                    }
                }
            }
        }
    }
}

/// The share of a point along a direction.
fn along<const D: usize>(forward: &Forward, point: &[f64; D]) -> f64 {
    (0..3).map(|d| forward.along[d] * point[d]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::spline::barrier::Barrier;
    use crate::smooth::spline::problem::{Group, Room};
    use crate::smooth::spline::project::project;
    use crate::smooth::spline::solve::go;
    use crate::smooth::spline::start;

    /// Corners whose place goes forward only, an end that moves so fast (m/s), and a first iterate.
    fn problem(speed: f64) -> (Problem<6>, Point<6>) {
        let vertices = [
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [0.1, 0.0, 0.0, 0.3, 0.0, 0.1],
            [0.1, 0.1, 0.0, 0.3, 0.4, 0.0],
            [0.0, 0.1, 0.1, 0.0, 0.4, 0.3],
            [0.0, 0.2, 0.1, 0.1, 0.1, 0.3],
        ];
        let group = |scale: f64, radius: f64| Group {
            caps: [0.5, 5.0, 100.0].map(|cap| cap * scale),
            radius,
            width: 2.0 * radius,
        };
        let mut problem = Problem::at_rest(vertices.to_vec(), [group(1.0, 0.01), group(4.0, 0.08)]);
        let mut point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
        if speed > 0.0 {
            let moving = [0.0, speed, 0.0, 0.0, 0.0, speed];
            problem.finish = Some([vertices[4], moving, [0.0; 6], [0.0; 6]]);
        }
        problem.pin(&mut point);
        project(&problem, &mut point, None, 20);
        let stretch = Stretch {
            vertices: &BTreeSet::from([0, 2]),
            nearer: &BTreeSet::from([2]),
            backwards: false,
            both: true,
        };
        problem.go_forward(&point, &stretch);
        (problem, point)
    }

    /// With bounds that hold and with bounds that are widened the barrier falls along the Newton step as its decrement says, and
    /// is curved so.
    fn check<const B: usize>(speed: f64, back: bool) {
        let (mut problem, point) = problem(speed);
        if back {
            for forward in &mut problem.forward {
                forward.along = forward.along.map(|x| -x);
            }
        }
        let room = Room::new(&problem, &point);
        assert_eq!(room.forward.len(), problem.forward.len());
        assert!(room.forward.iter().any(|behind| Forward::is_tight(*behind)) || back);
        assert!(room.forward.iter().any(|behind| *behind > 0.0) || !back);
        let weight = problem.parameter(&point) / point.z;
        let step = System::<6, B>::new(&point).step(&problem, &point, &room, weight);
        let step = step.unwrap();
        let barrier = Barrier {
            problem: &problem,
            room: &room,
            weight,
            keep: 0.0,
        };
        let value = |share: f64| {
            let mut moved = point.clone();
            go(&problem, (&point, &mut moved), (&step, share));
            project(&problem, &mut moved, Some(&room), 20);
            let seen = barrier.look(&moved, &[]).unwrap();
            barrier.value(&moved, &seen)
        };
        let wide = 1e-4;
        let (before, here, after) = (value(-wide), value(0.0), value(wide));
        let slope = (before - after) / (2.0 * wide) / step.decrement;
        assert!((slope - 1.0).abs() < 1e-3, "{speed} {back}: {slope}");
        let bend = (before + after - 2.0 * here) / (wide * wide) / step.decrement;
        assert!((bend - 1.0).abs() < 0.05, "{speed} {back}: {bend}");
    }

    #[test]
    fn the_barrier_falls_along_the_step_as_its_decrement_says() {
        for back in [false, true] {
            check::<20>(0.0, back);
            check::<36>(0.0, back);
            check::<20>(0.01, back);
            check::<36>(0.01, back);
        }
    }

    /// Each control point on a leg beside one of the vertices lies before the next one; those on the legs of a vertex before it,
    /// and past it afterwards.
    #[test]
    fn bounds_are_on_the_legs_beside_the_vertices() {
        let (mut problem, point) = problem(0.0);
        let (vertices, nearer) = (BTreeSet::from([1]), BTreeSet::new());
        for (both, backwards, legs) in [
            (false, false, vec![1]),
            (false, true, vec![2]),
            (true, false, vec![1, 2]),
        ] {
            let stretch = Stretch {
                vertices: &vertices,
                nearer: &nearer,
                backwards,
                both,
            };
            problem.go_forward(&point, &stretch);
            let leg = |forward: &Forward| point.leg(forward.control as f64 - 1.0).0;
            let (mut seen, all): (Vec<usize>, _) =
                (problem.forward.iter().map(leg).collect(), &problem.forward);
            assert!(
                all.chunks(2)
                    .all(|pair| pair[0].place.is_none() && pair[1].place.is_some())
            );
            let sign = |forward: &Forward| {
                let way = problem.way(leg(forward) + 1, 0).direction();
                (0..3).map(|d| way[d] * forward.along[d]).sum::<f64>()
            };
            for forward in all {
                let after = forward.place.is_some() && leg(forward) == 2;
                assert!((sign(forward) - if after { -1.0 } else { 1.0 }).abs() < 1e-12);
            }
            seen.dedup();
            assert_eq!(seen, legs);
        }
    }

    /// A widened bound contains the iterate, is never wider than before, and is the true one where the iterate is well inside.
    #[test]
    fn bounds_are_narrowed_to_the_iterate() {
        let mut behind = f64::INFINITY;
        for ahead in [-0.5, -0.2, -1e-3, 0.0, 1.2e-4, 1e-3] {
            let narrowed = Forward::narrowed(behind, ahead);
            assert!(narrowed <= behind && narrowed > -ahead);
            assert_eq!(Forward::is_tight(narrowed), ahead == 1e-3);
            behind = narrowed;
        }
    }
}
