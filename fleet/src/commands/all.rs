//! Questions to several arms or to all.

use std::collections::BTreeMap;
use std::sync::mpsc;
use std::time::Duration;

use serde_json::{Value, json};
use zenoh::{Session, Wait};

use super::{PATIENCE, print};
use crate::failure::Failure;
use crate::keys::{self, Kind};
use crate::link::{LinkOption, ask, open};

/// Some arms or all.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct All {
    /// Names of arms
    #[arg(value_name = "CELL/ARM", required_unless_present = "all")]
    arms: Vec<String>,
    /// All arms
    #[arg(long, conflicts_with = "arms")]
    all: bool,
    #[command(flatten)]
    link: LinkOption,
}

impl All {
    /// Asks each for something that needs no details; prints the answers.
    pub(crate) fn ask(&self, word: &str) -> Result<(), Failure> {
        let session = open(&self.link)?;
        let answers = self.answers(&session, word)?;
        let mut silent = Vec::new();
        let mut refused = Vec::new();
        for (arm, answer) in &answers {
            match answer {
                Some(answer) => {
                    print(&json!({"arm": arm, "accepted": answer["accepted"],
                        "message": answer["message"], "body": answer["body"]}))?;
                    if answer["accepted"] != true {
                        refused.push(arm.as_str());
                    }
                }
                None => {
                    print(&json!({"arm": arm, "accepted": Value::Null}))?;
                    silent.push(arm.as_str());
                }
            }
        }
        if !silent.is_empty() {
            return Err(super::unknown(&silent.join(", "), word));
        }
        if answers.is_empty() {
            return Err(Failure::NoPeer(
                "no arm lives, or no right to see it".to_owned(),
            ));
        }
        if !refused.is_empty() {
            let who = refused.join(", ");
            return Err(Failure::Refused(format!("{who}: {word} was refused")));
        }
        Ok(())
    }

    /// Prints how each is.
    pub(crate) fn list(&self) -> Result<(), Failure> {
        let session = open(&self.link)?;
        for (arm, answer) in self.answers(&session, "status")? {
            let alive = answer.is_some();
            let body = answer.map_or(Value::Null, |answer| answer["body"].clone());
            print(&json!({"arm": arm, "alive": alive, "report": body}))?;
        }
        Ok(())
    }

    /// The answers by arm; none for one that lives, or that is named, and does not answer.
    fn answers(
        &self,
        session: &Session,
        word: &str,
    ) -> Result<BTreeMap<String, Option<Value>>, Failure> {
        let nothing = json!({});
        let mut answers = BTreeMap::new();
        // The question first: a stop does not wait for a list of the arms.
        if self.all {
            let heard = ask(session, ("*/*", word), &nothing, PATIENCE)?;
            answers.extend(heard.into_iter().map(|(arm, answer)| (arm, Some(answer))));
            for arm in living(session)? {
                answers.entry(arm).or_insert(None);
            }
            return Ok(answers);
        }
        for arm in &self.arms {
            let heard = ask(session, (arm, word), &nothing, PATIENCE)?;
            let answer = heard.into_iter().next().map(|(_, answer)| answer);
            answers.insert(arm.clone(), answer);
        }
        Ok(answers)
    }
}

/// The arms whose engines answer.
fn living(session: &Session) -> Result<Vec<String>, Failure> {
    let (tell, heard) = mpsc::channel();
    session
        .liveliness()
        .get(keys::of("*/*", Kind::Alive))
        .timeout(PATIENCE)
        .callback(move |reply| {
            // Nobody listens after the last.
            let _ = tell.send(reply);
        })
        .wait()
        .map_err(Failure::link)?;
    let mut arms = Vec::new();
    while let Ok(reply) = heard.recv_timeout(PATIENCE + Duration::from_secs(1)) {
        let sample = reply.result().ok();
        if let Some((arm, _)) = sample.and_then(|sample| keys::read(sample.key_expr().as_str())) {
            arms.push(arm.to_owned());
        }
    }
    Ok(arms)
}
