//! Both ends of every channel, in one process.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use ipc::{
    Answer, Arm, Client, ClientServer, Clock, Domain, DriverLink, EngineLink, Hello, HelloAck,
    Identity, IpcError, Ownership, Request, RequestId, Setpoint, State, StatusReader, StatusWriter,
    Verb, Verdict,
};

fn arm(name: &str) -> Arm {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("domain");
    let name = format!("test-{}/{name}", std::process::id());
    Domain::open(&folder).unwrap().arm(&name).unwrap()
}

#[test]
fn setpoints_and_states_pass() {
    let arm = arm("pass");
    let engine = EngineLink::open(&arm).unwrap();
    let driver = DriverLink::open(&arm).unwrap();
    for sequence in 1..=100 {
        assert!(engine.send(&Setpoint {
            sequence,
            joints: 6,
            ..Setpoint::default()
        }));
        assert_eq!(driver.last_setpoint().unwrap().sequence, sequence);
        assert!(driver.send(&State {
            sequence,
            joints: 6,
            ..State::default()
        }));
        assert_eq!(engine.last_state().unwrap().sequence, sequence);
    }
    assert!(driver.last_setpoint().is_none());
}

#[test]
fn a_slow_reader_loses_the_oldest_and_blocks_nobody() {
    let arm = arm("slow");
    let engine = EngineLink::open(&arm).unwrap();
    let driver = DriverLink::open(&arm).unwrap();
    for sequence in 1..=10_000 {
        assert!(engine.send(&Setpoint {
            sequence,
            ..Setpoint::default()
        }));
    }
    let first = driver.next_setpoint().unwrap().sequence;
    assert!(first > 9_900, "oldest kept is {first}");
    assert_eq!(driver.last_setpoint().unwrap().sequence, 10_000);
}

#[test]
fn a_second_engine_or_driver_is_refused_by_name() {
    let arm = arm("taken");
    let engine = EngineLink::open(&arm).unwrap();
    let driver = DriverLink::open(&arm).unwrap();
    let error = EngineLink::open(&arm).unwrap_err();
    assert!(
        matches!(&error, IpcError::Taken { role: "engine", .. }),
        "{error}"
    );
    assert!(
        error.to_string().contains(&std::process::id().to_string()),
        "{error}"
    );
    assert!(matches!(
        DriverLink::open(&arm),
        Err(IpcError::Taken { role: "driver", .. })
    ));
    drop((engine, driver));
    EngineLink::open(&arm).unwrap();
}

#[test]
fn handshake() {
    let arm = arm("hello");
    let wait = Duration::from_millis(50);
    let hello = Hello::new(6, 1_000_000, 50_000_000, Clock::Wall);
    let engine = EngineLink::open(&arm).unwrap();
    let alone = engine.greet(&hello, [wait; 2], |_| {}).unwrap_err();
    assert!(
        matches!(alone, IpcError::NoAnswer { role: "driver", .. }),
        "{alone}"
    );

    let done = AtomicBool::new(false);
    thread::scope(|scope| {
        let (arm, done) = (&arm, &done);
        scope.spawn(move || {
            let driver = DriverLink::open(arm).unwrap();
            while !done.load(Ordering::Relaxed) {
                if let Some(greeting) = driver.greeting() {
                    let ack = match greeting.hello.check(6) {
                        Ok(()) => HelloAck {
                            verdict: Verdict::Welcome as u32,
                            session: 7,
                            watchdog_ns: 50_000_000,
                            ..HelloAck::refusal(6, Verdict::Welcome, "")
                        },
                        Err(cause) => {
                            HelloAck::refusal(6, Verdict::WrongProtocol, &cause.to_string())
                        }
                    };
                    greeting.answer(ack);
                }
                thread::sleep(Duration::from_millis(1));
            }
        });
        let ack = engine
            .greet(&hello, [Duration::from_secs(5); 2], |_| {})
            .unwrap();
        assert_eq!(ack.session, 7);
        let other = Hello {
            protocol: 99,
            ..hello
        };
        let refusal = engine
            .greet(&other, [Duration::from_secs(5); 2], |_| {})
            .unwrap_err()
            .to_string();
        assert!(refusal.contains("protocol 99, expected 2"), "{refusal}");
        done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn clients_ask_and_everybody_reads_the_status() {
    let arm = arm("client");
    let none = Client::open(&arm, "early")
        .unwrap()
        .ask(Verb::Status, Duration::from_millis(30));
    assert!(matches!(
        none,
        Err(IpcError::NoAnswer { role: "engine", .. })
    ));

    let server = ClientServer::open(&arm).unwrap();
    assert!(matches!(
        ClientServer::open(&arm),
        Err(IpcError::Taken { .. })
    ));
    let status = StatusWriter::open(&arm).unwrap();
    let late = StatusReader::open(&arm).unwrap();
    assert!(late.read().unwrap().is_none());
    status.write(&serde_json::json!({"ready": true})).unwrap();
    assert_eq!(late.read().unwrap().unwrap()["ready"], true);

    let program = "Message(\"x\");\n".repeat(20_000);
    let length = program.len();
    let submit = Verb::Submit {
        format: "text".into(),
        name: "long".into(),
        program,
    };
    let asking = arm.clone();
    let client = thread::spawn(move || {
        let client = Client::open(&asking, "test").unwrap();
        client.ask(submit, Duration::from_secs(5)).unwrap()
    });
    let handle = |request: Request| match request.ask {
        Verb::Submit { program, .. } => Answer::accept(serde_json::json!(program.len())),
        other => Answer::refuse(format!("{other:?}")),
    };
    while server.serve(handle).unwrap() == 0 {
        thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(
        client.join().unwrap(),
        Answer::accept(serde_json::json!(length))
    );
}

#[test]
fn one_client_commands_at_a_time() {
    let here = Identity {
        name: "first".into(),
        process: std::process::id(),
    };
    let there = Identity {
        name: "second".into(),
        process: 1,
    };
    let gone = Identity {
        name: "gone".into(),
        process: u32::MAX,
    };
    let ask = |client: &Identity, ask: Verb| Request {
        id: RequestId {
            process: client.process,
            asked_ns: 1,
        },
        client: client.clone(),
        ask,
    };
    let mut ownership = Ownership::default();
    ownership.admit(&ask(&here, Verb::Shutdown), false).unwrap();
    let refusal = ownership
        .admit(&ask(&there, Verb::Shutdown), true)
        .unwrap_err();
    assert!(refusal.message.contains("first"), "{}", refusal.message);
    ownership.admit(&ask(&there, Verb::Status), true).unwrap();
    ownership
        .admit(&ask(&there, Verb::Shutdown), false)
        .unwrap();
    ownership.admit(&ask(&gone, Verb::Shutdown), false).unwrap();
    ownership.admit(&ask(&here, Verb::Shutdown), true).unwrap();
}

/// `canter shutdown`: the engine answers and has ended before the client polls again.
#[test]
fn the_last_answer_of_an_engine_that_leaves_is_read() {
    for _ in 0..10 {
        let arm = arm("leaves");
        let server = ClientServer::open(&arm).unwrap();
        let asking = arm.clone();
        let client = thread::spawn(move || {
            let client = Client::open(&asking, "test").unwrap();
            client.ask(Verb::Shutdown, Duration::from_secs(5))
        });
        while server
            .serve(|_| Answer::accept(serde_json::Value::Null))
            .unwrap()
            == 0
        {
            thread::yield_now();
        }
        drop(server);
        assert!(client.join().unwrap().unwrap().accepted);
    }
}

/// Who gave up has asked nothing: an engine that comes to it later does not do it.
#[test]
fn a_request_without_an_answer_is_withdrawn() {
    let arm = arm("withdrawn");
    let server = ClientServer::open(&arm).unwrap();
    let client = Client::open(&arm, "test").unwrap();
    let gave_up = client.ask(Verb::Shutdown, Duration::from_millis(30));
    assert!(
        matches!(gave_up, Err(IpcError::NoAnswer { .. })),
        "{gave_up:?}"
    );
    let mut asked = Vec::new();
    server
        .serve(|request| {
            asked.push(request.ask);
            Answer::accept(serde_json::Value::Null)
        })
        .unwrap();
    assert_eq!(asked, [], "nothing is left to be done");
}

/// An engine that has taken a request and is slow is waited for.
#[test]
fn a_request_that_was_taken_is_waited_for() {
    let arm = arm("taken-late");
    let server = ClientServer::open(&arm).unwrap();
    let asking = arm.clone();
    let client = thread::spawn(move || {
        let client = Client::open(&asking, "test").unwrap();
        client.ask(Verb::Shutdown, Duration::from_millis(200))
    });
    let slow = |_: Request| {
        thread::sleep(Duration::from_millis(600));
        Answer::accept(serde_json::Value::Null)
    };
    while server.serve(slow).unwrap() == 0 {
        thread::yield_now();
    }
    assert!(client.join().unwrap().unwrap().accepted);
}

/// The answer to a request that timed out reaches no other client.
#[test]
fn an_answer_reaches_only_who_asked() {
    let arm = arm("numbered");
    let server = ClientServer::open(&arm).unwrap();
    let echo = |request: Request| Answer::accept(serde_json::to_value(&request.ask).unwrap());
    for _ in 0..20 {
        let client = Client::open(&arm, "test").unwrap();
        let gave_up = client.ask(Verb::Status, Duration::ZERO);
        assert!(gave_up.is_err());
        drop(client);
        let asking = arm.clone();
        let next = thread::spawn(move || {
            let client = Client::open(&asking, "test").unwrap();
            client.ask(Verb::Notes { since: 7 }, Duration::from_secs(5))
        });
        while !next.is_finished() {
            server.serve(echo).unwrap();
        }
        let answer = next.join().unwrap().unwrap();
        assert_eq!(answer.body["verb"], "notes", "{answer:?}");
    }
}

/// A client that asks without a pause does not keep others from their turn, nor the engine in it.
#[test]
fn every_client_has_its_turn() {
    let arm = arm("flood");
    let server = ClientServer::open(&arm).unwrap();
    let stop = AtomicBool::new(false);
    thread::scope(|scope| {
        let flood = || {
            let client = Client::open(&arm, "flood").unwrap();
            while !stop.load(Ordering::Relaxed) {
                // No client waits for the answers.
                let _ = client.ask(Verb::Status, Duration::ZERO);
            }
        };
        scope.spawn(flood);
        scope.spawn(flood);
        let quiet = scope.spawn(|| {
            let client = Client::open(&arm, "quiet").unwrap();
            let answers = (0..20).map(|since| {
                let answer = client.ask(Verb::Notes { since }, Duration::from_secs(20));
                answer.unwrap().accepted
            });
            answers.filter(|accepted| *accepted).count()
        });
        let mut most = 0;
        while !quiet.is_finished() {
            let served = server.serve(|_| {
                // As long as a status takes.
                thread::sleep(Duration::from_micros(200));
                Answer::accept(serde_json::Value::Null)
            });
            most = most.max(served.unwrap());
        }
        stop.store(true, Ordering::Relaxed);
        assert_eq!(quiet.join().unwrap(), 20);
        assert!(most <= 32, "{most} in a turn");
    });
}
