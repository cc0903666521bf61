//! The resampler's limiter where less speed is allowed near the ends of the range.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use driver_kit::{About, EndSpeeds, Reference, Resampler, ResamplerOptions};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const PERIOD: f64 = 0.001;
const SPEED: f64 = 2.6;

/// The deceleration and the offset of the limits near the ends, which are at 2 rad.
fn resampler([deceleration, offset]: [f64; 2]) -> Resampler {
    let about = About {
        lower: vec![-1.99],
        upper: vec![1.99],
        velocity: vec![SPEED],
        acceleration: vec![10.0],
        jerk: vec![5000.0],
        end_speeds: Some(EndSpeeds {
            lower: vec![-2.0],
            upper: vec![2.0],
            deceleration: vec![deceleration],
            offset: vec![offset],
        }),
        ..About::default()
    };
    let options = ResamplerOptions {
        delay: 0.004,
        period: PERIOD,
        velocity: vec![SPEED],
        acceleration: vec![9.0],
        jerk: vec![3000.0],
    };
    Resampler::new(&about, options).unwrap()
}

/// The largest speed over what is allowed at its position.
fn ratio(at: &Reference, [deceleration, offset]: [f64; 2]) -> f64 {
    if at.velocity == 0.0 {
        return 0.0;
    }
    let room = (2.0 - at.position * at.velocity.signum()).max(0.0);
    let allowed = ((2.0 * deceleration * room).sqrt() - offset).clamp(0.0, SPEED);
    at.velocity.abs() / allowed
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, rng_seed: RngSeed::Fixed(139), ..ProptestConfig::default() })]

    /// Whatever jumps the references make, and wherever they end, the commands keep the limits.
    #[test]
    fn commands_keep_them_whatever_comes(
        goals in prop::collection::vec((-1.98..1.98_f64, 20..900_usize, any::<bool>()), 1..8),
        shape in prop_oneof![Just([2.585, 0.2]), Just([6.0, 0.3]), Just([17.0, 0.35])],
    ) {
        let mut resampler = resampler(shape);
        resampler.begin(&[0.0]);
        let (mut sent, mut most, mut farthest) = (0_u64, 0.0_f64, 0.0_f64);
        for (goal, periods, silent) in goals {
            for _ in 0..periods {
                if !silent {
                    resampler.push(1_000_000_000 + sent * 1_000_000, &[Reference::rest(goal)]);
                }
                sent += 1;
                let command = resampler.next(PERIOD)[0];
                most = most.max(ratio(&command, shape));
                farthest = farthest.max(command.velocity.abs());
            }
        }
        prop_assert!(most <= 1.0, "{most}");
    }
}

/// A reference that jumps from end to end is followed fast, and slower where it must be.
#[test]
fn most_of_the_speed_is_used() {
    for shape in [[2.585, 0.2], [6.0, 0.3], [17.0, 0.35]] {
        let mut resampler = resampler(shape);
        resampler.begin(&[-1.9]);
        let (mut most, mut fastest, mut last) = (0.0_f64, 0.0_f64, 0.0);
        for number in 0..4000 {
            resampler.push(1_000_000_000 + number * 1_000_000, &[Reference::rest(1.9)]);
            let command = resampler.next(PERIOD)[0];
            most = most.max(ratio(&command, shape));
            fastest = fastest.max(command.velocity);
            last = command.position;
        }
        println!("{shape:?}: {most:.4} of the limit, {fastest:.3} rad/s");
        assert!(most <= 1.0, "{shape:?}: {most}");
        assert!(fastest > 0.8 * SPEED, "{shape:?}: {fastest}");
        assert!((last - 1.9).abs() < 1e-6, "{shape:?}: {last}");
    }
}
