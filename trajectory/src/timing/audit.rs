//! Bounds of every limited quantity over a motion in pieces.

use nalgebra::{SVector, Vector3};
use realtime::Piece;

use super::bound::{Precision, bound};
use super::grid::Bounded;
use super::gridpoints::ToolGridpoint;
use super::pieces::Pieces;
use super::reachability::ASIDE;
use crate::active::Active;
use crate::hull::{FLOOR, Hulls, TOLERANCE};
use crate::limit::{ActiveSpan, Limit, LimitPeak, order, root};
use crate::near_ends;
use crate::{JointLimits, Path, ToolLimits, ToolPoint};
use simd::Build;

/// A limit counts as active from this ratio on.
const ACTIVE: f64 = 0.97;

/// Ratios of every limit over every piece.
#[derive(Clone, Debug)]
pub(super) struct Audit {
    /// The finite limits.
    pub limits: Vec<Limit>,
    /// One row for each piece, one column for each of `limits`.
    pub ratios: Vec<f64>,
    /// The factor by which time has to be stretched for every limit to hold; below 1 if the motion
    /// could be faster.
    pub stretch: f64,
    /// What sampled tool ratios were raised by, at most.
    pub tool_margin: f64,
    durations: Vec<f64>,
}

impl Audit {
    /// Bounds every limit over every piece.
    pub(super) fn new<const N: usize>(bounded: Bounded<'_, N>, pieces: &Pieces<N>) -> Self {
        let joint = [
            bounded.joint.velocity,
            bounded.joint.acceleration,
            bounded.joint.jerk,
        ];
        let tool = tool_limits(bounded.tool);
        let mut limits = joint_limits(&joint);
        limits.extend(tool.iter().flatten().map(|(limit, _)| *limit));
        limits.extend(bounded.options.rate_cap.map(|_| Limit::Rate));
        let mut audit = Self {
            ratios: Vec::with_capacity(limits.len() * pieces.joint.len()),
            limits,
            stretch: 0.0,
            tool_margin: 0.0,
            durations: pieces.joint.iter().map(|piece| piece.duration).collect(),
        };
        let joint = JointBounds::new(joint);
        let rate = bounded.options.rate_cap.map(|cap| {
            let free = SVector::repeat(f64::INFINITY);
            JointBounds::new([SVector::repeat(cap), free, free])
        });
        let mut seen = Seen::at(bounded.path, 0.0, 0.0);
        let mut knots = Knots::new(bounded.path);
        for (piece, law) in pieces.joint.iter().zip(&pieces.law) {
            let row = audit.ratios.len();
            joint.push(piece, &mut audit.ratios);
            raise_near_ends(piece, bounded.joint, &mut audit.ratios[row..]);
            if bounded.tool.limited() {
                audit.push_tool(bounded.path, law, &tool, (&mut seen, &mut knots));
            }
            if let Some(rate) = &rate {
                rate.push(law, &mut audit.ratios);
            }
        }
        audit.stretch = audit.stretch_from(0);
        audit
    }

    /// Adds the ratios of the tool over one piece.
    fn push_tool<const N: usize>(
        &mut self,
        path: &dyn Path<N>,
        law: &Piece<1>,
        tool: &[Option<(Limit, f64)>; 6],
        (seen, knots): (&mut Seen, &mut Knots<'_>),
    ) {
        // At a knot the jerk of the path may jump: it counts as seen from inside the piece.
        let sides = [(0.0, 1.0), (law.duration, -1.0)].map(|(t, side)| {
            let is_knot = knots.contain(law.sample(t).position[0]);
            if is_knot { side } else { 0.0 }
        });
        let narrow = tool.map(|entry| entry.map_or(0.0, |(_, limit)| 1.0 / limit));
        let at = |quarter: u8, seen: &mut Seen| {
            let t = 0.25 * law.duration * f64::from(quarter);
            let side = match quarter {
                0 => sides[0],
                4 => sides[1],
                _ => 0.0,
            };
            let norms = tool_norms(path, law, (t, side), seen);
            SVector::from(norms).component_mul(&SVector::from(narrow))
        };
        let few = [at(0, seen), at(2, seen), at(4, seen)];
        let mut found = peaks(&few);
        // Far from all limits no closer look is needed.
        if !found.iter().all(|[most, margin]| most + margin < FLOOR) {
            let mut aside = *seen;
            let [first, last] = [1, 3].map(|quarter| at(quarter, &mut aside));
            found = peaks(&[few[0], first, few[1], last, few[2]]);
        }
        for ([most, margin], _) in found
            .into_iter()
            .zip(tool)
            .filter(|(_, limit)| limit.is_some())
        {
            self.tool_margin = self.tool_margin.max(margin);
            self.ratios.push(most + margin);
        }
    }

    /// The ratios piece by piece.
    fn rows(&self) -> std::slice::Chunks<'_, f64> {
        self.ratios.chunks(self.limits.len().max(1))
    }

    /// As [`Audit::stretch`], of all pieces but the first.
    pub(super) fn stretch_after_first(&self) -> f64 {
        self.stretch_from(1)
    }

    fn stretch_from(&self, first: usize) -> f64 {
        let mut most = vec![0.0_f64; self.limits.len()];
        for row in self.rows().skip(first) {
            for (most, ratio) in most.iter_mut().zip(row) {
                *most = if *ratio > *most { *ratio } else { *most };
            }
        }
        let pairs = self.limits.iter().zip(most);
        let factors = pairs.map(|(limit, most)| root(most, order(*limit)));
        factors.fold(0.0, f64::max)
    }

    /// The limit with the highest ratio in the first piece, and that ratio.
    pub(super) fn first(&self) -> (Option<Limit>, f64) {
        let pairs = self.limits.iter().zip(&self.ratios);
        let most = pairs.max_by(|a, b| a.1.total_cmp(b.1));
        most.map_or((None, 0.0), |(limit, ratio)| (Some(*limit), *ratio))
    }

    /// Each limit's peak once time is stretched by `factor`.
    pub(super) fn peaks(&self, factor: f64) -> Vec<LimitPeak> {
        let none = |limit: &Limit| LimitPeak {
            limit: *limit,
            ratio: 0.0,
            time: 0.0,
        };
        let mut peaks: Vec<LimitPeak> = self.limits.iter().map(none).collect();
        let mut clock = 0.0;
        for (row, duration) in self.rows().zip(&self.durations) {
            for (peak, ratio) in peaks.iter_mut().zip(row) {
                if *ratio > peak.ratio {
                    (peak.ratio, peak.time) = (*ratio, clock + 0.5 * duration);
                }
            }
            clock += duration;
        }
        for peak in &mut peaks {
            peak.ratio /= factor.powi(order(peak.limit));
            peak.time *= factor;
        }
        peaks
    }

    /// Which limit is active when, once time is stretched by `factor`.
    pub(super) fn active(&self, factor: f64) -> Vec<ActiveSpan> {
        let from = |limit: &Limit| ACTIVE * factor.powi(order(*limit));
        let least: Vec<f64> = self.limits.iter().map(from).collect();
        let mut active = Active::with(self.limits.clone(), least);
        let mut clock = 0.0;
        for (row, duration) in self.rows().zip(&self.durations) {
            active.add(clock, row);
            clock += duration * factor;
        }
        active.finish(clock)
    }
}

/// The largest of values at equal steps of time, and by how much a peak between them may be higher, as
/// their second differences tell.
fn peaks<const M: usize>(values: &[SVector<f64, 6>; M]) -> [[f64; 2]; 6] {
    let (mut most, mut bend) = (values[0], SVector::<f64, 6>::zeros());
    for three in values.windows(3) {
        most = most.sup(&three[1]).sup(&three[2]);
        bend = bend.sup(&(three[0] - three[1] * 2.0 + three[2]).abs());
    }
    std::array::from_fn(|k| [most[k], 0.125 * bend[k]])
}

/// The finite limits of the joints.
fn joint_limits<const N: usize>(values: &[SVector<f64, N>; 3]) -> Vec<Limit> {
    let names = [
        Limit::JointVelocity,
        Limit::JointAcceleration,
        Limit::JointJerk,
    ];
    let mut limits = Vec::with_capacity(3 * N + 7);
    for (name, values) in names.into_iter().zip(values) {
        let finite = (0..N).filter(|j| values[*j].is_finite());
        limits.extend(finite.map(name));
    }
    limits
}

/// Raises the ratios of speeds over a piece, joints with a finite limit first, where less is allowed
/// near the ends of the range.
fn raise_near_ends<const N: usize>(piece: &Piece<N>, limits: &JointLimits<N>, ratios: &mut [f64]) {
    if limits.ends.is_none() {
        return;
    }
    let finite = (0..N).filter(|j| limits.velocity[*j].is_finite());
    for (ratio, joint) in ratios.iter_mut().zip(finite) {
        *ratio = ratio.max(near_ends::ratio(piece, limits, joint));
    }
}

/// The finite limits of the tool, in the order of [`tool_norms`].
fn tool_limits(tool: &ToolLimits) -> [Option<(Limit, f64)>; 6] {
    [
        (Limit::ToolSpeed, tool.speed),
        (Limit::ToolAcceleration, tool.acceleration),
        (Limit::ToolJerk, tool.jerk),
        (Limit::AngularSpeed, tool.angular_speed),
        (Limit::AngularAcceleration, tool.angular_acceleration),
        (Limit::AngularJerk, tool.angular_jerk),
    ]
    .map(|entry| entry.1.is_finite().then_some(entry))
}

/// Bounds velocity, acceleration and jerk of joints over pieces.
struct JointBounds<const N: usize> {
    limits: [SVector<f64, N>; 3],
    /// One over each limit.
    narrow: [SVector<f64, N>; 3],
    /// Whether all limits of an order are finite.
    all: [bool; 3],
    build: Build,
}

impl<const N: usize> JointBounds<N> {
    fn new(limits: [SVector<f64, N>; 3]) -> Self {
        Self {
            narrow: limits.map(|limit| limit.map(|x| 1.0 / x)),
            all: limits.map(|limit| limit.iter().all(|x| x.is_finite())),
            limits,
            build: Build::detect(),
        }
    }

    /// Adds the ratio of each finite limit over a piece.
    fn push(&self, piece: &Piece<N>, ratios: &mut Vec<f64>) {
        let narrow = &self.narrow;
        let mut hulls = self.build.run(Hulls { piece, narrow });
        for (order, hull) in hulls.iter_mut().enumerate() {
            if hull.loose {
                for j in 0..N {
                    if hull.most[j] > FLOOR && hull.most[j] - hull.ends[j] > TOLERANCE {
                        hull.most[j] = self.tight(piece, order, j);
                    }
                }
            }
            if self.all[order] {
                ratios.extend_from_slice(&hull.most);
            } else {
                let finite = (0..N).filter(|j| self.limits[order][*j].is_finite());
                ratios.extend(finite.map(|j| hull.most[j]));
            }
        }
    }

    /// The ratio of one derivative of one joint over a piece.
    fn tight(&self, piece: &Piece<N>, order: usize, j: usize) -> f64 {
        let [_, c1, c2, c3, c4, c5] = &piece.coefficients;
        let (c1, c2, c3, c4, c5) = (c1[j], c2[j], c3[j], c4[j], c5[j]);
        let limit = self.limits[order][j];
        let precision = Precision {
            floor: FLOOR * limit,
            tolerance: TOLERANCE * limit,
        };
        let found = match order {
            0 => {
                let v = [c1, 2.0 * c2, 3.0 * c3, 4.0 * c4, 5.0 * c5];
                bound(&v, piece.duration, precision)
            }
            1 => {
                let a = [2.0 * c2, 6.0 * c3, 12.0 * c4, 20.0 * c5];
                bound(&a, piece.duration, precision)
            }
            _ => bound(&[6.0 * c3, 24.0 * c4, 60.0 * c5], piece.duration, precision),
        };
        found / limit
    }
}

/// The tool at the place of the path that was looked at last: a piece starts where the one before it
/// ends.
#[derive(Clone, Copy)]
struct Seen {
    u: f64,
    tool: ToolPoint,
}

impl Seen {
    /// The tool there, or beside it: before it (-1) or after it (1).
    fn at<const N: usize>(path: &dyn Path<N>, u: f64, side: f64) -> Self {
        let end = path.end();
        let tool = path.tool_at((u + side * ASIDE * end).clamp(0.0, end));
        Self { u, tool }
    }
}

/// The knots of a path, for places that ascend.
struct Knots<'a> {
    /// Those that are not behind.
    ahead: &'a [f64],
    near: f64,
}

impl<'a> Knots<'a> {
    fn new<const N: usize>(path: &'a dyn Path<N>) -> Self {
        Self {
            ahead: path.knots(),
            near: NEAR * path.end(),
        }
    }

    /// Whether a place, not before the one of the last question, is a knot.
    fn contain(&mut self, u: f64) -> bool {
        while let [first, rest @ ..] = self.ahead
            && *first < u - self.near
        {
            self.ahead = rest;
        }
        let next = self.ahead.first();
        next.is_some_and(|knot| *knot <= u + self.near)
    }
}

/// Speed, acceleration, jerk of the tool, then the angular ones, at `t` in a piece of the law, as seen from before it (-1), there
/// or after it (1).
fn tool_norms<const N: usize>(
    path: &dyn Path<N>,
    law: &Piece<1>,
    (t, side): (f64, f64),
    seen: &mut Seen,
) -> [f64; 6] {
    let at = law.sample(t);
    let reparametrization = [
        at.position[0],
        at.velocity[0],
        at.acceleration[0],
        at.jerk[0],
    ];
    let (u, end) = (at.position[0].clamp(0.0, path.end()), path.end());
    // NaN is looked at again.
    let same = (u - seen.u).abs() <= SAME * end;
    if !same || side != 0.0 {
        *seen = Seen::at(path, u, side);
    }
    let local = ToolGridpoint::new(&seen.tool, reparametrization);
    let norm = |v: Vector3<f64>| v.norm();
    let [l1, l2, l3] = local.linear.map(norm);
    let [a1, a2, a3] = local.angular.map(norm);
    [l1, l2, l3, a1, a2, a3]
}

/// Places that are nearer to each other than this fraction of the path are the same.
const SAME: f64 = 1e-13;
/// The same of a knot: a law comes to it up to rounding.
const NEAR: f64 = 1e-11;
