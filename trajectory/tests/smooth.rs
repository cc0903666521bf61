//! Properties of smooth motions, checked by sampling alone: no code of the certificate is used
//! here.
//!
//! `SMOOTH_LISTS=10000 SMOOTH_POSES=60 cargo test -p trajectory --release --test smooth` is the long
//! run.
#![allow(clippy::too_many_lines, reason = "a test reads from top to bottom")]
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use trajectory::smooth::{SmoothOptions, SmoothPlan, Windows, plan};
use trajectory::{ToolCurve, ToolLimits};

/// Small deterministic generator (splitmix64).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn power(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.between(low, high))
    }

    fn direction(&mut self) -> Vector3<f64> {
        let v = Vector3::new(
            self.between(-1., 1.),
            self.between(-1., 1.),
            self.between(-1., 1.),
        );
        if v.norm() > 1e-3 {
            v.normalize()
        } else {
            Vector3::x()
        }
    }
}

/// A list of 2 to `most` poses with every degeneracy mixed in.
fn list(random: &mut Random, most: usize) -> Vec<Isometry3<f64>> {
    let count = 2 + (random.next().powi(2) * (most - 1) as f64) as usize;
    let (size, turning) = (random.power(-4.0, -0.5), random.next() < 0.5);
    let spread = random.next();
    let mut poses = vec![Isometry3::identity()];
    let mut heading = random.direction();
    while poses.len() < count {
        let last = poses[poses.len() - 1];
        let length = size * (1.0 + spread * (random.power(-2.0, 0.5) - 1.0));
        match (random.next() * 9.0) as usize {
            0 => {}                                                            // on, in line
            1 => heading = -heading,                                           // reversal
            2 => heading = (-heading + 0.01 * random.direction()).normalize(), // hairpin
            3 => heading = (heading + 1e-4 * random.direction()).normalize(),  // nearly in line
            4 => heading = (heading + 0.3 * random.direction()).normalize(),   // bend
            5 if random.next() < 0.5 => {
                poses.push(last); // repeated
                continue;
            }
            6 if turning => {
                // Turn on the spot.
                let turn = random.direction() * random.between(0.0, 1.5);
                let rotation = last.rotation * UnitQuaternion::from_scaled_axis(turn);
                poses.push(Isometry3::from_parts(last.translation, rotation));
                continue;
            }
            _ => heading = random.direction(),
        }
        let turn = if turning {
            random.direction() * random.power(-3.0, 0.0)
        } else {
            Vector3::zeros()
        };
        let place = last.translation.vector + heading * length;
        let rotation = last.rotation * UnitQuaternion::from_scaled_axis(turn);
        poses.push(Isometry3::from_parts(place.into(), rotation));
    }
    poses
}

fn limits(random: &mut Random) -> ToolLimits {
    let mut scaled = |x: f64| x * random.power(-0.5, 0.5);
    ToolLimits {
        speed: scaled(0.5),
        acceleration: scaled(5.0),
        jerk: scaled(100.0),
        angular_speed: scaled(2.0),
        angular_acceleration: scaled(20.0),
        angular_jerk: scaled(400.0),
    }
}

/// Checks the times of the passes on samples: each is the first local closest
/// approach after the pass before, and within tolerance.
///
/// Rises by less than `slack` cannot be seen in samples: of two approaches that differ only by such
/// a rise, the plan may name either.
fn passes_in_order(
    plan: &SmoothPlan,
    times: &[f64],
    goals: &[Vector3<f64>],
    tolerance: f64,
) -> Result<(), String> {
    let place = |time: f64| plan.at(time).pose.translation.vector;
    let slack = 2e-10 + 1e-9 * tolerance;
    // Where the tool turns (nearly) on the spot, its orientation picks the
    // moment of the pass within a fiftieth of the tolerance, on samples of its own.
    let end = plan.at(plan.duration()).pose.rotation;
    let turns = (times.iter()).any(|t| plan.at(*t).pose.rotation.angle_to(&end) > 1e-9);
    let choice = slack + if turns { 0.03 * tolerance } else { 0.0 };
    let mut at = 0.0;
    for (i, goal) in goals.iter().enumerate() {
        let distance = |time: f64| (place(time) - goal).norm();
        let named = plan.crossings()[i].time;
        let fault = |what: &str, time: f64| {
            let known = plan.crossings()[i];
            Err(format!(
                "pose {}: {what} at {time}, {:e} away, tolerance {tolerance:e}, {known:?}",
                i + 1,
                distance(time)
            ))
        };
        if named < at {
            return fault("out of order", named);
        }
        if distance(named) > tolerance + slack {
            return fault("too far", named);
        }
        if named == at && at > 0.0 {
            // Within tolerance already when the pose before was passed.
            continue;
        }
        // The first closest approach that samples show, and when it is over.
        let (mut high, mut low, mut over) = (distance(at), f64::INFINITY, f64::INFINITY);
        if (high - tolerance).abs() <= slack {
            // Whether it is within tolerance here cannot be told.
            at = named;
            continue;
        }
        let mut approach = at;
        if high < tolerance {
            low = high;
        }
        for time in times.iter().copied().filter(|t| *t > at) {
            let d = distance(time);
            if d > low + slack {
                over = time;
                break;
            }
            if (low.is_finite() || d < high - slack) && d < low {
                (low, approach) = (d, time);
            }
            high = high.max(d);
        }
        // The pass is there, or as near in the same stretch.
        let beside = |approach: f64| {
            let room = distance(approach) + choice;
            let between = |t: &&f64| (**t - approach) * (**t - named) < 0.0;
            distance(named) <= room && times.iter().filter(between).all(|t| distance(*t) <= room)
        };
        let rises = |from: f64, side: f64, by: f64| {
            (6..24).any(|k| {
                let time = (from + side * 2_f64.powi(-k)).clamp(at, plan.duration());
                distance(time) >= distance(from) + by
            })
        };
        // Or beside a start within tolerance from which it rises between the samples.
        let start = distance(at) < tolerance && rises(at, 1.0, 1e-10);
        let same = beside(approach) || (start && beside(at));
        // Or it is an approach that falls between the samples.
        let least = -1e-15 * (1.0 + goal.norm());
        let fine = named < over && rises(named, -1.0, least) && rises(named, 1.0, least);
        if !same && !fine {
            return fault("not the closest approach", named);
        }
        at = named;
    }
    Ok(())
}

/// Checks a plan by sampling poses and differencing them.
fn check(
    plan: &SmoothPlan,
    poses: &[Isometry3<f64>],
    options: &SmoothOptions,
) -> Result<(), String> {
    let end = plan.duration();
    let knots = plan.knots();
    let mut times = Vec::new();
    for pair in knots.windows(2) {
        times.extend((0..24).map(|i| pair[0] + (pair[1] - pair[0]) * f64::from(i) / 24.0));
    }
    times.push(end);
    let samples: Vec<_> = times.iter().map(|t| plan.at(*t)).collect();
    let (first, last) = (plan.at(0.0), plan.at(end));
    let scale = 1.0
        + poses
            .iter()
            .map(|p| p.translation.vector.norm())
            .fold(0.0, f64::max);
    for (sample, pose) in [(&first, &poses[0]), (&last, &poses[poses.len() - 1])] {
        let off = (sample.pose.translation.vector - pose.translation.vector).norm();
        if off > 1e-12 * scale
            || sample.linear[0].norm() > 1e-9
            || sample.pose.rotation.angle_to(&pose.rotation) > 1e-7
        {
            return Err(format!(
                "end off by {off:e}, speed {:e}",
                sample.linear[0].norm()
            ));
        }
    }
    let l = &options.limits;
    let linear = [l.speed, l.acceleration, l.jerk];
    let angular = [l.angular_speed, l.angular_acceleration, l.angular_jerk];
    for (k, pair) in samples.windows(2).enumerate() {
        let dt = times[k + 1] - times[k];
        for (name, caps, now, next) in [
            ("linear", &linear, &pair[0].linear, &pair[1].linear),
            ("angular", &angular, &pair[0].angular, &pair[1].angular),
        ] {
            for order in 0..3 {
                if now[order].norm() > caps[order] * (1.0 + 1e-6) {
                    return Err(format!(
                        "{name} {order} is {} of {} at {}",
                        now[order].norm(),
                        caps[order],
                        times[k]
                    ));
                }
            }
            // Position, speed and acceleration never jump: each changes by no
            // more than the next one allows.
            for order in 0..2 {
                let step = (next[order] - now[order]).norm();
                if step > caps[order + 1] * dt * (1.0 + 1e-6) + 1e-7 * caps[order] {
                    return Err(format!(
                        "{name} {order} jumps by {step:e} in {dt:e} s at {} of {end}",
                        times[k]
                    ));
                }
            }
        }
        let moved = (pair[1].pose.translation.vector - pair[0].pose.translation.vector).norm();
        if moved > l.speed * dt * (1.0 + 1e-6) + 1e-12 * scale {
            return Err(format!("position jumps by {moved:e} at {}", times[k]));
        }
        let turned = pair[0].pose.rotation.angle_to(&pair[1].pose.rotation);
        if turned > l.angular_speed * dt * (1.0 + 1e-6) + 1e-7 {
            return Err(format!("orientation jumps by {turned:e} at {}", times[k]));
        }
    }
    let goals: Vec<_> = poses[1..poses.len() - 1]
        .iter()
        .map(|p| p.translation.vector)
        .collect();
    passes_in_order(plan, &times, &goals, options.tolerance)
}

fn report(seed: u64, most: usize) -> Result<[f64; 2], String> {
    let mut random = Random(seed);
    let poses = list(&mut random, most);
    let limits = limits(&mut random);
    let tolerance = if random.next() < 0.1 {
        0.0
    } else {
        random.power(-5.0, -1.5)
    };
    let options = SmoothOptions::new(tolerance, limits);
    let plan = plan(&poses, &options).map_err(|error| error.to_string())?;
    if !plan.certificate().holds() {
        let bad = plan.crossings().iter().find(|pass| !pass.holds());
        return Err(format!("certificate: {:?} {bad:?}", plan.certificate()));
    }
    if plan.duration() > plan.exact_stop() * (1.0 + 1e-9) {
        return Err(format!(
            "slower than exact stop: {} {}",
            plan.duration(),
            plan.exact_stop()
        ));
    }
    if plan.certificate().optimality() < 1.0 - 1e-9 {
        let least = plan.certificate().lower_bound;
        return Err(format!(
            "{} s, below its bound of {least} s: {:?}",
            plan.duration(),
            plan.certificate()
        ));
    }
    check(&plan, &poses, &options)?;
    Ok([plan.duration(), plan.exact_stop()])
}

/// Whatever the list: certified, confirmed by sampling, no slower than stops.
#[test]
fn random_lists() {
    let number = |name, otherwise| {
        let given = std::env::var(name).ok();
        given.map_or(otherwise, |n| n.parse().unwrap())
    };
    let (count, first) = (number("SMOOTH_LISTS", 20), number("SMOOTH_FIRST", 0));
    let most = number("SMOOTH_POSES", 24) as usize;
    let (mut bad, mut sums, mut stops) = (Vec::new(), [0.0; 2], 0);
    // Three times a pose of list 36 repeats the one before, but for the last digit of its orientation.
    for seed in (first..first + count).chain([36]) {
        match report(seed, most) {
            Ok([motion, stop]) => {
                sums[0] += motion;
                sums[1] += stop;
                stops += u32::from(motion >= stop * (1.0 - 1e-9));
            }
            Err(reason) => bad.push((seed, reason)),
        }
    }
    println!(
        "{count} lists: motion {:.3} s, exact stop {:.3} s, no gain {stops}, bad {}",
        sums[0],
        sums[1],
        bad.len()
    );
    for (seed, reason) in bad.iter().take(20) {
        println!("seed {seed}: {}", &reason[..reason.len().min(600)]);
    }
    assert!(bad.is_empty(), "{} of {count} lists failed", bad.len());
}

/// Windows: the committed time grows, the parts planned first are those
/// executed, and the whole is as `plan` gives it.
#[test]
fn windows_commit_in_order() {
    let limits = limits(&mut Random(5));
    let poses: Vec<_> = (0..150)
        .map(|i| Isometry3::translation(0.02 * f64::from(i), 0.01 * f64::from(i % 3), 0.0))
        .collect();
    let options = SmoothOptions::new(0.001, limits);
    let mut windows = Windows::new(&poses, &options).unwrap();
    let (mut committed, mut count) = (0.0, 0);
    let mut seen = Vec::new();
    assert!(windows.at(0.0).is_none());
    while windows.advance() {
        assert!(windows.committed() > committed);
        let time = 0.5 * (committed + windows.committed());
        seen.push((time, windows.at(time).unwrap()));
        committed = windows.committed();
        assert!(windows.at(committed + 1e-9).is_none());
        count += 1;
    }
    assert!(count > 3);
    let plan = windows.finish();
    // What was committed is what the whole motion does.
    for (time, point) in seen {
        assert_eq!(plan.at(time), point);
    }
    assert_eq!(plan.duration(), committed);
    assert!(plan.certificate().holds());
    check(&plan, &poses, &options).unwrap();
}

/// A tool that turns about another axis on each leg passes the corners in motion. A correction of the
/// orientation that ended with a jump of the angular velocity broke the angular jerk in nearly all
/// such lists; they were divided, and rested.
#[test]
fn corners_that_turn_are_passed_in_motion() {
    let limits = ToolLimits {
        speed: 1.0,
        acceleration: 5.0,
        jerk: 100.0,
        angular_speed: 3.0,
        angular_acceleration: 15.0,
        angular_jerk: 300.0,
    };
    let (mut random, mut resting) = (Random(12), 0);
    for _ in 0..20 {
        let mut pose = Isometry3::identity();
        let mut poses = vec![pose];
        for _ in 0..5 {
            pose.translation.vector += random.direction() * random.between(0.05, 0.2);
            let turn = random.direction() * random.between(0.1, 0.5);
            pose.rotation *= UnitQuaternion::from_scaled_axis(turn);
            poses.push(pose);
        }
        let plan = plan(&poses, &SmoothOptions::new(0.01, limits)).unwrap();
        assert!(plan.certificate().holds());
        resting += usize::from(!plan.rests().is_empty());
    }
    println!("{resting} of 20 lists rest");
    assert!(resting <= 2, "{resting} of 20 lists rest");
}

/// Six poses a quarter of a metre apart at most, each turned by up to 0.7 rad from the one before.
fn turning(seed: u64) -> Vec<Isometry3<f64>> {
    let mut random = Random(seed);
    let mut poses = vec![Isometry3::identity()];
    while poses.len() < 6 {
        let mut pose = poses[poses.len() - 1];
        pose.translation.vector += random.direction() * random.between(0.05, 0.25);
        let turn = random.direction() * random.between(0.1, 0.7);
        pose.rotation *= UnitQuaternion::from_scaled_axis(turn);
        poses.push(pose);
    }
    poses
}

/// Where a tool has to turn for longer than its place needs, more tolerance is not slower. Searches in which the place went to and
/// fro at a pose, before the tool was turned, were given up for slower ways, which depended on the tolerance by luck.
#[test]
fn more_tolerance_is_not_slower_where_the_tool_turns_for_longer() {
    let limits = ToolLimits {
        speed: 2.0,
        acceleration: 13.0,
        jerk: 6500.0,
        angular_speed: 2.5,
        angular_acceleration: 25.0,
        angular_jerk: 12_500.0,
    };
    let mut broken = Vec::new();
    for seed in 0..24 {
        let poses = turning(seed);
        let mut least = f64::INFINITY;
        for tolerance in [2e-4, 5e-4, 1e-3, 2e-3] {
            let plan = plan(&poses, &SmoothOptions::new(tolerance, limits)).unwrap();
            assert!(plan.certificate().holds(), "{:?}", plan.certificate());
            assert_eq!(plan.rests(), [], "list {seed} within {tolerance} m");
            if plan.duration() > 1.01 * least {
                broken.push((seed, tolerance, plan.duration() / least));
            }
            least = least.min(plan.duration());
        }
    }
    assert!(broken.is_empty(), "{broken:?}");
}

/// Legs of some millimetres and of some centimetres, within ten millimetres: on a short leg the tool turns for longer than its place needs.
fn short_and_long(seed: u64) -> Vec<Isometry3<f64>> {
    let mut random = Random(seed);
    let mut place = Vector3::zeros();
    let pose = |k: usize| {
        let far = if k.is_multiple_of(3) { 0.08 } else { 0.002 };
        place += random.direction() * far;
        Isometry3::new(place, random.direction() * random.between(0.05, 0.25))
    };
    (0..9).map(pose).collect()
}

/// Where a short leg turns the tool its place waits: it took a run-up to the next leg meanwhile, which is another approach to the pose,
/// and the list was divided and planned within less of the tolerance. These took 10.77 s together, now 8.56 s.
#[test]
fn a_place_waits_on_a_short_leg_until_the_tool_is_turned() {
    let limits = ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        angular_speed: 3.0,
        angular_acceleration: 30.0,
        angular_jerk: 600.0,
    };
    let times: Vec<f64> = (0..12)
        .map(|seed| {
            let plan = plan(&short_and_long(seed), &SmoothOptions::new(0.01, limits)).unwrap();
            assert!(plan.certificate().holds(), "{:?}", plan.certificate());
            assert_eq!(plan.rests(), [], "list {seed}");
            plan.duration()
        })
        .collect();
    let sum: f64 = times.iter().sum();
    println!("{sum:.4} s: {times:.3?}");
    assert!(sum < 8.7, "{sum} s: {times:?}");
}

/// A search stopped where the pass of a corner was not yet where the place is nearest: there the tool was not turned enough, so no
/// step led on. The motion took 5.4 % longer than within less of the tolerance.
#[test]
fn a_search_looks_for_its_passes_until_they_are_found() {
    let limits = ToolLimits {
        speed: 1.7,
        acceleration: 13.0,
        jerk: 6500.0,
        angular_speed: 2.5,
        angular_acceleration: 25.0,
        angular_jerk: 12_500.0,
    };
    let legs = [
        ([-0.021, 0.087, -0.013], [0.125, -0.124, 0.551]),
        ([-0.125, -0.040, 0.065], [0.453, -0.664, -0.093]),
        ([0.134, 0.024, 0.009], [0.648, 0.500, -0.619]),
        ([0.084, -0.134, 0.075], [0.171, 0.513, 0.177]),
        ([0.022, 0.065, 0.039], [0.125, 0.388, 0.183]),
    ];
    let mut poses = vec![Isometry3::identity()];
    for (way, turn) in legs {
        let mut pose = poses[poses.len() - 1];
        pose.translation.vector += Vector3::from(way);
        pose.rotation *= UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        poses.push(pose);
    }
    let times = [2e-4, 5e-4, 1e-3, 2e-3].map(|tolerance| {
        let plan = plan(&poses, &SmoothOptions::new(tolerance, limits)).unwrap();
        assert!(plan.certificate().holds(), "{:?}", plan.certificate());
        plan.duration()
    });
    assert!(
        times.is_sorted_by(|less, more| *more <= 1.001 * less),
        "{times:?}"
    );
}
