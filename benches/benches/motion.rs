//! Smooth motion through pose lists: motion time compared with exact stop and with an IPOPT
//! optimum. Budget: 2 ms for 3 poses, 5 ms for 5, 2.5 ms per pose in windows, 2 % of the motion
//! time.
//!
//! Then random moves of two robots: the processor time of planning. Budget of MoveTo: 1.5 ms (median)
//! and 5 ms (p99) with six joints, 3 and 10 ms with seven; of straight moves 1.5 and 3 ms; of smooth moves
//! 1 % of the motion (median) and 5 % (p95). With the
//! argument `moves` these alone, with one line for each move: how long it is, and how long it is
//! planned.
//!
//! Then long lists of a UR5e, one millimetre from pose to pose: the processor time until the first of
//! their windows may be executed. Budget: 100 ms for 10 000 poses. With the argument `windows` these alone.
//!
//! The reference is the minimum time found by IPOPT for piecewise constant
//! jerk in a tube of the tolerance, same limits (500 mm/s, 5000 mm/s2,
//! 1e5 mm/s3), computed once outside of this repository.
#![allow(missing_docs, clippy::print_stdout, reason = "a benchmark prints")]

use std::borrow::Cow;

use measure::smooth::measure;
use measure::{PlanningTime, RandomMoves};
use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3};
use planner::controller::Controller;
use planner::motion::Planner;
use planner::task::{Move, Shape};
use trajectory::ToolLimits;
use trajectory::smooth::{SmoothOptions, Windows};

#[path = "../../trajectory/tests/suite/mod.rs"]
mod suite;

#[path = "../../trajectory/tests/dense/lists.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod dense;

fn main() {
    // As the command does.
    scheduling::keep_freed_memory();
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.iter().any(|word| word == "moves") {
        random_moves(&words);
        return;
    }
    if !words.iter().any(|word| word == "windows") {
        lists();
        random_moves(&words);
    }
    first_windows();
}

/// Processor time from a long list to its first window, and the most that a later window takes beside
/// its own time.
fn first_windows() {
    let Ok(robot) = planner::robot::load("ur5e") else {
        println!("the robot ur5e is missing");
        return;
    };
    let Ok(controller) = Controller::<6>::new(&robot, 1000.0, Default::default()) else {
        println!("the robot ur5e cannot be used");
        return;
    };
    let planner = controller.planner();
    let home = SVector::from_column_slice(&robot.home);
    let start = planner.chain().forward(&home);
    let mut lines = Vec::new();
    for count in [1_000, 3_999, 10_000, 100_000] {
        for turn in [0.0, 0.15] {
            let motion = Move {
                shape: Shape::Smooth,
                poses: waves(&start, count, turn),
                tolerance: 1e-4,
                limits: robot.motion_limits(),
            };
            let row = Windowed::measure(planner, &motion, &home);
            println!("{count} poses, turning by {turn} rad: {row}");
            if turn > 0.0 {
                lines.push(format!("ratio first-window-{count}-ms {:.1}", row.first));
            }
        }
    }
    println!("{}", lines.join("\n"));
}

/// How a long list was planned.
struct Windowed {
    /// Time until something may be executed, ms.
    first: f64,
    /// Windows, 1 where the list is planned as a whole.
    windows: usize,
    /// Largest planning time of a later window over its own time.
    most: f64,
    /// Time of the motion, s.
    motion: f64,
}

impl Windowed {
    fn measure(planner: &Planner<6>, motion: &Move, home: &SVector<f64, 6>) -> Self {
        let clock = || scheduling::thread_time_ns() as f64 * 1e-6;
        let begun = clock();
        let mut row = Self {
            first: f64::NAN,
            windows: 1,
            most: 0.0,
            motion: f64::NAN,
        };
        let Some(mut windowed) = planner.windows(Cow::Borrowed(motion), home) else {
            if let Ok(planned) = planner.plan(motion, home) {
                row.motion = planned.trajectory.duration();
            }
            row.first = clock() - begun;
            return row;
        };
        row.first = clock() - begun;
        loop {
            let begun = clock();
            let Ok(window) = planner.window_of(&mut windowed) else {
                return row;
            };
            let time: f64 = window.pieces.iter().map(|piece| piece.duration).sum();
            row.most = row.most.max((clock() - begun) * 1e-3 / time);
            row.motion = windowed.duration();
            if window.last {
                return row;
            }
            row.windows += 1;
        }
    }
}

impl std::fmt::Display for Windowed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            first,
            windows,
            most,
            motion,
        } = self;
        write!(
            f,
            "{windows} windows, first after {first:.1} ms, later ones planned in at most {most:.3} of \
             their time, motion {motion:.5} s"
        )
    }
}

/// Poses on waves from a pose, one millimetre apart, with a tool that turns to and fro.
fn waves(start: &Isometry3<f64>, count: usize, turn: f64) -> Vec<Isometry3<f64>> {
    let at = |i: usize| {
        let a = std::f64::consts::TAU * i as f64 / 300.0;
        let way = Vector3::new(
            0.04 * (a.cos() - 1.0) + 0.03 * (0.37 * a).sin(),
            0.06 * a.sin(),
            0.02 * (0.21 * a).sin(),
        );
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), turn * (0.3 * a).sin());
        let place = start.translation.vector + way;
        Isometry3::from_parts(place.into(), start.rotation * turn)
    };
    (1..=count).map(at).collect()
}

/// Moves of each shape.
const MOVES: [(Shape, &str, usize); 3] = [
    (Shape::Joint, "moveto", 1000),
    (Shape::Straight, "straight", 300),
    (Shape::Smooth, "smooth", 100),
];

/// Processor time of planning random moves; refused moves count too. Words name the robots and
/// shapes that are wanted; all, if none is named. A number says how many moves of each.
fn random_moves(words: &[String]) {
    let each = words.iter().any(|word| word == "moves");
    let named = |all: &[&str]| words.iter().any(|word| all.contains(&word.as_str()));
    let wanted = |name: &str, all: &[&str]| !named(all) || named(&[name]);
    let fewer = words.iter().find_map(|word| word.parse().ok());
    let mut lines = Vec::new();
    const ROBOTS: [&str; 2] = ["ur5e", "panda"];
    for name in ROBOTS.into_iter().filter(|name| wanted(name, &ROBOTS)) {
        let Ok(robot) = planner::robot::load(name) else {
            println!("the robot {name} is missing");
            continue;
        };
        let suffix = if name == "ur5e" { "" } else { "-7" };
        let words = MOVES.map(|(_, word, _)| word);
        for (shape, word, all) in MOVES.into_iter().filter(|row| wanted(row.1, &words)) {
            let count = fewer.map_or(all, |fewer: usize| fewer.clamp(1, all));
            let moves = RandomMoves {
                shape,
                count,
                seed: 12,
                clock: || scheduling::thread_time_ns() as f64 * 1e-9,
            };
            let times = match moves.measure(&robot) {
                Ok(times) => times,
                Err(error) => {
                    println!("{name}: {error}");
                    continue;
                }
            };
            if each {
                for (i, time) in times.iter().enumerate() {
                    let motion = time.motion.unwrap_or(f64::NAN);
                    println!("{name} {word} {i} {motion:.6} {:.4}", time.planning * 1e3);
                }
            }
            let planned = times.iter().filter_map(|time| time.motion);
            let sum: f64 = planned.clone().sum();
            println!(
                "{name} {word}: {} of {count} planned, {sum:.3} s of motion",
                planned.count()
            );
            let mut planning: Vec<f64> = times.iter().map(|time| time.planning * 1e3).collect();
            planning.sort_by(f64::total_cmp);
            for (name, share) in [("p50", 0.5), ("p99", 0.99)] {
                let at = planning[((count - 1) as f64 * share) as usize];
                lines.push(format!("ratio {word}{suffix}-planning-{name}-ms {at:.3}"));
            }
            if shape == Shape::Smooth {
                lines.extend(shares(&times, &format!("{word}{suffix}")));
            }
        }
    }
    for line in lines {
        println!("{line}");
    }
}

/// Planning time over the time of the motion, of the moves that can be made, one line for each quantile.
fn shares(times: &[PlanningTime], name: &str) -> Vec<String> {
    let share =
        |time: &PlanningTime| Some(time.planning / time.motion.filter(|motion| *motion > 0.0)?);
    let mut shares: Vec<f64> = times.iter().filter_map(share).collect();
    shares.sort_by(f64::total_cmp);
    let at =
        |quantile: f64| shares.get((shares.len().saturating_sub(1) as f64 * quantile) as usize);
    let line = |(word, quantile): (&str, f64)| {
        let percent = 100.0 * at(quantile)?;
        Some(format!(
            "ratio {name}-planning-share-{word}-percent {percent:.3}"
        ))
    };
    [("p50", 0.5), ("p95", 0.95)]
        .into_iter()
        .filter_map(line)
        .collect()
}

fn lists() {
    let limits = ToolLimits {
        speed: 0.5,
        acceleration: 5.0,
        jerk: 100.0,
        ..ToolLimits::UNLIMITED
    };
    println!(
        "case        poses motion_s exact_s plan_ms first_ms deviat corrid veloc  accel  jerk   ok fallbacks"
    );
    let (mut sum, mut lines, mut worst) = (0.0, Vec::new(), 0.0_f64);
    let cases = suite::cases();
    for (name, poses, tolerance, reference) in &cases {
        let options = SmoothOptions::new(*tolerance, limits);
        let rows: Vec<_> = (0..5).map(|_| measure(poses, &options)).collect();
        let planning = rows
            .iter()
            .map(|row| row.planning)
            .fold(f64::INFINITY, f64::min);
        let row = &rows[0];
        let (motion, stop) = (
            row.motion.unwrap_or(f64::NAN),
            row.exact_stop.unwrap_or(f64::NAN),
        );
        println!(
            "{:<11} {:>5} {motion:>8.4} {stop:>7.3} {:>7.2} {:>8.2} {:.4} {:.4} {:.4} {:.4} {:.4} {} {}",
            name,
            row.poses,
            planning * 1e3,
            row.first * 1e3,
            row.deviation_ratio,
            row.corridor_ratio,
            row.velocity_ratio,
            row.acceleration_ratio,
            row.jerk_ratio,
            row.certified,
            row.fallbacks,
        );
        lines.push(format!(
            "ratio motion-exact-stop-{} {:.4}",
            name,
            motion / stop
        ));
        lines.push(format!(
            "ratio motion-reference-{} {:.4}",
            name,
            motion / reference
        ));
        sum += (motion / reference).ln();
        worst = worst.max(motion / reference);
    }
    lines.extend(long_lists(limits));
    for line in lines {
        println!("{line}");
    }
    println!("ratio motion-worst {worst:.4}");
    println!(
        "ratio motion-geomean {:.4}",
        (sum / cases.len() as f64).exp()
    );
    dense_lists(limits);
}

/// Lists dense in poses, beside the least time along the exact curve. Budget: 1.02 of it, 20 ms for
/// 1000 poses. Prints rows, then ratios.
fn dense_lists(limits: ToolLimits) {
    let (mut lines, mut worst) = (Vec::new(), 0.0_f64);
    for case in dense::suite() {
        let options = SmoothOptions::new(case.tolerance, limits);
        let rows: Vec<_> = (0..5).map(|_| measure(&case.poses, &options)).collect();
        let planning = rows
            .iter()
            .map(|row| row.planning)
            .fold(f64::INFINITY, f64::min);
        let row = &rows[0];
        let ratio = row.motion.unwrap_or(f64::NAN) / case.reference;
        println!(
            "{:<11} {:>5} {:>8.4} s, reference {:.4} s, {:.2} ms for 1000 poses, {} {}",
            case.name,
            row.poses,
            ratio * case.reference,
            case.reference,
            planning * 1e6 / row.poses as f64,
            row.certified,
            row.fallbacks,
        );
        lines.push(format!("ratio motion-dense-{} {ratio:.4}", case.name));
        worst = if ratio <= worst { worst } else { ratio };
    }
    for line in lines {
        println!("{line}");
    }
    println!("ratio motion-dense-worst {worst:.4}");
}

/// A zigzag of 1000 and of 10 000 poses in windows: time until motion can
/// start, and cost per pose. Budget: first motion within 50 ms, linear cost.
fn long_lists(limits: ToolLimits) -> Vec<String> {
    let [short, long] = [1_000, 10_000].map(|count| {
        let poses: Vec<_> = (0..count)
            .map(|i| Isometry3::translation(0.005 * f64::from(i), 0.004 * f64::from(i % 2), 0.0))
            .collect();
        let clock = std::time::Instant::now();
        let mut windows = match Windows::new(&poses, &SmoothOptions::new(0.5e-3, limits)) {
            Ok(windows) => windows,
            Err(error) => return Err(error.to_string()),
        };
        windows.advance();
        let first = clock.elapsed().as_secs_f64();
        let plan = windows.finish();
        let each = clock.elapsed().as_secs_f64() / f64::from(count);
        println!(
            "{count} poses: first {:.2} ms, {:.3} ms a pose, motion {:.2} s of {:.2} s with stops",
            first * 1e3,
            each * 1e3,
            plan.duration(),
            plan.exact_stop()
        );
        Ok((first, each))
    });
    match (short, long) {
        (Ok(short), Ok(long)) => vec![
            format!("ratio motion-first-10000-to-50ms {:.4}", long.0 / 0.05),
            format!("ratio motion-cost-10000-to-1000 {:.4}", long.1 / short.1),
        ],
        (Err(error), _) | (_, Err(error)) => vec![error],
    }
}
