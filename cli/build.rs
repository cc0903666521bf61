//! Names the commit that a release was built from, for `canter --version`.
//!
//! Other profiles name none: the command would be compiled again after each commit.

use std::process::Command;

/// What git prints; `None` where there is no git or no repository.
fn git(words: &[&str]) -> Option<String> {
    let ran = Command::new("git").args(words).output().ok()?;
    let text = String::from_utf8(ran.stdout).ok()?;
    let line = text.trim();
    (ran.status.success() && !line.is_empty()).then(|| line.to_owned())
}

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let version = std::env::var("CARGO_PKG_VERSION").unwrap_or_default();
    let release = std::env::var("PROFILE").is_ok_and(|profile| profile == "release");
    let commit = release.then(|| git(&["rev-parse", "--short=10", "HEAD"]));
    let Some(commit) = commit.flatten() else {
        println!("cargo::rustc-env=CANTER_VERSION={version}");
        return;
    };
    // A new commit changes one of these files; in a work tree they are not in one folder.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    let changed = git(&["status", "--porcelain", "--untracked-files=no"]).is_some();
    let mark = if changed { ", changed" } else { "" };
    println!("cargo::rustc-env=CANTER_VERSION={version} ({commit}{mark})");
}
