//! A recording with its robot and programs.

use std::path::Path;

use anyhow::anyhow;
use engine::host::GivenProgram;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use planner::recorded::{RecordedSample, RunColumns};
use planner::robot::Robot;
use recorder::{Recorded, Sample};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::output;

/// A recording that was read.
pub(crate) struct RecordedFile {
    name: String,
    /// All that the file has.
    pub(crate) content: Recorded,
}

impl RecordedFile {
    /// Reads a recording, and says so where it was cut off.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] when it cannot be read.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let content = recorder::read(path)?;
        let name = path.display().to_string();
        if let Some(cause) = &content.cut {
            output::note(&format!("canter: {name} ends before its end: {cause}"));
        }
        Ok(Self { name, content })
    }

    /// Refuses a file that is not as it was written: what it says proves nothing.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] with the checksum that does not fit.
    pub(crate) fn check_whole(&self) -> Result<(), Failure> {
        let Some(cause) = self.content.cut.as_ref().filter(|_| self.content.damaged) else {
            return Ok(());
        };
        let cause = anyhow!(
            "{}: the file was changed after it was written ({cause}); canter record --recover saves \
             what can be read of it",
            self.name
        );
        Err(Failure::new(Exit::Unreadable, cause))
    }

    /// The robot by the recording's own files.
    ///
    /// # Errors
    /// [`Exit::Unreadable`] when they make no robot.
    pub(crate) fn robot(&self) -> Result<Robot, Failure> {
        let head = &self.content.head;
        planner::robot::parse(&head.robot, &head.urdf, &head.robot_toml)
            .map_err(|error| Failure::new(Exit::Unreadable, error))
    }

    /// The programs of the recording, in order; with a line on standard error for each unless
    /// `silent`.
    ///
    /// # Errors
    /// [`Exit::Refused`] where there is none.
    pub(crate) fn programs(&self, silent: bool) -> Result<Vec<GivenProgram>, Failure> {
        let mut programs = Vec::new();
        for text in &self.content.programs {
            let given = serde_json::from_str::<GivenProgram>(text)
                .map_err(|cause| anyhow!("{}: a program in another form: {cause}", self.name))
                .map_err(|cause| Failure::new(Exit::Unreadable, cause))?;
            programs.push(given);
        }
        if programs.is_empty() {
            let cause = anyhow!(
                "{}: it has no program; one that was given before the recording began is not in it",
                self.name
            );
            return Err(Failure::new(Exit::Refused, cause));
        }
        if !silent && programs.len() > 1 {
            output::note(&format!(
                "canter: {} programs in {}",
                programs.len(),
                self.name
            ));
        }
        Ok(programs)
    }

    /// The periods of a program, as rows of a run.
    pub(crate) fn rows(&self, given: &GivenProgram, joints: usize) -> Vec<RecordedSample> {
        let samples = self.samples(given);
        let first = samples.first().map_or(0, |sample| sample.tick);
        let period = self.content.head.period_ns as f64 * 1e-9;
        let mut command = given.first;
        let mut rows = Vec::with_capacity(samples.len());
        for sample in samples {
            // The instant at which a command begins belongs to the one that ends there.
            if sample.path_time > 0.0 && sample.command >= given.first {
                command = sample.command;
            }
            rows.push(RecordedSample {
                t_s: (sample.tick - first) as f64 * period,
                command: command.saturating_sub(given.first) as usize,
                ..row(sample, joints)
            });
        }
        rows
    }

    /// The samples of a program: from the instant at which its first command begins to the last of
    /// its commands.
    pub(crate) fn samples(&self, given: &GivenProgram) -> &[Sample] {
        let samples = &self.content.samples;
        let inside = |sample: &Sample| (given.first..=given.last).contains(&sample.command);
        let Some(from) = samples.iter().position(inside) else {
            return &[];
        };
        let to = samples.iter().rposition(inside).unwrap_or(from);
        // An arm that rests before its first command rests in the program as well.
        samples.get(from..=to).unwrap_or_default()
    }
}

fn row(sample: &Sample, joints: usize) -> RecordedSample {
    let list = |values: &[f64]| values.iter().take(joints).copied().collect::<Vec<_>>();
    let [x, y, z, qw, qx, qy, qz] = sample.tool;
    RecordedSample {
        t_s: 0.0,
        command: 0,
        joints: list(&sample.position),
        rates: list(&sample.velocity),
        accelerations: list(&sample.acceleration),
        pose: Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::new_unchecked(Quaternion::new(qw, qx, qy, qz)),
        ),
        run: Some(RunColumns {
            path_time_s: sample.path_time,
            measured: list(&sample.measured),
            measured_point: Vector3::from(sample.measured_tool),
        }),
    }
}
