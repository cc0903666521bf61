//! Certificates of random moves on shipped robots, compared with dense samples.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "a test may stop where it fails and say what it saw"
)]

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use planner::motion::{PlannedMove, Planner};
use planner::robot::{Robot, load};
use planner::task::{Move, Shape};
use trajectory::ToolLimits;

/// Numbers from 0 to 1, the same each time.
///
/// # Source
/// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * self.next() - 1.0)
    }
}

/// What was seen of one kind of move.
#[derive(Default)]
struct Seen {
    moves: usize,
    refused: usize,
    /// Bound over the highest sample, where that is worth a look.
    tightness: Vec<f64>,
    /// Duration over its lower bound.
    optimality: Vec<f64>,
    /// Planning time, ms.
    planning: Vec<f64>,
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let at = (share * (sorted.len().max(1) - 1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

/// Ratios of everything that is limited at one moment, in the order of the certificate.
fn ratios<const N: usize>(
    planner: &Planner<N>,
    limits: &ToolLimits,
    found: &PlannedMove<N>,
    time: f64,
) -> Vec<f64> {
    let (s, joint) = (found.trajectory.sample(time), planner.limits());
    let mut all = Vec::with_capacity(3 * N + 6);
    all.extend(s.velocity.abs().component_div(&joint.velocity).iter());
    all.extend(
        s.acceleration
            .abs()
            .component_div(&joint.acceleration)
            .iter(),
    );
    all.extend(s.jerk.abs().component_div(&joint.jerk).iter());
    // Speed and acceleration by the Jacobian and its derivative, jerk by a difference of these.
    let acceleration = |s: &realtime::Sample<N>| {
        let (_, jacobian) = planner.chain().jacobian(&s.position);
        let change = planner
            .chain()
            .jacobian_derivative(&s.position, &s.velocity);
        (
            jacobian * s.velocity,
            jacobian * s.acceleration + change * s.velocity,
        )
    };
    let step = 1e-5;
    let moved = |d: f64| realtime::Sample {
        position: s.position + (s.velocity + (s.acceleration / 2.0 + s.jerk * (d / 6.0)) * d) * d,
        velocity: s.velocity + (s.acceleration + s.jerk * (d / 2.0)) * d,
        acceleration: s.acceleration + s.jerk * d,
        jerk: s.jerk,
    };
    let (twist, rate) = acceleration(&s);
    let (after, before) = (acceleration(&moved(step)).1, acceleration(&moved(-step)).1);
    let jerk = (after - before) / (2.0 * step);
    for (row, caps) in [
        (0, [limits.speed, limits.acceleration, limits.jerk]),
        (
            3,
            [
                limits.angular_speed,
                limits.angular_acceleration,
                limits.angular_jerk,
            ],
        ),
    ] {
        for (value, cap) in [&twist, &rate, &jerk].into_iter().zip(caps) {
            all.push(value.fixed_rows::<3>(row).norm() / cap);
        }
    }
    all
}

/// The kind of a random move, and how many samples its certificate is held against.
#[derive(Clone, Copy)]
struct Task {
    shape: Shape,
    samples: usize,
}

/// How many moves, and samples of each.
#[derive(Clone, Copy)]
struct Counts {
    moves: usize,
    samples: usize,
}

/// A random move of that shape, and where it begins.
fn random_move<const N: usize>(
    planner: &Planner<N>,
    most: &ToolLimits,
    shape: Shape,
    random: &mut Random,
) -> (SVector<f64, N>, Move) {
    let limits = planner.limits();
    let mut joints = || {
        SVector::<f64, N>::from_fn(|i, _| {
            let (low, high) = (limits.lower[i].max(-3.0), limits.upper[i].min(3.0));
            low + (high - low) * (0.15 + 0.7 * random.next())
        })
    };
    let (start, goal) = (joints(), joints());
    let mut poses = vec![planner.chain().forward(&start)];
    let legs = match shape {
        Shape::Joint => {
            poses.push(planner.chain().forward(&goal));
            0
        }
        Shape::Straight => 1,
        Shape::Smooth => 2 + (random.next() * 3.0) as usize,
    };
    for _ in 0..legs {
        let from = poses[poses.len() - 1];
        let place = from.translation.vector + random.vector() * 0.12;
        let turn = UnitQuaternion::from_scaled_axis(random.vector() * 0.3);
        poses.push(Isometry3::from_parts(
            Translation3::from(place),
            from.rotation * turn,
        ));
    }
    let part = [1.0, 1.0, 0.5, 0.2][(random.next() * 4.0) as usize];
    let tolerance = [0.0, 1e-3, 5e-3, 2e-2][(random.next() * 4.0) as usize];
    let motion = Move {
        shape,
        poses: poses.split_off(1),
        tolerance: if shape == Shape::Smooth {
            tolerance
        } else {
            0.0
        },
        limits: ToolLimits {
            speed: most.speed * part,
            angular_speed: most.angular_speed * part,
            ..*most
        },
    };
    (start, motion)
}

/// Plans one random move and holds its certificate against `samples` samples.
fn one_move<const N: usize>(
    planner: &Planner<N>,
    most: &ToolLimits,
    task: Task,
    random: &mut Random,
    seen: &mut Seen,
) {
    let Task { shape, samples } = task;
    let (start, motion) = random_move(planner, most, shape, random);
    let clock = std::time::Instant::now();
    let found = planner.plan(&motion, &start);
    seen.planning.push(clock.elapsed().as_secs_f64() * 1e3);
    seen.moves += 1;
    let Ok(found) = found else {
        seen.refused += 1;
        return;
    };
    let certificate = &found.certificate;
    assert_eq!(certificate.limits.len(), 3 * N + 6);
    assert!(certificate.peaks.largest() <= 1.0 + 1e-9);
    if certificate.duration_s <= 0.0 {
        return;
    }
    seen.optimality
        .push(certificate.duration_s / certificate.lower_bound_s);
    let mut most = vec![0.0_f64; 3 * N + 6];
    for i in 0..=samples {
        let time = certificate.duration_s * i as f64 / samples as f64;
        let now = ratios(planner, &motion.limits, &found, time);
        most.iter_mut()
            .zip(now)
            .for_each(|(most, now)| *most = most.max(now));
    }
    for (limit, most) in certificate.limits.iter().zip(most) {
        // The jerk of the tool comes from a difference here.
        let rounding = if limit.limit.contains("jerk") {
            1e-5
        } else {
            1e-9
        };
        assert!(
            limit.ratio >= most * (1.0 - rounding) - 1e-7,
            "{motion:?} {limit:?}: {most}"
        );
        if most > 0.05 {
            seen.tightness.push(limit.ratio / most);
        }
    }
}

fn on_robot<const N: usize>(robot: &Robot, counts: Counts, seed: u64, seen: &mut [Seen; 3]) {
    let planner = robot.planner::<N>().unwrap();
    let mut random = Random(seed);
    for kind in 0..counts.moves {
        let seen = &mut seen[kind % 3];
        let task = Task {
            shape: [Shape::Joint, Shape::Straight, Shape::Smooth][kind % 3],
            samples: counts.samples,
        };
        one_move(&planner, &robot.motion_limits(), task, &mut random, seen);
    }
}

/// `moves` moves on every robot of a list, each against `samples` samples; prints what was seen.
fn judge(names: &[&str], moves: usize, samples: usize) -> [Seen; 3] {
    let counts = Counts { moves, samples };
    let mut seen = [Seen::default(), Seen::default(), Seen::default()];
    for (i, name) in names.iter().enumerate() {
        let (robot, seed) = (load(name).unwrap(), 0x9e37_79b9 + i as u64);
        match robot.dof() {
            6 => on_robot::<6>(&robot, counts, seed, &mut seen),
            7 => on_robot::<7>(&robot, counts, seed, &mut seen),
            other => panic!("{name} has {other} joints"),
        }
    }
    for (kind, seen) in ["joint", "straight", "smooth"].iter().zip(&seen) {
        let tight = |share| quantile(&seen.tightness, share);
        let best = |share| quantile(&seen.optimality, share);
        println!(
            "{kind}: {} moves, {} refused; bound / sample {:.4} {:.4} {:.4}; \
             duration / lower bound {:.3} {:.3} {:.3}; planning {:.2} ms {:.2} ms",
            seen.moves,
            seen.refused,
            tight(0.5),
            tight(0.99),
            tight(1.0),
            best(0.5),
            best(0.9),
            best(1.0),
            quantile(&seen.planning, 0.5),
            quantile(&seen.planning, 0.9),
        );
    }
    seen
}

/// Few moves and samples: what every change is held against.
#[test]
fn no_sample_is_above_a_certificate() {
    let seen = judge(&["ur5e", "panda", "irb120"], 24, 2000);
    for seen in seen {
        assert!(
            seen.moves - seen.refused >= 5,
            "{} of {} refused",
            seen.refused,
            seen.moves
        );
        assert!(quantile(&seen.tightness, 0.5) <= 1.01);
    }
}

/// The long run: 10 000 moves on all arms of six and seven joints, 200 of them against 1e5 samples.
#[test]
#[ignore = "takes half an hour; run with --run-ignored all --no-capture"]
fn ten_thousand_moves() {
    let names = [
        "ur5e",
        "panda",
        "irb120",
        "iiwa7",
        "xarm7",
        "lrmate200id",
        "fr3",
        "iiwa14",
        "xarm6",
        "ur10e",
    ];
    judge(&names, 20, 100_000);
    let [joint, straight, _] = judge(&names, 980, 300);
    for (seen, most) in [(joint, 1.15), (straight, 1.10)] {
        let median = quantile(&seen.optimality, 0.5);
        assert!(median <= most, "duration / lower bound {median}");
    }
}
