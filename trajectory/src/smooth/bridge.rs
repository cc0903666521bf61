//! Motion in place of a rest: from a moment before it to one after it, both in motion, the time-optimal
//! spline passes the poses between them.
//!
//! A list is divided where no motion was found through a pose, and at the division the motion rests. What
//! is left of the list does not matter there: a spline over twice the way of braking, with knots as
//! close together as the corner asks for, is found where one through the whole list is not.
//!
//! Where none is found, what comes after the rest begins before what comes before it has ended ([`overlapped`]).

use nalgebra::{Isometry3, Vector3};

use super::certificate::certify;
use super::choose::{Then, Window, stretch};
use super::crossing::{Crossing, crossings};
use super::method::Method;
use super::motion::Motion;
use super::options::SmoothOptions;
use super::overlap::overlapped;
use super::rest::Rest;
use super::span::Span;
use super::spline::{KNOTS_PER_RAMP, Moving};
use crate::{ToolLimits, ToolPoint};

/// How bridges are searched for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    /// Reaches of a bridge to both sides of the rest, in braking times, one after the other.
    reaches: &'static [f64],
    /// Whether a search goes on where its ends hold it.
    onward: bool,
}

/// The search for a motion that may be compared with others, and that for one at whose rests no other way was found.
pub(super) const USUAL: Search = Search {
    reaches: &[3.0, 2.0, 1.25, 0.6, 0.3],
    onward: false,
};
pub(super) const LAST: Search = Search {
    reaches: &[4.0, 3.0, 2.5, 2.0, 1.6, 1.25, 0.9, 0.6, 0.4],
    onward: true,
};
/// Most splines that are tried for one motion: one that stops at thousands of poses is not worth thousands.
const MOST: usize = 48;
/// Rounds over all rests: where a rest beside another is gone, a bridge may reach farther.
const ROUNDS: usize = 2;
/// Knots in the time of the corner that the tolerance allows.
const KNOTS_PER_CORNER: f64 = 6.0;
/// Most knots of a bridge: where jerks are large beside accelerations, knots as close as a ramp asks for were thousands.
const MOST_KNOTS: f64 = 400.0;
/// Factor on the time of a motion before its rests are bridged: a state at a limit leaves a search no room.
const ROOM: f64 = 1.0 + 2e-6;
/// Most that bridges save, in braking times: once, and for each. A rest costs one, the way from full speed and back to it
/// at half of the speed in the mean; a bridge may gain some by its shape beside.
const SAVED: [f64; 2] = [0.5, 1.5];
/// Share of its time that a bridge has to save at least.
const GAIN: f64 = 1e-4;
/// Factor from one time in which both sides of a rest move to the next that is tried, the least of them in ramps of the
/// acceleration, and how many whole motions are certified.
const SHORTER: f64 = 0.8;
const LEAST_OVERLAP: f64 = 0.03;
const MOST_WHOLE: usize = 5;
/// Difference of two states that are the same, in the units of the normal form.
const SAME: f64 = 1e-7;

/// A motion with its rests, and when it passes each pose between the ends.
#[derive(Clone, Debug)]
struct Bridges<'a> {
    poses: &'a [Isometry3<f64>],
    options: &'a SmoothOptions,
    spans: Vec<Span>,
    /// How each span was made.
    methods: Vec<Method>,
    rests: Vec<Rest>,
    /// Times of the passes, s.
    passes: Vec<f64>,
    /// What is known of how it was found: see [`Motion`].
    eased: bool,
    retried: bool,
    search: Search,
}

/// The motion through poses without those of its rests for which a faster way past is found, with which
/// the whole `holds`; `None` if there is none, or if it would not be faster than `best` (s).
pub(super) fn bridged(
    motion: &Motion,
    (poses, options): (&[Isometry3<f64>], &SmoothOptions),
    (best, search): (f64, Search),
    holds: &dyn Fn(&Motion) -> bool,
) -> Option<Motion> {
    let mut spans = motion.spans.clone();
    stretch(&mut spans, ROOM);
    let made = motion.parts.iter();
    let mut bridges = Bridges {
        poses,
        options,
        passes: crossings(&spans, poses, options)
            .iter()
            .map(|pass| pass.time)
            .collect(),
        methods: made
            .flat_map(|(method, count)| std::iter::repeat_n(*method, *count))
            .collect(),
        spans,
        eased: motion.eased,
        retried: motion.retried,
        search,
        rests: motion
            .rests
            .iter()
            .map(|rest| Rest {
                time: rest.time * ROOM,
                ..*rest
            })
            .collect(),
    };
    let mut left = MOST;
    for _ in 0..ROUNDS {
        let (before, mut k) = (bridges.rests.len(), 0);
        while k < bridges.rests.len() && left > 0 {
            if bridges.least(left) > best {
                return None;
            }
            // A spline has to be faster than both sides of the rest at the same time.
            let other = bridges.overlapped(k, holds);
            let saved = other.map_or(0.0, |other| bridges.duration() - other.duration());
            let passed = bridges.ends(k).into_iter().find_map(|ends| {
                left = left.checked_sub(1)?;
                bridges.passed(k, (ends, saved), holds)
            });
            match passed {
                Some(passed) => bridges = passed,
                None => k += 1,
            }
        }
        if bridges.rests.len() == before {
            break;
        }
    }
    bridges.overlap_all(holds);
    (bridges.rests.len() < motion.rests.len()).then(|| bridges.motion())
}

impl Bridges<'_> {
    /// The motion past the rest with the number `k`, if the whole of it holds then: a pass beside the bridge
    /// may be another one now, so the bridge by itself does not tell.
    fn passed(
        &self,
        k: usize,
        (ends, saved): ([f64; 2], f64),
        holds: &dyn Fn(&Motion) -> bool,
    ) -> Option<Self> {
        let mut next = self.clone();
        next.pass(k, ends, saved)?;
        holds(&next.clone().motion()).then_some(next)
    }

    /// Time (s) below which the motion does not come with so many more bridges.
    fn least(&self, bridges: usize) -> f64 {
        let saved = (SAVED[0] + SAVED[1] * self.rests.len().min(bridges) as f64) * self.brake();
        self.duration() - saved
    }

    /// Time of the motion, s.
    fn duration(&self) -> f64 {
        self.spans.last().map_or(0.0, Span::end)
    }

    /// Braking time from full speed, s.
    fn brake(&self) -> f64 {
        let limits = &self.options.limits;
        limits.speed / limits.acceleration + limits.acceleration / limits.jerk
    }

    /// Puts a spline between two times (s) in the place of the rest with the number `k`, if that saves more than so much
    /// time (s).
    fn pass(&mut self, k: usize, [from, to]: [f64; 2], saved: f64) -> Option<()> {
        let ends = [self.state(from)?, self.state(to)?];
        let moving = Moving {
            state: ends[0],
            spacing: self.spacing().max((to - from) / MOST_KNOTS),
        };
        let first = self.passes.partition_point(|time| *time <= from);
        let after = self.passes.partition_point(|time| *time < to);
        let known = self.part(from, to);
        let window = Window {
            poses: &self.poses[first..after + 2],
            options: self.options,
            moving: Some(&moving),
            finish: Some(&ends[1]),
            then: Then::Stop,
            onward: self.search.onward,
            backwards: false,
        };
        let most = ((to - from) * (1.0 - GAIN)).min(to - from - saved);
        let bridge = window.spline(Some(&known), most)?;
        joins(&bridge.spans, &ends, &self.options.limits).then_some(())?;
        let (certificate, times) = certify(&bridge.spans, window.poses, self.options);
        // What the bridge exceeds a limit by the whole motion is slowed down by.
        let slower = if certificate.holds() {
            1.0
        } else {
            certificate.stretch() * ROOM
        };
        (bridge.duration() + (slower - 1.0) * self.duration() <= most).then_some(())?;
        for (time, pass) in self.passes[first..after].iter_mut().zip(times) {
            *time = from + pass.time;
        }
        self.replace(k, [from, to], (Method::Spline, bridge.spans));
        self.slow_down(slower);
        Some(())
    }

    /// Lets both sides of each rest that is left overlap where the whole of it holds then.
    fn overlap_all(&mut self, holds: &dyn Fn(&Motion) -> bool) {
        let (mut k, mut left) = (0, MOST);
        while k < self.rests.len() && left > 0 {
            left -= 1;
            match self.overlapped(k, holds) {
                Some(passed) => *self = passed,
                None => k += 1,
            }
        }
    }

    /// The motion in which what comes after the rest with the number `k` begins before what comes before it ends, as
    /// early as the whole of it holds.
    fn overlapped(&self, k: usize, holds: &dyn Fn(&Motion) -> bool) -> Option<Self> {
        let rest = self.rests[k].time;
        let [from, to] = self.reach(k, 1.0);
        let ramp = self.options.limits.acceleration / self.options.limits.jerk;
        let corner = self.state(rest)?.pose;
        let (mut time, mut left) = (ramp.min(rest - from).min(to - rest), MOST_WHOLE);
        while time > LEAST_OVERLAP * ramp && left > 0 {
            let sides = [self.part(rest - time, rest), self.part(rest, rest + time)];
            let spans = overlapped(&sides[0], &sides[1], &corner);
            if self.is_near(&spans, &corner) {
                left -= 1;
                let mut next = self.clone();
                let method = self.methods[self.at(rest - time)];
                next.replace(k, [rest - time, rest + time], (method, spans));
                let passes = crossings(&next.spans, self.poses, self.options);
                next.passes = passes.iter().map(|pass| pass.time).collect();
                if holds(&next.clone().motion()) {
                    return Some(next);
                }
            }
            time *= SHORTER;
        }
        None
    }

    /// Whether spans keep all limits and pass a pose within the tolerances.
    fn is_near(&self, spans: &[Span], corner: &Isometry3<f64>) -> bool {
        let (certificate, passes) = certify(spans, &[*corner; 3], self.options);
        let near = passes.first().is_some_and(Crossing::holds);
        near && certificate.worst_limit() <= 1.0
    }

    /// Takes so many times the time for all of the motion.
    fn slow_down(&mut self, factor: f64) {
        stretch(&mut self.spans, factor);
        let rests = self.rests.iter_mut().map(|rest| &mut rest.time);
        for time in rests.chain(&mut self.passes) {
            *time *= factor;
        }
    }

    /// When the bridges over a rest begin and end that are searched for, s: each once, as two reaches may be the same
    /// between rests.
    fn ends(&self, k: usize) -> Vec<[f64; 2]> {
        let reaches = self.search.reaches.iter();
        let mut ends: Vec<_> = reaches.map(|reach| self.reach(k, *reach)).collect();
        ends.dedup();
        ends
    }

    /// When the bridge over a rest begins and ends, s.
    fn reach(&self, k: usize, reach: f64) -> [f64; 2] {
        let brake = self.brake();
        let time = self.rests[k].time;
        let before = k.checked_sub(1).map_or(0.0, |k| self.rests[k].time);
        let end = self.duration();
        let after = self.rests.get(k + 1).map_or(end, |rest| rest.time);
        [
            (time - reach * brake).max(0.5 * (before + time)),
            (time + reach * brake).min(0.5 * (time + after)),
        ]
    }

    /// Knot spacing of a bridge, s: as in other splines, and finer if the tolerance shows corners.
    fn spacing(&self) -> f64 {
        let (limits, options) = (&self.options.limits, self.options);
        let tolerance = options.tolerance.min(options.corridor());
        // The time in which a jerk turns the motion at a corner.
        let corner = (96.0 * tolerance / limits.jerk).cbrt();
        let ramp = limits.acceleration / limits.jerk;
        (ramp / KNOTS_PER_RAMP).min(corner / KNOTS_PER_CORNER)
    }

    /// The span at a time.
    fn at(&self, time: f64) -> usize {
        self.spans
            .partition_point(|span| span.start <= time)
            .saturating_sub(1)
    }

    /// State at a time.
    fn state(&self, time: f64) -> Option<ToolPoint> {
        let span = self.spans.get(self.at(time))?;
        Some(span.at((time - span.start).clamp(0.0, span.duration)))
    }

    /// The spans between two times, the first from the time 0 on.
    fn part(&self, from: f64, to: f64) -> Vec<Span> {
        let (first, last) = (self.at(from), self.at(to));
        let parts = self.spans[first..=last].iter().map(|span| {
            let start = span.start.max(from) - from;
            Span {
                start,
                ..span.part(from, to)
            }
        });
        parts.filter(|span| span.duration > 0.0).collect()
    }

    /// Puts spans in the place of those between two times, and of the rest with the number `k`.
    fn replace(&mut self, k: usize, [from, to]: [f64; 2], (method, bridge): (Method, Vec<Span>)) {
        let end = self.duration();
        let (first, last) = (self.at(from), self.at(to));
        let change = bridge.last().map_or(0.0, Span::end) - (to - from);
        let mut spans = self.spans[..first].to_vec();
        let mut methods = self.methods[..first].to_vec();
        let mut add = |offset: f64, method: Method, span: Span| {
            if span.duration > 0.0 {
                spans.push(Span {
                    start: span.start + offset,
                    ..span
                });
                methods.push(method);
            }
        };
        let before = &self.spans[first];
        add(
            before.start,
            self.methods[first],
            before.part(before.start, from),
        );
        for span in bridge {
            add(from, method, span);
        }
        add(
            to + change,
            self.methods[last],
            self.spans[last].part(to, end),
        );
        for (span, method) in self.spans.iter().zip(&self.methods).skip(last + 1) {
            add(change, *method, span.clone());
        }
        (self.spans, self.methods) = (spans, methods);
        self.rests.remove(k);
        for rest in &mut self.rests[k..] {
            rest.time += change;
        }
        for time in self.passes.iter_mut().filter(|time| **time >= to) {
            *time += change;
        }
    }

    /// The motion as it is now.
    fn motion(self) -> Motion {
        let mut parts: Vec<(Method, usize)> = Vec::new();
        for method in &self.methods {
            match parts.last_mut() {
                Some((last, count)) if last == method => *count += 1,
                _ => parts.push((*method, 1)),
            }
        }
        Motion {
            spans: self.spans,
            parts,
            rests: self.rests,
            eased: self.eased,
            retried: self.retried,
        }
    }
}

/// Whether spans begin and end in two states, up to rounding: that of a jerk is as large as the jerks beside it.
fn joins(spans: &[Span], ends: &[ToolPoint; 2], limits: &ToolLimits) -> bool {
    let (Some(first), Some(last)) = (spans.first(), spans.last()) else {
        return false;
    };
    let got = [first.at(0.0), last.at(last.duration)];
    got.iter().zip(ends).all(|(got, end)| {
        let off = got.pose.translation.vector - end.pose.translation.vector;
        let turned = got.pose.rotation.angle_to(&end.pose.rotation);
        let near = |got: &[Vector3<f64>; 3], end: &[Vector3<f64>; 3], jerk: f64| {
            let sizes = [end[0].norm(), end[1].norm(), jerk];
            (0..3).all(|k| (got[k] - end[k]).norm() <= SAME * (1.0 + sizes[k]))
        };
        off.norm() + turned <= SAME
            && near(&got.linear, &end.linear, limits.jerk)
            && near(&got.angular, &end.angular, limits.angular_jerk)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    /// A bridge joins the motion if its states are off by rounding, which is large in a jerk where knots are short and the
    /// jerk at an end happens to be zero; not if a velocity or a jerk is another one.
    #[test]
    fn rounding_of_a_jerk_is_no_jump() {
        let limits = ToolLimits {
            speed: 1.0,
            acceleration: 26.0,
            jerk: 13_000.0,
            ..ToolLimits::UNLIMITED
        };
        let span = |speed: f64, jerk: f64| {
            let along = [0.0, speed, 0.5, jerk / 6.0, 0.0];
            Span {
                start: 0.0,
                duration: 0.1,
                point: along.map(|x| Vector3::x() * x),
                base: UnitQuaternion::identity(),
                turns: Vec::new(),
            }
        };
        let joins = |got: Span| {
            let ends = [0.0, 0.1].map(|time| span(0.8, 0.0).at(time));
            // Its end is compared with itself: what is off at the start adds up there.
            joins(std::slice::from_ref(&got), &[ends[0], got.at(0.1)], &limits)
        };
        assert!(joins(span(0.8, 0.0)) && joins(span(0.8, 6.4e-7)));
        assert!(!joins(span(0.8 + 1e-6, 0.0)) && !joins(span(0.8, 0.1)));
    }

    /// Both ends of a bridge are at the limits of the speed and of the angular speed: its search, in which they stay those of
    /// a slower motion at first, goes on all the same.
    #[test]
    fn ends_at_limits_do_not_hold_a_bridge() {
        let limits = ToolLimits {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
            angular_speed: 3.0,
            angular_acceleration: 30.0,
            angular_jerk: 600.0,
        };
        let options = SmoothOptions::new(2e-5, limits);
        let pose = |x: f64, y: f64, turn: f64| {
            Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * turn)
        };
        // Legs that turn as fast as the tool may while it moves as fast as it may.
        let poses = [
            pose(0.0, 0.0, 0.0),
            pose(0.3, 0.0, 1.8),
            pose(0.5, 0.1, 1.8 + 6.0 * 0.05_f64.sqrt()),
        ];
        let motion = super::super::choose::corners(&poses, &options);
        let search = Search {
            reaches: &[1.25],
            ..LAST
        };
        let bridged = bridged(
            &motion,
            (&poses, &options),
            (f64::INFINITY, search),
            &|_| true,
        );
        assert!(bridged.is_some_and(|bridged| bridged.rests.is_empty()));
    }
}
