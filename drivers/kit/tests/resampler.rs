//! The resampler: whatever the clocks and the arrivals do, no command is beyond the maker's limits,
//! and the delay stays where it was set.
#![allow(clippy::unwrap_used, reason = "tests")]

use driver_kit::{About, Reference, Resampler, ResamplerOptions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// The maker's limits, and the shares that are planned with.
const SPEED: f64 = 2.0;
const ACCELERATION: f64 = 10.0;
const JERK: f64 = 5000.0;
const PLANNED: [f64; 3] = [0.9, 0.8, 0.5];
/// The share of the maker's limits that the resampler is given, as drivers do: where it joins the plan
/// again, differences of positions can be 2 % above what it was given.
const SHARE: f64 = 0.97;
const DELAY: f64 = 0.004;
const PERIOD: f64 = 0.001;

/// A stream of numbers from a seed, in 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Moves from rest to rest between -1 and 1, each as quick as a quintic keeps the planned limits,
/// after a second of rest.
fn plan(time: f64) -> Reference {
    let limits = [
        SPEED * PLANNED[0],
        ACCELERATION * PLANNED[1],
        JERK * PLANNED[2],
    ];
    let d = 2.0_f64;
    let duration = (1.875 * d / limits[0])
        .max((5.7736 * d / limits[1]).sqrt())
        .max((60.0 * d / limits[2]).cbrt());
    let time = time - 3.0;
    if time < 0.0 {
        return Reference::rest(-1.0);
    }
    let number = (time / (duration + 0.3)).floor();
    let sign = if (number as u64).is_multiple_of(2) {
        1.0
    } else {
        -1.0
    };
    let u = ((time - number * (duration + 0.3)) / duration).min(1.0);
    let rest = 1.0 - u;
    Reference {
        position: sign * (-1.0 + d * u * u * u * (10.0 - 15.0 * u + 6.0 * u * u)),
        velocity: sign * d * 30.0 * u * u * rest * rest / duration,
        acceleration: sign * d * 60.0 * u * rest * (1.0 - 2.0 * u) / (duration * duration),
    }
}

/// How the two clocks and the way between them are.
#[derive(Clone, Copy, Debug)]
struct Trouble {
    /// How much faster the controller's clock is: a share.
    clocks: f64,
    /// Largest delay of an arrival (s).
    jitter: f64,
    /// Chance that a period begins a gap, and its largest length (s).
    gaps: [f64; 2],
    seed: u64,
}

/// What a run found.
#[derive(Debug, Default)]
struct Found {
    /// Largest shares of the maker's limits: speed, acceleration, jerk.
    peaks: [f64; 3],
    /// Smallest and largest delay (s) after the first ten seconds.
    delay: [f64; 2],
    /// Largest distance from the plan at the playhead (rad).
    error: f64,
}

fn run(periods: u64, trouble: Trouble) -> Found {
    let about = About {
        lower: vec![-1.5],
        upper: vec![1.5],
        velocity: vec![SPEED],
        acceleration: vec![ACCELERATION],
        jerk: vec![JERK],
        ..About::default()
    };
    let options = ResamplerOptions {
        delay: DELAY,
        period: PERIOD,
        velocity: vec![SPEED * SHARE],
        acceleration: vec![ACCELERATION * SHARE],
        jerk: vec![JERK * SHARE],
    };
    let mut resampler = Resampler::new(&about, options).unwrap();
    resampler.begin(&[-1.0]);
    let mut random = Random(trouble.seed);
    let (mut sent, mut arrives, mut blocked) = (0_u64, 0.0_f64, 0.0_f64);
    let mut found = Found {
        delay: [f64::MAX, f64::MIN],
        ..Found::default()
    };
    let mut last = [Reference::rest(-1.0); 4];
    for number in 0..periods {
        // The engine's time of this period of the controller.
        let now = number as f64 * PERIOD / (1.0 + trouble.clocks);
        if random.next() < trouble.gaps[0] {
            blocked = now + trouble.gaps[1] * random.next();
        }
        while arrives <= now && blocked <= now {
            let at = sent as f64 * PERIOD;
            resampler.push(1_000_000_000 + sent * 1_000_000, &[plan(at)]);
            sent += 1;
            arrives = sent as f64 * PERIOD + trouble.jitter * random.next();
        }
        let command = resampler.next(PERIOD)[0];
        last = [last[1], last[2], last[3], command];
        let p = last.map(|reference| reference.position);
        if number > 4 {
            let speed = (p[3] - p[2]) / PERIOD;
            let acceleration = (p[3] - 2.0 * p[2] + p[1]) / (PERIOD * PERIOD);
            let jerk = (p[3] - p[0] + 3.0 * (p[1] - p[2])) / (PERIOD * PERIOD * PERIOD);
            let shares = [speed / SPEED, acceleration / ACCELERATION, jerk / JERK];
            for (peak, share) in found.peaks.iter_mut().zip(shares) {
                *peak = peak.max(share.abs());
            }
        }
        if number > 10_000 {
            let delay = resampler.delay();
            found.delay = [found.delay[0].min(delay), found.delay[1].max(delay)];
            let newest = (sent - 1) as f64 * PERIOD;
            let wanted = plan(newest - delay).position;
            found.error = found.error.max((command.position - wanted).abs());
        }
    }
    found
}

fn within_limits(found: &Found) -> bool {
    found.peaks.iter().all(|peak| *peak <= 1.0)
}

#[test]
fn equal_clocks_give_the_plan() {
    let found = run(
        60_000,
        Trouble {
            clocks: 0.0,
            jitter: 0.0,
            gaps: [0.0; 2],
            seed: 1,
        },
    );
    assert!(within_limits(&found), "{found:?}");
    assert!(found.error < 1e-7, "{found:?}");
    assert!(found.peaks[1] < 0.82 && found.peaks[2] < 0.55, "{found:?}");
    assert!((found.delay[0] - DELAY).abs() < 1.1e-3, "{found:?}");
}

#[test]
fn clocks_that_differ_by_a_hundredth() {
    for clocks in [0.01, -0.01] {
        let found = run(
            120_000,
            Trouble {
                clocks,
                jitter: 0.5e-3,
                gaps: [0.0; 2],
                seed: 2,
            },
        );
        assert!(within_limits(&found), "{found:?}");
        assert!(found.error < 1e-5, "{found:?}");
        assert!(
            found.delay[0] > 0.001 && found.delay[1] < 0.008,
            "{found:?}"
        );
    }
}

/// References near the jerk limit whose positions waver a little, as those at a changing pace do, are not passed on as
/// they are: the third differences of the commands keep the limit.
#[test]
fn references_that_waver_keep_the_jerk() {
    const LEAST: f64 = 1000.0;
    // A swing with 0.9 of it.
    let (size, speed) = (9e-4, 100.0_f64);
    let mut resampler = resampler_with([SPEED, ACCELERATION, LEAST]);
    resampler.begin(&[0.0]);
    let (mut peak, mut p) = (0.0_f64, [0.0; 4]);
    for period in 0..6_000_u64 {
        let (sin, cos) = (speed * period as f64 * PERIOD).sin_cos();
        let sign = if period % 2 == 0 { 1.0 } else { -1.0 };
        let reference = Reference {
            position: size * sin + sign * LEAST * PERIOD.powi(3) / 26.0,
            velocity: size * speed * cos,
            acceleration: -size * speed * speed * sin,
        };
        resampler.push(period * 1_000_000, &[reference]);
        p = [p[1], p[2], p[3], resampler.next(PERIOD)[0].position];
        let jerk = (p[3] - p[0] + 3.0 * (p[1] - p[2])) / PERIOD.powi(3);
        peak = peak.max(jerk.abs() / LEAST);
    }
    println!("{peak:.4} of the jerk");
    assert!(peak > 0.9 && peak < 1.002, "{peak}");
}

/// The million periods of the acceptance: every trouble at once.
#[test]
fn a_million_periods_of_every_trouble() {
    let mut peaks = [0.0_f64; 3];
    for (seed, clocks) in [(3, 0.01), (4, -0.01), (5, 1e-4), (6, 0.0)] {
        let trouble = Trouble {
            clocks,
            jitter: 0.5e-3,
            gaps: [0.002, 0.015],
            seed,
        };
        let found = run(250_000, trouble);
        println!("{trouble:?} {found:?}");
        assert!(within_limits(&found), "{found:?}");
        for (peak, found) in peaks.iter_mut().zip(found.peaks) {
            *peak = peak.max(found);
        }
    }
    // The limits were reached: the check can fail.
    assert!(peaks[1] > 0.9, "{peaks:?}");
}

/// A controller that stands still for a while is behind then; it catches up without going far ahead of
/// the references.
#[test]
fn a_controller_that_stood_still_catches_up() {
    for still in [10, 20, 40_u64] {
        let mut resampler = resampler();
        resampler.begin(&[plan(0.0).position]);
        let (mut least, mut last) = (f64::INFINITY, 0.0);
        for period in 0..8_000_u64 {
            resampler.push(period * 1_000_000, &[plan(period as f64 * PERIOD)]);
            if !(3_500..3_500 + still).contains(&period) {
                resampler.next(PERIOD);
            }
            if period > 3_500 {
                least = resampler.delay().min(least);
            }
            if period == 5_500 {
                last = resampler.delay();
            }
        }
        println!("{still} ms: least delay {least:.4} s, after 2 s {last:.4} s");
        assert!(least > -0.01, "{still} ms: {least} s");
        assert!((last - DELAY).abs() < 2e-3, "{still} ms: {last} s");
    }
}

fn resampler() -> Resampler {
    resampler_of(1.0)
}

/// With a share of the maker's limits.
fn resampler_of(share: f64) -> Resampler {
    resampler_with([SPEED, ACCELERATION, JERK].map(|limit| limit * share))
}

/// With these limits of speed, acceleration and jerk.
fn resampler_with([speed, acceleration, jerk]: [f64; 3]) -> Resampler {
    let about = About {
        lower: vec![-1.5],
        upper: vec![1.5],
        velocity: vec![SPEED],
        acceleration: vec![ACCELERATION],
        jerk: vec![JERK],
        ..About::default()
    };
    let options = ResamplerOptions {
        delay: DELAY,
        period: PERIOD,
        velocity: vec![speed],
        acceleration: vec![acceleration],
        jerk: vec![jerk],
    };
    Resampler::new(&about, options).unwrap()
}

/// A controller that differences what it commands, as that of Franka arms does: acceleration goes on while commands
/// are missing, and its states are single precision.
#[derive(Default)]
struct Differences {
    position: f64,
    velocity: f64,
    acceleration: f64,
}

impl Differences {
    fn miss(&mut self) {
        self.velocity += self.acceleration * PERIOD;
        self.position += self.velocity * PERIOD;
    }

    /// Takes a command; returns the shares of the maker's limits.
    fn take(&mut self, position: f64) -> [f64; 3] {
        let velocity = (position - self.position) / PERIOD;
        let acceleration = (velocity - self.velocity) / PERIOD;
        let jerk = (acceleration - self.acceleration) / PERIOD;
        *self = Self {
            position,
            velocity,
            acceleration,
        };
        let shares = [velocity / SPEED, acceleration / ACCELERATION, jerk / JERK];
        shares.map(f64::abs)
    }

    /// What it says that it commands, as of the end of its period.
    fn told(&self) -> Reference {
        let [position, velocity, acceleration] =
            [self.position, self.velocity, self.acceleration].map(|value| f64::from(value as f32));
        Reference {
            position,
            velocity: velocity + acceleration * PERIOD / 2.0,
            acceleration,
        }
    }
}

/// Up to 18 commands in a row are lost at random times while the references come on: the command after them starts from
/// what the controller commands by itself, and none is beyond the maker's limits.
#[test]
fn commands_that_were_lost_are_joined() {
    let mut resampler = resampler_of(0.95);
    resampler.begin(&[-1.0]);
    let mut random = Random(5);
    let mut controller = Differences {
        position: -1.0,
        ..Differences::default()
    };
    let (mut lost, mut passed) = (0, 1.0);
    let mut peaks = [0.0_f64; 3];
    for number in 0..200_000_u64 {
        if lost == 0 && random.next() < 0.004 {
            lost = 1 + (18.0 * random.next()) as u64;
        }
        resampler.push(
            1_000_000_000 + number * 1_000_000,
            &[plan(number as f64 * PERIOD)],
        );
        if lost > 0 {
            (lost, passed) = (lost - 1, passed + 1.0);
            controller.miss();
            continue;
        }
        if passed > 1.0 {
            resampler.rejoin(&[controller.told()]);
        }
        let command = resampler.next(passed * PERIOD)[0].position;
        passed = 1.0;
        for (peak, share) in peaks.iter_mut().zip(controller.take(command)) {
            *peak = peak.max(share);
        }
    }
    println!("{peaks:?}");
    assert!(
        peaks[0] > 0.5 && peaks.iter().all(|peak| *peak <= 1.0),
        "{peaks:?}"
    );
}

/// From a moment on references come 12 ms later than before, in the middle of motions: the playhead is beyond the newest
/// one for a while, and the command follows those that come, also where they brake.
#[test]
fn references_that_come_later_are_followed() {
    for begin in 0..40_u64 {
        let mut resampler = resampler_of(0.95);
        resampler.begin(&[-1.0]);
        let mut worst = 0.0_f64;
        for number in 0..8000_u64 {
            let later = if number > 4000 + 25 * begin { 12 } else { 0 };
            let sent = number.saturating_sub(later);
            resampler.push(
                1_000_000_000 + sent * 1_000_000,
                &[plan(sent as f64 * PERIOD)],
            );
            let command = resampler.next(PERIOD)[0];
            let wanted = plan(sent as f64 * PERIOD).position;
            worst = worst.max((command.position - wanted).abs());
        }
        // The way of 16 ms at the largest speed, and what braking takes.
        assert!(worst < 0.04, "{begin}: {worst} rad");
    }
}

/// A stop in the middle of a motion: to rest within the maker's limits, whatever is pushed.
#[test]
fn a_stop_is_within_the_limits_and_stays() {
    for stop in [3_100, 3_400, 3_700, 4_000, 4_300] {
        let mut resampler = resampler();
        resampler.begin(&[plan(0.0).position]);
        let mut before = Reference::rest(plan(0.0).position);
        for period in 0..stop + 1_000_u64 {
            if period == stop {
                assert!(!resampler.is_resting());
                resampler.stop();
            }
            resampler.push(period * 1_000_000, &[plan(period as f64 * PERIOD)]);
            let command = resampler.next(PERIOD)[0];
            let jerk = (command.acceleration - before.acceleration).abs() / PERIOD;
            assert!(command.acceleration.abs() <= ACCELERATION * 1.001);
            assert!(jerk <= JERK * 1.001, "{jerk}");
            before = command;
        }
        assert!(resampler.is_resting());
        // Until it begins again.
        resampler.begin(&[before.position]);
        for period in stop..stop + 50 {
            let moved = before.position + (period - stop) as f64 * 1e-5;
            resampler.push(period * 1_000_000, &[Reference::rest(moved)]);
            resampler.next(PERIOD);
        }
        assert!(resampler.command()[0].position > before.position);
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(13), cases: 24, failure_persistence: None, ..ProptestConfig::default()
    })]

    #[test]
    fn the_makers_limits_hold(
        clocks in -0.02..0.02_f64, jitter in 0.0..2e-3_f64, chance in 0.0..0.01_f64,
        gap in 0.0..0.2_f64, seed in any::<u64>(),
    ) {
        let found = run(12_000, Trouble { clocks, jitter, gaps: [chance, gap], seed });
        prop_assert!(within_limits(&found), "{found:?}");
    }

    /// Whatever times are pushed, a command is finite and within the limits.
    #[test]
    fn times_that_make_no_sense(times in prop::collection::vec(any::<u64>(), 1..200), advance in -1.0..2.0_f64) {
        let about = About {
            lower: vec![-1.5], upper: vec![1.5], velocity: vec![SPEED],
            acceleration: vec![ACCELERATION], jerk: vec![JERK], ..About::default()
        };
        let options = ResamplerOptions {
            delay: DELAY, period: PERIOD, velocity: vec![SPEED],
            acceleration: vec![ACCELERATION], jerk: vec![JERK],
        };
        let mut resampler = Resampler::new(&about, options).unwrap();
        resampler.begin(&[0.0]);
        for at in times {
            resampler.push(at, &[plan(3.0 + (at % 2_000) as f64 * 1e-3)]);
            let command = resampler.next(advance)[0];
            prop_assert!(command.position.is_finite() && command.velocity.abs() <= SPEED * 1.002);
            prop_assert!(command.acceleration.abs() <= ACCELERATION * 1.002);
        }
    }
}
