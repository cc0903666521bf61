//! Domains and problems.

use std::collections::BTreeMap;

use super::sexpr::{PddlError, Sexpr, read};

/// A condition.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Condition {
    And(Vec<Condition>),
    Or(Vec<Condition>),
    Not(Box<Condition>),
    /// Predicate and terms; terms that start with `?` are parameters.
    Fact(Vec<String>),
    /// Equality of two objects.
    Same(String, String),
    Compare(&'static str, Number, Number),
}

/// A numeric expression.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Number {
    Value(f64),
    Function(Vec<String>),
    Binary(char, Box<Number>, Box<Number>),
}

/// An effect.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Effect {
    Add(Vec<String>),
    Remove(Vec<String>),
    /// `increase`, `decrease` or `assign` of a function.
    Change(&'static str, Vec<String>, Number),
}

/// An action.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Action {
    /// Parameter and type.
    pub(crate) parameters: Vec<(String, String)>,
    pub(crate) precondition: Condition,
    pub(crate) effects: Vec<Effect>,
}

/// A domain: types, predicates, functions, actions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Domain {
    /// Its name.
    pub name: String,
    /// Type and the type above it.
    pub(crate) types: BTreeMap<String, String>,
    pub(crate) actions: BTreeMap<String, Action>,
    /// Warnings about skipped parts, such as a malformed declaration.
    pub warnings: Vec<String>,
}

/// A problem: objects, facts at the start, goal.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// Its name.
    pub name: String,
    /// Object and type.
    pub objects: BTreeMap<String, String>,
    pub(crate) facts: Vec<Vec<String>>,
    pub(crate) numbers: Vec<(Vec<String>, f64)>,
    pub(crate) goal: Condition,
}

impl Domain {
    /// Whether `kind` is `wanted` or below it.
    #[must_use]
    pub fn is_a(&self, kind: &str, wanted: &str) -> bool {
        let mut kind = kind;
        for _ in 0..64 {
            if kind == wanted || wanted == "object" {
                return true;
            }
            match self.types.get(kind) {
                Some(above) => kind = above,
                None => return false,
            }
        }
        false
    }

    /// Names of the actions.
    pub fn actions(&self) -> impl Iterator<Item = &str> {
        self.actions.keys().map(String::as_str)
    }
}

/// Reads a domain: types, predicates, functions and actions with conditions made of `and`, `or`,
/// `not`, `imply`, `=` and numeric comparisons, and effects that add, remove, increase, decrease
/// and assign.
///
/// # Errors
/// [`PddlError`] with line and column.
pub fn read_domain(source: &str) -> Result<Domain, PddlError> {
    let reader = Reader { source };
    let expression = read(source)?;
    let (name, sections) = reader.define(&expression, "domain")?;
    let mut domain = Domain {
        name,
        ..Domain::default()
    };
    for section in sections {
        let list = reader.list(section)?;
        match section.head() {
            Some(":types") => domain.types = reader.typed(&list[1..])?.into_iter().collect(),
            Some(":action") => {
                let (name, action) = reader.action(list)?;
                if domain.actions.insert(name.clone(), action).is_some() {
                    let message = format!("two actions are called {name}");
                    return Err(reader.fail(section, message));
                }
            }
            Some(":predicates" | ":functions" | ":constants" | ":requirements") => {}
            Some(other) => domain.warnings.push(format!("{other} is read over")),
            None => return Err(reader.fail(section, "expected a section such as (:action ...)")),
        }
    }
    Ok(domain)
}

/// Reads a problem.
///
/// # Errors
/// [`PddlError`] with line and column.
pub fn read_problem(source: &str) -> Result<Problem, PddlError> {
    let reader = Reader { source };
    let expression = read(source)?;
    let (name, sections) = reader.define(&expression, "problem")?;
    let mut problem = Problem {
        name,
        objects: BTreeMap::new(),
        facts: Vec::new(),
        numbers: Vec::new(),
        goal: Condition::And(Vec::new()),
    };
    for section in sections {
        let list = reader.list(section)?;
        match section.head() {
            Some(":objects") => problem.objects.extend(reader.typed(&list[1..])?),
            Some(":init") => {
                for fact in &list[1..] {
                    reader.initial(fact, &mut problem)?;
                }
            }
            Some(":goal") => match &list[1..] {
                [goal] => problem.goal = reader.condition(goal)?,
                _ => return Err(reader.fail(section, "a goal is one condition")),
            },
            _ => {}
        }
    }
    Ok(problem)
}

struct Reader<'a> {
    source: &'a str,
}

type Result2<T> = Result<T, PddlError>;

impl Reader<'_> {
    fn fail(&self, at: &Sexpr, message: impl Into<String>) -> PddlError {
        PddlError::new(self.source, at.at(), message)
    }

    fn list<'s>(&self, expression: &'s Sexpr) -> Result2<&'s [Sexpr]> {
        expression
            .list()
            .ok_or_else(|| self.fail(expression, "expected a list"))
    }

    fn word(&self, expression: &Sexpr) -> Result2<String> {
        let word = expression.word().map(str::to_owned);
        word.ok_or_else(|| self.fail(expression, "expected a word"))
    }

    /// Name and sections of `(define (kind name) section ...)`.
    fn define<'s>(&self, whole: &'s Sexpr, kind: &str) -> Result2<(String, &'s [Sexpr])> {
        let list = self.list(whole)?;
        match list {
            [define, head, sections @ ..]
                if define.word() == Some("define") && head.head() == Some(kind) =>
            {
                let name = head
                    .list()
                    .and_then(|list| list.get(1))
                    .and_then(Sexpr::word);
                Ok((name.unwrap_or_default().to_owned(), sections))
            }
            _ => Err(self.fail(whole, format!("expected (define ({kind} ...) ...)"))),
        }
    }

    /// `a b - type c - other d`; without type it is `object`.
    fn typed(&self, list: &[Sexpr]) -> Result2<Vec<(String, String)>> {
        let mut typed: Vec<(String, String)> = Vec::new();
        let mut waiting = Vec::new();
        let mut words = list.iter();
        while let Some(item) = words.next() {
            let word = self.word(item)?;
            // The type may be written against the dash.
            let kind = match word.strip_prefix('-') {
                Some("") => match words.next() {
                    Some(kind) => self.word(kind)?,
                    None => return Err(self.fail(item, "expected a type after \"-\"")),
                },
                Some(kind) => kind.to_owned(),
                None => {
                    waiting.push(word);
                    continue;
                }
            };
            typed.extend(waiting.drain(..).map(|name| (name, kind.clone())));
        }
        typed.extend(waiting.into_iter().map(|name| (name, "object".to_owned())));
        Ok(typed)
    }

    fn action(&self, list: &[Sexpr]) -> Result2<(String, Action)> {
        let name = list
            .get(1)
            .map(|name| self.word(name))
            .transpose()?
            .unwrap_or_default();
        let mut action = Action {
            parameters: Vec::new(),
            precondition: Condition::And(Vec::new()),
            effects: Vec::new(),
        };
        let mut fields = list.iter().skip(2);
        while let Some(field) = fields.next() {
            let Some(value) = fields.next() else {
                return Err(self.fail(field, "a field without a value"));
            };
            match field.word() {
                Some(":parameters") => action.parameters = self.typed(self.list(value)?)?,
                Some(":precondition") => action.precondition = self.condition(value)?,
                Some(":effect") => self.effects(value, &mut action.effects)?,
                _ => return Err(self.fail(field, "expected :parameters, :precondition or :effect")),
            }
        }
        Ok((name, action))
    }

    fn words(&self, list: &[Sexpr]) -> Result2<Vec<String>> {
        list.iter().map(|word| self.word(word)).collect()
    }

    fn condition(&self, expression: &Sexpr) -> Result2<Condition> {
        let list = self.list(expression)?;
        let all = |list: &[Sexpr]| {
            list.iter()
                .map(|c| self.condition(c))
                .collect::<Result2<_>>()
        };
        match (expression.head(), list.get(1..).unwrap_or_default()) {
            (None, []) => Ok(Condition::And(Vec::new())),
            (Some("and"), rest) => Ok(Condition::And(all(rest)?)),
            (Some("or"), rest) => Ok(Condition::Or(all(rest)?)),
            (Some("not"), [one]) => Ok(Condition::Not(Box::new(self.condition(one)?))),
            (Some("imply"), [one, other]) => Ok(Condition::Or(vec![
                Condition::Not(Box::new(self.condition(one)?)),
                self.condition(other)?,
            ])),
            (Some("="), [Sexpr::Word(one, _), Sexpr::Word(other, _)])
                if one.parse::<f64>().is_err() && other.parse::<f64>().is_err() =>
            {
                Ok(Condition::Same(one.clone(), other.clone()))
            }
            (Some(sign @ ("=" | "<" | ">" | "<=" | ">=")), [one, other]) => {
                let sign = ["=", "<", ">", "<=", ">="].into_iter().find(|s| *s == sign);
                let (one, other) = (self.number(one)?, self.number(other)?);
                Ok(Condition::Compare(sign.unwrap_or("="), one, other))
            }
            (Some("forall" | "exists" | "when"), _) => {
                Err(self.fail(expression, "quantifiers are not supported"))
            }
            (Some(_), _) => Ok(Condition::Fact(self.words(list)?)),
            (None, _) => Err(self.fail(expression, "expected a condition")),
        }
    }

    fn number(&self, expression: &Sexpr) -> Result2<Number> {
        let list = match expression {
            Sexpr::Word(word, _) => {
                let value = word.parse::<f64>().ok().filter(|value| value.is_finite());
                let value = value.ok_or_else(|| self.fail(expression, "expected a number"))?;
                return Ok(Number::Value(value));
            }
            Sexpr::List(list, _) => list,
        };
        match (expression.head(), list.get(1..).unwrap_or_default()) {
            (Some(sign @ ("+" | "-" | "*" | "/")), [one, other]) => {
                let sign = sign.chars().next().unwrap_or('+');
                let (one, other) = (self.number(one)?, self.number(other)?);
                Ok(Number::Binary(sign, Box::new(one), Box::new(other)))
            }
            _ => Ok(Number::Function(self.words(list)?)),
        }
    }

    fn effects(&self, expression: &Sexpr, effects: &mut Vec<Effect>) -> Result2<()> {
        let list = self.list(expression)?;
        match (expression.head(), list.get(1..).unwrap_or_default()) {
            (None, []) => {}
            (Some("and"), rest) => {
                for effect in rest {
                    self.effects(effect, effects)?;
                }
            }
            (Some("not"), [fact]) => effects.push(Effect::Remove(self.words(self.list(fact)?)?)),
            (Some(verb @ ("increase" | "decrease" | "assign")), [function, value]) => {
                let verb = ["increase", "decrease", "assign"]
                    .into_iter()
                    .find(|v| *v == verb);
                let function = self.words(self.list(function)?)?;
                effects.push(Effect::Change(
                    verb.unwrap_or("assign"),
                    function,
                    self.number(value)?,
                ));
            }
            (Some("forall" | "when"), _) => {
                return Err(self.fail(expression, "conditional effects are not supported"));
            }
            (Some(_), _) => effects.push(Effect::Add(self.words(list)?)),
            (None, _) => return Err(self.fail(expression, "expected an effect")),
        }
        Ok(())
    }

    fn initial(&self, fact: &Sexpr, problem: &mut Problem) -> Result2<()> {
        match self.condition(fact)? {
            Condition::Fact(fact) => problem.facts.push(fact),
            Condition::Compare("=", Number::Function(function), Number::Value(value)) => {
                problem.numbers.push((function, value));
            }
            _ => return Err(self.fail(fact, "expected a fact or the value of a function")),
        }
        Ok(())
    }
}
