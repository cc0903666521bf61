//! Limits of efforts and the payload, from `robot.toml`.

use kinematics::{Inertia, Model};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use toml::Spanned;

use super::error::RobotError;
use super::files::Files;

/// Which further limits hold.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Limits {
    /// Whether the efforts of the joints are limited.
    #[serde(default = "no")]
    effort: Spanned<bool>,
}

fn no() -> Spanned<bool> {
    Spanned::new(0..0, false)
}

/// What the flange carries all the time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Payload {
    mass_kg: Spanned<f64>,
    center_m: Spanned<[f64; 3]>,
    inertia_kg_m2: Option<Spanned<[f64; 3]>>,
}

/// Limits of the efforts of the joints.
#[derive(Clone, Debug, PartialEq)]
pub struct EffortLimits {
    /// Largest effort of each joint, root first (Nm; N for sliding joints).
    pub limits: Vec<f64>,
}

impl Files<'_> {
    /// The limits of efforts, if the robot asks for them.
    pub(super) fn efforts(
        &self,
        model: &Model,
        limits: Option<&Limits>,
    ) -> Result<Option<EffortLimits>, RobotError> {
        let Some(limits) = limits.filter(|limits| *limits.effort.get_ref()) else {
            return Ok(None);
        };
        let mut efforts = Vec::with_capacity(model.dof());
        for (joint, inertia) in model.joints.iter().zip(&model.inertias) {
            let (Some(effort), true) = (joint.effort, inertia.is_some()) else {
                let lacks = if inertia.is_some() {
                    "an effort limit"
                } else {
                    "an inertia"
                };
                let expected = format!(
                    "false, or {lacks} for joint \"{}\" in robot.urdf",
                    joint.name
                );
                return Err(self.value(limits.effort.span(), "limits.effort", &expected));
            };
            efforts.push(effort);
        }
        Ok(Some(EffortLimits { limits: efforts }))
    }

    /// A body; `key` is where it stands in the file.
    pub(super) fn payload(&self, key: &str, payload: &Payload) -> Result<Inertia, RobotError> {
        let mass = *payload.mass_kg.get_ref();
        if !(0.0..=1e5).contains(&mass) {
            let expected = "a mass from 0 to 100000 kg";
            let key = format!("{key}.mass_kg");
            return Err(self.value(payload.mass_kg.span(), &key, expected));
        }
        let centre = *payload.center_m.get_ref();
        if !centre.iter().all(|x| x.abs() <= 100.0) {
            let expected = "three numbers of at most 100";
            let key = format!("{key}.center_m");
            return Err(self.value(payload.center_m.span(), &key, expected));
        }
        let mut moments = [0.0; 3];
        if let Some(given) = &payload.inertia_kg_m2 {
            moments = *given.get_ref();
            if !moments.iter().all(|x| (0.0..=1e6).contains(x)) {
                let expected = "three moments of at least zero, about the centre of mass";
                let key = format!("{key}.inertia_kg_m2");
                return Err(self.value(given.span(), &key, expected));
            }
        }
        Ok(Inertia {
            mass,
            centre: Vector3::from(centre),
            moment: Matrix3::from_diagonal(&Vector3::from(moments)),
        })
    }
}
