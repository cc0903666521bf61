//! A list of poses, and the choice among the ways of planning it.

use std::cell::Cell;

use nalgebra::Isometry3;

use super::certificate::certify_passing;
use super::crossing::RESOLUTION;
use super::found::Found;
use super::lower_bound::lower_bound;
use super::method::Method;
use super::motion::Motion;
use super::narrower::{narrower, within};
use super::normal_form::NormalForm;
use super::options::{SmoothError, SmoothOptions};
use super::plan::SmoothPlan;
use super::rest::RestCause;
use super::windows::{self, Windows};
use super::{bridge, dense, exact_stop, missed, retimed};

/// Plans a motion from the first pose to the last that passes those between in
/// order, each within tolerance: the fastest motion that is certified.
///
/// Poses are in one frame of the caller's choice, lengths in m. It is at rest
/// at both ends. A list of one pose, or of equal poses, gives a plan of no
/// duration.
///
/// # Errors
/// [`SmoothError`] when a number of the input is unusable; never because a
/// motion is hard.
///
/// ```
/// use nalgebra::Isometry3;
/// use trajectory::{ToolLimits, smooth};
/// let limits = ToolLimits {
///     speed: 0.5, acceleration: 5.0, jerk: 100.0,
///     angular_speed: 2.0, angular_acceleration: 20.0, angular_jerk: 400.0,
/// };
/// let corner = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]];
/// let poses = corner.map(|[x, y]| Isometry3::translation(x, y, 0.0));
/// let plan = smooth::plan(&poses, &smooth::SmoothOptions::new(0.001, limits))?;
/// assert!(plan.certificate().holds());
/// assert!(plan.crossings()[0].deviation <= 0.001);
/// assert!(plan.duration() <= plan.exact_stop());
/// # Ok::<(), smooth::SmoothError>(())
/// ```
pub fn plan(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<SmoothPlan, SmoothError> {
    options.check(poses)?;
    let finite = options.finite();
    let legs = legs(poses, &finite);
    let planned = |through: &[Isometry3<f64>]| List::new(poses, through, &finite).fastest();
    let fewer = (legs.len() < poses.len()).then(|| planned(&legs));
    match fewer.flatten().or_else(|| planned(poses)) {
        Some(plan) => Ok(plan),
        // Without a tolerance, or if the form was too coarse.
        None => Ok(Windows::new(poses, options)?.finish()),
    }
}

/// The poses between which the legs are straight: further poses on a leg change nothing of the way, and in a
/// corridor no wider than the balls most motions pass them, too.
fn legs(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Vec<Isometry3<f64>> {
    if options.tolerance <= RESOLUTION || options.corridor() > options.tolerance {
        poses.to_vec()
    } else {
        exact_stop::at_corners(poses)
    }
}

/// A list as it was given, with finite options, and the times (s) with a stop at each pose and of the bound.
struct List<'a> {
    given: &'a [Isometry3<f64>],
    /// Those of the poses that the motion is planned through.
    poses: &'a [Isometry3<f64>],
    options: &'a SmoothOptions,
    exact_stop: f64,
    /// Lower bound of the time of all motions, s.
    least: f64,
    /// Time of the fastest motion that is certified so far, s.
    best: Cell<f64>,
    /// Whether a certified motion rests nowhere.
    unrested: Cell<bool>,
}

impl<'a> List<'a> {
    /// The list `given` under finite options, planned through some of its `poses`.
    fn new(
        given: &'a [Isometry3<f64>],
        poses: &'a [Isometry3<f64>],
        options: &'a SmoothOptions,
    ) -> Self {
        Self {
            given,
            poses,
            options,
            exact_stop: exact_stop::duration(given, &options.limits),
            least: lower_bound(poses, options),
            best: Cell::new(f64::INFINITY),
            unrested: Cell::new(false),
        }
    }

    /// The fastest certified motion of the ways of planning that suit the list; `None` without a
    /// tolerance, and where no certificate holds.
    fn fastest(&self) -> Option<SmoothPlan> {
        let form = &NormalForm::new(self.poses, self.options)?;
        let (first, other) = self.at_first(form)?;
        let best = if self.is_doubtful(&first) {
            self.compared(form, first, other)?
        } else {
            first
        };
        let mut plan = self.without_rests(form, best).plan;
        plan.certificate.lower_bound = self.least;
        Some(plan)
    }

    /// The motion of the way of planning that suits the list; or the faster one of two, and the other one.
    fn at_first(&self, form: &NormalForm) -> Option<(Found, Option<Found>)> {
        let dense = self.options.fit && dense::is_dense(&form.poses, &form.options);
        // A list whose corners show is divided as often as needed only where a spline rests, or no search starts from it.
        let corners = dense && dense::shows_corners(&form.poses, &form.options);
        let fitted = if dense {
            self.fitted(form, !corners)
        } else {
            None
        };
        let enough = fitted.as_ref().is_some_and(Found::suffices);
        let alone = fitted
            .as_ref()
            .is_some_and(|fitted| self.is_fitted_alone(fitted));
        if alone || enough && dense::suffices(&form.poses, &form.options) {
            return Some((fitted?, None));
        }
        let spline = self.by_spline(form);
        let spline = spline.or_else(|| self.by_spline(&form.turned(self.poses, self.options)));
        let rests = |spline: &Found| !spline.plan.rests().is_empty();
        let divided =
            corners && fitted.is_none() && (self.is_long() || spline.as_ref().is_none_or(rests));
        let fitted = if divided {
            self.fitted(form, true)
        } else {
            fitted
        };
        let (best, other) = Found::ordered(fitted, spline)?;
        if self.options.is_rough() || dense || !self.is_slow(&best) || !self.may_be_fitted(form) {
            return Some((best, other));
        }
        Found::ordered(Some(best), self.fitted(form, true))
    }

    /// Whether a curve may be fitted through the list.
    fn may_be_fitted(&self, form: &NormalForm) -> bool {
        self.options.fit && dense::may_be_fitted(&form.poses, &form.options)
    }

    /// Whether a motion may be much slower than another: it rests on its way, or is far above the bound.
    fn is_slow(&self, found: &Found) -> bool {
        found.is_divided() || found.plan.duration() > SLOW * self.least
    }

    /// Whether a motion is so far above the bound that others are compared with it, those within less of the tolerance too.
    fn is_far(&self, found: &Found) -> bool {
        found.plan.duration() > FAR * self.least
    }

    /// Whether the list is longer than one window may be: no search starts from its motion as a whole.
    fn is_long(&self) -> bool {
        self.poses.len() > windows::MOST_POSES
    }

    /// Whether a motion is a fit that is compared with no splines: where these need three windows or more, they take seconds,
    /// and are rarely faster than a fit as it should be that rests nowhere.
    fn is_fitted_alone(&self, found: &Found) -> bool {
        let fitted = found
            .motion
            .parts
            .iter()
            .any(|(method, _)| *method == Method::Fit);
        let near = found.plan.duration() <= FITTED * self.least;
        let good = found.plan.rests().is_empty() && (near || !found.motion.eased);
        self.poses.len() > 2 * windows::MOST_POSES && fitted && good
    }

    /// Whether another search may find a faster motion.
    fn is_doubtful(&self, found: &Found) -> bool {
        let over = found.plan.duration() / self.least;
        let fitted = found.plan.method() == Method::Fit && found.suffices();
        let doubtful = if fitted && self.is_long() {
            FITTED
        } else {
            DOUBTFUL
        };
        let far = over > doubtful || (found.motion.retried && over > NEAR);
        !self.options.is_rough() && (found.is_divided() || (far && self.poses.len() > FEW))
    }

    /// The fastest of a doubtful motion and others: of splines from the other end where it rests without need; of searches
    /// that start from the motion and, if that is far above the bound then, from those of other ways of planning; and of
    /// those within less of the tolerance, where an attempt failed, the list is too long for searches, or the motion is
    /// still far above the bound.
    fn compared(&self, form: &NormalForm, first: Found, other: Option<Found>) -> Option<Found> {
        let (hard, mut best) = (first.is_hard(), first);
        let mut others = [other, None];
        if best.is_divided() && !self.is_fitted_alone(&best) {
            let turned = form.turned(self.poses, self.options);
            let turned = self.by_windows(&turned, &turned.options);
            (best, others[1]) = Found::ordered(Some(best), turned)?;
        }
        best = self.refined(form, best);
        // A long list that was divided at seams only is as fast within less.
        if best.is_divided() && self.is_fitted_alone(&best) {
            return Some(best);
        }
        // A search may end elsewhere from a slower motion.
        for other in others.into_iter().flatten() {
            if self.is_far(&best) {
                best = Found::faster(Some(best), Some(self.refined(form, other)))?;
            }
        }
        if hard || self.is_far(&best) || best.is_hard() || self.is_long() {
            let before = best.plan.duration();
            best = self.within_less(form, best)?;
            if best.plan.duration() < before {
                best = self.refined(form, best);
            }
        }
        Some(best)
    }

    /// The fastest of a motion and of those within less of the tolerance: what holds there holds here, and a search in
    /// wide balls may fail where one in narrow ones does not.
    fn within_less(&self, form: &NormalForm, mut best: Found) -> Option<Found> {
        let fit = self.may_be_fitted(form);
        let fitted = best.plan.method() == Method::Fit;
        let cheap = best.motion.retried || !self.is_costly(&best.plan);
        let alone = self.is_fitted_alone(&best);
        let spline = !alone && (self.is_slow(&best) || (!fitted && cheap));
        let mut left = if best.is_hard() { PATIENCE } else { 1 };
        // Where an attempt failed, or the best motion is slow, the search from that motion may have failed, too.
        let refined = |found: Option<Found>, again: bool| match found {
            Some(found) if again => Some(self.refined(form, found)),
            found => found,
        };
        for tolerance in narrower(form.options.tolerance).take(MOST_NARROWER) {
            let options = within(&form.options, tolerance / form.options.tolerance);
            let before = best.plan.duration();
            if fit {
                let again = best.is_hard() || self.is_far(&best);
                // Divided a few times only if a motion is known that rests nowhere, and searches start from it.
                let divided = self.is_long() || !self.unrested.get();
                let fit = refined(self.fit(form, &options, divided), again);
                best = Found::faster(Some(best), fit)?;
            }
            if spline {
                let spline = refined(self.by_windows(form, &options), self.is_far(&best));
                best = Found::faster(Some(best), spline)?;
            }
            left -= usize::from(best.plan.duration() > GAIN * before);
            if left == 0 || !self.is_doubtful(&best) {
                break;
            }
        }
        Some(best)
    }

    /// The motion with which searches end that start from the one found and from each other, as far as they are faster.
    fn refined(&self, form: &NormalForm, mut found: Found) -> Found {
        // A search with orientations is dear, and finds little that a good fit has not.
        let good = found.plan.method() == Method::Fit && found.suffices();
        // A look for a faster law along the way of such a fit finds little, and no search starts from a long motion.
        if good && self.is_long() && !self.is_slow(&found) {
            return found;
        }
        let other =
            (found.backwards != form.backwards).then(|| form.turned(self.poses, self.options));
        let form = other.as_ref().unwrap_or(form);
        for _ in 0..ROUNDS {
            let before = found.plan.duration();
            let others = self.improved(form, &found.motion, !good);
            for other in others.into_iter().flatten() {
                if other.plan.duration() < found.plan.duration() {
                    found = other;
                }
            }
            if found.plan.duration() > GAIN * before {
                break;
            }
        }
        found
    }

    /// The motion along the way of a known one as fast as the limits allow, and that with which a search ends which starts
    /// there, or else from the known one.
    fn improved(&self, form: &NormalForm, known: &Motion, dear: bool) -> [Option<Found>; 2] {
        let (poses, options) = (&form.poses, &form.options);
        let search = |from: &Motion| {
            let times = known.duration() / from.duration();
            let ways = (dear, form.backwards);
            let motion = windows::refined(poses, options, (from, times), ways)?;
            self.certified(form, motion)
        };
        let Some(sooner) = retimed::motion(known, (poses, options), GAIN) else {
            return [None, search(known)];
        };
        let searched = search(&sooner).or_else(|| search(known));
        [self.certified(form, sooner), searched]
    }

    /// The motion without those of its rests past which a faster way is found: with the whole tolerance, as it may have
    /// been planned within less, within less, and from either end.
    fn without_rests(&self, form: &NormalForm, mut found: Found) -> Found {
        for (share, turned) in UNRESTED {
            let left = found.plan.rests().len();
            if left == 0 || left > FEW_RESTS || self.poses.len() <= FEW || self.options.is_rough() {
                break;
            }
            let backwards = found.backwards != turned;
            let other =
                (backwards != form.backwards).then(|| form.turned(self.poses, self.options));
            let form = other.as_ref().unwrap_or(form);
            let motion = if turned {
                found.motion.reversed()
            } else {
                found.motion.clone()
            };
            let options = within(&form.options, share);
            let holds = |motion: &Motion| self.placed(form, motion).is_some();
            let search = (f64::INFINITY, bridge::LAST);
            let bridged = bridge::bridged(&motion, (&form.poses, &options), search, &holds);
            let placed = bridged.and_then(|motion| Some((self.placed(form, &motion)?, motion)));
            let before = found.plan.duration();
            if let Some((plan, motion)) = placed.filter(|(plan, _)| plan.duration() < before) {
                found = Found {
                    plan,
                    motion,
                    backwards,
                    ..found
                };
            }
        }
        found
    }

    /// The motion along a fitted curve: the faster one from both ends if that from the first is
    /// slower than it might be; where a fit fails the list is divided as often as needed if it may be `divided`.
    fn fitted(&self, form: &NormalForm, divided: bool) -> Option<Found> {
        let first = self.fit(form, &form.options, divided);
        let good = |first: &Found| first.suffices() || self.is_fitted_alone(first);
        if first.as_ref().map_or(!divided, good) {
            return first;
        }
        let turned = form.turned(self.poses, self.options);
        Found::faster(first, self.fit(&turned, &turned.options, divided))
    }

    /// The motion along a curve fitted from one end, under options of the form.
    fn fit(&self, form: &NormalForm, options: &SmoothOptions, divided: bool) -> Option<Found> {
        self.certified(form, dense::plan(&form.poses, options, divided)?)
    }

    /// The motion by time-optimal splines, and where that is cheap the faster one of it and that within half of the
    /// tolerance: a search ends within 0.1 % of the optimum, which more tolerance may not cost.
    fn by_spline(&self, form: &NormalForm) -> Option<Found> {
        let found = self.by_windows(form, &form.options)?;
        if !self.is_planned_again(&found.plan) {
            return Some(found);
        }
        let before = found.before;
        let half = SmoothOptions {
            tolerance: 0.5 * form.options.tolerance,
            ..form.options.clone()
        };
        let mut best = Found::faster(Some(found), self.by_windows(form, &half))?;
        if before.1 {
            best.before = before;
        }
        Some(best)
    }

    /// Whether a motion by splines is planned once more within half of the tolerance: where that is cheap, and no rough
    /// curve is wanted.
    fn is_planned_again(&self, plan: &SmoothPlan) -> bool {
        let cheap = !self.is_costly(plan) && plan.parts.len() <= 1 && self.poses.len() > SHORT;
        cheap && !self.options.is_rough() && plan.method() == Method::Spline
    }

    /// Whether another spline takes long: poses are far apart.
    fn is_costly(&self, plan: &SmoothPlan) -> bool {
        plan.spans.len() > SPANS_PER_POSE * self.poses.len()
    }

    /// The motion by time-optimal splines under options of the form, window by window.
    fn by_windows(&self, form: &NormalForm, options: &SmoothOptions) -> Option<Found> {
        let motion = windows::motion(&form.poses, options, form.backwards)?;
        self.certified(form, motion)
    }

    /// A motion through the normal form as one of the list, past its rests as far as one is found that is
    /// certified, if its certificate holds.
    fn certified(&self, form: &NormalForm, motion: Motion) -> Option<Found> {
        let mut rests = motion.rests.iter();
        let divided = rests.any(|rest| rest.cause != RestCause::TurnsBack);
        let before = (motion.duration(), divided);
        let eased = motion.eased || !motion.rests.is_empty();
        let bridged = if motion.rests.is_empty() || self.options.is_rough() {
            None
        } else {
            let holds = |motion: &Motion| self.placed(form, motion).is_some();
            let best = self.best.get();
            bridge::bridged(
                &motion,
                (&form.poses, &form.options),
                (best, bridge::USUAL),
                &holds,
            )
        };
        let placed = |motion: Motion| Some((self.placed(form, &motion)?, motion));
        let (plan, motion) = bridged
            .and_then(placed)
            .or_else(|| placed(motion.clone()))
            .or_else(|| self.repaired(form, motion))?;
        self.best.set(self.best.get().min(plan.duration()));
        let unrested = plan.rests().is_empty();
        self.unrested.set(self.unrested.get() || unrested);
        Some(Found {
            plan,
            motion,
            backwards: form.backwards,
            before,
            eased,
        })
    }

    /// The motion nearest to one through the normal form that misses poses on the legs: with orientations that meet them,
    /// else that with which a search ends that starts there and passes those poses, too.
    fn repaired(&self, form: &NormalForm, mut motion: Motion) -> Option<(SmoothPlan, Motion)> {
        let placed = |motion: Motion| Some((self.placed(form, &motion)?, motion));
        let fewer = self.poses.len() < self.given.len();
        if !fewer && !form.backwards {
            return None;
        }
        let whole = form.through(self.given, self.options);
        let seen = |back| (&whole.poses[..], back);
        // The passes from the start of the form, and those that are made.
        let ways = if form.backwards {
            &[false, true][..]
        } else {
            &[false]
        };
        let mut through = form.poses.clone();
        for _ in 0..REPAIRS {
            let met = |back| missed::met(&motion, seen(back), &whole.options).and_then(placed);
            if let Some(good) = ways.iter().find_map(|back| met(*back)) {
                return Some(good);
            }
            let far = motion.duration() > WORSE * self.best.get();
            if !fewer || far {
                return None;
            }
            let with = |back| missed::with(&through, seen(back), &motion.spans, &whole.options);
            through = ways.iter().find_map(|back| with(*back))?;
            let known = (&motion, WORSE);
            motion = windows::refined(&through, &whole.options, known, (true, false))?;
            if let Some(good) = placed(motion.clone()) {
                return Some(good);
            }
        }
        None
    }

    /// A motion through the normal form, laid back, if its certificate holds.
    fn placed(&self, form: &NormalForm, motion: &Motion) -> Option<SmoothPlan> {
        let motion = form.place(motion.clone());
        let soon = motion.duration() <= self.exact_stop * (1.0 + 1e-12);
        if !soon {
            return None;
        }
        let whole = certify_passing(&motion.spans, self.given, self.options)?;
        let good = whole.0.holds();
        good.then(|| SmoothPlan::new(self.given, motion, whole, self.exact_stop))
    }
}

/// Most narrower tolerances that are tried, and how many of them without a gain where an attempt failed.
const MOST_NARROWER: usize = 5;
const PATIENCE: usize = 2;

/// Most searches in which poses that a motion misses are added, and the factor on its time that they may cost.
const REPAIRS: usize = 3;
const WORSE: f64 = 1.05;

/// Most searches from a motion, each from the one that the search before ended with.
const ROUNDS: usize = 8;

/// Most rests that are bridged once more: each costs up to a second.
const FEW_RESTS: usize = 3;

/// Shares of the tolerance within which rests that are left are bridged once more, and whether from the other end.
const UNRESTED: [(f64, bool); 6] = [
    (1.0, false),
    (1.0, true),
    (0.7, false),
    (0.7, true),
    (0.4, false),
    (0.4, true),
];

/// An attempt has gained something if its motion takes less than this share.
const GAIN: f64 = 0.998;

/// A motion that takes no more than so many times the lower bound, found at the first attempt, is rarely slower than
/// others by more than a percent; and a fit as it should be of a list longer than a window, where another search takes
/// longer, up to this.
const DOUBTFUL: f64 = 1.05;
const FITTED: f64 = 1.25;

/// A motion that takes so many times the lower bound after a search from it is compared with those within less.
const FAR: f64 = 1.2;

/// A motion that takes no more than so many times the lower bound cannot be much slower than another.
const NEAR: f64 = 1.02;

/// A motion that takes so many times the lower bound may be slow: three in four splines take less.
const SLOW: f64 = 1.4;

/// Lists up to this length are planned once.
const SHORT: usize = 5;

/// Lists up to this length are not planned within less: a curve of a few poses is one of many that a move may try.
const FEW: usize = 12;

/// Another spline is cheap if it needs no more than this many spans per pose.
const SPANS_PER_POSE: usize = 24;

#[cfg(test)]
mod tests;
