//! Other processes of this benchmark.

use std::process::{Child, Command};
use std::thread::sleep;
use std::time::Duration;

use ipc::Arm;

/// Another process of this benchmark, ended when dropped.
pub(crate) struct Peer(pub(crate) Child);

impl Peer {
    pub(crate) fn start(role: &str, arm: &Arm) -> Self {
        let me = std::env::current_exe().unwrap();
        let child = Command::new(me)
            .args(["--peer", role, &arm.to_string()])
            .spawn()
            .unwrap();
        sleep(Duration::from_millis(300));
        Self(child)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
