use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use ipc::{Answer, Arm, Client, Domain, Verb};

use crate::damage;
use crate::exit::Exit;
use crate::failure::Failure;

/// How long an engine may take to answer; it answers between two periods of its main loop.
const PATIENCE: Duration = Duration::from_secs(3);

/// After this time an asking client is caught in damaged segments; longer than all that it waits
/// for by itself.
const HANG: Duration = Duration::from_secs(15);

/// In which domain engine, driver and clients find each other.
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
    /// [`Exit::NoPeer`] when no engine answers, [`Exit::Refused`] with the engine's words when it
    /// refuses.
    pub(crate) fn ask(&self, verb: Verb) -> Result<Answer, Failure> {
        let arm = self.open()?;
        let answer = damage::bounded(HANG, || {
            Client::open(&arm, "canter").and_then(|client| client.ask(verb, PATIENCE))
        });
        accepted(answer?)
    }

    /// Asks, prints the engine's words, if any, to standard error.
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
