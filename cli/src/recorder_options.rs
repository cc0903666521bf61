//! Where an engine records.

use std::env;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use clap::Args;
use engine::flight::FlightOptions;
use engine::host::Host;
use planner::robot::Robot;
use recorder::{Rotation, Summary};

use crate::failure::Failure;
use crate::printer::Printer;

/// Where an engine records.
#[derive(Args, Debug)]
pub(crate) struct RecorderOptions {
    /// Record everything as MCAP, for Foxglove, PlotJuggler, Rerun and `canter replay` [default
    /// name: canter-<robot>-<time>.mcap here]
    #[arg(long, value_name = "FILE.mcap", num_args = 0..=1, require_equals = true,
          default_missing_value = "")]
    record: Option<PathBuf>,
    /// Folder in which a fault leaves a recording of the minute before it [default: canter in
    /// $XDG_STATE_HOME or ~/.local/state]
    #[arg(long, value_name = "DIR")]
    faults: Option<PathBuf>,
    #[command(flatten)]
    rotation: RotationOptions,
}

/// When a new file of a recording begins.
#[derive(Args, Debug)]
pub(crate) struct RotationOptions {
    /// A new file of the recording begins at this size (MB)
    #[arg(long, value_name = "MB", default_value_t = 256, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    record_size: u64,
    /// A new file of the recording begins after this time (s)
    #[arg(long, value_name = "S", default_value_t = 600, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    record_age: u64,
    /// All files of the recording together have at most this size (MB); the oldest go first
    #[arg(long, value_name = "MB", default_value_t = 8192, value_parser = clap::value_parser!(u64).range(1..=100_000_000))]
    record_keep: u64,
}

impl RotationOptions {
    /// The rotation that was chosen.
    pub(crate) fn rotation(&self) -> Rotation {
        Rotation {
            bytes: self.record_size << 20,
            age_ns: self.record_age * 1_000_000_000,
            keep: self.record_keep << 20,
        }
    }
}

impl RecorderOptions {
    /// Starts to record what the host does.
    ///
    /// # Errors
    /// [`crate::exit::Exit::Unreadable`] when the file cannot be written.
    pub(crate) fn start<D>(&self, host: &mut Host<D>, robot: &Robot) -> Result<(), Failure> {
        let record = self.record.as_ref().map(|path| {
            if path.as_os_str().is_empty() {
                default_name(&robot.name)
            } else {
                path.clone()
            }
        });
        let options = FlightOptions {
            record,
            rotation: self.rotation.rotation(),
            faults: self.faults.clone().or_else(default_faults),
        };
        host.record(robot, &options)?;
        Ok(())
    }
}

/// Where faults are recorded unless told.
fn default_faults() -> Option<PathBuf> {
    let folder = |name: &str| {
        let value = env::var_os(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from)
    };
    let state = folder("XDG_STATE_HOME").or_else(|| Some(folder("HOME")?.join(".local/state")));
    state.map(|state| state.join("canter"))
}

/// The name of a recording unless told, in this folder: with the time, so that none is in the way of
/// another.
pub(crate) fn default_name(robot: &str) -> PathBuf {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let milliseconds = since.map_or(0, |since| since.as_millis());
    PathBuf::from(format!("canter-{robot}-{milliseconds}.mcap"))
}

/// Says what was recorded.
pub(crate) fn report(printer: &Printer, summary: &Summary) {
    let names = summary.files.iter().map(|path| shown(path));
    let names = names.collect::<Vec<_>>().join(", ");
    let lost = match summary.dropped {
        0 => String::new(),
        count => format!(", {count} samples had no room"),
    };
    printer.note(&format!(
        "canter: {} periods recorded in {names}{lost}",
        summary.written
    ));
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}
