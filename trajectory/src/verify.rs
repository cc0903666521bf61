//! An independent check of a recorded motion.
//!
//! It sees samples, limits and the poses that were asked for, and nothing of how the motion was
//! planned: no path, no polynomial, no certificate. All it uses is arithmetic on the samples.
//!
//! A divided difference of order `k` equals the derivative of that order somewhere between its
//! samples. So a ratio above one proves that a limit was broken; and no limit is reported broken
//! that was kept, but for the rounding of the recorded numbers, which is allowed for.

use nalgebra::{Isometry3, SVector, Vector3};

use crate::timing::{Limit, LimitPeak};
use crate::{JointLimits, ToolLimits};

/// One sample of a recorded motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Recorded<const N: usize> {
    /// When (s).
    pub time: f64,
    /// Joint positions (rad).
    pub position: SVector<f64, N>,
    /// Pose of the controlled point, in the frame of the targets.
    pub tool: Isometry3<f64>,
}

/// A pose that the motion has to pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Where the controlled point should be, in the frame of the samples.
    pub pose: Isometry3<f64>,
    /// Largest distance (m).
    pub tolerance: f64,
    /// Largest angle (rad); infinity where any orientation will do.
    pub angular_tolerance: f64,
}

/// What a recorded motion is checked against.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted<'a, const N: usize> {
    /// Limits of the joints.
    pub joint: &'a JointLimits<N>,
    /// Limits of the tool.
    pub tool: &'a ToolLimits,
    /// Poses to be passed, in this order, the last at the end.
    pub targets: &'a [Target],
    /// Largest distance (m) from the straight line between the ends, for straight moves.
    pub straightness: Option<f64>,
    /// Largest rounding error of recorded joint positions (rad) and tool positions (m).
    pub resolution: f64,
}

/// How a target was passed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passed {
    /// Index of the target.
    pub index: usize,
    /// Distance (m) at the closest approach that keeps the order.
    pub deviation: f64,
    /// Angle (rad) there.
    pub angle: f64,
    /// When (s).
    pub time: f64,
    /// Whether both are within the tolerances, in order.
    pub within: bool,
}

/// What the samples prove.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// Highest divided difference over the limit, less what rounding alone can make, for every
    /// finite limit; position limits are in `position_excess`.
    pub peaks: Vec<LimitPeak>,
    /// How far a joint is outside of its range at most (rad); 0 inside.
    pub position_excess: f64,
    /// The targets, in their order.
    pub passes: Vec<Passed>,
    /// Largest distance of the controlled point from the line between its ends (m).
    pub straightness: f64,
    /// Highest joint speed over the first and over the last sampling interval, as a ratio to what
    /// a motion from rest can reach in it.
    pub rest: [f64; 2],
    /// What is wrong, in words with numbers; empty if nothing is. Joints and poses are counted
    /// from 1 here.
    pub findings: Vec<String>,
}

impl Verdict {
    /// Whether nothing is wrong.
    pub fn holds(&self) -> bool {
        self.findings.is_empty()
    }
}

/// Ratios up to this pass: finite arithmetic on both sides.
const ALLOWED: f64 = 1.0 + 1e-6;

/// Checks a recorded motion, from rest to rest, given by its samples in the order of time.
///
/// ```
/// use nalgebra::{Isometry3, SVector};
/// use trajectory::verify::{Recorded, Wanted, verify};
/// use trajectory::{JointLimits, ToolLimits};
///
/// // A joint that jumps by a radian in a millisecond.
/// let at = |time: f64, q: f64| Recorded {
///     time,
///     position: SVector::<f64, 1>::new(q),
///     tool: Isometry3::identity(),
/// };
/// let samples = [at(0.0, 0.0), at(0.001, 0.0), at(0.002, 1.0), at(0.003, 1.0)];
/// let verdict = verify(&samples, &Wanted {
///     joint: &JointLimits::uniform(2.0, 10.0, 100.0),
///     tool: &ToolLimits::UNLIMITED,
///     targets: &[],
///     straightness: None,
///     resolution: 1e-12,
/// });
/// assert!(!verdict.holds());
/// assert!(verdict.findings[0].contains("velocity of joint 1"));
/// ```
pub fn verify<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> Verdict {
    let mut verdict = Verdict {
        peaks: Vec::new(),
        position_excess: 0.0,
        passes: Vec::new(),
        straightness: straightness(samples),
        rest: [0.0; 2],
        findings: Vec::new(),
    };
    if let Some(bad) = unsound(samples) {
        verdict.findings.push(bad);
        return verdict;
    }
    verdict.peaks = joint_peaks(samples, wanted);
    verdict.peaks.extend(tool_peaks(samples, wanted));
    verdict.position_excess = position_excess(samples, wanted.joint);
    verdict.passes = passes(samples, wanted);
    verdict.rest = [rest(samples, wanted), rest_backward(samples, wanted)];
    verdict.findings = findings(&verdict, wanted);
    verdict
}

/// Why the samples cannot be checked.
fn unsound<const N: usize>(samples: &[Recorded<N>]) -> Option<String> {
    if samples.is_empty() {
        return Some("there are no samples".to_owned());
    }
    let finite = |s: &Recorded<N>| {
        s.time.is_finite()
            && s.position.iter().all(|x| x.is_finite())
            && s.tool.translation.vector.iter().all(|x| x.is_finite())
    };
    if let Some(i) = samples.iter().position(|s| !finite(s)) {
        return Some(format!("sample {i} is not finite"));
    }
    let late = samples
        .windows(2)
        .position(|pair| pair[1].time <= pair[0].time)?;
    Some(format!(
        "sample {} is not later than the one before it",
        late + 1
    ))
}

/// What is wrong, in words.
fn findings<const N: usize>(verdict: &Verdict, wanted: &Wanted<'_, N>) -> Vec<String> {
    let mut findings = Vec::new();
    for peak in verdict.peaks.iter().filter(|peak| peak.ratio > ALLOWED) {
        let LimitPeak { limit, ratio, time } = peak;
        findings.push(format!(
            "{limit} is {ratio:.4} times its limit at {time:.3} s"
        ));
    }
    if verdict.position_excess > wanted.resolution {
        let excess = verdict.position_excess;
        findings.push(format!("a joint is {excess:.3e} rad outside of its range"));
    }
    for pass in verdict.passes.iter().filter(|pass| !pass.within) {
        let Passed {
            index,
            deviation,
            angle,
            ..
        } = pass;
        findings.push(format!(
            "pose {} is not passed in order within tolerance: {deviation:.3e} m, {angle:.3e} rad",
            index + 1
        ));
    }
    if wanted
        .straightness
        .is_some_and(|most| verdict.straightness > most)
    {
        findings.push(format!("the line bends by {:.3e} m", verdict.straightness));
    }
    for (rest, end) in verdict.rest.iter().zip(["start", "end"]) {
        if *rest > ALLOWED {
            findings.push(format!(
                "the motion is not at rest at its {end}: {rest:.2} times"
            ));
        }
    }
    findings
}

/// Divided difference of order `k` over `k + 1` samples, times `k!`: a value that the derivative
/// of order `k` takes between them. Also what an error of one in each sample makes of it.
///
/// # Source
/// de Boor, A Practical Guide to Splines, 1978, chapter I (divided differences).
fn difference<const D: usize>(
    times: &[f64],
    values: impl Iterator<Item = SVector<f64, D>>,
) -> (SVector<f64, D>, f64) {
    let order = times.len().saturating_sub(1);
    let mut factorial = 1.0;
    for i in 2..=order {
        factorial *= i as f64;
    }
    let (mut sum, mut noise) = (SVector::zeros(), 0.0);
    for (i, value) in values.take(times.len()).enumerate() {
        let mut weight = factorial;
        for (j, other) in times.iter().enumerate() {
            if j != i {
                weight /= times[i] - other;
            }
        }
        sum += value * weight;
        noise += weight.abs();
    }
    (sum, noise)
}

/// Differences of order `k` all along, each with its rounding and its time.
fn differences<const N: usize, const D: usize>(
    samples: &[Recorded<N>],
    order: usize,
    value: impl Fn(&Recorded<N>) -> SVector<f64, D> + Copy,
) -> impl Iterator<Item = (SVector<f64, D>, f64, f64)> {
    samples.windows(order + 1).map(move |window| {
        let mut times = [0.0; 4];
        for (time, sample) in times.iter_mut().zip(window) {
            *time = sample.time;
        }
        let (sum, noise) = difference(&times[..=order], window.iter().map(value));
        (sum, noise, 0.5 * (times[0] + times[order]))
    })
}

/// Peaks of the joints.
fn joint_peaks<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> Vec<LimitPeak> {
    let limits = [
        &wanted.joint.velocity,
        &wanted.joint.acceleration,
        &wanted.joint.jerk,
    ];
    let names = [
        Limit::JointVelocity,
        Limit::JointAcceleration,
        Limit::JointJerk,
    ];
    let mut peaks = Vec::new();
    for (order, (limits, name)) in limits.into_iter().zip(names).enumerate() {
        let first = peaks.len();
        for j in 0..N {
            peaks.push(LimitPeak {
                limit: name(j),
                ratio: 0.0,
                time: 0.0,
            });
        }
        for (sum, noise, time) in differences(samples, order + 1, |s| s.position) {
            for (j, peak) in peaks[first..].iter_mut().enumerate() {
                let ratio = (sum[j].abs() - noise * wanted.resolution) / limits[j];
                if ratio > peak.ratio {
                    *peak = LimitPeak {
                        ratio,
                        time,
                        ..*peak
                    };
                }
            }
        }
    }
    peaks
}

/// Peaks of the tool: norms of differences of its position, and of its rotation taken as steps of
/// the rotation vector in fixed axes.
fn tool_peaks<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> Vec<LimitPeak> {
    let tool = wanted.tool;
    let mut peaks = Vec::new();
    let linear = [
        (Limit::ToolSpeed, tool.speed),
        (Limit::ToolAcceleration, tool.acceleration),
        (Limit::ToolJerk, tool.jerk),
    ];
    for (order, (limit, most)) in linear.into_iter().enumerate().filter(|x| x.1.1.is_finite()) {
        let place = |s: &Recorded<N>| s.tool.translation.vector;
        let norms = differences(samples, order + 1, place);
        peaks.push(peak(
            limit,
            norms.map(|(v, n, t)| (v.norm() - n * wanted.resolution, t)),
            most,
        ));
    }
    if tool.angular_speed.is_finite() {
        let speeds = samples.windows(2).map(|pair| {
            let step = pair[1].time - pair[0].time;
            let angle = pair[0].tool.rotation.angle_to(&pair[1].tool.rotation);
            // Half angles near zero come from a square root of rounding.
            (
                (angle - 4.0 * f64::EPSILON.sqrt() * 1e-2) / step,
                pair[0].time,
            )
        });
        peaks.push(peak(Limit::AngularSpeed, speeds, tool.angular_speed));
    }
    peaks
}

/// The highest of `norms` over `most`.
fn peak(limit: Limit, norms: impl Iterator<Item = (f64, f64)>, most: f64) -> LimitPeak {
    let mut peak = LimitPeak {
        limit,
        ratio: 0.0,
        time: 0.0,
    };
    for (norm, time) in norms {
        if norm / most > peak.ratio {
            peak = LimitPeak {
                limit,
                ratio: norm / most,
                time,
            };
        }
    }
    peak
}

/// How far a joint is outside of its range at most.
fn position_excess<const N: usize>(samples: &[Recorded<N>], limits: &JointLimits<N>) -> f64 {
    let outside = |s: &Recorded<N>| {
        let below = limits.lower - s.position;
        let above = s.position - limits.upper;
        below.max().max(above.max())
    };
    samples.iter().map(outside).fold(0.0, f64::max)
}

/// Largest distance of the controlled point from the line between its first and last place.
fn straightness<const N: usize>(samples: &[Recorded<N>]) -> f64 {
    let (Some(first), Some(last)) = (samples.first(), samples.last()) else {
        return 0.0;
    };
    let (start, end) = (first.tool.translation.vector, last.tool.translation.vector);
    let off = |s: &Recorded<N>| nearest(&start, &end, &s.tool.translation.vector).0;
    samples.iter().map(off).fold(0.0, f64::max)
}

/// Distance of `point` from the segment, and where along it the nearest place is (0 to 1).
fn nearest(start: &Vector3<f64>, end: &Vector3<f64>, point: &Vector3<f64>) -> (f64, f64) {
    let along = end - start;
    let square = along.norm_squared();
    let x = if square > 0.0 {
        ((point - start).dot(&along) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    ((start + along * x - point).norm(), x)
}

/// Speed over the first interval as a ratio to what a motion from rest reaches in it: jerk times
/// the square of the interval over six, or half the acceleration where jerk is free.
fn rest<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> f64 {
    let [first, second, ..] = samples else {
        return 0.0;
    };
    leap(first, second, wanted)
}

/// The same for the last interval.
fn rest_backward<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> f64 {
    let [.., before, last] = samples else {
        return 0.0;
    };
    leap(before, last, wanted)
}

/// The way of the fastest joint between two samples over what is possible from rest.
fn leap<const N: usize>(a: &Recorded<N>, b: &Recorded<N>, wanted: &Wanted<'_, N>) -> f64 {
    let t = b.time - a.time;
    let mut most = 0.0_f64;
    for j in 0..N {
        let way = (b.position[j] - a.position[j]).abs() - 2.0 * wanted.resolution;
        let cubic = wanted.joint.jerk[j] * t * t * t / 6.0;
        let square = wanted.joint.acceleration[j] * t * t / 2.0;
        most = most.max(way / cubic.min(square));
    }
    most
}

/// One way to pass a target: distance, angle, time.
#[derive(Clone, Copy, Debug)]
struct Approach {
    distance: f64,
    angle: f64,
    time: f64,
}

/// The targets with the best approaches that keep their order.
fn passes<const N: usize>(samples: &[Recorded<N>], wanted: &Wanted<'_, N>) -> Vec<Passed> {
    let (targets, bend) = (wanted.targets, bend(samples, wanted.tool));
    // Latest interval in which each target may be passed so that all later ones still can.
    let last = samples.len().saturating_sub(1);
    let mut latest = vec![last; targets.len()];
    let mut end = last;
    for (index, target) in targets.iter().enumerate().rev() {
        let inside = (0..=end)
            .rev()
            .find(|i| within(&approach(samples, *i, target), target, bend));
        end = inside.unwrap_or(end);
        latest[index] = end;
    }
    let mut start = 0;
    let mut after = f64::NEG_INFINITY;
    let mut passed = Vec::with_capacity(targets.len());
    for (index, target) in targets.iter().enumerate() {
        let until = latest[index].max(start);
        let choices = (start..=until).map(|i| (i, approach(samples, i, target)));
        let choices = choices.filter(|(_, near)| near.time >= after);
        let rank = |near: &Approach| {
            (near.distance / target.tolerance.max(1e-12))
                .max(near.angle / target.angular_tolerance.max(1e-12))
        };
        let best = choices.min_by(|a, b| rank(&a.1).total_cmp(&rank(&b.1)));
        let Some((i, near)) = best else { continue };
        (start, after) = (i, near.time);
        let Approach {
            distance,
            angle,
            time,
        } = near;
        let within = within(&near, target, bend);
        passed.push(Passed {
            index,
            deviation: distance,
            angle,
            time,
            within,
        });
    }
    passed
}

/// Largest distance (m) of a motion within an acceleration limit from the chords between its
/// samples: it may have been that much nearer to a target than they are.
fn bend<const N: usize>(samples: &[Recorded<N>], tool: &ToolLimits) -> f64 {
    let step = samples
        .windows(2)
        .map(|pair| pair[1].time - pair[0].time)
        .fold(0.0, f64::max);
    if tool.acceleration.is_finite() {
        tool.acceleration * step * step / 8.0
    } else {
        0.0
    }
}

/// Whether an approach keeps the tolerances of a target, up to rounding and `bend` (m).
fn within(near: &Approach, target: &Target, bend: f64) -> bool {
    near.distance <= target.tolerance * ALLOWED + 1e-9 + bend
        && near.angle <= target.angular_tolerance * ALLOWED + 1e-7
}

/// The nearest that the controlled point comes to a target from sample `i` to the next, on the
/// chord; orientation turns evenly in between.
fn approach<const N: usize>(samples: &[Recorded<N>], i: usize, target: &Target) -> Approach {
    let from = &samples[i];
    let to = samples.get(i + 1).unwrap_or(from);
    let (a, b) = (from.tool.translation.vector, to.tool.translation.vector);
    let (distance, mut x) = nearest(&a, &b, &target.pose.translation.vector);
    if (b - a).norm() < 1e-12 {
        // Turning on the spot: the nearer of both orientations.
        let near = |s: &Recorded<N>| s.tool.rotation.angle_to(&target.pose.rotation);
        x = if near(to) < near(from) { 1.0 } else { 0.0 };
    }
    let turn = from.tool.rotation.try_slerp(&to.tool.rotation, x, 1e-12);
    let rotation = turn.unwrap_or(from.tool.rotation);
    let angle = rotation.angle_to(&target.pose.rotation);
    Approach {
        distance,
        angle,
        time: from.time + x * (to.time - from.time),
    }
}
