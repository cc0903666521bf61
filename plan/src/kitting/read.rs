//! Reading a whole plan: the sections.

use super::ast::{Expression, Field, Keyword, Parameter, Plan, Requirement, Span, Term, Variable};
use super::parser::{Misfit, Parser, Read};
use super::token::{Kind, tokens};
use crate::finding::Finding;

/// The result of reading a text: as much of the plan as could be read, and the findings.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The plan; incomplete when there are errors.
    pub plan: Plan,
    /// What was found, in the order of the text.
    pub findings: Vec<Finding>,
}

/// Reads a plan in the outline layout (the tree comes from labels such as `5.2.1`) or in the block
/// layout (`begin ... end`), or, when the text starts with `{`, in JSON.
///
/// Never fails and never panics: each error becomes a finding, and reading continues after it.
///
/// ```
/// let text = "About PlanId = \"p\" ToDo\n Start()\n Stop()";
/// let reading = plan::kitting::read(text);
/// assert!(reading.findings.is_empty());
/// assert_eq!(reading.plan.about("PlanId"), "p");
/// assert_eq!(reading.plan.statements().len(), 2);
/// ```
#[must_use]
pub fn read(source: &str) -> Reading {
    if source.trim_start().starts_with('{') {
        return read_json(source);
    }
    let (tokens, findings) = tokens(source);
    let mut parser = Parser {
        tokens,
        at: 0,
        findings,
        depth: 0,
        operators: 0,
        in_condition: false,
    };
    let mut plan = Plan::default();
    parser.sections(&mut plan);
    let mut findings = parser.findings;
    findings.sort_by_key(|finding| finding.span.start);
    Reading { plan, findings }
}

fn read_json(source: &str) -> Reading {
    match serde_json::from_str(source) {
        Ok(plan) => Reading {
            plan,
            findings: Vec::new(),
        },
        Err(error) => {
            let lines = source
                .split_inclusive('\n')
                .take(error.line().saturating_sub(1));
            let start = lines.map(str::len).sum::<usize>() + error.column().saturating_sub(1);
            let start = start.min(source.len());
            let finding = Finding::error("plan::json", error.to_string(), start..start);
            Reading {
                plan: Plan::default(),
                findings: vec![finding],
            }
        }
    }
}

/// The sections of a plan.
#[derive(Clone, Copy, PartialEq)]
enum Section {
    About,
    Requirements,
    Parameters,
    Variables,
    ToDo,
}

const SECTIONS: [(&str, Section); 6] = [
    ("About", Section::About),
    ("PlanRequirements", Section::Requirements),
    ("PlanParameters", Section::Parameters),
    ("Plan", Section::Parameters),
    ("InternalVariables", Section::Variables),
    ("ToDo", Section::ToDo),
];

impl Parser {
    /// Whether a section starts here (after its label, if it has one).
    pub(super) fn at_head(&self) -> bool {
        self.head().is_some()
    }

    /// The section that starts here and the number of tokens of its head.
    fn head(&self) -> Option<(Section, usize)> {
        let label = usize::from(matches!(&self.peek().kind, Kind::Label(l) if l.len() == 1));
        let Kind::Ident(name) = &self.peek_at(label).kind else {
            return None;
        };
        let (name, section) = SECTIONS.iter().find(|(known, _)| known == name)?;
        if *name == "Plan" {
            let Kind::Ident(next) = &self.peek_at(label + 1).kind else {
                return None;
            };
            return (next == "Parameters").then_some((*section, label + 2));
        }
        Some((*section, label + 1))
    }

    fn sections(&mut self, plan: &mut Plan) {
        let mut seen: Vec<Section> = Vec::new();
        while self.peek().kind != Kind::End {
            let span = self.span();
            let label = match &self.peek().kind {
                Kind::Label(label) => Some(label.clone()),
                _ => None,
            };
            let Some((section, length)) = self.head() else {
                let _: Read<()> = self.expected("a section");
                self.at += 1;
                self.skip(|parser| parser.at_head());
                continue;
            };
            self.at += length;
            self.take_symbol("=");
            if seen.contains(&section) {
                let _: Read<()> = self.fail(
                    "plan::section",
                    "this section is there already".into(),
                    span,
                );
            }
            seen.push(section);
            match section {
                Section::About => self.about(plan),
                Section::ToDo => plan.todo.extend(self.steps(label.as_deref())),
                _ => self.items(section, label.is_some(), plan),
            }
        }
        for (section, name) in [(Section::About, "About"), (Section::ToDo, "ToDo")] {
            if !seen.contains(&section) {
                let message = format!("the section {name} is missing");
                let _: Read<()> = self.fail("plan::section", message, self.span());
            }
        }
    }

    fn skip(&mut self, stop: impl Fn(&Self) -> bool) {
        while self.peek().kind != Kind::End && !stop(self) {
            self.at += 1;
        }
    }

    fn about(&mut self, plan: &mut Plan) {
        while self.peek().kind != Kind::End && !self.at_head() {
            if matches!(self.peek().kind, Kind::Label(_)) {
                self.at += 1;
            }
            let start = self.at;
            match self.about_field() {
                Ok(field) => plan.about.push(field),
                Err(Misfit) => {
                    self.at = self.at.max(start + 1);
                    self.skip(|parser| parser.peek().first);
                }
            }
        }
    }

    fn about_field(&mut self) -> Read<Field> {
        let name = self.ident("the name of a field")?;
        self.expect_symbol("=")?;
        let value = match self.peek().kind.clone() {
            Kind::Text(text) | Kind::Ident(text) => text,
            Kind::Number(number) => number.to_string(),
            _ => return self.expected("a value"),
        };
        self.at += 1;
        Ok(Field {
            name: name.text,
            value,
            span: name.span.to(self.last_span()),
        })
    }

    fn items(&mut self, section: Section, labelled: bool, plan: &mut Plan) {
        while self.peek().kind != Kind::End && !self.at_head() {
            let starts = match &self.peek().kind {
                Kind::Label(_) => labelled,
                Kind::Ident(name) => !labelled && name == "item",
                _ => false,
            };
            if !starts {
                let _: Read<()> = self.expected("an item");
                self.at += 1;
                self.skip(|p| {
                    p.at_head() || p.is_ident("item") || matches!(p.peek().kind, Kind::Label(_))
                });
                continue;
            }
            let start = self.span();
            self.at += 1;
            let mut item = Item::default();
            while !self.item_ends(labelled) {
                let before = self.at;
                if self.item_field(&mut item).is_err() {
                    self.in_condition = false;
                    self.at = self.at.max(before + 1);
                    self.skip(|p| p.peek().first || p.is_ident("end"));
                }
            }
            if !labelled {
                let _ = self.end();
            }
            item.span = start.to(self.last_span());
            self.finish_item(section, item, plan);
        }
    }

    fn item_ends(&self, labelled: bool) -> bool {
        match &self.peek().kind {
            Kind::End => true,
            Kind::Label(_) => true,
            Kind::Ident(name) => (!labelled && (name == "end" || name == "item")) || self.at_head(),
            _ => false,
        }
    }

    fn item_field(&mut self, item: &mut Item) -> Read<()> {
        self.operators = 0;
        let is_where = self.is_ident("where");
        let is_field = matches!(self.peek().kind, Kind::Ident(_))
            && matches!(self.peek_at(1).kind, Kind::Symbol("="));
        if is_where || !is_field {
            self.at += usize::from(is_where);
            self.in_condition = true;
            let condition = self.expression();
            self.in_condition = false;
            item.conditions.push(condition?);
            return Ok(());
        }
        let name = self.ident("the name of a field")?;
        self.expect_symbol("=")?;
        let value = self.expression()?;
        if item.fields.iter().any(|(known, _)| known.text == name.text) {
            let message = format!("the field {} is there already", name.text);
            return self.fail("plan::field", message, name.span);
        }
        item.fields.push((name, value));
        Ok(())
    }

    fn finish_item(&mut self, section: Section, mut item: Item, plan: &mut Plan) {
        let (span, name) = (item.span, self.text_field(&mut item, "name"));
        let class = self.type_field(&mut item);
        let (Some(name), Some(class)) = (name, class) else {
            return;
        };
        match section {
            Section::Requirements => {
                let requirement = self.requirement(&mut item, name, class);
                plan.requirements.push(requirement);
            }
            Section::Parameters => plan.parameters.push(Parameter { name, class, span }),
            _ => {
                let sku = item
                    .take("SkuRef")
                    .and_then(|value| self.text_value(&value));
                let requirement = item.take("requirement").and_then(|v| self.text_value(&v));
                let initial = item.take("initialValue").filter(|v| v.term != Term::Null);
                plan.variables.push(Variable {
                    name,
                    class,
                    requirement,
                    sku,
                    initial,
                    span,
                });
            }
        }
        for (field, _) in std::mem::take(&mut item.fields) {
            let message = format!("unknown field {}", field.text);
            let _: Read<()> = self.fail("plan::field", message, field.span);
        }
        if let Some(condition) = item.conditions.first() {
            let message = "only a requirement can have a condition".into();
            let _: Read<()> = self.fail("plan::field", message, condition.span);
        }
    }

    fn requirement(&mut self, item: &mut Item, name: String, class: String) -> Requirement {
        let mut made = Requirement {
            name,
            class,
            span: item.span,
            ..Requirement::default()
        };
        made.sku = item
            .take("SkuRef")
            .and_then(|value| self.text_value(&value));
        if let Some(value) = item.take("contentsType") {
            let text = self.text_value(&value).unwrap_or_default();
            made.contents_type = match text.split_once(' ') {
                Some(("SkuRef", id)) => Some(id.to_owned()),
                _ => {
                    let message = format!("expected \"SkuRef\" and an id, found \"{text}\"");
                    let _: Read<()> = self.fail("plan::field", message, value.span);
                    None
                }
            };
        }
        if let Some(value) = item.take("contentsQuantity") {
            let quantity = match &value.term {
                Term::Number(number) => Some(*number),
                Term::Text(text) => text.parse().ok(),
                _ => None,
            };
            match quantity {
                Some(quantity) if quantity >= 0.0 && quantity.fract() == 0.0 => {
                    made.contents_quantity = Some(quantity as u64);
                }
                _ => {
                    let message = "expected a whole number".into();
                    let _: Read<()> = self.fail("plan::field", message, value.span);
                }
            }
        }
        if let Some(value) = item.take("location") {
            match value.term {
                Term::Keyword(keyword @ (Keyword::Table | Keyword::Workstation)) => {
                    made.location = Some(keyword);
                }
                _ => {
                    let message = "expected TABLE or WORKSTATION".into();
                    let _: Read<()> = self.fail("plan::field", message, value.span);
                }
            }
        }
        made.conditions = std::mem::take(&mut item.conditions);
        made
    }

    fn text_field(&mut self, item: &mut Item, name: &str) -> Option<String> {
        let Some(value) = item.take(name) else {
            let message = format!("the field {name} is missing");
            let _: Read<()> = self.fail("plan::field", message, item.span);
            return None;
        };
        self.text_value(&value)
    }

    fn type_field(&mut self, item: &mut Item) -> Option<String> {
        let bare = item
            .fields
            .iter()
            .find_map(|(name, value)| match &value.term {
                Term::Name(class) if name.text == "type" => Some((class.clone(), value.span)),
                _ => None,
            });
        if let Some((class, span)) = bare {
            self.warn(
                "plan::unquoted_type",
                format!("the type {class} is not in quotes"),
                span,
            );
        }
        self.text_field(item, "type")
    }

    fn text_value(&mut self, value: &Expression) -> Option<String> {
        match &value.term {
            Term::Text(text) | Term::Name(text) => Some(text.clone()),
            _ => {
                let _: Read<()> = self.fail("plan::field", "expected a name".into(), value.span);
                None
            }
        }
    }
}

/// An item as it is read, before its fields are interpreted.
#[derive(Default)]
struct Item {
    fields: Vec<(super::ast::Name, Expression)>,
    conditions: Vec<Expression>,
    span: Span,
}

impl Item {
    fn take(&mut self, name: &str) -> Option<Expression> {
        let index = self
            .fields
            .iter()
            .position(|(known, _)| known.text == name)?;
        Some(self.fields.remove(index).1)
    }
}
