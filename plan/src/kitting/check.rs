//! Checks of a plan before it starts.

use std::collections::{BTreeMap, BTreeSet};

use super::ast::{Action, Expression, Keyword, Name, Plan, Span, Statement, Term, Triple};
use super::effects::conflicts;
use super::statements::distance;
use super::types::{Role, Scope, Type};
use crate::finding::Finding;
use crate::run::matches;
use crate::world::{Class, Model};

/// Checks names, types, the shape of the lists, preconditions and, with a world, the requirements
/// against it. A plan with an error is not executed.
#[must_use]
pub fn check(plan: &Plan, world: Option<&Model>) -> Vec<Finding> {
    let scope = Scope::new(plan);
    let mut checker = Checker {
        plan,
        scope: &scope,
        world,
        findings: Vec::new(),
        folded: BTreeSet::new(),
    };
    checker.declarations();
    checker.frame();
    checker.list(&plan.todo);
    checker.against_world();
    let mut findings = checker.findings;
    findings.sort_by_key(|finding| finding.span.start);
    findings
}

pub(super) struct Checker<'a> {
    pub(super) plan: &'a Plan,
    pub(super) scope: &'a Scope,
    pub(super) world: Option<&'a Model>,
    pub(super) findings: Vec<Finding>,
    folded: BTreeSet<String>,
}

impl Checker<'_> {
    pub(super) fn error(&mut self, code: &'static str, message: String, span: Span) {
        self.findings
            .push(Finding::error(code, message, span.range()));
    }

    pub(super) fn warning(&mut self, code: &'static str, message: String, span: Span) {
        self.findings
            .push(Finding::warning(code, message, span.range()));
    }

    pub(super) fn note(&mut self, code: &'static str, message: String, help: &str, span: Span) {
        self.findings
            .push(Finding::note(code, message, span.range()).help(help));
    }

    /// Role and type of a declared name; warns once of a name that differs in capitals.
    pub(super) fn known(&mut self, name: &str, span: Span) -> Option<(Role, Type)> {
        let declared = self.scope.declared(name)?.to_owned();
        if declared != name && self.folded.insert(name.to_owned()) {
            let message = format!("{name} is declared as {declared}");
            self.warning("plan::capitals", message, span);
        }
        self.scope.lookup(&declared)
    }

    pub(super) fn unknown_name(&mut self, name: &str, span: Span) {
        let near = self
            .scope
            .names()
            .map(|known| (distance(&known.to_lowercase(), &name.to_lowercase()), known))
            .min()
            .filter(|(distance, _)| *distance <= 3);
        let help = near.map(|(_, known)| format!("did you mean {known}?"));
        let message = format!("nothing is called {name}");
        let mut finding = Finding::error("plan::unknown_name", message, span.range());
        finding.help = help;
        self.findings.push(finding);
    }

    /// The expression must be of this type.
    pub(super) fn expect(&mut self, expression: &Expression, wanted: Type, subject: Option<Class>) {
        self.typed(expression, wanted, subject);
    }

    /// The expression must be of this type; the type that it has.
    pub(super) fn typed(
        &mut self,
        expression: &Expression,
        wanted: Type,
        subject: Option<Class>,
    ) -> Type {
        let found = self.infer(expression, subject);
        if !wanted.accepts(found) {
            let (wanted, found) = (wanted.describe(), found.describe());
            self.error(
                "plan::type",
                format!("expected {wanted}, found {found}"),
                expression.span,
            );
        }
        found
    }

    pub(super) fn check_sku(&mut self, id: &str, span: Span) {
        let Some(world) = self.world else { return };
        if world.sku(id).is_none() && world.design(id).is_none() {
            let message = format!("the library has no stock keeping unit or design {id}");
            self.error("plan::unknown_sku", message, span);
        }
    }

    fn declarations(&mut self) {
        let plan = self.plan;
        let mut seen: BTreeMap<String, String> = BTreeMap::new();
        let parameters = plan.parameters.iter().map(|p| (&p.name, &p.class, p.span));
        let variables = plan.variables.iter().map(|v| (&v.name, &v.class, v.span));
        for (name, class, span) in parameters.chain(variables) {
            if let Some(other) = seen.insert(name.to_lowercase(), name.clone()) {
                let message = format!("{name} and {other} are the same name");
                self.error("plan::duplicate_name", message, span);
            }
            if Type::from_name(class).is_none() {
                self.error("plan::unknown_type", format!("unknown type {class}"), span);
            }
        }
        let mut names = BTreeSet::new();
        for requirement in &plan.requirements {
            if !names.insert(&requirement.name) {
                let message = format!("two requirements are called {}", requirement.name);
                self.error("plan::duplicate_name", message, requirement.span);
            }
            match requirement.class.parse::<Class>() {
                Ok(class) => {
                    for condition in &requirement.conditions {
                        self.expect(condition, Type::Truth, Some(class));
                    }
                }
                Err(message) => self.error("plan::unknown_type", message, requirement.span),
            }
        }
        for variable in &plan.variables {
            self.variable(variable);
        }
    }

    fn variable(&mut self, variable: &super::ast::Variable) {
        let kind = Type::from_name(&variable.class).unwrap_or(Type::Unknown);
        if let Some(initial) = &variable.initial {
            // A number may be in quotes, by the type of its variable.
            let quoted = matches!((&initial.term, kind),
                (Term::Text(text), Type::Number { .. }) if text.parse::<f64>().is_ok());
            if !quoted {
                self.expect(initial, kind, None);
            }
        }
        if let Some(sku) = &variable.sku {
            self.check_sku(sku, variable.span);
        }
        let Some(name) = &variable.requirement else {
            return;
        };
        let Some(requirement) = self.plan.requirements.iter().find(|r| r.name == *name) else {
            let message = format!("no requirement is called {name}");
            return self.error("plan::unknown_name", message, variable.span);
        };
        if requirement.class != variable.class {
            let message = format!(
                "{} is a {}, its requirement a {}",
                variable.name, variable.class, requirement.class
            );
            self.error("plan::type", message, variable.span);
        }
    }

    /// Start is first and only there, Stop is last.
    fn frame(&mut self) {
        let todo = &self.plan.todo;
        if let Some(first) = todo.first()
            && first.action != (Action::Start {})
        {
            self.error("plan::start", "a plan begins with Start".into(), first.span);
        }
        if let Some(last) = todo.last()
            && last.action != (Action::Stop {})
        {
            self.error("plan::stop", "a plan ends with Stop".into(), last.span);
        }
        let starts = self
            .plan
            .statements()
            .into_iter()
            .filter(|s| s.action == (Action::Start {}));
        let late: Vec<Span> = starts.skip(1).map(|s| s.span).collect();
        for span in late {
            self.error("plan::start", "a plan starts only once".into(), span);
        }
    }

    fn list(&mut self, list: &[Statement]) {
        let mut chain = false;
        for statement in list {
            let action = &statement.action;
            let follows = matches!(action, Action::ElseIf { .. } | Action::Else { .. });
            if follows && !chain {
                let message = format!("{} without an If right before it", action.name());
                self.error("plan::else", message, statement.span);
            }
            chain = matches!(action, Action::If { .. } | Action::ElseIf { .. });
            self.statement(statement);
        }
    }

    fn body(&mut self, list: &[Statement], span: Span, any_order: bool) {
        if list.is_empty() {
            self.error("plan::empty", "the list is empty".into(), span);
        }
        self.list(list);
        if !any_order {
            return;
        }
        for (first, second, variable) in conflicts(list, self.scope) {
            let message = format!(
                "steps {} and {} share {variable} and keep their order",
                first + 1,
                second + 1
            );
            let help = "give each its own variable to let the executor choose";
            self.note("plan::any_order", message, help, span);
        }
    }

    fn statement(&mut self, statement: &Statement) {
        let span = statement.span;
        match &statement.action {
            Action::DoInGivenOrder(list) | Action::DoOne(list) => self.body(list, span, false),
            Action::DoInAnyOrder(list) => self.body(list, span, true),
            Action::DoInPreconditionOrder(triples) => self.triples(triples, span),
            Action::If { test, then } | Action::ElseIf { test, then } => {
                self.expect(test, Type::Truth, None);
                self.nested(then);
            }
            Action::Else { then } => self.nested(then),
            Action::LoopInGivenOrderWhile { test, body } => {
                self.expect(test, Type::Truth, None);
                self.body(body, span, false);
            }
            Action::LoopInAnyOrderWhile { test, body } => {
                self.expect(test, Type::Truth, None);
                self.body(body, span, true);
            }
            _ => self.simple(&statement.action, span),
        }
    }

    fn nested(&mut self, statement: &Statement) {
        self.list(std::slice::from_ref(statement));
    }

    fn simple(&mut self, action: &Action, span: Span) {
        let object = Type::Object(Class::SolidObject);
        match action {
            Action::Bind {
                variable, location, ..
            } => self.bind(variable, *location),
            Action::Set { target, value } => self.set(target, value),
            Action::SetPose {
                variable,
                reference,
                pose,
            } => {
                self.target(variable, Some(Type::Pose));
                self.expect(reference, object, None);
                self.expect(pose, Type::Pose, None);
                self.lint_box(pose);
            }
            Action::CreateInstance {
                variable,
                object: part,
                property,
            } => {
                self.create(variable, part, property, span);
            }
            Action::DestroyInstance { variable }
            | Action::FactotumRemove { variable }
            | Action::FactotumReplace { variable } => self.target(variable, Some(object)),
            Action::FactotumRefill { variable } => {
                self.target(variable, Some(object));
                let name = self.scope.declared(&variable.text);
                let declared = self
                    .plan
                    .variables
                    .iter()
                    .find(|v| Some(v.name.as_str()) == name);
                if declared.is_some_and(|v| v.requirement.is_none()) {
                    let message = format!("{} has no requirement to refill", variable.text);
                    self.error("plan::requirement", message, variable.span);
                }
            }
            Action::RobotChangeEndEffector { effector } => {
                match &effector.term {
                    Term::Text(id) => self.check_effector(id, effector.span),
                    _ => self.expect(effector, Type::Object(Class::EndEffector), None),
                };
            }
            Action::RobotMoveAbove { pose } => self.expect(pose, Type::Pose, None),
            Action::RobotPickUp { object: what } => self.expect(what, object, None),
            Action::RobotPutDown { object: what, pose } => {
                self.expect(what, object, None);
                self.expect(pose, Type::Pose, None);
            }
            _ => {}
        }
    }

    fn check_effector(&mut self, id: &str, span: Span) {
        let Some(world) = self.world else { return };
        if !world
            .named(id)
            .is_some_and(|object| object.class.is_a(Class::EndEffector))
        {
            self.error(
                "plan::world",
                format!("the world has no end effector {id}"),
                span,
            );
        }
    }

    /// A variable that is assigned.
    fn target(&mut self, variable: &Name, wanted: Option<Type>) {
        let Some((role, kind)) = self.known(&variable.text, variable.span) else {
            return self.unknown_name(&variable.text, variable.span);
        };
        if role == Role::Parameter {
            let message = format!("{} is a parameter and cannot be changed", variable.text);
            self.error("plan::parameter", message, variable.span);
        }
        if let Some(wanted) = wanted
            && !wanted.accepts(kind)
        {
            let message = format!("expected {}, found {}", wanted.describe(), kind.describe());
            self.error("plan::type", message, variable.span);
        }
    }

    fn bind(&mut self, variable: &Name, location: Keyword) {
        self.target(variable, Some(Type::Object(Class::SolidObject)));
        let name = self
            .scope
            .declared(&variable.text)
            .unwrap_or_default()
            .to_owned();
        let declared = self.plan.variables.iter().find(|v| v.name == name);
        let Some(declared) = declared else { return };
        let requirement = declared.requirement.as_ref();
        let requirement =
            requirement.and_then(|name| self.plan.requirements.iter().find(|r| r.name == *name));
        let Some(requirement) = requirement else {
            let message = format!("{name} has no requirement to look for");
            return self.error("plan::requirement", message, variable.span);
        };
        if requirement.location == Some(Keyword::Table) && location == Keyword::Workstation {
            let message = format!("{} must be on the table", requirement.name);
            self.warning("plan::location", message, variable.span);
        }
        if requirement.location == Some(Keyword::Workstation) && location == Keyword::Table {
            let message = format!("{} may be elsewhere than on the table", requirement.name);
            self.warning("plan::location", message, variable.span);
        }
    }

    fn set(&mut self, target: &Expression, value: &Expression) {
        let found = self.infer(value, None);
        let wanted = match &target.term {
            Term::Name(name) => {
                let name = Name {
                    text: name.clone(),
                    span: target.span,
                };
                self.target(&name, None);
                self.scope
                    .lookup(&name.text)
                    .map_or(Type::Unknown, |(_, kind)| kind)
            }
            Term::Property(..) => self.infer(target, None),
            _ => {
                let message = "expected a variable or a property".to_owned();
                return self.error("plan::type", message, target.span);
            }
        };
        if !wanted.accepts(found) {
            let message = format!("expected {}, found {}", wanted.describe(), found.describe());
            self.error("plan::type", message, value.span);
        }
    }

    fn create(&mut self, variable: &Name, part: &Expression, property: &str, span: Span) {
        self.target(variable, Some(Type::Object(Class::SolidObject)));
        let Some((_, Type::Object(class))) = self.scope.lookup(&variable.text) else {
            return;
        };
        match crate::world::class::derived_property(class, property) {
            Some((component, _)) => self.expect(part, Type::Object(component), None),
            None => {
                let message = format!("a {class} has no component {property}");
                self.error("plan::property", message, span);
            }
        }
    }

    /// The place of a box is its bottom, also when there is something in it.
    fn lint_box(&mut self, pose: &Expression) {
        let Term::Property(object, property) = &pose.term else {
            return;
        };
        if property != "hasSolidObject_PhysicalLocation" {
            return;
        }
        let Term::Name(name) = &object.term else {
            return;
        };
        if self.scope.lookup(name).map(|(_, kind)| kind)
            == Some(Type::Object(Class::LargeContainer))
        {
            let message = format!("the pose of {name} ignores what is in it");
            let help = "GetFreePose(container, object) is the lowest free place";
            self.note("plan::box_pose", message, help, pose.span);
        }
    }

    /// Checks that indexes are unique, predecessors exist, and no step waits for itself.
    fn triples(&mut self, triples: &[Triple], span: Span) {
        if triples.is_empty() {
            self.error("plan::empty", "the list is empty".into(), span);
        }
        let mut known = BTreeSet::new();
        for triple in triples {
            if !known.insert(triple.index) {
                let message = format!("the index {} is used twice", triple.index);
                self.error("plan::precondition", message, triple.statement.span);
            }
            if matches!(
                triple.statement.action,
                Action::ElseIf { .. } | Action::Else { .. }
            ) {
                let message = "an entry cannot be an ElseIf or Else".to_owned();
                self.error("plan::else", message, triple.statement.span);
            } else {
                self.statement(&triple.statement);
            }
        }
        for triple in triples {
            for before in triple
                .before
                .iter()
                .filter(|before| !known.contains(before))
            {
                let message = format!("there is no entry {before}");
                self.error("plan::precondition", message, triple.statement.span);
            }
        }
        let mut done = BTreeSet::new();
        loop {
            let ready = |t: &&Triple| {
                !done.contains(&t.index)
                    && t.before
                        .iter()
                        .all(|b| done.contains(b) || !known.contains(b))
            };
            let next: Vec<u32> = triples.iter().filter(ready).map(|t| t.index).collect();
            if next.is_empty() {
                break;
            }
            done.extend(next);
        }
        if let Some(stuck) = triples.iter().find(|t| !done.contains(&t.index)) {
            let message = format!("entry {} waits for itself", stuck.index);
            self.error("plan::precondition", message, stuck.statement.span);
        }
    }

    /// What must be in the workstation is in it.
    fn against_world(&mut self) {
        let (Some(world), plan) = (self.world, self.plan) else {
            return;
        };
        let about = |name: &str| plan.about.iter().find(|field| field.name == name);
        if let (Some(field), Ok(workstation)) = (about("PlanWorkstation"), world.workstation())
            && field.value != workstation.name
        {
            let message = format!("the world is {}, not {}", workstation.name, field.value);
            self.error("plan::world", message, field.span);
        }
        if let Some(field) = about("TargetSKU")
            && world.design(&field.value).is_none()
        {
            let message = format!("the world has no kit design {}", field.value);
            self.error("plan::world", message, field.span);
        }
        for requirement in &plan.requirements {
            let place = requirement.location.unwrap_or(Keyword::Workstation);
            let skus = requirement.sku.iter().chain(&requirement.contents_type);
            skus.for_each(|sku| self.check_sku(sku, requirement.span));
            if !world
                .objects()
                .any(|object| matches(world, plan, requirement, object, place))
            {
                let message = format!("the world has nothing that meets {}", requirement.name);
                self.error("plan::world", message, requirement.span);
            }
        }
    }
}
