//! Counts how often each rule was checked, and where one was broken.

use std::collections::BTreeMap;

/// Laws with how often they were judged and broken.
#[derive(Default)]
pub(crate) struct Tally {
    laws: BTreeMap<&'static str, Law>,
    /// The program that is judged, for the list of faults.
    pub(crate) program: String,
    /// The first errors, as text.
    pub(crate) faults: Vec<String>,
    pub(crate) programs: usize,
    pub(crate) moves: usize,
    pub(crate) refused: usize,
}

#[derive(Default)]
struct Law {
    judged: usize,
    broken: usize,
    /// Largest value over its limit.
    worst: f64,
}

/// Number of errors that are kept as text.
const KEPT: usize = 40;

impl Tally {
    /// A value may be at most its limit.
    pub(crate) fn at_most(&mut self, law: &'static str, value: f64, limit: f64) {
        let ratio = if limit > 0.0 { value / limit } else { 0.0 };
        let entry = self.laws.entry(law).or_default();
        entry.judged += 1;
        entry.worst = entry.worst.max(ratio);
        if value <= limit {
            return;
        }
        entry.broken += 1;
        if self.faults.len() < KEPT {
            self.faults
                .push(format!("{}: {law}: {value} beyond {limit}", self.program));
        }
    }

    /// Something must be so.
    pub(crate) fn must(&mut self, law: &'static str, holds: bool) {
        self.at_most(law, if holds { 0.0 } else { 1.0 }, 0.5);
    }

    /// How many laws were broken.
    pub(crate) fn broken(&self) -> usize {
        self.laws.values().filter(|law| law.broken > 0).count()
    }

    /// Whether this law was broken.
    pub(crate) fn is_broken(&self, law: &str) -> bool {
        self.laws.get(law).is_some_and(|law| law.broken > 0)
    }

    /// A line for each law.
    pub(crate) fn table(&self) -> String {
        let mut table = format!(
            "{} programs, {} moves made, {} refused\n",
            self.programs, self.moves, self.refused
        );
        for (law, counts) in &self.laws {
            let Law {
                judged,
                broken,
                worst,
            } = counts;
            table += &format!("{law:50} judged {judged:9} broken {broken:6} worst {worst:.7}\n");
        }
        for fault in self.faults.iter().take(KEPT) {
            table += fault;
            table += "\n";
        }
        table
    }
}
