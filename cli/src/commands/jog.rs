use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Args;
use ipc::{Client, Verb};

use crate::client::{self, ArmOption};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::printer::Printer;
use crate::signals::SignalThread;

/// Time between two requests to the engine.
const AGAIN: Duration = Duration::from_millis(50);

/// How long the engine may take to answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// The axes of the tool, in the order of the request.
const TOOL: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

/// Jog an arm: joints, or the tool along and about its own axes
///
/// Moves until Ctrl-C or --seconds, within the same limits as any other motion; the arm stops by
/// itself when this process ends. No program may be running.
#[derive(Args, Debug)]
pub(crate) struct Jog {
    /// Direction: j2=-0.1 turns joint 2 back at a tenth of its speed; x, y, z and rx, ry, rz are
    /// the axes of the tool; several of one kind can be combined
    #[arg(value_name = "AXIS=SHARE", required = true, value_parser = axis)]
    axes: Vec<(Axis, f64)>,
    /// How long; without it until Ctrl-C
    #[arg(long, value_name = "S", value_parser = seconds)]
    seconds: Option<f64>,
    /// The arm stops when the engine gets no request for this long, 50 to 2000
    #[arg(long, value_name = "MS", default_value_t = 300)]
    timeout: u64,
    #[command(flatten)]
    arm: ArmOption,
}

/// What a share of speed is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Axis {
    /// A joint, from 0.
    Joint(usize),
    /// An axis of the tool, by its index in [`TOOL`].
    Tool(usize),
}

impl Jog {
    /// Asks repeatedly, then for rest.
    pub(crate) fn run(&self, printer: &Printer) -> Result<Exit, Failure> {
        let signals = SignalThread::start(printer, "once more to give up")?;
        signals.count_only();
        let client = Client::open(&self.arm.open()?, "canter jog")?;
        let (space, speeds) = self.request(&client)?;
        let ask = |speeds: Vec<f64>| -> Result<(), Failure> {
            let verb = Verb::Jog {
                space: space.to_owned(),
                speeds,
                timeout_ms: self.timeout,
                distance: None,
                goal: Vec::new(),
            };
            let answer = client.ask(verb, PATIENCE)?;
            client::accepted(answer).map(|_| ())
        };
        let end = self
            .seconds
            .map(|seconds| Instant::now() + Duration::from_secs_f64(seconds));
        while signals.count() == 0 && end.is_none_or(|end| Instant::now() < end) {
            ask(speeds.clone())?;
            let left = end.map_or(AGAIN, |end| end.saturating_duration_since(Instant::now()));
            sleep(AGAIN.min(left));
        }
        ask(vec![0.0; speeds.len()])?;
        Ok(Exit::Done)
    }

    /// Space and shares as the engine wants them.
    fn request(&self, client: &Client) -> Result<(&'static str, Vec<f64>), Failure> {
        let mut tool = vec![0.0; TOOL.len()];
        let mut joints = Vec::new();
        for (axis, share) in &self.axes {
            match axis {
                Axis::Tool(place) => tool[*place] = *share,
                Axis::Joint(joint) => {
                    if joints.is_empty() {
                        joints = vec![0.0; joint_count(client)?];
                    }
                    let count = joints.len();
                    let place = joints.get_mut(*joint).ok_or_else(|| {
                        usage(format!("j{} on an arm of {count} joints", joint + 1))
                    })?;
                    *place = *share;
                }
            }
        }
        let turns_tool = tool.iter().any(|share| *share != 0.0);
        match (joints.is_empty(), turns_tool) {
            (false, true) => Err(usage(
                "joints and axes of the tool cannot move together".to_owned(),
            )),
            (false, false) => Ok(("joint", joints)),
            (true, _) => Ok(("tool", tool)),
        }
    }
}

/// How many joints the arm has, by its engine's report.
fn joint_count(client: &Client) -> Result<usize, Failure> {
    let answer = client.ask(Verb::Status, PATIENCE)?;
    let answer = client::accepted(answer)?;
    let joints = answer.body["status"]["joints"].as_array();
    Ok(joints.map_or(0, Vec::len))
}

fn usage(text: String) -> Failure {
    Failure::new(Exit::Usage, anyhow::anyhow!(text))
}

/// An axis with its share of the largest speed.
fn axis(text: &str) -> Result<(Axis, f64), String> {
    const WANTED: &str = "expected AXIS=SHARE: j1, j2, ... or x, y, z, rx, ry, rz; SHARE -1 to 1";
    let (name, share) = text.split_once('=').ok_or(WANTED)?;
    let share: f64 = share.parse().map_err(|_| WANTED)?;
    if !(-1.0..=1.0).contains(&share) {
        return Err(WANTED.to_owned());
    }
    if let Some(place) = TOOL.iter().position(|axis| *axis == name) {
        return Ok((Axis::Tool(place), share));
    }
    let joint = name
        .strip_prefix('j')
        .and_then(|number| number.parse().ok());
    match joint {
        Some(joint @ 1..=16_usize) => Ok((Axis::Joint(joint - 1), share)),
        _ => Err(WANTED.to_owned()),
    }
}

/// A length in s.
fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=3600.0).contains(&value) => Ok(value),
        _ => Err("expected s from 0 to 3600".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_read() {
        assert_eq!(axis("j3=-0.5"), Ok((Axis::Joint(2), -0.5)));
        assert_eq!(axis("rz=1"), Ok((Axis::Tool(5), 1.0)));
        for wrong in ["j0=0.1", "x", "x=2", "x=NaN", "q=0.1", "j=1", "j17=0.1"] {
            assert!(axis(wrong).is_err(), "{wrong}");
        }
    }
}
