//! Where a place is to go forward only.

use std::collections::BTreeSet;

use super::forward::Forward;
use super::problem::{Point, Problem, part, square};

/// The share of the time on a leg, before its vertex, in which the place comes nearer all the time; the distance, in radii of the
/// ball, and the time to the pass, in knots, below which it need not.
const BESIDE: f64 = 0.5;
const NEAR: f64 = 0.3;
const SOON: f64 = 1.5;

/// Control points at either end that a step does not move.
const FIXED: usize = 4;

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

    /// The legs beside its vertices on which the place goes forward, the first being 0.
    pub(super) fn legs(&self) -> BTreeSet<usize> {
        let beside = |after: usize| self.vertices.iter().map(move |vertex| vertex + after);
        let first = usize::from(self.backwards);
        let other = self.both.then_some(1 - first);
        [Some(first), other]
            .into_iter()
            .flatten()
            .flat_map(beside)
            .collect()
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::smooth::spline::problem::Group;
    use crate::smooth::spline::start;

    /// A zigzag, and a first iterate along it.
    fn zigzag() -> (Problem<3>, Point<3>) {
        let vertices = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1], [0.0, 0.1], [0.0, 0.2]];
        let group = Group {
            caps: [0.5, 5.0, 100.0],
            radius: 0.01,
            width: 0.02,
        };
        let vertices = vertices.map(|[x, y]| [x, y, 0.0]).to_vec();
        let mut problem = Problem::at_rest(vertices, [group; 2]);
        let point = start::first(&mut problem, None, start::KNOTS_PER_RAMP);
        (problem, point)
    }

    /// Each control point on a leg beside one of the vertices lies before the next one; those on the legs of a vertex before it,
    /// and past it afterwards.
    #[test]
    fn bounds_are_on_the_legs_beside_the_vertices() {
        let (mut problem, point) = zigzag();
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
            assert!(stretch.legs().into_iter().eq(legs));
        }
    }
}
