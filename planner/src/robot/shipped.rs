//! The robots that come with Canter, as part of the binary.

use include_dir::{Dir, include_dir};

static ROBOTS: Dir<'_> = include_dir!("$CARGO_MANIFEST_DIR/../robots");

/// Names of the shipped robots, in alphabetical order.
#[must_use]
pub fn list() -> Vec<&'static str> {
    let mut names: Vec<_> = ROBOTS
        .dirs()
        .filter_map(|dir| dir.path().to_str())
        .collect();
    names.sort_unstable();
    names
}

/// `robot.urdf` and `robot.toml` of a shipped robot.
pub(super) fn texts(name: &str) -> Option<(&'static str, &'static str)> {
    let text = |file: &str| ROBOTS.get_file(format!("{name}/{file}"))?.contents_utf8();
    Some((text("robot.urdf")?, text("robot.toml")?))
}
