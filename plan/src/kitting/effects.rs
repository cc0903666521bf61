//! What a statement reads and writes, and which statements of a list must keep their order.

use std::collections::BTreeSet;

use super::ast::{Action, Expression, Statement, Term};
use super::types::Scope;

/// Variables that a statement uses, and properties of objects by their name alone: the objects are
/// known only when the plan runs. Effects of motion are not included.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Effects {
    /// Read before the statement itself surely wrote them.
    pub(crate) reads: BTreeSet<String>,
    /// Perhaps written.
    pub(crate) writes: BTreeSet<String>,
    /// Surely written.
    sure: BTreeSet<String>,
    /// It moves the robot, or calls the factotum.
    pub(crate) acts: bool,
}

impl Effects {
    fn read(&mut self, expression: &Expression, scope: &Scope) {
        match &expression.term {
            Term::Name(name) => self.read_name(name, scope),
            Term::Property(object, property) => {
                self.read(object, scope);
                self.reads.insert(property.clone());
            }
            Term::Call(_, list) => list.iter().for_each(|argument| self.read(argument, scope)),
            Term::Unary(_, operand) => self.read(operand, scope),
            Term::Binary(_, left, right) => {
                self.read(left, scope);
                self.read(right, scope);
            }
            _ => {}
        }
    }

    fn read_name(&mut self, name: &str, scope: &Scope) {
        if let Some(name) = scope.declared(name)
            && !self.sure.contains(name)
        {
            self.reads.insert(name.to_owned());
        }
    }

    fn write(&mut self, name: &str, scope: &Scope) {
        if let Some(name) = scope.declared(name) {
            self.writes.insert(name.to_owned());
            self.sure.insert(name.to_owned());
        }
    }

    /// Adds a statement that may be executed: nothing is certainly written.
    fn add_perhaps(&mut self, statement: &Statement, scope: &Scope) {
        let sure = self.sure.clone();
        self.add(statement, scope);
        self.sure = sure;
    }

    fn add(&mut self, statement: &Statement, scope: &Scope) {
        match &statement.action {
            Action::Bind { variable, .. } => self.write(&variable.text, scope),
            Action::Set { target, value } => {
                self.read(value, scope);
                match &target.term {
                    Term::Name(name) => self.write(name, scope),
                    Term::Property(object, property) => {
                        self.read(object, scope);
                        self.writes.insert(property.clone());
                    }
                    _ => self.read(target, scope),
                }
            }
            Action::SetPose {
                variable,
                reference,
                pose,
            } => {
                self.read(reference, scope);
                self.read(pose, scope);
                self.write(&variable.text, scope);
            }
            Action::CreateInstance {
                variable, object, ..
            } => {
                self.read(object, scope);
                self.write(&variable.text, scope);
            }
            Action::DestroyInstance { variable } => {
                self.read_name(&variable.text, scope);
                self.write(&variable.text, scope);
            }
            Action::FactotumRefill { variable }
            | Action::FactotumRemove { variable }
            | Action::FactotumReplace { variable } => {
                self.acts = true;
                self.read_name(&variable.text, scope);
                self.write(&variable.text, scope);
            }
            Action::RobotChangeEndEffector { effector: argument }
            | Action::RobotMoveAbove { pose: argument }
            | Action::RobotPickUp { object: argument } => {
                self.acts = true;
                self.read(argument, scope);
            }
            Action::RobotPutDown { object, pose } => {
                self.acts = true;
                self.read(object, scope);
                self.read(pose, scope);
            }
            _ => self.add_list(statement, scope),
        }
    }

    /// Effects of a statement that holds others.
    fn add_list(&mut self, statement: &Statement, scope: &Scope) {
        match &statement.action {
            Action::If { test, then } | Action::ElseIf { test, then } => {
                self.read(test, scope);
                self.add_perhaps(then, scope);
            }
            Action::Else { then } => self.add_perhaps(then, scope),
            Action::LoopInGivenOrderWhile { test, body }
            | Action::LoopInAnyOrderWhile { test, body } => {
                self.read(test, scope);
                body.iter()
                    .for_each(|statement| self.add_perhaps(statement, scope));
            }
            Action::DoOne(list) => list.iter().for_each(|s| self.add_perhaps(s, scope)),
            Action::DoInAnyOrder(_) | Action::DoInPreconditionOrder(_) => {
                // The order is open: each may read before another writes.
                let before = self.sure.clone();
                let mut sure = before.clone();
                for child in statement.children() {
                    self.sure.clone_from(&before);
                    self.add(child, scope);
                    sure.append(&mut self.sure);
                }
                self.sure = sure;
            }
            Action::DoInGivenOrder(list) => list.iter().for_each(|s| self.add(s, scope)),
            _ => {}
        }
    }

    /// Whether the order of two statements matters for the variables: one may write what the other
    /// reads before writing it itself.
    #[must_use]
    pub(crate) fn conflicts_with<'a>(&'a self, other: &'a Self) -> Option<&'a str> {
        let clash = self.writes.intersection(&other.reads).next();
        clash
            .or_else(|| other.writes.intersection(&self.reads).next())
            .map(String::as_str)
    }
}

/// A step of a list: one statement, or an If with the ElseIf and Else that follow it.
#[must_use]
pub(crate) fn steps(list: &[Statement]) -> Vec<std::ops::Range<usize>> {
    let mut steps: Vec<std::ops::Range<usize>> = Vec::new();
    for (index, statement) in list.iter().enumerate() {
        let follows = matches!(
            statement.action,
            Action::ElseIf { .. } | Action::Else { .. }
        );
        match steps.last_mut() {
            Some(last) if follows => last.end = index + 1,
            _ => steps.push(index..index + 1),
        }
    }
    steps
}

/// Pairs of steps of an any-order list that keep their written order because their order matters,
/// with the variable they share.
#[must_use]
pub(crate) fn conflicts(list: &[Statement], scope: &Scope) -> Vec<(usize, usize, String)> {
    let effects: Vec<Effects> = steps(list)
        .into_iter()
        .map(|range| {
            let mut effects = Effects::default();
            list[range]
                .iter()
                .for_each(|statement| effects.add(statement, scope));
            effects
        })
        .collect();
    let mut found = Vec::new();
    for (second, later) in effects.iter().enumerate() {
        for (first, earlier) in effects.iter().enumerate().take(second) {
            if let Some(variable) = earlier.conflicts_with(later) {
                found.push((first, second, variable.to_owned()));
            }
        }
    }
    found
}
