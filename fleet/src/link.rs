//! The encrypted link to a router, with a certificate on both sides.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread::sleep;
use std::time::Duration;

use serde_json::{Value, json};
use zenoh::query::{ConsolidationMode, QueryTarget};
use zenoh::{Config, Session, Wait};

use crate::failure::{Failure, words};
use crate::keys;

/// After this time without a word the other side counts as gone (ms).
const LEASE_MS: u64 = 4000;

/// Time between two attempts to reach a router.
const AGAIN: Duration = Duration::from_secs(1);

/// Where a router is and who we are.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct LinkOption {
    /// Folder with authority.pem, cert.pem and key.pem, as `canter-fleet keys` makes it
    #[arg(long, value_name = "FOLDER")]
    pub(crate) keys: std::path::PathBuf,
    /// The router
    #[arg(
        long,
        value_name = "tls/HOST:PORT",
        default_value = "tls/127.0.0.1:7447"
    )]
    pub(crate) router: String,
}

/// The files of a folder of keys: authority, certificate, key.
///
/// # Errors
/// One of them is no file.
pub(crate) fn files(folder: &Path) -> Result<[String; 3], Failure> {
    let file = |name: &str| {
        let path = folder.join(name);
        let shown = path.display().to_string();
        if path.is_file() {
            return Ok(shown);
        }
        Err(Failure::Unreadable(format!(
            "{shown} is no file; canter-fleet keys makes such folders"
        )))
    };
    Ok([file("authority.pem")?, file("cert.pem")?, file("key.pem")?])
}

/// The settings of both sides of a link.
pub(crate) fn tls([authority, certificate, key]: &[String; 3]) -> Value {
    json!({
        "root_ca_certificate": authority,
        "listen_certificate": certificate,
        "listen_private_key": key,
        "connect_certificate": certificate,
        "connect_private_key": key,
        "enable_mtls": true,
        "verify_name_on_connect": true,
        "close_link_on_expiration": true,
    })
}

/// The settings of a client of a router.
fn client(option: &LinkOption) -> Result<Config, Failure> {
    if !option.router.starts_with("tls/") {
        return Err(Failure::Usage(format!(
            "a router is tls/HOST:PORT, got {:?}: without certificates anybody could move the arms",
            option.router
        )));
    }
    let all = json!({
        "mode": "client",
        "connect": {
            "endpoints": [option.router],
            "timeout_ms": 0,
            "exit_on_failure": true,
            "retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2.0},
        },
        "scouting": {"multicast": {"enabled": false}, "gossip": {"enabled": false}},
        "transport": {"link": {
            "protocols": ["tls"],
            "tx": {
                "lease": LEASE_MS,
                // A link that is full for longer is closed (decision 0146).
                "queue": {"congestion_control": {"block": {"wait_before_close": 200_000}}},
            },
            "tls": tls(&files(&option.keys)?),
        }},
    });
    Config::from_json5(&all.to_string())
        .map_err(|cause| Failure::Usage(format!("settings of the link: {cause}")))
}

/// Links to a router.
///
/// # Errors
/// No router answers, or it does not accept the certificate.
pub(crate) fn open(option: &LinkOption) -> Result<Session, Failure> {
    let config = client(option)?;
    zenoh::open(config).wait().map_err(|cause| {
        Failure::NoPeer(format!(
            "no link to the router at {}: {}",
            option.router,
            words(cause)
        ))
    })
}

/// Links to a router as soon as there is one; none where `ends` comes first. `say` gets the first
/// failure.
///
/// # Errors
/// The keys or the name of the router are wrong.
pub(crate) fn open_patiently(
    option: &LinkOption,
    ends: &AtomicBool,
    say: impl Fn(&str),
) -> Result<Option<Session>, Failure> {
    let mut said = false;
    while !ends.load(Ordering::Acquire) {
        match open(option) {
            Ok(session) => return Ok(Some(session)),
            Err(Failure::NoPeer(why)) if !said => {
                say(&format!("{why}; trying again"));
                said = true;
            }
            Err(Failure::NoPeer(_)) => {}
            Err(other) => return Err(other),
        }
        sleep(AGAIN);
    }
    Ok(None)
}

/// Asks an arm, or all arms with `*/*`; the answers by arm, as they come until `patience` is over.
/// An arm that does not answer gives none: what became of the question is then not known.
///
/// # Errors
/// The session is closed.
pub(crate) fn ask(
    session: &Session,
    (arm, word): (&str, &str),
    text: &Value,
    patience: Duration,
) -> Result<Vec<(String, Value)>, Failure> {
    let (tell, heard) = mpsc::channel();
    session
        .get(keys::ask(arm, word))
        .payload(text.to_string())
        .target(QueryTarget::All)
        .consolidation(ConsolidationMode::None)
        .timeout(patience)
        .callback(move |reply| {
            // Nobody listens after the last answer.
            let _ = tell.send(reply);
        })
        .wait()
        .map_err(Failure::link)?;
    let mut answers = Vec::new();
    // Ends when zenoh drops the callback: all have answered, or the time is over.
    while let Ok(reply) = heard.recv_timeout(patience + AGAIN) {
        let Ok(sample) = reply.result() else {
            continue;
        };
        let answer = serde_json::from_slice(&sample.payload().to_bytes());
        if let (Some(arm), Ok(answer)) = (keys::answered(sample.key_expr().as_str()), answer) {
            answers.push((arm.to_owned(), answer));
        }
    }
    Ok(answers)
}

/// A flag that a signal sets.
///
/// # Errors
/// The system refuses.
pub(crate) fn until_signal() -> Result<Arc<AtomicBool>, Failure> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let ends = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&ends))
            .map_err(|cause| Failure::NoPeer(format!("no signals: {cause}")))?;
    }
    Ok(ends)
}
