//! The systemd units of the Debian package: what they start, stopped and killed as systemd does it.
//! `packaging/clean_root.py` shows the same with systemd, as root.

use std::fs;
use std::process::{Child, Command};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;
use system_tests::repository::{files, root};

use crate::canter::{canter, command};

const PATIENCE: Duration = Duration::from_secs(60);

const SLOW: &str = "InitCanon()\nSetLengthUnits(\"meter\")\nSetRelativeSpeed(5)\n\
    MoveTo({{0.45, 0.3, 0.3}, {0,0,-1}, {1,0,0}})\n\
    MoveTo({{0.45, -0.3, 0.3}, {0,0,-1}, {1,0,0}})\nEndCanon(0)\n";

/// The value of a setting in a unit or in a file of variables.
fn setting(text: &str, name: &str) -> Option<String> {
    let head = format!("{name}=");
    let mut values = text.lines().filter_map(|line| line.strip_prefix(&head));
    values.next().map(str::to_owned)
}

fn unit() -> String {
    fs::read_to_string(root().join("packaging/systemd/canter@.service")).unwrap()
}

/// The words that the unit starts, with the variables of the example of its settings.
fn words(arm: &str) -> Vec<String> {
    let variables = fs::read_to_string(root().join("packaging/arm.conf")).unwrap();
    let line = setting(&unit(), "ExecStart").unwrap();
    let value = |name: &str| setting(&variables, name).unwrap();
    let line = line
        .replace("${CANTER_ROBOT}", &value("CANTER_ROBOT"))
        .replace("${CANTER_ARM}", arm)
        .replace("$CANTER_OPTIONS", &value("CANTER_OPTIONS"));
    let words: Vec<_> = line.split_whitespace().map(str::to_owned).collect();
    assert_eq!(words[0], "/usr/bin/canter");
    words[1..].to_vec()
}

/// An engine as the unit starts it; killed when dropped.
struct Service {
    arm: &'static str,
    process: Child,
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

impl Service {
    fn start(arm: &'static str) -> Self {
        let process = command(words(arm)).spawn().unwrap();
        let service = Self { arm, process };
        service.until("an engine", |status| status["idle"] == true);
        service
    }

    fn status(&self) -> Value {
        let ran = canter(["status", "--json", "--arm", self.arm]);
        serde_json::from_str(&ran.stdout).unwrap_or(Value::Null)
    }

    fn until(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let end = Instant::now() + PATIENCE;
        loop {
            let status = self.status();
            if is(&status) {
                return status;
            }
            assert!(Instant::now() < end, "no {what}: {status}");
            sleep(Duration::from_millis(20));
        }
    }

    /// Gives the slow program and waits until the arm moves.
    fn moves(&self) -> Value {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("slow.canon");
        fs::write(&file, SLOW).unwrap();
        let sent = canter([
            "send",
            "--no-wait",
            file.to_str().unwrap(),
            "--arm",
            self.arm,
        ]);
        assert_eq!(sent.code, 0, "{}", sent.stderr);
        let is_moving = |status: &Value| status["command"] == "MoveTo";
        self.until("motion", is_moving);
        sleep(Duration::from_millis(500));
        self.until("motion", is_moving)
    }

    fn signal(&self, signal: &str) {
        kill(&self.process.id().to_string(), signal);
    }

    /// The driver that the engine has started.
    fn driver(&self) -> String {
        let own = self.process.id();
        let children = fs::read_to_string(format!("/proc/{own}/task/{own}/children")).unwrap();
        children.split_whitespace().next().unwrap().to_owned()
    }
}

fn kill(process: &str, signal: &str) {
    let killed = Command::new("kill").args([signal, process]).status();
    assert!(killed.unwrap().success());
}

fn joints(status: &Value) -> Vec<f64> {
    let all = status["joints"].as_array().unwrap();
    all.iter().map(|joint| joint.as_f64().unwrap()).collect()
}

/// Stays where it is for half a second.
fn rests(service: &Service) {
    let before = joints(&service.status());
    sleep(Duration::from_millis(500));
    for (one, other) in joints(&service.status()).iter().zip(&before) {
        assert!((one - other).abs() < 1e-3, "it moves: {one} {other}");
    }
}

/// An engine that was killed in motion starts again without moving, and takes programs.
#[test]
fn a_killed_engine_starts_again_and_rests() {
    assert_eq!(setting(&unit(), "Restart").unwrap(), "on-failure");
    let first = Service::start("units/killed");
    first.moves();
    let driver = first.driver();
    first.signal("-KILL");
    drop(first);
    let end = Instant::now() + PATIENCE;
    // The driver stops the arm by its watchdog, and ends with its engine.
    let left = format!("/proc/{driver}");
    while fs::exists(&left).unwrap() {
        assert!(Instant::now() < end, "the driver outlives its engine");
        sleep(Duration::from_millis(20));
    }
    let second = Service::start("units/killed");
    rests(&second);
    let status = second.status();
    assert!(
        status["fault"].is_null() && status["idle"] == true,
        "{status}"
    );
    second.moves();
}

/// A driver that was killed in motion leaves a latched fault; the service has to be restarted.
#[test]
fn a_killed_driver_is_a_latched_fault() {
    let mut service = Service::start("units/driver");
    service.moves();
    kill(&service.driver(), "-KILL");
    service.until("fault", |status| status["fault"].is_string());
    rests(&service);
    assert!(
        service.process.try_wait().unwrap().is_none(),
        "it has ended"
    );
    assert_eq!(canter(["recover", "--arm", service.arm]).code, 1);
    drop(service);
    let again = Service::start("units/driver");
    assert!(again.status()["fault"].is_null());
}

/// `systemctl stop` in motion: on the path, in time, and no failure of the unit.
#[test]
fn a_stopped_service_has_not_failed() {
    let unit = unit();
    let signal = setting(&unit, "KillSignal").unwrap();
    let mut service = Service::start("units/stopped");
    service.moves();
    service.signal(&signal.replace("SIG", "-"));
    let seconds = setting(&unit, "TimeoutStopSec").unwrap().parse().unwrap();
    let end = Instant::now() + Duration::from_secs(seconds);
    let code = loop {
        if let Some(status) = service.process.try_wait().unwrap() {
            break status.code().unwrap();
        }
        assert!(Instant::now() < end, "systemd would kill it");
        sleep(Duration::from_millis(20));
    };
    let fine = setting(&unit, "SuccessExitStatus").unwrap_or_default();
    let fine = fine.split_whitespace().any(|word| word.parse() == Ok(code));
    assert!(code == 0 || fine, "systemd would call {code} a failure");
}

/// systemd reads all units without a complaint.
#[test]
fn systemd_can_read_the_units() {
    let folder = tempfile::tempdir().unwrap();
    let units = files("packaging/systemd", "service").unwrap();
    assert_eq!(units.len(), 3);
    for path in units {
        let name = path.file_name().unwrap().to_str().unwrap();
        let own = folder.path().join(name.replace('@', "@cell-arm"));
        let text = fs::read_to_string(&path).unwrap();
        let fleet = env!("CARGO_BIN_EXE_canter-fleet-under-test");
        let text = text.replace("/usr/bin/canter-fleet", fleet);
        let text = text.replace(
            "/usr/bin/canter ",
            concat!(env!("CARGO_BIN_EXE_canter-under-test"), " "),
        );
        fs::write(&own, text).unwrap();
        let ran = Command::new("systemd-analyze")
            .args(["verify", "--man=no"])
            .arg(&own)
            .output();
        let Ok(ran) = ran else {
            return println!("ignored: there is no systemd-analyze");
        };
        let said = String::from_utf8_lossy(&ran.stderr);
        let complains = said.contains(name.split(['@', '.']).next().unwrap());
        assert!(ran.status.success() && !complains, "{said}");
    }
}
