//! Laws that need no peer.

use nalgebra::vector;

use super::super::{Ends, Limits, Options, Otg, Problem, Problems, State};
use super::{KINDS, draw};

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
