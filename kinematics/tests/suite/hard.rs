//! Difficult cases for solvers: singular poses, axis-aligned poses, calibrated arms.

use crate::arms::{self, Random, SIX};
use kinematics::{Chain, Solver, urdf};
use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::FRAC_PI_2;

/// `solve` and `nearest` both answer a pose that some joint position reaches.
fn answered<const N: usize>(name: &str, solver: &Solver<N>, q: &SVector<f64, N>) {
    let pose = solver.chain().forward(q);
    for solution in [solver.solve(&pose), solver.nearest(&pose, q)] {
        let solution = solution.unwrap_or_else(|report| panic!("{name}: {report} at {q}"));
        let (position, rotation) = solver.error(&pose, &solution.q);
        assert!(
            position < 1e-8 && rotation < 1e-8,
            "{name}: {position} m, {rotation} rad at {q}"
        );
        assert!(solver.chain().within_limits(&solution.q, 0.0), "{name}");
    }
}

/// The angle inside the limits, and not on them, that is nearest to `angle`.
fn inside<const N: usize>(chain: &Chain<N>, joint: usize, angle: f64) -> f64 {
    angle.clamp(chain.lower()[joint] + 0.05, chain.upper()[joint] - 0.05)
}

#[test]
fn singular_poses_are_reached() {
    for name in SIX {
        let solver = Solver::new(arms::chain::<6>(name));
        let chain = *solver.chain();
        let mut random = Random(21);
        for _ in 0..arms::cases(200) {
            // The wrist straight.
            let mut q = random.joints(&chain);
            q[4] = inside(&chain, 4, 0.0);
            answered(name, &solver, &q);
            // Elbow and wrist straight, or as near as the limits let them.
            q[2] = inside(&chain, 2, 0.0);
            answered(name, &solver, &q);
            // Every joint at a multiple of a quarter turn.
            let quarter: SVector<f64, 6> = SVector::from_fn(|i, _| {
                inside(&chain, i, FRAC_PI_2 * random.between(-2.0, 2.0).round())
            });
            answered(name, &solver, &quarter);
        }
    }
    for name in arms::SEVEN {
        let solver = Solver::new(arms::chain::<7>(name));
        let chain = *solver.chain();
        let mut random = Random(22);
        for _ in 0..arms::cases(100) {
            let mut q = random.joints(&chain);
            q[5] = inside(&chain, 5, 0.0);
            answered(name, &solver, &q);
            q[1] = inside(&chain, 1, 0.0);
            answered(name, &solver, &q);
            let quarter: SVector<f64, 7> = SVector::from_fn(|i, _| {
                inside(&chain, i, FRAC_PI_2 * random.between(-2.0, 2.0).round())
            });
            answered(name, &solver, &quarter);
        }
    }
}

/// Flange along the axes of the base: solved, or refused with a report that numeric search confirms.
#[test]
fn axis_aligned_poses_are_reached_or_truly_refused() {
    for name in SIX {
        let solver = Solver::new(arms::chain::<6>(name));
        let blind = Solver::numeric(*solver.chain());
        let mut random = Random(23);
        let (mut reached, mut refused) = (0, 0);
        for _ in 0..arms::cases(60) {
            let turns = Vector3::from_fn(|_, _| FRAC_PI_2 * random.between(0.0, 4.0).floor());
            let place = solver
                .chain()
                .forward(&random.joints(solver.chain()))
                .translation
                .vector;
            let pose = Isometry3::from_parts(
                Translation3::from(place),
                UnitQuaternion::from_euler_angles(turns.x, turns.y, turns.z),
            );
            match solver.solve(&pose) {
                Ok(solution) => {
                    reached += 1;
                    let (position, rotation) = solver.error(&pose, &solution.q);
                    assert!(position < 1e-8 && rotation < 1e-8, "{name}");
                }
                Err(report) => {
                    refused += 1;
                    assert!(
                        blind.solve(&pose).is_err(),
                        "{name}: {report}, but it can be reached"
                    );
                }
            }
        }
        assert!(reached > 10, "{name}: {reached} reached, {refused} refused");
    }
}

/// The UR5e with errors of 0.5 mm and 0.05 degrees in every link.
fn calibrated(random: &mut Random) -> Chain<6> {
    let mut model = urdf::read(&arms::text("ur5e"), None).unwrap();
    for frame in &mut model.frames {
        let mut draw = |size: f64| Vector3::from_fn(|_, _| random.between(-size, size));
        let (shift, turn) = (draw(5e-4), draw(0.05_f64.to_radians()));
        *frame *= Isometry3::new(shift, turn);
    }
    model.chain().unwrap()
}

#[test]
fn calibrated_arms_keep_their_branches() {
    let mut random = Random(31);
    let (mut lost, mut poses, mut branches) = (0, 0, 0);
    for _ in 0..5 {
        let solver = Solver::new(calibrated(&mut random));
        assert_eq!(
            (solver.family(), solver.is_exact()),
            ("three parallel axes", false)
        );
        for _ in 0..arms::cases(400) {
            let q = random.joints(solver.chain());
            let pose = solver.chain().forward(&q);
            let found = solver.solve_all_at(&pose, 0.0, &q);
            for branch in &found {
                let (position, rotation) = solver.error(&pose, &branch.q);
                assert!(
                    position < 1e-9 && rotation < 1e-9,
                    "{position} m, {rotation} rad"
                );
            }
            poses += 1;
            branches += found.len();
            lost += u32::from(!found.iter().any(|branch| (branch.q - q).amax() < 1e-5));
        }
    }
    println!("{lost} of {poses} lost, {branches} branches");
    assert!(
        f64::from(lost) <= 1e-3 * f64::from(poses),
        "{lost} of {poses} lost"
    );
    assert!(
        branches > 3 * poses as usize,
        "{branches} branches of {poses} poses"
    );
}
