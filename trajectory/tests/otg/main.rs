//! Properties of state-to-state moves, and agreement with rsruckig.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod laws;
mod peer;
mod replan;

use measure::Problems;
use trajectory::otg::{Audit, Interface, Otg, Problem, Synchronisation};

/// Kinds of problems beyond the plain one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Plain,
    Asymmetric,
    SecondOrder,
    Velocity,
    VelocitySecondOrder,
    MinimumDuration,
    Periods,
    Apart,
}

const KINDS: [Kind; 8] = [
    Kind::Plain,
    Kind::Asymmetric,
    Kind::SecondOrder,
    Kind::Velocity,
    Kind::VelocitySecondOrder,
    Kind::MinimumDuration,
    Kind::Periods,
    Kind::Apart,
];

/// The control period of [`Kind::Periods`] (s).
const PERIOD: f64 = 0.05;

/// A random problem of a kind.
fn draw<const N: usize>(problems: &mut Problems, kind: Kind) -> Problem<N> {
    let mut problem: Problem<N> = problems.draw();
    match kind {
        Kind::Plain => {}
        Kind::Asymmetric => {
            for joint in 0..N {
                let v = problem.target.velocity[joint];
                let a = problem.target.acceleration[joint];
                let before = v - 0.5 * a * a.abs() / problem.limits.jerk[joint];
                let needed = v.abs().max(before.abs());
                problem.limits.velocity_min[joint] = -needed - problems.between(0.1, 12.0);
                problem.limits.acceleration_min[joint] = -a.abs() - problems.between(0.1, 12.0);
            }
        }
        Kind::SecondOrder | Kind::VelocitySecondOrder => {
            problem.limits.jerk.fill(f64::INFINITY);
            problem.start.acceleration.fill(0.0);
            problem.target.acceleration.fill(0.0);
        }
        Kind::Velocity => {}
        Kind::MinimumDuration => {
            problem.options.minimum_duration = problems.between(0.0, 30.0);
        }
        Kind::Periods => problem.options.period = Some(PERIOD),
        Kind::Apart => problem.options.synchronisation = Synchronisation::None,
    }
    if matches!(kind, Kind::Velocity | Kind::VelocitySecondOrder) {
        problem.options.interface = [Interface::Velocity; N];
        // Starts inside the velocity limits: braking for velocity is not part of this interface.
        for joint in 0..N {
            let unavoidable = problem.start.velocity[joint].abs()
                + 0.5 * problem.start.acceleration[joint].powi(2) / problem.limits.jerk[joint];
            let top = problem.limits.velocity_max[joint].max(unavoidable);
            problem.limits.velocity_max[joint] = top;
            problem.limits.velocity_min[joint] = -top;
        }
    }
    problem
}

/// Plans and audits a problem; the duration, or what is wrong.
fn sound<const N: usize>(problem: &Problem<N>) -> Result<f64, String> {
    let Problem {
        start,
        target,
        limits,
        options,
    } = problem;
    let motion = Otg::plan(start, target, limits, options).map_err(|error| error.to_string())?;
    let audit = Audit::of(&motion, start, target, limits);
    let worst = audit.worst();
    if worst.is_nan() || worst > 1e-12 {
        return Err(format!("{audit:?}"));
    }
    Ok(motion.duration())
}

/// Fails with the first few of `failures`.
fn report(failures: &[String], count: usize) {
    let shown = &failures[..failures.len().min(10)];
    assert!(
        failures.is_empty(),
        "{} of {count}: {shown:#?}",
        failures.len()
    );
}
