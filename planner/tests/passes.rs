//! The reported passes of smooth moves, compared with the motion itself.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use nalgebra::{Isometry3, SVector, Translation3, UnitQuaternion, Vector3};
use planner::motion::Planner;
use planner::robot::{Robot, load, vector};
use planner::task::{Move, Shape};
use trajectory::smooth::{RestCause, angular_tolerance};

/// Numbers from -1 to 1, the same each time.
///
/// # Source
/// G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
fn random(state: &mut u64) -> f64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    2.0 * (*state >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
}

/// A pose at most `far` (m) and `turned` (rad) from another, in each axis.
fn near(pose: &Isometry3<f64>, far: f64, turned: f64, state: &mut u64) -> Isometry3<f64> {
    let mut vector = || Vector3::from_fn(|_, _| random(state));
    let place = pose.translation.vector + vector() * far;
    let turn = UnitQuaternion::from_scaled_axis(vector() * turned);
    Isometry3::from_parts(Translation3::from(place), pose.rotation * turn)
}

/// The planner of a robot, and its home.
fn planner_at_home<const N: usize>(robot: &Robot) -> (Planner<N>, SVector<f64, N>) {
    let planner = robot.planner::<N>().unwrap();
    (planner, vector(&robot.home))
}

/// Poses in clusters that are smaller than the balls, with turns on the spot: the times of the
/// passes never go back, and at each of them the tool is in the ball and turned as the rule says.
#[test]
fn passes_are_in_order_and_true() {
    let robot = load("ur5e").unwrap();
    let (planner, home) = planner_at_home::<6>(&robot);
    let (mut state, mut planned) = (7, 0);
    for round in 0..24 {
        let tolerance = [0.0, 1e-4, 1e-3, 5e-3][round % 4];
        let mut poses = vec![planner.chain().forward(&home)];
        for _ in 0..3 {
            let first = near(&poses[poses.len() - 1], 0.06, 0.1, &mut state);
            poses.push(first);
            for _ in 0..3 {
                let turned = if round % 3 == 0 { 0.05 } else { 0.0 };
                let close = near(&poses[poses.len() - 1], 0.4 * tolerance, turned, &mut state);
                poses.push(close);
            }
        }
        let motion = Move {
            shape: Shape::Smooth,
            poses: poses.split_off(1),
            tolerance,
            limits: robot.motion_limits(),
        };
        let Ok(found) = planner.plan(&motion, &home) else {
            continue;
        };
        planned += 1;
        let mut last = 0.0;
        assert_eq!(found.certificate.poses.len(), motion.poses.len() - 1);
        for (pass, pose) in found.certificate.poses.iter().zip(&motion.poses) {
            assert!(
                pass.time_s >= last,
                "round {round}: {pass:?} after {last} s"
            );
            last = pass.time_s;
            let joints = found.trajectory.sample(pass.time_s).position;
            let gap = pose.inv_mul(&planner.chain().forward(&joints));
            let (far, angle) = (gap.translation.vector.norm(), gap.rotation.angle());
            assert!(
                (far - pass.deviation_m).abs() < 1e-12,
                "round {round}: {pass:?}"
            );
            assert!(far <= tolerance.max(2e-7), "round {round}: {pass:?}");
            assert_eq!(pass.angular_tolerance_rad, angular_tolerance(tolerance));
            let allowed = angular_tolerance(tolerance).max(1e-6);
            assert!(
                angle <= allowed && pass.angle_rad <= allowed,
                "round {round}: {pass:?}"
            );
        }
    }
    assert!(planned >= 20, "{planned} of 24 planned");
}

/// Time of straight moves to each pose in turn, s; `None` if one of them cannot be made.
fn straight_time<const N: usize>(
    planner: &Planner<N>,
    motion: &Move,
    home: &SVector<f64, N>,
) -> Option<f64> {
    let (mut joints, mut time) = (*home, 0.0);
    for pose in &motion.poses {
        let straight = Move {
            shape: Shape::Straight,
            poses: vec![*pose],
            ..motion.clone()
        };
        let leg = planner.plan(&straight, &joints).ok()?;
        time += leg.trajectory.duration();
        joints = leg.end;
    }
    Some(time)
}

/// The bounds of a whole motion may be above those of its parts by this share, and slow it down.
const ROOM: f64 = 1e-3;

/// Counts the random lists of an arm, of so many, of which both motions can be planned; the smooth one
/// is never the slower one.
fn compared<const N: usize>(name: &str, lists: usize, seed: u64) -> usize {
    let robot = load(name).unwrap();
    let (planner, home) = planner_at_home::<N>(&robot);
    let (mut state, mut both) = (seed, 0);
    for round in 0..lists {
        let tolerance = [0.0, 5e-5, 1e-3, 5e-3, 2e-2, 0.0][round % 6];
        let first = planner.chain().forward(&home);
        let poses = (0..3 + round % 4).map(|_| near(&first, 0.12, 0.3, &mut state));
        let motion = Move {
            shape: Shape::Smooth,
            poses: poses.collect(),
            tolerance,
            limits: robot.motion_limits(),
        };
        let smooth = planner.plan(&motion, &home);
        let (Ok(smooth), Some(straight)) = (smooth, straight_time(&planner, &motion, &home)) else {
            continue;
        };
        both += 1;
        let time = smooth.trajectory.duration();
        assert!(
            time <= straight * (1.0 + ROOM),
            "{name} {round}, tolerance {tolerance} m: {time} s, straight moves {straight} s"
        );
    }
    both
}

/// Each tolerance once on each of two arms; `CANTER_SMOOTH_LISTS=18` is the long run.
#[test]
fn smooth_moves_are_never_slower_than_straight_ones() {
    let lists = std::env::var("CANTER_SMOOTH_LISTS");
    let lists = lists.map_or(6, |count| count.parse().unwrap());
    let both = compared::<6>("ur5e", lists, 11) + compared::<7>("panda", lists, 12);
    assert!(3 * both >= 4 * lists, "{both} of {} planned", 2 * lists);
}

/// Where a move rests on its way the certificate names the pose and the cause; a pose that is passed in motion
/// has none.
#[test]
fn rests_are_named_in_the_certificate() {
    let robot = load("ur5e").unwrap();
    let (planner, home) = planner_at_home::<6>(&robot);
    let start = planner.chain().forward(&home);
    let at = |x: f64, y: f64| Isometry3::translation(x, y, 0.0) * start;
    let rests = |tolerance: f64, poses: Vec<_>| -> Vec<Option<RestCause>> {
        let motion = Move {
            shape: Shape::Smooth,
            poses,
            tolerance,
            limits: robot.motion_limits(),
        };
        let found = planner.plan(&motion, &home).unwrap();
        let passes = found.certificate.poses.iter();
        passes.map(|pass| pass.rests).collect()
    };
    let corner = || vec![at(0.05, 0.0), at(0.05, 0.05)];
    assert_eq!(rests(0.0, corner()), [Some(RestCause::Stop)]);
    assert_eq!(rests(1e-3, corner()), [None]);
}
