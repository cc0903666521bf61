//! A smooth motion that is as fast as the joints of an arm allow.

use nalgebra::Isometry3;

use super::arm::ArmMotion;
use super::certificate::{Certificate, certify_slowed};
use super::choose::{SLOWED, arm_effort};
use super::crossing::{Crossing, RESOLUTION};
use super::lower_bound::lower_bound;
use super::narrowing::narrow;
use super::options::{SmoothError, SmoothOptions};
use super::plan::SmoothPlan;
use super::seed::Seed;
use super::shares::Shares;
use super::spline::{self, Effort, Found, Request, power};
use super::{exact_stop, method::Method, motion::Motion};
use crate::poly::quartic;

/// Searches, each with bounds narrowed by what the motion before exceeded. A rough one is done once: another follows it.
const ATTEMPTS: usize = 3;

/// Share of the angular tolerance that a search uses, and by how much of it a pose may then be seen elsewhere than where the
/// search has it.
const TURNED: f64 = 0.98;
const AIMED: f64 = 0.015;

/// By how much a rough plan may exceed the tolerances, and the corridor: between its few knots it leaves that by more.
const ROUGHLY: f64 = 1.1;
const OUTSIDE: f64 = 3.0;

/// How the spare coordinate of an arm changes along a [`SmoothPlan`]: a uniform spline of degree four, from rest to rest.
#[derive(Clone, Debug, PartialEq)]
pub struct SpareSpline {
    control: Vec<f64>,
    /// Knot spacing, s.
    spacing: f64,
}

impl SpareSpline {
    /// Its value at a time (s) and the first three derivatives.
    #[must_use]
    pub fn at(&self, time: f64) -> [f64; 4] {
        let h = self.spacing;
        let at = (time / h).max(0.0);
        let span = (at as usize).min(self.control.len().saturating_sub(5));
        let Some(five) = self.control[span..].first_chunk() else {
            return [0.0; 4];
        };
        quartic(&power(five, h), (time - span as f64 * h).clamp(0.0, h))
    }
}

/// A smooth motion of the tool for an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmPlan {
    /// The motion of the tool.
    pub plan: SmoothPlan,
    /// How the spare coordinate of the arm changes along it, if the arm has one.
    pub spare: Option<SpareSpline>,
    /// Where its search ended.
    pub seed: Seed,
}

/// Plans a motion through `poses` that is about as fast as the joints of an arm allow, near a motion of the arm that is known.
///
/// The tool keeps its limits, tolerances and corridor, which the certificate of the plan says. The joints are looked at to first order from
/// where they are in the known motion: the caller follows the plan with the joints and times them. The joints along a plan may be
/// the known motion of a further search, which goes on where that of the plan ended ([`ArmMotion::onward`]); all but the last of
/// such searches may be [rough](ArmMotion::rough). [`SmoothOptions::gap`] says how near to the optimum a search ends. `None` where nothing is found that is
/// certified.
///
/// # Errors
/// [`SmoothError`] when a number of the input is unusable.
///
/// ```
/// use nalgebra::{Isometry3, vector};
/// use trajectory::{ToolLimits, smooth};
/// let limits = ToolLimits {
///     speed: 1.0, acceleration: 10.0, jerk: 200.0,
///     angular_speed: 2.0, angular_acceleration: 20.0, angular_jerk: 400.0,
/// };
/// let poses = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]].map(|[x, y]| Isometry3::translation(x, y, 0.0));
/// let options = smooth::SmoothOptions::new(0.01, limits);
/// let tool = smooth::plan(&poses, &options)?;
/// // An arm with a joint along each axis, half as fast as the tool may be: the tool's motion in twice the time.
/// let at = |time: f64| {
///     use trajectory::ToolCurve;
///     let pose = tool.at(0.5 * time).pose;
///     let joint = |j: usize| smooth::JointState {
///         position: pose.translation.vector[j],
///         changes: std::array::from_fn(|d| if d == j { 1.0 } else { 0.0 }),
///     };
///     Some(smooth::ArmState { pose, joints: (0..3).map(joint).collect(), spare: 0.0 })
/// };
/// let bounds = smooth::JointBounds { position: [-1.0, 1.0], rates: [0.5, 2.5, 25.0] };
/// let arm = smooth::ArmMotion {
///     duration: 2.0 * tool.duration(),
///     at: &at,
///     passes: &[2.0 * tool.crossings()[0].time],
///     bounds: &[bounds; 3],
///     far: 1.0,
///     has_spare: false,
///     rough: false,
///     onward: None,
/// };
/// let found = smooth::plan_for_arm(&poses, &options, &arm)?.unwrap();
/// assert!(found.plan.certificate().holds());
/// assert!(found.plan.duration() < arm.duration);
/// # Ok::<(), smooth::SmoothError>(())
/// ```
pub fn plan_for_arm(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    arm: &ArmMotion<'_>,
) -> Result<Option<ArmPlan>, SmoothError> {
    options.check(poses)?;
    let options = options.finite();
    let narrow = options.tolerance <= RESOLUTION || options.corridor() <= RESOLUTION;
    if poses.len() < 2 || narrow || !fits(arm, poses) {
        return Ok(None);
    }
    Ok(searched(poses, &options, arm))
}

/// Whether the numbers of an arm's motion can be used.
fn fits(arm: &ArmMotion<'_>, poses: &[Isometry3<f64>]) -> bool {
    let finite = arm.bounds.iter().all(|bounds| {
        let all = bounds.position.iter().chain(&bounds.rates);
        let rates = bounds.rates.iter().all(|rate| *rate > 0.0);
        rates && all.into_iter().all(|x| x.is_finite())
    });
    let passes = arm.passes.len() + 2 == poses.len();
    let numbers = [arm.duration, arm.far];
    let numbers = numbers.iter().all(|x| *x > 0.0 && x.is_finite());
    finite && passes && numbers && !arm.bounds.is_empty()
}

/// The first motion of some searches that holds.
fn searched(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    arm: &ArmMotion<'_>,
) -> Option<ArmPlan> {
    let mut inner = options.clone();
    inner.angular_tolerance = Some(TURNED * options.angular_tolerance());
    for _ in 0..if arm.rough { 1 } else { ATTEMPTS } {
        let request = Request {
            shares: &Shares::default(),
            poses,
            options: &inner,
            moving: None,
            finish: None,
            effort: effort(options, arm),
            coupled: true,
            known: None,
            backwards: false,
            arm: Some(arm),
        };
        let turns = request.moves()[1];
        let Found {
            mut spans,
            mut seed,
        } = spline::plan_for_arm(&request)?;
        let whole = certify_slowed(&mut spans, (poses, false), options, SLOWED);
        // It may have been slowed down.
        seed.spacing = spans.last()?.end() / spans.len() as f64;
        let enough = whole.0.holds() || arm.rough && is_rough(&whole);
        if !enough && passes_later(&whole.1, &seed) {
            return None;
        }
        if !enough {
            narrow(&mut inner, &whole.0, &whole.1, turns);
            continue;
        }
        let spare = arm.has_spare.then(|| SpareSpline {
            control: seed.last_coordinate(),
            spacing: seed.spacing,
        });
        let stop = exact_stop::duration(poses, &options.limits);
        let motion = Motion::new(spans, Method::Spline);
        let mut plan = SmoothPlan::new(poses, motion, whole, stop);
        plan.certificate.lower_bound = lower_bound(poses, options);
        return Some(ArmPlan { plan, spare, seed });
    }
    None
}

/// How far a search goes.
fn effort(options: &SmoothOptions, arm: &ArmMotion<'_>) -> Effort {
    let aimed = if arm.rough { f64::INFINITY } else { AIMED };
    arm_effort(options.gap, aimed, arm.onward.is_some())
}

/// Whether a search passes a pose on a later approach than the first, which misses it: within narrower bounds it does so, too.
fn passes_later(crossings: &[Crossing], seed: &Seed) -> bool {
    let mut all = crossings.iter().zip(&seed.crossings);
    all.any(|(made, searched)| !made.holds() && made.is_apart(*searched, seed.spacing))
}

/// Whether a motion is so near to one that holds that a search may begin there.
fn is_rough((certificate, crossings): &(Certificate, Vec<Crossing>)) -> bool {
    let near = |crossing: &Crossing| {
        crossing.deviation <= ROUGHLY * crossing.tolerance
            && crossing.angle <= ROUGHLY * crossing.angular_tolerance
    };
    certificate.corridor.ratio <= OUTSIDE && crossings.iter().all(near)
}
