//! Faults of shared memory, and requests that come late or get no answer, with real processes.

use std::fs::{self, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ipc::{DOMAIN_VARIABLE, Domain, Verb};
use serde_json::Value;
use system_tests::domain;
use system_tests::killed::Killed;

use crate::canter::{canter, command};
use crate::status::status;

/// How long a test waits for something that must come.
const PATIENCE: Duration = Duration::from_secs(60);

/// An engine with its simulated driver; killed when the test fails before its end.
struct Engine(Killed);

impl Engine {
    fn start(arm: &str, more: &[&str]) -> Self {
        let mut child = command(["engine", "--robot", "ur5e", "--arm", arm])
            .args(more)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let ready = lines.by_ref().map_while(Result::ok);
        let ready = ready.take_while(|line| !line.starts_with("canter: engine"));
        let said: Vec<_> = ready.collect();
        assert!(child.try_wait().unwrap().is_none(), "{said:?}");
        thread::spawn(move || lines.for_each(drop));
        Self(Killed(child))
    }

    fn signal(&self, signal: i32) {
        system_tests::signal::send(&self.0, signal);
    }
}

/// A program that was answered with "no engine" is not executed later.
#[test]
fn a_program_that_was_given_up_is_not_queued() {
    let engine = Engine::start("memory/gave-up", &[]);
    let before = status("memory/gave-up");
    engine.signal(libc::SIGSTOP);
    let words = [
        "send",
        "examples/pick_and_place.canon",
        "--arm",
        "memory/gave-up",
    ];
    let ran = canter(words);
    assert_eq!(ran.code, 4, "{}", ran.stderr);
    engine.signal(libc::SIGCONT);
    // Sent by who lives, killed before it was taken.
    engine.signal(libc::SIGSTOP);
    let mut killed = command(words).stderr(Stdio::null()).spawn().unwrap();
    thread::sleep(Duration::from_millis(500));
    killed.kill().unwrap();
    killed.wait().unwrap();
    engine.signal(libc::SIGCONT);
    thread::sleep(Duration::from_millis(500));
    let after = status("memory/gave-up");
    assert_eq!(
        (&after["queued"], &after["idle"]),
        (&Value::from(0), &Value::from(true))
    );
    assert_eq!(after["setpoint"], before["setpoint"], "it moved");
    assert_eq!(canter(["shutdown", "--arm", "memory/gave-up"]).code, 0);
}

/// After a client that went without its answer, the next gets its own.
#[test]
fn an_answer_is_for_who_asked() {
    let engine = Engine::start("memory/answers", &[]);
    for _ in 0..5 {
        engine.signal(libc::SIGSTOP);
        let words = [
            "send",
            "examples/pick_and_place.canon",
            "--arm",
            "memory/answers",
        ];
        let late = command(words).stderr(Stdio::null()).spawn().unwrap();
        let gone = late.wait_with_output().unwrap();
        assert_eq!(gone.status.code(), Some(4));
        engine.signal(libc::SIGCONT);
        let now = status("memory/answers");
        assert_eq!(now["joints"].as_array().map(Vec::len), Some(6), "{now}");
    }
    assert_eq!(canter(["shutdown", "--arm", "memory/answers"]).code, 0);
}

/// Two clients that ask without a pause do not delay other clients or a signal.
#[test]
fn a_flood_does_not_hold_the_engine() {
    let mut engine = Engine::start("memory/flood", &[]);
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                let client = ipc::Client::open(&domain::arm("memory/flood"), "flood").unwrap();
                while !stop.load(Ordering::Relaxed) {
                    // The answers are of no interest.
                    let _ = client.ask(Verb::Status, Duration::ZERO);
                }
            });
        }
        thread::sleep(Duration::from_millis(500));
        for _ in 0..5 {
            assert_eq!(status("memory/flood")["idle"], true);
        }
        engine.signal(libc::SIGINT);
        let start = Instant::now();
        while engine.0.try_wait().unwrap().is_none() && start.elapsed() < PATIENCE {
            thread::sleep(Duration::from_millis(5));
        }
        let took = start.elapsed();
        stop.store(true, Ordering::Relaxed);
        println!("SIGINT under a flood: {} ms", took.as_millis());
        assert!(took < Duration::from_secs(8), "{took:?}");
    });
}

/// A way to damage a file.
type Damage = fn(&Path);

/// What is done to segments.
const DAMAGES: [(&str, Damage); 4] = [
    ("cut to nothing", |path| {
        OpenOptions::new()
            .write(true)
            .open(path)
            .unwrap()
            .set_len(0)
            .unwrap();
    }),
    ("cut in half", |path| {
        let half = fs::metadata(path).unwrap().len() / 2;
        OpenOptions::new()
            .write(true)
            .open(path)
            .unwrap()
            .set_len(half)
            .unwrap();
    }),
    ("all ones", |path| overwrite(path, |_| 0xff)),
    ("noise behind the head", |path| {
        let old = fs::read(path).unwrap();
        let mut random = 0x2545_f491_4f6c_dd1d_u64;
        overwrite(path, |index| {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            if index < 16 { old[index] } else { random as u8 }
        });
    }),
];

fn overwrite(path: &std::path::Path, mut byte: impl FnMut(usize) -> u8) {
    let length = fs::metadata(path).unwrap().len() as usize;
    let bytes: Vec<u8> = (0..length).map(&mut byte).collect();
    let mut file = OpenOptions::new().write(true).open(path).unwrap();
    file.write_all(&bytes).unwrap();
}

/// Ends the engine of a domain and the driver that it has started, at once.
fn kill_all(mut engine: Engine, domain: &Domain) {
    let all = ipc::inhabitants_of(domain);
    engine.0.kill().unwrap();
    engine.0.wait().unwrap();
    for user in all {
        // It may have gone with the engine.
        let number = user.process.to_string();
        let _ = Command::new("kill")
            .args(["-9", &number])
            .stderr(Stdio::null())
            .status();
    }
    let start = Instant::now();
    while !ipc::inhabitants_of(domain).is_empty() && start.elapsed() < PATIENCE {
        thread::sleep(Duration::from_millis(10));
    }
}

/// Exit code and output of a command in a domain; it must not die of a signal.
fn said_in(domain: &Path, words: &[&str], context: &str) -> (i32, String) {
    let mut command = command(words);
    command.env(DOMAIN_VARIABLE, domain);
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let heard = String::from_utf8_lossy(&output.stdout).into_owned();
    let signal = output.status.signal();
    assert_eq!(signal, None, "{words:?} after {context}: {said}");
    (output.status.code().unwrap(), said + &heard)
}

/// What clients say of damaged segments, while an engine runs or after it was killed; then the
/// repair. Gives how many clients looked, and how many were told what repairs the damage.
fn damaged((damage, harm): (&str, Damage), alive: bool, place: &Path) -> (u32, u32) {
    let domain = Domain::open(place).unwrap();
    let context = format!("{damage}, alive {alive}");
    let words = |words: &[&str]| said_in(place, words, &context);
    let engine = Engine::start("memory/damaged", &["--domain", place.to_str().unwrap()]);
    let engine = if alive {
        let (code, said) = words(&["doctor", "--repair"]);
        assert_eq!(code, 1, "a living engine's segments are left alone: {said}");
        assert!(said.contains("in use by process"), "{said}");
        Some(engine)
    } else {
        kill_all(engine, &domain);
        None
    };
    for segment in domain::segments(&domain) {
        harm(&segment);
    }
    let (mut looked, mut told) = (0, 0);
    for asking in [
        &["status", "--arm", "memory/damaged"][..],
        &[
            "send",
            "examples/pick_and_place.canon",
            "--arm",
            "memory/damaged",
        ],
        &["driver", "test", "--arm", "memory/damaged"],
    ] {
        let (code, said) = words(asking);
        looked += 1;
        told += u32::from(said.contains("doctor --repair"));
        assert_ne!(code, 0, "{asking:?} after {context}: {said}");
    }
    let (_, said) = words(&["doctor", "--seconds", "0.1"]);
    println!("{context}: {said}");
    if let Some(engine) = engine {
        kill_all(engine, &domain);
    }
    let (code, said) = words(&["doctor", "--repair"]);
    assert_eq!(code, 0, "{said}");
    let again = Engine::start("memory/damaged", &["--domain", place.to_str().unwrap()]);
    let (code, said) = words(&["status", "--arm", "memory/damaged"]);
    assert_eq!(code, 0, "after the repair: {said}");
    kill_all(again, &domain);
    ipc::repair(&domain).unwrap();
    (looked, told)
}

/// However segments are damaged, while an engine runs or after it was killed: no client dies of a
/// signal or hangs, each says what repairs the damage, and after the repair everything works.
#[test]
fn damaged_segments_are_named_and_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let (mut looked, mut told) = (0, 0);
    // Each in a domain of its own, side by side: most of the time is waiting.
    for (number, damage) in DAMAGES.iter().enumerate() {
        let both = thread::scope(|scope| {
            let start = |alive: bool| {
                let place = folder.path().join(format!("{number}-{alive}"));
                scope.spawn(move || damaged(*damage, alive, &place))
            };
            [false, true]
                .map(start)
                .map(|running| running.join().unwrap())
        });
        for (clients, advised) in both {
            looked += clients;
            told += advised;
        }
    }
    println!("{looked} clients in damaged memory, {told} were told of the repair");
    assert!(told * 2 > looked, "{told} of {looked}");
}

/// Fills the memory under an engine that moves, and says what each command came to.
const FILL: &str = r#"
    mount -t tmpfs -o size=48m,mode=1777 tmpfs /dev/shm || exit 77
    before=$(df --output=used -k /dev/shm | tail -1)
    $CANTER engine --robot ur5e --arm memory/full > $OUT/engine.txt 2>&1 &
    engine=$!
    for i in $(seq 200); do
        $CANTER status --arm memory/full > /dev/null 2>&1 && break
        sleep 0.1
    done
    after=$(df --output=used -k /dev/shm | tail -1)
    echo "used $((after - before)) KiB"
    $CANTER send --no-wait examples/pick_and_place.canon --arm memory/full
    sleep 0.5
    dd if=/dev/zero of=/dev/shm/fill bs=64k > /dev/null 2>&1
    dd if=/dev/zero of=/dev/shm/fill2 bs=4k > /dev/null 2>&1
    $CANTER status --arm memory/full > $OUT/status.txt 2>&1
    echo "status $?"
    $CANTER run examples/pick_and_place.canon --robot ur5e --arm memory/other > $OUT/run.txt 2>&1
    echo "run $?"
    $CANTER doctor --seconds 0.1 > $OUT/doctor.txt 2>&1
    echo "doctor $?"
    sleep 0.5
    kill -0 $engine && echo "engine lives"
    rm /dev/shm/fill /dev/shm/fill2
    $CANTER status --json --arm memory/full > $OUT/later.txt 2>&1
    echo "later $?"
    dd if=/dev/zero of=/dev/shm/fill bs=4k > /dev/null 2>&1
    kill -INT $engine
    wait $engine
    echo "engine $?"
    cat $OUT/status.txt $OUT/run.txt $OUT/doctor.txt
"#;

/// In a separate `/dev/shm` of 48 MiB: a moving engine continues when the memory is full, clients
/// report what is missing, and SIGINT stops the arm.
#[test]
fn a_full_shared_memory_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut unshare = Command::new("unshare");
    let output = domain::join(&mut unshare)
        .args(["-m", "sh", "-c", FILL])
        .current_dir(system_tests::repository::root())
        .env("CANTER", env!("CARGO_BIN_EXE_canter-under-test"))
        .env("OUT", folder.path())
        .env("NO_COLOR", "1")
        .stdin(Stdio::null())
        .output();
    let output = match output {
        Ok(output) if !matches!(output.status.code(), Some(1 | 77)) => output,
        refused => return println!("ignored: no right to a /dev/shm of its own ({refused:?})"),
    };
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    println!("{said}{errors}");
    for line in ["status 4", "run 4", "doctor 1", "engine lives", "later 0"] {
        assert!(
            said.lines().any(|found| found == line),
            "{line}: {said}{errors}"
        );
    }
    let ended = said
        .lines()
        .any(|found| found == "engine 5" || found == "engine 0");
    assert!(ended, "stopped by the signal: {said}{errors}");
    let named = said.matches("/dev/shm has").count();
    assert!(named >= 2, "{said}");
}
