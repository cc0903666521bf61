//! A rule that was broken: where, when and by how much.

use serde::{Serialize, Serializer};

use super::rule::Rule;

/// Which side of a limit is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// The value may be at most the limit.
    AtMost,
    /// The value must be at least the limit.
    AtLeast,
}

/// A value and its limit, in the same unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measure {
    /// What was found.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
    /// On which side of the limit the value may be.
    pub side: Side,
    /// Unit of both; empty for plain numbers.
    pub unit: &'static str,
}

impl Measure {
    pub(super) fn at_most(value: f64, limit: f64, unit: &'static str) -> Self {
        Self {
            value,
            limit,
            side: Side::AtMost,
            unit,
        }
    }

    pub(super) fn at_least(value: f64, limit: f64, unit: &'static str) -> Self {
        Self {
            side: Side::AtLeast,
            ..Self::at_most(value, limit, unit)
        }
    }

    /// Whether the value is on the right side of the limit; NaN never is.
    pub(super) fn holds(&self) -> bool {
        match self.side {
            Side::AtMost => self.value <= self.limit,
            Side::AtLeast => self.value >= self.limit,
        }
    }

    fn excess(&self) -> f64 {
        (self.value - self.limit).abs()
    }
}

/// What a finding is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Subject {
    /// A joint, from 0; written from 1.
    Joint(usize),
    /// A pose of the command, from 0; written from 1.
    Pose(usize),
    /// Anything else, by its name.
    The(&'static str),
}

impl std::fmt::Display for Subject {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Joint(index) => write!(f, "joint {}", index + 1),
            Self::Pose(index) => write!(f, "pose {}", index + 1),
            Self::The(name) => f.write_str(name),
        }
    }
}

impl Serialize for Subject {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// A broken rule: the worst place of it in one command.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The rule.
    pub rule: Rule,
    /// Number of the command in the program, from 0; none for the recording as a whole.
    pub command: Option<usize>,
    /// Line of the command, from 1; 0 without one.
    pub line: usize,
    /// Name of the command; empty without one.
    pub name: &'static str,
    /// What it is about: a joint, a pose, a column.
    pub subject: Subject,
    /// When, s.
    pub time_s: f64,
    /// Value and limit.
    #[serde(flatten)]
    pub measure: Measure,
    /// Why, where no number says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Measure {
            value,
            limit,
            side,
            unit,
        } = self.measure;
        let side = match side {
            Side::AtMost => "at most",
            Side::AtLeast => "at least",
        };
        if let Some(reason) = &self.reason {
            return write!(f, "{}: {reason}", self.rule);
        }
        let space = if unit.is_empty() { "" } else { " " };
        let (rule, subject, time) = (self.rule, self.subject, self.time_s);
        write!(
            f,
            "{rule}: {subject} at {time:.6} s: {value:.9}{space}{unit}, expected {side} {limit:.9}{space}{unit}"
        )
    }
}

/// The findings so far: for each rule and subject the worst.
#[derive(Debug, Default)]
pub(super) struct RuleReport {
    findings: Vec<Finding>,
    /// The command that is judged, its line and name; none for the recording as a whole.
    command: Option<(usize, usize, &'static str)>,
    /// Largest ratio to a limit of motion.
    peak: Option<(f64, Rule, Subject)>,
}

impl RuleReport {
    /// A report about one command: its index, line and name.
    pub(super) fn of(index: usize, line: usize, name: &'static str) -> Self {
        Self {
            command: Some((index, line, name)),
            ..Self::default()
        }
    }

    /// Checks a number against a rule at a time (s); returns whether it holds.
    pub(super) fn hold(
        &mut self,
        rule: Rule,
        subject: Subject,
        time_s: f64,
        measure: Measure,
    ) -> bool {
        if rule.is_limit() {
            let ratio = measure.value / measure.limit;
            if self.peak.is_none_or(|(known, ..)| ratio > known) {
                self.peak = Some((ratio, rule, subject));
            }
        }
        if measure.holds() {
            return true;
        }
        let alike = |other: &&mut Finding| (other.rule, other.subject) == (rule, subject);
        match self.findings.iter_mut().find(alike) {
            Some(known) => {
                if measure.excess() > known.measure.excess() {
                    (known.time_s, known.measure) = (time_s, measure);
                }
            }
            None => {
                let finding = self.finding(rule, subject, time_s, measure);
                self.findings.push(finding);
            }
        }
        false
    }

    /// Adds a command that may not be executed at its place in the program.
    pub(super) fn refuse(&mut self, reason: String, time_s: f64) {
        let subject = Subject::The("the command");
        let measure = Measure::at_most(f64::NAN, f64::NAN, "");
        let finding = self.finding(Rule::Language, subject, time_s, measure);
        self.findings.push(Finding {
            reason: Some(reason),
            ..finding
        });
    }

    fn finding(&self, rule: Rule, subject: Subject, time_s: f64, measure: Measure) -> Finding {
        let (line, name) = self.command.map_or((0, ""), |(_, line, name)| (line, name));
        Finding {
            rule,
            command: self.command.map(|(index, ..)| index),
            line,
            name,
            subject,
            time_s,
            measure,
            reason: None,
        }
    }

    /// The largest ratio to a limit of motion, and of what.
    pub(super) fn peak(&self) -> Option<(f64, String)> {
        let (ratio, rule, subject) = self.peak?;
        let words = rule.name().replace('-', " ");
        Some(match (words.strip_prefix("joint "), subject) {
            (Some(quantity), Subject::Joint(_)) => (ratio, format!("{quantity} of {subject}")),
            _ => (ratio, words),
        })
    }

    /// Takes the findings out.
    pub(super) fn take(&mut self) -> Vec<Finding> {
        std::mem::take(&mut self.findings)
    }
}
