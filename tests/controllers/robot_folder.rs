//! Folders of robots that differ from the shipped ones.

use std::cell::Cell;

/// A copy of a shipped robot whose `robot.toml` is what `change` makes of it.
pub(crate) fn changed(robot: &str, change: impl Fn(String) -> String) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let from = system_tests::repository::root().join("robots").join(robot);
    let copy = |name: &str| std::fs::read_to_string(from.join(name)).unwrap();
    std::fs::write(folder.path().join("robot.urdf"), copy("robot.urdf")).unwrap();
    let text = change(copy("robot.toml"));
    std::fs::write(folder.path().join("robot.toml"), text).unwrap();
    folder
}

/// The masses (kg) of the end effectors of shipped robots in [`with_masses`], in their order.
pub(crate) const MASSES: [f64; 3] = [1.0, 0.5, 0.25];

/// A copy of a shipped robot whose end effectors have masses.
pub(crate) fn with_masses(robot: &str) -> tempfile::TempDir {
    let number = Cell::new(0);
    let line = |line: &str| {
        let mut text = format!("{line}\n");
        if line.starts_with("flange_from_tcp") {
            let mass = MASSES[number.replace(number.get() + 1)];
            let payload =
                format!("payload = {{ mass_kg = {mass:?}, center_m = [0.0, 0.0, 0.05] }}\n");
            text.push_str(&payload);
        }
        text
    };
    changed(robot, |text| text.lines().map(line).collect())
}
