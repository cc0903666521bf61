//! A separate domain for each test process, so that no test sees another Canter process of this
//! user.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use ipc::{Arm, DOMAIN_VARIABLE, Domain};

/// The domain of this test process; processes that it starts join it with [`join`].
///
/// Its directory is named after the process. The first call in a process removes what earlier test
/// processes have left: directories, and segments of those that were killed.
///
/// # Panics
/// The directory cannot be made; a test stops there.
pub fn domain() -> Domain {
    static DOMAIN: OnceLock<Domain> = OnceLock::new();
    DOMAIN
        .get_or_init(|| {
            let above = std::env::temp_dir().join(format!("canter-tests-{}", user()));
            Domain::open(&above).expect("a directory for the tests");
            remove_of_the_dead(&above);
            let own = above.join(std::process::id().to_string());
            // A directory of an earlier process with the same number.
            let _ = fs::remove_dir_all(&own);
            Domain::open(&own).expect("a directory for this test")
        })
        .clone()
}

/// The arm of this name in the domain of this test process.
///
/// # Panics
/// The name is not `cell/arm`.
pub fn arm(name: &str) -> Arm {
    domain().arm(name).expect("the name of an arm")
}

/// Lets a process that is about to be started join the domain of this test process.
pub fn join(command: &mut Command) -> &mut Command {
    command.env(DOMAIN_VARIABLE, domain().directory())
}

/// The domain that the process which started this one has chosen.
///
/// # Errors
/// Its directory cannot be used.
pub fn inherited() -> Result<Domain, ipc::IpcError> {
    Domain::choose(None, |name| std::env::var_os(name))
}

/// The number of this user, as the owner of this process.
fn user() -> u32 {
    use std::os::unix::fs::MetadataExt;
    fs::metadata("/proc/self").map_or(0, |found| found.uid())
}

/// Removes the directories in `above` whose process is gone, and their segments.
fn remove_of_the_dead(above: &Path) {
    let listed = fs::read_dir(above).into_iter().flatten().flatten();
    for path in listed.map(|entry| entry.path()) {
        let dead = path
            .file_name()
            .is_some_and(|number| !Path::new("/proc").join(number).exists());
        if dead && let Ok(domain) = Domain::open(&path) {
            segments(&domain).iter().for_each(|segment| {
                // Another test process may be doing the same.
                let _ = fs::remove_file(segment);
            });
            let _ = fs::remove_dir_all(&path);
        }
    }
}

/// The segments of a domain in `/dev/shm`.
pub fn segments(domain: &Domain) -> Vec<PathBuf> {
    let listed = fs::read_dir("/dev/shm").into_iter().flatten().flatten();
    let ours = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with(domain.prefix());
    listed
        .filter(|entry| ours(&entry.file_name()))
        .map(|entry| entry.path())
        .collect()
}
