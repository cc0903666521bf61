//! Kinematics compared with `k` and `rs-opw-kinematics`: forward kinematics with Jacobian, all
//! branches, inverse kinematics without a seed, servo ticks. A 1 kHz loop has 1000 us for
//! everything. It needs no servo: `cargo bench -p benches --no-default-features --bench
//! kinematics`.
//!
//! Every result of Canter is checked by forward kinematics. The poses and Canter's times are
//! written to `target/kinematics-bench/`, where `benches/peers/kinematics_peers.py` reads them.
//! Inputs are divided into small lots; the fastest of several passes over a lot counts.
#![allow(
    clippy::unwrap_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench prints its report"
)]

use kinematics::{Chain, Solver, urdf};
use measure::Random;
use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use rs_opw_kinematics::kinematic_traits::Kinematics as _;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

const POSES: usize = 10_000;
const PASSES: usize = 9;
const OUT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/kinematics-bench");

fn text(name: &str) -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../robots");
    std::fs::read_to_string(root.join(name).join("robot.urdf")).unwrap()
}

fn chain<const N: usize>(name: &str) -> Chain<N> {
    urdf::read(&text(name), None).unwrap().chain().unwrap()
}

/// Random joint positions inside the limits.
fn joints<const N: usize>(random: &mut Random, chain: &Chain<N>) -> SVector<f64, N> {
    random.within(chain.lower(), chain.upper())
}

/// Nanoseconds per input: the inputs are divided into small lots, and the fastest of several passes
/// over a lot counts, so that other work on the machine does not count.
fn nanoseconds<T>(inputs: &[T], mut work: impl FnMut(&T)) -> f64 {
    const LOT: usize = 50;
    let mut total = 0.0;
    for lot in inputs.chunks(LOT) {
        let mut best = f64::INFINITY;
        for _ in 0..PASSES {
            let begin = Instant::now();
            for input in lot {
                work(black_box(input));
            }
            best = best.min(begin.elapsed().as_secs_f64() * 1e9);
        }
        total += best;
    }
    total / inputs.len() as f64
}

/// Forward kinematics and Jacobian of ours and of `k`; returns the ratio.
fn forward<const N: usize>(name: &str) -> f64 {
    let chain = chain::<N>(name);
    let mut random = Random::new(1);
    let inputs: Vec<SVector<f64, N>> = (0..POSES).map(|_| joints(&mut random, &chain)).collect();
    let alone = nanoseconds(&inputs, |q| _ = black_box(chain.forward(q)));
    let ours = nanoseconds(&inputs, |q| _ = black_box(chain.jacobian(q)));
    let plain = chain.plain();
    let narrow = nanoseconds(&inputs, |q| _ = black_box(plain.jacobian(q)));
    let peer = k::Chain::<f64>::from(&urdf_rs::read_from_string(&text(name)).unwrap());
    let peer = k::SerialChain::from_end(peer.find("flange_fixed").unwrap());
    let theirs = nanoseconds(&inputs, |q| {
        peer.set_joint_positions_unchecked(q.as_slice());
        black_box(peer.end_transform());
        black_box(k::jacobian(&peer));
    });
    println!("{name:>14} | {alone:7.1} | {ours:7.1} | {narrow:7.1} | {theirs:7.1}");
    ours / theirs
}

/// All branches of one closed form, ns per pose; checks that the original joint position is found.
fn branches<const N: usize>(name: &str) -> f64 {
    let solver = Solver::new(chain::<N>(name));
    let mut random = Random::new(2);
    let inputs: Vec<_> = (0..POSES)
        .map(|_| {
            let q = joints(&mut random, solver.chain());
            (solver.chain().forward(&q), solver.parameter(&q), q)
        })
        .collect();
    let time = nanoseconds(&inputs, |(pose, parameter, q)| {
        black_box(solver.solve_all_at(pose, *parameter, q));
    });
    let (mut found, mut count) = (0, 0);
    for (pose, parameter, q) in &inputs {
        let all = solver.solve_all_at(pose, *parameter, q);
        count += all.len();
        found += usize::from(all.iter().any(|b| (b.q - q).amax() < 1e-6));
    }
    let recovered = 100.0 * found as f64 / POSES as f64;
    let mean = count as f64 / POSES as f64;
    println!(
        "{name:>14} | {:<44} | {time:7.1} | {mean:5.2} | {recovered:7.3} %",
        solver.family()
    );
    time
}

/// A UR5e with calibration errors of 0.5 mm and 0.05 degrees in every link: all branches from the
/// approximate closed form, polished. Prints the time per branch.
fn calibrated() {
    let mut random = Random::new(7);
    let (mut time, mut count, mut found) = (0.0, 0, 0);
    const ARMS: usize = 10;
    for _ in 0..ARMS {
        let mut model = urdf::read(&text("ur5e"), None).unwrap();
        for frame in &mut model.frames {
            let mut draw = |size: f64| Vector3::from_fn(|_, _| random.between(-size, size));
            let (shift, turn) = (draw(5e-4), draw(0.05_f64.to_radians()));
            *frame *= Isometry3::new(shift, turn);
        }
        let solver = Solver::new(model.chain::<6>().unwrap());
        let inputs: Vec<_> = (0..POSES / ARMS)
            .map(|_| {
                let q = joints(&mut random, solver.chain());
                (solver.chain().forward(&q), q)
            })
            .collect();
        time += nanoseconds(&inputs, |(pose, q)| {
            black_box(solver.solve_all_at(pose, 0.0, q));
        });
        for (pose, q) in &inputs {
            let all = solver.solve_all_at(pose, 0.0, q);
            count += all.len();
            found += usize::from(all.iter().any(|b| (b.q - q).amax() < 1e-5));
        }
    }
    let poses = (POSES / ARMS * ARMS) as f64;
    let mean = count as f64 / poses;
    let time = time / ARMS as f64;
    println!(
        "{:>14} | {:<44} | {time:7.1} | {mean:5.2} | {:7.3} % | {:.1} ns a branch",
        "calibrated",
        "UR5e, 0.5 mm and 0.05 degrees in each link",
        100.0 * found as f64 / poses,
        time / mean
    );
}

/// The peer for spherical wrists on the IRB 120.
fn opw() -> f64 {
    use rs_opw_kinematics::kinematics_impl::OPWKinematics;
    use rs_opw_kinematics::parameters::opw_kinematics::Parameters;
    let peer = OPWKinematics::new(Parameters {
        a1: 0.0,
        a2: -0.07,
        b: 0.0,
        c1: 0.29,
        c2: 0.27,
        c3: 0.302,
        c4: 0.072,
        ..Parameters::new()
    });
    let arm = chain::<6>("irb120");
    let mut random = Random::new(2);
    let inputs: Vec<_> = (0..POSES)
        .map(|_| {
            let q = joints(&mut random, &arm);
            peer.forward(&[q[0], q[1], q[2], q[3], q[4], q[5]])
        })
        .collect();
    let time = nanoseconds(&inputs, |pose| drop(black_box(peer.inverse(pose))));
    println!(
        "{:>14} | {:<44} | {time:7.1}",
        "irb120", "rs-opw-kinematics 3.0.0"
    );
    time
}

/// Cold inverse kinematics: times (ns) and failures over the poses of one arm.
struct Cold {
    mean: f64,
    median: f64,
    p99: f64,
    failures: usize,
}

fn cold<const N: usize>(
    solver: &Solver<N>,
    poses: &[Isometry3<f64>],
    seeds: &[SVector<f64, N>],
) -> Cold {
    let (mut times, mut failures) = (Vec::new(), 0);
    for (pose, seed) in poses.iter().zip(seeds) {
        let mut best = f64::INFINITY;
        let mut answer = None;
        for _ in 0..5 {
            let begin = Instant::now();
            let result = black_box(solver.nearest(black_box(pose), black_box(seed)));
            best = best.min(begin.elapsed().as_secs_f64() * 1e9);
            answer = result.ok();
        }
        times.push(best);
        let good = answer.is_some_and(|solution| {
            let (position, rotation) = solver.error(pose, &solution.q);
            position <= 1e-6 && rotation <= 1e-6 && solver.chain().within_limits(&solution.q, 0.0)
        });
        failures += usize::from(!good);
    }
    times.sort_unstable_by(f64::total_cmp);
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    Cold {
        mean,
        median: times[times.len() / 2],
        p99: times[times.len() * 99 / 100],
        failures,
    }
}

fn cold_arm<const N: usize>(name: &str, ours: &mut String) -> usize {
    let chain = chain::<N>(name);
    let mut random = Random::new(3);
    let sources: Vec<_> = (0..POSES).map(|_| joints(&mut random, &chain)).collect();
    let poses: Vec<_> = sources.iter().map(|q| chain.forward(q)).collect();
    let seeds: Vec<_> = (0..POSES).map(|_| joints(&mut random, &chain)).collect();
    let mut csv = String::from("x,y,z,qw,qx,qy,qz");
    for i in 1..=N {
        let _ = write!(csv, ",seed{i}");
    }
    csv.push('\n');
    for (pose, seed) in poses.iter().zip(&seeds) {
        let (t, r) = (pose.translation.vector, pose.rotation.quaternion());
        let _ = write!(
            csv,
            "{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            t.x, t.y, t.z, r.w, r.i, r.j, r.k
        );
        for s in seed {
            let _ = write!(csv, ",{s:?}");
        }
        csv.push('\n');
    }
    std::fs::write(format!("{OUT}/{name}.csv"), csv).unwrap();
    let mut failures = 0;
    for (kind, solver) in [
        ("numeric", Solver::numeric(chain).with_tolerance(1e-7, 1e-7)),
        ("best", Solver::new(chain).with_tolerance(1e-7, 1e-7)),
    ] {
        let result = cold(&solver, &poses, &seeds);
        println!(
            "{name:>14} | {kind:<8} | {:8.2} | {:8.2} | {:8.2} | {}",
            result.mean / 1e3,
            result.median / 1e3,
            result.p99 / 1e3,
            result.failures
        );
        let _ = writeln!(ours, "{name},{kind},{}", result.mean / 1e3);
        failures += result.failures;
    }
    failures
}

/// Median ns of a servo tick: the pose moves on by 0.25 mm and 0.5 mrad.
fn tick<const N: usize>(name: &str, solver: &Solver<N>) -> f64 {
    let mut random = Random::new(4);
    let axis = Vector3::new(0.36, 0.48, 0.8);
    let mut times = Vec::new();
    for _ in 0..POSES {
        let q = joints(&mut random, solver.chain());
        let pose = solver.chain().forward(&q);
        let turn = UnitQuaternion::from_scaled_axis(axis * 5e-4);
        let next = Isometry3::from_parts(
            Translation3::from(pose.translation.vector + axis * 2.5e-4),
            turn * pose.rotation,
        );
        // Sixteen calls per reading, because reading the clock takes some 25 ns.
        let lot = || {
            let begin = Instant::now();
            for _ in 0..16 {
                let _ = black_box(&solver.nearest(black_box(&next), black_box(&q)));
            }
            begin.elapsed().as_secs_f64() * 1e9 / 16.0
        };
        times.push((0..3).map(|_| lot()).fold(f64::INFINITY, f64::min));
    }
    times.sort_unstable_by(f64::total_cmp);
    let median = times[times.len() / 2];
    println!("{name:>14} | {:<44} | {median:7.1}", solver.family());
    median
}

fn main() {
    std::fs::create_dir_all(OUT).unwrap();
    println!("forward kinematics and Jacobian, ns");
    println!("{:>14} | forward | with J  | plain J | k with J", "arm");
    let six = forward::<6>("ur5e");
    let seven = forward::<7>("panda");

    println!("\nall branches of a pose, ns (seven joints: at the source's free parameter)");
    let wrist = branches::<6>("irb120");
    let parallel = branches::<6>("ur5e");
    let swivel = branches::<7>("iiwa14");
    let given = branches::<7>("panda");
    calibrated();
    let opw = opw();

    println!(
        "\ncold inverse kinematics of {POSES} poses, us; failures at 1e-6 m, 1e-6 rad and limits"
    );
    println!(
        "{:>14} | solver   |     mean |   median |      p99 | failures",
        "arm"
    );
    let mut ours = String::from("arm,solver,mean_us\n");
    let mut failures = 0;
    for name in ["ur5e", "ur10e", "irb120", "lrmate200id", "tx2_60", "xarm6"] {
        failures += cold_arm::<6>(name, &mut ours);
    }
    for name in ["panda", "iiwa14", "xarm7"] {
        failures += cold_arm::<7>(name, &mut ours);
    }
    std::fs::write(format!("{OUT}/ours.csv"), ours).unwrap();
    println!("failures: {failures}");

    println!("\nservo tick of 0.25 mm and 0.5 mrad, median ns");
    let tolerance = |solver: Solver<6>| solver.with_tolerance(1e-6, 1e-6);
    let numeric = tick("ur5e", &tolerance(Solver::numeric(chain("ur5e"))));
    let closed = tick("irb120", &tolerance(Solver::new(chain("irb120"))));
    tick("ur5e", &tolerance(Solver::new(chain("ur5e"))));
    tick(
        "panda",
        &Solver::numeric(chain::<7>("panda")).with_tolerance(1e-6, 1e-6),
    );
    tick("panda", &Solver::new(chain::<7>("panda")));

    println!();
    println!("ratio k-fk-jacobian {six:.4}");
    println!("ratio k-fk-jacobian-seven {seven:.4}");
    println!("ratio rs-opw-all-branches {:.4}", wrist / opw);
    println!("ratio rs-opw-ur-branches {:.4}", parallel / opw);
    println!("ratio rs-opw-swivel-branches {:.4}", swivel / opw);
    println!("ratio rs-opw-given-q7-branches {:.4}", given / opw);
    println!("ratio rs-opw-tick-closed {:.4}", closed / opw);
    println!("ratio rs-opw-tick-numeric {:.4}", numeric / opw);
}
