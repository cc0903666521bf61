//! Minimum time over a spline through balls, as a convex problem.
//!
//! Unknown are the control points `c` and `z = (h / scale)^3`, with the knot spacing `h`. With `D1,
//! D2, D3` the differences of control points, `|D1 c| <= V h`, `|D2 c| <= A h^2`, `|D3 c| <= J h^3`
//! bound speed, acceleration and jerk for all times; in `z` all three are convex. A via point is a
//! ball around a pose at the closest approach; the corridor is a distance from the leg at each knot
//! and between knots.

use nalgebra::{UnitQuaternion, Vector3};
use simd::{F4, Four};

use super::basis::{self, START, weights};
use super::forward::Forward;
use super::frame::Frame;
use super::joint::{BOUNDS, Joint};
use crate::smooth::shares::Shares;

/// Inner poses up to which place and orientation have bands of their own, and passes are looked for until they are found.
pub(super) const FEW: usize = 24;

/// Share of all constraints that the balls count for where they turn: few among thousands would be met at so small a
/// slack that each step along a ball leaves it.
const BALLS: f64 = 0.005;

/// Limits of one group of three coordinates (position, or rotation vector).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Speed, acceleration, jerk.
    pub(crate) caps: [f64; 3],
    /// Radius of the balls.
    pub(crate) radius: f64,
    /// Half width of the corridor; infinite: none.
    pub(crate) width: f64,
}

/// The problem in `D` coordinates, three to a group, and one of a spare joint.
#[derive(Clone, Debug)]
pub(crate) struct Problem<const D: usize> {
    /// One for each three coordinates; the second is unused when `D = 3`.
    pub(crate) groups: [Group; 2],
    /// Corners of the path: start of the first leg, inner poses, goal.
    pub(crate) vertices: Vec<[f64; D]>,
    /// The legs between them, by group; see [`ways`].
    pub(crate) ways: [Vec<Way>; 2],
    /// Position, velocity, acceleration and jerk at the start.
    pub(crate) start: [[f64; D]; 4],
    /// The same at the end; `None`: at rest in the last corner.
    pub(crate) finish: Option<[[f64; D]; 4]>,
    /// Knot spacing at `z = 1`, s.
    pub(crate) scale: f64,
    /// While a first iterate from a start in motion breaks limits, its first control points stay
    /// those of this `z`; a greater `z` only widens limits.
    pub(crate) anchor: Option<f64>,
    /// Whether the motion will be made from its end to its start: then the last inner vertex is passed first.
    pub(crate) backwards: bool,
    /// Whether the place alone says when an inner vertex is passed, by vertex; empty: of none.
    pub(crate) led: Vec<bool>,
    /// The joints of an arm that follow.
    pub(crate) joints: Vec<Joint<D>>,
    /// The known motion of an arm that turns, at each control point; empty: orientations are rolled out.
    pub(crate) frames: Vec<Frame>,
    /// Where the place goes forward only.
    pub(crate) forward: Vec<Forward>,
    /// Shares of the balls that are used.
    pub(crate) shares: Shares,
}

/// One iterate: control points, `z`, passing times in knots, and by how much
/// each constraint is still widened.
#[derive(Clone, Debug)]
pub(crate) struct Point<const D: usize> {
    pub(crate) control: Vec<[f64; D]>,
    pub(crate) z: f64,
    /// Time of the pass of each inner vertex, in knot intervals.
    pub(crate) crossings: Vec<f64>,
}

/// Widened bounds that the present iterate needs until it is feasible.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Room {
    /// Factor on speed, acceleration and jerk of each group.
    pub(crate) caps: [[f64; 3]; 2],
    /// Radius of each ball, by group.
    pub(crate) balls: [Vec<f64>; 2],
    /// Half width of the corridor at each sample, by group.
    pub(crate) widths: [Vec<f64>; 2],
    /// Leg of each corridor sample (index of its far vertex).
    pub(crate) legs: Vec<usize>,
    /// By how much the place may go back where it goes forward only, in strides.
    pub(crate) forward: Vec<f64>,
    /// Factor on what the iterate has of a quantity, for a widened bound.
    pub(crate) widen: f64,
}

impl<const D: usize> Problem<D> {
    /// Number of groups.
    pub(crate) const GROUPS: usize = D / 3;

    /// First coordinate of the last group.
    pub(crate) const LAST: usize = 3 * (Self::GROUPS - 1);

    /// Whether position and orientation are both searched.
    pub(crate) const TURNS: bool = Self::GROUPS > 1;

    /// The coordinate of a spare joint, if there is one: after those of the groups.
    pub(crate) const SPARE: Option<usize> = if D % 3 == 1 { Some(D - 1) } else { None };

    /// The problem from rest to rest through these corners, without an arm, in which no place alone leads.
    pub(super) fn at_rest(vertices: Vec<[f64; D]>, groups: [Group; 2]) -> Self {
        Self {
            groups,
            ways: ways(&vertices),
            start: [vertices[0], [0.0; D], [0.0; D], [0.0; D]],
            vertices,
            finish: None,
            scale: 1.0,
            anchor: None,
            backwards: false,
            led: Vec::new(),
            joints: Vec::new(),
            frames: Vec::new(),
            forward: Vec::new(),
            shares: Shares::default(),
        }
    }

    /// Radius of the ball of an inner vertex in group `g`.
    pub(super) fn radius(&self, g: usize, inner: usize) -> f64 {
        self.shares.ball(inner, g) * self.groups[g].radius
    }

    /// Half width of the corridor of group `g` along the leg to a vertex.
    pub(super) fn width(&self, g: usize, leg: usize) -> f64 {
        self.shares.leg(leg, g) * self.groups[g].width
    }

    /// Whether the start or the end is in motion.
    pub(crate) fn moving(&self) -> bool {
        let start = self.start[1..].iter().flatten();
        self.finish.is_some() || start.copied().any(|x| x != 0.0)
    }

    /// Knot spacing, s.
    pub(crate) fn spacing(&self, z: f64) -> f64 {
        self.scale * z.cbrt()
    }

    /// The rotation vector of a control point.
    pub(super) fn turn(control: &[f64; D]) -> Vector3<f64> {
        Vector3::from_fn(|d, _| control[Self::LAST + d])
    }

    /// The control orientations of an iterate beside the known motion, from rest to rest between two orientations.
    pub(super) fn turned(
        &self,
        point: &Point<D>,
        [start, end]: [UnitQuaternion<f64>; 2],
    ) -> Vec<UnitQuaternion<f64>> {
        let all = self.frames.iter().zip(&point.control);
        let mut all: Vec<_> = all.map(|(frame, c)| frame.at(&Self::turn(c))).collect();
        let last = all.len() - 4;
        all[..4].fill(start);
        all[last..].fill(end);
        all
    }

    /// Whether the place alone says when inner vertex `i` is passed.
    pub(crate) fn is_led(&self, i: usize) -> bool {
        Self::TURNS && self.led.get(i).copied().unwrap_or(false)
    }

    /// Inner vertices: those with a ball.
    pub(crate) fn inner(&self) -> &[[f64; D]] {
        self.vertices
            .get(1..self.vertices.len().saturating_sub(1))
            .unwrap_or_default()
    }

    /// The first four control points at `z`, and their derivatives to `z`.
    pub(crate) fn pinned(&self, z: f64) -> [[[f64; D]; 2]; 4] {
        self.around(&self.start, z)
    }

    /// The same of the last four, of an end in motion.
    pub(crate) fn pinned_last(&self, z: f64) -> Option<[[[f64; D]; 2]; 4]> {
        Some(self.around(self.finish.as_ref()?, z))
    }

    /// How each control point moves with `z` if the end is in motion: those that are fixed as they must, the
    /// others so that no third difference changes by much. Empty if the end rests.
    pub(crate) fn slides(&self, point: &Point<D>) -> Vec<[f64; D]> {
        let Some(last) = self.pinned_last(point.z) else {
            return Vec::new();
        };
        let first = self.pinned(point.z);
        let count = point.control.len();
        let spread = |pins: &[[[f64; D]; 2]; 4]| -> [f64; D] {
            std::array::from_fn(|d| pins[2][1][d] - pins[1][1][d])
        };
        let mut slides = spreading([spread(&first), spread(&last)], count);
        for k in 0..4 {
            slides[k] = first[k][1];
            slides[count - 4 + k] = last[k][1];
        }
        slides
    }

    /// The four control points around a state at `z`, and their derivatives to `z`.
    fn around(&self, state: &[[f64; D]; 4], z: f64) -> [[[f64; D]; 2]; 4] {
        let h = self.spacing(self.anchor.unwrap_or(z));
        let slope = if self.anchor.is_some() {
            0.0
        } else {
            h / (3.0 * z)
        };
        let [p, v, a, j] = state;
        START.map(|w| {
            let (mut value, mut change) = ([0.0; D], [0.0; D]);
            for d in 0..D {
                let (w0, w1, w2) = (w[0] * v[d], w[1] * a[d], w[2] * j[d]);
                value[d] = p[d] + (w0 + (w1 + w2 * h) * h) * h;
                change[d] = (w0 + (2.0 * w1 + 3.0 * w2 * h) * h) * slope;
            }
            [value, change]
        })
    }

    /// Writes the pinned control points of `z` into the iterate.
    pub(crate) fn pin(&self, point: &mut Point<D>) {
        for (control, pinned) in point.control.iter_mut().zip(self.pinned(point.z)) {
            *control = pinned[0];
        }
        let first = point.control.len().saturating_sub(4);
        for (k, pinned) in self.pinned_last(point.z).into_iter().flatten().enumerate() {
            point.control[first + k] = pinned[0];
        }
    }

    /// Bound of the difference of order `k` (1 to 3) in group `g` at `z`, with
    /// its first and second derivative to `z`.
    pub(crate) fn cap(&self, g: usize, k: usize, z: f64, room: &Room) -> [f64; 3] {
        let h = self.spacing(z);
        let power = k as f64 / 3.0;
        let value = self.groups[g].caps[k - 1] * room.caps[g][k - 1] * h.powi(k as i32);
        [
            value,
            value * power / z,
            value * power * (power - 1.0) / (z * z),
        ]
    }

    /// Offset of a point of group `g` from the nearest point of the path near a leg, and that
    /// point.
    ///
    /// Starts at the leg and changes to the next or previous leg while the nearest point is at the
    /// end of a leg and the distance falls. So a fine division of the path does not hinder motion
    /// along it.
    #[inline]
    pub(crate) fn nearest(&self, point: &[f64; 3], leg: usize, g: usize) -> Foot {
        let ways = &self.ways[g];
        let mut best = ways[leg - 1].foot(point, leg);
        for _ in 0..8 {
            let next = if best.share <= 0.0 {
                best.leg - 1
            } else if best.share >= 1.0 {
                best.leg + 1
            } else {
                break;
            };
            if next < 1 || next > ways.len() {
                break;
            }
            let other = ways[next - 1].foot(point, next);
            if square(&other.offset) >= square(&best.offset) {
                break;
            }
            best = other;
        }
        best
    }

    /// A leg (index of its far vertex) in group `g`.
    #[inline(always)]
    pub(crate) fn way(&self, leg: usize, g: usize) -> &Way {
        &self.ways[g][leg - 1]
    }

    /// Direction along which the nearest point of the path moves; zero at a corner.
    pub(crate) fn slide(&self, foot: &Foot, g: usize) -> [f64; 3] {
        let way = &self.ways[g][foot.leg - 1];
        let free = if foot.share > 0.0 && foot.share < 1.0 {
            way.inverse.sqrt()
        } else {
            0.0
        };
        way.way.map(|x| x * free)
    }

    /// Barrier parameter: twice the number of constraints that are norms, and the number of those that are linear.
    pub(crate) fn parameter(&self, point: &Point<D>) -> f64 {
        let knots = point.control.len() as f64;
        let corridor = if self.groups[0].width.is_finite() {
            2.0
        } else {
            0.0
        };
        let balls = self.heavy(point) * point.crossings.len() as f64;
        let norms = Self::GROUPS as f64 * (knots * (3.0 + corridor) + balls);
        let joints = (BOUNDS * self.joints.len()) as f64 * knots;
        2.0 * (norms + joints) + self.forward.len() as f64
    }

    /// Weight of a ball beside other constraints.
    pub(crate) fn heavy(&self, point: &Point<D>) -> f64 {
        if !Self::TURNS || point.crossings.is_empty() {
            return 1.0;
        }
        let knots = point.control.len() as f64;
        (BALLS * 5.0 * knots / point.crossings.len() as f64).max(1.0)
    }
}

impl<const D: usize> Point<D> {
    /// Number of spans.
    pub(crate) fn spans(&self) -> usize {
        self.control.len().saturating_sub(4)
    }

    /// Gives the last four control points the spare coordinate of the one before them: where a spare joint ends is free.
    pub(crate) fn end_spare(&mut self) {
        let last = self.control.len().saturating_sub(4);
        if let Some((spare, before)) = Problem::<D>::SPARE.zip(last.checked_sub(1)) {
            let end = self.control[before][spare];
            for control in &mut self.control[last..] {
                control[spare] = end;
            }
        }
    }

    /// The span of a time in knots, and the local parameter within it.
    pub(crate) fn locate(&self, time: f64) -> (usize, f64) {
        let last = self.spans().saturating_sub(1);
        let span = (time.max(0.0) as usize).min(last);
        (span, (time - span as f64).clamp(0.0, 1.0))
    }

    /// Position and first two derivatives (to knots) at a time in knots.
    pub(crate) fn at(&self, time: f64) -> [[f64; D]; 3] {
        let (span, share) = self.locate(time);
        self.with(span, &weights(share))
    }

    /// The sums of five control points from `first` on with weights.
    pub(crate) fn with<const M: usize>(&self, first: usize, w: &[[f64; 5]; M]) -> [[f64; D]; M] {
        let five = &self.control[first..first + 5];
        let mut result = [[0.0; D]; M];
        for (result, w) in result.iter_mut().zip(w) {
            for i in 0..5 {
                for d in 0..D {
                    result[d] += w[i] * five[i][d];
                }
            }
        }
        result
    }

    /// Position of group `g` at a time in knots.
    pub(crate) fn place(&self, time: f64, g: usize) -> [f64; 3] {
        let (span, share) = self.locate(time);
        self.sum(span, &basis::place(share), g)
    }

    /// Weighted sum of consecutive control points, the three of group `g`.
    pub(crate) fn sum<const M: usize>(&self, first: usize, w: &[f64; M], g: usize) -> [f64; 3] {
        let mut result = [0.0; 3];
        for (c, weight) in self.control[first..first + M].iter().zip(w) {
            for d in 0..3 {
                result[d] += weight * c[3 * g + d];
            }
        }
        result
    }

    /// Position of corridor sample `k`: knots (even) and middles of spans.
    pub(crate) fn sample(&self, k: usize, g: usize) -> [f64; 3] {
        let (first, w) = sample_weights(k);
        self.sum(first, w, g)
    }

    /// Number of corridor samples.
    pub(crate) fn samples(&self) -> usize {
        2 * self.spans()
    }
}

/// Changes of `count` control points that spread by `ends` from one to the next near either end.
pub(crate) fn spreading<const D: usize>(ends: [[f64; D]; 2], count: usize) -> Vec<[f64; D]> {
    let last = count - 1;
    let change = |k: usize| {
        let x = ((k as f64 - 3.0) / (last as f64 - 6.0)).clamp(0.0, 1.0);
        let share = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
        let (start, end) = (k as f64 - 1.5, 1.5 - (last - k) as f64);
        std::array::from_fn(|d| ends[0][d] * start * (1.0 - share) + ends[1][d] * end * share)
    };
    (0..count).map(change).collect()
}

/// First control point and weights of corridor sample `k`.
pub(crate) fn sample_weights(k: usize) -> (usize, &'static [f64; 5]) {
    (
        k / 2,
        if k.is_multiple_of(2) {
            &basis::AT_KNOT
        } else {
            &basis::AT_MIDDLE
        },
    )
}

/// Sum of squares.
pub(crate) fn square(y: &[f64; 3]) -> f64 {
    y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
}

/// The three coordinates of group `g`.
pub(crate) fn part<const D: usize>(x: &[f64; D], g: usize) -> [f64; 3] {
    [x[3 * g], x[3 * g + 1], x[3 * g + 2]]
}

/// One leg in one group.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    from: [f64; 3],
    way: [f64; 3],
    /// 1 / length squared; zero for a leg of no length.
    inverse: f64,
}

/// The point of the path nearest to a given one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    /// Offset of the given point from it.
    pub(crate) offset: [f64; 3],
    /// Its leg (index of the far vertex), and the fraction of that leg.
    pub(crate) leg: usize,
    pub(crate) share: f64,
}

/// The legs between vertices, by group.
pub(crate) fn ways<const D: usize>(vertices: &[[f64; D]]) -> [Vec<Way>; 2] {
    [0, 1].map(|g| {
        let pairs = vertices.windows(2).filter(|_| g < D / 3);
        pairs
            .map(|pair| {
                let (from, to) = (part(&pair[0], g), part(&pair[1], g));
                let way = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
                let length = square(&way);
                let inverse = if length > 0.0 { 1.0 / length } else { 0.0 };
                Way { from, way, inverse }
            })
            .collect()
    })
}

impl Way {
    /// The nearest point of this leg, which has index `leg`.
    #[inline]
    fn foot(&self, point: &[f64; 3], leg: usize) -> Foot {
        let (from, way) = (&self.from, &self.way);
        let off = [point[0] - from[0], point[1] - from[1], point[2] - from[2]];
        let along = off[0] * way[0] + off[1] * way[1] + off[2] * way[2];
        let share = if self.inverse > 0.0 {
            (along * self.inverse).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let offset = [
            off[0] - share * way[0],
            off[1] - share * way[1],
            off[2] - share * way[2],
        ];
        Foot { offset, leg, share }
    }

    /// Offsets of four points from this leg, by coordinate, if the nearest point of each lies between its ends.
    #[inline(always)]
    pub(crate) fn beside<S: Four>(&self, points: [F4<S>; 3]) -> Option<[F4<S>; 3]> {
        let simd = points[0].build();
        let [from, way] = [&self.from, &self.way];
        let x = points[0] - F4::splat(simd, from[0]);
        let y = points[1] - F4::splat(simd, from[1]);
        let z = points[2] - F4::splat(simd, from[2]);
        let share = (x * way[0] + y * way[1] + z * way[2]) * self.inverse;
        let inside = F4::splat(simd, f64::MIN_POSITIVE).le(share)
            & share.le(F4::splat(simd, 1.0 - f64::EPSILON));
        let offset = [x - share * way[0], y - share * way[1], z - share * way[2]];
        if inside.bits() == 0b1111 {
            Some(offset)
        } else {
            None
        }
    }

    /// Direction of the leg; zero for a leg of no length.
    #[inline(always)]
    pub(crate) fn direction(&self) -> [f64; 3] {
        let factor = self.inverse.sqrt();
        [
            self.way[0] * factor,
            self.way[1] * factor,
            self.way[2] * factor,
        ]
    }
}
