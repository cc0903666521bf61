//! Checks what the servo loop needs of this machine, and says how to correct problems.

mod driver;

use core::time::Duration;
use std::fs;
use std::thread;

use ipc::{AnsweringProbe, Arm, AskingProbe, Domain};
use scheduling::{RealTimeRequest, now_ns, request_real_time, sleep_until_ns};
use serde::Serialize;

use planner::robot::Robot;

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Health {
    /// As it should be.
    Ok,
    /// It works, but not as well as it could.
    Warn,
    /// It does not work.
    Fail,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What was checked.
    pub name: &'static str,
    /// How it is.
    pub health: Health,
    /// What was seen.
    pub seen: String,
    /// The command or setting that corrects it; empty if there is nothing to correct.
    pub remedy: String,
}

impl Check {
    fn new(name: &'static str, health: Health, seen: String, remedy: &str) -> Self {
        let remedy = if health == Health::Ok {
            String::new()
        } else {
            remedy.to_owned()
        };
        Self {
            name,
            health,
            seen,
            remedy,
        }
    }
}

/// What to check.
#[derive(Clone, Debug)]
pub struct DoctorOptions {
    /// The domain whose segments are checked, and in which the round trip is measured.
    pub domain: Domain,
    /// Servo rate to measure wake-ups at (Hz).
    pub rate_hz: f64,
    /// How long to measure wake-ups.
    pub wake_up: Duration,
    /// The arm whose driver is checked. The driver must have no engine.
    pub driver: Option<Arm>,
    /// Damage of the domain's segments, found by another process: reading them here could crash
    /// this one.
    pub damage: Option<String>,
    /// The robot whose limits are checked, and compared with those of the driver.
    pub robot: Option<Robot>,
}

impl DoctorOptions {
    /// The usual checks, in this domain.
    pub fn new(domain: Domain) -> Self {
        Self {
            domain,
            rate_hz: 1000.0,
            wake_up: Duration::from_secs(5),
            driver: None,
            damage: None,
            robot: None,
        }
    }
}

/// Makes all checks, one after the other.
pub fn examine(options: &DoctorOptions) -> Vec<Check> {
    let mut checks = vec![kernel(), governor(), shared_memory()];
    match &options.damage {
        Some(damage) => checks.push(damaged(&options.domain, damage)),
        None => checks.push(leftovers(&options.domain)),
    }
    checks.extend(rights());
    checks.push(wake_up(options));
    let sound = options.damage.is_none();
    checks.extend(sound.then(|| round_trip(&options.domain)));
    let ack = options
        .driver
        .as_ref()
        .filter(|_| sound)
        .map(|arm| driver::handshake(arm, options.rate_hz));
    let ack = ack.and_then(|(check, ack)| {
        checks.push(check);
        ack
    });
    if let Some(robot) = &options.robot {
        checks.push(driver::limits_known(robot));
        checks.extend(ack.map(|ack| driver::limits_agree(robot, &ack)));
    }
    checks
}

fn read(path: &str) -> String {
    fs::read_to_string(path)
        .unwrap_or_default()
        .trim()
        .to_owned()
}

fn kernel() -> Check {
    let release = read("/proc/sys/kernel/osrelease");
    let real_time = read("/sys/kernel/realtime") == "1";
    let health = if real_time { Health::Ok } else { Health::Warn };
    let kind = if real_time {
        "PREEMPT_RT"
    } else {
        "not PREEMPT_RT"
    };
    let remedy = "install a real-time kernel (Debian: apt install linux-image-rt-amd64)";
    Check::new("kernel", health, format!("{release}, {kind}"), remedy)
}

fn governor() -> Check {
    let seen = read("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    let (health, seen) = match seen.as_str() {
        "" => (Health::Ok, "no frequency scaling".to_owned()),
        "performance" => (Health::Ok, seen),
        _ => (Health::Warn, seen),
    };
    Check::new(
        "processor governor",
        health,
        seen,
        "cpupower frequency-set -g performance",
    )
}

/// Free space in `/dev/shm`, and whether it can be written to.
fn shared_memory() -> Check {
    const NAME: &str = "shared memory";
    let remedy = "ls -lS /dev/shm, remove what fills it, or mount -o remount,size=256m /dev/shm";
    let left = ipc::room_left();
    let mib = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let room = left.map_or("no limit".to_owned(), |left| {
        format!(
            "{:.0} MiB left, {:.0} needed",
            mib(left),
            mib(ipc::ROOM_NEEDED)
        )
    });
    if left.is_some_and(|left| left < ipc::ROOM_NEEDED) {
        return Check::new(NAME, Health::Fail, room, remedy);
    }
    let path = format!("/dev/shm/canter-doctor-{}", std::process::id());
    let written = fs::write(&path, vec![1_u8; 1 << 20]).and_then(|()| fs::remove_file(&path));
    match written {
        Ok(()) => Check::new(NAME, Health::Ok, format!("1 MiB written, {room}"), ""),
        Err(cause) => Check::new(NAME, Health::Fail, format!("{cause}, {room}"), remedy),
    }
}

/// What another process found broken.
fn damaged(domain: &Domain, damage: &str) -> Check {
    let users: Vec<String> = ipc::inhabitants_of(domain)
        .iter()
        .map(|user| format!("{} ({})", user.process, user.command))
        .collect();
    let directory = domain.directory().display();
    let remedy = if users.is_empty() {
        format!("canter doctor --repair --domain {directory}")
    } else {
        format!(
            "end process {}, then canter doctor --repair --domain {directory}",
            users.join(", ")
        )
    };
    let seen = format!("{directory} is damaged: {damage}");
    Check::new("left-over segments", Health::Fail, seen, &remedy)
}

/// Cleans up during the check: what is left then cannot be removed by this user.
fn leftovers(domain: &Domain) -> Check {
    const NAME: &str = "left-over segments";
    let directory = domain.directory().display();
    let looked = ipc::count_nodes(domain).and_then(|before| {
        let (cleaned, failed) = ipc::remove_dead_nodes(domain)?;
        let seen = format!(
            "{directory}: {} processes alive, {} dead, {cleaned} cleaned up, {failed} could not be",
            before.alive, before.dead
        );
        Ok((seen, ipc::count_nodes(domain)?))
    });
    let remedy = format!("stop all engines and drivers, then rm -r {directory}");
    let (seen, after) = match looked {
        Ok(found) => found,
        Err(error) => return Check::new(NAME, Health::Fail, error.to_string(), &remedy),
    };
    let health = if after.dead == 0 {
        Health::Ok
    } else {
        Health::Warn
    };
    Check::new(NAME, health, seen, &remedy)
}

/// Asks for each right in a separate thread, which ends at once.
fn rights() -> Vec<Check> {
    let none = RealTimeRequest {
        priority: 0,
        processor: None,
        lock_memory: false,
        low_latency: false,
    };
    let ask = |name, wish: RealTimeRequest, remedy: &str| {
        let refused = thread::spawn(move || request_real_time(wish).refused)
            .join()
            .unwrap_or_default();
        match refused.first() {
            None => Check::new(name, Health::Ok, "granted".to_owned(), ""),
            Some(refused) => Check::new(name, Health::Warn, refused.clone(), remedy),
        }
    };
    vec![
        ask(
            "real-time priority",
            RealTimeRequest {
                priority: 60,
                ..none
            },
            "echo \"$USER - rtprio 95\" | sudo tee /etc/security/limits.d/canter.conf",
        ),
        ask(
            "memory lock",
            RealTimeRequest {
                lock_memory: true,
                ..none
            },
            "echo \"$USER - memlock unlimited\" | sudo tee -a /etc/security/limits.d/canter.conf",
        ),
        ask(
            "processor latency",
            RealTimeRequest {
                low_latency: true,
                ..none
            },
            "sudo setfacl -m u:$USER:rw /dev/cpu_dma_latency",
        ),
    ]
}

fn quantile(sorted: &[u64], share: f64) -> u64 {
    sorted
        .get((sorted.len().saturating_sub(1) as f64 * share) as usize)
        .copied()
        .unwrap_or(0)
}

fn wake_up(options: &DoctorOptions) -> Check {
    let period = (1e9 / options.rate_hz.clamp(100.0, 4000.0)) as u64;
    let count = options.wake_up.as_nanos() as u64 / period;
    let wish = RealTimeRequest {
        lock_memory: false,
        ..RealTimeRequest::default()
    };
    let measured = thread::spawn(move || {
        let _granted = request_real_time(wish);
        let origin = now_ns() + period;
        let mut late = Vec::with_capacity(count as usize);
        for tick in 0..count {
            sleep_until_ns(origin + tick * period);
            late.push(now_ns().saturating_sub(origin + tick * period));
        }
        late.sort_unstable();
        late
    });
    let late = measured.join().unwrap_or_default();
    let missed = late.iter().filter(|late| **late > period).count();
    let seen = format!(
        "{} wake-ups: p50 {} us, p99 {} us, worst {} us, {missed} later than a period",
        late.len(),
        quantile(&late, 0.5) / 1000,
        quantile(&late, 0.99) / 1000,
        quantile(&late, 1.0) / 1000
    );
    let health = if quantile(&late, 0.99) > period {
        Health::Fail
    } else if missed > 0 || quantile(&late, 0.99) > period / 2 {
        Health::Warn
    } else {
        Health::Ok
    };
    let remedy = "stop other load, isolate a processor (isolcpus=) or lower --rate";
    Check::new("wake-up at the servo period", health, seen, remedy)
}

/// Round trips of plain messages between two threads.
fn round_trip(domain: &Domain) -> Check {
    const TRIPS: u64 = 2000;
    const NAME: &str = "shared-memory round trip";
    let result = (|| {
        let arm = domain.arm(&format!("doctor/{}", std::process::id()))?;
        let asks = AskingProbe::asking(&arm)?;
        let other = arm.clone();
        let echo = thread::spawn(move || -> Result<(), ipc::IpcError> {
            let answers = AnsweringProbe::answering(&other)?;
            let end = now_ns() + 3_000_000_000;
            let mut last = 0;
            while last < TRIPS && now_ns() < end {
                if let Some(number) = answers.receive() {
                    last = number;
                    answers.send(number);
                }
                thread::yield_now();
            }
            Ok(())
        });
        let mut times = Vec::with_capacity(TRIPS as usize);
        let end = now_ns() + 3_000_000_000;
        for number in 1..=TRIPS {
            let start = now_ns();
            asks.send(number);
            while asks.receive() != Some(number) && now_ns() < end {
                thread::yield_now();
                // The other side may not have been there when the first was sent.
                if number == 1 && now_ns() - start > 1_000_000 {
                    asks.send(number);
                }
            }
            times.push(now_ns() - start);
        }
        echo.join().unwrap_or(Ok(()))?;
        times.sort_unstable();
        Ok::<_, ipc::IpcError>((times, now_ns() < end))
    })();
    match result {
        Ok((times, true)) => {
            let (half, most) = (quantile(&times, 0.5), quantile(&times, 0.99));
            let seen = format!("p50 {} us, p99 {} us", half as f64 / 1e3, most as f64 / 1e3);
            Check::new(NAME, Health::Ok, seen, "")
        }
        Ok((_, false)) => Check::new(
            NAME,
            Health::Fail,
            "messages were lost".to_owned(),
            "canter doctor again",
        ),
        Err(error) => Check::new(
            NAME,
            Health::Fail,
            error.to_string(),
            "check /dev/shm and the directory of --domain",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_check_that_is_not_ok_has_a_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let domain = Domain::open(&folder.path().join("domain")).unwrap();
        let options = DoctorOptions {
            wake_up: Duration::from_millis(100),
            driver: Some(domain.arm("doctor/nobody-there").unwrap()),
            robot: Some(planner::robot::load("ur5e").unwrap()),
            ..DoctorOptions::new(domain)
        };
        let checks = examine(&options);
        assert_eq!(checks.len(), 11);
        for check in &checks {
            println!("{check:?}");
            assert_eq!(
                check.remedy.is_empty(),
                check.health == Health::Ok,
                "{check:?}"
            );
        }
        assert_eq!(checks[9].health, Health::Fail, "there is no driver");
    }
}
