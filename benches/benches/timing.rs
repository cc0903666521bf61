//! Path timing compared with copp on the same paths: 7 joints, 11 waypoints, 2 rad/s, 10 rad/s²,
//! 100 rad/s³. Budget: a law of 200 cells in less than a millisecond.
//!
//! `cargo bench -p benches --no-default-features --bench timing [-- PATHS]`; each time is the least
//! of several runs.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a bench")]
#![allow(missing_docs, reason = "a bench")]

use std::time::Instant;

use copp::robot::Robot;
use copp::solver::topp2_ra::{
    ReachSet2OptionsBuilder, Topp2ProblemBuilder, s_to_t_topp2, topp2_ra,
};
use copp::solver::topp3_socp::{
    ClarabelOptionsBuilder, Topp3ProblemBuilder, s_to_t_topp3, topp3_socp,
};
use measure::RandomPaths;
use nalgebra::DMatrix;
use trajectory::timing::{LawProblem, ReachGrid, reach_duration};
use trajectory::{Path, SplinePath, TimingOptions, ToolLimits, time_path};

const JOINTS: usize = 7;

/// Least time (s) of `runs` calls, and the last answer.
fn least<T>(runs: usize, mut call: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut answer = None;
    for _ in 0..runs {
        let start = Instant::now();
        answer = Some(std::hint::black_box(call()));
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best, answer.unwrap())
}

fn stations(path: &SplinePath<JOINTS>, count: usize) -> Vec<f64> {
    (0..count)
        .map(|i| path.end() * i as f64 / (count - 1) as f64)
        .collect()
}

/// The path and the limits of this benchmark in copp's types.
fn robot(path: &SplinePath<JOINTS>, s: &[f64], jerk: bool) -> Robot<usize> {
    let n = s.len();
    let matrix = |k: usize| {
        let columns: Vec<f64> = s
            .iter()
            .flat_map(|u| path.at(*u).joint.q[k].as_slice().to_vec())
            .collect();
        DMatrix::from_vec(JOINTS, n, columns)
    };
    let [q, dq, ddq, dddq] = [0, 1, 2, 3].map(matrix);
    let both = |x: f64| (vec![x; JOINTS], vec![-x; JOINTS]);
    let ((v, nv), (a, na), (j, nj)) = (both(2.0), both(10.0), both(100.0));
    let mut robot = Robot::with_capacity(JOINTS, n);
    robot.with_s(s).unwrap();
    let third = dddq.as_view();
    robot
        .with_q(
            &q.as_view(),
            &dq.as_view(),
            &ddq.as_view(),
            jerk.then_some(&third),
            0,
        )
        .unwrap()
        .with_axial_velocity((v.as_slice(), n), (nv.as_slice(), n), 0)
        .unwrap()
        .with_axial_acceleration((a.as_slice(), n), (na.as_slice(), n), 0)
        .unwrap();
    if jerk {
        robot
            .with_axial_jerk((j.as_slice(), n), (nj.as_slice(), n), 0)
            .unwrap();
    }
    robot
}

/// copp's topp2_ra: solving time and duration (s).
fn copp_second(path: &SplinePath<JOINTS>, count: usize) -> (f64, f64) {
    let s = stations(path, count);
    let robot = robot(path, &s, false);
    let problem = Topp2ProblemBuilder::new(&robot, (0, count - 1), (0.0, 0.0))
        .build()
        .unwrap();
    let options = ReachSet2OptionsBuilder::new().build().unwrap();
    let (time, a) = least(15, || topp2_ra(&problem, &options).unwrap());
    (time, s_to_t_topp2(&s, &a, 0.0).unwrap().0)
}

/// Our reachability pass on the same stations.
fn our_second(path: &SplinePath<JOINTS>, count: usize) -> (f64, f64) {
    let mut grid = ReachGrid::new(JOINTS);
    for u in stations(path, count) {
        let [_, first, second, _] = path.at(u).joint.q;
        let cap = (2.0 / first.amax()).powi(2);
        grid.push(
            u,
            cap,
            (0..JOINTS).map(|j| (first[j] / 10.0, second[j] / 10.0)),
        );
    }
    let (time, a) = least(15, || grid.solve(0.0, 0.0));
    (time, reach_duration(grid.at(), &a))
}

/// copp's TOPP3 by SOCP around its topp2_ra: time of one solve, duration after `solves` of them.
fn copp_third(path: &SplinePath<JOINTS>, count: usize, solves: usize) -> (f64, f64) {
    let s = stations(path, count);
    let mut robot = robot(path, &s, true);
    let mut a = {
        let problem = Topp2ProblemBuilder::new(&robot, (0, count - 1), (0.0, 0.0))
            .build()
            .unwrap();
        topp2_ra(&problem, &ReachSet2OptionsBuilder::new().build().unwrap()).unwrap()
    };
    robot.constraints.amax_substitute(&a, 0).unwrap();
    let options = ClarabelOptionsBuilder::new()
        .allow_almost_solved(true)
        .build()
        .unwrap();
    let (mut time, mut duration) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..solves {
        let problem = Topp3ProblemBuilder::new(&mut robot, 0, &a, (0.0, 0.0), (0.0, 0.0))
            .build_with_linearization()
            .unwrap();
        let (one, profile) = least(2, || topp3_socp(&problem, &options).unwrap());
        time = time.min(one);
        duration = s_to_t_topp3(&s, profile.as_parts(), 0.0).unwrap().0;
        a = profile.a.clone();
    }
    (time, duration)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

fn without_jerk(paths: &[SplinePath<JOINTS>]) -> f64 {
    println!("\nwithout jerk limits, mean over {} paths", paths.len());
    println!(
        "{:>6} {:>12} {:>12} {:>8} {:>10} {:>10}",
        "grid", "copp us", "ours us", "ratio", "copp s", "ours s"
    );
    let mut shown = 0.0;
    for count in [101, 201, 501] {
        let peer: Vec<_> = paths.iter().map(|path| copp_second(path, count)).collect();
        let ours: Vec<_> = paths.iter().map(|path| our_second(path, count)).collect();
        let (p, o) = (
            mean(peer.iter().map(|x| x.0)),
            mean(ours.iter().map(|x| x.0)),
        );
        let (pt, ot) = (
            mean(peer.iter().map(|x| x.1)),
            mean(ours.iter().map(|x| x.1)),
        );
        println!(
            "{count:>6} {:>12.2} {:>12.2} {:>8.3} {pt:>10.4} {ot:>10.4}",
            p * 1e6,
            o * 1e6,
            o / p
        );
        if count == 201 {
            shown = o / p;
        }
    }
    shown
}

fn with_jerk(paths: &[SplinePath<JOINTS>]) -> [f64; 3] {
    println!("\nwith jerk limits, mean over {} paths", paths.len());
    println!(
        "ours: the law alone beside one SOCP solve; then everything with pieces and certificate"
    );
    println!(
        "{:>6} {:>11} {:>11} {:>9} {:>11} {:>9} {:>9} {:>9} {:>7}",
        "grid", "copp ms", "law ms", "ratio", "all ms", "copp s", "law s", "certified", "ratio"
    );
    let limits = RandomPaths::<JOINTS>::limits();
    let mut shown = [0.0; 3];
    for count in [101_usize, 201, 501] {
        let options = TimingOptions {
            cells: Some(count - 1),
            ..TimingOptions::default()
        };
        let mut rows = Vec::new();
        for path in paths {
            let (peer, peer_duration) = copp_third(path, count, 2);
            let problem = LawProblem::new(path, &limits, &ToolLimits::UNLIMITED, &options).unwrap();
            let (law, answer) = least(9, || problem.solve());
            let (all, timed) = least(5, || {
                time_path(path, &limits, &ToolLimits::UNLIMITED, &options).unwrap()
            });
            assert!(timed.certificate.holds());
            let certified = timed.certificate.duration;
            rows.push([peer, law, all, peer_duration, answer.duration, certified]);
        }
        let [peer, law, all, peer_s, law_s, certified] =
            [0, 1, 2, 3, 4, 5].map(|i| mean(rows.iter().map(|row| row[i])));
        println!(
            "{count:>6} {:>11.3} {:>11.3} {:>9.4} {:>11.3} {peer_s:>9.4} {law_s:>9.4} {certified:>9.4} {:>7.4}",
            peer * 1e3,
            law * 1e3,
            law / peer,
            all * 1e3,
            certified / peer_s
        );
        match count {
            201 => [shown[0], shown[1]] = [law / peer, all / peer],
            501 => shown[2] = mean(rows.iter().map(|row| row[5] / row[3])),
            _ => {}
        }
    }
    shown
}

fn main() {
    let wanted = std::env::args().skip(1).find_map(|x| x.parse().ok());
    let paths: Vec<_> = RandomPaths::<JOINTS>::new(40, 11)
        .take(wanted.unwrap_or(10))
        .collect();
    let second = without_jerk(&paths);
    let [law, all, duration] = with_jerk(&paths);
    println!("\nratio copp-topp2ra {second:.4}");
    println!("ratio copp-topp3-socp-201 {law:.5}");
    println!("ratio copp-topp3-socp-201-certified {all:.5}");
    println!("ratio copp-duration-501 {duration:.5}");
}
