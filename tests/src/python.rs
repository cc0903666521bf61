//! Scripts of tests in Python, and the packages that they need.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use crate::{domain, repository};

/// Whether `python3` can import a module; the reason if not, with the package to install.
///
/// # Errors
/// The reason.
pub fn has(module: &str, package: &str) -> Result<(), String> {
    let ran = Command::new("python3")
        .args(["-c", &format!("import {module}")])
        .output();
    match ran {
        Err(error) => Err(format!("there is no python3 ({error})")),
        Ok(ran) if ran.status.success() => Ok(()),
        Ok(_) => Err(format!(
            "python3 cannot import {module} (pip install {package})"
        )),
    }
}

/// A script of the repository in the domain of the test, with arguments and environment; gives what it
/// printed.
///
/// # Errors
/// It cannot be started, or it failed: with its exit code and what it said.
pub fn run<A, E>(script: &str, arguments: A, environment: E) -> Result<String, String>
where
    A: IntoIterator<Item: AsRef<OsStr>>,
    E: IntoIterator<Item = (&'static str, String)>,
{
    let root = repository::root();
    let mut command = Command::new("python3");
    command.arg("-B").arg(root.join(Path::new(script)));
    let ran = domain::join(&mut command)
        .args(arguments)
        .current_dir(root)
        .envs(environment)
        .output()
        .map_err(|error| format!("there is no python3 ({error})"))?;
    let said = String::from_utf8_lossy(&ran.stdout).into_owned();
    if ran.status.success() {
        return Ok(said);
    }
    let why = String::from_utf8_lossy(&ran.stderr);
    Err(format!("{}\n{said}\n{why}", ran.status))
}
