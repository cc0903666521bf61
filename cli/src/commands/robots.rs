use std::io::{self, Write};
use std::path::PathBuf;

use clap::{Args, Subcommand};
use nalgebra::Isometry3;
use planner::robot::{self, Robot};
use serde_json::{Value, json};

use crate::exit::Exit;
use crate::failure::Failure;
use crate::mobility::{Mobility, mobility};
use crate::output;
use crate::robot::{load, with_joints};

/// Robots: list the shipped ones, show one, make a new one from its URDF
#[derive(Args, Debug)]
pub(crate) struct Robots {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// List the shipped robots
    List {
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Show limits, base, home and end effectors of a robot
    Show {
        /// Shipped robot or a folder with robot.urdf and robot.toml
        robot: String,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Make a robot folder from a URDF
    ///
    /// Writes robot.urdf and robot.toml, and copies the meshes that are found; what the URDF does
    /// not have is filled with cautious values that are marked as such. Check robot.toml before the
    /// robot moves.
    Import {
        /// The URDF file
        #[arg(value_name = "FILE.urdf")]
        file: PathBuf,
        /// Folder to make; the file's name without .urdf unless given
        #[arg(long, value_name = "FOLDER")]
        to: Option<PathBuf>,
        /// Link at the end of the arm, where the URDF has more than one end
        #[arg(long, value_name = "LINK")]
        tip: Option<String>,
    },
}

impl Robots {
    /// Lists, shows or imports.
    pub(crate) fn run(&self) -> Result<Exit, Failure> {
        match &self.what {
            What::List { json } => list(*json),
            What::Show { robot, json } => show(&load(robot)?, *json),
            What::Import { file, to, tip } => {
                let folder = to.clone().unwrap_or_else(|| file.with_extension(""));
                import(file, &folder, tip.as_deref())
            }
        }
    }
}

fn list(json: bool) -> Result<Exit, Failure> {
    let robots = robot::list()
        .into_iter()
        .map(load)
        .collect::<Result<Vec<_>, _>>()?;
    if json {
        let entry = |robot: &Robot| json!({"name": robot.name, "dof": robot.dof(), "description": robot.description});
        output::json(&robots.iter().map(entry).collect::<Vec<_>>())?;
        return Ok(Exit::Done);
    }
    let mut out = io::stdout().lock();
    for robot in &robots {
        writeln!(
            out,
            "{:14} {} joints  {}",
            robot.name,
            robot.dof(),
            robot.description
        )?;
    }
    Ok(Exit::Done)
}

fn import(
    file: &std::path::Path,
    folder: &std::path::Path,
    tip: Option<&str>,
) -> Result<Exit, Failure> {
    let robot =
        robot::import(file, folder, tip).map_err(|error| Failure::new(Exit::Unreadable, error))?;
    let mut out = io::stdout().lock();
    writeln!(out, "{}: {} joints", folder.display(), robot.dof())?;
    let names = robot::mesh_names(&robot.urdf);
    let is_lost = |name: &&&str| robot::mesh_file(folder, name).is_none();
    if let Some(lost) = names.iter().find(is_lost) {
        let count = names.iter().filter(is_lost).count();
        output::note(&format!(
            "{count} of {} meshes were not found, the first is {lost}: the live view shows the arm \
             without them",
            names.len()
        ));
    }
    output::note(&format!(
        "check {} before the robot moves: values that the URDF does not have are defaults",
        folder.join("robot.toml").display()
    ));
    Ok(Exit::Done)
}

fn show(robot: &Robot, json: bool) -> Result<Exit, Failure> {
    let mobility = with_joints!(robot.dof(), mobility(robot))?;
    if json {
        output::json(&description(robot, &mobility))?;
    } else {
        table(robot, &mobility)?;
    }
    Ok(Exit::Done)
}

fn pose(pose: &Isometry3<f64>) -> Value {
    let (p, r) = (pose.translation, pose.rotation);
    json!({"position_m": [p.x, p.y, p.z], "quaternion_wxyz": [r.w, r.i, r.j, r.k]})
}

fn description(robot: &Robot, mobility: &Mobility) -> Value {
    let finite = |values: &[f64]| -> Vec<Option<f64>> {
        values
            .iter()
            .map(|value| value.is_finite().then_some(*value))
            .collect()
    };
    let end_effectors: Vec<_> = robot
        .end_effectors
        .iter()
        .map(|tool| {
            json!({
                "name": tool.name,
                "flange_from_tcp": pose(&tool.flange_from_tcp),
                "opening_s": tool.gripper.map(|gripper| gripper.opening),
                "closing_s": tool.gripper.map(|gripper| gripper.closing),
                "workstation_from_holder": tool.workstation_from_holder.as_ref().map(pose),
            })
        })
        .collect();
    let mounted = robot
        .mounted
        .and_then(|index| robot.end_effectors.get(index));
    json!({
        "schema": 1,
        "name": robot.name,
        "description": robot.description,
        "dof": robot.dof(),
        "joints": {
            "name": robot.model.joints.iter().map(|joint| &joint.name).collect::<Vec<_>>(),
            "lower": finite(&robot.joints.lower),
            "upper": finite(&robot.joints.upper),
            "velocity": robot.joints.velocity,
            "acceleration": robot.joints.acceleration,
            "jerk": robot.joints.jerk,
            "source": robot.joints.source,
        },
        "tool": {
            "speed": robot.tool.speed,
            "acceleration": robot.tool.acceleration,
            "jerk": robot.tool.jerk,
            "angular_speed": robot.tool.angular_speed,
            "angular_acceleration": robot.tool.angular_acceleration,
            "angular_jerk": robot.tool.angular_jerk,
            "source": robot.tool.source,
        },
        "workstation_from_base": pose(&robot.workstation_from_base),
        "home": {"joints": robot.home, "workstation_from_tool": pose(&mobility.home)},
        "mobility": mobility.json(),
        "mounted": mounted.map(|tool| &tool.name),
        "end_effectors": end_effectors,
    })
}

fn table(robot: &Robot, mobility: &Mobility) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "{}: {}\n", robot.name, robot.description)?;
    joint_table(&mut out, robot)?;
    let tool = &robot.tool;
    writeln!(
        out,
        "controlled point: {} m/s, {} m/s2, {} m/s3; {} rad/s, {} rad/s2, {} rad/s3 ({})",
        tool.speed,
        tool.acceleration,
        tool.jerk,
        tool.angular_speed,
        tool.angular_acceleration,
        tool.angular_jerk,
        tool.source
    )?;
    writeln!(
        out,
        "base in the workstation: {}",
        millimetres(&robot.workstation_from_base)
    )?;
    let at_home = millimetres(&mobility.home);
    writeln!(out, "controlled point at home: {at_home}")?;
    mobility.lines(&mut out)?;
    end_effectors(&mut out, robot)
}

/// One line per joint.
fn joint_table(out: &mut impl Write, robot: &Robot) -> io::Result<()> {
    let joints = &robot.joints;
    writeln!(
        out,
        "{:24} {:>9} {:>9} {:>9} {:>13} {:>10} {:>9}",
        "joint", "lower", "upper", "velocity", "acceleration", "jerk", "home"
    )?;
    for (index, joint) in robot.model.joints.iter().enumerate() {
        let at = |values: &[f64]| values.get(index).copied().unwrap_or(f64::NAN);
        writeln!(
            out,
            "{:24} {:9.4} {:9.4} {:9.4} {:13.3} {:10.2} {:9.4}",
            joint.name,
            at(&joints.lower),
            at(&joints.upper),
            at(&joints.velocity),
            at(&joints.acceleration),
            at(&joints.jerk),
            at(&robot.home)
        )?;
    }
    writeln!(
        out,
        "(rad and s, m for sliding joints; acceleration and jerk: {})\n",
        joints.source
    )
}

/// One line an end effector.
fn end_effectors(out: &mut impl Write, robot: &Robot) -> io::Result<()> {
    for (index, tool) in robot.end_effectors.iter().enumerate() {
        let tcp = millimetres(&tool.flange_from_tcp);
        let mounted = if robot.mounted == Some(index) {
            ", mounted"
        } else {
            ""
        };
        let holder = tool.workstation_from_holder.as_ref();
        let holder = holder.map_or(String::new(), |at| {
            format!(", holder at {}", millimetres(at))
        });
        writeln!(
            out,
            "end effector {}: TCP at {tcp} of the flange{holder}{mounted}",
            tool.name
        )?;
    }
    Ok(())
}

/// A pose for display: millimetres, and degrees of roll, pitch and yaw if it is turned.
fn millimetres(pose: &Isometry3<f64>) -> String {
    let place = pose.translation.vector * 1e3;
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    let [x, y, z] = [place.x, place.y, place.z].map(tenths);
    let place = format!("({x:.1}, {y:.1}, {z:.1}) mm");
    if pose.rotation.angle() < 1e-9 {
        return place;
    }
    let [roll, pitch, yaw] = [roll, pitch, yaw].map(|angle| tenths(angle.to_degrees()));
    format!("{place} turned by roll {roll:.1}, pitch {pitch:.1}, yaw {yaw:.1} degrees")
}

/// Rounded to one decimal, without a negative zero.
fn tenths(value: f64) -> f64 {
    (value * 10.0).round() / 10.0 + 0.0
}
