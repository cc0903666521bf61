//! Simulating a PDDL plan without an arm: preconditions, effects, goal.

use std::collections::{BTreeMap, BTreeSet};

use super::domain::{Action, Condition, Domain, Effect, Number, Problem};
use super::plan_file::PlanStep;

/// Why a plan cannot be executed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Number of the step, from 1; one more than the last when the goal is not reached.
    pub step: usize,
    /// The action, or `goal`.
    pub action: String,
    /// What is wrong; a precondition that is false is named.
    pub message: String,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "step {}, ({}): {}", self.step, self.action, self.message)
    }
}

/// Executes a plan from the start of the problem and checks whether the goal is reached. Returns
/// the number of steps.
///
/// # Errors
/// [`Failure`]: an unknown action, a wrong number or type of objects, a precondition that is false,
/// or a goal that is not reached.
pub fn simulate(domain: &Domain, problem: &Problem, plan: &[PlanStep]) -> Result<usize, Failure> {
    let mut state = State {
        facts: problem.facts.iter().cloned().collect(),
        numbers: problem.numbers.iter().cloned().collect(),
    };
    for (index, step) in plan.iter().enumerate() {
        let fail = |message: String| Failure {
            step: index + 1,
            action: step.to_string(),
            message,
        };
        let action = domain.actions.get(&step.name);
        let action =
            action.ok_or_else(|| fail(format!("the domain has no action {}", step.name)))?;
        let binding = bind(domain, problem, action, step).map_err(fail)?;
        if let Some(broken) = state.broken(&action.precondition, &binding) {
            return Err(fail(format!("the precondition {broken} is false")));
        }
        state.apply(action, &binding).map_err(fail)?;
    }
    match state.broken(&problem.goal, &BTreeMap::new()) {
        None => Ok(plan.len()),
        Some(broken) => {
            let message = format!("{broken} is false at the end");
            Err(Failure {
                step: plan.len() + 1,
                action: "goal".into(),
                message,
            })
        }
    }
}

type Binding = BTreeMap<String, String>;

fn bind(
    domain: &Domain,
    problem: &Problem,
    action: &Action,
    step: &PlanStep,
) -> Result<Binding, String> {
    let (wanted, given) = (action.parameters.len(), step.objects.len());
    if wanted != given {
        return Err(format!("{} takes {wanted} objects, not {given}", step.name));
    }
    let mut binding = Binding::new();
    for ((parameter, kind), object) in action.parameters.iter().zip(&step.objects) {
        let own = problem.objects.get(object);
        let own = own.ok_or_else(|| format!("the problem has no object {object}"))?;
        if !domain.is_a(own, kind) {
            return Err(format!("{object} is a {own}, {parameter} takes a {kind}"));
        }
        binding.insert(parameter.clone(), object.clone());
    }
    Ok(binding)
}

/// Terms with parameters replaced by objects.
fn ground(terms: &[String], binding: &Binding) -> Vec<String> {
    terms
        .iter()
        .map(|term| binding.get(term).unwrap_or(term).clone())
        .collect()
}

fn show(terms: &[String]) -> String {
    format!("({})", terms.join(" "))
}

struct State {
    facts: BTreeSet<Vec<String>>,
    numbers: BTreeMap<Vec<String>, f64>,
}

impl State {
    fn value(&self, number: &Number, binding: &Binding) -> Result<f64, String> {
        match number {
            Number::Value(value) => Ok(*value),
            Number::Function(function) => {
                let function = ground(function, binding);
                let value = self.numbers.get(&function).copied();
                value.ok_or_else(|| format!("{} has no value", show(&function)))
            }
            Number::Binary(sign, one, other) => {
                let (one, other) = (self.value(one, binding)?, self.value(other, binding)?);
                Ok(match sign {
                    '+' => one + other,
                    '-' => one - other,
                    '*' => one * other,
                    _ => one / other,
                })
            }
        }
    }

    /// The first part of a condition that is false, as text; `None` if all is true.
    fn broken(&self, condition: &Condition, binding: &Binding) -> Option<String> {
        match condition {
            Condition::And(list) => list.iter().find_map(|part| self.broken(part, binding)),
            Condition::Or(list) => {
                let broken: Option<Vec<String>> =
                    list.iter().map(|part| self.broken(part, binding)).collect();
                broken.map(|parts| parts.join(" or "))
            }
            Condition::Not(inner) => match self.broken(inner, binding) {
                Some(_) => None,
                None => Some(format!("(not {})", describe(inner, binding))),
            },
            Condition::Fact(fact) => {
                let fact = ground(fact, binding);
                (!self.facts.contains(&fact)).then(|| show(&fact))
            }
            Condition::Same(one, other) => {
                let pair = ground(&[one.clone(), other.clone()], binding);
                (pair[0] != pair[1]).then(|| format!("(= {})", pair.join(" ")))
            }
            Condition::Compare(sign, one, other) => {
                let (a, b) = match (self.value(one, binding), self.value(other, binding)) {
                    (Ok(a), Ok(b)) => (a, b),
                    (Err(missing), _) | (_, Err(missing)) => {
                        return Some(format!(
                            "{}, because {missing},",
                            describe(condition, binding)
                        ));
                    }
                };
                let holds = match *sign {
                    "<" => a < b,
                    ">" => a > b,
                    "<=" => a <= b,
                    ">=" => a >= b,
                    _ => (a - b).abs() < 1e-9,
                };
                (!holds).then(|| format!("{} with {a} and {b}", describe(condition, binding)))
            }
        }
    }

    fn apply(&mut self, action: &Action, binding: &Binding) -> Result<(), String> {
        // Removals come before additions, so that an action may restore what it removes.
        for effect in &action.effects {
            if let Effect::Remove(fact) = effect {
                self.facts.remove(&ground(fact, binding));
            }
        }
        for effect in &action.effects {
            match effect {
                Effect::Remove(_) => {}
                Effect::Add(fact) => {
                    self.facts.insert(ground(fact, binding));
                }
                Effect::Change(verb, function, amount) => {
                    let function = ground(function, binding);
                    let text = describe_number(amount, binding);
                    let fail = |missing: String| {
                        let what = show(&function);
                        format!("the effect ({verb} {what} {text}) has no result: {missing}")
                    };
                    let amount = self.value(amount, binding).map_err(fail)?;
                    let before = self.numbers.get(&function).copied();
                    let before = match (*verb, before) {
                        ("assign", _) => 0.0,
                        (_, Some(before)) => before,
                        (_, None) => return Err(fail(format!("{} has no value", show(&function)))),
                    };
                    let after = if *verb == "decrease" {
                        before - amount
                    } else {
                        before + amount
                    };
                    self.numbers.insert(function, after);
                }
            }
        }
        Ok(())
    }
}

fn describe(condition: &Condition, binding: &Binding) -> String {
    let number = |number: &Number| describe_number(number, binding);
    match condition {
        Condition::Fact(fact) => show(&ground(fact, binding)),
        Condition::Same(one, other) => {
            format!(
                "(= {})",
                ground(&[one.clone(), other.clone()], binding).join(" ")
            )
        }
        Condition::Compare(sign, one, other) => {
            format!("({sign} {} {})", number(one), number(other))
        }
        Condition::Not(inner) => format!("(not {})", describe(inner, binding)),
        Condition::And(list) | Condition::Or(list) => {
            let parts: Vec<String> = list.iter().map(|part| describe(part, binding)).collect();
            let word = if matches!(condition, Condition::And(_)) {
                "and"
            } else {
                "or"
            };
            format!("({word} {})", parts.join(" "))
        }
    }
}

fn describe_number(number: &Number, binding: &Binding) -> String {
    match number {
        Number::Value(value) => value.to_string(),
        Number::Function(function) => show(&ground(function, binding)),
        Number::Binary(sign, one, other) => {
            let (one, other) = (
                describe_number(one, binding),
                describe_number(other, binding),
            );
            format!("({sign} {one} {other})")
        }
    }
}
