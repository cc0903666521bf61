//! State-to-state planning beside Ruckig (C++, through its own crate) and rsruckig, on the random
//! states of Ruckig's benchmark. Budget: half of Ruckig's time, 0.7 of it from rest to rest.
//!
//! Every input is planned by all three in the same run, in blocks that take turns; a time is the
//! least of all passes for that input, without the cost of reading the clock. Ruckig's crate copies
//! the input into C++ vectors on each call; what that costs is measured with an input that is
//! refused at once and taken off Ruckig's times.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a benchmark prints"
)]

use std::hint::black_box;
use std::time::Instant;

use rsruckig::prelude as rust;
use trajectory::otg::{Ends, Otg, Problem, Problems};

const COUNT: usize = 20_000;
const BLOCK: usize = 200;
const PASSES: usize = 9;

fn main() {
    let quick = std::env::args().any(|argument| argument == "--test");
    let count = if quick { BLOCK } else { COUNT };
    let clock = clock_cost();
    println!("{count} inputs, least of {PASSES} passes, us; clock {clock:.3} us taken off");
    println!(
        "{:<16}{:>10}{:>10}{:>10}{:>10}",
        "case", "planner", "mean", "p99", "max"
    );
    let mut ratios = Vec::new();
    case::<3>("3dof", Ends::Moving, (count, clock), &mut ratios);
    case::<6>("6dof", Ends::Moving, (count, clock), &mut ratios);
    case::<7>("7dof", Ends::Moving, (count, clock), &mut ratios);
    case::<7>("stop-7dof", Ends::Stopping, (count, clock), &mut ratios);
    case::<7>("rest-7dof", Ends::Resting, (count, clock), &mut ratios);
    for (name, ratio) in ratios {
        println!("ratio {name} {ratio:.4}");
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
    (count, clock): (usize, f64),
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
    let longer = (0..count)
        .filter(|&i| {
            let Problem {
                start,
                target,
                limits,
                options,
            } = &problems[i];
            let motion = Otg::plan(start, target, limits, options).unwrap();
            let refused = cpp_otg.calculate(&mut cpp_inputs[i], &mut cpp_trajectory);
            let peer = cpp_trajectory.get_duration();
            refused == ruckig::Result::Working && motion.duration() > peer * (1.0 + 1e-9)
        })
        .count();
    println!("{name:<16}{longer} of {count} moves last longer than Ruckig's");
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
