//! The directory in which the processes of one user find each other.

use std::ffi::OsString;
use std::fs::{self, DirBuilder, Metadata};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{DirBuilderExt, MetadataExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::IpcError;

/// The environment variable that names the directory, for programs that have no option for it.
pub const DOMAIN_VARIABLE: &str = "CANTER_DOMAIN";

/// The longest path of the directory (bytes); iceoryx2 appends up to 140 and takes 255.
const LONGEST: usize = 110;

/// Bits of a mode that give rights to other users.
const OTHERS: u32 = 0o077;

/// Where engine, driver and clients find each other: a directory that belongs to one user alone,
/// and the prefix of that directory's segments in `/dev/shm`.
///
/// Two processes find each other only in the same domain. Each user has one; another directory
/// makes another domain, for example for a test run.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let domain = ipc::Domain::open(&folder.path().join("cell"))?;
/// assert_eq!(domain.arm("kitting/left")?.to_string(), "kitting/left");
/// assert!(domain.arm("no spaces/please").is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Domain(Arc<Place>);

#[derive(Debug, PartialEq, Eq, Hash)]
struct Place {
    directory: PathBuf,
    prefix: String,
}

impl Domain {
    /// The domain of a process, chosen in its outermost layer: `directory` if given, otherwise the
    /// first of
    ///
    /// 1. the directory that `CANTER_DOMAIN` names,
    /// 2. `canter` in the directory that `XDG_RUNTIME_DIR` names,
    /// 3. `canter` in `/run/user/UID`,
    /// 4. `/dev/shm/canter-UID`.
    ///
    /// 2 and 3 count only if that directory belongs to this user and is closed to others.
    /// `environment` gives the value of a variable: pass `|name| std::env::var_os(name)`.
    ///
    /// # Errors
    /// As [`Self::open`], for the directory that was chosen.
    pub fn choose(
        directory: Option<&Path>,
        environment: impl Fn(&str) -> Option<OsString>,
    ) -> Result<Self, IpcError> {
        let set = |name| environment(name).filter(|value| !value.is_empty());
        let named = directory.map(Path::to_owned);
        if let Some(named) = named.or_else(|| set(DOMAIN_VARIABLE).map(PathBuf::from)) {
            return Self::open(&named);
        }
        let user = effective_user();
        let runtime = set("XDG_RUNTIME_DIR").map(PathBuf::from);
        let usual = PathBuf::from(format!("/run/user/{user}"));
        let usable = runtime.into_iter().chain([usual]).find(|path| {
            path.is_absolute() && fs::metadata(path).is_ok_and(|found| refusal(&found).is_none())
        });
        match usable {
            Some(runtime) => Self::open(&runtime.join("canter")),
            None => Self::open(&PathBuf::from(format!("/dev/shm/canter-{user}"))),
        }
    }

    /// The domain of `directory`, which is made (mode 0700) if it is missing.
    ///
    /// # Errors
    /// [`IpcError::Domain`] when it is not a directory of this user with mode 0700, when another
    /// user could rename it, or when its path is longer than 110 bytes.
    pub fn open(directory: &Path) -> Result<Self, IpcError> {
        let fail = |cause: String, remedy: String| IpcError::Domain {
            directory: directory.to_owned(),
            cause,
            remedy,
        };
        let failed = |cause: io::Error| {
            let remedy = "choose another with --domain or CANTER_DOMAIN".to_owned();
            fail(cause.to_string(), remedy)
        };
        match DirBuilder::new().mode(0o700).create(directory) {
            Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => {
                return Err(failed(cause));
            }
            _ => {}
        }
        // The link itself, not its target: the owner of a link can change it.
        let found = fs::symlink_metadata(directory).map_err(failed)?;
        if let Some((cause, remedy)) = refusal(&found) {
            return Err(fail(
                cause,
                remedy.replace("DIR", &directory.to_string_lossy()),
            ));
        }
        let whole = fs::canonicalize(directory).map_err(failed)?;
        let open = whole
            .ancestors()
            .skip(1)
            .find(|above| is_open_to_all(above));
        if let Some(above) = open {
            let cause = format!("anybody may rename it, {} is open to all", above.display());
            return Err(fail(cause, format!("chmod o-w {}", above.display())));
        }
        let path = whole.as_os_str().as_bytes();
        if path.len() > LONGEST || !path.iter().all(|byte| byte.is_ascii_graphic()) {
            let cause = format!(
                "the path is {} bytes long, or not of plain letters, digits and signs",
                path.len()
            );
            let remedy = format!("choose a path of at most {LONGEST} such bytes");
            return Err(fail(cause, remedy));
        }
        let prefix = format!(
            "canter_{}_{:x}_{:x}_",
            found.uid(),
            found.dev(),
            found.ino()
        );
        Ok(Self(Arc::new(Place {
            directory: whole,
            prefix,
        })))
    }

    /// The directory, without links.
    pub fn directory(&self) -> &Path {
        &self.0.directory
    }

    /// The prefix of the segment names in `/dev/shm`: `canter_UID_DEVICE_INODE_`, the numbers of
    /// the directory in hexadecimal digits.
    pub fn prefix(&self) -> &str {
        &self.0.prefix
    }
}

/// The effective user number of this process.
fn effective_user() -> u32 {
    // SAFETY: the call has no preconditions and cannot fail.
    #[expect(
        unsafe_code,
        reason = "the standard library does not show the user's number"
    )]
    unsafe {
        libc::geteuid()
    }
}

/// Why a directory is not this user's alone, and the command that makes it so.
fn refusal(found: &Metadata) -> Option<(String, &'static str)> {
    let user = effective_user();
    if !found.is_dir() {
        let cause = "it is not a directory (a link to one does not count)".to_owned();
        return Some((cause, "name a directory"));
    }
    if found.uid() != user {
        let cause = format!("it belongs to user {}, not to user {user}", found.uid());
        return Some((cause, "choose another with --domain or CANTER_DOMAIN"));
    }
    let mode = found.mode() & 0o7777;
    (mode & OTHERS != 0).then(|| {
        let cause = format!("other users may look into it (mode {mode:04o})");
        (cause, "chmod 700 DIR")
    })
}

/// Whether everybody may rename entries of a directory.
fn is_open_to_all(directory: &Path) -> bool {
    const STICKY: u32 = 0o1000;
    const ALL_WRITE: u32 = 0o002;
    fs::metadata(directory)
        .is_ok_and(|found| found.mode() & ALL_WRITE != 0 && found.mode() & STICKY == 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;
    use std::os::unix::fs::{PermissionsExt, symlink};

    fn environment(pairs: &[(&str, &Path)]) -> impl Fn(&str) -> Option<OsString> + use<> {
        let pairs: Vec<_> = pairs
            .iter()
            .map(|(name, value)| (name.to_string(), value.as_os_str().to_owned()))
            .collect();
        move |name| {
            let found = pairs.iter().find(|(known, _)| known == name);
            found.map(|(_, value)| value.clone())
        }
    }

    #[test]
    fn the_nearest_choice_wins() {
        let folder = tempfile::tempdir().unwrap();
        let [option, variable, runtime] =
            ["option", "variable", "runtime"].map(|name| folder.path().join(name));
        DirBuilder::new().mode(0o700).create(&runtime).unwrap();
        let both = environment(&[(DOMAIN_VARIABLE, &variable), ("XDG_RUNTIME_DIR", &runtime)]);
        let chosen = Domain::choose(Some(&option), &both).unwrap();
        assert!(chosen.directory().ends_with("option"), "{chosen:?}");
        let chosen = Domain::choose(None, &both).unwrap();
        assert!(chosen.directory().ends_with("variable"), "{chosen:?}");
        let chosen = Domain::choose(None, environment(&[("XDG_RUNTIME_DIR", &runtime)])).unwrap();
        assert!(chosen.directory().ends_with("runtime/canter"), "{chosen:?}");
        let mode = fs::metadata(chosen.directory()).unwrap().mode();
        assert_eq!(mode & 0o7777, 0o700);
    }

    /// A runtime directory that others may open, or that belongs to another user, is not used.
    #[test]
    fn a_runtime_directory_of_others_does_not_count() {
        let folder = tempfile::tempdir().unwrap();
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).unwrap();
        let open = environment(&[("XDG_RUNTIME_DIR", folder.path())]);
        let chosen = Domain::choose(None, open).unwrap();
        assert!(!chosen.directory().starts_with(folder.path()), "{chosen:?}");
    }

    #[test]
    fn a_directory_that_is_not_ours_alone_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("domain");
        let real = Domain::open(&path).unwrap();
        assert_eq!(Domain::open(&path).unwrap(), real, "the second to come");

        let link = folder.path().join("link");
        symlink(&path, &link).unwrap();
        let error = Domain::open(&link).unwrap_err().to_string();
        assert!(error.contains("not a directory"), "{error}");

        fs::set_permissions(&path, Permissions::from_mode(0o750)).unwrap();
        let error = Domain::open(&path).unwrap_err().to_string();
        assert!(
            error.contains("mode 0750") && error.contains("chmod 700 /"),
            "{error}"
        );
        fs::set_permissions(&path, Permissions::from_mode(0o700)).unwrap();

        fs::set_permissions(folder.path(), Permissions::from_mode(0o777)).unwrap();
        let error = Domain::open(&path).unwrap_err().to_string();
        assert!(error.contains("anybody may rename it"), "{error}");

        let long = folder.path().join("x".repeat(LONGEST));
        fs::set_permissions(folder.path(), Permissions::from_mode(0o700)).unwrap();
        let error = Domain::open(&long).unwrap_err().to_string();
        assert!(error.contains("at most 110"), "{error}");
    }

    /// The test changes a directory's owner, which only the superuser may.
    #[test]
    fn a_directory_of_another_user_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("theirs");
        Domain::open(&path).unwrap();
        if std::os::unix::fs::chown(&path, Some(12_345), None).is_err() {
            println!("ignored: no right to give a directory away");
            return;
        }
        let error = Domain::open(&path).unwrap_err().to_string();
        assert!(error.contains("belongs to user 12345"), "{error}");
    }

    #[test]
    fn two_directories_are_two_domains() {
        let folder = tempfile::tempdir().unwrap();
        let [one, two] =
            ["one", "two"].map(|name| Domain::open(&folder.path().join(name)).unwrap());
        assert_ne!(one.prefix(), two.prefix());
        assert_ne!(one.arm("a/b").unwrap(), two.arm("a/b").unwrap());
    }
}
