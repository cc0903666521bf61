//! Programs in JSON: the document and its commands.

use serde_json::value::RawValue;

use super::SCHEMA;
use super::reader::{Reader, describe};
use crate::argument::{Argument, Value};
use crate::code;
use crate::command::Command;
use crate::command_finding::{refused_extension, unknown_command};
use crate::command_info::CommandInfo;
use crate::finding::Finding;
use crate::lexer::clip;
use crate::program::{Located, Program};
use crate::source::Walker;

impl<'a> Reader<'a, '_> {
    pub(super) fn document(&mut self, document: &'a RawValue, program: &mut Program) {
        let Some(fields) = self.fields("a program", document) else {
            return;
        };
        self.known("a program", &fields, &["$schema", "schema", "commands"]);
        if let Some(version) = self.wanted("a program", document, &fields, "schema") {
            self.version(version);
        }
        let Some(commands) = self.wanted("a program", document, &fields, "commands") else {
            return;
        };
        let Some(commands) = self.items("the commands", commands) else {
            return;
        };
        let mut walker = Walker::new(self.source);
        for raw in commands {
            if let Some(command) = self.command(raw) {
                let span = self.span(raw);
                let (line, column) = walker.position(span.start);
                program.commands.push(Located {
                    command,
                    span,
                    line,
                    column,
                });
            }
        }
    }

    fn version(&mut self, version: &RawValue) {
        if version.get() != SCHEMA.to_string() {
            let message = format!("this is schema {}, not {SCHEMA}", clip(version.get()));
            let finding = Finding::error(code::SCHEMA_VERSION, self.span(version), message);
            let found = describe(version);
            self.findings
                .push(finding.expected(format!("`{SCHEMA}`")).found(found));
        }
    }

    fn command(&mut self, raw: &'a RawValue) -> Option<Command> {
        let fields = self.fields("a command", raw)?;
        let name = self.wanted("a command", raw, &fields, "command")?;
        let text = self.text("the name of a command", name)?;
        let Some(info) = CommandInfo::find(&text) else {
            self.findings.push(unknown_command(&text, self.span(name)));
            return None;
        };
        let refused = refused_extension(info, self.span(name)).filter(|_| self.strict);
        let argument = info.argument.map_or("command", |argument| argument.name);
        let known = self.known(info.name, &fields, &["command", argument]) && refused.is_none();
        self.findings.extend(refused);
        let value = match info.argument {
            None => Some(Value::None),
            Some(Argument { name, kind }) => {
                let value = self.wanted(info.name, raw, &fields, name)?;
                self.value(kind, value)
            }
        }?;
        info.build(value).filter(|_| known)
    }
}
