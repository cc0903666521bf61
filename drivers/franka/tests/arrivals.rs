//! The age of a state is what the kernel says, not how long the driver waited for it.
#![allow(clippy::unwrap_used, reason = "a test may stop where it fails")]

use std::net::UdpSocket;
use std::thread;
use std::time::{Duration, SystemTime};

use driver_franka::Sockets;

const PAUSE: Duration = Duration::from_millis(20);

/// Two sockets that this process opens meanwhile are two: the tests take turns.
static ONE: std::sync::Mutex<()> = std::sync::Mutex::new(());

#[test]
fn a_state_that_came_late_is_not_old() {
    let _one = ONE.lock();
    let before = Sockets::now();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let arrivals = before.arrivals_of_new().unwrap();
    let sender = socket.try_clone().unwrap();
    let sending = thread::spawn(move || {
        thread::sleep(PAUSE);
        let sent = SystemTime::now();
        sender.send_to(b"x", sender.local_addr().unwrap()).unwrap();
        sent
    });
    socket.recv(&mut [0; 1]).unwrap();
    // However long the wait was: it was sent after the wait began.
    assert!(arrivals.last().unwrap() >= sending.join().unwrap());
}

#[test]
fn a_state_that_waited_in_the_socket_is_old() {
    let _one = ONE.lock();
    let before = Sockets::now();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let arrivals = before.arrivals_of_new().unwrap();
    let to = socket.local_addr().unwrap();
    // Under load the kernel may take a datagram later than it was sent.
    let mut ages = (0..5).map(|_| {
        socket.send_to(b"x", to).unwrap();
        thread::sleep(PAUSE);
        socket.recv(&mut [0; 1]).unwrap();
        arrivals.age()
    });
    assert!(ages.any(|age| age >= PAUSE.as_secs_f64()));
}

#[test]
fn two_new_sockets_are_none() {
    let _one = ONE.lock();
    let before = Sockets::now();
    let _two = [(); 2].map(|()| UdpSocket::bind("127.0.0.1:0").unwrap());
    assert!(before.arrivals_of_new().is_none());
}
