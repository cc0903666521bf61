//! The Debian package, as `packaging/deb.sh` makes it.

use std::path::{Path, PathBuf};
use std::process::Command;

use system_tests::repository::root;

/// Makes the package of the command under test in a folder.
fn package(folder: &Path) -> PathBuf {
    let ran = Command::new(root().join("packaging/deb.sh"))
        .arg(folder)
        .env("CANTER", env!("CARGO_BIN_EXE_canter-under-test"))
        .env(
            "CANTER_FLEET",
            env!("CARGO_BIN_EXE_canter-fleet-under-test"),
        )
        .env("SOURCE_DATE_EPOCH", "1700000000")
        .env("COMPRESSION", "none")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&ran.stderr).into_owned();
    assert!(ran.status.success(), "{said}");
    PathBuf::from(String::from_utf8(ran.stdout).unwrap().trim())
}

/// What a tool says.
fn said(program: &str, words: &[&str]) -> Option<String> {
    let ran = Command::new(program).args(words).output().ok()?;
    ran.status
        .success()
        .then(|| String::from_utf8_lossy(&ran.stdout).into_owned())
}

#[test]
fn the_debian_package_is_whole_and_the_same_every_time() {
    for tool in ["dpkg-deb", "objdump", "strip"] {
        if said(tool, &["--version"]).is_none() {
            return println!("ignored: there is no {tool}");
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["first", "second"].map(|name| package(&folder.path().join(name)));
    let path = first.to_str().unwrap();
    let control = said("dpkg-deb", &["--info", path]).unwrap();
    let version = concat!("Version: ", env!("CARGO_PKG_VERSION"));
    for line in ["Package: canter", version, "Depends: libc6 (>= 2."] {
        assert!(control.contains(line), "{line}: {control}");
    }
    let files = said("dpkg-deb", &["--contents", path]).unwrap();
    for file in [
        "./usr/bin/canter",
        "./usr/bin/canter-fleet",
        "./usr/share/man/man1/canter.1.gz",
        "./usr/share/man/man1/canter-engine.1.gz",
        "./usr/share/man/man1/canter-fleet.1.gz",
        "./usr/share/man/man1/canter-fleet-cell.1.gz",
        "./usr/share/bash-completion/completions/canter",
        "./usr/share/bash-completion/completions/canter-fleet",
        "./usr/share/zsh/vendor-completions/_canter",
        "./usr/share/fish/vendor_completions.d/canter.fish",
        "./etc/security/limits.d/canter.conf",
        "./usr/lib/systemd/system/canter@.service",
        "./usr/lib/systemd/system/canter-fleet@.service",
        "./usr/lib/systemd/system/canter-fleet-router.service",
        "./usr/lib/sysusers.d/canter.conf",
        "./usr/share/doc/canter/examples/pick_and_place.canon",
    ] {
        assert!(files.lines().any(|line| line.ends_with(file)), "{file}");
    }
    assert!(files.lines().all(|line| line.contains(" root/root ")));
    let bytes = [first, second].map(|path| std::fs::read(path).unwrap());
    assert!(bytes[0] == bytes[1], "two packages of one binary differ");
}
