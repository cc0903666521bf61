//! Less speed near the ends of the range of a joint, from `robot.toml`.

use kinematics::Model;
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;

use super::JointLimits;
use super::error::RobotError;
use super::files::Files;

/// The share of the largest speed (1 is all of it) that is allowed at least at an end of the range
/// that is planned with: a motion to a place where no speed is allowed would not end.
const LEAST: f64 = 0.01;

/// Speed limits that fall towards the ends of the range: towards an end at the distance `x`, a joint
/// may have the speed `sqrt(2 deceleration x) - offset`. One value per joint, root first.
#[derive(Clone, Debug, PartialEq)]
pub struct EndSpeeds {
    /// Lower ends (rad or m), nearer by what the arm may be ahead of its command; they may lie beyond
    /// the range.
    pub lower: Vec<f64>,
    /// Upper ends (rad or m), likewise.
    pub upper: Vec<f64>,
    /// Decelerations, per s2.
    pub deceleration: Vec<f64>,
    /// Offsets of the speeds, per s.
    pub offset: Vec<f64>,
    /// Where they come from.
    pub source: String,
}

impl EndSpeeds {
    /// The same limits times `share`.
    #[must_use]
    pub(super) fn scaled(mut self, share: f64) -> Self {
        self.deceleration
            .iter_mut()
            .for_each(|x| *x *= share * share);
        self.offset.iter_mut().for_each(|x| *x *= share);
        self
    }

    /// The same limits for the planner.
    pub(super) fn vectors<const N: usize>(&self) -> trajectory::EndSpeeds<N> {
        trajectory::EndSpeeds {
            lower: super::vector(&self.lower),
            upper: super::vector(&self.upper),
            deceleration: super::vector(&self.deceleration),
            offset: super::vector(&self.offset),
        }
    }
}

impl JointLimits {
    /// The largest speed of a joint at `position` in the direction of `velocity`.
    pub(crate) fn speed(&self, joint: usize, position: f64, velocity: f64) -> f64 {
        let most = self.velocity[joint];
        let Some(ends) = &self.ends else {
            return most;
        };
        let one = |values: &[f64]| nalgebra::SVector::<f64, 1>::new(values[joint]);
        let ends = trajectory::EndSpeeds {
            lower: one(&ends.lower),
            upper: one(&ends.upper),
            deceleration: one(&ends.deceleration),
            offset: one(&ends.offset),
        };
        most.min(ends.speed(0, position, velocity > 0.0))
    }
}

/// `[joints.near_ends]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NearEnds {
    source: String,
    lower_rad_or_m: Spanned<Vec<f64>>,
    upper_rad_or_m: Spanned<Vec<f64>>,
    deceleration_per_s2: Spanned<Vec<f64>>,
    offset_per_s: Spanned<Vec<f64>>,
    ahead_rad_or_m: Option<Spanned<f64>>,
}

/// Where a list of numbers stands, and its key.
type Place = (Range<usize>, &'static str);

impl Files<'_> {
    /// The limits, if the robot has them. The ranges of `limits` and `model` become those in which a
    /// hundredth of the largest speed is allowed at least.
    pub(super) fn near_ends(
        &self,
        given: Option<&NearEnds>,
        model: &mut Model,
        limits: &mut JointLimits,
    ) -> Result<(), RobotError> {
        let Some(given) = given else {
            return Ok(());
        };
        let finite = |value: &f64| value.is_finite();
        let list = |key, values, good: &dyn Fn(&f64) -> bool, expected| {
            self.numbers((key, values), model.dof(), good, expected)
        };
        let numbers = "finite numbers";
        let ahead = self.ahead(given.ahead_rad_or_m.as_ref())?;
        let moved = |ends: Vec<f64>, by: f64| ends.into_iter().map(|end| end + by).collect();
        let ends = EndSpeeds {
            lower: moved(list(LOWER, &given.lower_rad_or_m, &finite, numbers)?, ahead),
            upper: moved(
                list(UPPER, &given.upper_rad_or_m, &finite, numbers)?,
                -ahead,
            ),
            deceleration: list(
                "joints.near_ends.deceleration_per_s2",
                &given.deceleration_per_s2,
                &|value| *value > 0.0 && value.is_finite(),
                "positive finite numbers",
            )?,
            offset: list(
                "joints.near_ends.offset_per_s",
                &given.offset_per_s,
                &|value| *value >= 0.0 && value.is_finite(),
                "finite numbers of at least 0",
            )?,
            source: given.source.clone(),
        };
        let places = [
            (given.lower_rad_or_m.span(), LOWER),
            (given.upper_rad_or_m.span(), UPPER),
        ];
        self.narrow(&ends, (model, limits), places)?;
        limits.ends = Some(ends);
        Ok(())
    }

    /// How far the arm may be ahead of its command; 0 where it is not given.
    fn ahead(&self, given: Option<&Spanned<f64>>) -> Result<f64, RobotError> {
        let Some(given) = given else {
            return Ok(0.0);
        };
        let value = *given.get_ref();
        if value.is_finite() && value >= 0.0 {
            return Ok(value);
        }
        let key = "joints.near_ends.ahead_rad_or_m";
        Err(self.value(given.span(), key, "a finite number of at least 0"))
    }

    /// One good number for each joint.
    fn numbers(
        &self,
        (key, values): (&'static str, &Spanned<Vec<f64>>),
        joints: usize,
        good: &dyn Fn(&f64) -> bool,
        expected: &str,
    ) -> Result<Vec<f64>, RobotError> {
        self.check_count(key, values, joints)?;
        if values.get_ref().iter().all(good) {
            return Ok(values.get_ref().clone());
        }
        Err(self.value(values.span(), key, expected))
    }

    /// Leaves out of the ranges what is nearer to an end than a hundredth of the largest speed allows.
    fn narrow(
        &self,
        ends: &EndSpeeds,
        (model, limits): (&mut Model, &mut JointLimits),
        [lower, upper]: [Place; 2],
    ) -> Result<(), RobotError> {
        for (j, joint) in model.joints.iter_mut().enumerate() {
            let speed = LEAST * limits.velocity[j] + ends.offset[j];
            let off = speed * speed / (2.0 * ends.deceleration[j]);
            let range = [
                joint.lower.max(ends.lower[j] + off),
                joint.upper.min(ends.upper[j] - off),
            ];
            if range[0] >= range[1] {
                let (span, key) = if joint.lower >= range[1] {
                    upper
                } else {
                    lower
                };
                let expected = format!(
                    "ends that leave a range to joint \"{}\", with these it is from {} to {}",
                    joint.name, range[0], range[1]
                );
                return Err(self.value(span, key, &expected));
            }
            [joint.lower, joint.upper] = range;
            [limits.lower[j], limits.upper[j]] = range;
        }
        Ok(())
    }
}

const LOWER: &str = "joints.near_ends.lower_rad_or_m";
const UPPER: &str = "joints.near_ends.upper_rad_or_m";
