//! Makes a robot folder from any URDF, with Canter's defaults for what the URDF does not have.

use super::Robot;
use super::error::RobotError;
use super::files::Files;
use super::meshes::copy_meshes;
use kinematics::{Model, urdf};
use std::fmt::Write as _;
use std::path::Path;

/// Makes a robot folder from a URDF: copies it to `folder/robot.urdf` with the meshes that it names
/// and that are found, and writes a `folder/robot.toml` whose defaults are marked as Canter's.
/// Returns the loaded robot.
///
/// `tip` names the link at the flange; it is needed when several could be it.
///
/// # Errors
/// [`RobotError`] when the URDF cannot be used, when the folder has a
/// `robot.toml` already, or when it cannot be written.
pub fn import(urdf_file: &Path, folder: &Path, tip: Option<&str>) -> Result<Robot, RobotError> {
    let file = urdf_file.display().to_string();
    let urdf = super::text_of(urdf_file)?;
    let toml = defaults_for(&file, &urdf, tip)?;
    let toml_file = folder.join("robot.toml");
    if toml_file.exists() {
        let message = "it exists already".to_owned();
        return Err(unwritable(&toml_file, message));
    }
    // Read before anything is written: a robot that is refused leaves nothing behind.
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    let robot = Files {
        name: &name,
        place: folder,
        urdf: &urdf,
        toml: &toml,
    }
    .read()?;
    let is_new = !folder.exists();
    let from = urdf_file.canonicalize().unwrap_or_default();
    let from = from.parent().unwrap_or(urdf_file);
    let written = write(folder, &urdf, &toml).and_then(|()| {
        let copied = copy_meshes(&urdf, from, folder);
        copied.map_err(|error| unwritable(folder, error.to_string()))
    });
    if written.is_err() && is_new {
        // An incomplete folder is removed; the write error is reported.
        let _ = std::fs::remove_dir_all(folder);
    }
    let folder = folder.canonicalize().ok();
    written.map(|_| Robot { folder, ..robot })
}

/// A robot from the text of a URDF, with Canter's defaults for what the URDF does not have. Nothing is
/// written.
///
/// `tip` names the link at the flange; it is needed when several could be it.
///
/// # Errors
/// [`RobotError`] when the URDF cannot be used.
///
/// ```
/// let urdf = planner::robot::load("ur5e")?.urdf;
/// let robot = planner::robot::from_urdf("mine", &urdf, None)?;
/// assert_eq!(robot.dof(), 6);
/// # Ok::<(), planner::robot::RobotError>(())
/// ```
pub fn from_urdf(name: &str, urdf: &str, tip: Option<&str>) -> Result<Robot, RobotError> {
    let toml = defaults_for(name, urdf, tip)?;
    super::parse(name, urdf, &toml)
}

/// Text of a `robot.toml` for a URDF.
fn defaults_for(file: &str, urdf: &str, tip: Option<&str>) -> Result<String, RobotError> {
    let model = urdf::read(urdf, tip).map_err(|source| RobotError::Urdf {
        file: file.to_owned(),
        source,
    })?;
    Ok(defaults(&model))
}

fn write(folder: &Path, urdf: &str, toml: &str) -> Result<(), RobotError> {
    std::fs::create_dir_all(folder).map_err(|error| unwritable(folder, error.to_string()))?;
    for (name, text) in [("robot.urdf", urdf), ("robot.toml", toml)] {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| unwritable(&path, error.to_string()))?;
    }
    Ok(())
}

fn unwritable(path: &Path, message: String) -> RobotError {
    RobotError::Write {
        file: path.display().to_string(),
        message,
    }
}

/// Text of a `robot.toml` for a model, every default marked as Canter's.
fn defaults(model: &Model) -> String {
    let velocity: Vec<f64> = model
        .joints
        .iter()
        .map(|joint| joint.velocity.unwrap_or(DEFAULT_VELOCITY))
        .collect();
    let mut text = String::new();
    // Writing to a `String` cannot fail.
    let _ = write!(
        text,
        r#"description = {name}
tip_link = {tip}

# One value per joint, root first; rad for turning joints, m for sliding ones.
# What the URDF gives goes before what stands here.
[joints]
source = "canter default"
velocity_per_s = {velocity:?}
acceleration_per_s2 = {acceleration:?}
jerk_per_s3 = {jerk:?}

[tool_limits]
source = "canter default"
speed_m_per_s = 1.0
acceleration_m_per_s2 = 5.0
jerk_m_per_s3 = 100.0
angular_speed_rad_per_s = 3.0
angular_acceleration_rad_per_s2 = 15.0
angular_jerk_rad_per_s3 = 300.0

# Where the base stands in the workstation.
[base]
position_m = [0.0, 0.0, 0.0]
roll_pitch_yaw_rad = [0.0, 0.0, 0.0]

# Middle of the joint ranges; put a good ready position here.
[home]
joints_rad_or_m = {home:?}
"#,
        name = toml::Value::from(model.name.as_str()),
        tip = toml::Value::from(model.tip_link.as_str()),
        velocity = velocity,
        acceleration = velocity.iter().map(|v| tidy(v / 0.6)).collect::<Vec<_>>(),
        jerk = velocity
            .iter()
            .map(|v| tidy(v / 0.6 * 20.0))
            .collect::<Vec<_>>(),
        home = model
            .joints
            .iter()
            .map(|joint| middle(joint.lower, joint.upper))
            .collect::<Vec<_>>(),
    );
    text
}

/// Speed for a joint whose URDF gives none, rad/s or m/s.
const DEFAULT_VELOCITY: f64 = 0.5;

/// Three figures after the point, and never zero.
fn tidy(value: f64) -> f64 {
    ((value * 1e3).round() / 1e3).max(1e-3)
}

/// Zero if it is within the joint's range, otherwise the middle of the range.
fn middle(lower: f64, upper: f64) -> f64 {
    if lower <= 0.0 && upper >= 0.0 {
        0.0
    } else {
        0.5 * (lower + upper)
    }
}
