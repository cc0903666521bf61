//! Reading statements, in both layouts.

use super::ast::{Action, Expression, Keyword, Name, STATEMENTS, Span, Statement, Triple};
use super::parser::{Misfit, Parser, Read};
use super::token::Kind;

impl Parser {
    /// Statements whose labels lie below `label`, or up to `end` in the block layout.
    pub(super) fn steps(&mut self, label: Option<&[u32]>) -> Vec<Statement> {
        let mut steps = Vec::new();
        let mut previous: Option<u32> = None;
        loop {
            let own = match (&self.peek().kind, label) {
                (Kind::Label(own), Some(label)) if is_below(own, label) => own.clone(),
                (Kind::Ident(name), None) if name != "end" && !self.at_head() => Vec::new(),
                _ => return steps,
            };
            if let Some(label) = label {
                self.check_label(&own, label, &mut previous);
                self.at += 1;
            }
            let start = self.at;
            match self.statement(label.map(|_| own.as_slice())) {
                Ok(statement) => steps.push(statement),
                Err(Misfit) => self.recover(start, label.is_some()),
            }
        }
    }

    fn check_label(&mut self, own: &[u32], label: &[u32], previous: &mut Option<u32>) {
        let text: Vec<String> = own.iter().map(u32::to_string).collect();
        let text = text.join(".");
        let span = self.span();
        let number = own.get(label.len()).copied();
        if own.len() > label.len() + 1 {
            let message = format!("the label {text} skips a level");
            self.warn("plan::label", message, span);
        } else if let (Some(number), Some(before)) = (number, *previous)
            && number == before
        {
            let message = format!("the label {text} is used twice; the order in the file counts");
            self.warn("plan::label", message, span);
        } else if let (Some(number), Some(before)) = (number, *previous)
            && number != before.saturating_add(1)
        {
            let message = format!("the label {text} is out of order; the order in the file counts");
            self.warn("plan::label", message, span);
        }
        *previous = number;
    }

    /// Continues after an error: at the next label, or at the next line that starts with a
    /// statement.
    fn recover(&mut self, start: usize, outline: bool) {
        self.at = self.at.max(start + 1);
        loop {
            let token = self.peek();
            let stop = match &token.kind {
                Kind::End => true,
                Kind::Label(_) => outline,
                Kind::Ident(name) => {
                    !outline
                        && token.first
                        && (name == "end" || STATEMENTS.contains(&name.as_str()) || self.at_head())
                }
                _ => false,
            };
            if stop {
                return;
            }
            self.at += 1;
        }
    }

    /// One statement; `label` is the label above it in the outline layout.
    fn statement(&mut self, label: Option<&[u32]>) -> Read<Statement> {
        self.operators = 0;
        let start = self.span();
        let name = self.ident("a statement")?;
        let action = self.deeper(|parser| parser.action(&name, label))?;
        Ok(Statement {
            action,
            span: start.to(self.last_span()),
        })
    }

    fn action(&mut self, name: &Name, label: Option<&[u32]>) -> Read<Action> {
        Ok(match name.text.as_str() {
            "DoInGivenOrder" => Action::DoInGivenOrder(self.body(label)?),
            "DoInAnyOrder" => Action::DoInAnyOrder(self.body(label)?),
            "DoOne" => Action::DoOne(self.body(label)?),
            "DoInPreconditionOrder" => Action::DoInPreconditionOrder(self.triples(label)?),
            "If" => {
                let test = self.test()?;
                Action::If {
                    test,
                    then: Box::new(self.statement(label)?),
                }
            }
            "ElseIf" => {
                let test = self.test()?;
                Action::ElseIf {
                    test,
                    then: Box::new(self.statement(label)?),
                }
            }
            "Else" => Action::Else {
                then: Box::new(self.statement(label)?),
            },
            "LoopInGivenOrderWhile" => {
                let test = self.test()?;
                Action::LoopInGivenOrderWhile {
                    test,
                    body: self.body(label)?,
                }
            }
            "LoopInAnyOrderWhile" => {
                let test = self.test()?;
                Action::LoopInAnyOrderWhile {
                    test,
                    body: self.body(label)?,
                }
            }
            _ => return self.simple(name),
        })
    }

    fn test(&mut self) -> Read<Expression> {
        self.expect_symbol("{")?;
        let test = self.expression()?;
        self.expect_symbol("}")?;
        Ok(test)
    }

    fn body(&mut self, label: Option<&[u32]>) -> Read<Vec<Statement>> {
        if label.is_some() {
            return Ok(self.steps(label));
        }
        self.begin()?;
        let steps = self.steps(None);
        self.end()?;
        Ok(steps)
    }

    fn begin(&mut self) -> Read<()> {
        if !self.is_ident("begin") {
            return self.expected("begin");
        }
        self.at += 1;
        Ok(())
    }

    pub(super) fn end(&mut self) -> Read<()> {
        if !self.is_ident("end") {
            return self.expected("end");
        }
        self.at += 1;
        Ok(())
    }

    fn triples(&mut self, label: Option<&[u32]>) -> Read<Vec<Triple>> {
        let mut triples = Vec::new();
        if label.is_none() {
            self.begin()?;
        }
        loop {
            let own = match (&self.peek().kind, label) {
                (Kind::Label(own), Some(label)) if is_below(own, label) => Some(own.clone()),
                _ => None,
            };
            self.at += usize::from(own.is_some());
            if !self.is_symbol("(") {
                break;
            }
            triples.push(self.triple(own.as_deref().or(label))?);
        }
        if label.is_none() {
            self.end()?;
        }
        Ok(triples)
    }

    /// `(3 (1 2) statement)`
    fn triple(&mut self, label: Option<&[u32]>) -> Read<Triple> {
        self.expect_symbol("(")?;
        let index = self.index()?;
        self.expect_symbol("(")?;
        let mut before = Vec::new();
        while !self.take_symbol(")") {
            self.take_symbol(",");
            before.push(self.index()?);
        }
        let statement = self.statement(label)?;
        self.expect_symbol(")")?;
        Ok(Triple {
            index,
            before,
            statement,
        })
    }

    fn index(&mut self) -> Read<u32> {
        match self.peek().kind {
            Kind::Number(number) if number.fract() == 0.0 && (0.0..1e6).contains(&number) => {
                self.at += 1;
                Ok(number as u32)
            }
            _ => self.expected("the index of a statement"),
        }
    }

    fn simple(&mut self, name: &Name) -> Read<Action> {
        let action = match name.text.as_str() {
            "Start" | "Stop" | "Quit" => {
                if self.is_symbol("(") && !self.peek().first {
                    let arguments = self.arguments()?;
                    self.count(name, arguments.len(), 0)?;
                }
                match name.text.as_str() {
                    "Start" => Action::Start {},
                    "Stop" => Action::Stop {},
                    _ => Action::Quit {},
                }
            }
            "FactotumRefill" => Action::FactotumRefill {
                variable: self.factotum(name)?,
            },
            "FactotumRemove" => Action::FactotumRemove {
                variable: self.factotum(name)?,
            },
            "FactotumReplace" => Action::FactotumReplace {
                variable: self.factotum(name)?,
            },
            "Bind" => self.bind()?,
            known if STATEMENTS.contains(&known) => {
                let arguments = self.arguments()?;
                self.with_arguments(name, arguments)?
            }
            unknown => {
                let near = nearest(unknown);
                let message = format!("unknown statement {unknown}");
                let mut finding = crate::finding::Finding::error(
                    "plan::unknown_statement",
                    message,
                    name.span.range(),
                );
                finding.help = near.map(|near| format!("did you mean {near}?"));
                self.findings.push(finding);
                return Err(Misfit);
            }
        };
        Ok(action)
    }

    fn bind(&mut self) -> Read<Action> {
        self.expect_symbol("(")?;
        let variable = self.ident("a variable")?;
        self.expect_symbol(",")?;
        let location = self.keyword(&[Keyword::Table, Keyword::Workstation])?;
        self.expect_symbol(",")?;
        let which = self.keyword(&[Keyword::Any])?;
        self.expect_symbol(",")?;
        let on_failure = self.keyword(&[Keyword::Quit])?;
        self.expect_symbol(")")?;
        Ok(Action::Bind {
            variable,
            location,
            which,
            on_failure,
        })
    }

    /// The one variable of a statement for the factotum: parentheses may be missing, and the name
    /// may be in quotes.
    fn factotum(&mut self, statement: &Name) -> Read<Name> {
        let open = self.take_symbol("(");
        if !open {
            let message = format!("{} without parentheses", statement.text);
            self.warn("plan::parentheses", message, statement.span);
        }
        let (name, quoted) = self.name("a variable")?;
        if quoted {
            let message = format!("the name of the variable {} is in quotes", name.text);
            self.warn("plan::quoted_name", message, name.span);
        }
        if open {
            self.expect_symbol(")")?;
        }
        Ok(name)
    }

    fn count(&mut self, statement: &Name, found: usize, wanted: usize) -> Read<()> {
        if found == wanted {
            return Ok(());
        }
        let message = format!(
            "{} takes {wanted} argument(s), found {found}",
            statement.text
        );
        self.fail("plan::arguments", message, statement.span)
    }

    fn variable(&mut self, expression: Expression) -> Read<Name> {
        match expression.term {
            super::ast::Term::Name(text) => Ok(Name {
                text,
                span: expression.span,
            }),
            _ => self.fail(
                "plan::syntax",
                "expected a variable".into(),
                expression.span,
            ),
        }
    }

    fn with_arguments(&mut self, name: &Name, arguments: Vec<Expression>) -> Read<Action> {
        let wanted = match name.text.as_str() {
            "SetPose" | "CreateInstance" => 3,
            "Set" | "RobotPutDown" => 2,
            _ => 1,
        };
        self.count(name, arguments.len(), wanted)?;
        let mut rest = arguments.into_iter();
        let mut take = || {
            let missing = super::ast::Term::Null;
            rest.next().unwrap_or(Expression {
                term: missing,
                span: Span::default(),
            })
        };
        let first = take();
        Ok(match name.text.as_str() {
            "Set" => Action::Set {
                target: first,
                value: take(),
            },
            "SetPose" => {
                let (reference, pose) = (take(), take());
                Action::SetPose {
                    variable: self.variable(first)?,
                    reference,
                    pose,
                }
            }
            "CreateInstance" => {
                let (object, property) = (take(), take());
                let variable = self.variable(first)?;
                match property.term {
                    super::ast::Term::Text(property) | super::ast::Term::Name(property) => {
                        Action::CreateInstance {
                            variable,
                            object,
                            property,
                        }
                    }
                    _ => {
                        let message = "expected the name of a property".into();
                        return self.fail("plan::syntax", message, property.span);
                    }
                }
            }
            "DestroyInstance" => Action::DestroyInstance {
                variable: self.variable(first)?,
            },
            "RobotChangeEndEffector" => Action::RobotChangeEndEffector { effector: first },
            "RobotMoveAbove" => Action::RobotMoveAbove { pose: first },
            "RobotPickUp" => Action::RobotPickUp { object: first },
            _ => Action::RobotPutDown {
                object: first,
                pose: take(),
            },
        })
    }
}

fn is_below(own: &[u32], label: &[u32]) -> bool {
    own.len() > label.len() && own.starts_with(label)
}

/// The statement whose name is most like `name`, if any is like it.
fn nearest(name: &str) -> Option<&'static str> {
    let folded = name.to_lowercase();
    STATEMENTS
        .into_iter()
        .map(|known| (distance(&folded, &known.to_lowercase()), known))
        .min()
        .filter(|(distance, _)| *distance <= 3)
        .map(|(_, known)| known)
}

/// Number of single-letter edits between two short words.
///
/// # Source
/// V. I. Levenshtein, "Binary codes capable of correcting deletions, insertions, and reversals",
/// Soviet Physics Doklady 10(8), 1966; computed row by row.
pub(super) fn distance(one: &str, other: &str) -> usize {
    let other: Vec<char> = other.chars().take(64).collect();
    let mut row: Vec<usize> = (0..=other.len()).collect();
    for (i, a) in one.chars().take(64).enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, b) in other.iter().enumerate() {
            let replaced = diagonal + usize::from(a != *b);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[other.len()]
}
