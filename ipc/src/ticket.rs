//! Decides whether a request was taken or withdrawn: exactly one of the two, whatever the order of
//! events.
//!
//! A request may wait in its channel for longer than its sender waits. So the sender first makes a
//! file, the ticket. The process that removes the file decides: the engine takes the request, or
//! the sender withdraws it. A file can be removed only once.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use crate::{Domain, IpcError};

/// The folder of tickets in a domain's directory.
const FOLDER: &str = "requests";

/// The number of a request, unique in a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestId {
    /// The process that asks.
    pub process: u32,
    /// Time of the request (ns since 1970), later than all earlier requests of the process.
    pub asked_ns: u64,
}

impl RequestId {
    /// A number for a request of this process.
    pub(crate) fn new() -> Self {
        use core::sync::atomic::{AtomicU64, Ordering};
        static LAST: AtomicU64 = AtomicU64::new(0);
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = since.unwrap_or_default().as_nanos() as u64;
        // Two threads of one process may ask in the same nanosecond.
        let last = LAST.fetch_max(now, Ordering::Relaxed);
        let asked_ns = if last < now {
            now
        } else {
            LAST.fetch_add(1, Ordering::Relaxed) + 1
        };
        Self {
            process: std::process::id(),
            asked_ns,
        }
    }

    fn path(self, domain: &Domain) -> PathBuf {
        let name = format!("{}-{}", self.process, self.asked_ns);
        domain.directory().join(FOLDER).join(name)
    }
}

/// A request that may still be withdrawn. It is locked as long as its sender lives.
#[derive(Debug)]
pub(crate) struct Ticket {
    path: PathBuf,
    _lock: File,
}

impl Ticket {
    /// Makes the ticket of a request that is about to be sent.
    ///
    /// # Errors
    /// [`IpcError::Domain`] when the file cannot be made.
    pub(crate) fn issue(domain: &Domain, id: RequestId) -> Result<Self, IpcError> {
        let fail = |cause: io::Error| IpcError::Domain {
            directory: domain.directory().to_owned(),
            cause: format!("cannot write the request: {cause}"),
            remedy: "canter doctor".to_owned(),
        };
        let folder = domain.directory().join(FOLDER);
        match DirBuilder::new().mode(0o700).create(&folder) {
            Err(cause) if cause.kind() != io::ErrorKind::AlreadyExists => return Err(fail(cause)),
            _ => {}
        }
        // Locked under another name, so that no process sees an unlocked ticket.
        let path = id.path(domain);
        let draft = path.with_extension("draft");
        let lock = OpenOptions::new()
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(&draft)
            .map_err(fail)?;
        let placed = lock.lock().and_then(|()| fs::rename(&draft, &path));
        if let Err(cause) = placed {
            // A file that cannot be renamed is removed; the error is returned.
            let _ = fs::remove_file(&draft);
            return Err(fail(cause));
        }
        Ok(Self { path, _lock: lock })
    }

    /// Withdraws the request; `false` when the engine has taken it.
    pub(crate) fn withdraw(self) -> bool {
        fs::remove_file(&self.path).is_ok()
    }
}

/// Takes a request for its engine; `false` when its sender has withdrawn it or has died.
pub(crate) fn take(domain: &Domain, id: RequestId) -> bool {
    let path = id.path(domain);
    let alive = is_locked(&path);
    fs::remove_file(&path).is_ok() && alive
}

/// Removes the tickets of senders that have died. One that is being made or taken stays.
pub(crate) fn sweep(domain: &Domain) {
    let folder = domain.directory().join(FOLDER);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let is_draft = path.extension().is_some();
        if !is_draft && !is_locked(&path) {
            // Another process may have done the same.
            let _ = fs::remove_file(path);
        }
    }
}

/// Whether the process that made the file still runs.
fn is_locked(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| matches!(file.try_lock(), Err(TryLockError::WouldBlock)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The steps of sender and engine for one request.
    #[derive(Default)]
    struct World {
        ticket: Option<Ticket>,
        sent: bool,
        received: bool,
        taken: u32,
        withdrawn: bool,
        dead: bool,
    }

    type Step = fn(&mut World, &Domain, RequestId);

    /// The sender sends, and gives up.
    const SENDER: [Step; 3] = [
        |world, domain, id| world.ticket = Some(Ticket::issue(domain, id).unwrap()),
        |world, _, _| world.sent = true,
        |world, _, _| world.withdrawn = world.ticket.take().unwrap().withdraw(),
    ];

    /// The sender sends, and dies.
    const DYING: [Step; 3] = [SENDER[0], SENDER[1], |world, _, _| {
        world.ticket = None;
        world.dead = true;
    }];

    /// The engine receives a request and takes it; it gets the request twice.
    const ENGINE: [Step; 4] = [receive, take_it, receive, take_it];

    fn receive(world: &mut World, _: &Domain, _: RequestId) {
        world.received = world.sent;
    }

    fn take_it(world: &mut World, domain: &Domain, id: RequestId) {
        if std::mem::take(&mut world.received) {
            world.taken += u32::from(take(domain, id));
        }
    }

    /// Every order of the steps of two sides, as a list of who is next.
    fn orders(left: usize, right: usize) -> Vec<Vec<bool>> {
        if left == 0 || right == 0 {
            return vec![[vec![true; left], vec![false; right]].concat()];
        }
        let mut all = Vec::new();
        for (first, rest) in [
            (true, orders(left - 1, right)),
            (false, orders(left, right - 1)),
        ] {
            all.extend(rest.into_iter().map(|order| [vec![first], order].concat()));
        }
        all
    }

    fn play(domain: &Domain, sender: &[Step], order: &[bool]) -> World {
        let id = RequestId::new();
        let mut world = World::default();
        let (mut left, mut right) = (sender.iter(), ENGINE.iter());
        for sends in order {
            let step = if *sends { left.next() } else { right.next() };
            step.unwrap()(&mut world, domain, id);
        }
        world
    }

    /// In every order of events exactly one of the two decides, and a request is taken once.
    #[test]
    fn taken_or_withdrawn_in_every_order() {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::open(&folder.path().join("domain")).unwrap();
        let (mut taken, mut withdrawn) = (0, 0);
        for order in orders(SENDER.len(), ENGINE.len()) {
            let world = play(&domain, &SENDER, &order);
            assert!(world.taken <= 1, "{order:?}");
            assert_eq!(world.taken == 0, world.withdrawn, "{order:?}");
            taken += world.taken;
            withdrawn += u32::from(world.withdrawn);
        }
        assert!(
            taken > 0 && withdrawn > 0,
            "{taken} taken, {withdrawn} withdrawn"
        );
    }

    /// A request whose sender died before it was taken is not taken any more.
    #[test]
    fn a_dead_sender_has_asked_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::open(&folder.path().join("domain")).unwrap();
        for order in orders(DYING.len(), ENGINE.len()) {
            let world = play(&domain, &DYING, &order);
            assert!(world.dead && world.taken <= 1);
            let death = order.iter().enumerate().filter(|(_, sends)| **sends);
            let death = death.map(|(index, _)| index).nth(2).unwrap();
            let before = order[..death].iter().filter(|sends| !**sends).count();
            let sent = order.iter().enumerate().filter(|(_, sends)| **sends).nth(1);
            let sent = sent.map(|(index, _)| index).unwrap();
            let early = order[..sent].iter().filter(|sends| !**sends).count();
            // The engine received it and took it between the sending and the death.
            let may = (early <= 0 && before >= 2) || (early <= 2 && before >= 4);
            assert_eq!(world.taken == 1, may, "{order:?}");
        }
        sweep(&domain);
        let left = fs::read_dir(domain.directory().join(FOLDER))
            .unwrap()
            .count();
        assert_eq!(left, 0);
    }

    #[test]
    fn numbers_differ_between_threads() {
        let threads: Vec<_> = (0..4)
            .map(|_| std::thread::spawn(|| (0..1000).map(|_| RequestId::new()).collect::<Vec<_>>()))
            .collect();
        let all = threads
            .into_iter()
            .flat_map(|thread| thread.join().unwrap());
        assert_eq!(all.collect::<std::collections::HashSet<_>>().len(), 4000);
    }
}
