//! Programs with a number of the sender's: each is taken once, however often it comes.

use std::collections::{HashMap, VecDeque};
use std::time::{SystemTime, UNIX_EPOCH};

use ipc::{Answer, Verb, model_hash};
use serde_json::{Value, json};

/// How many numbers are known at least: those of the latest programs.
const KEPT: usize = 4096;

/// The longest number of a sender (bytes).
const LONGEST: usize = 100;

/// The programs that this engine has taken, by the number that their sender gave them.
///
/// A sender that got no answer sends the same again, and nothing moves twice. An engine that was
/// started again knows no numbers, so a program also names the session it is for.
#[derive(Debug)]
pub(crate) struct TakenOnce {
    session: String,
    order: VecDeque<String>,
    known: HashMap<String, (u64, Value)>,
}

impl TakenOnce {
    /// For an engine that starts now.
    pub(crate) fn new() -> Self {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let now = since.unwrap_or_default().as_nanos();
        Self::of(&format!("{:x}-{now:x}", std::process::id()))
    }

    fn of(session: &str) -> Self {
        Self {
            session: session.to_owned(),
            order: VecDeque::new(),
            known: HashMap::new(),
        }
    }

    /// Names this run of the engine; no other has the same name.
    pub(crate) fn session(&self) -> &str {
        &self.session
    }

    /// The answer to a program that is not to be taken (any more); none for one that is, and for
    /// everything else.
    pub(crate) fn answer(&self, verb: &Verb) -> Option<Answer> {
        let Verb::SubmitOnce { id, session, .. } = verb else {
            return None;
        };
        if id.is_empty() || id.len() > LONGEST || !id.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Some(Answer::refuse(format!(
                "the number of a program is 1 to {LONGEST} letters, digits and signs, got {:?}",
                id.chars().take(LONGEST).collect::<String>()
            )));
        }
        if *session != self.session {
            return Some(Answer::refuse(format!(
                "the engine was started again: the program is for session {session:?}, this is \
                 {:?}; what became of it before is not known; look at the arm, then send it with \
                 a new number",
                self.session
            )));
        }
        let (hash, body) = self.known.get(id)?;
        if *hash != hash_of(verb) {
            return Some(Answer::refuse(format!(
                "the number {id:?} belongs to another program, which was taken"
            )));
        }
        let mut body = body.clone();
        body["again"] = json!(true);
        Some(Answer::accept(body))
    }

    /// Keeps the answer to a program that was taken.
    pub(crate) fn keep(&mut self, verb: &Verb, answer: &Answer) {
        let Verb::SubmitOnce { id, .. } = verb else {
            return;
        };
        if !answer.accepted {
            return;
        }
        if self.order.len() == KEPT
            && let Some(oldest) = self.order.pop_front()
        {
            self.known.remove(&oldest);
        }
        self.order.push_back(id.clone());
        let kept = (hash_of(verb), answer.body.clone());
        self.known.insert(id.clone(), kept);
    }
}

/// A checksum of the program.
fn hash_of(verb: &Verb) -> u64 {
    verb.program().map_or(0, |program| {
        let parts = [program.format, program.name, program.text];
        model_hash(parts.join("\0").as_bytes())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn program(id: &str, session: &str, text: &str) -> Verb {
        Verb::SubmitOnce {
            id: id.to_owned(),
            session: session.to_owned(),
            format: "text".to_owned(),
            name: "p".to_owned(),
            program: text.to_owned(),
        }
    }

    #[test]
    fn a_number_is_taken_once() {
        let mut once = TakenOnce::of("s");
        let first = program("a", "s", "x");
        assert!(once.answer(&first).is_none());
        once.keep(&first, &Answer::refuse("full"));
        assert!(once.answer(&first).is_none(), "refused: it may come again");
        once.keep(&first, &Answer::accept(json!({"first": 3, "last": 4})));
        let again = once.answer(&first).unwrap();
        assert!(again.accepted);
        assert_eq!(
            again.body,
            json!({"first": 3, "last": 4, "again": true}),
            "the answer of the first time"
        );
        let other = once.answer(&program("a", "s", "y")).unwrap();
        assert!(!other.accepted && other.message.contains("another program"));
        let late = once.answer(&program("b", "r", "x")).unwrap();
        assert!(!late.accepted && late.message.contains("started again"));
        for wrong in ["", "a b", "ä", &"x".repeat(LONGEST + 1)] {
            assert!(!once.answer(&program(wrong, "s", "x")).unwrap().accepted);
        }
        assert!(once.answer(&Verb::Status).is_none());
        assert_ne!(TakenOnce::new().session(), TakenOnce::new().session());
    }

    #[test]
    fn the_oldest_numbers_are_forgotten() {
        let mut once = TakenOnce::of("s");
        let yes = Answer::accept(Value::Null);
        for number in 0..=KEPT {
            let one = program(&number.to_string(), "s", "x");
            assert!(once.answer(&one).is_none());
            once.keep(&one, &yes);
        }
        assert_eq!(once.known.len(), KEPT);
        assert!(once.answer(&program("0", "s", "x")).is_none());
        assert!(once.answer(&program("1", "s", "x")).is_some());
    }
}
