//! One row of a recording.

use nalgebra::{Isometry3, Vector3};

use crate::dry_run::PlanSample;

/// One row of a recorded motion, as `canter plan --samples` and `canter run --samples` write it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedSample {
    /// Time, s.
    pub t_s: f64,
    /// Number of the command in the program, from 0.
    pub command: usize,
    /// Joint positions, rad or m.
    pub joints: Vec<f64>,
    /// Joint velocities, per s.
    pub rates: Vec<f64>,
    /// Joint accelerations, per s2.
    pub accelerations: Vec<f64>,
    /// The controlled point in the workstation as it was recorded.
    pub pose: Isometry3<f64>,
    /// What only a recording of a run has.
    pub run: Option<RunColumns>,
}

/// The columns that a run has in addition to those of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct RunColumns {
    /// Planned time since the start of the command, s.
    pub path_time_s: f64,
    /// Joint positions that the driver measured, rad or m.
    pub measured: Vec<f64>,
    /// The controlled point at the measured joints, in the workstation, m.
    pub measured_point: Vector3<f64>,
}

/// A sample of a plan as a recording of it has it.
impl From<PlanSample> for RecordedSample {
    fn from(sample: PlanSample) -> Self {
        Self {
            t_s: sample.t_s,
            command: sample.command,
            joints: sample.q,
            rates: sample.dq,
            accelerations: sample.ddq,
            pose: sample.workstation_from_tool,
            run: None,
        }
    }
}

impl RecordedSample {
    /// Whether every number is finite and every list has one entry per joint.
    pub(super) fn is_sound(&self, joints: usize) -> bool {
        let lists = [&self.joints, &self.rates, &self.accelerations];
        let run = self.run.as_ref();
        let finite = |list: &[f64]| list.iter().all(|number| number.is_finite());
        self.t_s.is_finite()
            && lists
                .iter()
                .all(|list| list.len() == joints && finite(list))
            && finite(self.pose.translation.vector.as_slice())
            && finite(self.pose.rotation.coords.as_slice())
            && run.is_none_or(|run| {
                run.path_time_s.is_finite()
                    && run.measured.len() == joints
                    && finite(&run.measured)
                    && finite(run.measured_point.as_slice())
            })
    }

    /// Whether nothing moves.
    pub(super) fn rests(&self) -> bool {
        let all = self.rates.iter().chain(&self.accelerations);
        all.into_iter().all(|number| number.abs() <= REST)
    }
}

/// Joint velocities and accelerations up to this count as rest (rounding).
const REST: f64 = 1e-9;
