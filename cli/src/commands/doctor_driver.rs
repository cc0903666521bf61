//! What the drivers of real arms need of this machine and its network: each line is what was measured, or
//! says that it is not known and why.

use std::net::{TcpStream, ToSocketAddrs, UdpSocket};
use std::process::Command;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use driver_cia402::EtherSocket;
use driver_franka::host;
use engine::doctor::{Check, Health};
use scheduling::{RealTimeRequest, request_real_time};

/// How often the network is tried, and how long an answer may take.
const TRIES: usize = 100;
const ANSWER: Duration = Duration::from_millis(200);

/// So many tries in a row without an answer end the measurement: nobody is there.
const ENOUGH: usize = 5;

/// Time between two tries.
const BETWEEN: Duration = Duration::from_millis(5);

/// The priority that the drivers' threads ask for.
const PRIORITY: i32 = 80;

/// The port that answers without being disturbed: that of the maker's web page, or of the dashboard. A
/// refusal is an answer too.
const WEB: u16 = 443;
const DASHBOARD: u16 = 29999;

/// A driver that is checked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum DriverName {
    /// Franka FR3 and Panda
    Franka,
    /// Universal Robots
    Ur,
    /// KUKA over RSI
    Kuka,
    /// CiA 402 drives on EtherCAT
    Cia402,
}

/// All checks for a driver. `place` is the controller's address, or the network interface of the bus.
pub(super) fn examine(driver: DriverName, place: &str) -> Vec<Check> {
    let mut checks = match driver {
        DriverName::Cia402 => vec![interface(place), frames(place)],
        DriverName::Franka => vec![round_trips(place, WEB), ports(place, &[1337])],
        DriverName::Ur => vec![
            round_trips(place, DASHBOARD),
            ports(place, &[DASHBOARD, 30001, 30004]),
        ],
        DriverName::Kuka => vec![round_trips(place, WEB), own_port("0.0.0.0:49152")],
    };
    checks.push(priority());
    checks.push(firewall(driver));
    checks
}

fn check(name: &'static str, health: Health, seen: String, remedy: &str) -> Check {
    let remedy = match health {
        Health::Ok => String::new(),
        _ => remedy.to_owned(),
    };
    Check {
        name,
        health,
        seen,
        remedy,
    }
}

/// Round trips of connections: each is one packet there and one back.
fn round_trips(address: &str, port: u16) -> Check {
    const NAME: &str = "network to the controller";
    let remedy = "check the cable and the address; a cable of its own, no switch";
    let host = host(address);
    let found = (host, port).to_socket_addrs().map(|mut all| all.next());
    let target = match found {
        Ok(Some(target)) => target,
        Ok(None) => return check(NAME, Health::Fail, format!("{host} has no address"), remedy),
        Err(cause) => return check(NAME, Health::Fail, format!("{host}: {cause}"), remedy),
    };
    let mut times = Times::default();
    while times.tries() < TRIES && !(times.times.is_empty() && times.lost >= ENOUGH) {
        let start = Instant::now();
        let tried = TcpStream::connect_timeout(&target, ANSWER);
        let answered = match &tried {
            Ok(_) => true,
            Err(cause) => cause.kind() == std::io::ErrorKind::ConnectionRefused,
        };
        times.count(answered.then(|| start.elapsed()));
        std::thread::sleep(BETWEEN);
    }
    if times.times.is_empty() {
        let seen = format!("latency and loss not known: no answer from {target}");
        return check(NAME, Health::Fail, seen, remedy);
    }
    times.check(NAME, &format!("connections to {target}"), remedy)
}

/// Measured round trips.
#[derive(Default)]
struct Times {
    times: Vec<Duration>,
    lost: usize,
}

impl Times {
    fn count(&mut self, time: Option<Duration>) {
        match time {
            Some(time) => self.times.push(time),
            None => self.lost += 1,
        }
    }

    fn tries(&self) -> usize {
        self.times.len() + self.lost
    }

    /// In words; a lost packet, or a round trip beyond a millisecond, is a warning.
    fn check(mut self, name: &'static str, what: &str, remedy: &str) -> Check {
        self.times.sort_unstable();
        let at = |share: f64| {
            let place = ((self.times.len() - 1) as f64 * share) as usize;
            self.times[place].as_micros()
        };
        let seen = format!(
            "{} {what}: {} without an answer; p50 {} us, p99 {} us, worst {} us",
            self.tries(),
            self.lost,
            at(0.5),
            at(0.99),
            at(1.0)
        );
        let good = self.lost == 0 && at(0.99) < 1000;
        let health = if good { Health::Ok } else { Health::Warn };
        check(name, health, seen, remedy)
    }
}

/// Whether the ports that the driver connects to are open.
fn ports(address: &str, ports: &[u16]) -> Check {
    const NAME: &str = "ports of the controller";
    let host = host(address);
    let mut health = Health::Ok;
    let mut seen = Vec::new();
    for port in ports {
        let opened = (host, *port)
            .to_socket_addrs()
            .and_then(|mut all| all.next().ok_or(std::io::ErrorKind::NotFound.into()))
            .and_then(|target| TcpStream::connect_timeout(&target, ANSWER));
        match opened {
            Ok(_) => seen.push(format!("{port} open")),
            Err(cause) => {
                health = Health::Fail;
                seen.push(format!("{port}: {cause}"));
            }
        }
    }
    let remedy = "switch the interface on at the controller: see docs/drivers";
    check(NAME, health, seen.join(", "), remedy)
}

/// Whether the port that the controller sends to is free.
fn own_port(listen: &str) -> Check {
    const NAME: &str = "port for the controller";
    match UdpSocket::bind(listen) {
        Ok(_) => check(NAME, Health::Ok, format!("{listen} is free"), ""),
        Err(cause) => check(
            NAME,
            Health::Warn,
            format!("{listen}: {cause}"),
            "end the driver or program that has it",
        ),
    }
}

/// The state of a network interface, and its own counts of errors.
fn interface(name: &str) -> Check {
    const NAME: &str = "network interface";
    let read = |file: &str| {
        let path = format!("/sys/class/net/{name}/{file}");
        std::fs::read_to_string(path).map(|text| text.trim().to_owned())
    };
    let state = match read("operstate") {
        Ok(state) => state,
        Err(cause) => {
            let seen = format!("not known: /sys/class/net/{name}: {cause}");
            return check(NAME, Health::Warn, seen, "ip link; give its name");
        }
    };
    let count = |file: &str| {
        let known = read(&format!("statistics/{file}"));
        known.unwrap_or("not known".to_owned())
    };
    let (errors, dropped) = (count("rx_errors"), count("rx_dropped"));
    let seen = format!("{name} is {state}, {errors} receive errors, {dropped} dropped");
    let good = state == "up" && errors == "0";
    let health = if good { Health::Ok } else { Health::Warn };
    check(
        NAME,
        health,
        seen,
        &format!("ip link set {name} up; another cable"),
    )
}

/// Round trips of EtherCAT frames that read the first register of all devices.
fn frames(name: &str) -> Check {
    const NAME: &str = "EtherCAT frames";
    let remedy =
        "check cable and power of the drives, and sudo setcap cap_net_raw+ep on this program";
    let socket = match EtherSocket::open(name) {
        Ok(socket) => socket,
        Err(cause) => {
            let seen = format!("latency and loss not known: {name}: {cause}");
            return check(NAME, Health::Fail, seen, remedy);
        }
    };
    let (mut times, mut devices) = (Times::default(), 0);
    while times.tries() < TRIES && !(times.times.is_empty() && times.lost >= ENOUGH) {
        let answer = ask_all(&socket, times.tries() as u8);
        if let Some((_, found)) = answer {
            devices = found;
        }
        times.count(answer.map(|answer| answer.0));
        std::thread::sleep(BETWEEN);
    }
    if times.times.is_empty() {
        let seen = format!("latency and loss not known: no frame comes back on {name}");
        return check(NAME, Health::Fail, seen, remedy);
    }
    let what = format!("frames to {devices} devices");
    times.check(NAME, &what, remedy)
}

/// One frame: how long it took, and the working counter.
fn ask_all(socket: &EtherSocket, number: u8) -> Option<(Duration, u16)> {
    // To all; a broadcast read (7) of one byte at address 0.
    let mut frame = vec![0xFF; 6];
    frame.extend_from_slice(&[0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x88, 0xA4]);
    frame.extend_from_slice(&[13, 0x10]);
    frame.extend_from_slice(&[7, number, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]);
    frame.resize(60, 0);
    let start = Instant::now();
    socket.send(&frame).ok()?;
    let mut answer = [0; 1518];
    while start.elapsed() < ANSWER {
        let left = ANSWER.saturating_sub(start.elapsed());
        let length = socket.receive(&mut answer, left).ok()??;
        // Ours, and not an answer to another master.
        if length >= 29 && answer[16] == 7 && answer[17] == number {
            let counter = u16::from_le_bytes([answer[27], answer[28]]);
            return Some((start.elapsed(), counter));
        }
    }
    None
}

/// Whether a thread gets the priority that the drivers ask for.
fn priority() -> Check {
    const NAME: &str = "priority of the driver";
    let ask = || {
        request_real_time(RealTimeRequest {
            priority: PRIORITY,
            processor: None,
            lock_memory: false,
            low_latency: false,
        })
        .refused
    };
    let refused = std::thread::spawn(ask).join().unwrap_or_default();
    match refused.first() {
        None => check(
            NAME,
            Health::Ok,
            format!("SCHED_FIFO {PRIORITY} granted"),
            "",
        ),
        Some(refused) => check(
            NAME,
            Health::Warn,
            refused.clone(),
            "echo \"$USER - rtprio 95\" | sudo tee /etc/security/limits.d/canter.conf",
        ),
    }
}

/// Whether rules of this machine drop what comes in.
fn firewall(driver: DriverName) -> Check {
    const NAME: &str = "firewall";
    if driver == DriverName::Cia402 {
        let seen = "not asked: EtherCAT frames do not pass it".to_owned();
        return check(NAME, Health::Ok, seen, "");
    }
    let ask = |program: &str, words: &[&str]| {
        let ran = Command::new(program).args(words).output();
        match ran {
            Ok(output) if output.status.success() => {
                Ok(String::from_utf8_lossy(&output.stdout).into_owned())
            }
            Ok(output) => {
                let said = String::from_utf8_lossy(&output.stderr);
                let first = said.lines().next().unwrap_or_default().to_owned();
                Err(format!("{program}: {first}"))
            }
            Err(cause) => Err(format!("{program}: {cause}")),
        }
    };
    let rules = ask("nft", &["list", "ruleset"])
        .map(|rules| ("nft", rules))
        .or_else(|first| {
            ask("iptables", &["-S", "INPUT"])
                .map(|rules| ("iptables", rules))
                .map_err(|second| format!("not known: {first}; {second}"))
        });
    let remedy = "let everything in on the network card of the controller";
    match rules {
        Err(reason) => check(NAME, Health::Warn, reason, "sudo nft list ruleset"),
        Ok((program, rules)) => {
            let drops = rules.lines().any(drops_input);
            let (health, seen) = if drops {
                (Health::Warn, "a rule drops or refuses what comes in")
            } else {
                (Health::Ok, "no rule drops what comes in")
            };
            check(NAME, health, format!("{program}: {seen}"), remedy)
        }
    }
}

/// Whether a line of `nft list ruleset` or `iptables -S INPUT` drops or refuses something that comes in.
fn drops_input(line: &str) -> bool {
    let words: Vec<&str> = line.split([' ', ';', '\t']).collect();
    let has = |word: &str| words.contains(&word);
    let refuses = has("drop") || has("reject") || has("DROP") || has("REJECT");
    let other = has("hook") && !has("input");
    refuses && !other
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_that_drop_are_seen() {
        assert!(drops_input(
            "type filter hook input priority filter; policy drop;"
        ));
        assert!(!drops_input(
            "type filter hook forward priority filter; policy drop;"
        ));
        assert!(!drops_input(
            "type filter hook input priority filter; policy accept;"
        ));
        assert!(drops_input("-P INPUT DROP"));
        assert!(drops_input("\t\tudp dport 1-1024 drop"));
        assert!(!drops_input("-P INPUT ACCEPT"));
    }

    #[test]
    fn every_line_is_a_fact_or_says_why_not() {
        let refused = examine(DriverName::Ur, "127.0.0.1");
        assert!(
            refused[0].seen.contains("0 without an answer"),
            "{refused:?}"
        );
        let nobody = examine(DriverName::Cia402, "no-such-card");
        assert_eq!(nobody[1].health, Health::Fail);
        assert!(nobody[1].seen.contains("not known"), "{nobody:?}");
        for check in refused.iter().chain(&nobody) {
            assert_eq!(check.remedy.is_empty(), check.health == Health::Ok);
        }
    }
}
