//! Long texts that clients ask for, in parts that fit into an answer.

use crcl::LengthUnit;
use ipc::{Answer, Verb};
use planner::robot::Robot;
use serde::{Deserialize, Serialize};
use serde_json::json;

/// How long a part may be as JSON (bytes).
const PART: usize = ipc::LONGEST_ANSWER / 2;

/// A program that was given to an engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GivenProgram {
    /// `text` or `json`.
    pub form: String,
    /// Its name, for messages.
    pub name: String,
    /// Its text.
    pub text: String,
    /// Number of its first command in the session.
    pub first: u32,
    /// Number of its last command in the session.
    pub last: u32,
    /// Joint positions when it was given (rad, m); none where the arm was not at rest then.
    pub start: Option<Vec<f64>>,
    /// Unit of length until it sets one: `mm`, `m` or `inch`.
    pub default_length: String,
}

impl GivenProgram {
    /// The program that the answer is about, if it was taken; the arm stood at `start` then.
    pub(crate) fn taken(answer: &Answer, verb: &Verb, start: Option<Vec<f64>>) -> Option<Self> {
        let program = verb.program()?;
        let number = |of: &str| answer.body[of].as_u64().unwrap_or(0) as u32;
        answer.accepted.then(|| Self {
            first: number("first"),
            last: number("last"),
            form: program.format.to_owned(),
            name: program.name.to_owned(),
            text: program.text.to_owned(),
            start,
            default_length: "mm".to_owned(),
        })
    }

    /// The unit of length until the program sets one.
    #[must_use]
    pub fn length(&self) -> LengthUnit {
        match self.default_length.as_str() {
            "m" => LengthUnit::Meter,
            "inch" => LengthUnit::Inch,
            _ => LengthUnit::Millimeter,
        }
    }

    /// The same with another unit of length.
    pub(crate) fn in_unit(self, default_length: &str) -> Self {
        Self {
            default_length: default_length.to_owned(),
            ..self
        }
    }
}

/// A unit of length in one word, as [`GivenProgram`] has it: `mm`, `m` or `inch`.
#[must_use]
pub fn length_word(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Millimeter => "mm",
        LengthUnit::Meter => "m",
        LengthUnit::Inch => "inch",
    }
}

/// What clients may read.
#[derive(Debug)]
pub(crate) struct Texts {
    urdf: String,
    robot: String,
    /// Where the robot's files are; empty for one that comes with Canter.
    folder: String,
    program: Option<GivenProgram>,
    /// How many programs were given.
    count: u64,
}

impl Texts {
    pub(crate) fn new(robot: &Robot) -> Self {
        Self {
            urdf: robot.urdf.clone(),
            robot: robot.toml.clone(),
            folder: robot
                .folder
                .as_ref()
                .map_or_else(String::new, |folder| folder.display().to_string()),
            program: None,
            count: 0,
        }
    }

    pub(crate) fn give(&mut self, program: GivenProgram) {
        self.count += 1;
        self.program = Some(program);
    }

    /// What is known of the last program but its text, with a number that grows by one with each.
    pub(crate) fn program(&self) -> serde_json::Value {
        self.program.as_ref().map_or(json!(null), |program| {
            json!({
                "number": self.count,
                "form": program.form,
                "name": program.name,
                "first": program.first,
                "last": program.last,
                "start": program.start,
                "default_length": program.default_length,
            })
        })
    }

    /// The part of a text that begins at `from`, and where the next one begins.
    pub(crate) fn part(&self, of: &str, from: usize) -> Answer {
        let text = match of {
            "urdf" => &self.urdf,
            "robot" => &self.robot,
            "folder" => &self.folder,
            "program" => match &self.program {
                Some(program) => &program.text,
                None => return Answer::refuse("no program was given"),
            },
            other => {
                return Answer::refuse(format!(
                    "a text is urdf, robot, folder or program, not {other:?}"
                ));
            }
        };
        let Some(rest) = text.get(from..) else {
            return Answer::refuse(format!("the text has no character at byte {from}"));
        };
        let mut length = 0;
        let part: String = rest
            .chars()
            .take_while(|character| {
                length += written(*character);
                length <= PART
            })
            .collect();
        Answer::accept(json!({
            "number": self.count,
            "next": from + part.len(),
            "length": text.len(),
            "text": part,
        }))
    }
}

/// Bytes of a character in JSON, at most.
fn written(character: char) -> usize {
    match character {
        '"' | '\\' | '\n' | '\r' | '\t' => 2,
        control if control.is_control() => 6,
        other => other.len_utf8(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_comes_in_parts_that_fit() {
        let robot = planner::robot::load("ur5e").unwrap();
        let mut texts = Texts::new(&robot);
        assert!(!texts.part("program", 0).accepted);
        let text = "\u{1}\"\n\u{e4}x".repeat(20_000);
        texts.give(GivenProgram {
            form: "text".to_owned(),
            name: "long".to_owned(),
            text: text.clone(),
            first: 1,
            last: 2,
            start: None,
            default_length: "mm".to_owned(),
        });
        let (mut read, mut from) = (String::new(), 0);
        while from < text.len() {
            let answer = texts.part("program", from);
            assert!(answer.accepted, "{}", answer.message);
            let bytes = serde_json::to_vec(&answer).unwrap().len();
            assert!(bytes <= ipc::LONGEST_ANSWER, "{bytes}");
            read.push_str(answer.body["text"].as_str().unwrap());
            from = answer.body["next"].as_u64().unwrap() as usize;
        }
        assert_eq!(read, text);
        assert!(!texts.part("program", 5).accepted || text.is_char_boundary(5));
        assert!(!texts.part("secrets", 0).accepted);
        assert_eq!(texts.part("urdf", 0).body["length"], robot.urdf.len());
    }
}
