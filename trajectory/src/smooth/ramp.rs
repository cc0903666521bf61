//! One-dimensional jerk-limited motion along a leg.

/// Limits along one leg, in its own unit of length: speed, acceleration, jerk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Caps {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
    pub(crate) jerk: f64,
}

impl Caps {
    /// Speed, acceleration, jerk.
    pub(crate) fn values(&self) -> [f64; 3] {
        [self.speed, self.acceleration, self.jerk]
    }
}

/// Speed and acceleration at an end of a leg. `acceleration` is the one that
/// leads away from the end into the leg, so it is >= 0 at both ends (seen
/// backwards in time at the far end).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Gate {
    pub(crate) speed: f64,
    pub(crate) acceleration: f64,
}

impl Gate {
    /// Lowest top speed reachable from this gate: the acceleration is taken to
    /// zero at full jerk.
    fn lowest_top(&self, caps: &Caps) -> f64 {
        self.speed + self.acceleration * self.acceleration / (2.0 * caps.jerk)
    }
}

/// Durations of the rise from `gate` to the speed `top` with no acceleration
/// left: jerk up, hold, jerk down. `top` is at least [`Gate::lowest_top`].
fn rise(gate: &Gate, top: f64, caps: &Caps) -> [f64; 3] {
    let (a0, jerk) = (gate.acceleration, caps.jerk);
    let gain = (top - gate.speed).max(0.0);
    let peak = (jerk * gain + 0.5 * a0 * a0)
        .max(a0 * a0)
        .sqrt()
        .min(caps.acceleration)
        .max(a0);
    let up = (peak - a0) / jerk;
    let down = peak / jerk;
    let ramps = (2.0 * peak * peak - a0 * a0) / (2.0 * jerk);
    let hold = if peak > 0.0 {
        ((gain - ramps) / peak).max(0.0)
    } else {
        0.0
    };
    [up, hold, down]
}

/// Distance covered while rising.
fn rise_distance(gate: &Gate, times: &[f64; 3], caps: &Caps) -> f64 {
    let mut state = [0.0, gate.speed, gate.acceleration];
    for (duration, jerk) in times.iter().zip([caps.jerk, 0.0, -caps.jerk]) {
        state = advance(state, *duration, jerk);
    }
    state[0]
}

/// Position, speed and acceleration after `t` at constant jerk.
pub(crate) fn advance([x, v, a]: [f64; 3], t: f64, jerk: f64) -> [f64; 3] {
    [
        x + (v + (a / 2.0 + jerk * t / 6.0) * t) * t,
        v + (a + jerk * t / 2.0) * t,
        a + jerk * t,
    ]
}

/// Fastest motion over `length` between two gates under `caps`, as pieces
/// (duration, jerk); `None` when the leg is too short for its gates.
///
/// The distance grows with the top speed, so the top speed is bracketed and bisected; both halves
/// are the same rise, the second one backwards in time.
///
/// # Source
/// Profile families: R. Haschke, E. Weitnauer, H. Ritter, "On-line planning of
/// time-optimal, jerk-limited trajectories", IROS 2008.
pub(crate) fn leg(length: f64, start: Gate, end: Gate, caps: &Caps) -> Option<Vec<(f64, f64)>> {
    let halves = |top: f64| (rise(&start, top, caps), rise(&end, top, caps));
    let distance = |top: f64| {
        let (first, last) = halves(top);
        rise_distance(&start, &first, caps) + rise_distance(&end, &last, caps)
    };
    let mut low = start.lowest_top(caps).max(end.lowest_top(caps));
    if low > caps.speed * (1.0 + 1e-12) || distance(low) > length * (1.0 + 1e-12) {
        return None;
    }
    let mut top = caps.speed.max(low);
    if distance(top) > length {
        let mut high = top;
        for _ in 0..200 {
            top = 0.5 * (low + high);
            if top <= low || top >= high {
                break;
            }
            if distance(top) > length {
                high = top;
            } else {
                low = top;
            }
        }
        top = low;
    }
    let (first, last) = halves(top);
    let cruise = if top > 0.0 {
        (length - distance(top)).max(0.0) / top
    } else {
        0.0
    };
    let jerk = caps.jerk;
    Some(vec![
        (first[0], jerk),
        (first[1], 0.0),
        (first[2], -jerk),
        (cruise, 0.0),
        (last[2], -jerk),
        (last[1], 0.0),
        (last[0], jerk),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..ProptestConfig::default() })]

        /// The leg is covered, ends as asked, keeps its caps, and some cap is active.
        #[test]
        fn covers_the_leg(
            length in -6.0..1.0_f64, gates in prop::array::uniform4(0.0..0.9_f64),
            caps in prop::array::uniform3(-1.0..2.0_f64),
        ) {
            let [speed, acceleration, jerk] = caps.map(|x| 10_f64.powf(x));
            let (length, caps) = (10_f64.powf(length), Caps { speed, acceleration, jerk });
            let start = Gate { speed: gates[0] * speed * 0.5, acceleration: gates[1] * acceleration };
            let end = Gate { speed: gates[2] * speed * 0.5, acceleration: gates[3] * acceleration };
            if let Some(pieces) = leg(length, start, end, &caps) {
                let mut state = [0.0, start.speed, start.acceleration];
                for (duration, jerk) in pieces {
                    prop_assert!(duration >= 0.0);
                    state = advance(state, duration, jerk);
                    prop_assert!(state[1] <= speed * (1.0 + 1e-9));
                    prop_assert!(state[2].abs() <= acceleration * (1.0 + 1e-9));
                }
                assert_relative_eq!(state[0], length, epsilon = 1e-9 * length, max_relative = 1e-8);
                assert_relative_eq!(state[1], end.speed, epsilon = 1e-8 * speed);
                assert_relative_eq!(state[2], -end.acceleration, epsilon = 1e-8 * acceleration);
            }
        }
    }

    /// 100 mm at 500 mm/s, 5000 mm/s2, 1e5 mm/s3: by hand 0.1/0.5 + 0.5/5 + 0.05 s.
    #[test]
    fn known_leg() {
        let caps = Caps {
            speed: 0.5,
            acceleration: 5.0,
            jerk: 100.0,
        };
        let pieces = leg(0.1, Gate::default(), Gate::default(), &caps).unwrap();
        let duration: f64 = pieces.iter().map(|piece| piece.0).sum();
        assert_relative_eq!(duration, 0.35, epsilon = 1e-12);
    }
}
