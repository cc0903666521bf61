//! Properties of the path factor: whatever the operator asks at any time, every setpoint keeps the
//! joint limits and lies on the planned path.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "tests"
)]
#![allow(clippy::disallowed_types, reason = "tests may use the heap")]

use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use realtime::{Cycle, Demand, JointLimits, Piece, Pushed, Sample, Segment, StopCategory};

const N: usize = 3;
type Joints = SVector<f64, N>;

fn limits() -> JointLimits<N> {
    JointLimits {
        lower: Joints::from_element(-100.0),
        upper: Joints::from_element(100.0),
        velocity: Joints::new(3.0, 2.0, 4.0),
        acceleration: Joints::new(15.0, 8.0, 20.0),
        jerk: Joints::new(150.0, 100.0, 400.0),
        ends: None,
    }
}

fn joints(size: f64) -> impl Strategy<Value = Joints> {
    prop::array::uniform3(-size..size).prop_map(Joints::from)
}

/// A planned motion: smooth pieces from rest to rest, stretched in time until exactly one joint
/// is exactly at one of its limits.
fn motion() -> impl Strategy<Value = Vec<Piece<N>>> {
    let via = (joints(1.0), joints(1.5), joints(4.0), 0.1..0.6_f64);
    (prop::collection::vec(via, 1..6), joints(1.0)).prop_map(|(vias, goal)| {
        let mut samples = vec![(Sample::rest(Joints::zeros()), 0.3)];
        samples.extend(
            vias.into_iter()
                .map(|(position, velocity, acceleration, duration)| {
                    (
                        Sample {
                            position,
                            velocity,
                            acceleration,
                            jerk: Joints::zeros(),
                        },
                        duration,
                    )
                }),
        );
        samples.push((Sample::rest(goal), 0.4));
        let pieces: Vec<_> = samples
            .windows(2)
            .map(|pair| Piece::hermite(pair[1].1, &pair[0].0, &pair[1].0))
            .collect();
        stretch(&pieces, slowness(&pieces))
    })
}

/// The least factor on time that brings the pieces within the limits.
fn slowness(pieces: &[Piece<N>]) -> f64 {
    let limits = limits();
    let mut worst = 0.0_f64;
    for piece in pieces {
        for step in 0..=2000 {
            let sample = piece.sample(piece.duration * f64::from(step) / 2000.0);
            worst = worst
                .max(sample.velocity.component_div(&limits.velocity).amax())
                .max(
                    sample
                        .acceleration
                        .component_div(&limits.acceleration)
                        .amax()
                        .sqrt(),
                )
                .max(sample.jerk.component_div(&limits.jerk).amax().cbrt());
        }
    }
    worst
}

fn stretch(pieces: &[Piece<N>], factor: f64) -> Vec<Piece<N>> {
    pieces
        .iter()
        .map(|piece| {
            let mut power = 1.0;
            let coefficients = piece.coefficients.map(|coefficient| {
                let scaled = coefficient * power;
                power /= factor;
                scaled
            });
            Piece {
                duration: piece.duration * factor,
                coefficients,
            }
        })
        .collect()
}

fn demand() -> impl Strategy<Value = Demand> {
    prop_oneof![
        4 => (0.0..1.0_f64).prop_map(Demand::Run),
        2 => Just(Demand::Run(1.0)),
        1 => Just(Demand::Run(0.0)),
        2 => Just(Demand::Stop(StopCategory::Gentle)),
        2 => Just(Demand::Stop(StopCategory::Fast)),
    ]
}

/// The plan at a planned time since its start.
fn planned(pieces: &[Piece<N>], mut time: f64) -> Joints {
    for piece in pieces {
        if time <= piece.duration {
            return piece.sample(time).position;
        }
        time -= piece.duration;
    }
    let last = pieces.last().unwrap();
    last.sample(last.duration).position
}

/// The last four positions: finite differences up to the third.
#[derive(Default)]
struct Differences {
    positions: Vec<Joints>,
}

impl Differences {
    fn check(&mut self, position: Joints, period: f64) -> Result<(), TestCaseError> {
        self.positions.push(position);
        let p = &self.positions;
        let n = p.len();
        let limits = limits();
        let within = |value: Joints, limit: &Joints, rounding: f64, what: &str| {
            let ratio = (value.abs() - Joints::from_element(rounding))
                .component_div(limit)
                .max();
            prop_assert!(
                ratio <= 1.0 + 1e-6,
                "{what} at {ratio} of its limit in period {n}"
            );
            Ok(())
        };
        let noise = 1e-15;
        if n >= 2 {
            let first = (p[n - 1] - p[n - 2]) / period;
            within(first, &limits.velocity, noise / period, "velocity")?;
        }
        if n >= 3 {
            let second = (p[n - 1] - p[n - 2] * 2.0 + p[n - 3]) / (period * period);
            within(
                second,
                &limits.acceleration,
                noise / period.powi(2),
                "acceleration",
            )?;
        }
        if n >= 4 {
            let third = (p[n - 1] - p[n - 4] + (p[n - 3] - p[n - 2]) * 3.0) / period.powi(3);
            within(third, &limits.jerk, 4.0 * noise / period.powi(3), "jerk")?;
        }
        Ok(())
    }
}

/// One run: the demands in turn, each for its time, then full speed to the end.
fn run(pieces: &[Piece<N>], demands: &[(Demand, u32)], rate: f64) -> Result<(), TestCaseError> {
    let period = 1.0 / rate;
    let mut cycle = Cycle::<N, 64>::new(Joints::zeros(), limits(), period);
    for (index, piece) in pieces.iter().enumerate() {
        let last = index + 1 == pieces.len();
        let pushed = cycle.push(&Segment {
            piece: *piece,
            command: 3,
            last,
        });
        prop_assert_eq!(pushed, Pushed::Taken);
    }
    let mut plan = demands
        .iter()
        .flat_map(|(demand, milliseconds)| {
            let periods = f64::from(*milliseconds) * 0.001 * rate;
            std::iter::repeat_n(*demand, periods as usize)
        })
        .chain(std::iter::repeat(Demand::Run(1.0)));
    let mut differences = Differences::default();
    for _ in 0..(60.0 * rate) as usize {
        let step = cycle.step(plan.next().unwrap());
        prop_assert_eq!(step.trip, None);
        differences.check(step.setpoint.position, period)?;
        if step.finished.is_some() {
            let total: f64 = pieces.iter().map(|piece| piece.duration).sum();
            prop_assert_eq!(step.setpoint.position, planned(pieces, total + 1.0));
            prop_assert!(step.resting);
            return Ok(());
        }
        let distance = (step.setpoint.position - planned(pieces, step.path_time)).amax();
        prop_assert!(distance <= 1e-9, "{distance} rad from the path");
    }
    Err(TestCaseError::fail("the motion never ended"))
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(5),
        cases,
        max_shrink_iters: 50,
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

fn sequences() -> impl Strategy<Value = Vec<(Demand, u32)>> {
    prop::collection::vec((demand(), 1_u32..400), 0..10)
}

proptest! {
    #![proptest_config(config(300))]

    /// The law on random plans that are exactly at a limit.
    #[test]
    fn stays_on_the_path_within_limits(
        pieces in motion(),
        demands in sequences(),
        rate in prop::sample::select(vec![250.0, 1000.0, 4000.0]),
    ) {
        run(&pieces, &demands, rate)?;
    }
}

proptest! {
    #![proptest_config(config(10_000))]

    /// The same, ten thousand times.
    #[test]
    #[ignore = "takes minutes"]
    fn stays_on_the_path_within_limits_at_length(pieces in motion(), demands in sequences()) {
        run(&pieces, &demands, 1000.0)?;
    }
}

proptest! {
    #![proptest_config(config(200))]

    /// A stop from an unhurried motion takes no longer than the joints need; and after it the arm
    /// rests where it is until a resume.
    #[test]
    fn a_stop_stops(pieces in motion(), at in 0.05..0.8_f64, fast in any::<bool>()) {
        let slow = stretch(&pieces, 2.0);
        let total: f64 = slow.iter().map(|piece| piece.duration).sum();
        let mut cycle = Cycle::<N, 64>::new(Joints::zeros(), limits(), 0.001);
        for (index, piece) in slow.iter().enumerate() {
            cycle.push(&Segment { piece: *piece, command: 0, last: index + 1 == slow.len() });
        }
        for _ in 0..(at * total * 1000.0) as usize {
            cycle.step(Demand::Run(1.0));
        }
        let category = if fast { StopCategory::Fast } else { StopCategory::Gentle };
        let mut periods = 0;
        while !cycle.is_resting() {
            cycle.step(Demand::Stop(category));
            periods += 1;
            prop_assert!(periods < 1000, "no rest after a second");
        }
        let there = cycle.setpoint().position;
        for _ in 0..50 {
            prop_assert_eq!(cycle.step(Demand::Stop(category)).setpoint.position, there);
        }
    }

    /// A planner that stops in the middle of a command: the arm stops on the path before the end
    /// of what is planned, and goes on when the rest comes.
    #[test]
    fn a_starved_planner_stops_the_arm_on_the_path(pieces in motion()) {
        let slow = stretch(&pieces, 2.0);
        let last = slow.len() - 1;
        let supply: f64 = slow[..last].iter().map(|piece| piece.duration).sum();
        prop_assume!(supply > 1.2);
        let mut cycle = Cycle::<N, 64>::new(Joints::zeros(), limits(), 0.001);
        for piece in &slow[..last] {
            cycle.push(&Segment { piece: *piece, command: 0, last: false });
        }
        let mut differences = Differences::default();
        let mut starved_at = 0.0;
        for _ in 0..(supply * 1000.0) as usize + 6000 {
            let step = cycle.step(Demand::Run(1.0));
            prop_assert_eq!(step.trip, None);
            differences.check(step.setpoint.position, 0.001)?;
            let distance = (step.setpoint.position - planned(&slow, step.path_time)).amax();
            prop_assert!(distance <= 1e-9);
            starved_at = step.path_time;
        }
        prop_assert!(cycle.is_resting(), "still moving at {starved_at} of {supply}");
        cycle.push(&Segment { piece: slow[last], command: 0, last: true });
        let mut finished = None;
        for _ in 0..60_000 {
            let step = cycle.step(Demand::Run(1.0));
            prop_assert_eq!(step.trip, None);
            differences.check(step.setpoint.position, 0.001)?;
            finished = step.finished;
            if finished.is_some() {
                break;
            }
        }
        prop_assert_eq!(finished, Some(0));
    }
}

/// A plan that jumps is stopped by the guard, within the limits, and says where.
#[test]
fn a_broken_plan_is_braked() {
    let mut cycle = Cycle::<N, 64>::new(Joints::zeros(), limits(), 0.001);
    let goal = Sample::rest(Joints::new(0.4, 0.3, -0.2));
    let half = Piece::hermite(1.0, &Sample::rest(Joints::zeros()), &goal);
    cycle.push(&Segment {
        piece: Piece {
            duration: 0.5,
            ..half
        },
        command: 1,
        last: false,
    });
    let far = Joints::from_element(2.0);
    cycle.push(&Segment {
        piece: Piece::hold(far, 1.0),
        command: 1,
        last: true,
    });
    let mut differences = Differences::default();
    let mut trips = 0;
    for _ in 0..2000 {
        let step = cycle.step(Demand::Run(1.0));
        differences.check(step.setpoint.position, 0.001).unwrap();
        trips += usize::from(step.trip.is_some());
        assert_eq!(step.finished, None);
    }
    assert_eq!(trips, 1);
    assert!(cycle.is_resting());
    assert!(cycle.setpoint().position.amax() < 0.5);
}

/// Segments that are not numbers never get into the cycle.
#[test]
fn a_segment_that_is_not_finite_is_refused() {
    let mut cycle = Cycle::<N, 64>::new(Joints::zeros(), limits(), 0.001);
    let mut piece = Piece::hold(Joints::zeros(), 1.0);
    piece.coefficients[4][1] = f64::NAN;
    assert_eq!(
        cycle.push(&Segment {
            piece,
            command: 0,
            last: true
        }),
        Pushed::Broken
    );
    let piece = Piece::hold(Joints::zeros(), f64::INFINITY);
    assert_eq!(
        cycle.push(&Segment {
            piece,
            command: 0,
            last: true
        }),
        Pushed::Broken
    );
}
