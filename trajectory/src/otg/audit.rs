//! An independent check of a planned move.

use realtime::Piece;

use super::limits::Limits;
use super::motion::Motion;
use super::state::State;

/// Worst cases of a planned move, computed from its pieces alone: bounds for all times, not
/// samples.
///
/// All numbers are worst cases over the joints in each joint's own units: acceleration limit A for
/// accelerations, A/J for times (J the jerk limit), hence A²/J for velocities and A³/J² for
/// positions; V, V/A where jerk is not limited. Positions are further divided by `1 + |start| +
/// |target| + fastest · duration` in those units, velocities by `1 + fastest`, because floating
/// point resolves no smaller differences. Four roundings of a time as long as the move are
/// subtracted from steps and excess of velocity and acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Audit {
    /// Largest difference between the first piece and the start.
    pub start: f64,
    /// Largest difference between the last piece and the target.
    pub end: f64,
    /// Largest step of position, velocity or (where jerk is limited) acceleration between pieces.
    pub joins: f64,
    /// Largest velocity beyond its limit.
    pub velocity: f64,
    /// Largest acceleration beyond its limit.
    pub acceleration: f64,
    /// Largest jerk beyond its limit, relative to the limit.
    pub jerk: f64,
}

impl Audit {
    /// The largest of all numbers.
    pub fn worst(&self) -> f64 {
        let mut worst = self.start;
        for value in [
            self.end,
            self.joins,
            self.velocity,
            self.acceleration,
            self.jerk,
        ] {
            raise(&mut worst, value);
        }
        worst
    }

    /// Checks `motion` against what was asked for. Limits are not checked after a joint's
    /// arrival, nor while it brakes
    /// because its start breaks them, and a velocity that is still beyond its limit then (because the
    /// opposite limit leaves no other way) only must not grow; positions that were not asked for count as reached.
    pub fn of<const N: usize>(
        motion: &Motion<N>,
        start: &State<N>,
        target: &State<N>,
        limits: &Limits<N>,
    ) -> Self {
        let pieces = motion.pieces();
        let mut audit = Self::default();
        for joint in 0..N {
            let scale = Scale::of(joint, limits, start, motion);
            let pieces = until(&pieces, motion.arrival(joint).unwrap_or(0.0));
            if let (Some(first), Some(last)) = (pieces.first(), pieces.last()) {
                let off = scale.difference(at(first, joint, 0.0), of_joint(start, joint));
                raise(&mut audit.start, off);
                let reached = at(last, joint, last.duration);
                raise(
                    &mut audit.end,
                    scale.difference(reached, of_joint(target, joint)),
                );
            }
            audit.pieces(joint, &scale, pieces, limits);
            audit.joins(joint, &scale, pieces);
        }
        audit
    }

    fn joins<const N: usize>(&mut self, joint: usize, scale: &Scale, pieces: &[Piece<N>]) {
        for pair in pieces.windows(2) {
            let before = at(&pair[0], joint, pair[0].duration);
            raise(
                &mut self.joins,
                scale.difference(before, at(&pair[1], joint, 0.0)),
            );
        }
    }

    fn pieces<const N: usize>(
        &mut self,
        joint: usize,
        scale: &Scale,
        pieces: &[Piece<N>],
        limits: &Limits<N>,
    ) {
        let mut time = 0.0;
        let mut allowed = (limits.velocity_min[joint], limits.velocity_max[joint]);
        for piece in pieces {
            let settled = time >= scale.braking * (1.0 - 1e-12);
            time += piece.duration;
            let [_, v, a] = at(piece, joint, 0.0);
            if !settled {
                let [_, w, _] = at(piece, joint, piece.duration);
                allowed = (
                    limits.velocity_min[joint].min(w),
                    limits.velocity_max[joint].max(w),
                );
                continue;
            }
            let jerk = 6.0 * piece.coefficients[3][joint].abs();
            if limits.jerk[joint].is_finite() {
                raise(&mut self.jerk, jerk / limits.jerk[joint] - 1.0);
            }
            let [_, w, b] = at(piece, joint, piece.duration);
            let turn = -a / (6.0 * piece.coefficients[3][joint]);
            let mut speeds = (v.min(w), v.max(w));
            if turn > 0.0 && turn < piece.duration {
                let [_, extreme, _] = at(piece, joint, turn);
                speeds = (speeds.0.min(extreme), speeds.1.max(extreme));
            }
            let over = (speeds.1 - allowed.1).max(allowed.0 - speeds.0);
            raise(
                &mut self.velocity,
                (over - scale.rounding[0]) / scale.velocity,
            );
            let over = (a.max(b) - limits.acceleration_max[joint])
                .max(limits.acceleration_min[joint] - a.min(b));
            raise(
                &mut self.acceleration,
                (over - scale.rounding[1]) / scale.acceleration,
            );
        }
    }
}

/// The scale of the numbers of one joint.
struct Scale {
    position: f64,
    velocity: f64,
    acceleration: f64,
    /// Effect of rounding a time of the size of the duration on velocity and acceleration.
    rounding: [f64; 2],
    braking: f64,
    positions: bool,
    accelerations: bool,
}

impl Scale {
    fn of<const N: usize>(
        joint: usize,
        limits: &Limits<N>,
        start: &State<N>,
        motion: &Motion<N>,
    ) -> Self {
        let acceleration = limits.acceleration_max[joint];
        let jerk = limits.jerk[joint];
        let fastest = limits.velocity_max[joint].max(-limits.velocity_min[joint]);
        let second = !jerk.is_finite();
        let time = if second {
            fastest / acceleration
        } else {
            acceleration / jerk
        };
        let end = motion.end();
        let clock = 4.0 * f64::EPSILON * motion.duration();
        let finite = if second { 0.0 } else { jerk };
        let reached = start.velocity[joint]
            .abs()
            .max(end.velocity[joint].abs())
            .max((end.position[joint] - start.position[joint]).abs() / motion.duration().max(time));
        let fastest = if fastest.is_finite() {
            fastest.max(reached)
        } else {
            reached
        };
        let way =
            start.position[joint].abs() + end.position[joint].abs() + fastest * motion.duration();
        Self {
            position: acceleration * time * time + way,
            velocity: acceleration * time + fastest,
            acceleration,
            rounding: [
                clock * acceleration.max(-limits.acceleration_min[joint]),
                clock * finite,
            ],
            braking: motion.braking(joint),
            positions: motion.reaches_position(joint),
            accelerations: !second,
        }
    }

    fn difference(&self, left: [f64; 3], right: [f64; 3]) -> f64 {
        let position = (left[0] - right[0]).abs() / self.position;
        let step = (left[1] - right[1]).abs() - self.rounding[0];
        let velocity = step.max(0.0) / self.velocity;
        let step = (left[2] - right[2]).abs() - self.rounding[1];
        let acceleration = step.max(0.0) / self.acceleration;
        let position = if self.positions { position } else { 0.0 };
        let acceleration = if self.accelerations {
            acceleration
        } else {
            0.0
        };
        position.max(velocity).max(acceleration)
    }
}

/// The pieces up to `arrival` (s).
fn until<const N: usize>(pieces: &[Piece<N>], arrival: f64) -> &[Piece<N>] {
    let mut time = 0.0;
    let count = pieces.iter().take_while(|piece| {
        let middle = time + 0.5 * piece.duration;
        time += piece.duration;
        middle < arrival
    });
    &pieces[..count.count()]
}

/// Position, velocity and acceleration of a joint in a state.
fn of_joint<const N: usize>(state: &State<N>, joint: usize) -> [f64; 3] {
    [
        state.position[joint],
        state.velocity[joint],
        state.acceleration[joint],
    ]
}

/// Position, velocity and acceleration of a joint at `t` (s) in a piece.
fn at<const N: usize>(piece: &Piece<N>, joint: usize, t: f64) -> [f64; 3] {
    let [p, v, a, j] = [0, 1, 2, 3].map(|power: usize| piece.coefficients[power][joint]);
    [
        p + t * (v + t * (a + t * j)),
        v + t * (2.0 * a + 3.0 * t * j),
        2.0 * a + 6.0 * t * j,
    ]
}

fn raise(worst: &mut f64, value: f64) {
    // NaN counts as the worst value and is kept.
    if value.is_nan() || value > *worst {
        *worst = value;
    }
}
