//! How fast path timing is on this machine, on random paths from a seed.

use std::time::Instant;

use trajectory::{TimingOptions, ToolLimits, time_path};

use crate::RandomPaths;

/// One line of the benchmark: random spline paths with given numbers of joints and waypoints, each
/// with time law, pieces and certificate.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingRow {
    /// Number of joints.
    pub joints: usize,
    /// Waypoints of a path.
    pub waypoints: usize,
    /// Number of paths.
    pub count: usize,
    /// Paths that could not be timed.
    pub failed: usize,
    /// Paths whose certificate does not hold.
    pub uncertified: usize,
    /// Mean planning time (ms), the shortest of all passes for each path.
    pub mean_ms: f64,
    /// 99th percentile of the planning times (ms).
    pub p99_ms: f64,
    /// Mean duration of the motions (s).
    pub motion_s: f64,
    /// Mean of duration / lower bound; the bound uses jerk limits only on straight lines.
    pub optimality: f64,
    /// Largest distance of a joint from its path (rad).
    pub fit_error: f64,
}

/// How often each path is timed.
const PASSES: usize = 3;

/// Times `count` random paths each of 3, 6 and 7 joints through 11 waypoints, and of 7 joints
/// through 3 and 101. The same `seed` gives the same paths. Reads the clock: not for a control
/// cycle.
///
/// ```
/// let table = measure::timing::bench(1, 2);
/// assert_eq!(table.len(), 5);
/// assert!(table.iter().all(|row| row.failed == 0 && row.uncertified == 0));
/// ```
pub fn bench(seed: u64, count: usize) -> Vec<TimingRow> {
    vec![
        row::<3>(seed, 11, count),
        row::<6>(seed, 11, count),
        row::<7>(seed, 11, count),
        row::<7>(seed, 3, count),
        row::<7>(seed, 101, count),
    ]
}

fn row<const N: usize>(seed: u64, waypoints: usize, count: usize) -> TimingRow {
    let limits = RandomPaths::<N>::limits();
    let options = TimingOptions::default();
    let mut row = TimingRow {
        joints: N,
        waypoints,
        count,
        failed: 0,
        uncertified: 0,
        mean_ms: 0.0,
        p99_ms: 0.0,
        motion_s: 0.0,
        optimality: 0.0,
        fit_error: 0.0,
    };
    let mut times = Vec::with_capacity(count);
    for path in RandomPaths::<N>::new(seed, waypoints).take(count) {
        let mut least = f64::INFINITY;
        let mut timed = None;
        for _ in 0..PASSES {
            let begin = Instant::now();
            timed = time_path(&path, &limits, &ToolLimits::UNLIMITED, &options).ok();
            least = least.min(begin.elapsed().as_secs_f64());
        }
        let Some(timed) = timed else {
            row.failed += 1;
            continue;
        };
        times.push(least * 1e3);
        row.uncertified += usize::from(!timed.certificate.holds());
        row.motion_s += timed.certificate.duration;
        row.optimality += timed.certificate.optimality();
        row.fit_error = row.fit_error.max(timed.certificate.fit_error);
    }
    times.sort_by(f64::total_cmp);
    let share = 1.0 / times.len().max(1) as f64;
    row.mean_ms = times.iter().sum::<f64>() * share;
    row.p99_ms = times.get(times.len() * 99 / 100).copied().unwrap_or(0.0);
    row.motion_s *= share;
    row.optimality *= share;
    row
}
