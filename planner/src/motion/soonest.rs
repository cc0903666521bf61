//! The search for the motion in joint space that ends soonest, among several ends and two ways to
//! each.
//!
//! Every way has a lower bound of its time, which becomes closer step by step. The way with the
//! least bound is looked at next, a line whose law without jerk limits is known when its expected time
//! comes, until a motion is known that no bound is below. So only few motions are computed in full, and
//! the result is the fastest of all.

use std::cell::OnceCell;
use std::cmp::Ordering;

use nalgebra::SVector;
use trajectory::bounds::JointsToTool;
use trajectory::otg::{self, Otg};
use trajectory::timing::{PathTiming, least_time};
use trajectory::{
    Boundary, JointLine, JointPoint, SampledLine, TimingOptions, ToolLimits, Trajectory,
};

use super::certificate::Arm;
use super::{Draft, MotionError, Planner};
use crate::task::Move;

/// Parts of a line in joint space whose chords bound the path of the tool.
const CHORDS: usize = 8;

/// The least gain of time for which an additional end is looked at.
const GAIN: f64 = 0.014;

/// Times that differ by less than this share are equal: laws are known to about so much. Of equal ways that to the
/// first end is taken.
const EQUAL: f64 = 5e-4;

/// A path is timed from rest to rest, with wider cells where no limit takes the place of another.
pub(super) const RESTING: TimingOptions = TimingOptions {
    start: Boundary::Rest,
    end: Boundary::Rest,
    rate_cap: None,
    cells: None,
    widest: 8,
    fine: false,
    fit: 1e-8,
    gap: 4e-4,
    reserve: 0.0,
};

/// The same of an arm with seven joints, whose laws are searched from near the limits. The gap is so small that
/// hardly any motion is slower than with a search that begins far from them.
const NEAR: TimingOptions = TimingOptions {
    gap: 2e-4,
    ..RESTING
};

/// How far one way to one end has been looked at.
enum Stage<'a, const N: usize> {
    /// Nothing is known but what each joint needs.
    End,
    /// The motion that the joints alone allow.
    Free(Trajectory<N>),
    /// The same; it is also known about how much slower the tool makes it.
    Slower(Trajectory<N>),
    /// A line in joint space.
    Line,
    /// The same with its fastest law without jerk limits.
    Timed(Box<PathTiming<'a, N>>),
}

/// One way to one end.
struct Open<'a, const N: usize> {
    /// No motion this way is shorter, s.
    least: f64,
    /// When it is looked at, among the others: the bound, or about how long the motion takes, s.
    turn: f64,
    end: usize,
    stage: Stage<'a, N>,
}

/// The search from one start.
struct Search<'a, const N: usize> {
    planner: &'a Planner<N>,
    motion: &'a Move,
    start: &'a SVector<f64, N>,
    ends: &'a [SVector<f64, N>],
    /// The line to each end, once it is looked at.
    lines: &'a [OnceCell<SampledLine<N>>],
    open: Vec<Open<'a, N>>,
    /// How many of the ends are looked at however little they gain.
    sure: usize,
    /// The fastest motion so far and its end.
    best: Option<(Draft<N>, usize)>,
    refusal: Option<MotionError>,
}

impl<const N: usize> Planner<N> {
    /// The motion within the limits of joints and tool that ends soonest at one of `ends`. An end
    /// after the first `sure` ones is left out if it can gain only [`GAIN`].
    ///
    /// # Errors
    /// The reason why no end can be reached; [`MotionError::NoWay`] if there is none.
    pub(super) fn soonest(
        &self,
        motion: &Move,
        start: &SVector<f64, N>,
        ends: &[SVector<f64, N>],
        sure: usize,
    ) -> Result<Draft<N>, MotionError> {
        let lines = vec![OnceCell::new(); ends.len()];
        let open = ends.iter().enumerate().map(|(end, goal)| {
            let least = self.least_of_joints(start, goal);
            Open {
                least,
                turn: least,
                end,
                stage: Stage::End,
            }
        });
        let mut search = Search {
            planner: self,
            motion,
            start,
            ends,
            lines: &lines,
            open: open.collect(),
            sure,
            best: None,
            refusal: None,
        };
        while search.look() {}
        let none = search.refusal.unwrap_or(MotionError::NoWay);
        search.best.map(|(draft, _)| draft).ok_or(none)
    }

    /// The fastest motion from rest to rest that the joints alone allow.
    fn rest_to_rest(
        &self,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
    ) -> Result<Trajectory<N>, MotionError> {
        let plan = Otg::plan(
            &otg::State::rest(*start),
            &otg::State::rest(*goal),
            &otg::Limits::from(&self.limits),
            &otg::Options::default(),
        );
        Ok(Trajectory::new(plan?.pieces()))
    }

    /// A lower bound (s) of the time along the line in joint space, from the chords of the tool's
    /// path.
    pub(super) fn least_of_line(
        &self,
        start: &SVector<f64, N>,
        goal: &SVector<f64, N>,
        limits: &ToolLimits,
    ) -> f64 {
        let mut last = self.chain().forward(start);
        let (mut way, mut turn) = (0.0, 0.0);
        for part in 1..=CHORDS {
            let share = part as f64 / CHORDS as f64;
            let next = self.chain().forward(&start.lerp(goal, share));
            way += (next.translation.vector - last.translation.vector).norm();
            turn += next.rotation.angle_to(&last.rotation);
            last = next;
        }
        // Along a bend the jerk of the tool is not that of the distance.
        let free = f64::INFINITY;
        let linear = least_time(way, [limits.speed, limits.acceleration, free]);
        let angular = [limits.angular_speed, limits.angular_acceleration, free];
        let tool = linear.max(least_time(turn, angular));
        tool.max(self.least_of_joints(start, goal))
    }

    /// A factor by which time has to be stretched at least so that the tool keeps its limits, from
    /// samples.
    pub(super) fn least_stretch(&self, motion: &Trajectory<N>, limits: &ToolLimits) -> f64 {
        let mut most = [0.0_f64; 6];
        for piece in motion.pieces() {
            for share in [0.0, 0.5, 1.0] {
                let s = piece.sample(share * piece.duration);
                let q = [s.position, s.velocity, s.acceleration, s.jerk];
                let seen = self.chain().motion(&q);
                let sizes = seen.linear.iter().chain(&seen.angular);
                for (most, size) in most.iter_mut().zip(sizes) {
                    *most = most.max(size.norm());
                }
            }
        }
        let [v, a, j, w, dw, ddw] = most;
        (v / limits.speed)
            .max(w / limits.angular_speed)
            .max(
                (a / limits.acceleration)
                    .max(dw / limits.angular_acceleration)
                    .sqrt(),
            )
            .max((j / limits.jerk).max(ddw / limits.angular_jerk).cbrt())
    }
}

impl<'a, const N: usize> Search<'a, N> {
    /// Looks closer at the way whose turn it is; false if no way can be faster than the best motion so
    /// far.
    fn look(&mut self) -> bool {
        let sure = self.sure;
        let worth = |end: usize, time: f64| time * (1.0 + if end < sure { 0.0 } else { GAIN });
        let open = std::mem::take(&mut self.open).into_iter();
        let open = open.filter(|way| worth(way.end, way.least) < self.limit(way.end));
        self.open = open.collect();
        let turns = self.open.iter().map(|way| worth(way.end, way.turn));
        // The first of equal ways, so that the order of the ends decides.
        let Some((index, _)) = turns.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)) else {
            return false;
        };
        let Open {
            end, stage, least, ..
        } = self.open.remove(index);
        match stage {
            Stage::End => self.expand(end, least),
            Stage::Free(free) => {
                let stretch = self.planner.least_stretch(&free, &self.motion.limits);
                // A little less, so that rounding does not lift it above the time itself.
                let slower = free.duration() * (stretch * (1.0 - 1e-9)).max(1.0);
                self.push(slower, end, Stage::Slower(free));
            }
            Stage::Slower(free) => self.keep(Draft::of(free), end),
            Stage::Line => {
                let (limits, tool) = (&self.planner.limits, &self.motion.limits);
                // With six joints it would save two percent.
                let options = if N > 6 { &NEAR } else { &RESTING };
                match PathTiming::new(self.line(end), limits, tool, options) {
                    Ok(timing) => {
                        let timing = if N > 6 { timing.near() } else { timing };
                        let least = least.max(timing.lower_bound());
                        self.open.push(Open {
                            least,
                            turn: least.max(timing.expected()),
                            end,
                            stage: Stage::Timed(Box::new(timing)),
                        });
                    }
                    // The other way to this end is never refused.
                    Err(_) => return true,
                }
            }
            Stage::Timed(timing) => {
                if let Ok(Some(timed)) = timing.solve_below(self.limit(end)) {
                    self.keep(Draft::of(timed.trajectory), end);
                }
            }
        }
        true
    }

    /// The line in joint space to an end.
    fn line(&self, end: usize) -> &'a SampledLine<N> {
        self.lines[end].get_or_init(|| {
            let tool = |joint: &JointPoint<N>| Arm(self.planner.chain()).motion(joint);
            SampledLine::new(&JointLine::new(*self.start, self.ends[end], tool))
        })
    }

    /// Opens both ways to an end.
    fn expand(&mut self, end: usize, least: f64) {
        let goal = &self.ends[end];
        match self.planner.rest_to_rest(self.start, goal) {
            Ok(free) => {
                let alone = free.duration().max(least);
                let limits = &self.motion.limits;
                let line = self.planner.least_of_line(self.start, goal, limits);
                self.push(free.duration(), end, Stage::Free(free));
                if alone > 0.0 {
                    self.push(line.max(alone), end, Stage::Line);
                }
            }
            Err(error) => self.refusal = Some(error),
        }
    }

    fn push(&mut self, least: f64, end: usize, stage: Stage<'a, N>) {
        self.open.push(Open {
            least,
            turn: least,
            end,
            stage,
        });
    }

    /// Slows a motion to an end down until it keeps the limits, and keeps it if it is the fastest.
    fn keep(&mut self, draft: Draft<N>, end: usize) {
        let limit = self.limit(end);
        if draft.trajectory.duration() >= limit {
            return;
        }
        let slowed = self.planner.slowed(draft, self.motion);
        if self.best.is_none() || slowed.trajectory.duration() < limit {
            self.best = Some((slowed, end));
        }
    }

    /// How long a motion to an end may take to be better than the best one so far, s.
    fn limit(&self, end: usize) -> f64 {
        let Some((draft, taken)) = &self.best else {
            return f64::INFINITY;
        };
        let equal = match end.cmp(taken) {
            Ordering::Less => EQUAL,
            // Others have to gain more in any case.
            Ordering::Greater if end < self.sure => -EQUAL,
            _ => 0.0,
        };
        draft.trajectory.duration() * (1.0 + equal)
    }
}
