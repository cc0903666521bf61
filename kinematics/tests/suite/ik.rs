//! Inverse kinematics: each solution reaches the pose, and a missing solution is explained.

use crate::arms::{self, Random, SEVEN, SIX};
use kinematics::{Goal, IkFailure, Solver};
use nalgebra::{Isometry3, SVector, Vector3};

/// Distance (m) and angle (rad) between two poses.
pub(crate) fn error(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    let matrix =
        a.rotation.to_rotation_matrix().matrix() - b.rotation.to_rotation_matrix().matrix();
    // For small angles the Frobenius norm is sqrt(2) times the angle.
    (
        (a.translation.vector - b.translation.vector).norm(),
        matrix.norm() / 2.0_f64.sqrt(),
    )
}

/// Every branch reproduces its pose, and the position that the pose came from is among them.
/// What was lost, as a line.
fn all_branches<const N: usize>(name: &str, family: &str, count: u32) -> String {
    let solver = Solver::new(arms::chain::<N>(name));
    assert_eq!(
        (solver.family(), solver.is_exact()),
        (family, true),
        "{name}"
    );
    let mut random = Random(17);
    let (mut lost, mut branches) = (Vec::new(), 0);
    for i in 0..count {
        let q = random.joints(solver.chain());
        let pose = solver.chain().forward(&q);
        let found = solver.solve_all_at(&pose, solver.parameter(&q), &q);
        for solution in &found {
            branches += 1;
            let (position, rotation) = solver.error(&pose, &solution.q);
            assert!(
                position < 1e-9 && rotation < 1e-9,
                "{name} {i}: {position} m, {rotation} rad"
            );
            assert!(solver.chain().within_limits(&solution.q, 0.0), "{name} {i}");
        }
        if !found.iter().any(|solution| (solution.q - q).amax() < 1e-6) {
            lost.push(format!("{i}: {:?}", q.as_slice()));
        }
    }
    assert!(
        lost.len() as f64 <= 1e-4 * f64::from(count),
        "{name}: of {count} lost {lost:?}"
    );
    assert!(branches > count, "{name}: only {branches} branches");
    format!(
        "{name}: {count} poses, {branches} branches, lost {}: {lost:?}",
        lost.len()
    )
}

const CLOSED_SIX: [(&str, &str); 7] = [
    ("ur5e", "three parallel axes"),
    ("ur10e", "three parallel axes"),
    ("irb120", "spherical wrist"),
    ("irb1200_5_90", "spherical wrist"),
    ("irb1200_7_70", "spherical wrist"),
    ("lrmate200id", "spherical wrist"),
    ("tx2_60", "spherical wrist"),
];
const CLOSED_SEVEN: [(&str, &str); 5] = [
    ("panda", "seven joints, last given"),
    ("fr3", "seven joints, last given"),
    ("xarm7", "seven joints, last given"),
    ("iiwa7", "spherical shoulder and wrist, swivel given"),
    ("iiwa14", "spherical shoulder and wrist, swivel given"),
];

#[test]
fn closed_forms_find_every_branch() {
    for (name, family) in CLOSED_SIX {
        println!("{}", all_branches::<6>(name, family, arms::cases(2000)));
    }
    for (name, family) in CLOSED_SEVEN {
        println!("{}", all_branches::<7>(name, family, arms::cases(2000)));
    }
}

fn cold<const N: usize>(name: &str, count: u32) {
    let solver = Solver::new(arms::chain::<N>(name));
    let mut random = Random(5);
    for i in 0..count {
        let q = random.joints(solver.chain());
        let pose = solver.chain().forward(&q);
        let solution = solver
            .solve(&pose)
            .unwrap_or_else(|report| panic!("{name} {i}: {report}\n{q}"));
        let (position, rotation) = error(&solver.chain().forward(&solution.q), &pose);
        assert!(
            position < 2e-9 && rotation < 2e-9,
            "{name} {i}: {position} m, {rotation} rad"
        );
        assert!(solver.chain().within_limits(&solution.q, 0.0), "{name} {i}");
    }
}

#[test]
fn every_reachable_pose_is_reached() {
    SIX.iter()
        .for_each(|name| cold::<6>(name, arms::cases(1000)));
    SEVEN
        .iter()
        .for_each(|name| cold::<7>(name, arms::cases(1000)));
}

/// Poses at corners of the limits, where few restarts come through; each was refused once.
#[test]
fn poses_in_corners_are_reached() {
    corner::<6>("xarm6", 7206);
    corner::<7>("panda", 461);
    corner::<7>("panda", 4412);
    corner::<7>("panda", 9558);
    corner::<7>("fr3", 626);
    corner::<7>("iiwa7", 2912);
}

/// One pose of a random sequence, from the seed that goes with it, with and without the
/// closed form.
fn corner<const N: usize>(name: &str, index: usize) {
    let chain = arms::chain::<N>(name);
    let mut random = Random(5);
    let mut draw = || {
        SVector::from_fn(|i, _| {
            let (low, high) = (chain.lower()[i].max(-6.3), chain.upper()[i].min(6.3));
            random.between(low, high)
        })
    };
    let joints: Vec<SVector<f64, N>> = (0..20_000).map(|_| draw()).collect();
    let (pose, seed) = (chain.forward(&joints[index]), joints[10_000 + index]);
    for solver in [Solver::numeric(chain), Solver::new(chain)] {
        let solution = solver.nearest(&pose, &seed);
        let solution = solution.unwrap_or_else(|report| panic!("{name} {index}: {report}"));
        let (position, rotation) = solver.error(&pose, &solution.q);
        assert!(position < 2e-9 && rotation < 2e-9, "{name} {index}");
        assert!(chain.within_limits(&solution.q, 0.0), "{name} {index}");
    }
}

#[test]
fn out_of_reach_says_by_how_much() {
    let solver = Solver::new(arms::chain::<6>("irb120"));
    // The shoulder is at 0.29 m; straight out the arm reaches 0.27 + hypot(0.302, 0.07) + 0.072 m.
    let far = Isometry3::new(
        Vector3::new(1.0, 0.0, 0.29),
        Vector3::y() * std::f64::consts::FRAC_PI_2,
    );
    let report = solver.solve(&far).unwrap_err();
    let IkFailure::OutOfReach { distance } = report.failure else {
        panic!("{report}")
    };
    let reach = 0.27 + 0.302_f64.hypot(0.07) + 0.072;
    assert!(
        (distance - (1.0 - reach)).abs() < 2e-3,
        "{distance} against {}",
        1.0 - reach
    );
    assert!(
        report.to_string().starts_with("out of reach by "),
        "{report}"
    );
    let nan = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert_eq!(
        solver.solve(&nan).unwrap_err().failure,
        IkFailure::NotFinite
    );
}

/// Position alone and position with an axis are reached as well.
#[test]
fn partial_goals_are_reached() {
    for name in SIX {
        let solver = Solver::new(arms::chain::<6>(name));
        let mut random = Random(9);
        for _ in 0..100 {
            let pose = solver.chain().forward(&random.joints(solver.chain()));
            let seed = random.joints(solver.chain());
            let point = pose.translation.vector.into();
            let reached = solver.reach(&Goal::Position(point), &seed).unwrap();
            assert!(
                (solver.chain().forward(&reached.q).translation.vector - point.coords).norm()
                    < 1e-8
            );
            let axis = nalgebra::Unit::new_normalize(pose.rotation * Vector3::z());
            let reached = solver.reach(&Goal::Axis(point, axis), &seed).unwrap();
            let found = solver.chain().forward(&reached.q);
            assert!(
                (found.rotation * Vector3::z() - *axis).norm() < 1e-8,
                "{name}"
            );
        }
    }
}

/// Every branch, and the nearest, with every bit.
fn bits<const N: usize>(name: &str) -> Vec<u64> {
    let solver = Solver::new(arms::chain::<N>(name));
    let mut random = Random(13);
    let mut bits = Vec::new();
    for _ in 0..200 {
        let pose = solver.chain().forward(&random.joints(solver.chain()));
        let nearest = solver.nearest(&pose, &random.joints(solver.chain()));
        let all = solver.solve_all(&pose);
        for solution in all.iter().chain(nearest.iter()) {
            bits.extend(solution.q.iter().map(|x| x.to_bits()));
        }
    }
    bits
}

/// Two solvers give the same bits.
#[test]
fn answers_are_the_same_to_the_bit() {
    for name in SIX {
        assert_eq!(bits::<6>(name), bits::<6>(name), "{name}");
    }
    for name in SEVEN {
        assert_eq!(bits::<7>(name), bits::<7>(name), "{name}");
    }
}

/// The example of the README, as it stands there.
#[test]
fn readme_example_runs() {
    let model = kinematics::urdf::read(&arms::text("ur5e"), None).unwrap();
    let solver = kinematics::Solver::new(model.chain::<6>().unwrap());
    let pose = solver
        .chain()
        .forward(&nalgebra::vector![0.1, -1.2, 1.4, -1.8, -1.5, 0.3]);
    let all = solver.solve_all(&pose);
    let near = solver.nearest(&pose, &all[0].q).unwrap();
    assert_eq!(near.q, all[0].q);
}
