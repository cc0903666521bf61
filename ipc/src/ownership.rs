//! Which client commands the arm.

use crate::{Answer, Identity, Request};

/// Which client commands the arm. A commanding client that is dead, or that has let go, makes
/// place for the next.
#[derive(Clone, Debug, Default)]
pub struct Ownership {
    owner: Option<Identity>,
}

impl Ownership {
    /// Whether `request` may be obeyed; takes ownership where nobody has it. `busy` says whether
    /// a program of the owner is still under way: an idle arm belongs to whoever comes.
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

    /// Gives the arm to `client`, which nobody else has.
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
