//! The engine's notes in words, for `/rosout`.

use ros2_client::log::LogLevel;
use serde_json::Value;

/// A note in words and how much it matters.
pub(crate) fn words(note: &Value) -> (LogLevel, String) {
    let text = |of: &str| note[of].as_str().unwrap_or_default().to_owned();
    let number = |of: &str| note[of].as_u64().unwrap_or(0);
    let (name, line) = (text("name"), number("line"));
    let place = if line == 0 {
        name.clone()
    } else {
        format!("line {line}: {name}")
    };
    match note["event"].as_str().unwrap_or_default() {
        "started" => (LogLevel::Debug, format!("{place} started")),
        "done" => (LogLevel::Debug, format!("{place} done")),
        "refused" => {
            let why = note["error"]["message"].as_str().unwrap_or_default();
            (LogLevel::Warn, format!("{place} refused: {why}"))
        }
        "message" => (LogLevel::Info, text("text")),
        "ended" => {
            let reason = note["reason"].as_i64().unwrap_or(0);
            (
                LogLevel::Info,
                format!("the program ended with reason {reason}"),
            )
        }
        "stopped" => (
            LogLevel::Info,
            "the arm rests after a pause or a stop".to_owned(),
        ),
        "aborted" => {
            let dropped = number("dropped");
            (
                LogLevel::Warn,
                format!("aborted, {dropped} commands dropped"),
            )
        }
        "not-arrived" | "end-missed" | "not-settled" => (LogLevel::Warn, missed(note)),
        "faulted" => (LogLevel::Error, format!("fault: {}", text("reason"))),
        "recovered" => (LogLevel::Info, "the fault is cleared".to_owned()),
        "closed" => (LogLevel::Error, "the engine has ended".to_owned()),
        _ => (LogLevel::Info, note.to_string()),
    }
}

/// Where the arm is not, although the plan is, in words.
fn missed(note: &Value) -> String {
    let number = |key: &str| note[key].as_f64().unwrap_or(f64::NAN);
    let (joint, error) = (number("joint"), number("error"));
    match note["event"].as_str() {
        Some("not-arrived") => {
            format!("joint {joint} is {error:.4} from its end and does not arrive")
        }
        Some("end-missed") => {
            let (point, angle) = (number("off_m") * 1e3, number("off_rad").to_degrees());
            format!(
                "the measured tool came no nearer to its end than {point:.3} mm and {angle:.3} degrees"
            )
        }
        _ => format!(
            "joint {joint} is {error:.6} from the last setpoint, and the driver does not come to rest"
        ),
    }
}

/// What became of commands, as far as a note tells.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Fate {
    /// A command began to move.
    Started(u64),
    /// A command is over.
    Done(u64),
    /// A command was refused and had no effect.
    Refused(u64, String),
    /// All commands are dropped; the reason in words.
    Dropped(String),
    /// Nothing.
    Other,
}

impl Fate {
    /// What a note tells.
    pub(crate) fn of(note: &Value) -> Self {
        let id = note["id"].as_u64().unwrap_or(0);
        match note["event"].as_str().unwrap_or_default() {
            "started" => Self::Started(id),
            "done" => Self::Done(id),
            "refused" => {
                let why = note["error"]["message"].as_str().unwrap_or_default();
                let help = note["error"]["help"].as_str();
                let help = help.map_or(String::new(), |help| format!("; {help}"));
                Self::Refused(id, format!("{why}{help}"))
            }
            "faulted" => Self::Dropped(note["reason"].as_str().unwrap_or("a fault").to_owned()),
            "aborted" => Self::Dropped("the motion was stopped and dropped".to_owned()),
            "closed" => Self::Dropped("the engine has ended".to_owned()),
            _ => Self::Other,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn notes_have_words_and_fates() {
        let note = json!({"event": "refused", "id": 7, "line": 0, "name": "FollowJointTrajectory",
            "error": {"message": "velocity of elbow is 1.2 times its limit", "help": "more time"}});
        let (level, said) = words(&note);
        assert_eq!(level, LogLevel::Warn);
        assert!(
            said.starts_with("FollowJointTrajectory refused: velocity of elbow"),
            "{said}"
        );
        let Fate::Refused(7, why) = Fate::of(&note) else {
            panic!("{note}");
        };
        assert!(why.ends_with("; more time"));
        let fault = json!({"event": "faulted", "blame": "driver", "reason": "no state for 60 ms"});
        assert_eq!(words(&fault).0, LogLevel::Error);
        assert_eq!(
            Fate::of(&fault),
            Fate::Dropped("no state for 60 ms".to_owned())
        );
        assert_eq!(Fate::of(&json!({"event": "done", "id": 3})), Fate::Done(3));
    }
}
