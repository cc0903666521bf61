//! Smooth motions for an arm, whose joints are affine functions of the tool's position and rotation vector here, so that what is
//! asked of them can be checked by sampling alone.
//!
//! `ARM_LISTS=2000 cargo test -p trajectory --release --test arm` is the long run.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};
use trajectory::smooth::{
    ArmMotion, ArmPlan, ArmState, JointBounds, JointState, Seed, SmoothOptions, SmoothPlan, plan,
    plan_for_arm,
};
use trajectory::{ToolCurve, ToolLimits};

const LIMITS: ToolLimits = ToolLimits {
    speed: 1.0,
    acceleration: 8.0,
    jerk: 120.0,
    angular_speed: 3.0,
    angular_acceleration: 20.0,
    angular_jerk: 300.0,
};

/// How far a joint may be from the known motion.
const FAR: f64 = 1.0;

/// Joints of the arm.
const JOINTS: usize = 4;

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

/// An arm, a list for it, and a motion that is known: that of the tool alone, slowed down until the joints can follow.
struct Case {
    poses: Vec<Isometry3<f64>>,
    options: SmoothOptions,
    tool: SmoothPlan,
    slower: f64,
    changes: [[f64; 7]; JOINTS],
    bounds: [JointBounds; JOINTS],
    has_spare: bool,
}

impl Case {
    fn new(state: &mut u64, turning: bool, has_spare: bool) -> Self {
        let mut pose = Isometry3::identity();
        let count = 3 + (2.0 * (1.0 + random(state))) as usize;
        let mut poses = vec![pose];
        for _ in 0..count {
            let mut vector = || Vector3::from_fn(|_, _| random(state));
            pose.translation.vector += vector() * 0.15;
            if turning {
                pose.rotation *= UnitQuaternion::from_scaled_axis(vector() * 0.4);
            }
            poses.push(pose);
        }
        let options = SmoothOptions::new(0.01, LIMITS);
        let tool = plan(&poses, &options).unwrap();
        let mut change = |_| {
            std::array::from_fn(|d| match d {
                0..3 => 2.0 * random(state),
                3..6 => 0.5 * random(state),
                _ => 0.5 + 0.5 * random(state),
            })
        };
        let changes = std::array::from_fn(&mut change);
        let bounds = [JointBounds {
            position: [-4.0, 4.0],
            rates: [1.0, 6.0, 80.0],
        }; JOINTS];
        let mut case = Self {
            poses,
            options,
            tool,
            slower: 1.0,
            changes,
            bounds,
            has_spare,
        };
        case.slower = case.slowdown();
        case
    }

    /// The arm at a time of the motion that is known.
    fn state(&self, time: f64) -> ArmState {
        let pose = self.tool.at(time / self.slower).pose;
        let vector = pose.rotation.scaled_axis();
        let turned = vector_with_turns(&pose.rotation);
        let joint = |j: usize| {
            let with = &self.changes[j];
            let about = |d: usize| dot(&with[3..6], turned.column(d).as_slice());
            JointState {
                position: dot(&with[..3], pose.translation.vector.as_slice())
                    + dot(&with[3..6], vector.as_slice()),
                changes: [
                    with[0],
                    with[1],
                    with[2],
                    about(0),
                    about(1),
                    about(2),
                    with[6],
                ],
            }
        };
        ArmState {
            pose,
            joints: (0..JOINTS).map(joint).collect(),
            spare: 0.0,
        }
    }

    /// What a search finds that begins at a motion: its plan, by how much it is slowed down, and the arm along it. `change` says
    /// what else is asked.
    fn searched_from(
        &self,
        (plan, slower): (&SmoothPlan, f64),
        (at, onward): (&dyn Fn(f64) -> Option<ArmState>, Option<&Seed>),
        change: impl Fn(ArmMotion<'_>) -> ArmMotion<'_>,
    ) -> Option<ArmPlan> {
        let passes = plan.crossings().iter();
        let passes: Vec<f64> = passes.map(|pass| slower * pass.time).collect();
        let arm = ArmMotion {
            duration: slower * plan.duration(),
            at,
            passes: &passes,
            bounds: &self.bounds,
            far: FAR,
            has_spare: self.has_spare,
            rough: false,
            onward,
        };
        plan_for_arm(&self.poses, &self.options, &change(arm)).unwrap()
    }

    /// The same at the known motion.
    fn searched(&self, change: impl Fn(ArmMotion<'_>) -> ArmMotion<'_>) -> Option<ArmPlan> {
        let at = |time: f64| Some(self.state(time));
        self.searched_from((&self.tool, self.slower), (&at, None), change)
    }

    fn found(&self) -> Option<ArmPlan> {
        self.searched(|arm| arm)
    }

    /// Positions of the joints of an arm that does not turn.
    fn positions(&self, place: &Vector3<f64>, spare: f64) -> [f64; JOINTS] {
        std::array::from_fn(|j| {
            dot(&self.changes[j][..3], place.as_slice()) + self.changes[j][6] * spare
        })
    }

    /// What a search finds that goes on from a plan for an arm that does not turn.
    fn found_onward(&self, from: &ArmPlan) -> Option<ArmPlan> {
        let at = |time: f64| {
            let pose = from.plan.at(time).pose;
            let spare = from.spare.as_ref().map_or(0.0, |spare| spare.at(time)[0]);
            let positions = self.positions(&pose.translation.vector, spare);
            let joint = |j: usize| JointState {
                position: positions[j],
                changes: self.changes[j],
            };
            Some(ArmState {
                pose,
                joints: (0..JOINTS).map(joint).collect(),
                spare,
            })
        };
        self.searched_from((&from.plan, 1.0), (&at, Some(&from.seed)), |arm| arm)
    }

    /// Speed, acceleration and jerk of a joint along a plan at a time.
    fn rates(&self, plan: &SmoothPlan, spare: [f64; 4], (j, time): (usize, f64)) -> [f64; 3] {
        let point = plan.at(time);
        let angular = vector_rates(plan, time);
        std::array::from_fn(|k| {
            dot(&self.changes[j][..3], point.linear[k].as_slice())
                + dot(&self.changes[j][3..6], angular[k].as_slice())
                + self.changes[j][6] * spare[k + 1]
        })
    }

    /// The factor on the time with which the joints follow the tool's motion.
    fn slowdown(&self) -> f64 {
        let mut worst = 1.0_f64;
        for (j, time) in samples(self.tool.duration()) {
            let rates = self.rates(&self.tool, [0.0; 4], (j, time));
            for k in 0..3 {
                let ratio = rates[k].abs() / self.bounds[j].rates[k];
                worst = worst.max(ratio.powf(1.0 / (k + 1) as f64));
            }
        }
        1.01 * worst
    }

    /// The greatest ratio of a rate of a joint to its bound along a plan that was found.
    fn worst(&self, found: &ArmPlan) -> f64 {
        let mut worst = 0.0_f64;
        for (j, time) in samples(found.plan.duration()) {
            let spare = found
                .spare
                .as_ref()
                .map_or([0.0; 4], |spare| spare.at(time));
            let rates = self.rates(&found.plan, spare, (j, time));
            for k in 0..3 {
                worst = worst.max(rates[k].abs() / self.bounds[j].rates[k]);
            }
        }
        worst
    }
}

/// By how much the rotation vector of an orientation changes, to first order, with turns about x, y and z of the tool.
fn vector_with_turns(rotation: &UnitQuaternion<f64>) -> Matrix3<f64> {
    let step = 1e-5;
    let turned = |axis: Vector3<f64>| {
        let by =
            |angle: f64| (rotation * UnitQuaternion::from_scaled_axis(axis * angle)).scaled_axis();
        (by(step) - by(-step)) / (2.0 * step)
    };
    Matrix3::from_columns(&[Vector3::x(), Vector3::y(), Vector3::z()].map(turned))
}

/// The first three derivatives of the rotation vector along a plan, at the time nearest to one at which differences are inside of it.
fn vector_rates(plan: &SmoothPlan, time: f64) -> [Vector3<f64>; 3] {
    let step = 5e-4;
    let time = time.clamp(2.0 * step, plan.duration() - 2.0 * step);
    let at = |k: f64| plan.at(time + k * step).pose.rotation.scaled_axis();
    let [a, b, c, d, e] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(at);
    [
        (d - b) / (2.0 * step),
        (d - c * 2.0 + b) / step.powi(2),
        (e - d * 2.0 + b * 2.0 - a) / (2.0 * step.powi(3)),
    ]
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Each joint at many times of a motion.
fn samples(duration: f64) -> impl Iterator<Item = (usize, f64)> {
    (0..=2000).flat_map(move |i| (0..JOINTS).map(move |j| (j, duration * f64::from(i) / 2000.0)))
}

/// Motions that are found keep the tool's certificate and the bounds of the joints, and are faster than those that are known. Where
/// the tool turns the joints are affine to first order only.
#[test]
fn joints_keep_their_bounds_and_the_motion_is_faster() {
    let lists = std::env::var("ARM_LISTS").map_or(6, |count| count.parse().unwrap());
    let mut state = 7;
    for (turning, has_spare) in [(false, false), (false, true), (true, false), (true, true)] {
        let (mut found, mut ratio) = (0, 0.0);
        for list in 0..lists {
            let case = Case::new(&mut state, turning, has_spare);
            let Some(plan) = case.found() else {
                continue;
            };
            assert!(plan.plan.certificate().holds());
            let crossings = plan.plan.crossings();
            assert_eq!(crossings.len() + 2, case.poses.len());
            assert!(crossings.iter().all(|pass| pass.deviation <= 0.01));
            assert_eq!(plan.spare.is_some(), has_spare);
            let worst = case.worst(&plan);
            let most = if turning { 1.15 } else { 1.0 + 1e-6 };
            assert!(worst <= most, "{turning} {has_spare} {list}: {worst}");
            found += 1;
            ratio += (plan.plan.duration() / (case.slower * case.tool.duration())).ln();
        }
        let mean = (ratio / f64::from(found)).exp();
        println!("turning {turning}, spare {has_spare}: {found} of {lists}, {mean:.3} of the time");
        assert!(10 * found >= 9 * lists, "{found} of {lists}");
        assert!(mean < 0.85, "{mean}");
    }
}

/// A spare joint that helps saves time, and ends where it likes, at rest.
#[test]
fn a_spare_joint_saves_time() {
    let mut state = 11;
    let (mut log, mut count) = (0.0, 0);
    for _ in 0..6 {
        let mut case = Case::new(&mut state, false, true);
        let Some(with) = case.found() else { continue };
        case.has_spare = false;
        let Some(without) = case.found() else {
            continue;
        };
        let spare = with.spare.unwrap();
        let (begin, end) = (spare.at(0.0), spare.at(with.plan.duration()));
        assert!(begin.iter().all(|x| x.abs() < 1e-9));
        assert!(end[1..].iter().all(|x| x.abs() < 1e-6), "{end:?}");
        // At the end the tool is where it was, so a joint moves with the spare coordinate alone.
        let moved = case.changes.iter().map(|change| change[6] * end[0]);
        assert!(moved.into_iter().all(|by| by.abs() <= FAR), "{end:?}");
        log += (with.plan.duration() / without.plan.duration()).ln();
        count += 1;
    }
    let mean = (log / f64::from(count)).exp();
    assert!(mean < 0.95, "{mean}");
}

/// A rough search and one that goes on from it end where one search does.
#[test]
fn a_search_goes_on() {
    let mut state = 13;
    let mut count = 0;
    for has_spare in [false, true, false, true, false, true] {
        let case = Case::new(&mut state, false, has_spare);
        let rough = case.searched(|arm| ArmMotion { rough: true, ..arm });
        let onward = rough.as_ref().and_then(|rough| case.found_onward(rough));
        let (Some(onward), Some(once)) = (onward, case.found()) else {
            continue;
        };
        assert!(onward.plan.certificate().holds());
        assert!(case.worst(&onward) <= 1.0 + 1e-6);
        let ratio = onward.plan.duration() / once.plan.duration();
        assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
        count += 1;
    }
    assert!(count >= 5, "{count}");
}

/// No joint goes farther from the known motion than it may.
#[test]
fn joints_stay_near_the_known_motion() {
    let mut state = 17;
    let (mut count, mut farthest) = (0, 0.0_f64);
    for has_spare in [false, true, false, true] {
        let case = Case::new(&mut state, false, has_spare);
        let far = 0.02;
        let Some(found) = case.searched(|arm| ArmMotion { far, ..arm }) else {
            continue;
        };
        // The search begins one knot and a half before the known motion, and ends so much after it.
        let knots = found.plan.spans() as f64;
        let duration = case.slower * case.tool.duration();
        for i in 0..=1000 {
            let share = f64::from(i) / 1000.0;
            let time = duration * (knots * share - 1.5) / (knots - 3.0);
            let known = case.state(time.clamp(0.0, duration));
            let at = share * found.plan.duration();
            let spare = found.spare.as_ref().map_or(0.0, |spare| spare.at(at)[0]);
            let place = found.plan.at(at).pose.translation.vector;
            let positions = case.positions(&place, spare);
            for (position, known) in positions.iter().zip(&known.joints) {
                farthest = farthest.max((position - known.position).abs() / far);
            }
        }
        count += 1;
    }
    assert!(count >= 3, "{count}");
    assert!((0.5..1.02).contains(&farthest), "{farthest}");
}

/// What cannot be used is refused: a number of the list in words, a motion of the arm with `None`.
#[test]
fn what_cannot_be_used_is_refused() {
    let mut state = 3;
    let case = Case::new(&mut state, true, true);
    let at = |time: f64| Some(case.state(time));
    let passes: Vec<f64> = case.tool.crossings().iter().map(|pass| pass.time).collect();
    let arm = ArmMotion {
        duration: case.tool.duration(),
        at: &at,
        passes: &passes,
        bounds: &case.bounds,
        far: FAR,
        has_spare: true,
        rough: false,
        onward: None,
    };
    let found = |arm: &ArmMotion<'_>| plan_for_arm(&case.poses, &case.options, arm).unwrap();
    let singular = |_: f64| None;
    let without_a_joint = |time: f64| {
        let mut state = case.state(time);
        state.joints.pop();
        Some(state)
    };
    let infinite = [JointBounds {
        rates: [1.0, 6.0, f64::INFINITY],
        ..case.bounds[0]
    }];
    for other in [
        ArmMotion { passes: &[], ..arm },
        ArmMotion { bounds: &[], ..arm },
        ArmMotion {
            bounds: &infinite,
            ..arm
        },
        ArmMotion {
            duration: f64::NAN,
            ..arm
        },
        ArmMotion { far: 0.0, ..arm },
        ArmMotion {
            at: &singular,
            ..arm
        },
        ArmMotion {
            at: &without_a_joint,
            ..arm
        },
    ] {
        assert_eq!(found(&other), None);
    }
    let mut poses = case.poses.clone();
    poses[1].translation.x = f64::NAN;
    assert!(plan_for_arm(&poses, &case.options, &arm).is_err());
    // Without a tolerance there is nothing to search.
    let exact = SmoothOptions::new(0.0, LIMITS);
    assert_eq!(plan_for_arm(&case.poses, &exact, &arm), Ok(None));
}
