//! Parameters of the robot and of its end effector: they are kept and reported, and change nothing.
//!
//! # Source
//! NIST, CRCLCommands.xsd (2021Apr28), SetRobotParametersType: what the settings mean is not part of
//! the language.

use crcl::xml::{Parameter, XmlCommand};

/// How many parameters of each kind are kept.
const MOST: usize = 16;

/// The longest name and the longest value (characters).
const LONGEST: usize = 64;

/// The parameters that clients have set, the newest value of each name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Parameters {
    /// Those of SetRobotParameters.
    pub(crate) robot: Vec<Parameter>,
    /// Those of SetEndEffectorParameters.
    pub(crate) end_effector: Vec<Parameter>,
}

impl Parameters {
    /// Keeps what a command sets; nothing for a command of another kind.
    ///
    /// # Errors
    /// A sentence about a parameter that is too long, or one too many. Nothing of the command is
    /// kept then.
    pub(crate) fn set(&mut self, command: &XmlCommand) -> Option<Result<(), String>> {
        let (kept, given) = match command {
            XmlCommand::SetRobotParameters(given) => (&mut self.robot, given),
            XmlCommand::SetEndEffectorParameters(given) => (&mut self.end_effector, given),
            _ => return None,
        };
        let mut all = kept.clone();
        for parameter in given {
            let long = |text: &str| text.chars().count() > LONGEST;
            if long(&parameter.name) || long(&parameter.value) {
                let why = format!("a parameter has at most {LONGEST} characters in name and value");
                return Some(Err(why));
            }
            all.retain(|other| other.name != parameter.name);
            all.push(parameter.clone());
        }
        if all.len() > MOST {
            let why = format!("{MOST} parameters are kept, not {}", all.len());
            return Some(Err(why));
        }
        *kept = all;
        Some(Ok(()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(name: &str, value: &str) -> XmlCommand {
        XmlCommand::SetRobotParameters(vec![Parameter {
            name: name.to_owned(),
            value: value.to_owned(),
        }])
    }

    #[test]
    fn the_newest_value_of_a_name_counts() {
        let mut kept = Parameters::default();
        for value in ["1", "2"] {
            assert_eq!(kept.set(&set("a", value)), Some(Ok(())));
        }
        assert_eq!((kept.robot.len(), kept.robot[0].value.as_str()), (1, "2"));
        assert!(kept.end_effector.is_empty());
        assert_eq!(kept.set(&XmlCommand::InitCanon), None);
        let long = "x".repeat(LONGEST + 1);
        assert!(matches!(kept.set(&set("b", &long)), Some(Err(_))));
        for number in 1..MOST {
            assert_eq!(kept.set(&set(&format!("n{number}"), "")), Some(Ok(())));
        }
        assert!(matches!(kept.set(&set("one more", "")), Some(Err(_))));
        assert_eq!(kept.robot.len(), MOST);
    }
}
