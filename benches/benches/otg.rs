//! State-to-state planning compared with Ruckig (C++, through its crate) and rsruckig, on the
//! random states of Ruckig's benchmark. Budget: half of Ruckig's time, 0.7 of it from rest to rest.
//!
//! All three plan every input in the same run, in alternating blocks. A time is the least of all
//! passes for that input, without the cost of reading the clock. Ruckig's crate copies the input
//! into C++ vectors on each call; this cost is measured with an input that is refused at once, and
//! subtracted from Ruckig's times.
//!
//! `cargo bench -p benches --no-default-features --bench otg [-- --compare COUNT]`; with
//! `--compare` it compares only durations, for COUNT inputs of each of the five cases.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a benchmark prints"
)]

use std::hint::black_box;
use std::time::Instant;

use measure::{Ends, Problems};
use rsruckig::prelude as rust;
use trajectory::otg::{Audit, Otg, Problem};

const COUNT: usize = 20_000;
const BLOCK: usize = 200;
const PASSES: usize = 9;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--test");
    if let Some(count) = compared() {
        return compare_all(count);
    }
    let count = if quick { BLOCK } else { COUNT };
    let clock = clock_cost();
    println!("{count} inputs, least of {PASSES} passes, us; clock {clock:.3} us taken off");
    println!(
        "{:<16}{:>10}{:>10}{:>10}{:>10}",
        "case", "planner", "mean", "p99", "max"
    );
    let mut ratios = Vec::new();
    case::<3>("3dof", Ends::Moving, count, clock, &mut ratios);
    case::<6>("6dof", Ends::Moving, count, clock, &mut ratios);
    case::<7>("7dof", Ends::Moving, count, clock, &mut ratios);
    case::<7>("stop-7dof", Ends::Stopping, count, clock, &mut ratios);
    case::<7>("rest-7dof", Ends::Resting, count, clock, &mut ratios);
    for (name, ratio) in ratios {
        println!("ratio {name} {ratio:.4}");
    }
}

/// Inputs of each case whose durations alone are to be compared: `--compare COUNT`.
fn compared() -> Option<usize> {
    let mut arguments = std::env::args().skip_while(|argument| argument != "--compare");
    arguments.nth(1)?.parse().ok()
}

/// Compares durations with Ruckig's over `count` inputs of each case, timing nothing.
fn compare_all(count: usize) {
    println!("durations beside Ruckig's, {count} inputs a case");
    let show = |name: &str, durations: Durations| println!("{name:<16}{durations}");
    show("3dof", Durations::of::<3>(1, Ends::Moving, count));
    show("6dof", Durations::of::<6>(2, Ends::Moving, count));
    show("7dof", Durations::of::<7>(3, Ends::Moving, count));
    show("stop-7dof", Durations::of::<7>(4, Ends::Stopping, count));
    show("rest-7dof", Durations::of::<7>(5, Ends::Resting, count));
}

/// How our durations compare with Ruckig's.
#[derive(Default)]
struct Durations {
    equal: usize,
    shorter: usize,
    /// Shorter ones that break a limit or miss the target by more than 1e-12.
    unsound: usize,
    longer: usize,
    refused: usize,
    /// The greatest relative difference of a shorter one.
    gain: f64,
}

impl Durations {
    /// Compares the first `count` inputs of a random source.
    fn of<const N: usize>(seed: u64, ends: Ends, count: usize) -> Self {
        let mut source = Problems::new(seed, ends);
        let mut otg = ruckig::Ruckig::new_direct(N, 0.005);
        let mut trajectory = ruckig::Trajectory::new_direct(N);
        let mut result = Self::default();
        for _ in 0..count {
            let problem: Problem<N> = source.draw();
            let Problem {
                start,
                target,
                limits,
                options,
            } = &problem;
            let motion = Otg::plan(start, target, limits, options).unwrap();
            let ours = motion.duration();
            let answer = otg.calculate(&mut cpp_input(&problem), &mut trajectory);
            let theirs = trajectory.get_duration();
            if answer != ruckig::Result::Working {
                result.refused += 1;
            } else if ours > theirs * (1.0 + 1e-9) {
                result.longer += 1;
            } else if ours < theirs * (1.0 - 1e-9) {
                result.shorter += 1;
                result.gain = result.gain.max(1.0 - ours / theirs);
                let worst = Audit::of(&motion, start, target, limits).worst();
                result.unsound += usize::from(worst.is_nan() || worst > 1e-12);
            } else {
                result.equal += 1;
            }
        }
        result
    }
}

impl std::fmt::Display for Durations {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} as long as Ruckig's, {} shorter (by {:.2e} at most, {} of them unsound), \
             {} longer, {} refused by it",
            self.equal, self.shorter, self.gain, self.unsound, self.longer, self.refused
        )
    }
}

/// What reading the clock twice costs (us).
fn clock_cost() -> f64 {
    (0..100_000)
        .map(|_| timed(|| ()))
        .fold(f64::INFINITY, f64::min)
}

fn timed<T>(work: impl FnOnce() -> T) -> f64 {
    let begin = Instant::now();
    black_box(work());
    begin.elapsed().as_nanos() as f64 * 1e-3
}

/// Times of one planner: the least of each input.
struct Times(Vec<f64>);

impl Times {
    fn new(count: usize) -> Self {
        Self(vec![f64::INFINITY; count])
    }

    fn note(&mut self, index: usize, time: f64) {
        self.0[index] = self.0[index].min(time);
    }

    /// Mean, 99th percentile and largest, less `cost`.
    fn summary(mut self, cost: f64) -> [f64; 3] {
        self.0.sort_by(f64::total_cmp);
        let count = self.0.len();
        let mean = self.0.iter().sum::<f64>() / count as f64;
        [mean, self.0[count * 99 / 100], self.0[count - 1]].map(|time| time - cost)
    }
}

fn case<const N: usize>(
    name: &str,
    ends: Ends,
    count: usize,
    clock: f64,
    ratios: &mut Vec<(String, f64)>,
) {
    let mut source = Problems::new(42, ends);
    let problems: Vec<Problem<N>> = (0..count).map(|_| source.draw()).collect();
    let mut ours = Times::new(count);
    let mut cpp = Times::new(count);
    let mut port = Times::new(count);
    let mut cpp_inputs: Vec<_> = problems.iter().map(cpp_input).collect();
    let port_inputs: Vec<_> = problems.iter().map(port_input).collect();
    let mut cpp_otg = ruckig::Ruckig::new_direct(N, 0.005);
    let mut cpp_trajectory = ruckig::Trajectory::new_direct(N);
    let mut port_otg = rust::Ruckig::<N, rust::ThrowErrorHandler>::new(None, 0.005);
    let mut port_trajectory = rust::Trajectory::new(None);
    for _ in 0..PASSES {
        for begin in (0..count).step_by(BLOCK) {
            let block = begin..(begin + BLOCK).min(count);
            for i in block.clone() {
                let Problem {
                    start,
                    target,
                    limits,
                    options,
                } = &problems[i];
                ours.note(i, timed(|| Otg::plan(start, target, limits, options)));
            }
            for i in block.clone() {
                let input = &mut cpp_inputs[i];
                cpp.note(i, timed(|| cpp_otg.calculate(input, &mut cpp_trajectory)));
            }
            for i in block {
                let input = &port_inputs[i];
                port.note(i, timed(|| port_otg.calculate(input, &mut port_trajectory)));
            }
        }
    }
    let durations = Durations::of::<N>(42, ends, count);
    println!("{name:<16}{durations}");
    let copy = copy_cost(&problems[0]);
    let ours = ours.summary(clock);
    let cpp = cpp.summary(copy);
    let port = port.summary(clock);
    for (planner, [mean, p99, max]) in [("canter", ours), ("ruckig", cpp), ("rsruckig", port)] {
        println!("{name:<16}{planner:>10}{mean:>10.3}{p99:>10.3}{max:>10.3}");
    }
    println!("{:<16}{:>10}{:>10.3}", name, "(copy", copy);
    for (peer, times) in [("ruckig", cpp), ("rsruckig", port)] {
        ratios.push((format!("{peer}-{name}-mean"), ours[0] / times[0]));
        ratios.push((format!("{peer}-{name}-p99"), ours[1] / times[1]));
    }
}

/// What a call of Ruckig's crate costs that is refused at once (us), clock included.
fn copy_cost<const N: usize>(problem: &Problem<N>) -> f64 {
    let mut input = cpp_input(problem);
    input.max_jerk[0] = -1.0;
    let mut otg = ruckig::Ruckig::new_direct(N, 0.005);
    let mut trajectory = ruckig::Trajectory::new_direct(N);
    (0..20_000)
        .map(|_| timed(|| otg.calculate(&mut input, &mut trajectory)))
        .fold(f64::INFINITY, f64::min)
}

fn cpp_input<const N: usize>(problem: &Problem<N>) -> ruckig::InputParameter {
    let mut input = ruckig::InputParameter::new(N);
    input.current_position = problem.start.position.as_slice().to_vec();
    input.current_velocity = problem.start.velocity.as_slice().to_vec();
    input.current_acceleration = problem.start.acceleration.as_slice().to_vec();
    input.target_position = problem.target.position.as_slice().to_vec();
    input.target_velocity = problem.target.velocity.as_slice().to_vec();
    input.target_acceleration = problem.target.acceleration.as_slice().to_vec();
    input.max_velocity = problem.limits.velocity_max.as_slice().to_vec();
    input.max_acceleration = problem.limits.acceleration_max.as_slice().to_vec();
    input.max_jerk = problem.limits.jerk.as_slice().to_vec();
    input
}

fn port_input<const N: usize>(problem: &Problem<N>) -> rust::InputParameter<N> {
    let mut input = rust::InputParameter::new(None);
    for joint in 0..N {
        input.current_position[joint] = problem.start.position[joint];
        input.current_velocity[joint] = problem.start.velocity[joint];
        input.current_acceleration[joint] = problem.start.acceleration[joint];
        input.target_position[joint] = problem.target.position[joint];
        input.target_velocity[joint] = problem.target.velocity[joint];
        input.target_acceleration[joint] = problem.target.acceleration[joint];
        input.max_velocity[joint] = problem.limits.velocity_max[joint];
        input.max_acceleration[joint] = problem.limits.acceleration_max[joint];
        input.max_jerk[joint] = problem.limits.jerk[joint];
    }
    input
}
