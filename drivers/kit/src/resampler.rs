//! References for a controller with a clock of its own.

use std::collections::VecDeque;

use crate::{About, DriverError, Limiter, Reference};

/// Share of the speed near the ends of the ranges that commands have at most: a controller stops at the
/// first step beyond it, and the braking is looked at only at some places.
const NEAR_ENDS: f64 = 0.97;

/// How many references are kept.
const RING: usize = 256;

/// Time constant of the filters of the measured lead (s), and bandwidth of the law that draws the
/// playhead to its delay (rad/s): below 0.5 Hz, so that the jitter of arrivals does not reach the
/// arm.
const FILTER: f64 = 0.05;
const BANDWIDTH: f64 = 3.0;

/// How long the motion continues when the newest reference was passed, before it stops (s), and time
/// constant in which the difference of the clocks is found at rest (s).
const COAST: f64 = 0.03;
const LEARN: f64 = 1.0;

/// Largest difference of the two clocks, as a share, and how fast the pace may change (1/s): at
/// 3 rad/s that is 0.9 rad/s².
const CLOCKS: f64 = 0.25;
const PACE: f64 = 0.3;

/// A lead up to this teaches the difference of the clocks (s): a larger one comes from a controller that
/// stood still, and learning from it would send the playhead beyond the newest reference.
const LEARNT: f64 = 0.004;

/// The share of the largest change of the pace with which the playhead comes near to its delay.
const NEARING: f64 = 0.8;

/// An arm that is behind by this much more than it should be (s) asks for less speed; by so much more
/// again for half of it, and never for less than this share.
const BEHIND: f64 = 0.006;
const HALF: f64 = 0.02;
const LEAST: f64 = 0.2;

/// The share of the planned speed that an arm asks for which is `behind` by so much more time than it
/// should be (s), because its controller stood still: the distance that it is behind stays small until it
/// has caught up. For [`crate::Robot::speed_scaling`]; after a stall of the driver the kit asks for it by
/// itself.
///
/// ```
/// assert_eq!(driver_kit::speed_share(0.002), 1.0);
/// assert!((driver_kit::speed_share(0.026) - 0.5).abs() < 1e-12);
/// ```
pub fn speed_share(behind: f64) -> f64 {
    if behind.is_finite() {
        (HALF / (HALF + (behind - BEHIND).max(0.0))).max(LEAST)
    } else {
        LEAST
    }
}

/// Options of a [`Resampler`].
#[derive(Clone, Debug, PartialEq)]
pub struct ResamplerOptions {
    /// How far the playhead is behind the newest reference (s): three to four periods of the engine
    /// where both run at 1 kHz.
    pub delay: f64,
    /// Period of the controller (s).
    pub period: f64,
    /// The maker's largest speeds (rad/s), accelerations (rad/s²) and jerks (rad/s³), one entry per
    /// joint, in place of those of [`About`].
    pub velocity: Vec<f64>,
    /// See `velocity`.
    pub acceleration: Vec<f64>,
    /// See `velocity`.
    pub jerk: Vec<f64>,
}

impl ResamplerOptions {
    /// With shares of the velocities, accelerations and jerks of an arm.
    pub fn of_shares(about: &About, delay: f64, period: f64, shares: [f64; 3]) -> Self {
        let part = |values: &[f64], share: f64| values.iter().map(|value| value * share).collect();
        Self {
            delay,
            period,
            velocity: part(&about.velocity, shares[0]),
            acceleration: part(&about.acceleration, shares[1]),
            jerk: part(&about.jerk, shares[2]),
        }
    }
}

/// A reference of all joints with its time.
#[derive(Clone, Debug)]
struct Row {
    /// Time (s) since the first reference.
    at: f64,
    joints: Vec<Reference>,
}

/// The references of the engine at the times of a controller with a clock of its own.
///
/// References are pushed with their times ([`crate::Command::at_ns`]). In each period of the
/// controller [`Resampler::next`] moves a playhead on by the controller's own time and gives the
/// motion there: the quintic through position, velocity and acceleration of both neighbours. The
/// playhead is drawn slowly to its delay behind the newest reference, so the clocks may differ.
/// Behind it is a limiter with the maker's limits, which starts from the last command: after a stall
/// or a gap the motion joins the plan again within these limits. Where the newest reference is
/// passed, the motion continues for a while and then stops.
///
/// ```
/// use driver_kit::{About, Reference, Resampler, ResamplerOptions};
///
/// let about = About {
///     lower: vec![-3.0], upper: vec![3.0],
///     velocity: vec![2.0], acceleration: vec![10.0], jerk: vec![1000.0],
///     ..About::default()
/// };
/// let options = ResamplerOptions {
///     delay: 0.004, period: 0.001,
///     velocity: vec![2.0], acceleration: vec![10.0], jerk: vec![5000.0],
/// };
/// let mut resampler = Resampler::new(&about, options)?;
/// resampler.begin(&[0.5]);
/// resampler.push(1_000_000, &[Reference::rest(0.5)]);
/// assert_eq!(resampler.next(0.001), &[Reference::rest(0.5)]);
/// # Ok::<(), driver_kit::DriverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Resampler {
    options: ResamplerOptions,
    limiters: Vec<Limiter>,
    /// In the order of time; old ones are used again for new ones.
    ring: VecDeque<Row>,
    /// The time of the first reference (ns).
    origin_ns: Option<u64>,
    playhead: Option<Playhead>,
    /// The controller's time since the newest reference came (s).
    waited: f64,
    targets: Vec<Reference>,
    commands: Vec<Reference>,
    /// The motion ends: references count no more.
    stops: bool,
}

/// Where in the references the controller is.
#[derive(Clone, Copy, Debug)]
struct Playhead {
    /// Time (s) since the first reference.
    at: f64,
    /// Filtered lead of the newest reference beyond the wanted delay (s), twice.
    lead: [f64; 2],
    /// Difference of the clocks that was found: a share.
    clocks: f64,
    /// The share by which the playhead is faster than the controller's clock.
    pace: f64,
}

impl Resampler {
    /// Nothing to follow yet. `about` gives the ranges of the joints.
    ///
    /// # Errors
    /// [`DriverError::Count`] or [`DriverError::Value`] for lists that do not fit.
    pub fn new(about: &About, options: ResamplerOptions) -> Result<Self, DriverError> {
        let maker = About {
            velocity: options.velocity.clone(),
            acceleration: options.acceleration.clone(),
            jerk: options.jerk.clone(),
            end_speeds: about.end_speeds.as_ref().map(|ends| ends.scaled(NEAR_ENDS)),
            ..about.clone()
        };
        maker.check()?;
        DriverError::check_value("delay", options.delay, true)?;
        DriverError::check_value("period", options.period, true)?;
        let joints = about.joints();
        Ok(Self {
            options,
            limiters: maker.limiters(),
            ring: VecDeque::with_capacity(RING),
            origin_ns: None,
            playhead: None,
            waited: 0.0,
            targets: vec![Reference::default(); joints],
            commands: vec![Reference::default(); joints],
            stops: false,
        })
    }

    /// Begins a motion at rest where the controller commands the joints (rad); what was pushed
    /// before is forgotten.
    pub fn begin(&mut self, commanded: &[f64]) {
        self.ring.clear();
        self.origin_ns = None;
        self.playhead = None;
        self.waited = 0.0;
        self.stops = false;
        for (joint, at) in commanded.iter().enumerate().take(self.commands.len()) {
            self.commands[joint] = Reference::rest(*at);
        }
        self.targets.clone_from(&self.commands);
    }

    /// The controller did not take the last command and commands this by itself: the next one
    /// starts from there.
    pub fn rejoin(&mut self, commanded: &[Reference]) {
        for (command, found) in self.commands.iter_mut().zip(commanded) {
            *command = *found;
        }
    }

    /// Stops all joints as fast as the maker's limits allow, from the last command; references count
    /// again after the next [`Resampler::begin`].
    pub fn stop(&mut self) {
        self.stops = true;
        self.targets.clone_from(&self.commands);
    }

    /// A reference of all joints and its time (ns). One that is not newer than the last is left out.
    pub fn push(&mut self, at_ns: u64, joints: &[Reference]) {
        let origin = *self.origin_ns.get_or_insert(at_ns);
        if at_ns < origin || joints.len() != self.commands.len() {
            return;
        }
        let at = (at_ns - origin) as f64 * 1e-9;
        if self.ring.back().is_some_and(|last| at <= last.at) {
            return;
        }
        let mut row = if self.ring.len() == RING {
            self.ring.pop_front()
        } else {
            None
        }
        .unwrap_or_else(|| Row {
            at,
            joints: joints.to_vec(),
        });
        row.at = at;
        row.joints.copy_from_slice(joints);
        self.ring.push_back(row);
        self.waited = 0.0;
    }

    /// How far the command is behind the newest reference (s); 0 before the first reference.
    pub fn delay(&self) -> f64 {
        match (&self.playhead, self.ring.back()) {
            (Some(playhead), Some(newest)) => newest.at - playhead.at,
            _ => 0.0,
        }
    }

    /// The last command.
    pub fn command(&self) -> &[Reference] {
        &self.commands
    }

    /// Whether the last command rests.
    pub fn is_resting(&self) -> bool {
        self.commands.iter().all(Reference::rests)
    }

    /// The command for the controller's next period, which is `advance` (s) after the last one by
    /// the controller's own time.
    pub fn next(&mut self, advance: f64) -> &[Reference] {
        let advance = if advance.is_finite() {
            advance.clamp(0.0, 1.0)
        } else {
            0.0
        };
        if self.stops {
            let period = self.options.period;
            for (limiter, command) in self.limiters.iter().zip(&mut self.commands) {
                *command = limiter.stop(command, period);
            }
            return &self.commands;
        }
        self.move_playhead(advance);
        self.waited += advance;
        self.find_targets();
        let joints = self.commands.iter_mut().zip(&self.targets);
        for (limiter, (command, target)) in self.limiters.iter().zip(joints) {
            *command = limiter.approach(command, target, self.options.period);
        }
        &self.commands
    }

    /// Moves the playhead on, and draws it to its delay.
    fn move_playhead(&mut self, advance: f64) {
        let Some(newest) = self.ring.back() else {
            return;
        };
        let (wanted, limit) = (newest.at - self.options.delay, PACE * advance);
        let rests = self.ring.iter().all(|row| row.joints == newest.joints)
            && newest.joints.iter().all(Reference::rests);
        let playhead = self.playhead.get_or_insert(Playhead {
            at: wanted,
            lead: [0.0; 2],
            clocks: 0.0,
            pace: 0.0,
        });
        playhead.at += advance * (1.0 + playhead.pace);
        // The newest reference would be newer by what the engine's clock went on since it came.
        let lead = wanted + self.waited - playhead.at;
        let share = 1.0 - (-advance / FILTER).exp();
        playhead.lead[0] += (lead - playhead.lead[0]) * share;
        playhead.lead[1] += (playhead.lead[0] - playhead.lead[1]) * share;
        let found = playhead.lead[1];
        // During a gap nothing is learnt.
        if self.waited < COAST && !rests {
            let learnt = found.clamp(-LEARNT, LEARNT);
            playhead.clocks += BANDWIDTH * BANDWIDTH * learnt * advance;
            playhead.clocks = playhead.clocks.clamp(-CLOCKS, CLOCKS);
        }
        // No faster than it can be slowed down again on the way that is left.
        let nearing = (2.0 * NEARING * PACE * found.abs()).sqrt();
        let draw = (2.0 * BANDWIDTH * found.abs()).min(nearing);
        let pace = (playhead.clocks + draw.copysign(found)).clamp(-CLOCKS, CLOCKS);
        if rests {
            // Nothing moves: the delay may be set at once, and the pace is that of the clocks.
            playhead.at += found;
            playhead.lead = playhead.lead.map(|lead| lead - found);
            playhead.clocks = (playhead.clocks + found / LEARN).clamp(-CLOCKS, CLOCKS);
            playhead.pace = playhead.clocks;
        } else {
            playhead.pace += (pace - playhead.pace).clamp(-limit, limit);
        }
    }

    /// The motion at the playhead.
    fn find_targets(&mut self) {
        let Some(playhead) = &self.playhead else {
            return;
        };
        let at = playhead.at;
        while self.ring.len() > 2 && self.ring.get(1).is_some_and(|row| row.at <= at) {
            self.ring.pop_front();
        }
        let pace = 1.0 + playhead.pace;
        match (self.ring.front(), self.ring.get(1)) {
            (Some(before), Some(after)) if at <= after.at => {
                for (joint, target) in self.targets.iter_mut().enumerate() {
                    let ends = [&before.joints[joint], &after.joints[joint]];
                    let found = between(ends, after.at - before.at, (at - before.at).max(0.0));
                    *target = at_pace(&found, pace);
                }
            }
            (Some(only), None) if at <= only.at => {}
            _ => {
                let Some(newest) = self.ring.back() else {
                    return;
                };
                // The newest reference has been passed. It is the one to go on from: the references that come
                // meanwhile may brake.
                let passed = at - newest.at;
                let joints = newest.joints.iter().zip(&mut self.targets);
                for (limiter, (from, target)) in self.limiters.iter().zip(joints) {
                    let found = limiter.go_on(from, passed.min(COAST));
                    let found = if passed > COAST {
                        limiter.stop(&found, passed - COAST)
                    } else {
                        found
                    };
                    *target = at_pace(&found, pace);
                }
            }
        }
    }
}

/// The same motion as one goes through it at another pace.
fn at_pace(motion: &Reference, pace: f64) -> Reference {
    Reference {
        velocity: motion.velocity * pace,
        acceleration: motion.acceleration * pace * pace,
        ..*motion
    }
}

/// The quintic through two references that are `length` (s) apart, `time` (s) after the first.
///
/// # Source
/// The Hermite quintic: G. Farin, "Curves and Surfaces for CAGD", 5th ed., 2002, section 7.6, in
/// powers of time.
fn between([from, to]: [&Reference; 2], length: f64, time: f64) -> Reference {
    let (t, t2) = (length, length * length);
    let moved = to.position - from.position - (from.velocity + from.acceleration * t / 2.0) * t;
    let gained = to.velocity - from.velocity - from.acceleration * t;
    let changed = to.acceleration - from.acceleration;
    let c3 = (10.0 * moved - 4.0 * gained * t + changed * t2 / 2.0) / (t2 * t);
    let c4 = (-15.0 * moved + 7.0 * gained * t - changed * t2) / (t2 * t2);
    let c5 = (6.0 * moved - 3.0 * gained * t + changed * t2 / 2.0) / (t2 * t2 * t);
    let u = time;
    let c2 = from.acceleration / 2.0;
    Reference {
        position: from.position + u * (from.velocity + u * (c2 + u * (c3 + u * (c4 + u * c5)))),
        velocity: from.velocity + u * (2.0 * c2 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5))),
        acceleration: 2.0 * c2 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5)),
    }
}
