use std::io::{self, Write};
use std::path::PathBuf;
use std::thread::sleep;
use std::time::{Duration, Instant};

use clap::Args;
use ipc::{Answer, Arm, Client, ControlAnswer, ControlAsk, ControlClient, Domain, Verb};

use crate::damage;
use crate::exit::Exit;
use crate::failure::Failure;

/// How long an engine may take to answer; it answers between two periods of its main loop.
const PATIENCE: Duration = Duration::from_secs(3);

/// After this time a client that waits counts as blocked by damaged segments; longer than all its
/// own time limits.
pub(crate) const HANG: Duration = Duration::from_secs(15);

/// How long to wait for a stop: a gentle one takes about a third of a second if the joint limits
/// allow it.
const REST: Duration = Duration::from_secs(3);

/// How often the engine is asked whether the arm rests.
const LOOK: Duration = Duration::from_millis(2);

/// The domain in which engine, driver and clients find each other.
#[derive(Args, Clone, Debug)]
pub(crate) struct DomainOption {
    /// Directory in which engine, driver and clients find each other, for this user only [default:
    /// $CANTER_DOMAIN, else canter in the user's runtime directory]
    #[arg(long, value_name = "DIR")]
    domain: Option<PathBuf>,
}

impl DomainOption {
    /// The domain that was chosen.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when its directory cannot be used.
    pub(crate) fn open(&self) -> Result<Domain, Failure> {
        let domain = Domain::choose(self.domain.as_deref(), |name| std::env::var_os(name))?;
        damage::watch(&domain);
        Ok(domain)
    }
}

/// Which arm a command is about.
#[derive(Args, Debug)]
pub(crate) struct ArmOption {
    /// Name of the arm, as cell/arm; engine, driver and clients find each other by it
    #[arg(long, value_name = "CELL/ARM", default_value = "canter/arm")]
    arm: String,
    #[command(flatten)]
    domain: DomainOption,
}

impl ArmOption {
    /// The arm in its domain.
    ///
    /// # Errors
    /// [`Exit::Usage`] for a wrong name, [`Exit::NoPeer`] when the domain cannot be used.
    pub(crate) fn open(&self) -> Result<Arm, Failure> {
        Ok(self.domain.open()?.arm(&self.arm)?)
    }

    /// Asks the arm's engine and waits for the answer.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when no engine answers, [`Exit::Refused`] with the engine's reason when it
    /// refuses.
    pub(crate) fn ask(&self, verb: Verb) -> Result<Answer, Failure> {
        let arm = self.open()?;
        let answer = damage::bounded(HANG, || {
            Client::open(&arm, "canter").and_then(|client| client.ask(verb, PATIENCE))
        });
        accepted(answer?)
    }

    /// Sends a request about the current motion and waits until it acts; with `rest`, also until
    /// the arm rests, but no longer than a stop takes. Prints the state that was reached on
    /// standard output.
    ///
    /// # Errors
    /// [`Exit::NoPeer`] when no engine answers, [`Exit::Refused`] with the engine's reason when it
    /// refuses.
    pub(crate) fn control(&self, ask: ControlAsk, rest: bool) -> Result<Exit, Failure> {
        let arm = self.open()?;
        let asked = Instant::now();
        let (client, mut answer) = damage::bounded(HANG, || {
            let client = ControlClient::open(&arm)?;
            client.ask(ask, PATIENCE).map(|answer| (client, answer))
        })?;
        if answer.accepted == 0 {
            let reason = anyhow::anyhow!(answer.reason());
            return Err(Failure::new(Exit::Refused, reason));
        }
        let first = answer.tick;
        while rest && answer.resting == 0 && asked.elapsed() < REST {
            sleep(LOOK);
            answer = client.ask(ControlAsk::Look, PATIENCE)?;
        }
        let text = reached(&answer, first, asked.elapsed());
        writeln!(io::stdout().lock(), "{text}")?;
        Ok(Exit::Done)
    }

    /// Asks, and prints the engine's message, if any, to standard error.
    ///
    /// # Errors
    /// As [`Self::ask`].
    pub(crate) fn tell(&self, verb: Verb) -> Result<Exit, Failure> {
        let answer = self.ask(verb)?;
        if !answer.message.is_empty() {
            crate::output::note(&answer.message);
        }
        Ok(Exit::Done)
    }
}

/// Where the motion is, in one line.
fn reached(answer: &ControlAnswer, first: u64, took: Duration) -> String {
    let held = if answer.held == 0 { "" } else { ", held" };
    let fault = if answer.fault == 0 {
        ""
    } else {
        ", a fault is latched"
    };
    let at = if answer.resting == 1 {
        "at rest".to_owned()
    } else if answer.held == 1 {
        format!("slowing, at {:.0} % speed", answer.time_scaling * 100.0)
    } else {
        format!("moving at {:.0} % speed", answer.time_scaling * 100.0)
    };
    format!(
        "{at}{held}{fault}; acts from period {first} on, after {} ms",
        took.as_millis()
    )
}

/// The answer, or the engine's refusal as a failure.
///
/// # Errors
/// [`Exit::Refused`] when the engine said no.
pub(crate) fn accepted(answer: Answer) -> Result<Answer, Failure> {
    if answer.accepted {
        Ok(answer)
    } else {
        Err(Failure::new(Exit::Refused, anyhow::anyhow!(answer.message)))
    }
}
