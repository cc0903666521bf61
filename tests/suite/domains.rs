//! Processes meet only in the same domain, and a domain belongs to one user.

use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use ipc::{DOMAIN_VARIABLE, Domain};

use crate::canter::{canter, command};

/// A user that owns nothing here.
const STRANGER: u32 = 12_345;

/// A driver that is ready; ended when dropped.
struct Driver(Child);

impl Driver {
    fn start(command: &mut Command) -> std::io::Result<Self> {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line)?;
        let driver = Self(child);
        assert_eq!(line, "ready\n");
        Ok(driver)
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        // A byte asks for the end, so that no segment stays. It may have ended by itself.
        let _ = self.0.stdin.take().map(|mut input| input.write_all(b"q"));
        let _ = self.0.wait();
    }
}

/// A driver of the arm `domains/arm` for the robot of the repository.
fn driver() -> Command {
    command([
        "driver",
        "sim",
        "--until-end-of-input",
        "--robot",
        "ur5e",
        "--arm",
        "domains/arm",
    ])
}

/// The same arm in another domain is another arm: the processes do not affect each other and are
/// not counted.
#[test]
fn two_domains_do_not_see_each_other() {
    let folder = tempfile::tempdir().unwrap();
    let other = folder.path().join("other");
    let _driver = Driver::start(&mut driver()).unwrap();
    let _second = Driver::start(driver().arg("--domain").arg(&other)).unwrap();
    let third = canter(["driver", "test", "--arm", "domains/nobody"]);
    assert_eq!(third.code, 4);
    let own = ipc::count_nodes(&system_tests::domain::domain()).unwrap();
    let other = ipc::count_nodes(&Domain::open(&other).unwrap()).unwrap();
    assert_eq!((own.alive, other.alive), (1, 1));
}

/// Two users have the same arm at the same time; the second can neither open the first one's
/// directory nor join it, and their own is closed to others.
#[test]
fn two_users_do_not_meet() {
    let ours = system_tests::domain::domain();
    let _driver = Driver::start(&mut driver()).unwrap();
    let mut theirs = driver();
    theirs.uid(STRANGER).gid(STRANGER);
    theirs
        .env_remove(DOMAIN_VARIABLE)
        .env_remove("XDG_RUNTIME_DIR");
    let _their_driver = match Driver::start(&mut theirs) {
        Ok(driver) => driver,
        Err(cause) => {
            println!("ignored: no right to start a process of another user ({cause})");
            return;
        }
    };
    let place = Path::new("/dev/shm").join(format!("canter-{STRANGER}"));
    let mode = std::fs::metadata(&place).unwrap().permissions().mode();
    assert_eq!(mode & 0o7777, 0o700);
    let stranger = |words: &[&str]| {
        let mut command = Command::new(words[0]);
        command.args(&words[1..]).uid(STRANGER).gid(STRANGER);
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (output.status.code(), said)
    };
    let directory = ours.directory().to_str().unwrap();
    for words in [
        &["ls", directory][..],
        &["mv", directory, &format!("{directory}-taken")],
    ] {
        let (code, said) = stranger(words);
        assert_ne!(code, Some(0), "{words:?} {said}");
    }
    let mut joining = command(["status", "--arm", "domains/arm", "--domain", directory]);
    let output = joining.uid(STRANGER).gid(STRANGER).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(
        said.contains("ermission denied") || said.contains("belongs to user"),
        "{said}"
    );
    drop(_their_driver);
    // The second user leaves nothing behind.
    let _ = std::fs::remove_dir_all(place);
}
