//! MoveSmoothlyTo through a long list where the joints rule: a search of the whole fails where the joints are known too badly in one
//! place, so parts are searched for themselves.
//!
//! Each part is planned from rest to rest, further than the next one begins; where both are in motion the joints go over from one to
//! the next. No rest is left between them, and the planning grows linearly with the list.

use std::ops::Range;

use kinematics::follow::FollowPoint;
use nalgebra::SVector;
use trajectory::bounds::JointsToTool;
use trajectory::smooth::{angular_tolerance, off_segment};
use trajectory::{JointPoint, ToolCurve, ToolPoint};

use super::certificate::{Arm, corridor};
use super::draft::Crossing;
use super::many::{BEGINNINGS, Beginning, or_sooner};
use super::seam::{Part, Seam};
use super::smooth_joints::{Followed, HELPED};
use super::{Blend, PlannedMove, Planner};
use crate::task::Move;

/// Poses of a part, as two divisions of a list have them, and how many of them are those of the next one, too.
const PARTS: [usize; 2] = [24, 32];
const OVERLAP: usize = 10;
/// Most legs over which a seam reaches at either side of its pose.
const LEGS: usize = 3;
/// Places of a seam at which its distance from the legs is looked at.
const LOOKS: u32 = 32;
/// Points nearer to each other than this are one, s.
const NEAR: f64 = 1e-6;

/// The rough curves from which searches of a part begin that does not turn.
const STEADY: [Beginning; 4] = [
    (None, [1.0, 1.0]),
    (Some(0.05), [1.0, 1.0]),
    (Some(0.5), [1.0, 0.6]),
    (Some(0.5), [0.7, 1.0]),
];

/// The tool along parts and seams, by the time up to which it is on each.
struct AlongParts<'a, const N: usize> {
    planner: &'a Planner<N>,
    parts: &'a [Part<N>],
    seams: &'a [Seam],
    /// When each part would begin, s.
    starts: Vec<f64>,
    /// The joints along all of it, whose parameter is time.
    points: Vec<FollowPoint<N>>,
}

impl<const N: usize> ToolCurve for AlongParts<'_, N> {
    fn end(&self) -> f64 {
        let (last, part) = (self.parts.len() - 1, &self.parts[self.parts.len() - 1]);
        self.starts[last] + part.followed.path.plan.duration()
    }

    fn knots(&self) -> Vec<f64> {
        self.points.iter().map(|point| point.u).collect()
    }

    fn at(&self, u: f64) -> ToolPoint {
        let ended = |(p, seam): (usize, &Seam)| self.starts[p] + seam.within[1] <= u;
        let seams = self.seams.iter().enumerate();
        let p = seams.take_while(|seam| ended(*seam)).count();
        let time = u - self.starts[p];
        match self.seams.get(p) {
            Some(seam) if time > seam.within[0] => {
                let q = seam.at(self.pair(p), time);
                Arm(self.planner.chain()).motion(&JointPoint { q })
            }
            _ => self.parts[p].followed.path.plan.at(time),
        }
    }
}

impl<'a, const N: usize> AlongParts<'a, N> {
    fn new(planner: &'a Planner<N>, parts: &'a [Part<N>], seams: &'a [Seam]) -> Self {
        let mut starts = vec![0.0];
        for seam in seams {
            starts.push(starts[starts.len() - 1] - seam.shift);
        }
        let mut all = Self {
            planner,
            parts,
            seams,
            starts,
            points: Vec::new(),
        };
        all.points = all.joints();
        all
    }

    /// A part and the next one.
    fn pair(&self, p: usize) -> (&Part<N>, &Part<N>) {
        (&self.parts[p], &self.parts[p + 1])
    }

    /// The joints along all of it, whose parameter is time.
    fn joints(&self) -> Vec<FollowPoint<N>> {
        let mut all: Vec<FollowPoint<N>> = Vec::new();
        for (p, part) in self.parts.iter().enumerate() {
            let start = self.starts[p];
            let later = |point: &FollowPoint<N>| FollowPoint {
                u: point.u + start,
                ..*point
            };
            let since = all.last().map_or(f64::NEG_INFINITY, |last| last.u + NEAR);
            let seam = self.seams.get(p);
            let until = seam.map_or(f64::INFINITY, |seam| start + seam.within[0] - NEAR);
            let inner = part.followed.points.iter().map(later);
            all.extend(inner.filter(|point| since < point.u && point.u < until));
            let seam = seam.map(|seam| seam.points(self.pair(p)));
            all.extend(seam.iter().flatten().map(later));
        }
        all
    }

    /// When it passes the poses but the last, s.
    fn crossings(&self) -> Vec<Crossing> {
        let mut all = Vec::new();
        for (p, seam) in self.seams.iter().enumerate() {
            // Where both parts pass, or only the first does.
            let (first, second) = self.pair(p);
            let pass = |pose: usize| {
                if pose < second.poses.start {
                    first.pass(pose)
                } else {
                    seam.pass((first, second), pose)
                }
            };
            let known = all.len()..first.poses.end - 1;
            all.extend(known.map(|pose| self.starts[p] + pass(pose)));
        }
        let last = self.parts.len() - 1;
        let known = all.len()..self.parts[last].poses.end - 1;
        all.extend(known.map(|pose| self.starts[last] + self.parts[last].pass(pose)));
        let all = all.into_iter();
        all.map(|time| Crossing { time, rests: None }).collect()
    }
}

/// Whether so many poses are no more than one part of about this size.
fn is_whole(size: usize, poses: usize) -> bool {
    poses <= size + size / 2
}

impl<const N: usize> Planner<N> {
    /// The motion through a list of more than one part, each of which is searched for itself: the faster one of those along two
    /// divisions of the list.
    pub(super) fn in_parts(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Option<PlannedMove<N>> {
        let [few, many] = PARTS.map(|size| self.in_parts_of(size, motion, start));
        or_sooner(few, many)
    }

    /// Whether a list is no more than one part.
    pub(super) fn is_one_part(motion: &Move) -> bool {
        is_whole(PARTS[0], motion.poses.len())
    }

    /// The motion through a list whose parts of so many poses are searched for themselves; `None` where two of them do not meet, and
    /// where one rests on its way.
    fn in_parts_of(
        &self,
        size: usize,
        motion: &Move,
        start: &SVector<f64, N>,
    ) -> Option<PlannedMove<N>> {
        let count = motion.poses.len();
        let (mut parts, mut seams) = (Vec::<Part<N>>::new(), Vec::new());
        let (mut from, mut joints) = (0, *start);
        loop {
            let short = is_whole(size, count - from);
            let end = if short { count } else { from + size };
            let part = Part::new(from..end, self.part(motion, from..end, &joints)?);
            let moves = !part.followed.points.is_empty();
            if !moves || part.followed.path.blend().fallbacks > 0 {
                return None;
            }
            if let Some(before) = parts.last() {
                seams.push(self.seam((before, &part), motion)?);
            }
            if short {
                parts.push(part);
                return self.along_parts(motion, start, (&parts, &seams));
            }
            from = end - OVERLAP;
            let near = part.at(part.pass(from - 1))[0];
            joints = self.solver.nearest(&motion.poses[from - 1], &near).ok()?.q;
            parts.push(part);
        }
    }

    /// The joints along the fastest curve that is found through the poses of a part; from straight moves only where they follow no other.
    fn part(
        &self,
        motion: &Move,
        poses: Range<usize>,
        start: &SVector<f64, N>,
    ) -> Option<Followed<N>> {
        let part = Move {
            poses: motion.poses[poses].to_vec(),
            ..motion.clone()
        };
        let beginnings: &[Beginning] = if self.turns(&part, start) {
            &BEGINNINGS
        } else {
            &STEADY
        };
        let mut best: Option<(f64, Followed<N>)> = None;
        for beginning in beginnings {
            let Ok((curve, course)) = self.rough(&part, start, *beginning) else {
                continue;
            };
            let ruled = course.time > HELPED * curve.path.plan.duration();
            let found = self.searched_along(&part, start, course);
            let ends = found.is_some() || !ruled;
            let followed = found.unwrap_or(curve);
            let time = self.about_time(&followed.points);
            if best.as_ref().is_none_or(|(known, _)| time < *known) {
                best = Some((time, followed));
            }
            if ends {
                break;
            }
        }
        let from_stops = || {
            let stops = self.stops(&part, start).ok()?;
            self.searched_along(&part, start, stops)
        };
        best.map(|(_, followed)| followed).or_else(from_stops)
    }

    /// The seam between two parts at which least time is lost.
    fn seam(&self, parts: (&Part<N>, &Part<N>), motion: &Move) -> Option<Seam> {
        let inner = parts.1.poses.start..parts.0.poses.end - 1;
        let mut best: Option<(f64, Seam)> = None;
        for pose in inner.clone() {
            for legs in 1..=LEGS {
                // It begins and ends between poses that both parts pass.
                if pose < inner.start + legs || pose + legs >= inner.end {
                    break;
                }
                let seam = Seam::around(parts, pose, legs);
                let points = seam.points(parts);
                let [from, to] = seam.within;
                let lost = self.about_time(&points) - (to - from);
                let better = best.is_none_or(|(least, _)| lost < least);
                if better && lost.is_finite() && self.is_near(&seam, parts, motion) {
                    best = Some((lost, seam));
                }
            }
        }
        best.map(|(_, seam)| seam)
    }

    /// Whether a seam passes its poses within their tolerances and is near enough to its legs between them.
    fn is_near(&self, seam: &Seam, parts: (&Part<N>, &Part<N>), motion: &Move) -> bool {
        let seen = |time: f64| self.chain().forward(&seam.at(parts, time)[0]);
        let inner = parts.1.poses.start..parts.0.poses.end - 1;
        let passes: Vec<f64> = inner.clone().map(|pose| seam.pass(parts, pose)).collect();
        let [from, to] = seam.within;
        let angle = angular_tolerance(motion.tolerance);
        let mut passed = passes.iter().zip(inner.clone());
        let sees = passed.all(|(time, pose)| {
            let gap = motion.poses[pose].inv_mul(&seen(*time));
            let near = gap.translation.vector.norm() <= motion.tolerance;
            !(from..to).contains(time) || near && gap.rotation.angle() <= angle
        });
        let mut times = (1..LOOKS).map(|k| from + (to - from) * f64::from(k) / f64::from(LOOKS));
        sees && times.all(|time| {
            let next = inner.start + passes.partition_point(|pass| *pass <= time);
            let place = seen(time).translation.vector;
            let leg = [next - 1, next].map(|pose| motion.poses[pose].translation.vector);
            off_segment(&place, &leg) <= corridor(motion)
        })
    }

    /// The motion along parts and seams, certified.
    fn along_parts(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        (parts, seams): (&[Part<N>], &[Seam]),
    ) -> Option<PlannedMove<N>> {
        let curve = AlongParts::new(self, parts, seams);
        let along = (curve.points.as_slice(), f64::INFINITY);
        let draft = self.fastest_along(&curve, along, (&curve.crossings(), motion));
        let planned = self.certify(motion, start, draft.ok()?).ok()?;
        let plans = parts.iter().map(|part| part.followed.path.blend());
        let jerks = plans.map(|blend| blend.jerk_ratio);
        let blend = Blend {
            tolerance: motion.tolerance,
            exact_stop: self.least_of_legs(motion, start).iter().sum(),
            corridor_ratio: planned.certificate.corridor_m.unwrap_or(0.0) / motion.tolerance,
            jerk_ratio: jerks.fold(0.0, f64::max),
            fallbacks: 0,
        };
        Some(PlannedMove {
            blend: Some(blend),
            ..planned
        })
    }
}
