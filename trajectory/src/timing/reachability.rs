//! The reachability pass over a path: whether the path is valid, and the fastest law without jerk
//! limits.

use nalgebra::{SVector, Vector3};

use super::block::{LANE, Lane};
use super::reach::{self, ReachGrid};
use super::rise::{Rise, joint_ratio, speed_ratio};
use super::{Boundary, TimingOptions};
use crate::{JointLimits, Path, PathPoint, TimingError, ToolLimits};

/// Cells that the reachability pass distributes over the path, in addition to those at the knots.
const CELLS: usize = 256;
/// The same where a look at a few places is enough.
const FEW_CELLS: usize = 24;
/// A squared rate that nothing bounds.
const FREE: f64 = 1e100;
/// Least number of cells from one knot to the next.
const PER_KNOT: f64 = 4.0;
/// A share of a limit of acceleration by which it jumps where another limit rules from there on.
const JUMP: f64 = 0.05;
/// Distance of one-sided values from a knot, as a fraction of the path parameter.
pub(super) const ASIDE: f64 = 1e-9;

/// The fastest law without jerk limits, and its time scale.
#[derive(Clone, Debug)]
pub(super) struct ReachabilityPass {
    /// Path parameters.
    pub at: Vec<f64>,
    /// Rates `du/dt` there.
    pub rate: Vec<f64>,
    /// Times there (s).
    pub times: Vec<f64>,
    /// Time in which the accelerations of this law could build up within the jerk limits (s).
    pub ramp: f64,
    /// Lower bound of the duration (s) by velocity and acceleration limits, and by jerk limits at the
    /// ends of a path that is straight in joint space.
    pub bound: f64,
    /// Whether the joints move on a straight line, evenly in the path parameter.
    pub straight: bool,
    /// When (s) its accelerations jump, as another limit rules from there on; both ends too.
    pub switches: Vec<f64>,
}

/// The cap of `(du/dt)^2` from speeds: joints, tool and the rate itself.
pub(super) fn speed_cap<const N: usize>(
    [joint, linear, angular]: [f64; 3],
    limits: &ToolLimits,
    rate: f64,
) -> f64 {
    let ratio = joint
        .max(linear / limits.speed)
        .max(angular / limits.angular_speed);
    1.0 / (ratio * ratio).max(rate * rate)
}

impl ReachabilityPass {
    /// Surveys `path`.
    ///
    /// # Errors
    /// [`TimingError`] for paths that are not finite, have a corner, or limits that bound nothing.
    pub(super) fn new<const N: usize>(
        path: &dyn Path<N>,
        joint: &JointLimits<N>,
        tool: &ToolLimits,
        options: &TimingOptions,
    ) -> Result<Self, TimingError> {
        let at = places(path)?;
        let bends = Bends::new(path, &at, tool)?;
        let rows = Rows {
            joint,
            tool,
            rate_cap: options.rate_cap,
            leading: bends.step().map(|step| leading(&step, &joint.acceleration)),
        };
        if joint.jerk.iter().all(|jerk| jerk.is_finite()) {
            corners(path, bends.sizes)?;
        }
        let caps = rows.caps(&bends);
        let groups = rows.groups(&bends);
        let grid = rows.grid(&at, (&caps, &groups), 1);
        let first = first_value(options);
        let last = if options.end == Boundary::Rest {
            0.0
        } else {
            f64::MAX
        };
        let a = grid.solve(first, last);
        if matches!(options.start, Boundary::Moving { .. }) && first > a[0] * (1.0 + 1e-9) {
            let limit = "velocity and acceleration".to_owned();
            return Err(TimingError::StartTooFast {
                ratio: (first / a[0]).sqrt(),
                limit,
            });
        }
        let total = reach::duration(&at, &a);
        if !(total.is_finite() && total > 0.0 && a.iter().all(|a| *a < FREE)) {
            return Err(TimingError::Unbounded);
        }
        // The difference from a grid of half the points estimates the error of this one.
        let coarse = rows.grid(&at, (&caps, &groups), 2);
        let slow = coarse.solve(first, last);
        let both = [(&at[..], &a[..]), (coarse.at(), &slow[..])];
        let [fine, coarse] = match bends.rise(joint, options) {
            Some(rise) => both.map(|(at, a)| risen(at, a, &rise)),
            None => both.map(|(at, a)| reach::duration(at, a)),
        };
        let bound = (fine - 2.0 * (coarse - fine).abs()).max(0.0);
        let ramp = ramp(joint, tool, &at, &a, &bends);
        let times = clock(&at, &a);
        let switches = switches((joint, tool), (&at, &a, &times), &bends);
        let rate = a.into_iter().map(f64::sqrt).collect();
        Ok(Self {
            at,
            rate,
            times,
            ramp,
            bound,
            straight: bends.step().is_some(),
            switches,
        })
    }
}

/// About how long the fastest motion from rest to rest takes (s), from a look at the knots of its path and a few places
/// between them.
pub(super) fn about<const N: usize>(
    path: &dyn Path<N>,
    joint: &JointLimits<N>,
    tool: &ToolLimits,
) -> Result<f64, TimingError> {
    let at = even(path, FEW_CELLS, 1.0)?;
    let bends = Bends::new(path, &at, tool)?;
    let rows = Rows {
        joint,
        tool,
        rate_cap: None,
        leading: None,
    };
    let (caps, groups) = (rows.caps(&bends), rows.groups(&bends));
    let a = rows.grid(&at, (&caps, &groups), 1).solve(0.0, 0.0);
    Ok(reach::duration(&at, &a) + ramp(joint, tool, &at, &a, &bends))
}

/// The joint that comes nearest to its limit where the joints move by `step`.
pub(super) fn leading<const N: usize>(step: &SVector<f64, N>, limit: &SVector<f64, N>) -> usize {
    step.component_div(limit).iamax()
}

/// `(du/dt)^2` at the start: from the boundary, or free.
fn first_value(options: &TimingOptions) -> f64 {
    match options.start {
        Boundary::Rest => 0.0,
        Boundary::Free => FREE,
        Boundary::Moving { rate, .. } => rate * rate,
    }
}

/// Time of a law from rest to rest that is slowed down where it rises and falls too fast.
fn risen(at: &[f64], a: &[f64], rise: &Rise) -> f64 {
    let end = at.last().copied().unwrap_or(0.0);
    let slower = |(u, a): (&f64, &f64)| a.min(rise.square(*u)).min(rise.square(end - u));
    let slow: Vec<f64> = at.iter().zip(a).map(slower).collect();
    reach::duration(at, &slow)
}

/// Time at each place.
fn clock(at: &[f64], a: &[f64]) -> Vec<f64> {
    let mut time = 0.0;
    let mut times = vec![0.0];
    for (u, a) in at.windows(2).zip(a.windows(2)) {
        time += 2.0 * (u[1] - u[0]) / (a[0].sqrt() + a[1].sqrt());
        times.push(time);
    }
    times
}

/// Knots, places between them, and more of them near ends at rest.
fn places<const N: usize>(path: &dyn Path<N>) -> Result<Vec<f64>, TimingError> {
    let mut at = even(path, CELLS, PER_KNOT)?;
    let end = path.end();
    let graded = [0.002, 0.01, 0.03, 0.08, 0.2, 0.5];
    let (first, last) = (at[1], end - at[at.len() - 2]);
    at.extend(graded.iter().map(|x| x * first));
    at.extend(graded.iter().map(|x| end - x * last));
    at.sort_by(f64::total_cmp);
    Ok(at)
}

/// Knots, and places between them: so many cells over the whole path, and at least so many from one knot to the next.
fn even<const N: usize>(
    path: &dyn Path<N>,
    cells: usize,
    per_knot: f64,
) -> Result<Vec<f64>, TimingError> {
    let end = path.end();
    if !(end > 0.0 && end.is_finite()) {
        return Err(TimingError::EmptyPath { end });
    }
    let mut knots: Vec<f64> = path.knots().to_vec();
    knots.retain(|u| *u > 0.0 && *u < end);
    knots.push(0.0);
    knots.push(end);
    knots.sort_by(f64::total_cmp);
    knots.dedup_by(|b, a| *b - *a < 1e-8 * end);
    if let Some(last) = knots.last_mut() {
        *last = end;
    }
    let step = end / cells as f64;
    let mut at = Vec::new();
    for pair in knots.windows(2) {
        let parts = ((pair[1] - pair[0]) / step).ceil().max(per_knot);
        for i in 0..parts as usize {
            at.push(pair[0] + (pair[1] - pair[0]) * (i as f64 / parts));
        }
    }
    at.push(end);
    Ok(at)
}

/// The first two derivatives of a path at many places.
struct Bends<const N: usize> {
    positions: Vec<SVector<f64, N>>,
    joints: Vec<[SVector<f64, N>; 2]>,
    /// Of the tool, of its position and then of its orientation; empty if nothing limits it.
    tools: Vec<[[Vector3<f64>; 2]; 2]>,
    /// The largest value of each derivative of the joints.
    sizes: [f64; 4],
}

impl<const N: usize> Bends<N> {
    /// Looks at `path`.
    fn new(path: &dyn Path<N>, at: &[f64], limits: &ToolLimits) -> Result<Self, TimingError> {
        let limited = limits.limited();
        let mut bends = Self {
            positions: Vec::with_capacity(at.len()),
            joints: Vec::with_capacity(at.len()),
            tools: Vec::with_capacity(if limited { at.len() } else { 0 }),
            sizes: [0.0; 4],
        };
        for &u in at {
            let PathPoint { joint, tool } = finite(path.at(u), u)?;
            for (size, d) in bends.sizes.iter_mut().zip(&joint.q) {
                *size = size.max(d.amax());
            }
            bends.positions.push(joint.q[0]);
            bends.joints.push([joint.q[1], joint.q[2]]);
            if limited {
                let two = |[p, q, _]: [Vector3<f64>; 3]| [p, q];
                bends.tools.push([two(tool.linear), two(tool.angular)]);
            }
        }
        Ok(bends)
    }

    /// How fast the law can rise, if the path is straight in joint space and both ends are at rest.
    fn rise(&self, joint: &JointLimits<N>, options: &TimingOptions) -> Option<Rise> {
        let rest = options.start == Boundary::Rest && options.end == Boundary::Rest;
        let step = self.step().filter(|_| rest)?;
        Some(Rise::new(&step, joint))
    }

    /// How the joints move with the path parameter, if that is the same everywhere.
    fn step(&self) -> Option<SVector<f64, N>> {
        let straight = self.sizes[2] == 0.0 && self.sizes[3] == 0.0;
        let first = self.joints.first().filter(|_| straight)?;
        Some(first[0])
    }

    /// The tool at place `i`: position, then orientation.
    fn tool(&self, i: usize) -> [[Vector3<f64>; 2]; 2] {
        let tool = self.tools.get(i).copied();
        tool.unwrap_or_else(|| [[Vector3::zeros(); 2]; 2])
    }
}

/// The point, if it is finite.
fn finite<const N: usize>(point: PathPoint<N>, u: f64) -> Result<PathPoint<N>, TimingError> {
    let joints = point
        .joint
        .q
        .iter()
        .all(|d| d.iter().all(|x| x.is_finite()));
    let vectors = point.tool.linear.iter().chain(&point.tool.angular);
    let tool = vectors.flat_map(|v| v.iter()).all(|x| x.is_finite());
    if joints && tool {
        Ok(point)
    } else {
        Err(TimingError::NotFinite { u })
    }
}

/// Searches for jumps of the first two derivatives at knots, relative to their `sizes`.
fn corners<const N: usize>(path: &dyn Path<N>, sizes: [f64; 4]) -> Result<(), TimingError> {
    let end = path.end();
    let [_, first, second, third] = sizes;
    let second = second + 4.0 * first / end;
    for &u in path.knots().iter().filter(|u| **u > 0.0 && **u < end) {
        let before = path.joint_at(u - ASIDE * end);
        let after = path.joint_at(u + ASIDE * end);
        let allowed = [
            1e-6 * first + 1e-8 * end * second,
            1e-4 * second + 1e-8 * end * third,
        ];
        for order in 1..=2 {
            let jump = after.q[order] - before.q[order];
            let joint = jump.iamax();
            if jump[joint].abs() > allowed[order - 1] {
                return Err(TimingError::Corner {
                    u,
                    joint,
                    order,
                    jump: jump[joint],
                });
            }
        }
    }
    Ok(())
}

/// The limits from which the rows of a reachability grid are made.
struct Rows<'a, const N: usize> {
    joint: &'a JointLimits<N>,
    tool: &'a ToolLimits,
    rate_cap: Option<f64>,
    /// The only joint whose acceleration counts, because the others are always farther from their
    /// limits.
    leading: Option<usize>,
}

impl<const N: usize> Rows<'_, N> {
    /// The caps from speeds at all places.
    fn caps(&self, bends: &Bends<N>) -> Vec<f64> {
        let mut caps: Vec<f64> = (0..bends.joints.len())
            .map(|i| self.cap(bends, i))
            .collect();
        let finite = caps.iter().copied().filter(|cap| *cap < FREE);
        let most = finite.fold(0.0, f64::max);
        // Where the path does not move with its parameter, no limit bounds the rate.
        let most = if most > 0.0 { most } else { FREE };
        caps.iter_mut().for_each(|cap| *cap = cap.min(most));
        caps
    }

    /// The grid at every `step`-th of the places `at`, and at the last, with the caps and rows there.
    fn grid(&self, at: &[f64], (caps, groups): (&[f64], &[[Lane; 2]]), step: usize) -> ReachGrid {
        let mut grid = ReachGrid::with_room(self.count(), at.len() / step + 2);
        let places = at.iter().zip(caps).zip(groups.chunks(self.width()));
        for (i, ((u, cap), groups)) in places.enumerate() {
            if i % step == 0 || i + 1 == at.len() {
                grid.push_groups(*u, *cap, groups);
            }
        }
        grid
    }

    /// Rows at a place.
    fn count(&self) -> usize {
        let tool = [self.tool.acceleration, self.tool.angular_acceleration];
        let tools = tool.iter().filter(|limit| limit.is_finite()).count();
        let joints = if self.leading.is_some() { 1 } else { N };
        joints + 3 * tools
    }

    /// Groups of rows at a place.
    fn width(&self) -> usize {
        self.count().div_ceil(LANE)
    }

    /// The cap from speeds at place `i`. Jerk limits are used as if the rate were constant there.
    fn cap(&self, bends: &Bends<N>, i: usize) -> f64 {
        let [linear, angular] = bends.tool(i);
        let speeds = [
            speed_ratio(&bends.positions[i], &bends.joints[i][0], self.joint),
            linear[0].norm(),
            angular[0].norm(),
        ];
        let rate = self.rate_cap.map_or(0.0, |cap| 1.0 / cap);
        speed_cap::<N>(speeds, self.tool, rate)
    }

    /// Acceleration rows `(p, q)` at all places, in groups; those of the tool for each axis, which bounds
    /// a little less than the norm does.
    fn groups(&self, bends: &Bends<N>) -> Vec<[Lane; 2]> {
        let (narrow, width) = (self.joint.acceleration.map(|x| 1.0 / x), self.width());
        let joints = self.leading.map_or(0..N, |j| j..j + 1);
        let mut all = vec![[[0.0; LANE]; 2]; width * bends.joints.len()];
        for (i, groups) in all.chunks_mut(width).enumerate() {
            let mut row = 0;
            let mut put = |p: f64, q: f64| {
                let group = &mut groups[row / LANE];
                (group[0][row % LANE], group[1][row % LANE]) = (p, q);
                row += 1;
            };
            let [first, second] = &bends.joints[i];
            for j in joints.clone() {
                put(first[j] * narrow[j], second[j] * narrow[j]);
            }
            let [linear, angular] = bends.tool(i);
            let tools = [
                (linear, self.tool.acceleration),
                (angular, self.tool.angular_acceleration),
            ];
            for ([p, q], limit) in tools.into_iter().filter(|(_, limit)| limit.is_finite()) {
                for axis in 0..3 {
                    put(p[axis] / limit, q[axis] / limit);
                }
            }
        }
        all
    }
}

/// How long the accelerations of the law `a` take to build up within the jerk limits.
fn ramp<const N: usize>(
    joint: &JointLimits<N>,
    tool: &ToolLimits,
    at: &[f64],
    a: &[f64],
    bends: &Bends<N>,
) -> f64 {
    let mut ramp = 0.0_f64;
    for k in 0..at.len() - 1 {
        let b = 0.5 * (a[k + 1] - a[k]) / (at[k + 1] - at[k]);
        let [first, second] = bends.joints[k];
        let joints = first * b + second * a[k];
        ramp = ramp.max(joint_ratio(&joints, &joint.jerk));
        let used = |[p, q]: [Vector3<f64>; 2]| (p * b + q * a[k]).norm();
        let [linear, angular] = bends.tool(k).map(used);
        ramp = ramp.max(linear.min(tool.acceleration) / tool.jerk);
        ramp = ramp.max(angular.min(tool.angular_acceleration) / tool.angular_jerk);
    }
    ramp
}

/// When the accelerations of the law `a` jump, and both ends.
fn switches<const N: usize>(
    (joint, tool): (&JointLimits<N>, &ToolLimits),
    (at, a, times): (&[f64], &[f64], &[f64]),
    bends: &Bends<N>,
) -> Vec<f64> {
    let slope = |k: usize| 0.5 * (a[k + 1] - a[k]) / (at[k + 1] - at[k]);
    let jumps = |k: &usize| {
        let jump = (slope(*k) - slope(k - 1)).abs();
        let [linear, angular] = bends.tool(*k).map(|[first, _]| first.norm());
        let joints = joint_ratio(&bends.joints[*k][0], &joint.acceleration);
        let tools = (linear / tool.acceleration).max(angular / tool.angular_acceleration);
        jump * joints.max(tools) > JUMP
    };
    let last = at.len() - 1;
    let between = (1..last).filter(jumps);
    let places = [0].into_iter().chain(between).chain([last]);
    places.map(|k| times[k]).collect()
}

impl ReachabilityPass {
    /// Duration of the law (s).
    pub(super) fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// The path parameter at the time `t`; before the start and after the end it continues with the
    /// rate there.
    pub(super) fn parameter(&self, t: f64) -> f64 {
        let last = self.at.len() - 1;
        if t <= 0.0 {
            return t * self.rate[0];
        }
        if t >= self.times[last] {
            return self.at[last] + (t - self.times[last]) * self.rate[last];
        }
        let k = (self.times.partition_point(|x| *x <= t).max(1) - 1).min(last - 1);
        let x = t - self.times[k];
        let span = self.times[k + 1] - self.times[k];
        let gain = (self.rate[k + 1] - self.rate[k]) / span;
        self.at[k] + x * (self.rate[k] + 0.5 * gain * x)
    }
}
