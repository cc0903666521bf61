use std::io::Write;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::thread::sleep;
use std::time::Duration;

use serde_json::json;
use zenoh::{Config, Wait};

use crate::failure::Failure;
use crate::link::{files, tls, until_signal};

/// Run the router of a fleet
///
/// Reads router.json5 in its folder of keys; `zenohd -c router.json5`, started in that folder, does the
/// same. It knows no arm: it lets pass what certificates allow.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Router {
    /// The router's folder, as `canter-fleet keys` makes it
    #[arg(long, value_name = "FOLDER")]
    keys: PathBuf,
    /// Where to listen, in place of what router.json5 says
    #[arg(long, value_name = "tls/ADDRESS:PORT")]
    listen: Option<String>,
}

impl Router {
    /// Runs until a signal comes.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let ends = until_signal()?;
        let path = self.keys.join("router.json5");
        let wrong = |cause: String| Failure::Unreadable(format!("{}: {cause}", path.display()));
        let mut config = Config::from_file(&path).map_err(|cause| wrong(cause.to_string()))?;
        let mut set = |at: &str, value: &serde_json::Value| {
            let set = config.insert_json5(at, &value.to_string());
            set.map_err(|cause| wrong(format!("{at}: {cause}")))
        };
        // The names of the files are those of this machine.
        set("transport/link/tls", &tls(&files(&self.keys)?))?;
        if let Some(listen) = &self.listen {
            if !listen.starts_with("tls/") {
                let got = format!("expected tls/ADDRESS:PORT, got {listen:?}");
                return Err(Failure::Usage(got));
            }
            set("listen/endpoints", &json!([listen]))?;
        }
        let endpoints = config.get_json("listen/endpoints").unwrap_or_default();
        let session = zenoh::open(config)
            .wait()
            .map_err(|cause| Failure::NoPeer(format!("no router: {cause}")))?;
        // Nobody may listen.
        let _ = writeln!(
            std::io::stderr().lock(),
            "canter-fleet: router listens at {endpoints}"
        );
        while !ends.load(Ordering::Acquire) {
            sleep(Duration::from_millis(50));
        }
        session.close().wait().map_err(Failure::link)
    }
}
