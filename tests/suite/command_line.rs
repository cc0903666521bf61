//! The command line as a user meets it: what it answers, where, and with which exit code.

use crate::canter::canter;

#[test]
fn help_is_an_answer() {
    let ran = canter(["--help"]);
    assert_eq!(ran.code, 0);
    assert!(ran.stdout.contains("Usage: canter"), "{}", ran.stdout);
    assert_eq!(ran.stderr, "");
}

#[test]
fn the_version_is_an_answer() {
    assert_eq!(
        canter(["--version"]).stdout,
        concat!("canter ", env!("CARGO_PKG_VERSION"), "\n")
    );
}

#[test]
fn an_unknown_command_is_a_usage_error() {
    let ran = canter(["dance"]);
    assert_eq!(ran.code, 2);
    assert_eq!(ran.stdout, "");
    assert!(ran.stderr.contains("dance"), "{}", ran.stderr);
}

#[test]
fn every_shell_gets_completions() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let ran = canter(["completions", shell]);
        assert_eq!((ran.code, ran.stderr.as_str()), (0, ""), "{shell}");
        assert!(ran.stdout.contains("completions"), "{shell}");
    }
}

#[test]
fn every_command_has_a_manual_page() {
    assert!(canter(["man"]).stdout.contains(".TH canter 1"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("man1");
    assert_eq!(canter(["man", "--folder", path.to_str().unwrap()]).code, 0);
    for page in ["canter.1", "canter-man.1", "canter-completions.1"] {
        assert!(path.join(page).exists(), "{page}");
    }
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    use std::io::Read;
    let mut child = crate::canter::command(["man"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut stderr = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut stderr)
        .unwrap();
    assert_eq!(
        (child.wait().unwrap().code(), stderr.as_str()),
        (Some(0), "")
    );
}
