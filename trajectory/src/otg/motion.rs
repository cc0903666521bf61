//! A planned move.

use nalgebra::SVector;
use realtime::{Piece, Sample};

use crate::Trajectory;

use super::joint::Frame;
use super::options::Interface;
use super::profile::BlendedProfile;
use super::state::State;

/// One joint's part of a move.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Track {
    pub(crate) frame: Frame,
    /// Whether a position had to be reached.
    pub(crate) placed: bool,
    pub(crate) blended_profile: BlendedProfile,
    /// When this joint arrives (s).
    pub(crate) duration: f64,
    /// Position, velocity and acceleration at the start (SI) and on arrival.
    pub(crate) start: [f64; 3],
    pub(crate) end: [f64; 3],
}

impl Track {
    /// Sets the end of a joint whose position is not asked for.
    pub(crate) fn finish(&mut self, enabled: bool, interface: Interface) {
        if !enabled {
            self.end = [self.start[0], 0.0, 0.0];
        } else if interface == Interface::Velocity {
            self.end[0] = self.last_position();
        }
    }

    /// Position, velocity, acceleration and jerk at `time` (s).
    pub(crate) fn at(&self, time: f64) -> [f64; 4] {
        if time >= self.duration {
            let [p, v, a] = self.end;
            let t = time - self.duration;
            return [p + t * (v + 0.5 * t * a), v + t * a, a, 0.0];
        }
        self.inside(time)
    }

    /// The same before arrival, where the end of the profile is not the exact target.
    pub(crate) fn inside(&self, time: f64) -> [f64; 4] {
        let units = self.frame.units();
        let point = self.frame.point(&self.blended_profile, time.max(0.0));
        [
            self.start[0] + units.position * point.position,
            units.velocity * point.velocity,
            units.acceleration * point.acceleration,
            units.jerk * point.jerk,
        ]
    }
}

/// A planned move of `N` joints: what `Otg::plan` returns. Plain data of fixed size.
#[derive(Clone, Copy, Debug)]
pub struct Motion<const N: usize> {
    pub(crate) tracks: [Track; N],
    pub(crate) duration: f64,
    pub(crate) straight: bool,
}

impl<const N: usize> From<&Motion<N>> for Trajectory<N> {
    fn from(motion: &Motion<N>) -> Self {
        Self::new(motion.pieces())
    }
}

impl<const N: usize> Motion<N> {
    /// How long the move lasts (s).
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// When joint `joint` arrives (s): the duration of the move, unless joints are not
    /// synchronised. `None` if there is no such joint.
    pub fn arrival(&self, joint: usize) -> Option<f64> {
        self.tracks.get(joint).map(|track| track.duration)
    }

    /// How long joint `joint` brakes at first because its start breaks limits (s), mostly zero.
    pub fn braking(&self, joint: usize) -> f64 {
        self.tracks
            .get(joint)
            .map_or(0.0, |track| track.frame.braking())
    }

    /// Whether joint `joint` had to reach a position (not only a velocity).
    pub fn reaches_position(&self, joint: usize) -> bool {
        self.tracks.get(joint).is_some_and(|track| track.placed)
    }

    /// Whether the joints were planned along one straight line in joint space.
    pub fn is_straight(&self) -> bool {
        self.straight
    }

    /// The motion at `time` (s) after its start, without a heap allocation. Before the start it is
    /// the start state. After the end the joints continue with velocity and acceleration of the
    /// target; for a target at rest they stay there.
    pub fn sample(&self, time: f64) -> Sample<N> {
        self.collect(|track| track.at(time))
    }

    /// The state on arrival: the target, except positions that were not asked for.
    pub fn end(&self) -> State<N> {
        self.sample(self.duration).into()
    }

    fn collect(&self, at: impl Fn(&Track) -> [f64; 4]) -> Sample<N> {
        let mut sample = Sample::rest(SVector::zeros());
        for (joint, track) in self.tracks.iter().enumerate() {
            let [p, v, a, j] = at(track);
            sample.position[joint] = p;
            sample.velocity[joint] = v;
            sample.acceleration[joint] = a;
            sample.jerk[joint] = j;
        }
        sample
    }

    /// The same motion as pieces of constant jerk, split wherever a joint switches. This one
    /// allocates.
    pub fn pieces(&self) -> Vec<Piece<N>> {
        let times = self.switches();
        times
            .windows(2)
            .map(|pair| {
                let (from, to) = (pair[0], pair[1]);
                let middle = 0.5 * (from + to);
                let back = from - middle;
                let s = self.collect(|track| {
                    let [p, v, a, j] = track.at(middle);
                    let half = 0.5 * back;
                    let third = back / 3.0;
                    [
                        p + back * (v + half * (a + third * j)),
                        v + back * (a + half * j),
                        a + back * j,
                        j,
                    ]
                });
                Piece::cubic(to - from, s.position, s.velocity, s.acceleration, s.jerk)
            })
            .collect()
    }

    /// Start, end and all instants between at which a jerk changes, ascending; instants closer
    /// than rounding are one.
    fn switches(&self) -> Vec<f64> {
        let mut times = vec![0.0];
        for track in &self.tracks {
            track
                .frame
                .switches(&track.blended_profile, |time| times.push(time));
            times.push(track.duration);
        }
        times.sort_by(f64::total_cmp);
        let close = 4.0 * f64::EPSILON * self.duration;
        times.dedup_by(|later, earlier| *later - *earlier <= close);
        times.retain(|time| *time < self.duration - close);
        times.push(self.duration);
        times
    }
}
