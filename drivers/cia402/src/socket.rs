//! Ethernet frames of EtherCAT over one network interface.

use std::ffi::CString;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::{AsRawFd, FromRawFd};
use std::time::Duration;

/// The type of EtherCAT's Ethernet frames.
const ETHERCAT: u16 = 0x88A4;

/// A socket that sends and receives the frames of EtherCAT, and no others, on one interface.
#[derive(Debug)]
pub struct EtherSocket(File);

impl EtherSocket {
    /// Opens it; needs the right `CAP_NET_RAW`.
    ///
    /// # Errors
    /// What the operating system says: no such interface, or no right.
    #[expect(unsafe_code, reason = "the standard library has no packet sockets")]
    pub fn open(interface: &str) -> io::Result<Self> {
        let name = CString::new(interface)?;
        // SAFETY: the name ends with 0; the number is 0 for none.
        let index = unsafe { libc::if_nametoindex(name.as_ptr()) };
        if index == 0 {
            return Err(io::Error::last_os_error());
        }
        let kind = libc::SOCK_RAW | libc::SOCK_NONBLOCK | libc::SOCK_CLOEXEC;
        let protocol = i32::from(ETHERCAT.to_be());
        // SAFETY: takes numbers only; the result is checked.
        let descriptor = unsafe { libc::socket(libc::AF_PACKET, kind, protocol) };
        if descriptor < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the descriptor is open and owned by nobody else.
        let socket = unsafe { File::from_raw_fd(descriptor) };
        // SAFETY: all fields are numbers, for which 0 is a value.
        let mut address: libc::sockaddr_ll = unsafe { core::mem::zeroed() };
        address.sll_family = libc::AF_PACKET as u16;
        address.sll_protocol = ETHERCAT.to_be();
        address.sll_ifindex = index as i32;
        let length = size_of::<libc::sockaddr_ll>() as libc::socklen_t;
        // SAFETY: the address is on the stack and has this length.
        let bound = unsafe { libc::bind(descriptor, (&raw const address).cast(), length) };
        if bound != 0 {
            return Err(io::Error::last_os_error());
        }
        Ok(Self(socket))
    }

    /// Sends a frame; returns its length.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn send(&self, frame: &[u8]) -> io::Result<usize> {
        (&self.0).write(frame)
    }

    /// Waits at most this long for a frame; returns its length, or nothing.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn receive(&self, frame: &mut [u8], wait: Duration) -> io::Result<Option<usize>> {
        if !wait.is_zero() && !self.wait(wait)? {
            return Ok(None);
        }
        match (&self.0).read(frame) {
            Ok(length) => Ok(Some(length)),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// Whether a frame came in time.
    #[expect(
        unsafe_code,
        reason = "the standard library cannot wait for less than a clock tick"
    )]
    fn wait(&self, wait: Duration) -> io::Result<bool> {
        let mut one = libc::pollfd {
            fd: self.0.as_raw_fd(),
            events: libc::POLLIN,
            revents: 0,
        };
        let time = libc::timespec {
            tv_sec: wait.as_secs() as libc::time_t,
            tv_nsec: i64::from(wait.subsec_nanos()),
        };
        // SAFETY: both pointers are to values on the stack; no signal mask.
        let found = unsafe { libc::ppoll(&raw mut one, 1, &raw const time, core::ptr::null()) };
        match found {
            0 => Ok(false),
            1.. => Ok(true),
            _ => {
                let error = io::Error::last_os_error();
                if error.kind() == io::ErrorKind::Interrupted {
                    return Ok(false);
                }
                Err(error)
            }
        }
    }
}
