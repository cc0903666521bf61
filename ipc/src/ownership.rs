//! Which client commands the arm.

use crate::{Answer, Identity, Request};

/// Which client commands the arm. A client can take over when the one before has ended or released
/// the arm.
#[derive(Clone, Debug, Default)]
pub struct Ownership {
    owner: Option<Identity>,
}

impl Ownership {
    /// Whether `request` may be executed; takes ownership if no client has it. `busy` says whether
    /// a program of the owner still runs: an idle arm has no owner.
    ///
    /// # Errors
    /// The refusal, with the owner's name.
    pub fn admit(&mut self, request: &Request, busy: bool) -> Result<(), Answer> {
        if !request.ask.commands() {
            return Ok(());
        }
        match &self.owner {
            Some(owner) if *owner != request.client && busy && is_alive(owner.process) => {
                Err(Answer::refuse(format!(
                    "the arm is commanded by {:?} (process {})",
                    owner.name, owner.process
                )))
            }
            _ => {
                self.owner = Some(request.client.clone());
                Ok(())
            }
        }
    }

    /// Gives the arm to `client`; it must have no other owner.
    pub fn give(&mut self, client: Identity) {
        self.owner = Some(client);
    }

    /// Who commands.
    pub fn owner(&self) -> Option<&Identity> {
        self.owner.as_ref()
    }
}

/// Whether a process of this number exists.
fn is_alive(process: u32) -> bool {
    std::path::Path::new("/proc")
        .join(process.to_string())
        .exists()
}
