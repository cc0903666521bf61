//! Another process made the services with messages of another layout: the error says what to do.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};

use ::ipc::{Domain, DriverLink, EngineLink, IpcError};
use iceoryx2::prelude::{Config, FileName, NodeBuilder, Path, SemanticString, ServiceName};

/// Tells the child process which arm to spoil.
const ARM: &str = "CANTER_TEST_MISMATCH";

fn domain() -> Domain {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("domain");
    Domain::open(&folder).unwrap()
}

/// Not a test of its own: the other process.
#[test]
#[ignore = "run by the test below, as a process of its own"]
fn another_layout() {
    let Ok(arm) = std::env::var(ARM) else { return };
    let mut config = Config::default();
    let (domain, directory) = (domain(), domain().directory().to_owned());
    config.global.prefix = FileName::new(domain.prefix().as_bytes()).unwrap();
    let directory = Path::new(directory.as_os_str().as_encoded_bytes()).unwrap();
    config.global.set_root_path(&directory);
    let node = NodeBuilder::new()
        .config(&config)
        .create::<iceoryx2::service::ipc::Service>()
        .unwrap();
    let name = ServiceName::new(&format!("{arm}/setpoint")).unwrap();
    let _service = node
        .service_builder(&name)
        .publish_subscribe::<[u64; 4]>()
        .open_or_create()
        .unwrap();
    println!("made");
    std::io::stdout().flush().unwrap();
    // Until the parent lets go.
    let _ = std::io::stdin().lock().read_line(&mut String::new());
}

#[test]
fn another_layout_is_refused_in_words() {
    let name = format!("mismatch-{}/arm", std::process::id());
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "another_layout", "--ignored", "--nocapture"])
        .env(ARM, &name)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(
        lines
            .map_while(Result::ok)
            .any(|line| line.contains("made"))
    );
    let arm = domain().arm(&name).unwrap();
    let engine = EngineLink::open(&arm).err().unwrap();
    let driver = DriverLink::open(&arm).err().unwrap();
    child.stdin.take().unwrap().write_all(b"\n").unwrap();
    child.wait().unwrap();
    for error in [engine, driver] {
        assert!(matches!(error, IpcError::Incompatible { .. }), "{error}");
        let words = "build both from the same version";
        assert!(error.to_string().contains(words), "{error}");
    }
    // Once it is gone, the arm can be used.
    EngineLink::open(&arm).unwrap();
}
