//! When the kernel received what a socket of another library gave last.

use std::collections::BTreeSet;
use std::io;
use std::os::fd::{AsRawFd, BorrowedFd, OwnedFd, RawFd};
use std::path::PathBuf;
use std::time::{Duration, SystemTime};

/// The request for the time stamp of the last datagram (`linux/sockios.h`), where a time has 64 bits.
const SIOCGSTAMPNS: libc::Ioctl = 0x8907;

/// Where the kernel lists what a process has open.
const OPEN: &str = "/proc/self/fd";

/// The sockets that this process had at a time.
///
/// ```
/// use std::net::UdpSocket;
///
/// let before = driver_franka::Sockets::now();
/// let socket = UdpSocket::bind("127.0.0.1:0")?;
/// let arrivals = before.arrivals_of_new().expect("one new socket");
/// socket.send_to(b"a", socket.local_addr()?)?;
/// socket.recv(&mut [0; 1])?;
/// assert!(arrivals.last().is_some());
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Sockets(BTreeSet<PathBuf>);

impl Sockets {
    /// Those of this moment.
    pub fn now() -> Self {
        Self(list().into_iter().map(|(name, _)| name).collect())
    }

    /// The arrivals at the one UDP socket that is new since then; nothing where there is none, or more than one.
    pub fn arrivals_of_new(&self) -> Option<Arrivals> {
        let new = list()
            .into_iter()
            .filter(|(name, _)| !self.0.contains(name));
        let mut found = new.filter_map(|(_, descriptor)| datagrams(descriptor));
        let socket = found.next()?;
        if found.next().is_some() {
            return None;
        }
        let arrivals = Arrivals(socket);
        // The kernel keeps time stamps from the first question on.
        let _ = arrivals.last();
        Some(arrivals)
    }
}

/// The arrivals at a socket.
#[derive(Debug)]
pub struct Arrivals(OwnedFd);

impl Arrivals {
    /// When the datagram came that was read last, by the system's clock; nothing before the first.
    #[expect(
        unsafe_code,
        reason = "the standard library has no time stamps of datagrams"
    )]
    pub fn last(&self) -> Option<SystemTime> {
        let mut stamp = libc::timespec {
            tv_sec: 0,
            tv_nsec: 0,
        };
        // SAFETY: the descriptor is open; the kernel writes one `timespec`.
        let got = unsafe { libc::ioctl(self.0.as_raw_fd(), SIOCGSTAMPNS, &raw mut stamp) };
        let seconds = u64::try_from(stamp.tv_sec).ok()?;
        let nanoseconds = u32::try_from(stamp.tv_nsec).ok()?;
        (got == 0).then(|| SystemTime::UNIX_EPOCH + Duration::new(seconds, nanoseconds))
    }

    /// How long ago that was (s); 0 where it is not known, or the system's clock was set meanwhile.
    pub fn age(&self) -> f64 {
        let age = self.last().and_then(|last| last.elapsed().ok());
        let age = age.unwrap_or_default();
        if age < Duration::from_secs(1) {
            age.as_secs_f64()
        } else {
            0.0
        }
    }
}

/// The sockets of this process: the kernel's name of each, which is never used twice while it is open, and its
/// descriptor.
fn list() -> Vec<(PathBuf, RawFd)> {
    let Ok(entries) = std::fs::read_dir(OPEN) else {
        return Vec::new();
    };
    let named = entries.filter_map(|entry| {
        let path = entry.ok()?.path();
        let descriptor = path.file_name()?.to_str()?.parse().ok()?;
        Some((std::fs::read_link(&path).ok()?, descriptor))
    });
    named
        .filter(|(name, _)| name.to_string_lossy().starts_with("socket:"))
        .collect()
}

/// A descriptor of our own for a socket of UDP over IPv4; nothing if it is another one.
#[expect(
    unsafe_code,
    reason = "the library that opened the socket keeps it to itself"
)]
fn datagrams(descriptor: RawFd) -> Option<OwnedFd> {
    let is = |option, wanted| matches!(number(descriptor, option), Ok(found) if found == wanted);
    if !is(libc::SO_TYPE, libc::SOCK_DGRAM) || !is(libc::SO_DOMAIN, libc::AF_INET) {
        return None;
    }
    // SAFETY: the descriptor was open a moment ago; if it is not any more, the copy fails or is one of another
    // file, of which nothing is read or written.
    let borrowed = unsafe { BorrowedFd::borrow_raw(descriptor) };
    borrowed.try_clone_to_owned().ok()
}

/// An option of a socket that is a number.
#[expect(unsafe_code, reason = "the standard library asks its own sockets only")]
fn number(descriptor: RawFd, option: libc::c_int) -> io::Result<libc::c_int> {
    let mut found: libc::c_int = 0;
    let mut length = size_of::<libc::c_int>() as libc::socklen_t;
    let value = (&raw mut found).cast();
    // SAFETY: value and length are on the stack, and the length is that of the value.
    let got =
        unsafe { libc::getsockopt(descriptor, libc::SOL_SOCKET, option, value, &raw mut length) };
    if got == 0 {
        Ok(found)
    } else {
        Err(io::Error::last_os_error())
    }
}
