//! What an engine says of itself.

use std::time::{Duration, Instant};

use serde_json::Value;

use crate::canter::canter;

/// The status of an engine that is there.
pub(crate) fn status(arm: &str) -> Value {
    let ran = canter(["status", "--json", "--arm", arm]);
    assert_eq!(ran.code, 0, "{}", ran.stderr);
    serde_json::from_str(&ran.stdout).unwrap()
}

/// Waits until the status is as wanted.
pub(crate) fn wait_for(arm: &str, what: &str, wanted: impl Fn(&Value) -> bool) -> Value {
    let deadline = Instant::now() + Duration::from_secs(120);
    loop {
        let now = status(arm);
        if wanted(&now) {
            return now;
        }
        assert!(
            Instant::now() < deadline,
            "{what} did not come about: {now}"
        );
    }
}
