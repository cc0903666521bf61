//! How far the tool turns at least on any way of the joints.

use kinematics::Chain;
use nalgebra::SVector;

/// Most that the tool may turn between two looks at its orientation, rad: less than half a turn, so
/// that the nearer of both quaternions is the next one.
const STEP: f64 = 1.0;
/// Most looks.
const LOOKS: f64 = 1e4;

/// The angle (rad, 0 to a whole turn) that the orientation of the tool travels at least when the
/// joints go from `start` to `end`, whatever their way within their ranges.
///
/// The rotation between both orientations is half a turn at most, but the joints may have to go the
/// long way round. The ranges of the joints are a box, so every way between two joint positions can
/// be deformed into the straight one. Along it the unit quaternion of the tool changes continuously,
/// and its end is that of all ways: the distance of both quaternions on the sphere is the angle.
///
/// # Source
/// Unit quaternions are the double cover of the rotations: S. L. Altmann, Rotations, Quaternions, and
/// Double Groups, 1986, chapter 10.
pub(super) fn least_turn<const N: usize>(
    chain: &Chain<N>,
    start: &SVector<f64, N>,
    end: &SVector<f64, N>,
) -> f64 {
    let way = end - start;
    let steps = (way.abs().sum() / STEP).ceil().clamp(1.0, LOOKS) as u32;
    let at = |share: f64| chain.forward(&(start + way * share)).rotation.into_inner();
    let first = at(0.0);
    let mut last = first;
    for step in 1..=steps {
        let next = at(f64::from(step) / f64::from(steps));
        last = if next.dot(&last) < 0.0 { -next } else { next };
    }
    4.0 * (last - first).norm().atan2((last + first).norm())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn joints(values: [f64; 6]) -> SVector<f64, 6> {
        SVector::from(values)
    }

    fn ur5e() -> Chain<6> {
        crate::robot::load("ur5e").unwrap().chain::<6>().unwrap()
    }

    /// The last joint alone turns the tool by its own angle, more than half a turn too.
    #[test]
    fn one_joint_turns_by_its_angle() {
        let (chain, start) = (ur5e(), joints([0.1, -1.2, 1.3, 0.4, 1.5, -2.0]));
        for angle in [0.0, 0.3, 3.0, 4.5, 6.0] {
            let mut end = start;
            end[5] += angle;
            let turn = least_turn(&chain, &start, &end);
            assert!((turn - angle).abs() < 1e-12, "{turn} for {angle}");
        }
    }

    proptest! {
        /// On ways through two other joint positions the tool turns no less.
        #[test]
        fn no_way_turns_less(
            ways in prop::array::uniform4(prop::array::uniform6(-3.0..3.0_f64)),
        ) {
            let chain = ur5e();
            let [start, one, two, end] = ways.map(joints);
            let mut turned = 0.0;
            for pair in [start, one, two, end].windows(2) {
                let at = |step: u32| {
                    let share = f64::from(step) / 400.0;
                    chain.forward(&(pair[0] + (pair[1] - pair[0]) * share)).rotation
                };
                turned += (0..400).map(|step| at(step).angle_to(&at(step + 1))).sum::<f64>();
            }
            let least = least_turn(&chain, &start, &end);
            prop_assert!(turned >= least - 1e-6, "{} below {}", turned, least);
        }
    }
}
