use std::io::{self, BufReader, Read, Write};
use std::path::Path;

use anyhow::{Context, anyhow};
use clap::Args;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};
use planner::recorded::{
    CommandVerdict, ProgramVerdict, RecordedSample, RunColumns, verify_program,
};
use planner::robot::Robot;

use crate::exit::Exit;
use crate::failure::Failure;
use crate::program::{ProgramArgument, ProgramFile, ReadingOptions};
use crate::recorded_program::RecordedFile;
use crate::{input, output, robot};

/// Check a recorded motion against its program, from the samples alone
///
/// Reads what `canter plan --samples` or `canter run --samples` wrote and checks every column
/// against the program, the robot and the other columns: limits of joints and tool, tolerances and
/// their order, straight lines and legs, orientation, rest, times. A finding names the rule, the
/// time, the value and the limit. It has its own kinematics and plans nothing.
#[derive(Args, Debug)]
pub(crate) struct Verify {
    /// CSV file of samples, `-` is standard input; or a recording, which has its program and robot
    #[arg(value_name = "SAMPLES.csv|FILE.mcap")]
    samples: String,
    /// File of canonical commands, text or JSON; a recording has its own
    #[arg(value_name = "PROGRAM")]
    program: Option<String>,
    #[command(flatten)]
    reading: ReadingOptions,
    /// Shipped robot (see `canter robots list`) or a folder with robot.urdf and robot.toml; a
    /// recording has its own
    #[arg(short, long, value_name = "R")]
    robot: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Verify {
    /// Checks and prints; findings are the exit code [`Exit::Refused`].
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        let path = Path::new(&self.samples);
        if path.to_string_lossy().contains(".mcap") {
            return self.run_recording(path);
        }
        let (Some(robot), Some(program)) = (&self.robot, &self.program) else {
            let cause = anyhow!("a CSV file needs PROGRAM and --robot; a recording has both");
            return Err(Failure::new(Exit::Usage, cause));
        };
        let robot = robot::load(robot)?;
        let program = ProgramArgument::new(program, &self.reading).read()?;
        if program.exit() != Exit::Done {
            program.report();
            return Ok(program.exit());
        }
        let rows = read(&self.samples, robot.dof())?;
        self.judge(&robot, &program, &rows)
    }

    fn judge(
        &self,
        robot: &Robot,
        program: &ProgramFile,
        rows: &[RecordedSample],
    ) -> Result<Exit, Failure> {
        let verdict = verify_program(robot, program.program(), program.default_length(), rows);
        if self.json {
            output::json(&verdict)?;
        } else {
            table(&verdict)?;
        }
        Ok(if verdict.holds {
            Exit::Done
        } else {
            Exit::Refused
        })
    }

    /// Judges a recording: every program of it, or the one that is given.
    fn run_recording(&self, path: &Path) -> Result<Exit, Failure> {
        let recorded = RecordedFile::read(path)?;
        recorded.check_whole()?;
        let robot = match &self.robot {
            Some(name) => robot::load(name)?,
            None => recorded.robot()?,
        };
        let mut exit = Exit::Done;
        for given in recorded.programs(self.json)? {
            let program = match &self.program {
                Some(path) => ProgramArgument::new(path, &self.reading).read()?,
                None => ProgramFile::given(&given),
            };
            if program.exit() != Exit::Done {
                program.report();
                return Ok(program.exit());
            }
            let rows = recorded.rows(&given, robot.dof());
            if self.judge(&robot, &program, &rows)? != Exit::Done {
                exit = Exit::Refused;
            }
        }
        Ok(exit)
    }
}

/// Rows of a sample file, found by the names of its columns.
fn read(path: &str, joints: usize) -> Result<Vec<RecordedSample>, Failure> {
    let source = BufReader::new(input::lines(path)?);
    input::unreadable(path, parse(source, joints))
}

fn parse(source: impl Read, joints: usize) -> anyhow::Result<Vec<RecordedSample>> {
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(source);
    let header = reader.headers()?.clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|cell| cell == name)
            .ok_or_else(|| anyhow!("line 1: there is no column {name}"))
    };
    let numbered = |name: &str| -> Vec<String> {
        let joints = 1..=joints;
        joints.map(|joint| format!("{name}{joint}")).collect()
    };
    let mut names = vec!["t_s".to_owned(), "command".to_owned()];
    for name in ["q", "dq", "ddq"] {
        names.extend(numbered(name));
    }
    names.extend(["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"].map(str::to_owned));
    if header.iter().any(|cell| cell == "path_time_s") {
        names.push("path_time_s".to_owned());
        names.extend(numbered("measured_q"));
        names.extend(["x", "y", "z"].map(|axis| format!("measured_{axis}_m")));
    }
    let columns = names
        .iter()
        .map(|name| column(name))
        .collect::<Result<Vec<_>, _>>()?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |index: usize| {
            let cell = record.get(columns[index]).unwrap_or("");
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(anyhow!(
                    "line {line}, column {}: expected a number, got {cell:?}",
                    names[index]
                )),
            }
        };
        let numbers = (0..columns.len())
            .map(number)
            .collect::<Result<Vec<_>, _>>()?;
        rows.push(row(&numbers, joints).with_context(|| format!("line {line}"))?);
    }
    Ok(rows)
}

/// A row from the numbers of its columns.
fn row(numbers: &[f64], joints: usize) -> anyhow::Result<RecordedSample> {
    let mut numbers = numbers.iter().copied();
    let mut next = || numbers.next().ok_or_else(|| anyhow!("too few columns"));
    let (t_s, command) = (next()?, next()?);
    let mut list = |count: usize| (0..count).map(|_| next()).collect::<Result<Vec<_>, _>>();
    let (joints_now, rates, accelerations) = (list(joints)?, list(joints)?, list(joints)?);
    let (place, turn) = (list(3)?, list(4)?);
    let turn = Quaternion::new(turn[0], turn[1], turn[2], turn[3]);
    if (turn.norm() - 1.0).abs() > 1e-9 {
        return Err(anyhow!("the quaternion has length {}, not 1", turn.norm()));
    }
    if command < 0.0 || command.fract() != 0.0 {
        return Err(anyhow!("{command} is not the number of a command"));
    }
    let run = match list(1) {
        Ok(path_time) => Some(RunColumns {
            path_time_s: path_time[0],
            measured: list(joints)?,
            measured_point: Vector3::from_row_slice(&list(3)?),
        }),
        Err(_) => None,
    };
    Ok(RecordedSample {
        t_s,
        command: command as usize,
        joints: joints_now,
        rates,
        accelerations,
        pose: Isometry3::from_parts(
            Translation3::new(place[0], place[1], place[2]),
            UnitQuaternion::from_quaternion(turn),
        ),
        run,
    })
}

fn table(verdict: &ProgramVerdict) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(
        out,
        "{:>5} {:>5}  {:30} {:>8}  verdict",
        "index", "line", "command", "samples"
    )?;
    for command in &verdict.commands {
        writeln!(
            out,
            "{:5} {:5}  {:30} {:8}  {}",
            command.index,
            command.line,
            command.name,
            command.samples,
            words(command)
        )?;
        for finding in &command.findings {
            writeln!(out, "{:13}FAULT: {finding}", "")?;
        }
    }
    for finding in &verdict.findings {
        writeln!(out, "FAULT: {finding}")?;
    }
    let word = if verdict.holds {
        "holds"
    } else {
        "does NOT hold"
    };
    writeln!(
        out,
        "{} samples on {}: the motion {word}",
        verdict.samples, verdict.robot
    )
}

fn words(command: &CommandVerdict) -> String {
    let mut words = Vec::new();
    if let Some((ratio, limit)) = &command.peak {
        words.push(format!("{limit} {:.1} %", ratio * 100.0));
    }
    if let Some(straightness) = command.straightness_m {
        words.push(format!("straight within {:.2} um", straightness * 1e6));
    }
    let passes = command.poses.iter().rev().skip(1);
    let worst = passes
        .clone()
        .map(|pass| pass.deviation_m)
        .fold(0.0, f64::max);
    if let Some(tolerance) = passes.clone().map(|pass| pass.tolerance_m).next() {
        words.push(format!(
            "{} poses passed within {:.3} mm of {:.3} mm",
            passes.count(),
            worst * 1e3,
            tolerance * 1e3
        ));
    }
    words.join(", ")
}

#[cfg(test)]
mod tests {
    use super::parse;

    #[test]
    fn columns_are_found_by_name_and_faults_have_a_place() {
        let text = "command,t_s,q1,dq1,ddq1,x_m,y_m,z_m,qw,qx,qy,qz\n3,0.5,0.1,0,7,1,2,3,1,0,0,0\n";
        let rows = parse(text.as_bytes(), 1).unwrap();
        assert_eq!((rows[0].t_s, rows[0].command), (0.5, 3));
        assert_eq!(rows[0].joints, [0.1]);
        assert_eq!((rows[0].accelerations[0], &rows[0].run), (7.0, &None));
        assert_eq!(rows[0].pose.translation.z, 3.0);
        let fault = |text: String| format!("{:#}", parse(text.as_bytes(), 1).unwrap_err());
        assert!(fault(text.replace("q1", "p1")).contains("no column q1"));
        let bad = fault(text.replace("0.1", "x"));
        assert!(bad.contains("line 2") && bad.contains("column q1"), "{bad}");
        assert!(fault(text.replace("1,0,0,0\n", "0,0,0,0\n")).contains("quaternion"));
        assert!(fault(text.replace("3,0.5", "3.5,0.5")).contains("command"));
    }
}
