//! How fast planning is on this machine, on random problems from a seed.

use std::hint::black_box;
use std::time::Instant;

use trajectory::otg::{Audit, Otg, Problem};

use crate::{Ends, Problems};

/// One line of the benchmark: planning times of random problems, and whether the moves are valid.
#[derive(Clone, Debug, PartialEq)]
pub struct OtgRow {
    /// Number of joints.
    pub joints: usize,
    /// Which ends of the moves are in motion.
    pub ends: Ends,
    /// Number of problems.
    pub count: usize,
    /// Problems that could not be planned.
    pub failed: usize,
    /// Mean, median, 99th percentile and longest planning time (µs), the shortest of all passes
    /// for each problem, with the cost of reading the clock.
    pub mean_us: f64,
    /// See `mean_us`.
    pub median_us: f64,
    /// See `mean_us`.
    pub p99_us: f64,
    /// See `mean_us`.
    pub max_us: f64,
    /// Mean duration of the moves (s).
    pub move_s: f64,
    /// Worst number of all audits (see [`Audit`]); rounding stays below 1e-12.
    pub worst: f64,
}

/// How often each problem is planned.
const PASSES: usize = 5;

/// Plans `count` random problems of 3, 6 and 7 joints with moving ends, and of 7 joints with a
/// target at rest and from rest to rest. The same `seed` gives the same problems. Allocates and
/// reads the clock: not for a control cycle.
///
/// ```
/// let table = measure::otg::bench(1, 20);
/// assert_eq!(table.len(), 5);
/// assert!(table.iter().all(|row| row.failed == 0 && row.worst < 1e-12));
/// ```
pub fn bench(seed: u64, count: usize) -> Vec<OtgRow> {
    vec![
        row::<3>(seed, Ends::Moving, count),
        row::<6>(seed, Ends::Moving, count),
        row::<7>(seed, Ends::Moving, count),
        row::<7>(seed, Ends::Stopping, count),
        row::<7>(seed, Ends::Resting, count),
    ]
}

fn row<const N: usize>(seed: u64, ends: Ends, count: usize) -> OtgRow {
    let mut source = Problems::new(seed, ends);
    let problems: Vec<Problem<N>> = (0..count).map(|_| source.draw()).collect();
    let mut times = vec![f64::INFINITY; count];
    for _ in 0..PASSES {
        for (
            time,
            Problem {
                start,
                target,
                limits,
                options,
            },
        ) in times.iter_mut().zip(&problems)
        {
            let begin = Instant::now();
            let motion = Otg::plan(start, target, limits, options);
            black_box(&motion).as_ref().ok();
            *time = time.min(begin.elapsed().as_nanos() as f64 * 1e-3);
        }
    }
    times.sort_by(f64::total_cmp);
    let at = |share: f64| {
        times
            .get((share * (count as f64 - 1.0)).round() as usize)
            .copied()
            .unwrap_or(0.0)
    };
    let (failed, move_s, worst) = outcome(&problems);
    OtgRow {
        joints: N,
        ends,
        count,
        failed,
        mean_us: times.iter().sum::<f64>() / (count.max(1) as f64),
        median_us: at(0.5),
        p99_us: at(0.99),
        max_us: at(1.0),
        move_s,
        worst,
    }
}

/// Failures, mean duration and worst audit.
fn outcome<const N: usize>(problems: &[Problem<N>]) -> (usize, f64, f64) {
    let (mut failed, mut sum, mut worst) = (0, 0.0, 0.0_f64);
    for Problem {
        start,
        target,
        limits,
        options,
    } in problems
    {
        match Otg::plan(start, target, limits, options) {
            Ok(motion) => {
                sum += motion.duration();
                worst = worst.max(Audit::of(&motion, start, target, limits).worst());
            }
            Err(_) => failed += 1,
        }
    }
    (
        failed,
        sum / ((problems.len() - failed).max(1) as f64),
        worst,
    )
}
