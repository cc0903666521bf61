//! Where a search with the joints may go: how far from the motion that is known, and how near to the limits of the joints.
//!
//! # Source
//! J. Nocedal, S. J. Wright, "Numerical Optimization", 2nd ed. 2006, algorithm 4.1 (trust region).

use kinematics::measure::{NIMBLE, ROOM};
use nalgebra::SVector;
use trajectory::Trajectory;
use trajectory::smooth::JointBounds;

use super::Planner;

/// Share of the time that a search has to save for another like it.
const GAIN: f64 = 0.01;

/// How far each joint may go from where it is looked at (rad, m) at first and at most, by what that shrinks and grows, and how far is not
/// worth a search.
const FAR: f64 = 0.6;
const SHRINK: f64 = 0.25;
const GROW: f64 = 2.0;
const NOWHERE: f64 = 0.01;
/// Less than the one share of what was foretold to be saved says that the joints were looked at too far away, more than the other
/// that they may be farther away.
const POOR: f64 = 0.25;
const WELL: f64 = 0.75;

/// Share of the ease of the known motion that another must have, and by how many times of what it lacks the joints stay farther
/// from their limits then.
const EASED: f64 = 0.9;
const FARTHER: f64 = 3.0;

/// Places along a motion at which its ease is looked at, and by how much that may be below what was asked for in a motion along a
/// curve whose joints had it: the motion is elsewhere at the same places.
const LOOKS: u32 = 24;
const ROUNDLY: f64 = 0.01;

/// How far a search may go.
#[derive(Clone)]
pub(super) struct Region {
    /// How far each joint may go from where it is looked at, rad or m.
    far: f64,
    /// The least that this was in any search.
    least: f64,
    /// The least ease of a motion; with a spare joint only.
    ease: Option<f64>,
    /// How far from their limits the joints of an arm with a spare one stay, rad or m.
    room: Vec<f64>,
}

impl Region {
    /// How far each joint may go from where it is looked at, rad or m.
    pub(super) fn far(&self) -> f64 {
        self.far
    }

    /// The same that is as near as it was in any search.
    pub(super) fn nearest(self) -> Self {
        Self {
            far: self.least,
            ..self
        }
    }

    /// Whether another search is worth it after one that began at a motion of a time (s), of which it foretold to leave that of the
    /// second and left that of the third. Where much less is saved than was foretold the next one goes less far, where nearly all is, farther.
    pub(super) fn goes_on(&mut self, [before, foretold, after]: [f64; 3]) -> bool {
        let (hoped, saved) = (before - foretold, before - after);
        let gains = saved > GAIN * before;
        if !gains && (hoped < 2.0 * GAIN * before || SHRINK * self.far < NOWHERE) {
            return false;
        }
        if !gains || saved < POOR * hoped {
            self.far *= SHRINK;
        } else if saved > WELL * hoped {
            self.far = FAR.min(GROW * self.far);
        }
        self.least = self.least.min(self.far);
        true
    }
}

/// Joint positions at the ends of so many parts of a motion that take the same time.
pub(super) fn places<const N: usize>(
    trajectory: &Trajectory<N>,
    parts: u32,
) -> impl Iterator<Item = SVector<f64, N>> {
    let step = trajectory.duration() / f64::from(parts);
    (0..=parts).map(move |k| trajectory.sample(step * f64::from(k)).position)
}

impl<const N: usize> Planner<N> {
    /// Where searches may go that begin at a known motion.
    pub(super) fn region(&self, known: &Trajectory<N>) -> Region {
        let chain = self.chain();
        let places: Vec<_> = places(known, LOOKS).collect();
        let room = |j: usize| {
            let room = places.iter().map(|q| chain.room(j, q[j]));
            room.fold(ROOM, f64::min).max(0.0)
        };
        Region {
            far: FAR,
            least: FAR,
            ease: (N > 6).then(|| EASED * self.ease_along(known)),
            room: (0..N).map(|j| if N > 6 { room(j) } else { 0.0 }).collect(),
        }
    }

    /// What the joints may do. With a spare joint they may be no nearer to limits than in the known motion, up to what counts as
    /// well inside.
    pub(super) fn joint_bounds(&self, region: &Region) -> Vec<JointBounds> {
        let (limits, chain) = (&self.limits, self.chain());
        let joint = |(j, room): (usize, &f64)| JointBounds {
            position: [chain.lower()[j] + room, chain.upper()[j] - room],
            rates: [limits.velocity[j], limits.acceleration[j], limits.jerk[j]],
        };
        region.room.iter().enumerate().map(joint).collect()
    }

    /// Whether a motion with which searches end has enough ease, or nearly so.
    pub(super) fn is_eased(&self, trajectory: &Trajectory<N>, region: &Region) -> bool {
        self.missing_ease(trajectory, region) <= ROUNDLY
    }

    /// How much ease a motion lacks; not above 0 where it has enough.
    fn missing_ease(&self, trajectory: &Trajectory<N>, region: &Region) -> f64 {
        let least = region.ease;
        least.map_or(0.0, |least| least - self.ease_along(trajectory))
    }

    /// Whether a motion has enough ease; if not, the joints stay farther from their limits from now on.
    pub(super) fn is_admitted(&self, trajectory: &Trajectory<N>, region: &mut Region) -> bool {
        let missing = self.missing_ease(trajectory, region);
        if missing > 0.0 {
            let rooms = region.room.iter_mut();
            rooms.for_each(|room| *room += FARTHER * ROOM * missing);
        }
        missing <= 0.0
    }

    /// The least ease along a motion.
    fn ease_along(&self, trajectory: &Trajectory<N>) -> f64 {
        let all = places(trajectory, LOOKS).map(|q| self.ease_within(&q, [ROOM, NIMBLE]));
        all.fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region() -> Region {
        Region {
            far: FAR,
            least: FAR,
            ease: None,
            room: Vec::new(),
        }
    }

    /// It is smaller where the joints cannot follow, and larger again, not above the first, where they do what was foretold.
    #[test]
    fn it_is_as_large_as_the_joints_are_known() {
        let mut region = region();
        assert!(region.goes_on([4.0, 2.0, 4.0]) && region.far() == SHRINK * FAR);
        assert!(region.goes_on([4.0, 3.0, 3.1]) && region.far() == GROW * SHRINK * FAR);
        assert!(region.goes_on([3.1, 2.0, 2.6]) && region.far() == GROW * SHRINK * FAR);
        for _ in 0..3 {
            assert!(region.goes_on([3.0, 2.0, 2.0]));
        }
        assert_eq!(region.far(), FAR);
        assert_eq!(region.nearest().far(), SHRINK * FAR);
    }

    /// Searches end where nothing is left to save, and where no region is small enough.
    #[test]
    fn searches_end() {
        assert!(!region().goes_on([4.0, 3.97, 3.98]));
        let mut region = region();
        let more = (0..10).take_while(|_| region.goes_on([4.0, 2.0, 5.0]));
        assert_eq!(more.count(), 2);
    }
}
