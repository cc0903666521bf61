//! The Python package, on the extension module that cargo has built.
//!
//! Without Python or NumPy these tests are reported as ignored. The package is put together in a
//! folder: the Python files of `python/canter`, the module, the driver kit. Tests of the client
//! start engines of the command under test.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use libtest_mimic::{Arguments, Failed, Trial};
use system_tests::python;
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
    let numpy = python::has("numpy", "numpy");
    if let Err(reason) = &numpy {
        eprintln!("{reason}: the tests of the Python package are ignored");
    } else {
        put_together(package.path());
    }
    let trials = SCRIPTS.iter().map(|(script, needs)| {
        let missing = needs
            .iter()
            .find_map(|package| python::has(package, package).err());
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
    let path = |path: &Path| path.display().to_string();
    let environment = [
        ("PYTHONPATH", path(package)),
        ("CANTER_COMMAND", path(&package.join("bin/canter"))),
        ("MPLBACKEND", "Agg".to_owned()),
        (
            "PYTHONWARNINGS",
            "error::DeprecationWarning:canter".to_owned(),
        ),
    ];
    let script = format!("python/tests/{script}.py");
    python::run(&script, [""; 0], environment)?;
    Ok(())
}
