//! Properties that need no other library.

use measure::{Ends, Problems};
use nalgebra::vector;
use trajectory::otg::{
    Audit, Interface, Limits, Options, Otg, OtgError, Problem, State, Synchronisation,
};

use super::{KINDS, draw, report, sound};

#[test]
fn textbook_move() {
    let limits = Limits::symmetric(vector![10.0], vector![10.0], vector![1.0]);
    let (start, target) = (State::rest(vector![0.0]), State::rest(vector![2.0]));
    let motion = Otg::plan(&start, &target, &limits, &Options::default()).unwrap();
    // Four equal phases of jerk 1: distance = jerk T³ / 32.
    assert!((motion.duration() - 4.0).abs() < 1e-14);
    assert_eq!(motion.sample(motion.duration()).position, vector![2.0]);
    assert!((motion.sample(2.0).velocity[0] - 1.0).abs() < 1e-14);
}

/// The problem in units of length 2^`length` and of time 2^`time` times smaller.
fn rescaled<const N: usize>(problem: &Problem<N>, length: i32, time: i32) -> Problem<N> {
    let p = 2f64.powi(length);
    let t = 2f64.powi(time);
    let (v, a, j) = (p / t, p / t / t, p / t / t / t);
    let state = |s: &State<N>| State {
        position: s.position * p,
        velocity: s.velocity * v,
        acceleration: s.acceleration * a,
    };
    let l = &problem.limits;
    Problem {
        start: state(&problem.start),
        target: state(&problem.target),
        limits: Limits {
            position_max: l.position_max * p,
            position_min: l.position_min * p,
            velocity_max: l.velocity_max * v,
            velocity_min: l.velocity_min * v,
            acceleration_max: l.acceleration_max * a,
            acceleration_min: l.acceleration_min * a,
            jerk: l.jerk * j,
        },
        options: Options {
            minimum_duration: problem.options.minimum_duration * t,
            period: problem.options.period.map(|period| period * t),
            ..problem.options
        },
    }
}

/// Units by powers of two change no bit of a plan.
#[test]
fn units_do_not_matter() {
    let mut problems = Problems::new(5, Ends::Moving);
    for kind in KINDS {
        for index in 0..500 {
            let plain = draw::<3>(&mut problems, kind);
            let (length, time) = (index % 41 - 20, index % 37 - 18);
            let scaled = rescaled(&plain, length, time);
            let plan = |p: &Problem<3>| Otg::plan(&p.start, &p.target, &p.limits, &p.options);
            let (one, other) = (plan(&plain).unwrap(), plan(&scaled).unwrap());
            let t = 2f64.powi(time);
            assert_eq!(one.duration() * t, other.duration());
            for step in 0..5 {
                let instant = one.duration() * f64::from(step) / 5.0;
                let left = one.sample(instant).position * 2f64.powi(length);
                assert_eq!(left, other.sample(instant * t).position);
            }
        }
    }
}

/// Between position limits a move that strays out is replaced or refused, never returned.
#[test]
fn positions_stay_inside() {
    let mut problems = Problems::new(8, Ends::Stopping);
    let (mut kept, mut refused, mut replaced) = (0, 0, 0);
    for _ in 0..3000 {
        let mut problem = problems.draw::<3>();
        let reach = problem
            .start
            .position
            .zip_map(&problem.target.position, f64::max);
        let below = problem
            .start
            .position
            .zip_map(&problem.target.position, f64::min);
        let room = problems.between(0.0, 0.5);
        let Problem {
            start,
            target,
            limits,
            options,
        } = &mut problem;
        let free = Otg::plan(start, target, limits, options).unwrap();
        *limits = limits.within(below.add_scalar(-room), reach.add_scalar(room));
        match Otg::plan(start, target, limits, options) {
            Ok(motion) => {
                kept += 1;
                assert!(Audit::of(&motion, start, target, limits).worst() < 1e-12);
                assert_eq!(motion.duration(), free.duration());
                let inside = |m: &trajectory::otg::Motion<3>| {
                    (0..=400).all(|step| {
                        let p = m.sample(m.duration() * f64::from(step) / 400.0).position;
                        (p - limits.position_max).max() < 1e-9
                            && (limits.position_min - p).max() < 1e-9
                    })
                };
                assert!(inside(&motion));
                replaced += usize::from(!inside(&free));
            }
            Err(OtgError::PositionLimit { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
        }
    }
    println!("{kept} kept, {replaced} of them replaced, {refused} refused");
    assert!(kept > 1000 && replaced > 100);
}

/// A problem whose states all lie on one line.
fn collinear(problems: &mut Problems) -> Problem<3> {
    let mut problem = problems.draw::<3>();
    let way = vector![problems.normal(), problems.normal(), problems.normal()];
    problem.start.velocity = way * (0.3 * problems.normal());
    problem.start.acceleration = way * (0.3 * problems.normal());
    problem.target.position = problem.start.position + way * problems.normal();
    problem.target.velocity = way * 0.05;
    problem.target.acceleration = way * 0.0;
    problem.options.synchronisation = Synchronisation::Phase;
    problem
}

/// Where start and target allow a straight line the move follows it, soundly and not faster than
/// without it; where they do not, it says so.
#[test]
fn phases_are_straight() {
    let mut problems = Problems::new(9, Ends::Moving);
    let mut failures = Vec::new();
    for index in 0..2000 {
        let mut problem = collinear(&mut problems);
        let Problem {
            start,
            target,
            limits,
            options,
        } = problem;
        let motion = match Otg::plan(&start, &target, &limits, &options) {
            Ok(motion) => motion,
            Err(OtgError::TargetBeyondLimit { .. }) => continue,
            Err(error) => panic!("{error}"),
        };
        assert!(motion.is_straight());
        let audit = Audit::of(&motion, &start, &target, &limits);
        if audit.worst() > 1e-12 {
            failures.push(format!("{index}: {audit:?}"));
        }
        let way = (target.position - start.position).normalize();
        for step in 0..=20 {
            let sample = motion.sample(motion.duration() * f64::from(step) / 20.0);
            let gone = sample.position - start.position;
            assert!((gone - way * way.dot(&gone)).norm() < 1e-9);
        }
        problem.options.synchronisation = Synchronisation::Time;
        if let Ok(duration) = sound(&problem)
            && motion.braking(0) == 0.0
        {
            assert!(duration <= motion.duration() * (1.0 + 1e-9));
        }
        problem.start.velocity[1] += 0.2;
        problem.options.synchronisation = Synchronisation::Phase;
        let Problem {
            start,
            target,
            limits,
            mut options,
        } = problem;
        let bent = Otg::plan(&start, &target, &limits, &options);
        assert!(matches!(bent, Err(OtgError::NotStraight { .. })));
        options.synchronisation = Synchronisation::PhaseIfPossible;
        assert!(
            !Otg::plan(&start, &target, &limits, &options)
                .unwrap()
                .is_straight()
        );
    }
    report(&failures, 2000);
}

/// Limits lowered in the middle of a move: the new plan brakes at once, never rises above where
/// physics lets it, and arrives without overshoot of the target where there is room to stop.
#[test]
fn lowered_limits_brake() {
    let mut problems = Problems::new(10, Ends::Resting);
    for _ in 0..2000 {
        let problem = problems.draw::<3>();
        let Problem {
            start,
            target,
            mut limits,
            options,
        } = problem;
        let motion = Otg::plan(&start, &target, &limits, &options).unwrap();
        let state: State<3> = motion
            .sample(motion.duration() * problems.between(0.0, 1.0))
            .into();
        limits.velocity_max *= problems.between(0.2, 0.9);
        limits.velocity_min = -limits.velocity_max;
        let next = Otg::plan(&state, &target, &limits, &options).unwrap();
        let audit = Audit::of(&next, &state, &target, &limits);
        assert!(audit.worst() < 1e-12, "{audit:?}");
        for joint in 0..3 {
            // With the acceleration it has, a joint gets a little faster whatever is done.
            let a = state.acceleration[joint];
            let coasting = state.velocity[joint].abs() + 0.5 * a * a / limits.jerk[joint];
            let highest = limits.velocity_max[joint].max(coasting) * (1.0 + 1e-12);
            for step in 0..=200 {
                let sample = next.sample(next.duration() * f64::from(step) / 200.0);
                assert!(sample.velocity[joint].abs() <= highest);
            }
        }
    }
}

/// What is not asked for does not matter, and what is wrong is named.
#[test]
fn options_and_errors() {
    let limits = Limits::symmetric(vector![1.0, 1.0], vector![1.0, 1.0], vector![1.0, 1.0]);
    let start = State::rest(vector![0.0, 5.0]);
    let mut target = State::rest(vector![1.0, f64::NAN]);
    let mut options = Options {
        enabled: [true, false],
        ..Options::default()
    };
    let motion = Otg::plan(&start, &target, &limits, &options).unwrap();
    assert_eq!(motion.sample(motion.duration() * 0.5).position[1], 5.0);
    assert_eq!(motion.end().position, vector![1.0, 5.0]);
    options.enabled = [true, true];
    let error = Otg::plan(&start, &target, &limits, &options).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("joint 1: target position must be finite"),
        "{error}"
    );
    options.interface = [Interface::Position, Interface::Velocity];
    target.velocity[1] = 0.5;
    let mixed = Otg::plan(&start, &target, &limits, &options).unwrap();
    assert_eq!(mixed.end().velocity, vector![0.0, 0.5]);
    target = State {
        velocity: vector![2.0, 0.0],
        ..State::rest(vector![1.0, 1.0])
    };
    let error = Otg::plan(&start, &target, &limits, &Options::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "joint 0: target velocity 2 is beyond the limit 1"
    );
    let mut bad = limits;
    bad.jerk[1] = -3.0;
    let error = Otg::plan(&start, &start, &bad, &Options::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "joint 1: jerk limit must be positive, got -3"
    );
    let huge = Otg::plan(
        &start,
        &State::rest(vector![1e308, -1e308]),
        &limits,
        &Options::default(),
    );
    assert!(huge.is_ok_and(|motion| motion.duration() >= 1e308) || huge.is_err());
}
