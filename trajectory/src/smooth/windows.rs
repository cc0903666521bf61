//! Plans long lists window by window, so that motion can start after the first window.

use nalgebra::{Isometry3, UnitQuaternion};

use super::certificate::certify_whole;
use super::choose::{Then, Window, corners, from_rest};
use super::crossing::{RESOLUTION, crossings, crossings_made};
use super::exact_stop;
use super::lower_bound::lower_bound;
use super::method::Method;
use super::motion::Motion;
use super::options::{SmoothError, SmoothOptions};
use super::plan::SmoothPlan;
use super::rest::RestCause;
use super::span::{Span, span_at};
use super::spline::Moving;
use crate::ToolPoint;
use crate::line::body_turn;

/// Longest part of a leg in one window, in time at full speed, s.
const LONGEST: f64 = 1.0;

/// Shortest and longest window, in braking times. The first window of a long list is shorter, so
/// that motion can start sooner.
const LEAST_BRAKES: f64 = 8.0;
const MOST_BRAKES: f64 = 16.0;
const FIRST_BRAKES: f64 = 4.0;
const LONG_BRAKES: f64 = 64.0;

/// Most legs of a list that is one window where no more than a rough curve is wanted: that needs few knots, and no search begins in motion.
const ROUGH_LEGS: usize = 36;

/// Part of a window's end that is planned again, in braking times.
const AGAIN_BRAKES: f64 = 2.0;

/// Most poses of one window.
pub(super) const MOST_POSES: usize = 400;

/// Times that a list is divided where its windows miss a pose.
const DIVISIONS: usize = 3;

/// The motion through a list by windows, uncertified; where it misses a pose the list is divided, so that
/// one pose does not cost the whole motion. A list that was laid `backwards` is passed from its end: the
/// first approaches may be others then.
pub(super) fn motion(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    backwards: bool,
) -> Option<Motion> {
    in_parts(poses, options, (backwards, DIVISIONS))
}

/// The spline with which a search ends that starts from a motion through the list, if it is certified and takes no more
/// than so many `times` as long; with the orientation as a part of the search only where that may be `dear`.
pub(super) fn refined(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    (known, times): (&Motion, f64),
    (dear, backwards): (bool, bool),
) -> Option<Motion> {
    let poses = divided(poses, options);
    if poses.len() > MOST_POSES {
        return None;
    }
    let window = Window {
        backwards,
        ..Window::from_rest(&poses, options, Then::Stop)
    };
    window.refined(&known.spans, times * known.duration(), dear)
}

/// The same, divided at most so many times.
fn in_parts(
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    (backwards, divisions): (bool, usize),
) -> Option<Motion> {
    let windows = Windows {
        backwards,
        ..Windows::new(poses, options).ok()?
    };
    let motion = windows.motion();
    let missed = missed(&motion, poses, options, backwards);
    let Some(missed) = missed.filter(|_| divisions > 0) else {
        return Some(motion);
    };
    let part = |poses| in_parts(poses, options, (backwards, divisions - 1));
    let mut first = part(&poses[..=missed])?;
    first.append(part(&poses[missed..])?, RestCause::Division);
    Some(first)
}

/// The first pose that a motion misses, as seen from the end at which it is to begin.
fn missed(
    motion: &Motion,
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
    backwards: bool,
) -> Option<usize> {
    let passes = crossings_made(&motion.spans, (poses, backwards), options);
    let mut missed = passes.iter().filter(|pass| !pass.holds());
    let first = if backwards {
        missed.next_back()
    } else {
        missed.next()
    };
    first.map(|pass| pass.index)
}

/// Plans a list of poses window by window, with look-ahead.
///
/// Each window ends at rest, so the planned part can always be started safely. Most of a window is
/// then committed; the next window continues from that state of motion, so there is no stop between
/// them. The cost grows linearly with the list.
///
/// ```
/// use nalgebra::Isometry3;
/// use trajectory::{ToolLimits, smooth::{SmoothOptions, Windows}};
/// let limits = ToolLimits { speed: 0.5, acceleration: 5.0, jerk: 100.0, ..ToolLimits::UNLIMITED };
/// let poses: Vec<_> = (0..100)
///     .map(|i| Isometry3::translation(0.01 * f64::from(i), 0.01 * f64::from(i % 2), 0.0))
///     .collect();
/// let mut windows = Windows::new(&poses, &SmoothOptions::new(0.001, limits))?;
/// assert!(windows.advance()); // motion may start now
/// assert!(windows.committed() > 0.0);
/// let plan = windows.finish();
/// assert!(plan.certificate().holds());
/// # Ok::<(), trajectory::smooth::SmoothError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Windows {
    /// The poses as given.
    given: Vec<Isometry3<f64>>,
    /// Poses without repeats, long legs divided.
    poses: Vec<Isometry3<f64>>,
    options: SmoothOptions,
    /// Whether the motion will be made from its end to its start, where one window is all of it.
    backwards: bool,
    /// What is committed, from the start on.
    done: Motion,
    /// The rest of the last window, from the end of `done`, to rest in
    /// `poses[end]`.
    tail: Motion,
    /// Pose passed last at the end of `done`.
    passed: usize,
    /// Last pose of the last window.
    end: usize,
}

impl Windows {
    /// Prepares a list of poses, the first of which is the start; plans
    /// nothing yet.
    ///
    /// # Errors
    /// [`SmoothError`] when a number of the input is unusable.
    pub fn new(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Result<Self, SmoothError> {
        options.check(poses)?;
        let options = options.finite();
        Ok(Self {
            poses: divided(poses, &options),
            given: poses.to_vec(),
            options,
            backwards: false,
            done: Motion::default(),
            tail: Motion::default(),
            passed: 0,
            end: 0,
        })
    }

    /// Plans the next window; false when the whole list is planned.
    pub fn advance(&mut self) -> bool {
        if self.end + 1 >= self.poses.len() {
            self.done.join(std::mem::take(&mut self.tail));
            return false;
        }
        let from = if self.tail.spans.is_empty() {
            self.done.rest(RestCause::Division);
            self.end
        } else {
            self.passed
        };
        let end = self.window(from);
        self.tail = self.plan(end);
        self.end = end;
        if end + 1 < self.poses.len() {
            self.commit();
        } else {
            self.done.join(std::mem::take(&mut self.tail));
        }
        true
    }

    /// Time (s) up to which the motion is final and may be executed; the rest
    /// of the planned part, which ends at rest, may still be improved.
    #[must_use]
    pub fn committed(&self) -> f64 {
        self.done.duration()
    }

    /// Pose and derivatives of the controlled point (m, rad, s) at a time up to
    /// [`Windows::committed`]; `None` beyond. The result for a time never changes, so it may be
    /// executed while later windows are planned.
    #[must_use]
    pub fn at(&self, time: f64) -> Option<ToolPoint> {
        if !(0.0..=self.committed()).contains(&time) {
            return None;
        }
        let (span, local) = span_at(&self.done.spans, time)?;
        Some(span.at(local))
    }

    /// Plans what is left and certifies the whole.
    #[must_use]
    pub fn finish(mut self) -> SmoothPlan {
        while self.advance() {}
        let stop = exact_stop::plan(&self.given, &self.options.limits);
        let exact_stop = stop.last().map_or(0.0, Span::end);
        let bound = lower_bound(&self.given, &self.options);
        let mut whole = certify_whole(&self.done.spans, &self.given, &self.options);
        if !whole.0.holds() || self.done.duration() > exact_stop * (1.0 + 1e-12) {
            self.done = corners(&self.given, &self.options);
            whole = certify_whole(&self.done.spans, &self.given, &self.options);
        }
        whole.0.lower_bound = bound;
        SmoothPlan::new(&self.given, self.done, whole, exact_stop)
    }

    /// Plans what is left; the whole, uncertified.
    pub(crate) fn motion(mut self) -> Motion {
        while self.advance() {}
        self.done
    }

    /// Braking time from full speed, s.
    fn brake(&self) -> f64 {
        let limits = &self.options.limits;
        limits.speed / limits.acceleration + limits.acceleration / limits.jerk
    }

    /// Last pose of a window that begins at pose `from`.
    fn window(&self, from: usize) -> usize {
        let last = self.poses.len() - 1;
        if from == 0 && self.options.is_rough() && last <= ROUGH_LEGS {
            return last;
        }
        let (mut end, mut time) = (from, 0.0);
        let most = MOST_BRAKES * self.brake();
        let legs = self.poses.windows(2);
        let whole = || {
            legs.map(|leg| full_speed(&leg[0], &leg[1], &self.options))
                .sum::<f64>()
        };
        let least = if from == 0 && whole() > LONG_BRAKES * self.brake() {
            FIRST_BRAKES
        } else {
            LEAST_BRAKES
        };
        while end + 1 < self.poses.len() && end - from < MOST_POSES {
            let enough = end - from >= self.options.window.max(2) && time >= least * self.brake();
            if end - from >= 3 && (enough || time >= most) {
                break;
            }
            time += full_speed(&self.poses[end], &self.poses[end + 1], &self.options);
            end += 1;
        }
        // A window that has to end at rest should end at a corner.
        let mut near = (end..self.poses.len()).take(self.options.window / 2);
        let end = near.find(|i| self.turns(*i)).unwrap_or(end);
        // A short rest of the list joins this window.
        if last - end <= self.options.window / 4 {
            last
        } else {
            end
        }
    }

    /// Whether the straight path has a corner at a pose.
    fn turns(&self, pose: usize) -> bool {
        let around = pose.saturating_sub(1)..(pose + 2).min(self.poses.len());
        exact_stop::corners(&self.poses[around.clone()]).count() == around.len()
    }

    /// Motion from the end of `done` to rest in pose `end`.
    fn plan(&self, end: usize) -> Motion {
        let options = &self.options;
        let then = if end + 1 < self.poses.len() {
            Then::More
        } else {
            Then::Stop
        };
        let more = &self.poses[self.end..=end];
        let resting = Window {
            backwards: self.backwards && more.len() == self.poses.len(),
            ..Window::from_rest(more, options, then)
        };
        if self.tail.spans.is_empty() {
            return from_rest(&resting);
        }
        let moving = self.tail.spans.first().map(|span| Moving {
            state: span.at(0.0),
            spacing: span.duration,
        });
        let window = Window {
            poses: &self.poses[self.passed..=end],
            moving: moving.as_ref(),
            ..resting
        };
        let most = self.tail.duration() + corners(more, options).duration();
        window.spline(None, most).unwrap_or_else(|| {
            let mut known = self.tail.clone();
            known.append(from_rest(&resting), RestCause::Division);
            let through = window.spline(Some(&known.spans), known.duration());
            through.unwrap_or(known)
        })
    }

    /// Moves the committed part of the tail to `done`.
    fn commit(&mut self) {
        let poses = &self.poses[self.passed..=self.end];
        let latest = self.tail.duration() - AGAIN_BRAKES * self.brake();
        let crossings = crossings(&self.tail.spans, poses, &self.options);
        let smooth = self.tail.parts.len() == 1 && self.tail.parts[0].0 == Method::Spline;
        let mut best = None;
        for (i, crossing) in crossings.iter().enumerate().filter(|_| smooth) {
            let next = crossings
                .get(i + 1)
                .map_or(self.tail.duration(), |next| next.time);
            let cut = self
                .tail
                .spans
                .partition_point(|span| span.start < crossing.time);
            let start = self
                .tail
                .spans
                .get(cut)
                .map_or(f64::INFINITY, |span| span.start);
            if start < next && start <= latest {
                best = Some((cut, self.passed + crossing.index));
            }
        }
        let Some((cut, passed)) = best else {
            self.done.join(std::mem::take(&mut self.tail));
            self.passed = self.end;
            return;
        };
        let mut rest = self.tail.spans.split_off(cut);
        let offset = rest.first().map_or(0.0, |span| span.start);
        for span in &mut rest {
            span.start -= offset;
        }
        let parts = vec![(Method::Spline, rest.len())];
        let rest = Motion {
            spans: rest,
            parts,
            ..Motion::default()
        };
        let mut head = std::mem::replace(&mut self.tail, rest);
        head.parts = vec![(Method::Spline, head.spans.len())];
        self.done.join(head);
        self.passed = passed;
    }
}

/// Time of a leg at full speed, s.
fn full_speed(from: &Isometry3<f64>, to: &Isometry3<f64>, options: &SmoothOptions) -> f64 {
    let way = (to.translation.vector - from.translation.vector).norm();
    let turn = body_turn(&from.rotation, &to.rotation).norm();
    (way / options.limits.speed).max(turn / options.limits.angular_speed)
}

/// Poses without repeats; legs longer than [`LONGEST`] are divided, as one
/// spline cannot be both long and fine.
fn divided(poses: &[Isometry3<f64>], options: &SmoothOptions) -> Vec<Isometry3<f64>> {
    let mut result = vec![poses[0]];
    let limits = &options.limits;
    // If every pose requires a stop, no poses may be added.
    let longest = if options.tolerance > RESOLUTION {
        LONGEST.max(20.0 * limits.acceleration / limits.jerk)
    } else {
        f64::INFINITY
    };
    for pose in &poses[1..] {
        let from = result[result.len() - 1];
        if crate::line::Line::new(from, *pose).is_still() {
            continue;
        }
        let parts = (full_speed(&from, pose, options) / longest)
            .ceil()
            .clamp(1.0, 1e4);
        let (way, turn) = (
            pose.translation.vector - from.translation.vector,
            body_turn(&from.rotation, &pose.rotation),
        );
        for i in 1..parts as usize {
            let share = i as f64 / parts;
            let place = from.translation.vector + way * share;
            let rotation = from.rotation * UnitQuaternion::from_scaled_axis(turn * share);
            result.push(Isometry3::from_parts(place.into(), rotation));
        }
        result.push(*pose);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ToolLimits;

    /// What planning a zigzag in windows asks for.
    #[derive(Debug, Default)]
    struct Tally {
        windows: usize,
        /// Poses of all windows, and of the largest.
        poses: usize,
        largest: usize,
        /// Most spans that are planned and not committed.
        waiting: usize,
    }

    fn tally(count: u32) -> Tally {
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            ..ToolLimits::UNLIMITED
        };
        let poses: Vec<_> = (0..count)
            .map(|i| Isometry3::translation(0.01 * f64::from(i), 0.002 * f64::from(i % 2), 0.0))
            .collect();
        let mut windows = Windows::new(&poses, &SmoothOptions::new(1e-3, limits)).unwrap();
        let mut tally = Tally::default();
        let mut since = 0;
        while windows.advance() {
            let poses = windows.end - since;
            tally.windows += 1;
            tally.poses += poses;
            tally.largest = tally.largest.max(poses);
            tally.waiting = tally.waiting.max(windows.tail.spans.len());
            since = windows.passed;
        }
        assert!(windows.finish().certificate().holds());
        tally
    }

    /// A rough curve through some dozens of poses is one window, one through more is not.
    #[test]
    fn a_rough_curve_needs_one_window() {
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            ..ToolLimits::UNLIMITED
        };
        let poses: Vec<_> = (0..100)
            .map(|i| Isometry3::translation(0.05 * f64::from(i), 0.02 * f64::from(i % 2), 0.0))
            .collect();
        let fine = SmoothOptions::new(1e-3, limits);
        let rough = SmoothOptions {
            gap: 0.05,
            ..fine.clone()
        };
        let first = |count: usize, options: &SmoothOptions| {
            let mut windows = Windows::new(&poses[..=count], options).unwrap();
            assert!(windows.advance());
            windows.end
        };
        assert_eq!(first(ROUGH_LEGS, &rough), ROUGH_LEGS);
        assert!(first(ROUGH_LEGS + 1, &rough) < ROUGH_LEGS);
        assert!(first(ROUGH_LEGS, &fine) < ROUGH_LEGS);
    }

    /// Four times the poses take four times the windows; no window is larger, and no more is
    /// planned ahead.
    #[test]
    fn cost_is_linear() {
        let (short, long) = (tally(150), tally(600));
        assert!(short.windows > 2, "{short:?}");
        assert!(long.windows <= 4 * short.windows + 1, "{short:?} {long:?}");
        assert!(long.poses <= 4 * short.poses + 60, "{short:?} {long:?}");
        assert!(long.largest <= short.largest + 5, "{short:?} {long:?}");
        assert!(long.waiting <= short.waiting + 20, "{short:?} {long:?}");
    }
}
