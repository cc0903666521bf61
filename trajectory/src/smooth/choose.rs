//! The fastest certified motion through one window of poses.

use nalgebra::Isometry3;

use super::certificate::{certify_made, certify_slowed};
use super::crossing::{Crossing, RESOLUTION, settled};
use super::exact_stop;
use super::judged::Judged;
use super::method::Method;
use super::missed;
use super::motion::Motion;
use super::narrowing::{between, broken, narrow, narrow_legs, narrow_missed};
use super::options::SmoothOptions;
use super::rest::RestCause;
use super::shares::Shares;
use super::span::Span;
pub(crate) use super::span::stretch;
use super::spline::{self, Effort, Found, Moving, Request};
use crate::ToolPoint;

mod onward;

/// Effort of one spline, but for the gap to its optimum.
const EFFORT: Effort = Effort {
    steps: 90,
    search: 72,
    spread: Some(1.0),
    gap: f64::INFINITY,
    most: f64::INFINITY,
    onward: false,
    aimed: 1e-4,
};

/// Steps after which a search for an arm is given up that goes on where another ended, and is still not inside of its bounds.
const ONWARD: usize = 30;

/// The effort of a search for an arm, which ends at a gap to its optimum, with the poses seen so far beside their vertices, in
/// radii of their balls; it may go on where another ended.
pub(super) fn arm_effort(gap: f64, aimed: f64, onward: bool) -> Effort {
    Effort {
        spread: None,
        gap,
        aimed,
        search: if onward { ONWARD } else { EFFORT.search },
        ..EFFORT
    }
}

/// An attempt that breaks a bound by more than this (its first, a later one)
/// is not followed by another.
const HOPELESS: [f64; 2] = [10.0, 3.5];

/// Attempts, the first ones, after which only the tolerances of poses that were missed and the corridor along legs that were left are
/// narrowed; after later ones those of all.
const SINGLY: usize = 2;

/// A bound that is broken by more than this is narrowed by so much that the motion may be slow.
const FAR: f64 = 1.2;

/// A motion from rest that exceeds a limit by less than this is slowed down as a whole.
pub(super) const SLOWED: f64 = 1.3;

/// The most by which a motion may miss a pose by the angle for its orientations to be turned to it.
const TURNED: f64 = 4.0;

/// A motion between two ends in motion that exceeds a limit by no more may be slowed down as a whole.
const NEARLY: f64 = 1.03;

/// Spread of a start in motion that was too fast.
const SPREAD: f64 = 1.2;

/// Fraction of the speed limit used by splines that others follow: the hull of a start in motion on
/// a bend is a little larger than the speed.
const JOIN_SPEED: f64 = 0.998;

/// What comes after a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Then {
    /// Nothing: the last pose is the goal.
    Stop,
    /// More motion, which must not change how the earlier poses were passed.
    More,
}

/// Poses that one spline is to pass.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window<'a> {
    /// The poses; with `moving` the first is the one passed last.
    pub(crate) poses: &'a [Isometry3<f64>],
    pub(crate) options: &'a SmoothOptions,
    /// State at the start; `None` at rest in the first pose.
    pub(crate) moving: Option<&'a Moving>,
    /// State at the end, before the last pose; `None` at rest in the last pose.
    pub(crate) finish: Option<&'a ToolPoint>,
    /// What comes after it.
    pub(crate) then: Then,
    /// Whether a search between two ends in motion goes on where they hold it.
    pub(crate) onward: bool,
    /// Whether the motion will be made from its end to its start: the first approaches to poses may be others then.
    pub(crate) backwards: bool,
}

/// Fastest certified motion from rest in the first pose of a window to rest in its last.
pub(crate) fn from_rest(window: &Window<'_>) -> Motion {
    let motion = in_parts(window);
    if motion.rests.is_empty() {
        return motion;
    }
    // From a motion that rests, a search may find one that does not.
    let through = window.spline(Some(&motion.spans), motion.duration());
    through.unwrap_or(motion)
}

/// The same, with stops where no spline is found.
fn in_parts(window: &Window<'_>) -> Motion {
    let Window { poses, options, .. } = *window;
    let stop = corners(poses, options);
    if poses.len() < 3 || options.tolerance <= RESOLUTION {
        return stop;
    }
    if let Some(motion) = window.spline(None, stop.duration()) {
        return motion;
    }
    // A stop in the middle splits the window into two easier ones.
    let middle = poses.len() / 2;
    let mut halves = in_parts(&Window {
        poses: &poses[..=middle],
        then: Then::More,
        ..*window
    });
    let second = in_parts(&Window {
        poses: &poses[middle..],
        ..*window
    });
    halves.append(second, RestCause::Division);
    if halves.duration() < stop.duration() {
        halves
    } else {
        stop
    }
}

/// Straight legs with a stop at each corner. There is no stop at poses on a straight line, unless
/// the tolerance requires a stop at every pose.
pub(crate) fn corners(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Motion {
    let spans = if options.tolerance > RESOLUTION {
        exact_stop::plan(&exact_stop::at_corners(poses), &options.limits)
    } else {
        exact_stop::plan(poses, &options.limits)
    };
    Motion::stops(spans)
}

/// What the attempts at one window have come to.
struct Attempts<'a> {
    window: Window<'a>,
    /// A motion through the window that holds, to start from.
    known: Option<&'a [Span]>,
    /// Longest useful time, s.
    most: f64,
    /// The options, narrowed by what was exceeded.
    inner: SmoothOptions,
    /// Shares of the tolerances of single poses, narrowed where these were missed.
    shares: Shares,
    effort: Effort,
    /// Whether the orientation has to be part of the optimum, once that is decided.
    coupled: Option<bool>,
    /// Whether it may be.
    dear: bool,
    /// Whether motions that miss poses by the angle are turned to them.
    keeps: bool,
    /// The fastest of these, and whether an attempt before it failed by far.
    turned: Option<(Vec<Span>, bool)>,
}

impl<'a> Window<'a> {
    /// A window that starts at rest.
    pub(crate) fn from_rest(
        poses: &'a [Isometry3<f64>],
        options: &'a SmoothOptions,
        then: Then,
    ) -> Self {
        Self {
            poses,
            options,
            moving: None,
            finish: None,
            then,
            onward: false,
            backwards: false,
        }
    }

    /// A certified spline through the window that takes at most `most` seconds, if one is found.
    ///
    /// From a motion that is `known`, the search has a point that holds every bound, so a motion
    /// that need not rest is found where the one that is known rests.
    pub(crate) fn spline(&self, known: Option<&[Span]>, most: f64) -> Option<Motion> {
        self.found(known, most, [true, false])
    }

    /// The same from a motion; where the orientation has to be part of the search only if it may be `dear`.
    pub(crate) fn refined(&self, known: &[Span], most: f64, dear: bool) -> Option<Motion> {
        self.found(Some(known), most, [dear, true])
    }

    fn found(&self, known: Option<&[Span]>, most: f64, [dear, keeps]: [bool; 2]) -> Option<Motion> {
        let options = self.options;
        if options.tolerance <= RESOLUTION || options.corridor() <= RESOLUTION {
            return None;
        }
        let mut inner = options.clone();
        if self.then == Then::More {
            inner.limits.speed *= JOIN_SPEED;
            inner.limits.angular_speed *= JOIN_SPEED;
        }
        let attempts = Attempts {
            window: *self,
            known,
            most,
            inner,
            shares: Shares::default(),
            effort: Effort {
                most,
                gap: options.gap,
                onward: self.onward,
                ..EFFORT
            },
            coupled: None,
            dear,
            keeps,
            turned: None,
        };
        let (spans, retried) = attempts.run()?;
        let soon = spans.last()?.end() <= most;
        soon.then(|| Motion {
            retried,
            ..Motion::new(spans, Method::Spline)
        })
    }
}

impl<'a> Attempts<'a> {
    /// A certified spline, and whether an attempt before it failed by far; between two ends in motion else the first
    /// that exceeds its limits by no more than [`NEARLY`].
    fn run(mut self) -> Option<(Vec<Span>, bool)> {
        let mut nearly = None;
        let held = self.held(&mut nearly);
        let turned = self.turned.take();
        let time = |found: &(Vec<Span>, bool)| found.0.last().map_or(0.0, Span::end);
        let faster = |found: &(Vec<Span>, bool)| {
            let held = held.as_ref().map_or(f64::INFINITY, time);
            time(found) < held
        };
        turned.filter(faster).or(held).or(nearly)
    }

    /// The same without the one that is `nearly` within its limits; bounds that one attempt breaks are narrowed for
    /// the next one.
    fn held(&mut self, nearly: &mut Option<(Vec<Span>, bool)>) -> Option<(Vec<Span>, bool)> {
        let whole = self.inner.clone();
        let (mut retried, mut early) = (false, false);
        for attempt in 0..5_usize {
            let (narrowed, shares) = (self.inner.clone(), self.shares.clone());
            let mut request = self.request(&narrowed, &shares);
            // A list and its reverse are searched alike as long as no pose is passed too early.
            request.backwards &= early;
            let [places, turns] = request.moves();
            request.coupled = self.couples(&request, turns)?;
            let Some(Found { mut spans, seed }) = spline::plan(&request) else {
                self.otherwise(request.coupled || !turns)?;
                retried = true;
                continue;
            };
            let seen = self.judge(&mut spans);
            if seen.holds() {
                return Some((spans, retried));
            }
            let later = self.later(&request, (&spans, &seed, &seen));
            early |= !later.is_empty();
            if attempt == 0
                && let Some(found) = self.gone_on(&request, (&spans, seed, &seen))
            {
                return Some(found);
            }
            let (certificate, crossings) = (&seen.certificate, &seen.crossings);
            if self.keeps && seen.settled {
                self.keep(&spans, crossings, retried);
            }
            let between = self.window.finish.is_some();
            if between && nearly.is_none() && certificate.holds_within(NEARLY) {
                *nearly = Some((spans.clone(), retried));
            }
            // Narrower bounds make it slower still.
            let slow = spans.last().map_or(0.0, Span::end) > self.most;
            let last = request.coupled || !turns;
            // A pose that is passed too early moves the passes of all that follow.
            let first = attempt == 0 && !later.is_empty();
            let far = broken(certificate, crossings);
            if last && (slow || !first && far > HOPELESS[attempt.min(1)]) {
                return None;
            }
            let again = attempt == 1 && self.dear && !seen.only_leaves();
            let couple = turns && (again || certificate.worst_limit() > SLOWED);
            self.coupled = Some(request.coupled || couple);
            if couple && !request.coupled {
                // What an orientation exceeds that follows the path says nothing about the optimum.
                (self.inner, self.shares) = (whole.clone(), Shares::default());
                continue;
            }
            retried |= far > FAR;
            let coupled = request.coupled && places;
            if !self.keep_beside(&later) {
                self.narrow(attempt, (&spans, &seen), coupled)?;
            }
        }
        None
    }

    /// What is asked of a spline under narrowed bounds, with an orientation that follows the path.
    fn request<'b>(&self, options: &'b SmoothOptions, shares: &'b Shares) -> Request<'b>
    where
        'a: 'b,
    {
        Request {
            poses: self.window.poses,
            options,
            shares,
            moving: self.window.moving,
            finish: self.window.finish,
            effort: self.effort,
            coupled: false,
            known: self.known,
            backwards: self.window.backwards,
            arm: None,
        }
    }

    /// How a motion keeps what is asked of the window, slowed down as a whole where that helps.
    fn judge(&self, spans: &mut [Span]) -> Judged {
        let Window {
            poses,
            options,
            moving,
            then,
            backwards,
            ..
        } = self.window;
        let most = if moving.is_none() { SLOWED } else { 1.0 };
        let (certificate, crossings) = certify_slowed(spans, (poses, backwards), options, most);
        Judged {
            settled: then == Then::Stop || settled(spans, poses, &crossings, options),
            certificate,
            crossings,
        }
    }

    /// Whether the orientation is part of the optimum; `None` where it has to be and is too dear. Where legs are
    /// shorter than the tolerance it need not be.
    fn couples(&self, request: &Request<'_>, turns: bool) -> Option<bool> {
        let coupled = self.coupled.unwrap_or(!request.can_follow());
        if !turns || !coupled || self.dear {
            return Some(coupled);
        }
        (self.coupled.is_none() && request.may_follow()).then_some(false)
    }

    /// Keeps the spans of a motion from rest that misses poses by the angle only, turned to them, if no faster ones are kept.
    fn keep(&mut self, spans: &[Span], crossings: &[Crossing], retried: bool) {
        let Window {
            poses,
            options,
            backwards,
            ..
        } = self.window;
        let near = |pass: &Crossing| {
            pass.deviation <= pass.tolerance && pass.angle <= TURNED * pass.angular_tolerance
        };
        if !crossings.iter().all(near) {
            return;
        }
        let most = self.turned.as_ref().and_then(|(spans, _)| spans.last());
        let most = most.map_or(f64::INFINITY, Span::end);
        let motion = Motion::new(spans.to_vec(), Method::Spline);
        let met = missed::met(&motion, (poses, backwards), options);
        let met = met.filter(|met| met.duration() < most);
        let made = |met: &Motion| certify_made(&met.spans, (poses, backwards), options);
        let holds = |met: &Motion| made(met).0.holds();
        if let Some(met) = met.filter(holds) {
            self.turned = Some((met.spans, retried));
        }
    }

    /// Prepares the attempt after one that broke bounds; `None` if it would be the same.
    fn narrow(
        &mut self,
        attempt: usize,
        (spans, seen): (&[Span], &Judged),
        coupled: bool,
    ) -> Option<()> {
        let (certificate, crossings) = (&seen.certificate, &seen.crossings);
        let Window { moving, finish, .. } = self.window;
        let before = (self.inner.clone(), self.shares.clone());
        // With other bounds that are broken more poses are missed than those that show it.
        if seen.only_leaves() || certificate.worst_limit() <= 1.0 && attempt < SINGLY {
            narrow_missed(&mut self.shares, crossings, coupled);
            let outside = self.outside(spans, seen);
            narrow_legs(&mut self.shares, &outside);
        } else {
            narrow(&mut self.inner, certificate, crossings, coupled);
        }
        if let Some((moving, finish)) = moving.zip(finish) {
            self.inner.limits = between(&before.0.limits, certificate, [&moving.state, finish]);
            if (&self.inner, &self.shares) == (&before.0, &before.1) {
                return None;
            }
        }
        if certificate.in_order && !seen.settled {
            self.inner.tolerance *= 0.5;
        }
        Some(())
    }

    /// Prepares the attempt after one that found no spline; `None` if there is no other way.
    /// `last` says that the orientation was part of the optimum, or does not change.
    fn otherwise(&mut self, last: bool) -> Option<()> {
        let anchored = self.window.moving.is_some() && self.known.is_none();
        if anchored && self.effort.spread.is_some() {
            self.effort.spread = self.effort.spread.filter(|x| *x < SPREAD).map(|_| SPREAD);
        } else if last {
            return None;
        } else {
            let most = self.most;
            let (gap, onward) = (self.window.options.gap, self.window.onward);
            (self.coupled, self.effort) = (
                Some(true),
                Effort {
                    most,
                    gap,
                    onward,
                    ..EFFORT
                },
            );
        }
        Some(())
    }
}
