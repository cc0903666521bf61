//! Forward kinematics and Jacobian: against `k`, finite differences and data sheets.

use crate::arms::{self, Random, SEVEN, SIX};
use kinematics::Chain;
use nalgebra::{Isometry3, SVector, UnitQuaternion, Vector3, Vector6, vector};

/// Difference of two poses: position (m) and rotation vector (rad), `a` minus `b`.
fn difference(a: &Isometry3<f64>, b: &Isometry3<f64>) -> Vector6<f64> {
    let dp = a.translation.vector - b.translation.vector;
    let dr = (a.rotation * b.rotation.inverse()).scaled_axis();
    vector![dp.x, dp.y, dp.z, dr.x, dr.y, dr.z]
}

/// Pose and Jacobian agree with `k`'s on every shipped arm.
fn agrees_with_k<const N: usize>(name: &str) {
    let text = arms::text(name);
    let oracle = k::Chain::<f64>::from(&urdf_rs::read_from_string(&text).unwrap());
    let arm = k::SerialChain::from_end(oracle.find("flange_fixed").unwrap());
    let chain: Chain<N> = arms::chain(name);
    let mut random = Random(7);
    for _ in 0..300 {
        let q = random.joints(&chain);
        arm.set_joint_positions_unchecked(q.as_slice());
        arm.update_transforms();
        let theirs = arm.end_transform();
        let (pose, jacobian) = chain.jacobian(&q);
        for i in 0..3 {
            let error = (pose.translation.vector[i] - theirs.translation.vector[i]).abs();
            assert!(error < 1e-12, "{name}: position off by {error} at {q}");
        }
        let r = theirs.rotation.quaternion();
        let theirs_rotation =
            UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(r.w, r.i, r.j, r.k));
        assert!(
            pose.rotation.angle_to(&theirs_rotation) < 1e-7,
            "{name}: rotation at {q}"
        );
        let difference = (pose.rotation.to_rotation_matrix().matrix()
            - theirs_rotation.to_rotation_matrix().matrix())
        .norm();
        assert!(difference < 1e-13, "{name}: rotation off by {difference}");
        let theirs = k::jacobian(&arm);
        for row in 0..6 {
            for column in 0..N {
                let error = (jacobian[(row, column)] - theirs[(row, column)]).abs();
                assert!(
                    error < 1e-12,
                    "{name}: Jacobian ({row}, {column}) off by {error}"
                );
            }
        }
    }
}

/// The ball of reach holds every position of the tool, and is not much larger than they are.
fn ball_holds<const N: usize>(name: &str) {
    let tool = Isometry3::translation(0.02, -0.03, 0.2);
    let base = Isometry3::translation(1.0, 2.0, -0.5);
    let chain: Chain<N> = arms::chain(name).with_tool(&tool).with_base(&base);
    let (middle, radius) = chain.reach_ball();
    let mut random = Random(11);
    let mut farthest = 0.0_f64;
    for _ in 0..2000 {
        let q = random.joints(&chain);
        let point = chain.forward(&q).translation.vector;
        farthest = farthest.max((point - middle.coords).norm());
    }
    assert!(farthest <= radius + 1e-12, "{name}: {farthest} > {radius}");
    assert!(radius < 2.5 * farthest, "{name}: {radius} for {farthest}");
}

#[test]
fn the_ball_of_reach_holds_every_pose() {
    SIX.iter().for_each(|name| ball_holds::<6>(name));
    SEVEN.iter().for_each(|name| ball_holds::<7>(name));
}

#[test]
fn every_arm_agrees_with_k() {
    SIX.iter().for_each(|name| agrees_with_k::<6>(name));
    SEVEN.iter().for_each(|name| agrees_with_k::<7>(name));
}

/// The Jacobian is the derivative of the pose, its derivative that of the Jacobian.
fn derivatives_agree_with_differences<const N: usize>(name: &str) {
    let tool = Isometry3::new(
        Vector3::new(0.03, -0.02, 0.15),
        Vector3::new(0.3, 0.2, -0.5),
    );
    let base = Isometry3::new(Vector3::new(-0.4, 0.1, 0.8), Vector3::new(0.0, 0.1, 1.5));
    let chain: Chain<N> = arms::chain::<N>(name).with_tool(&tool).with_base(&base);
    let mut random = Random(11);
    for _ in 0..50 {
        let q = random.joints(&chain);
        let dq: SVector<f64, N> = SVector::from_fn(|_, _| random.between(-1.0, 1.0));
        let h = 1e-5;
        let (plus, jp) = chain.jacobian(&(q + dq * h));
        let (minus, jm) = chain.jacobian(&(q - dq * h));
        let (_, jacobian) = chain.jacobian(&q);
        let twist = jacobian * dq;
        assert!(
            (difference(&plus, &minus) / (2.0 * h) - twist).norm() < 1e-8,
            "{name}"
        );
        let derivative = chain.jacobian_derivative(&q, &dq);
        assert!(((jp - jm) / (2.0 * h) - derivative).norm() < 1e-8, "{name}");
    }
}

#[test]
fn derivatives_agree_with_finite_differences() {
    SIX.iter()
        .for_each(|name| derivatives_agree_with_differences::<6>(name));
    SEVEN
        .iter()
        .for_each(|name| derivatives_agree_with_differences::<7>(name));
}

/// Position of the flange with all joints at zero, from drawings and data sheets.
#[test]
fn zero_poses_are_those_of_the_data_sheets() {
    let six: [(&str, [f64; 3]); 8] = [
        ("ur5e", [0.8172, 0.2329, 0.0628]),
        ("ur10e", [1.1843, 0.2907, 0.0609]),
        ("irb120", [0.3740, 0.0, 0.6300]),
        ("irb1200_5_90", [0.5330, 0.0, 0.8891]),
        ("irb1200_7_70", [0.4330, 0.0, 0.7911]),
        ("lrmate200id", [0.4650, 0.0, 0.6950]),
        ("tx2_60", [0.0, 0.0200, 1.0450]),
        ("xarm6", [0.2070, 0.0, 0.1120]),
    ];
    let seven: [(&str, [f64; 3]); 5] = [
        ("panda", [0.088, 0.0, 0.926]),
        ("fr3", [0.088, 0.0, 0.926]),
        ("iiwa7", [0.0, 0.0, 1.266]),
        ("iiwa14", [0.0, 0.0, 1.306]),
        ("xarm7", [0.206, 0.0, 0.1205]),
    ];
    let close = |name: &str, found: Vector3<f64>, expected: [f64; 3]| {
        assert!(
            (found - Vector3::from(expected)).amax() < 6e-5,
            "{name}: {found}"
        );
    };
    for (name, expected) in six {
        close(
            name,
            arms::chain::<6>(name)
                .forward(&SVector::zeros())
                .translation
                .vector,
            expected,
        );
    }
    for (name, expected) in seven {
        close(
            name,
            arms::chain::<7>(name)
                .forward(&SVector::zeros())
                .translation
                .vector,
            expected,
        );
    }
}

/// The build without wide instructions gives the same pose within 1e-14 of the reach.
#[test]
fn plain_build_agrees() {
    for name in SIX {
        let wide = arms::chain::<6>(name);
        let plain = wide.plain();
        let mut random = Random(3);
        for _ in 0..1000 {
            let q = random.joints(&wide);
            let (a, ja) = wide.jacobian(&q);
            let (b, jb) = plain.jacobian(&q);
            assert!(difference(&a, &b).norm() < 2e-14 * 3.0, "{name}");
            assert!((ja - jb).norm() < 1e-13, "{name}");
        }
    }
}
