//! The Python package, on the extension module that cargo has built.
//!
//! Without Python or NumPy these tests are reported as ignored. The package is put together in a
//! folder: the Python files of `python/canter`, the module, the driver kit. Tests of the client
//! start engines of the command under test.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::ffi::OsStr;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Command;

use libtest_mimic::{Arguments, Failed, Trial};
use system_tests::repository::root;

/// Scripts of `python/tests`, and the packages that each needs besides NumPy.
const SCRIPTS: [(&str, &[&str]); 8] = [
    ("robots", &[]),
    ("motions", &["ruckig"]),
    ("paths", &["toppra"]),
    ("programs", &[]),
    ("arms", &[]),
    ("stubs", &["mypy"]),
    ("documents", &["matplotlib"]),
    ("notebooks", &["matplotlib", "ruckig", "iceoryx2"]),
];

fn main() {
    let mut arguments = Arguments::from_args();
    // Engines and their threads want the processors to themselves.
    arguments.test_threads = Some(1);
    let package = tempfile::tempdir().unwrap();
    let numpy = has("numpy");
    if let Err(reason) = &numpy {
        eprintln!("{reason}: the tests of the Python package are ignored");
    } else {
        put_together(package.path());
    }
    let trials = SCRIPTS.iter().map(|(script, needs)| {
        let missing = needs.iter().find_map(|package| has(package).err());
        if let (Ok(()), Some(reason)) = (&numpy, &missing) {
            eprintln!("{reason}: python/tests/{script}.py is ignored");
        }
        let ignored = numpy.is_err() || missing.is_some();
        let folder = package.path().to_owned();
        Trial::test(format!("{script}.py"), move || run(script, &folder)).with_ignored_flag(ignored)
    });
    let trials = trials.collect();
    let conclusion = libtest_mimic::run(&arguments, trials);
    drop(package);
    conclusion.exit();
}

/// Whether `python3` can import a package; the reason if not.
fn has(package: &str) -> Result<(), String> {
    let ran = Command::new("python3")
        .args(["-c", &format!("import {package}")])
        .output();
    match ran {
        Err(error) => Err(format!("there is no python3 ({error})")),
        Ok(ran) if ran.status.success() => Ok(()),
        Ok(_) => Err(format!(
            "python3 cannot import {package} (pip install {package})"
        )),
    }
}

/// The package as a wheel would install it, by links.
fn put_together(folder: &Path) {
    let canter = folder.join("canter");
    fs::create_dir(&canter).unwrap();
    for entry in fs::read_dir(root().join("python/canter")).unwrap() {
        let path = entry.unwrap().path();
        symlink(&path, canter.join(path.file_name().unwrap())).unwrap();
    }
    symlink(module(), canter.join("_canter.abi3.so")).unwrap();
    let command = env!("CARGO_BIN_EXE_canter-under-test");
    fs::create_dir(folder.join("bin")).unwrap();
    symlink(command, folder.join("bin/canter")).unwrap();
}

/// The extension module: cargo builds it beside the dependencies of this test.
fn module() -> PathBuf {
    let own = std::env::current_exe().unwrap();
    let folder = own.parent().unwrap();
    let places = [folder.to_owned(), folder.parent().unwrap().to_owned()];
    let module = places
        .iter()
        .map(|folder| folder.join("libcanter_python.so"))
        .find(|path| path.is_file());
    module.expect("cargo builds libcanter_python.so for this test")
}

fn run(script: &str, package: &Path) -> Result<(), Failed> {
    let path = root().join(format!("python/tests/{script}.py"));
    let mut command = Command::new("python3");
    system_tests::domain::join(&mut command)
        .arg("-B")
        .arg(path)
        .current_dir(root())
        .env("PYTHONPATH", package)
        .env("CANTER_COMMAND", package.join("bin/canter"))
        .env("MPLBACKEND", OsStr::new("Agg"))
        .env("PYTHONWARNINGS", "error::DeprecationWarning:canter");
    let ran = command.output()?;
    if ran.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    Err(format!("{}\n{said}", ran.status).into())
}
