//! Minimum time over a spline through balls, as a convex problem.
//!
//! Unknown are the control points `c` and `z = (h / scale)^3`, with the knot
//! spacing `h`. With `D1, D2, D3` the differences of control points,
//! `|D1 c| <= V h`, `|D2 c| <= A h^2`, `|D3 c| <= J h^3` bound speed,
//! acceleration and jerk for every moment; in `z` all three are convex. A pass
//! is a ball around a pose at the closest approach, the corridor a distance
//! from the leg at each knot and between.

use super::basis::{self, START, weights};

/// What rules one group of three coordinates (position, or rotation vector).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Group {
    /// Speed, acceleration, jerk.
    pub(crate) caps: [f64; 3],
    /// Radius of the balls.
    pub(crate) radius: f64,
    /// Half width of the corridor; infinite: none.
    pub(crate) width: f64,
}

/// The problem in `D` coordinates, three to a group.
#[derive(Clone, Debug)]
pub(crate) struct Problem<const D: usize> {
    /// One for each three coordinates; the second is unused when `D = 3`.
    pub(crate) groups: [Group; 2],
    /// Corners of the way: start of the first leg, inner poses, goal.
    pub(crate) vertices: Vec<[f64; D]>,
    /// Position, velocity, acceleration and jerk at the start.
    pub(crate) start: [[f64; D]; 4],
    /// Knot spacing at `z = 1`, s.
    pub(crate) scale: f64,
    /// While a first iterate from a start in motion breaks limits, its first
    /// control points stay as for this `z`; a greater `z` only widens limits.
    pub(crate) anchor: Option<f64>,
}

/// One iterate: control points, `z`, passing times in knots, and by how much
/// each constraint is still widened.
#[derive(Clone, Debug)]
pub(crate) struct Point<const D: usize> {
    pub(crate) control: Vec<[f64; D]>,
    pub(crate) z: f64,
    /// Time of the pass of each inner vertex, in knot intervals.
    pub(crate) passes: Vec<f64>,
}

/// Widened bounds: what the present iterate needs until it is feasible.
#[derive(Clone, Debug)]
pub(crate) struct Room {
    /// Factor on speed, acceleration and jerk of each group.
    pub(crate) caps: [[f64; 3]; 2],
    /// Radius of each ball, by group.
    pub(crate) balls: [Vec<f64>; 2],
    /// Half width of the corridor at each sample, by group.
    pub(crate) widths: [Vec<f64>; 2],
    /// Leg of each corridor sample (index of its far vertex).
    pub(crate) legs: Vec<usize>,
}

impl<const D: usize> Problem<D> {
    /// Number of groups.
    pub(crate) const GROUPS: usize = D / 3;

    /// Whether the start is in motion.
    pub(crate) fn moving(&self) -> bool {
        self.start[1..].iter().flatten().any(|x| *x != 0.0)
    }

    /// Knot spacing, s.
    pub(crate) fn spacing(&self, z: f64) -> f64 {
        self.scale * z.cbrt()
    }

    /// Inner vertices: those with a ball.
    pub(crate) fn inner(&self) -> &[[f64; D]] {
        self.vertices
            .get(1..self.vertices.len().saturating_sub(1))
            .unwrap_or_default()
    }

    /// The first four control points at `z`, and their derivatives to `z`.
    pub(crate) fn pinned(&self, z: f64) -> [[[f64; D]; 2]; 4] {
        let h = self.spacing(self.anchor.unwrap_or(z));
        let slope = if self.anchor.is_some() {
            0.0
        } else {
            h / (3.0 * z)
        };
        let [p, v, a, j] = &self.start;
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

    /// Nearest point of the way near a leg: its leg and share of that leg.
    ///
    /// Starts at the leg and moves on to the next or back to the one before
    /// while the nearest point is at the end of a leg and that helps: motion
    /// along a finely divided way is not held up by its division.
    pub(crate) fn nearest(&self, point: &[f64; 3], leg: usize, g: usize) -> (usize, f64) {
        let (mut best, mut share) = self.on(point, leg, g);
        let mut at = leg;
        for _ in 0..8 {
            let next = if share <= 0.0 {
                at - 1
            } else if share >= 1.0 {
                at + 1
            } else {
                break;
            };
            if next < 1 || next >= self.vertices.len() {
                break;
            }
            let (other, there) = self.on(point, next, g);
            if square(&other) >= square(&best) {
                break;
            }
            (best, share, at) = (other, there, next);
        }
        (at, share)
    }

    /// Offset of a point of group `g` from the nearest point of the way near a
    /// leg, and the direction along which that nearest point slides.
    pub(crate) fn offset(&self, point: &[f64; 3], leg: usize, g: usize) -> ([f64; 3], [f64; 3]) {
        let (at, share) = self.nearest(point, leg, g);
        let (from, to) = (part(&self.vertices[at - 1], g), part(&self.vertices[at], g));
        let way = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
        let free = if share > 0.0 && share < 1.0 {
            1.0 / square(&way).sqrt()
        } else {
            0.0
        };
        (self.on(point, at, g).0, way.map(|x| x * free))
    }

    fn on(&self, point: &[f64; 3], leg: usize, g: usize) -> ([f64; 3], f64) {
        offset(
            point,
            &part(&self.vertices[leg - 1], g),
            &part(&self.vertices[leg], g),
        )
    }

    /// Barrier parameter: twice the number of norm constraints.
    pub(crate) fn parameter(&self, point: &Point<D>) -> f64 {
        let knots = point.control.len() as f64;
        let corridor = if self.groups[0].width.is_finite() {
            2.0
        } else {
            0.0
        };
        2.0 * Self::GROUPS as f64 * (knots * (3.0 + corridor) + point.passes.len() as f64)
    }
}

impl<const D: usize> Point<D> {
    /// Number of spans.
    pub(crate) fn spans(&self) -> usize {
        self.control.len().saturating_sub(4)
    }

    /// The span of a time in knots, and the share within it.
    pub(crate) fn locate(&self, time: f64) -> (usize, f64) {
        let last = self.spans().saturating_sub(1);
        let span = (time.max(0.0) as usize).min(last);
        (span, (time - span as f64).clamp(0.0, 1.0))
    }

    /// Position and first two derivatives (to knots) at a time in knots.
    pub(crate) fn at(&self, time: f64) -> [[f64; D]; 3] {
        let (span, share) = self.locate(time);
        let w = weights(share);
        let mut result = [[0.0; D]; 3];
        for (i, c) in self.control.iter().skip(span).take(5).enumerate() {
            for k in 0..3 {
                for d in 0..D {
                    result[k][d] += w[k][i] * c[d];
                }
            }
        }
        result
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

/// Offset of a point from the nearest point of a segment, and the share of the
/// segment where that is.
fn offset(point: &[f64; 3], from: &[f64; 3], to: &[f64; 3]) -> ([f64; 3], f64) {
    let way = [to[0] - from[0], to[1] - from[1], to[2] - from[2]];
    let off = [point[0] - from[0], point[1] - from[1], point[2] - from[2]];
    let length = square(&way);
    if length <= 0.0 {
        return (off, 1.0);
    }
    let share = ((off[0] * way[0] + off[1] * way[1] + off[2] * way[2]) / length).clamp(0.0, 1.0);
    (
        [
            off[0] - share * way[0],
            off[1] - share * way[1],
            off[2] - share * way[2],
        ],
        share,
    )
}
