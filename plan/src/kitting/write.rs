//! Writing a plan in the block layout.

use std::fmt::Write;

use super::ast::{Action, Expression, Operator, Plan, Statement, Term};

/// Writes a plan in the block layout; [`super::read`] gives the same plan back.
#[must_use]
pub fn write(plan: &Plan) -> String {
    let mut out = Out {
        text: String::new(),
        indent: 0,
    };
    out.line("About");
    for field in &plan.about {
        out.line(&format!("  {} = {}", field.name, quoted(&field.value)));
    }
    requirements(plan, &mut out);
    out.line("PlanParameters");
    for item in &plan.parameters {
        out.item(&[
            format!("name = {}", quoted(&item.name)),
            format!("type = {}", quoted(&item.class)),
        ]);
    }
    out.line("InternalVariables");
    for item in &plan.variables {
        let mut fields = vec![
            format!("name = {}", quoted(&item.name)),
            format!("type = {}", quoted(&item.class)),
        ];
        fields.extend(
            item.requirement
                .iter()
                .map(|r| format!("requirement = {}", quoted(r))),
        );
        fields.extend(
            item.sku
                .iter()
                .map(|sku| format!("SkuRef = {}", quoted(sku))),
        );
        fields.extend(
            item.initial
                .iter()
                .map(|v| format!("initialValue = {}", expression(v))),
        );
        out.item(&fields);
    }
    out.line("ToDo");
    out.indent += 1;
    plan.todo
        .iter()
        .for_each(|statement| out.statement("", statement, ""));
    out.text
}

fn requirements(plan: &Plan, out: &mut Out) {
    out.line("PlanRequirements");
    for item in &plan.requirements {
        let mut fields = vec![
            format!("name = {}", quoted(&item.name)),
            format!("type = {}", quoted(&item.class)),
        ];
        fields.extend(
            item.sku
                .iter()
                .map(|sku| format!("SkuRef = {}", quoted(sku))),
        );
        let contents = item.contents_type.iter();
        fields.extend(
            contents.map(|sku| format!("contentsType = {}", quoted(&format!("SkuRef {sku}")))),
        );
        fields.extend(
            item.contents_quantity
                .iter()
                .map(|n| format!("contentsQuantity = {n}")),
        );
        fields.extend(
            item.location
                .iter()
                .map(|place| format!("location = {}", place.name())),
        );
        fields.extend(
            item.conditions
                .iter()
                .map(|test| format!("where {}", expression(test))),
        );
        out.item(&fields);
    }
}

/// A text in quotes; a quotation mark in it cannot be written and becomes an apostrophe.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "'"))
}

struct Out {
    text: String,
    indent: usize,
}

impl Out {
    fn line(&mut self, text: &str) {
        let _ = writeln!(self.text, "{:indent$}{text}", "", indent = self.indent * 2);
    }

    fn item(&mut self, fields: &[String]) {
        self.line("  item");
        fields
            .iter()
            .for_each(|field| self.line(&format!("    {field}")));
        self.line("  end");
    }

    /// Writes `before`, the statement and `after`, on as many lines as it needs.
    fn statement(&mut self, before: &str, statement: &Statement, after: &str) {
        let action = &statement.action;
        let name = action.name();
        match action {
            Action::DoInGivenOrder(list) | Action::DoInAnyOrder(list) | Action::DoOne(list) => {
                self.block(&format!("{before}{name}"), list, after);
            }
            Action::LoopInGivenOrderWhile { test, body }
            | Action::LoopInAnyOrderWhile { test, body } => {
                self.block(
                    &format!("{before}{name} {{{}}}", expression(test)),
                    body,
                    after,
                );
            }
            Action::DoInPreconditionOrder(triples) => {
                self.line(&format!("{before}{name} begin"));
                self.indent += 1;
                for triple in triples {
                    let indexes: Vec<String> = triple.before.iter().map(u32::to_string).collect();
                    let head = format!("({} ({}) ", triple.index, indexes.join(" "));
                    self.statement(&head, &triple.statement, ")");
                }
                self.indent -= 1;
                self.line(&format!("end{after}"));
            }
            Action::If { test, then } | Action::ElseIf { test, then } => {
                let head = format!("{before}{name} {{{}}} ", expression(test));
                self.statement(&head, then, after);
            }
            Action::Else { then } => self.statement(&format!("{before}{name} "), then, after),
            _ => self.line(&format!("{before}{name}({}){after}", arguments(action))),
        }
    }

    fn block(&mut self, head: &str, list: &[Statement], after: &str) {
        self.line(&format!("{head} begin"));
        self.indent += 1;
        list.iter()
            .for_each(|statement| self.statement("", statement, ""));
        self.indent -= 1;
        self.line(&format!("end{after}"));
    }
}

fn arguments(action: &Action) -> String {
    let join = |expressions: &[&Expression]| {
        expressions
            .iter()
            .map(|e| expression(e))
            .collect::<Vec<_>>()
            .join(", ")
    };
    match action {
        Action::Bind {
            variable,
            location,
            which,
            on_failure,
        } => {
            let words = [location.name(), which.name(), on_failure.name()];
            format!("{}, {}", variable.text, words.join(", "))
        }
        Action::Set { target, value } => join(&[target, value]),
        Action::SetPose {
            variable,
            reference,
            pose,
        } => {
            format!("{}, {}", variable.text, join(&[reference, pose]))
        }
        Action::CreateInstance {
            variable,
            object,
            property,
        } => {
            format!(
                "{}, {}, {}",
                variable.text,
                expression(object),
                quoted(property)
            )
        }
        Action::DestroyInstance { variable }
        | Action::FactotumRefill { variable }
        | Action::FactotumRemove { variable }
        | Action::FactotumReplace { variable } => variable.text.clone(),
        Action::RobotChangeEndEffector { effector } => expression(effector),
        Action::RobotMoveAbove { pose } => expression(pose),
        Action::RobotPickUp { object } => expression(object),
        Action::RobotPutDown { object, pose } => join(&[object, pose]),
        _ => String::new(),
    }
}

/// Writes an expression with as few parentheses as it needs.
#[must_use]
pub fn expression(value: &Expression) -> String {
    let inner = |operand: &Expression, strength: u8| {
        let text = expression(operand);
        let own = match &operand.term {
            Term::Binary(operator, _, _) => operator.strength(),
            Term::Unary(..) => 7,
            Term::Number(number) if *number < 0.0 => 7,
            _ => 9,
        };
        if own < strength {
            format!("({text})")
        } else {
            text
        }
    };
    match &value.term {
        Term::Number(number) => number.to_string(),
        Term::Text(text) => quoted(text),
        Term::Null => "Null".into(),
        Term::Truth(truth) => truth.to_string(),
        Term::Keyword(keyword) => keyword.name().into(),
        Term::Name(name) => name.clone(),
        Term::Property(object, property) => format!("{}.{property}", inner(object, 8)),
        Term::Call(function, arguments) => {
            let arguments: Vec<String> = arguments.iter().map(expression).collect();
            format!("{function}({})", arguments.join(", "))
        }
        Term::Unary(operator, operand) => {
            let symbol = if *operator == Operator::Minus {
                "-"
            } else {
                "!"
            };
            format!("{symbol}{}", inner(operand, 8))
        }
        Term::Binary(operator, left, right) => {
            let strength = operator.strength();
            let symbol = operator.symbol();
            format!(
                "{} {symbol} {}",
                inner(left, strength),
                inner(right, strength + 1)
            )
        }
    }
}
