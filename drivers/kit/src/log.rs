//! Writes what the driver received to a file, for the fault tests.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use ipc::Setpoint;

use crate::{Driver, DriverError, Robot};

/// A CSV file with a line for each setpoint received: time (ns), session, sequence, tick and flags,
/// then position, velocity and acceleration of each joint, then the measured positions. Lines are
/// not buffered: after a kill the file contains everything that was received.
#[derive(Debug)]
pub(crate) struct Log(Option<File>);

impl Log {
    pub(crate) fn open(path: Option<&Path>) -> Result<Self, DriverError> {
        let Some(path) = path else {
            return Ok(Self(None));
        };
        let file = File::create(path).map_err(|cause| DriverError::Log {
            path: path.to_owned(),
            cause: cause.to_string(),
        })?;
        Ok(Self(Some(file)))
    }

    pub(crate) fn write<R: Robot>(&mut self, setpoint: &Setpoint, driver: &Driver<R>, now_ns: u64) {
        let Some(file) = &mut self.0 else { return };
        let joints = driver.joints();
        let mut line = format!(
            "{now_ns},{},{},{},{}",
            setpoint.session, setpoint.sequence, setpoint.tick, setpoint.flags
        );
        let lists = [
            &setpoint.position,
            &setpoint.velocity,
            &setpoint.acceleration,
        ];
        for value in lists.into_iter().flat_map(|list| list.iter().take(joints)) {
            line.push_str(&format!(",{value:e}"));
        }
        for joint in 0..joints {
            line.push_str(&format!(",{:e}", driver.position(joint)));
        }
        line.push('\n');
        // A full disk must not stop the robot.
        let _ = file.write_all(line.as_bytes());
    }
}
