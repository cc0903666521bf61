//! The arms of a cell as members of a fleet.

use std::collections::HashSet;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::{self, sleep};
use std::time::Duration;

use ipc::{Arm, Domain};
use zenoh::{Session, Wait};

use crate::answers::declare;
use crate::failure::Failure;
use crate::link::{LinkOption, open_patiently, until_signal};
use crate::reporter::Reporter;

/// Make the arms of this cell members of a fleet
///
/// Runs beside the engines of the cell: publishes their reports and notes, and hands on programs,
/// pauses and stops from whoever has the right. It may be started before router and engines, and
/// survives both. Ctrl-C ends it; the arms go on.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Cell {
    /// Name of an arm, as cell/arm; may be given several times
    #[arg(long = "arm", value_name = "CELL/ARM", required = true)]
    arms: Vec<String>,
    /// Directory in which engine, driver and clients find each other [default: $CANTER_DOMAIN, else
    /// canter in the user's runtime directory]
    #[arg(long, value_name = "DIR")]
    domain: Option<PathBuf>,
    #[command(flatten)]
    link: LinkOption,
}

impl Cell {
    /// Serves until a signal comes.
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let ends = until_signal()?;
        let domain = Domain::choose(self.domain.as_deref(), |name| std::env::var_os(name))?;
        let arms = self.arms.iter().collect::<HashSet<_>>();
        let arms = arms
            .into_iter()
            .map(|name| domain.arm(name))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| Failure::Usage(error.to_string()))?;
        let Some(session) = open_patiently(&self.link, &ends, say)? else {
            return Ok(());
        };
        let mut answering = Vec::new();
        let mut reporting = Vec::new();
        for arm in &arms {
            answering.push(declare(&session, arm)?);
            reporting.push(report(&session, arm, &ends)?);
        }
        say(&format!(
            "canter-fleet: {} at {}",
            self.arms.join(", "),
            self.link.router
        ));
        while !ends.load(Ordering::Acquire) {
            sleep(Duration::from_millis(50));
        }
        for thread in reporting {
            // It has nothing left to say.
            let _ = thread.join();
        }
        drop(answering);
        session.close().wait().map_err(Failure::link)
    }
}

/// A line for who started it.
fn say(line: &str) {
    // Nobody may listen.
    let _ = writeln!(std::io::stderr().lock(), "{line}");
}

/// Starts the thread that reports; its ports stay in the thread that opens them.
fn report(
    session: &Session,
    arm: &Arm,
    ends: &Arc<AtomicBool>,
) -> Result<thread::JoinHandle<()>, Failure> {
    let (session, arm, ends) = (session.clone(), arm.clone(), Arc::clone(ends));
    let (tell, opened) = channel();
    let thread = thread::Builder::new()
        .name("reporter".to_owned())
        .spawn(move || match Reporter::open(&session, &arm) {
            Ok(reporter) => {
                let _ = tell.send(Ok(()));
                reporter.run(&ends);
            }
            Err(error) => {
                let _ = tell.send(Err(error));
            }
        })
        .map_err(|cause| Failure::NoPeer(format!("no thread: {cause}")))?;
    opened
        .recv()
        .map_err(|_| Failure::NoPeer("a thread has ended early".to_owned()))??;
    Ok(thread)
}
