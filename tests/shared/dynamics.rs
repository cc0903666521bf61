//! The inverse dynamics beside that of Pinocchio, on every shipped robot with inertias.

use std::io::Write;
use std::process::{Command, Stdio};

use kinematics::Model;
use nalgebra::SVector;
use planner::with_dof;
use system_tests::repository::root;

/// States for each robot.
const STATES: usize = 20_000;
/// Robots that come with inertias; 1e5 states in all.
const ROBOTS: [&str; 5] = ["ur5e", "panda", "fr3", "iiwa7", "iiwa14"];
/// Largest difference, relative to the largest effort of the state.
const RELATIVE: f64 = 1e-9;

/// Reads states from standard input and writes their efforts.
const PEER: &str = r"
import sys, numpy as np, pinocchio
model = pinocchio.buildModelFromUrdf(sys.argv[1])
model.gravity.linear = np.array([0.0, 0.0, -9.80665])
data, n = model.createData(), model.nv
states = np.frombuffer(sys.stdin.buffer.read()).reshape(-1, 3, n)
out = [np.array(pinocchio.rnea(model, data, q.copy(), v.copy(), a.copy())) for q, v, a in states]
sys.stdout.buffer.write(np.array(out).tobytes())
";

/// Whether Python with Pinocchio is there.
pub(crate) fn has_pinocchio() -> bool {
    let run = Command::new("python3")
        .args(["-c", "import pinocchio, numpy"])
        .output();
    run.is_ok_and(|output| output.status.success())
}

pub(crate) fn efforts_agree_with_pinocchio() {
    for name in ROBOTS {
        let file = root().join("robots").join(name).join("robot.urdf");
        let text = std::fs::read_to_string(&file).unwrap();
        let robot = planner::robot::load(name).unwrap();
        assert_eq!(robot.urdf, text);
        let worst = with_dof!(robot.dof(), N => compared::<N>(&robot.model, &file));
        println!("{name}: {STATES} states, largest relative difference {worst:.1e}");
        assert!(worst < RELATIVE, "{name}: {worst:.3e}");
    }
}

fn compared<const N: usize>(model: &Model, file: &std::path::Path) -> f64 {
    let mut random = measure::Problems::new(1, measure::Ends::Resting);
    let mut vector = |size: f64| SVector::<f64, N>::from_fn(|_, _| random.between(-size, size));
    let states: Vec<[SVector<f64, N>; 3]> = (0..STATES)
        .map(|_| [vector(3.0), vector(3.0), vector(10.0)])
        .collect();
    let bytes: Vec<u8> = states
        .iter()
        .flatten()
        .flat_map(|v| v.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
        .collect();
    let mut peer = Command::new("python3")
        .args(["-c", PEER])
        .arg(file)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    peer.stdin.take().unwrap().write_all(&bytes).unwrap();
    let output = peer.wait_with_output().unwrap();
    assert!(output.status.success());
    let theirs: Vec<f64> = output
        .stdout
        .chunks_exact(8)
        .map(|eight| f64::from_le_bytes(eight.try_into().unwrap()))
        .collect();
    assert_eq!(theirs.len(), STATES * N);
    let dynamics = model.dynamics::<N>().unwrap();
    let mut worst = 0.0_f64;
    for ([q, dq, ddq], theirs) in states.iter().zip(theirs.chunks(N)) {
        let theirs = SVector::<f64, N>::from_column_slice(theirs);
        let gap = (dynamics.effort(q, dq, ddq) - theirs).amax();
        worst = worst.max(gap / theirs.amax());
    }
    worst
}
