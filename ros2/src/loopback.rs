//! Keeps all sockets of this process to the loopback interface.
//!
//! The DDS library binds its sockets to every address. A socket that is bound to a device receives
//! from that device only: the operating system sees to it.

use std::fs;
use std::io;
use std::os::fd::{BorrowedFd, RawFd};

use socket2::{Domain, SockRef, Type};

/// Binds every UDP socket of this process to the loopback interface; gives how many there are.
///
/// # Errors
/// What the operating system says; sockets that were bound before stay bound.
pub(crate) fn keep_to_loopback() -> io::Result<usize> {
    let mut count = 0;
    for entry in fs::read_dir("/proc/self/fd")? {
        let path = entry?.path();
        let is_socket = fs::read_link(&path)
            .is_ok_and(|target| target.to_string_lossy().starts_with("socket:"));
        let number = path
            .file_name()
            .and_then(|name| name.to_str()?.parse().ok());
        if let (true, Some(number)) = (is_socket, number) {
            count += usize::from(bind(number)?);
        }
    }
    Ok(count)
}

/// Binds one socket, if it is a UDP socket.
fn bind(number: RawFd) -> io::Result<bool> {
    // SAFETY: the number was just listed as open. The sockets of the DDS library live as long as its
    // participant, which the caller holds; if another thread closed one meanwhile, the calls below
    // would fail or bind another socket of this process, and nothing is read or closed.
    #[expect(unsafe_code, reason = "decision 0144")]
    let socket = unsafe { BorrowedFd::borrow_raw(number) };
    let socket = SockRef::from(&socket);
    let of_network = matches!(socket.domain()?, Domain::IPV4 | Domain::IPV6);
    if !of_network || socket.r#type()? != Type::DGRAM {
        return Ok(false);
    }
    socket.bind_device(Some(b"lo"))?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::net::{Ipv4Addr, UdpSocket};

    /// A socket that listens on every address is bound to the loopback device, and still hears what
    /// comes from there.
    #[test]
    fn sockets_hear_the_loopback_only() {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).unwrap();
        assert!(SockRef::from(&socket).device().unwrap().is_none());
        assert!(keep_to_loopback().unwrap() >= 1);
        assert_eq!(SockRef::from(&socket).device().unwrap().unwrap(), b"lo");
        let port = socket.local_addr().unwrap().port();
        let other = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        other.send_to(b"x", (Ipv4Addr::LOCALHOST, port)).unwrap();
        let mut buffer = [0; 4];
        socket
            .set_read_timeout(Some(std::time::Duration::from_secs(20)))
            .unwrap();
        assert_eq!(socket.recv(&mut buffer).unwrap(), 1);
    }
}
